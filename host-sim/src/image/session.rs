//! Talks to a running image: one request, one reply.

use std::path::Path;
use std::time::Duration;

use bnkf::Measurement;
use bnkf::protocol::{
    self, BudgetFrame, EncodeError, EstimateFrame, ForecastFrame, FrameError, FrameReader,
    HORIZONS, LikelihoodFrame, MeasurementFrame, Ready, RefusalCode, Reply, Request, Reset,
};

use crate::image::qemu::{Machine, QemuError};

/// Why the conversation with the image ended.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The machine cannot be used.
    #[error(transparent)]
    Qemu(#[from] QemuError),
    /// The request does not fit into a frame.
    #[error("request: {0}")]
    Encode(#[from] EncodeError),
    /// The image sent something else than a frame.
    #[error("reply: {0}")]
    Frame(#[from] FrameError),
    /// The image speaks another version of the protocol.
    #[error(
        "the image speaks protocol version {image}, this program {}",
        protocol::VERSION
    )]
    Version {
        /// The image's version.
        image: u8,
    },
    /// The image refused the request.
    #[error("the image refused: {0}")]
    Refused(RefusalCode),
    /// The reply belongs to another request.
    #[error("the image sent an unexpected reply: {0:?}")]
    Unexpected(Box<Reply>),
}

/// A running image that has said who it is.
#[derive(Debug)]
pub struct ImageSession {
    line: Line,
    ready: Ready,
}

#[derive(Debug)]
struct Line {
    machine: Machine,
    reader: FrameReader,
}

impl ImageSession {
    /// Starts `image` in QEMU and waits until it is ready. No answer may take longer than
    /// `answer_time_max`.
    ///
    /// # Errors
    /// [`SessionError`] says what went wrong; `Refused(Blob)` for a broken blob in its flash.
    pub fn boot(image: &Path, answer_time_max: Duration) -> Result<Self, SessionError> {
        let mut line = Line {
            machine: Machine::boot(image, answer_time_max)?,
            reader: FrameReader::new(),
        };
        // The image announces itself; the version is compared before anything else is believed.
        match line.receive()? {
            Reply::Ready(ready) if ready.protocol_version == protocol::VERSION => {
                Ok(Self { line, ready })
            }
            Reply::Ready(ready) => Err(SessionError::Version {
                image: ready.protocol_version,
            }),
            other => Err(unexpected(other)),
        }
    }

    /// What the image said about itself.
    pub fn ready(&self) -> Ready {
        self.ready
    }

    /// Starts a new track.
    ///
    /// # Errors
    /// [`SessionError`]; `Refused(Settings)` when the blob does not fit them.
    pub fn reset(&mut self, reset: Reset) -> Result<(), SessionError> {
        match self.ask(&Request::Reset(reset))? {
            Reply::Started => Ok(()),
            other => Err(unexpected(other)),
        }
    }

    /// One measurement, or none at `time_us`: the image's estimate or its refusal.
    ///
    /// # Errors
    /// [`SessionError`] when there was no answer to that.
    pub fn step(
        &mut self,
        time_us: u64,
        measurement: Option<&Measurement>,
    ) -> Result<Result<EstimateFrame, RefusalCode>, SessionError> {
        let request = match measurement {
            Some(measurement) => Request::Step(MeasurementFrame::from(measurement)),
            None => Request::Coast { time_us },
        };
        match self.ask(&request)? {
            Reply::Estimate(estimate) => Ok(Ok(estimate)),
            Reply::Refused(code) => Ok(Err(code)),
            other => Err(unexpected(other)),
        }
    }

    /// Where the image says that the target will be, or its refusal.
    ///
    /// # Errors
    /// [`SessionError`] when there was no answer to that.
    pub fn forecast(
        &mut self,
        times_us: [u64; HORIZONS],
    ) -> Result<Result<ForecastFrame, RefusalCode>, SessionError> {
        match self.ask(&Request::Forecast { times_us })? {
            Reply::Forecast(forecast) => Ok(Ok(forecast)),
            Reply::Refused(code) => Ok(Err(code)),
            other => Err(unexpected(other)),
        }
    }

    /// How well the image says that a measurement fits its track, or its refusal.
    ///
    /// # Errors
    /// [`SessionError`] when there was no answer to that.
    pub fn likelihood(
        &mut self,
        measurement: &Measurement,
    ) -> Result<Result<LikelihoodFrame, RefusalCode>, SessionError> {
        match self.ask(&Request::Likelihood(MeasurementFrame::from(measurement)))? {
            Reply::Likelihood(likelihood) => Ok(Ok(likelihood)),
            Reply::Refused(code) => Ok(Err(code)),
            other => Err(unexpected(other)),
        }
    }

    /// Memory in use on the target.
    ///
    /// # Errors
    /// [`SessionError`] when there was no answer to that.
    pub fn budget(&mut self) -> Result<BudgetFrame, SessionError> {
        match self.ask(&Request::Budget)? {
            Reply::Budget(budget) => Ok(budget),
            other => Err(unexpected(other)),
        }
    }

    /// Sends bytes that need not be a request and returns what the image answers.
    ///
    /// # Errors
    /// [`SessionError`] when there was no answer.
    pub fn ask_raw(&mut self, bytes: &[u8]) -> Result<Reply, SessionError> {
        self.line.machine.send(bytes)?;
        self.line.receive()
    }

    /// The image's log so far, still encoded; [`crate::image::log`] reads it.
    ///
    /// # Errors
    /// The log's file cannot be read.
    pub fn log(&self) -> Result<Vec<u8>, QemuError> {
        self.line.machine.log()
    }

    fn ask(&mut self, request: &Request) -> Result<Reply, SessionError> {
        self.ask_raw(&protocol::encode(request)?)
    }
}

impl Line {
    fn receive(&mut self) -> Result<Reply, SessionError> {
        loop {
            let byte = self.machine.receive()?;
            if let Some(reply) = self.reader.push(byte) {
                return Ok(reply?);
            }
        }
    }
}

fn unexpected(reply: Reply) -> SessionError {
    match reply {
        Reply::Refused(code) => SessionError::Refused(code),
        other => SessionError::Unexpected(Box::new(other)),
    }
}
