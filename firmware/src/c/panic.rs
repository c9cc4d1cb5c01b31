//! A static library needs a panic handler, and nothing here panics: the handler calls a function that nobody
//! defines, so a program links only if no path to it is left.
//!
//! That needs the profile `image`: without link-time optimisation the compiler does not see it, and the
//! program has to define the function.
#![allow(unsafe_code)]

// SAFETY: defined by nobody, or by a program that takes nothing and never returns from it.
unsafe extern "C" {
    fn bnkf_something_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: see above.
    unsafe { bnkf_something_can_panic() }
}
