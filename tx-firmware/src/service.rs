//! The serial port's service: bytes in, bytes out.
//!
//! [`Service::receive`] takes one byte at a time, from any port, and returns an answer when a
//! request is complete. It answers each whole request once, immediately, and sends nothing else. No input
//! can make it wait, and an incomplete frame changes only a counter. [`link::serial`] has
//! the messages, `docs/serial.md` the bytes.
//!
//! **A table takes effect whole or not at all.** Its parts are collected in a staging area. Once all have arrived,
//! match the announced CRC and make a valid [`L2aTable`], the table is stored. Once it is stored, it
//! becomes the running one, in one step, with the next reading of the light.

use link::{
    checksum::crc32c,
    fec::Code,
    framing::MESSAGE_MAX,
    intensity::IntensityLimit,
    l2a_table::{L2aTable, image::IMAGE_MAX},
    panel::PanelFrame,
    serial::{
        ANSWER_FRAME_MAX, Answer, BodyError, CHUNK_MAX, Counters, Faults, FrameReader, Hello, Kind, Measured, REQUEST_FRAME_MAX, Refusal,
        Request, SCHEMA, Status, TEST_LEDS_MAX, TablePart, encode, wire_length,
    },
    symbol_rate::SymbolRate,
    waveform::{SymbolTiming, Waveform},
};

use crate::{
    calibration::{Calibration, CalibrationError},
    matrix::LedMatrix,
    schedule::Repeats,
    store::{Memory, StoreError},
    transmitter::Transmitter,
};

#[cfg(feature = "signing")]
mod key;
#[cfg(feature = "signing")]
mod lock;

/// Maximum bytes of an answer on the wire.
pub const ANSWER_MAX: usize = wire_length(ANSWER_FRAME_MAX);

/// The transmitter that the service controls: a [`Transmitter`], or a board that shares its own with interrupts, with a lock around each
/// call.
pub trait Device {
    /// The transmitter's LEDs.
    type Matrix: LedMatrix;

    /// Reads from the transmitter.
    fn read<R>(&self, read: impl FnOnce(&Transmitter<Self::Matrix>) -> R) -> R;

    /// Changes the transmitter.
    fn change<R>(&mut self, change: impl FnOnce(&mut Transmitter<Self::Matrix>) -> R) -> R;
}

impl<M: LedMatrix> Device for Transmitter<M> {
    type Matrix = M;

    fn read<R>(&self, read: impl FnOnce(&Self) -> R) -> R {
        read(self)
    }

    fn change<R>(&mut self, change: impl FnOnce(&mut Self) -> R) -> R {
        change(self)
    }
}

/// The identity that a transmitter reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of the firmware; the first 32 bytes count.
    pub firmware: &'static str,
    /// Name of the board; the first 32 bytes count.
    pub board: &'static str,
}

/// The received part of a new table.
#[derive(Debug)]
struct Staging {
    image: [u8; IMAGE_MAX],
    length: u16,
    crc: u32,
    received: u16,
}

/// One serial port's service.
///
/// ```
/// # mod flash { include!("../tests/flash/mod.rs"); }
/// # use link::l2a_table::L2aTable;
/// # use tx_firmware::{ambient::Smoothing, calibration::{BENCH, Calibration}, matrix::RecordingMatrix};
/// # use tx_firmware::{store::Store, transmitter::Transmitter};
/// use link::serial::{ANSWER_FRAME_MAX, Answer, FrameReader, Kind, Request, encode};
/// use tx_firmware::service::{ANSWER_MAX, Identity, Service};
/// # let calibration = Calibration::new(BENCH)?;
/// # let mut transmitter = Transmitter::new(RecordingMatrix::default(), calibration, L2aTable::default(), Smoothing::default());
/// # let mut store = Store::new(flash::Flash::<4>::new(), 0..8192)?;
/// let mut service = Service::new(Identity { firmware: "1.0.0", board: "bench" });
///
/// let (mut wire, mut answer) = ([0; 64], [0; ANSWER_MAX]);
/// let request = encode(Kind::Request, 1, &Request::Hello, &mut wire)?;
/// let mut reader = FrameReader::<ANSWER_FRAME_MAX>::new();
/// let mut board = None;
/// for &byte in request {
///     let Some(answer) = service.receive(byte, &mut transmitter, &mut store, &mut answer) else { continue };
///     for &byte in answer {
///         if let Some(Ok(frame)) = reader.push(byte) && let Ok(Answer::Hello(hello)) = frame.answer() {
///             board = Some(hello.board.to_owned());
///         }
///     }
/// }
/// assert_eq!(board.as_deref(), Some("bench"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Service {
    identity: Identity,
    reader: FrameReader<REQUEST_FRAME_MAX>,
    conversation: Conversation,
}

