//! Draws a film.

use std::f64::consts::TAU;

use link::fec::Code;
use link::framing::Framer;
use link::panel::{LEDS, PanelFrame, SIDE};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::ground::{GROUND, Ground};
use super::light::Sky;
use super::{EXPOSURE_S, FPS, Film, MESSAGE, SYMBOL_RATE_HZ, Shake};
use crate::sensor::{Sensor, gauss};

/// Samples along a pixel's side, for discs.
const SAMPLES: usize = 4;
/// Instants within an exposure, between which the camera moves.
const MOMENTS: usize = 3;

/// The camera's pose at an instant: the image's shift (px) and its roll about the centre (rad).
#[derive(Clone, Copy, Default)]
struct Pose {
    shift: [f64; 2],
    roll: f64,
}

/// State of a film while it is drawn.
pub struct Drawing {
    film: Film,
    side: usize,
    random: ChaCha8Rng,
    ground: Ground,
    sky: Sky,
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

/// A sine component of a smooth shake, in x, y or roll.
struct Sine {
    axis: usize,
    amplitude: f64,
    hz: f64,
    phase: f64,
}

/// A frame and its ground truth.
pub struct Shot {
    /// Grey levels, row by row.
    pub grey: Vec<u8>,
    /// The panel's centre (px).
    pub centre_px: [f64; 2],
    /// The bits at mid-exposure.
    pub bits: u64,
    /// Whether each On LED is brighter at its centre than all Off LEDs.
    pub is_legible: bool,
}

impl Drawing {
    /// Draws the background.
    pub fn new(film: Film) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(film.seed);
        let span = match film.shake {
            // Twice the standard deviation of a shake with this step.
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
        let sky = Sky::draw(&mut ChaCha8Rng::seed_from_u64(!film.seed), film.light, film.frames, panel_px, level);
        let mut drawing = Self {
            film,
            side,
            ground,
            sky,
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

    /// Side of a frame in pixels.
    pub fn side(&self) -> usize {
        self.side
    }

    /// The light on the sensor from a static panel that shows `bits`.
    pub fn still_light(&mut self, bits: u64) -> &[f32] {
        self.light.fill(0.0);
        self.expose(Pose::default(), bits, 1.0, 0.0);
        self.blur();
        &self.light
    }

    /// Centre of LED `led` in the image of a static panel (px).
    pub fn still_led_px(&self, led: usize) -> [f64; 2] {
        self.led_px(Pose::default(), led)
    }

    fn led_px(&self, pose: Pose, led: usize) -> [f64; 2] {
        let [x, y] = [led % SIDE, led / SIDE].map(|at| (at as f64 - 3.5) * self.film.pitch_px);
        self.to_picture(pose, [x, y])
    }

    /// Draws frame `number`.
    pub fn take(&mut self, number: usize) -> Shot {
        self.light.fill(0.0);
        let start_s = number as f64 / FPS;
        let mut middle = [0.0; 2];
        let moments = if self.film.shake == Shake::Random { 1 } else { MOMENTS };
        for moment in 0..moments {
            let at_s = start_s + EXPOSURE_S * (moment as f64 + 0.5) / moments as f64;
            let pose = self.pose(number, at_s);
            let bits = self.bits(at_s);
            self.expose(pose, bits, 1.0 / moments as f32, at_s);
            if moment == moments / 2 {
                middle = self.to_picture(pose, [0.0; 2]);
            }
        }
        self.veil(number, middle);
        self.blur();
        let grey = self.encode(self.sky.gain(number));
        let at_s = start_s + EXPOSURE_S / 2.0;
        let bits = self.bits(at_s);
        let pose = self.pose(number, at_s);
        let centres = |on: bool| {
            let of_state = (0..LEDS).filter(move |led| (bits >> led & 1 == 1) == on);
            of_state.map(|led| {
                let [x, y] = self
                    .led_px(pose, led)
                    .map(|at| at.round().clamp(0.0, self.side as f64 - 1.0) as usize);
                grey[y * self.side + x]
            })
        };
        let is_legible = centres(true).min() > centres(false).max();
        Shot {
            is_legible,
            grey,
            centre_px: middle,
            bits,
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
                // Back and forth within 20°.
                let turned = (at_s * FPS * self.film.step).rem_euclid(40.0);
                let angle = if turned < 20.0 { turned } else { 40.0 - turned };
                Pose {
                    shift: [0.0; 2],
                    roll: (angle - 10.0).to_radians(),
                }
            }
        }
    }

    /// Image position of a point on the panel, in px from its centre.
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

    /// Adds light that the lens scatters.
    fn veil(&mut self, number: usize, centre: [f64; 2]) {
        for (at, light) in self.light.iter_mut().enumerate() {
            let [x, y] = [at % self.side, at / self.side].map(|at| at as f64);
            *light += self.sky.veil([x - centre[0], y - centre[1]], number) as f32;
        }
    }

    /// Adds an instant's light.
    fn expose(&mut self, pose: Pose, bits: u64, share: f32, at_s: f64) {
        let side = self.side;
        let mut light = std::mem::take(&mut self.light);
        let middle = (side as f64 - 1.0) / 2.0;
        let (sin, cos) = pose.roll.sin_cos();
        // The ambient light at a pixel, and that of the ground in it.
        let lit = |x: usize, y: usize| {
            let [u, v] = [x as f64 - middle - pose.shift[0], y as f64 - middle - pose.shift[1]];
            let [u, v] = [cos * u + sin * v, cos * v - sin * u];
            let ambient = self.sky.shade([u - self.panel_at[0], v - self.panel_at[1]], at_s);
            (ambient, ambient as f32 * self.ground.at([u, v]))
        };
        for (at, light) in light.iter_mut().enumerate() {
            *light += share * lit(at % side, at / side).1;
        }
        let pitch = self.film.pitch_px;
        let reach = 3.5 * pitch + self.board.map_or(0.0, |(_, margin)| margin * pitch).max(0.5 * pitch);
        let centre = self.to_picture(pose, [0.0; 2]);
        let low = centre.map(|c| (c - 1.5 * reach).max(0.0) as usize);
        let high = centre.map(|c| ((c + 1.5 * reach) as usize + 1).min(side));
        let (sin, cos) = (self.roll + pose.roll).sin_cos();
        let radius = 0.5 * self.fill * pitch;
        for y in low[1]..high[1] {
            for x in low[0]..high[0] {
                let (ambient, behind) = lit(x, y);
                let behind = f64::from(behind);
                let mut changed = 0.0;
                for sample in 0..SAMPLES * SAMPLES {
                    let part = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
                    let u = x as f64 + part(sample % SAMPLES) - centre[0];
                    let v = y as f64 + part(sample / SAMPLES) - centre[1];
                    let at = [cos * u + sin * v, cos * v - sin * u];
                    changed += self.panel_light(at, radius, bits, ambient).map_or(0.0, |light| light - behind);
                }
                let pixel = &mut light[y * side + x];
                *pixel = (f64::from(*pixel) + changed * f64::from(share) / (SAMPLES * SAMPLES) as f64) as f32;
            }
        }
        self.light = light;
    }

    /// The light of a point on the panel or its board, in px from the centre; `None` outside.
    fn panel_light(&self, [x, y]: [f64; 2], radius: f64, bits: u64, ambient: f64) -> Option<f64> {
        let pitch = self.film.pitch_px;
        let (column, row) = (x / pitch + 3.5, y / pitch + 3.5);
        let (near_column, near_row) = (column.round(), row.round());
        let inside = |i: f64| (0.0..SIDE as f64).contains(&i);
        if inside(near_column) && inside(near_row) && (column - near_column).hypot(row - near_row) * pitch < radius {
            let led = near_row as usize * SIDE + near_column as usize;
            let [off, on] = self.led_light;
            return Some(off * ambient + (on - off) * (bits >> led & 1) as f64);
        }
        let (light, margin) = self.board?;
        let reach = (3.5 + margin) * pitch;
        (x.abs() < reach && y.abs() < reach).then_some(light * ambient)
    }

    /// Applies the lens blur: a Gaussian along rows, then along columns.
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

    /// Applies the sensor, under a gain of the exposure.
    fn encode(&mut self, gain: f64) -> Vec<u8> {
        let random = &mut self.random;
        self.light
            .iter()
            .map(|light| light * gain as f32)
            .map(|light| Sensor::USUAL.grey(light, gauss(random)))
            .collect()
    }
}

/// Sines of a smooth shake with the film's RMS step; the roll moves a panel's side by a tenth of the shift.
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
        // A sine of amplitude a has RMS steps of a·√2·|sin(π·f/fps)|.
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
