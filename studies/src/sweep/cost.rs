//! The approximate cost of a frame, for a fair division of work.
//!
//! A frame is drawn and measured pixel by pixel, and then read by a detector. The costs are those of one computer; only their ratios matter
//! for the division into shards (`docs/scale.md` has the measurement).

use super::{Sweep, SweepError};
use crate::detectors::DetectorChoice;
use crate::monte_carlo::view;
use sim::view::View;

/// Constant time of a frame.
const FRAME_NS: f64 = 7_000.0;
/// Time to draw, to read out and to measure a pixel.
const PIXEL_NS: f64 = 10.0;

/// The expected time of one frame of a view on one thread, ns.
fn frame_ns(view: &View, detector: DetectorChoice) -> f64 {
    FRAME_NS + PIXEL_NS * pixels(view) + detector_ns(detector)
}

impl Sweep {
    /// The expected cost of a frame of cell `index` on one thread, in ns, with counted errors: see [`frame_ns`].
    ///
    /// With splitting a frame costs at least fifty times as much, and more at lower rates, because there are more levels to climb. Their
    /// number is known only after they are chosen, which is work in itself. So this is ignored, and shards of cells with very different
    /// rates are not balanced.
    ///
    /// # Errors
    /// If the cell's scene cannot be seen.
    pub(super) fn frame_cost(&self, index: usize) -> Result<f64, SweepError> {
        let scene = self.scene_of(index)?;
        let seen = view(&scene, self.random_reflectance);
        let seen = seen.map_err(|fault| self.evaluate_error(index, fault.into()))?;
        Ok(frame_ns(&seen, self.cell(index).detector))
    }
}

/// The time of a detector for the features or the image of one frame.
fn detector_ns(detector: DetectorChoice) -> f64 {
    match detector {
        DetectorChoice::Otsu | DetectorChoice::Fisher | DetectorChoice::FisherNgr | DetectorChoice::KMeans | DetectorChoice::KMeansRaw => {
            1_000.0
        }
        DetectorChoice::Best | DetectorChoice::MaximumLikelihood => 700_000.0,
        DetectorChoice::Genie => 5_000_000.0,
    }
}

/// Pixels of the first panel's bounding box.
fn pixels(view: &View) -> f64 {
    let centres = view.panels[0].ellipses.map(|ellipse| ellipse.centre);
    let spread = |of: fn(&glam::DVec2) -> f64| {
        let ends = centres.iter().map(of);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        // The outer half of the outer cells.
        (high - low) * 8.0 / 7.0
    };
    spread(|centre| centre.x) * spread(|centre| centre.y)
}
