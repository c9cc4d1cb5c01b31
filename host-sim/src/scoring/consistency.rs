//! Whether a filter's covariance tells the truth: NEES and NIS against chi-square bounds, and how
//! often the truth lies inside ellipsoids of every size.

use serde::Serialize;

use crate::filter::Nis;
use crate::scoring::chi_square;

/// Nominal probabilities of the reliability diagram.
pub const NOMINAL: [f64; 11] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95];

/// Degrees of freedom of a position error.
const DOF: f64 = 3.0;

/// Ends of the 95% region of the averaged statistic.
const ENDS: (f64, f64) = (0.025, 0.975);

/// A statistic averaged over flights at each step, against its chi-square bounds (Bar-Shalom, Li
/// and Kirubarajan, Estimation with Applications, section 5.4).
///
/// Flights are independent, steps of one flight are not: only averages over flights have the
/// chi-square distribution with `flights * degrees` degrees of freedom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Bounds {
    /// Steps with at least one value.
    pub steps: u64,
    /// Fraction of steps whose average lies within the 95% bounds (ideal 0.95).
    pub inside: f64,
    /// Fraction above them: overconfident.
    pub above: f64,
    /// Fraction below them: too cautious.
    pub below: f64,
}

/// Checks NEES: one inner slice per flight, with `D^2` of every scored step.
pub fn nees_bounds(flights: &[Vec<f64>]) -> Bounds {
    let longest = flights.iter().map(Vec::len).max().unwrap_or(0);
    let at = |step: usize| {
        let values = flights.iter().filter_map(move |flight| flight.get(step));
        values.fold((0.0, 0.0), |(sum, dof), value| (sum + value, dof + DOF))
    };
    bounds((0..longest).map(at))
}

/// Checks NIS: one inner slice per flight, with an entry per scored step.
pub fn nis_bounds(flights: &[Vec<Option<Nis>>]) -> Bounds {
    let longest = flights.iter().map(Vec::len).max().unwrap_or(0);
    let at = |step: usize| {
        let values = flights
            .iter()
            .filter_map(move |flight| flight.get(step).copied().flatten());
        values.fold((0.0, 0.0), |(sum, dof), nis| {
            (sum + nis.value, dof + nis.degrees as f64)
        })
    };
    bounds((0..longest).map(at))
}

/// `steps` yields the sum over flights and its degrees of freedom.
fn bounds(steps: impl Iterator<Item = (f64, f64)>) -> Bounds {
    let (mut count, mut above, mut below) = (0_u64, 0_u64, 0_u64);
    let mut known: Option<(f64, (f64, f64))> = None;
    for (sum, dof) in steps {
        if dof == 0.0 {
            continue;
        }
        count += 1;
        let limits = match known {
            Some((of, limits)) if of == dof => limits,
            _ => (
                chi_square::quantile(ENDS.0, dof),
                chi_square::quantile(ENDS.1, dof),
            ),
        };
        known = Some((dof, limits));
        // NaN counts as above: it is certainly not consistent.
        above += u64::from(sum > limits.1 || sum.is_nan());
        below += u64::from(sum < limits.0);
    }
    let part = |steps: u64| steps as f64 / count as f64;
    Bounds {
        steps: count,
        inside: part(count - above - below),
        above: part(above),
        below: part(below),
    }
}

/// Fraction of `squared` Mahalanobis distances inside the ellipsoid of each of [`NOMINAL`]; NaN
/// without values.
pub fn reliability(squared: &[f64]) -> [f64; NOMINAL.len()] {
    NOMINAL.map(|probability| {
        let limit = chi_square::quantile(probability, DOF);
        squared.iter().filter(|d2| **d2 <= limit).count() as f64 / squared.len() as f64
    })
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::random_source::RandomSource;

    use super::{NOMINAL, nees_bounds, nis_bounds, reliability};
    use crate::filter::Nis;

    fn squares(flights: usize, steps: usize, scale: f64) -> Vec<Vec<f64>> {
        let mut random = RandomSource::new(11, &[]);
        let mut one = || scale * (0..3).map(|_| random.normal().powi(2)).sum::<f64>();
        (0..flights)
            .map(|_| (0..steps).map(|_| one()).collect())
            .collect()
    }

    #[test]
    fn consistent_errors_lie_within_the_bounds_95_times_of_100() {
        let bounds = nees_bounds(&squares(20, 1000, 1.0));
        assert_eq!(bounds.steps, 1000);
        // Four standard errors of a fraction of .95 of 1000.
        assert!((bounds.inside - 0.95).abs() < 0.028, "{bounds:?}");
        assert!((bounds.above - 0.025).abs() < 0.02 && (bounds.below - 0.025).abs() < 0.02);
    }

    #[test]
    fn over_and_underconfidence_show_on_their_side() {
        let over = nees_bounds(&squares(50, 100, 2.0));
        assert!(over.above > 0.95 && over.below == 0.0, "{over:?}");
        let under = nees_bounds(&squares(50, 100, 0.5));
        assert!(under.below > 0.95 && under.above == 0.0, "{under:?}");
    }

    #[test]
    fn gaps_have_no_innovation_and_do_not_count() {
        let value = |value| Some(Nis { value, degrees: 4 });
        let flights = [vec![value(4.0), None, value(99.0)], vec![value(5.0), None]];
        let bounds = nis_bounds(&flights);
        assert_eq!(bounds.steps, 2);
        assert_eq!((bounds.inside, bounds.above), (0.5, 0.5));
    }

    #[test]
    fn reliability_of_consistent_errors_is_the_diagonal() {
        let values: Vec<f64> = squares(1, 40_000, 1.0).concat();
        for (observed, nominal) in reliability(&values).into_iter().zip(NOMINAL) {
            assert!(
                (observed - nominal).abs() < 0.011,
                "{observed} at {nominal}"
            );
        }
    }

    #[test]
    fn no_values_have_no_fractions() {
        assert!(nees_bounds(&[]).inside.is_nan());
        assert!(reliability(&[])[0].is_nan());
    }
}
