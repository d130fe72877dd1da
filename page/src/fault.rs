//! What can be wrong.

use reception::ReceptionError;
use reception::picture::PixelKindError;
use reception::still::StillError;
use reception::stream::StreamError;
use rx_pipeline::cells::CellsError;
use rx_pipeline::corners::CornersError;
use rx_pipeline::frame::FrameError;
use rx_pipeline::receiver::ReceiverError;
use sim::input::PictureError;
use sim::l2a::L2aError;
use sim::road::RoadError;
use sim::scene::SceneError;
use sim::view::ViewError;
use studies::detectors::DetectorError;
use studies::monte_carlo::EvaluateError;
use studies::optimum::OptimumError;

/// Why the page gets no answer, as a sentence for whoever sits before it.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The page has asked for what there is not: a fault of the page's own.
    #[error("the page asked for something that there is not ({0}): load it again")]
    Request(#[from] serde_json::Error),
    /// Something was asked for before it was begun.
    #[error("nothing was begun that could go on: {0} first")]
    NotBegun(&'static str),
    /// No scene is like that.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// What was asked for cannot be written as a file.
    #[error("it cannot be written as a file: {0}")]
    Unwritten(#[from] toml::ser::Error),
    /// No detector has that name.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// The transmitter has no such ratio.
    #[error(transparent)]
    L2a(#[from] L2aError),
    /// The message cannot be sent.
    #[error(transparent)]
    Road(#[from] RoadError),
    /// Frames cannot be evaluated.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// No best ratio is found.
    #[error(transparent)]
    Optimum(#[from] OptimumError),
    /// The file is no picture.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The picture's pixels are of another kind.
    #[error(transparent)]
    Kind(#[from] PixelKindError),
    /// The picture cannot be looked at.
    #[error(transparent)]
    Still(#[from] StillError),
    /// The receiver cannot be set up.
    #[error(transparent)]
    Receiver(#[from] ReceiverError),
    /// Frames are of several sizes.
    #[error(transparent)]
    Reception(#[from] ReceptionError),
    /// A frame is none.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A panel is too large or not in the picture.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// Its corners are none.
    #[error(transparent)]
    Corners(#[from] CornersError),
    /// A film cannot be read.
    #[error(transparent)]
    Film(StreamError),
    /// A film is none.
    #[error("it is no y4m film: it does not begin as one does; other films are read where this browser plays them")]
    NoY4m,
    /// Nothing is left of a film.
    #[error("the film has no frame here: it is empty, or cut off")]
    NoFrame,
    /// The reference level is for single pictures.
    #[error("the reference level is for single frames: choose fine or fast")]
    Reference,
    /// A number is out of its range.
    #[error("{what} is {value}: {allowed}")]
    Range {
        /// What it is.
        what: &'static str,
        /// The number.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// The pixels are not as many as were told.
    #[error("the picture has {bytes} bytes, and {wanted} belong to {width} × {height} pixels")]
    Pixels {
        /// How many there are.
        bytes: usize,
        /// How many there should be.
        wanted: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl From<StreamError> for Fault {
    /// What the command line says of films that are none speaks of its options.
    fn from(fault: StreamError) -> Self {
        match fault {
            StreamError::Empty | StreamError::NoY4m | StreamError::LongLine => Self::NoY4m,
            fault => Self::Film(fault),
        }
    }
}
