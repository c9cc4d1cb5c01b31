//! `host-sim track`: the firmware's tracker on somebody's plots, with no truth beside them.

use std::io::Write as _;
use std::path::PathBuf;

use bnkf::{Inference, PassesError, Settings, TrackerError};
use bnkf_model_export::atomic_file::{self, AtomicWriteError};

use super::positive::positive;
use crate::contest::default_models;
use crate::contest::model::{Model, ModelError};
use crate::csv_text::CsvText;
use crate::exchange::columns::TableError;
use crate::exchange::plots::{self, Plots, StatedSigmas};
use crate::exchange::self_consistency::{SelfConsistency, modes};
use crate::exchange::tracked::{self, Refusal};
use crate::output_folder::{self, OutputFolderError};
use crate::plot::track_figure;

/// Names of the files.
const ESTIMATES: &str = "estimates.csv";
const FIGURE: &str = "track.svg";

/// Tracks recorded plots of a radar: estimates, a picture, and whether the innovations are what the tracker says.
///
/// FILE is CSV, a row for what came at one time: time_s or time_us; any of range_m, elevation_rad (or _deg),
/// azimuth_rad (or _deg), range_rate_mps, empty where not measured, each with its sigma_... column; sensor_x_m,
/// sensor_y_m,sensor_z_m and sensor_vx_mps,... where the radar is not at rest in the origin; late_s. A row without
/// a channel asks for an estimate in a gap; a column `flight` tells targets apart. What `readings` writes
/// is such a file. Angles: azimuth from x (east) towards y (north), elevation from the horizontal.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The plots
    #[arg(long, value_name = "FILE")]
    pub readings: PathBuf,
    /// Blob to track with [default: the built-in recursive one]
    #[arg(long, value_name = "BLOB")]
    pub model: Option<PathBuf>,
    /// Monte Carlo passes per estimate [default: the model's own number]
    #[arg(long, value_name = "N")]
    pub passes: Option<u16>,
    /// Standard deviation of the range, metres, if the file has no column of it; else refused
    #[arg(long, value_name = "M", value_parser = positive)]
    pub sigma_range_m: Option<f64>,
    /// The same of both angles, radians
    #[arg(long, value_name = "RAD", value_parser = positive)]
    pub sigma_angle_rad: Option<f64>,
    /// The same of the range-rate, metres per second
    #[arg(long, value_name = "M/S", value_parser = positive)]
    pub sigma_range_rate_mps: Option<f64>,
    /// Folder for estimates.csv and track.svg; made if it is missing
    #[arg(long, value_name = "DIR", default_value = "out/track")]
    pub out: PathBuf,
}

/// Why nothing was tracked.
#[derive(Debug, thiserror::Error)]
pub enum TrackError {
    /// The plots cannot be used.
    #[error(transparent)]
    Plots(#[from] TableError),
    /// The blob cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// No tracker runs so many passes.
    #[error("--passes: {0}")]
    Passes(#[from] PassesError),
    /// The settings do not fit to the model.
    #[error(transparent)]
    Settings(#[from] TrackerError),
    /// The folder cannot take results.
    #[error(transparent)]
    Folder(#[from] OutputFolderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Every plot was refused; results are there, and say so.
    #[error("{}: nothing was tracked: {first}", file.display())]
    Nothing {
        /// The plots.
        file: PathBuf,
        /// The first that was.
        first: Refusal,
    },
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`TrackError`].
pub fn run(args: &Args) -> Result<(), TrackError> {
    let model = match &args.model {
        Some(path) => Model::read(path)?,
        None => default_models::recursive()?,
    };
    let own = Settings::of(&model.blob());
    let asked = args.passes.map(Inference::of_passes).transpose()?;
    let settings = Settings {
        inference: asked.unwrap_or(own.inference),
        ..own
    };
    let inputs: Vec<_> = args.model.iter().chain([&args.readings]).cloned().collect();
    output_folder::prepare(&args.out, &[ESTIMATES, FIGURE], &inputs)?;
    let sigmas = StatedSigmas {
        range_m: args.sigma_range_m,
        angle_rad: args.sigma_angle_rad,
        range_rate_mps: args.sigma_range_rate_mps,
    };
    let Plots {
        targets,
        unread,
        degrees,
    } = plots::read(&args.readings, sigmas)?;
    if !unread.is_empty() {
        let names = unread.join("`, `");
        eprintln!("note: columns that are not read: `{names}`");
    }
    for [in_radians, in_degrees] in degrees {
        eprintln!(
            "warning: most of `{in_radians}` are more than a whole turn; degrees are read from `{in_degrees}`"
        );
    }
    let (mut text, mut said) = (CsvText::new(&tracked::HEADER), String::new());
    let (mut figure, mut refusal, mut tracked_any) = (None, None, false);
    for target in &targets {
        let answers = tracked::run(&model, settings, target)?;
        text.add(answers.iter().map(|answer| answer.row(&target.name)));
        let consistency = SelfConsistency::of(&answers);
        let consistency = consistency.map_or("no innovation".to_owned(), |c| c.to_string());
        let name = if target.name.is_empty() {
            "track"
        } else {
            &target.name
        };
        said += &format!("{name}: {}; {consistency}\n", modes(&answers));
        let mut refused = answers.iter().filter_map(Refusal::of);
        if let Some(first) = refused.next() {
            said += &format!("first refused: {first}\n");
            refusal.get_or_insert(first);
        }
        tracked_any |= answers.iter().any(|answer| answer.estimate.is_ok());
        figure.get_or_insert_with(|| track_figure::draw(&target.name, &answers));
    }
    let estimates = args.out.join(ESTIMATES);
    atomic_file::write(&estimates, &text.finish())?;
    said += &format!("{}\n", estimates.display());
    if let Some(figure) = figure {
        let path = args.out.join(FIGURE);
        atomic_file::write(&path, figure.as_bytes())?;
        said += &format!("{}\n", path.display());
    }
    std::io::stdout().write_all(said.as_bytes())?;
    match refusal {
        Some(first) if !tracked_any => {
            let file = args.readings.clone();
            Err(TrackError::Nothing { file, first })
        }
        _ => Ok(()),
    }
}
