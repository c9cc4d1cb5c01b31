//! A second track beside the first: made of measurements that the first one rejects, or uses as probably wrong.
//!
//! One such measurement is an outlier; several that agree with each other are a target. The
//! candidate starts from one and takes in those of the following ones that fit it. When enough have, and the first
//! track has believed none meanwhile, it takes over. The old track then is the candidate: it may have been right, and
//! it comes back if measurements that the new one rejects agree with it and it has the longer record. So scattered false
//! alarms never steal a track, and a ghost that did does not keep it.
//!
//! A candidate is predicted without the network, so a rejected measurement costs little more than
//! one that is used.

use super::correction::correct_soundly;
use super::population::{Base, Population};
use super::target::Target;
use crate::clock::seconds_between;
use crate::ekf::Corrected;
use crate::measurement::{Measurement, Vectors};

/// Measurements that must agree before a candidate takes over, its first one included.
pub const AGREEING: u8 = 3;
/// Normalised innovation squared up to which a measurement agrees with a candidate: by chance
/// (chi-square, four degrees of freedom) a true one exceeds it once in a thousand.
pub const AGREEMENT_NIS: f32 = 18.5;
/// Measurements in a row that do not agree after which a candidate is given up.
pub const MISSES_MAX: u8 = 2;
/// Time without agreement after which a candidate is given up, s.
pub const AGE_MAX_S: f32 = 5.0;
/// Deviations of the population's range that a candidate's position may be unsure by. Beyond it
/// nearly anything would agree with it.
pub const UNSURE_MAX: f32 = 2.0;

/// A track that may take over.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    pub(crate) target: Target,
    pub(crate) agreeing: u8,
    pub(crate) misses: u8,
}

/// What a rejected measurement did to the candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The candidate is too old, too unsure or too often contradicted to go on with.
    Over,
    /// Nothing is certain yet.
    Wait,
    /// The candidate has had enough agreement.
    Agreed,
}

impl Candidate {
    /// A candidate from its first measurement, if a target can start from it; `room` is overwritten.
    pub fn start(
        measurement: &Measurement,
        prior: &Population<f32>,
        room: &mut Target,
    ) -> Option<Self> {
        room.start(measurement, prior).ok()?;
        Some(Self {
            target: *room,
            agreeing: 1,
            misses: 0,
        })
    }

    /// Takes the place of `target`, which is the candidate from now on.
    pub fn depose(&mut self, target: &mut Target) {
        core::mem::swap(&mut self.target, target);
        self.agreeing = 0;
        self.misses = 0;
    }

