//! The examples of every epoch, made anew from the flights with fresh noise.

use crate::flights::data_hash;
use crate::flights::flight::Flight;
use crate::flights::held_out::{HeldOut, HeldOutError, hold_out};
use crate::memoryless::example::{Condition, Example, ExampleSettings, examples};
use crate::memoryless::normalisation::Normalisations;
use crate::memoryless::rows::Rows;
use crate::memoryless::training_settings::{ErrorScale, TrainingSettings};
use crate::random_source::RandomSource;
use crate::seed;
use rayon::prelude::*;

/// Most rows that are in memory at a time: about 40 MB.
const CHUNK_ROWS: usize = 1 << 19;

/// Flights, and how they become rows.
#[derive(Clone, Debug)]
pub struct TrainingData {
    /// Fingerprint of all flights.
    pub sha256: String,
    /// The split of the flights.
    pub split: HeldOut,
    /// Affine maps, fixed by the first draw of the training examples.
    pub normalisation: Normalisations,
    /// Training positions: samples of the training flights.
    pub positions: usize,
    /// Standard deviation of a velocity component over the training flights, m/s.
    pub speed_sigma_mps: f64,
    /// Standard deviation of an acceleration component over the training flights, m/s^2.
    pub acceleration_sigma_mps2: f64,
    /// Rows of the held-out flights; their noise never changes.
    pub validation: Rows,
    settings: ExampleSettings,
    error_scale: ErrorScale,
    outputs: usize,
    seed: u64,
}

/// One pass over one flight.
#[derive(Clone, Copy, Debug)]
struct Pass<'a> {
    flight: &'a Flight,
    condition: Condition,
}

impl TrainingData {
    /// Splits `flights` and fixes the normalisation.
    ///
    /// # Errors
    /// There are too few flights to hold one out.
    pub fn new(flights: Vec<Flight>, settings: &TrainingSettings) -> Result<Self, HeldOutError> {
        let sha256 = data_hash::of_flights(&flights);
        let split = hold_out(flights, settings.held_out, settings.seed)?;
        let example_settings = ExampleSettings {
            layout: settings.features.layout(),
            table: settings.noise_table,
            range_spread_m: range_spread_m(&split.training),
        };
        let inputs = settings.features.layout().len();
        let mut data = Self {
            sha256,
            positions: split
                .training
                .iter()
                .map(|flight| flight.samples.len())
                .sum(),
            speed_sigma_mps: component_sigma(&split.training, velocities),
            acceleration_sigma_mps2: component_sigma(&split.training, accelerations),
            normalisation: Normalisations {
                inputs: Vec::new(),
                output_mean_m: [0.0; 3],
                output_scale_m: 1.0,
            },
            validation: Rows::new(inputs, 3),
            settings: example_settings,
            error_scale: settings.error_scale,
            outputs: 3 / settings.networks(),
            seed: settings.seed,
            split,
        };
        let fixed = |name| seed::derive(settings.seed, &[seed::name_id(name)]);
        let first = data.examples(&passes(&data.split.training), fixed("normalisation noise"));
        data.normalisation = Normalisations::of(&first, inputs);
        let held_out = data.examples(&passes(&data.split.validation), fixed("validation noise"));
        data.validation = data.rows(&held_out);
        Ok(data)
    }

    /// Number of chunks that an epoch is cut into.
    #[must_use]
    pub fn chunks(&self) -> usize {
        self.chunk_bounds(&passes(&self.split.training)).len()
    }

    /// Rows of chunk `chunk` of epoch `epoch`: every pass over a training flight falls in one of
    /// an epoch's chunks, at random, with noise of its own.
    #[must_use]
    pub fn chunk(&self, epoch: u32, chunk: usize) -> Rows {
        let noise = seed::derive(self.seed, &[seed::name_id("epoch"), u64::from(epoch)]);
        self.rows(&self.examples(&self.chunk_passes(epoch, chunk), noise))
    }

