//! Late readings for any filter, taken as the firmware's [`LateTracker`](bnkf::LateTracker) takes them:
//! what came after is run again in the order of times.

use std::collections::VecDeque;

use bnkf::late::LATE_MAX_US;
use bnkf_model_export::radar::reading::Reading;

use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

/// `F` with the steps of the last half second, to run them again.
#[derive(Clone, Debug)]
pub struct Late<F> {
    filter: F,
    steps: VecDeque<Step<F>>,
}

/// A step, and the filter before it.
#[derive(Clone, Debug)]
struct Step<F> {
    before: F,
    time_us: u64,
    reading: Option<Reading>,
}

impl<F> Late<F> {
    /// A filter that has not been started.
    pub fn new(filter: F) -> Self {
        Self {
            filter,
            steps: VecDeque::new(),
        }
    }
}

impl<F: Filter + Clone> Filter for Late<F> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.steps.clear();
        self.filter.start(start)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let is_old = |step: &Step<F>| time_us.saturating_sub(step.time_us) > LATE_MAX_US;
        while self.steps.front().is_some_and(is_old) {
            self.steps.pop_front();
        }
        self.steps.push_back(Step {
            before: self.filter.clone(),
            time_us,
            reading: reading.copied(),
        });
        self.filter.step(time_us, reading)
    }

    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        self.filter.forecast(times_us)
    }

    fn late(&mut self, reading: &Reading) -> Result<PositionEstimate, FilterError> {
        let behind = self
            .steps
            .iter()
            .position(|step| step.time_us >= reading.time_us);
        let place = behind.ok_or(FilterError::TimeWentBack)?;
        if self.steps[place].time_us == reading.time_us && self.steps[place].reading.is_none() {
            self.steps[place].reading = Some(*reading);
        } else if place > 0 {
            let before = self.steps[place].before.clone();
            let step = Step {
                before,
                time_us: reading.time_us,
                reading: Some(*reading),
            };
            self.steps.insert(place, step);
        } else {
            // What was before the first step that is kept may be later than the reading.
            return Err(FilterError::TimeWentBack);
        }
        self.filter = self.steps[place].before.clone();
        let mut answer = Err(FilterError::NotStarted);
        for step in self.steps.iter_mut().skip(place) {
            step.before = self.filter.clone();
            answer = self.filter.step(step.time_us, step.reading.as_ref());
        }
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::gated::tests::reading;
    use crate::baseline::kalman::Kalman;
    use nalgebra::Vector3;

    fn started() -> Late<Kalman<crate::baseline::motion::WhiteAcceleration, 6>> {
        let mut late = Late::new(Kalman::paper_ekf());
        let start = Start {
            reading: &reading(0, 0.5),
            true_position_m: Vector3::new(26.0, 15.0, 12.0),
            true_velocity_mps: Vector3::zeros(),
        };
        late.start(&start).unwrap();
        late
    }

    #[test]
    fn late_readings_end_where_those_in_order_do() {
        let (mut late, mut ordered) = (started(), started());
        let at = |tenth: u64| reading(tenth * 100_000, 0.5 + 0.01 * tenth as f64);
        for tenth in 1..=20 {
            let on_time = tenth % 3 != 0;
            let now = at(tenth);
            late.step(now.time_us, on_time.then_some(&now)).unwrap();
            let in_order = ordered.step(now.time_us, Some(&now)).unwrap();
            if tenth % 3 == 2 && tenth > 3 {
                // Two tenths late.
                let answer = late.late(&at(tenth - 2)).unwrap();
                assert_eq!(answer, in_order);
            }
        }
    }

    #[test]
    fn what_is_too_late_is_refused_and_leaves_no_trace() {
        let mut late = started();
        for tenth in 1..=20 {
            late.step(tenth * 100_000, None).unwrap();
        }
        let before = late.clone().step(2_100_000, None);
        assert_eq!(
            late.late(&reading(1_499_999, 0.5)),
            Err(FilterError::TimeWentBack)
        );
        assert_eq!(
            late.late(&reading(2_000_001, 0.5)),
            Err(FilterError::TimeWentBack)
        );
        assert_eq!(late.clone().step(2_100_000, None), before);
        // Between two steps.
        let twin = late.clone();
        assert!(late.late(&reading(1_650_000, 0.5)).is_ok());
        assert_ne!(
            late.clone().step(2_100_000, None),
            twin.clone().step(2_100_000, None)
        );
    }
}