/// The state of a service between requests.
#[derive(Debug)]
struct Conversation {
    staging: Option<Staging>,
    /// The sequence number of the last accepted message.
    message: Option<u32>,
    counters: Counters,
    #[cfg(feature = "signing")]
    permits: lock::Permits,
}

impl Service {
    /// A service that has received nothing; `const`, so that it can be a static.
    pub const fn new(identity: Identity) -> Self {
        Self {
            identity,
            reader: FrameReader::new(),
            conversation: Conversation {
                staging: None,
                message: None,
                counters: Counters {
                    frames: 0,
                    bad_frames: 0,
                    refusals: 0,
                    symbols: 0,
                    lost_symbols: 0,
                    readings: 0,
                    missed_readings: 0,
                },
                #[cfg(feature = "signing")]
                permits: lock::Permits::NONE,
            },
        }
    }

    /// Takes one byte from the port, and returns the answer if it completes a request.
    ///
    /// All but [`Request::CommitTable`], [`Request::WriteCalibration`], [`Request::WriteSymbolRate`], [`Request::WriteIntensityLimit`],
    /// [`Request::WriteCarrier`] and the requests about keys and locks are answered without waiting. These wait for `memory`,
    /// and so does [`Request::Send`] if messages are signed, which also waits for the signature. If the ports are locked, each request that
    /// changes something waits for the verification of its permit. The first
    /// [`Request::ReadProgramHash`] waits until the program is hashed.
    pub fn receive<'a>(
        &mut self,
        byte: u8,
        device: &mut impl Device,
        memory: &mut impl Memory,
        answer: &'a mut [u8; ANSWER_MAX],
    ) -> Option<&'a [u8]> {
        let conversation = &mut self.conversation;
        let frame = match self.reader.push(byte)? {
            Ok(frame) => frame,
            Err(_) => {
                count(&mut conversation.counters.bad_frames);
                return None;
            }
        };
        count(&mut conversation.counters.frames);
        let sequence = frame.sequence();
        let table;
        let program;
        let outcome = match frame.request() {
            // An echo of an answer: the other end is not a computer.
            Err(BodyError::OtherKind) => return None,
            Err(error) => Err(error.into()),
            Ok(Request::Hello) => Ok(Answer::Hello(self.identity.hello())),
            Ok(Request::ReadTable { offset }) => {
                table = device.read(|transmitter| transmitter.table().clone());
                Ok(Answer::Table(part(&table, offset)))
            }
            Ok(Request::ReadProgramHash) => {
                program = memory.program_hash();
                let hash = program.as_ref().map(|program| Answer::ProgramHash {
                    length: program.length,
                    sha256: &program.sha256,
                });
                hash.ok_or(Refusal::Unknown)
            }
            #[cfg(feature = "signing")]
            Ok(request) => conversation.act_if_permitted(&frame, request, device, memory),
            #[cfg(not(feature = "signing"))]
            Ok(request) => conversation.act(sequence, request, device, memory),
        };
        let message = outcome.unwrap_or_else(|refusal| {
            count(&mut conversation.counters.refusals);
            #[cfg(feature = "defmt")]
            defmt::warn!("request {=u32} refused: {}", sequence, refusal);
            Answer::Refused(refusal)
        });
        encode(Kind::Answer, sequence, &message, answer).ok()
    }
}

