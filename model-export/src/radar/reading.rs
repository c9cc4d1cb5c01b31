//! One simulated radar reading in f64, as the host's filters take it.

use crate::radar::pose::Pose;
use bnkf::measurement::{Channel, Vectors};
use bnkf::{Measurement, Sensed};

/// Range, elevation, azimuth and range-rate at one instant, with their standard deviations.
///
/// Frame: x east, y north, z up, counted from the radar's own place; azimuth from +x towards +y, elevation from
/// the horizontal plane, range-rate positive outbound. A noisy range may be negative, a noisy
/// elevation may pass the zenith; the azimuth stays in `(-pi, pi]`.
///
/// Of a channel that was not measured both the value and the standard deviation are NaN: who forgets
/// to ask gets no number at all. The product's [`Measurement`] has `None` there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Microseconds since the flight's first sample.
    pub time_us: u64,
    /// Range, metres.
    pub range_m: f64,
    /// Elevation, radians.
    pub elevation_rad: f64,
    /// Azimuth, radians.
    pub azimuth_rad: f64,
    /// Range-rate, metres per second.
    pub range_rate_mps: f64,
    /// Standard deviation (1 sigma) of the range, metres.
    pub sigma_range_m: f64,
    /// Standard deviation of the elevation, radians.
    pub sigma_elevation_rad: f64,
    /// Standard deviation of the azimuth, radians.
    pub sigma_azimuth_rad: f64,
    /// Standard deviation of the range-rate, metres per second.
    pub sigma_range_rate_mps: f64,
    /// Where the radar was and how it moved.
    pub sensor: Pose,
    /// How long after its time it comes, microseconds.
    pub late_us: u64,
}

impl Reading {
    /// Values and standard deviations in the order of vectors of measurements: elevation, azimuth,
    /// range, range-rate.
    fn parts(&self) -> [(f64, f64); 4] {
        [
            (self.elevation_rad, self.sigma_elevation_rad),
            (self.azimuth_rad, self.sigma_azimuth_rad),
            (self.range_m, self.sigma_range_m),
            (self.range_rate_mps, self.sigma_range_rate_mps),
        ]
    }

    /// As vectors for a filter step.
    #[must_use]
    pub fn vectors(&self) -> Vectors<f64> {
        let parts = self.parts();
        let or = |value: f64, sigma: f64, other| if sigma.is_nan() { other } else { value };
        Vectors {
            measured: parts.map(|(value, sigma)| or(value, sigma, 0.0)),
            sigmas: parts.map(|(_, sigma)| or(sigma, sigma, 1.0)),
            present: parts.map(|(_, sigma)| or(1.0, sigma, 0.0)),
        }
    }

    /// How many channels were measured.
    #[must_use]
    pub fn measured(&self) -> usize {
        let sigmas = self.parts().map(|(_, sigma)| sigma);
        sigmas.iter().filter(|sigma| !sigma.is_nan()).count()
    }

    /// The first channel that was not measured.
    #[must_use]
    pub fn missing(&self) -> Option<Channel> {
        let parts = Channel::ALL.into_iter().zip(self.parts());
        let mut missing = parts.filter(|(_, (_, sigma))| sigma.is_nan());
        missing.next().map(|(channel, _)| channel)
    }

    /// The same reading by a sensor without these channels.
    #[must_use]
    pub fn without(mut self, channels: &[Channel]) -> Self {
        for channel in channels {
            let (value, sigma) = match channel {
                Channel::Elevation => (&mut self.elevation_rad, &mut self.sigma_elevation_rad),
                Channel::Azimuth => (&mut self.azimuth_rad, &mut self.sigma_azimuth_rad),
                Channel::Range => (&mut self.range_m, &mut self.sigma_range_m),
                Channel::RangeRate => (&mut self.range_rate_mps, &mut self.sigma_range_rate_mps),
            };
            (*value, *sigma) = (f64::NAN, f64::NAN);
        }
        self
    }
}

impl From<&Reading> for Measurement {
    /// Rounds every field to the nearest finite f32, which is what a sensor's frame carries: of a standard deviation
    /// beyond all of them the tracker would say that its value is not finite.
    fn from(reading: &Reading) -> Self {
        let [elevation, azimuth, range, range_rate] = reading.parts().map(|(value, sigma)| {
            (!sigma.is_nan()).then_some(Sensed {
                value: nearest(value),
                sigma: nearest(sigma),
            })
        });
        Self {
            time_us: reading.time_us,
            range,
            elevation,
            azimuth,
            range_rate,
            sensor: reading.sensor.into(),
        }
    }
}

fn nearest(number: f64) -> f32 {
    let rounded = number as f32;
    if number.is_finite() {
        rounded.clamp(f32::MIN, f32::MAX)
    } else {
        rounded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READING: Reading = Reading {
        time_us: 7,
        range_m: 30.0,
        elevation_rad: 0.3,
        azimuth_rad: 1.0,
        range_rate_mps: -2.0,
        sigma_range_m: 1.0,
        sigma_elevation_rad: 0.01,
        sigma_azimuth_rad: 0.02,
        sigma_range_rate_mps: 0.1,
        sensor: Pose::ORIGIN,
        late_us: 0,
    };

    #[test]
    fn what_is_not_measured_is_no_number_and_nothing_to_the_tracker() {
        for (index, channel) in Channel::ALL.into_iter().enumerate() {
            let reading = READING.without(&[channel]);
            assert_eq!(reading.missing(), Some(channel));
            assert_eq!(reading.measured(), 3);
            let (value, sigma) = reading.parts()[index];
            assert!(value.is_nan() && sigma.is_nan());
            let vectors = reading.vectors();
            for i in 0..4 {
                let (value, sigma) = READING.parts()[i];
                let (value, sigma, present) = if i == index {
                    (0.0, 1.0, 0.0)
                } else {
                    (value, sigma, 1.0)
                };
                assert_eq!(vectors.measured[i], value);
                assert_eq!((vectors.sigmas[i], vectors.present[i]), (sigma, present));
            }
            let measurement = Measurement::from(&reading);
            let channels = measurement.channels();
            assert!(
                channels
                    .iter()
                    .enumerate()
                    .all(|(i, c)| c.is_none() == (i == index))
            );
            assert_eq!(measurement.check(), Ok(()));
        }
        assert_eq!(READING.missing(), None);
        assert_eq!(
            Measurement::from(&READING).azimuth,
            Some(Sensed {
                value: 1.0,
                sigma: 0.02
            })
        );
    }

    #[test]
    fn a_number_too_large_for_the_frame_is_named_as_what_it_is() {
        let refusal = |reading| Measurement::from(&reading).check().unwrap_err().to_string();
        let sigma_range_m = 1e300;
        let said = refusal(Reading {
            sigma_range_m,
            ..READING
        });
        assert_eq!(said, "sigma of range [m] is not within 0.0001 to 100000");
        let said = refusal(Reading {
            range_m: -1e300,
            ..READING
        });
        assert_eq!(said, "range [m] is not within -1000000 to 1000000");
        let said = refusal(Reading {
            range_m: f64::INFINITY,
            ..READING
        });
        assert_eq!(said, "range [m] is not finite");
    }
}
