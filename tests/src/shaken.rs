//! Films by a camera that shakes, drawn without the simulator: a panel on a board before houses, in linear light, taken by a camera whose
//! direction and roll change from frame to frame.
//!
//! Discs are sampled, not modelled; the lens blurs the whole picture by a Gaussian; the sensor adds the noise of its electrons, and encodes
//! by a power law. What a film shows is known: the panel's centre and pitch in each frame.

use link::fec::Code;
use link::framing::Framer;
use link::panel::{PanelFrame, SIDE};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
use rx_pipeline::frame::Frame;
use std::f64::consts::TAU;
use std::ops::Add;

/// Frames a second, symbols a second and seconds of exposure.
const FPS: f64 = 100.0;
const SYMBOL_RATE_HZ: f64 = 90.0;
/// See there.
const EXPOSURE_S: f64 = 0.001;
/// What the panel says.
const MESSAGE: &[u8] = b"Lane closed ahead";
/// Samples along a pixel's side, by which discs are drawn.
const SAMPLES: usize = 4;
/// Times within an exposure, between which the camera moves.
const MOMENTS: usize = 3;
/// Light of the ground, of a white sensor.
const GROUND: f64 = 0.18;

/// A place farther from the truth is another line's (pitches).
const LINE_OFF: f64 = 0.6;
/// Such a reading should not be said to be surer (probability).
const SURE: f32 = 0.9;

/// How the camera shakes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shake {
    /// Each frame by itself: a new direction that has nothing to do with the last.
    Random,
    /// Sums of sines of 1 to 12 Hz, as a hand's or a vehicle's.
    Smooth,
    /// A turn about the picture's centre by so many degrees a frame, there and back, the panel far from the centre.
    Turn,
}

/// A film of a shaken camera.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    /// The seed of everything that is drawn at random.
    pub seed: u64,
    /// Distance of neighbouring LEDs (px).
    pub pitch_px: f64,
    /// How the camera shakes.
    pub shake: Shake,
    /// By how much the panel moves from frame to frame, root mean square (px); degrees a frame for a turn.
    pub step: f64,
    /// Frames.
    pub frames: usize,
}

/// The camera's pose in a moment: the picture's shift (px) and its roll about the centre (rad).
#[derive(Clone, Copy)]
struct Pose {
    shift: [f64; 2],
    roll: f64,
}

/// A film being drawn.
pub(crate) struct Drawing {
    film: Film,
    side: usize,
    random: ChaCha8Rng,
    ground: Ground,
    sines: Vec<Sine>,
    still: Vec<Pose>,
    symbols: Vec<u64>,
    phase: f64,
    panel_at: [f64; 2],
    roll: f64,
    led_light: [f64; 2],
    board: Option<(f64, f64)>,
    blur_px: f64,
    fill: f64,
    light: Vec<f32>,
    row: Vec<f32>,
}

/// One of the sines that make a smooth shake: of x, y or roll.
struct Sine {
    axis: usize,
    amplitude: f64,
    hz: f64,
    phase: f64,
}

/// What stands behind the panel: a picture with a margin.
struct Ground {
    side: usize,
    margin: f64,
    light: Vec<f32>,
}

/// A frame and its truth.
struct Taken {
    /// Grey levels, row by row.
    grey: Vec<u8>,
    /// The panel's centre (px).
    centre_px: [f64; 2],
    /// The bits shown in the middle of the exposure.
    bits: u64,
}

