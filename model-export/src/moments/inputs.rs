//! What the networks of a blob read on the way of flights, noise by noise.

use crate::flights::flight::Flight;
use crate::memoryless::example::ExampleSettings;
use crate::memoryless::verification::measured_rows;
use crate::radar::noise::{NoiseLevel, NoiseTable};
use crate::recursive::encounter::Encounter;
use crate::recursive::model::RecursiveModel;
use crate::recursive::normalisation::Normalisation;
use crate::recursive::scenario::Scenario;
use crate::recursive::step::{Weighing, advance, features_of};
use bnkf::blob::{Blob, Kind};
use bnkf::network::Network;
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::schedule::OUTPUTS;

/// Normalised inputs under one noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The noise.
    pub name: String,
    /// One list for each estimate.
    pub inputs: Vec<Vec<f32>>,
}

/// About `count` inputs of `blob` under each noise of `scenario`, evenly spread over `flights` and
/// rates; a recursive one meets them with its mean weights.
#[must_use]
pub fn levels(
    blob: &Blob<'_>,
    scenario: Scenario,
    flights: &[Flight],
    count: usize,
    seed: u64,
) -> Vec<Level> {
    match blob.kind() {
        Kind::Memoryless => memoryless(blob, flights, count, seed),
        Kind::Recursive => recursive(blob, scenario, flights, count, seed),
    }
}

fn memoryless(blob: &Blob<'_>, flights: &[Flight], count: usize, seed: u64) -> Vec<Level> {
    let settings = ExampleSettings {
        layout: blob.features(),
        table: NoiseTable::Radians,
        // Only the loss depends on it.
        range_spread_m: 1.0,
    };
    let level = |level: NoiseLevel| {
        let rows = measured_rows(blob, flights, level, &settings, count, seed);
        Level {
            name: level.to_string(),
            inputs: (0..rows.len().min(count))
                .map(|row| rows.features_of(row).to_vec())
                .collect(),
        }
    };
    NoiseLevel::ALL.map(level).into()
}

fn recursive(
    blob: &Blob<'_>,
    scenario: Scenario,
    flights: &[Flight],
    count: usize,
    seed: u64,
) -> Vec<Level> {
    let (Some((parameters, normalisation)), Some(view)) =
        (RecursiveModel::surroundings(blob), blob.networks().next())
    else {
        return Vec::new();
    };
    let network = Network::new(view);
    let cells = scenario.cells(flights, seed);
    // Every scenario has three noises with three rates each.
    let level = |cells: &[crate::recursive::trial::Cell]| {
        let met = cells.iter().flat_map(|cell| {
            let encounters = cell.encounters(&parameters.population);
            let follow =
                |encounter: &Encounter| met(&network, &parameters, &normalisation, encounter);
            encounters.iter().flat_map(follow).collect::<Vec<_>>()
        });
        let met: Vec<Vec<f32>> = met.collect();
        let every = (met.len() / count).max(1);
        Level {
            name: cells.first().map_or_else(String::new, |cell| {
                let name = cell.name.split([',', ' ']).next();
                name.unwrap_or_default().to_owned()
            }),
            inputs: met.into_iter().step_by(every).take(count).collect(),
        }
    };
    cells.chunks(3).map(level).collect()
}

/// Every input on the way of one flight.
fn met(
    network: &Network<'_>,
    parameters: &Parameters<f64>,
    normalisation: &Normalisation,
    encounter: &Encounter,
) -> Vec<Vec<f32>> {
    let mut carry = encounter.start;
    let meet = |arrival: &crate::recursive::step::Arrival<f64>| {
        let inputs = normalisation
            .apply(&features_of(&carry, arrival.dt_s))
            .map(|x| x as f32);
        let mut outputs = [0.0_f32; OUTPUTS];
        network.mean_pass(&inputs, &mut outputs);
        let outputs = outputs.map(f64::from);
        carry = advance(&carry, &outputs, arrival, parameters, Weighing::All);
        inputs.to_vec()
    };
    encounter.arrivals.iter().map(meet).collect()
}
