//! Where the image ends when something is wrong: log the cause, then stop.
//!
//! Under semihosting the process exits with a failure code; a board resets.
#![allow(unsafe_code)]

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    // Where, without what: formatting the message takes 4 KB of flash, and the place tells as much.
    match info.location() {
        Some(place) => defmt::error!("panic at {=str}:{=u32}", place.file(), place.line()),
        None => defmt::error!("panic"),
    }
    stop()
}

// SAFETY: runs on the exception's own frame and touches no state of the interrupted code.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    defmt::error!(
        "hard fault, pc {=u32:#x}, lr {=u32:#x}",
        frame.pc(),
        frame.lr()
    );
    stop()
}

/// Nothing was asked for a long time. A board waits for ever; under an emulator the host was killed
/// and nobody else would end the process.
pub fn line_is_idle() {
    defmt::warn!("the line is idle");
    #[cfg(not(feature = "image-board"))]
    stop()
}

#[cfg(not(feature = "image-board"))]
fn stop() -> ! {
    semihosting::process::exit(1)
}

#[cfg(feature = "image-board")]
fn stop() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}
