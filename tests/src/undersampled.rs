//! Films of a panel that shows its bits as the phase of a carrier, drawn without the simulator.
//!
//! An LED of bit 1 is On while cos(2π·f·t) is positive, an LED of bit 0 while it is not; cycles of the carrier and symbols begin together.
//! Each line of the sensor receives the light of its own exposure, integrated exactly. The picture is that of [`crate::shake`], from a
//! camera at rest.

use crate::sensor::{Sensor, gauss};
use crate::shake::{self, Drawing, Shake};
use link::fec::Code;
use link::framing::Framer;
use link::panel::{LEDS, PanelFrame, SIDE};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
use rx_pipeline::frame::Frame;
use studies::statistics::Reliability;

/// Pixels along a side of a frame around an 8×8 panel with this pitch (px).
fn side_px(pitch_px: f64) -> usize {
    (8.0 * pitch_px + 84.0) as usize
}
/// Default distance of neighbouring LEDs (px).
pub const PITCH_PX: f64 = 5.5;
/// Numbers of lines of usual rolling shutters.
const USUAL_LINES: [f64; 3] = [720.0, 1080.0, 1080.0];
/// Normal deviates for the noise; each line of a frame starts at another of them.
const DEVIATES: usize = 1 << 16;
/// Resolution of stamps (s).
const STAMP_S: f64 = 1e-5;

/// Frame rates of usual cameras.
const USUAL_FPS: [f64; 16] = [
    24.0, 25.0, 29.97, 30.0, 40.0, 48.0, 50.0, 59.94, 60.0, 75.0, 100.0, 119.88, 120.0, 144.0, 200.0, 240.0,
];
/// Symbol rates of usual transmitters (Hz).
const USUAL_RATES_HZ: [f64; 12] = [100.0, 90.0, 80.0, 60.0, 54.0, 50.0, 45.0, 30.0, 27.0, 25.0, 24.0, 20.0];
/// Distance from its place beyond which a panel was read on another line (pitches).
const LINE_OFF: f64 = 0.6;
/// Number of frames after a message in which a wrong one is looked for.
const AFTERWARDS: usize = 40;

/// A film of a panel with a carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// The seed of the scene, the noise and the jitter.
    pub seed: u64,
    /// Frames a second.
    pub fps: f64,
    /// Seconds of exposure.
    pub exposure_s: f64,
    /// Symbols a second by the transmitter's clock.
    pub symbol_rate_hz: f64,
    /// Cycles of the carrier in a symbol; 0 for a still panel.
    pub cycles: u32,
    /// Deviation of the transmitter's clock, in parts per million; positive is fast.
    pub clock_ppm: f64,
    /// The elapsed part of a symbol at the start of the film.
    pub phase: f64,
    /// Standard deviation of the frames' times, which their stamps include (s).
    pub jitter_s: f64,
    /// Delay of each line's exposure after the one above (s).
    pub line_delay_s: f64,
    /// Distance of neighbouring LEDs (px).
    pub pitch_px: f64,
    /// The encoding and the blur.
    pub sensor: Sensor,
    /// Number of frames.
    pub frames: usize,
    /// The film's first part, if it differs.
    pub change: Option<Change>,
}

/// A film's first part, before the message begins: beacons with another carrier, or with the same carrier at another phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Number of frames in the first part.
    pub frames: usize,
    /// Cycles of its carrier in a symbol; 0 for a still panel.
    pub cycles: u32,
    /// Delay of the carrier relative to the second part (cycles).
    pub late: f64,
}

