//! A model compared with the pixels of a window.

use super::grey_metric::GreyMetric;
use super::lattice_model::LatticeModel;
use super::outline::Outline;
use super::profile::{Moments, Profile};
use super::shade::{MEASURES_SHADE, Shade};
use super::slope::Slope;
use super::window::{LANES, Window};
use crate::frame::Frame;
use core::ops::RangeInclusive;
use link::panel::{LEDS, SIDE};

/// The reach of an LED's light in columns and rows (pitches, from the first LED on); the surroundings lie beyond.
const NEAR_LATTICE: RangeInclusive<f32> = -1.1..=8.1;
/// Pixels around the lattice that suffice for a mean square (count). More: near the frame's edge the noise of the whole frame serves
/// instead.
const ENOUGH_PIXELS: u32 = 60;

/// The observed pixels.
#[derive(Clone, Copy)]
pub(crate) struct Observation<'a, 'f> {
    pub frame: &'a Frame<'f>,
    pub earlier: Option<&'a Frame<'f>>,
    pub metric: &'a GreyMetric,
    /// The part in use; all if `None`.
    pub within: Option<Outline>,
    /// The light between the LEDs if it is uneven, which adds to the background; only with the feature `surroundings`.
    pub shade: Option<&'a Shade>,
}

impl Observation<'_, '_> {
    /// The light between pixels, and whether it is white; `None` beyond the frame.
    pub fn light_at(&self, at: [f32; 2]) -> Option<(f32, bool)> {
        self.metric.light_at(self.frame, at)
    }
}

/// Memory for a window of up to `N` pixels.
pub(crate) struct Residuals<const N: usize> {
    residual: [f32; N],
    weight: [f32; N],
}

/// Sums over pixels, lane by lane.
#[derive(Default)]
struct Sums {
    squares: [f32; LANES],
    total: [f32; LANES],
    pixels: [u32; LANES],
    background: [[f32; LANES]; 2],
}

impl Sums {
    /// Adds pixels whose model is in `residual`, and their shade in `weight`; leaves their weighted residuals and their weights.
    #[inline(always)]
    fn add<const L: usize>(&mut self, [light, weights]: [[f32; L]; 2], background: f32, residual: &mut [f32; L], weight: &mut [f32; L]) {
        const { assert!(L <= LANES) }
        for i in 0..L {
            let difference = light[i] - residual[i];
            let weighted = weights[i] * difference;
            let ground = if MEASURES_SHADE { background + weight[i] } else { background };
            let step = light[i] - ground;
            self.squares[i] += weighted * difference;
            self.total[i] += weights[i] * step * step;
            self.pixels[i] += u32::from(weights[i] > 0.0);
            self.background[0][i] += weighted;
            self.background[1][i] += weights[i];
            residual[i] = weighted;
        }
        *weight = weights;
    }

    /// Adds a row of such pixels.
    fn add_row<const L: usize>(
        &mut self,
        metric: &GreyMetric,
        (now, earlier): (&[[u8; L]], Option<&[[u8; L]]>),
        background: f32,
        residual: &mut [[f32; L]],
        weight: &mut [[f32; L]],
    ) {
        let pixels = residual.iter_mut().zip(weight).zip(now);
        match earlier {
            None => {
                for ((residual, weight), now) in pixels {
                    let seen = metric.single(now, residual);
                    self.add(seen, background, residual, weight);
                }
            }
            Some(earlier) => {
                for (((residual, weight), now), earlier) in pixels.zip(earlier) {
                    let seen = metric.pair(now, earlier, residual);
                    self.add(seen, background, residual, weight);
                }
            }
        }
    }
}

impl<const N: usize> Residuals<N> {
    pub const fn new() -> Self {
        Self {
            residual: [0.0; N],
            weight: [0.0; N],
        }
    }

    /// Compares the model with the observation.
    pub fn compare(&mut self, spots: &LatticeModel, observation: Observation<'_, '_>, window: Window) -> Option<Slope> {
        self.compare_below(f32::INFINITY, spots, observation, window)
    }

