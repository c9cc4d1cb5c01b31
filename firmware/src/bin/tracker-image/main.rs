//! The Cortex-M4F image: the tracker behind a serial port, its blob in flash.
//!
//! The host sends requests as in `bnkf::protocol`; each is answered by one reply. The image
//! announces itself with `Ready` (or `Refused(Blob)`) when it has booted. Nothing is allocated, no
//! interrupt is enabled, and the port is only polled while the tracker rests: what a step costs
//! does not depend on what the line carries.
//!
//! `host-sim image` builds and runs it. By hand, with the blob of `BNKF_BLOB` (default:
//! `models/recursive.bnkf`) and the memory map in `memory.x`:
//!
//! ```text
//! cargo build -p bnkf --bin tracker-image --features image --profile image --target thumbv7em-none-eabihf
//! ```
//!
//! `image` logs and exits through semihosting, for QEMU or a debugger; `image-board` logs through
//! RTT and resets after a fault. What was proven, was proven in QEMU: no board has run it yet.
#![no_std]
#![no_main]

mod board;
mod fault;
mod session;

// For its critical sections, which the logger enters.
use cortex_m as _;
#[cfg(feature = "image-board")]
use defmt_rtt as _;
#[cfg(not(feature = "image-board"))]
use defmt_semihosting as _;

use bnkf::protocol::{FrameReader, RefusalCode, Reply, encode};
use bnkf::{Track, Workspace};
use cortex_m_rt::entry;

use board::Board;
use session::Session;

/// Polls of a silent line, minutes of them, after which an emulator's image takes its host for gone.
const IDLE_POLLS_MAX: u32 = 1 << 25;

#[entry]
fn main() -> ! {
    // The entry's own: it hands them out as `&'static mut`, once.
    static mut WORKSPACE: Workspace = Workspace::new();
    static mut TRACK: Track = Track::idle();
    static mut READER: FrameReader = FrameReader::new();

    let mut board = Board::start();
    let mut session = Session::new(WORKSPACE, TRACK);
    send(&mut board, &session.greeting());
    let mut idle_polls = 0u32;
    loop {
        board.feed_watchdog();
        let Some(byte) = board.read_byte() else {
            idle_polls = idle_polls.saturating_add(1);
            if idle_polls == IDLE_POLLS_MAX {
                fault::line_is_idle();
            }
            continue;
        };
        idle_polls = 0;
        let reply = match READER.push(byte) {
            None => continue,
            Some(Ok(request)) => session.answer(&request, &board),
            Some(Err(error)) => {
                defmt::warn!("frame refused: {=u8}", error as u8);
                Reply::Refused(RefusalCode::Frame)
            }
        };
        send(&mut board, &reply);
    }
}

fn send(board: &mut Board, reply: &Reply) {
    match encode(reply) {
        Ok(frame) => board.write(&frame),
        // The protocol's tests encode the widest replies, so this is a broken build: stop loudly.
        Err(_) => panic!("reply does not fit a frame"),
    }
}
