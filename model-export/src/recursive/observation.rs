//! What the radar would measure of a state.

use super::carry::{MEASUREMENT, STATE};
use super::line_of_sight::LineOfSight;
use super::scalar::Scalar;

/// Elevation, azimuth, range and range-rate of a state, and their derivatives by position and
/// velocity (rows: measurements; columns: three of position, three of velocity).
pub fn observe<S: Scalar>(
    state: &[S; STATE],
    sight: &LineOfSight<S>,
) -> ([S; MEASUREMENT], [[S; 6]; MEASUREMENT]) {
    let zero = S::constant(0.0);
    let [x, y, z, vx, vy, vz, ..] = *state;
    let (rho, range) = (sight.horizontal_m, sight.range_m);
    let range2 = range * range;
    let unit = [x / range, y / range, z / range];
    let rate = unit[0] * vx + unit[1] * vy + unit[2] * vz;
    let lean = z / (range2 * rho);
    let across = |velocity: S, along: S| (velocity - rate * along) / range;
    let expected = [z.atan2(rho), y.atan2(x), range, rate];
    let jacobian = [
        [-(x * lean), -(y * lean), rho / range2, zero, zero, zero],
        [
            -(y / sight.horizontal_m2),
            x / sight.horizontal_m2,
            zero,
            zero,
            zero,
            zero,
        ],
        [unit[0], unit[1], unit[2], zero, zero, zero],
        [
            across(vx, unit[0]),
            across(vy, unit[1]),
            across(vz, unit[2]),
            unit[0],
            unit[1],
            unit[2],
        ],
    ];
    (expected, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATE_AT: [f64; 9] = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4, 0.3, 0.2, -0.1];

    fn expected(state: &[f64; 9]) -> [f64; 4] {
        observe(state, &LineOfSight::to([state[0], state[1], state[2]])).0
    }

    #[test]
    fn jacobian_equals_central_differences() {
        let (_, jacobian) = observe(&STATE_AT, &LineOfSight::to([12.0, -21.0, 9.0]));
        for k in 0..6 {
            let (mut high, mut low) = (STATE_AT, STATE_AT);
            high[k] += 1e-5;
            low[k] -= 1e-5;
            for i in 0..4 {
                let difference = (expected(&high)[i] - expected(&low)[i]) / 2e-5;
                assert!((jacobian[i][k] - difference).abs() < 1e-9, "{i} {k}");
            }
        }
    }
}
