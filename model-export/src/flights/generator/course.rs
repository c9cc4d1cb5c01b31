//! What a flight is about: the pilot's intention.

use super::circle::Circle;
use super::lemniscate::Lemniscate;
use super::reference::Reference;
use super::vehicle::{State, Vehicle};
use super::vertical::Vertical;
use super::waypoints::Waypoints;
use crate::random_source::RandomSource;
use nalgebra::Vector3;

/// A periodic course or a waypoint flight.
#[derive(Clone, Copy, Debug)]
pub enum Course {
    Periodic {
        path: Path,
        vertical: Vertical,
        /// Feedback on the position error, 1/s^2.
        stiffness_per_s2: f64,
        /// Feedback on the velocity error, 1/s.
        damping_per_s: f64,
        /// Whether the flight begins on the course instead of at rest.
        moving_start: bool,
    },
    Waypoints(Waypoints),
}

/// The level shape of a periodic course.
#[derive(Clone, Copy, Debug)]
pub enum Path {
    Circle(Circle),
    Lemniscate(Lemniscate),
}

impl Path {
    fn at(&self, t_s: f64) -> Reference {
        match self {
            Self::Circle(circle) => circle.at(t_s),
            Self::Lemniscate(eight) => eight.at(t_s),
        }
    }

    fn rate_rad_per_s(&self) -> f64 {
        match self {
            Self::Circle(circle) => circle.rate_rad_per_s,
            Self::Lemniscate(eight) => eight.rate_rad_per_s,
        }
    }
}

impl Course {
    /// 40% circles, 35% lemniscates, 25% waypoint flights.
    pub fn draw(random: &mut RandomSource, vehicle: &Vehicle, duration_s: f64) -> Self {
        // Log-normal, so that the mean over all samples is the paper's 2.3 m/s.
        let speed_mps = (2.6 * libm::exp(0.3 * random.normal())).clamp(0.7, 4.2);
        let choice = random.unit();
        let path = if choice < 0.4 {
            Path::Circle(Circle::draw(random, vehicle, speed_mps))
        } else if choice < 0.75 {
            Path::Lemniscate(Lemniscate::draw(random, vehicle, speed_mps))
        } else {
            return Self::Waypoints(Waypoints::draw(random, vehicle, speed_mps));
        };
        let stiffness_per_s2 = random.uniform(2.0, 6.0);
        Self::Periodic {
            path,
            vertical: Vertical::draw(random, path.rate_rad_per_s(), duration_s),
            stiffness_per_s2,
            // At least 70% of critical damping: stable with every lag that a vehicle has.
            damping_per_s: 2.0 * stiffness_per_s2.sqrt() * random.uniform(0.7, 1.0),
            moving_start: random.chance(0.8),
        }
    }

    /// First part of the flight's name.
    pub fn kind(&self) -> String {
        match self {
            Self::Periodic { path, vertical, .. } => {
                let shape = match path {
                    Path::Circle(_) => "circle",
                    Path::Lemniscate(_) => "lemniscate",
                };
                format!("{shape}{}", vertical.suffix())
            }
            Self::Waypoints(_) => "waypoints".to_owned(),
        }
    }

    pub fn start(&self) -> State {
        match self {
            Self::Periodic {
                path,
                vertical,
                moving_start,
                ..
            } => {
                let first = vertical.apply(path.at(0.0), 0.0);
                State {
                    position_m: first.position_m,
                    velocity_mps: if *moving_start {
                        first.velocity_mps
                    } else {
                        Vector3::zeros()
                    },
                }
            }
            Self::Waypoints(pilot) => pilot.start(),
        }
    }

    /// The acceleration asked for at `t_s`, m/s^2.
    pub fn command(&mut self, t_s: f64, state: &State, random: &mut RandomSource) -> Vector3<f64> {
        match self {
            Self::Periodic {
                path,
                vertical,
                stiffness_per_s2,
                damping_per_s,
                ..
            } => {
                let wanted = vertical.apply(path.at(t_s), t_s);
                wanted.acceleration_mps2
                    + (wanted.velocity_mps - state.velocity_mps) * *damping_per_s
                    + (wanted.position_m - state.position_m) * *stiffness_per_s2
            }
            Self::Waypoints(pilot) => pilot.command(state, random),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Course, Vehicle};
    use crate::flights::generator::vehicle::STEP_S;
    use crate::random_source::RandomSource;

    #[test]
    fn kinds_come_in_the_stated_shares() {
        let mut counts = std::collections::BTreeMap::<String, u32>::new();
        for seed in 0..2000 {
            let mut random = RandomSource::new(seed, &[]);
            let vehicle = Vehicle::draw(&mut random);
            let kind = Course::draw(&mut random, &vehicle, 15.0).kind();
            let shape = kind.split('-').next().unwrap_or_default().to_owned();
            *counts.entry(shape).or_default() += 1;
        }
        // Four standard deviations of a binomial count.
        for (shape, share) in [("circle", 0.4), ("lemniscate", 0.35), ("waypoints", 0.25)] {
            let slack = 4.0 * f64::sqrt(2000.0 * share * (1.0 - share));
            let error = f64::from(counts[shape]) - 2000.0 * share;
            assert!(error.abs() < slack, "{counts:?}");
        }
    }

    #[test]
    fn a_vehicle_without_gusts_stays_near_its_periodic_course() {
        for seed in 0..100 {
            let mut random = RandomSource::new(seed, &[]);
            let mut vehicle = Vehicle::draw_calm(&mut random);
            let mut course = Course::draw(&mut random, &vehicle, 15.0);
            let mut state = course.start();
            for step in 0..2500 {
                let t_s = f64::from(step) * STEP_S;
                if let Course::Periodic { path, vertical, .. } = &course
                    && t_s > 10.0
                {
                    let wanted = vertical.apply(path.at(t_s), t_s);
                    let error_m = (wanted.position_m - state.position_m).norm();
                    assert!(error_m < 1.5, "seed {seed}: {error_m} m off at {t_s} s");
                }
                let command = course.command(t_s, &state, &mut random);
                state = state.after(STEP_S, vehicle.respond(command, &mut random));
            }
        }
    }
}
