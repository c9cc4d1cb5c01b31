//! Measurements come in an interrupt, which does nothing but put them into a queue; the loop takes them out and
//! tracks, which may take longer than the time between two of them.
//!
//! On a Cortex-M the interrupt is the SysTick timer; on a host, where the same file runs, it is a thread:
//!
//! ```text
//! cargo run -p bnkf --example interrupt
//! cargo run -p bnkf --example interrupt --profile image --target thumbv7em-none-eabihf
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

use core::cell::RefCell;

use bnkf::{Estimate, Measurement, Model, Sensed, Sensor, Settings, StepError, Track, Workspace};
use critical_section::Mutex;
use heapless::Deque;

static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");

/// Measurements that may wait: more than come while one step runs, and than an emulator on a busy host lets wait.
const WAITING: usize = 32;
/// How many this program takes.
const PLOTS: u64 = 20;

static QUEUE: Mutex<RefCell<Queue>> = Mutex::new(RefCell::new(Queue {
    waiting: Deque::new(),
    lost: 0,
}));

struct Queue {
    waiting: Deque<Measurement, WAITING>,
    /// Measurements that came when the queue was full.
    lost: u32,
}

/// The interrupt's part: a copy, and no longer.
fn received(plot: Measurement) {
    critical_section::with(|cs| {
        let mut queue = QUEUE.borrow_ref_mut(cs);
        if queue.waiting.push_back(plot).is_err() {
            queue.lost = queue.lost.saturating_add(1);
        }
    });
}

/// The loop's part: the interrupt waits only while one measurement is copied, not while a step runs.
fn next_step(
    model: &Model<'_>,
    workspace: &mut Workspace,
    track: &mut Track,
) -> Option<Result<Estimate, StepError>> {
    let plot = critical_section::with(|cs| QUEUE.borrow_ref_mut(cs).waiting.pop_front())?;
    Some(track.step(model, workspace, &plot))
}

/// What the radar says when its interrupt comes for the `number`-th time.
fn radar(number: u64) -> Measurement {
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    Measurement {
        time_us: 100_000 * number,
        range: sensed(30.0 + 0.2 * number as f32, 0.5),
        elevation: sensed(0.3, 0.01),
        azimuth: sensed(0.4, 0.01),
        range_rate: sensed(2.0, 0.1),
        sensor: Sensor::ORIGIN,
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Model::new(BLOB)?;
    let mut workspace = Workspace::new();
    let mut track = Track::new(&model, Settings::of(model.blob()))?;
    let interrupt = std::thread::spawn(|| {
        for number in 0..PLOTS {
            received(radar(number));
            // Slower than the loop, so that nothing is lost.
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    });
    let mut taken = 0;
    while taken < PLOTS && critical_section::with(|cs| QUEUE.borrow_ref_mut(cs).lost) == 0 {
        if let Some(estimate) = next_step(&model, &mut workspace, &mut track) {
            taken += 1;
            println!("{:?}", estimate?.position_m);
        }
    }
    interrupt.join().map_err(|_| "the thread")?;
    Ok(())
}

#[cfg(target_os = "none")]
mod board {
    use core::sync::atomic::{AtomicU32, Ordering};

    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m_rt::{entry, exception};
    use semihosting::println;

    use super::*;

    #[entry]
    fn main() -> ! {
        // The entry's own: it hands them out as `&'static mut`, once.
        static mut WORKSPACE: Workspace = Workspace::new();
        static mut TRACK: Track = Track::idle();
        semihosting::process::exit(i32::from(run(WORKSPACE, TRACK).is_none()))
    }

    fn run(workspace: &mut Workspace, track: &mut Track) -> Option<()> {
        let model = Model::new(BLOB).ok()?;
        track.begin(&model, Settings::of(model.blob())).ok()?;
        let mut timer = cortex_m::Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        // A tenth of a second at 16 MHz.
        timer.set_reload(1_600_000 - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
        let mut taken = 0;
        while taken < PLOTS {
            match next_step(&model, workspace, track) {
                Some(estimate) => {
                    taken += 1;
                    println!("{:?}", estimate.ok()?.position_m);
                }
                None => cortex_m::asm::wfi(),
            }
        }
        Some(())
    }

    #[exception]
    fn SysTick() {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = u64::from(NUMBER.fetch_add(1, Ordering::Relaxed));
        received(radar(number));
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        semihosting::process::exit(1)
    }
}

#[test]
fn what_does_not_fit_is_counted_and_the_rest_is_tracked() {
    let model = Model::new(BLOB).expect("a blob");
    let mut workspace = Workspace::new();
    let mut track = Track::new(&model, Settings::of(model.blob())).expect("its own settings");
    for number in 0..34 {
        received(radar(number));
    }
    let mut times_us = Vec::new();
    while let Some(estimate) = next_step(&model, &mut workspace, &mut track) {
        times_us.push(estimate.expect("a step").time_us);
    }
    let expected: Vec<u64> = (0..32).map(|number| 100_000 * number).collect();
    assert_eq!(times_us, expected);
    assert_eq!(
        critical_section::with(|cs| QUEUE.borrow_ref_mut(cs).lost),
        2
    );
}
