//! Frames of panels for tests: LEDs as Gaussian spots before a background, in linear light, encoded with a gamma curve.

use crate::corners::Corners;
use crate::frame::Frame;
use link::camera::MIDDLE_GREY;
use std::vec::Vec;

/// The scene before the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene {
    pub bits: u64,
    /// The bits in the last part of the exposure, and that part.
    pub next: (u64, f32),
    /// The growth of that part from each line to the one below; the part is then that of the panel's middle.
    pub growth: f32,
    pub width: usize,
    pub height: usize,
    pub centre: [f32; 2],
    pub pitch_px: f32,
    pub roll_deg: f32,
    /// Height over width, as of a panel turned about its upright axis.
    pub aspect: f32,
    /// Light of an Off and an On LED's surface; the background's is 1.
    pub light: [f32; 2],
    /// LED diameter over pitch.
    pub fill: f32,
    pub noise_grey: f32,
    /// The deviation of light 1 by electron noise; it grows with the root of light.
    pub shot_noise: f32,
    /// Standard deviation of the blur along x and y.
    pub blur_px: [f32; 2],
    pub gamma: f32,
    /// The factor on each LED's On light above the background: 1 for sound LEDs.
    pub gain: fn(usize) -> f32,
    /// Light of the background at a place, in pixels.
    pub background: fn([f32; 2]) -> f32,
    /// A factor on all light, as by the exposure.
    pub exposure: f32,
    /// A wiper before the columns from the first to the last but one: its transmitted share of light, and its own light.
    pub wiper: ([usize; 2], f32, f32),
}

impl Scene {
    pub const PLAIN: Self = Self {
        bits: 0x9a3c_5e71_0f96_c3a5,
        next: (0, 0.0),
        growth: 0.0,
        width: 96,
        height: 96,
        centre: [47.3, 48.6],
        pitch_px: 4.4,
        roll_deg: 0.0,
        aspect: 1.0,
        light: [0.4 / 0.18, 0.4 / 0.18 * 5.0],
        fill: 0.5,
        noise_grey: 0.0,
        shot_noise: 0.0,
        blur_px: [1.5; 2],
        gamma: 2.2,
        gain: |_| 1.0,
        background: |_| 1.0,
        exposure: 1.0,
        wiper: ([0; 2], 1.0, 0.0),
    };

    pub fn corners(&self) -> Corners {
        let ends = [[-3.5, -3.5], [3.5, -3.5], [3.5, 3.5], [-3.5, 3.5]];
        Corners::new(ends.map(|[column, row]| self.position(column, row))).unwrap()
    }

    fn position(&self, column: f32, row: f32) -> [f32; 2] {
        let (sin, cos) = self.roll_deg.to_radians().sin_cos();
        let (across, down) = (column * self.pitch_px / self.aspect, row * self.pitch_px);
        [
            self.centre[0] + cos * across - sin * down,
            self.centre[1] + sin * across + cos * down,
        ]
    }

    pub fn render(&self) -> Rendered {
        let diameter = self.fill * self.pitch_px;
        let variance = self.blur_px.map(|blur| blur * blur + diameter * diameter / 16.0 + 1.0 / 12.0);
        let area = core::f32::consts::PI / 4.0 * diameter * diameter;
        let height = area / (2.0 * core::f32::consts::PI * (variance[0] * variance[1]).sqrt());
        let place = |i: usize| [(i % self.width) as f32, (i / self.width) as f32];
        let mut light: Vec<f32> = (0..self.width * self.height).map(|i| (self.background)(place(i))).collect();
        for led in 0..64 {
            let [cx, cy] = self.position((led % 8) as f32 - 3.5, (led / 8) as f32 - 3.5);
            let [off, on] = self.light;
            let on = off + (self.gain)(led) * (on - off);
            let surface = |bits: u64| if bits >> led & 1 == 1 { on } else { off };
            let (next, share) = self.next;
            let (ended, begun) = (surface(self.bits), surface(next));
            for (i, light) in light.iter_mut().enumerate() {
                let [x, y] = place(i);
                let share = if self.growth == 0.0 {
                    share
                } else {
                    (share + self.growth * (y - self.centre[1])).clamp(0.0, 1.0)
                };
                let surface = (1.0 - share) * ended + share * begun;
                let (dx, dy) = (x - cx, y - cy);
                let exponent = 0.5 * (dx * dx / variance[0] + dy * dy / variance[1]);
                if exponent < 20.0 {
                    *light += (surface - 1.0) * height * (-exponent).exp();
                }
            }
        }
        let ([from, to], passes, own) = self.wiper;
        for (i, light) in light.iter_mut().enumerate() {
            if (from..to).contains(&(i % self.width)) {
                *light = passes * *light + own;
            }
            *light *= self.exposure;
        }
        let mut random = Random(self.bits | 1);
        if self.shot_noise > 0.0 {
            for light in &mut light {
                *light += self.shot_noise * light.sqrt() * random.normal();
            }
        }
        let grey = |light: f32| MIDDLE_GREY * light.powf(1.0 / self.gamma) + self.noise_grey * random.normal();
        Rendered {
            pixels: light.into_iter().map(grey).map(|grey| grey.round() as u8).collect(),
            scene: *self,
        }
    }
}

/// A frame that owns its pixels.
pub(crate) struct Rendered {
    pub pixels: Vec<u8>,
    scene: Scene,
}

impl Rendered {
    pub fn frame(&self) -> Frame<'_> {
        Frame::new(&self.pixels, self.scene.width, self.scene.height).unwrap()
    }
}

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Approximately standard normal: the sum of twelve uniform numbers.
    fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.uniform()).sum::<f32>() - 6.0
    }
}
