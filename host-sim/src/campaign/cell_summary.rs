//! One cell of the full evaluation: metrics, how sure they are, and how honest the covariance is.

use serde::Serialize;

use crate::campaign::step_record::StepRecord;
use crate::contest::tuned_on::TunedOn;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::binned::{BinSums, binned};
use crate::scoring::bootstrap::{FlightSum, Interval, interval_95};
use crate::scoring::cell::{Cell, CellMetrics, ScoredStep};
use crate::scoring::chi_square;
use crate::scoring::consistency::{Bounds, NOMINAL, nees_bounds, nis_bounds, reliability};
use crate::scoring::phase::Phase;

/// Everything that is known about one method under one condition.
#[derive(Clone, Debug, Serialize)]
pub struct CellSummary {
    /// The method.
    pub method: Method,
    /// The condition: noise table, noise level, sampling rate.
    #[serde(flatten)]
    pub condition: Condition,
    /// What the method's parameters were fitted to; `None` if it has none.
    pub tuned_on: Option<TunedOn>,
    /// Metrics over all steps.
    #[serde(flatten)]
    pub metrics: CellMetrics,
    /// Flights, every run of one by itself, that were not tracked at more than half of their steps.
    pub flights_not_tracked: usize,
    /// 95% interval of the mean ED by bootstrap, metres.
    pub ed_interval_m: Interval,
    /// 95% interval of the NEES by bootstrap.
    pub nees_interval: Interval,
    /// Fraction of truths inside the 50% ellipsoid.
    pub coverage50: f64,
    /// Fraction of truths inside the 95% ellipsoid.
    pub coverage95: f64,
    /// Fraction inside the ellipsoid of each nominal probability of [`NOMINAL`].
    pub reliability: [f64; NOMINAL.len()],
    /// NEES, averaged over flights at each step, against its chi-square bounds.
    pub nees_bounds: Bounds,
    /// Mean NIS over its degrees of freedom (ideal 1); NaN for methods without innovations.
    pub nis_ratio: f64,
    /// NIS against its bounds.
    pub nis_bounds: Bounds,
    /// The phases of a flight, apart.
    pub phases: Vec<PhaseSummary>,
    /// The steps by the target's true speed and acceleration.
    pub bins: Vec<BinSums>,
    /// Mean ED of each fold's flights, metres.
    pub ed_by_fold_m: Vec<f64>,
}

/// Metrics of one phase.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhaseSummary {
    /// The phase.
    pub phase: Phase,
    /// Metrics over its steps.
    #[serde(flatten)]
    pub metrics: CellMetrics,
}

/// The steps of one method over one flight, and where the flight belongs.
#[derive(Clone, Copy, Debug)]
pub struct Track<'a> {
    /// The steps.
    pub steps: &'a [StepRecord],
    /// The fold that tested the flight.
    pub fold: usize,
    /// Number of the cluster (recording or flight) that is drawn as a whole by the bootstrap.
    pub cluster: usize,
}

impl Track<'_> {
    /// Whether the flight was tracked at half of its steps or more.
    fn is_tracked(&self) -> bool {
        let lost = self.steps.iter().filter(|step| step.not_tracked).count();
        2 * lost <= self.steps.len()
    }
}

