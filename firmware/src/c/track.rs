//! A track.
#![allow(unsafe_code)]

use super::estimate::BnkfEstimate;
use super::likelihood::BnkfLikelihood;
use super::measurement::BnkfMeasurement;
use super::place::{BnkfModel, BnkfTrack, BnkfWorkspace, made, made_mut, make};
use super::pointer::{Room, check, read, slice};
use super::settings::BnkfSettings;
use super::status::{BnkfStatus, said};
use crate::estimate::Estimate;
use crate::measurement::Measurement;
use crate::model::Model;
use crate::settings::Settings;
use crate::step_error::StepError;
use crate::track::{TRACK_SNAPSHOT_BYTES, Track};
use crate::workspace::Workspace;

/// Makes a track that has seen nothing yet.
///
/// # Safety
/// `track` is room for a track that nobody else uses; `model` is room for a model; `settings` are settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_init(
    track: *mut BnkfTrack,
    model: *const BnkfModel,
    settings: *const BnkfSettings,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        made(model).and_then(|model| {
            let settings = Settings::try_from(read(settings)?)?;
            settings.check(model.blob()).map_err(BnkfStatus::from)?;
            make(track, const { Track::idle() })?;
            made_mut(track)?
                .begin(model, settings)
                .map_err(BnkfStatus::from)
        })
    })
}

/// The estimate at the time of a measurement. Refused, the measurement is ignored and the track as before.
///
/// # Safety
/// `track`, `model` and `workspace` are places of their kind, the first and the last used by nobody else;
/// `measurement` is a measurement; `estimate` is room for an estimate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_step(
    track: *mut BnkfTrack,
    model: *const BnkfModel,
    workspace: *mut BnkfWorkspace,
    measurement: *const BnkfMeasurement,
    estimate: *mut BnkfEstimate,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        let measurement = read(measurement).and_then(Measurement::try_from);
        measurement.and_then(|measurement| {
            estimated(
                Asked::new(track, model, workspace)?,
                Room::new(estimate)?,
                |on| on.track.step(on.model, on.workspace, &measurement),
            )
        })
    })
}

/// The estimate at a time without a measurement, at most 60 s ahead; the covariance grows. `BNKF_STATUS_LOST`: the
/// target was forgotten, and the next measurement starts anew.
///
/// # Safety
/// As of `bnkf_track_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_coast(
    track: *mut BnkfTrack,
    model: *const BnkfModel,
    workspace: *mut BnkfWorkspace,
    time_us: u64,
    estimate: *mut BnkfEstimate,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        Asked::new(track, model, workspace).and_then(|on| {
            estimated(on, Room::new(estimate)?, |on| {
                on.track.coast(on.model, on.workspace, time_us)
            })
        })
    })
}

/// Where the target will be at `count` times, which lie in order; the track stays as it is. Refused, some of
/// the forecasts may have been written. `BNKF_STATUS_LOST`: one of them would be unsure by more than 100 km.
///
/// # Safety
/// As of `bnkf_track_step`; `times_us` points to `count` times and `forecasts` to room for as many estimates.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_forecasts(
    track: *mut BnkfTrack,
    model: *const BnkfModel,
    workspace: *mut BnkfWorkspace,
    times_us: *const u64,
    count: usize,
    forecasts: *mut BnkfEstimate,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        Asked::new(track, model, workspace).and_then(|on| {
            if count > 0 {
                check(forecasts)?;
            }
            let times_us = slice(times_us, count)?;
            // Each is smaller than the room for its estimate, which is an object too.
            on.track
                .forecast_each(on.model, on.workspace, times_us, |place, estimate| {
                    forecasts
                        .wrapping_add(place)
                        .write(BnkfEstimate::from(estimate));
                })
                .map_err(BnkfStatus::from)
        })
    })
}

