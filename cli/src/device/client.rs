//! One conversation with a transmitter or a receiver: each request is asked until there is an answer to it.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use link::serial::{Answer, Frame, FrameReader, Kind, REQUEST_FRAME_MAX, Refusal, Request, SCHEMA, VERSION, encode, wire_length};
use rx_pipeline::standalone::{ANSWER_MAX, BOARD_PREFIX};
use serde::Serialize;

use super::DeviceError;

/// How often a request is sent before its transmitter counts as silent.
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
    /// Whether it is a receiver, whose messages are `rx_pipeline::standalone`'s.
    pub fn is_receiver(&self) -> bool {
        self.board.starts_with(BOARD_PREFIX)
    }
}

/// A transmitter or a receiver behind `port`, whose reads end with `TimedOut` after the time that one try is given.
pub struct Client<P> {
    port: P,
    patience: Duration,
    reader: FrameReader<ANSWER_MAX>,
    sequence: u32,
    identity: Identity,
}

impl<P: Read + Write> Client<P> {
    /// Says hello to a transmitter. A try lasts `patience`; `sequence` is the number of the first request, which should be
    /// another one in each conversation.
    ///
    /// # Errors
    /// [`DeviceError`] when nobody answers, or nobody who can be talked to.
    pub fn greet(port: P, patience: Duration, sequence: u32) -> Result<Self, DeviceError> {
        let client = Self::greet_any(port, patience, sequence)?;
        match client.identity() {
            identity if identity.is_receiver() => Err(DeviceError::IsReceiver {
                board: identity.board.clone(),
            }),
            Identity { schema, firmware, .. } if *schema != SCHEMA => Err(DeviceError::Schema {
                theirs: *schema,
                firmware: firmware.clone(),
            }),
            _ => Ok(client),
        }
    }

    /// Says hello to whoever is there, a transmitter of any age or a receiver.
    ///
    /// # Errors
    /// [`DeviceError`] when nobody answers, or nobody who can be talked to.
    pub fn greet_any(port: P, patience: Duration, sequence: u32) -> Result<Self, DeviceError> {
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
    pub fn ask<R>(&mut self, request: &Request<'_>, read: impl Fn(Answer<'_>) -> Option<R>) -> Result<R, DeviceError> {
        self.exchange(request, |frame| outcome(frame, &read))
    }

    /// What `read` makes of the frame that answers `request`.
    ///
    /// # Errors
    /// [`DeviceError`] when there is none after [`TRIES`], or what `read` says.
    pub fn exchange<R>(&mut self, request: &impl Serialize, read: impl Fn(&Frame<'_>) -> Result<R, DeviceError>) -> Result<R, DeviceError> {
        self.sequence = self.sequence.wrapping_add(1);
        let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
        let wire = encode(Kind::Request, self.sequence, request, &mut wire).map_err(|_| DeviceError::Unexpected)?;
        let mut heard = 0;
        for _ in 0..TRIES {
            match self.port.write_all(wire).and_then(|()| self.port.flush()) {
                Err(error) if !is_passing(error.kind()) => return Err(gone(&error)),
                // What was sent of it, if anything, is garbage to the transmitter.
                Ok(()) | Err(_) => {}
            }
            if let Some(outcome) = self.listen(&read, &mut heard)? {
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
                    return Err(DeviceError::Gone {
                        why: "the port was closed".into(),
                    });
                }
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) if is_passing(error.kind()) => return Ok(None),
                Err(error) => return Err(gone(&error)),
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
            // Whoever talks without end is not waited for.
            if Instant::now() > deadline {
                return Ok(None);
            }
        }
    }
}

fn outcome<R>(frame: &Frame<'_>, read: impl Fn(Answer<'_>) -> Option<R>) -> Result<R, DeviceError> {
    if frame.version() != VERSION {
        return Err(DeviceError::Version { theirs: frame.version() });
    }
    match frame.answer() {
        Ok(Answer::Refused(Refusal::Version { speaks })) => Err(DeviceError::Version { theirs: speaks }),
        Ok(Answer::Refused(refusal)) => Err(refusal.into()),
        Ok(answer) => read(answer).ok_or(DeviceError::Unexpected),
        Err(_) => Err(DeviceError::Unexpected),
    }
}

/// Whether it is worth another try.
fn is_passing(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn gone(error: &std::io::Error) -> DeviceError {
    DeviceError::Gone { why: error.to_string() }
}
