//! What the recursive tracker remembers beside its state: statistics that the network reads.

use libm::{expm1f, logf, tanhf};

use crate::Sigmas;

/// Running means of the velocity.
pub const MEANS: usize = 4;
/// Numbers that the network writes for itself to read at the next step.
pub const NOTES: usize = 9;
/// Time constants of the running means of the velocity, s.
pub const MEAN_TIMES_S: [f32; MEANS] = [0.25, 0.7, 2.0, 6.0];
/// Time constants of the network's own notes, s.
const NOTE_TIMES_S: [f32; NOTES] = [0.1, 0.15, 0.25, 0.4, 0.7, 1.1, 1.8, 3.0, 5.0];

/// Statistics of the flight so far.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    /// Last innovation (elevation, azimuth, range, range-rate) whitened in turn, each over the
    /// standard deviation given the ones before; fades while nothing is measured.
    pub innovation: [f32; 4],
    /// Running mean of `innovation` over measurements.
    pub drift: [f32; 4],
    /// Running mean over measurements of the squares of `innovation`; one is honest.
    pub squares: [f32; 4],
    /// Natural logarithms of the last measurement's sigmas: elevation, azimuth, range, range-rate.
    pub ln_sigmas: [f32; 4],
    /// Time since the last measurement that was used, s.
    pub coast_s: f32,
    /// Time since the first measurement, s.
    pub age_s: f32,
    /// Running means of the velocity with the times [`MEAN_TIMES_S`], m/s.
    pub velocity_means: [[f32; 3]; MEANS],
    /// Running means of the network's notes.
    pub notes: [f32; NOTES],
}

/// Natural logarithms of the sigmas in the order elevation, azimuth, range, range-rate.
pub fn ln_sigmas(sigmas: &Sigmas) -> [f32; 4] {
    [
        sigmas.elevation_rad,
        sigmas.azimuth_rad,
        sigmas.range_m,
        sigmas.range_rate_mps,
    ]
    .map(logf)
}

impl Memory {
    /// The memory after the first measurement.
    pub fn start(sigmas: &Sigmas, velocity: [f32; 3]) -> Self {
        Self {
            innovation: [0.0; 4],
            drift: [0.0; 4],
            squares: [1.0; 4],
            ln_sigmas: ln_sigmas(sigmas),
            coast_s: 0.0,
            age_s: 0.0,
            velocity_means: [velocity; MEANS],
            notes: [0.0; NOTES],
        }
    }

    /// Takes in a measurement: its whitened innovation and the sensor's sigmas.
    pub fn measured(&mut self, whitened: [f32; 4], sigmas: &Sigmas) {
        self.innovation = whitened;
        for ((drift, square), y) in self.drift.iter_mut().zip(&mut self.squares).zip(whitened) {
            *drift += 0.15 * (y.clamp(-5.0, 5.0) - *drift);
            *square += 0.1 * ((y * y).clamp(0.0, 25.0) - *square);
        }
        self.ln_sigmas = ln_sigmas(sigmas);
    }

    /// Takes in a step without a measurement.
    pub fn missed(&mut self) {
        for y in &mut self.innovation {
            *y *= 0.8;
        }
    }

    /// Takes in what every step has: the time, whether a measurement was used, the velocity after
    /// it, the network's notes.
    pub fn stepped(&mut self, dt_s: f32, used: bool, velocity: [f32; 3], notes: &[f32]) {
        self.coast_s = if used { 0.0 } else { self.coast_s + dt_s };
        self.age_s += dt_s;
        for (mean, time_s) in self.velocity_means.iter_mut().zip(MEAN_TIMES_S) {
            // A plain mean until the flight is older than the time constant.
            let fading = -expm1f(-dt_s / time_s);
            let plain = dt_s / self.age_s;
            let weight = if fading > plain { fading } else { plain };
            for (mean, velocity) in mean.iter_mut().zip(velocity) {
                *mean += weight * (velocity - *mean);
            }
        }
        for ((kept, &note), time_s) in self.notes.iter_mut().zip(notes).zip(NOTE_TIMES_S) {
            *kept += -expm1f(-dt_s / time_s) * (tanhf(note) - *kept);
        }
    }
}
