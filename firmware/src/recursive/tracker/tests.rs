use super::*;
use crate::blob::Blob;
use crate::blob::draft::Draft;
use crate::estimate::Estimate;
use crate::inference::Inference;
use crate::measurement::Sensed;
use crate::network::monte_carlo::separate_moments;
use crate::network::repeats::Repeats;
use crate::network::{Network, Scratch, moments};
use crate::recursive::envelope::Envelope;
use crate::recursive::factor::Factor;
use crate::recursive::features::FEATURES;
use crate::recursive::hypotheses::HYPOTHESES;
use crate::recursive::parameters::Parameters;
use crate::recursive::schedule::{OUTPUTS, Schedule};
use crate::rng::seeded;
use crate::settings::Correction;

type Outputs = [f32; OUTPUTS];

fn measurement(time_us: u64, range: f32, azimuth: f32) -> Measurement {
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
fn constant(outputs: Outputs) -> Draft {
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
fn outputs() -> Outputs {
    core::array::from_fn(|i| (((i * 7) % 9) as f32 - 3.5) * 0.125)
}

fn settings() -> Settings {
    Settings {
        correction: Correction::Polar,
        inference: Inference::Mean,
        seed: 5,
    }
}

fn parameters() -> Parameters<f32> {
    let bytes = constant(outputs()).bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    Parameters::read(blob.parameters())
}

/// Everything that a call works with, owned.
struct Bench<'a> {
    model: Model<'a>,
    settings: Settings,
    rng: Generator,
    belief: Belief,
    workspace: Workspace,
}

impl<'a> Bench<'a> {
    fn new(blob: Blob<'a>, settings: Settings) -> Self {
        Self {
            model: Model::new(blob),
            rng: seeded(settings.seed),
            settings,
            belief: Belief::NONE,
            workspace: Workspace::new(),
        }
    }

    fn run(&mut self) -> Recursive<'_, 'a> {
        Recursive {
            model: &self.model,
            settings: &self.settings,
            rng: &mut self.rng,
            belief: &mut self.belief,
            workspace: &mut self.workspace,
        }
    }

    fn step(&mut self, measurement: &Measurement, anew: bool) -> Result<Estimate, StepError> {
        let outcome = self.run().step(measurement, anew)?;
        Ok(self.model.estimate(&now(self), outcome))
    }

    fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let outcome = self.run().coast(time_us)?;
        Ok(self.model.estimate(&now(self), outcome))
    }

    fn infer(&mut self, inputs: &mut [f32; FEATURES]) -> (Outputs, [f32; 3]) {
        let mut outputs = [0.0; OUTPUTS];
        let jerk_variance = self.run().infer(inputs, &mut outputs);
        (outputs, jerk_variance)
    }
}

fn started(bytes: &[u8]) -> Bench<'_> {
    let blob = Blob::parse(bytes).expect("a blob");
    let mut tracker = Bench::new(blob, settings());
    let estimate = tracker.step(&measurement(0, 33.0, 0.5), false);
    assert_eq!(estimate.expect("an estimate").mode, Mode::Started);
    tracker
}

fn now(tracker: &Bench<'_>) -> Target {
    tracker.belief.target.expect("a target")
}

fn near(a: f32, b: f32, scale: f32) -> bool {
    (a - b).abs() <= 1e-5 * scale.abs().max(1e-3)
}

fn assert_same(got: &Target, expected: &Target) {
    assert_eq!((got.time_us, got.used), (expected.time_us, expected.used));
    for i in 0..9 {
        let deviation = expected.covariance[i][i];
        assert!(near(got.state[i], expected.state[i], 10.0), "{i}");
        for j in 0..9 {
            let (got, expected) = (got.covariance[i][j], expected.covariance[i][j]);
            assert!(near(got, expected, deviation), "{i} {j}: {got} {expected}");
        }
    }
    let list = |track: &Target| {
        let m = &track.memory;
        let mut list = std::vec![m.coast_s, m.age_s];
        list.extend(m.innovation.iter().chain(&m.drift).chain(&m.squares));
        list.extend(m.ln_sigmas.iter().chain(&m.notes).chain(&m.counts));
        list.extend(m.velocity_means.as_flattened());
        list
    };
    for (i, (got, expected)) in list(got).into_iter().zip(list(expected)).enumerate() {
        assert!(near(got, expected, 10.0), "memory {i}: {got} {expected}");
    }
}

