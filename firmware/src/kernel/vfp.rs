//! Four lanes, inputs or rows at once in the microcontroller's floating-point unit, whose registers the compiler
//! lends to no inline assembly on this target. Every operation rounds as the host's does.

use core::arch::naked_asm;

use super::packed::{ROUNDER, SQUARE_STEP};
use crate::kernel::activation::gelu::{ENTRIES, LIMIT, STEPS_PER_UNIT};

/// Quantises whole groups of four inputs, `[input][lane]`, as [`Packed::pack`](super::Packed::pack)
/// does.
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

/// As [`quantise`], without the squares.
#[inline]
pub fn quantise_values(activations: &[f32], inverse: &[f32], values: &mut [u32]) {
    let groups = (activations.len() / 16).min(values.len() / 8);
    if groups > 0 && inverse.len() == 4 {
        // SAFETY: reads four words of `inverse` and `groups` times sixteen of `activations`;
        // writes `groups` times eight of `values`.
        unsafe {
            quantise_value_groups(
                activations.as_ptr(),
                groups,
                values.as_mut_ptr(),
                inverse.as_ptr(),
            );
        }
    }
}

#[unsafe(naked)]
unsafe extern "C" fn quantise_value_groups(
    activations: *const f32,
    groups: usize,
    values: *mut u32,
    inverse: *const f32,
) {
    naked_asm!(
        ".fpu fpv4-sp-d16",
        // S0-S3 inverse, S4 rounder, S8-S23 sixteen activations: two inputs of four lanes in S8-S15 are
        // the low halves of two times four words, S16-S23 the high ones.
        ".macro BNKF_ROUND value, inverse",
        "vmul.f32 \\value, \\value, \\inverse",
        "vadd.f32 \\value, \\value, s4",
        ".endm",
        ".macro BNKF_HALVES l0, l1, l2, l3, h0, h1, h2, h3",
        "vmov r4, r5, \\l0, \\l1",
        "vmov r6, r7, \\l2, \\l3",
        "vmov r8, r9, \\h0, \\h1",
        "vmov r10, r11, \\h2, \\h3",
        "pkhbt r4, r4, r8, lsl #16",
        "pkhbt r5, r5, r9, lsl #16",
        "pkhbt r6, r6, r10, lsl #16",
        "pkhbt r7, r7, r11, lsl #16",
        "stmia r2!, {{r4-r7}}",
        ".endm",
        "push {{r4-r11, lr}}",
        "vpush {{d8-d11}}",
        "vldmia r3, {{s0-s3}}",
        "movw r12, #{rounder_low}",
        "movt r12, #{rounder_high}",
        "vmov s4, r12",
        "2:",
        "vldmia r0!, {{s8-s23}}",
        ".irp input, 8, 12, 16, 20",
        "BNKF_ROUND s\\input, s0",
        ".endr",
        ".irp input, 9, 13, 17, 21",
        "BNKF_ROUND s\\input, s1",
        ".endr",
        ".irp input, 10, 14, 18, 22",
        "BNKF_ROUND s\\input, s2",
        ".endr",
        ".irp input, 11, 15, 19, 23",
        "BNKF_ROUND s\\input, s3",
        ".endr",
        "BNKF_HALVES s8, s9, s10, s11, s16, s17, s18, s19",
        "BNKF_HALVES s12, s13, s14, s15, s20, s21, s22, s23",
        "subs r1, #1",
        "bne 2b",
        "vpop {{d8-d11}}",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_ROUND",
        ".purgem BNKF_HALVES",
        rounder_low = const ROUNDER.to_bits() & 0xFFFF,
        rounder_high = const ROUNDER.to_bits() >> 16,
    )
}

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
        rounder_low = const ROUNDER.to_bits() & 0xFFFF,
        rounder_high = const ROUNDER.to_bits() >> 16,
        step_low = const SQUARE_STEP.to_bits() & 0xFFFF,
        step_high = const SQUARE_STEP.to_bits() >> 16,
    )
}

/// Quantises whole groups of four inputs of one pass, as [`Vector::pack`](super::Vector::pack) does.
#[inline]
pub fn quantise_vector(activations: &[[f32; 4]], inverse: f32, pairs: &mut [[u32; 2]]) {
    let groups = activations.len().min(pairs.len());
    if groups > 0 {
        // SAFETY: reads `groups` times four words of `activations`, writes as many times two of
        // `pairs`.
        unsafe {
            quantise_vector_groups(activations.as_ptr(), groups, pairs.as_mut_ptr(), inverse);
        }
    }
}

