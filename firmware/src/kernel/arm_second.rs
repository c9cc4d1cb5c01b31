//! Sums of second moments on the microcontroller, in 64 bits by SMLALD: decoded variances of whole
//! rows, and squared means of some of their columns.

use super::spread::{GROUPS, Group};
use core::arch::naked_asm;

/// For each row of four codes for every pair of `words` the sum of the decoded variances times their
/// halves, less the lowest eight bits. There is a row for every sum.
#[inline]
pub fn dot_variances(rows: &[u8], words: &[[u32; 2]], sums: &mut [i32]) {
    if rows.len() == 4 * words.len() * sums.len() && !rows.is_empty() {
        let ends = sums.as_mut_ptr_range();
        // SAFETY: reads four codes for each of `words` and each sum, which is all of `rows`, and all of
        // `words`; every code is an index into the 256 entries of the table; writes all of `sums`, of
        // which there is at least one.
        unsafe {
            let table = super::VARIANCES.as_ptr();
            let (rows, words) = (rows.as_ptr(), words.as_ptr_range());
            sum_variances(rows, words.start, words.end, table, ends.start, ends.end);
        }
    }
}

#[unsafe(naked)]
unsafe extern "C" fn sum_variances(
    rows: *const u8,
    words: *const [u32; 2],
    words_end: *const [u32; 2],
    table: *const u16,
    sums: *mut i32,
    sums_end: *mut i32,
) {
    naked_asm!(
        // r0 and r2 codes of two rows, r1 words, r3 table, r4 and r5 four activations, r8-r9 and
        // r10-r11 the sums.
        ".macro BNKF_ROW row, low, high",
        "ldrb r6, [\\row], #4",
        "ldrb r7, [\\row, #-2]",
        "ldrh r6, [r3, r6, lsl #1]",
        "ldrh r7, [r3, r7, lsl #1]",
        "pkhbt r6, r6, r7, lsl #16",
        "smlald \\low, \\high, r6, r4",
        "ldrb r6, [\\row, #-3]",
        "ldrb r7, [\\row, #-1]",
        "ldrh r6, [r3, r6, lsl #1]",
        "ldrh r7, [r3, r7, lsl #1]",
        "pkhbt r6, r6, r7, lsl #16",
        "smlald \\low, \\high, r6, r5",
        ".endm",
        ".macro BNKF_ROWS",
        "ldmia r1!, {{r4, r5}}",
        "BNKF_ROW r0, r8, r9",
        "BNKF_ROW r2, r10, r11",
        ".endm",
        "push {{r4-r11, lr}}",
        "sub r12, r2, r1",
        "lsr r12, #3",
        // Words, and above ten registers the sums and their end.
        "push {{r1}}",
        "2:",
        // Two rows, of which the last may be the same.
        "mov r2, r0",
        "ldr r4, [sp, #40]",
        "ldr r5, [sp, #44]",
        "add r4, #4",
        "cmp r4, r5",
        "it ne",
        "addne r2, r0, r12, lsl #2",
        "ldr r1, [sp]",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "ands lr, r12, #15",
        "beq 4f",
        "3:",
        "BNKF_ROWS",
        "subs lr, #1",
        "bne 3b",
        "cmp r12, #15",
        "bls 5f",
        "4:",
        ".rept 16",
        "BNKF_ROWS",
        ".endr",
        "5:",
        "lsr r8, #8",
        "orr r8, r8, r9, lsl #24",
        "lsr r10, #8",
        "orr r10, r10, r11, lsl #24",
        "ldr r4, [sp, #40]",
        "ldr r5, [sp, #44]",
        "str r8, [r4], #4",
        "cmp r4, r5",
        "beq 6f",
        "str r10, [r4], #4",
        "str r4, [sp, #40]",
        "mov r0, r2",
        "cmp r4, r5",
        "bne 2b",
        "6:",
        "add sp, #4",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_ROWS",
        ".purgem BNKF_ROW",
    )
}

/// For each row of `stride` codes the sum of the squared codes of the groups times their halves, less
/// the lowest eight bits. There is a row for every sum.
#[inline]
pub fn dot_squares(rows: &[u8], stride: usize, groups: &[Group; GROUPS], sums: &mut [i32]) {
    let inside = groups.iter().all(|group| group.at as usize + 4 <= stride);
    if inside && rows.len() == stride * sums.len() && !sums.is_empty() {
        let ends = sums.as_mut_ptr_range();
        // SAFETY: reads four codes of each group in each row, which end before the row does, and all
        // of `groups`; writes all of `sums`, of which there is at least one.
        unsafe {
            sum_squares(rows.as_ptr(), groups, stride, ends.start, ends.end);
        }
    }
}

const _: () = assert!(GROUPS == 8 && super::WIDTH_MAX == 64);

#[unsafe(naked)]
unsafe extern "C" fn sum_squares(
    rows: *const u8,
    groups: *const [Group; GROUPS],
    stride: usize,
    sums: *mut i32,
    sums_end: *mut i32,
) {
    naked_asm!(
        "push {{r4-r11, lr}}",
        "ldr r12, [sp, #36]",
        "mov lr, r1",
        "2:",
        "mov r1, lr",
        "mov r10, #0",
        "mov r11, #0",
        ".rept 8",
        "ldmia r1!, {{r4, r5, r6}}",
        "ldr r7, [r0, r4]",
        "sxtb16 r8, r7",
        "sxtb16 r7, r7, ror #8",
        "smulbb r9, r8, r8",
        "smultt r8, r8, r8",
        "pkhbt r9, r9, r8, lsl #16",
        "smlald r10, r11, r9, r5",
        "smulbb r9, r7, r7",
        "smultt r7, r7, r7",
        "pkhbt r9, r9, r7, lsl #16",
        "smlald r10, r11, r9, r6",
        ".endr",
        "lsr r10, #8",
        "orr r10, r10, r11, lsl #24",
        "str r10, [r3], #4",
        "add r0, r2",
        "cmp r3, r12",
        "bne 2b",
        "pop {{r4-r11, pc}}",
    )
}
