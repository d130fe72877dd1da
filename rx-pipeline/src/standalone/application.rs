//! What runs on a receiver that stands alone.

use core::fmt::Write;

use super::desk::{Desk, Facts};
use super::exposure::{self, BRACKET_FRAMES, Levels};
use super::follow::{Follow, Sighting};
use super::message::{CameraSettings, Counters, Fault, Message, State, Status};
use super::picture::Picture;
use super::{Board, Machine, Port};
use crate::corners::Corners;
use crate::frame::Frame;
use crate::hm01b0::{Exposure, Mode};
use crate::profile::{Profile, Stage};
use link::framing::MESSAGE_MAX;

/// After a request text is held back so long, µs: a computer that asks gets answers alone.
pub const QUIET_US: u64 = 5_000_000;
/// Bytes taken from the port between two frames, at most: a flood does not keep frames from being read.
const BYTES_AT_ONCE: usize = 512;
/// The lamp blinks so long after a message, µs.
const MESSAGE_SHOWN_US: u64 = 1_500_000;
/// Frames between two changes of the exposure while a panel is followed: a change takes two frames to show.
const SETTLING_FRAMES: u32 = 6;
/// The exposure to begin with, in lines at gain 1.
const FIRST_SENSITIVITY: u32 = 60;

/// What an application is told before it starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How the camera reads its frames.
    pub mode: Mode,
    /// Thousandths of a symbol a second that panels show: above 0, at most one a frame.
    pub symbol_millihertz: u32,
    /// Whether the watchdog or a panic ended what ran before.
    pub was_reset: bool,
}

/// Why there is no application with these settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ApplicationError {
    /// More symbols than frames, or none.
    #[error(
        "{millihertz} thousandths of a symbol a second: above 0 and at most {most} can be read, one in each frame"
    )]
    SymbolRate {
        /// The rate asked for.
        millihertz: u32,
        /// The most.
        most: u32,
    },
}

/// Frames in, text out; and the camera, the lamp and the port looked after.
///
/// Whoever runs it calls [`start`](Self::start) once, [`frame`](Self::frame) with each frame that comes, and
/// [`no_frame`](Self::no_frame) when none has come for some time; each also serves the port.
pub struct Application<F> {
    follower: F,
    settings: Settings,
    state: State,
    said: Option<State>,
    pub(super) exposure: Exposure,
    by_mean: Exposure,
    pub(super) levels: Levels,
    /// Frames since the exposure was changed, or the search began.
    steady_frames: u32,
    last: Option<Last>,
    pub(super) corners: Option<Corners>,
    confidence: f32,
    counters: Counters,
    frame_us: u32,
    longest_us: u32,
    message: heapless::Vec<u8, MESSAGE_MAX>,
    message_us: u64,
    message_frames: u32,
    message_corrected: u32,
    picture: Picture,
    pub(super) desk: Desk,
}

/// The frame before.
#[derive(Clone, Copy)]
struct Last {
    number: u64,
    ended_us: u64,
}

/// Tells the board that the program is alive while a frame is worked on.
struct Pulse<'a, B>(&'a mut B);

impl<B: Machine> Profile for Pulse<'_, B> {
    fn begins(&mut self, _: Stage) {
        self.0.alive();
    }

    fn ends(&mut self, _: Stage) {}
}

impl<F: Follow> Application<F> {
    /// An application that has seen nothing.
    ///
    /// # Errors
    /// [`ApplicationError`] if a setting is out of its range.
    pub fn new(mut follower: F, settings: Settings) -> Result<Self, ApplicationError> {
        let Settings {
            mode,
            symbol_millihertz,
            ..
        } = settings;
        let begun =
            symbols_per_frame(symbol_millihertz, mode).and_then(|rate| follower.begin(rate));
        begun.ok_or(ApplicationError::SymbolRate {
            millihertz: symbol_millihertz,
            most: most_millihertz(mode),
        })?;
        let exposure = exposure::of_sensitivity(FIRST_SENSITIVITY, mode);
        Ok(Self {
            follower,
            settings,
            state: State::Searching,
            said: None,
            exposure,
            by_mean: exposure,
            levels: Levels::default(),
            steady_frames: 0,
            last: None,
            corners: None,
            confidence: 0.0,
            counters: Counters::default(),
            frame_us: 0,
            longest_us: 0,
            message: heapless::Vec::new(),
            message_us: 0,
            message_frames: 0,
            message_corrected: 0,
            picture: Picture::EMPTY,
            desk: Desk::new(),
        })
    }

    /// What it is at.
    pub fn state(&self) -> State {
        self.state
    }

    /// How the camera exposes.
    pub fn exposure(&self) -> Exposure {
        self.exposure
    }

    /// What was counted.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The last message; empty before the first.
    pub fn message(&self) -> &[u8] {
        &self.message
    }