#[unsafe(naked)]
unsafe extern "C" fn quantise_vector_groups(
    activations: *const [f32; 4],
    groups: usize,
    pairs: *mut [u32; 2],
    inverse: f32,
) {
    naked_asm!(
        ".fpu fpv4-sp-d16",
        "push {{r4, lr}}",
        "movw r3, #{rounder_low}",
        "movt r3, #{rounder_high}",
        "vmov s1, r3",
        "2:",
        "vldmia r0!, {{s4-s7}}",
        "vmul.f32 s4, s4, s0",
        "vmul.f32 s5, s5, s0",
        "vmul.f32 s6, s6, s0",
        "vmul.f32 s7, s7, s0",
        "vadd.f32 s4, s4, s1",
        "vadd.f32 s5, s5, s1",
        "vadd.f32 s6, s6, s1",
        "vadd.f32 s7, s7, s1",
        "vmov r3, r4, s4, s5",
        "vmov r12, lr, s6, s7",
        "pkhbt r3, r3, r12, lsl #16",
        "pkhbt r4, r4, lr, lsl #16",
        "stmia r2!, {{r3, r4}}",
        "subs r1, #1",
        "bne 2b",
        "pop {{r4, pc}}",
        rounder_low = const ROUNDER.to_bits() & 0xFFFF,
        rounder_high = const ROUNDER.to_bits() >> 16,
    )
}

/// `sum * scale * scales + biases` for four rows at a time, as
/// [`Vector::dot_rows`](super::Vector::dot_rows) does it.
#[inline]
pub fn scale_rows(
    sums: &[[i32; 4]],
    scale: f32,
    scales: &[[[u8; 4]; 4]],
    biases: &[[[u8; 4]; 4]],
    means: &mut [[f32; 4]],
) {
    let fours = sums.len().min(scales.len());
    let fours = fours.min(biases.len()).min(means.len());
    if fours > 0 {
        // SAFETY: reads `fours` times four words of `sums`, and of `scales` and `biases` by LDR, which
        // takes any alignment; writes as many of `means`.
        unsafe {
            scale_fours(
                sums.as_ptr(),
                scales.as_ptr(),
                biases.as_ptr(),
                means.as_mut_ptr(),
                fours,
                scale,
            );
        }
    }
}

#[unsafe(naked)]
unsafe extern "C" fn scale_fours(
    sums: *const [i32; 4],
    scales: *const [[u8; 4]; 4],
    biases: *const [[u8; 4]; 4],
    means: *mut [f32; 4],
    fours: usize,
    scale: f32,
) {
    naked_asm!(
        ".fpu fpv4-sp-d16",
        // Four floats from any address to S registers.
        ".macro BNKF_FLOATS from, f0, f1, f2, f3",
        "ldr r4, [\\from], #4",
        "ldr r5, [\\from], #4",
        "ldr r6, [\\from], #4",
        "ldr r7, [\\from], #4",
        "vmov \\f0, \\f1, r4, r5",
        "vmov \\f2, \\f3, r6, r7",
        ".endm",
        "push {{r4-r7, lr}}",
        // Above the five registers.
        "ldr r12, [sp, #20]",
        "2:",
        "vldmia r0!, {{s4-s7}}",
        "BNKF_FLOATS r1, s8, s9, s10, s11",
        "BNKF_FLOATS r2, s12, s13, s14, s15",
        "vcvt.f32.s32 s4, s4",
        "vcvt.f32.s32 s5, s5",
        "vcvt.f32.s32 s6, s6",
        "vcvt.f32.s32 s7, s7",
        "vmul.f32 s4, s4, s0",
        "vmul.f32 s5, s5, s0",
        "vmul.f32 s6, s6, s0",
        "vmul.f32 s7, s7, s0",
        "vmla.f32 s12, s4, s8",
        "vmla.f32 s13, s5, s9",
        "vmla.f32 s14, s6, s10",
        "vmla.f32 s15, s7, s11",
        "vstmia r3!, {{s12-s15}}",
        "subs r12, #1",
        "bne 2b",
        "pop {{r4-r7, pc}}",
        ".purgem BNKF_FLOATS",
    )
}

/// Four floats, which the calling convention passes in S0 to S3.
#[repr(C)]
struct Four([f32; 4]);

/// Square roots, correctly rounded.
#[inline]
pub fn square_roots(x: [f32; 4]) -> [f32; 4] {
    // SAFETY: reads and writes argument registers only; the unit is present by cfg.
    unsafe { square_roots_of(Four(x)).0 }
}

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

/// GELU from its table, as [`gelu`](crate::kernel::activation::gelu::gelu) interpolates it.
#[inline]
pub fn gelus(x: [f32; 4], table: &[[f32; 2]; ENTRIES]) -> [f32; 4] {
    // SAFETY: below a magnitude of 5 the index is at most 640, and the table has 641 entries.
    unsafe { gelus_of(Four(x), table).0 }
}

const _: () = assert!(LIMIT == 5 && STEPS_PER_UNIT == 64 && ENTRIES == 641);

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
