//! The image of one LED: a disc, blurred, integrated over pixels.
//!
//! - [`overlap`]: a sharp disc's share of each pixel, in closed form. [`outline`]: discs and boards under any blur, pixel by pixel.
//! - [`kernel`]: the blur's integral over a pixel. [`chords`]: a blurred disc as a few lines, which suffice under a blur.
//! - `spread`: blurs of other shapes.
//! - [`gauss`]: nodes of quadratures. `phase_table`: functions tabulated at sub-pixel phases.

pub mod chords;
pub mod gauss;
pub mod kernel;
pub mod outline;
pub mod overlap;
pub(crate) mod phase_table;
pub(crate) mod spread;
