//! Runs the same measurements on any core and prints one number for all answers; `tests/cores.rs` compares it
//! with the host's, in QEMU. Needs no board: QEMU puts the program where `build.rs` says, and the
//! number leaves through semihosting.
#![no_std]
#![no_main]
#![allow(unsafe_code)]

mod flight;
mod hash;

use core::arch::global_asm;
use core::panic::PanicInfo;

// The initial stack and the first instruction, which is all that a Cortex-M reads.
#[cfg(target_arch = "arm")]
global_asm!(
    ".section .start, \"ax\"",
    ".word stack_top",
    ".word _start",
    ".text",
    ".thumb_func",
    ".global _start",
    "_start:",
    // The floating-point unit is off after a reset.
    "ldr r0, =0xE000ED88",
    "ldr r1, ={unit}",
    "str r1, [r0]",
    "dsb",
    "isb",
    "bl main",
    unit = const if cfg!(target_abi = "eabihf") { 0xF << 20 } else { 0 },
);

#[cfg(target_arch = "riscv32")]
global_asm!(
    ".section .start, \"ax\"",
    ".global _start",
    "_start:",
    "la sp, stack_top",
    // The floating-point unit is off after a reset; a core without one ignores the bit.
    "li t0, 0x2000",
    "csrs mstatus, t0",
    "call main",
);

// SAFETY: called once, by the lines above; no other object has a symbol of this name.
#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    semihosting::println!("{:016x}", hash::hash());
    semihosting::process::exit(0)
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    semihosting::process::exit(1)
}
