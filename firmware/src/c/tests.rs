//! What C may get wrong is refused; that the answers are right, `tests/from_c.rs` shows with a C program.
#![allow(unsafe_code)]

use core::mem::zeroed;
use core::ptr::{null, null_mut};

use super::*;
use crate::blob::draft::Draft;
use crate::track::TRACK_SNAPSHOT_BYTES;

fn plot(time_us: u64) -> BnkfMeasurement {
    BnkfMeasurement {
        time_us,
        azimuth: BnkfSensed {
            value: 0.5,
            sigma: 0.01,
        },
        range: BnkfSensed {
            value: 33.0,
            sigma: 0.5,
        },
        channels: BNKF_AZIMUTH | BNKF_RANGE,
        ..BnkfMeasurement::default()
    }
}

/// Everything that a track's life takes.
struct Life {
    model: BnkfModel,
    workspace: BnkfWorkspace,
    track: BnkfTrack,
    settings: BnkfSettings,
    estimate: BnkfEstimate,
}

impl Life {
    /// Nothing was made yet.
    fn blank() -> Self {
        // SAFETY: zeros are numbers, and the first code of every enum.
        unsafe { zeroed() }
    }

    fn begun() -> Self {
        let mut life = Self::blank();
        let blob = Draft::recursive(3).bytes().leak();
        // SAFETY: all is as the functions ask.
        unsafe {
            let status = bnkf_model_init(&mut life.model, blob.as_ptr(), blob.len());
            assert_eq!(status, BnkfStatus::Ok);
            assert_eq!(bnkf_workspace_init(&mut life.workspace), BnkfStatus::Ok);
            let status = bnkf_model_settings(&life.model, &mut life.settings);
            assert_eq!(status, BnkfStatus::Ok);
            let status = bnkf_track_init(&mut life.track, &life.model, &life.settings);
            assert_eq!(status, BnkfStatus::Ok);
        }
        life
    }

    fn step(&mut self, plot: *const BnkfMeasurement) -> BnkfStatus {
        let (track, workspace) = (&mut self.track, &mut self.workspace);
        // SAFETY: `plot` is refused, or points to a measurement.
        unsafe { bnkf_track_step(track, &self.model, workspace, plot, &mut self.estimate) }
    }
}

#[test]
fn a_life_from_c() {
    let mut life = Life::begun();
    let mut latest_us = 0;
    // SAFETY: all is as the functions ask.
    unsafe {
        let status = bnkf_track_latest_us(&life.track, &mut latest_us);
        assert_eq!(status, BnkfStatus::NotStarted);
        assert_eq!(life.step(&plot(1_000_000)), BnkfStatus::Ok);
        assert_eq!(life.estimate.mode, BnkfMode::Started);
        assert!(life.estimate.has_motion && life.estimate.time_us == 1_000_000);
        assert_eq!(life.step(&plot(1_000_000)), BnkfStatus::Repeated);

        let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
        let status = bnkf_track_to_bytes(&life.track, bytes.as_mut_ptr());
        assert_eq!(status, BnkfStatus::Ok);
        assert_eq!(bnkf_track_reset(&mut life.track), BnkfStatus::Ok);
        let status = bnkf_track_latest_us(&life.track, &mut latest_us);
        assert_eq!(status, BnkfStatus::NotStarted);
        let status = bnkf_track_from_bytes(&mut life.track, bytes.as_ptr());
        assert_eq!(status, BnkfStatus::Ok);
        let status = bnkf_track_latest_us(&life.track, &mut latest_us);
        assert_eq!((status, latest_us), (BnkfStatus::Ok, 1_000_000));
        bytes[9] ^= 1;
        let status = bnkf_track_from_bytes(&mut life.track, bytes.as_ptr());
        assert_eq!(status, BnkfStatus::BytesWrongChecksum);
        let status = bnkf_track_hand_over(&mut life.track, &life.model);
        assert_eq!(status, BnkfStatus::Ok);

        let mut checksum = 0;
        let status = bnkf_model_checksum(&life.model, &mut checksum);
        assert!(status == BnkfStatus::Ok && checksum != 0);
    }
}

