//! One step of the recursive tracker: predict under a schedule, correct, remember.

use super::carry::{CARRY, Carry, MEASUREMENT, STATE};
use super::normalisation::Normalisation;
use crate::autodiff::program::Program;
use bnkf::cholesky::{cholesky, forward_substitute};
use bnkf::measurement::Vectors;
use bnkf::recursive::correction::{GATE_NIS, correct};
use bnkf::recursive::factor::Factor;
use bnkf::recursive::features::{FEATURES, features};
use bnkf::recursive::hypotheses::{NOMINAL, OUTLIER};
use bnkf::recursive::interval::Interval;
use bnkf::recursive::mixture::Mixture;
use bnkf::recursive::motion::predict;
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::schedule::{NOTE_OUTPUT, OUTPUTS, SCHEDULE, Schedule};
use bnkf::recursive::sight::LineOfSight;
use bnkf::recursive::state::{Covariance, State};
use bnkf::scalar::Scalar;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// What arrives at one step.
#[derive(Clone, Copy, Debug)]
pub struct Arrival<S> {
    /// Time since the previous step, seconds.
    pub dt_s: S,
    /// One when there is a measurement, zero in a gap.
    pub measured: S,
    /// Elevation (rad), azimuth (rad), range (m), range-rate (m/s), their standard deviations, and
    /// which of them were measured; anything finite in a gap.
    pub vectors: Vectors<S>,
}

/// Numbers in an [`Arrival`].
pub const ARRIVAL: usize = 2 + 3 * MEASUREMENT;

/// Inputs of the filter program: carry, network outputs, arrival, true position.
pub const FILTER_INPUTS: usize = CARRY + OUTPUTS + ARRIVAL + 3;
/// After the carry, the filter program's outputs: negative log-likelihood of the true position,
pub const SURPRISE: usize = CARRY;
/// distance from it,
pub const DISTANCE: usize = CARRY + 1;
/// and root of the trace of the position's covariance.
pub const DEVIATION: usize = CARRY + 2;
/// Outputs of the filter program.
pub const FILTER_OUTPUTS: usize = CARRY + 3;
/// Inputs of the feature program: carry, then the time step.
pub const FEATURE_INPUTS: usize = CARRY + 1;

/// The features of a prediction over `dt_s` seconds, before normalisation.
pub fn features_of<S: Scalar>(carry: &Carry<S>, dt_s: S) -> [S; FEATURES] {
    let sight = sight_of(carry);
    features(&carry.state, &carry.covariance, &carry.memory, &sight, dt_s)
}

/// The line of sight to where a carry's state is.
pub fn sight_of<S: Scalar>(carry: &Carry<S>) -> LineOfSight<S> {
    LineOfSight::to([carry.state[0], carry.state[1], carry.state[2]])
}

/// Which hypotheses a step weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weighing {
    /// The network's own model alone
    Nominal,
    /// Every one, as the firmware does, behind the wider of its two gates
    All,
}

/// Advances `carry` by one step under the motion model that the network `outputs` schedule.
///
/// The firmware's own parts in the firmware's order; what it decides by a branch (a gap, the gate)
/// is a factor of one or zero here, so that every lane of flights runs the same operations. Rejected readings
/// are not counted here, so hypotheses look back over them as over a gap, which the firmware's do not.
pub fn advance<S: Scalar>(
    carry: &Carry<S>,
    outputs: &[S],
    arrival: &Arrival<S>,
    parameters: &Parameters<f64>,
    weighing: Weighing,
) -> Carry<S> {
    let schedule = Schedule::read(outputs, &parameters.base.known());
    let hypotheses = parameters.hypotheses.known();
    let sight = sight_of(carry);
    let (mut state, mut covariance) = (carry.state, carry.covariance);
    predict(&mut state, &mut covariance, &sight, &schedule, arrival.dt_s);
    let population = parameters.population.known();
    Factor::read(&outputs[SCHEDULE..NOTE_OUTPUT]).fuse(
        &mut state,
        &mut covariance,
        &population,
        arrival.dt_s,
    );
    let interval = Interval {
        sight,
        noise: schedule.noise,
        sensor_scale: schedule.sensor_scale,
        dt_s: arrival.dt_s,
        coast_s: carry.memory.coast_s,
    };
    let vectors = arrival.vectors;
    let odds = hypotheses.odds(&carry.memory.counts);
    let mut mixture = Mixture::before(&state, &covariance);
    let whitened = match weighing {
        Weighing::All => interval.weigh(
            &state,
            &covariance,
            &vectors,
            &hypotheses,
            &odds,
            &mut mixture,
        ),
        Weighing::Nominal => {
            let whitened = correct(&mut mixture.corrected, &vectors, schedule.sensor_scale);
            mixture.begin(NOMINAL, S::constant(1.0));
            whitened
        }
    };
    if weighing == Weighing::All {
        interval.doubt(&mut covariance, &hypotheses, &odds);
    }
    let corrected = &mixture.corrected;
    let measured = arrival.measured;
    let used = measured * (S::constant(GATE_NIS) - corrected.nis).step();
    let between = |from: S, to: S, weight: S| from + weight * (to - from);
    let mut next = Carry {
        state: core::array::from_fn(|i| between(state[i], corrected.state[i], used)),
        covariance,
        memory: carry.memory,
    };
    for row in 0..STATE {
        for column in 0..=row {
            let corrected = corrected.covariance[row][column];
            next.covariance[row][column] = between(covariance[row][column], corrected, used);
            next.covariance[column][row] = next.covariance[row][column];
        }
    }
    let (mut seen, mut unseen) = (carry.memory, carry.memory);
    seen.measured(whitened, &vectors);
    unseen.missed();
    // What is rejected is seen unless the sensor is often wrong.
    let trusted = hypotheses.trust(&carry.memory.counts).step();
    let shown = used + (measured - used) * trusted;
    let blend = |unseen: [S; MEASUREMENT], seen: [S; MEASUREMENT]| {
        core::array::from_fn(|i| between(unseen[i], seen[i], shown))
    };
    next.memory.innovation = blend(unseen.innovation, seen.innovation);
    next.memory.drift = blend(unseen.drift, seen.drift);
    next.memory.squares = blend(unseen.squares, seen.squares);
    next.memory.ln_sigmas = blend(unseen.ln_sigmas, seen.ln_sigmas);
    next.memory
        .explained(mixture.shares.map(|share| used * share));
    next.memory.counts[OUTLIER] = next.memory.counts[OUTLIER] + (measured - used);
    let velocity = [next.state[3], next.state[4], next.state[5]];
    next.memory
        .stepped(arrival.dt_s, used, velocity, &outputs[NOTE_OUTPUT..]);
    next
}

