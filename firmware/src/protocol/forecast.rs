//! Forecasts on the wire.

use serde::{Deserialize, Serialize};

use crate::Estimate;

/// Times of one request for forecasts.
pub const HORIZONS: usize = 3;

/// Where the target will be at the times that were asked about.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForecastFrame {
    /// In the order of the times.
    pub places: [PlaceFrame; HORIZONS],
    /// Ticks spent inside the tracker, see [`EstimateFrame`](crate::protocol::EstimateFrame).
    pub ticks: u32,
}

/// A position at a time; frame as in [`Measurement`](crate::Measurement).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaceFrame {
    /// Microseconds.
    pub time_us: u64,
    /// x, y, z, metres.
    pub position_m: [f32; 3],
    /// Covariance of the position, row by row, m^2.
    pub covariance_m2: [[f32; 3]; 3],
    /// Whether the target will be where, or move as, the model was not trained for.
    pub outside: bool,
}

impl ForecastFrame {
    /// Forecasts and what they cost.
    pub fn new(forecasts: &[Estimate; HORIZONS], ticks: u32) -> Self {
        Self {
            places: core::array::from_fn(|i| PlaceFrame::from(&forecasts[i])),
            ticks,
        }
    }

    /// Whether two forecasts are the same to the last bit, whatever they cost.
    pub fn same_bits(&self, other: &Self) -> bool {
        self.places.map(|place| place.bits()) == other.places.map(|place| place.bits())
    }
}

impl From<&Estimate> for PlaceFrame {
    fn from(estimate: &Estimate) -> Self {
        Self {
            time_us: estimate.time_us,
            position_m: estimate.position_m,
            covariance_m2: estimate.covariance_m2,
            outside: estimate.outside,
        }
    }
}

impl PlaceFrame {
    fn bits(&self) -> (u64, [u32; 3], [[u32; 3]; 3], bool) {
        let bits = |row: [f32; 3]| row.map(f32::to_bits);
        (
            self.time_us,
            bits(self.position_m),
            self.covariance_m2.map(bits),
            self.outside,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_bits_sees_every_number_but_not_the_cost() {
        let place = PlaceFrame {
            time_us: 5,
            position_m: [1.0, 2.0, 3.0],
            covariance_m2: [[4.0, 5.0, 6.0], [5.0, 7.0, 8.0], [6.0, 8.0, 0.0]],
            outside: false,
        };
        let base = ForecastFrame {
            places: [place; HORIZONS],
            ticks: 1,
        };
        assert!(base.same_bits(&ForecastFrame { ticks: 2, ..base }));
        for number in 0..14 {
            for which in 0..HORIZONS {
                let mut other = base;
                let place = &mut other.places[which];
                let flip = |x: &mut f32| *x = f32::from_bits(x.to_bits() ^ (1 << 31));
                match number {
                    0..3 => flip(&mut place.position_m[number]),
                    3..12 => flip(&mut place.covariance_m2[number / 3 - 1][number % 3]),
                    12 => place.time_us += 1,
                    _ => place.outside = true,
                }
                assert!(!base.same_bits(&other), "{number} of {which}");
            }
        }
    }
}