/// What a part of the way is predicted with.
#[derive(Clone, Copy)]
struct Way {
    schedule: Schedule<f32>,
    factor: Option<Factor<f32>>,
    notes: [f32; NOTES],
}

/// The way of a network with these outputs.
fn asked(outputs: &Outputs) -> Way {
    Way {
        schedule: Schedule::read(outputs, &parameters().base),
        factor: Some(Factor::read(&outputs[17..27])),
        notes: core::array::from_fn(|i| outputs[27 + i]),
    }
}

/// The way that no network is asked for.
fn unasked(schedule: Schedule<f32>) -> Way {
    Way {
        schedule,
        factor: None,
        notes: [0.0; NOTES],
    }
}

/// Moves a track by `parts` parts of `dt_s` each; all but the last are remembered.
fn predicted(track: &mut Target, way: &Way, parts: usize, dt_s: f32) -> Interval<f32> {
    let p = parameters();
    let mut interval = None;
    for _ in 0..parts {
        if let Some(interval) = &interval {
            doubted(track, interval, way);
        }
        let sight = track.sight();
        track.predict(&sight, &way.schedule, dt_s);
        if let Some(factor) = &way.factor {
            track.fuse(factor, &p.population, dt_s);
        }
        interval = Some(Interval {
            sight,
            noise: way.schedule.noise,
            sensor_scale: way.schedule.sensor_scale,
            dt_s,
            coast_s: track.memory.coast_s,
        });
    }
    interval.expect("a part")
}

/// A part of the way that no measurement ends.
fn doubted(track: &mut Target, interval: &Interval<f32>, way: &Way) {
    let hypotheses = parameters().hypotheses;
    let odds = hypotheses.odds(&track.memory.counts);
    track.doubt(interval, &hypotheses, &odds);
    assert!(track.settle());
    track.memory.missed();
    let velocity = track.velocity();
    track
        .memory
        .stepped(interval.dt_s, 0.0, velocity, &way.notes);
}

/// The correction under all hypotheses, and what is remembered of it.
fn corrected(track: &mut Target, interval: &Interval<f32>, way: &Way, seen: &Measurement) -> f32 {
    let hypotheses = parameters().hypotheses;
    let odds = hypotheses.odds(&track.memory.counts);
    let vectors = Vectors::from(seen);
    let mut mixture = Mixture::before(&track.state, &track.covariance);
    let weighed = track.weighed(&vectors, interval, &hypotheses, &odds, &mut mixture);
    let whitened = weighed.expect("sound");
    track.memory.measured(whitened, &vectors);
    track.take(&mixture.corrected);
    track.memory.explained(mixture.shares);
    assert!(track.settle());
    let velocity = track.velocity();
    track
        .memory
        .stepped(interval.dt_s, 1.0, velocity, &way.notes);
    mixture.corrected.nis
}

/// A gap of 0.6 s is predicted in three parts, 0.25 s in one, each as the network says, and
/// corrected under all hypotheses.
#[test]
fn a_step_is_predictions_and_a_correction() {
    let bytes = constant(outputs()).bytes();
    let mut tracker = started(&bytes);
    let mut expected = now(&tracker);
    let way = asked(&outputs());
    let mut time_us = 0;
    for (after_us, parts, dt_s) in [(600_000, 3, 0.2), (250_000, 1, 0.25), (300_000, 2, 0.15)] {
        time_us += after_us;
        let seen = measurement(time_us, 33.3, 0.505);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        let interval = predicted(&mut expected, &way, parts, dt_s);
        expected.time_us = time_us;
        let nis = corrected(&mut expected, &interval, &way, &seen);
        assert_same(&now(&tracker), &expected);
        assert_eq!((estimate.mode, estimate.outside), (Mode::Tracking, false));
        assert!(near(estimate.nis, nis, 10.0 * nis));
        assert_eq!(estimate.time_us, time_us);
        expected = now(&tracker);
    }
}

