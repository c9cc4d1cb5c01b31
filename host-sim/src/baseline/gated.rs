//! A gate before a filter, as the firmware's recursive tracker has one: a reading far outside what
//! was expected is not used, and a second track of such readings takes over when enough of them
//! agree with each other.

use std::mem;

use bnkf::recursive::AGREEING;
use bnkf::recursive::candidate::UNSURE_MAX;
use bnkf_model_export::radar::reading::Reading;

use super::candidate::{Candidate, Track, Verdict};
use crate::filter::{Fate, Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

/// Normalised innovation squared from which a reading is not used.
const GATE_NIS: f64 = bnkf::recursive::correction::GATE_NIS;

/// `F` behind a gate. Readings without an innovation pass.
#[derive(Clone, Debug)]
pub struct Gated<F> {
    track: Track<F>,
    /// Readings in a row that the track rejected.
    rejections: u8,
    candidate: Option<Candidate<F>>,
    /// See [`Candidate::meet`].
    unsure_max_m: f64,
}

impl<F> Gated<F> {
    /// A gate before `filter`, which starts from a reading and not from the truth: nobody knows
    /// that when a filter starts anew. Ranges of the population deviate by `range_sigma_m`.
    pub fn new(filter: F, range_sigma_m: f64) -> Self {
        Self {
            track: Track {
                filter,
                time_us: 0,
                used: 0,
            },
            rejections: 0,
            candidate: None,
            unsure_max_m: f64::from(UNSURE_MAX) * range_sigma_m,
        }
    }
}

impl<F: Filter + Clone> Gated<F> {
    /// Shows the candidate a reading that the track rejected; its estimate if it took over. The old
    /// track then is the candidate.
    fn replaced(&mut self, reading: &Reading) -> Option<PositionEstimate> {
        let unsure_max_m = self.unsure_max_m;
        let met = self.candidate.as_mut();
        let verdict = met.map_or(Verdict::Over, |met| met.meet(reading, unsure_max_m));
        if verdict == Verdict::Over {
            self.candidate = Candidate::start(&self.track.filter, reading);
        }
        let Verdict::Agreed(estimate) = verdict else {
            return None;
        };
        let (rejections, used) = (self.rejections, self.track.used);
        let candidate = self
            .candidate
            .take_if(|candidate| rejections >= AGREEING || candidate.track().used > used)?;
        let old = mem::replace(&mut self.track, candidate.into_track());
        self.candidate = Some(Candidate::deposed(old));
        self.rejections = 0;
        Some(estimate)
    }
}

impl<F: Filter + Clone> Filter for Gated<F> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.rejections = 0;
        self.candidate = None;
        let estimate = self.track.filter.start(start)?;
        self.track.time_us = start.reading.time_us;
        self.track.used = 1;
        Ok(estimate)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let Some(reading) = reading else {
            return self.track.step(time_us, None);
        };
        let mut after = self.track.clone();
        let nis = match after.step(time_us, Some(reading)) {
            Ok(estimate) if estimate.nis_is_below(GATE_NIS) => {
                self.track = after;
                self.rejections = 0;
                return Ok(PositionEstimate {
                    fate: Some(Fate::Used),
                    ..estimate
                });
            }
            Ok(estimate) => estimate.nis,
            // A correction that comes to nothing is one that the firmware rejects.
            Err(FilterError::NotFinite | FilterError::NotPositiveDefinite) => None,
            Err(error) => return Err(error),
        };
        let coasted = self.track.step(time_us, None)?;
        self.rejections = self.rejections.saturating_add(1);
        if let Some(taken_over) = self.replaced(reading) {
            return Ok(PositionEstimate {
                nis: None,
                fate: Some(Fate::Restarted),
                ..taken_over
            });
        }
        Ok(PositionEstimate {
            nis,
            fate: Some(Fate::Rejected),
            ..coasted
        })
    }

    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        self.track.filter.forecast(times_us)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;
    use nalgebra::{Matrix3, Vector3};

    use super::Gated;
    use crate::baseline::imm::Imm;
    use crate::baseline::origin::Origin;
    use crate::baseline::prior::tests::PRIOR;
    use crate::filter::{
        Fate, Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start,
    };

    /// A target that stands 30 m away.
    pub fn reading(time_us: u64, azimuth_rad: f64) -> Reading {
        Reading {
            time_us,
            range_m: 30.0,
            elevation_rad: 0.3,
            azimuth_rad,
            range_rate_mps: 0.0,
            sigma_range_m: 1.0,
            sigma_elevation_rad: 0.01,
            sigma_azimuth_rad: 0.01,
            sigma_range_rate_mps: 0.1,
            sensor: Pose::ORIGIN,
            late_us: 0,
        }
    }

    /// Twenty readings of a target in the east, 0.1 s apart.
    fn started() -> Gated<Imm<10>> {
        let mut filter = Gated::new(Imm::wide(Origin::Population(PRIOR)), PRIOR.range_m.sigma);
        let start = Start {
            reading: &reading(0, 0.0),
            true_position_m: Vector3::repeat(f64::NAN),
            true_velocity_mps: Vector3::repeat(f64::NAN),
        };
        assert!(filter.start(&start).is_ok());
        assert_eq!(fates(&mut filter, 1, &[0.0; 19]), [Fate::Used; 19]);
        filter
    }

    /// What becomes of readings at these azimuths, the first of them at a step's number.
    fn fates(filter: &mut Gated<Imm<10>>, step: u64, azimuths_rad: &[f64]) -> Vec<Fate> {
        let mut fates = Vec::new();
        for (azimuth_rad, step) in azimuths_rad.iter().zip(step..) {
            let reading = reading(step * 100_000, *azimuth_rad);
            let answer = filter.step(reading.time_us, Some(&reading)).unwrap();
            fates.extend(answer.fate);
        }
        fates
    }

    #[test]
    fn a_wild_reading_moves_nothing_and_a_lasting_one_starts_anew() {
        let (mut gated, mut coasting) = (started(), started());
        for step in 20..22 {
            let wild = reading(step * 100_000, 2.0);
            let refused = gated.step(wild.time_us, Some(&wild)).unwrap();
            let coasted = coasting.step(wild.time_us, None).unwrap();
            assert_eq!(refused.fate, Some(Fate::Rejected));
            assert_eq!(refused.position_m, coasted.position_m);
            assert_eq!(refused.covariance_m2, coasted.covariance_m2);
            assert!(refused.nis.unwrap().value > super::GATE_NIS);
        }
        let third = reading(2_200_000, 2.0);
        let anew = gated.step(third.time_us, Some(&third)).unwrap();
        assert_eq!((anew.fate, anew.nis), (Some(Fate::Restarted), None));
        let bearing_rad = anew.position_m.y.atan2(anew.position_m.x);
        assert!((bearing_rad - 2.0).abs() < 0.02, "{bearing_rad}");
        assert_eq!(fates(&mut gated, 23, &[2.0; 3]), [Fate::Used; 3]);
    }

    /// Stays in the origin, and cannot be corrected by what is in the south.
    #[derive(Clone, Debug)]
    struct Brittle;

    impl Filter for Brittle {
        fn start(&mut self, _: &Start<'_>) -> Result<PositionEstimate, FilterError> {
            Ok(PositionEstimate::new(Vector3::zeros(), Matrix3::identity()))
        }

        fn step(
            &mut self,
            _: u64,
            reading: Option<&Reading>,
        ) -> Result<PositionEstimate, FilterError> {
            match reading {
                Some(reading) if reading.azimuth_rad < 0.0 => Err(FilterError::NotPositiveDefinite),
                _ => Ok(PositionEstimate::new(Vector3::zeros(), Matrix3::identity())),
            }
        }

        fn forecast(&mut self, _: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
            Err(FilterError::NotFinite)
        }
    }

    #[test]
    fn a_correction_that_fails_rejects_its_reading() {
        let mut gated = Gated::new(Brittle, PRIOR.range_m.sigma);
        let start = Start {
            reading: &reading(0, 0.0),
            true_position_m: Vector3::zeros(),
            true_velocity_mps: Vector3::zeros(),
        };
        gated.start(&start).unwrap();
        let rejected = gated.step(100_000, Some(&reading(100_000, -1.0))).unwrap();
        assert_eq!((rejected.fate, rejected.nis), (Some(Fate::Rejected), None));
        let used = gated.step(200_000, Some(&reading(200_000, 1.0))).unwrap();
        assert_eq!(used.fate, Some(Fate::Used));
    }

    #[test]
    fn scattered_false_alarms_never_steal_the_track() {
        let mut gated = started();
        let scattered = [2.0, -2.0, 1.0, 3.0, -1.0, 2.5, -2.5, 1.5, -0.5];
        assert_eq!(fates(&mut gated, 20, &scattered), [Fate::Rejected; 9]);
        assert_eq!(fates(&mut gated, 29, &[0.0; 3]), [Fate::Used; 3]);
    }

    #[test]
    fn a_ghost_that_alternates_with_the_target_does_not_take_over() {
        let mut gated = started();
        let alternating: Vec<f64> = [2.0, 0.0].repeat(20);
        let expected = [Fate::Rejected, Fate::Used].repeat(20);
        assert_eq!(fates(&mut gated, 20, &alternating), expected);
    }

    #[test]
    fn a_ghost_that_took_over_does_not_keep_the_track() {
        let mut gated = started();
        let [rejected, used, restarted] = [Fate::Rejected, Fate::Used, Fate::Restarted];
        assert_eq!(
            fates(&mut gated, 20, &[2.0; 4]),
            [rejected, rejected, restarted, used]
        );
        // The target has the longer record: three of its readings suffice, one at a time.
        let back = fates(&mut gated, 24, &[0.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.0]);
        assert_eq!(
            back,
            [rejected, used, rejected, used, restarted, used, used]
        );
    }

    #[test]
    fn a_start_forgets_the_candidate() {
        let mut gated = started();
        assert_eq!(fates(&mut gated, 20, &[2.0; 2]), [Fate::Rejected; 2]);
        let start = Start {
            reading: &reading(2_200_000, 0.0),
            true_position_m: Vector3::zeros(),
            true_velocity_mps: Vector3::zeros(),
        };
        assert!(gated.start(&start).is_ok());
        assert_eq!(fates(&mut gated, 23, &[2.0; 2]), [Fate::Rejected; 2]);
    }

    #[test]
    fn a_likely_reading_counts_as_without_a_gate() {
        let mut gated = started();
        let mut plain = gated.track.filter.clone();
        let near = reading(2_000_000, 0.005);
        let answer = gated.step(near.time_us, Some(&near)).unwrap();
        let used = PositionEstimate {
            fate: Some(Fate::Used),
            ..plain.step(near.time_us, Some(&near)).unwrap()
        };
        assert_eq!(answer, used);
    }
}