    fn chunk_passes(&self, epoch: u32, chunk: usize) -> Vec<Pass<'_>> {
        let mut passes = passes(&self.split.training);
        let bounds = self.chunk_bounds(&passes);
        let order = [seed::name_id("order of passes"), u64::from(epoch)];
        RandomSource::new(self.seed, &order).shuffle(&mut passes);
        passes[bounds[chunk].clone()].to_vec()
    }

    fn chunk_bounds(&self, passes: &[Pass<'_>]) -> Vec<std::ops::Range<usize>> {
        let samples: usize = passes.iter().map(|pass| pass.flight.samples.len()).sum();
        let chunks = samples.div_ceil(CHUNK_ROWS).min(passes.len()).max(1);
        (0..chunks)
            .map(|c| c * passes.len() / chunks..(c + 1) * passes.len() / chunks)
            .collect()
    }

    fn examples(&self, passes: &[Pass<'_>], seed: u64) -> Vec<Example> {
        let lists: Vec<Vec<Example>> = passes
            .par_iter()
            .map(|pass| examples(pass.flight, pass.condition, &self.settings, seed))
            .collect();
        lists.into_iter().flatten().collect()
    }

    fn rows(&self, examples: &[Example]) -> Rows {
        let mut rows = Rows::new(self.settings.layout.len(), 3);
        let square_m2 = f64::from(self.normalisation.output_scale_m).powi(2);
        for example in examples {
            self.normalisation
                .push_features(&example.features, &mut rows.features);
            rows.targets
                .extend(self.normalisation.target(example.position_m));
            let weight = match self.error_scale {
                ErrorScale::Whitened => 0.5 * square_m2 / example.attainable_variance_m2,
                ErrorScale::Metres => square_m2 / self.outputs as f64,
            };
            rows.weights.push(weight as f32);
        }
        rows
    }
}

fn passes(flights: &[Flight]) -> Vec<Pass<'_>> {
    let conditions = Condition::all();
    flights
        .iter()
        .flat_map(|flight| {
            conditions
                .iter()
                .map(move |&condition| Pass { flight, condition })
        })
        .collect()
}

fn range_spread_m(flights: &[Flight]) -> f64 {
    let ranges = flights
        .iter()
        .flat_map(|flight| &flight.samples)
        .map(|sample| sample.position_m.iter().map(|c| c * c).sum::<f64>().sqrt());
    // Flights at one range all the way say nothing about where others will be.
    standard_deviation(ranges).max(1.0)
}

/// Root mean square of the components that `vectors` gives for a flight, at least 1e-3.
fn component_sigma(flights: &[Flight], vectors: fn(&Flight) -> Vec<[f64; 3]>) -> f64 {
    let squares: Vec<f64> = flights
        .iter()
        .flat_map(vectors)
        .map(|v| v.iter().map(|c| c * c).sum::<f64>() / 3.0)
        .collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    mean.sqrt().max(1e-3)
}

fn velocities(flight: &Flight) -> Vec<[f64; 3]> {
    flight
        .samples
        .iter()
        .map(|sample| sample.velocity_mps)
        .collect()
}

fn accelerations(flight: &Flight) -> Vec<[f64; 3]> {
    let pairs = flight.samples.windows(2);
    pairs
        .map(|pair| {
            let step_s = pair[1].time_s - pair[0].time_s;
            [0, 1, 2].map(|axis| (pair[1].velocity_mps[axis] - pair[0].velocity_mps[axis]) / step_s)
        })
        .collect()
}

fn standard_deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::TrainingData;
    use crate::flights::generator::{GeneratorSettings, generate};
    use crate::memoryless::training_settings::{ErrorScale, TrainingSettings};

    fn data(change: impl Fn(&mut TrainingSettings)) -> TrainingData {
        let flights = generate(&GeneratorSettings {
            flights: 10,
            duration_s: 5.0,
            ..GeneratorSettings::default()
        });
        let mut settings = TrainingSettings {
            held_out: 0.2,
            ..TrainingSettings::default()
        };
        change(&mut settings);
        TrainingData::new(flights.unwrap(), &settings).unwrap()
    }

    #[test]
    fn epochs_hold_the_same_positions_with_other_noise() {
        let data = data(|_| {});
        assert_eq!(
            (data.split.training.len(), data.split.validation.len()),
            (8, 2)
        );
        assert_eq!((data.positions, data.chunks()), (8 * 50, 1));
        let (one, two) = (data.chunk(0, 0), data.chunk(1, 0));
        // Rates 1, 3/4 and 1/2, rounded per gap period, at three noise levels.
        let expected = 400.0 * 3.0 * 2.25;
        assert!(
            (one.len() as f64 / expected - 1.0).abs() < 0.1,
            "{}",
            one.len()
        );
        assert_eq!(one, data.chunk(0, 0));
        assert_ne!(one.features[..26], two.features[..26]);
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        assert!(mean(&one.features).abs() < 0.05);
        assert!(data.speed_sigma_mps > 0.3 && data.speed_sigma_mps < 3.0);
        assert!(data.acceleration_sigma_mps2 > 0.3 && data.acceleration_sigma_mps2 < 5.0);
    }

    #[test]
    fn weights_turn_normalised_errors_into_the_stated_units() {
        let metres = data(|settings| settings.error_scale = ErrorScale::Metres);
        let scale = metres.normalisation.output_scale_m;
        assert!((metres.validation.weights[0] - scale * scale / 3.0).abs() < 1e-3);
        let whitened = data(|_| {});
        let weights = &whitened.validation.weights;
        let (least, most) = weights
            .iter()
            .fold((f32::MAX, 0.0_f32), |(l, m), &w| (l.min(w), m.max(w)));
        // From high noise (errors of several metres) to low noise (about half a metre).
        assert!(most / least > 30.0, "{least} {most}");
    }
}
