//! One request in, one reply out.

use core::sync::atomic::{Ordering, compiler_fence};

use bnkf::blob::BlobError;
use bnkf::protocol::{
    self, EstimateFrame, ForecastFrame, HORIZONS, InferenceCode, LikelihoodFrame, PlaceFrame,
    Ready, RefusalCode, Reply, Request, Reset,
};
use bnkf::{Estimate, Likelihood, Measurement, Model, Settings, StepError, Track, Workspace};

use crate::board::Board;

/// The model in flash, on a word boundary so that what a step costs does not depend on the linker.
#[repr(C, align(4))]
struct InFlash<const N: usize>([u8; N]);

static BLOB: InFlash<{ include_bytes!(env!("BNKF_BLOB")).len() }> =
    InFlash(*include_bytes!(env!("BNKF_BLOB")));

/// The model in flash, and the track that runs on it.
pub struct Session {
    model: Result<Model<'static>, BlobError>,
    workspace: &'static mut Workspace,
    track: &'static mut Track,
    /// Whether a reset was accepted.
    begun: bool,
}

impl Session {
    /// Checks the blob in flash. The track will live in `track`.
    // In a frame of its own, which is gone before the first request.
    #[inline(never)]
    pub fn new(workspace: &'static mut Workspace, track: &'static mut Track) -> Self {
        // Without this the compiler may run the check on the bytes it sees now and leave it out of
        // the image; it is there for the bytes that flash holds later.
        let bytes = core::hint::black_box(BLOB.0.as_slice());
        Self {
            model: Model::new(bytes),
            workspace,
            track,
            begun: false,
        }
    }

    /// What the image says when it has booted.
    pub fn greeting(&self) -> Reply {
        match &self.model {
            Ok(model) => {
                defmt::info!(
                    "ready: blob {=u32:08x}, {=usize} bytes",
                    model.checksum(),
                    BLOB.0.len()
                );
                Reply::Ready(Ready {
                    protocol_version: protocol::VERSION,
                    blob_bytes: BLOB.0.len() as u32,
                    blob_crc: model.checksum(),
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
                self.timed(
                    board,
                    |on| on.track.step(on.model, on.workspace, &measurement),
                    estimated,
                )
            }
            Request::Coast { time_us } => self.timed(
                board,
                |on| on.track.coast(on.model, on.workspace, *time_us),
                estimated,
            ),
            Request::Budget => Reply::Budget(board.budget()),
            Request::Forecast { times_us } => self.timed(
                board,
                |on| on.forecast(times_us),
                |&places, ticks| Reply::Forecast(ForecastFrame { places, ticks }),
            ),
            Request::Likelihood(frame) => {
                let measurement = Measurement::from(frame);
                self.timed(
                    board,
                    |on| on.track.likelihood(on.model, on.workspace, &measurement),
                    fitted,
                )
            }
        }
    }

    fn reset(&mut self, reset: Reset) -> Reply {
        let Ok(model) = &self.model else {
            return Reply::Refused(RefusalCode::Blob);
        };
        let settings = match Settings::try_from(reset) {
            Ok(settings) => settings,
            Err(error) => return Reply::Refused(error.into()),
        };
        match self.track.begin(model, settings) {
            Ok(()) => {
                self.begun = true;
                match reset.inference {
                    InferenceCode::Mean => defmt::info!("new track: mean weights"),
                    InferenceCode::Passes(passes) => {
                        defmt::info!("new track: {=u16} passes", passes);
                    }
                    InferenceCode::Frozen(passes) => {
                        defmt::info!("new track: {=u16} passes, frozen spreads", passes);
                    }
                    InferenceCode::Moments => defmt::info!("new track: moments"),
                }
                Reply::Started
            }
            Err(error) => Reply::Refused(error.into()),
        }
    }

    /// Runs one call of the track between two readings of the counter.
    #[inline(never)]
    fn timed<T>(
        &mut self,
        board: &Board,
        call: impl FnOnce(On<'_>) -> Result<T, StepError>,
        reply: impl FnOnce(&T, u32) -> Reply,
    ) -> Reply {
        let (Ok(model), true) = (&self.model, self.begun) else {
            return Reply::Refused(RefusalCode::NotReset);
        };
        let on = On {
            model,
            workspace: self.workspace,
            track: self.track,
        };
        let before = board.ticks();
        // The fences keep the compiler from moving the call's work out of the measured stretch.
        compiler_fence(Ordering::SeqCst);
        let answer = call(on);
        compiler_fence(Ordering::SeqCst);
        let ticks = board.ticks().wrapping_sub(before);
        match &answer {
            Ok(answer) => reply(answer, ticks),
            Err(error) => {
                let code = RefusalCode::from(*error);
                defmt::warn!("call refused, code {=u8}", code as u8);
                Reply::Refused(code)
            }
        }
    }
}

/// What a call works with.
struct On<'s> {
    model: &'s Model<'static>,
    workspace: &'s mut Workspace,
    track: &'s mut Track,
}

impl On<'_> {
    fn forecast(self, times_us: &[u64; HORIZONS]) -> Result<[PlaceFrame; HORIZONS], StepError> {
        let mut places = [PlaceFrame::default(); HORIZONS];
        self.track
            .forecast_each(self.model, self.workspace, times_us, |place, estimate| {
                if let Some(slot) = places.get_mut(place) {
                    *slot = PlaceFrame::from(estimate);
                }
            })?;
        Ok(places)
    }
}

// Replies are made when the call is off the stack.
#[inline(never)]
fn estimated(estimate: &Estimate, ticks: u32) -> Reply {
    Reply::Estimate(EstimateFrame::new(estimate, ticks))
}

#[inline(never)]
fn fitted(likelihood: &Likelihood, ticks: u32) -> Reply {
    Reply::Likelihood(LikelihoodFrame::new(likelihood, ticks))
}
