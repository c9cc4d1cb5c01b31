//! What a step of each method costs on this machine, one thread.

use bnkf_model_export::flights::flight::Flight;
use serde::Serialize;

use crate::contest::roster::Roster;
use crate::contest::track::track;
use crate::csv_text::{self, number};
use crate::method::Method;
use crate::scenario::radar::{Condition, Radar};
use crate::scoring::median::median;

/// Times that each flight is flown; the fastest counts, for what else ran then disturbed it least.
const REPEATS: usize = 5;

/// Time of one method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MethodTime {
    /// The method.
    pub method: Method,
    /// Median over the flights of the mean time of a step, microseconds.
    pub step_us: f64,
    /// Median time of a flight, milliseconds.
    pub flight_ms: f64,
}

/// Processor time of every method of `roster` over `flights` under `condition`, one after another on
/// this thread. Scoring is part of the time: it is the same small cost for all.
pub fn measure(
    roster: &Roster<'_>,
    flights: &[&Flight],
    radar: &Radar,
    condition: Condition,
    seed: u64,
) -> Vec<MethodTime> {
    let mut seconds: Vec<(Method, Vec<(f64, usize)>)> = roster
        .methods()
        .map(|method| (method, Vec::new()))
        .collect();
    for flight in flights {
        let readings = radar.readings(flight, condition, seed);
        let steps = flight.samples.len() - 1;
        let mut fastest_s = vec![f64::INFINITY; seconds.len()];
        for _ in 0..REPEATS {
            for (index, (_, mut filter)) in roster
                .filters(flight, condition, seed)
                .into_iter()
                .enumerate()
            {
                let start_s = thread_s();
                std::hint::black_box(track(filter.as_mut(), flight, &readings));
                fastest_s[index] = fastest_s[index].min(thread_s() - start_s);
            }
        }
        for ((_, times), fastest_s) in seconds.iter_mut().zip(fastest_s) {
            times.push((fastest_s, steps));
        }
    }
    let middle = |flights: &[(f64, usize)], value: fn(&(f64, usize)) -> f64| {
        let values: Vec<f64> = flights.iter().map(value).collect();
        median(&[&values])
    };
    let time = |(method, flights): (Method, Vec<(f64, usize)>)| MethodTime {
        method,
        step_us: 1e6 * middle(&flights, |(s, steps)| s / *steps as f64),
        flight_ms: 1e3 * middle(&flights, |(s, _)| *s),
    };
    seconds.into_iter().map(time).collect()
}

/// Processor time of this thread, seconds: what other programs take does not count.
#[cfg(unix)]
fn thread_s() -> f64 {
    use rustix::time::{ClockId, clock_gettime};

    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Time since the first call, seconds: without POSIX's clock of a thread other programs count, too.
#[cfg(not(unix))]
fn thread_s() -> f64 {
    use std::sync::LazyLock;
    use std::time::Instant;

    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

/// The times as a table.
pub fn csv(times: &[MethodTime]) -> Vec<u8> {
    let row = |time: &MethodTime| {
        let method = time.method.to_string();
        vec![method, number(time.step_us), number(time.flight_ms)]
    };
    csv_text::csv(&["method", "step_us", "flight_ms"], times.iter().map(row))
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::noise::NoiseTable;

    use super::measure;
    use crate::contest::roster::{Roster, Supplies};
    use crate::method::Method;
    use crate::scenario::radar::Radar;

    #[test]
    fn every_method_takes_time() {
        let row = |i: i32| [0.1 * f64::from(i), 20.0 + 0.1 * f64::from(i), 0.0, 5.0];
        let flight =
            Flight::from_track("line", "line", &(0..100).map(row).collect::<Vec<_>>()).unwrap();
        let roster = Roster::new(&[Method::Ekf, Method::Ukf], Supplies::default()).unwrap();
        let radar = Radar::paper(NoiseTable::Radians);
        let times = measure(&roster, &[&flight], &radar, radar.conditions()[0], 1);
        assert_eq!(times.len(), 2);
        for time in times {
            assert!(time.step_us > 0.0);
            assert!((time.flight_ms - 0.099 * time.step_us).abs() < 1e-9);
        }
    }
}
