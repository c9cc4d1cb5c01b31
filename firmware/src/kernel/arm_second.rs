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
        // r0 codes, r1 words, r3 table, r4 and r5 four activations, r10 and r11 the sum, r12 groups of
        // a row.
        ".macro BNKF_VARIANCES",
        "ldmia r1!, {{r4, r5}}",
        "ldrb r6, [r0], #4",
        "ldrb r7, [r0, #-2]",
        "ldrb r8, [r0, #-3]",
        "ldrb r9, [r0, #-1]",
        "ldrh r6, [r3, r6, lsl #1]",
        "ldrh r7, [r3, r7, lsl #1]",
        "ldrh r8, [r3, r8, lsl #1]",
        "ldrh r9, [r3, r9, lsl #1]",
        "pkhbt r6, r6, r7, lsl #16",
        "pkhbt r8, r8, r9, lsl #16",
        "smlald r10, r11, r6, r4",
        "smlald r10, r11, r8, r5",
        ".endm",
        "push {{r1, r2, r4-r11, lr}}",
        "sub r12, r2, r1",
        "lsr r12, #3",
        // The arguments on the stack lie above eleven registers.
        "ldr lr, [sp, #44]",
        "2:",
        "mov r10, #0",
        "mov r11, #0",
        "ands r2, r12, #7",
        "beq 4f",
        "3:",
        "BNKF_VARIANCES",
        "subs r2, #1",
        "bne 3b",
        "4:",
        "lsrs r2, r12, #3",
        "beq 6f",
        "5:",
        ".rept 8",
        "BNKF_VARIANCES",
        ".endr",
        "subs r2, #1",
        "bne 5b",
        "6:",
        "lsr r10, #8",
        "orr r10, r10, r11, lsl #24",
        "str r10, [lr], #4",
        "ldr r1, [sp]",
        "ldr r4, [sp, #48]",
        "cmp lr, r4",
        "bne 2b",
        "pop {{r1, r2, r4-r11, pc}}",
        ".purgem BNKF_VARIANCES",
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

const _: () = assert!(GROUPS == 10);

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
        ".rept 10",
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
