//! Sums of second moments on the microcontroller: two rows at a time, UMLAL adds up in 64 bits.

use core::arch::naked_asm;

/// For each row of codes, four for each of `words`, the sum of what `table` makes of the codes times
/// their words. There is a row for every sum.
#[inline]
pub fn dot_variances(rows: &[u8], words: &[[u32; 4]], table: &[u32; 256], sums: &mut [u64]) {
    if rows.len() == 4 * words.len() * sums.len() && !rows.is_empty() {
        let (words, ends) = (words.as_ptr_range(), sums.as_mut_ptr_range());
        let rows = rows.as_ptr();
        // SAFETY: reads four codes for each of `words` and each sum, which is all of `rows`, and all of
        // `words`; every code is an index into the 256 entries of the table; writes all of `sums`.
        // There are some of all.
        unsafe { sum_variances(rows, words.start, words.end, table, ends.start, ends.end) };
    }
}

/// For each row of int8 codes, four for each of `words`, the sum of their squares times their words.
/// There is a row for every sum.
#[inline]
pub fn dot_squares(rows: &[u8], words: &[[u32; 4]], sums: &mut [u64]) {
    if rows.len() == 4 * words.len() * sums.len() && !rows.is_empty() {
        let (words, ends) = (words.as_ptr_range(), sums.as_mut_ptr_range());
        let (rows, none) = (rows.as_ptr(), core::ptr::null());
        // SAFETY: as above, but no table is read.
        unsafe { sum_squares(rows, words.start, words.end, none, ends.start, ends.end) };
    }
}

const _: () = assert!(crate::blob::field::WIDTH_MAX == 64);

/// A loop over pairs of rows. Its body adds four products of the row at its first operand to the two
/// words of the sum; it has the four words in r4-r7, and r12 and lr for itself.
macro_rules! rows {
    ($name:ident, [$($body:literal),*]) => {
        #[unsafe(naked)]
        unsafe extern "C" fn $name(
            rows: *const u8,
            words: *const [u32; 4],
            words_end: *const [u32; 4],
            table: *const [u32; 256],
            sums: *mut u64,
            sums_end: *mut u64,
        ) {
            naked_asm!(
                // r0 and r2 two rows, r1 words, r3 table, r8-r9 and r10-r11 their sums.
                ".macro BNKF_ROW row, low, high",
                $($body,)*
                ".endm",
                ".macro BNKF_ROWS",
                "ldmia r1!, {{r4-r7}}",
                "BNKF_ROW r0, r8, r9",
                "BNKF_ROW r2, r10, r11",
                ".endm",
                // The words and their end lie lowest on the stack, above nine registers the sums and
                // their end.
                "push {{r4-r11, lr}}",
                "push {{r1, r2}}",
                "2:",
                "ldrd r1, r12, [sp]",
                "ldrd r4, r5, [sp, #44]",
                "sub r12, r1",
                // The second row, or the first again if there is no other.
                "add r4, #8",
                "mov r2, r0",
                "cmp r4, r5",
                "it ne",
                "addne r2, r0, r12, lsr #2",
                "mov r8, #0",
                "mov r9, #0",
                "mov r10, #0",
                "mov r11, #0",
                "cmp r12, #256",
                "beq 4f",
                "3:",
                "BNKF_ROWS",
                "ldr r12, [sp, #4]",
                "cmp r1, r12",
                "bne 3b",
                "b 5f",
                "4:",
                ".rept 8",
                "BNKF_ROWS",
                ".endr",
                "ldr r12, [sp, #4]",
                "cmp r1, r12",
                "bne 4b",
                "5:",
                "ldrd r4, r5, [sp, #44]",
                "strd r8, r9, [r4], #8",
                "cmp r4, r5",
                "beq 6f",
                "strd r10, r11, [r4], #8",
                "str r4, [sp, #44]",
                "mov r0, r2",
                "cmp r4, r5",
                "bne 2b",
                "6:",
                "add sp, #8",
                "pop {{r4-r11, pc}}",
                ".purgem BNKF_ROWS",
                ".purgem BNKF_ROW",
            )
        }
    };
}

rows!(
    sum_variances,
    [
        "ldrb r12, [\\row], #4",
        "ldrb lr, [\\row, #-3]",
        "ldr r12, [r3, r12, lsl #2]",
        "ldr lr, [r3, lr, lsl #2]",
        "umlal \\low, \\high, r12, r4",
        "umlal \\low, \\high, lr, r5",
        "ldrb r12, [\\row, #-2]",
        "ldrb lr, [\\row, #-1]",
        "ldr r12, [r3, r12, lsl #2]",
        "ldr lr, [r3, lr, lsl #2]",
        "umlal \\low, \\high, r12, r6",
        "umlal \\low, \\high, lr, r7"
    ]
);

rows!(
    sum_squares,
    [
        "ldr r3, [\\row], #4",
        "sxtb16 r12, r3",
        "sxtb16 r3, r3, ror #8",
        "smulbb lr, r12, r12",
        "umlal \\low, \\high, lr, r4",
        "smulbb lr, r3, r3",
        "umlal \\low, \\high, lr, r5",
        "smultt lr, r12, r12",
        "umlal \\low, \\high, lr, r6",
        "smultt lr, r3, r3",
        "umlal \\low, \\high, lr, r7"
    ]
);
