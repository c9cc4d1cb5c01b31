//! Columns of a layer times three vectors on the microcontroller: a word of two rows each, SMLAD does
//! two products.

use super::adjoint::{Pair, UNROLLED, VECTORS};
use core::arch::naked_asm;

/// Sums over pairs of rows of the int8 codes of four columns after four times the halves of the three
/// vectors. Says whether there are three, a multiple of [`UNROLLED`] pairs, and the codes.
#[inline]
pub fn sum_columns(codes: &[u8], pairs: &[Pair], sums: &mut [[[i32; VECTORS]; 4]]) -> bool {
    let needed = 4 * sums.len();
    let inside = |pair: &Pair| {
        pair.rows
            .iter()
            .all(|&row| row as usize + needed <= codes.len())
    };
    let whole = pairs.len() % UNROLLED == 0 && !pairs.is_empty() && !sums.is_empty();
    let fits = whole && pairs.iter().all(inside);
    if fits {
        let (pairs, ends) = (pairs.as_ptr_range(), sums.as_mut_ptr_range());
        // SAFETY: reads all of `pairs`, and of each of their rows one word for
        // each of `sums`, which are codes; writes all of `sums`. There are some of both.
        unsafe {
            sum_three(
                pairs.end.cast(),
                pairs.start.cast(),
                ends.end.cast(),
                ends.start.cast(),
                codes.as_ptr(),
            );
        }
    }
    fits
}

const _: () = assert!(UNROLLED == 2 && VECTORS == 3);

#[unsafe(naked)]
unsafe extern "C" fn sum_three(
    pairs_end: *const Pair,
    pairs: *const Pair,
    sums_end: *mut [[i32; VECTORS]; 4],
    sums: *mut [[i32; VECTORS]; 4],
    codes: *const u8,
) {
    naked_asm!(
        // r0 codes of the columns in the first row, lr pairs, r4-r6 and r7-r9 the sums of two columns,
        // r10-r12 two rows of the three vectors. The arguments lie lowest on the stack.
        ".macro BNKF_COLUMNS turn, first, second",
        "ldr lr, [sp, #4]",
        "mov r4, #0",
        "mov r5, #0",
        "mov r6, #0",
        "mov r7, #0",
        "mov r8, #0",
        "mov r9, #0",
        "3:",
        ".rept 2",
        "ldmia lr!, {{r2, r3, r10-r12}}",
        "ldr r2, [r0, r2]",
        "ldr r3, [r0, r3]",
        "sxtb16 r2, r2, ror #\\turn",
        "sxtb16 r3, r3, ror #\\turn",
        "pkhbt r1, r2, r3, lsl #16",
        "pkhtb r3, r3, r2, asr #16",
        "smlad r4, r1, r10, r4",
        "smlad r5, r1, r11, r5",
        "smlad r6, r1, r12, r6",
        "smlad r7, r3, r10, r7",
        "smlad r8, r3, r11, r8",
        "smlad r9, r3, r12, r9",
        ".endr",
        "ldr r1, [sp]",
        "cmp lr, r1",
        "bne 3b",
        "ldr r2, [sp, #12]",
        "add r3, r2, #\\first",
        "stmia r3, {{r4-r6}}",
        "add r3, r2, #\\second",
        "stmia r3, {{r7-r9}}",
        ".endm",
        "push {{r4-r11, lr}}",
        "push {{r0-r3}}",
        "ldr r0, [sp, #52]",
        "2:",
        "BNKF_COLUMNS 0, 0, 24",
        "BNKF_COLUMNS 8, 12, 36",
        "ldr r3, [sp, #8]",
        "add r0, #4",
        "add r2, #48",
        "str r2, [sp, #12]",
        "cmp r2, r3",
        "bne 2b",
        "add sp, #16",
        "pop {{r4-r11, pc}}",
        ".purgem BNKF_COLUMNS",
    )
}