impl Drawing {
    /// Draws the surroundings.
    pub(crate) fn new(film: Film) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(film.seed);
        let span = match film.shake {
            // Twice the deviation of a shake whose steps are as wide as this.
            Shake::Random => 2.5 * film.step,
            Shake::Smooth => 12.0 * film.step,
            Shake::Turn => 0.0,
        };
        let panel_px = 8.0 * film.pitch_px;
        let side = match film.shake {
            Shake::Turn => 640,
            _ => (panel_px + 2.0 * span.min(4.0 * panel_px) + 96.0).clamp(192.0, 1280.0) as usize,
        };
        let ground = Ground::draw(&mut random, side, film.pitch_px);
        let is_night = random.random_bool(0.3);
        let level = if is_night { 0.1 * GROUND } else { GROUND };
        let contrast = random.random_range(3.0..12.0);
        let off = level * random.random_range(0.3..1.5);
        let on = (off + contrast * if is_night { GROUND } else { level }).min(3.0);
        let board = random
            .random_bool(0.7)
            .then(|| (level * random.random_range(0.1..0.8), random.random_range(0.6..2.5)));
        let off_centre = match film.shake {
            Shake::Turn => 0.36 * side as f64 - 4.0 * film.pitch_px,
            _ => 0.0,
        };
        let sines = sines(&film, &mut random);
        let mut framer = Framer::new(MESSAGE, Code::for_length(MESSAGE.len()), true).expect("a message");
        let begins = random.random_range(0..10);
        let symbols = (0..begins + film.frames + 4)
            .map(|_| framer.next_panel())
            .map(PanelFrame::bits)
            .skip(begins)
            .collect();
        let still = (0..film.frames)
            .map(|_| Pose {
                shift: [0; 2].map(|_| film.step / 2.0 * gauss(&mut random)),
                roll: 0.0,
            })
            .collect();
        let mut drawing = Self {
            film,
            side,
            ground,
            sines,
            still,
            symbols,
            phase: random.random_range(0.0..1.0),
            panel_at: [off_centre, 0.7 * off_centre],
            roll: random.random_range(-0.15..0.15),
            led_light: [off, on],
            board,
            blur_px: random.random_range(0.8..1.6),
            fill: random.random_range(0.35..0.65),
            light: vec![0.0; side * side],
            row: vec![0.0; side],
            random,
        };
        drawing.ground.light.iter_mut().for_each(|light| *light *= (level / GROUND) as f32);
        drawing
    }

    /// Pixels along a side of a frame.
    pub(crate) fn side(&self) -> usize {
        self.side
    }

    /// The light of the sensor's pixels before a panel that is still and shows `bits`.
    pub(crate) fn still_light(&mut self, bits: u64) -> &[f32] {
        self.light.fill(0.0);
        self.expose(
            Pose {
                shift: [0.0; 2],
                roll: 0.0,
            },
            bits,
            1.0,
        );
        self.blur();
        &self.light
    }

    /// Where the middle of LED `led` is in a picture of a panel that is still (px).
    pub(crate) fn still_led_px(&self, led: usize) -> [f64; 2] {
        let [x, y] = [led % SIDE, led / SIDE].map(|at| (at as f64 - 3.5) * self.film.pitch_px);
        self.to_picture(
            Pose {
                shift: [0.0; 2],
                roll: 0.0,
            },
            [x, y],
        )
    }

    /// Takes frame `number`.
    fn take(&mut self, number: usize) -> Taken {
        self.light.fill(0.0);
        let start_s = number as f64 / FPS;
        let mut middle = [0.0; 2];
        let moments = if self.film.shake == Shake::Random { 1 } else { MOMENTS };
        for moment in 0..moments {
            let at_s = start_s + EXPOSURE_S * (moment as f64 + 0.5) / moments as f64;
            let pose = self.pose(number, at_s);
            let bits = self.bits(at_s);
            self.expose(pose, bits, 1.0 / moments as f32);
            if moment == moments / 2 {
                middle = self.to_picture(pose, [0.0; 2]);
            }
        }
        self.blur();
        let grey = self.encode();
        Taken {
            grey,
            centre_px: middle,
            bits: self.bits(start_s + EXPOSURE_S / 2.0),
        }
    }

    fn bits(&self, at_s: f64) -> u64 {
        self.symbols[(at_s * SYMBOL_RATE_HZ + self.phase) as usize]
    }

    fn pose(&self, number: usize, at_s: f64) -> Pose {
        match self.film.shake {
            Shake::Random => self.still[number],
            Shake::Smooth => {
                let mut along = [0.0; 3];
                for sine in &self.sines {
                    along[sine.axis] += sine.amplitude * (TAU * sine.hz * at_s + sine.phase).sin();
                }
                Pose {
                    shift: [along[0], along[1]],
                    roll: along[2],
                }
            }
            Shake::Turn => {
                // There and back within 20°.
                let turned = (at_s * FPS * self.film.step).rem_euclid(40.0);
                let angle = if turned < 20.0 { turned } else { 40.0 - turned };
                Pose {
                    shift: [0.0; 2],
                    roll: (angle - 10.0).to_radians(),
                }
            }
        }
    }

    /// Where a place of the panel, in px from its centre, is in the picture.
    fn to_picture(&self, pose: Pose, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.roll.sin_cos();
        let [x, y] = [self.panel_at[0] + cos * x - sin * y, self.panel_at[1] + sin * x + cos * y];
        let (sin, cos) = pose.roll.sin_cos();
        let middle = (self.side as f64 - 1.0) / 2.0;
        [
            middle + pose.shift[0] + cos * x - sin * y,
            middle + pose.shift[1] + sin * x + cos * y,
        ]
    }

    /// Adds a moment's light.
    fn expose(&mut self, pose: Pose, bits: u64, share: f32) {
        let side = self.side;
        let middle = (side as f64 - 1.0) / 2.0;
        let (sin, cos) = pose.roll.sin_cos();
        for (y, row) in self.light.chunks_exact_mut(side).enumerate() {
            let v = y as f64 - middle - pose.shift[1];
            for (x, light) in row.iter_mut().enumerate() {
                let u = x as f64 - middle - pose.shift[0];
                *light += share * self.ground.at([cos * u + sin * v, cos * v - sin * u]);
            }
        }
        let pitch = self.film.pitch_px;
        let reach = 3.5 * pitch + self.board.map_or(0.0, |(_, margin)| margin * pitch).max(0.5 * pitch);
        let centre = self.to_picture(pose, [0.0; 2]);
        let (low, high) = (
            centre.map(|c| (c - 1.5 * reach).max(0.0) as usize),
            centre.map(|c| ((c + 1.5 * reach) as usize + 1).min(side)),
        );
        let (sin, cos) = (self.roll + pose.roll).sin_cos();
        let radius = 0.5 * self.fill * pitch;
        for y in low[1]..high[1] {
            for x in low[0]..high[0] {
                let before = f64::from(self.light[y * side + x]);
                let mut changed = 0.0;
                for sample in 0..SAMPLES * SAMPLES {
                    let part = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
                    let u = x as f64 + part(sample % SAMPLES) - centre[0];
                    let v = y as f64 + part(sample / SAMPLES) - centre[1];
                    let at = [cos * u + sin * v, cos * v - sin * u];
                    if let Some(light) = self.panel_light(at, radius, bits) {
                        changed += light - self.ground_of(pose, [x, y]);
                    }
                }
                self.light[y * side + x] = (before + changed * f64::from(share) / (SAMPLES * SAMPLES) as f64) as f32;
            }
        }
    }

    fn ground_of(&self, pose: Pose, [x, y]: [usize; 2]) -> f64 {
        let middle = (self.side as f64 - 1.0) / 2.0;
        let (sin, cos) = pose.roll.sin_cos();
        let (u, v) = (x as f64 - middle - pose.shift[0], y as f64 - middle - pose.shift[1]);
        self.ground.at([cos * u + sin * v, cos * v - sin * u]).into()
    }

    /// The light of a place on the panel or its board, in px from the centre; `None` beside them.
    fn panel_light(&self, [x, y]: [f64; 2], radius: f64, bits: u64) -> Option<f64> {
        let pitch = self.film.pitch_px;
        let (column, row) = (x / pitch + 3.5, y / pitch + 3.5);
        let (near_column, near_row) = (column.round(), row.round());
        let inside = |i: f64| (0.0..SIDE as f64).contains(&i);
        if inside(near_column) && inside(near_row) && (column - near_column).hypot(row - near_row) * pitch < radius {
            let led = near_row as usize * SIDE + near_column as usize;
            return Some(self.led_light[(bits >> led & 1) as usize]);
        }
        let (light, margin) = self.board?;
        let reach = (3.5 + margin) * pitch;
        (x.abs() < reach && y.abs() < reach).then_some(light)
    }

    /// The lens: a Gaussian along rows, then along columns.
    fn blur(&mut self) {
        let reach = (3.0 * self.blur_px).ceil() as usize;
        let weights: Vec<f32> = (0..=reach)
            .map(|i| (-0.5 * (i as f64 / self.blur_px).powi(2)).exp() as f32)
            .collect();
        let whole = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
        let side = self.side;
        for row in self.light.chunks_exact_mut(side) {
            self.row.copy_from_slice(row);
            for (x, to) in row.iter_mut().enumerate() {
                let at = |i: isize| self.row[i.clamp(0, side as isize - 1) as usize];
                let mut sum = weights[0] * self.row[x];
                for (i, weight) in weights.iter().enumerate().skip(1) {
                    sum += weight * (at(x as isize - i as isize) + at(x as isize + i as isize));
                }
                *to = sum / whole;
            }
        }
        let sharp = self.light.clone();
        for y in 0..side {
            let line = |i: isize| i.clamp(0, side as isize - 1) as usize * side;
            for x in 0..side {
                let mut sum = weights[0] * sharp[y * side + x];
                for (i, weight) in weights.iter().enumerate().skip(1) {
                    sum += weight * (sharp[line(y as isize - i as isize) + x] + sharp[line(y as isize + i as isize) + x]);
                }
                self.light[y * side + x] = sum / whole;
            }
        }
    }

    /// The sensor.
    fn encode(&mut self) -> Vec<u8> {
        let random = &mut self.random;
        self.light.iter().map(|&light| Sensor::USUAL.grey(light, gauss(random))).collect()
    }
}