    /// Sets the camera up; says what is wrong if it cannot be.
    pub fn start(&mut self, board: &mut impl Board) {
        add(&mut self.counters.starts, 1);
        self.state = match board.start(self.exposure) {
            Ok(()) => State::Searching,
            Err(error) => State::Faulty(error.into()),
        };
        self.serve(board);
    }

    /// No frame has come for some time: says so, and sets the camera up anew.
    pub fn no_frame(&mut self, board: &mut impl Board) {
        let started = board.start(self.exposure);
        add(&mut self.counters.starts, 1);
        self.state = State::Faulty(started.map_or_else(Into::into, |()| Fault::NoFrames));
        self.corners = None;
        self.serve(board);
    }

    /// Takes in a frame whose last line was read out at `ended_us`. Frames of another size than the camera's are not looked at.
    // Not inlined, so that it can be timed.
    #[inline(never)]
    pub fn frame(&mut self, pixels: &[u8], ended_us: u64, board: &mut impl Board) {
        let began_us = board.micros();
        let (width, height) = (self.settings.mode.width(), self.settings.mode.height());
        if let Ok(frame) = Frame::new(pixels, width, height) {
            let number = self.count(ended_us);
            self.look(number, &frame, board);
            self.expose(&frame, board);
            if !self.desk.keeps_picture(began_us) {
                self.picture.draw(number, &frame, self.corners.as_ref());
            }
        }
        let took_us = board.micros().saturating_sub(began_us);
        self.frame_us = took_us.min(u32::MAX.into()) as u32;
        self.longest_us = self.longest_us.max(self.frame_us);
        self.serve(board);
    }

    /// The number of a frame, by when it ended: those that passed by are counted.
    fn count(&mut self, ended_us: u64) -> u64 {
        let period_us = u64::from(self.settings.mode.period_us());
        let number = self.last.map_or(0, |last| {
            let elapsed = ended_us.saturating_sub(last.ended_us);
            let periods = ((elapsed + period_us / 2) / period_us).max(1);
            add(
                &mut self.counters.passed_by,
                (periods - 1).min(u32::MAX.into()) as u32,
            );
            last.number.saturating_add(periods)
        });
        self.last = Some(Last { number, ended_us });
        add(&mut self.counters.frames, 1);
        number
    }

    fn look(&mut self, number: u64, frame: &Frame<'_>, board: &mut impl Board) {
        let seen = self.follower.frame(number, frame, &mut Pulse(board));
        let was_following = self.state == State::Following;
        self.state = if seen.is_following {
            State::Following
        } else {
            State::Searching
        };
        match (was_following, seen.is_following) {
            (false, true) => add(&mut self.counters.found, 1),
            (true, false) => add(&mut self.counters.lost, 1),
            _ => {}
        }
        if was_following != seen.is_following {
            (self.steady_frames, self.by_mean) = (0, self.exposure);
        }
        if let Some(Sighting {
            corners,
            confidence,
        }) = seen.sighting
        {
            add(&mut self.counters.readings, 1);
            (self.corners, self.confidence) = (Some(corners), confidence);
        } else if !seen.is_following {
            self.corners = None;
        }
        if let Some(delivery) = seen.message {
            self.message.clear();
            // A message is never longer than there is room for.
            let _ = self.message.extend_from_slice(delivery.message);
            self.message_us = board.micros();
            self.message_corrected = delivery.corrected_bits;
            self.message_frames = delivery.last_stamp.saturating_sub(delivery.first_stamp) as u32;
            add(&mut self.counters.messages, 1);
            add(&mut self.counters.corrected_bits, delivery.corrected_bits);
            if !self.desk.is_asked(self.message_us, QUIET_US) {
                write_message(&self.message, board);
            }
        }
    }

    /// Looks after the exposure.
    fn expose(&mut self, frame: &Frame<'_>, board: &mut impl Board) {
        self.levels = match &self.corners {
            Some(corners) => Levels::of_panel(frame, corners),
            None => Levels::of_frame(frame),
        };
        self.steady_frames = self.steady_frames.saturating_add(1);
        let (mode, now) = (self.settings.mode, self.exposure);
        let wanted = if self.corners.is_some() {
            let is_due = self.steady_frames >= SETTLING_FRAMES;
            is_due.then(|| exposure::for_panel(now, self.levels, mode))
        } else {
            let turn = self.steady_frames / BRACKET_FRAMES;
            let is_due = self.steady_frames.is_multiple_of(BRACKET_FRAMES);
            is_due.then(|| exposure::for_search(&mut self.by_mean, now, self.levels, turn, mode))
        };
        let Some(wanted) = wanted.filter(|wanted| *wanted != now) else {
            return;
        };
        match board.expose(wanted) {
            Ok(()) => {
                self.exposure = wanted;
                if self.corners.is_some() {
                    self.steady_frames = 0;
                } else {
                    self.follower.expect_another_exposure();
                }
            }
            Err(error) => self.state = State::Faulty(error.into()),
        }
    }