/// How well a measurement fits the track, which stays as it is.
///
/// # Safety
/// As of `bnkf_track_step`; `likelihood` is room for a likelihood.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_likelihood(
    track: *mut BnkfTrack,
    model: *const BnkfModel,
    workspace: *mut BnkfWorkspace,
    measurement: *const BnkfMeasurement,
    likelihood: *mut BnkfLikelihood,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        let measurement = read(measurement).and_then(Measurement::try_from);
        measurement.and_then(|measurement| {
            let (on, room) = (Asked::new(track, model, workspace)?, Room::new(likelihood)?);
            let fit = on.track.likelihood(on.model, on.workspace, &measurement)?;
            room.put(BnkfLikelihood::from(&fit));
            Ok(())
        })
    })
}

/// Time of the latest measurement or coast, microseconds; `BNKF_STATUS_NOT_STARTED` before the first.
///
/// # Safety
/// `track` is room for a track, and `time_us` for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_latest_us(
    track: *const BnkfTrack,
    time_us: *mut u64,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        Room::new(time_us).and_then(|room| {
            let latest_us = made(track)?.latest_us();
            room.put(latest_us.ok_or(BnkfStatus::NotStarted)?);
            Ok(())
        })
    })
}

/// Forgets the target and all times, and starts the random stream again.
///
/// # Safety
/// `track` is room for a track that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_reset(track: *mut BnkfTrack) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe { made_mut(track) }.map(Track::reset))
}

/// Writes all that is known of the target as `BNKF_TRACK_SNAPSHOT_BYTES` bytes, the same on every computer.
///
/// # Safety
/// `track` is room for a track, and `bytes` for so many bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_to_bytes(
    track: *const BnkfTrack,
    bytes: *mut u8,
) -> BnkfStatus {
    // SAFETY: by contract; any bytes are bytes.
    said(unsafe {
        check(bytes).and_then(|()| {
            made(track)?.to_bytes(&mut *bytes.cast::<[u8; TRACK_SNAPSHOT_BYTES]>());
            Ok(())
        })
    })
}

/// Makes the track that was written as `BNKF_TRACK_SNAPSHOT_BYTES` bytes; refused, the place is as before. Any
/// bytes may be given.
///
/// # Safety
/// `track` is room for a track that nobody else uses, and `bytes` points to so many bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_from_bytes(
    track: *mut BnkfTrack,
    bytes: *const u8,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        check(bytes).and_then(|()| {
            let read = Track::from_bytes(&*bytes.cast::<[u8; TRACK_SNAPSHOT_BYTES]>());
            make(track, read.map_err(BnkfStatus::from)?)
        })
    })
}

/// Lets another model of its kind go on with the track.
///
/// # Safety
/// `track` is room for a track that nobody else uses; `model` is room for a model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_track_hand_over(
    track: *mut BnkfTrack,
    model: *const BnkfModel,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        made_mut(track).and_then(|track| track.hand_over(made(model)?).map_err(BnkfStatus::from))
    })
}

/// A track and what it works with.
struct Asked<'c> {
    track: &'c mut Track,
    model: &'c Model<'static>,
    workspace: &'c mut Workspace,
}

impl Asked<'_> {
    /// # Safety
    /// As of [`bnkf_track_step`].
    unsafe fn new(
        track: *mut BnkfTrack,
        model: *const BnkfModel,
        workspace: *mut BnkfWorkspace,
    ) -> Result<Self, BnkfStatus> {
        // SAFETY: by contract; marks keep one place from being given as two kinds.
        unsafe {
            Ok(Self {
                track: made_mut(track)?,
                model: made(model)?,
                workspace: made_mut(workspace)?,
            })
        }
    }
}

/// An estimate, written where C wants it.
fn estimated(
    on: Asked<'_>,
    room: Room<BnkfEstimate>,
    ask: impl FnOnce(Asked<'_>) -> Result<Estimate, StepError>,
) -> Result<(), BnkfStatus> {
    room.put(BnkfEstimate::from(&ask(on)?));
    Ok(())
}
