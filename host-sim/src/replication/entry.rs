//! The lines of the replication's tables: an estimator made by a recipe.

use serde::{Deserialize, Serialize};

use super::departure::Departure;
use super::recipe::Recipe;

/// What answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// The paper's EKF: truth start, q = 0.1 m^2/s^3.
    Ekf,
    /// The paper's UKF with a spread of the sigma points that stays finite.
    Ukf,
    /// The paper's UKF with the customary spread, alpha = 1e-3.
    UkfNarrow,
    /// The reading converted to Cartesian coordinates.
    Converted,
    /// The reading's direction at the training flights' mean range.
    ConstantRange,
    /// One network, no correction.
    Bnn,
    /// One network and the correction.
    Bnkf,
    /// One network for each output and the correction.
    Bnkfe,
}

/// A table of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Section {
    /// Preset `reference-code`.
    ReferenceCode,
    /// Preset `paper`, angle figures in degrees as printed.
    PaperDegrees,
    /// Preset `paper`, angle figures as radians.
    PaperRadians,
    /// BNKF under `reference-code`, one departure taken back at a time.
    FromReferenceCode,
    /// BNKF under `paper` in degrees, one departure taken at a time.
    FromPaper,
}

impl Section {
    /// All of them, in the order of the page.
    pub const ALL: [Self; 5] = [
        Self::ReferenceCode,
        Self::PaperDegrees,
        Self::PaperRadians,
        Self::FromReferenceCode,
        Self::FromPaper,
    ];

    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ReferenceCode => "reference-code",
            Self::PaperDegrees => "paper-degrees",
            Self::PaperRadians => "paper-radians",
            Self::FromReferenceCode => "from-reference-code",
            Self::FromPaper => "from-paper",
        }
    }

    /// Its heading.
    pub const fn title(self) -> &'static str {
        match self {
            Self::ReferenceCode => "Ours, preset reference-code",
            Self::PaperDegrees => "Ours, preset paper, angles in degrees as printed",
            Self::PaperRadians => "Ours, preset paper, angles as radians",
            Self::FromReferenceCode => "What each departure is worth, from reference-code",
            Self::FromPaper => "What each departure is worth, from paper",
        }
    }

    /// What its lines are.
    pub const fn explanation(self) -> &'static str {
        match self {
            Self::ReferenceCode => {
                "As the published code does it: every departure of the ablation below is taken."
            }
            Self::PaperDegrees => {
                "As the paper says it: loss = MSE + KL over all weights, gaps scored with the last estimate\nheld, causal, nothing dropped. Prior N(0, 0.01^2); the unit prior that Eq. 14 prints is in the\nlast table. \"KL / rows\" divides the KL by the number of training rows, as a bound on the\nevidence does."
            }
            Self::PaperRadians => "The same with angle errors 57 times larger.",
            Self::FromReferenceCode => {
                "BNKF; each line takes back one departure. Per cent: ED beside the first line."
            }
            Self::FromPaper => {
                "BNKF, angles in degrees, KL / rows; each line takes one departure. Per cent: ED beside the\nfirst line."
            }
        }
    }

    /// Whether its lines are compared with the first.
    pub const fn compares(self) -> bool {
        matches!(self, Self::FromReferenceCode | Self::FromPaper)
    }
}

/// One line: three cells, low to high noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its table.
    pub section: Section,
    /// Its name there.
    pub label: String,
    /// How it is made and scored.
    pub recipe: Recipe,
    /// What answers.
    pub estimator: Estimator,
}

impl Estimator {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 8] = [
        Self::Ekf,
        Self::Ukf,
        Self::UkfNarrow,
        Self::Converted,
        Self::ConstantRange,
        Self::Bnn,
        Self::Bnkf,
        Self::Bnkfe,
    ];

    /// Name in the tables.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Ekf => "EKF",
            Self::Ukf => "UKF, alpha 1",
            Self::UkfNarrow => "UKF, alpha 0.001",
            Self::Converted => "converted measurement",
            Self::ConstantRange => "direction x constant range",
            Self::Bnn => "BNN",
            Self::Bnkf => "BNKF",
            Self::Bnkfe => "BNKFe",
        }
    }

    /// Whether networks are trained for it, and then whether one for each output.
    pub const fn per_output(self) -> Option<bool> {
        match self {
            Self::Bnn | Self::Bnkf => Some(false),
            Self::Bnkfe => Some(true),
            Self::Ekf | Self::Ukf | Self::UkfNarrow | Self::Converted | Self::ConstantRange => None,
        }
    }
}

