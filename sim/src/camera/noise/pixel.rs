//! Grey levels of pixels of any linear values, drawn one after another.
//!
//! The distributions of the grey level are tabulated at *knots*: expected electrons λ, equally spaced in √(λ + σ²) so that their distance Δ
//! is the sixteenth part of the standard deviation s = √(λ + σ²). A pixel between two knots is drawn from either at random, such that its
//! expectation is exact. The effect on the distribution of the electrons:
//!
//! - The mean is exact. The variance v grows by w·(1 − w)·Δ² if the next knot has the probability w, relatively by at most (√(v + Δ) − √v)²
//!   = 1/1024.
//! - A mixture of the distributions p of two knots differs from the distribution between them by at most w·(1 − w)/2·Δ²·max‖p″‖ in the sum
//!   over all values. For a Poisson distribution p″ is its second difference, whose sum is at most √2/λ; smeared by a normal distribution
//!   it is at most √2/σ², too. As min(1/λ, 1/σ²) ≤ 2/s², no event's probability is off by more than √2/8·(Δ/s)² = 0.0007. The grey level is
//!   a function of the electrons, so this holds for it as well. [`LAW_ERROR`] leaves room for the series that tabulates many electrons.
//! - No tail is heavier than that of a pixel a sixteenth of a standard deviation brighter or darker.
//!
//! Above 65 000 electrons in a white pixel there would be more than [`MOST_KNOTS`]. Their distance is then greater, a thirtieth of a grey
//! level at a gamma of 2.2, while the noise itself is less than half a grey level.
//!
//! A draw takes 32 random bits: 16 for the knot, 8 for the column of its alias table, 8 for the side of the column.

use rand::Rng;

use super::Noise;
use super::alias::{Builder, Column, Fine};
use super::law::{Band, ManyLaws};

/// The greatest error of the probability of any event in the grey level of a pixel.
pub const LAW_ERROR: f64 = 8e-4;

/// Knots in a standard deviation.
const KNOTS_PER_DEVIATION: f64 = 16.0;
const MOST_KNOTS: f64 = 8192.0;
/// Pixels per block of random bits.
const BLOCK: usize = 256;
/// The greatest share of readings of white pixels at any other level.
const NEGLIGIBLE: f64 = 1e-12;

/// The position of a linear value between the knots: the knot's number and, in the lower 16 bits, the probability of the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Site(u32);

/// Draws grey levels of pixels of any linear values.
#[derive(Clone, Debug)]
pub struct PixelNoise {
    scale: Scale,
    /// log₂ of the columns of each knot.
    column_bits: u32,
    columns: Vec<Column>,
    fine: Vec<Fine>,
}

/// Knots are equally spaced in √(λ + σ²).
#[derive(Clone, Copy, Debug)]
struct Scale {
    electrons_per_linear: f32,
    variance: f32,
    deviation: f32,
    knots_per_root: f32,
    /// The last knot, whose pixels are all white.
    last: f32,
    /// The root at the last knot.
    white: f32,
}

impl Scale {
    fn electrons(&self, knot: usize) -> f64 {
        let root = knot as f64 / f64::from(self.knots_per_root);
        root * (root + 2.0 * f64::from(self.deviation))
    }

    /// Weights are linear in λ: with r = √(λ + σ²) between a and b, (r² − a²)/(b² − a²).
    #[inline(always)]
    fn site(&self, linear: f32) -> Site {
        let linear = if linear > 0.0 { linear } else { 0.0 };
        let root = (linear * self.electrons_per_linear + self.variance).sqrt();
        let root = if root < self.white { root } else { self.white };
        let position = ((root - self.deviation) * self.knots_per_root).min(self.last);
        // From half a knot below, the nearest integer is the knot below; beside a knot it may be either one.
        let knot = nearest(position.max(0.5) - 0.5);
        let step = 1.0 / self.knots_per_root;
        let below = knot as f32 * step + self.deviation;
        let weight = (position - knot as f32) * (root + below) / (2.0 * below + step);
        Site((knot << 16).wrapping_add(nearest(weight * 65536.0)))
    }
}

