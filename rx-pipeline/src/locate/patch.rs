//! A square of the frame around a blob, reduced so that panels of all sizes have about the same size in it.

use crate::frame::Frame;
use crate::lattice::Lattice;

/// Samples along one side of the patch (count). More: finer, and slower by the square.
pub(super) const PATCH_SIDE: usize = 64;
/// One sample in this many may be brighter than the limit, to which brighter ones are reduced (count), because a hot pixel is no brighter
/// than an LED. More: few bright spots decide; fewer: LEDs are no brighter than their surroundings.
const BRIGHTEST_ONE_IN: usize = 40;
/// The distance of the patch's rim from its end; the rim's median is the ground (samples). Closer to the end: pixels beyond the frame
/// decide.
const RIM: usize = 2;
/// The widest reach of a blur (samples). Longer: slower; shorter: wide spots are truncated.
const BLUR_REACH: usize = 12;

/// A square of samples, each a mean of `step`×`step` pixels.
#[derive(Clone)]
pub(super) struct Patch {
    /// Samples, row by row.
    pub sample: [[f32; PATCH_SIDE]; PATCH_SIDE],
    /// The frame's position of the first sample.
    pub origin: [f32; 2],
    /// Pixels from one sample to the next.
    pub step: usize,
}

impl Patch {
    /// The square around `centre` of `frame`, minus that of `earlier` if there is one.
    pub fn of(frame: &Frame<'_>, earlier: Option<&Frame<'_>>, centre: [f32; 2], step: usize) -> Self {
        let first = centre.map(|c| libm::roundf(c) as i32 - (PATCH_SIDE * step / 2) as i32);
        let mut sample = [[0.0; PATCH_SIDE]; PATCH_SIDE];
        for (j, row) in sample.iter_mut().enumerate() {
            let mut sums = [0i32; PATCH_SIDE];
            for y in 0..step {
                let y = first[1] + (j * step + y) as i32;
                add_row(frame, y, first[0], step, 1, &mut sums);
                if let Some(earlier) = earlier {
                    add_row(earlier, y, first[0], step, -1, &mut sums);
                }
            }
            for (sample, sum) in row.iter_mut().zip(sums) {
                *sample = sum as f32 / (step * step) as f32;
            }
        }
        let middle = (step as f32 - 1.0) / 2.0;
        Self {
            sample,
            origin: first.map(|c| c as f32 + middle),
            step,
        }
    }

    /// Converts a position in the frame to samples.
    pub fn to_samples(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let step = self.step as f32;
        [(x - self.origin[0]) / step, (y - self.origin[1]) / step]
    }

    /// Converts a position in samples to the frame.
    pub fn to_frame(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let step = self.step as f32;
        [self.origin[0] + x * step, self.origin[1] + y * step]
    }

    /// Converts a lattice in samples to the frame.
    pub fn to_frame_lattice(&self, lattice: &Lattice) -> Lattice {
        lattice.scaled(self.to_frame(lattice.centre), self.step as f32)
    }

    /// Subtracts the median of the patch's rim.
    pub fn level_around(&mut self) {
        let mut rim = [0.0; 4 * PATCH_SIDE];
        for (i, four) in rim.chunks_exact_mut(4).enumerate() {
            let rows = (self.sample[RIM][i], self.sample[PATCH_SIDE - 1 - RIM][i]);
            four.copy_from_slice(&[rows.0, rows.1, self.sample[i][RIM], self.sample[i][PATCH_SIDE - 1 - RIM]]);
        }
        let level = *rim.select_nth_unstable_by(2 * PATCH_SIDE, f32::total_cmp).1;
        self.sample.iter_mut().flatten().for_each(|sample| *sample -= level);
    }

    /// Subtracts the smooth part: the same patch blurred by `sigma` samples.
    pub fn without_ground(&mut self, sigma: f32) {
        let mean = self.sample.iter().flatten().sum::<f32>() / (PATCH_SIDE * PATCH_SIDE) as f32;
        self.sample.iter_mut().flatten().for_each(|sample| *sample -= mean);
        let ground = self.blurred(sigma, 1.0);
        let ground = ground.iter().flatten();
        for (sample, ground) in self.sample.iter_mut().flatten().zip(ground) {
            *sample -= ground;
        }
    }

    /// Exchanges bright and dark.
    pub fn negate(&mut self) {
        for sample in self.sample.iter_mut().flatten() {
            *sample = -*sample;
        }
    }

