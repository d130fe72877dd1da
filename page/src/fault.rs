//! The faults of a request.

use reception::stream::StreamError;

/// Why a request has no answer, as a sentence for the user.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// The page has requested something that does not exist, which is a bug of the page.
    #[error("the page made an unknown request ({0}): load it again")]
    Request(#[from] serde_json::Error),
    /// A request continues something that was not begun.
    #[error("nothing to continue: {0} first")]
    NotBegun(&'static str),
    /// The requested contents cannot be written as a file.
    #[error("it cannot be written as a file: {0}")]
    Unwritten(#[from] toml::ser::Error),
    /// An error of a library: about a scene, a picture, a film or a message.
    #[error(transparent)]
    Library(Box<dyn std::error::Error + Send + Sync>),
    /// A film has another format.
    #[error("it is not a y4m film: it does not begin as one does; other films are read where this browser plays them")]
    NoY4m,
    /// A film has no frames left.
    #[error("the film has no frame here: it is empty, or cut off")]
    NoFrame,
    /// The reference level is for single pictures.
    #[error("the reference level is for single frames: choose fine or fast")]
    Reference,
    /// A number is out of its range.
    #[error("{what} is {value}: {allowed}")]
    Range {
        /// The quantity.
        what: &'static str,
        /// The number.
        value: f64,
        /// The allowed range.
        allowed: &'static str,
    },
    /// The number of pixels differs from the stated one.
    #[error("the picture has {bytes} bytes, and {wanted} belong to {width} × {height} pixels")]
    Pixels {
        /// The present number of bytes.
        bytes: usize,
        /// The required number of bytes.
        wanted: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl From<StreamError> for Fault {
    /// The command line's texts about films in another format mention its options.
    fn from(fault: StreamError) -> Self {
        match fault {
            StreamError::Empty | StreamError::NoY4m | StreamError::LongLine => Self::NoY4m,
            fault => Self::Library(fault.into()),
        }
    }
}

macro_rules! from_libraries {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Fault {
            fn from(error: $error) -> Self {
                Self::Library(error.into())
            }
        })+
    };
}

from_libraries!(
    sim::scene::SceneError,
    sim::view::ViewError,
    studies::detectors::DetectorError,
    sim::l2a::L2aError,
    sim::road::RoadError,
    studies::monte_carlo::EvaluateError,
    studies::optimum::OptimumError,
    sim::input::PictureError,
    reception::picture::PixelKindError,
    reception::still::StillError,
    rx_pipeline::receiver::ReceiverError,
    reception::ReceptionError,
    reception::keys::KeyFileError,
    rx_pipeline::frame::FrameError,
    rx_pipeline::cells::CellsError,
    rx_pipeline::corners::CornersError,
);
