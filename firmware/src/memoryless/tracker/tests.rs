use super::*;
use crate::blob::draft::Draft;
use crate::measurement::Sensed;
use crate::network::Scratch;
use crate::network::monte_carlo::moments;
use crate::rng::seeded;
use crate::spread::Spread;

fn measurement(time_us: u64, away: f32) -> Measurement {
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    Measurement {
        time_us,
        range: sensed(30.0 + away, 0.9),
        elevation: sensed(0.4 - 0.1 * away, 0.05),
        azimuth: sensed(-1.1 + 0.2 * away, 0.07),
        range_rate: sensed(0.6 - away, 0.3),
        sensor: crate::sensor::Sensor::ORIGIN,
    }
}

/// One network for all axes, every number of its normalisation another.
fn joint() -> Draft {
    let mut draft = Draft::memoryless(&[12, 6, 3], 11);
    for (i, pair) in draft.inputs.iter_mut().enumerate() {
        *pair = [i as f32 - 6.0, 0.3 + 0.02 * i as f32];
    }
    draft.outputs = std::vec![[5.0, 0.3], [-8.0, 0.2], [12.0, 0.4]];
    draft
}

fn settings(correction: Correction) -> Settings {
    Settings {
        correction,
        inference: Inference::of_passes(20).unwrap(),
        seed: 7,
    }
}

/// Everything that a call works with, owned.
struct Bench<'a> {
    model: Model<'a>,
    settings: Settings,
    rng: Generator,
    past: Past,
    workspace: Workspace,
}

impl<'a> Bench<'a> {
    fn new(blob: Blob<'a>, settings: Settings) -> Self {
        Self {
            model: Model::new(blob),
            rng: seeded(settings.seed),
            settings,
            past: Past::NONE,
            workspace: Workspace::new(),
        }
    }

    fn run(&mut self) -> Memoryless<'_, 'a> {
        Memoryless {
            model: &self.model,
            settings: &self.settings,
            rng: &mut self.rng,
            past: &mut self.past,
            workspace: &mut self.workspace,
        }
    }

    fn step(&mut self, measurement: &Measurement, anew: bool) -> Result<Estimate, StepError> {
        let outcome = self.run().step(measurement, anew)?;
        let fix = self.past.latest.as_ref().expect("a fix");
        Ok(estimate(fix, outcome))
    }

    fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        self.run().coast(time_us)
    }
}

/// What the networks say of two measurements: features, normalisation and scale by hand.
fn network_says(
    draft: &Draft,
    blob: &Blob<'_>,
    [before, now]: [&Measurement; 2],
    rng: &mut Generator,
) -> (Vector3<f32>, Matrix3<f32>) {
    let raw = |m: &Measurement| {
        let [elevation, azimuth, range, rate] = m.channels().map(|c| c.expect("whole"));
        [range, elevation, azimuth, rate]
    };
    let (before, now) = (raw(before), raw(now));
    let values = before.iter().chain(&now).map(|sensed| sensed.value);
    let features = values.chain(now.iter().map(|sensed| sensed.sigma));
    let pairs = features.zip(&draft.inputs);
    let inputs: std::vec::Vec<f32> = pairs
        .map(|(x, [mean, inverse])| (x - mean) * inverse)
        .collect();
    let (mut mean, mut covariance) = (Vector3::zeros(), Matrix3::zeros());
    let mut scratch = Scratch::new();
    let networks: std::vec::Vec<_> = blob.networks().map(Network::new).collect();
    let sampling = Sampling::Activations(Spread::Exact);
    if let [network] = &networks[..] {
        let joint = moments::<3>(network, &inputs, 20, sampling, rng, &mut scratch);
        mean = joint.mean.into();
        covariance = Matrix3::from_fn(|i, j| joint.covariance[i][j]);
    } else {
        for (axis, network) in networks.iter().enumerate() {
            let single = moments::<1>(network, &inputs, 20, sampling, rng, &mut scratch);
            mean[axis] = single.mean[0];
            covariance[(axis, axis)] = single.covariance[0][0];
        }
    }
    let offset = Vector3::from_fn(|i, _| draft.outputs[i][0]);
    let scale = Matrix3::from_diagonal(&Vector3::from_fn(|i, _| draft.outputs[i][1]));
    let floor = Matrix3::identity() * 1e-6;
    (offset + scale * mean, scale * covariance * scale + floor)
}

