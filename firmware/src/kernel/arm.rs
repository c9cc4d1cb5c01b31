//! Four lanes at once on the microcontroller: the activations of four passes come by LDM, and SMLAD
//! does two products.

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
