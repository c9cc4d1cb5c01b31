//! Learning from a few flights of a user's own: a shipped model goes on training on them, half of
//! every batch still built-in flights, so that it forgets nothing. The shipped posterior of every
//! weight can be its prior as well.

use super::augmentation::Augmentation;
use super::model::RecursiveModel;
use super::network::Network;
use super::network::anchor::Anchor;
use super::population::population_of;
use crate::flights::data_hash::of_flights;
use crate::flights::flight::Flight;
use bnkf::recursive::population::Population;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Batches of flights by default: half as many learn a little less of generated flights of our own, in half
/// the time (docs/choices.md).
pub const EPISODES: u64 = 900;
/// Highest learning rate by default: beside [`BLEND`] a third of it learned less of generated flights of our own
/// and forgot more of others (docs/choices.md).
pub const RATE: f64 = 1e-3;
/// How far the tuned model goes from the shipped weights to the trained ones by default.
pub const BLEND: f64 = 0.8;
/// Share of every batch that is built-in flights by default.
pub const REHEARSAL: f64 = 0.5;
/// Shortest flight to learn from, s.
pub const DURATION_MIN_S: f64 = 4.5;

/// Least distance and height that are told apart, m.
const NEAREST_M: f64 = 1.0;
/// Most that flights which stay where they are are moved, in the logarithm of distance and height.
const SPREAD_MAX: f64 = 0.5;

/// What holds the weights where they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// The shipped posterior of every weight, ten times as wide
    Posterior,
    /// The shipped means, all with ten times their median deviation
    Isotropic,
    /// Nothing but rehearsal
    Nothing,
}

/// Width of the prior, in the shipped deviations.
const WIDTH: f64 = 10.0;

/// How a model is tuned; part of a [`super::recipe::Recipe`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Share of every batch that is built-in flights.
    pub rehearsal: f64,
    /// What holds the weights.
    pub hold: Hold,
    /// How far the tuned model goes from the shipped weights to the trained ones, which know more of own
    /// flights and less of all others: 0 to 1. Weights on the straight line between are nearly as good in
    /// both as the better end (Wortsman et al. 2022, "Robust fine-tuning of zero-shot models").
    pub blend: f64,
    /// Whether own flights are moved into the volume; otherwise they stay where they were, turned
    /// about the radar.
    pub place: bool,
    /// SHA-256 of the model that was tuned.
    pub blob_sha256: String,
    /// SHA-256 of the own flights.
    pub flights_sha256: String,
}

impl Tuning {
    /// Half rehearsal and nothing else that holds: a prior of any kind cost more than it kept.
    pub fn new(blob_sha256: String, own: &[Flight], place: bool) -> Self {
        Self {
            rehearsal: REHEARSAL,
            hold: Hold::Nothing,
            blend: BLEND,
            place,
            blob_sha256,
            flights_sha256: of_flights(own),
        }
    }

    /// How own flights of targets with this population are changed: turned and mirrored, and placed if they are to
    /// be. Where they stay they are examples of places, and near them others will be flown.
    pub fn augmentation(&self, own: &[Flight], known: &Population<f64>) -> Augmentation {
        Augmentation {
            kept: !self.place,
            kept_spread: if self.place {
                [0.0; 2]
            } else {
                places_spread(own, known)
            },
            ..Augmentation::STILL
        }
    }

    /// The prior of the weights.
    pub fn anchor(&self, shipped: &Network) -> Option<Anchor> {
        match self.hold {
            Hold::Posterior => Some(Anchor::posterior(shipped, WIDTH)),
            Hold::Isotropic => Some(Anchor::isotropic(shipped, WIDTH)),
            Hold::Nothing => None,
        }
    }
}

/// The flights that are long enough to learn from.
pub fn usable(flights: Vec<Flight>) -> Vec<Flight> {
    let long = |flight: &Flight| too_short(flight).is_none();
    flights.into_iter().filter(long).collect()
}

/// What to say of a flight that is left out.
pub fn too_short(flight: &Flight) -> Option<String> {
    let duration_s = flight.duration_s();
    let long = duration_s >= DURATION_MIN_S;
    let name = &flight.name;
    (!long).then(|| {
        format!("{name}: {duration_s:.2} s, and {DURATION_MIN_S} s is the least to learn from")
    })
}