impl Ground {
    /// Walls, windows and lamps, some of them finely divided, in a picture twice as wide as a frame.
    fn draw(random: &mut ChaCha8Rng, frame_side: usize, pitch_px: f64) -> Self {
        let side = 2 * frame_side;
        let mut light = vec![GROUND as f32; side * side];
        for _ in 0..random.random_range(20..80) {
            let size = [0; 2].map(|_| random.random_range(2.0..0.4 * frame_side as f64) as usize);
            let at = size.map(|size| random.random_range(0..side - size));
            let grey = (GROUND * random.random_range(0.1f64..1.0).exp2().powi(2) * 0.5) as f32;
            for y in at[1]..at[1] + size[1] {
                light[y * side + at[0]..y * side + at[0] + size[0]].fill(grey);
            }
        }
        // Lamps, as wide as LEDs.
        for _ in 0..random.random_range(0..12) {
            let radius = (pitch_px * random.random_range(0.2..0.6)).max(1.0);
            let at = [0; 2].map(|_| random.random_range(radius + 1.0..side as f64 - radius - 1.0));
            let reach = radius as isize + 1;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    if (dx * dx + dy * dy) as f64 <= radius * radius {
                        let (x, y) = ((at[0] as isize + dx) as usize, (at[1] as isize + dy) as usize);
                        if x < side && y < side {
                            light[y * side + x] = (4.0 * GROUND) as f32;
                        }
                    }
                }
            }
        }
        Self {
            side,
            margin: side as f64 / 2.0,
            light,
        }
    }

    /// The light at a place, in px from the middle, between its pixels.
    fn at(&self, [x, y]: [f64; 2]) -> f32 {
        let last = (self.side - 2) as f64;
        let (x, y) = ((x + self.margin).clamp(0.0, last), (y + self.margin).clamp(0.0, last));
        let (left, top) = (x as usize, y as usize);
        let (right, down) = ((x - left as f64) as f32, (y - top as f64) as f32);
        let pixel = |dx: usize, dy: usize| self.light[(top + dy) * self.side + left + dx];
        let row = |dy: usize| pixel(0, dy) + right * (pixel(1, dy) - pixel(0, dy));
        row(0) + down * (row(1) - row(0))
    }
}