/// Rounds a number from 0 to 2²² to the nearest integer. Adding 2²³ leaves a float no fraction bits; unlike a checked cast, this is
/// vectorised.
#[inline(always)]
fn nearest(number: f32) -> u32 {
    const NO_FRACTION: f32 = (1 << 23) as f32;
    (number + NO_FRACTION).to_bits() & ((1 << 23) - 1)
}

impl PixelNoise {
    /// For pixels under `noise`.
    pub fn new(noise: &Noise) -> Self {
        let mut laws = ManyLaws::new(noise.law());
        let scale = scale(noise, &mut laws);
        let knots: Vec<Band> = (0..=scale.last as usize).map(|knot| laws.of(scale.electrons(knot))).collect();
        let widest = knots.iter().map(|band| band.probabilities.len()).max();
        let count = widest.unwrap_or(1).next_power_of_two().max(2);
        let mut columns = vec![Column::default(); knots.len() * count];
        let mut fine = vec![0; knots.len() * count];
        let mut builder = Builder::default();
        let tables = columns.chunks_exact_mut(count).zip(fine.chunks_exact_mut(count));
        for (band, (columns, fine)) in knots.iter().zip(tables) {
            builder.build(band.first as u8, &band.probabilities, columns, fine);
        }
        Self {
            scale,
            column_bits: count.trailing_zeros(),
            columns,
            fine,
        }
    }

    /// The positions of linear values between the knots.
    pub(crate) fn sites(&self, linear: &[f32], sites: &mut [Site]) {
        let scale = self.scale;
        for (site, &linear) in sites.iter_mut().zip(linear) {
            *site = scale.site(linear);
        }
    }

    /// The distribution of draws for a linear value: 256 probabilities, within [`LAW_ERROR`] of [`Noise::distribution`].
    pub fn distribution(&self, linear: f32) -> [f64; 256] {
        let Site(site) = self.scale.site(linear);
        let (knot, next) = ((site >> 16) as usize, f64::from(site & 0xffff) / 65536.0);
        let count = 1 << self.column_bits;
        let mut law = [0.0; 256];
        for (knot, chance) in [(knot, 1.0 - next), (knot + 1, next)] {
            let columns = self.columns.iter().zip(&self.fine);
            for (column, &fine) in columns.skip(knot * count).take(count) {
                column.add_law(fine, chance / count as f64, &mut law);
            }
        }
        law
    }

    /// Reads pixels of the given linear values.
    pub fn read(&self, linear: &[f32], random: &mut impl Rng, grey: &mut [u8]) {
        let mut sites = [Site::default(); BLOCK];
        for (linear, grey) in linear.chunks(BLOCK).zip(grey.chunks_mut(BLOCK)) {
            let sites = &mut sites[..linear.len()];
            self.sites(linear, sites);
            self.read_sites(sites, random, grey);
        }
    }

    /// Reads pixels of linear values whose [sites](PixelNoise::sites) are known.
    pub(crate) fn read_sites(&self, sites: &[Site], random: &mut impl Rng, grey: &mut [u8]) {
        let mut bytes = [0; 4 * BLOCK];
        let spare_bits = 8 - self.column_bits;
        for (sites, grey) in sites.chunks(BLOCK).zip(grey.chunks_mut(BLOCK)) {
            let bytes = &mut bytes[..4 * sites.len()];
            random.fill_bytes(bytes);
            for ((grey, site), bits) in grey.iter_mut().zip(sites).zip(bytes.chunks_exact(4)) {
                let bits = u32::from_le_bytes([bits[0], bits[1], bits[2], bits[3]]);
                let knot = (site.0 + (bits & 0xffff)) >> 16;
                let index = ((knot << 8 | bits >> 24) >> spare_bits) as usize;
                let column = self.columns[index];
                *grey = match column.level((bits >> 16) as u8) {
                    Some(level) => level,
                    None => column.settle(self.fine[index], random),
                };
            }
        }
    }
}

