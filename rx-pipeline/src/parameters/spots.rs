//! The spots that LEDs leave in an image, and the metrics in which they are held against pixels.

use core::ops::RangeInclusive;

/// Where a spot ends for a fit of the lattice (standard deviations): 3 % of its height is left. Farther: slower by the
/// square.
pub const REACH_FITTED: f32 = 2.65;
/// Where it ends for reading (standard deviations), as far as [`SPOT_PX`] allows. Nearer: light of an LED counts as its
/// neighbour's.
pub const REACH_READ: f32 = 3.3;
/// The most pixels of a spot in a row or column (px); a multiple of 4. More: wider spots, and more memory.
pub const SPOT_PX: usize = 20;
/// A spot's standard deviation (px). Wider: blurs are fitted that no panel is read in.
pub const SIGMA_PX: RangeInclusive<f32> = 0.4..=4.8;
/// Columns and rows within which an LED's light is felt (pitches, from the first LED on): beyond is what stands around.
pub const NEAR_LATTICE: RangeInclusive<f32> = -1.1..=8.1;
/// Pixels around the lattice that make a mean square worth having (count). More: near the frame's rim the noise of the
/// whole frame has to do.
pub const ENOUGH_PIXELS: u32 = 60;
/// Darker pixels count as uncertain as one of this level (grey): there the encoding is so steep that not the grey level
/// but the sensor's own noise says how sure the light is. Lower: dark pixels decide.
pub const DARKEST_GREY: usize = 48;
/// What is added to light under the root (light, 1 at middle grey). Wider: frames that the model does not explain look
/// as if they were noisier or less noisy than any camera's.
pub const ROOT_OFFSET: RangeInclusive<f32> = 1e-3..=1.0;
/// The squared distance from which spots do not overlap (variances of a spot): there the product of two has fallen to
/// exp(−5) = 0.7 %. Farther: slower.
pub const OVERLAP: f32 = 20.0;
