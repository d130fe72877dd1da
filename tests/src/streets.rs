//! Street films, drawn without the simulator: houses with grids of windows, brickwork, signs, trees and lamps that a camera passes, with or
//! without a panel.

use link::fec::Code;
use link::framing::Framer;
use link::panel::{PanelFrame, SIDE};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

use crate::sensor::gauss;

/// The panel's message.
pub const MESSAGE: &[u8] = b"Lane closed ahead";
/// Symbols per frame.
pub const SYMBOLS_PER_FRAME: f64 = 0.9;
/// Samples along a pixel's side, for discs.
const SAMPLES: usize = 4;
/// Number of noise samples, which are reused.
const NOISE: usize = 1 << 16;

/// Motion of the camera and the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// None.
    Still,
    /// A static camera and blinking lamps.
    Blinking,
    /// The camera passes the houses.
    Panning,
    /// The camera's direction shakes.
    Shaking,
    /// A static camera in rain.
    Rain,
}

/// All motions with their names.
pub const MOTIONS: [(Motion, &str); 5] = [
    (Motion::Still, "still"),
    (Motion::Blinking, "blinking lamps"),
    (Motion::Panning, "panning"),
    (Motion::Shaking, "shaking"),
    (Motion::Rain, "rain"),
];

/// Parameters of a street film.
#[derive(Clone, Copy, Debug)]
pub struct Street {
    /// The random seed.
    pub seed: u64,
    /// Frame width and height in pixels.
    pub size: [usize; 2],
    /// How the camera moves.
    pub motion: Motion,
    /// Distance of the panel's neighbouring LEDs (px), if there is a panel. It stays at the image centre while the street passes.
    pub pitch_px: Option<f64>,
    /// The first frame with the panel.
    pub appears: usize,
}

/// State of a film while it is drawn.
pub struct Drawing {
    street: Street,
    random: ChaCha8Rng,
    world: World,
    lamps: Vec<([usize; 2], usize)>,
    panel: Option<Panel>,
    speed_px: f64,
    noise: Vec<f32>,
    curve: Vec<u8>,
}

/// Light of the street, row by row.
struct World {
    width: usize,
    light: Vec<f32>,
}

struct Panel {
    pitch_px: f64,
    centre: [f64; 2],
    levels: [f32; 2],
    symbols: Vec<u64>,
}

impl Drawing {
    /// Draws the street.
    pub fn new(street: Street) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(street.seed);
        let [width, height] = street.size;
        let mut world = World::draw(&mut random, [2 * width, height + height / 4]);
        let lamps = (0..12)
            .map(|_| {
                let at = [random.random_range(8..world.width - 8), random.random_range(8..height - 8)];
                (at, random.random_range(2..9))
            })
            .collect();
        world.blur(random.random_range(0.8..1.4));
        let panel = street.pitch_px.map(|pitch_px| {
            let mut framer = Framer::new(MESSAGE, Code::for_length(MESSAGE.len()), true).expect("a message");
            let contrast = random.random_range(0.35..0.6);
            Panel {
                pitch_px,
                centre: street.size.map(|c| c as f64 * random.random_range(0.35..0.65)),
                levels: [0.05, 0.05 + contrast],
                symbols: (0..600).map(|_| framer.next_panel()).map(PanelFrame::bits).collect(),
            }
        });
        let noise = (0..NOISE).map(|_| gauss(&mut random) as f32).collect();
        let curve = (0..=4096)
            .map(|i| (255.0 * (f64::from(i) / 4096.0).powf(1.0 / 2.2)).round() as u8)
            .collect();
        Self {
            street,
            world,
            lamps,
            panel,
            speed_px: random.random_range(1.5..7.0),
            noise,
            curve,
            random,
        }
    }

    /// Centre of the panel (px), if there is one.
    pub fn centre_px(&self) -> Option<[f64; 2]> {
        self.panel.as_ref().map(|panel| panel.centre)
    }

    /// Draws frame `number`: grey levels, row by row.
    pub fn take(&mut self, number: usize) -> Vec<u8> {
        let [width, height] = self.street.size;
        let shift = match self.street.motion {
            Motion::Still | Motion::Blinking | Motion::Rain => [0.5 * width as f64, 10.0],
            Motion::Panning => [
                (number as f64 * self.speed_px) % (width - 2) as f64,
                10.0 + (number as f64 * 0.7).sin(),
            ],
            Motion::Shaking => [0.5 * width as f64, 20.0].map(|c| c + 2.0 * gauss(&mut self.random)),
        };
        let mut light = vec![0.0f32; width * height];
        for (y, row) in light.chunks_exact_mut(width).enumerate() {
            self.world.row([shift[0], shift[1] + y as f64], row);
        }
        if self.street.motion == Motion::Blinking {
            for &(at, period) in &self.lamps {
                if (number / period).is_multiple_of(2) && at[0] >= width / 2 && at[0] + 8 < width / 2 + width {
                    for (dy, dx) in (0..5).flat_map(|dy| (0..5).map(move |dx| (dy, dx))) {
                        light[(at[1] + dy) * width + at[0] - width / 2 + dx] = 0.8;
                    }
                }
            }
        }
        if let Some(panel) = &self.panel
            && number >= self.street.appears
        {
            panel.draw(number, &mut light, self.street.size);
        }
        if self.street.motion == Motion::Rain {
            for _ in 0..width * height / 1200 {
                let (x, y) = (self.random.random_range(0..width - 10), self.random.random_range(0..height));
                let (length, lean) = (self.random.random_range(4..30), self.random.random_range(0.0..0.3));
                for k in 0..length.min(height - y) {
                    light[(y + k) * width + x + (lean * k as f64) as usize] += 0.12;
                }
            }
        }
        let mut next = self.random.random_range(0..NOISE);
        light
            .iter()
            .map(|&light| {
                next = (next * 25_173 + 13_849) % NOISE;
                let seen = light + (light.max(0.0) / 8000.0 + 5e-7).sqrt() * self.noise[next];
                self.curve[(4096.0 * seen.clamp(0.0, 1.0)) as usize]
            })
            .collect()
    }
}

