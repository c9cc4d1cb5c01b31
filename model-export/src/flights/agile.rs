//! Flights at the limits of small drones, each under a law of its own: accelerations that switch,
//! wander with heavy tails, weave, dash and stop, or turn hard. What a model must see so that it is
//! sure where it may be and unsure where it must.

use super::flight::Sample;
use crate::random_source::RandomSource;

/// Time step of the integration, s.
const STEP_S: f64 = 0.01;
/// Speed that no flight exceeds by much, m/s.
const SPEED_MAX_MPS: f64 = 15.0;
/// Largest acceleration that a law asks for, m/s^2.
const ACCELERATION_MAX_MPS2: f64 = 20.0;

/// A flight about the origin: `count` samples, `interval_s` apart, from time zero.
pub fn fly(count: usize, interval_s: f64, random: &mut RandomSource) -> Vec<Sample> {
    let mut law = Law::draw(random);
    let mut position = [0.0; 3];
    let mut velocity = [random.normal(), random.normal(), 0.3 * random.normal()];
    let mut time_s = 0.0;
    let mut samples = Vec::with_capacity(count);
    for index in 0..count {
        let due_s = interval_s * index as f64;
        while time_s < due_s - 1e-9 {
            let dt = STEP_S.min(due_s - time_s);
            let acceleration = law.acceleration(time_s, position, velocity, random);
            for axis in 0..3 {
                position[axis] += dt * velocity[axis] + 0.5 * dt * dt * acceleration[axis];
                velocity[axis] += dt * acceleration[axis];
            }
            time_s += dt;
        }
        samples.push(Sample {
            time_s: due_s,
            position_m: position,
            velocity_mps: velocity,
        });
    }
    samples
}

/// What drives a flight, beside drag and a pull back to the origin.
struct Law {
    kind: Kind,
    /// Typical acceleration, m/s^2.
    size: f64,
    /// Rate of changes, 1/s.
    rate: f64,
    /// Drag, 1/s.
    drag: f64,
    /// Pull back, horizontal and vertical, 1/s^2.
    pull: [f64; 2],
    /// How strong it is along the vertical.
    flat: f64,
    /// What the law asks for now, m/s^2.
    driven: [f64; 3],
    /// Scale of the law now.
    boost: f64,
    /// When the law changes next, s.
    until_s: f64,
    /// Heading of dashes, weaves and turns, rad.
    heading: f64,
    /// Where a dash is.
    phase: Phase,
}

#[derive(Clone, Copy)]
enum Kind {
    Switching,
    Wandering,
    Weaving,
    Dashing,
    Turning,
}

#[derive(Clone, Copy)]
enum Phase {
    Hover,
    Burst,
    Cruise,
    Brake,
}

impl Law {
    fn draw(random: &mut RandomSource) -> Self {
        let kinds = [
            Kind::Switching,
            Kind::Wandering,
            Kind::Weaving,
            Kind::Dashing,
            Kind::Turning,
        ];
        Self {
            kind: kinds[random.below(kinds.len())],
            size: random
                .uniform(1.0_f64.ln(), ACCELERATION_MAX_MPS2.ln())
                .exp(),
            rate: random.uniform(0.3, 2.0),
            drag: random.uniform(0.1, 1.0),
            pull: [random.uniform(0.02, 0.2), random.uniform(0.1, 0.5)],
            flat: random.uniform(0.2, 1.0),
            driven: [0.0; 3],
            boost: 1.0,
            until_s: random.uniform(0.3, 2.0),
            heading: random.uniform(0.0, core::f64::consts::TAU),
            phase: Phase::Hover,
        }
    }

