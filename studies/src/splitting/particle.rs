//! A frame by its random numbers, and small changes of them that preserve their distribution.

use link::panel::{LEDS, PanelFrame, SIDE};
use rand::Rng;

use sim::camera::clock::Moment;
use sim::camera::noise::PixelLaw;
use sim::random::uniform;
use sim::renderer::PanelExposure;
use sim::renderer::canvas::Region;

/// A frame with one selected LED.
#[derive(Debug)]
pub struct Particle {
    /// The time of its exposure.
    pub moment: Moment,
    /// The LED.
    pub led: usize,
    /// The panels' exposures, with the first one's phase and reflectance.
    pub shown: Vec<PanelExposure>,
    /// The quantile of each pixel's reading.
    pub noise: Vec<f32>,
    /// Each pixel's light.
    pub light: Vec<f32>,
    /// Each pixel's reading.
    pub grey: Vec<u8>,
}

/// Copies fields into existing memory.
impl Clone for Particle {
    fn clone(&self) -> Self {
        Self {
            moment: self.moment,
            led: self.led,
            shown: self.shown.clone(),
            noise: self.noise.clone(),
            light: self.light.clone(),
            grey: self.grey.clone(),
        }
    }

    fn clone_from(&mut self, other: &Self) {
        (self.moment, self.led) = (other.moment, other.led);
        self.shown.clone_from(&other.shown);
        self.noise.clone_from(&other.noise);
        self.light.clone_from(&other.light);
        self.grey.clone_from(&other.grey);
    }
}

/// Pixels around an LED.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// The LED's position in the region.
    pub centre: [f64; 2],
    /// Half the side.
    pub radius: f64,
    /// The whole of it.
    pub region: Region,
}

/// LEDs across and down whose bits affect the one in the middle.
const NEAR: usize = 2;

impl Particle {
    /// Redraws some of the random numbers. Returns whether the light changes.
    pub fn change(&mut self, window: Window, law: &PixelLaw, random: &mut impl Rng) -> bool {
        match random.next_u32() % 8 {
            0 => self.change_phase(random),
            1..=3 => self.change_bits(random),
            _ => {
                self.change_noise(window, law, random);
                return false;
            }
        }
        true
    }

    /// Redraws one or two bits of neighbours, and perhaps those of LEDs farther away.
    fn change_bits(&mut self, random: &mut impl Rng) {
        let (row, column) = (self.led / SIDE, self.led % SIDE);
        let is_near = |led: usize| (led / SIDE).abs_diff(row) <= NEAR && (led % SIDE).abs_diff(column) <= NEAR;
        let near: Vec<usize> = (0..LEDS).filter(|&led| is_near(led)).collect();
        let mut drawn = 0u64;
        for _ in 0..1 + random.next_u32() % 2 {
            drawn |= 1 << near[random.next_u32() as usize % near.len()];
        }
        if random.next_u32().is_multiple_of(4) {
            // A quarter of the others.
            let some = random.next_u64() & random.next_u64();
            let far = (0..LEDS).filter(|&led| !is_near(led));
            drawn |= some & far.fold(0, |bits, led| bits | 1 << led);
        }
        for symbol in &mut self.shown[0].symbols {
            let flips = random.next_u64() & drawn;
            *symbol = PanelFrame::from_bits(symbol.bits() ^ flips);
        }
    }

    /// Changes the phase by up to a twentieth or to half of a pixel, cyclically.
    fn change_phase(&mut self, random: &mut impl Rng) {
        let most = [0.05, 0.15, 0.5][random.next_u32() as usize % 3];
        for shift in &mut self.shown[0].shift_px {
            *shift = (*shift + most * (2.0 * uniform(random) - 1.0)).rem_euclid(1.0);
        }
    }

    /// Redraws the noise of some of the pixels near the LED, and perhaps of all others.
    fn change_noise(&mut self, window: Window, law: &PixelLaw, random: &mut impl Rng) {
        // One of two pixels, of four, of eight or of sixteen.
        let mask = (2 << (random.next_u32() % 4)) - 1;
        let elsewhere = random.next_u32().is_multiple_of(4);
        let width = window.region.width;
        for row in 0..window.region.height {
            let is_near_row = (row as f64 - window.centre[1]).abs() <= window.radius;
            if !is_near_row && !elsewhere {
                continue;
            }
            for column in 0..width {
                let is_near = is_near_row && (column as f64 - window.centre[0]).abs() <= window.radius;
                if (is_near && random.next_u32() & mask == 0) || (!is_near && elsewhere) {
                    let pixel = row * width + column;
                    self.noise[pixel] = part_of(random);
                    self.grey[pixel] = law.grey(self.light[pixel], self.noise[pixel]);
                }
            }
        }
    }

    /// Sets its light.
    pub fn expose(&mut self, light: &[f32], law: &PixelLaw) {
        for (pixel, &light) in light.iter().enumerate() {
            if light != self.light[pixel] {
                self.light[pixel] = light;
                self.grey[pixel] = law.grey(light, self.noise[pixel]);
            }
        }
    }
}

/// A number from 0 up to 1 in single precision.
pub fn part_of(random: &mut impl Rng) -> f32 {
    (random.next_u32() >> 8) as f32 / (1u32 << 24) as f32
}
