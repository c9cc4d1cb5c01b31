//! One cell of the full evaluation: metrics, how sure they are, and how honest the covariance is.

use bnkf_model_export::scoring::means::Sums;
use serde::Serialize;

use crate::campaign::step_record::StepRecord;
use crate::contest::tuned_on::TunedOn;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::binned::{BinSums, Binned};
use crate::scoring::bootstrap::{FlightSum, Interval, interval_95};
use crate::scoring::cell::{Cell, CellMetrics, CellSums, CellTotals};
use crate::scoring::consistency::{Averages, Bounds, NOMINAL, Reliability, nees};
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
    /// Mean NIS over its degrees of freedom of the readings that were used (ideal 1); NaN for methods without
    /// innovations.
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

/// A cell under construction, which takes one flight after another. Of their steps it keeps two numbers each, for the
/// medians.
#[derive(Clone, Debug)]
pub struct CellAccount {
    all: CellTotals,
    /// Each step is in one of them, and its values for the medians of all.
    phases: [CellSums; Phase::ALL.len()],
    bins: Binned,
    folds: Vec<Sums>,
    reliability: Reliability,
    nees: Averages,
    nis: Averages,
    flights_not_tracked: usize,
    errors_m: Vec<FlightSum>,
    squared: Vec<FlightSum>,
}

impl CellAccount {
    /// Without flights yet; there are so many `folds` and `clusters`.
    pub fn new(folds: usize, clusters: usize) -> Self {
        Self {
            all: CellTotals::default(),
            phases: Default::default(),
            bins: Binned::default(),
            folds: vec![Sums::default(); folds],
            reliability: Reliability::default(),
            nees: Averages::default(),
            nis: Averages::default(),
            flights_not_tracked: 0,
            errors_m: vec![FlightSum::default(); clusters],
            squared: vec![FlightSum::default(); clusters],
        }
    }

    /// Adds a flight.
    ///
    /// # Panics
    /// If its fold or cluster is beyond what there are.
    pub fn add(&mut self, track: Track<'_>) {
        for step in track.steps {
            let scored = step.scored();
            self.all.add(&scored);
            let phase = Phase::ALL
                .iter()
                .position(|phase| *phase == step.phase())
                .expect("one of them");
            self.phases[phase].add(&scored);
            self.bins.add(&step.motion, &scored.score);
            self.folds[track.fold].add(&scored.score);
            self.reliability.add(step.mahalanobis_squared);
        }
        let steps = || track.steps.iter();
        self.nees
            .add(steps().map(|step| Some(nees(step.mahalanobis_squared))));
        self.nis.add(steps().map(StepRecord::nis_used));
        self.flights_not_tracked += usize::from(!track.is_tracked());
        self.errors_m[track.cluster].join(FlightSum::of(steps().map(|step| step.error_m)));
        self.squared[track.cluster]
            .join(FlightSum::of(steps().map(|step| step.mahalanobis_squared)));
    }

    /// Metrics of the flights so far.
    pub fn metrics(&self) -> CellMetrics {
        self.all
            .metrics(&self.phases.each_ref().map(CellSums::values))
    }

    /// Errors of every cluster, metres; what paired comparisons are made of.
    pub fn errors_m(&self) -> &[FlightSum] {
        &self.errors_m
    }

    /// What all flights come to for `method` under `condition`.
    pub fn summary(
        &self,
        method: Method,
        condition: Condition,
        tuned_on: Option<TunedOn>,
        seed: u64,
    ) -> CellSummary {
        let phase = |(phase, sums): (&Phase, &CellSums)| PhaseSummary {
            phase: *phase,
            metrics: sums.metrics(),
        };
        let fold_ed_m = |sums: &Sums| sums.means().distance_m;
        CellSummary {
            method,
            condition,
            tuned_on,
            metrics: self.metrics(),
            flights_not_tracked: self.flights_not_tracked,
            ed_interval_m: interval_95(&self.errors_m, seed),
            nees_interval: interval_95(&self.squared, seed),
            coverage50: self.reliability.fraction(0.5),
            coverage95: self.reliability.fraction(0.95),
            reliability: self.reliability.fractions(),
            nees_bounds: self.nees.bounds(),
            nis_ratio: self.nis.ratio(),
            nis_bounds: self.nis.bounds(),
            phases: Phase::ALL.iter().zip(&self.phases).map(phase).collect(),
            bins: self.bins.bins(),
            ed_by_fold_m: self.folds.iter().map(fold_ed_m).collect(),
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

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Motion;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::{CellAccount, CellSummary, Track};
    use crate::campaign::step_record::StepRecord;
    use crate::filter::Fate;
    use crate::method::Method;
    use crate::scenario::radar::Condition;

    const CONDITION: Condition = Condition {
        table: NoiseTable::Radians,
        noise: NoiseLevel::Low,
        rate: SamplingRate::HALF,
    };

    fn step(time_s: f64, in_gap: bool, error_m: f64) -> StepRecord {
        StepRecord {
            in_gap,
            mahalanobis_squared: error_m * error_m,
            nis: (!in_gap).then_some((8.0, 4)),
            motion: Motion {
                speed_mps: time_s,
                acceleration_mps2: 0.0,
            },
            ..StepRecord::of_test(time_s, error_m)
        }
    }

    fn account(tracks: &[Track<'_>], folds: usize, clusters: usize) -> CellAccount {
        let mut account = CellAccount::new(folds, clusters);
        for track in tracks {
            account.add(*track);
        }
        account
    }

    fn summary(account: &CellAccount) -> CellSummary {
        account.summary(Method::Imm5, CONDITION, None, 1)
    }

    /// A gate that keeps a reading out has an innovation for the record, not for the mean.
    #[test]
    fn what_is_rejected_does_not_count_as_an_innovation() {
        let rejected = StepRecord {
            fate: Some(Fate::Rejected),
            nis: Some((8e6, 4)),
            ..step(2.0, false, 1.0)
        };
        let steps = [step(1.0, false, 1.0), rejected, step(3.0, false, 1.0)];
        let track = Track {
            steps: &steps,
            fold: 0,
            cluster: 0,
        };
        assert_eq!(summary(&account(&[track], 1, 1)).nis_ratio, 2.0);
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
        let account = account(&tracks, 2, 2);
        let cell = summary(&account);
        assert_eq!(cell.metrics, account.metrics());
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
        let sums = account.errors_m();
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
        let cell = summary(&account(&tracks, 1, 1));
        assert_eq!((cell.flights_not_tracked, cell.metrics.not_tracked), (1, 4));
    }

    #[test]
    fn json_is_flat_and_has_no_nan() {
        let cell = summary(&account(&[], 0, 0));
        let json = serde_json::to_value(cell).unwrap();
        assert_eq!(json["table"], "radians");
        assert_eq!(json["noise"], "low");
        assert_eq!(json["rate"], 0.5);
        assert!(json["ed_mean_m"].is_null() && json["nis_ratio"].is_null());
    }
}
