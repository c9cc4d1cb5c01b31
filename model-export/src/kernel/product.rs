//! Matrix products in the two shapes that training needs.
//!
//! A tile of the result stays in registers while one row of `b` after the other is streamed past
//! it; tile sizes are chosen so that accumulators and one row of `b` fill the register file.

use super::tier::per_tier;

per_tier! {
    /// `c[i][j] = start[j] + sum over p < depth of a[i][p] * b[p][j]`.
    ///
    /// `a` is `rows` x `a_stride`, `b` is `depth` x `columns`, `c` is `rows` x `columns`;
    /// `start` holds `columns` values. `rows` is a multiple of 4, `columns` of 16.
    fn rows_times(
        depth: usize,
        columns: usize,
        a_stride: usize,
        a: &[f32],
        b: &[f32],
        start: &[f32],
        c: &mut [f32],
    ) => rows_times_tiled::<4, 4>, rows_times_tiled::<4, 16>, rows_times_wide
}

per_tier! {
    /// `c[i][j] += sum over r of a[r][i] * b[r][j]` for `i < rows`.
    ///
    /// `a` is any number of rows of `a_stride`, `b` as many rows of `columns`, `c` is at least
    /// `rows` x `columns`. `rows` is a multiple of 4, `columns` of 16.
    fn transposed_times(
        rows: usize,
        columns: usize,
        a_stride: usize,
        a: &[f32],
        b: &[f32],
        c: &mut [f32],
    ) => transposed_times_tiled::<4, 4>, transposed_times_tiled::<4, 16>, transposed_times_wide
}

per_tier! {
    /// `sums[j] += sum over r of a[r][j]`, rows in order; `sums` holds one row of `a`.
    fn add_columns(a: &[f32], sums: &mut [f32])
        => add_columns_body, add_columns_body, add_columns_body
}

#[inline(always)]
fn add_columns_body(a: &[f32], sums: &mut [f32]) {
    for row in a.chunks_exact(sums.len()) {
        for (sum, value) in sums.iter_mut().zip(row) {
            *sum += value;
        }
    }
}

#[inline(always)]
fn rows_times_wide(
    depth: usize,
    columns: usize,
    a_stride: usize,
    a: &[f32],
    b: &[f32],
    start: &[f32],
    c: &mut [f32],
) {
    if columns.is_multiple_of(64) {
        rows_times_tiled::<4, 64>(depth, columns, a_stride, a, b, start, c);
    } else if columns.is_multiple_of(32) {
        rows_times_tiled::<8, 32>(depth, columns, a_stride, a, b, start, c);
    } else {
        rows_times_tiled::<8, 16>(depth, columns, a_stride, a, b, start, c);
    }
}

#[inline(always)]
fn transposed_times_wide(
    rows: usize,
    columns: usize,
    a_stride: usize,
    a: &[f32],
    b: &[f32],
    c: &mut [f32],
) {
    if columns.is_multiple_of(64) {
        transposed_times_tiled::<4, 64>(rows, columns, a_stride, a, b, c);
    } else if columns.is_multiple_of(32) {
        transposed_times_tiled::<4, 32>(rows, columns, a_stride, a, b, c);
    } else {
        transposed_times_tiled::<4, 16>(rows, columns, a_stride, a, b, c);
    }
}

#[inline(always)]
fn rows_times_tiled<const TALL: usize, const WIDE: usize>(
    depth: usize,
    columns: usize,
    a_stride: usize,
    a: &[f32],
    b: &[f32],
    start: &[f32],
    c: &mut [f32],
) {
    let rows = a.len() / a_stride;
    assert!(rows.is_multiple_of(TALL) && columns.is_multiple_of(WIDE) && depth <= a_stride);
    let b = &b[..depth * columns];
    for i in (0..rows).step_by(TALL) {
        let a_rows: [&[f32]; TALL] = std::array::from_fn(|r| &a[(i + r) * a_stride..][..depth]);
        for j in (0..columns).step_by(WIDE) {
            let mut tile = [tile_row::<WIDE>(start, j); TALL];
            // The range lets the compiler see that `p` is within every row.
            for (p, b_row) in (0..depth).zip(b.chunks_exact(columns)) {
                let b_row = tile_row::<WIDE>(b_row, j);
                for r in 0..TALL {
                    let factor = a_rows[r][p];
                    for q in 0..WIDE {
                        tile[r][q] = factor.mul_add(b_row[q], tile[r][q]);
                    }
                }
            }
            for r in 0..TALL {
                c[(i + r) * columns + j..][..WIDE].copy_from_slice(&tile[r]);
            }
        }
    }
}

