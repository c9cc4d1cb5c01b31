//! A tracker that takes measurements which come late, by asking again.
//!
//! Retrodiction formulas (Bar-Shalom 2002) put one late measurement into one linear filter. Here are a
//! network that reads its own statistics, a gate, and a second track: only running them again in the
//! order of times gives what they would have given, and that to the bit. So the calls of the last half
//! second are kept, and two copies of the track from before them: when the younger is older than any
//! measurement may be late, it takes the place of the older one, and about a second at most is run again.

use heapless::Vec;

use crate::call::Call;
use crate::clock::AHEAD_MAX_US;
use crate::estimate::Estimate;
use crate::likelihood::Likelihood;
use crate::measurement::Measurement;
use crate::step_error::StepError;
use crate::track::{TRACK_BYTES_MAX, Track};
use crate::tracker::{TRACKER_BYTES_MAX, Tracker};

/// How late a measurement may be, microseconds behind the newest time: half a second.
pub const LATE_MAX_US: u64 = 500_000;
/// Calls that are kept at most: where they come evenly, fewer than 40 a second, every measurement is taken that is not
/// later than [`LATE_MAX_US`]; of more, or of a burst, the oldest are let go sooner.
pub const CALLS_MAX: usize = 40;

/// A [`Tracker`] and what it needs to be asked again.
///
/// Its estimates are those of a tracker that was asked the same in the order of times: measurements of
/// one time as they came, and a measurement in place of a coast to its time. A late measurement costs its
/// own step and those of the calls kept, at most [`CALLS_MAX`] and of about a second; any other costs
/// what it always did, and about twice a second a copy of the track.
///
/// ```
/// use bnkf::{LateTracker, Measurement, Model, Sensed, Sensor, Settings, Tracker};
/// # static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");
///
/// let model = Model::new(BLOB)?;
/// let mut tracker = LateTracker::new(Tracker::new(model, Settings::of(model.blob()))?);
/// let plot = |time_us| Measurement {
///     time_us,
///     range: Some(Sensed { value: 30.0, sigma: 0.5 }),
///     azimuth: Some(Sensed { value: 0.5, sigma: 0.01 }),
///     elevation: None,
///     range_rate: None,
///     sensor: Sensor::ORIGIN,
/// };
/// for time_us in [100_000, 200_000, 400_000, 300_000] {
///     tracker.step(&plot(time_us))?;
/// }
/// // The last one was late: it and the calls that are kept ran again.
/// assert_eq!(tracker.calls_rerun(), 4);
/// assert_eq!(tracker.tracker().latest_us(), Some(400_000));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct LateTracker<'a> {
    tracker: Tracker<'a>,
    /// The track before the first of `calls`.
    base: Track,
    /// The track after so many of `calls`.
    middle: Option<(Track, usize)>,
    /// Calls that were answered, in the order of times; there is room for one more.
    calls: Vec<Call, CALLS_MAX>,
    rerun: usize,
}

/// Static memory, part of the contract as [`TRACKER_BYTES_MAX`] is.
pub const LATE_TRACKER_BYTES_MAX: usize =
    TRACKER_BYTES_MAX + 2 * TRACK_BYTES_MAX + CALLS_MAX * size_of::<Call>() + 64;
