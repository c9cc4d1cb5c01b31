//! Whether a filter's covariance tells the truth: NEES and NIS against chi-square bounds, and how
//! often the truth lies inside ellipsoids of every size.

use serde::Serialize;

use crate::filter::Nis;
use crate::scoring::chi_square;

/// Nominal probabilities of the reliability diagram.
pub const NOMINAL: [f64; 11] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95];

/// Degrees of freedom of a position error.
const DOF: usize = 3;

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

/// A statistic under construction, which takes one flight after another.
#[derive(Clone, Debug, Default)]
pub struct Averages {
    /// Sum over flights and its degrees of freedom at every step.
    steps: Vec<(f64, f64)>,
    /// The same over all steps, in the order in which they came.
    all: (f64, f64),
}

impl Averages {
    /// Adds a flight: an entry for every scored step.
    pub fn add(&mut self, flight: impl Iterator<Item = Option<Nis>>) {
        for (step, value) in flight.enumerate() {
            if step == self.steps.len() {
                self.steps.push((0.0, 0.0));
            }
            if let Some(Nis { value, degrees }) = value {
                for sum in [&mut self.steps[step], &mut self.all] {
                    sum.0 += value;
                    sum.1 += degrees as f64;
                }
            }
        }
    }

    /// The statistic against its bounds.
    pub fn bounds(&self) -> Bounds {
        bounds(self.steps.iter().copied())
    }

    /// Mean over its degrees of freedom (ideal 1); NaN without values.
    pub fn ratio(&self) -> f64 {
        self.all.0 / self.all.1
    }
}

/// A squared Mahalanobis distance of a position as an entry of [`Averages`].
pub fn nees(mahalanobis_squared: f64) -> Nis {
    Nis {
        value: mahalanobis_squared,
        degrees: DOF,
    }
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

/// How many errors lie inside ellipsoids of every size; takes one squared Mahalanobis distance after another.
#[derive(Clone, Debug)]
pub struct Reliability {
    limits: [f64; NOMINAL.len()],
    inside: [u64; NOMINAL.len()],
    count: u64,
}

impl Default for Reliability {
    fn default() -> Self {
        Self {
            limits: NOMINAL.map(|probability| chi_square::quantile(probability, DOF as f64)),
            inside: [0; NOMINAL.len()],
            count: 0,
        }
    }
}

impl Reliability {
    /// Adds an error.
    pub fn add(&mut self, mahalanobis_squared: f64) {
        self.count += 1;
        for (inside, limit) in self.inside.iter_mut().zip(self.limits) {
            *inside += u64::from(mahalanobis_squared <= limit);
        }
    }

    /// Fraction inside the ellipsoid of each of [`NOMINAL`]; NaN without values.
    pub fn fractions(&self) -> [f64; NOMINAL.len()] {
        self.inside.map(|inside| inside as f64 / self.count as f64)
    }

    /// Fraction inside the ellipsoid of `probability`, one of [`NOMINAL`]; NaN of another.
    pub fn fraction(&self, probability: f64) -> f64 {
        let place = NOMINAL.iter().position(|nominal| *nominal == probability);
        place.map_or(f64::NAN, |place| self.fractions()[place])
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::random_source::RandomSource;

    use super::{Averages, Bounds, NOMINAL, Reliability, nees};
    use crate::filter::Nis;

    fn squares(flights: usize, steps: usize, scale: f64) -> Vec<Vec<f64>> {
        let mut random = RandomSource::new(11, &[]);
        let mut one = || scale * (0..3).map(|_| random.normal().powi(2)).sum::<f64>();
        (0..flights)
            .map(|_| (0..steps).map(|_| one()).collect())
            .collect()
    }

    fn nees_bounds(flights: &[Vec<f64>]) -> Bounds {
        let mut averages = Averages::default();
        for flight in flights {
            averages.add(flight.iter().map(|value| Some(nees(*value))));
        }
        averages.bounds()
    }

    fn reliability(squared: &[f64]) -> Reliability {
        let mut reliability = Reliability::default();
        for value in squared {
            reliability.add(*value);
        }
        reliability
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
        let mut averages = Averages::default();
        for flight in flights {
            averages.add(flight.into_iter());
        }
        assert_eq!(averages.ratio(), 108.0 / 12.0);
        let bounds = averages.bounds();
        assert_eq!(bounds.steps, 2);
        assert_eq!((bounds.inside, bounds.above), (0.5, 0.5));
    }

    #[test]
    fn reliability_of_consistent_errors_is_the_diagonal() {
        let values: Vec<f64> = squares(1, 40_000, 1.0).concat();
        let found = reliability(&values);
        assert_eq!(found.fraction(0.5), found.fractions()[5]);
        assert!(found.fraction(0.51).is_nan());
        for (observed, nominal) in found.fractions().into_iter().zip(NOMINAL) {
            assert!(
                (observed - nominal).abs() < 0.011,
                "{observed} at {nominal}"
            );
        }
    }

    #[test]
    fn no_values_have_no_fractions() {
        assert!(nees_bounds(&[]).inside.is_nan());
        assert!(reliability(&[]).fractions()[0].is_nan());
        assert!(Averages::default().ratio().is_nan());
    }
}