/// A coast is a step that ends in doubt; a call at the same time moves nothing.
#[test]
fn a_coast_is_predictions_and_a_doubt() {
    let bytes = constant(outputs()).bytes();
    let mut tracker = started(&bytes);
    let mut expected = now(&tracker);
    let way = asked(&outputs());
    let interval = predicted(&mut expected, &way, 2, 0.2);
    doubted(&mut expected, &interval, &way);
    expected.time_us = 400_000;
    let estimate = tracker.coast(400_000).expect("a coast");
    assert_same(&now(&tracker), &expected);
    assert_eq!((estimate.mode, estimate.nis), (Mode::Coasting, 0.0));
    assert_eq!(estimate.doubt, Doubt::NONE);
    let again = tracker.coast(400_000).expect("a coast");
    assert_eq!(again.position_m, estimate.position_m);
    // Nor at the time of the first measurement, when there is no age to divide by.
    let mut tracker = started(&bytes);
    let before = now(&tracker);
    tracker.coast(0).expect("a coast");
    assert_same(&now(&tracker), &before);
    tracker.coast(400_000).expect("a coast");
    let age_s = now(&tracker).memory.age_s;
    assert!((age_s - 0.4).abs() < 1e-6);
}

/// Too fast for the model: the wide schedule. Somewhere it does not know: its base.
#[test]
fn outside_the_envelope_the_network_is_not_asked() {
    let bytes = constant(outputs()).bytes();
    let base = parameters().base;
    type Case = (fn(&mut Target), Way);
    let cases: [Case; 4] = [
        // Ten seconds are not more than ten.
        (|t| t.memory.coast_s = 10.0, asked(&outputs())),
        (|t| t.state[3] = 17.0, unasked(Schedule::wide(&base))),
        (
            |t| t.state[2] = 150.0,
            unasked(Schedule::read(&[0.0; OUTPUTS], &base)),
        ),
        (
            |t| t.memory.coast_s = 10.1,
            unasked(Schedule::read(&[0.0; OUTPUTS], &base)),
        ),
    ];
    for (change, way) in cases {
        let mut tracker = started(&bytes);
        let mut expected = now(&tracker);
        change(&mut expected);
        tracker.belief.target = Some(expected);
        let interval = predicted(&mut expected, &way, 1, 0.1);
        doubted(&mut expected, &interval, &way);
        expected.time_us = 100_000;
        let estimate = tracker.coast(100_000).expect("a coast");
        assert_same(&now(&tracker), &expected);
        let p = parameters();
        let envelope = Envelope::of(&p.bounds, &p.population);
        let inside = envelope.holds_motion(&expected.state)
            && envelope.holds_place(&expected.state, &expected.covariance);
        assert_eq!(estimate.outside, !inside);
    }
}

/// Inputs are normalised and kept within four deviations, outputs are scaled back; the spread of
/// the mean jerk over passes becomes white jerk.
#[test]
fn the_network_reads_and_answers_in_its_own_units() {
    let mut draft = Draft::recursive(3);
    for (i, pair) in draft.inputs.iter_mut().enumerate() {
        *pair = [0.1 * i as f32, 0.5 + 0.01 * i as f32];
    }
    for (i, pair) in draft.outputs.iter_mut().enumerate() {
        *pair = [0.2 * i as f32, 0.5 + 0.03 * i as f32];
    }
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let raw: [f32; FEATURES] = core::array::from_fn(|i| (1.7 * i as f32).sin() * 12.0);
    let expected_inputs = core::array::from_fn(|i| {
        let [mean, inverse] = draft.inputs[i];
        ((raw[i] - mean) * inverse).clamp(-4.0, 4.0)
    });
    let network = Network::new(blob.networks().next().expect("one"));
    let passes = [1, 2, 20].map(|passes| Inference::of_passes(passes).unwrap());
    for inference in passes.into_iter().chain([Inference::Moments]) {
        let mut tracker = Bench::new(
            blob,
            Settings {
                inference,
                ..settings()
            },
        );
        let mut inputs = raw;
        let (outputs, jerk_variance) = tracker.infer(&mut inputs);
        assert_eq!(inputs, expected_inputs);
        let (mut plain, mut variances) = ([0.0; OUTPUTS], [0.0; OUTPUTS]);
        let (scratch, repeats) = (&mut Scratch::new(), Repeats::NONE);
        match inference {
            Inference::Mean => network.mean_pass(&inputs, &mut plain),
            Inference::Passes(passes) => {
                let rng = &mut seeded(5);
                let (count, spread) = (passes.count(), passes.spread());
                (plain, variances) =
                    separate_moments(&network, &inputs, count, spread, rng, scratch);
            }
            Inference::Moments => {
                for output in 4..7 {
                    let [[variance]] =
                        moments::outputs(&network, &repeats, &inputs, &mut plain, output, scratch);
                    variances[output] = variance;
                }
            }
        }
        for i in 0..OUTPUTS {
            let [mean, scale] = draft.outputs[i];
            assert!(near(outputs[i], mean + scale * plain[i], 10.0), "{i}");
        }
        for axis in 0..3 {
            let scale = 2.0 * draft.outputs[4 + axis][1];
            let expected = scale * scale * variances[4 + axis];
            // Three outputs together are quantised as one alone, to the steps of the adjoint.
            let apart = jerk_variance[axis] - expected;
            assert!(apart.abs() <= 1e-3 * expected, "{axis}");
            assert_eq!(expected > 0.0, inference != Inference::Mean);
        }
    }
}