/// The sines of a smooth shake whose steps are as wide as the film's, and which rolls by a tenth of what it shifts, seen from a panel's side.
fn sines(film: &Film, random: &mut ChaCha8Rng) -> Vec<Sine> {
    const PER_AXIS: usize = 6;
    let mut sines: Vec<Sine> = (0..3 * PER_AXIS)
        .map(|i| Sine {
            axis: i / PER_AXIS,
            amplitude: random.random_range(0.5..1.5),
            hz: random.random_range(1.0..12.0),
            phase: random.random_range(0.0..TAU),
        })
        .collect();
    for axis in 0..3 {
        // A sine of amplitude a makes steps of a·√2·|sin(π·f/fps)|, root mean square.
        let square = |sine: &Sine| 2.0 * (sine.amplitude * (TAU / 2.0 * sine.hz / FPS).sin()).powi(2);
        let of_axis = sines.iter().filter(|sine| sine.axis == axis);
        let now = of_axis.map(square).sum::<f64>().sqrt();
        let wanted = match axis {
            2 => 0.1 * film.step / (4.0 * film.pitch_px),
            _ => film.step / 2f64.sqrt(),
        };
        for sine in sines.iter_mut().filter(|sine| sine.axis == axis) {
            sine.amplitude *= wanted / now;
        }
    }
    sines
}

