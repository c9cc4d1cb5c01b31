//! The axes of a flight file's positions.

/// Axes of a right-handed local frame, metres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Frame {
    /// x east, y north, z up: this workspace's.
    Enu,
    /// x north, y east, z down: PX4's and ArduPilot's local position.
    Ned,
    /// Latitude and longitude in degrees, height.
    Wgs84,
}

impl Frame {
    /// The frame in which most of a flight is above its origin, for aircraft take off from there, and what to say of its
    /// `columns`. Rows are `[time, x, y, z]`.
    #[must_use]
    pub fn plausible(rows: &[[f64; 4]], [x, y, z]: [&str; 3]) -> (Self, String) {
        let above = rows.iter().filter(|row| row[3] > 0.0).count();
        let below = rows.iter().filter(|row| row[3] < 0.0).count();
        let (frame, axes, other) = if below > above {
            (Self::Ned, "north, east, down", "enu")
        } else {
            (Self::Enu, "east, north, up", "ned")
        };
        let note = format!(
            "`{x}`, `{y}`, `{z}` read as {axes}, which puts most of the flight above its origin; \
             --frame {other} says otherwise"
        );
        (frame, note)
    }
}

#[cfg(test)]
mod tests {
    use super::Frame;

    #[test]
    fn flights_are_above_their_origin() {
        let rows = |heights: [f64; 3]| heights.map(|z| [0.0, 0.0, 0.0, z]);
        assert_eq!(
            Frame::plausible(&rows([0.1, -5.0, -6.0]), ["x", "y", "z"]).0,
            Frame::Ned
        );
        assert_eq!(
            Frame::plausible(&rows([-0.1, 5.0, 6.0]), ["x", "y", "z"]).0,
            Frame::Enu
        );
        assert_eq!(
            Frame::plausible(&rows([0.0; 3]), ["x", "y", "z"]).0,
            Frame::Enu
        );
        assert_eq!(
            Frame::plausible(&rows([f64::NAN; 3]), ["x", "y", "z"]).0,
            Frame::Enu
        );
    }
}
