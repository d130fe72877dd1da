//! The panel's pixels as seen, and as the model expects them.
//!
//! Both are in root light ([`RootMetric`]), in which all pixels weigh the same.

use super::crop::Crop;
pub(super) use crate::approximate::{censored_loss, root};
use crate::frame::Frame;
#[cfg(feature = "surroundings")]
use crate::spots::Shade;
use crate::spots::{LANES, RootMetric, SpotTable};
use link::panel::{LEDS, SIDE};

/// The share of saturated pixels from which light is no longer linear in the bits (share). Higher: the form that lists sets of flips
/// ignores saturation; lower: fewer sets are tried.
const OVEREXPOSED: f32 = 0.2;
/// The ground is white if this many of the 49 places between four LEDs are at grey 255 (count). Fewer: LEDs that run together count as
/// ground; more: a hot or dead pixel, or clutter, hides white ground.
const FULL_GROUND: usize = 45;
/// Minimum pitch for ground between overexposed LEDs, because nearer ones run together (px of the image).
const APART_PX: f32 = 4.0;

/// The root light of excluded pixels, seen and expected: it is so bright that no LED changes it, so that loops need no branch for them.
const LEFT_OUT: f32 = 1e6;

/// The longest side of an image.
pub(super) const SIDE_MAX: usize = 128;

/// A panel's pixels.
pub(super) struct Image<const PIXELS: usize> {
    /// Pixels of the image.
    pub size: [usize; 2],
    pub stride: usize,
    /// Addition to light under the root.
    pub offset: f32,
    /// The lowest root light at grey 255, from which on a pixel is a lower bound; beyond all light if no pixel is one.
    pub full: f32,
    /// One bit a row: whether a pixel of it is saturated.
    saturated_rows: u128,
    /// Root light as seen; at least [`Image::full`] in saturated pixels.
    pub seen: [f32; PIXELS],
    /// Light as expected, plus the offset.
    pub expected: [f32; PIXELS],
    /// Its root.
    pub root: [f32; PIXELS],
}

impl<const PIXELS: usize> Image<PIXELS> {
    pub const fn new() -> Self {
        Self {
            size: [0; 2],
            stride: 0,
            offset: 0.0,
            full: 0.0,
            saturated_rows: 0,
            seen: [0.0; PIXELS],
            expected: [0.0; PIXELS],
            root: [0.0; PIXELS],
        }
    }

    /// Loads the panel's pixels; `offset` is that of the root. Returns false if they do not fit.
    pub fn load(&mut self, frame: &Frame<'_>, crop: &Crop, metric: &RootMetric, offset: f32) -> bool {
        let (window, bin) = (crop.window, crop.scale.bin);
        let [width, height] = [window.width / bin, window.height / bin];
        let stride = width.next_multiple_of(LANES);
        if width == 0 || height < LANES || stride > SIDE_MAX || height > SIDE_MAX || stride * height > PIXELS {
            return false;
        }
        (self.size, self.stride) = ([width, height], stride);
        (self.offset, self.full) = (offset, root(metric.full() + offset));
        self.saturated_rows = 0;
        let per_pixel = 1.0 / (bin * bin) as f32;
        for row in 0..height {
            let to = &mut self.seen[row * stride..][..stride];
            to.fill(0.0);
            let mut saturated = [0u16; SIDE_MAX];
            for y in window.y + bin * row..window.y + bin * (row + 1) {
                let Some(from) = frame.row(y).and_then(|from| from.get(window.x..window.x + bin * width)) else {
                    return false;
                };
                for ((to, saturated), from) in to.iter_mut().zip(&mut saturated).zip(from.chunks_exact(bin)) {
                    for &grey in from {
                        *to += metric.light(grey);
                        *saturated += u16::from(grey == u8::MAX);
                    }
                }
            }
            for (to, saturated) in to.iter_mut().zip(saturated) {
                *to = root(*to * per_pixel + offset);
                // One hot pixel does not make a block saturated, nor does the rim of an LED.
                if 2 * usize::from(saturated) >= bin * bin {
                    *to = to.max(self.full);
                    self.saturated_rows |= 1 << row;
                } else {
                    // Averages stay below the saturation limit.
                    *to = to.min(self.full * BELOW);
                }
            }
            let panel = crop.columns(row, width);
            let seen = &mut self.seen[row * stride..][..stride];
            seen[..panel.start].fill(LEFT_OUT);
            seen[panel.end..].fill(LEFT_OUT);
        }
        if self.has_full_ground(crop) {
            (self.full, self.saturated_rows) = (LEFT_OUT, 0);
        }
        true
    }