/// What makes grey levels of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Electrons at white, beside 6 of read noise.
    pub white_e: f64,
    /// The power that grey levels are encoded by.
    pub gamma: f64,
}

impl Sensor {
    /// That of these films.
    pub const USUAL: Self = Self {
        white_e: 8000.0,
        gamma: 2.2,
    };

    /// The grey level of a light, 1 at white, its noise `deviate` standard deviations above the mean.
    pub(crate) fn grey(&self, light: f32, deviate: f64) -> u8 {
        let noise = (f64::from(light).max(0.0) / self.white_e + (6.0 / self.white_e).powi(2)).sqrt();
        let seen = (f64::from(light) + noise * deviate).clamp(0.0, 1.0);
        (255.0 * seen.powf(1.0 / self.gamma)).round() as u8
    }
}

/// A normal deviate (Box and Muller 1958).
pub(crate) fn gauss(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
}

/// What came of films.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fate {
    /// Films whose message came.
    pub delivered: usize,
    /// Frames.
    pub frames: usize,
    /// Frames that were read.
    pub read: usize,
    /// Those read at least 0.6 pitches off.
    pub line_off: usize,
    /// Those of them said to be more than 90 % sure.
    pub surely: usize,
    /// Wrong bits of frames that were read in their place and show one symbol.
    pub wrong_bits: usize,
}

impl Add for Fate {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            delivered: self.delivered + other.delivered,
            frames: self.frames + other.frames,
            read: self.read + other.read,
            line_off: self.line_off + other.line_off,
            surely: self.surely + other.surely,
            wrong_bits: self.wrong_bits + other.wrong_bits,
        }
    }
}

/// Receives a film as `vocc receive` does, told its two rates; `verbose` tells of each frame.
pub fn receive(film: Film, verbose: bool) -> Fate {
    let mut drawing = Drawing::new(film);
    let side = drawing.side();
    let settings = ReceptionSettings {
        fps: FPS as f32,
        symbol_rate_hz: Some(SYMBOL_RATE_HZ as f32),
        ..ReceptionSettings::default()
    };
    let mut reception = Reception::new(settings).expect("settings");
    let no_lens = Err(String::from("no lens"));
    let mut fate = Fate::default();
    let mut came = |event: &PanelEvent| matches!(event, PanelEvent::Message(message) if message.data == MESSAGE);
    for number in 0..film.frames {
        let taken = drawing.take(number);
        let frame = Frame::new(&taken.grey, side, side).expect("a frame");
        fate.frames += 1;
        let stamp = Stamp::of(number as u64);
        let reports = reception.frame(stamp, &frame, &no_lens, &mut ()).expect("a report");
        for report in &reports {
            if report.events.iter().any(&mut came) {
                fate.delivered = 1;
            }
            match &report.reading {
                Ok(reading) => {
                    let points = reading.corners.points();
                    let centre = [0, 1].map(|i| points.iter().map(|point| f64::from(point[i])).sum::<f64>() / 4.0);
                    let off = (centre[0] - taken.centre_px[0]).hypot(centre[1] - taken.centre_px[1]) / film.pitch_px;
                    let wrong = (reading.detection.bits.bits() ^ taken.bits).count_ones() as usize;
                    fate.read += 1;
                    if reading.detection.mixed.is_none() && off < LINE_OFF {
                        fate.wrong_bits += wrong;
                    }
                    if off > LINE_OFF {
                        fate.line_off += 1;
                        fate.surely += usize::from(reading.detection.confidence > SURE);
                    }
                    if verbose {
                        let sure = reading.detection.confidence;
                        let mixed = if reading.detection.mixed.is_some() { ", mixed" } else { "" };
                        println!("  {number:3} {off:6.2} pitches off, {wrong:2} wrong, {sure:.3} sure{mixed}");
                    }
                }
                Err(loss) if verbose => println!("  {number:3} {loss}"),
                Err(_) => {}
            }
        }
    }
    if reception.finish().iter().any(|(_, event)| came(event)) {
        fate.delivered = 1;
    }
    fate
}
