//! Channels between a framer and a deframer, for tests and examples: seeded, and identical on every machine.

use link::framing::Framer;
use link::panel::{LLR_STEP, Llr, PanelFrame, SoftPanel};
use link::scramble::split_mix64;

/// The channel's effect on each LED.
#[derive(Clone, Copy, Debug)]
pub enum Channel {
    /// Hard decisions: each LED is read wrongly with this probability, and all readings are equally certain.
    Bsc(f64),
    /// Soft decisions in white Gaussian noise for which hard decisions would be wrong with this probability.
    Awgn(f64),
}

impl Channel {
    /// A camera's reading of `panel`.
    pub fn read(self, panel: PanelFrame, noise: &mut Noise) -> SoftPanel {
        let truth = |led| if panel.led(led) { 1.0 } else { -1.0 };
        match self {
            Self::Bsc(p) => {
                let certainty = ((1.0 - p) / p).ln();
                SoftPanel(core::array::from_fn(|led| {
                    quantised(if noise.uniform() < p { -certainty } else { certainty } * truth(led))
                }))
            }
            Self::Awgn(p) => {
                let sigma = sigma_of(p);
                SoftPanel(core::array::from_fn(|led| {
                    quantised(2.0 * (truth(led) + sigma * noise.gaussian()) / (sigma * sigma))
                }))
            }
        }
    }

    /// A reading of the next panel of `framer`.
    pub fn read_next(self, framer: &mut Framer, noise: &mut Noise) -> SoftPanel {
        self.read(framer.next_panel(), noise)
    }
}

fn quantised(llr: f64) -> Llr {
    (llr / f64::from(LLR_STEP)).round().clamp(-127.0, 127.0) as Llr
}

/// The standard deviation of the noise on levels of ±1 of which a fraction `p` is on the wrong side of 0: Q(1/σ) = p.
fn sigma_of(p: f64) -> f64 {
    let (mut low, mut high) = (0.01, 100.0);
    for _ in 0..60 {
        let sigma = 0.5 * (low + high);
        let wrong = 0.5 * libm::erfc(core::f64::consts::FRAC_1_SQRT_2 / sigma);
        if wrong < p { low = sigma } else { high = sigma }
    }
    low
}

/// A stream of random numbers.
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(split_mix64(seed.wrapping_add(1)))
    }

    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(1);
        split_mix64(self.0)
    }

    /// Uniform in 0 to 1, without 1.
    pub fn uniform(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal, by Box and Muller's transform.
    pub fn gaussian(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (core::f64::consts::TAU * self.uniform()).cos()
    }

    pub fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.word() as u8).collect()
    }
}
