//! A track as bytes: to survive a reset, or to move to another computer.
//!
//! Panic contract: [`Track::from_bytes`] accepts any bytes and never panics; what it returns is a track
//! as one could have become by itself, and answers as such. The layout is one fixed order of
//! little-endian numbers, said once for both ways.

use crc::{CRC_32_ISO_HDLC, Crc};

use super::{State, Track, TrackBytesError, TrackField};
use crate::blob::Kind;
use crate::clock::Clock;
use crate::inference::Inference;
use crate::measurement::{Measurement, Sensed};
use crate::memoryless::{Fix, Past, Plot};
use crate::recursive::Belief;
use crate::recursive::candidate::Candidate;
use crate::recursive::target::Target;
use crate::rng::Generator;
use crate::sensor::Sensor;
use crate::settings::{Correction, Settings};
use crate::spread::Spread;

/// Length of every track as bytes.
pub const TRACK_SNAPSHOT_BYTES: usize = 1_088;

/// First four bytes.
const MAGIC: [u8; 4] = *b"BNKT";
/// The only version of the layout that this code reads and writes.
const VERSION: u16 = 3;
/// Stands for moments, which are had without passes.
const NO_PASSES: u16 = 0;
const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const CRC_BYTES: usize = 4;

impl Track {
    /// Writes all that is known, to the bit; [`Track::from_bytes`] reads it.
    pub fn to_bytes(&self, bytes: &mut [u8; TRACK_SNAPSHOT_BYTES]) {
        bytes.fill(0);
        let (body, crc) = bytes.split_at_mut(TRACK_SNAPSHOT_BYTES - CRC_BYTES);
        let mut line = Line {
            side: Side::Write(body),
            sound: true,
        };
        let (mut magic, mut version, mut kind) = (MAGIC, VERSION, self.kind().id());
        line.bytes(&mut magic);
        line.u16(&mut version);
        line.u8(&mut kind);
        line.track(&mut self.clone());
        crc.copy_from_slice(&CRC32.checksum(body).to_le_bytes());
    }

    /// The track that was written. It runs on the model that it ran on; another of its kind can take it
    /// over ([`Track::hand_over`]).
    ///
    /// # Errors
    /// [`TrackBytesError`], the first thing found wrong.
    pub fn from_bytes(bytes: &[u8; TRACK_SNAPSHOT_BYTES]) -> Result<Self, TrackBytesError> {
        let (body, crc) = bytes.split_at(TRACK_SNAPSHOT_BYTES - CRC_BYTES);
        let mut line = Line {
            side: Side::Read(body),
            sound: true,
        };
        let (mut magic, mut version, mut kind) = ([0; 4], 0, 0);
        line.bytes(&mut magic);
        line.u16(&mut version);
        line.u8(&mut kind);
        if magic != MAGIC {
            return Err(TrackBytesError::NotATrack);
        }
        if version != VERSION {
            return Err(TrackBytesError::UnknownVersion(version));
        }
        if CRC32.checksum(body).to_le_bytes() != crc {
            return Err(TrackBytesError::WrongChecksum);
        }
        let mut track = Self::idle();
        if kind == Kind::Memoryless.id() {
            track.state = State::Memoryless(Past::NONE);
        } else if kind != Kind::Recursive.id() {
            return Err(TrackBytesError::UnknownKind(kind));
        }
        line.track(&mut track);
        line.end();
        if !line.sound {
            return Err(TrackBytesError::Invalid(TrackField::Padding));
        }
        track.check().map_err(TrackBytesError::Invalid)?;
        Ok(track)
    }
}

/// Where a number is written to or read from.
enum Side<'b> {
    Write(&'b mut [u8]),
    Read(&'b [u8]),
}

/// Numbers in a row, written or read.
struct Line<'b> {
    side: Side<'b>,
    /// Whether all that was read can have been written.
    sound: bool,
}

macro_rules! numbers {
    ($($number:ident),*) => {$(
        fn $number(&mut self, value: &mut $number) {
            let mut bytes = value.to_le_bytes();
            self.bytes(&mut bytes);
            *value = $number::from_le_bytes(bytes);
        }
    )*};
}

impl<'b> Line<'b> {
    fn bytes<const N: usize>(&mut self, value: &mut [u8; N]) {
        match &mut self.side {
            Side::Write(rest) => {
                if let Some((slot, left)) = core::mem::take(rest).split_first_chunk_mut() {
                    *slot = *value;
                    *rest = left;
                } else {
                    self.sound = false;
                }
            }
            Side::Read(rest) => {
                if let Some((slot, left)) = rest.split_first_chunk() {
                    *value = *slot;
                    *rest = left;
                } else {
                    self.sound = false;
                }
            }
        }
    }

    numbers!(u8, u16, u32, u64, f32);

    fn floats(&mut self, values: &mut [f32]) {
        for value in values {
            self.f32(value);
        }
    }

    fn flag(&mut self, flag: &mut bool) {
        let mut byte = u8::from(*flag);
        self.u8(&mut byte);
        self.sound &= byte <= 1;
        *flag = byte == 1;
    }

    /// Takes as much room for nothing as for `room`, which is what is written for it.
    fn option<T>(&mut self, value: &mut Option<T>, room: T, each: impl FnOnce(&mut Self, &mut T)) {
        let mut there = value.is_some();
        self.flag(&mut there);
        let mut inner = value.take().unwrap_or(room);
        let before = self.unread();
        each(self, &mut inner);
        let read = before.len() - self.unread().len();
        self.sound &= there || before.iter().take(read).all(|&byte| byte == 0);
        *value = there.then_some(inner);
    }

