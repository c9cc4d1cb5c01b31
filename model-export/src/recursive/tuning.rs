//! Learning from a few flights of a user's own: a shipped model goes on training on them, half of
//! every batch still built-in flights, so that it forgets nothing, with the shipped posterior as
//! the prior of every weight.

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

/// Shortest flight to learn from, s.
pub const DURATION_MIN_S: f64 = 4.5;

/// What holds the weights where they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// The shipped posterior of every weight, three times as wide
    Posterior,
    /// The shipped means, all with three times their median deviation
    Isotropic,
    /// Nothing but rehearsal
    Nothing,
}

/// Width of the prior, in the shipped deviations.
const WIDTH: f64 = 3.0;

/// How a model is tuned; part of a [`super::recipe::Recipe`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Share of every batch that is built-in flights.
    pub rehearsal: f64,
    /// What holds the weights.
    pub hold: Hold,
    /// Whether own flights are moved into the volume; otherwise they stay where they were, turned
    /// about the radar.
    pub place: bool,
    /// SHA-256 of the model that was tuned.
    pub blob_sha256: String,
    /// SHA-256 of the own flights.
    pub flights_sha256: String,
}

impl Tuning {
    /// Half rehearsal, the shipped posterior as prior.
    pub fn new(blob_sha256: String, own: &[Flight], place: bool) -> Self {
        Self {
            rehearsal: 0.5,
            hold: Hold::Posterior,
            place,
            blob_sha256,
            flights_sha256: of_flights(own),
        }
    }

    /// How own flights are changed: turned and mirrored, and placed if they are to be.
    pub fn augmentation(&self) -> Augmentation {
        Augmentation {
            kept: !self.place,
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
    let long = |flight: &Flight| flight.duration_s() >= DURATION_MIN_S;
    flights.into_iter().filter(long).collect()
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
