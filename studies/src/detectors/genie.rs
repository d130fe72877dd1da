//! The genie: the likeliest panel of a frame, if everything but the bits is known.
//!
//! The genie knows the true position, blur, levels and noise of the panel: the renderer itself supplies each LED's image, and the sensor's
//! noise model the probability of each grey level. It searches for the bits of greatest likelihood from several starts, among them the true
//! bits, by flipping single LEDs and pairs of them. If it errs, other bits explain the frame better than the true ones, and no receiver
//! could detect the error.
//!
//! # The bound
//!
//! All panels are equally probable, so the likeliest is right more often than any other choice: no receiver is expected to read fewer
//! *panels* wrongly. A wrong panel has at least one wrong bit, so no bit error rate is expected below a 64th of that share. The genie's own
//! *bit* errors are not a bound, because it does not decide bit by bit: if it errs, others may err in fewer bits. In few frames, chance
//! decides which of two counts is larger: the bound applies to the expectation.
//!
//! It is not quite the maximum over all 2⁶⁴ panels: one far from all starts would be missed, so the count of the genie's errors can only be
//! too low.

use link::panel::{LEDS, PanelFrame};

use sim::camera::clock::Moment;
use sim::camera::curve::Curve;
use sim::camera::noise::{Noise, electrons_per_linear};
use sim::renderer::canvas::{Canvas, Region};
use sim::renderer::{PanelExposure, Renderer};

/// Steps of the table of probabilities, evenly spaced in the root of the linear value.
const STEPS: usize = 1024;
/// Electrons at middle grey from which on their number counts as normally distributed.
const NORMAL_ELECTRONS: f64 = 300.0;
/// The least log probability of a grey level, in nats, so that a frame never excludes any bits with certainty.
const LEAST_LOG: f32 = -200.0;
/// The part of its brightest pixel below which an LED's light is ignored.
const NEGLIGIBLE: f32 = 1e-5;
/// Rounds of the search.
const ROUNDS: usize = 50;

/// The logarithm of the probability of each grey level at each light.
pub struct LikelihoodTable {
    steps_per_root: f32,
    /// For each grey level, the values at all steps.
    log: Vec<Vec<f32>>,
}

impl LikelihoodTable {
    /// For a renderer's camera, with noise if the renderer simulates it.
    pub fn new(renderer: &Renderer) -> Self {
        let view = renderer.view();
        let curve = renderer.curve();
        let noise = renderer
            .plan()
            .includes("noise")
            .then(|| Noise::new(&view.scene, &view.exposure, curve));
        let brightest = (2.0 * renderer.plan().range.peak).max(curve.linear(255.0));
        let steps_per_root = (STEPS - 1) as f64 / brightest.sqrt();
        let mut log = vec![vec![0.0; STEPS]; 256];
        let electrons = electrons_per_linear(&view.scene, &view.exposure);
        for step in 0..STEPS {
            let linear = (step as f64 / steps_per_root).powi(2);
            let probability = match &noise {
                Some(noise) if electrons < NORMAL_ELECTRONS => noise.distribution(linear),
                Some(_) => {
                    let read = view.scene.camera.read_noise_e;
                    let deviation = (linear * electrons + read * read).sqrt() / electrons;
                    normal(linear, deviation.max(1e-6), curve)
                }
                None => rounding(linear, curve),
            };
            for (level, &p) in log.iter_mut().zip(&probability) {
                level[step] = (p.ln() as f32).max(LEAST_LOG);
            }
        }
        Self {
            steps_per_root: steps_per_root as f32,
            log,
        }
    }

    /// ln P(grey | linear), interpolated.
    pub fn log(&self, grey: u8, linear: f32) -> f32 {
        let place = (linear.max(0.0).sqrt() * self.steps_per_root).min((STEPS - 2) as f32);
        let step = place as usize;
        let row = &self.log[usize::from(grey)];
        row[step] + (row[step + 1] - row[step]) * (place - step as f32)
    }
}

/// A pixel of normally distributed light.
fn normal(linear: f64, deviation: f64, curve: Curve) -> [f64; 256] {
    // Tails that erfc rounds to 0 are continued by parabolas.
    let below = |level: usize| match level {
        0 => 0.0,
        256 => 1.0,
        level => {
            let t = (curve.linear(level as f64 - 0.5) - linear) / deviation;
            0.5 * libm::erfc(-t * std::f64::consts::FRAC_1_SQRT_2)
        }
    };
    let above = |level: usize| match level {
        0 => 1.0,
        256 => 0.0,
        level => {
            let t = (curve.linear(level as f64 - 0.5) - linear) / deviation;
            0.5 * libm::erfc(t * std::f64::consts::FRAC_1_SQRT_2)
        }
    };
    // From the smaller tail, so that small probabilities are exact.
    std::array::from_fn(|level| (below(level + 1) - below(level)).max(above(level) - above(level + 1)))
}

