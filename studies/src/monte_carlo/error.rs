//! The errors of an evaluation.

use rx_pipeline::cells::CellsError;
use rx_pipeline::corners::CornersError;
use rx_pipeline::detect::FisherError;
use rx_pipeline::features::FeaturesError;
use rx_pipeline::frame::FrameError;
use sim::view::ViewError;

use super::accumulator::AccumulatorError;

/// Why an evaluation cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// The scene cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The corners do not make a panel.
    #[error("the panel cannot be measured: {0}")]
    Corners(#[from] CornersError),
    /// The panel has no cells.
    #[error("the panel cannot be measured: {0}")]
    Cells(#[from] CellsError),
    /// The frame cannot be measured.
    #[error("the panel cannot be measured: {0}")]
    Features(#[from] FeaturesError),
    /// The frame is invalid.
    #[error("the panel cannot be measured: {0}")]
    Frame(#[from] FrameError),
    /// A chunk was counted twice.
    #[error(transparent)]
    Accumulator(#[from] AccumulatorError),
    /// The scene has no noise.
    #[error(
        "this scene simulates no noise, and rare errors are looked for in noise: count them (without rare events), or set effects.noise=on"
    )]
    NoNoise,
    /// The panel has a carrier.
    #[error(
        "link.carrier_cycles = {cycles}: single frames are evaluated here, and with a carrier one frame does not tell its bits from their \
         complement: set link.carrier_cycles=0 for still panels, send messages with it (vocc link), or search by reach (vocc optimize \
         --criterion reach)"
    )]
    Carrier {
        /// Cycles of the carrier a symbol.
        cycles: u16,
    },
    /// The detector cannot be trained.
    #[error("the detector cannot be trained on this scene: {0}")]
    Training(#[from] FisherError),
    /// A genie cannot be used as a receiver.
    #[error(
        "the genie knows the panel's place, light and noise, which no receiver does: use it with `evaluate`, or choose another detector"
    )]
    NoReceiver,
    /// The caller asked to stop.
    #[error("stopped before it was finished")]
    Stopped,
}

impl EvaluateError {
    /// Whether the scene's image is unreadable: too small, too large, off the sensor, or uniform. Other values of the scene's keys may be
    /// readable.
    pub fn is_of_what_is_seen(&self) -> bool {
        use ViewError::{Behind, Folded, OffSensor, TooSmall};
        match self {
            Self::View(fault) => matches!(fault, Behind { .. } | OffSensor { .. } | Folded { .. } | TooSmall { .. }),
            Self::Corners(_) | Self::Cells(_) | Self::Features(_) | Self::Frame(_) | Self::Training(_) => true,
            Self::Accumulator(_) | Self::Carrier { .. } | Self::NoNoise | Self::NoReceiver | Self::Stopped => false,
        }
    }
}
