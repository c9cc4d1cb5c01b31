//! The memoryless tracker: the network's estimate of the current position, corrected by the
//! measurement (paper Section IV-C and IV-D).

use nalgebra::{Matrix3, Vector3};

use super::coast::{Fix, Population, extrapolate};
use super::features::{FEATURES_MAX, features};
use super::plot::Plot;
use crate::blob::{Blob, FeatureLayout, Floats, field};
use crate::cholesky::make_definite;
use crate::clock::seconds_between;
use crate::ekf::{Corrected, EkfError, correct_polar, correct_position};
use crate::estimate::{Doubt, Estimate, Mode, NIS_MAX, Outcome, POSITION_SIGMA_MAX_M};
use crate::inference::Inference;
use crate::likelihood::Likelihood;
use crate::measurement::{Channel, Measurement, Vectors};
use crate::network::monte_carlo::{self, Moments, Sampling};
use crate::network::repeats::Repeats;
use crate::network::{Network, moments};
use crate::part::Part;
use crate::radar::{converted, innovations, predict};
use crate::recursive::correction::GATE_NIS;
use crate::rng::Generator;
use crate::sensor::Sensor;
use crate::settings::{Correction, Settings};
use crate::step_error::StepError;
use crate::workspace::Workspace;

/// A previous measurement older than this is forgotten: the next one starts anew.
pub const PREVIOUS_AGE_MAX_US: u64 = 2_000_000;

/// Variance added to each axis of the network's covariance, m^2: a millimetre, so that few passes
/// or a collapsed posterior still give a positive definite matrix.
const VARIANCE_FLOOR_M2: f32 = 1e-6;

/// A memoryless blob, and what of it is asked at every step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Model<'a> {
    pub(crate) blob: Blob<'a>,
    population: Population,
    /// Of every network, where moments are built.
    repeats: [[Repeats; field::NETWORKS_MAX]; Part::Moments.count()],
}

impl<'a> Model<'a> {
    /// Reads what surrounds the networks.
    pub fn new(blob: Blob<'a>) -> Self {
        let parameters = blob.parameters();
        let mut repeats = [[Repeats::NONE; field::NETWORKS_MAX]; Part::Moments.count()];
        if Part::Moments.is_built() {
            for (repeats, view) in repeats.iter_mut().flatten().zip(blob.networks()) {
                *repeats = Repeats::of(&Network::new(view));
            }
        }
        Self {
            blob,
            repeats,
            population: Population {
                speed_sigma: parameters.get(field::PARAMETER_SPEED_SIGMA),
                acceleration_sigma: parameters.get(field::PARAMETER_ACCELERATION_SIGMA),
            },
        }
    }
}

/// What is remembered of one target.
#[derive(Clone, Debug)]
pub(crate) struct Past {
    pub(crate) previous: Option<Plot>,
    pub(crate) latest: Option<Fix>,
    pub(crate) before: Option<Fix>,
}

impl Past {
    /// Nothing.
    pub const NONE: Self = Self {
        previous: None,
        latest: None,
        before: None,
    };
}

/// Estimates the position of one target from its radar measurements, with the networks of a
/// memoryless blob: one for all axes (BNKF) or one per axis (BNKFe). What one call works with.
pub(crate) struct Memoryless<'r, 'a> {
    pub model: &'r Model<'a>,
    pub settings: &'r Settings,
    pub rng: &'r mut Generator,
    pub past: &'r mut Past,
    pub workspace: &'r mut Workspace,
}

