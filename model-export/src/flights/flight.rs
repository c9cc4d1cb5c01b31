//! A flight: where a drone was, and how fast, at increasing instants.
//!
//! Frame: x east, y north, z up, metres, radar at the origin. Nothing here panics, but for [`Flight::at`].

use crate::flights::track_error::check_track;
pub use crate::flights::track_error::{SAMPLES_MIN, SampleField, TrackError};
use serde::{Deserialize, Serialize};

/// Position and velocity of the drone at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Seconds since the first sample of the flight.
    pub time_s: f64,
    /// Position [x, y, z], metres.
    pub position_m: [f64; 3],
    /// Velocity [x, y, z], metres per second.
    pub velocity_mps: [f64; 3],
}

/// How fast the drone really was at one instant, and how fast that changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Magnitude of the velocity, metres per second.
    pub speed_mps: f64,
    /// Magnitude of the acceleration, m/s^2.
    pub acceleration_mps2: f64,
}

/// A recorded or generated flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Unique name; random streams are derived from it.
    pub name: String,
    /// The recording it was cut from (a file name, or the name of a generated flight). Segments of
    /// one source belong in the same fold.
    pub source: String,
    /// At least [`SAMPLES_MIN`], with increasing time.
    pub samples: Vec<Sample>,
}

impl Flight {
    /// A flight from `[time_s, x_m, y_m, z_m]` rows; the first time becomes zero.
    ///
    /// Velocity is the derivative of the parabola through a sample and its two neighbours (the
    /// central difference where sampling is even), one-sided at both ends.
    ///
    /// # Errors
    /// The first row that is not usable, or too few rows.
    pub fn from_track(name: &str, source: &str, rows: &[[f64; 4]]) -> Result<Self, TrackError> {
        check_track(rows)?;
        let start_s = rows[0][0];
        let place = |i: usize| (rows[i][0], [rows[i][1], rows[i][2], rows[i][3]]);
        let samples = (0..rows.len())
            .map(|i| Sample {
                time_s: rows[i][0] - start_s,
                position_m: place(i).1,
                velocity_mps: derivative(place, rows.len(), i),
            })
            .collect();
        Ok(Self {
            name: name.to_owned(),
            source: source.to_owned(),
            samples,
        })
    }

    /// The same flight with `rate_hz` samples a second, interpolated between its own.
    ///
    /// # Errors
    /// It is too short for three of them.
    pub fn resampled(&self, rate_hz: f64) -> Result<Self, TrackError> {
        let count = (self.duration_s() * rate_hz + 1e-9) as usize + 1;
        let row = |index: usize| {
            let time_s = index as f64 / rate_hz;
            let [x, y, z] = self.at(time_s).position_m;
            [time_s, x, y, z]
        };
        let rows: Vec<_> = (0..count).map(row).collect();
        Self::from_track(&self.name, &self.source, &rows)
    }

    /// Time from the first to the last sample, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.samples.first(), self.samples.last()) {
            (Some(first), Some(last)) => last.time_s - first.time_s,
            _ => 0.0,
        }
    }

    /// Median time between neighbouring samples, seconds; 0 for fewer than two samples.
    #[must_use]
    pub fn median_step_s(&self) -> f64 {
        let mut steps_s: Vec<f64> = self
            .samples
            .windows(2)
            .map(|pair| pair[1].time_s - pair[0].time_s)
            .collect();
        if steps_s.is_empty() {
            return 0.0;
        }
        let middle = steps_s.len() / 2;
        *steps_s.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// The true motion at every sample: the speed of its velocity, and the acceleration by the same
    /// differences of the neighbours' velocities that give [`Flight::from_track`] its velocity.
    #[must_use]
    pub fn motion(&self) -> Vec<Motion> {
        let velocity = |i: usize| (self.samples[i].time_s, self.samples[i].velocity_mps);
        let count = self.samples.len();
        (0..count)
            .map(|i| Motion {
                speed_mps: length(velocity(i).1),
                acceleration_mps2: length(derivative(velocity, count, i)),
            })
            .collect()
    }

    /// Position and velocity at `time_s` by the cubic through both neighbours' positions and
    /// velocities; held within the flight's ends.
    ///
    /// # Panics
    /// If the flight has fewer than two samples, which no reader or generator makes.
    pub fn at(&self, time_s: f64) -> Sample {
        let samples = &self.samples;
        let after = samples
            .partition_point(|sample| sample.time_s <= time_s)
            .clamp(1, samples.len() - 1);
        let (a, b) = (&samples[after - 1], &samples[after]);
        let dt = b.time_s - a.time_s;
        let t = ((time_s - a.time_s) / dt).clamp(0.0, 1.0);
        let (t2, t3) = (t * t, t * t * t);
        let mut out = *a;
        out.time_s = time_s;
        for axis in 0..3 {
            let (pa, pb) = (a.position_m[axis], b.position_m[axis]);
            let (va, vb) = (dt * a.velocity_mps[axis], dt * b.velocity_mps[axis]);
            out.position_m[axis] = (2.0 * t3 - 3.0 * t2 + 1.0) * pa
                + (t3 - 2.0 * t2 + t) * va
                + (3.0 * t2 - 2.0 * t3) * pb
                + (t3 - t2) * vb;
            out.velocity_mps[axis] = ((6.0 * t2 - 6.0 * t) * (pa - pb)
                + (3.0 * t2 - 4.0 * t + 1.0) * va
                + (3.0 * t2 - 2.0 * t) * vb)
                / dt;
        }
        out
    }

    /// The same flight seen by a radar at `radar_m` instead of the origin (axes stay parallel).
    #[must_use]
    pub fn seen_from(&self, radar_m: [f64; 3]) -> Self {
        let mut moved = self.clone();
        for sample in &mut moved.samples {
            for axis in 0..3 {
                sample.position_m[axis] -= radar_m[axis];
            }
        }
        moved
    }
}