impl Panel {
    fn draw(&self, number: usize, light: &mut [f32], [width, _]: [usize; 2]) {
        let bits = self.symbols[(number as f64 * SYMBOLS_PER_FRAME) as usize % self.symbols.len()];
        let (pitch, radius) = (self.pitch_px, 0.3 * self.pitch_px);
        let reach = 4.5 * pitch;
        let ends = self.centre.map(|c| ((c - reach) as usize, (c + reach) as usize + 1));
        let blur = 0.6;
        for y in ends[1].0..=ends[1].1 {
            for x in ends[0].0..=ends[0].1 {
                let mut sum = 0.0;
                for sample in 0..SAMPLES * SAMPLES {
                    // Samples over more than a pixel model the lens.
                    let part = |i: usize| ((i as f64 + 0.5) / SAMPLES as f64 - 0.5) * (1.0 + 2.0 * blur);
                    let at = [
                        x as f64 + part(sample % SAMPLES) - self.centre[0],
                        y as f64 + part(sample / SAMPLES) - self.centre[1],
                    ];
                    let [column, row] = at.map(|c| c / pitch + 3.5);
                    let (near_column, near_row) = (column.round(), row.round());
                    let inside = |i: f64| (0.0..SIDE as f64).contains(&i);
                    let is_led = inside(near_column) && inside(near_row) && (column - near_column).hypot(row - near_row) * pitch < radius;
                    sum += if is_led {
                        self.levels[(bits >> (near_row as usize * SIDE + near_column as usize) & 1) as usize]
                    } else if at.iter().all(|c| c.abs() < reach) {
                        0.03
                    } else {
                        light[y * width + x]
                    };
                }
                light[y * width + x] = sum / (SAMPLES * SAMPLES) as f32;
            }
        }
    }
}

impl World {
    fn draw(random: &mut ChaCha8Rng, [width, height]: [usize; 2]) -> Self {
        let mut world = Self {
            width,
            light: vec![0.35; width * height],
        };
        let mut x = 0;
        while x < width {
            let house = random.random_range(60..260).min(width - x);
            let top = random.random_range(0..height / 3);
            let wall = random.random_range(0.05..0.3f32);
            world.fill([x, top], [house, height - top], wall);
            if random.random_bool(0.5) {
                world.bricks(random, [x, top], [house, height - top], wall);
            }
            world.windows(random, [x, top], [house, height - top]);
            x += house + random.random_range(0..20);
        }
        for _ in 0..width / 120 {
            let at = [random.random_range(0..width), random.random_range(height / 2..height)];
            world.tree(random, at);
        }
        for _ in 0..width / 160 {
            let at = [random.random_range(0..width), random.random_range(0..height)];
            world.sign(random, at);
        }
        world.fill([0, height - height / 8], [width, height / 8], 0.12);
        world
    }

    fn fill(&mut self, [x, y]: [usize; 2], [width, height]: [usize; 2], light: f32) {
        let rows = self.light.len() / self.width;
        let right = (x + width).min(self.width);
        for y in y..(y + height).min(rows) {
            if x < right {
                self.light[y * self.width + x..y * self.width + right].fill(light);
            }
        }
    }

