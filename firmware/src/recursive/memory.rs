//! What the recursive tracker remembers beside its state: statistics that the network reads.

use super::hypotheses::{HYPOTHESES, OUTLIER};
use crate::measurement::Vectors;
use crate::scalar::Scalar;

/// Running means of the velocity.
pub const MEANS: usize = 4;
/// Numbers that the network writes for itself to read at the next step.
pub const NOTES: usize = 9;
/// Time constants of the running means of the velocity, s.
pub const MEAN_TIMES_S: [f64; MEANS] = [0.25, 0.7, 2.0, 6.0];
/// Time constants of the network's own notes, s.
pub const NOTE_TIMES_S: [f64; NOTES] = [0.1, 0.15, 0.25, 0.4, 0.7, 1.1, 1.8, 3.0, 5.0];

/// Statistics of the flight so far.
#[derive(Clone, Copy, Debug)]
pub struct Memory<S> {
    /// Last innovation (elevation, azimuth, range, range-rate) whitened in turn, each over the
    /// standard deviation given the ones before; fades while nothing is measured.
    pub innovation: [S; 4],
    /// Running mean of `innovation` over measurements.
    pub drift: [S; 4],
    /// Running mean over measurements of the squares of `innovation`; one is honest.
    pub squares: [S; 4],
    /// Natural logarithms of the last measurement's sigmas: elevation, azimuth, range, range-rate.
    pub ln_sigmas: [S; 4],
    /// Time since the last measurement that was used, s.
    pub coast_s: S,
    /// Time since the first measurement, s.
    pub age_s: S,
    /// Running means of the velocity with the times [`MEAN_TIMES_S`], m/s.
    pub velocity_means: [[S; 3]; MEANS],
    /// Running means of the network's notes.
    pub notes: [S; NOTES],
    /// Steps that were explained by each hypothesis, in parts.
    pub counts: [S; HYPOTHESES],
}

impl Memory<f32> {
    /// Of no flight.
    pub const NONE: Self = Self {
        innovation: [0.0; 4],
        drift: [0.0; 4],
        squares: [0.0; 4],
        ln_sigmas: [0.0; 4],
        coast_s: 0.0,
        age_s: 0.0,
        velocity_means: [[0.0; 3]; MEANS],
        notes: [0.0; NOTES],
        counts: [0.0; HYPOTHESES],
    };
}

impl<S: Scalar> Memory<S> {
    /// The memory after the first measurement; `sigmas` in the order elevation, azimuth, range,
    /// range-rate.
    pub fn start(sigmas: [S; 4], velocity: [S; 3]) -> Self {
        let zero = S::constant(0.0);
        Self {
            innovation: [zero; 4],
            drift: [zero; 4],
            squares: [S::constant(1.0); 4],
            ln_sigmas: sigmas.map(S::ln),
            coast_s: zero,
            age_s: zero,
            velocity_means: [velocity; MEANS],
            notes: [zero; NOTES],
            counts: [zero; HYPOTHESES],
        }
    }

    /// Takes in a measurement: its whitened innovation and the sensor's sigmas. Of a channel that
    /// was not present the innovation fades, and the rest stays what it was.
    pub fn measured(&mut self, whitened: [S; 4], vectors: &Vectors<S>) {
        for (channel, y) in whitened.into_iter().enumerate() {
            self.heard(channel, y, vectors);
        }
    }

    /// Takes in one channel.
    // Once in flash, not four times.
    #[inline(never)]
    fn heard(&mut self, channel: usize, y: S, vectors: &Vectors<S>) {
        let (c, i) = (S::constant, channel);
        let present = vectors.present[i];
        let absent = c(1.0) - present;
        let blend = |from: S, to: S, weight: S| from + weight * present * (to - from);
        self.innovation[i] = present * y + absent * c(0.8) * self.innovation[i];
        self.drift[i] = blend(self.drift[i], y.clamp(-5.0, 5.0), c(0.15));
        self.squares[i] = blend(self.squares[i], (y * y).min(c(25.0)), c(0.1));
        self.ln_sigmas[i] = present * vectors.sigmas[i].ln() + absent * self.ln_sigmas[i];
    }

