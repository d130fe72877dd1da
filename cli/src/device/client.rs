//! One conversation with a transmitter: each request is asked until there is an answer to it.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use link::serial::{
    ANSWER_FRAME_MAX, Answer, Frame, FrameReader, Kind, REQUEST_FRAME_MAX, Refusal, Request,
    SCHEMA, VERSION, encode, wire_length,
};

use super::DeviceError;

/// How often a request is sent before its transmitter counts as silent.
pub const TRIES: u32 = 8;

/// Who a transmitter says it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Version of its firmware.
    pub firmware: String,
    /// Name of its board.
    pub board: String,
    /// Most bytes of a table that it takes at once.
    pub chunk_max: usize,
}

/// A transmitter behind `port`, whose reads end with `TimedOut` after the time that one try is given.
pub struct Client<P> {
    port: P,
    patience: Duration,
    reader: FrameReader<ANSWER_FRAME_MAX>,
    sequence: u32,
    identity: Identity,
}

impl<P: Read + Write> Client<P> {
    /// Says hello. A try lasts `patience`; `sequence` is the number of the first request, which should be
    /// another one in each conversation.
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
                firmware: String::new(),
                board: String::new(),
                chunk_max: 0,
            },
        };
        let (schema, identity) = client.ask(&Request::Hello, |answer| match answer {
            Answer::Hello(hello) => Some((
                hello.schema,
                Identity {
                    firmware: hello.firmware.into(),
                    board: hello.board.into(),
                    chunk_max: hello.chunk_max.max(1).into(),
                },
            )),
            _ => None,
        })?;
        if schema != SCHEMA {
            return Err(DeviceError::Schema {
                theirs: schema,
                firmware: identity.firmware,
            });
        }
        client.identity = identity;
        Ok(client)
    }

    /// Who the transmitter is.
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
    pub fn ask<R>(
        &mut self,
        request: &Request<'_>,
        read: impl Fn(Answer<'_>) -> Option<R>,
    ) -> Result<R, DeviceError> {
        self.sequence = self.sequence.wrapping_add(1);
        let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
        let wire = encode(Kind::Request, self.sequence, request, &mut wire)
            .map_err(|_| DeviceError::Unexpected)?;
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
        read: impl Fn(Answer<'_>) -> Option<R>,
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
                    return Ok(Some(outcome(&frame, read)));
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
        return Err(DeviceError::Version {
            theirs: frame.version(),
        });
    }
    match frame.answer() {
        Ok(Answer::Refused(Refusal::Version { speaks })) => {
            Err(DeviceError::Version { theirs: speaks })
        }
        Ok(Answer::Refused(refusal)) => Err(refusal.into()),
        Ok(answer) => read(answer).ok_or(DeviceError::Unexpected),
        Err(_) => Err(DeviceError::Unexpected),
    }
}

/// Whether it is worth another try.
fn is_passing(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

fn gone(error: &std::io::Error) -> DeviceError {
    DeviceError::Gone {
        why: error.to_string(),
    }
}
