//! A tracker with everything that a call works with, and networks that answer what a test wants.

use super::super::*;
use crate::blob::Blob;
use crate::blob::draft::Draft;
use crate::estimate::Estimate;
use crate::inference::Inference;
use crate::measurement::Sensed;
use crate::recursive::features::FEATURES;
use crate::recursive::parameters::Parameters;
use crate::recursive::schedule::OUTPUTS;
use crate::rng::seeded;
use crate::settings::Correction;

pub(super) type Outputs = [f32; OUTPUTS];

pub(super) fn measurement(time_us: u64, range: f32, azimuth: f32) -> Measurement {
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    Measurement {
        time_us,
        range: sensed(range, 0.3),
        elevation: sensed(0.45, 0.01),
        azimuth: sensed(azimuth, 0.01),
        range_rate: sensed(0.8, 0.1),
        sensor: crate::sensor::Sensor::ORIGIN,
    }
}

/// A network whose weights are zero answers with its biases, scaled back: these outputs.
pub(super) fn constant(outputs: Outputs) -> Draft {
    let mut draft = Draft::recursive(3);
    for layer in &mut draft.networks[0] {
        layer.means.fill(0);
        layer.variance_codes.fill(0);
        layer.bias_mean.fill(0.0);
        layer.bias_variance.fill(0.0);
    }
    for (i, output) in outputs.into_iter().enumerate() {
        let (mean, scale) = (0.25 * (i % 5) as f32, [0.5, 2.0][i % 2]);
        draft.outputs[i] = [mean, scale];
        draft.networks[0][1].bias_mean[i] = (output - mean) / scale;
    }
    draft
}

/// Outputs that are exact in single precision, none zero.
pub(super) fn outputs() -> Outputs {
    core::array::from_fn(|i| (((i * 7) % 9) as f32 - 3.5) * 0.125)
}

pub(super) fn settings() -> Settings {
    Settings {
        correction: Correction::Polar,
        inference: Inference::Mean,
        seed: 5,
    }
}

pub(super) fn parameters() -> Parameters<f32> {
    let bytes = constant(outputs()).bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    Parameters::read(blob.parameters())
}

/// Everything that a call works with, owned.
pub(super) struct Bench<'a> {
    pub(super) model: Model<'a>,
    pub(super) settings: Settings,
    pub(super) rng: Generator,
    pub(super) belief: Belief,
    pub(super) workspace: Workspace,
}

impl<'a> Bench<'a> {
    pub(super) fn new(blob: Blob<'a>, settings: Settings) -> Self {
        Self {
            model: Model::new(blob),
            rng: seeded(settings.seed),
            settings,
            belief: Belief::NONE,
            workspace: Workspace::new(),
        }
    }

    pub(super) fn run(&mut self) -> Recursive<'_, 'a> {
        Recursive {
            model: &self.model,
            settings: &self.settings,
            rng: &mut self.rng,
            belief: &mut self.belief,
            workspace: &mut self.workspace,
        }
    }

    pub(super) fn step(
        &mut self,
        measurement: &Measurement,
        anew: bool,
    ) -> Result<Estimate, StepError> {
        let outcome = self.run().step(measurement, anew)?;
        Ok(self.model.estimate(&now(self), outcome))
    }

    pub(super) fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let outcome = self.run().coast(time_us)?;
        Ok(self.model.estimate(&now(self), outcome))
    }

    pub(super) fn infer(&mut self, inputs: &mut [f32; FEATURES]) -> (Outputs, [f32; 3]) {
        let mut outputs = [0.0; OUTPUTS];
        let jerk_variance = self.run().infer(inputs, &mut outputs);
        (outputs, jerk_variance)
    }
}

pub(super) fn started(bytes: &[u8]) -> Bench<'_> {
    let blob = Blob::parse(bytes).expect("a blob");
    let mut tracker = Bench::new(blob, settings());
    let estimate = tracker.step(&measurement(0, 33.0, 0.5), false);
    assert_eq!(estimate.expect("an estimate").mode, Mode::Started);
    tracker
}

pub(super) fn now(tracker: &Bench<'_>) -> Target {
    tracker.belief.target.expect("a target")
}

pub(super) fn near(a: f32, b: f32, scale: f32) -> bool {
    (a - b).abs() <= 1e-5 * scale.abs().max(1e-3)
}