fn assert_near(estimate: &Estimate, position: [f32; 3], covariance: [[f32; 3]; 3]) {
    for i in 0..3 {
        let apart = estimate.position_m[i] - position[i];
        assert!(apart.abs() < 1e-4, "{i}: {apart}");
        for j in 0..3 {
            let apart = estimate.covariance_m2[i][j] - covariance[i][j];
            assert!(
                apart.abs() < 1e-4 * covariance[i][i].max(1e-3),
                "{i} {j}: {apart}"
            );
        }
    }
}

fn columns(matrix: Matrix3<f32>) -> [[f32; 3]; 3] {
    core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
}

/// Without a correction the estimate is the networks' own, joint or one per axis; the random stream
/// runs on from step to step.
#[test]
fn the_network_alone_is_scaled_back() {
    for draft in [joint(), Draft::ensemble(5)] {
        let bytes = draft.bytes();
        let blob = Blob::parse(&bytes).expect("a blob");
        let mut tracker = Bench::new(blob, settings(Correction::None));
        let mut rng = seeded(7);
        let (first, second) = (measurement(0, 0.0), measurement(100_000, 0.5));
        for (pair, mode) in [
            ([&first, &first], Mode::Started),
            ([&first, &second], Mode::Tracking),
        ] {
            let estimate = tracker.step(pair[1], false).expect("an estimate");
            let (position, covariance) = network_says(&draft, &blob, pair, &mut rng);
            assert_near(&estimate, position.into(), columns(covariance));
            assert_eq!((estimate.mode, estimate.nis), (mode, 0.0));
            assert_eq!(estimate.time_us, pair[1].time_us);
        }
    }
}

/// The same without passes, and with every weight at its mean, where nothing but a millimetre is in
/// doubt.
#[test]
fn moments_and_mean_weights_are_scaled_back() {
    for draft in [joint(), Draft::ensemble(5)] {
        let bytes = draft.bytes();
        let blob = Blob::parse(&bytes).expect("a blob");
        let seen = measurement(0, 0.0);
        let says = |inference| {
            let settings = Settings {
                inference,
                ..settings(Correction::None)
            };
            let mut tracker = Bench::new(blob, settings);
            tracker.step(&seen, false).expect("an estimate")
        };
        let (mean, moments) = (says(Inference::Mean), says(Inference::Moments));
        let sampled = says(Inference::of_passes(10_000).unwrap());
        for i in 0..3 {
            let sigma = sampled.covariance_m2[i][i].sqrt();
            for (estimate, sigmas) in [(&mean, 1.0), (&moments, 0.1)] {
                let apart = estimate.position_m[i] - sampled.position_m[i];
                assert!(apart.abs() < sigmas * sigma, "{i}: {apart} {sigma}");
            }
            assert!((mean.covariance_m2[i][i] - 1e-6).abs() < 1e-9);
            let share = moments.covariance_m2[i][i] / (sigma * sigma);
            assert!((share - 1.0).abs() < 0.2, "{i}: {share}");
            for j in 0..3 {
                // One network for each axis: nothing is shared.
                let shared = draft.networks.len() == 1 || i == j;
                assert_eq!(moments.covariance_m2[i][j] != 0.0, shared);
            }
        }
        assert_ne!(mean.position_m, moments.position_m);
        assert_eq!(moments, says(Inference::Moments));
    }
}

/// Both corrections of what the networks say, by the filter's own formulas.
#[test]
fn a_correction_is_made_of_what_the_network_says() {
    let draft = joint();
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let seen = measurement(0, 0.0);
    let (position, covariance) = network_says(&draft, &blob, [&seen, &seen], &mut seeded(7));
    let (position, covariance) = (position.into(), columns(covariance));
    let plot = Plot::of(&seen).expect("whole");
    let measured = converted(plot.range, plot.elevation, plot.azimuth);
    let vectors = Vectors::from(&seen);
    let variances = [0.0025, 0.0049, 0.81, 0.09];
    let mut polar = Corrected::before(&position, &covariance);
    correct_polar(&mut polar, &vectors, &variances);
    for (correction, expected) in [
        (
            Correction::Converted,
            correct_position(position, covariance, &measured).expect("sound"),
        ),
        (Correction::Polar, polar),
    ] {
        let mut tracker = Bench::new(blob, settings(correction));
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_near(&estimate, expected.state, expected.covariance);
        assert!((estimate.nis / expected.nis - 1.0).abs() < 1e-2 && estimate.nis > 1.0);
    }
}