/// The doubt about the mean jerk is added to the noise, by the length of the part.
#[test]
fn a_doubtful_jerk_is_noise() {
    let mut draft = constant(outputs());
    draft.networks[0][1].bias_variance[4..7].copy_from_slice(&[4.0, 9.0, 16.0]);
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(
        blob,
        Settings {
            inference: Inference::of_passes(16).unwrap(),
            ..settings()
        },
    );
    tracker
        .step(&measurement(0, 33.0, 0.5), false)
        .expect("an estimate");
    tracker.workspace.target = now(&tracker);
    let step = tracker.run().predict(200_000).expect("a step");
    // The same network, the same random numbers.
    let mut twin = Bench::new(
        blob,
        Settings {
            inference: Inference::of_passes(16).unwrap(),
            ..settings()
        },
    );
    let (answer, variance) = twin.infer(&mut [0.0; FEATURES]);
    let plain = Schedule::read(&answer, &parameters().base);
    for axis in 0..3 {
        let expected = plain.noise.jerk[axis] + 0.2 * variance[axis];
        assert!(variance[axis] > 1.0);
        let got = step.interval.noise.jerk[axis];
        assert!(near(got, expected, expected), "{axis}: {got} {expected}");
    }
}

/// Ten seconds of silence end a track, coasted or not.
#[test]
fn a_long_silence_starts_anew() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    for (coast_us, after_us, mode) in [
        (0, 10_000_000, Mode::Tracking),
        (0, 10_100_000, Mode::Started),
        (6_000_000, 3_900_000, Mode::Tracking),
        (6_000_000, 4_100_000, Mode::Started),
    ] {
        let mut tracker = started(&bytes);
        if coast_us > 0 {
            tracker.coast(coast_us).expect("a coast");
        }
        let seen = measurement(coast_us + after_us, 33.0, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, mode, "{coast_us} {after_us}");
    }
    let mut tracker = started(&bytes);
    let anew = tracker.step(&measurement(100_000, 33.0, 0.5), true);
    assert_eq!(anew.expect("an estimate").mode, Mode::Started);
}

/// Three rejected measurements that agree with each other are the target; the old track then waits
/// beside it.
#[test]
fn agreeing_rejections_take_over() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let mut tracker = started(&bytes);
    for step in 1..=5 {
        let seen = measurement(100_000 * step, 33.0, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, Mode::Tracking);
    }
    let before = now(&tracker);
    for (step, mode) in [Mode::Rejected, Mode::Rejected, Mode::Restarted]
        .into_iter()
        .enumerate()
    {
        let seen = measurement(600_000 + 100_000 * step as u64, 60.0, -2.0);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, mode, "{step}");
        assert!(estimate.nis > GATE_NIS as f32);
        let doubt = if mode == Mode::Rejected {
            Doubt::OUTLIER
        } else {
            Doubt::NONE
        };
        assert_eq!(estimate.doubt, doubt);
        if mode == Mode::Rejected {
            let memory = now(&tracker).memory;
            let wrong = memory.counts[OUTLIER] - before.memory.counts[OUTLIER];
            assert!(near(wrong, 1.0 + step as f32, 10.0), "{wrong}");
            assert!(near(memory.coast_s, 0.1 * (1 + step) as f32, 10.0));
            assert_eq!(now(&tracker).used, before.used);
        }
    }
    let taken = now(&tracker);
    assert!((taken.sight().range_m - 60.0).abs() < 1.0 && taken.used == 3);
    let waiting = tracker.belief.candidate.expect("the old track");
    assert!((waiting.target().sight().range_m - 33.0).abs() < 2.0);
    assert_eq!(tracker.belief.rejections, 0);
    // One measurement of its own brings no change of track back.
    let back = tracker.step(&measurement(900_000, 60.0, -2.0), false);
    assert_eq!(back.expect("an estimate").mode, Mode::Tracking);
}

