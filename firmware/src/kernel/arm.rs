//! Four lanes or four rows at once on the microcontroller: the activations of four passes, or of
//! eight inputs of one pass, come by LDM, and SMLAD does two products.

use core::arch::naked_asm;
use core::mem::MaybeUninit;

/// Sums of the int8 codes `means` times the halves of `values`, and of the decoded variances
/// `codes` times the halves of `squares`; two words of four lanes for every group of four codes.
#[inline]
pub fn dots(means: &[u8], codes: &[u8], values: &[u32], squares: &[u32]) -> [[i32; 4]; 2] {
    let groups = (means.len().min(codes.len()) / 4).min(values.len().min(squares.len()) / 8);
    // SAFETY: reads `groups` times four bytes of `means` and `codes` and eight words of `values`
    // and `squares`, which all have; every byte is an index into the 256 entries of the table;
    // writes the eight words of the result.
    unsafe {
        let table = super::VARIANCES.as_ptr();
        let mut sums = MaybeUninit::<[[i32; 4]; 2]>::uninit();
        sum_row(
            means.as_ptr(),
            values.as_ptr(),
            groups,
            sums.as_mut_ptr(),
            codes.as_ptr(),
            squares.as_ptr(),
            table,
        );
        sums.assume_init()
    }
}

/// Sums of the int8 codes of each row times the halves of `words`; four lanes for each row.
#[inline]
pub fn dot_pass_rows(rows: &[u8], words: &[u32], sums: &mut [u32]) {
    let stride = words.len() / 2;
    let all = stride > 0 && stride % 4 == 0 && rows.len() == stride * (sums.len() / 4);
    if all && !rows.is_empty() {
        let is_wide = stride == WIDE && rows.as_ptr().cast::<u32>().is_aligned();
        let sums = sums.as_mut_ptr_range();
        // SAFETY: reads all of `words`, which belong to one row of whole groups, and all of `rows`, which
        // begin on a word where LDRD reads them; writes four words of `sums` for every row.
        unsafe {
            if is_wide {
                sum_wide_passes(rows.as_ptr(), words.as_ptr(), sums.start, sums.end);
            } else {
                sum_passes(rows.as_ptr(), words.as_ptr(), sums.start, sums.end, stride);
            }
        }
    }
}

/// Rows of [`WIDE`] codes that begin on a word: eight codes come by one LDRD, and nothing is counted within a
/// row.
#[unsafe(naked)]
unsafe extern "C" fn sum_wide_passes(
    rows: *const u8,
    words: *const u32,
    sums: *mut u32,
    sums_end: *mut u32,
) {
    naked_asm!(
        // r0 codes, r1 words, r2 sums, r4-r7 four lanes of two activations, r8-r11 the sums of the
        // lanes; the end of the sums lies lowest on the stack.
        ".macro BNKF_PASSES codes",
        "ldmia r1!, {{r4-r7}}",
        "smlad r8, \\codes, r4, r8",
        "smlad r9, \\codes, r5, r9",
        "smlad r10, \\codes, r6, r10",
        "smlad r11, \\codes, r7, r11",
        ".endm",
        "push {{r3-r11, lr}}",
        "2:",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        ".rept 8",
        "ldrd r3, r12, [r0], #8",
        "sxtb16 lr, r3",
        "BNKF_PASSES lr",
        "sxtb16 lr, r3, ror #8",
        "BNKF_PASSES lr",
        "sxtb16 lr, r12",
        "BNKF_PASSES lr",
        "sxtb16 lr, r12, ror #8",
        "BNKF_PASSES lr",
        ".endr",
        "stmia r2!, {{r8-r11}}",
        "ldr r12, [sp]",
        "sub r1, #512",
        "cmp r2, r12",
        "bne 2b",
        "pop {{r3-r11, pc}}",
        ".purgem BNKF_PASSES",
    )
}