/// Two seconds of silence are bridged, more are not: the measurement then is its own predecessor.
#[test]
fn an_old_measurement_is_forgotten() {
    let draft = joint();
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    for (time_us, anew, mode) in [
        (2_000_000, false, Mode::Tracking),
        (2_000_001, false, Mode::Started),
        (1_000_000, true, Mode::Started),
    ] {
        let mut tracker = Bench::new(blob, settings(Correction::None));
        let mut rng = seeded(7);
        let (first, second) = (measurement(0, 0.0), measurement(time_us, 0.5));
        tracker.step(&first, false).expect("an estimate");
        network_says(&draft, &blob, [&first, &first], &mut rng);
        let estimate = tracker.step(&second, anew).expect("an estimate");
        assert_eq!(estimate.mode, mode, "{time_us}");
        let before = if mode == Mode::Tracking {
            &first
        } else {
            &second
        };
        let (position, covariance) = network_says(&draft, &blob, [before, &second], &mut rng);
        assert_near(&estimate, position.into(), columns(covariance));
        // Nor does a coast remember what was before.
        let coasted = tracker.coast(time_us + 500_000).expect("a coast");
        let moved = (0..3).any(|i| coasted.position_m[i] != estimate.position_m[i]);
        assert_eq!(moved, mode == Mode::Tracking);
    }
}

/// A gap is coasted from the last two estimates, with the blob's population: 1.5 m/s and 2.5 m/s^2.
#[test]
fn a_coast_extrapolates_the_last_two_estimates_until_nothing_is_known() {
    let bytes = joint().bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(blob, settings(Correction::Converted));
    assert_eq!(tracker.coast(0), Err(StepError::NotStarted));
    let fixes = [(0, 0.0), (100_000, 0.5)].map(|(time_us, away)| {
        let estimate = tracker.step(&measurement(time_us, away), false);
        let estimate = estimate.expect("an estimate");
        Fix {
            time_us,
            position: estimate.position_m.into(),
            covariance: Matrix3::from_fn(|i, j| estimate.covariance_m2[i][j]),
        }
    });
    let population = Population {
        speed_sigma: 1.5,
        acceleration_sigma: 2.5,
    };
    // At 280 s the deviation is 98 km along each axis, at 284 s it is more than a hundred.
    for time_us in [400_000, 280_000_000] {
        let estimate = tracker.coast(time_us).expect("a coast");
        let expected = extrapolate(&fixes[1], Some(&fixes[0]), population, time_us);
        assert_near(
            &estimate,
            expected.position.into(),
            columns(expected.covariance),
        );
        assert_eq!((estimate.mode, estimate.nis), (Mode::Coasting, 0.0));
        assert_eq!(estimate.time_us, time_us);
    }
    assert_eq!(tracker.coast(284_500_000), Err(StepError::Lost));
    assert_eq!(tracker.coast(500_000), Err(StepError::NotStarted));
    let again = tracker.step(&measurement(600_000, 0.5), false);
    assert_eq!(again.expect("an estimate").mode, Mode::Started);
}

#[test]
fn an_overflow_of_the_network_is_an_error() {
    let mut draft = joint();
    draft.outputs[1] = [0.0, 1e25];
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(blob, settings(Correction::None));
    let refused = tracker.step(&measurement(0, 0.0), false);
    assert_eq!(refused, Err(StepError::NetworkNotFinite));
}

/// Networks that agree with themselves in all passes still doubt by a millimetre.
#[test]
fn a_collapsed_posterior_has_a_variance() {
    let mut draft = joint();
    for layer in &mut draft.networks[0] {
        layer.variance_codes.fill(0);
        layer.bias_variance.fill(0.0);
    }
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(blob, settings(Correction::None));
    let estimate = tracker
        .step(&measurement(0, 0.0), false)
        .expect("an estimate");
    for axis in 0..3 {
        assert!((estimate.covariance_m2[axis][axis] - 1e-6).abs() < 1e-9);
    }
}