    /// Counts a measurement that no hypothesis explained: it was wrong.
    pub fn refused(&mut self) {
        self.counts[OUTLIER] = self.counts[OUTLIER] + S::constant(1.0);
    }

    /// Counts which hypotheses explained a step, in parts.
    pub fn explained(&mut self, shares: [S; HYPOTHESES]) {
        for (count, share) in self.counts.iter_mut().zip(shares) {
            *count = *count + share;
        }
    }

    /// Takes in a step without a measurement.
    pub fn missed(&mut self) {
        for y in &mut self.innovation {
            *y = *y * S::constant(0.8);
        }
    }

    /// Takes in what every step has: the time, whether a measurement was used (one or zero), the
    /// velocity after it, the network's outputs for the notes.
    pub fn stepped(&mut self, dt_s: S, used: S, velocity: [S; 3], notes: &[S]) {
        self.coast_s = (S::constant(1.0) - used) * (self.coast_s + dt_s);
        self.age_s = self.age_s + dt_s;
        for (mean, time_s) in self.velocity_means.iter_mut().zip(MEAN_TIMES_S) {
            // A plain mean until the flight is older than the time constant.
            let weight = fading(dt_s, S::constant(time_s)).max(dt_s / self.age_s);
            for (mean, velocity) in mean.iter_mut().zip(velocity) {
                *mean = *mean + weight * (velocity - *mean);
            }
        }
        self.noted(dt_s, notes);
    }

    /// Takes in the network's outputs for the notes alone.
    pub fn noted(&mut self, dt_s: S, notes: &[S]) {
        for ((kept, &note), time_s) in self.notes.iter_mut().zip(notes).zip(NOTE_TIMES_S) {
            *kept = noted(*kept, note, dt_s, S::constant(time_s));
        }
    }
}

/// A note after the network has written it again.
// Nine times a step, once in flash.
#[inline(never)]
fn noted<S: Scalar>(kept: S, note: S, dt_s: S, time_s: S) -> S {
    kept + fading(dt_s, time_s) * (note.tanh() - kept)
}

