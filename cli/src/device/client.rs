//! One conversation with a transmitter or a receiver: each request is asked until there is an answer to it.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use link::serial::{Answer, BodyError, Frame, FrameReader, Kind, REQUEST_FRAME_MAX, Refusal, Request, SCHEMA, encode, wire_length};
use rx_pipeline::standalone as receiver;
use serde::{Deserialize, Serialize};

use super::DeviceError;

/// How often a request is sent before its board counts as silent.
pub const TRIES: u32 = 8;

/// Who somebody at a port says they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Number of its set of messages.
    pub schema: u32,
    /// Version of its firmware.
    pub firmware: String,
    /// Name of its board.
    pub board: String,
    /// Most bytes of a table that it takes at once.
    pub chunk_max: usize,
}

impl Identity {
    /// Whether it is a receiver; otherwise it is a transmitter.
    pub fn is_receiver(&self) -> bool {
        self.board.starts_with(receiver::BOARD_PREFIX)
    }
}

/// What one kind of board is asked, and how it answers.
pub trait Question: Serialize {
    /// The answers of such a board.
    type Answer<'a>: Deserialize<'a>;

    /// Why the board did not do what it was asked, if this says so.
    fn refusal(answer: &Self::Answer<'_>) -> Option<DeviceError>;
}

impl Question for Request<'_> {
    type Answer<'a> = Answer<'a>;

    fn refusal(answer: &Answer<'_>) -> Option<DeviceError> {
        match *answer {
            Answer::Refused(Refusal::Version { speaks }) => Some(DeviceError::Version { theirs: speaks }),
            Answer::Refused(refusal) => Some(refusal.into()),
            _ => None,
        }
    }
}

impl Question for receiver::Request {
    type Answer<'a> = receiver::Answer<'a>;

    fn refusal(answer: &receiver::Answer<'_>) -> Option<DeviceError> {
        match *answer {
            receiver::Answer::Refused(receiver::Refusal::Version { speaks }) => Some(DeviceError::Version { theirs: speaks }),
            receiver::Answer::Refused(refusal) => Some(refusal.into()),
            _ => None,
        }
    }
}

/// A transmitter or a receiver behind `port`, whose reads end with `TimedOut` after the time that one try is given.
pub struct Client<P> {
    port: P,
    patience: Duration,
    reader: FrameReader<{ receiver::ANSWER_MAX }>,
    sequence: u32,
    identity: Identity,
}

impl<P: Read + Write> Client<P> {
    /// Greets the board at the port, of any kind and age. A try lasts `patience`; `sequence` is the number of the first request, which
    /// should be another one in each conversation.
    ///
    /// # Errors
    /// [`DeviceError`] when nobody answers, or nobody who can be talked to.
    pub fn greet(port: P, patience: Duration, sequence: u32) -> Result<Self, DeviceError> {
        let mut client = Self {
            port,
            patience,
            reader: FrameReader::new(),
            sequence,
            identity: Identity {
                schema: 0,
                firmware: String::new(),
                board: String::new(),
                chunk_max: 0,
            },
        };
        client.identity = client.ask(&Request::Hello, |answer| match answer {
            Answer::Hello(hello) => Some(Identity {
                schema: hello.schema,
                firmware: hello.firmware.into(),
                board: hello.board.into(),
                chunk_max: hello.chunk_max.max(1).into(),
            }),
            _ => None,
        })?;
        Ok(client)
    }

    /// The same, if a transmitter with this program's messages is there.
    ///
    /// # Errors
    /// [`DeviceError`] that says who is there instead.
    pub fn transmitter(self) -> Result<Self, DeviceError> {
        if self.identity.is_receiver() {
            return Err(DeviceError::IsReceiver {
                board: self.identity.board,
            });
        }
        self.of_schema(SCHEMA)
    }

    /// The same, if a receiver with this program's messages is there.
    ///
    /// # Errors
    /// [`DeviceError`] that says who is there instead.
    pub fn receiver(self) -> Result<Self, DeviceError> {
        if !self.identity.is_receiver() {
            return Err(DeviceError::IsTransmitter {
                board: self.identity.board,
            });
        }
        self.of_schema(receiver::SCHEMA)
    }

    fn of_schema(self, ours: u32) -> Result<Self, DeviceError> {
        if self.identity.schema == ours {
            return Ok(self);
        }
        Err(DeviceError::Schema {
            theirs: self.identity.schema,
            ours,
            firmware: self.identity.firmware,
        })
    }

    /// Who is there.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The port, as it is left.
    #[cfg(test)]
    pub fn into_port(self) -> P {
        self.port
    }

    /// What `read` makes of the answer to `request`.
    ///
    /// # Errors
    /// [`DeviceError`] when there is none after [`TRIES`], or a refusal, or one that `read` does not want.
    pub fn ask<Q: Question, R>(&mut self, request: &Q, read: impl Fn(Q::Answer<'_>) -> Option<R>) -> Result<R, DeviceError> {
        self.sequence = self.sequence.wrapping_add(1);
        let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
        let wire = encode(Kind::Request, self.sequence, request, &mut wire).map_err(|_| DeviceError::Unexpected)?;
        let mut heard = 0;
        for _ in 0..TRIES {
            match self.port.write_all(wire).and_then(|()| self.port.flush()) {
                Err(error) if !is_passing(error.kind()) => return Err(disconnected(&error)),
                // What was sent of it, if anything, is garbage to the transmitter.
                Ok(()) | Err(_) => {}
            }
            if let Some(outcome) = self.listen(|frame| outcome::<Q, R>(frame, &read), &mut heard)? {
                return outcome;
            }
        }
        Err(if heard == 0 {
            DeviceError::Silent { tries: TRIES }
        } else {
            DeviceError::NoTransmitter {
                bytes: heard,
                tries: TRIES,
            }
        })
    }

    /// Listens for one try.
    fn listen<R>(
        &mut self,
        read: impl Fn(&Frame<'_>) -> Result<R, DeviceError>,
        heard: &mut usize,
    ) -> Result<Option<Result<R, DeviceError>>, DeviceError> {
        let deadline = Instant::now() + self.patience;
        let mut bytes = [0; 256];
        loop {
            let count = match self.port.read(&mut bytes) {
                Ok(0) => {
                    return Err(DeviceError::Disconnected {
                        why: "the port was closed".into(),
                    });
                }
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) if is_passing(error.kind()) => return Ok(None),
                Err(error) => return Err(disconnected(&error)),
            };
            *heard += count;
            for &byte in &bytes[..count] {
                if let Some(Ok(frame)) = self.reader.push(byte)
                    && frame.is(Kind::Answer)
                    && frame.sequence() == self.sequence
                {
                    return Ok(Some(read(&frame)));
                }
            }
            // An endless sender is not waited for.
            if Instant::now() > deadline {
                return Ok(None);
            }
        }
    }
}

fn outcome<Q: Question, R>(frame: &Frame<'_>, read: impl Fn(Q::Answer<'_>) -> Option<R>) -> Result<R, DeviceError> {
    match frame.message(Kind::Answer) {
        Ok(answer) => match Q::refusal(&answer) {
            Some(refusal) => Err(refusal),
            None => read(answer).ok_or(DeviceError::Unexpected),
        },
        Err(BodyError::Version { version }) => Err(DeviceError::Version { theirs: version }),
        Err(_) => Err(DeviceError::Unexpected),
    }
}

/// Whether it is worth another try.
fn is_passing(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn disconnected(error: &std::io::Error) -> DeviceError {
    DeviceError::Disconnected { why: error.to_string() }
}
