//! Where the image ends when something is wrong: log the cause, then stop.
//!
//! Under semihosting the process exits with a failure code; a board resets.
#![allow(unsafe_code)]

use core::fmt::Write as _;
use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};

/// Room for a panic message, bytes; longer ones are cut.
const MESSAGE_BYTES_MAX: usize = 160;

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    let mut text = heapless::String::<MESSAGE_BYTES_MAX>::new();
    // A message cut short is still worth logging.
    let cut = write!(text, "{info}").is_err();
    defmt::error!("{=str} cut={=bool}", text.as_str(), cut);
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
