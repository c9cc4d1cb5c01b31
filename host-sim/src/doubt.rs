//! Whether doubt about the weights rises on unfamiliar motion and mends the coverage there: ways of
//! being in doubt on the same flights, familiar and not.

pub mod entry;
pub mod table;
pub mod world;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::recursive::committee::{Committee, Followed};
use bnkf_model_export::recursive::scenario::Scenario;
use bnkf_model_export::seed;
use rayon::prelude::*;
use serde::Serialize;

use crate::scoring::bootstrap::{FlightSum, Interval, interval_95, mean};
use crate::scoring::median::median;
use crate::scoring::paired::PairedDifference;

/// How one way of being in doubt does in one world at one noise level, all sampling rates together.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Doubt {
    /// Mean distance to the truth, metres.
    pub distance_m: f64,
    /// Mean normalised error squared; three is honest.
    pub nees: f64,
    /// Share of truths inside the 90% ellipsoid, and its interval by flight.
    pub coverage90: f64,
    /// Its 95% interval, by flight.
    pub coverage90_interval: Interval,
    /// Mean negative log-likelihood of the true position, nats.
    pub surprise: f64,
    /// Root mean square over steps of the deviation of the mean jerk over opinions, m/s^3.
    pub jerk_sigma_mps3: f64,
    /// What that adds to the density of the jerk noise, as a share of the scheduled one; median
    /// over flights of the mean over steps.
    pub noise_share: f64,
    /// Coverage less that of the first entry.
    pub coverage90_gain: PairedDifference,
    /// Surprise less that of the first entry; negative is better.
    pub surprise_gain: PairedDifference,
}

/// A row of the study.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The world.
    pub world: String,
    /// The noise level.
    pub noise: NoiseLevel,
    /// Name of the entry.
    pub entry: String,
    /// What was found.
    #[serde(flatten)]
    pub doubt: Doubt,
}

/// An entry, ready to follow flights.
pub struct Candidate<'b> {
    /// Its name.
    pub name: &'b str,
    /// Its opinions.
    pub committee: Committee<'b>,
}

/// Sums of one flight.
struct FlightSums {
    distance: FlightSum,
    nees: FlightSum,
    covered: FlightSum,
    surprise: FlightSum,
    jerk: FlightSum,
    share: FlightSum,
}

/// Lets every candidate follow `flights` under the paper's noise levels and sampling rates; rows in
/// the order of levels, then candidates. `told` is called once a level and candidate.
pub fn study(
    world: &str,
    flights: &[Flight],
    candidates: &[Candidate<'_>],
    seed: u64,
    told: &dyn Fn(),
) -> Vec<Row> {
    let cells = Scenario::Paper.cells(flights, seed);
    let rates = cells.len() / NoiseLevel::ALL.len();
    let mut rows = Vec::new();
    for (noise, cells) in NoiseLevel::ALL.into_iter().zip(cells.chunks(rates)) {
        let mut first: Option<Vec<FlightSums>> = None;
        for candidate in candidates {
            let committee = &candidate.committee;
            // One entry a flight: its cells one after another.
            let mut steps: Vec<Vec<Followed>> = Vec::new();
            for cell in cells {
                let encounters = cell.encounters(committee.population());
                let parts: Vec<Vec<Followed>> = encounters
                    .par_iter()
                    .enumerate()
                    .map(|(index, encounter)| {
                        let seed = seed::derive(seed, &[seed::name_id("doubt"), index as u64]);
                        committee.follow(encounter, seed)
                    })
                    .collect();
                if steps.is_empty() {
                    steps = parts;
                } else {
                    for (all, part) in steps.iter_mut().zip(parts) {
                        all.extend(part);
                    }
                }
            }
            let sums: Vec<FlightSums> = steps.iter().map(|steps| FlightSums::of(steps)).collect();
            rows.push(Row {
                world: world.to_owned(),
                noise,
                entry: candidate.name.to_owned(),
                doubt: Doubt::new(&sums, first.as_ref().unwrap_or(&sums), seed),
            });
            first.get_or_insert(sums);
            told();
        }
    }
    rows
}

impl FlightSums {
    fn of(steps: &[Followed]) -> Self {
        let sum = |value: fn(&Followed) -> f64| FlightSum::of(steps.iter().map(value));
        Self {
            distance: sum(|step| step.score.error_m),
            nees: sum(|step| step.score.mahalanobis_squared),
            covered: sum(|step| f64::from(u8::from(step.score.covered_90()))),
            surprise: sum(|step| step.score.surprise()),
            jerk: sum(|step| step.jerk_variance),
            share: sum(|step| step.noise_share),
        }
    }
}

impl Doubt {
    fn new(own: &[FlightSums], first: &[FlightSums], seed: u64) -> Self {
        let part = |sums: &[FlightSums], value: fn(&FlightSums) -> FlightSum| {
            sums.iter().map(value).collect::<Vec<_>>()
        };
        let average = |value| mean(&part(own, value));
        let against = |value| PairedDifference::new(&part(own, value), &part(first, value), seed);
        let shares: Vec<f64> = own.iter().map(|sums| mean(&[sums.share])).collect();
        Self {
            distance_m: average(|sums| sums.distance),
            nees: average(|sums| sums.nees),
            coverage90: average(|sums| sums.covered),
            coverage90_interval: interval_95(&part(own, |sums| sums.covered), seed),
            surprise: average(|sums| sums.surprise),
            jerk_sigma_mps3: average(|sums| sums.jerk).sqrt(),
            noise_share: median(&[&shares]),
            coverage90_gain: against(|sums| sums.covered),
            surprise_gain: against(|sums| sums.surprise),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Candidate, study};
    use crate::contest::default_models;
    use crate::doubt::world::World;
    use bnkf::Inference;
    use bnkf::blob::Kind;
    use bnkf_model_export::recursive::committee::Committee;

    #[test]
    fn sampled_weights_doubt_and_mean_ones_do_not() {
        let models = default_models::load().unwrap();
        let model = models
            .iter()
            .find(|model| model.blob().kind() == Kind::Recursive);
        let blob = model.unwrap().blob();
        let candidate = |name, inference| Candidate {
            name,
            committee: Committee::new(&[blob], inference).unwrap(),
        };
        let candidates = [
            candidate("mean", Inference::Mean),
            candidate("sampled", Inference::of_passes(8).unwrap()),
        ];
        let world = &World::built_in(3).unwrap()[0];
        let rows = study(&world.name, &world.flights, &candidates, 1, &|| ());
        assert_eq!(rows.len(), 6);
        for pair in rows.chunks(2) {
            let (plain, sampled) = (&pair[0].doubt, &pair[1].doubt);
            assert_eq!((plain.noise_share, plain.jerk_sigma_mps3), (0.0, 0.0));
            assert_eq!(plain.surprise_gain.difference, 0.0);
            assert!(sampled.noise_share > 0.0 && sampled.jerk_sigma_mps3 > 0.0);
            assert!(sampled.surprise_gain.difference != 0.0);
            assert!((1.0..8.0).contains(&plain.nees), "{}", plain.nees);
        }
    }
}
