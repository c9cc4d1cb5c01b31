//! Bytes of one frame: COBS around a postcard message and its CRC-32.

use cobs::{DecodeResult, DecoderState};
use crc::{CRC_32_ISO_HDLC, Crc};
use heapless::Vec;
use serde::{Serialize, de::DeserializeOwned};

/// Longest message, bytes.
const MESSAGE_BYTES_MAX: usize = 384;
const CRC_BYTES: usize = 4;
const BODY_BYTES_MAX: usize = MESSAGE_BYTES_MAX + CRC_BYTES;

/// Longest frame with its delimiter, bytes.
pub const FRAME_BYTES_MAX: usize = cobs::max_encoding_length(BODY_BYTES_MAX) + 1;

const DELIMITER: u8 = 0;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// One encoded frame, delimiter included.
pub type Frame = Vec<u8, FRAME_BYTES_MAX>;

/// A message that does not fit into a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodeError;

/// Why the bytes before a delimiter are no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// More than [`FRAME_BYTES_MAX`] bytes without a delimiter.
    TooLong,
    /// The COBS code runs past the end of the frame.
    Stuffing,
    /// The checksum does not match, or there is no room for one.
    Checksum,
    /// The checksum holds but the bytes are not exactly one message.
    Message,
}

impl core::fmt::Display for EncodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the message is longer than {MESSAGE_BYTES_MAX} bytes")
    }
}

impl core::error::Error for EncodeError {}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooLong => "frame too long",
            Self::Stuffing => "broken byte stuffing",
            Self::Checksum => "frame checksum mismatch",
            Self::Message => "frame holds no known message",
        })
    }
}

impl core::error::Error for FrameError {}

/// Encodes one message as a frame, delimiter included.
///
/// # Errors
/// The message is longer than a frame can carry.
pub fn encode<M: Serialize>(message: &M) -> Result<Frame, EncodeError> {
    let mut body = [0u8; BODY_BYTES_MAX];
    let message_len = postcard::to_slice(message, &mut body[..MESSAGE_BYTES_MAX])
        .map_err(|_| EncodeError)?
        .len();
    let (message, rest) = body.split_at_mut_checked(message_len).ok_or(EncodeError)?;
    let crc = rest.first_chunk_mut().ok_or(EncodeError)?;
    *crc = CRC.checksum(message).to_le_bytes();
    let body = body.get(..message_len + CRC_BYTES).ok_or(EncodeError)?;

    let mut frame = Frame::new();
    frame
        .resize(cobs::max_encoding_length(body.len()), DELIMITER)
        .map_err(|_| EncodeError)?;
    let frame_len = cobs::try_encode(body, &mut frame).map_err(|_| EncodeError)?;
    frame.truncate(frame_len);
    frame.push(DELIMITER).map_err(|_| EncodeError)?;
    Ok(frame)
}

/// Collects bytes into frames.
#[derive(Debug, Default)]
pub struct FrameReader {
    bytes: Frame,
    too_long: bool,
}

impl FrameReader {
    /// An empty reader.
    pub const fn new() -> Self {
        Self {
            bytes: Frame::new(),
            too_long: false,
        }
    }

    /// Takes one byte; answers when it ends a frame. Empty frames are skipped, so a sender may
    /// start with a delimiter to end whatever the line held before.
    pub fn push<M: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<M, FrameError>> {
        if byte != DELIMITER {
            if self.bytes.push(byte).is_err() {
                self.too_long = true;
            }
            return None;
        }
        let message = if self.too_long {
            Some(Err(FrameError::TooLong))
        } else if self.bytes.is_empty() {
            None
        } else {
            Some(decode(&mut self.bytes))
        };
        self.bytes.clear();
        self.too_long = false;
        message
    }
}

/// Decodes the bytes of one frame, without its delimiter, in place.
fn decode<M: DeserializeOwned>(frame: &mut [u8]) -> Result<M, FrameError> {
    let body = unstuff(frame).ok_or(FrameError::Stuffing)?;
    let (message, crc) = body
        .split_last_chunk::<CRC_BYTES>()
        .ok_or(FrameError::Checksum)?;
    if CRC.checksum(message) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Checksum);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Message),
    }
}