/// The distribution of [`PixelNoise`], for draws by quantile: such a draw changes little if the light changes little.
#[derive(Clone, Debug)]
pub struct PixelLaw {
    scale: Scale,
    /// The cumulative probabilities of all levels, for each knot.
    up_to: Vec<[f32; 256]>,
}

impl PixelLaw {
    /// The distribution of `noise`.
    pub fn new(noise: &PixelNoise) -> Self {
        let count = 1 << noise.column_bits;
        let columns = noise.columns.chunks(count).zip(noise.fine.chunks(count));
        let of_knot = |(columns, fine): (&[Column], &[Fine])| {
            let mut law = [0.0; 256];
            for (column, &fine) in columns.iter().zip(fine) {
                column.add_law(fine, 1.0 / count as f64, &mut law);
            }
            let mut sum = 0.0;
            law.map(|probability| {
                sum += probability;
                sum as f32
            })
        };
        Self {
            scale: noise.scale,
            up_to: columns.map(of_knot).collect(),
        }
    }

    /// The grey level at the quantile `part`, from 0 up to 1, of readings of a pixel of a linear value.
    #[inline]
    pub fn grey(&self, linear: f32, part: f32) -> u8 {
        let Site(site) = self.scale.site(linear);
        let (knot, next) = ((site >> 16) as usize, (site & 0xffff) as f32 / 65536.0);
        let below = &self.up_to[knot];
        let above = self.up_to.get(knot + 1).unwrap_or(below);
        let (mut low, mut high) = (0usize, 255);
        while low < high {
            let middle = (low + high) / 2;
            if below[middle] * (1.0 - next) + above[middle] * next > part {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        low as u8
    }
}

/// Knots from darkness to the first with white pixels only.
fn scale(noise: &Noise, laws: &mut ManyLaws) -> Scale {
    let deviation = noise.read_noise_e;
    let mut scale = Scale {
        electrons_per_linear: noise.electrons_per_linear as f32,
        variance: (deviation * deviation) as f32,
        deviation: deviation as f32,
        knots_per_root: (2.0 * KNOTS_PER_DEVIATION) as f32,
        last: 0.0,
        white: 0.0,
    };
    let white = |scale: &Scale, knot: usize, laws: &mut ManyLaws| {
        let band = laws.of(scale.electrons(knot));
        let dark: f64 = band.probabilities[..255usize.saturating_sub(band.first).min(band.probabilities.len())]
            .iter()
            .sum();
        dark < NEGLIGIBLE
    };
    let mut knot = 1;
    while !white(&scale, knot, laws) {
        knot += 1 + knot / 64;
    }
    if knot as f64 > MOST_KNOTS {
        scale.knots_per_root *= (MOST_KNOTS / knot as f64) as f32;
        knot = MOST_KNOTS as usize;
    }
    scale.last = knot as f32;
    scale.white = scale.last / scale.knots_per_root + scale.deviation;
    scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::curve::Curve;
    use crate::camera::exposure::Exposure;
    use crate::scene::Scene;

    fn noise(overrides: &[&str]) -> Noise {
        let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
        let scene = Scene::load("paper", &overrides).unwrap();
        Noise::new(&scene, &Exposure::of(&scene), Curve::of(&scene.camera))
    }

    /// Cameras from ISO 100 to 32 000, without read noise, with little, the usual and much, and with few electrons.
    const CAMERAS: [&[&str]; 9] = [
        &["ambient.illuminance_lx=20000"],
        &["ambient.illuminance_lx=500"],
        &["ambient.illuminance_lx=50"],
        &["ambient.illuminance_lx=50", "camera.read_noise_e=0"],
        &["ambient.illuminance_lx=5000", "camera.read_noise_e=0"],
        &["ambient.illuminance_lx=1000", "camera.read_noise_e=0.4"],
        &["ambient.illuminance_lx=50", "camera.read_noise_e=1000"],
        &["ambient.illuminance_lx=50", "camera.full_well_e=2000"],
        &["ambient.illuminance_lx=20000", "camera.gamma=1", "camera.full_well_e=60000"],
    ];

    #[test]
    fn what_is_drawn_follows_the_law_within_its_error() {
        for camera in CAMERAS {
            let noise = noise(camera);
            let pixels = PixelNoise::new(&noise);
            let mut linear = 1e-4f32;
            while linear < 20.0 {
                let (drawn, exact) = (pixels.distribution(linear), noise.distribution(linear.into()));
                let apart: f64 = drawn.iter().zip(exact).map(|(a, b)| (a - b).abs()).sum();
                assert!(apart / 2.0 < LAW_ERROR, "{camera:?}, linear {linear}: {}", apart / 2.0);
                linear *= 1.37;
            }
        }
    }

    #[test]
    fn quantiles_are_those_of_the_law() {
        const PARTS: u32 = 100_000;
        for camera in CAMERAS {
            let pixels = PixelNoise::new(&noise(camera));
            let law = PixelLaw::new(&pixels);
            for linear in [0.0, 0.01, 0.7, 1.0, 3.1, 9.0] {
                let mut counts = [0; 256];
                for k in 0..PARTS {
                    let grey = law.grey(linear, (k as f32 + 0.5) / PARTS as f32);
                    counts[usize::from(grey)] += 1;
                }
                for (count, p) in counts.into_iter().zip(pixels.distribution(linear)) {
                    let part = f64::from(count) / f64::from(PARTS);
                    assert!((part - p).abs() < 2.0 / f64::from(PARTS), "{part} for {p}");
                }
            }
        }
    }

    #[test]
    fn the_expectation_is_met_between_knots() {
        for camera in CAMERAS {
            let noise = noise(camera);
            let scale = PixelNoise::new(&noise).scale;
            let white = scale.electrons(scale.last as usize) / noise.electrons_per_linear;
            for step in 0..1000 {
                let linear = (white * (f64::from(step) / 1000.0).powi(3)) as f32;
                let Site(site) = scale.site(linear);
                let [a, b] = [0, 1].map(|next| scale.electrons((site >> 16) as usize + next));
                let met = a + (b - a) * f64::from(site & 0xffff) / 65536.0;
                let expected = f64::from(linear) * noise.electrons_per_linear;
                let deviation = (expected + noise.read_noise_e.powi(2)).sqrt();
                // Relative to the deviation: 2⁻¹⁶ of a knot's distance and the rounding of f32.
                let allowed = 1e-5 + 4e-7 * (deviation + expected / deviation.max(1e-3));
                assert!(
                    (met - expected).abs() < allowed * deviation.max(1e-3),
                    "{camera:?}, linear {linear}: {met} for {expected}"
                );
            }
        }
    }

    #[test]
    fn odd_values_do_no_harm() {
        let pixels = PixelNoise::new(&noise(&["ambient.illuminance_lx=50"]));
        let mut grey = [7; 4];
        let mut random = crate::random::stream(1, 0, crate::random::Purpose::Noise);
        pixels.read(&[f32::NAN, -1.0, f32::INFINITY, f32::MAX], &mut random, &mut grey);
        assert_eq!(grey[2..], [255, 255]);
    }

    #[test]
    fn cameras_of_many_electrons_keep_a_table_of_bounded_size() {
        let noise = noise(&["ambient.illuminance_lx=100000", "camera.full_well_e=1e7", "camera.iso_min=1"]);
        let pixels = PixelNoise::new(&noise);
        assert!(pixels.columns.len() <= 8193 * 16, "{}", pixels.columns.len());
        let law = pixels.distribution(1.0);
        assert!(law[118] > 0.999, "{}", law[118]);
    }
}
