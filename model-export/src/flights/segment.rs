//! Cutting long flights into segments of equal duration.

use crate::flights::flight::{Flight, SAMPLES_MIN};
use std::ops::Range;

/// The paper's flights last 15 s: 150 samples at 10 Hz.
pub const PAPER_SEGMENT_S: f64 = 15.0;

/// A time step longer than this many median steps is a hole in the recording.
const HOLE_STEPS: f64 = 10.0;

/// Why a flight cannot be cut so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SegmentError {
    /// The duration is negative or not finite.
    #[error("segment duration {0} s is not a number of seconds from 0 (whole flights) on")]
    Duration(f64),
    /// No segment of this duration is a flight.
    #[error(
        "segment duration {segment_s} s: fewer than the {SAMPLES_MIN} samples of a flight in {name}, which has one every {step_s:.3} s; 0 keeps flights whole"
    )]
    FewSamples {
        /// The flight.
        name: String,
        /// The duration.
        segment_s: f64,
        /// Its median time step, seconds.
        step_s: f64,
    },
}

/// What has become of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// The segments, or the whole flight.
    pub segments: Vec<Flight>,
    /// Whether it is the whole flight though it lasts longer: no segment has room between its holes.
    pub has_holes: bool,
}

/// Cuts `flight` into consecutive segments of `segment_s` seconds; 0 keeps it whole.
///
/// - A segment holds the samples from its first one to just before `segment_s` later: 150 at 10 Hz
///   in 15 s. Its time starts at zero, its name is `<flight>#<number from 1>`.
/// - No segment spans a hole in the recording (a step over ten median steps): the cut starts anew
///   behind it.
/// - A remainder shorter than a segment is dropped, except that a flight which holds no full
///   segment stays whole: short flights are not lost.
///
/// # Errors
/// `segment_s` is negative or not finite, or too short for the flight's samples.
pub fn segments(flight: &Flight, segment_s: f64) -> Result<Cut, SegmentError> {
    if !segment_s.is_finite() || segment_s < 0.0 {
        return Err(SegmentError::Duration(segment_s));
    }
    let whole = |has_holes| Cut {
        segments: vec![flight.clone()],
        has_holes,
    };
    if segment_s == 0.0 {
        return Ok(whole(false));
    }
    let samples = &flight.samples;
    let step_s = flight.median_step_s();
    // By as much a segment may be short of its last step, below.
    if segment_s < (SAMPLES_MIN as f64 - 0.5) * step_s {
        return Err(SegmentError::FewSamples {
            name: flight.name.clone(),
            segment_s,
            step_s,
        });
    }
    // Half a step of tolerance: recorded times are rounded and jitter.
    let full_s = segment_s - 0.5 * step_s;
    let mut cut = Vec::new();
    for run in runs(flight, HOLE_STEPS * step_s) {
        let mut first = run.start;
        for end in run.start + 1..=run.end {
            let next_s = if end < run.end {
                samples[end].time_s
            } else {
                samples[end - 1].time_s + step_s
            };
            if next_s - samples[first].time_s > full_s {
                if end - first >= SAMPLES_MIN {
                    cut.push(segment(flight, first..end, cut.len() + 1));
                }
                first = end;
            }
        }
    }
    if cut.is_empty() {
        return Ok(whole(flight.duration_s() + step_s > full_s));
    }
    Ok(Cut {
        segments: cut,
        has_holes: false,
    })
}

/// The stretches of `flight` in which no time step exceeds `hole_s`.
fn runs(flight: &Flight, hole_s: f64) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut first = 0;
    for (i, pair) in flight.samples.windows(2).enumerate() {
        if pair[1].time_s - pair[0].time_s > hole_s {
            runs.push(first..i + 1);
            first = i + 1;
        }
    }
    runs.push(first..flight.samples.len());
    runs
}

fn segment(flight: &Flight, range: Range<usize>, number: usize) -> Flight {
    let start_s = flight.samples[range.start].time_s;
    let mut samples = flight.samples[range].to_vec();
    for sample in &mut samples {
        sample.time_s -= start_s;
    }
    Flight {
        name: format!("{}#{number}", flight.name),
        source: flight.source.clone(),
        samples,
    }
}

#[cfg(test)]
mod tests {
    use super::{Cut, PAPER_SEGMENT_S, SegmentError, segments};
    use crate::flights::flight::{Flight, SAMPLES_MIN};
    use proptest::prelude::*;

    fn flight(times_s: impl IntoIterator<Item = f64>) -> Flight {
        let rows: Vec<[f64; 4]> = times_s.into_iter().map(|t| [t, t, -2.0 * t, 5.0]).collect();
        Flight::from_track("log.csv", "log.csv", &rows).unwrap()
    }

    fn ten_hertz(samples: usize) -> Flight {
        flight((0..samples).map(|i| i as f64 / 10.0))
    }