/// Undoes the byte stuffing of a whole frame in place. (`cobs::decode_in_place` indexes, so it keeps a path
/// to a panic.)
fn unstuff(frame: &mut [u8]) -> Option<&[u8]> {
    let mut state = DecoderState::Idle;
    let mut filled = 0;
    for at in 0..frame.len() {
        let byte = *frame.get(at)?;
        if let DecodeResult::DataContinue(byte) = state.feed(byte).ok()? {
            *frame.get_mut(filled)? = byte;
            filled += 1;
        }
    }
    match state.feed(DELIMITER).ok()? {
        DecodeResult::DataComplete => frame.get(..filled),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Reply, Request};
    use proptest::prelude::*;

    fn read_all<M: DeserializeOwned>(bytes: &[u8]) -> std::vec::Vec<Result<M, FrameError>> {
        let mut reader = FrameReader::new();
        bytes.iter().filter_map(|&b| reader.push(b)).collect()
    }

    #[test]
    fn frame_bytes_are_fixed() {
        // postcard writes variant 3 and the varint 300; the CRC-32 of [3, 0xac, 0x02] follows.
        let crc = CRC.checksum(&[3, 0xac, 0x02]).to_le_bytes();
        let frame = encode(&Request::Coast { time_us: 300 }).unwrap();
        let mut expected = std::vec![8, 3, 0xac, 0x02];
        expected.extend_from_slice(&crc);
        expected.push(0);
        assert_eq!(frame.as_slice(), expected);
        // The published check value of CRC-32/ISO-HDLC.
        assert_eq!(CRC.checksum(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn garbage_before_a_frame_costs_only_itself() {
        let mut bytes = std::vec![0x55u8; 3 * FRAME_BYTES_MAX];
        bytes.push(0);
        bytes.extend_from_slice(&encode(&Request::Hello).unwrap());
        let read = read_all::<Request>(&bytes);
        assert_eq!(read, [Err(FrameError::TooLong), Ok(Request::Hello)]);
    }

    #[test]
    fn every_single_bit_flip_is_refused() {
        let frame = encode(&Request::Coast { time_us: 123_456 }).unwrap();
        for bit in 0..(frame.len() - 1) * 8 {
            let mut flipped = frame.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            for message in read_all::<Request>(&flipped) {
                assert!(message.is_err(), "bit {bit} gave {message:?}");
            }
        }
    }

    #[test]
    fn trailing_bytes_under_a_good_checksum_are_refused() {
        #[derive(serde::Serialize)]
        struct Padded(Request, u8);
        let frame = encode(&Padded(Request::Hello, 7)).unwrap();
        assert_eq!(read_all::<Request>(&frame), [Err(FrameError::Message)]);
    }

    #[test]
    fn a_message_longer_than_a_frame_is_an_error() {
        let longest = [[0xa5u8; 32]; MESSAGE_BYTES_MAX / 32];
        let frame = encode(&longest).unwrap();
        // A code byte starts the frame and follows every 254 bytes; the delimiter ends it.
        assert_eq!(frame.len(), 384 + 4 + 2 + 1);
        assert_eq!(frame.len(), FRAME_BYTES_MAX);
        assert_eq!(
            read_all::<[[u8; 32]; MESSAGE_BYTES_MAX / 32]>(&frame),
            [Ok(longest)]
        );
        let long = [[0xa5u8; 32]; MESSAGE_BYTES_MAX / 32 + 1];
        assert_eq!(encode(&long), Err(EncodeError));
    }

    proptest! {
        #[test]
        fn hostile_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..1200)) {
            let read = read_all::<Request>(&bytes).len() + read_all::<Reply>(&bytes).len();
            let delimiters = bytes.iter().filter(|&&b| b == 0).count();
            prop_assert!(read <= 2 * delimiters);
        }

        #[test]
        fn hostile_messages_under_a_good_checksum_never_panic(
            message in proptest::collection::vec(any::<u8>(), 1..MESSAGE_BYTES_MAX),
        ) {
            let mut body = message.clone();
            body.extend_from_slice(&CRC.checksum(&message).to_le_bytes());
            let mut frame = std::vec![0u8; cobs::max_encoding_length(body.len())];
            let len = cobs::encode(&body, &mut frame);
            frame.truncate(len);
            frame.push(0);
            // Whatever is accepted must be a message that encodes again.
            for reply in read_all::<Reply>(&frame).into_iter().flatten() {
                prop_assert!(encode(&reply).is_ok());
            }
        }
    }
}
