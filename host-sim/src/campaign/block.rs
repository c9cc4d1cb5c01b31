//! All flights under one condition, summed up one after another.

use rayon::prelude::*;

use super::cell_summary::{CellAccount, CellSummary, Track};
use super::comparison::{Comparison, comparisons};
use super::forecast_summary::{self, ForecastAccount, ForecastComparison, ForecastSummary};
use super::outcome::Floor;
use super::tuning_choice::{Candidate, choose, chosen};
use super::unit::Unit;
use crate::contest::tuned_on::TunedOn;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::{FlightSum, mean};

/// Where a flight belongs.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The fold that tested it.
    pub fold: usize,
    /// Its cluster, which the bootstrap draws as a whole.
    pub cluster: usize,
}

/// How many folds and clusters there are.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Folds.
    pub folds: usize,
    /// Clusters.
    pub clusters: usize,
}

/// One method with the parameters of one fit.
#[derive(Clone, Debug)]
struct Account {
    method: Method,
    tuned_on: Option<TunedOn>,
    cell: CellAccount,
    forecasts: ForecastAccount,
}

/// The accounts of all methods, which take one flight after another.
#[derive(Clone, Debug)]
pub struct Block<'a> {
    condition: Condition,
    methods: &'a [Method],
    accounts: Vec<Account>,
    /// The bound's sum over the flights by every motion model; `None` once a flight had no bound.
    floors: Vec<(TunedOn, Option<FlightSum>)>,
}

/// What a block comes to.
#[derive(Clone, Debug)]
pub struct BlockSums {
    /// One per method, as it is shown.
    pub cells: Vec<CellSummary>,
    /// Every pair of methods.
    pub comparisons: Vec<Comparison>,
    /// One per method and horizon.
    pub forecasts: Vec<ForecastSummary>,
    /// Every pair of methods at every horizon.
    pub forecast_comparisons: Vec<ForecastComparison>,
    /// Every tuned method with each of its fits.
    pub candidates: Vec<Candidate>,
    /// The bound.
    pub floor: Floor,
}

/// A flight's piece lacks a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lacking;

impl<'a> Block<'a> {
    /// Without flights yet. Tuned methods have a fit for each of `tuned_on`.
    pub fn new(
        condition: Condition,
        methods: &'a [Method],
        tuned_on: &[TunedOn],
        places: Places,
    ) -> Self {
        let account = |method, tuned_on| Account {
            method,
            tuned_on,
            cell: CellAccount::new(places.folds, places.clusters),
            forecasts: ForecastAccount::new(places.clusters),
        };
        let of_method = |method: &Method| -> Vec<Account> {
            if method.is_tuned() {
                let fits = tuned_on.iter();
                fits.map(|on| account(*method, Some(*on))).collect()
            } else {
                vec![account(*method, None)]
            }
        };
        Self {
            condition,
            methods,
            accounts: methods.iter().flat_map(of_method).collect(),
            floors: tuned_on
                .iter()
                .map(|on| (*on, Some(FlightSum::default())))
                .collect(),
        }
    }

    /// Adds flights, in their order.
    ///
    /// # Errors
    /// One of them lacks a method.
    pub fn add(&mut self, flights: &[(Place, Unit)]) -> Result<(), Lacking> {
        for (_, unit) in flights {
            for (on, sum) in &mut self.floors {
                let own = unit.floors_m.iter().find(|(of, _)| of == on);
                let own = own.and_then(|(_, own)| *own);
                match (sum.as_mut(), own) {
                    (Some(sum), Some(own)) => sum.join(own),
                    _ => *sum = None,
                }
            }
        }
        self.accounts.par_iter_mut().try_for_each(|account| {
            for (place, unit) in flights {
                let is_own = |track: &&_| account.is_of(track);
                let track = unit.tracks.iter().find(is_own).ok_or(Lacking)?;
                account.cell.add(Track {
                    steps: &track.steps,
                    fold: place.fold,
                    cluster: place.cluster,
                });
                account.forecasts.add(&track.forecasts, place.cluster);
            }
            Ok(())
        })
    }

