//! Moves flights rigidly into a scenario's volume.
//!
//! A memoryless network knows only the space it was trained in, so a flight recorded elsewhere is
//! turned, perhaps mirrored, and shifted to a random place there. Nothing here panics.

use crate::flights::flight::Flight;
use crate::flights::rigid_move::RigidMove;
use crate::flights::volume::Volume;
use crate::random_source::RandomSource;
use crate::seed;
use std::f64::consts::{PI, TAU};

/// Random moves that are tried before a flight is given up.
pub const TRIES_MAX: usize = 2000;

/// Why a flight has no place in a volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlacementError {
    /// It spans more height than the volume.
    #[error("{flight}: it spans {span_m:.1} m of height, the volume {volume_m:.1} m")]
    TooTall {
        /// Name of the flight.
        flight: String,
        /// Highest minus lowest point, metres.
        span_m: f64,
        /// The volume's, metres.
        volume_m: f64,
    },
    /// None of [`TRIES_MAX`] random moves put every sample inside.
    #[error(
        "{flight}: none of {TRIES_MAX} moves fits it into the volume ({width_m:.1} m x {depth_m:.1} m)"
    )]
    DoesNotFit {
        /// Name of the flight.
        flight: String,
        /// Extent along x before the move, metres.
        width_m: f64,
        /// Extent along y before the move, metres.
        depth_m: f64,
    },
}

/// Moves `flight` to a random place inside `volume`.
///
/// The move depends on (`seed`, flight name) only. Yaw, azimuth and mirror are uniform, the range
/// of the centre is normal ([`Volume::range_m_mean`], [`Volume::range_m_sd`]), its height uniform
/// where the flight fits; moves that leave the volume at any sample are drawn again.
///
/// # Errors
/// The flight does not fit.
pub fn place(flight: &Flight, volume: &Volume, seed: u64) -> Result<Flight, PlacementError> {
    let (low, high) = bounds_m(flight);
    let half_m: [f64; 3] = std::array::from_fn(|axis| 0.5 * (high[axis] - low[axis]));
    let centre_m: [f64; 3] = std::array::from_fn(|axis| low[axis] + half_m[axis]);
    let (lowest_m, highest_m) = (
        volume.height_m_min + half_m[2],
        volume.height_m_max - half_m[2],
    );
    if lowest_m > highest_m {
        return Err(PlacementError::TooTall {
            flight: flight.name.clone(),
            span_m: 2.0 * half_m[2],
            volume_m: volume.height_m_max - volume.height_m_min,
        });
    }
    let mut random = RandomSource::new(
        seed,
        &[seed::name_id("placement"), seed::name_id(&flight.name)],
    );
    for _ in 0..TRIES_MAX {
        let mirror = random.chance(0.5);
        let yaw_rad = random.uniform(0.0, TAU);
        let range_m = volume.range_m_mean + volume.range_m_sd * random.normal();
        let height_m = random.uniform(lowest_m, highest_m);
        let azimuth_rad = random.uniform(-PI, PI);
        if range_m <= height_m.abs() {
            continue;
        }
        let horizontal_m = (range_m * range_m - height_m * height_m).sqrt();
        let (sine, cosine) = libm::sincos(azimuth_rad);
        let target_m = [horizontal_m * cosine, horizontal_m * sine, height_m];
        let turn = RigidMove {
            mirror,
            yaw_rad,
            shift_m: [0.0; 3],
        };
        let turned_m = turn.direction(centre_m);
        let whole = RigidMove {
            shift_m: std::array::from_fn(|axis| target_m[axis] - turned_m[axis]),
            ..turn
        };
        let fits = |sample: &crate::flights::flight::Sample| {
            volume.contains(whole.point(sample.position_m))
        };
        if flight.samples.iter().all(fits) {
            return Ok(whole.flight(flight));
        }
    }
    Err(PlacementError::DoesNotFit {
        flight: flight.name.clone(),
        width_m: 2.0 * half_m[0],
        depth_m: 2.0 * half_m[1],
    })
}

