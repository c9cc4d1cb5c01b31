//! Where a target will be, asked without touching its track.

use super::answer::Answer;
use super::envelope::SILENCE_MAX_S;
use super::foresight::AHEAD_S;
use super::steady::Steady;
use super::target::Target;
use super::tracker::{INTERVAL_MAX_S, Recursive};
use crate::clock::seconds_between;
use crate::estimate::{Estimate, Mode, Outcome};
use crate::step_error::StepError;

/// Part of a forecast that the network is asked about, s: the longest that it knows.
const FORECAST_ASKED_S: f32 = INTERVAL_MAX_S;
/// First part of a forecast, s; every part after it reaches twice as far ahead.
const FORECAST_FIRST_S: f32 = 0.5;
/// Part of a forecast that the network says nothing of any more, s: in longer ones noise that fades would add up as
/// if it did not.
const FORECAST_BEYOND_S: f32 = 1.0;

impl Recursive<'_, '_> {
    /// Gives estimates at times that lie in order and not before the target's to `each`, one by one with
    /// its place. The track stays as it is.
    ///
    /// A copy of the target moves by one answer of the network, along a grid whose parts double: half a
    /// second, one, two, four; from then on the base model moves it by a second each. Times between are reached from the
    /// grid. So a forecast does not depend on what else is asked for, and costs little more than its furthest time.
    pub fn forecast_each(
        &mut self,
        times_us: &[u64],
        each: &mut dyn FnMut(usize, &Estimate),
    ) -> Result<(), StepError> {
        self.set_out()?;
        let mut answer = Answer::of(&self.model.parameters.base);
        self.ask_ahead(&mut answer)?;
        self.follow(&mut answer, times_us, each)
    }

    /// How the target moves if nothing more is measured.
    // Apart from what follows it: the network's stack and that of the estimates take turns.
    #[inline(never)]
    fn ask_ahead(&mut self, answer: &mut Answer) -> Result<(), StepError> {
        let rng = self.rng.clone();
        let asked = self.ask(&self.workspace.target.sight(), FORECAST_ASKED_S, answer);
        *self.rng = rng;
        asked?;
        self.model.unmeasured(&self.workspace.target, answer);
        Ok(())
    }

    /// The estimates of a target that moves by an answer.
    #[inline(never)]
    fn follow(
        &mut self,
        answer: &mut Answer,
        times_us: &[u64],
        each: &mut dyn FnMut(usize, &Estimate),
    ) -> Result<(), StepError> {
        let ahead = &mut self.workspace.target;
        let (start_us, before_m2) = (ahead.time_us, ahead.position_variance());
        let now = Steady::of(&ahead.state);
        let coasted = Outcome::uncorrected(Mode::Coasting);
        let mut there = Target::NONE;
        let (mut from_s, mut to_s) = (0.0, FORECAST_FIRST_S);
        for (place, &time_us) in times_us.iter().enumerate() {
            let time_s = seconds_between(start_us, time_us);
            while time_s >= to_s {
                self.model.advance(ahead, answer, to_s - from_s);
                // As in a silence: further ahead nobody says where targets are, or how they turn.
                let beyond = 2.0 * to_s > SILENCE_MAX_S;
                let further_s = if beyond { FORECAST_BEYOND_S } else { to_s };
                (from_s, to_s) = (to_s, to_s + further_s);
                if beyond && let Some(schedule) = self.model.unasked(ahead, f32::INFINITY) {
                    (answer.factor, answer.schedule) = (None, schedule);
                }
            }
            there.copy_from(ahead);
            there.time_us = time_us;
            self.model.advance(&mut there, answer, time_s - from_s);
            there.foresight.widen(&mut there.covariance, before_m2);
            // Of a second ahead it was learned how sure to be, of what comes after it the bend itself is open.
            let open = 1.0 - AHEAD_S / time_s.max(AHEAD_S);
            there.bend((&now, time_s), [0.0; 3], self.model.parameters.bend, open);
            if !there.settle() {
                return Err(StepError::Lost);
            }
            each(place, &self.model.estimate(&there, coasted));
        }
        Ok(())
    }
}
