//! `host-sim image`: the Cortex-M4F image in QEMU beside the host, bit for bit.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bnkf::blob::Kind;
use bnkf::{Correction, Inference, Part, PassesError, Settings, Tracker};
use bnkf_model_export::flights::csv::options::ReadOptions;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::flight_file::{FlightFileError, read_flight};
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings, generate};
use bnkf_model_export::flights::suspicion::suspicions;
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::RadarSettings;
use bnkf_model_export::radar::sensors::Sensors;
use bnkf_model_export::regular_file::{self, ReadFileError};
use object::{Architecture, BinaryFormat, Object as _};

use crate::contest::default_models;
use crate::contest::model::{Model, ModelError};
use crate::image::build::{ImageBuildError, build_image};
use crate::image::equality::{Comparison, Difference, EqualityError, compare, record};
use crate::image::log::{ImageLogError, LogTable};
use crate::image::qemu::QemuError;
use crate::image::report::{figures, grouped};
use crate::image::session::{ImageSession, SessionError};
use crate::image::stack::deepest;
use crate::image::toolchain::{Toolchain, ToolchainChoice, ToolchainError};

/// Longest wait for one answer: the base for a slow machine, and a share for every pass.
const ANSWER_TIME_BASE: Duration = Duration::from_secs(60);
const ANSWER_TIME_PER_PASS: Duration = Duration::from_millis(200);

/// Largest image, bytes: with all symbols it is a few megabytes.
const IMAGE_BYTES_MAX: u64 = 1 << 28;

/// Runs the microcontroller's image in QEMU over a flight and compares every estimate, forecast and likelihood with the host's.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Image to run instead of building one
    #[arg(long, value_name = "ELF")]
    pub image: Option<PathBuf>,
    /// Blob to put into the image and to run on the host (default: the built-in recursive model)
    #[arg(long, value_name = "BLOB")]
    pub model: Option<PathBuf>,
    /// Flight file (timestamp,tx,ty,tz); `builtin` generates a flight of 150 samples
    #[arg(id = "flights", long = "flight", value_name = "CSV", default_value = BUILTIN)]
    pub flight: PathBuf,
    /// How the flight file is read.
    #[command(flatten)]
    pub reading: ReadOptions,
    /// Noise level of the radar
    #[arg(long, value_enum, default_value_t = NoiseLevel::Medium)]
    pub noise: NoiseLevel,
    /// How the angle figures of the noise levels are read: radians, or degrees as printed
    #[arg(long, value_enum, default_value_t = NoiseTable::Radians)]
    pub noise_table: NoiseTable,
    /// Part of the samples that is measured; the image coasts through the rest
    #[arg(long, default_value = "0.75", value_parser = sampling_rate)]
    pub rate: SamplingRate,
    /// The radar drives on a circle of 20 m at 15 m/s
    #[arg(long)]
    pub moving: bool,
    /// Correction after the network (default: what the model is made for)
    #[arg(long, value_enum)]
    pub correction: Option<CorrectionChoice>,
    /// Monte Carlo passes per estimate (default: the model's own number)
    #[arg(long, value_name = "N")]
    pub passes: Option<u16>,
    /// Draws all but the first eighth of the passes with the standard deviations of those: half the work
    #[arg(long)]
    pub frozen: bool,
    /// Mean and covariance of the network's answers without passes
    #[arg(long, conflicts_with_all = ["passes", "frozen"])]
    pub moments: bool,
    /// Leaves out of the image what this model and this inference do not need
    #[arg(long, conflicts_with = "image")]
    pub lean: bool,
    /// Seed of the flight, the radar's noise and the Monte Carlo passes
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Compiler for the image
    #[arg(long, value_enum, default_value_t = ToolchainChoice::Auto)]
    pub toolchain: ToolchainChoice,
    /// Prints what the image logged
    #[arg(long)]
    pub log: bool,
}

const BUILTIN: &str = "builtin";

/// What `--moving` does.
const MOVING: Sensors = Sensors::Circling {
    radius_m: 20.0,
    speed_mps: 15.0,
};

/// The correction after the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum CorrectionChoice {
    /// The network alone (BNN)
    None,
    /// The converted position (BNKF, BNKFe)
    Converted,
    /// Range, elevation and azimuth themselves
    Polar,
}

impl From<CorrectionChoice> for Correction {
    fn from(choice: CorrectionChoice) -> Self {
        match choice {
            CorrectionChoice::None => Self::None,
            CorrectionChoice::Converted => Self::Converted,
            CorrectionChoice::Polar => Self::Polar,
        }
    }
}

fn sampling_rate(text: &str) -> Result<SamplingRate, String> {
    let rate = text
        .parse()
        .map_err(|_| format!("`{text}` is not a number"))?;
    SamplingRate::new(rate).map_err(|error| error.to_string())
}