    /// The target.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// Compares a measurement with the candidate, and takes it in if it agrees; `moved` is overwritten.
    // Its correction is off the stack before another candidate starts.
    #[inline(never)]
    pub fn meet(
        &mut self,
        measurement: &Measurement,
        base: &Base<f32>,
        population: &Population<f32>,
        moved: &mut Target,
    ) -> Verdict {
        let elapsed_s = seconds_between(self.target.time_us, measurement.time_us);
        if elapsed_s > AGE_MAX_S {
            return Verdict::Over;
        }
        moved.copy_from(&self.target);
        moved.seen_from(measurement.sensor.position_m);
        moved.drift(measurement.time_us, base);
        let unsure_max = UNSURE_MAX * population.range_sigma_m;
        if moved.position_variance() > unsure_max * unsure_max {
            return Verdict::Over;
        }
        let vectors = Vectors::from(measurement);
        let sensor_mps = measurement.sensor.velocity_mps;
        moved.relative_to(sensor_mps);
        let mut corrected = Corrected::new();
        corrected.begin(&moved.state, &moved.covariance);
        let agreed = match correct_soundly(&mut corrected, &vectors, [1.0; 3]) {
            Some(whitened) if corrected.nis < AGREEMENT_NIS => {
                moved.take(&corrected);
                moved.over_ground(sensor_mps);
                moved.memory.measured(whitened, &vectors);
                if elapsed_s > 0.0 {
                    // No network, no notes: those that a deposed track has stay.
                    moved.memory.stepped(elapsed_s, 1.0, moved.velocity(), &[]);
                }
                moved.settle()
            }
            _ => false,
        };
        if !agreed {
            self.misses += 1;
            return if self.misses < MISSES_MAX {
                Verdict::Wait
            } else {
                Verdict::Over
            };
        }
        self.target.copy_from(moved);
        self.misses = 0;
        self.agreeing = self.agreeing.saturating_add(1);
        if self.agreeing >= AGREEING {
            Verdict::Agreed
        } else {
            Verdict::Wait
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Sensed;
    use crate::sensor::Sensor;

    fn population() -> Population<f32> {
        Population {
            horizontal_sigma_mps: 10.0,
            vertical_sigma_mps: 10.0,
            acceleration_sigma_mps2: 4.0,
            ..Population::PAPER.known()
        }
    }

    fn base() -> Base<f32> {
        Base::DRONE.known()
    }

    fn seen(time_us: u64, range: f32, azimuth: f32) -> Measurement {
        let sensed = |value, sigma| Some(Sensed { value, sigma });
        Measurement {
            time_us,
            range: sensed(range, 0.1),
            elevation: sensed(0.4, 0.005),
            azimuth: sensed(azimuth, 0.005),
            range_rate: sensed(0.0, 0.05),
            sensor: Sensor::ORIGIN,
        }
    }

    fn room() -> Target {
        Target::NONE
    }

    fn deposed(mut target: Target) -> Candidate {
        let mut candidate = candidate();
        candidate.depose(&mut target);
        candidate
    }

    fn candidate() -> Candidate {
        Candidate::start(&seen(0, 33.0, 0.5), &population(), &mut room()).expect("a direction")
    }

    fn candidate_start_velocity() -> [f32; 3] {
        candidate().target().velocity()
    }

    #[test]
    fn three_that_agree_are_enough() {
        let mut candidate = candidate();
        let meet = |candidate: &mut Candidate, time_us| {
            candidate.meet(
                &seen(time_us, 33.05, 0.5),
                &base(),
                &population(),
                &mut room(),
            )
        };
        assert_eq!(meet(&mut candidate, 100_000), Verdict::Wait);
        assert_eq!(meet(&mut candidate, 200_000), Verdict::Agreed);
        assert_eq!(candidate.target().used, 3);
        assert_eq!(candidate.target().time_us, 200_000);
        // What the network will read of it is of now, not of its first guess.
        let memory = &candidate.target().memory;
        assert!((memory.age_s - 0.2).abs() < 1e-6);
        assert!(memory.velocity_means[0] != candidate_start_velocity());
    }

    #[test]
    fn two_in_a_row_elsewhere_end_it_and_one_does_not() {
        let mut candidate = candidate();
        let elsewhere = |time_us| seen(time_us, 50.0, -2.0);
        assert_eq!(
            candidate.meet(&elsewhere(100_000), &base(), &population(), &mut room()),
            Verdict::Wait
        );
        let there = seen(200_000, 33.0, 0.5);
        assert_eq!(
            candidate.meet(&there, &base(), &population(), &mut room()),
            Verdict::Wait
        );
        for (time_us, verdict) in [(300_000, Verdict::Wait), (400_000, Verdict::Over)] {
            let met = candidate.meet(&elsewhere(time_us), &base(), &population(), &mut room());
            assert_eq!(met, verdict);
        }
    }

    #[test]
    fn what_is_old_or_unsure_agrees_with_nothing() {
        let there = |time_us| seen(time_us, 33.0, 0.5);
        assert_eq!(
            candidate().meet(&there(5_100_000), &base(), &population(), &mut room()),
            Verdict::Over
        );
        // Two seconds at 10 m/s a component leave 35 m, more than twice 6 m.
        assert_eq!(
            candidate().meet(&there(2_000_000), &base(), &population(), &mut room()),
            Verdict::Over
        );
        let wide = Population {
            range_sigma_m: 600.0,
            ..population()
        };
        assert_eq!(
            candidate().meet(&there(2_000_000), &base(), &wide, &mut room()),
            Verdict::Wait
        );
    }

    #[test]
    fn a_deposed_track_needs_three_again() {
        let mut old = deposed(*candidate().target());
        for (step, verdict) in [Verdict::Wait, Verdict::Wait, Verdict::Agreed]
            .into_iter()
            .enumerate()
        {
            let there = seen(100_000 * (step as u64 + 1), 33.0, 0.5);
            assert_eq!(
                old.meet(&there, &base(), &population(), &mut room()),
                verdict
            );
        }
        assert_eq!(old.target().used, 4);
    }

    /// Twice 6 m is 12 m: a sum of variances of 144 m^2 may agree, more may not.
    #[test]
    fn unsure_and_old_end_where_they_are_said_to() {
        let unsure = |variance: f32, time_us, range_sigma_m| {
            let mut track = *candidate().target();
            for axis in 0..3 {
                track.covariance[axis] = [0.0; 9];
                track.covariance[axis][axis] = variance / 3.0;
            }
            let there = seen(time_us, 33.0, 0.5);
            let population = Population {
                range_sigma_m,
                ..population()
            };
            deposed(track).meet(&there, &base(), &population, &mut room())
        };
        assert_eq!(unsure(144.0, 0, 6.0), Verdict::Wait);
        assert_eq!(unsure(145.0, 0, 6.0), Verdict::Over);
        assert_eq!(unsure(100.0, 5_000_000, 600.0), Verdict::Wait);
        assert_eq!(unsure(100.0, 5_100_000, 600.0), Verdict::Over);
    }

    /// Agreement at the same time is no step of the memory.
    #[test]
    fn no_time_is_no_step() {
        let mut candidate = candidate();
        let met = candidate.meet(&seen(0, 33.0, 0.5), &base(), &population(), &mut room());
        assert_eq!((met, candidate.target().used), (Verdict::Wait, 2));
        let memory = &candidate.target().memory;
        assert_eq!(memory.age_s, 0.0);
        let means = memory.velocity_means.as_flattened();
        assert!(means.iter().all(|mean| mean.is_finite()));
    }
}