/// Negative log-likelihood of a position under the state's Gaussian, nats.
pub fn position_surprise<S: Scalar>(
    state: &State<S>,
    covariance: &Covariance<S>,
    truth: [S; 3],
) -> S {
    let block: [[S; 3]; 3] =
        core::array::from_fn(|row| core::array::from_fn(|column| covariance[row][column]));
    let factor = cholesky(&block);
    let error = core::array::from_fn(|axis| state[axis] - truth[axis]);
    let whitened = forward_substitute(&factor, error);
    let mut sum = S::constant(1.5 * core::f64::consts::TAU.ln());
    for axis in 0..3 {
        sum = sum + S::constant(0.5) * whitened[axis] * whitened[axis] + factor[axis][axis].ln();
    }
    sum
}

/// Distance from a position, metres. It has a slope everywhere, also where it is zero.
fn position_distance<S: Scalar>(state: &State<S>, truth: [S; 3]) -> S {
    let mut square = S::constant(1e-12);
    for axis in 0..3 {
        let error = state[axis] - truth[axis];
        square = square + error * error;
    }
    square.sqrt()
}

/// Records the step between the network and the next features.
pub fn filter_program(parameters: &Parameters<f64>, weighing: Weighing) -> Program {
    Program::record(FILTER_INPUTS, |inputs| {
        let (carry, rest) = inputs.split_at(CARRY);
        let (outputs, rest) = rest.split_at(OUTPUTS);
        let (arrival, truth) = rest.split_at(ARRIVAL);
        let arrival = Arrival {
            dt_s: arrival[0],
            measured: arrival[1],
            vectors: Vectors {
                measured: core::array::from_fn(|i| arrival[2 + i]),
                sigmas: core::array::from_fn(|i| arrival[2 + MEASUREMENT + i]),
                present: core::array::from_fn(|i| arrival[2 + 2 * MEASUREMENT + i]),
            },
        };
        let carry = Carry::unflatten(carry);
        let next = advance(&carry, outputs, &arrival, parameters, weighing);
        let truth = [truth[0], truth[1], truth[2]];
        let p = &next.covariance;
        let mut flat = next.flatten();
        flat.push(position_surprise(&next.state, p, truth));
        flat.push(position_distance(&next.state, truth));
        flat.push((p[0][0] + p[1][1] + p[2][2]).sqrt());
        flat
    })
}