/// Rows of any number of groups from any address.
#[unsafe(naked)]
unsafe extern "C" fn sum_passes(
    rows: *const u8,
    words: *const u32,
    sums: *mut u32,
    sums_end: *mut u32,
    stride: usize,
) {
    naked_asm!(
        // As above; r3 codes of the row that are left.
        ".macro BNKF_PASSES codes",
        "ldmia r1!, {{r4-r7}}",
        "smlad r8, \\codes, r4, r8",
        "smlad r9, \\codes, r5, r9",
        "smlad r10, \\codes, r6, r10",
        "smlad r11, \\codes, r7, r11",
        ".endm",
        "push {{r3-r11, lr}}",
        "2:",
        // The stride lies above the ten registers.
        "ldr r3, [sp, #40]",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "3:",
        "ldr r12, [r0], #4",
        "sxtb16 lr, r12",
        "BNKF_PASSES lr",
        "sxtb16 lr, r12, ror #8",
        "BNKF_PASSES lr",
        "subs r3, #4",
        "bne 3b",
        "stmia r2!, {{r8-r11}}",
        "ldr r12, [sp]",
        "ldr r3, [sp, #40]",
        "sub r1, r1, r3, lsl #3",
        "cmp r2, r12",
        "bne 2b",
        "pop {{r3-r11, pc}}",
        ".purgem BNKF_PASSES",
    )
}

/// One row: its means, then its variances. Whole fours of groups are unrolled.
#[unsafe(naked)]
unsafe extern "C" fn sum_row(
    means: *const u8,
    values: *const u32,
    groups: usize,
    sums: *mut [[i32; 4]; 2],
    codes: *const u8,
    squares: *const u32,
    table: *const u16,
) {
    naked_asm!(
        // r0 codes, r1 words, r2 groups left, r3 groups of the unrolled loop or the table,
        // r8-r11 the sums of the four lanes.
        ".macro BNKF_MEANS",
        "ldr r12, [r0], #4",
        "ldmia r1!, {{r4-r7}}",
        "sxtb16 lr, r12",
        "sxtb16 r12, r12, ror #8",
        "smlad r8, lr, r4, r8",
        "smlad r9, lr, r5, r9",
        "smlad r10, lr, r6, r10",
        "smlad r11, lr, r7, r11",
        "ldmia r1!, {{r4-r7}}",
        "smlad r8, r12, r4, r8",
        "smlad r9, r12, r5, r9",
        "smlad r10, r12, r6, r10",
        "smlad r11, r12, r7, r11",
        ".endm",
        ".macro BNKF_VARIANCES",
        "ldrb r4, [r0], #4",
        "ldrb r5, [r0, #-3]",
        "ldrb r6, [r0, #-2]",
        "ldrb r7, [r0, #-1]",
        "ldrh r4, [r3, r4, lsl #1]",
        "ldrh r5, [r3, r5, lsl #1]",
        "ldrh r6, [r3, r6, lsl #1]",
        "ldrh r7, [r3, r7, lsl #1]",
        "pkhbt lr, r4, r6, lsl #16",
        "pkhbt r12, r5, r7, lsl #16",
        "ldmia r1!, {{r4-r7}}",
        "smlad r8, lr, r4, r8",
        "smlad r9, lr, r5, r9",
        "smlad r10, lr, r6, r10",
        "smlad r11, lr, r7, r11",
        "ldmia r1!, {{r4-r7}}",
        "smlad r8, r12, r4, r8",
        "smlad r9, r12, r5, r9",
        "smlad r10, r12, r6, r10",
        "smlad r11, r12, r7, r11",
        ".endm",
        "push {{r2-r11, lr}}",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "ands r3, r2, #3",
        "beq 3f",
        "2:",
        "BNKF_MEANS",
        "subs r3, #1",
        "bne 2b",
        "3:",
        "lsrs r2, #2",
        "beq 5f",
        "4:",
        ".rept 4",
        "BNKF_MEANS",
        ".endr",
        "subs r2, #1",
        "bne 4b",
        "5:",
        // The group count and the address of the sums were pushed first and second.
        "pop {{r2, r3}}",
        "stmia r3!, {{r8-r11}}",
        "push {{r2, r3}}",
        // The arguments on the stack lie above the eleven registers.
        "add r3, sp, #44",
        "ldmia r3, {{r0, r1, r3}}",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "ands r2, r2, #3",
        "beq 7f",
        "6:",
        "BNKF_VARIANCES",
        "subs r2, #1",
        "bne 6b",
        "7:",
        "ldr r2, [sp]",
        "lsrs r2, #2",
        "beq 9f",
        "8:",
        ".rept 4",
        "BNKF_VARIANCES",
        ".endr",
        "subs r2, #1",
        "bne 8b",
        "9:",
        "pop {{r2, r3}}",
        "stmia r3, {{r8-r11}}",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_MEANS",
        ".purgem BNKF_VARIANCES",
    )
}

