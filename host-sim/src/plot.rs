//! Figures as SVG text: white background, one colour and marker per method everywhere.

pub mod comparison_figure;
pub mod flights_figure;
pub mod gaps_figure;
pub mod legend;
pub mod metrics_figure;
pub mod motion_figure;
pub mod palette;
pub mod panel;
pub mod phases_figure;
pub mod reliability_figure;
pub mod runtime_figure;
pub mod scale;
pub mod svg;
pub mod track_figure;
pub mod trajectory_figure;
pub mod variation_figure;
