//! Four lanes or four rows at once on the host: PMADDWD is SMLAD without the sum. SSE2 is part of
//! x86_64.

use core::arch::x86_64::{
    __m128i, _mm_add_epi32, _mm_cvtsi32_si128, _mm_loadu_si128, _mm_madd_epi16, _mm_set_epi16,
    _mm_set_epi32, _mm_set1_epi32, _mm_setzero_si128, _mm_shuffle_epi32, _mm_shufflelo_epi16,
    _mm_slli_epi16, _mm_srai_epi16, _mm_storeu_si128, _mm_unpacklo_epi8,
};

/// Sums of the int8 codes `means` times the halves of `values`, and of the decoded variances
/// `codes` times the halves of `squares`; two words of four lanes for every group of four codes.
#[inline]
pub fn dots(means: &[u8], codes: &[u8], values: &[u32], squares: &[u32]) -> [[i32; 4]; 2] {
    [
        dot(means, values, signed_codes),
        dot(codes, squares, variances),
    ]
}

/// Sums of the int8 codes of each row times the halves of `words`; four lanes for each row.
#[inline]
pub fn dot_pass_rows(rows: &[u8], words: &[u32], sums: &mut [u32]) {
    let stride = (words.len() / 2).max(1);
    for (row, sums) in rows.chunks_exact(stride).zip(sums.as_chunks_mut().0) {
        *sums = dot(row, words, signed_codes).map(i32::cast_unsigned);
    }
}

/// Sums over groups of four codes; `decode` turns a group into its two pairs, in the lowest
/// two words of a vector.
#[inline]
fn dot(row: &[u8], words: &[u32], decode: impl Fn(&[u8; 4]) -> __m128i) -> [i32; 4] {
    let (groups, _) = row.as_chunks::<4>();
    let (words, _) = words.as_chunks::<8>();
    let mut sums = [0_i32; 4];
    // SAFETY: the unaligned loads and the store cover four words each of arrays of eight and
    // four words.
    unsafe {
        let mut sum = _mm_setzero_si128();
        for (codes, words) in groups.iter().zip(words) {
            let pairs = decode(codes);
            let first = _mm_loadu_si128(words.as_ptr().cast());
            let second = _mm_loadu_si128(words.as_ptr().add(4).cast());
            let pair = _mm_shuffle_epi32::<0x00>(pairs);
            sum = _mm_add_epi32(sum, _mm_madd_epi16(first, pair));
            let pair = _mm_shuffle_epi32::<0x55>(pairs);
            sum = _mm_add_epi32(sum, _mm_madd_epi16(second, pair));
        }
        _mm_storeu_si128(sums.as_mut_ptr().cast(), sum);
    }
    sums
}

/// Sums of the int8 codes of each row times the halves of `words`, two words for every group of four
/// codes; one lane for each of four rows.
#[inline]
pub fn dot_rows(rows: &[u8], words: &[u32], sums: &mut [[i32; 4]]) {
    let stride = 2 * words.len();
    let (words, _) = words.as_chunks::<2>();
    for (rows, sums) in rows.chunks_exact(4 * stride).zip(sums) {
        let row = |i: usize| rows[i * stride..][..stride].as_chunks::<4>().0;
        let groups = row(0).iter().zip(row(1)).zip(row(2)).zip(row(3));
        // SAFETY: register arithmetic of SSE2, and a store that covers four words of four.
        unsafe {
            let mut sum = _mm_setzero_si128();
            for ((((&a, &b), &c), &d), &[first, second]) in groups.zip(words) {
                let [a, b, c, d] = [a, b, c, d].map(i32::from_le_bytes);
                let codes = _mm_set_epi32(d, c, b, a);
                let even = _mm_srai_epi16::<8>(_mm_slli_epi16::<8>(codes));
                let odd = _mm_srai_epi16::<8>(codes);
                let first = _mm_set1_epi32(first.cast_signed());
                let second = _mm_set1_epi32(second.cast_signed());
                sum = _mm_add_epi32(sum, _mm_madd_epi16(even, first));
                sum = _mm_add_epi32(sum, _mm_madd_epi16(odd, second));
            }
            _mm_storeu_si128(sums.as_mut_ptr().cast(), sum);
        }
    }
}

/// Pairs (0, 2) and (1, 3) of four int8 codes.
#[inline]
fn signed_codes(codes: &[u8; 4]) -> __m128i {
    // SAFETY: register arithmetic of SSE2.
    unsafe {
        let bytes = _mm_cvtsi32_si128(i32::from_le_bytes(*codes));
        let extended = _mm_srai_epi16::<8>(_mm_unpacklo_epi8(bytes, bytes));
        _mm_shufflelo_epi16::<0b11_01_10_00>(extended)
    }
}

/// Pairs (0, 2) and (1, 3) of four decoded variances.
#[inline]
fn variances(codes: &[u8; 4]) -> __m128i {
    let v = codes.map(|code| super::VARIANCES[usize::from(code)] as i16);
    // SAFETY: register arithmetic of SSE2.
    unsafe { _mm_set_epi16(0, 0, 0, 0, v[3], v[1], v[2], v[0]) }
}
