//! The large parts of a receiver, which lie where its user puts them.

use super::reader::MaximumLikelihood;
use super::reader::Tools;
use super::settings::ReceiverSettings;
use crate::camera::Learnt;
use crate::cells::CellMap;
use crate::detect::Method;
use crate::spots::Residuals;
use crate::surroundings::{Surroundings, Tiles};
use link::panel::SoftPanel;

/// What a receiver follows and reads with: `PANELS` panels, each in up to `PIXELS` pixels. Panels that cover more of the frame are read in
/// larger pixels, so that `9216`, 96×96, serves panels of any size.
///
/// For one panel 31 bytes a pixel and 45 kB: 331 kB for 96×96 pixels; for each further one 22 bytes a pixel and 35 kB. It begins as
/// nothing but zeros: as a `static` it takes no room in flash. On a computer, `Box::default()` makes it where it stays, and takes no room
/// for it on the stack.
pub struct ReceiverMemory<const PIXELS: usize, const PANELS: usize = 1> {
    pub(super) panels: [PanelMemory<PIXELS>; PANELS],
    pub(super) residuals: Residuals<PIXELS>,
    /// Where a near panel's surroundings are drawn in larger pixels.
    pub(super) canvas: [u8; PIXELS],
    pub(super) tiles: Tiles,
}

/// What each panel has of its own.
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

    /// What has been learnt of the camera and the panel.
    pub fn learnt(&self) -> Option<Learnt> {
        self.likelihood.learnt()
    }

    /// Goes by lines that are each later than the one above by so many exposures.
    #[cfg(feature = "read-lines")]
    pub fn tell_line_delay(&mut self, delay: f32) {
        self.likelihood.tell_line_delay(delay);
    }

    /// Whether its contrast is another in each frame, by a carrier.
    pub fn expect_carrier(&mut self, has_carrier: bool) {
        #[cfg(feature = "carrier")]
        self.likelihood.expect_carrier(has_carrier);
        #[cfg(not(feature = "carrier"))]
        let _ = has_carrier;
    }

    /// What the panel is read with in a frame, `before` which that symbol was shown.
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
    /// A constant, so that its parts are not made one by one on the stack before they are put together.
    const EMPTY: Self = Self {
        panels: [const { PanelMemory::EMPTY }; PANELS],
        residuals: Residuals::new(),
        canvas: [0; PIXELS],
        tiles: Tiles::EMPTY,
    };

    /// Memory that holds nothing yet.
    pub const fn new() -> Self {
        Self::EMPTY
    }

    /// Gets ready for a camera.
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
