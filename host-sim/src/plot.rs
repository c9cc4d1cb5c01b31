//! Figures as SVG text: one colour, marker and dash per method everywhere; white, or dark where the
//! reader's system is.

pub mod comparison_figure;
pub mod flights_figure;
pub mod forecast_figure;
pub mod gaps_figure;
pub mod ink;
pub mod legend;
pub mod marker;
pub mod method_rows;
pub mod metrics_figure;
pub mod motion_figure;
pub mod palette;
pub mod panel;
pub mod phases_figure;
pub mod reliability_figure;
pub mod runtime_figure;
pub mod scale;
pub mod slot;
pub mod suspicion_figure;
pub mod svg;
pub mod track_figure;
pub mod trajectory_figure;
pub mod variation_figure;
pub mod view_from_above;