/// Every line of the page. Folds by segment differ from folds by recording only if `shared`:
/// recordings hold more than one segment.
pub fn entries(shared: bool) -> Vec<Entry> {
    let mut entries = Vec::new();
    let mut add = |section, label: &str, recipe, estimator| {
        entries.push(Entry {
            section,
            label: label.to_owned(),
            recipe,
            estimator,
        });
    };
    let paper = Recipe::PAPER;
    let per_row = paper.with_divergence_per_row();
    let reference = Recipe::REFERENCE_CODE;
    let undropped = reference.switched(Departure::OutliersDropped);
    for estimator in Estimator::ALL {
        add(
            Section::ReferenceCode,
            estimator.label(),
            reference,
            estimator,
        );
        if matches!(
            estimator,
            Estimator::Ekf | Estimator::Ukf | Estimator::UkfNarrow
        ) {
            let label = format!("{}, nothing dropped", estimator.label());
            add(Section::ReferenceCode, &label, undropped, estimator);
        }
    }
    for (section, table) in [
        (Section::PaperDegrees, paper),
        (Section::PaperRadians, paper.with(Departure::Radians)),
    ] {
        let mended = table.with_divergence_per_row();
        for estimator in Estimator::ALL {
            add(section, estimator.label(), table, estimator);
        }
        for estimator in [Estimator::Bnn, Estimator::Bnkf, Estimator::Bnkfe] {
            let label = format!("{}, KL / rows", estimator.label());
            add(section, &label, mended, estimator);
        }
    }
    let bnkf = Estimator::Bnkf;
    let counted = |departure: &Departure| shared || *departure != Departure::SegmentFolds;
    add(
        Section::FromReferenceCode,
        "reference-code",
        reference,
        bnkf,
    );
    add(
        Section::FromReferenceCode,
        "trained again, other random numbers",
        reference.with_other_luck(),
        bnkf,
    );
    add(
        Section::FromReferenceCode,
        "no correction (BNN)",
        reference,
        Estimator::Bnn,
    );
    for departure in Departure::ALL.into_iter().filter(counted) {
        let recipe = reference.switched(departure);
        add(
            Section::FromReferenceCode,
            departure.not_taken(),
            recipe,
            bnkf,
        );
        if departure == Departure::Cartesian {
            let label = format!("{}, no correction", departure.not_taken());
            add(Section::FromReferenceCode, &label, recipe, Estimator::Bnn);
        }
    }
    let both = reference.switched(Departure::LastBias);
    let both = both.with_divergence_per_row();
    add(
        Section::FromReferenceCode,
        "KL of all weights / rows, sigmas learned",
        both,
        bnkf,
    );
    add(Section::FromPaper, "paper, KL / rows", per_row, bnkf);
    add(
        Section::FromPaper,
        "trained again, other random numbers",
        per_row.with_other_luck(),
        bnkf,
    );
    add(
        Section::FromPaper,
        "no correction (BNN)",
        per_row,
        Estimator::Bnn,
    );
    add(Section::FromPaper, "KL not / rows", paper, bnkf);
    add(
        Section::FromPaper,
        "prior N(0, 1), KL / rows",
        per_row.with_unit_prior(),
        bnkf,
    );
    add(
        Section::FromPaper,
        "prior N(0, 1), KL not / rows",
        paper.with_unit_prior(),
        bnkf,
    );
    for departure in Departure::ALL.into_iter().filter(counted) {
        let recipe = per_row.switched(departure);
        add(Section::FromPaper, departure.taken(), recipe, bnkf);
    }
    entries
}