const _: () = assert!(size_of::<LateTracker<'static>>() <= LATE_TRACKER_BYTES_MAX);

impl<'a> LateTracker<'a> {
    /// Begins with a tracker as it is: what it was asked before is not run again.
    pub fn new(tracker: Tracker<'a>) -> Self {
        Self {
            base: tracker.track().clone(),
            tracker,
            middle: None,
            calls: Vec::new(),
            rerun: 0,
        }
    }

    /// The tracker as it is now, at the newest time.
    pub fn tracker(&self) -> &Tracker<'a> {
        &self.tracker
    }

    /// How many calls the latest late measurement made run, itself included; zero if there was none.
    pub fn calls_rerun(&self) -> usize {
        self.rerun
    }

    /// Forgets the target, all times and calls, and starts the random stream again.
    pub fn reset(&mut self) {
        self.tracker.reset();
        self.rerun = 0;
        self.begin();
    }

    /// The estimate at the newest time, which is that of `measurement` unless it is late.
    ///
    /// # Errors
    /// [`StepError`] as of [`Tracker::step`]; the measurement is then ignored, and
    /// [`StepError::TimeWentBack`] says that it is later than [`LATE_MAX_US`], or than the calls that are
    /// kept. Where a late one was taken and the newest call has no answer behind it, the error is that call's:
    /// [`StepError::Lost`] if the track that it led to was given up since.
    pub fn step(&mut self, measurement: &Measurement) -> Result<Estimate, StepError> {
        let Some(place) = self.place_of(measurement.time_us) else {
            let call = Call::Step(*measurement);
            let estimate = call.answer(&mut self.tracker)?;
            self.keep(call);
            return Ok(estimate);
        };
        // Before anything is undone for it.
        measurement.check().map_err(StepError::Measurement)?;
        self.late(Call::Step(*measurement), place)
    }

    /// The estimate at `time_us` without a measurement.
    ///
    /// # Errors
    /// As of [`Tracker::coast`]: a coast is never late.
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let call = Call::Coast(time_us);
        let answer = call.answer(&mut self.tracker);
        match answer {
            Ok(_) => self.keep(call),
            // What was given up does not come back with a late measurement.
            Err(StepError::Lost) => self.begin(),
            Err(_) => {}
        }
        answer
    }

    /// [`Tracker::forecasts`], from what has come so far.
    ///
    /// # Errors
    /// As there.
    pub fn forecasts<const N: usize>(
        &mut self,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        self.tracker.forecasts(times_us)
    }

    /// [`Tracker::likelihood`], for a plot that is not late.
    ///
    /// # Errors
    /// As there.
    pub fn likelihood(&mut self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        self.tracker.likelihood(measurement)
    }

    fn begin(&mut self) {
        self.base = self.tracker.track().clone();
        self.middle = None;
        self.calls.clear();
    }

    /// Where a measurement of this time belongs among the calls, if it belongs before or in place of one
    /// of them: behind those of its time, or on a coast to it. `None` if it is the newest, or too late.
    fn place_of(&self, time_us: u64) -> Option<usize> {
        let newest_us = self.calls.last()?.time_us();
        let base_us = self.base.latest_us();
        let late = newest_us.checked_sub(time_us)? <= LATE_MAX_US;
        if !late || base_us.is_some_and(|base_us| time_us <= base_us) {
            return None;
        }
        let behind = self
            .calls
            .iter()
            .rposition(|call| call.time_us() <= time_us);
        let place = behind.map_or(0, |at| at + 1);
        if self.calls[..place].last() == Some(&Call::Coast(time_us)) {
            return Some(place - 1);
        }
        (place < self.calls.len()).then_some(place)
    }

    /// Remembers a call that was answered and is the newest.
    fn keep(&mut self, call: Call) {
        let last_us = self.calls.last().map(Call::time_us);
        let follows = last_us.or(self.base.latest_us()).is_none_or(|last_us| {
            let ahead_us = call.time_us().checked_sub(last_us);
            ahead_us.is_some_and(|ahead_us| ahead_us <= AHEAD_MAX_US)
        });
        if follows && self.calls.push(call).is_ok() {
            self.let_go();
        } else {
            // The clock was set: nothing comes late to what was before.
            self.begin();
        }
    }

    /// Lets go of calls that are older than any measurement may be late, and of more of them for room for
    /// one more.
    fn let_go(&mut self) {
        let Some(newest_us) = self.calls.last().map(Call::time_us) else {
            return;
        };
        let is_old = |at_us: u64| newest_us.saturating_sub(at_us) > LATE_MAX_US;
        let full = self.calls.is_full();
        let older = |middle: &mut (Track, usize)| full || middle.0.latest_us().is_some_and(is_old);
        if let Some((middle, count)) = self.middle.take_if(older) {
            self.base = middle;
            self.calls.drain(..count.min(self.calls.len()));
        }
        let first_us = self.calls.first().map(Call::time_us);
        let begun_us = self.base.latest_us().or(first_us);
        let many = self.calls.len() >= CALLS_MAX / 2;
        if self.middle.is_none() && (many || begun_us.is_some_and(is_old)) {
            self.middle = Some((self.tracker.track().clone(), self.calls.len()));
        }
    }

    /// Puts a late call in its place and runs again what comes behind it.
    fn late(&mut self, call: Call, place: usize) -> Result<Estimate, StepError> {
        // A tracker knows a repeat of its latest measurement only.
        if self.calls.contains(&call) {
            return Err(StepError::Repeated);
        }
        let given_us = call.time_us();
        let coast = Call::Coast(given_us);
        let coasted = self.calls.get(place) == Some(&coast);
        if coasted {
            self.calls[place] = call;
        } else if self.calls.insert(place, call).is_err() {
            let latest_us = self.tracker.latest_us().unwrap_or_default();
            return Err(StepError::TimeWentBack {
                latest_us,
                given_us,
            });
        }
        // From the younger copy if it was taken before the place, else from the older one, and the
        // younger is taken again on the way.
        let (track, first, again) = match &self.middle {
            Some((middle, count)) if *count <= place => (middle, *count, None),
            middle => {
                let again = middle.as_ref().map(|(_, count)| *count);
                (&self.base, 0, again)
            }
        };
        self.tracker.rewind(track);
        self.rerun = self.calls.len() - first;
        let mut answer = Err(StepError::NotStarted);
        let mut refused = None;
        for (at, call) in self.calls.iter().enumerate().skip(first) {
            answer = call.answer(&mut self.tracker);
            if at == place
                && let Err(error) = answer
            {
                refused = Some(error);
                if coasted {
                    answer = coast.answer(&mut self.tracker);
                }
            }
            if again == Some(at + 1) {
                self.middle = Some((self.tracker.track().clone(), at + 1));
            }
        }
        let Some(error) = refused else {
            self.let_go();
            return answer;
        };
        // The track is as if it had not come; so are the calls.
        if coasted {
            self.calls[place] = coast;
        } else {
            self.calls.remove(place);
            if let Some((_, count)) = &mut self.middle
                && *count > place
            {
                *count -= 1;
            }
        }
        Err(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::Blob;
    use crate::blob::draft::Draft;
    use crate::inference::Inference;
    use crate::measurement::{Channel, MeasurementError, Sensed};
    use crate::sensor::Sensor;
    use crate::settings::Settings;

    fn seen(time_us: u64) -> Measurement {
        let sensed = |value, sigma| Some(Sensed { value, sigma });
        let time_s = time_us as f32 * 1e-6;
        Measurement {
            time_us,
            range: sensed(33.0 + 0.5 * libm::sinf(7.0 * time_s), 0.3),
            elevation: sensed(0.4, 0.005),
            azimuth: sensed(0.5 + 0.03 * time_s, 0.005),
            range_rate: sensed(0.0, 0.5),
            sensor: Sensor::ORIGIN,
        }
    }

    fn tracker(bytes: &[u8]) -> Tracker<'_> {
        let blob = Blob::parse(bytes).expect("a blob");
        let settings = Settings {
            inference: Inference::of_passes(2).unwrap(),
            ..Settings::of(&blob)
        };
        Tracker::new(blob, settings).expect("its own settings")
    }

    /// What a tracker says now, by a coast that a copy of it is asked.
    fn says(late: &LateTracker<'_>, bytes: &[u8], time_us: u64) -> Result<Estimate, StepError> {
        let mut copy = tracker(bytes);
        copy.rewind(late.tracker().track());
        copy.coast(time_us)
    }

    fn in_order(bytes: &[u8], calls: &[Call]) -> Tracker<'static> {
        let bytes: &'static [u8] = std::boxed::Box::leak(bytes.to_vec().into_boxed_slice());
        let mut tracker = tracker(bytes);
        for call in calls {
            call.answer(&mut tracker).expect("an estimate");
        }
        tracker
    }

    #[test]
    fn a_late_measurement_goes_where_it_belongs() {
        for bytes in [
            Draft::recursive(3).bytes(),
            Draft::memoryless(&[12, 3], 3).bytes(),
        ] {
            let mut late = LateTracker::new(tracker(&bytes));
            for tenth in [0, 1, 2, 4, 5, 6] {
                late.step(&seen(tenth * 100_000)).expect("a step");
            }
            let answer = late.step(&seen(300_000)).expect("late");
            assert_eq!(answer.time_us, 600_000);
            let calls: std::vec::Vec<_> = (0..=6).map(|i| Call::Step(seen(i * 100_000))).collect();
            let mut expected = in_order(&bytes, &calls);
            assert_eq!(says(&late, &bytes, 700_000), expected.coast(700_000));
            // One copy, of when half a second had passed: all of it ran again.
            assert_eq!(late.calls_rerun(), 7);
            assert_eq!(late.step(&seen(300_000)), Err(StepError::Repeated));
        }
    }

    #[test]
    fn a_measurement_takes_the_place_of_a_coast() {
        let bytes = Draft::recursive(3).bytes();
        let mut late = LateTracker::new(tracker(&bytes));
        late.step(&seen(0)).expect("a step");
        for tenth in 1..=3 {
            late.coast(tenth * 100_000).expect("a coast");
        }
        late.step(&seen(200_000)).expect("late");
        // The newest coast, too.
        late.step(&seen(300_000)).expect("late");
        let calls = [
            Call::Step(seen(0)),
            Call::Coast(100_000),
            Call::Step(seen(200_000)),
            Call::Step(seen(300_000)),
        ];
        let mut expected = in_order(&bytes, &calls);
        assert_eq!(says(&late, &bytes, 400_000), expected.coast(400_000));
    }

    #[test]
    fn half_a_second_is_the_limit() {
        let bytes = Draft::recursive(3).bytes();
        let mut late = LateTracker::new(tracker(&bytes));
        for tenth in 0..40 {
            late.step(&seen(tenth * 100_000)).expect("a step");
        }
        let before = says(&late, &bytes, 4_000_000);
        let too_late = late.step(&seen(3_399_999));
        let expected = StepError::TimeWentBack {
            latest_us: 3_900_000,
            given_us: 3_399_999,
        };
        assert_eq!(too_late, Err(expected));
        assert_eq!(says(&late, &bytes, 4_000_000), before);
        assert!(late.step(&seen(3_400_001)).is_ok());
        assert!(late.calls_rerun() <= 13, "{}", late.calls_rerun());
        assert!(late.coast(3_800_000).is_err());
    }

    /// What cannot be used changes nothing, not even by having been tried.
    #[test]
    fn a_late_measurement_that_is_refused_leaves_no_trace() {
        let bytes = Draft::memoryless(&[12, 3], 3).bytes();
        let mut late = LateTracker::new(tracker(&bytes));
        for tenth in 0..9 {
            late.step(&seen(tenth * 100_000)).expect("a step");
        }
        late.coast(900_000).expect("a coast");
        let before = says(&late, &bytes, 1_000_000);
        for time_us in [450_001, 650_000, 900_000] {
            let mut partial = seen(time_us);
            partial.range_rate = None;
            let missing = Err(StepError::Missing(Channel::RangeRate));
            assert_eq!(late.step(&partial), missing);
            partial.range = Some(Sensed {
                value: f32::NAN,
                sigma: 1.0,
            });
            let error = MeasurementError::NotFinite(Channel::Range);
            assert_eq!(late.step(&partial), Err(StepError::Measurement(error)));
            assert_eq!(says(&late, &bytes, 1_000_000), before);
        }
        assert!(late.step(&seen(750_000)).is_ok());
        assert!(late.step(&seen(900_000)).is_ok());
    }

    /// Coasted until nothing was known of it, it is gone for late measurements, too.
    #[test]
    fn what_was_given_up_does_not_come_back() {
        let mut draft = Draft::memoryless(&[12, 3], 3);
        // Targets that turn so hard are a hundred kilometres away in a minute.
        draft.parameters[1] = 3e3;
        let bytes = draft.bytes();
        let mut late = LateTracker::new(tracker(&bytes));
        late.step(&seen(0)).expect("a step");
        late.step(&seen(400_000)).expect("a step");
        assert!(late.step(&seen(300_000)).is_ok());
        assert_eq!(late.coast(59_000_000), Err(StepError::Lost));
        let too_late = late.step(&seen(200_000));
        assert!(matches!(too_late, Err(StepError::TimeWentBack { .. })));
        assert_eq!(says(&late, &bytes, 500_000), Err(StepError::NotStarted));
        late.reset();
        assert_eq!(late.calls_rerun(), 0);
    }

    /// Thousands of calls a second: what is too late then is said to be.
    #[test]
    fn many_calls_shorten_the_window_and_no_more() {
        let bytes = Draft::recursive(3).bytes();
        let mut late = LateTracker::new(tracker(&bytes));
        let mut taken = 0;
        for i in 0..500 {
            late.step(&seen(1_000 * i)).expect("a step");
            if i > 10 {
                match late.step(&seen(1_000 * i - 4_500)) {
                    Ok(_) => taken += 1,
                    Err(error) => assert!(matches!(error, StepError::TimeWentBack { .. })),
                }
                assert!(late.calls_rerun() <= CALLS_MAX);
            }
        }
        assert!(taken > 350, "{taken}");
        let too_late = late.step(&seen(300_500));
        assert!(matches!(too_late, Err(StepError::TimeWentBack { .. })));
    }

    #[test]
    fn a_clock_that_was_set_and_a_reset_begin_anew() {
        let bytes = Draft::recursive(3).bytes();
        let mut late = LateTracker::new(tracker(&bytes));
        late.step(&seen(100_000_000)).expect("a step");
        for time_us in [5_000_000, 5_100_000] {
            _ = late.step(&seen(time_us));
        }
        assert_eq!(late.tracker().latest_us(), Some(5_100_000));
        late.step(&seen(5_300_000)).expect("a step");
        late.step(&seen(5_200_000)).expect("late");
        let mut expected = in_order(&bytes, &[Call::Step(seen(5_100_000))]);
        // The random stream has gone on; the track is what counts.
        for time_us in [5_200_000, 5_300_000] {
            expected.step(&seen(time_us)).expect("a step");
        }
        let (got, expected) = (says(&late, &bytes, 5_400_000), expected.coast(5_400_000));
        assert_eq!(got.map(|e| e.time_us), expected.map(|e| e.time_us));
        late.reset();
        assert_eq!(late.coast(0), Err(StepError::NotStarted));
        late.step(&seen(0)).expect("a step");
        let mut fresh = in_order(&bytes, &[Call::Step(seen(0))]);
        assert_eq!(says(&late, &bytes, 100_000), fresh.coast(100_000));
    }
}
