//! One frame, measured.

use link::panel::PanelFrame;
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use sim::renderer::canvas::Region;

use super::error::EvaluateError;

/// The most pixels of a panel's bounding box.
pub(crate) const PANEL_PIXELS: usize = 128 * 128;

/// The measurement of one frame, and the truth.
pub struct Observation {
    /// The panel's bits in the middle of the exposure.
    pub bits: PanelFrame,
    /// The features of its cells.
    pub features: Features,
    /// Its corner LEDs in the drawn region.
    pub corners: Corners,
}

/// The features of a panel at `corners`.
#[inline(always)]
pub(crate) fn measure(
    grey: &[u8],
    Region { width, height, .. }: Region,
    corners: &Corners,
    map: &mut CellMap<PANEL_PIXELS>,
) -> Result<Features, EvaluateError> {
    map.build(corners, width, height)?;
    Ok(Features::measure(&Frame::new(grey, width, height)?, map)?)
}
