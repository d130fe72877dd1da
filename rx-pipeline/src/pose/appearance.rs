//! The appearance of a panel and its surroundings, independent of its position.

use link::panel::{LEDS, PanelFrame};
use nalgebra::{Matrix2, Vector2};

/// The prior spread of LEDs, as a share of an On LED's light (standard deviation).
const USUAL_SPREAD: f64 = 0.03;
/// The least spread, because LEDs are not more alike, and models of their images are not more accurate.
const LEAST_SPREAD: f64 = 0.01;
/// The least variance of a pixel's noise.
const LEAST_NOISE: f64 = 1e-9;

/// Sums over all pixels in use.
#[derive(Clone, Copy)]
pub(super) struct Sums {
    /// Squared residuals, weighted by powers of the light, for the noise.
    pub misfit: [f64; 2],
    pub light: [f64; 3],
    pub pixels: f64,
    /// Squared residuals of the surroundings relative to noise, and their number of pixels.
    pub around: [f64; 2],
    /// Squared pull on LEDs along x and y.
    pub pull: f64,
    /// Its expectation by noise.
    pub hold: f64,
}

/// The appearance of a panel in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Appearance {
    /// Standard deviation of the blur.
    pub(super) sigma: f64,
    /// Light around the panel, and its change to the window's edges.
    pub(super) ground: [f64; 3],
    /// The light of an Off and of an On LED above the ground.
    pub(super) levels: [f64; 2],
    /// Variance of the LEDs' individual deviations, of Off and of On ones.
    pub(super) spread: [f64; 2],
    /// Variance of a pixel without light, and its increase per light 1.
    pub(super) noise: [f64; 2],
    /// The limit of the pixels in use, in pitches outside the panel's cells.
    pub(super) rim: f64,
}

impl Appearance {
    /// The initial appearance: only the blur is known.
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

    /// Variance of a pixel's noise at that light.
    pub(super) fn noise_of(&self, light: f64) -> f64 {
        self.noise[0] + self.noise[1] * light
    }

    /// The greatest relative difference of noise and spread.
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

    /// The spread of Off LEDs (standard deviation), relative to the contrast.
    pub(super) fn off_spread(&self) -> f64 {
        let contrast = (self.levels[1] - self.levels[0]).abs();
        libm::sqrt(self.spread[0]) / contrast.max(f64::MIN_POSITIVE)
    }

    pub(super) fn set_prior_spread(&mut self) {
        self.spread = [self.square_of_contrast(USUAL_SPREAD); 2];
    }

    fn square_of_contrast(&self, share: f64) -> f64 {
        let light = share * (self.levels[1] - self.levels[0]);
        (light * light).max(f64::MIN_POSITIVE)
    }

    /// Estimates the spread of LEDs: their squared deviations over the number that the pixels determine (MacKay 1992). Returns that
    /// effective number for all LEDs.
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

    /// Estimates the noise from the residuals after a fit of `fitted` parameters, by regression on the light.
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

    /// Squared pull on LEDs away from the lattice, relative to noise.
    pub(super) fn scatter(&self) -> f64 {
        self.pull / self.hold
    }
}
