//! The bits of single frames.

use link::camera::Camera;
use rx_pipeline::camera::Learnt;
use rx_pipeline::cells::{CellMap, CellsError};
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::{Detection, Method, check_white};
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::MaximumLikelihood;
use rx_pipeline::receiver::{FrameSearch, Reading, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings, SearchMemory};

/// The most pixels of a panel's bounding box.
pub const PANEL_PIXELS: usize = 512 * 512;
/// The most pixels that the likelihood looks at; larger panels are binned.
pub const LIKELIHOOD_PIXELS: usize = 128 * 128;
/// Pixels that a panel is looked for and read in where no corners are given; larger ones are seen in larger pixels. Boards end at
/// edges that the largest pixels mix with LEDs, so there is room to find panels in smaller ones.
const SEARCH_PIXELS: usize = 256 * 256;

/// A panel's place and bits, or why they cannot be read.
pub type StillReading = Result<Reading, String>;

/// Why a frame cannot be looked at.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StillError {
    /// The panel's corners do not fit into the frame.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// No receiver is like that.
    #[error(transparent)]
    Receiver(#[from] ReceiverError),
}

/// Reads single frames, each for itself.
pub struct StillDecoder {
    method: Method,
    map: Box<CellMap<PANEL_PIXELS>>,
    likelihood: Box<MaximumLikelihood<LIKELIHOOD_PIXELS>>,
}

impl StillDecoder {
    /// By a method of telling bits apart.
    pub fn new(method: Method) -> Self {
        Self {
            method,
            map: Box::new(CellMap::empty()),
            likelihood: Box::new(MaximumLikelihood::new(Camera::default())),
        }
    }

    /// The panel in a single frame, at given corners or wherever one is found, and what was learnt of the camera.
    ///
    /// # Errors
    /// [`StillError`] where what is given is at fault.
    pub fn decode(&mut self, frame: &Frame, camera: Camera, given: Option<Corners>) -> Result<(StillReading, Option<Learnt>), StillError> {
        let Some(corners) = given else {
            return self.search(camera, frame);
        };
        // Each frame stands for itself.
        self.likelihood.prepare(camera);
        self.map.build(&corners, frame.width(), frame.height())?;
        let detection = self.detect(frame, &corners);
        let reading = detection.map(|detection| Reading { corners, detection });
        Ok((reading, self.likelihood.learnt()))
    }

    /// What a receiver makes of a frame that it has seen none before, and what it learns of the camera.
    fn search(&self, camera: Camera, frame: &Frame) -> Result<(StillReading, Option<Learnt>), StillError> {
        let room = FrameSearch::<Box<SearchMemory>>::bytes(frame.width(), frame.height());
        let search = FrameSearch::with_history(Box::<SearchMemory>::default(), vec![0; room]);
        let settings = ReceiverSettings {
            camera,
            method: self.method,
            ..ReceiverSettings::default()
        };
        let memory = Box::<ReceiverMemory<SEARCH_PIXELS>>::default();
        let mut receiver = Receiver::new(settings, memory, search.thorough())?;
        let reading = receiver.frame(0, frame).reading;
        Ok((reading.map_err(|loss| loss.to_string()), receiver.learnt()))
    }

    fn detect(&mut self, frame: &Frame, corners: &Corners) -> Result<Detection, String> {
        let why = |error: &dyn std::error::Error| error.to_string();
        let features = Features::measure(frame, &self.map).map_err(|error| why(&error))?;
        check_white(&features).map_err(|error| why(&error))?;
        match &self.method {
            Method::Features(detector) => detector.detect(&features),
            Method::MaximumLikelihood => self.likelihood.detect(frame, corners),
        }
        .map_err(|error| why(&error))
    }
}
