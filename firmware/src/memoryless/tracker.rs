//! The memoryless tracker: the network's estimate of the current position, corrected by the
//! measurement (paper Section IV-C and IV-D).

use nalgebra::{Matrix3, Vector3};

use super::coast::{Fix, Population, extrapolate};
use super::features::{FEATURES_MAX, features};
use super::plot::Plot;
use crate::blob::{Blob, FeatureLayout, Floats, field};
use crate::cholesky::make_definite;
use crate::clock::seconds_between;
use crate::ekf::{EkfError, correct_polar, correct_position};
use crate::estimate::{Doubt, Estimate, Mode, NIS_MAX, POSITION_SIGMA_MAX_M};
use crate::likelihood::Likelihood;
use crate::measurement::{Measurement, Vectors};
use crate::network::monte_carlo::{Sampling, moments};
use crate::network::{Network, Scratch};
use crate::radar::{converted, innovations, predict};
use crate::rng::{Generator, seeded};
use crate::sensor::Sensor;
use crate::settings::{Correction, Settings};
use crate::step_error::StepError;

/// A previous measurement older than this is forgotten: the next one starts anew.
const PREVIOUS_AGE_MAX_US: u64 = 2_000_000;

/// Variance added to each axis of the network's covariance, m^2: a millimetre, so that few passes
/// or a collapsed posterior still give a positive definite matrix.
const VARIANCE_FLOOR_M2: f32 = 1e-6;

/// Estimates the position of one target from its radar measurements, with the networks of a
/// memoryless blob: one for all axes (BNKF) or one per axis (BNKFe).
pub(crate) struct Memoryless<'a> {
    blob: Blob<'a>,
    settings: Settings,
    population: Population,
    rng: Generator,
    scratch: Scratch,
    previous: Option<Plot>,
    latest: Option<Fix>,
    before: Option<Fix>,
}

/// What a [`Memoryless`] knows at one time.
#[derive(Clone)]
pub(crate) struct Snapshot {
    rng: Generator,
    previous: Option<Plot>,
    latest: Option<Fix>,
    before: Option<Fix>,
}

