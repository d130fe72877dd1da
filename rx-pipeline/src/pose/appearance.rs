//! How a panel and what is around it look, but for where it is.

use link::panel::{LEDS, PanelFrame};
use nalgebra::{Matrix2, Vector2};

/// LEDs differ by this share of an On LED's light where nothing is known (standard deviation).
const USUAL_SPREAD: f64 = 0.03;
/// The least they are taken to: no LEDs are more alike, nor is any model of their images better.
const LEAST_SPREAD: f64 = 0.01;
/// The least variance of a pixel's noise: no camera has less.
const LEAST_NOISE: f64 = 1e-9;

/// Sums over all pixels that count.
#[derive(Clone, Copy)]
pub(super) struct Sums {
    /// Squared misfits, over what light there is: for the noise.
    pub misfit: [f64; 2],
    pub light: [f64; 3],
    pub pixels: f64,
    /// Squared misfit over noise of what is around, and its pixels.
    pub around: [f64; 2],
    /// Squared pull on LEDs along x and y, and how much noise would pull.
    pub pull: f64,
    pub hold: f64,
}

/// How a panel looks in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Appearance {
    /// Standard deviation of the blur.
    pub(super) sigma: f64,
    /// Light around the panel, and by how much it changes to the window's edges.
    pub(super) ground: [f64; 3],
    /// What an Off and an On LED add to it.
    pub(super) levels: [f64; 2],
    /// Variance of the LEDs' own differences, of Off and of On ones.
    pub(super) spread: [f64; 2],
    /// Variance of a pixel without light, and what light 1 adds to it.
    pub(super) noise: [f64; 2],
    /// Pixels count up to here, in pitches outside the panel's cells.
    pub(super) rim: f64,
}

impl Appearance {
    /// Of a panel of which nothing but the blur is supposed.
    pub(super) const fn of_blur(sigma: f64) -> Self {
        Self {
            sigma,
            ground: [1.0, 0.0, 0.0],
            levels: [0.0; 2],
            spread: [1.0; 2],
            noise: [1e-3, 1e-3],
            rim: 0.0,
        }
    }

    /// Variance of a pixel's noise under such light.
    pub(super) fn noise_of(&self, light: f64) -> f64 {
        self.noise[0] + self.noise[1] * light
    }

    /// By which share what is learnt differs from what was supposed, at most.
    pub(super) fn differs_from(&self, other: &Self) -> f64 {
        let dark = self.ground[0].max(0.0);
        let bright = dark + self.levels[1].max(0.0);
        let of = |look: &Self| {
            let [off, on] = look.spread;
            [look.noise_of(dark), look.noise_of(bright), off, on]
        };
        let both = of(self).into_iter().zip(of(other));
        both.map(|(now, then)| (now / then - 1.0).abs()).fold(0.0, f64::max)
    }

    /// By how much Off LEDs differ (standard deviation), over what On ones add to them.
    pub(super) fn off_spread(&self) -> f64 {
        let contrast = (self.levels[1] - self.levels[0]).abs();
        libm::sqrt(self.spread[0]) / contrast.max(f64::MIN_POSITIVE)
    }

    /// Supposes that LEDs differ as usual.
    pub(super) fn suppose_spread(&mut self) {
        self.spread = [self.square_of_contrast(USUAL_SPREAD); 2];
    }

    fn square_of_contrast(&self, share: f64) -> f64 {
        let light = share * (self.levels[1] - self.levels[0]);
        (light * light).max(f64::MIN_POSITIVE)
    }

    /// Learns by how much LEDs differ: their squared differences over how many of them the pixels tell (MacKay 1992). Gives back how many
    /// numbers the pixels tell of all LEDs' own.
    pub(super) fn learn_spread(&mut self, bits: PanelFrame, own: &[f64; LEDS], variance: &[f64; LEDS]) -> f64 {
        let least = self.square_of_contrast(LEAST_SPREAD);
        let mut free = 0.0;
        for (on, spread) in self.spread.iter_mut().enumerate() {
            let (mut squares, mut told) = (0.0, 0.0);
            for led in (0..LEDS).filter(|&led| usize::from(bits.led(led)) == on) {
                squares += own[led] * own[led];
                told += 1.0 - variance[led] / *spread;
            }
            free += told;
            if told > 0.0 {
                *spread = squares / told;
            }
            *spread = spread.max(least);
        }
        free.clamp(0.0, LEDS as f64)
    }

    /// Learns the noise from what is left once so many numbers are fitted, by regression on the light.
    pub(super) fn learn_noise(&mut self, sums: &Sums, fitted: f64) {
        let [a, b, c] = sums.light;
        let share = sums.pixels / (sums.pixels - fitted).max(1.0);
        let misfit = Vector2::from(sums.misfit) * share;
        let alone = [misfit.x / a, misfit.y / c];
        let both = Matrix2::new(a, b, b, c).try_inverse().map(|inverse| inverse * misfit);
        let [dark, of_light] = match both {
            Some(noise) if noise.x >= 0.0 && noise.y >= 0.0 => [noise.x, noise.y],
            Some(noise) if noise.x < 0.0 => [0.0, alone[1]],
            _ => [alone[0], 0.0],
        };
        self.noise = [dark.max(LEAST_NOISE), of_light.max(0.0)];
    }
}

impl Sums {
    pub(super) const NONE: Self = Self {
        misfit: [0.0; 2],
        light: [0.0; 3],
        pixels: 0.0,
        around: [0.0; 2],
        pull: 0.0,
        hold: 0.0,
    };

    /// Squared pull on LEDs away from the lattice, over noise's.
    pub(super) fn scatter(&self) -> f64 {
        self.pull / self.hold
    }
}
