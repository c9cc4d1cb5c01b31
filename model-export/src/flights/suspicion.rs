//! Flights that are legal and hardly what was meant: far from where the models expect them, or
//! faster than any aircraft. Results are then numbers about nothing, so somebody must say it.

use crate::flights::csv::time_unit::SPEED_MPS_MAX;
use crate::flights::flight::Flight;
use crate::flights::volume::Volume;

/// With less than this part of the positions in the volume the models are out of their depth.
const INSIDE_MIN: f64 = 0.2;

/// One sentence for everything suspicious about `flights`, which models for `volume` will see.
#[must_use]
pub fn suspicions(flights: &[Flight], volume: &Volume) -> Vec<String> {
    [elsewhere(flights, volume), too_fast(flights)]
        .into_iter()
        .flatten()
        .collect()
}

fn elsewhere(flights: &[Flight], volume: &Volume) -> Option<String> {
    let positions = || flights.iter().flat_map(|flight| &flight.samples);
    let all = positions().count();
    let inside = positions()
        .filter(|sample| volume.contains(sample.position_m))
        .count();
    if all == 0 || inside as f64 >= INSIDE_MIN * all as f64 {
        return None;
    }
    let share = match inside {
        0 => "nothing lies".to_owned(),
        _ => format!(
            "only {:.0} % of the positions lie",
            100.0 * inside as f64 / all as f64
        ),
    };
    let (mut nearest_m, mut farthest_m) = (f64::INFINITY, 0.0_f64);
    let (mut lowest_m, mut highest_m) = (f64::INFINITY, f64::NEG_INFINITY);
    for sample in positions() {
        let [x, y, z] = sample.position_m;
        let range_m = (x * x + y * y + z * z).sqrt();
        (nearest_m, farthest_m) = (nearest_m.min(range_m), farthest_m.max(range_m));
        (lowest_m, highest_m) = (lowest_m.min(z), highest_m.max(z));
    }
    Some(format!(
        "{share} in the models' volume ({:.0} to {:.0} m from the radar, {}): the flights are {nearest_m:.0} to \
         {farthest_m:.0} m away and {lowest_m:.0} to {highest_m:.0} m high; --place moves them into the volume, \
         --radar X,Y,Z (evaluate) says where the radar stands",
        volume.range_m_min,
        volume.range_m_max,
        heights(volume),
    ))
}

fn heights(volume: &Volume) -> String {
    // Models without heights of their own have those of their ranges.
    if volume.height_m_max >= volume.range_m_max {
        return "at any height".to_owned();
    }
    format!(
        "{:.0} to {:.0} m high",
        volume.height_m_min, volume.height_m_max
    )
}

fn too_fast(flights: &[Flight]) -> Option<String> {
    let mut fast = 0_usize;
    let mut fastest: Option<(f64, &str)> = None;
    for flight in flights {
        for sample in &flight.samples {
            let [x, y, z] = sample.velocity_mps;
            let speed_mps = (x * x + y * y + z * z).sqrt();
            if speed_mps > SPEED_MPS_MAX {
                fast += 1;
                if fastest.is_none_or(|(before, _)| speed_mps > before) {
                    fastest = Some((speed_mps, &flight.name));
                }
            }
        }
    }
    let (speed_mps, name) = fastest?;
    Some(format!(
        "{fast} samples are faster than {SPEED_MPS_MAX} m/s, {name} up to {speed_mps:.0} m/s: are times and positions in \
         other units (--time-unit), or does the recording jump?"
    ))
}

#[cfg(test)]
mod tests {
    use super::suspicions;
    use crate::flights::flight::Flight;
    use crate::flights::volume::Volume;

    /// Ten seconds at `speed_mps` from `start_m`.
    fn flight(start_m: [f64; 3], speed_mps: f64) -> Flight {
        let [x, y, z] = start_m;
        let row = |i: i32| {
            let time_s = 0.1 * f64::from(i);
            [time_s, x, y + speed_mps * time_s, z]
        };
        let rows: Vec<_> = (0..=100).map(row).collect();
        Flight::from_track("f", "f", &rows).unwrap()
    }

    #[test]
    fn flights_where_they_belong_raise_none() {
        let good = flight([30.0, -10.0, 12.0], 2.0);
        assert_eq!(suspicions(&[good], &Volume::PAPER), [""; 0]);
        assert_eq!(suspicions(&[], &Volume::PAPER), [""; 0]);
    }

    #[test]
    fn utm_coordinates_name_the_options_that_help() {
        let utm = flight([691_020.0, 5_334_020.0, 532.0], 2.0);
        let said = suspicions(&[utm], &Volume::PAPER);
        assert_eq!(said.len(), 1, "{said:?}");
        for part in [
            "nothing lies",
            "19 to 47 m",
            "5378594 to 5378614 m away",
            "--place",
            "--radar X,Y,Z",
        ] {
            assert!(said[0].contains(part), "{part}: {said:?}");
        }
        let partly = flight([30.0, 20.0, 12.0], 20.0);
        let said = suspicions(&[partly], &Volume::PAPER);
        assert!(said[0].starts_with("only 7 %"), "{said:?}");
    }

    #[test]
    fn speeds_of_no_aircraft_are_named_with_their_flight() {
        let said = suspicions(&[flight([30.0, -10.0, 12.0], 151.0)], &Volume::PAPER);
        let speed = said.last().unwrap();
        assert!(
            speed.starts_with("101 samples are faster than 150 m/s, f up to 151 m/s"),
            "{said:?}"
        );
        assert!(speed.contains("--time-unit"));
        let slow = suspicions(&[flight([30.0, -10.0, 12.0], 149.0)], &Volume::PAPER);
        assert!(slow.iter().all(|said| !said.contains("faster")), "{slow:?}");
    }
}
