//! What the page's script needs: the cells in every measure, and flights to look at from all sides.

use serde::Serialize;

use crate::campaign::outcome::Outcome;
use crate::contest::example::Example;
use crate::contest::track::position_of;
use crate::method::Method;
use crate::plot::ink::at_night;
use crate::plot::palette::look;
use crate::plot::view_from_above;
use crate::report::swatch;
use crate::scoring::cell::CellMetrics;

/// A cell of the table.
#[derive(Serialize)]
struct PageCell<'a> {
    #[serde(flatten)]
    metrics: &'a CellMetrics,
    /// Whether the method says where it was not trained.
    knows_outside: bool,
}

#[derive(Serialize)]
struct Data<'a> {
    cells: Vec<PageCell<'a>>,
    examples: Vec<Flight>,
}

#[derive(Serialize)]
struct Flight {
    title: String,
    truth: Vec<[f64; 3]>,
    readings: Vec<(usize, [f64; 3])>,
    tracks: Vec<Track>,
}

#[derive(Serialize)]
struct Track {
    method: Method,
    /// Name of its symbol.
    symbol: String,
    /// Whether it is drawn before anybody asks for it.
    shown: bool,
    colour: &'static str,
    night: String,
    /// Lengths of dash and blank.
    dash: Vec<f64>,
    /// Outline of the marker at its end, and whether it is filled with paper.
    marker: String,
    hollow: bool,
    points: Vec<[f64; 3]>,
}

/// The data as JSON that may stand inside a script element.
pub fn data(outcome: &Outcome, examples: &[Example<'_>]) -> String {
    let cells = outcome.cells.iter().map(|cell| PageCell {
        metrics: &cell.metrics,
        knows_outside: cell.method.knows_outside(),
    });
    let data = Data {
        cells: cells.collect(),
        examples: examples.iter().map(flight).collect(),
    };
    let json = serde_json::to_string(&data).expect("every value has a representation");
    // "</script>" inside a text would end the element.
    json.replace('<', "\\u003c")
}

fn flight(example: &Example<'_>) -> Flight {
    let near = view_from_above::shown(example);
    let readings = example.readings.iter().enumerate();
    Flight {
        title: format!(
            "{}, {} noise, rate {}",
            example.flight.name, example.noise, example.rate
        ),
        truth: example
            .flight
            .samples
            .iter()
            .map(|sample| centimetres(sample.position_m))
            .collect(),
        readings: readings
            .filter_map(|(index, reading)| {
                Some((index, centimetres(position_of(reading.as_ref()?).into())))
            })
            .collect(),
        tracks: example
            .tracks
            .iter()
            .map(|(method, steps)| {
                let look = look(*method);
                let lengths = look.dash.split_whitespace();
                Track {
                    method: *method,
                    symbol: swatch::id(*method),
                    shown: near.contains(method),
                    colour: look.colour,
                    night: at_night(look.colour),
                    dash: lengths.filter_map(|length| length.parse().ok()).collect(),
                    marker: look.marker.outline(5.0),
                    hollow: look.marker.hollow || look.marker.is_of_lines(),
                    points: steps
                        .iter()
                        .map(|step| centimetres(step.position_m.into()))
                        .collect(),
                }
            })
            .collect(),
    }
}

/// Rounded to what a screen can show, which keeps the page small.
fn centimetres(position_m: [f64; 3]) -> [f64; 3] {
    position_m.map(|value| (value * 100.0).round() / 100.0)
}