impl Conversation {
    fn act(
        &mut self,
        sequence: u32,
        request: Request<'_>,
        device: &mut impl Device,
        memory: &mut impl Memory,
    ) -> Result<Answer<'static>, Refusal> {
        match request {
            Request::Hello | Request::ReadTable { .. } | Request::ReadProgramHash => Err(Refusal::Unknown),
            Request::Status => Ok(Answer::Status(self.status(device.read(Transmitter::status)))),
            Request::BeginTable { length, crc } => self.begin(length, crc),
            Request::WriteTable { offset, bytes } => self.write(offset, bytes),
            Request::CommitTable { crc } => self.commit(crc, device, memory),
            Request::RollBackTable => {
                self.staging = None;
                Ok(Answer::Done)
            }
            Request::ReadCalibration => Ok(Answer::Calibration(
                device.read(|transmitter| *transmitter.calibration().measured()),
            )),
            Request::WriteCalibration(measured) => calibrate(measured, device, memory),
            Request::Send { repeats, message } => self.send(sequence, repeats, message, device, memory),
            Request::StopSending => {
                device.change(Transmitter::stop);
                Ok(Answer::Done)
            }
            Request::ResetCounters => {
                self.counters = Counters::default();
                device.change(Transmitter::reset_counters);
                Ok(Answer::Done)
            }
            Request::ReadSymbolRate => Ok(symbol_rate(device)),
            Request::WriteSymbolRate { millihertz } => change_rate(millihertz, device, memory),
            Request::ReadIntensityLimit => Ok(intensity_limit(device)),
            Request::WriteIntensityLimit { most_mcd, led_diameter_um } => change_limit([most_mcd, led_diameter_um], device, memory),
            Request::ReadCarrier => Ok(carrier(device)),
            Request::WriteCarrier { millihertz, cycles } => change_carrier(millihertz, cycles, device, memory),
            Request::TestPanel { bits, share, time_ms } => test(PanelFrame::from_bits(bits), share, time_ms, device),
            Request::ReadSensor => Ok(device.read(Transmitter::sensor)),
            #[cfg(feature = "signing")]
            Request::ReadKey | Request::WriteKey { .. } | Request::EraseKey => key::act(request, device, memory),
            #[cfg(not(feature = "signing"))]
            Request::ReadKey | Request::WriteKey { .. } | Request::EraseKey => Err(Refusal::NoSigning),
            #[cfg(feature = "signing")]
            Request::ReadLock | Request::WriteLock { .. } | Request::RemoveLock => lock::act(request, device, memory),
            #[cfg(feature = "signing")]
            Request::Permit { challenge, signature } => self.permits.announce(challenge, signature),
            #[cfg(not(feature = "signing"))]
            Request::ReadLock | Request::WriteLock { .. } | Request::RemoveLock | Request::Permit { .. } => Err(Refusal::NoLock),
        }
    }

    fn status(&self, status: Status) -> Status {
        Status {
            counters: Counters {
                frames: self.counters.frames,
                bad_frames: self.counters.bad_frames,
                refusals: self.counters.refusals,
                ..status.counters
            },
            ..status
        }
    }

    fn begin(&mut self, length: u16, crc: u32) -> Result<Answer<'static>, Refusal> {
        if length == 0 || usize::from(length) > IMAGE_MAX {
            let most = IMAGE_MAX as u16;
            return Err(Refusal::TableLength { length, most });
        }
        self.staging = Some(Staging {
            image: [0; IMAGE_MAX],
            length,
            crc,
            received: 0,
        });
        Ok(Answer::Staged { received: 0 })
    }

    fn write(&mut self, offset: u16, bytes: &[u8]) -> Result<Answer<'static>, Refusal> {
        let staging = self.staging.as_mut().ok_or(Refusal::NotBegun)?;
        let expected = staging.received;
        let (from, to) = (usize::from(offset), usize::from(offset) + bytes.len());
        let place = staging.image[..usize::from(staging.length)].get_mut(from..to);
        match place {
            Some(place) if offset <= expected => place.copy_from_slice(bytes),
            _ => return Err(Refusal::Offset { expected }),
        }
        staging.received = expected.max(to as u16);
        Ok(Answer::Staged {
            received: staging.received,
        })
    }

    fn commit(&mut self, crc: u32, device: &mut impl Device, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
        let Some(staging) = &self.staging else {
            // This may repeat a commit whose answer was lost; meanwhile another port may have replaced the table.
            let is_in_use =
                |transmitter: &Transmitter<_>| transmitter.table().crc() == crc && !transmitter.faults().contains(Faults::NO_TABLE);
            return if device.read(is_in_use) {
                Ok(Answer::Committed { crc })
            } else {
                Err(Refusal::NotBegun)
            };
        };
        let table = staging.table(crc)?;
        memory.save_table(&table)?;
        device.change(|transmitter| transmitter.set_table(table));
        self.staging = None;
        Ok(Answer::Committed { crc })
    }

    fn send(
        &mut self,
        sequence: u32,
        repeats: Option<u32>,
        message: &[u8],
        device: &mut impl Device,
        memory: &mut impl Memory,
    ) -> Result<Answer<'static>, Refusal> {
        if self.message != Some(sequence) {
            let repeats = repeats.map_or(Repeats::Forever, Repeats::Times);
            let code = Code::for_length(message.len());
            // A message that cannot be shown uses no counter. The current message continues while the new one is signed.
            let is_possible = (1..=MESSAGE_MAX).contains(&message.len());
            let signature = if is_possible { memory.sign(message)? } else { None };
            let sent = device.change(|transmitter| match signature {
                #[cfg(feature = "signing")]
                Some(signature) => transmitter.send_signed(message, code, repeats, signature),
                _ => transmitter.send(message, code, repeats),
            });
            sent.map_err(|_| Refusal::MessageLength {
                length: message.len() as u16,
                most: MESSAGE_MAX as u16,
            })?;
            self.message = Some(sequence);
        }
        Ok(Answer::Done)
    }
}