impl Film {
    /// The film of a camera drawn from that seed: 24 to 240 frames a second, with usual rates or any; carriers of about 450, 1260 or 1440
    /// Hz; exposures of up to 1.44 cycles, except those that see less than a fifth of the contrast; clocks with an error of 500 ppm; in a
    /// quarter of them, stamps with jitter.
    pub fn of_camera(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let fps = match random.random_bool(0.6) {
            true => USUAL_FPS[random.random_range(0..USUAL_FPS.len())],
            false => random.random_range(24.0..240.0),
        };
        let usual = if fps >= 90.0 { 90.0 } else { 0.9 * fps };
        let followed: Vec<f64> = USUAL_RATES_HZ.into_iter().filter(|&rate| rate <= 0.95 * fps).collect();
        let symbol_rate_hz: f64 = match random.random_bool(0.6) || followed.is_empty() {
            true => usual,
            false => followed[random.random_range(0..followed.len())],
        };
        let symbol_rate_hz = (symbol_rate_hz * 1000.0).round() / 1000.0;
        let about_hz: f64 = [450.0, 1260.0, 1440.0, 1440.0][random.random_range(0..4)];
        let cycles = (about_hz / symbol_rate_hz).round() as u32;
        let exposed: f64 = match random.random_range(0..3) {
            0 => random.random_range(0.05..0.5),
            1 => random.random_range(0.5..0.83),
            _ => random.random_range(1.25..1.44),
        };
        Self {
            seed,
            fps,
            exposure_s: exposed / (symbol_rate_hz * f64::from(cycles)),
            symbol_rate_hz,
            cycles,
            clock_ppm: random.random_range(-500.0..500.0),
            phase: random.random_range(0.0..1.0),
            jitter_s: if random.random_bool(0.25) {
                random.random_range(0.0002..0.002)
            } else {
                0.0
            },
            line_delay_s: 0.0,
            pitch_px: PITCH_PX,
            sensor: Sensor::USUAL,
            frames: (3.0 * fps).clamp(120.0, 360.0) as usize,
            change: None,
        }
    }

    /// The film of another camera drawn from that seed. In three of four, lines are exposed one after another: 720 or 1080 of them within
    /// 20 to 95 % of the frame period, from above or from below. LEDs are 6 to 30 px apart; curves have γ 1.8 to 2.6, with 2 000 to 16 000
    /// electrons at white; in one of eight, stamps have jitter.
    pub fn of_rolling_camera(seed: u64) -> Self {
        let camera = Self::of_camera(seed ^ 0x0011_11e5);
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x05c4_ee45);
        let line_delay_s = if random.random_bool(0.75) {
            let lines = USUAL_LINES[random.random_range(0..USUAL_LINES.len())];
            let from = if random.random_bool(0.8) { 1.0 } else { -1.0 };
            from * random.random_range(0.2..0.95) / (camera.fps * lines)
        } else {
            0.0
        };
        let pitch_px = 6.0 * f64::powf(5.0, random.random_range(0.0..1.0));
        let sensor = Sensor {
            white_e: 2000.0 * f64::powf(8.0, random.random_range(0.0..1.0)),
            gamma: random.random_range(1.8..2.6),
        };
        let jitter_s = if random.random_bool(0.125) {
            random.random_range(0.0002..0.002)
        } else {
            0.0
        };
        Self {
            seed,
            jitter_s,
            line_delay_s,
            pitch_px,
            sensor,
            ..camera
        }
    }

    /// The film, made longer if it does not show that many repeats of a message.
    pub fn of_repeats(self, message: &[u8], repeats: u32) -> Self {
        let framer = Framer::new(message, Code::for_length(message.len()), true).expect("a message");
        let frames = f64::from(framer.panels_per_repeat() * repeats) / self.rate_hz() * self.fps;
        Self {
            frames: self.frames.max(frames as usize),
            ..self
        }
    }

    /// The frequency of the carrier (Hz).
    pub fn carrier_hz(&self) -> f64 {
        self.rate_hz() * f64::from(self.cycles)
    }

    fn rate_hz(&self) -> f64 {
        self.symbol_rate_hz * (1.0 + 1e-6 * self.clock_ppm)
    }

    /// Number of symbols in the first part.
    fn symbols_before(&self) -> usize {
        let frames = self.change.map_or(0, |change| change.frames);
        (frames as f64 / self.fps * self.rate_hz()).round() as usize
    }

    /// The carrier's cycles in a symbol, and their delay.
    fn carrier_of(&self, symbol: usize) -> (u32, f64) {
        match self.change {
            Some(change) if symbol < self.symbols_before() => (change.cycles, change.late),
            _ => (self.cycles, 0.0),
        }
    }
}