    /// The same, but the LEDs' part of the slope, which takes most of the time, is only measured if the squares are below `limit`.
    pub fn compare_below(&mut self, limit: f32, spots: &LatticeModel, observation: Observation<'_, '_>, window: Window) -> Option<Slope> {
        let area = window.width * window.height;
        let (residual, weight) = (self.residual.get_mut(..area)?, self.weight.get_mut(..area)?);
        residual.fill(spots.background);
        let origin = [window.x as f32, window.y as f32];
        let mut profiles = [Profile::NONE; LEDS];
        for (led, profile) in profiles.iter_mut().enumerate() {
            let [x, y] = spots.lattice.position((led % SIDE) as f32, (led / SIDE) as f32);
            profile.place([x - origin[0], y - origin[1]], spots.sigma, window);
            let height = spots.amplitude(led);
            if height != 0.0 {
                profile.add_to(residual, window.width, height);
            }
        }
        let mut sums = Sums::default();
        let rows = residual
            .chunks_exact_mut(window.width.max(1))
            .zip(weight.chunks_exact_mut(window.width.max(1)));
        let mut seen = 0;
        for (y, (residual, weight)) in (window.y..).zip(rows) {
            let all = 0..window.width;
            let span = observation.within.map_or(all, |outline| outline.span(y, window));
            seen += span.len() as u32;
            for row in [&mut *residual, &mut *weight] {
                row[..span.start].fill(0.0);
                row[span.end..].fill(0.0);
            }
            let (residual, weight) = (&mut residual[span.clone()], &mut weight[span.clone()]);
            if MEASURES_SHADE {
                match observation.shade {
                    Some(shade) => shade.add_row(window, y, span.clone(), residual, weight),
                    None => weight.fill(0.0),
                }
            }
            let columns = window.x + span.start..window.x + span.end;
            let now = observation.frame.row(y)?.get(columns.clone())?;
            let earlier = match observation.earlier {
                Some(earlier) => Some(earlier.row(y)?.get(columns)?),
                None => None,
            };
            let (now, earlier) = (now.as_chunks(), earlier.map(|row| row.as_chunks()));
            let (residual, weight) = (residual.as_chunks_mut(), weight.as_chunks_mut());
            let (metric, background) = (observation.metric, spots.background);
            let most = (now.0, earlier.map(|row| row.0));
            sums.add_row::<LANES>(metric, most, background, residual.0, weight.0);
            let rest = (now.1.as_chunks().0, earlier.map(|row| row.1.as_chunks().0));
            let (residual, weight) = (residual.1.as_chunks_mut(), weight.1.as_chunks_mut());
            sums.add_row::<1>(metric, rest, background, residual.0, weight.0);
        }
        let sum = |lanes: [f32; LANES]| lanes.iter().sum::<f32>();
        let squares = sum(sums.squares);
        let moments = |led: usize| match squares < limit {
            true => profiles[led].moments(residual, weight, window.width),
            false => Moments::default(),
        };
        Some(Slope {
            squares,
            total: sum(sums.total),
            pixels: sums.pixels.iter().sum(),
            window_pixels: seen,
            background: sums.background.map(sum),
            led: core::array::from_fn(moments),
        })
    }

    /// After [`Residuals::compare`]: the mean square residual beyond [`NEAR_LATTICE`], in grey levels squared; `None` if there are too few
    /// pixels.
    pub fn noise_around(&self, spots: &LatticeModel, window: Window) -> Option<f32> {
        let area = window.width * window.height;
        let (residual, weight) = (self.residual.get(..area)?, self.weight.get(..area)?);
        let (mut squares, mut pixels) = (0.0, 0u32);
        for (i, (&residual, &weight)) in residual.iter().zip(weight).enumerate() {
            let at = [(window.x + i % window.width) as f32, (window.y + i / window.width) as f32];
            let outside = spots.lattice.coordinates(at)?.into_iter().any(|c| !NEAR_LATTICE.contains(&c));
            if outside && weight > 0.0 {
                squares += residual * residual / weight;
                pixels += 1;
            }
        }
        (pixels >= ENOUGH_PIXELS).then(|| squares / pixels as f32)
    }

    /// After [`Residuals::compare`]: the number of the 36 places around the lattice with at least half an LED's light.
    pub fn lit_around(&self, spots: &LatticeModel, window: Window) -> u32 {
        let area = window.width * window.height;
        let (Some(residual), Some(weight)) = (self.residual.get(..area), self.weight.get(..area)) else {
            return 0;
        };
        let mut lit = 0;
        for row in -1..=SIDE as i32 {
            for column in -1..=SIDE as i32 {
                let inside = 0..SIDE as i32;
                if inside.contains(&row) && inside.contains(&column) {
                    continue;
                }
                let [x, y] = spots.lattice.position(column as f32, row as f32);
                let mut profile = Profile::NONE;
                let at = [x - window.x as f32, y - window.y as f32];
                profile.place(at, spots.sigma, window);
                let sums = profile.moments(residual, weight, window.width);
                lit += u32::from(sums.height.abs() > 0.5 * spots.contrast.abs() * sums.weight && sums.weight > 0.0);
            }
        }
        lit
    }
}
