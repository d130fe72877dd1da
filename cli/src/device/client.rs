//! A session with a transmitter or a receiver: repeats each request until it is answered.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use link::lock::Challenge;
use link::serial::{Answer, BodyError, Frame, FrameReader, Kind, REQUEST_FRAME_MAX, Refusal, Request, SCHEMA, encode, wire_length};
use link::signing::SecretKey;
use rx_pipeline::standalone as receiver;
use serde::{Deserialize, Serialize};

use super::DeviceError;

/// Attempts per request before a board counts as silent.
pub const TRIES: u32 = 8;
/// Permits made for one request: another one if the board restarts, or if another program uses its challenge.
const PERMITS: u32 = 3;

/// Gives the private key of a lock with this salt.
pub type Opener = Box<dyn FnMut(u64) -> Result<SecretKey, DeviceError>>;

/// Identity reported by a board.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Number of its message schema.
    pub schema: u32,
    /// Firmware version.
    pub firmware: String,
    /// Board name.
    pub board: String,
    /// Maximum bytes of a table per message.
    pub chunk_max: usize,
}

impl Identity {
    /// Whether the board is a receiver, not a transmitter.
    pub fn is_receiver(&self) -> bool {
        self.board.starts_with(receiver::BOARD_PREFIX)
    }
}

/// The requests to one kind of board, and their answers.
pub trait Question: Serialize {
    /// The answers of such a board.
    type Answer<'a>: Deserialize<'a>;

    /// The board's refusal, if the answer is one.
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

/// A transmitter or a receiver behind `port`, whose reads return `TimedOut` after the duration of one attempt.
pub struct Client<P> {
    port: P,
    patience: Duration,
    reader: FrameReader<{ receiver::ANSWER_MAX }>,
    sequence: u32,
    identity: Identity,
    opener: Option<Opener>,
    /// The key of a lock, by its salt.
    key: Option<(u64, SecretKey)>,
}

impl<P: Read + Write> Client<P> {
    /// Greets the board at the port, of any kind and version. Each attempt takes up to `patience`; `sequence` numbers the first request and
    /// should differ between sessions.
    ///
    /// # Errors
    /// [`DeviceError`] if no board answers, or none with a usable protocol.
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
            opener: None,
            key: None,
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

    /// This client, if the board is a transmitter with this program's schema.
    ///
    /// # Errors
    /// [`DeviceError`] that names the board found.
    pub fn transmitter(self) -> Result<Self, DeviceError> {
        if self.identity.is_receiver() {
            return Err(DeviceError::IsReceiver {
                board: self.identity.board,
            });
        }
        self.of_schema(SCHEMA)
    }

    /// This client, if the board is a receiver with this program's schema.
    ///
    /// # Errors
    /// [`DeviceError`] that names the board found.
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

    /// This client, which opens a locked board with the key that `opener` gives.
    pub fn opened_by(self, opener: Opener) -> Self {
        Self {
            opener: Some(opener),
            ..self
        }
    }

    /// The board's identity.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Returns the port.
    #[cfg(test)]
    pub fn into_port(self) -> P {
        self.port
    }

    /// Sends `request`, with a permit if the board is locked, and returns what `read` takes from its answer.
    ///
    /// # Errors
    /// [`DeviceError`] if there is no answer after [`TRIES`] attempts, a refusal, or an answer that `read` rejects.
    pub fn ask<Q: Question, R>(&mut self, request: &Q, read: impl Fn(Q::Answer<'_>) -> Option<R>) -> Result<R, DeviceError> {
        let mut outcome = self.ask_once(request, &read);
        for _ in 0..PERMITS {
            if outcome.as_ref().err() != Some(&DeviceError::Refused(Refusal::Locked)) || self.opener.is_none() {
                break;
            }
            self.permit(request)?;
            outcome = self.ask_once(request, &read);
        }
        outcome
    }

    /// Gives a permit for the request that comes next.
    fn permit(&mut self, request: &impl Serialize) -> Result<(), DeviceError> {
        let lock = self.ask_once(&Request::ReadLock, &|answer: Answer<'_>| match answer {
            Answer::Lock { salt, challenge, wait_s } => Some((salt, challenge, wait_s)),
            _ => None,
        })?;
        let (Some(salt), number, wait_s) = lock else {
            // It was unlocked in the meantime.
            return Ok(());
        };
        if wait_s > 0 {
            return Err(Refusal::Wait { wait_s }.into());
        }
        if self.key.as_ref().map(|(of, _)| *of) != Some(salt) {
            let opener = self.opener.as_mut().ok_or(Refusal::Locked)?;
            self.key = Some((salt, opener(salt)?));
        }
        let (_, key) = self.key.as_ref().ok_or(Refusal::Locked)?;
        // The permit has the next number, the request the one after it.
        let sequence = self.sequence.wrapping_add(2);
        let signature = key
            .permit(Challenge { salt, number }, sequence, request)
            .ok_or(DeviceError::Unexpected)?;
        let permit = Request::Permit {
            challenge: number,
            signature: &signature,
        };
        self.ask_once(&permit, &|answer| (answer == Answer::Done).then_some(()))
    }

    fn ask_once<Q: Question, R>(&mut self, request: &Q, read: &impl Fn(Q::Answer<'_>) -> Option<R>) -> Result<R, DeviceError> {
        self.sequence = self.sequence.wrapping_add(1);
        let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
        let wire = encode(Kind::Request, self.sequence, request, &mut wire).map_err(|_| DeviceError::Unexpected)?;
        let mut heard = 0;
        for _ in 0..TRIES {
            match self.port.write_all(wire).and_then(|()| self.port.flush()) {
                Err(error) if !is_passing(error.kind()) => return Err(disconnected(&error)),
                // The board discards a partial request.
                Ok(()) | Err(_) => {}
            }
            if let Some(outcome) = self.listen(|frame| outcome::<Q, R>(frame, read), &mut heard)? {
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

    /// Waits for an answer, for one attempt.
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
            // Stop at the deadline even if the sender never stops.
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

/// Whether a retry may succeed.
fn is_passing(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn disconnected(error: &std::io::Error) -> DeviceError {
    DeviceError::Disconnected { why: error.to_string() }
}