/// Hypotheses look back over a gap, but not over readings that were rejected.
#[test]
fn hypotheses_look_back_over_what_nobody_saw() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    for (rejections, coast_s) in [(0, 0.4), (1, 0.0)] {
        let mut tracker = started(&bytes);
        tracker.coast(400_000).expect("a coast");
        tracker.belief.rejections = rejections;
        let mut run = tracker.run();
        run.set_out().expect("a target");
        let step = run.predict(500_000).expect("a prediction");
        assert!((step.interval.coast_s - coast_s).abs() < 1e-6);
        assert!((step.interval.dt_s - 0.1).abs() < 1e-6);
    }
}

/// A track two metres from the sensor's axis, 20 m up, unsure by ten metres along every axis, and what is seen 5 m
/// from the axis a tenth of a second later.
fn blind(bytes: &[u8]) -> (Bench<'_>, Measurement) {
    let mut tracker = started(bytes);
    let target = tracker.belief.target.as_mut().expect("a target");
    target.state[..3].copy_from_slice(&[2.0, 0.0, 20.0]);
    for axis in 0..3 {
        target.covariance[axis][axis] = 100.0;
    }
    let mut seen = measurement(100_000, 20.0, -2.0);
    seen.elevation = Some(Sensed {
        value: 1.3,
        sigma: 0.001,
    });
    (tracker, seen)
}

fn assert_overhead(estimate: &Estimate) {
    let place = crate::radar::position(20.0_f32, 1.3, -2.0);
    for (axis, (there, seen)) in estimate.position_m.iter().zip(place).enumerate() {
        assert!((there - seen).abs() < 1.0, "{axis}");
    }
}

/// Measurements would count for less, the more it is unsure. It is found at the next one, goes on as the same
/// track, and says how sure it is.
#[test]
fn a_track_that_is_blind_overhead_finds_back() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let (mut tracker, seen) = blind(&bytes);
    let used = now(&tracker).used;
    let estimate = tracker.step(&seen, false).expect("an estimate");
    assert_eq!(
        (estimate.mode, now(&tracker).used),
        (Mode::Tracking, used + 1)
    );
    assert_overhead(&estimate);
    // A variance of 0.09 along the beam, which one look leaves and two would halve.
    let variance_m2 = now(&tracker).position_variance();
    assert!((0.08..0.12).contains(&variance_m2), "{variance_m2}");
    assert!(estimate.nis < 64.0);
}

/// Its place is the measurement's, so it cannot say that the measurement was rejected.
#[test]
fn a_blind_track_of_another_velocity_starts_anew() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let (mut tracker, mut seen) = blind(&bytes);
    seen.range_rate = Some(Sensed {
        value: 300.0,
        sigma: 0.1,
    });
    let estimate = tracker.step(&seen, false).expect("an estimate");
    assert_eq!((estimate.mode, now(&tracker).used), (Mode::Restarted, 1));
    assert_overhead(&estimate);
}

/// What a rejected measurement says is remembered, within a thousand deviations, unless readings
/// are often wrong.
#[test]
fn a_rejected_innovation_is_remembered_unless_often_wrong() {
    for (wrong, remembered) in [(0.0, true), (4.0, true), (6.0, false)] {
        let bytes = constant([0.0; OUTPUTS]).bytes();
        let mut tracker = started(&bytes);
        let mut track = now(&tracker);
        track.memory.counts = [0.0; HYPOTHESES];
        track.memory.counts[OUTLIER] = wrong;
        track.memory.innovation = [0.5; 4];
        tracker.belief.target = Some(track);
        let seen = measurement(100_000, 9e5, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, Mode::Rejected);
        let innovation = now(&tracker).memory.innovation;
        if remembered {
            assert_eq!(innovation[2], WHITENED_MAX);
        } else {
            assert!(near(innovation[2], 0.4, 1.0), "{innovation:?}");
        }
    }
}