    /// Serves the port and the lamp, and tells the board that it is alive.
    pub fn serve(&mut self, board: &mut impl Board) {
        board.alive();
        for _ in 0..BYTES_AT_ONCE {
            let Some(byte) = board.read() else { break };
            let now_us = board.micros();
            if let Some(asked) = self.desk.receive(byte, now_us) {
                if let Some(millihertz) = asked.symbol_millihertz() {
                    self.set_symbol_rate(millihertz);
                }
                self.answer(&asked, now_us, board);
            }
        }
        let now_us = board.micros();
        if self.said != Some(self.state) && !self.desk.is_asked(now_us, QUIET_US) {
            write_state(self.state, board);
            self.said = Some(self.state);
        }
        board.lamp(self.lamp(now_us));
    }

    fn set_symbol_rate(&mut self, millihertz: u32) {
        let rate = symbols_per_frame(millihertz, self.settings.mode);
        let is_new = millihertz != self.settings.symbol_millihertz;
        if is_new && rate.and_then(|rate| self.follower.begin(rate)).is_some() {
            self.settings.symbol_millihertz = millihertz;
            self.corners = None;
        }
    }

    fn answer<B: Board>(&mut self, asked: &super::desk::Asked, now_us: u64, board: &mut B) {
        let Settings {
            mode,
            symbol_millihertz,
            was_reset,
        } = self.settings;
        let Self {
            desk,
            picture,
            message,
            ..
        } = self;
        let facts = Facts {
            now_us,
            board: B::BOARD,
            firmware: B::FIRMWARE,
            status: Status {
                uptime_ms: now_us / 1000,
                state: self.state,
                was_reset,
                corners: self.corners.map(|corners| corners.points()),
                confidence: self.confidence,
                symbol_millihertz,
                frame_us: self.frame_us,
                longest_us: self.longest_us,
                stack_bytes: board.stack_bytes(),
                counters: Counters {
                    cut_short: board.cut_short(),
                    requests: desk.requests,
                    bad_frames: desk.bad_frames,
                    ..self.counters
                },
            },
            camera: CameraSettings {
                size: [mode.width() as u16, mode.height() as u16],
                period_us: mode.period_us(),
                lines: self.exposure.lines,
                exposure_us: self.exposure.time_us(),
                gain_log2: self.exposure.gain_log2,
                levels: [self.levels.bright, self.levels.dark],
            },
            message: Message {
                count: self.counters.messages,
                bytes: message,
                age_ms: now_us.saturating_sub(self.message_us) / 1000,
                frames: self.message_frames,
                corrected_bits: self.message_corrected,
            },
            picture,
            most_millihertz: most_millihertz(mode),
        };
        board.write(desk.answer(asked, &facts));
    }

    /// Whether the lamp is lit: a short flash each second while searching, steadily while following, quickly blinking after a message, and
    /// slowly where something is wrong.
    fn lamp(&self, now_us: u64) -> bool {
        let has_message =
            self.counters.messages > 0 && now_us.saturating_sub(self.message_us) < MESSAGE_SHOWN_US;
        let lit = |on_us: u64, period_us: u64| now_us % period_us < on_us;
        match self.state {
            State::Faulty(_) => lit(1_000_000, 2_000_000),
            _ if has_message => lit(60_000, 120_000),
            State::Following => true,
            State::Searching => lit(80_000, 1_000_000),
        }
    }
}

fn add(counter: &mut u32, count: u32) {
    *counter = counter.saturating_add(count);
}

/// Thousandths of a symbol a second: one in each frame.
const fn most_millihertz(mode: Mode) -> u32 {
    1_000_000_000 / mode.period_us()
}

fn symbols_per_frame(millihertz: u32, mode: Mode) -> Option<f32> {
    let in_range = (1..=most_millihertz(mode)).contains(&millihertz);
    in_range.then(|| (millihertz as f32 * mode.period_us() as f32 * 1e-9).min(1.0))
}

/// What has no zeros in it, which answers begin and end with.
struct Text<'a, P>(&'a mut P);

impl<P: Port> Write for Text<'_, P> {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

pub(super) fn write_message(message: &[u8], port: &mut impl Port) {
    let mut text = Text(port);
    let _ = text.write_str("message: ");
    for chunk in message.utf8_chunks() {
        for character in chunk.valid().chars() {
            let _ = if character.is_control() {
                write!(text, "{}", character.escape_default())
            } else {
                text.write_char(character)
            };
        }
        for byte in chunk.invalid() {
            let _ = write!(text, "\\x{byte:02x}");
        }
    }
    let _ = text.write_str("\r\n");
}

fn write_state(state: State, port: &mut impl Port) {
    let mut text = Text(port);
    let _ = match state {
        State::Searching => text.write_str("state: searching\r\n"),
        State::Following => text.write_str("state: following\r\n"),
        State::Faulty(fault) => write!(text, "fault: {fault}\r\n"),
    };
}
