//! What the tracker's calls cost on a real board: cycles of a Cortex-M's own counter (DWT), which QEMU has not.
//!
//! The flight is that of `same-bits`, the model the default one, at the clock that the board starts with. For an
//! STM32F405; another Cortex-M with a counter needs another `memory.x`. No board has run it yet.
//!
//! ```text
//! cargo board -p bnkf --bin bench --features bench
//! ```
#![no_std]
#![no_main]

#[path = "../same-bits/flight.rs"]
mod flight;

use core::sync::atomic::{Ordering, compiler_fence};

use bnkf::{Model, Settings, StepError, Track, Workspace};
use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use defmt_rtt as _;

use flight::{STEPS, is_gap, measurement};

/// On a word boundary, where a step is a little faster.
#[repr(C, align(4))]
struct InFlash<const N: usize>([u8; N]);

static BLOB: InFlash<{ include_bytes!("../../../models/recursive.bnkf").len() }> =
    InFlash(*include_bytes!("../../../models/recursive.bnkf"));

#[entry]
fn main() -> ! {
    // The entry's own: it hands them out as `&'static mut`, once.
    static mut WORKSPACE: Workspace = Workspace::new();
    static mut TRACK: Track = Track::idle();
    if !counting() {
        defmt::error!("this core has no cycle counter");
    } else if run(WORKSPACE, TRACK).is_none() {
        defmt::error!("the model was refused");
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// Starts the counter; whether it counts.
fn counting() -> bool {
    let Some(mut core) = cortex_m::Peripherals::take() else {
        return false;
    };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let before = DWT::cycle_count();
    cortex_m::asm::delay(100);
    DWT::cycle_count() != before
}

fn run(workspace: &mut Workspace, track: &mut Track) -> Option<()> {
    let model = Model::new(core::hint::black_box(BLOB.0.as_slice())).ok()?;
    track.begin(&model, Settings::of(model.blob())).ok()?;
    let [mut steps, mut coasts, mut forecasts, mut likelihoods] = [Cost::NONE; 4];
    for step in 0..STEPS {
        let time_us = 100_000 * step;
        if is_gap(step) {
            coasts.of(|| track.coast(&model, workspace, time_us));
        } else {
            let seen = measurement(time_us, step);
            likelihoods.of(|| track.likelihood(&model, workspace, &seen));
            steps.of(|| track.step(&model, workspace, &seen));
        }
        let ahead_us = [time_us + 500_000, time_us + 1_000_000, time_us + 2_000_000];
        forecasts.of(|| track.forecasts(&model, workspace, &ahead_us));
    }
    steps.say("step");
    coasts.say("coast");
    forecasts.say("three forecasts");
    likelihoods.say("likelihood");
    Some(())
}

/// Cycles of one kind of call.
#[derive(Clone, Copy)]
struct Cost {
    least: u32,
    most: u32,
    sum: u64,
    calls: u32,
}

impl Cost {
    const NONE: Self = Self {
        least: u32::MAX,
        most: 0,
        sum: 0,
        calls: 0,
    };

    /// Counts a call, unless it is refused.
    fn of<T>(&mut self, call: impl FnOnce() -> Result<T, StepError>) {
        let before = DWT::cycle_count();
        // The fences keep the compiler from moving the call's work out of the measured stretch.
        compiler_fence(Ordering::SeqCst);
        let answer = call();
        compiler_fence(Ordering::SeqCst);
        let cycles = DWT::cycle_count().wrapping_sub(before);
        if answer.is_ok() {
            self.least = self.least.min(cycles);
            self.most = self.most.max(cycles);
            self.sum += u64::from(cycles);
            self.calls += 1;
        }
    }

    fn say(&self, call: &str) {
        let mean = self.sum / u64::from(self.calls.max(1));
        defmt::info!(
            "{=str}: {=u32} calls, cycles min {=u32}, mean {=u64}, max {=u32}",
            call,
            self.calls,
            self.least,
            mean,
            self.most
        );
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    defmt::error!("panic");
    cortex_m::asm::udf()
}
