//! Where the radars of a scenario are: in the origin, several that measure by turns, or one that drives.

use crate::radar::pose::Pose;

/// The radars that see a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Sensors {
    /// One, at rest in the origin.
    #[default]
    Origin,
    /// At rest at these places, metres; they measure by turns.
    ByTurns(Vec<[f64; 3]>),
    /// One that drives round the origin, at its height, starting in the east towards the north.
    Circling {
        /// Radius of the circle, metres.
        radius_m: f64,
        /// Speed, metres per second.
        speed_mps: f64,
    },
}

impl Sensors {
    /// The one that has its `turn`-th turn, `time_s` seconds after the first.
    #[must_use]
    pub fn pose(&self, turn: usize, time_s: f64) -> Pose {
        match self {
            Self::Origin => Pose::ORIGIN,
            Self::ByTurns(places) if places.is_empty() => Pose::ORIGIN,
            Self::ByTurns(places) => Pose::at(places[turn % places.len()]),
            Self::Circling {
                radius_m,
                speed_mps,
            } => {
                let (sine, cosine) = {
                    let angle = speed_mps * time_s / radius_m;
                    (libm::sin(angle), libm::cos(angle))
                };
                Pose {
                    position_m: [radius_m * cosine, radius_m * sine, 0.0],
                    velocity_mps: [-speed_mps * sine, speed_mps * cosine, 0.0],
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_come_round() {
        let sensors = Sensors::ByTurns(vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(sensors.pose(0, 0.0), Pose::at([1.0, 2.0, 3.0]));
        assert_eq!(sensors.pose(3, 9.0), Pose::at([4.0, 5.0, 6.0]));
        assert_eq!(sensors.pose(4, 9.0), sensors.pose(0, 0.0));
        assert_eq!(Sensors::ByTurns(vec![]).pose(7, 1.0), Pose::ORIGIN);
        assert_eq!(Sensors::default().pose(7, 1.0), Pose::default());
    }

    #[test]
    fn a_drive_has_its_speed_and_its_velocity_is_the_derivative() {
        let sensors = Sensors::Circling {
            radius_m: 20.0,
            speed_mps: 15.0,
        };
        for time_s in [0.0, 0.7, 3.0, 100.0] {
            let at = |t: f64| sensors.pose(0, t).position_m;
            let pose = sensors.pose(5, time_s);
            let (after, before) = (at(time_s + 1e-4), at(time_s - 1e-4));
            for axis in 0..3 {
                let slope = (after[axis] - before[axis]) / 2e-4;
                assert!((pose.velocity_mps[axis] - slope).abs() < 1e-6);
            }
            let [vx, vy, _] = pose.velocity_mps;
            assert!((vx.hypot(vy) - 15.0).abs() < 1e-12);
            let [x, y, _] = pose.position_m;
            assert!((x.hypot(y) - 20.0).abs() < 1e-12);
        }
    }
}