/// The result of a film.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilmResult {
    /// The frame that completed the message.
    pub delivered: Option<usize>,
    /// Number of wrong messages.
    pub wrong: usize,
    /// Number of frames that were read.
    pub read: usize,
    /// Number of frames that were read at least one line beside the panel's place.
    pub beside: usize,
    /// Numbers of readings that equal the panel, that equal its complement, and that have wrong bits or show other symbols.
    pub panels: [usize; 3],
    /// The bits of frames by their stated certainty, up to the sign that all bits of a frame share. Frames count if they show one symbol, are
    /// read at the panel's place, and the carrier is known.
    pub reliability: Reliability,
    /// The receiver's advice if no message arrived.
    pub advice: Vec<String>,
}

/// The symbols that a frame shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownSymbol {
    /// The symbol in the middle of its exposure.
    pub bits: u64,
    /// Whether all its lines show that one.
    pub is_single: bool,
}

/// A film being drawn.
pub struct FilmDrawing {
    film: Film,
    side: usize,
    /// The position of the panel's middle (px).
    centre_px: [f64; 2],
    symbols: Vec<u64>,
    off: Vec<f32>,
    /// For each LED, its first pixel, the length of its lines, and the light that it adds when On.
    leds: Vec<([usize; 2], usize, Vec<f32>)>,
    deviates: Vec<f64>,
    random: ChaCha8Rng,
}

