//! The standard normal distribution from a table with linear interpolation.

use crate::series;

const STEPS_PER_UNIT: usize = 32;
const LIMIT: usize = 5;
/// The last one stands for all beyond.
const ENTRIES: usize = LIMIT * STEPS_PER_UNIT + 1;

/// What the standard normal distribution function has above one half, and the density, at the nodes;
/// each with the step to the next.
static NORMAL: [[f32; 4]; ENTRIES] = {
    let mut table = [[0.5, 0.0, 0.0, 0.0]; ENTRIES];
    let mut i = 0;
    while i + 1 < ENTRIES {
        let x = i as f64 / STEPS_PER_UNIT as f64;
        let next = x + 1.0 / STEPS_PER_UNIT as f64;
        table[i] = [
            (series::normal_cdf(x) - 0.5) as f32,
            (series::normal_cdf(next) - series::normal_cdf(x)) as f32,
            series::normal_density(x) as f32,
            (series::normal_density(next) - series::normal_density(x)) as f32,
        ];
        i += 1;
    }
    table
};

/// Distribution function and density of the standard normal, to 5e-5.
#[inline]
pub fn normal(x: f32) -> (f32, f32) {
    let place = x.abs() * STEPS_PER_UNIT as f32;
    let index = (place as usize).min(ENTRIES - 1);
    let [above, above_step, density, density_step] = NORMAL[index];
    let fraction = place - index as f32;
    let above = above + fraction * above_step;
    let above = if x < 0.0 { -above } else { above };
    (0.5 + above, density + fraction * density_step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_ends_are_the_functions() {
        assert_eq!(normal(-5.1), (0.0, 0.0));
        assert_eq!(normal(1e9), (1.0, 0.0));
        let last = f32::from_bits(5.0_f32.to_bits() - 1);
        for (x, cumulated) in [(last, 1.0), (5.0, 1.0), (-last, 0.0), (-5.0, 0.0)] {
            let (got, density) = normal(x);
            assert!((got - cumulated).abs() < 1e-6 && density < 1e-5, "{x}");
        }
    }
}