impl Memoryless<'_, '_> {
    /// Takes in a measurement, whose values and time were checked; `anew` when its time does not follow
    /// the ones before.
    #[inline(never)]
    pub fn step(&mut self, measurement: &Measurement, anew: bool) -> Result<Outcome, StepError> {
        let plot = Plot::of(measurement)?;
        let recent = self.past.previous.filter(|previous| {
            let age_us = measurement.time_us.saturating_sub(previous.time_us);
            !anew && age_us <= PREVIOUS_AGE_MAX_US
        });
        let previous = recent.unwrap_or(plot);
        let age_s = seconds_between(previous.time_us, measurement.time_us);
        let (position, covariance) = self.infer(&previous, &plot, age_s);
        if !position
            .iter()
            .chain(covariance.iter())
            .all(|value| value.is_finite())
        {
            return Err(StepError::NetworkNotFinite);
        }
        let (position, covariance, nis) = match self.settings.correction {
            Correction::None => (position, covariance, 0.0),
            Correction::Converted => correct_position(
                position.into(),
                covariance.into(),
                &converted(plot.range, plot.elevation, plot.azimuth),
            )
            .map(|c| (c.state.into(), c.covariance.into(), c.nis))
            .map_err(StepError::Correction)?,
            Correction::Polar => {
                let vectors = Vectors::from(measurement);
                let c = corrected(&position.into(), &covariance.into(), &vectors)?;
                (c.state.into(), c.covariance.into(), c.nis)
            }
        };
        let mut covariance: [[f32; 3]; 3] = covariance.into();
        make_definite(&mut covariance)
            .map_err(|_| StepError::Correction(EkfError::NotPositiveDefinite))?;
        let covariance = covariance.into();
        let fix = Fix {
            time_us: measurement.time_us,
            position,
            covariance,
        };
        self.past.before = recent.and(self.past.latest);
        self.past.latest = Some(fix);
        self.past.previous = Some(plot);
        let mode = if recent.is_some() {
            Mode::Tracking
        } else {
            Mode::Started
        };
        let doubt = Doubt::NONE;
        Ok(Outcome { nis, mode, doubt })
    }

