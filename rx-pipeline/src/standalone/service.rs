//! The serial port's service: requests in, answers out.

use super::message::{
    ANSWER_MAX, Answer, CameraSettings, Message, PART_MAX, PicturePart, REQUEST_MAX, Refusal, Request, SCHEMA, Status, WireReading,
};
use super::picture::Picture;
use link::serial::{BodyError, FrameReader, Hello, Kind, encode, wire_length};

/// Bytes of an answer on the wire, at most.
const WIRE_MAX: usize = wire_length(ANSWER_MAX);
/// Time for which a picture is kept after the last request for a part, µs: longer than between two parts.
const PICTURE_HOLD_US: u64 = 500_000;

/// The sources of answers.
pub struct State<'a> {
    pub now_us: u64,
    pub board: &'a str,
    pub firmware: &'a str,
    pub status: Status,
    pub camera: CameraSettings,
    pub reading: Option<WireReading>,
    pub message: Message<'a>,
    pub picture: &'a Picture,
    /// The greatest readable symbol rate, thousandths of a symbol a second.
    pub most_millihertz: u32,
}

/// Reads requests and writes answers.
pub struct Service {
    reader: FrameReader<REQUEST_MAX>,
    wire: [u8; WIRE_MAX],
    /// Whole requests.
    pub requests: u32,
    /// Garbage between two zeros.
    pub bad_frames: u32,
    /// The time of the last request, µs since the start.
    asked_us: Option<u64>,
    /// The time until which the picture is kept.
    kept_until_us: u64,
}

/// A request, and the sequence number for its answer.
pub struct IncomingRequest {
    sequence: u32,
    request: Result<Request, Refusal>,
}

impl IncomingRequest {
    /// The symbol rate that it sets.
    pub fn symbol_millihertz(&self) -> Option<u32> {
        match self.request {
            Ok(Request::SetSymbolRate { millihertz }) => Some(millihertz),
            _ => None,
        }
    }
}

impl Service {
    pub fn new() -> Self {
        Self {
            reader: FrameReader::new(),
            wire: [0; WIRE_MAX],
            requests: 0,
            bad_frames: 0,
            asked_us: None,
            kept_until_us: 0,
        }
    }

    /// Whether a computer has sent a request within `within_us` µs.
    pub fn is_asked(&self, now_us: u64, within_us: u64) -> bool {
        self.asked_us.is_some_and(|asked| now_us.saturating_sub(asked) < within_us)
    }

    /// Whether the picture must not change.
    pub fn keeps_picture(&self, now_us: u64) -> bool {
        now_us < self.kept_until_us
    }

    /// Adds a byte; returns the request that it completes.
    pub fn receive(&mut self, byte: u8, now_us: u64) -> Option<IncomingRequest> {
        let frame = match self.reader.push(byte)? {
            Ok(frame) => frame,
            Err(_) => {
                self.bad_frames = self.bad_frames.saturating_add(1);
                return None;
            }
        };
        let request = match frame.message(Kind::Request) {
            // An echo of an answer.
            Err(BodyError::OtherKind) => return None,
            request => request.map_err(Refusal::from),
        };
        self.requests = self.requests.saturating_add(1);
        self.asked_us = Some(now_us);
        Some(IncomingRequest {
            sequence: frame.sequence(),
            request,
        })
    }

    /// The answer to a request.
    pub fn answer(&mut self, received: &IncomingRequest, state: &State<'_>) -> &[u8] {
        let answer = match received.request {
            Err(refusal) => Answer::Refused(refusal),
            Ok(Request::Hello) => Answer::Hello(Hello {
                schema: SCHEMA,
                firmware: state.firmware,
                board: state.board,
                chunk_max: PART_MAX as u16,
                message_max: 0,
            }),
            Ok(Request::Status) => Answer::Status(state.status),
            Ok(Request::Message) => Answer::Message(state.message),
            Ok(Request::Camera) => Answer::Camera(state.camera),
            Ok(Request::Reading) => Answer::Reading(state.reading),
            Ok(Request::Picture { offset }) => self.part_of(state.picture, offset, state.now_us),
            Ok(Request::SetSymbolRate { millihertz }) => {
                // The rate was set before this answer, if it is in range.
                if state.status.symbol_millihertz == millihertz {
                    Answer::Done
                } else {
                    Answer::Refused(Refusal::SymbolRate {
                        millihertz,
                        most: state.most_millihertz,
                    })
                }
            }
        };
        // Answers always fit.
        encode(Kind::Answer, received.sequence, &answer, &mut self.wire).unwrap_or_default()
    }

    fn part_of<'a>(&mut self, picture: &'a Picture, offset: u32, now_us: u64) -> Answer<'a> {
        if picture.size == [0; 2] {
            return Answer::Refused(Refusal::NoPicture);
        }
        self.kept_until_us = now_us + PICTURE_HOLD_US;
        Answer::Picture(PicturePart {
            frame: picture.frame,
            size: picture.size,
            origin: picture.origin,
            step: picture.step,
            offset,
            bytes: picture.part(offset, PART_MAX),
        })
    }
}