impl CellSummary {
    /// Sums up all flights of `method` under `condition`.
    pub fn new(
        method: Method,
        condition: Condition,
        tracks: &[Track<'_>],
        folds: usize,
        seed: u64,
    ) -> Self {
        let steps = || tracks.iter().flat_map(|track| track.steps);
        let metrics = metrics(steps());
        let squared: Vec<f64> = steps().map(|step| step.mahalanobis_squared).collect();
        let within = |probability: f64| {
            let limit = chi_square::quantile(probability, 3.0);
            squared.iter().filter(|d2| **d2 <= limit).count() as f64 / squared.len() as f64
        };
        let nees: Vec<Vec<f64>> = tracks
            .iter()
            .map(|track| {
                track
                    .steps
                    .iter()
                    .map(|step| step.mahalanobis_squared)
                    .collect()
            })
            .collect();
        let nis: Vec<Vec<_>> = tracks
            .iter()
            .map(|track| track.steps.iter().map(StepRecord::nis).collect())
            .collect();
        let (value, degrees) = nis
            .iter()
            .flatten()
            .flatten()
            .fold((0.0, 0.0), |(value, degrees), nis| {
                (value + nis.value, degrees + nis.degrees as f64)
            });
        let phase = |phase| PhaseSummary {
            phase,
            metrics: self::metrics(steps().filter(|step| step.phase() == phase)),
        };
        let fold_ed_m = |fold| {
            let own = tracks.iter().filter(|track| track.fold == fold);
            self::metrics(own.flat_map(|track| track.steps)).ed_mean_m
        };
        Self {
            method,
            condition,
            tuned_on: None,
            metrics,
            flights_not_tracked: tracks.iter().filter(|track| !track.is_tracked()).count(),
            ed_interval_m: interval_95(&error_sums(tracks), seed),
            nees_interval: interval_95(
                &cluster_sums(tracks, |step| step.mahalanobis_squared),
                seed,
            ),
            coverage50: within(0.5),
            coverage95: within(0.95),
            reliability: reliability(&squared),
            nees_bounds: nees_bounds(&nees),
            nis_ratio: value / degrees,
            nis_bounds: nis_bounds(&nis),
            phases: Phase::ALL.map(phase).to_vec(),
            bins: binned(steps().map(|step| (step.motion, step.scored().score))),
            ed_by_fold_m: (0..folds).map(fold_ed_m).collect(),
        }
    }
}

impl From<&CellSummary> for Cell {
    fn from(summary: &CellSummary) -> Self {
        Self {
            method: summary.method,
            noise: summary.condition.noise,
            rate: summary.condition.rate,
            metrics: summary.metrics,
            bins: summary.bins.clone(),
        }
    }
}

/// Errors of every cluster, metres; what paired comparisons are made of.
pub fn error_sums(tracks: &[Track<'_>]) -> Vec<FlightSum> {
    cluster_sums(tracks, |step| step.error_m)
}

fn cluster_sums(tracks: &[Track<'_>], value: fn(&StepRecord) -> f64) -> Vec<FlightSum> {
    let count = tracks
        .iter()
        .map(|track| track.cluster + 1)
        .max()
        .unwrap_or(0);
    let mut sums = vec![FlightSum::default(); count];
    for track in tracks {
        let own = FlightSum::of(track.steps.iter().map(value));
        let sum = &mut sums[track.cluster];
        sum.sum += own.sum;
        sum.count += own.count;
    }
    sums
}

fn metrics<'a>(steps: impl Iterator<Item = &'a StepRecord>) -> CellMetrics {
    let scored: Vec<ScoredStep> = steps.map(StepRecord::scored).collect();
    CellMetrics::new(&scored)
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Motion;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::{CellSummary, Track, error_sums};
    use crate::campaign::step_record::StepRecord;
    use crate::method::Method;
    use crate::scenario::radar::Condition;

    const CONDITION: Condition = Condition {
        table: NoiseTable::Radians,
        noise: NoiseLevel::Low,
        rate: SamplingRate::HALF,
    };

    fn step(time_s: f64, in_gap: bool, error_m: f64) -> StepRecord {
        StepRecord {
            time_s,
            in_gap,
            diverged: false,
            fate: None,
            not_tracked: false,
            outside: false,
            error_m,
            mahalanobis_squared: error_m * error_m,
            det_p_m6: 1.0,
            nis: (!in_gap).then_some((8.0, 4)),
            motion: Motion {
                speed_mps: time_s,
                acceleration_mps2: 0.0,
            },
        }
    }

    #[test]
    fn phases_folds_and_clusters_are_kept_apart() {
        let one = [
            step(1.0, true, 1.0),
            step(3.0, true, 2.0),
            step(4.0, false, 3.0),
        ];
        let two = [
            step(1.0, false, 4.0),
            step(3.0, false, 2.0),
            step(4.0, false, 0.0),
        ];
        let tracks = [
            Track {
                steps: &one,
                fold: 0,
                cluster: 0,
            },
            Track {
                steps: &two,
                fold: 1,
                cluster: 1,
            },
            Track {
                steps: &two,
                fold: 1,
                cluster: 1,
            },
        ];
        let cell = CellSummary::new(Method::Imm5, CONDITION, &tracks, 2, 1);
        assert_eq!(cell.metrics.steps, 9);
        assert_eq!(cell.ed_by_fold_m, [2.0, 2.0]);
        let phases: Vec<_> = cell
            .phases
            .iter()
            .map(|p| (p.metrics.steps, p.metrics.ed_mean_m))
            .collect();
        assert_eq!(phases, [(3, 3.0), (1, 2.0), (5, 1.4)]);
        // At one, three and four metres per second.
        let by_speed = cell.bins.iter().map(|own| own.means());
        let by_speed: Vec<_> = by_speed.map(|m| (m.steps, m.distance_m)).collect();
        assert_eq!(by_speed[..3], [(3, 3.0), (3, 2.0), (3, 1.0)]);
        assert_eq!(cell.nis_ratio, 2.0);
        // D^2 of 1, 4, 9, 16, 4, 0, 16, 4, 0 against 2.37 and 7.81.
        assert_eq!(cell.coverage50, 3.0 / 9.0);
        assert_eq!(cell.coverage95, 6.0 / 9.0);
        let sums = error_sums(&tracks);
        assert_eq!((sums[0].sum, sums[1].sum, sums[1].count), (6.0, 12.0, 6));
    }

    #[test]
    fn a_flight_is_lost_when_most_of_its_steps_are() {
        let lost = StepRecord {
            not_tracked: true,
            ..step(1.0, false, 1.0)
        };
        let good = step(1.0, false, 1.0);
        let half = [lost, good];
        let most = [lost, good, lost];
        let track = |steps| Track {
            steps,
            fold: 0,
            cluster: 0,
        };
        let tracks = [track(&half[..]), track(&most[..]), track(&half[..])];
        let cell = CellSummary::new(Method::Imm5, CONDITION, &tracks, 1, 1);
        assert_eq!((cell.flights_not_tracked, cell.metrics.not_tracked), (1, 4));
    }

    #[test]
    fn json_is_flat_and_has_no_nan() {
        let cell = CellSummary::new(Method::Ekf, CONDITION, &[], 0, 1);
        let json = serde_json::to_value(cell).unwrap();
        assert_eq!(json["table"], "radians");
        assert_eq!(json["noise"], "low");
        assert_eq!(json["rate"], 0.5);
        assert!(json["ed_mean_m"].is_null() && json["nis_ratio"].is_null());
    }
}