    /// What is left to be read.
    fn unread(&self) -> &'b [u8] {
        match self.side {
            Side::Read(rest) => rest,
            Side::Write(_) => &[],
        }
    }

    /// What is left was never written.
    fn end(&mut self) {
        self.sound &= self.unread().iter().all(|&byte| byte == 0);
    }

    fn track(&mut self, track: &mut Track) {
        self.u32(&mut track.model);
        self.settings(&mut track.settings);
        let Clock {
            latest_us,
            strange_us,
        } = &mut track.clock;
        self.option(latest_us, 0, Self::u64);
        self.option(strange_us, 0, Self::u64);
        let nothing = Measurement {
            time_us: 0,
            range: None,
            elevation: None,
            azimuth: None,
            range_rate: None,
            sensor: Sensor::ORIGIN,
        };
        self.option(&mut track.latest, nothing, Self::measurement);
        let mut rng = track.rng.state();
        for word in &mut rng {
            self.u32(word);
        }
        track.rng = Generator::at(rng);
        match &mut track.state {
            State::Memoryless(past) => {
                // It is the latest measurement, or none.
                let mut recent = past.previous.is_some();
                self.flag(&mut recent);
                let previous = track.latest.as_ref().map(Plot::of);
                past.previous = previous.and_then(Result::ok).filter(|_| recent);
                self.sound &= recent == past.previous.is_some();
                self.option(&mut past.latest, Fix::NONE, Self::fix);
                self.option(&mut past.before, Fix::NONE, Self::fix);
            }
            State::Recursive(belief) => self.belief(belief),
        }
    }

    fn settings(&mut self, settings: &mut Settings) {
        let mut code = match settings.correction {
            Correction::None => 0,
            Correction::Converted => 1,
            Correction::Polar => 2,
        };
        self.u8(&mut code);
        settings.correction = match code {
            0 => Correction::None,
            1 => Correction::Converted,
            _ => Correction::Polar,
        };
        self.sound &= code <= 2;
        let (mut passes, mut frozen) = match settings.inference {
            Inference::Mean => (1, false),
            Inference::Passes(passes) => (passes.count(), passes.spread() == Spread::Frozen),
            Inference::Moments => (NO_PASSES, false),
        };
        self.u16(&mut passes);
        self.flag(&mut frozen);
        match Inference::of_passes(passes) {
            Ok(inference) if !frozen => settings.inference = inference,
            Ok(passes @ Inference::Passes(_)) => settings.inference = passes.frozen(),
            Err(_) if passes == NO_PASSES && !frozen => settings.inference = Inference::Moments,
            _ => self.sound = false,
        }
        self.u64(&mut settings.seed);
    }

    fn measurement(&mut self, measurement: &mut Measurement) {
        self.u64(&mut measurement.time_us);
        let nothing = Sensed {
            value: 0.0,
            sigma: 0.0,
        };
        for sensed in [
            &mut measurement.elevation,
            &mut measurement.azimuth,
            &mut measurement.range,
            &mut measurement.range_rate,
        ] {
            self.option(sensed, nothing, |line, sensed| {
                line.f32(&mut sensed.value);
                line.f32(&mut sensed.sigma);
            });
        }
        self.floats(&mut measurement.sensor.position_m);
        self.floats(&mut measurement.sensor.velocity_mps);
    }

    fn fix(&mut self, fix: &mut Fix) {
        self.u64(&mut fix.time_us);
        self.floats(fix.position.as_mut_slice());
        self.floats(fix.covariance.as_mut_slice());
    }

    fn belief(&mut self, belief: &mut Belief) {
        self.option(&mut belief.target, Target::NONE, Self::target);
        self.u8(&mut belief.rejections);
        let nothing = Candidate {
            target: Target::NONE,
            agreeing: 0,
            misses: 0,
        };
        self.option(&mut belief.candidate, nothing, |line, candidate| {
            line.target(&mut candidate.target);
            line.u8(&mut candidate.agreeing);
            line.u8(&mut candidate.misses);
        });
    }

    fn target(&mut self, target: &mut Target) {
        self.u64(&mut target.time_us);
        self.floats(&mut target.state);
        self.floats(&mut target.sensor_m);
        // The lower triangle; it is symmetric to the bit.
        for row in 0..9 {
            for column in 0..=row {
                let mut value = target.covariance[row][column];
                self.f32(&mut value);
                target.covariance[row][column] = value;
                target.covariance[column][row] = value;
            }
        }
        let m = &mut target.memory;
        self.floats(&mut m.innovation);
        self.floats(&mut m.drift);
        self.floats(&mut m.squares);
        self.floats(&mut m.ln_sigmas);
        self.f32(&mut m.coast_s);
        self.f32(&mut m.age_s);
        self.floats(m.velocity_means.as_flattened_mut());
        self.floats(&mut m.notes);
        self.floats(&mut m.counts);
        self.u16(&mut target.used);
        let f = &mut target.foresight;
        self.u64(&mut f.due_us);
        self.floats(&mut f.position_m);
        self.floats(&mut f.bend_m);
        self.f32(&mut f.variance_m2);
        self.f32(&mut f.found);
        self.f32(&mut f.expected);
        self.f32(&mut f.followed);
        self.f32(&mut f.bent);
    }
}

#[cfg(test)]
mod tests;