/// Lowest and highest value of each coordinate, metres.
fn bounds_m(flight: &Flight) -> ([f64; 3], [f64; 3]) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for sample in &flight.samples {
        for axis in 0..3 {
            low[axis] = low[axis].min(sample.position_m[axis]);
            high[axis] = high[axis].max(sample.position_m[axis]);
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::{PlacementError, place};
    use crate::flights::flight::Flight;
    use crate::flights::volume::Volume;
    use proptest::prelude::*;

    fn square(name: &str, side_m: f64, rise_m: f64, corner_m: [f64; 3]) -> Flight {
        let [x, y, z] = corner_m;
        let rows = [
            [0.0, x, y, z],
            [5.0, x + side_m, y, z],
            [10.0, x + side_m, y + side_m, z + rise_m],
            [15.0, x, y + side_m, z + rise_m],
        ];
        Flight::from_track(name, name, &rows).unwrap()
    }

    #[test]
    fn the_place_depends_on_seed_and_name_only() {
        let at_origin = square("a", 8.0, 2.0, [0.0; 3]);
        let placed = place(&at_origin, &Volume::PAPER, 1).unwrap();
        assert_eq!(place(&at_origin, &Volume::PAPER, 1), Ok(placed.clone()));
        assert_ne!(place(&at_origin, &Volume::PAPER, 2), Ok(placed.clone()));
        let other_name = square("b", 8.0, 2.0, [0.0; 3]);
        let other = place(&other_name, &Volume::PAPER, 1).unwrap();
        assert_ne!(other.samples, placed.samples);
        assert_eq!((placed.name.as_str(), placed.source.as_str()), ("a", "a"));
    }

    #[test]
    fn flights_that_cannot_fit_are_named_with_their_size() {
        let tall = place(&square("tall", 1.0, 20.0, [0.0; 3]), &Volume::PAPER, 1).unwrap_err();
        assert!(matches!(tall, PlacementError::TooTall { .. }));
        assert_eq!(
            tall.to_string(),
            "tall: it spans 20.0 m of height, the volume 19.9 m"
        );
        let wide = place(&square("wide", 150.0, 1.0, [0.0; 3]), &Volume::PAPER, 1).unwrap_err();
        assert_eq!(
            wide,
            PlacementError::DoesNotFit {
                flight: "wide".to_owned(),
                width_m: 150.0,
                depth_m: 150.0
            }
        );
    }

    #[test]
    fn places_spread_over_the_volume() {
        let mut octants = std::collections::HashSet::new();
        let mut ranges_m = Vec::new();
        for i in 0..400 {
            let flight = square(&format!("f{i}"), 4.0, 1.0, [100.0, 0.0, -50.0]);
            let placed = place(&flight, &Volume::PAPER, 3).unwrap();
            let [x, y, z] = placed.samples[0].position_m;
            octants.insert((x > 0.0, y > 0.0, z > 14.0));
            ranges_m.push((x * x + y * y + z * z).sqrt());
        }
        assert_eq!(octants.len(), 8);
        let mean_m = ranges_m.iter().sum::<f64>() / ranges_m.len() as f64;
        assert!((32.0..37.0).contains(&mean_m), "mean range {mean_m} m");
        let spread = |low: f64, high: f64| {
            let inside = |r: &&f64| (low..high).contains(*r);
            ranges_m.iter().filter(inside).count()
        };
        assert!(spread(18.7, 25.0) > 15 && spread(42.0, 46.9) > 30);
    }

    proptest! {
        #[test]
        fn a_placed_flight_is_inside_and_keeps_its_speeds(
            side_m in 0.0..12.0_f64, rise_m in -10.0..10.0_f64,
            corner_m in prop::array::uniform3(-1e4..1e4_f64), seed in any::<u64>()
        ) {
            let flight = square("f", side_m, rise_m, corner_m);
            let placed = place(&flight, &Volume::PAPER, seed).unwrap();
            for (before, after) in flight.samples.iter().zip(&placed.samples) {
                prop_assert!(Volume::PAPER.contains(after.position_m));
                let speed = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
                prop_assert!((speed(before.velocity_mps) - speed(after.velocity_mps)).abs() < 1e-9);
                prop_assert!((before.velocity_mps[2] - after.velocity_mps[2]).abs() < 1e-9);
            }
        }
    }
}