    /// Subtracts the excess of a shade in the frame over its mean. White pixels stay lower bounds, and so do pixels that become as bright.
    #[cfg(feature = "surroundings")]
    pub fn remove(&mut self, shade: &Shade, crop: &Crop) {
        let (mean, bin) = (shade.mean(), crop.scale.bin as f32);
        let [width, height] = self.size;
        let origin = [crop.window.x, crop.window.y].map(|first| first as f32 + 0.5 * (bin - 1.0));
        for y in 0..height {
            let row = &mut self.seen[y * self.stride..][..width];
            for (x, seen) in row.iter_mut().enumerate().filter(|(_, seen)| **seen < self.full) {
                let at = [origin[0] + bin * x as f32, origin[1] + bin * y as f32];
                let light = *seen * *seen - (shade.at(at) - mean);
                *seen = root(light.max(self.offset)).min(self.full);
                if *seen == self.full {
                    self.saturated_rows |= 1 << y;
                }
            }
        }
    }

    /// Whether the ground between the LEDs is saturated nearly everywhere: a white board in the sun. Off LEDs are then dark dots on white,
    /// and white counts as its actual level, because lower bounds determine no level.
    fn has_full_ground(&self, crop: &Crop) -> bool {
        let rows = (0..LEDS - SIDE).step_by(SIDE);
        let between = rows.flat_map(|row| (row..row + SIDE - 1).map(|led| crop.between(led)));
        let full = between.filter(|&[x, y]| {
            let seen = self.seen.get(y * self.stride + x);
            seen.is_some_and(|seen| (self.full..LEFT_OUT).contains(seen))
        });
        crop.scale.pitch >= APART_PX && full.count() >= FULL_GROUND
    }

    /// Whether [`Self::load`] found a [saturated ground](Self::has_full_ground).
    fn is_full_throughout(&self) -> bool {
        self.full >= LEFT_OUT
    }

    /// Whether too many pixels are saturated for light that is linear in the bits.
    pub fn is_overexposed(&self) -> bool {
        self.saturated_share() > OVEREXPOSED
    }

    /// The share of the pixels that are saturated.
    pub fn saturated_share(&self) -> f32 {
        let (mut all, mut full) = (0usize, 0usize);
        for (&seen, _) in self.pixels() {
            all += usize::from(seen < LEFT_OUT);
            full += usize::from((self.full..LEFT_OUT).contains(&seen));
        }
        full as f32 / all.max(1) as f32
    }

    pub fn is_saturated(&self, row: usize) -> bool {
        self.saturated_rows >> row & 1 == 1
    }

    /// Sets the expected light: `background` and each LED's light.
    pub fn expect(&mut self, spots: &SpotTable, background: f32, light: &[f32; LEDS]) {
        let used = self.stride * self.size[1];
        self.expected[..used].fill(background + self.offset);
        for (led, &light) in light.iter().enumerate() {
            self.add(spots, led, light);
        }
        self.take_roots();
    }

    /// Adds light to an LED. [`Image::take_roots`] must follow.
    pub fn add(&mut self, spots: &SpotTable, led: usize, light: f32) {
        let [x, y] = spots.first(led);
        for (row, &down) in (y..).zip(spots.down(led)) {
            let scale = light * down;
            let start = row * self.stride + x;
            for (to, &across) in self.expected[start..].iter_mut().zip(spots.across(led)) {
                *to += scale * across;
            }
        }
    }