#[inline(always)]
fn transposed_times_tiled<const TALL: usize, const WIDE: usize>(
    rows: usize,
    columns: usize,
    a_stride: usize,
    a: &[f32],
    b: &[f32],
    c: &mut [f32],
) {
    assert!(rows.is_multiple_of(TALL) && columns.is_multiple_of(WIDE) && rows <= a_stride);
    assert_eq!(a.len() / a_stride, b.len() / columns);
    for i in (0..rows).step_by(TALL) {
        for j in (0..columns).step_by(WIDE) {
            let mut tile: [[f32; WIDE]; TALL] =
                std::array::from_fn(|r| tile_row(&c[(i + r) * columns..], j));
            for (a_row, b_row) in a.chunks_exact(a_stride).zip(b.chunks_exact(columns)) {
                let factors = tile_row::<TALL>(a_row, i);
                let b_row = tile_row::<WIDE>(b_row, j);
                for r in 0..TALL {
                    for q in 0..WIDE {
                        tile[r][q] = factors[r].mul_add(b_row[q], tile[r][q]);
                    }
                }
            }
            for r in 0..TALL {
                c[(i + r) * columns + j..][..WIDE].copy_from_slice(&tile[r]);
            }
        }
    }
}

#[inline(always)]
fn tile_row<const WIDE: usize>(row: &[f32], from: usize) -> [f32; WIDE] {
    let mut values = [0.0; WIDE];
    values.copy_from_slice(&row[from..from + WIDE]);
    values
}

#[cfg(test)]
mod tests {
    use super::super::{Aligned, Tier};
    use super::{rows_times, transposed_times};

    fn filled(len: usize, seed: u32) -> Aligned {
        let mut buffer = Aligned::zeros(len);
        let mut state = seed;
        for value in buffer.iter_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *value = (state >> 8) as f32 / (1 << 23) as f32 - 1.0;
        }
        buffer
    }

    /// (rows, depth, columns, stride of a)
    const SHAPES: [(usize, usize, usize, usize); 5] = [
        (64, 13, 64, 16),
        (64, 64, 64, 64),
        (64, 3, 64, 16),
        (8, 32, 32, 32),
        (16, 48, 16, 48),
    ];

    #[test]
    fn rows_times_is_the_sum_in_order_of_depth_on_every_tier() {
        for (rows, depth, columns, stride) in SHAPES {
            let (a, b) = (filled(rows * stride, 1), filled(depth * columns, 2));
            let start = filled(columns, 3);
            for tier in Tier::available() {
                let mut c = Aligned::zeros(rows * columns);
                rows_times(tier, depth, columns, stride, &a, &b, &start, &mut c);
                for i in 0..rows {
                    for j in 0..columns {
                        let naive = (0..depth).fold(start[j], |sum, p| {
                            a[i * stride + p].mul_add(b[p * columns + j], sum)
                        });
                        assert_eq!(c[i * columns + j], naive, "{} {i} {j}", tier.name());
                    }
                }
            }
        }
    }

    #[test]
    fn transposed_times_adds_the_sum_in_order_of_rows_on_every_tier() {
        for (samples, rows, columns, stride) in [
            (64, 64, 64, 64),
            (64, 4, 64, 16),
            (20, 32, 16, 32),
            (8, 16, 32, 16),
        ] {
            let (a, b) = (filled(samples * stride, 4), filled(samples * columns, 5));
            for tier in Tier::available() {
                let mut c = filled(rows * columns, 6);
                let before = c.clone();
                transposed_times(tier, rows, columns, stride, &a, &b, &mut c);
                for i in 0..rows {
                    for j in 0..columns {
                        let naive = (0..samples).fold(before[i * columns + j], |sum, r| {
                            a[r * stride + i].mul_add(b[r * columns + j], sum)
                        });
                        assert_eq!(c[i * columns + j], naive, "{} {i} {j}", tier.name());
                    }
                }
            }
        }
    }
}
