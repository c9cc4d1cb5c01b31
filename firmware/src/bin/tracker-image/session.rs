//! One request in, one reply out. Owns the tracker.

use core::sync::atomic::{Ordering, compiler_fence};

use bnkf::blob::{Blob, BlobError};
use bnkf::protocol::{
    self, EstimateFrame, ForecastFrame, InferenceCode, LikelihoodFrame, Ready, RefusalCode, Reply,
    Request, Reset,
};
use bnkf::{Estimate, Measurement, Settings, StepError, Tracker};

use crate::board::Board;

/// The model in flash, on a word boundary so that what a step costs does not depend on the linker.
#[repr(C, align(4))]
struct InFlash<const N: usize>([u8; N]);

static BLOB: InFlash<{ include_bytes!(env!("BNKF_BLOB")).len() }> =
    InFlash(*include_bytes!(env!("BNKF_BLOB")));

/// Room for one tracker.
pub type TrackerSlot = Option<Tracker<'static>>;

/// The blob in flash and the tracker that runs from it.
pub struct Session {
    blob: Result<Blob<'static>, BlobError>,
    tracker: &'static mut TrackerSlot,
}

impl Session {
    /// Checks the blob in flash. The tracker will live in `tracker`.
    pub fn new(tracker: &'static mut TrackerSlot) -> Self {
        // Without this the compiler may run the check on the bytes it sees now and leave it out of
        // the image; it is there for the bytes that flash holds later.
        let bytes = core::hint::black_box(BLOB.0.as_slice());
        Self {
            blob: Blob::parse(bytes),
            tracker,
        }
    }

    /// What the image says when it has booted.
    pub fn greeting(&self) -> Reply {
        match &self.blob {
            Ok(blob) => {
                defmt::info!(
                    "ready: blob {=u32:08x}, {=usize} bytes",
                    blob.checksum(),
                    BLOB.0.len()
                );
                Reply::Ready(Ready {
                    protocol_version: protocol::VERSION,
                    blob_bytes: BLOB.0.len() as u32,
                    blob_crc: blob.checksum(),
                })
            }
            Err(_) => {
                defmt::error!("the blob in flash failed its check");
                Reply::Refused(RefusalCode::Blob)
            }
        }
    }

    /// Carries one request out.
    #[inline(never)]
    pub fn answer(&mut self, request: &Request, board: &Board) -> Reply {
        match request {
            Request::Hello => self.greeting(),
            Request::Reset(reset) => self.reset(*reset),
            Request::Step(frame) => {
                let measurement = Measurement::from(frame);
                self.timed(board, |tracker| tracker.step(&measurement), estimated)
            }
            Request::Coast { time_us } => {
                self.timed(board, |tracker| tracker.coast(*time_us), estimated)
            }
            Request::Budget => Reply::Budget(board.budget()),
            Request::Forecast { times_us } => self.timed(
                board,
                |tracker| tracker.forecasts(times_us),
                |forecasts, ticks| Reply::Forecast(ForecastFrame::new(forecasts, ticks)),
            ),
            Request::Likelihood(frame) => {
                let measurement = Measurement::from(frame);
                self.timed(
                    board,
                    |tracker| tracker.likelihood(&measurement),
                    |likelihood, ticks| Reply::Likelihood(LikelihoodFrame::new(likelihood, ticks)),
                )
            }
        }
    }

    // A frame of its own: the new tracker's way over the stack is none of a step's business.
    #[inline(never)]
    fn reset(&mut self, reset: Reset) -> Reply {
        let Ok(blob) = self.blob else {
            return Reply::Refused(RefusalCode::Blob);
        };
        let settings = match Settings::try_from(reset) {
            Ok(settings) => settings,
            Err(error) => return Reply::Refused(error.into()),
        };
        match Tracker::new(blob, settings) {
            Ok(tracker) => {
                *self.tracker = Some(tracker);
                match reset.inference {
                    InferenceCode::Mean => defmt::info!("new track: mean weights"),
                    InferenceCode::Passes(passes) => {
                        defmt::info!("new track: {=u16} passes", passes);
                    }
                    InferenceCode::Moments => defmt::info!("new track: moments"),
                }
                Reply::Started
            }
            Err(error) => Reply::Refused(error.into()),
        }
    }

    /// Runs one call of the tracker between two readings of the counter.
    #[inline(never)]
    fn timed<T>(
        &mut self,
        board: &Board,
        call: impl FnOnce(&mut Tracker<'static>) -> Result<T, StepError>,
        reply: impl FnOnce(&T, u32) -> Reply,
    ) -> Reply {
        let Some(tracker) = self.tracker.as_mut() else {
            return Reply::Refused(RefusalCode::NotReset);
        };
        let before = board.ticks();
        // The fences keep the compiler from moving the call's work out of the measured stretch.
        compiler_fence(Ordering::SeqCst);
        let answer = call(tracker);
        compiler_fence(Ordering::SeqCst);
        let ticks = board.ticks().wrapping_sub(before);
        match answer {
            Ok(answer) => reply(&answer, ticks),
            Err(error) => {
                let code = RefusalCode::from(error);
                defmt::warn!("call refused, code {=u8}", code as u8);
                Reply::Refused(code)
            }
        }
    }
}

fn estimated(estimate: &Estimate, ticks: u32) -> Reply {
    Reply::Estimate(EstimateFrame::new(estimate, ticks))
}
