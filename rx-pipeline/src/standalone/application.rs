//! The program of a standalone receiver.

use core::array;

use super::camera::{CameraError, CameraMode, CameraModeError, Exposure};
use super::exposure::{self, BRACKET_FRAMES, Levels};
use super::follow::{Follow, Sighting};
use super::last_message::LastMessage;
use super::message::{CameraSettings, Counters, Fault, Message, Status, Trouble, WireReading};
use super::numbering::Numbering;
use super::picture::Picture;
use super::range::range_pitches;
use super::service::{IncomingRequest, Service, State};
use super::text::{self, PrintedState};
use super::trust::{Trust, TrustError};
use super::{Board, Machine};
use crate::corners::Corners;
use crate::frame::Frame;
use crate::pose::PanelSize;
use crate::profile::{Profile, Stage};
use link::framing::Event;
use link::panel::SIDE;
use link::signing::Verdict;

/// Time without text after a request, µs: a computer that sends requests receives only answers.
pub const QUIET_US: u64 = 5_000_000;
/// Bytes read from the port between two frames, at most, so that a flood of bytes does not stop the reading of frames.
const BYTES_AT_ONCE: usize = 512;
/// Time for which the lamp blinks after a message, µs.
const MESSAGE_SHOWN_US: u64 = 1_500_000;
/// Frames between two changes of the exposure while a panel is followed, because a change takes two frames to show.
const SETTLING_FRAMES: u32 = 6;
/// Interval between attempts to set up a camera that streams but did not accept its settings, µs.
const SET_UP_AGAIN_US: u64 = 1_000_000;
/// The initial exposure, in lines at gain 1.
const FIRST_SENSITIVITY: u32 = 60;

/// The settings of an application.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The camera's mode.
    pub mode: CameraMode,
    /// The panel's symbol rate in thousandths of a symbol a second: above 0, at most one symbol a frame.
    pub symbol_millihertz: u32,
    /// Whether the watchdog or a panic ended the previous run.
    pub was_reset: bool,
}

/// Why there is no application with these settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ApplicationError {
    /// A value of the camera's mode is out of its range.
    #[error(transparent)]
    Mode(#[from] CameraModeError),
    /// More symbols than frames, or none.
    #[error("{millihertz} thousandths of a symbol a second cannot be read: give above 0 and at most {most}, one symbol a frame")]
    SymbolRate {
        /// The requested rate.
        millihertz: u32,
        /// The maximum.
        most: u32,
    },
}

/// The receiver's program: frames in, text out, with control of the camera, the lamp and the port.
///
/// Call [`start`](Self::start) once, [`frame`](Self::frame) with each frame, and [`no_frame`](Self::no_frame) after some time without one.
/// Each of them also serves the port.
pub struct Application<F> {
    follower: F,
    settings: Settings,
    is_following: bool,
    trouble: Option<Trouble>,
    printed: PrintedState,
    /// Whether the camera has accepted its settings.
    is_set_up: bool,
    set_up_us: u64,
    pub(super) exposure: Exposure,
    by_mean: Exposure,
    pub(super) levels: Levels,
    /// Frames since the last change of the exposure, or since the search began.
    steady_frames: u32,
    numbering: Numbering,
    /// The last sighting of the panel, and the number of its frame.
    sighting: Option<(u64, Sighting)>,
    /// The transmitted size of the panel.
    size: Option<PanelSize>,
    trust: Trust,
    /// Why the list of trusted keys is unusable, if it is.
    unusable_keys: Option<TrustError>,
    counters: Counters,
    frame_us: u32,
    longest_us: u32,
    message: LastMessage,
    picture: Picture,
    pub(super) service: Service,
}

/// Reports to the board during a frame that the program is alive.
struct Pulse<'a, B>(&'a mut B);

impl<B: Machine> Profile for Pulse<'_, B> {
    fn begins(&mut self, _: Stage) {
        self.0.alive();
    }

    fn ends(&mut self, _: Stage) {}
}