    /// The mean square of root light about the expectation, over the unsaturated pixels, after a fit of `free` parameters.
    pub fn mean_square(&self, free: usize) -> f32 {
        let (mut sum, mut count) = (0.0, 0usize);
        for (&seen, &root) in self.pixels() {
            if seen < self.full {
                sum += (seen - root) * (seen - root);
                count += 1;
            }
        }
        sum / count.saturating_sub(free).max(1) as f32
    }

    /// The mean square of root light about the expectation, in the cells and around them.
    pub fn mean_squares_in_and_around(&self, crop: &Crop) -> [f32; 2] {
        let (mut sums, mut counts) = ([0.0; 2], [0usize; 2]);
        let [width, height] = self.size;
        for row in 0..height {
            let cells = crop.cell_columns(row, width);
            let start = row * self.stride;
            let seen = &self.seen[start..][..width];
            for (x, (&seen, &root)) in seen.iter().zip(&self.root[start..]).enumerate() {
                if seen < self.full {
                    let around = usize::from(!cells.contains(&x));
                    sums[around] += (seen - root) * (seen - root);
                    counts[around] += 1;
                }
            }
        }
        [0, 1].map(|i| sums[i] / counts[i].max(1) as f32)
    }

    /// The negative log-likelihood of all pixels at a variance of root light of `noise`, up to a constant.
    pub fn loss(&self, noise: f32) -> f32 {
        let per_deviation = 1.0 / libm::sqrtf(noise);
        self.pixels().fold(0.0, |sum, (&seen, &root)| {
            sum + if seen < self.full {
                0.5 * (seen - root) * (seen - root) / noise
            } else {
                censored_loss((self.full - root) * per_deviation)
            }
        })
    }

    /// An estimate of the light of the ground between the LEDs: the mean of the pixels up to the overall mean, or, if the ground is
    /// saturated, the overall mean.
    pub fn ground(&self) -> f32 {
        let mean_below = |limit: f32| {
            let (mut sum, mut count) = (0.0, 0usize);
            for (&seen, _) in self.pixels() {
                if seen < limit {
                    sum += seen * seen - self.offset;
                    count += 1;
                }
            }
            (sum / count.max(1) as f32).max(0.0)
        };
        let mean = mean_below(LEFT_OUT);
        if self.is_full_throughout() {
            return mean;
        }
        mean_below(root(mean + self.offset) * ABOVE)
    }

    /// Fills [`Image::root`] with the light as seen, minus a `background`.
    pub fn start_from_light(&mut self, background: f32) {
        let used = self.stride * self.size[1];
        for (rest, &seen) in self.root[..used].iter_mut().zip(&self.seen[..used]) {
            *rest = if seen < LEFT_OUT {
                seen * seen - self.offset - background
            } else {
                0.0
            };
        }
    }

    /// The mean square of the residual light in [`Image::root`], in root light.
    pub fn mean_square_of_rest(&self) -> f32 {
        let (mut sum, mut count) = (0.0, 0usize);
        for (&seen, &rest) in self.pixels() {
            if seen < self.full {
                let slope = 0.5 / seen;
                sum += (rest * slope) * (rest * slope);
                count += 1;
            }
        }
        sum / count.max(1) as f32
    }

    /// Root light as seen and as expected.
    fn pixels(&self) -> impl Iterator<Item = (&f32, &f32)> {
        let [width, height] = self.size;
        (0..height).flat_map(move |row| {
            let start = row * self.stride;
            self.seen[start..][..width].iter().zip(&self.root[start..][..width])
        })
    }

    fn take_roots(&mut self) {
        let used = self.stride * self.size[1];
        let pixels = self.root[..used].iter_mut().zip(&mut self.expected[..used]);
        for ((root_light, light), &seen) in pixels.zip(&self.seen[..used]) {
            *light = if seen < LEFT_OUT { *light } else { LEFT_OUT * LEFT_OUT };
            *root_light = root(*light);
        }
    }
}

/// Just below the limit, relatively.
const BELOW: f32 = 0.9999;
/// And just above.
const ABOVE: f32 = 1.0001;
