//! Regions to messages.

use core::borrow::BorrowMut;

use crate::cells::{CellMap, CellsError};
use crate::corners::Corners;
use crate::detect::Method;
use crate::frame::Frame;
use crate::likelihood::MaximumLikelihood;
use crate::locate::Locator;
use crate::profile::Profile;
use crate::receiver::reader::{Reader, Tools};
use crate::receiver::{Loss, Outcome, ReceiverError, ReceiverSettings};
use crate::spots::Canvas;
use link::framing::{Deframer, Event};

/// The large parts of a [`RegionReceiver`] for panels of up to `PIXELS` (bounding box): 30 bytes a pixel and 30 kB.
///
/// It begins as nothing but zeros: as a `static` it takes no room in flash.
pub struct RegionMemory<const PIXELS: usize> {
    map: CellMap<PIXELS>,
    canvas: Canvas<PIXELS>,
    likelihood: MaximumLikelihood<PIXELS>,
}

impl<const PIXELS: usize> RegionMemory<PIXELS> {
    /// Memory that holds nothing yet.
    pub const fn new() -> Self {
        Self {
            map: CellMap::empty(),
            canvas: Canvas::new(),
            likelihood: MaximumLikelihood::blind(),
        }
    }

    /// Gets ready for a camera.
    fn prepare(&mut self, settings: &ReceiverSettings) {
        if settings.method == Method::MaximumLikelihood {
            self.likelihood.prepare(settings.camera);
        }
    }
}

impl<const PIXELS: usize> Default for RegionMemory<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}

/// Regions of frames to messages, for one panel whose place is given once.
///
/// It follows the panel as [`crate::receiver::Receiver`] does, and never looks through a frame for one: after
/// [`crate::track::PATIENCE_FRAMES`] frames without the panel it waits to be told again. `M` is where its [memory](RegionMemory) is.
///
/// ```
/// use rx_pipeline::corners::Corners;
/// use rx_pipeline::frame::Frame;
/// use rx_pipeline::receiver::{Loss, ReceiverSettings};
/// use rx_pipeline::region::{RegionMemory, RegionReceiver};
///
/// let memory = Box::new(RegionMemory::<4096>::new());
/// let mut receiver = RegionReceiver::new(ReceiverSettings::default(), memory)?;
/// // The 40 × 40 pixels of a frame from (600, 300) on, without a panel.
/// let pixels = [118; 40 * 40];
/// let region = Frame::new(&pixels, 40, 40)?;
/// assert_eq!(receiver.region(0, [600, 300], &region, &mut ()).reading, Err(Loss::NoPlace));
///
/// let corners = Corners::new([[606.0, 306.0], [634.0, 306.0], [634.0, 334.0], [606.0, 334.0]])?;
/// receiver.place(corners, [600, 300], &region)?;
/// assert!(matches!(receiver.region(1, [600, 300], &region, &mut ()).reading, Err(Loss::Coasting { .. })));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct RegionReceiver<const PIXELS: usize, M> {
    locator: Locator,
    reader: Reader,
    deframer: Deframer,
    memory: M,
    /// Where the last region began, and its size.
    window: ([u16; 2], (usize, usize)),
}

impl<const PIXELS: usize, M: BorrowMut<RegionMemory<PIXELS>>> RegionReceiver<PIXELS, M> {
    /// A receiver that has seen nothing.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range.
    pub fn new(settings: ReceiverSettings, mut memory: M) -> Result<Self, ReceiverError> {
        let (locator, reader) = (Locator::new(settings.camera)?, Reader::new(&settings)?);
        memory.borrow_mut().prepare(&settings);
        Ok(Self {
            locator,
            reader,
            deframer: Deframer::new(),
            memory,
            window: ([0; 2], (0, 0)),
        })
    }

    /// Forgets everything and goes by other settings.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range; then nothing changes.
    // Not inlined: what it takes of the stack is free again before the next region comes.
    #[inline(never)]
    pub fn begin(&mut self, settings: &ReceiverSettings) -> Result<(), ReceiverError> {
        let reader = Reader::new(settings)?;
        self.locator = Locator::new(settings.camera)?;
        (self.reader, self.deframer) = (reader, Deframer::new());
        self.memory.borrow_mut().prepare(settings);
        Ok(())
    }

    /// Reads the panel at `corners` (in pixels of the frame) from now on, in regions like `region`, which begins at `origin`.
    ///
    /// As in [`crate::receiver::Receiver::place`] the panel is taken to be at rest in the frame: until two frames have shown how it
    /// moves, it may move by no more than 0.3 pitches a frame.
    ///
    /// # Errors
    /// [`CellsError`] if its cells are not in the region or too large for the memory; then no panel is followed.
    pub fn place(
        &mut self,
        corners: Corners,
        origin: [u16; 2],
        region: &Frame<'_>,
    ) -> Result<(), CellsError> {
        let size = (region.width(), region.height());
        self.window = (origin, size);
        let [x, y] = origin.map(|c| c as f32);
        let sigma_px = self.locator.spot_sigma_px();
        let map = &mut self.memory.borrow_mut().map;
        // Corners beyond what can be reckoned with are outside of every region.
        let corners = corners.shifted(-x, -y).unwrap_or(corners);
        self.reader.place(corners, size, sigma_px, map)
    }

    /// Takes in the region of frame `number` that begins at `origin`. All positions in the outcome are the region's own.
    ///
    /// Numbers are as for [`crate::receiver::Receiver::frame`].
    pub fn region(
        &mut self,
        number: u64,
        origin: [u16; 2],
        region: &Frame<'_>,
        profile: &mut impl Profile,
    ) -> Outcome<'_> {
        let RegionMemory {
            map,
            canvas,
            likelihood,
        } = self.memory.borrow_mut();
        let window = (origin, (region.width(), region.height()));
        if self.window != window {
            let before = self.window.0;
            let shift = [0, 1].map(|i| i32::from(before[i]) - i32::from(origin[i]));
            self.reader.shift(shift, window.1, map);
            self.window = window;
        }
        let mut tools = Tools {
            map,
            canvas,
            likelihood,
        };
        let reading = self
            .reader
            .follow(number, region, &self.locator, &mut tools, profile)
            .unwrap_or(Err(Loss::NoPlace));
        self.reader
            .outcome(number, reading, &mut self.deframer, profile)
    }

    /// Takes in the symbol that the last regions showed, of which [`RegionReceiver::region`] waits for the end.
    pub fn finish(&mut self) -> Event<'_> {
        self.reader.finish(&mut self.deframer)
    }
}