impl<F: Follow> Application<F> {
    /// An application before its first frame.
    ///
    /// # Errors
    /// [`ApplicationError`] if a setting is out of its range.
    pub fn new(mut follower: F, settings: Settings) -> Result<Self, ApplicationError> {
        let Settings {
            mode, symbol_millihertz, ..
        } = settings;
        let mode = mode.checked()?;
        let begun = symbols_per_frame(symbol_millihertz, &mode).and_then(|rate| follower.begin(rate));
        begun.ok_or(ApplicationError::SymbolRate {
            millihertz: symbol_millihertz,
            most: most_millihertz(&mode),
        })?;
        let exposure = exposure::of_sensitivity(FIRST_SENSITIVITY, &mode);
        Ok(Self {
            follower,
            settings,
            is_following: false,
            trouble: None,
            printed: PrintedState::default(),
            is_set_up: false,
            set_up_us: 0,
            exposure,
            by_mean: exposure,
            levels: Levels::default(),
            steady_frames: 0,
            numbering: Numbering::new(mode.period_us()),
            sighting: None,
            size: None,
            trust: Trust::default(),
            unusable_keys: None,
            counters: Counters::default(),
            frame_us: 0,
            longest_us: 0,
            message: LastMessage::default(),
            picture: Picture::EMPTY,
            service: Service::new(),
        })
    }

    /// Whether it follows a panel; otherwise it searches.
    pub fn is_following(&self) -> bool {
        self.is_following
    }

    /// The current fault, if any.
    pub fn trouble(&self) -> Option<Trouble> {
        self.trouble
    }

    /// The camera's exposure.
    pub fn exposure(&self) -> Exposure {
        self.exposure
    }

    /// The counters.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The last message; empty before the first.
    pub fn message(&self) -> &[u8] {
        &self.message.bytes
    }

    /// Verifies signed messages by these keys from now on. At first there are none, and signatures are reported without being checked; so
    /// they are with an unusable list, which is a fault from the start on.
    pub fn trust(&mut self, keys: Result<Trust, TrustError>) {
        self.unusable_keys = keys.as_ref().err().copied();
        self.trust = keys.unwrap_or_default();
    }

    /// Sets the camera up; reports a fault if that fails.
    pub fn start(&mut self, board: &mut impl Board) {
        let started = self.set_up(board);
        self.set_fault(started.err().map(Fault::Camera), board.micros());
        self.serve(board);
    }

    /// Handles a time without a whole frame: reports it, and resets the camera.
    pub fn no_frame(&mut self, board: &mut impl Board) {
        let lacking = match self.numbering.cut_since(board.cut_short()) {
            0 => Fault::NoFrames,
            _ => Fault::NoWholeFrames,
        };
        let fault = self.set_up(board).map_or_else(Fault::Camera, |()| lacking);
        self.set_fault(Some(fault), board.micros());
        self.lose();
        self.serve(board);
    }

    fn set_up(&mut self, board: &mut impl Board) -> Result<(), CameraError> {
        add(&mut self.counters.starts, 1);
        self.numbering.interrupt();
        let started = board.start(self.exposure);
        (self.is_set_up, self.set_up_us) = (started.is_ok(), board.micros());
        started
    }

    /// Sets or clears the current fault. Without another one, unusable keys remain.
    fn set_fault(&mut self, fault: Option<Fault>, now_us: u64) {
        let fault = fault.or(self.unusable_keys.map(Fault::Keys));
        if self.fault() != fault {
            let since_ms = now_us / 1000;
            self.trouble = fault.map(|fault| Trouble { fault, since_ms });
        }
    }

    pub(super) fn fault(&self) -> Option<Fault> {
        self.trouble.map(|trouble| trouble.fault)
    }

    /// Processes a frame whose last line was read out at `ended_us`. Frames of another size than the camera's are ignored.
    // Not inlined, so that it can be timed.
    #[inline(never)]
    pub fn frame(&mut self, pixels: &[u8], ended_us: u64, board: &mut impl Board) {
        let (width, height) = (self.settings.mode.width, self.settings.mode.height);
        let frame = Frame::new(pixels, width, height);
        if frame.is_ok() {
            self.clear_frame_faults(board);
        }
        let began_us = board.micros();
        if let Ok(frame) = frame {
            let number = self.count(ended_us, board.cut_short());
            self.look(number, &frame, board);
            self.expose(&frame, board);
            if !self.service.keeps_picture(began_us) {
                let corners = self.corners();
                self.picture.draw(number, &frame, corners.as_ref());
            }
        }
        let took_us = board.micros().saturating_sub(began_us);
        self.frame_us = took_us.min(u32::MAX.into()) as u32;
        self.longest_us = self.longest_us.max(self.frame_us);
        self.serve(board);
        self.numbering.was_busy(board.micros().saturating_sub(began_us));
    }

    /// Clears faults about missing frames after a whole one. Retries a camera that could not be set up.
    fn clear_frame_faults(&mut self, board: &mut impl Board) {
        let now_us = board.micros();
        if self.is_set_up {
            if matches!(self.fault(), Some(Fault::NoFrames | Fault::NoWholeFrames)) {
                self.set_fault(None, now_us);
            }
        } else if now_us.saturating_sub(self.set_up_us) >= SET_UP_AGAIN_US {
            let started = self.set_up(board);
            self.set_fault(started.err().map(Fault::Camera), board.micros());
        }
    }