impl Staging {
    /// The received table, if it is complete and has that CRC.
    fn table(&self, crc: u32) -> Result<L2aTable, Refusal> {
        if self.received != self.length {
            return Err(Refusal::Incomplete {
                received: self.received,
                length: self.length,
            });
        }
        let image = &self.image[..usize::from(self.length)];
        let found = crc32c(&[image]);
        for expected in [self.crc, crc] {
            if found != expected {
                return Err(Refusal::TableCrc { found, expected });
            }
        }
        L2aTable::from_image(image).map_err(|_| Refusal::TableInvalid)
    }
}

impl Identity {
    fn hello(&self) -> Hello<'static> {
        Hello {
            schema: SCHEMA,
            firmware: shortened(self.firmware),
            board: shortened(self.board),
            chunk_max: CHUNK_MAX as u16,
            message_max: MESSAGE_MAX as u16,
        }
    }
}

/// A name, truncated to fit into an answer.
fn shortened(name: &'static str) -> &'static str {
    const MOST: usize = 32;
    let end = (0..=MOST.min(name.len())).rev().find(|&end| name.is_char_boundary(end));
    name.get(..end.unwrap_or(0)).unwrap_or("")
}

/// The part of a table's image from `offset` on; nothing beyond its end.
fn part(table: &L2aTable, offset: u16) -> TablePart<'_> {
    let image = table.image();
    let from = usize::from(offset).min(image.len());
    let to = (from + CHUNK_MAX).min(image.len());
    TablePart {
        length: image.len() as u16,
        crc: table.crc(),
        offset,
        bytes: &image[from..to],
    }
}

fn calibrate(measured: Measured, device: &mut impl Device, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    let calibration = Calibration::new(measured).map_err(|error| Refusal::Calibration {
        value: match error {
            CalibrationError::LuminanceFull(_) => 0,
            CalibrationError::ShortestPulse { .. } => 1,
            CalibrationError::PwmPeriod(_) => 2,
            CalibrationError::Reflectance(_) => 3,
            CalibrationError::Interval(_) => 4,
            CalibrationError::SensorGain(_) => 5,
            CalibrationError::LowCurrentShare(_) => 6,
        },
    })?;
    memory.save_calibration(&calibration)?;
    device.change(|transmitter| transmitter.set_calibration(calibration));
    Ok(Answer::Done)
}