    /// Acceleration at `time_s`, m/s^2.
    fn acceleration(
        &mut self,
        time_s: f64,
        position: [f64; 3],
        velocity: [f64; 3],
        random: &mut RandomSource,
    ) -> [f64; 3] {
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        let changes = time_s >= self.until_s;
        let mut drag = self.drag;
        match self.kind {
            Kind::Switching => {
                for axis in 0..3 {
                    if random.chance(self.rate * STEP_S) {
                        let flat = if axis == 2 { self.flat } else { 1.0 };
                        self.driven[axis] = flat * self.size * [-1.0, 0.0, 1.0][random.below(3)];
                    }
                }
            }
            Kind::Wandering => {
                if random.chance(0.5 * STEP_S) {
                    self.boost = if random.chance(0.3) {
                        random.uniform(2.0, 5.0)
                    } else {
                        random.uniform(0.2, 1.0)
                    };
                }
                for axis in 0..3 {
                    let flat = if axis == 2 { self.flat } else { 1.0 };
                    let spread = 0.4 * self.size * self.boost * flat;
                    self.driven[axis] += -2.0 * self.rate * self.driven[axis] * STEP_S
                        + spread * (4.0 * self.rate * STEP_S).sqrt() * random.normal();
                }
            }
            Kind::Weaving => {
                if random.chance(0.1 * STEP_S) {
                    self.boost = random.uniform(0.2, 1.5);
                }
                let wave = self.boost * self.size * (4.0 * self.rate * time_s).sin();
                let (s, c) = self.heading.sin_cos();
                self.driven = [wave * c, wave * s, 0.7 * self.flat * wave];
            }
            Kind::Dashing => {
                if changes {
                    self.next_phase(time_s, position, random);
                }
                let (s, c) = self.heading.sin_cos();
                self.driven = match self.phase {
                    Phase::Burst if speed < SPEED_MAX_MPS => [
                        self.size * c,
                        self.size * s,
                        self.flat * self.boost * self.size,
                    ],
                    Phase::Brake if speed > 0.1 => {
                        velocity.map(|v| -self.size * v / speed.max(0.5))
                    }
                    _ => [0.0; 3],
                };
                drag = if matches!(self.phase, Phase::Hover) {
                    3.0
                } else {
                    0.0
                };
            }
            Kind::Turning => {
                if changes {
                    self.until_s = time_s + random.uniform(0.5, 3.0);
                    self.boost = random.sign() * random.uniform(0.1, 1.0);
                    self.driven[2] = random.uniform(-1.0, 1.0);
                }
                let wanted = (0.6 * self.size).clamp(2.0, SPEED_MAX_MPS);
                let along = 2.0 * (wanted - speed) / speed.max(0.5);
                let across = self.boost * self.size / speed.max(1.0);
                self.driven[0] = along * velocity[0] - across * velocity[1];
                self.driven[1] = along * velocity[1] + across * velocity[0];
                drag = 0.0;
            }
        }
        // Beyond the largest speed the air holds it back.
        drag += (speed / SPEED_MAX_MPS - 0.9).max(0.0) * 10.0;
        let [level, vertical] = self.pull;
        let pull = [level, level, vertical];
        let limit = self.driven.iter().map(|a| a * a).sum::<f64>().sqrt() / ACCELERATION_MAX_MPS2;
        core::array::from_fn(|axis| {
            self.driven[axis] / limit.max(1.0) - drag * velocity[axis] - pull[axis] * position[axis]
        })
    }

    fn next_phase(&mut self, time_s: f64, position: [f64; 3], random: &mut RandomSource) {
        let (phase, length_s) = match self.phase {
            Phase::Hover => (Phase::Burst, random.uniform(0.3, 1.2)),
            Phase::Burst => (Phase::Cruise, random.uniform(0.0, 1.5)),
            Phase::Cruise => (Phase::Brake, random.uniform(0.3, 1.5)),
            Phase::Brake => (Phase::Hover, random.uniform(0.5, 5.0)),
        };
        if matches!(phase, Phase::Burst) {
            self.heading = if position[0].hypot(position[1]) > 6.0 {
                (-position[1]).atan2(-position[0]) + random.uniform(-0.8, 0.8)
            } else {
                random.uniform(0.0, core::f64::consts::TAU)
            };
            self.boost = random.uniform(-1.0, 1.0);
        }
        self.phase = phase;
        self.until_s = time_s + length_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flights_fill_speeds_and_accelerations_and_stay_within_reach() {
        let mut random = RandomSource::new(8, &[]);
        let (mut speeds, mut accelerations) = ([0_usize; 9], [0_usize; 6]);
        for _ in 0..400 {
            let samples = fly(150, 0.1, &mut random);
            assert_eq!(samples.len(), 150);
            for pair in samples.windows(2) {
                let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                let change: [f64; 3] = core::array::from_fn(|i| {
                    (pair[1].velocity_mps[i] - pair[0].velocity_mps[i]) / 0.1
                });
                let (speed, acceleration) = (length(pair[1].velocity_mps), length(change));
                assert!(
                    speed < 20.0 && acceleration < 45.0,
                    "{speed} {acceleration}"
                );
                assert!(length(pair[1].position_m) < 150.0);
                speeds[(speed / 2.0) as usize] += 1;
                accelerations[((acceleration / 4.0) as usize).min(5)] += 1;
                // Positions and velocities belong together.
                for axis in 0..3 {
                    let mean = 0.5 * (pair[0].velocity_mps[axis] + pair[1].velocity_mps[axis]);
                    let moved = pair[1].position_m[axis] - pair[0].position_m[axis];
                    assert!((moved - 0.1 * mean).abs() < 0.15, "{moved} {mean}");
                }
            }
        }
        assert!(speeds[..7].iter().all(|n| *n > 1000), "{speeds:?}");
        assert!(
            accelerations[..5].iter().all(|n| *n > 1000),
            "{accelerations:?}"
        );
    }

    #[test]
    fn the_seed_decides() {
        let flown = |seed| fly(80, 0.1, &mut RandomSource::new(seed, &[]));
        assert_eq!(flown(1), flown(1));
        assert_ne!(flown(1), flown(2));
    }
}
