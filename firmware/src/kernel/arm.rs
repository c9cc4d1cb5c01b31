//! Four lanes at once on the microcontroller: the activations of four passes come by LDM, and SMLAD
//! does two products.

use core::arch::naked_asm;
use core::mem::MaybeUninit;

#[cfg(arm_vfp)]
use crate::activation::{ENTRIES, LIMIT, STEPS_PER_UNIT};

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

/// Quantises whole groups of four inputs, `[input][lane]`, as [`super::quantise`] does.
#[cfg(arm_vfp)]
#[inline]
pub fn quantise(activations: &[f32], inverse: &[f32], values: &mut [u32], squares: &mut [u32]) {
    let groups = (activations.len() / 16).min(values.len().min(squares.len()) / 8);
    if groups > 0 && inverse.len() == 4 {
        // SAFETY: reads four words of `inverse` and `groups` times sixteen of `activations`;
        // writes `groups` times eight of `values` and `squares`.
        unsafe {
            quantise_groups(
                activations.as_ptr(),
                groups,
                values.as_mut_ptr(),
                squares.as_mut_ptr(),
                inverse.as_ptr(),
            );
        }
    }
}

#[cfg(arm_vfp)]
#[unsafe(naked)]
unsafe extern "C" fn quantise_groups(
    activations: *const f32,
    groups: usize,
    values: *mut u32,
    squares: *mut u32,
    inverse: *const f32,
) {
    naked_asm!(
        ".fpu fpv4-sp-d16",
        // S0-S3 inverse, S4 rounder, S5 step of the squares, S8-S23 sixteen activations.
        // One activation: its value in place, its square in `square`.
        ".macro BNKF_ROUND value, inverse, square",
        "vmul.f32 \\value, \\value, \\inverse",
        "vmul.f32 \\square, \\value, \\value",
        "vmul.f32 \\square, \\square, s5",
        "vadd.f32 \\value, \\value, s4",
        "vadd.f32 \\square, \\square, s4",
        ".endm",
        // Two lots of four lanes as the low and the high halves of four words.
        ".macro BNKF_HALVES to, l0, l1, l2, l3, h0, h1, h2, h3",
        "vmov r4, r5, \\l0, \\l1",
        "vmov r6, r7, \\l2, \\l3",
        "vmov r8, r9, \\h0, \\h1",
        "vmov r10, r11, \\h2, \\h3",
        "pkhbt r4, r4, r8, lsl #16",
        "pkhbt r5, r5, r9, lsl #16",
        "pkhbt r6, r6, r10, lsl #16",
        "pkhbt r7, r7, r11, lsl #16",
        "stmia \\to!, {{r4-r7}}",
        ".endm",
        "push {{r4-r11, lr}}",
        "vpush {{d8-d15}}",
        // Above the nine registers and the eight double words.
        "ldr r12, [sp, #100]",
        "vldmia r12, {{s0-s3}}",
        "movw r12, #{rounder_low}",
        "movt r12, #{rounder_high}",
        "vmov s4, r12",
        "movw r12, #{step_low}",
        "movt r12, #{step_high}",
        "vmov s5, r12",
        "2:",
        "vldmia r0!, {{s8-s23}}",
        "BNKF_ROUND s8, s0, s24",
        "BNKF_ROUND s9, s1, s25",
        "BNKF_ROUND s10, s2, s26",
        "BNKF_ROUND s11, s3, s27",
        "BNKF_ROUND s16, s0, s28",
        "BNKF_ROUND s17, s1, s29",
        "BNKF_ROUND s18, s2, s30",
        "BNKF_ROUND s19, s3, s31",
        "BNKF_HALVES r2, s8, s9, s10, s11, s16, s17, s18, s19",
        "BNKF_HALVES r3, s24, s25, s26, s27, s28, s29, s30, s31",
        "BNKF_ROUND s12, s0, s24",
        "BNKF_ROUND s13, s1, s25",
        "BNKF_ROUND s14, s2, s26",
        "BNKF_ROUND s15, s3, s27",
        "BNKF_ROUND s20, s0, s28",
        "BNKF_ROUND s21, s1, s29",
        "BNKF_ROUND s22, s2, s30",
        "BNKF_ROUND s23, s3, s31",
        "BNKF_HALVES r2, s12, s13, s14, s15, s20, s21, s22, s23",
        "BNKF_HALVES r3, s24, s25, s26, s27, s28, s29, s30, s31",
        "subs r1, #1",
        "bne 2b",
        "vpop {{d8-d15}}",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_ROUND",
        ".purgem BNKF_HALVES",
        rounder_low = const super::ROUNDER.to_bits() & 0xFFFF,
        rounder_high = const super::ROUNDER.to_bits() >> 16,
        step_low = const super::SQUARE_STEP.to_bits() & 0xFFFF,
        step_high = const super::SQUARE_STEP.to_bits() >> 16,
    )
}

