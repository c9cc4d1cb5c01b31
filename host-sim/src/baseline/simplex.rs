//! Minimisation without derivatives (Nelder and Mead 1965): no randomness, few evaluations.

/// A point and the objective there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex<const D: usize> {
    /// The point.
    pub at: [f64; D],
    /// The objective at the point.
    pub value: f64,
}

/// The best point found from `start` by at most about `evaluations` evaluations.
///
/// The first simplex reaches `step` along each axis. An objective that is not finite counts as
/// worse than any other.
pub fn minimise<const D: usize>(
    mut objective: impl FnMut(&[f64; D]) -> f64,
    start: [f64; D],
    step: f64,
    evaluations: usize,
) -> Vertex<D> {
    let mut count = 0;
    let mut evaluate = |at: [f64; D]| {
        count += 1;
        let value = objective(&at);
        (
            Vertex {
                at,
                value: if value.is_finite() { value } else { f64::MAX },
            },
            count,
        )
    };
    let (first, _) = evaluate(start);
    let mut best = first;
    let mut others: [Vertex<D>; D] = core::array::from_fn(|axis| {
        let mut at = start;
        at[axis] += step;
        evaluate(at).0
    });
    loop {
        // `others` in rising order behind `best`; the last one is to be replaced.
        others.sort_by(|a, b| a.value.total_cmp(&b.value));
        if D > 0 && others[0].value < best.value {
            core::mem::swap(&mut best, &mut others[0]);
            others.sort_by(|a, b| a.value.total_cmp(&b.value));
        }
        let Some((worst, kept)) = others.split_last_mut() else {
            return best;
        };
        let mut centre = best.at;
        for (axis, c) in centre.iter_mut().enumerate() {
            *c = (*c + kept.iter().map(|v| v.at[axis]).sum::<f64>()) / D as f64;
        }
        let along = |t: f64| core::array::from_fn(|i| centre[i] + t * (worst.at[i] - centre[i]));
        let second_worst = kept.last().map_or(best.value, |v| v.value);
        let (reflected, mut used) = evaluate(along(-1.0));
        let replacement = if reflected.value < best.value {
            let (expanded, n) = evaluate(along(-2.0));
            used = n;
            Some(if expanded.value < reflected.value {
                expanded
            } else {
                reflected
            })
        } else if reflected.value < second_worst {
            Some(reflected)
        } else {
            let (contracted, n) = evaluate(along(if reflected.value < worst.value {
                -0.5
            } else {
                0.5
            }));
            used = n;
            (contracted.value < reflected.value.min(worst.value)).then_some(contracted)
        };
        match replacement {
            Some(vertex) => *worst = vertex,
            None => {
                for vertex in &mut others {
                    let middle = core::array::from_fn(|i| 0.5 * (vertex.at[i] + best.at[i]));
                    (*vertex, used) = evaluate(middle);
                }
            }
        }
        if used >= evaluations {
            return others
                .iter()
                .fold(best, |a, b| if b.value < a.value { *b } else { a });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::minimise;

    #[test]
    fn finds_the_minimum_of_a_curved_valley() {
        let rosenbrock = |x: &[f64; 2]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
        let best = minimise(rosenbrock, [-1.2, 1.0], 0.5, 250);
        assert!(
            (best.at[0] - 1.0).abs() < 1e-4 && (best.at[1] - 1.0).abs() < 1e-4,
            "{best:?}"
        );
    }

    #[test]
    fn walks_around_what_is_not_finite() {
        let objective = |x: &[f64; 3]| {
            if x[0] < 0.0 {
                f64::NAN
            } else {
                (x[0] - 0.1).powi(2) + x[1].powi(2) + x[2].powi(4)
            }
        };
        let best = minimise(objective, [1.0, 1.0, 1.0], 0.7, 200);
        assert!(best.value < 1e-4, "{best:?}");
    }

    #[test]
    fn spends_no_more_than_it_may() {
        let mut count = 0;
        let count_calls = |x: &[f64; 4]| {
            count += 1;
            x.iter().map(|v| v * v).sum()
        };
        let best = minimise(count_calls, [3.0; 4], 1.0, 60);
        assert!(best.value < 9.0);
        assert!(count <= 60 + 4, "{count}");
    }
}
