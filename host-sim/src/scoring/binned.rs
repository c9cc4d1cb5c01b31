//! Scores sorted into the bins of the target's true speed and acceleration.

use bnkf_model_export::flights::flight::Motion;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::scoring::means::{Means, Sums};
use bnkf_model_export::scoring::step_score::StepScore;
use serde::Serialize;

use super::bin::{Bin, By};
use super::cell::Cell;
use crate::method::Method;

/// Means over fewer steps than this are noise: figures and tables for people leave them out.
pub const STEPS_MIN: u64 = 200;

/// The steps of one bin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(into = "Row")]
pub struct BinSums {
    /// The bin.
    pub bin: Bin,
    sums: Sums,
}

/// What is written of them, under the names that cells have.
#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    bin: Bin,
    steps: u64,
    ed_mean_m: f64,
    nees_mean: f64,
    coverage90: f64,
    nll: f64,
}

/// One method at one noise level, the steps of all sampling rates together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pooled {
    /// The method.
    pub method: Method,
    /// Noise level of the readings.
    pub noise: NoiseLevel,
    /// The bins of both quantities.
    pub bins: Vec<BinSums>,
}

impl BinSums {
    /// Means over its steps; NaN over none.
    pub fn means(&self) -> Means {
        self.sums.means()
    }

    /// The same if there are steps enough to tell.
    pub fn telling(&self) -> Option<Means> {
        Some(self.means()).filter(|means| means.steps >= STEPS_MIN)
    }
}

impl From<BinSums> for Row {
    fn from(sums: BinSums) -> Self {
        let means = sums.means();
        Self {
            bin: sums.bin,
            steps: means.steps,
            ed_mean_m: means.distance_m,
            nees_mean: means.nees,
            coverage90: means.coverage90,
            nll: means.surprise,
        }
    }
}

/// Bins under construction, which take one step after another.
#[derive(Clone, Debug)]
pub struct Binned([Vec<BinSums>; By::ALL.len()]);

impl Default for Binned {
    fn default() -> Self {
        let empty = |bin| BinSums {
            bin,
            sums: Sums::default(),
        };
        Self(By::ALL.map(|by| by.bins().into_iter().map(empty).collect()))
    }
}

impl Binned {
    /// Adds a step to one bin of every quantity.
    pub fn add(&mut self, motion: &Motion, score: &StepScore) {
        for (by, bins) in By::ALL.into_iter().zip(&mut self.0) {
            bins[by.index(motion)].sums.add(score);
        }
    }

    /// The bins of every quantity, in the order of [`By::ALL`].
    pub fn bins(&self) -> Vec<BinSums> {
        self.0.concat()
    }
}

/// `steps` in the bins of every quantity, each step once in each, in the order of [`By::ALL`].
#[cfg(test)]
pub fn binned(steps: impl Iterator<Item = (Motion, StepScore)>) -> Vec<BinSums> {
    let mut binned = Binned::default();
    for (motion, score) in steps {
        binned.add(&motion, &score);
    }
    binned.bins()
}

/// The bins of `cells`, the sampling rates of each noise level and method together.
pub fn over_rates(cells: &[Cell]) -> Vec<Pooled> {
    let mut pooled: Vec<Pooled> = Vec::new();
    for cell in cells {
        let same = |known: &&mut Pooled| (known.method, known.noise) == (cell.method, cell.noise);
        match pooled.iter_mut().find(same) {
            Some(known) => {
                for (all, own) in known.bins.iter_mut().zip(&cell.bins) {
                    all.sums = all.sums.join(own.sums);
                }
            }
            None => pooled.push(Pooled {
                method: cell.method,
                noise: cell.noise,
                bins: cell.bins.clone(),
            }),
        }
    }
    pooled
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Motion;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::NoiseLevel;
    use bnkf_model_export::scoring::step_score::StepScore;

    use super::{BinSums, STEPS_MIN, binned, over_rates};
    use crate::method::Method;
    use crate::scoring::bin::By;
    use crate::scoring::cell::{Cell, CellMetrics};

    fn step(speed_mps: f64, acceleration_mps2: f64, error_m: f64) -> (Motion, StepScore) {
        let motion = Motion {
            speed_mps,
            acceleration_mps2,
        };
        let score = StepScore {
            error_m,
            mahalanobis_squared: 2.0 * error_m,
            det_p_m6: 1.0,
        };
        (motion, score)
    }

    /// Steps and mean distance of a bin.
    fn of(bins: &[BinSums], by: By, low: f64) -> (u64, f64) {
        let own = bins
            .iter()
            .find(|own| (own.bin.by, own.bin.low) == (by, low));
        let means = own.unwrap().means();
        (means.steps, means.distance_m)
    }

    #[test]
    fn every_step_is_once_in_each_quantity() {
        let steps = [
            step(1.0, 0.0, 1.0),
            step(1.5, 25.0, 3.0),
            step(13.0, 3.0, 5.0),
            step(99.0, 21.0, 8.0),
        ];
        let bins = binned(steps.into_iter());
        assert_eq!(bins.len(), 13);
        assert_eq!(of(&bins, By::Speed, 0.0), (2, 2.0));
        assert_eq!(of(&bins, By::Speed, 12.0), (2, 6.5));
        assert_eq!(of(&bins, By::Acceleration, 0.0), (2, 3.0));
        assert_eq!(of(&bins, By::Acceleration, 20.0), (2, 5.5));
        for by in By::ALL {
            let own = bins.iter().filter(|own| own.bin.by == by);
            assert_eq!(own.map(|own| own.means().steps).sum::<u64>(), 4);
        }
        let json = serde_json::to_value(bins[0]).unwrap();
        assert_eq!(json["by"], "speed");
        assert_eq!(
            (&json["steps"], &json["nees_mean"]),
            (&2.into(), &4.0.into())
        );
        assert!(serde_json::to_value(bins[1]).unwrap()["ed_mean_m"].is_null());
    }

    #[test]
    fn rates_are_pooled_by_their_steps() {
        let cell = |method, noise, rate, steps: &[(Motion, StepScore)]| Cell {
            method,
            noise,
            rate,
            metrics: CellMetrics::new(&[]),
            bins: binned(steps.iter().copied()),
        };
        let (low, high) = (NoiseLevel::Low, NoiseLevel::High);
        let (full, half) = (SamplingRate::FULL, SamplingRate::HALF);
        let fast = step(7.0, 1.0, 4.0);
        let pooled = over_rates(&[
            cell(Method::Ekf, low, full, &[fast, fast, fast]),
            cell(Method::Bnkf, low, full, &[]),
            cell(Method::Ekf, low, half, &[step(7.0, 1.0, 8.0)]),
            cell(Method::Ekf, high, full, &[fast]),
        ]);
        let places: Vec<_> = pooled.iter().map(|own| (own.method, own.noise)).collect();
        let expected = [(Method::Ekf, low), (Method::Bnkf, low), (Method::Ekf, high)];
        assert_eq!(places, expected);
        assert_eq!(of(&pooled[0].bins, By::Speed, 6.0), (4, 5.0));
        assert_eq!(of(&pooled[1].bins, By::Speed, 6.0).0, 0);
    }

    #[test]
    fn few_steps_do_not_tell() {
        let bins = |count| binned(std::iter::repeat_n(step(1.0, 1.0, 1.0), count as usize));
        assert!(bins(STEPS_MIN - 1)[0].telling().is_none());
        assert_eq!(bins(STEPS_MIN)[0].telling().unwrap().nees, 2.0);
    }
}
