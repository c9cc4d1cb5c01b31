//! A gate before a filter, as the firmware's recursive tracker has one: a reading far outside what
//! was expected is not used, and after three of them in a row the filter starts anew.

use bnkf::recursive::AGREEING as REJECTIONS_MAX;
use bnkf_model_export::radar::reading::Reading;
use nalgebra::Vector3;

use crate::filter::{Fate, Filter, FilterError, PositionEstimate, Start};

/// Normalised innovation squared from which a reading is not used.
const GATE_NIS: f64 = bnkf::recursive::correction::GATE_NIS;

/// `F` behind a gate. Readings without an innovation pass.
#[derive(Clone, Debug)]
pub struct Gated<F> {
    filter: F,
    rejections: u8,
}

impl<F> Gated<F> {
    /// A gate before `filter`, which starts from a reading and not from the truth: nobody knows
    /// that when a filter starts anew.
    pub fn new(filter: F) -> Self {
        Self {
            filter,
            rejections: 0,
        }
    }
}

impl<F: Filter + Clone> Filter for Gated<F> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.rejections = 0;
        self.filter.start(start)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let Some(reading) = reading else {
            return self.filter.step(time_us, None);
        };
        let mut after = self.filter.clone();
        let estimate = after.step(time_us, Some(reading))?;
        if estimate.nis.is_none_or(|nis| nis.value < GATE_NIS) {
            self.filter = after;
            self.rejections = 0;
            return Ok(PositionEstimate {
                fate: Some(Fate::Used),
                ..estimate
            });
        }
        self.rejections += 1;
        if self.rejections < REJECTIONS_MAX {
            let coasted = self.filter.step(time_us, None)?;
            return Ok(PositionEstimate {
                nis: estimate.nis,
                fate: Some(Fate::Rejected),
                ..coasted
            });
        }
        let nowhere = Vector3::repeat(f64::NAN);
        let anew = self.start(&Start {
            reading,
            true_position_m: nowhere,
            true_velocity_mps: nowhere,
        })?;
        Ok(PositionEstimate {
            fate: Some(Fate::Restarted),
            ..anew
        })
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::reading::Reading;
    use nalgebra::Vector3;

    use super::Gated;
    use crate::baseline::imm::Imm;
    use crate::baseline::origin::Origin;
    use crate::baseline::prior::tests::PRIOR;
    use crate::filter::{Fate, Filter, PositionEstimate, Start};

    /// A target that stands 30 m to the east.
    fn reading(time_us: u64, azimuth_rad: f64) -> Reading {
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
        }
    }

    fn started() -> Gated<Imm<10>> {
        let mut filter = Gated::new(Imm::wide(Origin::Population(PRIOR)));
        let start = Start {
            reading: &reading(0, 0.0),
            true_position_m: Vector3::repeat(f64::NAN),
            true_velocity_mps: Vector3::repeat(f64::NAN),
        };
        assert!(filter.start(&start).is_ok());
        for step in 1..20 {
            let reading = reading(step * 100_000, 0.0);
            assert!(filter.step(reading.time_us, Some(&reading)).is_ok());
        }
        filter
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
        assert_eq!(anew.fate, Some(Fate::Restarted));
        let bearing_rad = anew.position_m.y.atan2(anew.position_m.x);
        assert!((bearing_rad - 2.0).abs() < 0.05, "{bearing_rad}");
    }

    #[test]
    fn a_likely_reading_counts_as_without_a_gate() {
        let mut gated = started();
        let mut plain = gated.filter.clone();
        let near = reading(2_000_000, 0.005);
        let answer = gated.step(near.time_us, Some(&near)).unwrap();
        let used = PositionEstimate {
            fate: Some(Fate::Used),
            ..plain.step(near.time_us, Some(&near)).unwrap()
        };
        assert_eq!(answer, used);
    }
}