impl<'a> Memoryless<'a> {
    /// A tracker that has seen nothing yet; `settings` fit the blob.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Self {
        let parameters = blob.parameters();
        Self {
            blob,
            settings,
            population: Population {
                speed_sigma: parameters.get(field::PARAMETER_SPEED_SIGMA),
                acceleration_sigma: parameters.get(field::PARAMETER_ACCELERATION_SIGMA),
            },
            rng: seeded(settings.seed),
            scratch: Scratch::new(),
            previous: None,
            latest: None,
            before: None,
        }
    }

    /// A copy of what it knows.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            rng: self.rng.clone(),
            previous: self.previous,
            latest: self.latest,
            before: self.before,
        }
    }

    /// Goes back to what it knew when `snapshot` was taken.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.rng = snapshot.rng.clone();
        self.previous = snapshot.previous;
        self.latest = snapshot.latest;
        self.before = snapshot.before;
    }

    /// Forgets the target and starts the random stream again.
    pub fn reset(&mut self) {
        self.rng = seeded(self.settings.seed);
        self.previous = None;
        self.latest = None;
        self.before = None;
    }

    /// The estimate at the time of `measurement`, whose values and time were checked; `anew` when
    /// its time does not follow the ones before.
    pub fn step(&mut self, measurement: &Measurement, anew: bool) -> Result<Estimate, StepError> {
        let plot = Plot::of(measurement)?;
        if anew {
            self.previous = None;
            self.latest = None;
            self.before = None;
        }
        let recent = self.previous.filter(|previous| {
            measurement.time_us.saturating_sub(previous.time_us) <= PREVIOUS_AGE_MAX_US
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
                let variances = vectors.sigmas.map(|sigma| sigma * sigma);
                correct_polar(&position.into(), &covariance.into(), &vectors, &variances)
                    .0
                    .checked()
                    .map(|c| (c.state.into(), c.covariance.into(), c.nis))
                    .map_err(StepError::Correction)?
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
        self.before = recent.and(self.latest);
        self.latest = Some(fix);
        self.previous = Some(plot);
        let mode = if recent.is_some() {
            Mode::Tracking
        } else {
            Mode::Started
        };
        Ok(estimate(&fix, nis, mode))
    }

    /// The estimate at `time_us` without a measurement: the last two estimates extrapolated, with
    /// a covariance that grows (rule in the module `coast`).
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let ahead = self.ahead(time_us);
        if ahead == Err(StepError::Lost) {
            self.latest = None;
            self.previous = None;
        }
        ahead
    }

    /// What [`Memoryless::coast`] would say at each of `times_us`; nothing is forgotten.
    pub fn forecasts<const N: usize>(
        &self,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        let latest = self.latest.as_ref().ok_or(StepError::NotStarted)?;
        let mut forecasts = [estimate(latest, 0.0, Mode::Coasting); N];
        for (forecast, &time_us) in forecasts.iter_mut().zip(times_us) {
            *forecast = self.ahead(time_us)?;
        }
        Ok(forecasts)
    }

    /// What the last two estimates, extrapolated, say of a measurement's position, whose values were
    /// checked. Nothing is known of the velocity beside it, so the range-rate does not count.
    pub fn likelihood(&self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        if measurement.sensor != Sensor::ORIGIN {
            return Err(StepError::Sensor);
        }
        let ahead = self.ahead(measurement.time_us)?;
        let mut vectors = Vectors::from(measurement);
        vectors.present[3] = 0.0;
        let spoilt = StepError::Correction(EkfError::NotFinite);
        let variances = vectors.sigmas.map(|sigma| sigma * sigma);
        let (position, covariance) = (&ahead.position_m, &ahead.covariance_m2);
        let corrected = correct_polar(position, covariance, &vectors, &variances).0;
        let corrected = corrected.checked().map_err(StepError::Correction)?;
        let expected = predict(ahead.position_m, [0.0; 3]).measurement;
        let innovation = innovations(&vectors.measured, &expected);
        Likelihood::new(innovation, &vectors, &corrected, corrected.nis).ok_or(spoilt)
    }

    fn ahead(&self, time_us: u64) -> Result<Estimate, StepError> {
        let latest = self.latest.as_ref().ok_or(StepError::NotStarted)?;
        let mut fix = extrapolate(latest, self.before.as_ref(), self.population, time_us);
        let mut covariance = fix.covariance.into();
        let variance_max = POSITION_SIGMA_MAX_M * POSITION_SIGMA_MAX_M;
        if make_definite(&mut covariance).is_err()
            || (0..3).any(|axis| covariance[axis][axis] > variance_max)
            || !fix.position.iter().all(|x| x.is_finite())
        {
            return Err(StepError::Lost);
        }
        fix.covariance = covariance.into();
        Ok(estimate(&fix, 0.0, Mode::Coasting))
    }

    /// Mean (m) and covariance (m^2) of the networks' outputs for two measurements.
    fn infer(
        &mut self,
        previous: &Plot,
        current: &Plot,
        age_s: f32,
    ) -> (Vector3<f32>, Matrix3<f32>) {
        let layout = self.blob.features();
        let mut inputs = features(layout, previous, current, age_s);
        normalise(layout, self.blob.input_normalisation(), &mut inputs);
        let inputs = &inputs[..layout.len().min(FEATURES_MAX)];
        let (passes, sampling) = (
            self.settings.passes,
            Sampling::Activations(self.settings.spread),
        );
        let mut mean = Vector3::zeros();
        let mut covariance = Matrix3::zeros();
        for (axis, view) in self.blob.networks().enumerate() {
            let network = Network::new(view);
            if self.blob.network_count() == 1 {
                let joint = moments::<3>(
                    &network,
                    inputs,
                    passes,
                    sampling,
                    &mut self.rng,
                    &mut self.scratch,
                );
                mean = Vector3::from(joint.mean);
                covariance = Matrix3::from_fn(|i, j| joint.covariance[i][j]);
            } else {
                let single = moments::<1>(
                    &network,
                    inputs,
                    passes,
                    sampling,
                    &mut self.rng,
                    &mut self.scratch,
                );
                let slots = (mean.get_mut(axis), covariance.get_mut((axis, axis)));
                if let (Some(mean), Some(variance)) = slots {
                    [*mean] = single.mean;
                    [[*variance]] = single.covariance;
                }
            }
        }
        let output = self.blob.output_normalisation();
        let scale = |axis: usize| output.get(2 * axis + 1);
        let position = Vector3::from_fn(|axis, _| output.get(2 * axis) + scale(axis) * mean[axis]);
        let covariance = Matrix3::from_fn(|i, j| covariance[(i, j)] * scale(i) * scale(j))
            + Matrix3::identity() * VARIANCE_FLOOR_M2;
        (position, covariance)
    }
}

fn normalise(layout: FeatureLayout, pairs: Floats<'_>, inputs: &mut [f32; FEATURES_MAX]) {
    for (i, input) in inputs.iter_mut().enumerate().take(layout.len()) {
        *input = (*input - pairs.get(2 * i)) * pairs.get(2 * i + 1);
    }
}

fn estimate(fix: &Fix, nis: f32, mode: Mode) -> Estimate {
    Estimate {
        time_us: fix.time_us,
        position_m: fix.position.into(),
        covariance_m2: core::array::from_fn(|i| core::array::from_fn(|j| fix.covariance[(i, j)])),
        nis: nis.min(NIS_MAX),
        doubt: Doubt::NONE,
        mode,
        outside: false,
        motion: None,
    }
}

#[cfg(test)]
mod tests;
