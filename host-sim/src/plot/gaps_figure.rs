//! How a sampling rate leaves gaps: the readings of one flight over time, a row per rate.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::reading::Reading;

use crate::contest::track::position_of;
use crate::plot::ink::{ALARM, GAP, INK};
use crate::plot::legend::{self, Mark};
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::slot::stretches;
use crate::plot::svg::{Rect, Stroke, Svg};

const LEFT: f64 = 70.0;
const WIDTH: f64 = 1120.0;
const PANEL_HEIGHT: f64 = 120.0;
const PANEL_GAP: f64 = 44.0;
const HEADER: f64 = 104.0;
const TRUTH: Stroke<'static> = Stroke::solid(INK, 1.8);

/// The figure: `rows` holds one entry per sample for each rate. Readings beyond the axis are cut.
pub fn draw(flight: &Flight, rows: &[(SamplingRate, Vec<Option<Reading>>)]) -> String {
    let height = HEADER + rows.len() as f64 * (PANEL_HEIGHT + PANEL_GAP) - PANEL_GAP + 52.0;
    let mut svg = Svg::new(
        WIDTH,
        height,
        "Readings of one flight at each sampling rate",
        "A row per sampling rate: the true x over time, a dot per reading, and grey stripes where there are none.",
    );
    let title = format!("Sampling rates: the readings of {} along x", flight.name);
    svg.heading((LEFT, 26.0), &title);
    let entries = [
        (Mark::Line(TRUTH), "truth"),
        (Mark::Dot(ALARM), "readings"),
        (Mark::Patch(GAP, 1.0), "gap: no readings"),
    ];
    legend::draw(&mut svg, (LEFT, 56.0), &entries);
    let truth: Vec<_> = flight
        .samples
        .iter()
        .map(|s| (s.time_s, s.position_m[0]))
        .collect();
    let (low, high) = truth
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, x)| {
            (low.min(*x), high.max(*x))
        });
    let margin = 0.35 * (high - low).max(2.0);
    for (index, (rate, readings)) in rows.iter().enumerate() {
        let panel = Panel {
            frame: Rect {
                x: LEFT,
                y: HEADER + index as f64 * (PANEL_HEIGHT + PANEL_GAP),
                width: WIDTH - LEFT - 24.0,
                height: PANEL_HEIGHT,
            },
            x: Scale::linear(0.0, flight.duration_s()),
            y: Scale::linear(low - margin, high + margin),
        };
        for (from, to) in gaps_s(flight, readings) {
            panel.stripe(&mut svg, from, to, GAP);
        }
        panel.y_grid(&mut svg, true);
        panel.title(
            &mut svg,
            &format!(
                "rate {rate}: {} of {} samples",
                readings.iter().flatten().count(),
                readings.len()
            ),
        );
        panel.y_name(&mut svg, "x (east), m", 44.0);
        if index + 1 == rows.len() {
            panel.x_grid(&mut svg, 10);
            panel.x_name(&mut svg, "time, s");
        }
        panel.line(&mut svg, &truth, TRUTH);
        let dots: Vec<_> = flight
            .samples
            .iter()
            .zip(readings)
            .filter_map(|(sample, reading)| Some((sample.time_s, position_of(reading.as_ref()?).x)))
            .map(|(time_s, x)| panel.at(time_s, x))
            .collect();
        svg.clipped(panel.frame, |svg| {
            for at in &dots {
                svg.circle(*at, 2.4, ALARM);
            }
        });
        panel.axes(&mut svg);
    }
    svg.finish()
}

/// Stretches without readings, seconds.
fn gaps_s(flight: &Flight, readings: &[Option<Reading>]) -> Vec<(f64, f64)> {
    let samples = flight.samples.iter().zip(readings);
    stretches(samples.map(|(sample, reading)| (sample.time_s, reading.is_none())))
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};

    use super::{draw, gaps_s};

    #[test]
    fn a_row_per_rate_with_its_gaps() {
        let row = |i: i32| [0.1 * f64::from(i), 20.0 + 0.1 * f64::from(i), 0.0, 5.0];
        let flight =
            Flight::from_track("line", "line", &(0..100).map(row).collect::<Vec<_>>()).unwrap();
        let rows: Vec<_> = SamplingRate::ALL
            .into_iter()
            .map(|rate| {
                let settings = RadarSettings::paper(NoiseLevel::Low, NoiseTable::Radians, rate, 1);
                (rate, sample_radar(&flight, &settings))
            })
            .collect();
        assert_eq!(gaps_s(&flight, &rows[0].1), []);
        // Blocks of ten samples, five of them measured.
        let gaps = gaps_s(&flight, &rows[2].1);
        assert_eq!(gaps.len(), 10);
        assert!((gaps[0].0 - 0.45).abs() < 1e-9 && (gaps[0].1 - 0.95).abs() < 1e-9);
        assert!((gaps[9].1 - 9.9).abs() < 1e-9);
        let text = draw(&flight, &rows);
        assert!(text.contains("rate 0.50: 50 of 100 samples"));
    }
}