    #[test]
    fn a_real_length_flight_gives_segments_of_150_samples() {
        let cut = segments(&ten_hertz(1164), PAPER_SEGMENT_S)
            .unwrap()
            .segments;
        assert_eq!(cut.len(), 7);
        for (i, segment) in cut.iter().enumerate() {
            assert_eq!(segment.samples.len(), 150);
            assert_eq!(segment.samples[0].time_s, 0.0);
            assert_eq!(segment.name, format!("log.csv#{}", i + 1));
            assert_eq!(segment.source, "log.csv");
            assert!((segment.samples[0].position_m[0] - 15.0 * i as f64).abs() < 1e-9);
        }
    }

    #[test]
    fn short_and_uncut_flights_stay_whole() {
        for samples in [3, 100, 148] {
            let short = ten_hertz(samples);
            let cut = segments(&short, PAPER_SEGMENT_S).unwrap();
            let whole = Cut {
                segments: vec![short],
                has_holes: false,
            };
            assert_eq!(cut, whole);
        }
        let long = ten_hertz(1000);
        let cut = segments(&long, 0.0).unwrap();
        assert_eq!((cut.segments, cut.has_holes), (vec![long], false));
        let exact = segments(&ten_hertz(150), PAPER_SEGMENT_S).unwrap().segments;
        assert_eq!((exact.len(), exact[0].samples.len()), (1, 150));
        assert_eq!(exact[0].name, "log.csv#1");
    }

    #[test]
    fn no_segment_spans_a_hole() {
        // 20 s, a hole of a minute, 31 s: one segment, then two.
        let times = (0..200)
            .map(|i| f64::from(i) / 10.0)
            .chain((0..310).map(|i| 80.0 + f64::from(i) / 10.0));
        let cut = segments(&flight(times), PAPER_SEGMENT_S).unwrap().segments;
        let starts: Vec<f64> = cut.iter().map(|s| s.samples[0].position_m[0]).collect();
        assert_eq!(starts, [0.0, 80.0, 95.0]);
        assert!(cut.iter().all(|s| s.samples.len() == 150));
    }

    #[test]
    fn a_flight_without_a_whole_stretch_says_so() {
        // 5 s, a hole of 20 s, 5 s.
        let times = (0..50).chain(250..300).map(|i| f64::from(i) / 10.0);
        let holed = flight(times);
        let cut = segments(&holed, PAPER_SEGMENT_S).unwrap();
        assert_eq!((cut.segments, cut.has_holes), (vec![holed.clone()], true));
        let cut = segments(&holed, 5.0).unwrap();
        assert_eq!((cut.segments.len(), cut.has_holes), (2, false));
    }

    #[test]
    fn a_segment_that_is_no_flight_is_refused() {
        for segment_s in [1e-9, 0.1, 0.2, 0.249] {
            let error = segments(&ten_hertz(150), segment_s).unwrap_err();
            assert!(matches!(error, SegmentError::FewSamples { .. }), "{error}");
            assert!(
                error
                    .to_string()
                    .contains("log.csv, which has one every 0.100 s")
            );
        }
        for (segment_s, count) in [(0.26, 50), (0.3, 50), (0.4, 37)] {
            let cut = segments(&ten_hertz(150), segment_s).unwrap();
            assert_eq!(cut.segments.len(), count, "{segment_s}");
        }
    }

    #[test]
    fn impossible_durations_are_refused() {
        for segment_s in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(segments(&ten_hertz(10), segment_s).is_err());
        }
    }

    proptest! {
        #[test]
        fn segments_are_disjoint_in_order_and_long_enough(
            steps in prop::collection::vec(0.05..0.15_f64, 3..400), segment_s in 0.5..20.0_f64
        ) {
            let mut time_s = 0.0;
            let whole = flight(std::iter::once(0.0).chain(steps.iter().map(|step| {
                time_s += step;
                time_s
            })));
            let cut = segments(&whole, segment_s).unwrap().segments;
            // x is the time within the recording: it names every sample.
            let marks: Vec<f64> = cut
                .iter()
                .flat_map(|s| s.samples.iter().map(|sample| sample.position_m[0]))
                .collect();
            prop_assert!(marks.windows(2).all(|pair| pair[0] < pair[1]));
            for segment in &cut {
                prop_assert!(segment.samples.len() >= SAMPLES_MIN);
                prop_assert!(segment.duration_s() < segment_s);
                if segment.name != whole.name {
                    prop_assert!(segment.duration_s() > segment_s - 0.3);
                }
            }
            if cut[0].name != whole.name {
                // Only a remainder is lost.
                prop_assert_eq!(marks[0], 0.0);
                prop_assert!(time_s - marks[marks.len() - 1] < segment_s + 0.15);
            }
        }
    }
}
