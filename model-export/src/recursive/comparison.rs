//! What rounding and single precision cost: the blob in the firmware's tracker beside the unrounded
//! network in the training's filter.

use super::model::RecursiveModel;
use super::network::sampling::Sampling;
use super::score::Score;
use super::step::Weighing;
use super::step_programs::Programs;
use super::trial::{Cell, TrackerScore};
use crate::kernel::Tier;
use bnkf::blob::Blob;
use bnkf::{Inference, TrackerError};
use serde::Serialize;

/// Largest share by which the mean distance may rise.
pub const DISTANCE_SHARE_MAX: f64 = 0.01;
/// Largest change of the mean NEES.
pub const NEES_CHANGE_MAX: f64 = 0.2;

/// One cell by both.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Noise and rate.
    pub cell: String,
    /// Unrounded mean weights, double-precision filter.
    pub unrounded: Score,
    /// The blob in the firmware's tracker.
    pub tracker: TrackerScore,
}

impl Comparison {
    /// Whether the blob is as good as what it was rounded from.
    #[must_use]
    pub fn accepted(&self) -> bool {
        let (tracker, unrounded) = (&self.tracker.score.means, &self.unrounded.means);
        self.tracker.score.lost == 0
            && tracker.steps == unrounded.steps
            && tracker.distance_m <= (1.0 + DISTANCE_SHARE_MAX) * unrounded.distance_m
            && (tracker.nees - unrounded.nees).abs() <= NEES_CHANGE_MAX
    }
}

/// Compares `blob` with the model that it was written from, over `cells`.
///
/// # Errors
/// The blob is of another kind.
pub fn compare(
    model: &RecursiveModel,
    blob: Blob<'_>,
    cells: &[Cell],
    inference: Inference,
) -> Result<Vec<Comparison>, TrackerError> {
    let programs = Programs::new(&model.parameters, &model.normalisation, Weighing::All);
    let weights = model.network.weights(Tier::detect(), Sampling::Nothing);
    let one = |cell: &Cell| {
        let encounters = cell.encounters(&model.parameters.population);
        Ok(Comparison {
            cell: cell.name.clone(),
            unrounded: Score::of(&programs, &weights, &encounters),
            tracker: cell.track(blob, inference)?,
        })
    };
    cells.iter().map(one).collect()
}

/// A line for each cell: mean distance, NEES and coverage of both, and the tracker's events.
#[must_use]
pub fn table(comparisons: &[Comparison]) -> String {
    let mut text = format!(
        "{:<16}{:>25}{:>25}{:>10}{:>10}{:>10}\n",
        "cell", "unrounded ED/NEES/90%", "blob ED/NEES/90%", "rejected", "restarts", "refused"
    );
    for comparison in comparisons {
        let triple = |score: &Score| {
            let m = &score.means;
            format!(
                "{:.3} {:.2} {:.1}",
                m.distance_m,
                m.nees,
                100.0 * m.coverage90
            )
        };
        text += &format!(
            "{:<16} {:>24} {:>24}{:>10}{:>10}{:>10}{}\n",
            comparison.cell,
            triple(&comparison.unrounded),
            triple(&comparison.tracker.score),
            comparison.tracker.rejected,
            comparison.tracker.restarted,
            comparison.tracker.score.lost,
            if comparison.accepted() {
                ""
            } else {
                "  differs"
            }
        );
    }
    if !comparisons.iter().all(Comparison::accepted) {
        text += &format!(
            "differs: rounding to int8 costs more than {} % of the distance or {NEES_CHANGE_MAX} of NEES here, or the \
             tracker refused steps; few flights differ by chance\n",
            100.0 * DISTANCE_SHARE_MAX
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scoring::means::Means;

    #[test]
    fn a_blob_that_is_worse_is_not_accepted() {
        let score = |distance_m, nees, lost| Score {
            means: Means {
                steps: 10,
                distance_m,
                nees,
                coverage90: 0.9,
                surprise: 0.0,
            },
            lost,
        };
        let comparison = |distance_m, nees, lost| Comparison {
            cell: "low".to_owned(),
            unrounded: score(1.0, 3.0, 0),
            tracker: TrackerScore {
                score: score(distance_m, nees, lost),
                rejected: 0,
                restarted: 0,
            },
        };
        assert!(comparison(1.009, 3.1, 0).accepted());
        assert!(!comparison(1.011, 3.0, 0).accepted());
        assert!(!comparison(1.0, 3.3, 0).accepted());
        assert!(!comparison(1.0, 3.0, 1).accepted());
        assert!(!comparison(f64::NAN, 3.0, 0).accepted());
        assert!(table(&[comparison(2.0, 3.0, 0)]).contains("differs: rounding"));
        // However far off a blob is, its numbers stand apart.
        let far = table(&[comparison(1e9, 1e12, 0)]);
        assert!(
            far.contains(" 1.000 3.00 90.0 1000000000.000 1000000000000.00 90.0 "),
            "{far}"
        );
    }
}