    /// Keeps the excess over halfway between the neighbours at `lag` samples, the lesser along rows and along columns: spots stay, edges
    /// and gradients vanish. Unusually bright spots are reduced to a limit.
    pub fn spots_only(&mut self, lag: usize) {
        let lag = lag.clamp(1, PATCH_SIDE / 4);
        let from = self.sample;
        let near = |i: usize| (i.saturating_sub(lag), (i + lag).min(PATCH_SIDE - 1));
        let mut sorted = [0.0; PATCH_SIDE * PATCH_SIDE];
        for (j, row) in self.sample.iter_mut().enumerate() {
            let (above, below) = near(j);
            for (i, sample) in row.iter_mut().enumerate() {
                let (left, right) = near(i);
                let across = from[j][i] - 0.5 * (from[j][left] + from[j][right]);
                let down = from[j][i] - 0.5 * (from[above][i] + from[below][i]);
                *sample = across.min(down).max(0.0);
                sorted[PATCH_SIDE * j + i] = *sample;
            }
        }
        let rank = PATCH_SIDE * PATCH_SIDE - PATCH_SIDE * PATCH_SIDE / BRIGHTEST_ONE_IN;
        let most = *sorted.select_nth_unstable_by(rank, f32::total_cmp).1;
        self.sample.iter_mut().flatten().for_each(|sample| *sample = sample.min(most));
    }

    /// Root mean square of the samples.
    pub fn contrast(&self) -> f32 {
        let squares: f32 = self.sample.iter().flatten().map(|sample| sample * sample).sum();
        libm::sqrtf(squares / (PATCH_SIDE * PATCH_SIDE) as f32)
    }

    /// Convolved with a Gaussian of that standard deviation in samples, its integral `gain`; the patch is 0 beyond its edges.
    pub fn blurred(&self, sigma: f32, gain: f32) -> [[f32; PATCH_SIDE]; PATCH_SIDE] {
        let reach = (libm::ceilf(3.0 * sigma) as usize).min(BLUR_REACH);
        let mut kernel: [f32; BLUR_REACH + 1] = core::array::from_fn(|i| libm::expf(-0.5 * (i * i) as f32 / (sigma * sigma)));
        let sum = kernel[0] + 2.0 * kernel[1..=reach].iter().sum::<f32>();
        let scale = libm::sqrtf(gain) / sum;
        kernel.iter_mut().for_each(|weight| *weight *= scale);
        let kernel = &kernel[..=reach];
        let mut across = [[0.0; PATCH_SIDE]; PATCH_SIDE];
        for (to, from) in across.iter_mut().zip(&self.sample) {
            let mut padded = [0.0; PATCH_SIDE + 2 * BLUR_REACH];
            padded[BLUR_REACH..BLUR_REACH + PATCH_SIDE].copy_from_slice(from);
            for (offset, &weight) in kernel.iter().enumerate() {
                for i in 0..PATCH_SIDE {
                    to[i] += if offset == 0 {
                        weight * padded[BLUR_REACH + i]
                    } else {
                        weight * (padded[BLUR_REACH + i - offset] + padded[BLUR_REACH + i + offset])
                    };
                }
            }
        }
        let mut both = [[0.0; PATCH_SIDE]; PATCH_SIDE];
        for (j, to) in both.iter_mut().enumerate() {
            for (offset, &weight) in kernel.iter().enumerate() {
                let mut add = |from: Option<&[f32; PATCH_SIDE]>| {
                    if let Some(from) = from {
                        for i in 0..PATCH_SIDE {
                            to[i] += weight * from[i];
                        }
                    }
                };
                add(across.get(j + offset));
                if offset > 0 {
                    add(j.checked_sub(offset).and_then(|j| across.get(j)));
                }
            }
        }
        both
    }
}

fn add_row(frame: &Frame<'_>, y: i32, x: i32, step: usize, sign: i32, sums: &mut [i32; PATCH_SIDE]) {
    let (width, height) = (frame.width() as i32, frame.height() as i32);
    // Beyond its edges a frame continues with its outermost pixels.
    let Some(row) = frame.row(y.clamp(0, height - 1) as usize) else {
        return;
    };
    if x >= 0 && x + (PATCH_SIDE * step) as i32 <= width {
        for (sum, pixels) in sums.iter_mut().zip(row[x as usize..].chunks(step)) {
            *sum += sign * pixels.iter().map(|&grey| i32::from(grey)).sum::<i32>();
        }
    } else {
        for (i, sum) in sums.iter_mut().enumerate() {
            for k in 0..step {
                let x = (x + (i * step + k) as i32).clamp(0, width - 1);
                *sum += sign * i32::from(row[x as usize]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_are_left_and_edges_are_not() {
        let look = |spots: bool| {
            let pixels: [u8; PATCH_SIDE * PATCH_SIDE] = core::array::from_fn(|i| {
                let spot = i % PATCH_SIDE % 8 < 2 && i / PATCH_SIDE % 8 < 2;
                let ground = if i % PATCH_SIDE > 40 { 200 } else { 60 };
                ground + if spots && spot { 40 } else { 0 }
            });
            let frame = Frame::new(&pixels, PATCH_SIDE, PATCH_SIDE).unwrap();
            let mut patch = Patch::of(&frame, None, [32.0; 2], 1);
            patch.spots_only(3);
            patch.sample
        };
        assert!(look(false).iter().flatten().all(|&sample| sample == 0.0));
        let left = look(true);
        assert!(left[16][16] > 20.0);
        assert!(left[20].iter().all(|&sample| sample < 1.0));
    }
}
