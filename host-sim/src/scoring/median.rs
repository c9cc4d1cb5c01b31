//! The middle of many values.

/// Median of the values of all `parts`; the mean of the middle two if their number is even, NaN if there are none.
///
/// The values stay where they are: of so many a copy would be the largest thing in memory.
pub fn median(parts: &[&[f64]]) -> f64 {
    let count: usize = parts.iter().map(|part| part.len()).sum();
    if count == 0 {
        return f64::NAN;
    }
    let middle = count / 2;
    if count % 2 == 1 {
        return of_rank(parts, middle);
    }
    0.5 * (of_rank(parts, middle - 1) + of_rank(parts, middle))
}

/// The value that `rank` others come before, in the order of [`f64::total_cmp`]: bit by bit from the highest, by how
/// many values lie below.
fn of_rank(parts: &[&[f64]], rank: usize) -> f64 {
    let mut found = 0_u64;
    for bit in (0..u64::BITS).rev() {
        let next = found | 1 << bit;
        let below = |part: &&[f64]| part.iter().filter(|value| key(**value) < next).count();
        if parts.iter().map(below).sum::<usize>() <= rank {
            found = next;
        }
    }
    value(found)
}

const SIGN: u64 = 1 << 63;

/// A number whose order is that of the values.
fn key(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

/// The value of a [`key`].
fn value(key: u64) -> f64 {
    f64::from_bits(if key & SIGN == 0 { !key } else { key & !SIGN })
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::random_source::RandomSource;

    use super::{key, median, value};

    #[test]
    fn median_of_odd_and_even_counts() {
        assert_eq!(median(&[&[3.0, 1.0, 2.0]]), 2.0);
        assert_eq!(median(&[&[4.0, 1.0], &[], &[2.0, 3.0]]), 2.5);
        assert_eq!(median(&[&[7.0]]), 7.0);
        assert_eq!(
            median(&[&[-1.0], &[f64::NAN, f64::INFINITY]]),
            f64::INFINITY
        );
        assert!(median(&[]).is_nan() && median(&[&[], &[]]).is_nan());
    }

    #[test]
    fn it_is_what_sorting_finds() {
        let mut random = RandomSource::new(7, &[]);
        for count in 1..200_usize {
            let mut draw =
                || (random.normal() * 8.0).round() * 10_f64.powi(random.below(9) as i32 - 4);
            let values: Vec<f64> = (0..count).map(|_| draw()).collect();
            let cut = random.below(count + 1);
            let found = median(&[&values[..cut], &values[cut..]]);
            let mut sorted = values;
            sorted.sort_unstable_by(f64::total_cmp);
            let middle = count / 2;
            let expected = match count % 2 {
                1 => sorted[middle],
                _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
            };
            assert_eq!(found.to_bits(), expected.to_bits(), "{sorted:?}");
        }
    }

    #[test]
    fn keys_keep_the_order() {
        let order = [
            f64::NEG_INFINITY,
            -1.0,
            -0.0,
            0.0,
            1e-300,
            1.0,
            f64::INFINITY,
            f64::NAN,
        ];
        assert!(order.windows(2).all(|pair| key(pair[0]) < key(pair[1])));
        for of in order {
            assert_eq!(value(key(of)).to_bits(), of.to_bits());
        }
    }
}
