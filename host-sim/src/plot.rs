//! Figures as SVG text: white background, one colour and marker per method everywhere.

pub mod legend;
pub mod metrics_figure;
pub mod palette;
pub mod panel;
pub mod scale;
pub mod svg;
pub mod trajectory_figure;
