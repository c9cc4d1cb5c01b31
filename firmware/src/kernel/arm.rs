//! Four lanes at once on the microcontroller: the activations of four passes come by LDM, and SMLAD
//! does two products.

use core::arch::naked_asm;

/// Sums of int8 codes times the halves of `words`, two words of four lanes for every group of
/// four codes.
#[inline]
pub fn dot_means(row: &[u8], words: &[u32]) -> [i32; 4] {
    let groups = (row.len() / 4).min(words.len() / 8);
    let mut sums = [0; 4];
    if groups > 0 {
        // SAFETY: reads `groups` times four bytes of `row` and eight words of `words`, which
        // both have, and writes the four words of `sums`.
        unsafe { sum_means(row.as_ptr(), words.as_ptr(), groups, &mut sums) }
    }
    sums
}

/// Sums of decoded variances times the halves of `words`, laid out as in [`dot_means`].
#[inline]
pub fn dot_variances(row: &[u8], words: &[u32]) -> [i32; 4] {
    let groups = (row.len() / 4).min(words.len() / 8);
    let mut sums = [0; 4];
    if groups > 0 {
        let table = super::VARIANCES.as_ptr();
        // SAFETY: as above; every byte is an index into the 256 entries of the table.
        unsafe { sum_variances(row.as_ptr(), words.as_ptr(), groups, &mut sums, table) }
    }
    sums
}

#[unsafe(naked)]
unsafe extern "C" fn sum_means(
    row: *const u8,
    words: *const u32,
    groups: usize,
    sums: &mut [i32; 4],
) {
    naked_asm!(
        "push {{r3-r11, lr}}",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "2:",
        "ldr r12, [r0], #4",
        "sxtb16 lr, r12",
        "sxtb16 r12, r12, ror #8",
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
        "subs r2, #1",
        "bne 2b",
        "stmia r3, {{r8-r11}}",
        "pop {{r3-r11, pc}}",
    )
}

#[unsafe(naked)]
unsafe extern "C" fn sum_variances(
    row: *const u8,
    words: *const u32,
    groups: usize,
    sums: &mut [i32; 4],
    table: *const u16,
) {
    naked_asm!(
        "push {{r3-r11, lr}}",
        // The fifth argument lies above the ten registers.
        "ldr r3, [sp, #40]",
        "mov r8, #0",
        "mov r9, #0",
        "mov r10, #0",
        "mov r11, #0",
        "2:",
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
        "subs r2, #1",
        "bne 2b",
        "pop {{r3}}",
        "stmia r3, {{r8-r11}}",
        "pop {{r4-r11, pc}}",
    )
}