/// A pixel without noise: its grey level, with the tolerance of drawing.
fn rounding(linear: f64, curve: Curve) -> [f64; 256] {
    let expected = curve.unrounded(linear);
    let weight = |level: usize| {
        let beyond = ((level as f64 - expected).abs() - 0.5).max(0.0);
        (-0.5 * (beyond / 0.1).powi(2)).exp()
    };
    let weights: [f64; 256] = std::array::from_fn(weight);
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// The change of light in the region if one LED is On rather than Off.
struct Spot {
    /// (Position in the region, light).
    pixels: Vec<(usize, f32)>,
}

/// The genie's knowledge of one frame.
pub struct Genie<'a> {
    likelihood: &'a LikelihoodTable,
    grey: &'a [u8],
    expected: Vec<f32>,
    spots: Vec<Spot>,
    neighbours: Vec<Vec<usize>>,
    bits: PanelFrame,
}

impl<'a> Genie<'a> {
    /// A genie for the frame `grey` of `region`, in which the renderer's first panel was `shown` at `moment`.
    pub fn new(
        renderer: &Renderer,
        likelihood: &'a LikelihoodTable,
        moment: &Moment,
        shown: &[PanelExposure],
        region: Region,
        grey: &'a [u8],
    ) -> Self {
        let mut canvas = Canvas::new(region);
        let mut shown = shown.to_vec();
        let mut drawn = |bits: u64| {
            shown[0].symbols = [PanelFrame::from_bits(bits); sim::camera::clock::WINDOW];
            renderer.draw(moment, &shown, &mut canvas);
            canvas.values().to_vec()
        };
        let expected = drawn(0);
        let spots: Vec<Spot> = (0..LEDS)
            .map(|led| {
                let lit = drawn(1 << led);
                let light: Vec<f32> = lit.iter().zip(&expected).map(|(on, off)| on - off).collect();
                let least = NEGLIGIBLE * light.iter().fold(0.0f32, |most, light| most.max(light.abs()));
                Spot {
                    pixels: light.into_iter().enumerate().filter(|(_, light)| light.abs() > least).collect(),
                }
            })
            .collect();
        let neighbours = (0..LEDS).map(|led| {
            (led + 1..LEDS)
                .filter(|&other| {
                    let (dx, dy) = ((led % 8).abs_diff(other % 8), (led / 8).abs_diff(other / 8));
                    dx <= 2 && dy <= 2
                })
                .collect()
        });
        Self {
            likelihood,
            grey,
            expected,
            neighbours: neighbours.collect(),
            spots,
            bits: PanelFrame::default(),
        }
    }

    /// The likeliest bits, by a search from each of `starts`.
    pub fn bits(&mut self, starts: &[PanelFrame]) -> PanelFrame {
        let mut best = (f64::NEG_INFINITY, PanelFrame::default());
        for &start in starts {
            self.set(start);
            self.climb();
            let log = self.log();
            if log > best.0 {
                best = (log, self.bits);
            }
        }
        best.1
    }

    fn log(&self) -> f64 {
        let pixels = self.grey.iter().zip(&self.expected);
        pixels.map(|(&grey, &light)| f64::from(self.likelihood.log(grey, light))).sum()
    }

    fn set(&mut self, bits: PanelFrame) {
        for led in 0..LEDS {
            if bits.led(led) != self.bits.led(led) {
                self.flip(led);
            }
        }
    }

    fn sign(&self, led: usize) -> f32 {
        if self.bits.led(led) { -1.0 } else { 1.0 }
    }

    fn flip(&mut self, led: usize) {
        let sign = self.sign(led);
        for &(at, light) in &self.spots[led].pixels {
            self.expected[at] += sign * light;
        }
        self.bits = PanelFrame::from_bits(self.bits.bits() ^ 1 << led);
    }

    /// The gain of log-likelihood by flipping an LED.
    fn gain(&self, led: usize) -> f32 {
        let sign = self.sign(led);
        let change = |&(at, light): &(usize, f32)| {
            let (grey, before) = (self.grey[at], self.expected[at]);
            self.likelihood.log(grey, before + sign * light) - self.likelihood.log(grey, before)
        };
        self.spots[led].pixels.iter().map(change).sum()
    }

    fn climb(&mut self) {
        for _ in 0..ROUNDS {
            if !self.climb_singly() && !self.climb_by_pairs() {
                return;
            }
        }
    }

    fn climb_singly(&mut self) -> bool {
        let mut risen = false;
        for led in 0..LEDS {
            if self.gain(led) > LEAST_GAIN {
                self.flip(led);
                risen = true;
            }
        }
        risen
    }

    fn climb_by_pairs(&mut self) -> bool {
        for led in 0..LEDS {
            let alone = self.gain(led);
            self.flip(led);
            let partner = self.neighbours[led]
                .iter()
                .copied()
                .find(|&other| alone + self.gain(other) > LEAST_GAIN);
            if let Some(other) = partner {
                self.flip(other);
                return true;
            }
            self.flip(led);
        }
        false
    }
}

/// Smaller gains are rounding.
const LEAST_GAIN: f32 = 1e-2;