/// Sums of the int8 codes of each row times the halves of `words`, two words for every group of four
/// codes; four rows at a time.
#[inline]
pub fn dot_rows(rows: &[u8], words: &[u32], sums: &mut [[i32; 4]]) {
    let stride = 2 * words.len();
    let sums_match = rows.len() == 4 * stride * sums.len() && !sums.is_empty();
    let is_wide = stride == WIDE && rows.as_ptr().cast::<u32>().is_aligned();
    if sums_match && is_wide {
        let sums = sums.as_mut_ptr_range();
        // SAFETY: reads all of `words`, which are [`WIDE`] halves, and all of `rows`, which begin on a
        // word as LDRD needs it; writes all of `sums`, of which there is at least one.
        unsafe { sum_wide_rows(rows.as_ptr(), words.as_ptr(), sums.start, sums.end) }
    } else if sums_match && words.len() % 2 == 0 {
        let words = words.as_ptr_range();
        let sums = sums.as_mut_ptr_range();
        // SAFETY: reads whole pairs of `words`, and four bytes of each of four rows for a pair, which
        // is all of `rows`; writes all of `sums`, of which there is at least one.
        unsafe {
            sum_rows(
                rows.as_ptr(),
                words.start,
                words.end,
                stride,
                sums.start,
                sums.end,
            );
        }
    }
}

/// Inputs of the widest layer, whose rows have their own loop.
const WIDE: usize = 64;
const _: () = assert!(WIDE == crate::blob::field::WIDTH_MAX);

/// Rows of [`WIDE`] codes that begin on a word: eight codes come by one LDRD.
#[unsafe(naked)]
unsafe extern "C" fn sum_wide_rows(
    rows: *const u8,
    words: *const u32,
    sums: *mut [i32; 4],
    sums_end: *mut [i32; 4],
) {
    naked_asm!(
        // r0 the first of four rows, r1 words, r2 sums, r3-r6 eight activations, r8-r11 four sums.
        ".macro BNKF_WIDE_ROW sum, place:vararg",
        "ldrd r7, r12, \\place",
        "sxtb16 lr, r7",
        "sxtb16 r7, r7, ror #8",
        "smlad \\sum, lr, r3, \\sum",
        "sxtb16 lr, r12",
        "smlad \\sum, r7, r4, \\sum",
        "sxtb16 r12, r12, ror #8",
        "smlad \\sum, lr, r5, \\sum",
        "smlad \\sum, r12, r6, \\sum",
        ".endm",
        // The ends of the words and of the sums lie lowest on the stack.
        "push {{r3-r11, lr}}",
        "add r12, r1, #128",
        "push {{r12}}",
        "2:",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "3:",
        ".rept 4",
        "ldmia r1!, {{r3-r6}}",
        "BNKF_WIDE_ROW r9, [r0, #64]",
        "BNKF_WIDE_ROW r10, [r0, #128]",
        "BNKF_WIDE_ROW r11, [r0, #192]",
        "BNKF_WIDE_ROW r8, [r0], #8",
        ".endr",
        "ldrd r7, r12, [sp]",
        "cmp r1, r7",
        "bne 3b",
        "stmia r2!, {{r8-r11}}",
        "sub r1, #128",
        "add r0, #192",
        "cmp r2, r12",
        "bne 2b",
        "add sp, #8",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_WIDE_ROW",
    )
}