/// Derivative at instant `i` of the `count` instants that `at` gives with their values, per second;
/// zero of a single one.
fn derivative(at: impl Fn(usize) -> (f64, [f64; 3]), count: usize, i: usize) -> [f64; 3] {
    if count < 2 {
        return [0.0; 3];
    }
    let slope = |from: usize, axis: usize| {
        let ((before_s, before), (after_s, after)) = (at(from), at(from + 1));
        (after[axis] - before[axis]) / (after_s - before_s)
    };
    std::array::from_fn(|axis| {
        if i == 0 {
            slope(0, axis)
        } else if i + 1 == count {
            slope(i - 1, axis)
        } else {
            let before_s = at(i).0 - at(i - 1).0;
            let after_s = at(i + 1).0 - at(i).0;
            (after_s * slope(i - 1, axis) + before_s * slope(i, axis)) / (before_s + after_s)
        }
    })
}

/// Length of a vector, in its unit.
#[must_use]
pub fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::{Flight, Motion, Sample};
    use crate::flights::track_error::COORDINATE_M_MAX;
    use proptest::prelude::*;

    #[test]
    fn velocity_of_a_parabola_is_exact_inside_with_uneven_steps() {
        // x = 3 t^2, so vx = 6 t; y = -2 t, so vy = -2.
        let rows: Vec<[f64; 4]> = [100.0, 100.1, 100.35, 100.4, 101.0]
            .iter()
            .map(|t: &f64| [*t, 3.0 * (t - 100.0).powi(2), -2.0 * t, 7.0])
            .collect();
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        assert_eq!(flight.samples[0].time_s, 0.0);
        assert!((flight.duration_s() - 1.0).abs() < 1e-9);
        for sample in &flight.samples[1..4] {
            assert!((sample.velocity_mps[0] - 6.0 * sample.time_s).abs() < 1e-9);
        }
        for sample in &flight.samples {
            assert!((sample.velocity_mps[1] + 2.0).abs() < 1e-9);
            assert_eq!(sample.velocity_mps[2], 0.0);
        }
        // One-sided ends: the slope of the first and the last interval.
        assert!((flight.samples[0].velocity_mps[0] - 0.3).abs() < 1e-9);
        assert!((flight.samples[4].velocity_mps[0] - 4.2).abs() < 1e-9);
    }

    #[test]
    fn motion_is_of_the_velocities_and_central() {
        // Velocity (3 t^2, 4, 0): the parabola through three of them is exact inside.
        let sample = |time_s: f64| Sample {
            time_s,
            position_m: [0.0; 3],
            velocity_mps: [3.0 * time_s * time_s, 4.0, 0.0],
        };
        let flight = |times: &[f64]| Flight {
            name: "f".to_owned(),
            source: "f".to_owned(),
            samples: times.iter().copied().map(sample).collect(),
        };
        let motion = flight(&[0.0, 0.5, 1.0, 1.25, 2.0]).motion();
        assert_eq!((motion[0].speed_mps, motion[2].speed_mps), (4.0, 5.0));
        for (motion, expected) in motion[1..4].iter().zip([3.0, 6.0, 7.5]) {
            assert!((motion.acceleration_mps2 - expected).abs() < 1e-12);
        }
        // One-sided at the ends.
        assert!((motion[0].acceleration_mps2 - 1.5).abs() < 1e-12);
        assert!((motion[4].acceleration_mps2 - 9.75).abs() < 1e-12);
        let still = Motion {
            speed_mps: 4.0,
            acceleration_mps2: 0.0,
        };
        assert_eq!(flight(&[0.0]).motion(), [still]);
        assert_eq!(flight(&[]).motion(), []);
    }

    #[test]
    fn a_moved_radar_shifts_positions_only() {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let moved = flight.seen_from([10.0, -1.0, 0.5]);
        assert_eq!(moved.samples[1].position_m, [-8.0, 3.0, 2.5]);
        assert_eq!(
            moved.samples[1].velocity_mps,
            flight.samples[1].velocity_mps
        );
    }

    proptest! {
        #[test]
        fn any_numbers_give_a_finite_flight_or_an_error(
            rows in prop::collection::vec(prop::array::uniform4(any::<f64>()), 0..6)
        ) {
            if let Ok(flight) = Flight::from_track("f", "f", &rows) {
                for sample in flight.samples {
                    prop_assert!(sample.position_m.iter().all(|v| v.is_finite()));
                    prop_assert!(sample.velocity_mps.iter().all(|v| v.is_finite()));
                }
            }
        }

        #[test]
        fn accepted_extremes_have_finite_velocity(
            steps in prop::collection::vec(1e-6..1e3_f64, 3..20),
            side in prop::collection::vec(any::<bool>(), 20)
        ) {
            let mut time_s = 0.0;
            let rows: Vec<[f64; 4]> = steps.iter().zip(side).map(|(step, up)| {
                time_s += step.max(1e-6) * 1.001;
                let edge = if up { COORDINATE_M_MAX } else { -COORDINATE_M_MAX };
                [time_s, edge, -edge, 0.0]
            }).collect();
            let flight = Flight::from_track("f", "f", &rows).unwrap();
            prop_assert!(flight.samples.iter().all(|s| s.velocity_mps.iter().all(|v| v.is_finite())));
        }
    }
}