fn test(panel: PanelFrame, share: u8, time_ms: u16, device: &mut impl Device) -> Result<Answer<'static>, Refusal> {
    if panel.count_on() > TEST_LEDS_MAX {
        let [on, most] = [panel.count_on(), TEST_LEDS_MAX].map(|leds| leds as u8);
        return Err(Refusal::TestPanel { on, most });
    }
    // If the LEDs reject the duty, the next reading tries again.
    let _ = device.change(|transmitter| transmitter.test(panel, share, time_ms).is_ok());
    Ok(Answer::Done)
}

/// Another rate with the current waveform.
fn change_rate(millihertz: u32, device: &mut impl Device, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    let waveform = device.read(Transmitter::timing).waveform();
    let rate = SymbolRate::from_millihertz(millihertz).ok();
    let timing = rate.and_then(|rate| SymbolTiming::new(rate, waveform).ok()).ok_or_else(|| {
        let [least, most] = waveform.rates_millihertz();
        Refusal::SymbolRate { millihertz, least, most }
    })?;
    change_timing(timing, device, memory)?;
    Ok(symbol_rate(device))
}

fn symbol_rate(device: &impl Device) -> Answer<'static> {
    Answer::SymbolRate {
        millihertz: device.read(Transmitter::symbol_rate).millihertz(),
    }
}

fn change_carrier<D: Device>(millihertz: u32, cycles: u16, device: &mut D, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    let [least, most] = Waveform::STILL.rates_millihertz();
    let rate = SymbolRate::from_millihertz(millihertz).map_err(|_| Refusal::SymbolRate { millihertz, least, most })?;
    let waveform = Waveform::new(cycles.into()).ok();
    let timing = waveform.and_then(|waveform| SymbolTiming::new(rate, waveform).ok());
    let timing = timing.ok_or(Refusal::Carrier { millihertz, cycles })?;
    if cycles != 0 && !D::Matrix::SHOWS_CARRIER {
        return Err(Refusal::NoLatch);
    }
    change_timing(timing, device, memory)?;
    Ok(carrier(device))
}

fn carrier(device: &impl Device) -> Answer<'static> {
    let timing = device.read(Transmitter::timing);
    Answer::Carrier {
        millihertz: timing.rate().millihertz(),
        cycles: timing.waveform().cycles(),
    }
}

fn change_timing(timing: SymbolTiming, device: &mut impl Device, memory: &mut impl Memory) -> Result<(), Refusal> {
    memory.save_timing(timing)?;
    device.change(|transmitter| transmitter.set_timing(timing));
    Ok(())
}

fn change_limit(numbers: [u32; 2], device: &mut impl Device, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    let [most_mcd, led_diameter_um] = numbers;
    let limit = IntensityLimit::from_numbers(numbers).map_err(|_| Refusal::IntensityLimit { most_mcd, led_diameter_um })?;
    memory.save_intensity_limit(limit)?;
    device.change(|transmitter| transmitter.set_intensity_limit(limit));
    Ok(intensity_limit(device))
}

fn intensity_limit(device: &impl Device) -> Answer<'static> {
    let [most_mcd, led_diameter_um] = IntensityLimit::numbers(device.read(|transmitter| transmitter.calibration().limit()));
    Answer::IntensityLimit { most_mcd, led_diameter_um }
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        #[cfg(feature = "defmt")]
        defmt::error!("store: {}", error);
        match error {
            StoreError::NoSigning => Self::NoSigning,
            StoreError::NoCounter => Self::NoCounter,
            StoreError::NoLock => Self::NoLock,
            StoreError::Addresses { .. } | StoreError::Flash | StoreError::Damaged => Self::Store,
        }
    }
}

/// Adds one, saturating.
fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
