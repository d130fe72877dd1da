//! A receiver of any number of panels.

use link::framing::Event;
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::frame::Frame;
use rx_pipeline::profile::Profile;
use rx_pipeline::receiver::{
    CarrierCandidate, FrameSearch, Outcome, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings, SearchMemory,
};

use crate::Stamp;

/// The most pixels in which a panel is read; a larger panel is binned.
const PANEL_PIXELS: usize = 160 * 160;

/// A receiver on the heap that searches whole frames for panels.
type WholeFrames<const PANELS: usize> =
    Receiver<PANEL_PIXELS, Box<ReceiverMemory<PANEL_PIXELS, PANELS>>, FrameSearch<Box<SearchMemory>, Vec<u8>>, PANELS>;

/// Makes a receiver for frames of this width and height.
pub type MakePanels = fn(ReceiverSettings, (usize, usize)) -> Result<Box<dyn Panels>, ReceiverError>;

/// A receiver of a fixed number of panels: see [`Receiver`].
pub trait Panels: Send + Sync {
    /// Processes a frame.
    fn frame(&mut self, stamp: Stamp, frame: &Frame<'_>, profile: &mut dyn Profile, report: &mut dyn FnMut(usize, Outcome<'_>));
    /// Decodes the symbols of the last frames.
    fn finish(&mut self, report: &mut dyn FnMut(usize, Event<'_>));
    /// The learnt cameras, by panel number.
    fn learnt(&self) -> Vec<Option<CameraEstimate>>;
    /// Whether a panel seems to have a carrier.
    fn has_carrier(&self, panel: usize) -> bool;
    /// Continues with a carrier of a panel that its readings have proven.
    fn confirm_carrier(&mut self, panel: usize, carrier: &CarrierCandidate);
    /// Sets the initial delay between lines, in exposures.
    fn set_line_delay(&mut self, exposures: f32);
}

impl<const PANELS: usize> Panels for WholeFrames<PANELS> {
    fn frame(&mut self, stamp: Stamp, frame: &Frame<'_>, mut profile: &mut dyn Profile, report: &mut dyn FnMut(usize, Outcome<'_>)) {
        self.set_late(stamp.late);
        self.frame_each(stamp.number, frame, &mut profile, report);
    }

    fn finish(&mut self, report: &mut dyn FnMut(usize, Event<'_>)) {
        self.finish_each(report);
    }

    fn learnt(&self) -> Vec<Option<CameraEstimate>> {
        self.learnt_each().to_vec()
    }

    fn has_carrier(&self, panel: usize) -> bool {
        self.has_carrier_each().get(panel).is_some_and(|&has_carrier| has_carrier)
    }

    fn confirm_carrier(&mut self, panel: usize, carrier: &CarrierCandidate) {
        Self::confirm_carrier(self, panel, carrier);
    }

    fn set_line_delay(&mut self, exposures: f32) {
        Self::set_line_delay(self, exposures);
    }
}

/// A receiver that has not seen a frame.
pub fn make<const PANELS: usize>(settings: ReceiverSettings, (width, height): (usize, usize)) -> Result<Box<dyn Panels>, ReceiverError> {
    let room = FrameSearch::<Box<SearchMemory>>::bytes(width, height);
    let search = FrameSearch::with_history(Box::default(), vec![0; room]);
    let receiver: WholeFrames<PANELS> = Receiver::new(settings, Box::default(), search)?;
    Ok(Box::new(receiver))
}