    fn bricks(&mut self, random: &mut ChaCha8Rng, at: [usize; 2], size: [usize; 2], wall: f32) {
        let course = random.random_range(3..7);
        for (row, y) in (0..size[1]).step_by(course).enumerate() {
            for x in (row % 2 * course..size[0]).step_by(2 * course) {
                let light = wall * random.random_range(0.8..1.25f32);
                self.fill([at[0] + x, at[1] + y], [2 * course - 1, course - 1], light);
            }
        }
    }

    fn windows(&mut self, random: &mut ChaCha8Rng, at: [usize; 2], size: [usize; 2]) {
        let step = [random.random_range(8..40), random.random_range(10..50)];
        let window = step.map(|step| (step as f64 * random.random_range(0.35..0.75)) as usize);
        let light = [random.random_range(0.01..0.08f32), random.random_range(0.2..0.8f32)];
        let lit = random.random_range(0.0..0.5);
        for y in (step[1] / 2..size[1].saturating_sub(step[1])).step_by(step[1]) {
            for x in (step[0] / 2..size[0].saturating_sub(step[0])).step_by(step[0]) {
                let is_lit = random.random_bool(lit);
                self.fill(
                    [at[0] + x, at[1] + y],
                    window,
                    light[usize::from(is_lit)] * random.random_range(0.8..1.2f32),
                );
            }
        }
    }

    fn tree(&mut self, random: &mut ChaCha8Rng, at: [usize; 2]) {
        let crown = random.random_range(20.0..70.0);
        for _ in 0..600 {
            let (turn, far) = (random.random_range(0.0..TAU), crown * random.random_range(0.0..1.0f64).sqrt());
            let leaf = [at[0] as f64 + far * turn.cos(), at[1] as f64 + far * turn.sin()].map(|c| c.max(0.0) as usize);
            let side = random.random_range(1..5);
            self.fill(leaf, [side, side], random.random_range(0.01..0.2));
        }
    }

    fn sign(&mut self, random: &mut ChaCha8Rng, at: [usize; 2]) {
        let (cell, letters) = (random.random_range(1..4), random.random_range(3..14));
        self.fill(at, [6 * cell * letters, 9 * cell], random.random_range(0.02..0.6));
        let ink = random.random_range(0.02..0.8);
        for letter in 0..letters {
            for dot in 0..35 {
                if random.random_bool(0.45) {
                    let place = [at[0] + cell * (6 * letter + dot % 5), at[1] + cell * (1 + dot / 5)];
                    self.fill(place, [cell, cell], ink);
                }
            }
        }
    }

    /// Applies the lens blur: a Gaussian along rows, then along columns.
    fn blur(&mut self, sigma_px: f64) {
        let reach = (3.0 * sigma_px).ceil() as isize;
        let weights: Vec<f32> = (-reach..=reach)
            .map(|i| (-0.5 * (i as f64 / sigma_px).powi(2)).exp() as f32)
            .collect();
        let whole: f32 = weights.iter().sum();
        let (width, rows) = (self.width as isize, (self.light.len() / self.width) as isize);
        for [dx, dy] in [[1, 0], [0, 1]] {
            let sharp = self.light.clone();
            for (i, to) in self.light.iter_mut().enumerate() {
                let (x, y) = (i as isize % width, i as isize / width);
                let at = |k: isize| sharp[((y + k * dy).clamp(0, rows - 1) * width + (x + k * dx).clamp(0, width - 1)) as usize];
                *to = weights.iter().zip(-reach..).map(|(weight, k)| weight * at(k)).sum::<f32>() / whole;
            }
        }
    }

    /// A row of the image from a start position, interpolated from the world's pixels.
    fn row(&self, [x, y]: [f64; 2], row: &mut [f32]) {
        let rows = self.light.len() / self.width;
        let (left, top) = (x.max(0.0) as usize, (y.max(0.0) as usize).min(rows - 2));
        let (right, down) = ((x - left as f64) as f32, (y - top as f64) as f32);
        let line = |top: usize| &self.light[top * self.width + left.min(self.width - row.len() - 1)..];
        let (upper, lower) = (line(top), line(top + 1));
        for (i, to) in row.iter_mut().enumerate() {
            let above = upper[i] + right * (upper[i + 1] - upper[i]);
            let below = lower[i] + right * (lower[i + 1] - lower[i]);
            *to = above + down * (below - above);
        }
    }
}