/// Standard deviations of the logarithms of horizontal distance and height, for places like those of `own` flights:
/// a kernel of the width that suits so many points in two dimensions (Silverman and Young 1987, "The bootstrap:
/// to smooth or not to smooth?"), where what is known counts as one flight.
fn places_spread(own: &[Flight], known: &Population<f64>) -> [f64; 2] {
    let count = own.len() as f64;
    let spread = |value: fn(&[f64; 3]) -> f64, known: f64| {
        let places = own.iter().map(|flight| {
            let values = flight.samples.iter().map(|s| value(&s.position_m));
            let mean = values.sum::<f64>() / flight.samples.len() as f64;
            mean.abs().max(NEAREST_M).ln()
        });
        let mean = places.clone().sum::<f64>() / count;
        let squares: f64 = places.map(|place| (place - mean).powi(2)).sum();
        ((squares + known * known) / count).sqrt() * count.powf(-1.0 / 6.0)
    };
    let relative = |sigma: f64, mean: f64| (sigma / mean.abs().max(NEAREST_M)).min(SPREAD_MAX);
    [
        spread(
            |[x, y, _]| x.hypot(*y),
            relative(known.horizontal_sigma_m, known.horizontal_m),
        ),
        spread(
            |[_, _, z]| *z,
            relative(known.height_sigma_m, known.height_m),
        ),
    ]
    .map(|spread| spread.min(SPREAD_MAX))
}

