//! Bursts: a drone that hovers, leaves with all its thrust, and brakes as hard.

use bnkf_model_export::flights::flight::{Flight, Sample, length};
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed::name_id;

/// Acceleration of bursts and brakes, m/s^2.
const THRUST_MPS2: f64 = 10.0;
/// Longest step of the integration, seconds.
const STEP_S: f64 = 0.01;
/// Speed at which braking ends, m/s: more than a step's thrust changes.
const STOPPED_MPS: f64 = 0.15;
/// How far from its start it turns back, metres.
const FAR_M: f64 = 5.0;
/// Lowest height at which it goes on sinking, metres.
const FLOOR_M: f64 = 2.0;

/// What the drone does, and until when (seconds) if that is decided.
#[derive(Clone, Copy, Debug)]
enum Phase {
    Hover { until_s: f64 },
    Burst { until_s: f64, direction: [f64; 3] },
    Brake,
}

/// A flight from the place where `flight` begins, sampled as it is: hovers for one to three seconds,
/// bursts for 0.3 to 0.8 s with 10 m/s^2 and brakes with as much.
pub fn bursts(flight: &Flight, seed: u64) -> Flight {
    let mut random = RandomSource::new(seed, &[name_id("bursts"), name_id(&flight.name)]);
    let centre_m = flight.samples[0].position_m;
    let mut now = Sample {
        velocity_mps: [0.0; 3],
        ..flight.samples[0]
    };
    let mut phase = Phase::Hover {
        until_s: now.time_s + random.uniform(1.0, 3.0),
    };
    let mut samples = Vec::with_capacity(flight.samples.len());
    for sample in &flight.samples {
        while now.time_s < sample.time_s - 1e-9 {
            phase = phase.next(&now, centre_m, &mut random);
            let step_s = (sample.time_s - now.time_s).min(STEP_S);
            now = moved(&now, phase.acceleration_mps2(now.velocity_mps), step_s);
        }
        samples.push(Sample {
            time_s: sample.time_s,
            ..now
        });
    }
    Flight {
        name: format!("bursts-{}", flight.name),
        source: flight.source.clone(),
        samples,
    }
}

impl Phase {
    fn next(self, now: &Sample, centre_m: [f64; 3], random: &mut RandomSource) -> Self {
        match self {
            Self::Hover { until_s } if now.time_s >= until_s => Self::Burst {
                until_s: now.time_s + random.uniform(0.3, 0.8),
                direction: direction(now.position_m, centre_m, random),
            },
            Self::Burst { until_s, .. } if now.time_s >= until_s => Self::Brake,
            Self::Brake if length(now.velocity_mps) <= STOPPED_MPS => Self::Hover {
                until_s: now.time_s + random.uniform(1.0, 3.0),
            },
            same => same,
        }
    }

    fn acceleration_mps2(self, velocity_mps: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Hover { .. } => velocity_mps.map(|v| -3.0 * v),
            Self::Burst { direction, .. } => direction.map(|d| THRUST_MPS2 * d),
            Self::Brake => {
                let speed_mps = length(velocity_mps);
                velocity_mps.map(|v| -THRUST_MPS2 * v / speed_mps)
            }
        }
    }
}

/// Anywhere, a little up or down, but back when it has gone far; of length one.
fn direction(position_m: [f64; 3], centre_m: [f64; 3], random: &mut RandomSource) -> [f64; 3] {
    let away = [position_m[0] - centre_m[0], position_m[1] - centre_m[1]];
    let angle = if libm::hypot(away[0], away[1]) > FAR_M {
        libm::atan2(-away[1], -away[0]) + random.uniform(-0.7, 0.7)
    } else {
        random.uniform(0.0, core::f64::consts::TAU)
    };
    let (sine, cosine) = libm::sincos(angle);
    let climb = (0.3 * (centre_m[2] - position_m[2])).clamp(-0.5, 0.5) + random.uniform(-0.2, 0.2);
    let length = (1.0 + climb * climb).sqrt();
    [cosine / length, sine / length, climb / length]
}

/// The sample `step_s` later under a constant acceleration; nothing sinks through the floor.
fn moved(now: &Sample, acceleration_mps2: [f64; 3], step_s: f64) -> Sample {
    let mut next = Sample {
        time_s: now.time_s + step_s,
        ..*now
    };
    for i in 0..3 {
        let gained_mps = step_s * acceleration_mps2[i];
        next.position_m[i] += step_s * (now.velocity_mps[i] + 0.5 * gained_mps);
        next.velocity_mps[i] += gained_mps;
    }
    if next.position_m[2] < FLOOR_M && next.velocity_mps[2] < 0.0 {
        next.position_m[2] = FLOOR_M;
        next.velocity_mps[2] = 0.0;
    }
    next
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::generator::{GeneratorSettings, generate};

    use super::{Sample, bursts};

    #[test]
    fn it_rests_bursts_and_brakes_with_ten() {
        let settings = GeneratorSettings {
            flights: 3,
            duration_s: 60.0,
            ..GeneratorSettings::default()
        };
        for flight in generate(&settings).unwrap() {
            let bursting = bursts(&flight, 1);
            assert_eq!(bursting, bursts(&flight, 1));
            assert_ne!(bursting, bursts(&flight, 2));
            let motion = bursting.motion();
            let share = |holds: &dyn Fn(f64) -> bool| {
                let count = motion.iter().filter(|m| holds(m.acceleration_mps2)).count();
                count as f64 / motion.len() as f64
            };
            assert!(share(&|a| a < 0.5) > 0.3, "it hovers");
            assert!(share(&|a| (a - 10.0).abs() < 0.2) > 0.15, "it bursts");
            assert!(motion.iter().all(|m| m.acceleration_mps2 < 10.2));
            let fastest = motion.iter().map(|m| m.speed_mps).fold(0.0, f64::max);
            assert!((3.0..8.2).contains(&fastest), "{fastest}");
            // Positions belong to the velocities.
            for pair in bursting.samples.windows(2) {
                for i in 0..3 {
                    let dt_s = pair[1].time_s - pair[0].time_s;
                    let mean = 0.5 * (pair[0].velocity_mps[i] + pair[1].velocity_mps[i]);
                    let moved_m = pair[1].position_m[i] - pair[0].position_m[i];
                    // Off by less than where in the interval the thrust turns.
                    assert!((moved_m - dt_s * mean).abs() < 0.06, "{moved_m} {mean}");
                }
            }
            let away = |s: &Sample| {
                let from = bursting.samples[0].position_m;
                f64::hypot(s.position_m[0] - from[0], s.position_m[1] - from[1])
            };
            assert!(bursting.samples.iter().all(|s| away(s) < 14.0));
        }
    }
}