/// Weight of the newest value in a running mean with a time constant.
#[inline(never)]
fn fading<S: Scalar>(dt_s: S, time_s: S) -> S {
    -((-dt_s / time_s).exp_m1())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGMAS: [f64; 4] = [0.01, 0.02, 3.0, 0.5];

    #[test]
    fn the_start_remembers_the_sensor_and_the_velocity() {
        let memory = Memory::start(SIGMAS, [1.0, -2.0, 3.0]);
        for (got, sigma) in memory.ln_sigmas.into_iter().zip(SIGMAS) {
            assert!((got - sigma.ln()).abs() < 1e-15);
        }
        assert_eq!(memory.velocity_means, [[1.0, -2.0, 3.0]; MEANS]);
        assert_eq!((memory.innovation, memory.drift), ([0.0; 4], [0.0; 4]));
        assert_eq!((memory.squares, memory.notes), ([1.0; 4], [0.0; NOTES]));
        assert_eq!((memory.coast_s, memory.age_s), (0.0, 0.0));
    }

    #[test]
    fn innovations_are_averaged_and_bounded() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        memory.measured([2.0, -8.0, 0.0, 1.0], &Vectors::whole([0.0; 4], [0.1; 4]));
        assert_eq!(memory.innovation, [2.0, -8.0, 0.0, 1.0]);
        for (got, expected) in memory.drift.into_iter().zip([0.3, -0.75, 0.0, 0.15]) {
            assert!((got - expected).abs() < 1e-15);
        }
        for (got, expected) in memory.squares.into_iter().zip([1.3, 3.4, 0.9, 1.0]) {
            assert!((got - expected).abs() < 1e-15);
        }
        assert!((memory.ln_sigmas[2] - 0.1_f64.ln()).abs() < 1e-15);
        memory.missed();
        assert!((memory.innovation[1] + 6.4).abs() < 1e-15);
        assert!((memory.drift[0] - 0.3).abs() < 1e-15);
    }

    #[test]
    fn means_are_plain_at_first_and_fade_later() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        // Four velocities: the slow means are plain averages of them, the start left out.
        for velocity in [1.0, 3.0, 5.0, 7.0] {
            memory.stepped(0.1, 1.0, [velocity, 0.0, 0.0], &[]);
        }
        assert!((memory.velocity_means[3][0] - 4.0).abs() < 1e-12);
        assert!(memory.velocity_means[0][0] > 4.2);
        assert!((memory.age_s - 0.4).abs() < 1e-12);
        // Later the time constant decides.
        let mut expected = 4.0;
        for step in 5..105 {
            memory.stepped(0.1, 1.0, [9.0, 0.0, 0.0], &[]);
            let weight = f64::max(1.0 / f64::from(step), 1.0 - (-0.1_f64 / 2.0).exp());
            expected += weight * (9.0 - expected);
        }
        assert!((memory.velocity_means[2][0] - expected).abs() < 1e-12);
        assert!(expected > 8.9);
    }

    #[test]
    fn coasting_counts_until_a_measurement_is_used() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        memory.stepped(0.2, 0.0, [0.0; 3], &[]);
        memory.stepped(0.3, 0.0, [0.0; 3], &[]);
        assert!((memory.coast_s - 0.5).abs() < 1e-15);
        memory.stepped(0.3, 1.0, [0.0; 3], &[]);
        assert_eq!(memory.coast_s, 0.0);
    }

    #[test]
    fn what_explains_and_what_nothing_explains_is_counted() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        memory.explained([0.5, 0.25, 0.0, 0.25]);
        memory.explained([1.0, 0.0, 0.0, 0.0]);
        memory.refused();
        assert_eq!(memory.counts, [1.5, 0.25, 0.0, 1.25]);
    }

    #[test]
    fn notes_are_squashed_and_forgotten_at_their_own_times() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        memory.stepped(0.4, 1.0, [0.0; 3], &[100.0; NOTES]);
        for (kept, time_s) in memory.notes.into_iter().zip(NOTE_TIMES_S) {
            assert!((kept - (1.0 - (-0.4 / time_s).exp())).abs() < 1e-12);
        }
    }

    /// Of a channel that was not measured the innovation fades and the rest stays.
    #[test]
    fn an_absent_channel_is_remembered_as_it_was() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        memory.measured([2.0, -1.0, 0.5, 3.0], &Vectors::whole([0.0; 4], [0.1; 4]));
        let before = memory;
        let mut vectors = Vectors::whole([0.0; 4], [0.3; 4]);
        vectors.present = [0.0, 1.0, 0.0, 1.0];
        memory.measured([9.0, 4.0, 9.0, -6.0], &vectors);
        for i in [0, 2] {
            assert!((memory.innovation[i] - 0.8 * before.innovation[i]).abs() < 1e-15);
            assert_eq!(memory.drift[i], before.drift[i]);
            assert_eq!(memory.squares[i], before.squares[i]);
            assert_eq!(memory.ln_sigmas[i], before.ln_sigmas[i]);
        }
        for (i, y, bounded, square) in [(1, 4.0, 4.0, 16.0), (3, -6.0, -5.0, 25.0)] {
            assert_eq!(memory.innovation[i], y);
            let drift = 0.85 * before.drift[i] + 0.15 * bounded;
            assert!((memory.drift[i] - drift).abs() < 1e-15);
            let squares = 0.9 * before.squares[i] + 0.1 * square;
            assert!((memory.squares[i] - squares).abs() < 1e-14);
            assert!((memory.ln_sigmas[i] - 0.3_f64.ln()).abs() < 1e-15);
        }
    }

    /// Notes come nearer to what the network says now, from wherever they are.
    #[test]
    fn notes_are_running_means() {
        let mut memory = Memory::start(SIGMAS, [0.0; 3]);
        memory.noted(0.4, &[100.0; NOTES]);
        let before = memory.notes;
        memory.noted(0.3, &[-0.5; NOTES]);
        for i in 0..NOTES {
            let kept = (-0.3 / NOTE_TIMES_S[i]).exp();
            let expected = kept * before[i] + (1.0 - kept) * (-0.5_f64).tanh();
            assert!((memory.notes[i] - expected).abs() < 1e-12, "{i}");
        }
    }
}