impl FilmDrawing {
    /// Draws the scene.
    pub fn new(film: Film, message: &[u8]) -> Self {
        let mut drawing = Drawing::new(shake::Film {
            seed: film.seed,
            pitch_px: film.pitch_px,
            shake: Shake::Random,
            step: 0.0,
            frames: 1,
            light: shake::Light::Steady,
        });
        let (wide, frame) = (drawing.side(), side_px(film.pitch_px));
        let margin = (wide - frame) / 2;
        let crop = |light: &[f32]| -> Vec<f32> {
            let rows = light.chunks_exact(wide).skip(margin).take(frame);
            rows.flat_map(|row| row[margin..margin + frame].to_vec()).collect()
        };
        let corners = [0, SIDE - 1, LEDS - SIDE, LEDS - 1].map(|led| drawing.still_led_px(led));
        let centre_px = [0, 1].map(|i| corners.iter().map(|corner| corner[i]).sum::<f64>() / 4.0 - margin as f64);
        let off = crop(drawing.still_light(0));
        let side = (0.8 * film.pitch_px + 14.0) as usize;
        let mut leds = vec![([0; 2], side, Vec::new()); LEDS];
        for class in 0..16 {
            // LEDs four pitches apart do not overlap.
            let of_class = |led: usize| (led % 4, led / 8 % 4) == (class % 4, class / 4);
            let bits = (0..LEDS).filter(|&led| of_class(led)).fold(0, |bits, led| bits | 1u64 << led);
            let lit = crop(drawing.still_light(bits));
            for led in (0..LEDS).filter(|&led| of_class(led)) {
                let first = drawing
                    .still_led_px(led)
                    .map(|at| (at - margin as f64 - side as f64 / 2.0).round() as usize);
                let added = (0..side * side).map(|i| {
                    let at = (first[1] + i / side) * frame + first[0] + i % side;
                    lit[at] - off[at]
                });
                leds[led] = (first, side, added.collect());
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(film.seed ^ 0xca44_1e40);
        let mut framer = Framer::new(message, Code::for_length(message.len()), true).expect("a message");
        let mut beacons = Framer::beacon();
        let shown = film.frames as f64 / film.fps * film.rate_hz() * 1.01;
        let symbols_before = film.symbols_before();
        let next = |symbol| match symbol < symbols_before {
            true => beacons.next_panel().bits(),
            false => framer.next_panel().bits(),
        };
        Self {
            film,
            side: frame,
            centre_px,
            symbols: (0..shown as usize + 8).map(next).collect(),
            off,
            leds,
            deviates: (0..DEVIATES).map(|_| gauss(&mut random)).collect(),
            random,
        }
    }

    /// The time of frame `number` (s).
    fn time_s(&mut self, number: usize) -> f64 {
        let jitter = self.film.jitter_s * gauss(&mut self.random);
        let limit = 0.4 / self.film.fps;
        (number as f64 + 0.5) / self.film.fps + jitter.clamp(-limit, limit)
    }

    /// For each LED, the share of an exposure from `start_s` on for which it is On.
    fn shares(&self, start_s: f64) -> [f32; LEDS] {
        let Film { exposure_s, phase, .. } = self.film;
        // In symbols.
        let [from, to] = [start_s, start_s + exposure_s].map(|at| at * self.film.rate_hz() + phase);
        let mut shares = [0.0; LEDS];
        for symbol in from as usize..=to as usize {
            let [begin, end] = [from.max(symbol as f64), to.min(symbol as f64 + 1.0)];
            let length = end - begin;
            let lit = match self.film.carrier_of(symbol) {
                (0, _) => length,
                (cycles, late) => {
                    let cycles = f64::from(cycles);
                    (positive_cosine(end * cycles - late) - positive_cosine(begin * cycles - late)) / cycles
                }
            };
            let panel = PanelFrame::from_bits(self.symbols[symbol]);
            for (led, share) in shares.iter_mut().enumerate() {
                *share += if panel.led(led) { lit } else { length - lit };
            }
        }
        shares.map(|share| (share / (to - from)) as f32)
    }

    /// Draws frame `number`: its stamp, its pixels, and its symbols.
    pub fn take(&mut self, number: usize) -> (Stamp, Vec<u8>, ShownSymbol) {
        let (stamp, grey, start_s) = self.expose(number, Self::shares);
        (stamp, grey, self.shown(start_s))
    }

    fn shown(&self, start_s: f64) -> ShownSymbol {
        let Film { exposure_s, phase, .. } = self.film;
        let symbol = |at_s: f64| (at_s * self.film.rate_hz() + phase).max(0.0) as usize;
        let last_line_s = start_s + self.film.line_delay_s * (self.side - 1) as f64;
        ShownSymbol {
            bits: self.symbols[symbol(start_s + 0.5 * exposure_s)],
            is_single: symbol(start_s.min(last_line_s)) == symbol(start_s.max(last_line_s) + exposure_s),
        }
    }

    /// Draws frame `number` with LEDs that are On for these shares of an exposure that begins at a time (s). Returns its stamp, its pixels,
    /// and its start.
    fn expose(&mut self, number: usize, shares_from: impl Fn(&Self, f64) -> [f32; LEDS]) -> (Stamp, Vec<u8>, f64) {
        let start_s = self.time_s(number);
        let told_s = (start_s / STAMP_S).round() * STAMP_S;
        let frame = self.side;
        let mut light = self.off.clone();
        let whole = shares_from(self, start_s);
        for y in 0..frame {
            let shares = match self.film.line_delay_s {
                0.0 => whole,
                delay => shares_from(self, start_s + delay * y as f64),
            };
            for (([left, top], side, added), share) in self.leds.iter().zip(shares) {
                let Some(line) = y.checked_sub(*top).filter(|line| line < side) else {
                    continue;
                };
                let row = &mut light[y * frame + left..][..*side];
                row.iter_mut()
                    .zip(&added[line * side..])
                    .for_each(|(light, added)| *light += share * added);
            }
        }
        let mut grey = Vec::with_capacity(frame * frame);
        for row in light.chunks_exact(frame) {
            let from = self.random.random_range(0..DEVIATES - frame);
            grey.extend(
                row.iter()
                    .zip(&self.deviates[from..])
                    .map(|(&light, &deviate)| self.film.sensor.grey(light, deviate)),
            );
        }
        let late = if self.film.jitter_s == 0.0 {
            0.0
        } else {
            told_s * self.film.fps - 0.5 - number as f64
        };
        let stamp = Stamp {
            number: number as u64,
            late,
        };
        (stamp, grey, start_s)
    }
}

/// ∫ from 0 to x of a function that is 1 if cos(2πx) is positive and 0 otherwise.
fn positive_cosine(x: f64) -> f64 {
    let (cycle, part) = (x.floor(), x - x.floor());
    0.5 * cycle + part.min(0.25) + (part - 0.75).max(0.0)
}

/// Receives a film with only the frame rate configured; `tell` is called for each frame.
pub fn receive(film: Film, message: &[u8], tell: impl FnMut(usize, ShownSymbol, &reception::PanelReport)) -> FilmResult {
    let mut drawn = FilmDrawing::new(film, message);
    let centre_px = drawn.centre_px;
    receive_taken(film, message, centre_px, |number| drawn.take(number), tell)
}

/// Receives a film of LEDs whose shares of each exposure, from a time on (s), the caller provides instead of the film's transmitter.
pub fn receive_light(film: Film, message: &[u8], shares_from: impl Fn(f64) -> [f32; LEDS]) -> FilmResult {
    let mut drawn = FilmDrawing::new(film, message);
    let drawn_at = drawn.centre_px;
    let take = |number| {
        let (stamp, grey, _) = drawn.expose(number, |_, start_s| shares_from(start_s));
        let unknown = ShownSymbol { bits: 0, is_single: false };
        (stamp, grey, unknown)
    };
    receive_taken(film, message, drawn_at, take, |_, _, _| ())
}

fn receive_taken(
    film: Film,
    message: &[u8],
    centre_px: [f64; 2],
    mut take: impl FnMut(usize) -> (Stamp, Vec<u8>, ShownSymbol),
    mut tell: impl FnMut(usize, ShownSymbol, &reception::PanelReport),
) -> FilmResult {
    let settings = ReceptionSettings {
        fps: film.fps as f32,
        ..ReceptionSettings::default()
    };
    let mut reception = Reception::new(settings).expect("settings");
    let no_lens = Err(String::from("no lens"));
    let side = side_px(film.pitch_px);
    let mut fate = FilmResult::default();
    let count = |fate: &mut FilmResult, number, event: &PanelEvent| {
        if let PanelEvent::Message(came) = event {
            if came.data == message {
                fate.delivered.get_or_insert(number);
            } else {
                fate.wrong += 1;
            }
        }
    };
    for number in 0..film.frames {
        if fate.delivered.is_some_and(|delivered| number > delivered + AFTERWARDS) {
            break;
        }
        let (stamp, grey, shown) = take(number);
        let frame = Frame::new(&grey, side, side).expect("a frame");
        for report in reception.frame(stamp, &frame, &no_lens, &mut ()).expect("a report") {
            report.events.iter().for_each(|event| count(&mut fate, number, event));
            if let Ok(reading) = &report.reading {
                fate.read += 1;
                let off = [0, 1].map(|i| f64::from(reading.corners.centre_px()[i]) - centre_px[i]);
                let is_beside = off[0].hypot(off[1]) > LINE_OFF * film.pitch_px;
                fate.beside += usize::from(is_beside);
                let wrong = (reading.detection.bits.bits() ^ shown.bits).count_ones();
                let is_known = film.cycles == 0 || reception.has_carrier(report.panel);
                if is_known && shown.is_single && !is_beside {
                    let is_complement = wrong > LEDS as u32 / 2;
                    let truth = shown.bits ^ if is_complement { u64::MAX } else { 0 };
                    fate.reliability.push(&reading.detection.soft, PanelFrame::from_bits(truth));
                }
                fate.panels[match wrong {
                    0..=3 => 0,
                    61..=64 => 1,
                    _ => 2,
                }] += 1;
            }
            tell(number, shown, &report);
        }
    }
    for (_, event) in reception.finish() {
        count(&mut fate, film.frames, &event);
    }
    if fate.delivered.is_none() {
        fate.advice = reception.advice(false);
    }
    fate
}
