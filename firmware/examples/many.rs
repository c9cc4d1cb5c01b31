//! Several targets on one model and one workspace: every plot goes to the track that it fits best, or begins one.

use std::error::Error;

use bnkf::{Estimate, Measurement, Model, Sensed, Sensor, Settings, StepError, Track, Workspace};

static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");

/// Targets that are looked for at most.
const TRACKS: usize = 4;
/// A normalised innovation squared that one in twenty thousand of a track's own plots passes (chi-square of four
/// numbers). The gate of a step is no help here: it knows that readings may be wrong, and such fit every track.
const NIS_MAX: f32 = 25.0;

/// What does not change while targets come and go.
struct Picture<'a> {
    model: Model<'a>,
    workspace: Workspace,
    /// A place is free while its track has seen nothing.
    tracks: [Track; TRACKS],
}

impl<'a> Picture<'a> {
    fn new(model: Model<'a>) -> Result<Self, Box<dyn Error>> {
        let track = Track::new(&model, Settings::of(model.blob()))?;
        Ok(Self {
            model,
            workspace: Workspace::new(),
            tracks: std::array::from_fn(|_| track.clone()),
        })
    }

    /// The place of the track that expects the plot most, of those that it can be of; else a free one.
    fn place_of(&mut self, plot: &Measurement) -> Option<usize> {
        let mut best = None;
        for (place, track) in self.tracks.iter_mut().enumerate() {
            match track.likelihood(&self.model, &mut self.workspace, plot) {
                Ok(fit) if fit.nis < NIS_MAX => {
                    let score = fit.ln_likelihood;
                    if best.is_none_or(|(_, best)| score > best) {
                        best = Some((place, score));
                    }
                }
                // Not its own, or it has seen nothing, or it says why it cannot be asked.
                Ok(_) | Err(StepError::NotStarted) => {}
                Err(error) => println!("track {place}: {error}"),
            }
        }
        let free = || self.tracks.iter().position(|t| t.latest_us().is_none());
        best.map(|(place, _)| place).or_else(free)
    }

    fn take(&mut self, plot: &Measurement) -> Option<(usize, Result<Estimate, StepError>)> {
        let place = self.place_of(plot)?;
        let track = self.tracks.get_mut(place)?;
        Some((place, track.step(&self.model, &mut self.workspace, plot)))
    }
}

/// Plots of one scan, in no order that says whose they are: one target to the east goes north, one in the
/// north goes west, and both are 35 m away.
fn scan(tenth: u64) -> [Measurement; 2] {
    let t = 0.1 * tenth as f32;
    let plot = |range, azimuth, range_rate| {
        let sensed = |value, sigma| Some(Sensed { value, sigma });
        Measurement {
            time_us: 100_000 * tenth,
            range: sensed(range, 0.5),
            elevation: sensed(0.2, 0.01),
            azimuth: sensed(azimuth, 0.01),
            range_rate: sensed(range_rate, 0.1),
            sensor: Sensor::ORIGIN,
        }
    };
    let (east, north) = (
        plot(35.0 + 0.5 * t, 0.1 * t, 0.5),
        plot(35.0 - 0.5 * t, 1.5 + 0.1 * t, -0.5),
    );
    if tenth.is_multiple_of(2) {
        [east, north]
    } else {
        [north, east]
    }
}

/// The place of every target's plot, scan by scan.
fn associate() -> Result<Vec<[usize; 2]>, Box<dyn Error>> {
    let mut picture = Picture::new(Model::new(BLOB)?)?;
    let mut scans = Vec::new();
    for tenth in 0..30 {
        let mut places = [TRACKS; 2];
        for (plot, place) in scan(tenth).iter().zip(&mut places) {
            if let Some((found, estimate)) = picture.take(plot) {
                estimate?;
                *place = found;
            }
        }
        scans.push(places);
    }
    Ok(scans)
}

fn main() -> Result<(), Box<dyn Error>> {
    for (tenth, places) in associate()?.iter().enumerate() {
        println!("scan {tenth}: plots go to tracks {places:?}");
    }
    Ok(())
}

#[test]
fn every_plot_goes_to_its_own_track() {
    let scans = associate().expect("every call is answered");
    for (tenth, places) in scans.into_iter().enumerate() {
        let expected = if tenth % 2 == 0 { [0, 1] } else { [1, 0] };
        assert_eq!(places, expected, "scan {tenth}");
    }
}
