//! The large parts of a receiver, in memory that its user provides.

use super::reader::MaximumLikelihood;
use super::reader::Tools;
use super::settings::ReceiverSettings;
use crate::camera::CameraEstimate;
use crate::cells::CellMap;
use crate::detect::Method;
use crate::spots::Residuals;
use crate::surroundings::{Surroundings, Tiles};
use link::panel::SoftPanel;

/// The memory of a receiver for `PANELS` panels, each in up to `PIXELS` pixels. Panels that cover more of the frame are read in larger
/// pixels, so that `9216`, 96×96, serves panels of any size.
///
/// One panel takes 31 bytes a pixel and 45 kB, which is 331 kB for 96×96 pixels. Each further panel takes 22 bytes a pixel and 35 kB.
/// Initially, all bytes are zero, so that a `static` takes no room in flash. On a computer, `Box::default()` makes it in place and needs no
/// room for it on the stack.
pub struct ReceiverMemory<const PIXELS: usize, const PANELS: usize = 1> {
    pub(super) panels: [PanelMemory<PIXELS>; PANELS],
    pub(super) residuals: Residuals<PIXELS>,
    /// The surroundings of a near panel in larger pixels.
    pub(super) canvas: [u8; PIXELS],
    pub(super) tiles: Tiles,
}

/// The memory of one panel.
pub(super) struct PanelMemory<const PIXELS: usize> {
    pub map: CellMap<PIXELS>,
    likelihood: MaximumLikelihood<PIXELS>,
    surroundings: Surroundings,
}

impl<const PIXELS: usize> PanelMemory<PIXELS> {
    const EMPTY: Self = Self {
        map: CellMap::empty(),
        likelihood: MaximumLikelihood::empty(),
        surroundings: Surroundings::UNKNOWN,
    };

    /// The learnt camera and panel.
    pub fn learnt(&self) -> Option<CameraEstimate> {
        self.likelihood.learnt()
    }

    /// Sets the initial delay of each line after the one above, in exposures.
    #[cfg(feature = "read-lines")]
    pub fn set_line_delay(&mut self, delay: f32) {
        self.likelihood.set_line_delay(delay);
    }

    /// Sets whether the contrast differs in each frame, because of a carrier.
    pub fn expect_carrier(&mut self, has_carrier: bool) {
        #[cfg(feature = "carrier")]
        self.likelihood.expect_carrier(has_carrier);
        #[cfg(not(feature = "carrier"))]
        let _ = has_carrier;
    }

    /// The tools for reading the panel in a frame; `before` holds the soft values of the symbol before.
    pub fn tools<'a>(&'a mut self, residuals: &'a mut Residuals<PIXELS>, tiles: &'a mut Tiles, before: SoftPanel) -> Tools<'a, PIXELS> {
        Tools {
            map: &mut self.map,
            residuals,
            tiles,
            likelihood: &mut self.likelihood,
            surroundings: &mut self.surroundings,
            before,
        }
    }
}

impl<const PIXELS: usize, const PANELS: usize> ReceiverMemory<PIXELS, PANELS> {
    /// A constant, so that the compiler does not build its parts one by one on the stack.
    const EMPTY: Self = Self {
        panels: [const { PanelMemory::EMPTY }; PANELS],
        residuals: Residuals::new(),
        canvas: [0; PIXELS],
        tiles: Tiles::EMPTY,
    };

    /// Empty memory.
    pub const fn new() -> Self {
        Self::EMPTY
    }

    /// Prepares the memory for a camera.
    pub(super) fn prepare(&mut self, settings: &ReceiverSettings) {
        if settings.method == Method::MaximumLikelihood {
            for panel in &mut self.panels {
                panel.likelihood.prepare_with(settings.camera, settings.likelihood);
            }
        }
    }
}

impl<const PIXELS: usize, const PANELS: usize> Default for ReceiverMemory<PIXELS, PANELS> {
    fn default() -> Self {
        Self::new()
    }
}