/// Rows of any length from any address: a single group of four codes if they are odd, then pairs.
#[unsafe(naked)]
unsafe extern "C" fn sum_rows(
    rows: *const u8,
    words: *const u32,
    words_end: *const u32,
    stride: usize,
    sums: *mut [i32; 4],
    sums_end: *mut [i32; 4],
) {
    naked_asm!(
        // r0 the first of four rows, r4 the last, r3 from row to row, r1 words, r8-r11 sums.
        ".macro BNKF_ROW sum, first, second, place:vararg",
        "ldr r7, \\place",
        "sxtb16 r12, r7",
        "sxtb16 r7, r7, ror #8",
        "smlad \\sum, r12, \\first, \\sum",
        "smlad \\sum, r7, \\second, \\sum",
        ".endm",
        ".macro BNKF_ROWS first, second",
        "BNKF_ROW r9, \\first, \\second, [r0, r3]",
        "BNKF_ROW r10, \\first, \\second, [r0, r3, lsl #1]",
        "BNKF_ROW r8, \\first, \\second, [r0], #4",
        "BNKF_ROW r11, \\first, \\second, [r4], #4",
        ".endm",
        // The end of the words lies lowest on the stack; the other arguments above ten registers.
        "push {{r2, r4-r11, lr}}",
        "2:",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "add r4, r3, r3, lsl #1",
        "add r4, r0",
        "3:",
        "ldr r7, [sp]",
        "subs r7, r1",
        "beq 5f",
        "tst r7, #15",
        "beq 4f",
        "ldmia r1!, {{r2, r5}}",
        "BNKF_ROWS r2, r5",
        "b 3b",
        "4:",
        "ldmia r1!, {{r2, r5, r6, lr}}",
        "BNKF_ROWS r2, r5",
        "BNKF_ROWS r6, lr",
        "ldr r7, [sp]",
        "cmp r1, r7",
        "bne 4b",
        "5:",
        "ldr r7, [sp, #40]",
        "ldr r12, [sp, #44]",
        "stmia r7!, {{r8-r11}}",
        "str r7, [sp, #40]",
        "sub r1, r1, r3, lsl #1",
        "mov r0, r4",
        "cmp r7, r12",
        "bne 2b",
        "pop {{r2, r4-r11, pc}}",
        ".purgem BNKF_ROW",
        ".purgem BNKF_ROWS",
    )
}

/// Bits of the largest magnitude of each lane; `activations` are `[input][lane]`.
#[inline]
pub fn largest_magnitudes(activations: &[f32]) -> [u32; 4] {
    let mut largest = [0; 4];
    let rows = activations.len() / 4;
    if rows > 0 {
        // SAFETY: reads `rows` times four words of `activations`, writes those of `largest`.
        unsafe { largest_of(activations.as_ptr(), rows, &mut largest) }
    }
    largest.map(|doubled: u32| doubled >> 1)
}

/// Magnitudes shifted left by one, which drops the sign.
#[unsafe(naked)]
unsafe extern "C" fn largest_of(activations: *const f32, rows: usize, largest: &mut [u32; 4]) {
    naked_asm!(
        ".macro BNKF_LARGER lane, largest",
        "cmp \\largest, \\lane, lsl #1",
        "it lo",
        "lsllo \\largest, \\lane, #1",
        ".endm",
        "push {{r4-r11, lr}}",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "2:",
        "ldmia r0!, {{r4-r7}}",
        "BNKF_LARGER r4, r8",
        "BNKF_LARGER r5, r9",
        "BNKF_LARGER r6, r10",
        "BNKF_LARGER r7, r11",
        "subs r1, #1",
        "bne 2b",
        "stmia r2, {{r8-r11}}",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_LARGER",
    )
}
