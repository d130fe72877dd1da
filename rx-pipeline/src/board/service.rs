//! A board's end of the conversation.

use core::borrow::BorrowMut;

use super::message::{
    Answer, Hello, Memory, Message, PROTOCOL, REGION_ANSWER_MAX, REGION_REQUEST_MAX, REGION_SIDE_MAX, Refusal, Region, Report, Request,
    STAGE_COUNT, Settings, Unread, WireReading,
};
use crate::corners::Corners;
use crate::frame::Frame;
use crate::profile::{Profile, Stage};
use crate::receiver::{NoSearch, Receiver, ReceiverError, ReceiverMemory};
use link::framing::Event;
use link::serial::{BodyError, FrameReader, Kind, VERSION, encode, wire_length};

/// Bytes that an answer may take on the wire.
pub const ANSWER_WIRE_MAX: usize = wire_length(REGION_ANSWER_MAX);

/// The machine that a [`Service`] runs on.
pub trait Machine {
    /// Its name, up to 32 bytes.
    const BOARD: &'static str;
    /// Ticks of its clock in a second.
    const TICKS_HZ: u32;
    /// A clock that counts up and wraps around.
    fn ticks(&self) -> u32;
    /// The deepest that the stack has been, bytes.
    fn stack_bytes(&self) -> u32;
}

/// Bytes in, bytes out: reads the panels in the regions that arrive.
///
/// `PIXELS` and `M` are those of the [`Receiver`].
pub struct Service<const PIXELS: usize, M> {
    reader: FrameReader<REGION_REQUEST_MAX>,
    desk: Desk<PIXELS, M>,
}

/// What answers, and the last answer.
struct Desk<const PIXELS: usize, M> {
    receiver: Receiver<PIXELS, M>,
    answered: Option<u32>,
    wire: [u8; ANSWER_WIRE_MAX],
    length: usize,
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>> Service<PIXELS, M> {
    /// A service that has heard nothing, of a receiver with the default [`Settings`].
    ///
    /// # Errors
    /// None, as the default settings are in their ranges.
    pub fn new(memory: M) -> Result<Self, ReceiverError> {
        Ok(Self {
            reader: FrameReader::new(),
            desk: Desk {
                receiver: Receiver::new(Settings::default().into(), memory, NoSearch)?,
                answered: None,
                wire: [0; ANSWER_WIRE_MAX],
                length: 0,
            },
        })
    }

    /// Takes a byte; the bytes to send back where it completes a request.
    pub fn receive(&mut self, byte: u8, machine: &impl Machine) -> Option<&[u8]> {
        let frame = self.reader.push(byte)?.ok()?;
        let sequence = frame.sequence();
        match frame.message(Kind::Request) {
            Ok(request) => {
                // What was asked twice is done once.
                let repeated = self.desk.answered == Some(sequence) && matches!(request, Request::Region(_) | Request::Finish);
                if !repeated {
                    self.desk.answer(sequence, request, machine);
                }
            }
            Err(BodyError::OtherKind) => return None,
            Err(BodyError::Version { .. }) => {
                let refusal = Refusal::Version { speaks: VERSION };
                self.desk.send(sequence, &Answer::Refused(refusal));
            }
            Err(_) => self.desk.send(sequence, &Answer::Refused(Refusal::Unknown)),
        }
        self.desk.wire.get(..self.desk.length)
    }
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>> Desk<PIXELS, M> {
    fn answer<K: Machine>(&mut self, sequence: u32, request: Request<'_>, machine: &K) {
        let answer = match request {
            Request::Hello => Answer::Hello(Hello {
                protocol: PROTOCOL,
                board: K::BOARD,
                ticks_hz: K::TICKS_HZ,
            }),
            Request::Memory => Answer::Memory(Memory {
                stack_bytes: machine.stack_bytes(),
            }),
            Request::Begin(settings) => match self.receiver.begin(&settings.into()) {
                Ok(()) => Answer::Ready,
                Err(_) => Answer::Refused(Refusal::Settings),
            },
            Request::Region(region) => read(&mut self.receiver, &region, machine).map_or_else(Answer::Refused, Answer::Report),
            Request::Finish => Answer::Finished(delivered(self.receiver.finish())),
        };
        let written = encode(Kind::Answer, sequence, &answer, &mut self.wire);
        self.length = written.map_or(0, <[u8]>::len);
        self.answered = Some(sequence);
    }

    fn send(&mut self, sequence: u32, answer: &Answer<'_>) {
        let written = encode(Kind::Answer, sequence, answer, &mut self.wire);
        self.length = written.map_or(0, <[u8]>::len);
        self.answered = Some(sequence);
    }
}

/// Reads a region.
fn read<'a, const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>>(
    receiver: &'a mut Receiver<PIXELS, M>,
    region: &Region<'_>,
    machine: &impl Machine,
) -> Result<Report<'a>, Refusal> {
    let started = machine.ticks();
    let [width, height] = region.size;
    let wrong_size = Refusal::Size {
        width,
        height,
        pixels: region.pixels.len() as u32,
    };
    let (columns, rows) = (usize::from(width), usize::from(height));
    if columns > REGION_SIDE_MAX || rows > REGION_SIDE_MAX || region.pixels.len() != columns * rows {
        return Err(wrong_size);
    }
    let frame = Frame::new(region.pixels, columns, rows).map_err(|_| wrong_size)?;
    if let Some(points) = region.corners {
        let corners = Corners::new(points).map_err(|_| Refusal::Corners)?;
        receiver
            .place(corners, region.origin, (columns, rows))
            .map_err(|_| Refusal::Place)?;
    }
    let mut watch = Stopwatch {
        machine,
        began: started,
        ticks: [0; STAGE_COUNT],
    };
    let outcome = receiver.region(region.frame, region.origin, &frame, &mut watch);
    Ok(Report {
        reading: outcome
            .reading
            .map(|reading| WireReading::new(&reading, region.origin))
            .map_err(Unread::from),
        symbol: outcome.symbol,
        message: delivered(outcome.event),
        ticks: machine.ticks().wrapping_sub(started),
        stage_ticks: watch.ticks,
    })
}

fn delivered(event: Event<'_>) -> Option<Message<'_>> {
    let Event::Delivered(delivery) = event else {
        return None;
    };
    Some(Message {
        bytes: delivery.message,
        first_frame: delivery.first_stamp,
        last_frame: delivery.last_stamp,
        corrected_bits: delivery.corrected_bits,
    })
}

/// Takes the time of stages, none within another.
struct Stopwatch<'a, K> {
    machine: &'a K,
    began: u32,
    ticks: [u32; STAGE_COUNT],
}

impl<K: Machine> Profile for Stopwatch<'_, K> {
    fn begins(&mut self, _: Stage) {
        self.began = self.machine.ticks();
    }

    fn ends(&mut self, stage: Stage) {
        let elapsed = self.machine.ticks().wrapping_sub(self.began);
        if let Some(ticks) = self.ticks.get_mut(stage as usize) {
            *ticks = ticks.wrapping_add(elapsed);
        }
    }
}
