//! What steps and coasts are to do to a track, from the parts that they are made of.

use super::super::*;
use super::bench::{Outputs, near, parameters};
use crate::recursive::factor::Factor;
use crate::recursive::schedule::Schedule;

pub(super) fn assert_same(got: &Target, expected: &Target) {
    assert_eq!((got.time_us, got.used), (expected.time_us, expected.used));
    for i in 0..9 {
        let deviation = expected.covariance[i][i];
        assert!(near(got.state[i], expected.state[i], 10.0), "{i}");
        for j in 0..9 {
            let (got, expected) = (got.covariance[i][j], expected.covariance[i][j]);
            assert!(near(got, expected, deviation), "{i} {j}: {got} {expected}");
        }
    }
    let list = |track: &Target| {
        let m = &track.memory;
        let mut list = std::vec![m.coast_s, m.age_s];
        list.extend(m.innovation.iter().chain(&m.drift).chain(&m.squares));
        list.extend(m.ln_sigmas.iter().chain(&m.notes).chain(&m.counts));
        list.extend(m.velocity_means.as_flattened());
        list
    };
    for (i, (got, expected)) in list(got).into_iter().zip(list(expected)).enumerate() {
        assert!(near(got, expected, 10.0), "memory {i}: {got} {expected}");
    }
}

/// What a part of the way is predicted with.
#[derive(Clone, Copy)]
pub(super) struct Way {
    pub(super) schedule: Schedule<f32>,
    pub(super) factor: Option<Factor<f32>>,
    pub(super) notes: [f32; NOTES],
}

/// The way of a network with these outputs.
pub(super) fn asked(outputs: &Outputs) -> Way {
    Way {
        schedule: Schedule::read(outputs, &parameters().base),
        factor: Some(Factor::read(&outputs[17..27])),
        notes: core::array::from_fn(|i| outputs[27 + i]),
    }
}

/// The way that no network is asked for.
pub(super) fn unasked(schedule: Schedule<f32>) -> Way {
    Way {
        schedule,
        factor: None,
        notes: [0.0; NOTES],
    }
}

/// Moves a track by `parts` parts of `dt_s` each; all but the last are remembered.
pub(super) fn predicted(track: &mut Target, way: &Way, parts: usize, dt_s: f32) -> Interval<f32> {
    let p = parameters();
    let mut interval = None;
    for _ in 0..parts {
        if let Some(interval) = &interval {
            doubted(track, interval, way);
        }
        let sight = track.sight();
        track.go_on(&sight, &way.schedule, dt_s, p.bend);
        if let Some(factor) = &way.factor {
            track.fuse(factor, &p.population, dt_s);
        }
        interval = Some(Interval {
            sight,
            noise: way.schedule.noise,
            sensor_scale: way.schedule.sensor_scale,
            dt_s,
            coast_s: track.memory.coast_s,
        });
    }
    interval.expect("a part")
}

/// A part of the way that no measurement ends.
pub(super) fn doubted(track: &mut Target, interval: &Interval<f32>, way: &Way) {
    let hypotheses = parameters().hypotheses;
    let odds = hypotheses.odds(&track.memory.counts);
    track.doubt(interval, &hypotheses, &odds);
    assert!(track.settle());
    track.memory.missed();
    let velocity = track.velocity();
    track
        .memory
        .stepped(interval.dt_s, 0.0, velocity, &way.notes);
}

/// The correction under all hypotheses, and what is remembered of it.
pub(super) fn corrected(
    track: &mut Target,
    interval: &Interval<f32>,
    way: &Way,
    seen: &Measurement,
) -> f32 {
    let hypotheses = parameters().hypotheses;
    let odds = hypotheses.odds(&track.memory.counts);
    let vectors = Vectors::from(seen);
    let mut mixture = Mixture::before(&track.state, &track.covariance);
    let weighed = track.weighed(&vectors, interval, &hypotheses, &odds, &mut mixture);
    let whitened = weighed.expect("sound");
    track.memory.measured(whitened, &vectors);
    track.take(&mixture.corrected);
    track.memory.explained(mixture.shares);
    assert!(track.settle());
    let velocity = track.velocity();
    track
        .memory
        .stepped(interval.dt_s, 1.0, velocity, &way.notes);
    mixture.corrected.nis
}
