//! The panel's image: Gaussian spots before a background, in linear light.
//!
//! An LED's disc, the lens blur and the pixel's square together are close to a Gaussian, so a pixel at p sees b + Σ aₖ·g(p − pₖ). All users
//! share one model: the same [light of a grey level](light_table), the same [spots](window). Two metrics compare it with pixels, depending
//! on the expected noise:
//!
//! | metric | uniform noise in | for |
//! |---|---|---|
//! | [`GreyMetric`] | grey levels: clutter, rounding | finding and following: the lattice, with spots of few brightnesses |
//! | [`RootMetric`] | roots of light: electrons | reading: the likeliest bits |
//!
//! The spots have two forms. [`profile`] is a single spot, truncated early, and its derivatives: a fit tries hundreds of poses.
//! [`SpotTable`] is 64 spots of one size, truncated farther out and never by the window's rim, because the light of an LED at its
//! neighbour's place decides on bits.

mod grey_metric;
mod lattice_model;
mod light_table;
mod outline;
mod perspective;
mod profile;
mod residuals;
mod root_metric;
mod shade;
mod slope;
mod spot_table;
mod window;

pub(crate) use grey_metric::GreyMetric;
pub(crate) use lattice_model::{LatticeModel, SIGMA_PX};
pub(crate) use outline::Outline;
pub(crate) use profile::REACH_FITTED;
pub(crate) use residuals::{Observation, Residuals};
pub(crate) use root_metric::RootMetric;
pub(crate) use shade::{MEASURES_SHADE, SHADE_LEAST_PITCH, Shade};
pub(crate) use slope::Slope;
pub(crate) use spot_table::{OVERLAP, SpotTable};
pub(crate) use window::{LANES, SPOT_PX, Window, dot};

/// The variance of a uniform position within a pixel, in px².
pub(crate) const PIXEL_VARIANCE: f32 = 1.0 / 12.0;