/// A measurement that is used is remembered, however often readings are wrong.
#[test]
fn a_used_innovation_is_remembered() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let mut tracker = started(&bytes);
    let mut track = now(&tracker);
    track.memory.counts[OUTLIER] = 50.0;
    track.memory.innovation = [100.0; 4];
    tracker.belief.target = Some(track);
    let estimate = tracker.step(&measurement(100_000, 33.1, 0.5), false);
    assert_eq!(estimate.expect("an estimate").mode, Mode::Tracking);
    let innovation = now(&tracker).memory.innovation;
    assert!(innovation.iter().all(|y| y.abs() < 5.0), "{innovation:?}");
}

/// A candidate that agrees takes over after three rejections or with the longer record, and only
/// where it is apart.
#[test]
fn a_takeover_needs_rejections_or_a_longer_record_and_a_distance() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    // Measurements used by the candidate in the end and by the track; rejections in the end.
    for (candidate, own, rejections, apart, takes_over) in [
        (6, 5, 1, true, true),
        (5, 5, 1, true, false),
        (4, 5, 1, true, false),
        (4, 5, 3, true, true),
        (4, 5, 2, true, false),
        (4, 5, 3, false, false),
        (6, 5, 1, false, false),
    ] {
        let mut tracker = started(&bytes);
        let mut track = now(&tracker);
        track.used = own;
        tracker.belief.target = Some(track);
        tracker.belief.rejections = rejections - 1;
        let range = if apart { 60.0 } else { 33.0 };
        let seen = |time_us| measurement(time_us, range, 0.5);
        let p = parameters();
        let mut none = Target::NONE;
        let room = &mut none;
        let mut waiting = Candidate::start(&seen(0), &p.population, room).expect("a target");
        (waiting.target.used, waiting.agreeing) = (candidate - 3, 0);
        for time_us in [100_000, 200_000] {
            let met = waiting.meet(&seen(time_us), &p.base, &p.population, room);
            assert_eq!(met, Verdict::Wait);
        }
        tracker.belief.candidate = Some(waiting);
        let taken = tracker.run().is_suspected(&seen(300_000), APART);
        let case = (candidate, own, rejections, apart);
        assert_eq!(taken, takes_over, "{case:?}");
        let used = if takes_over { candidate } else { own };
        assert_eq!(now(&tracker).used, used, "{case:?}");
    }
}

/// A candidate begins anywhere in the population's place, with any motion of the envelope.
#[test]
fn a_suspect_may_move_as_the_envelope_allows() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let p = parameters();
    let expected = Population {
        horizontal_sigma_mps: 16.0,
        vertical_sigma_mps: 16.0,
        acceleration_sigma_mps2: 12.5,
        ..p.population
    };
    assert_eq!(started(&bytes).model.suspected(), expected);
}

/// Coasting ends where nothing is known any more, and a reset forgets the track and the numbers.
#[test]
fn a_lost_track_and_a_reset_one_are_gone() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let mut tracker = started(&bytes);
    let mut track = now(&tracker);
    // Too fast for the model: nothing but its motion is known of it.
    (track.state[3], track.covariance[3][3]) = (20.0, 1e8);
    tracker.belief.target = Some(track);
    assert!(tracker.coast(1_000_000).is_ok());
    // Ten kilometres a second leave more than a hundred kilometres.
    assert_eq!(tracker.coast(61_000_000), Err(StepError::Lost));
    assert_eq!(tracker.coast(0), Err(StepError::NotStarted));

    let bytes = Draft::recursive(3).bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(
        blob,
        Settings {
            inference: Inference::of_passes(4).unwrap(),
            ..settings()
        },
    );
    let flight = |tracker: &mut Bench<'_>| {
        [0, 100_000, 200_000].map(|time_us| tracker.step(&measurement(time_us, 33.0, 0.5), false))
    };
    let first = flight(&mut tracker);
    tracker.belief.rejections = 2;
    tracker.rng = seeded(5);
    tracker.belief.forget();
    assert!(tracker.belief.target.is_none() && tracker.belief.candidate.is_none());
    assert_eq!(tracker.belief.rejections, 0);
    assert_eq!(flight(&mut tracker), first);
}

#[test]
fn an_answer_that_is_not_finite_is_an_error() {
    let mut draft = constant([0.0; OUTPUTS]);
    draft.outputs[0] = [3e38, 3e38];
    draft.networks[0][1].bias_mean[0] = 1.0;
    let bytes = draft.bytes();
    let mut tracker = started(&bytes);
    assert_eq!(tracker.coast(100_000), Err(StepError::NetworkNotFinite));
}