#[test]
fn null_and_misaligned_pointers_are_refused() {
    let mut life = Life::begun();
    let mut words = [0_u64; 400];
    // Odd addresses inside an object.
    let odd = words.as_mut_ptr().wrapping_byte_add(1);
    assert_eq!(life.step(null()), BnkfStatus::NullPointer);
    assert_eq!(life.step(odd.cast()), BnkfStatus::MisalignedPointer);
    for (wrong, expected) in [
        (null_mut(), BnkfStatus::NullPointer),
        (odd, BnkfStatus::MisalignedPointer),
    ] {
        let (model, workspace) = (wrong.cast(), wrong.cast());
        let (track, estimate) = (wrong.cast(), wrong.cast());
        let plot = plot(1_000_000);
        // SAFETY: pointers are valid or refused.
        let said = unsafe {
            [
                bnkf_model_init(model, [0].as_ptr(), 0),
                bnkf_model_checksum(model, &mut 0),
                bnkf_model_checksum(&life.model, wrong.cast()),
                bnkf_model_settings(&life.model, wrong.cast()),
                bnkf_workspace_init(workspace),
                bnkf_track_init(track, &life.model, &life.settings),
                bnkf_track_init(&mut life.track, model, &life.settings),
                bnkf_track_init(&mut life.track, &life.model, wrong.cast::<BnkfSettings>()),
                bnkf_track_step(
                    track,
                    &life.model,
                    &mut life.workspace,
                    &plot,
                    &mut life.estimate,
                ),
                bnkf_track_step(
                    &mut life.track,
                    model,
                    &mut life.workspace,
                    &plot,
                    &mut life.estimate,
                ),
                bnkf_track_coast(
                    &mut life.track,
                    &life.model,
                    workspace,
                    1,
                    &mut life.estimate,
                ),
                bnkf_track_coast(
                    &mut life.track,
                    &life.model,
                    &mut life.workspace,
                    1,
                    estimate,
                ),
                bnkf_track_forecasts(
                    &mut life.track,
                    &life.model,
                    &mut life.workspace,
                    wrong,
                    1,
                    &mut life.estimate,
                ),
                bnkf_track_likelihood(
                    &mut life.track,
                    &life.model,
                    &mut life.workspace,
                    &plot,
                    wrong.cast::<BnkfLikelihood>(),
                ),
                bnkf_track_latest_us(&life.track, wrong),
                bnkf_track_reset(track),
                bnkf_track_hand_over(&mut life.track, model),
                bnkf_mounting_direction(0.0, 0.0, 0.0, plot.azimuth, plot.azimuth, wrong.cast()),
            ]
        };
        for (place, status) in said.into_iter().enumerate() {
            // An empty blob is refused before its place is looked at.
            let expected = if place == 0 {
                BnkfStatus::BlobTruncated
            } else {
                expected
            };
            assert_eq!(status, expected, "call {place}");
        }
    }
    // SAFETY: refused.
    unsafe {
        let status = bnkf_track_to_bytes(&life.track, null_mut());
        assert_eq!(status, BnkfStatus::NullPointer);
        let status = bnkf_track_from_bytes(&mut life.track, null());
        assert_eq!(status, BnkfStatus::NullPointer);
        let status = bnkf_model_init(&mut life.model, null(), 1);
        assert_eq!(status, BnkfStatus::NullPointer);
        let status = bnkf_model_init(&mut life.model, [0].as_ptr(), usize::MAX);
        assert_eq!(status, BnkfStatus::Length);
    }
    let fine = plot(1).azimuth;
    let endless = BnkfSensed {
        sigma: f32::INFINITY,
        ..fine
    };
    for (angle, elevation, azimuth, expected) in [
        (f32::NAN, fine, fine, BnkfStatus::SensorNotFinite),
        (0.0, endless, fine, BnkfStatus::ElevationNotFinite),
        (0.0, fine, endless, BnkfStatus::AzimuthNotFinite),
        (
            0.0,
            BnkfSensed {
                sigma: -0.01,
                ..fine
            },
            fine,
            BnkfStatus::ElevationSigma,
        ),
        (
            0.0,
            fine,
            BnkfSensed { sigma: 5.0, ..fine },
            BnkfStatus::AzimuthSigma,
        ),
        (
            0.0,
            BnkfSensed { value: 4.0, ..fine },
            fine,
            BnkfStatus::ElevationOutOfRange,
        ),
    ] {
        // SAFETY: refused.
        let status =
            unsafe { bnkf_mounting_direction(0.0, angle, 0.0, elevation, azimuth, null_mut()) };
        assert_eq!(status, expected);
    }
    // No call that was refused has touched the track.
    assert_eq!(life.step(&plot(1_000_000)), BnkfStatus::Ok);
    // Nothing asked for needs no room.
    // SAFETY: no time and no estimate are touched.
    let status = unsafe {
        let none = (null(), null_mut());
        bnkf_track_forecasts(
            &mut life.track,
            &life.model,
            &mut life.workspace,
            none.0,
            0,
            none.1,
        )
    };
    assert_eq!(status, BnkfStatus::Ok);
}

#[test]
fn a_place_that_holds_nothing_or_something_else_is_refused() {
    let mut life = Life::begun();
    let blank = Life::blank();
    let mut other = [0_u64; BNKF_WORKSPACE_WORDS];
    other[0] = life.workspace.words[0];
    // SAFETY: every place is large enough to be read as the other.
    unsafe {
        let status = bnkf_track_init(&mut life.track, &blank.model, &life.settings);
        assert_eq!(status, BnkfStatus::NotInitialised);
        let status = bnkf_track_reset(other.as_mut_ptr().cast());
        assert_eq!(status, BnkfStatus::NotInitialised);
    }
    life.workspace = blank.workspace;
    assert_eq!(life.step(&plot(1)), BnkfStatus::NotInitialised);
}

#[test]
fn settings_that_do_not_fit_leave_the_track_as_it_was() {
    let mut life = Life::begun();
    assert_eq!(life.step(&plot(1_000_000)), BnkfStatus::Ok);
    let settings = life.settings;
    for (settings, expected) in [
        (
            BnkfSettings {
                correction: BnkfCorrection::Converted as u8,
                ..settings
            },
            BnkfStatus::SettingsCorrection,
        ),
        (
            BnkfSettings {
                correction: 9,
                ..settings
            },
            BnkfStatus::UnknownCode,
        ),
    ] {
        // SAFETY: all is as the function asks.
        let status = unsafe { bnkf_track_init(&mut life.track, &life.model, &settings) };
        assert_eq!(status, expected);
    }
    assert_eq!(life.step(&plot(1_000_000)), BnkfStatus::Repeated);
}
