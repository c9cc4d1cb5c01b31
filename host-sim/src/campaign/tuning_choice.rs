//! Which of its parameters a tuned filter is shown with: in every cell those with which it came
//! nearest to the truth.
//!
//! The choice looks at the flights that are evaluated, so it favours the tuned filters: whoever must
//! choose before the flight does as well at best.

use serde::Serialize;

use super::step_record::MethodSteps;
use crate::contest::tuned_on::TunedOn;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::cell::CellMetrics;

/// A tuned method with one set of parameters under one condition.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Candidate {
    /// The method.
    pub method: Method,
    /// The condition.
    #[serde(flatten)]
    pub condition: Condition,
    /// What its parameters were fitted to.
    pub tuned_on: TunedOn,
    /// Metrics over all steps.
    #[serde(flatten)]
    pub metrics: CellMetrics,
    /// Whether the cell shows this one.
    pub chosen: bool,
}

/// The candidates under `condition` and the choice among each method's: the smallest mean ED, the
/// first of equals. `metrics` are those of a method with a fit over all flights, if it flew with it.
pub fn choose(
    condition: Condition,
    methods: &[Method],
    mut metrics: impl FnMut(Method, TunedOn) -> Option<CellMetrics>,
) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    for method in methods.iter().copied().filter(|method| method.is_tuned()) {
        let mut own: Vec<Candidate> = TunedOn::ALL
            .into_iter()
            .filter_map(|tuned_on| {
                Some(Candidate {
                    method,
                    condition,
                    tuned_on,
                    metrics: metrics(method, tuned_on)?,
                    chosen: false,
                })
            })
            .collect();
        let best = own
            .iter_mut()
            .min_by(|a, b| a.metrics.ed_mean_m.total_cmp(&b.metrics.ed_mean_m));
        if let Some(best) = best {
            best.chosen = true;
        }
        candidates.extend(own);
    }
    candidates
}

/// What `method` is shown with; `None` if it is not tuned.
pub fn chosen(candidates: &[Candidate], method: Method, condition: Condition) -> Option<TunedOn> {
    let found = candidates
        .iter()
        .find(|c| c.chosen && c.method == method && c.condition == condition);
    found.map(|candidate| candidate.tuned_on)
}

/// Leaves of a flight's tracks the chosen ones, one per method in their order.
pub fn keep_chosen(
    candidates: &[Candidate],
    condition: Condition,
    methods: &[Method],
    mut all: Vec<MethodSteps>,
) -> Vec<MethodSteps> {
    let mut kept = Vec::with_capacity(methods.len());
    for method in methods {
        let tuned_on = chosen(candidates, *method, condition);
        let place = |track: &MethodSteps| track.is_of(*method, tuned_on);
        if let Some(index) = all.iter().position(place) {
            kept.push(all.swap_remove(index));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::{choose, chosen, keep_chosen};
    use crate::campaign::step_record::{MethodSteps, StepRecord};
    use crate::contest::tuned_on::TunedOn;
    use crate::method::Method;
    use crate::scenario::radar::Condition;
    use crate::scoring::cell::CellMetrics;

    const CONDITION: Condition = Condition {
        table: NoiseTable::Radians,
        noise: NoiseLevel::Low,
        rate: SamplingRate::FULL,
    };

    fn track(method: Method, tuned_on: Option<TunedOn>, error_m: f64) -> MethodSteps {
        MethodSteps {
            method,
            tuned_on,
            steps: vec![StepRecord::of_test(1.0, error_m)],
            estimates: Vec::new(),
            forecasts: Vec::new(),
        }
    }

    /// The nearest over all flights is chosen, not the nearest of each; others are left alone.
    #[test]
    fn each_tuned_method_is_shown_with_what_served_it_best() {
        let [generated, recordings, both] = TunedOn::ALL.map(Some);
        let flight = |errors_m: [f64; 4]| {
            vec![
                track(Method::Recursive, None, 0.1),
                track(Method::EkfTuned, generated, errors_m[0]),
                track(Method::Imm5, generated, errors_m[3]),
                track(Method::EkfTuned, recordings, errors_m[1]),
                track(Method::Imm5, recordings, 9.0),
                track(Method::EkfTuned, both, errors_m[2]),
            ]
        };
        let methods = [Method::Imm5, Method::Recursive, Method::EkfTuned];
        let flights = [flight([1.0, 5.0, 2.0, 1.0]), flight([9.0, 3.0, 2.0, 1.0])];
        let candidates = choose(CONDITION, &methods, |method, on| {
            let all = flights.iter().flatten();
            let own = all.filter(|track| track.is_of(method, Some(on)));
            let steps: Vec<_> = own
                .flat_map(|track| &track.steps)
                .map(StepRecord::scored)
                .collect();
            (!steps.is_empty()).then(|| CellMetrics::new(&steps))
        });
        assert_eq!(candidates.len(), 5);
        let of = |method| chosen(&candidates, method, CONDITION);
        assert_eq!(of(Method::EkfTuned), both);
        assert_eq!(of(Method::Imm5), generated);
        assert_eq!(of(Method::Recursive), None);

        for flight in flights {
            let kept = keep_chosen(&candidates, CONDITION, &methods, flight);
            let kept = kept.iter().map(|t| (t.method, t.tuned_on));
            let expected = [
                (Method::Imm5, generated),
                (Method::Recursive, None),
                (Method::EkfTuned, both),
            ];
            assert_eq!(kept.collect::<Vec<_>>(), expected);
        }
    }
}