    /// The estimate at `time_us` without a measurement: the last two estimates extrapolated, with
    /// a covariance that grows (rule in the module `coast`).
    #[inline(never)]
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let ahead = self.ahead(time_us);
        if ahead == Err(StepError::Lost) {
            *self.past = Past::NONE;
        }
        ahead
    }

    /// Gives what [`Memoryless::coast`] would say at each of `times_us` to `each`, with its place; nothing
    /// is forgotten.
    #[inline(never)]
    pub fn forecast_each(
        &self,
        times_us: &[u64],
        each: &mut dyn FnMut(usize, &Estimate),
    ) -> Result<(), StepError> {
        for (place, &time_us) in times_us.iter().enumerate() {
            each(place, &self.ahead(time_us)?);
        }
        Ok(())
    }

    /// What the last two estimates, extrapolated, say of a measurement's position, whose values were
    /// checked. Nothing is known of the velocity beside it, so the range-rate does not count.
    #[inline(never)]
    pub fn likelihood(&self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        if measurement.sensor != Sensor::ORIGIN {
            return Err(StepError::Sensor);
        }
        let ahead = self.ahead(measurement.time_us)?;
        let mut vectors = Vectors::from(measurement);
        vectors.present[3] = 0.0;
        if vectors.present == [0.0; 4] {
            // A range-rate alone, which it knows nothing of.
            return Err(StepError::Missing(Channel::Range));
        }
        let spoilt = StepError::Correction(EkfError::NotFinite);
        let corrected = corrected(&ahead.position_m, &ahead.covariance_m2, &vectors)?;
        let expected = predict(ahead.position_m, [0.0; 3]).measurement;
        let innovation = innovations(&vectors, &expected);
        Likelihood::new(
            innovation,
            &vectors,
            corrected.nis,
            corrected.ln_root,
            corrected.nis < GATE_NIS as f32,
        )
        .ok_or(spoilt)
    }

    fn ahead(&self, time_us: u64) -> Result<Estimate, StepError> {
        let latest = self.past.latest.as_ref().ok_or(StepError::NotStarted)?;
        let mut fix = extrapolate(
            latest,
            self.past.before.as_ref(),
            self.model.population,
            time_us,
        );
        let mut covariance = fix.covariance.into();
        let variance_max = POSITION_SIGMA_MAX_M * POSITION_SIGMA_MAX_M;
        if make_definite(&mut covariance).is_err()
            || (0..3).any(|axis| covariance[axis][axis] > variance_max)
            || !fix.position.iter().all(|x| x.is_finite())
        {
            return Err(StepError::Lost);
        }
        fix.covariance = covariance.into();
        Ok(estimate(&fix, Outcome::uncorrected(Mode::Coasting)))
    }

    /// Mean (m) and covariance (m^2) of the networks' outputs for two measurements.
    fn infer(
        &mut self,
        previous: &Plot,
        current: &Plot,
        age_s: f32,
    ) -> (Vector3<f32>, Matrix3<f32>) {
        let layout = self.model.blob.features();
        let mut inputs = features(layout, previous, current, age_s);
        normalise(layout, self.model.blob.input_normalisation(), &mut inputs);
        let inputs = &inputs[..layout.len().min(FEATURES_MAX)];
        let mut mean = Vector3::zeros();
        let mut covariance = Matrix3::zeros();
        for (axis, view) in self.model.blob.networks().enumerate() {
            let network = Network::new(view);
            let repeats = self.model.repeats.as_flattened().get(axis);
            let repeats = repeats.unwrap_or(&Repeats::NONE);
            if self.model.blob.network_count() == 1 {
                let joint = self.ask::<3>(&network, repeats, inputs);
                mean = Vector3::from(joint.mean);
                covariance = Matrix3::from_fn(|i, j| joint.covariance[i][j]);
            } else {
                let single = self.ask::<1>(&network, repeats, inputs);
                let slots = (mean.get_mut(axis), covariance.get_mut((axis, axis)));
                if let (Some(mean), Some(variance)) = slots {
                    [*mean] = single.mean;
                    [[*variance]] = single.covariance;
                }
            }
        }
        let output = self.model.blob.output_normalisation();
        let scale = |axis: usize| output.get(2 * axis + 1);
        let position = Vector3::from_fn(|axis, _| output.get(2 * axis) + scale(axis) * mean[axis]);
        let covariance = Matrix3::from_fn(|i, j| covariance[(i, j)] * scale(i) * scale(j))
            + Matrix3::identity() * VARIANCE_FLOOR_M2;
        (position, covariance)
    }

    fn ask<const N: usize>(
        &mut self,
        network: &Network<'_>,
        repeats: &Repeats,
        inputs: &[f32],
    ) -> Moments<N> {
        match self.settings.inference {
            Inference::Mean => {
                let mut mean = [0.0; N];
                network.mean_pass(inputs, &mut mean);
                Moments {
                    mean,
                    covariance: [[0.0; N]; N],
                }
            }
            Inference::Passes(passes) => monte_carlo::moments(
                network,
                inputs,
                passes.count(),
                Sampling::Activations(passes.spread()),
                self.rng,
                &mut self.workspace.scratch,
            ),
            Inference::Moments => {
                let mut mean = [0.0; N];
                let scratch = &mut self.workspace.scratch;
                let covariance = moments::outputs(network, repeats, inputs, &mut mean, 0, scratch);
                Moments { mean, covariance }
            }
        }
    }
}

/// The polar correction of a position, sound.
fn corrected(
    position: &[f32; 3],
    covariance: &[[f32; 3]; 3],
    vectors: &Vectors<f32>,
) -> Result<Corrected<f32, 3>, StepError> {
    let variances = vectors.sigmas.map(|sigma| sigma * sigma);
    let mut corrected = Corrected::before(position, covariance);
    correct_polar(&mut corrected, vectors, &variances);
    corrected.check().map_err(StepError::Correction)?;
    Ok(corrected)
}

fn normalise(layout: FeatureLayout, pairs: Floats<'_>, inputs: &mut [f32; FEATURES_MAX]) {
    for (i, input) in inputs.iter_mut().enumerate().take(layout.len()) {
        *input = (*input - pairs.get(2 * i)) * pairs.get(2 * i + 1);
    }
}

/// A fix as an estimate.
pub(crate) fn estimate(fix: &Fix, outcome: Outcome) -> Estimate {
    let Outcome { nis, mode, doubt } = outcome;
    Estimate {
        time_us: fix.time_us,
        position_m: fix.position.into(),
        covariance_m2: core::array::from_fn(|i| core::array::from_fn(|j| fix.covariance[(i, j)])),
        nis: nis.min(NIS_MAX),
        doubt,
        mode,
        outside: false,
        motion: None,
    }
}

#[cfg(test)]
mod tests;