    /// What the flights come to, tuned methods with the fit that served them best. `seed` is the bootstrap's.
    ///
    /// # Panics
    /// Never: every method has an account.
    pub fn sum_up(mut self, seed: u64) -> BlockSums {
        let accounts = &self.accounts;
        let candidates = choose(self.condition, self.methods, |method, on| {
            let mut own = accounts.iter();
            let account = own.find(|own| (own.method, own.tuned_on) == (method, Some(on)))?;
            Some(account.cell.metrics()).filter(|metrics| metrics.steps > 0)
        });
        let shown = |method| chosen(&candidates, method, self.condition);
        self.accounts.retain(|account| {
            account.tuned_on.is_none() || account.tuned_on == shown(account.method)
        });
        let cells = self.accounts.par_iter().map(|account| {
            let (method, tuned_on) = (account.method, account.tuned_on);
            account.cell.summary(method, self.condition, tuned_on, seed)
        });
        let cells = cells.collect();
        let errors_m = self.accounts.iter();
        let errors_m: Vec<_> = errors_m
            .map(|account| (account.method, account.cell.errors_m()))
            .collect();
        let said: Vec<_> = self
            .accounts
            .iter()
            .map(|account| (account.method, &account.forecasts))
            .collect();
        let (forecasts, forecast_comparisons) =
            forecast_summary::sum_up(self.condition, &said, seed);
        // The bound of the model that the tuned EKF is shown with.
        let on = shown(Method::EkfTuned).unwrap_or(TunedOn::Generated);
        let floor = self.floors.iter().find(|(of, _)| *of == on);
        let floor = floor.and_then(|(_, sum)| *sum);
        BlockSums {
            cells,
            comparisons: comparisons(self.condition, &errors_m, seed),
            forecasts,
            forecast_comparisons,
            candidates,
            floor: Floor {
                condition: self.condition,
                ed_m: floor.map_or(f64::NAN, |sum| mean(&[sum])),
            },
        }
    }
}

impl Account {
    fn is_of(&self, track: &super::step_record::MethodSteps) -> bool {
        track.is_of(self.method, self.tuned_on)
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::{Block, BlockSums, Lacking, Place, Places};
    use crate::campaign::step_record::{MethodSteps, StepRecord};
    use crate::campaign::unit::Unit;
    use crate::contest::tuned_on::TunedOn;
    use crate::method::Method;
    use crate::scenario::radar::Condition;
    use crate::scoring::bootstrap::FlightSum;

    const CONDITION: Condition = Condition {
        table: NoiseTable::Radians,
        noise: NoiseLevel::Low,
        rate: SamplingRate::FULL,
    };
    const METHODS: [Method; 2] = [Method::Recursive, Method::EkfTuned];
    const ON: [TunedOn; 2] = [TunedOn::Generated, TunedOn::Both];

    fn track(method: Method, tuned_on: Option<TunedOn>, error_m: f64) -> MethodSteps {
        let step = |time_s: f64| StepRecord::of_test(time_s, error_m * time_s);
        MethodSteps {
            method,
            tuned_on,
            steps: [1.0, 2.0, 3.0].map(step).to_vec(),
            estimates: Vec::new(),
            forecasts: Vec::new(),
        }
    }

    /// Flight `number`: the filter is nearer with what both kinds of flights taught it.
    fn flight(number: usize) -> (Place, Unit) {
        let metres = 1.0 + 0.1 * number as f64;
        let unit = Unit {
            tracks: vec![
                track(Method::Recursive, None, metres),
                track(Method::EkfTuned, Some(TunedOn::Generated), 3.0 * metres),
                track(Method::EkfTuned, Some(TunedOn::Both), 2.0 * metres),
            ],
            floors_m: ON
                .map(|on| (on, Some(FlightSum { sum: 3.0, count: 3 })))
                .to_vec(),
        };
        let (fold, cluster) = (number % 2, number);
        (Place { fold, cluster }, unit)
    }

    fn sums(parts: &[&[(Place, Unit)]]) -> BlockSums {
        let places = Places {
            folds: 2,
            clusters: 5,
        };
        let mut block = Block::new(CONDITION, &METHODS, &ON, places);
        for part in parts {
            block.add(part).unwrap();
        }
        block.sum_up(1)
    }

    #[test]
    fn flights_come_at_once_or_one_after_another() {
        let flights: Vec<_> = (0..5).map(flight).collect();
        let once = sums(&[&flights]);
        let parts = sums(&[&flights[..1], &flights[1..4], &flights[4..]]);
        let text = |sums: &BlockSums| serde_json::to_string(&sums.cells).unwrap();
        assert_eq!(text(&once), text(&parts));
        let [own, tuned] = &once.cells[..] else {
            panic!("one cell a method");
        };
        assert_eq!((own.tuned_on, tuned.tuned_on), (None, Some(TunedOn::Both)));
        assert_eq!((own.metrics.steps, tuned.metrics.steps), (15, 15));
        assert!((own.metrics.ed_mean_m - 2.4).abs() < 1e-12);
        assert_eq!(once.candidates.len(), 2);
        assert_eq!(once.comparisons.len(), 1);
        assert!((once.comparisons[0].ed_m.difference + 2.4).abs() < 1e-12);
        assert_eq!(once.floor.ed_m, 1.0);
        assert!(once.forecasts.is_empty());
    }

    #[test]
    fn a_flight_without_a_bound_leaves_none() {
        let mut flights: Vec<_> = (0..5).map(flight).collect();
        flights[2].1.floors_m[1].1 = None;
        assert!(sums(&[&flights]).floor.ed_m.is_nan());
    }

    #[test]
    fn a_flight_that_lacks_a_method_is_noticed() {
        let (place, mut unit) = flight(0);
        unit.tracks.pop();
        let places = Places {
            folds: 2,
            clusters: 5,
        };
        let mut block = Block::new(CONDITION, &METHODS, &ON, places);
        assert_eq!(block.add(&[(place, unit)]), Err(Lacking));
    }
}
