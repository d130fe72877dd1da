//! Frames on whole pixels, step by step.

use rand::Rng;
use sim::random::{Purpose, stream, uniform};

use super::reading::{Blur, Disc, Interpretation, Order};

const SEED: u64 = 1;
const DIAMETER_M: f64 = 0.03;
const PIXEL_M: f64 = 6.875e-6;
const BACKGROUND_REFLECTANCE: f64 = 0.18;
/// Samples per pixel along each axis.
const SAMPLES: usize = 8;
/// Margin around the 8 × 8 pitches, in pitches.
const RIM: f64 = 0.75;

/// A random panel.
pub struct Scene {
    pub bits: u64,
    /// Centre of LED 0.
    pub first_px: [f64; 2],
    pub pitch_px: f64,
    pub radius_px: f64,
    /// Side of the frame in pixels.
    pub side: usize,
    /// Linear value of an Off LED.
    off: f64,
    blur: Vec<f64>,
}

impl Scene {
    /// The random bits, phase and reflectance of frame `frame`.
    pub fn random(reading: &Interpretation, interval: f64, distance_m: f64, frame: u64) -> Self {
        let mut random = stream(SEED, frame, Purpose::Phase);
        let px = reading.focal_mm * 1e-3 / PIXEL_M / distance_m;
        let pitch_px = (1.0 + interval) * DIAMETER_M * px;
        let rim = (RIM * pitch_px).ceil() + 7.0;
        let bits = random.next_u64();
        let phase = [uniform(&mut random), uniform(&mut random)];
        let reflectance = 0.3 + 0.2 * uniform(&mut random);
        let moved = if reading.random_phase { phase } else { [0.5; 2] };
        Self {
            bits,
            first_px: moved.map(|moved| rim + pitch_px / 2.0 + moved),
            pitch_px,
            radius_px: DIAMETER_M / 2.0 * px,
            side: (8.0 * pitch_px + 2.0 * rim) as usize + 2,
            off: reflectance / BACKGROUND_REFLECTANCE,
            blur: kernel(reading.blur, distance_m),
        }
    }

    /// The share of each pixel that all LEDs cover, and that On LEDs cover, blurred if the blur comes first.
    pub fn light(&self, reading: &Interpretation) -> Light<'_> {
        let (mut all, mut on) = (vec![0.0; self.side * self.side], vec![0.0; self.side * self.side]);
        for led in 0..64 {
            self.add_disc(reading.disc, led, &mut all);
            if self.bits >> led & 1 == 1 {
                self.add_disc(reading.disc, led, &mut on);
            }
        }
        if reading.order == Order::BlurGammaClip {
            (all, on) = (self.blurred(&all), self.blurred(&on));
        }
        Light { scene: self, all, on }
    }

    fn add_disc(&self, disc: Disc, led: usize, coverage: &mut [f64]) {
        let mut centre = [
            self.first_px[0] + (led % 8) as f64 * self.pitch_px,
            self.first_px[1] + (led / 8) as f64 * self.pitch_px,
        ];
        if disc == Disc::Rounded {
            centre = centre.map(f64::round);
        }
        let samples = if disc == Disc::Area { SAMPLES } else { 1 };
        let offset = |k: usize| (k as f64 + 0.5) / samples as f64 - 0.5;
        let span = |c: f64| (c - self.radius_px).floor() as usize..=(c + self.radius_px).ceil() as usize;
        for y in span(centre[1]) {
            for x in span(centre[0]) {
                let inside = (0..samples * samples).filter(|k| {
                    let dx = x as f64 + offset(k % samples) - centre[0];
                    let dy = y as f64 + offset(k / samples) - centre[1];
                    dx.hypot(dy) <= self.radius_px
                });
                coverage[y * self.side + x] += inside.count() as f64 / (samples * samples) as f64;
            }
        }
    }

    /// Blurs along rows and columns; the edge pixels are repeated outside.
    fn blurred(&self, image: &[f64]) -> Vec<f64> {
        let (side, reach) = (self.side, self.blur.len() / 2);
        // Twice: blurs the rows and writes them as columns.
        (0..2).fold(image.to_vec(), |image, _| {
            let mut turned = vec![0.0; side * side];
            for (y, row) in image.chunks_exact(side).enumerate() {
                for x in 0..side {
                    let weighted = self.blur.iter().enumerate().map(|(k, weight)| {
                        let from = (x + k).saturating_sub(reach).min(side - 1);
                        weight * row[from]
                    });
                    turned[x * side + y] = weighted.sum();
                }
            }
            turned
        })
    }
}

fn kernel(blur: Blur, distance_m: f64) -> Vec<f64> {
    let (sigma, reach) = match blur {
        Blur::Pixels(sigma) => (sigma, (4.0 * sigma).ceil() as usize),
        Blur::WithImage(sigma) => {
            let sigma = sigma * 50.0 / distance_m;
            (sigma, (4.0 * sigma).ceil() as usize)
        }
        Blur::Cut(sigma, reach) => (sigma, reach),
    };
    let weights: Vec<f64> = (0..=2 * reach)
        .map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma).powi(2)).exp())
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

/// The share of each pixel that LEDs cover.
pub struct Light<'a> {
    scene: &'a Scene,
    all: Vec<f64>,
    on: Vec<f64>,
}

impl Light<'_> {
    /// The 8-bit frame at the ratio `r`.
    pub fn grey(&self, reading: &Interpretation, r: f64) -> Vec<f64> {
        let Scene { off, .. } = self.scene;
        let own = off * reading.contrast * r;
        let behind = reading.background;
        let pixels = self.all.iter().zip(&self.on);
        let light = pixels.map(|(all, on)| behind + (off - behind) * all + own * on);
        let encoded = |light: f64| 118.0 * light.powf(1.0 / reading.gamma);
        let white = (255.0f64 / 118.0).powf(reading.gamma);
        let mut grey: Vec<f64> = match reading.order {
            Order::BlurGammaClip => light.map(encoded).collect(),
            Order::ClipBlurGamma => {
                let clipped: Vec<f64> = light.map(|light| light.min(white)).collect();
                self.scene.blurred(&clipped).into_iter().map(encoded).collect()
            }
            Order::GammaBlurClip => self.scene.blurred(&light.map(encoded).collect::<Vec<_>>()),
            Order::GammaClipBlur => {
                let clipped: Vec<f64> = light.map(|light| encoded(light).min(255.0)).collect();
                self.scene.blurred(&clipped)
            }
        };
        grey.iter_mut().for_each(|grey| *grey = grey.round().clamp(0.0, 255.0));
        grey
    }
}