/// Four floats, which the calling convention passes in S0 to S3.
#[cfg(arm_vfp)]
#[repr(C)]
struct Four([f32; 4]);

/// Square roots, correctly rounded.
#[cfg(arm_vfp)]
#[inline]
pub fn square_roots(x: [f32; 4]) -> [f32; 4] {
    // SAFETY: reads and writes argument registers only; the unit is present by cfg.
    unsafe { square_roots_of(Four(x)).0 }
}

#[cfg(arm_vfp)]
#[unsafe(naked)]
unsafe extern "C" fn square_roots_of(x: Four) -> Four {
    naked_asm!(
        ".fpu fpv4-sp-d16",
        "vsqrt.f32 s0, s0",
        "vsqrt.f32 s1, s1",
        "vsqrt.f32 s2, s2",
        "vsqrt.f32 s3, s3",
        "bx lr",
    )
}

/// GELU from its table, as [`gelu`](crate::activation::gelu) interpolates it.
#[cfg(arm_vfp)]
#[inline]
pub fn gelus(x: [f32; 4], table: &[[f32; 2]; ENTRIES]) -> [f32; 4] {
    // SAFETY: below a magnitude of 5 the index is at most 640, and the table has 641 entries.
    unsafe { gelus_of(Four(x), table).0 }
}

#[cfg(arm_vfp)]
const _: () = assert!(LIMIT == 5 && STEPS_PER_UNIT == 64 && ENTRIES == 641);

#[cfg(arm_vfp)]
#[unsafe(naked)]
unsafe extern "C" fn gelus_of(x: Four, table: &[[f32; 2]; ENTRIES]) -> Four {
    naked_asm!(
        ".fpu fpv4-sp-d16",
        // r1 twice the bits of the limit, S4 the limit, S5 steps per unit.
        ".macro BNKF_WITHIN x, beyond, done",
        "vmov r2, \\x",
        "cmp r1, r2, lsl #1",
        "bls \\beyond\\()f",
        "vadd.f32 s6, \\x, s4",
        "vmul.f32 s6, s6, s5",
        "vcvt.u32.f32 s7, s6",
        "vmov r2, s7",
        "vcvt.f32.u32 s7, s7",
        "add r2, r0, r2, lsl #3",
        "vldr \\x, [r2]",
        "vsub.f32 s6, s6, s7",
        "vldr s7, [r2, #4]",
        "vmla.f32 \\x, s6, s7",
        "\\done:",
        ".endm",
        // Zero far below, as it is far above, and so is what is no number.
        ".macro BNKF_BEYOND x, beyond, done",
        "\\beyond:",
        "vcmp.f32 \\x, #0",
        "mov r2, #0",
        "vmrs APSR_nzcv, fpscr",
        "it mi",
        "vmovmi \\x, r2",
        "b \\done\\()b",
        ".endm",
        "vmov.f32 s4, #5.0",
        "movw r1, #0",
        "movt r1, #0x8140",
        "mov r2, #0x42800000",
        "vmov s5, r2",
        "BNKF_WITHIN s0, 20, 30",
        "BNKF_WITHIN s1, 21, 31",
        "BNKF_WITHIN s2, 22, 32",
        "BNKF_WITHIN s3, 23, 33",
        "bx lr",
        "BNKF_BEYOND s0, 20, 30",
        "BNKF_BEYOND s1, 21, 31",
        "BNKF_BEYOND s2, 22, 32",
        "BNKF_BEYOND s3, 23, 33",
        ".purgem BNKF_WITHIN",
        ".purgem BNKF_BEYOND",
    )
}