/// The model with the prior of its first measurement widened to what `own` flights are like: half of
/// them, half of what it knew. Where targets are is left alone when the flights are `placed`.
pub fn refitted(model: &RecursiveModel, own: &[Flight], placed: bool) -> RecursiveModel {
    let mut refitted = model.clone();
    let Some(found) = population_of(own) else {
        return refitted;
    };
    let known = model.parameters.population;
    let root = |a: f64, b: f64| (0.5 * (a * a + b * b)).sqrt();
    let spread = |known: (f64, f64), found: (f64, f64)| {
        let (mean, apart) = (0.5 * (known.0 + found.0), 0.5 * (known.0 - found.0));
        (mean, root(known.1, found.1).hypot(apart))
    };
    let mut population = Population {
        acceleration_sigma_mps2: root(known.acceleration_sigma_mps2, found.acceleration_sigma_mps2),
        horizontal_sigma_mps: root(known.horizontal_sigma_mps, found.horizontal_sigma_mps),
        vertical_sigma_mps: root(known.vertical_sigma_mps, found.vertical_sigma_mps),
        ..known
    };
    if !placed {
        (population.range_m, population.range_sigma_m) = spread(
            (known.range_m, known.range_sigma_m),
            (found.range_m, found.range_sigma_m),
        );
        (population.elevation_rad, population.elevation_sigma_rad) = spread(
            (known.elevation_rad, known.elevation_sigma_rad),
            (found.elevation_rad, found.elevation_sigma_rad),
        );
        (population.horizontal_m, population.horizontal_sigma_m) = spread(
            (known.horizontal_m, known.horizontal_sigma_m),
            (found.horizontal_m, found.horizontal_sigma_m),
        );
        (population.height_m, population.height_sigma_m) = spread(
            (known.height_m, known.height_sigma_m),
            (found.height_m, found.height_sigma_m),
        );
    }
    refitted.parameters.population = population;
    refitted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::generator::{GeneratorSettings, generate};
    use crate::kernel::Tier;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::recipe::Recipe;
    use crate::recursive::score::Score;
    use crate::recursive::training::{ResumeError, Training, TrainingError};
    use bnkf::recursive::hypotheses::Hypotheses;

    fn flights(count: usize, seed: u64, speed_scale: f64) -> Vec<Flight> {
        generate(&GeneratorSettings {
            flights: count,
            seed,
            speed_scale,
            ..GeneratorSettings::default()
        })
        .unwrap()
    }

    fn recipe(own: &[Flight], hold: Hold) -> Recipe {
        let tuning = Tuning {
            hold,
            ..Tuning::new("abc".to_owned(), own, true)
        };
        Recipe {
            flights: 32,
            episodes: 6,
            // The model that is tuned has learned next to nothing.
            rate: 1e-3,
            ..Recipe::DEFAULT.tuned(tuning)
        }
    }

    fn shipped(flights: &[Flight]) -> RecursiveModel {
        let small = Recipe {
            flights: 32,
            episodes: 2,
            ..Recipe::DEFAULT
        };
        Training::new(small, flights).unwrap().model()
    }

    /// One flight as far and as high as these, round the radar.
    fn around(distance_m: f64, height_m: f64) -> Flight {
        let rows: Vec<[f64; 4]> = (0..60)
            .map(|i| {
                let (s, c) = (0.05 * f64::from(i)).sin_cos();
                [0.1 * f64::from(i), distance_m * c, distance_m * s, height_m]
            })
            .collect();
        Flight::from_track("around", "around", &rows).unwrap()
    }

    /// One place is as uncertain as those that the model knows; of many it is their own spread, and less the more
    /// they are. Flights that are placed anyway are not spread.
    #[test]
    fn places_are_spread_by_what_own_flights_leave_open() {
        let known = bnkf::recursive::parameters::Parameters::PAPER.population;
        let relative = [
            known.horizontal_sigma_m / known.horizontal_m,
            known.height_sigma_m / known.height_m,
        ];
        let spread = |own: &[Flight], place: bool| {
            let tuning = Tuning::new("abc".to_owned(), own, place);
            tuning.augmentation(own, &known).kept_spread
        };
        let one = spread(&[around(30.0, 12.0)], false);
        for (one, relative) in one.iter().zip(relative) {
            assert!((one - relative).abs() < 1e-9, "{one} {relative}");
        }
        // Logarithms a tenth and two tenths apart from their mean.
        let own: Vec<Flight> = (0..64)
            .map(|i| if i % 2 == 0 { 1.0 } else { -1.0_f64 })
            .map(|sign| around(30.0 * (0.1 * sign).exp(), 12.0 * (0.2 * sign).exp()))
            .collect();
        let many = spread(&own, false);
        for ((many, own), relative) in many.iter().zip([0.1_f64, 0.2]).zip(relative) {
            let expected = (own * own + relative * relative / 64.0).sqrt() / 2.0;
            assert!((many - expected).abs() < 1e-6, "{many} {expected}");
        }
        assert_eq!(spread(&own, true), [0.0; 2]);
        // Places that differ by more than any kernel covers.
        let apart = [around(1.0, 0.0), around(1000.0, -900.0)];
        assert_eq!(spread(&apart, false), [SPREAD_MAX; 2]);
    }

    /// Own flights that are faster than any other: their likelihood rises.
    #[test]
    fn tuning_learns_from_own_flights() {
        let (familiar, own) = (flights(8, 1, 1.0), flights(4, 2, 4.0));
        let model = shipped(&familiar);
        let recipe = Recipe {
            episodes: 16,
            ..recipe(&own, Hold::Nothing)
        };
        let mut training = Training::tune(recipe, &familiar, &own, &model).unwrap();
        let judged = flights(8, 3, 4.0);
        let population = training.parameters.population;
        let cell = &crate::recursive::scenario::Scenario::Paper.cells(&judged, 5)[0];
        let encounters = cell.encounters(&population);
        let score = |training: &Training<'_>| {
            let weights = training.network.weights(Tier::detect(), Sampling::Nothing);
            Score::of(training.programs(), &weights, &encounters)
        };
        let before = score(&training);
        for _ in 0..16 {
            training.episode();
        }
        let after = score(&training);
        assert!(
            after.means.surprise < before.means.surprise - 0.02,
            "{before:?} {after:?}"
        );
    }

    #[test]
    fn an_interrupted_tuning_ends_with_the_same_weights() {
        let (familiar, own) = (flights(4, 1, 1.0), flights(2, 2, 2.0));
        let model = shipped(&familiar);
        let recipe = recipe(&own, Hold::Posterior);
        let mut whole = Training::tune(recipe.clone(), &familiar, &own, &model).unwrap();
        whole.episode();
        let checkpoint = whole.checkpoint();
        whole.episode();
        let resumed = Training::tune(recipe.clone(), &familiar, &own, &model).unwrap();
        let mut resumed = resumed.resumed(&checkpoint).unwrap();
        resumed.episode();
        assert_eq!(
            whole.model().blob().unwrap(),
            resumed.model().blob().unwrap()
        );
        let other = Recipe { seed: 9, ..recipe };
        let refused = Training::tune(other, &familiar, &own, &model).unwrap();
        let refused = refused.resumed(&checkpoint);
        assert_eq!(refused.err(), Some(ResumeError::OtherRecipe));
    }

    /// A prior as sharp as certainty keeps the means where they were, no prior does not.
    #[test]
    fn the_prior_holds() {
        let (familiar, own) = (flights(4, 1, 1.0), flights(2, 2, 2.0));
        let mut model = shipped(&familiar);
        model.network.log_sigmas.fill(-12.0);
        let moved = |hold| {
            let recipe = recipe(&own, hold);
            let mut training = Training::tune(recipe, &familiar, &own, &model).unwrap();
            for _ in 0..3 {
                training.episode();
            }
            let pairs = training
                .network
                .means
                .iter()
                .zip(model.network.means.iter());
            pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>()
        };
        let (free, held) = (moved(Hold::Nothing), moved(Hold::Posterior));
        assert!(held < 0.9 * free, "{held} {free}");
    }

    /// None of the way is the shipped network, all of it the trained one, and between every weight lies between.
    #[test]
    fn a_tuned_model_goes_a_part_of_the_way() {
        let (familiar, own) = (flights(4, 1, 1.0), flights(2, 2, 2.0));
        let model = shipped(&familiar);
        let tuned = |blend| {
            let mut recipe = recipe(&own, Hold::Nothing);
            if let Some(tuning) = &mut recipe.tuning {
                tuning.blend = blend;
            }
            let mut training = Training::tune(recipe, &familiar, &own, &model).unwrap();
            training.episode();
            (training.model().weights(), training.network)
        };
        let (start, _) = tuned(0.0);
        assert_eq!(start, model.weights());
        let (end, trained) = tuned(1.0);
        assert_eq!(end, trained.gaussian_weights());
        assert_ne!(start, end);
        let (between, _) = tuned(0.25);
        for (of, part) in [
            ((&start.means, &end.means), &between.means),
            ((&start.log_sigmas, &end.log_sigmas), &between.log_sigmas),
        ] {
            for ((a, b), got) in of.0.iter().zip(of.1).zip(part) {
                assert!((got - (0.75 * a + 0.25 * b)).abs() < 1e-6);
            }
        }
    }

    /// Own flights that are faster than the model expects: manoeuvres are then taken to be common.
    #[test]
    fn manoeuvres_are_as_frequent_as_in_own_flights() {
        let familiar = flights(8, 1, 1.0);
        let model = shipped(&familiar);
        let shipped = model.parameters.hypotheses;
        let tuned = |own: &[Flight]| {
            let recipe = recipe(own, Hold::Nothing);
            let training = Training::tune(recipe, &familiar, own, &model).unwrap();
            training.model().parameters.hypotheses
        };
        let (calm, fast) = (tuned(&flights(4, 2, 1.0)), tuned(&flights(4, 2, 4.0)));
        let priors = |h: &Hypotheses<f64>| h.manoeuvres.iter().map(|m| m.prior).sum::<f64>();
        assert!(priors(&calm) < priors(&shipped), "{calm:?}");
        assert!(priors(&fast) > 2.0 * priors(&calm), "{calm:?} {fast:?}");
        assert_eq!(fast.outlier, shipped.outlier);
    }

    #[test]
    fn nothing_to_learn_from_is_an_error() {
        let familiar = flights(2, 1, 1.0);
        let model = shipped(&familiar);
        let none = Training::tune(recipe(&[], Hold::Nothing), &familiar, &[], &model);
        assert_eq!(none.err(), Some(TrainingError::NoFlights));
        let untuned = Training::tune(Recipe::DEFAULT, &familiar, &familiar, &model);
        assert_eq!(untuned.err(), Some(TrainingError::NoFlights));
        let mut short = familiar.clone();
        short[0].samples.truncate(40);
        let reasons = [too_short(&short[0]), too_short(&short[1])];
        let said = format!(
            "{}: 3.90 s, and 4.5 s is the least to learn from",
            short[0].name
        );
        assert_eq!(reasons, [Some(said), None]);
        assert_eq!(usable(short).len(), 1);
    }

    #[test]
    fn the_population_meets_half_way() {
        let familiar = flights(6, 1, 1.0);
        let model = shipped(&familiar);
        let fast = flights(6, 2, 3.0);
        let placed = refitted(&model, &fast, true).parameters.population;
        let known = model.parameters.population;
        let found = population_of(&fast).unwrap();
        assert_eq!(placed.range_m, known.range_m);
        assert!(placed.horizontal_sigma_mps > known.horizontal_sigma_mps);
        assert!(placed.horizontal_sigma_mps < found.horizontal_sigma_mps);
        let kept = refitted(&model, &fast, false).parameters.population;
        assert!((kept.height_m - 0.5 * (known.height_m + found.height_m)).abs() < 1e-9);
    }
}