    /// The number of a frame, by its end. Counts dropped frames.
    fn count(&mut self, ended_us: u64, cut_short: u32) -> u64 {
        let (number, passed_by) = self.numbering.next(ended_us, cut_short);
        add(&mut self.counters.passed_by, passed_by);
        add(&mut self.counters.frames, 1);
        number
    }

    /// Sets whether a panel is followed.
    fn follow(&mut self, is_following: bool) {
        match (self.is_following, is_following) {
            (false, true) => add(&mut self.counters.found, 1),
            (true, false) => add(&mut self.counters.lost, 1),
            _ => return,
        }
        self.is_following = is_following;
        (self.steady_frames, self.by_mean) = (0, self.exposure);
    }

    fn look(&mut self, number: u64, frame: &Frame<'_>, board: &mut impl Board) {
        let seen = self.follower.frame(number, frame, &mut Pulse(board));
        let (is_following, sighting) = (seen.is_following, seen.sighting);
        let verdict = match seen.event {
            Event::Delivered(delivery) => {
                add(&mut self.counters.messages, 1);
                add(&mut self.counters.corrected_bits, delivery.corrected_bits);
                self.message.keep(&delivery, board.micros());
                if !self.service.is_asked(self.message.at_us, QUIET_US) {
                    text::write_message(&self.message.bytes, board);
                }
                (!self.trust.is_empty()).then_some(Verdict::Unproven)
            }
            Event::Signed(signed) => Some(self.trust.verdict(&signed)),
            Event::Header { unsigned: true, .. } => self.message.is_unproven().then_some(Verdict::Unsigned),
            Event::Geometry(told) => {
                self.size = Some(told.into());
                None
            }
            _ => None,
        };
        if let Some(verdict) = verdict {
            self.message.verdict = verdict;
            if !self.service.is_asked(board.micros(), QUIET_US) {
                text::write_verdict(&verdict, board);
            }
        }
        self.follow(is_following);
        if let Some(sighting) = sighting {
            add(&mut self.counters.readings, 1);
            self.sighting = Some((number, sighting));
        } else if !is_following {
            self.lose();
        }
    }

    /// The last known position of the panel.
    pub(super) fn corners(&self) -> Option<Corners> {
        self.sighting.map(|(_, sighting)| sighting.corners)
    }

    /// Forgets the panel: the next one may be another.
    fn lose(&mut self) {
        self.follow(false);
        (self.sighting, self.size) = (None, None);
    }

    /// Controls the exposure.
    fn expose(&mut self, frame: &Frame<'_>, board: &mut impl Board) {
        let corners = self.corners();
        self.levels = match &corners {
            Some(corners) => Levels::of_panel(frame, corners),
            None => Levels::of_frame(frame),
        };
        self.steady_frames = self.steady_frames.saturating_add(1);
        let (mode, now) = (&self.settings.mode, self.exposure);
        let wanted = if corners.is_some() {
            let is_due = self.steady_frames >= SETTLING_FRAMES;
            is_due.then(|| exposure::for_panel(now, self.levels, mode))
        } else {
            let turn = self.steady_frames / BRACKET_FRAMES;
            let is_due = self.steady_frames.is_multiple_of(BRACKET_FRAMES);
            is_due.then(|| exposure::for_search(&mut self.by_mean, now, self.levels, turn, mode))
        };
        // After a failed write the exposure is written again.
        let is_unsure = matches!(self.fault(), Some(Fault::Camera(_)));
        let Some(wanted) = wanted.filter(|wanted| self.is_set_up && (is_unsure || *wanted != now)) else {
            return;
        };
        let exposed = board.expose(wanted);
        if exposed.is_err() || is_unsure {
            self.set_fault(exposed.err().map(Fault::Camera), board.micros());
        }
        match exposed {
            Ok(()) => {
                self.exposure = wanted;
                if corners.is_some() {
                    self.steady_frames = 0;
                } else {
                    self.follower.expect_another_exposure();
                }
            }
            // Not in each frame, because a bus that hangs takes time.
            Err(_) if corners.is_some() => self.steady_frames = 0,
            Err(_) => {}
        }
    }