/// Why the command failed.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The blob cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// There is no built-in model.
    #[error("there is no built-in model of the recursive kind: give one with --model")]
    NoModel,
    /// No such number of passes.
    #[error("{0}")]
    Passes(#[from] PassesError),
    /// `--frozen` beside mean weights.
    #[error("--frozen: {0} have no spread to freeze; give --passes of two or more")]
    NothingToFreeze(Inference),
    /// The flight file cannot be read.
    #[error(transparent)]
    Flight(#[from] FlightFileError),
    /// The flight cannot be generated.
    #[error(transparent)]
    Generator(#[from] GeneratorError),
    /// No compiler for the target.
    #[error(transparent)]
    Toolchain(#[from] ToolchainError),
    /// The image cannot be built.
    #[error(transparent)]
    Build(#[from] ImageBuildError),
    /// The image cannot be run, or refuses the settings.
    #[error(transparent)]
    Equality(#[from] EqualityError),
    /// The image cannot be read.
    #[error(transparent)]
    Image(#[from] ReadFileError),
    /// QEMU would run its bytes as if they were code.
    #[error("{}: no ELF image for an Arm processor", .0.display())]
    NoImage(PathBuf),
    /// The image's log cannot be read.
    #[error(transparent)]
    Log(#[from] ImageLogError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
    /// The image holds another blob, which happens to give the same estimates.
    #[error("the image holds the blob {image:08x}, not {model:08x}")]
    OtherBlob {
        /// Checksum of the image's blob.
        image: u32,
        /// Checksum of the model.
        model: u32,
    },
    /// Not every estimate is the same.
    #[error("{differing} of {steps} estimates differ between image and host; the first: {first}")]
    Differs {
        /// Steps that differ.
        differing: usize,
        /// All steps.
        steps: usize,
        /// The first difference.
        first: Box<Difference>,
    },
    /// Every estimate is the same, and not every forecast or likelihood.
    #[error("{forecasts} forecasts and {likelihoods} likelihoods differ between image and host")]
    AnswersDiffer {
        /// Forecasts that differ.
        forecasts: usize,
        /// Likelihoods that differ.
        likelihoods: usize,
    },
}

impl From<SessionError> for ImageError {
    fn from(error: SessionError) -> Self {
        Self::Equality(error.into())
    }
}

impl From<QemuError> for ImageError {
    fn from(error: QemuError) -> Self {
        SessionError::from(error).into()
    }
}

/// Runs the command.
///
/// # Errors
/// See [`ImageError`]; any difference is one.
pub fn run(args: &Args) -> Result<(), ImageError> {
    let model = model(args.model.as_deref())?;
    let blob = model.blob();
    let own = Settings::of(&blob);
    let settings = Settings {
        correction: args.correction.map_or(own.correction, Correction::from),
        inference: inference(args, own.inference)?,
        seed: args.seed,
    };
    // The settings are checked before anything slow is started.
    Tracker::new(blob, settings).map_err(EqualityError::from)?;
    if let Some(image) = &args.image {
        let bytes = regular_file::read(image, IMAGE_BYTES_MAX)?;
        if !is_image(&bytes) {
            return Err(ImageError::NoImage(image.clone()));
        }
    }
    let flight = flight(args, &model.volume().unwrap_or(Volume::PAPER))?;
    let radar = RadarSettings::paper(args.noise, args.noise_table, args.rate, args.seed);
    let sensors = if args.moving { MOVING } else { Sensors::Origin };
    let steps = record(&flight, &radar, &sensors);

    let built = tempfile::NamedTempFile::new()?;
    let image = match &args.image {
        Some(image) => image.as_path(),
        None => {
            let toolchain = Toolchain::find(args.toolchain)?;
            eprintln!("building the image with {toolchain}");
            let parts: Vec<Part> = Part::ALL
                .into_iter()
                .filter(|part| !args.lean || settings.needs(blob.kind(), *part))
                .collect();
            build_image(&toolchain, model.bytes(), &parts, built.path())?;
            built.path()
        }
    };
    let passes = match settings.inference {
        Inference::Mean | Inference::Moments => 1,
        Inference::Passes(passes) => passes.count(),
    };
    let answer_time_max = ANSWER_TIME_BASE + ANSWER_TIME_PER_PASS * u32::from(passes);
    let mut session = ImageSession::boot(image, answer_time_max)?;
    let comparison = compare(&mut session, blob, settings, &steps)?;
    let budget = session.budget()?;

    let mut report = String::new();
    let gaps = steps.iter().filter(|s| s.measurement.is_none()).count();
    report += &format!(
        "model         {}, {} bytes, CRC {:08x}\n\
         flight        {}, {} noise, rate {}: {} steps, {gaps} of them in gaps\n",
        model.source,
        grouped(model.bytes().len()),
        blob.checksum(),
        flight.name,
        args.noise,
        args.rate,
        steps.len(),
    );
    if session.ready().blob_crc != blob.checksum() {
        report += &format!(
            "image         holds another blob, CRC {:08x}\n",
            session.ready().blob_crc
        );
    }
    let elf = regular_file::read(image, IMAGE_BYTES_MAX)?;
    let (ready, inference) = (session.ready(), settings.inference);
    let bound = deepest(&elf);
    if let Err(error) = &bound {
        eprintln!("note: the stack has no bound: {error}");
    }
    report += &figures(&comparison, &ready, &budget, bound.ok(), inference);
    std::io::stdout().write_all(report.as_bytes())?;
    if args.log {
        for line in LogTable::of_image(&elf)?.decode(&session.log()?)? {
            println!("log           {line}");
        }
    }
    verdict(&comparison, session.ready().blob_crc, blob.checksum())
}

/// Whether the file is one that QEMU's board can run.
fn is_image(bytes: &[u8]) -> bool {
    object::File::parse(bytes).is_ok_and(|file| {
        (file.format(), file.architecture()) == (BinaryFormat::Elf, Architecture::Arm)
    })
}

/// How the networks are asked, where a model's own way is `own`.
fn inference(args: &Args, own: Inference) -> Result<Inference, ImageError> {
    if args.moments {
        return Ok(Inference::Moments);
    }
    let exact = args.passes.map_or(Ok(own), Inference::of_passes)?;
    match exact.frozen() {
        _ if !args.frozen => Ok(exact),
        frozen if frozen == exact => Err(ImageError::NothingToFreeze(exact)),
        frozen => Ok(frozen),
    }
}

fn model(path: Option<&Path>) -> Result<Model, ImageError> {
    if let Some(path) = path {
        return Ok(Model::read(path)?);
    }
    default_models::load()?
        .into_iter()
        .find(|model| model.blob().kind() == Kind::Recursive)
        .ok_or(ImageError::NoModel)
}

fn flight(args: &Args, volume: &Volume) -> Result<Flight, ImageError> {
    if args.flight != Path::new(BUILTIN) {
        let file = read_flight(&args.flight, &args.reading)?;
        for note in &file.notes {
            eprintln!("note: {}: {note}", file.flight.name);
        }
        for warning in suspicions(std::slice::from_ref(&file.flight), volume) {
            eprintln!("warning: {warning}");
        }
        return Ok(file.flight);
    }
    let settings = GeneratorSettings {
        flights: 1,
        seed: args.seed,
        ..GeneratorSettings::default()
    };
    Ok(generate(&settings)?.remove(0))
}

fn verdict(comparison: &Comparison, image: u32, model: u32) -> Result<(), ImageError> {
    match comparison.first_difference {
        Some(first) => Err(ImageError::Differs {
            differing: comparison.steps - comparison.identical,
            steps: comparison.steps,
            first: Box::new(first),
        }),
        None if !comparison.all_identical() => {
            let (forecasts, likelihoods) = (&comparison.forecasts, &comparison.likelihoods);
            Err(ImageError::AnswersDiffer {
                forecasts: forecasts.asked - forecasts.identical,
                likelihoods: likelihoods.asked - likelihoods.identical,
            })
        }
        None if image != model => Err(ImageError::OtherBlob { image, model }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use bnkf::protocol::RefusalCode;

    use super::*;
    use crate::image::question::Questions;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn passes_are_frozen_on_demand_and_mean_weights_never() {
        let asked = |line: &str, own| {
            let line = std::iter::once("image").chain(line.split_whitespace());
            inference(&<Line as clap::Parser>::parse_from(line).args, own)
        };
        let passes = |count| Inference::of_passes(count).unwrap();
        let own = passes(100);
        assert_eq!(asked("", own).unwrap(), own);
        assert_eq!(asked("--frozen", own).unwrap(), own.frozen());
        let sixteen = asked("--passes 16 --frozen", Inference::Mean).unwrap();
        assert_eq!(sixteen, passes(16).frozen());
        for (line, own) in [("--frozen", Inference::Mean), ("--passes 1 --frozen", own)] {
            let error = asked(line, own).unwrap_err().to_string();
            assert!(error.contains("mean weights have no spread"), "{error}");
        }
    }

    #[test]
    fn any_difference_is_a_failure() {
        let mut comparison = Comparison {
            steps: 150,
            identical: 150,
            refused: 0,
            first_difference: None,
            ticks_measured: vec![3, 1, 2],
            ticks_coasted: vec![],
            forecasts: Questions::default(),
            likelihoods: Questions::default(),
        };
        assert!(verdict(&comparison, 7, 7).is_ok());
        assert!(verdict(&comparison, 7, 8).is_err());
        comparison.forecasts.asked = 2;
        let error = verdict(&comparison, 7, 7).unwrap_err().to_string();
        assert!(
            error.starts_with("2 forecasts and 0 likelihoods"),
            "{error}"
        );
        comparison.identical = 149;
        comparison.first_difference = Some(Difference {
            step: 3,
            image: Err(RefusalCode::Time),
            host: Err(RefusalCode::Numerical),
        });
        let error = verdict(&comparison, 7, 7).unwrap_err().to_string();
        assert!(error.starts_with("1 of 150 estimates differ"), "{error}");
        assert!(error.contains("step 3"), "{error}");
    }
}