/// Records the normalised features.
pub fn feature_program(normalisation: &Normalisation) -> Program {
    Program::record(FEATURE_INPUTS, |inputs| {
        let (carry, dt_s) = inputs.split_at(CARRY);
        let features: [_; FEATURES] = features_of(&Carry::unflatten(carry), dt_s[0]);
        normalisation.apply(&features).to_vec()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autodiff::lanes::{LANES, Lanes, ZERO};
    use bnkf::recursive::population::Population;

    const SIGMAS: [f64; 4] = [0.01, 0.012, 10.0, 0.1];

    /// A circle of 5 m flown at 2 m/s: position and velocity after `time_s` seconds.
    fn circle(time_s: f64) -> ([f64; 3], [f64; 3]) {
        let (s, c) = (0.4 * time_s).sin_cos();
        (
            [20.0 + 5.0 * c, -15.0 + 5.0 * s, 12.0],
            [-2.0 * s, 2.0 * c, 0.0],
        )
    }

    fn reading(time_s: f64) -> [f64; 4] {
        let (position, velocity) = circle(time_s);
        bnkf::radar::predict(position, velocity).measurement
    }

    fn first() -> Vectors<f64> {
        Vectors::whole(reading(0.0), SIGMAS)
    }

    fn step_inputs(carry: &Carry<f64>, outputs: &[f64], k: usize, measured: f64) -> Vec<f64> {
        let time_s = 0.1 * k as f64;
        let mut inputs = carry.flatten();
        inputs.extend(outputs);
        inputs.extend([0.1, measured]);
        inputs.extend(reading(time_s));
        inputs.extend(SIGMAS);
        inputs.extend([1.0; 4]);
        inputs.extend(circle(time_s).0);
        inputs
    }

    fn splat(numbers: &[f64]) -> Vec<Lanes> {
        numbers.iter().map(|&x| [x; LANES]).collect()
    }

    #[test]
    fn the_base_model_follows_a_circle() {
        let mut carry = Carry::start(&first(), &Population::PAPER);
        for k in 1..150 {
            let inputs = step_inputs(&carry, &[], k, f64::from(u8::from(k % 15 < 8)));
            let (arrival, _) = inputs[CARRY..].split_at(ARRIVAL);
            let arrival = Arrival {
                dt_s: arrival[0],
                measured: arrival[1],
                vectors: Vectors::whole(core::array::from_fn(|i| arrival[2 + i]), SIGMAS),
            };
            carry = advance(
                &carry,
                &[0.0; OUTPUTS],
                &arrival,
                &Parameters::PAPER,
                Weighing::All,
            );
        }
        let truth = circle(14.9).0;
        for axis in 0..3 {
            assert!((carry.state[axis] - truth[axis]).abs() < 0.5);
        }
        // Seven steps into a gap the standard deviation is about a metre an axis.
        assert!(position_surprise(&carry.state, &carry.covariance, truth) < 3.0);
    }

    #[test]
    fn the_program_is_the_plain_step_and_its_gradient_is_right() {
        let program = filter_program(&Parameters::PAPER, Weighing::All);
        let mut workspace = program.workspace();
        let mut carry = Carry::start(&first(), &Population::PAPER).flatten();
        let wave: Vec<f64> = (0..OUTPUTS).map(|i| 0.3 * (1.7 * i as f64).sin()).collect();
        let mut outputs = vec![ZERO; FILTER_OUTPUTS];
        for k in 1..20 {
            let measured = f64::from(u8::from(k % 7 != 3));
            let inputs = step_inputs(&Carry::unflatten(&carry), &wave, k, measured);
            program.forward(&mut workspace, &splat(&inputs), &mut outputs);
            let scale = |i: usize| ((i * 5) % 7) as f64 - 3.0;
            let seeds: Vec<Lanes> = (0..FILTER_OUTPUTS).map(|i| [scale(i); LANES]).collect();
            let mut adjoints = vec![ZERO; FILTER_INPUTS];
            program.backward(&mut workspace, &seeds, &mut adjoints);
            let next: Vec<f64> = outputs.iter().map(|lanes| lanes[LANES - 1]).collect();
            check_gradient(&program, &inputs, &scale, &adjoints);
            carry = next[..CARRY].to_vec();
        }
    }

    fn check_gradient(
        program: &Program,
        inputs: &[f64],
        scale: &impl Fn(usize) -> f64,
        adjoints: &[Lanes],
    ) {
        let mut workspace = program.workspace();
        let mut total = |inputs: &[f64]| -> f64 {
            let mut outputs = vec![ZERO; FILTER_OUTPUTS];
            program.forward(&mut workspace, &splat(inputs), &mut outputs);
            outputs
                .iter()
                .enumerate()
                .map(|(i, lanes)| scale(i) * lanes[0])
                .sum()
        };
        for i in 0..FILTER_INPUTS {
            // A gap's step has no derivative at zero by its own flag.
            if i == CARRY + OUTPUTS + 1 {
                continue;
            }
            let h = 1e-5 * (1e-2 + inputs[i].abs());
            let mut moved = inputs.to_vec();
            moved[i] = inputs[i] + h;
            let high = total(&moved);
            moved[i] = inputs[i] - h;
            let low = total(&moved);
            let difference = (high - low) / (2.0 * h);
            let error = (adjoints[i][3] - difference).abs();
            assert!(
                error < 1e-4 * (1.0 + difference.abs()) + 1e-9 * high.abs() / h,
                "input {i}: {} against {difference}",
                adjoints[i][3]
            );
        }
    }

    #[test]
    fn the_step_stays_small() {
        // The cost of training is proportional to these; a structural zero that is computed shows.
        let lengths = [Weighing::Nominal, Weighing::All]
            .map(|weighing| filter_program(&Parameters::PAPER, weighing).len());
        assert!(lengths[0] < 2_450 && lengths[1] < 5_400, "{lengths:?}");
        assert!(feature_program(&Normalisation::IDENTITY).len() < 400);
    }
}