    /// Serves the port and the lamp, and reports to the board that the program is alive. Answers at most one request; others wait.
    pub fn serve(&mut self, board: &mut impl Board) {
        board.alive();
        for _ in 0..BYTES_AT_ONCE {
            let Some(byte) = board.read() else { break };
            let now_us = board.micros();
            if let Some(received) = self.service.receive(byte, now_us) {
                if let Some(millihertz) = received.symbol_millihertz() {
                    self.set_symbol_rate(millihertz);
                }
                self.answer(&received, now_us, board);
                // One at a time: an answer may take longer than a frame, and an endless series of requests would stop all else.
                break;
            }
        }
        let now_us = board.micros();
        if !self.service.is_asked(now_us, QUIET_US) {
            self.printed.update(self.is_following, self.fault(), board);
        }
        board.lamp(self.lamp(now_us));
    }

    fn set_symbol_rate(&mut self, millihertz: u32) {
        let rate = symbols_per_frame(millihertz, &self.settings.mode);
        let is_new = millihertz != self.settings.symbol_millihertz;
        if is_new && rate.and_then(|rate| self.follower.begin(rate)).is_some() {
            self.settings.symbol_millihertz = millihertz;
            self.lose();
        }
    }

    fn answer<B: Board>(&mut self, received: &IncomingRequest, now_us: u64, board: &mut B) {
        let Settings {
            mode,
            symbol_millihertz,
            was_reset,
        } = self.settings;
        let reading = self.reading();
        let Self {
            service, picture, message, ..
        } = self;
        let state = State {
            now_us,
            board: B::BOARD,
            firmware: B::FIRMWARE,
            status: Status {
                uptime_ms: now_us / 1000,
                is_following: self.is_following,
                trouble: self.trouble,
                was_reset,
                corners: reading.map(|reading| reading.corners),
                confidence: reading.map_or(0.0, |reading| reading.confidence),
                symbol_millihertz,
                frame_us: self.frame_us,
                longest_us: self.longest_us,
                stack_bytes: board.stack_bytes(),
                counters: Counters {
                    cut_short: board.cut_short(),
                    requests: service.requests,
                    bad_frames: service.bad_frames,
                    ..self.counters
                },
            },
            camera: CameraSettings {
                size: [mode.width as u16, mode.height as u16],
                period_us: mode.period_us(),
                lines: self.exposure.lines,
                exposure_us: mode.exposure_us(self.exposure),
                gain_log2: self.exposure.gain_log2,
                levels: [self.levels.bright, self.levels.dark],
            },
            message: Message {
                count: self.counters.messages,
                bytes: &message.bytes,
                age_ms: now_us.saturating_sub(message.at_us) / 1000,
                frames: message.frames,
                corrected_bits: message.corrected_bits,
                verdict: message.verdict,
            },
            reading,
            picture,
            most_millihertz: most_millihertz(&mode),
        };
        board.write(service.answer(received, &state));
    }

    /// The last reading of the followed panel.
    fn reading(&self) -> Option<WireReading> {
        let (frame, sighting) = self.sighting.filter(|_| self.is_following)?;
        Some(WireReading {
            frame,
            bits: sighting.bits.bits(),
            soft: array::from_fn(|row| array::from_fn(|column| sighting.soft.0[SIDE * row + column])),
            is_mixed: sighting.is_mixed,
            corners: sighting.corners.points(),
            confidence: sighting.confidence,
            range_pitches: range_pitches(&sighting.corners, &self.settings.mode),
            pitch_m: self.size.map(|size| size.pitch_m() as f32),
        })
    }

    /// Whether the lamp is lit: a short flash each second while searching, steadily while following, quickly blinking after a message, and
    /// slowly during a fault.
    fn lamp(&self, now_us: u64) -> bool {
        let has_message = self.counters.messages > 0 && now_us.saturating_sub(self.message.at_us) < MESSAGE_SHOWN_US;
        let lit = |on_us: u64, period_us: u64| now_us % period_us < on_us;
        match self.trouble {
            Some(_) => lit(1_000_000, 2_000_000),
            None if has_message => lit(60_000, 120_000),
            None => self.is_following || lit(80_000, 1_000_000),
        }
    }
}

fn add(counter: &mut u32, count: u32) {
    *counter = counter.saturating_add(count);
}

/// The greatest symbol rate, in thousandths of a symbol a second: one symbol a frame.
const fn most_millihertz(mode: &CameraMode) -> u32 {
    1_000_000_000 / mode.period_us()
}

fn symbols_per_frame(millihertz: u32, mode: &CameraMode) -> Option<f32> {
    let in_range = (1..=most_millihertz(mode)).contains(&millihertz);
    in_range.then(|| (millihertz as f32 * mode.period_us() as f32 * 1e-9).min(1.0))
}
