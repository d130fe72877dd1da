//! What is said between a computer and a board that reads panels.

use crate::detect::{Detector, Fisher, Method};
use crate::profile::STAGES;
use crate::receiver::{Loss, Reading, ReceiverSettings};
use link::camera::Camera;
use link::framing::MESSAGE_MAX;
use link::panel::SIDE;
use link::serial::FRAME_OVERHEAD;
use serde::{Deserialize, Serialize};

/// The number of this set of messages; another number, other messages.
pub const PROTOCOL: u16 = 1;
/// Pixels along a region's side at most.
pub const REGION_SIDE_MAX: usize = 128;
/// Bytes of the longest request's frame.
pub const REGION_REQUEST_MAX: usize = FRAME_OVERHEAD + 64 + REGION_SIDE_MAX * REGION_SIDE_MAX;
/// Bytes of the longest answer's frame.
pub const REGION_ANSWER_MAX: usize = FRAME_OVERHEAD + 256 + MESSAGE_MAX;

/// A request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Who is there? Answered by [`Answer::Hello`].
    Hello,
    /// Forget everything and go by these settings. Answered by [`Answer::Ready`].
    Begin(Settings),
    /// Read this. Answered by [`Answer::Report`].
    #[serde(borrow)]
    Region(Region<'a>),
    /// No more frames come: take in the symbol that the last ones showed. Answered by [`Answer::Finished`].
    Finish,
    /// How much memory has been needed so far? Answered by [`Answer::Memory`].
    Memory,
}

/// What a receiver has to know of camera and link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// How bits are told apart.
    pub method: MethodChoice,
    /// The camera that makes the frames.
    pub camera: Camera,
    /// Symbols in a frame period: above 0, at most 1.
    pub symbols_per_frame: f32,
}

/// How bits are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum MethodChoice {
    /// [`Detector::KMeans`]
    KMeans,
    /// [`Method::MaximumLikelihood`]
    MaximumLikelihood,
    /// [`Detector::KMeansRaw`]
    KMeansRaw,
    /// [`Detector::Otsu`]
    Otsu,
    /// [`Detector::Fisher`], trained elsewhere.
    Fisher(Fisher),
}

impl Default for Settings {
    /// k-means, [`Camera::default`], and one symbol a frame.
    fn default() -> Self {
        Self {
            method: MethodChoice::KMeans,
            camera: Camera::default(),
            symbols_per_frame: 1.0,
        }
    }
}

impl From<Settings> for ReceiverSettings {
    fn from(settings: Settings) -> Self {
        let Settings {
            method,
            camera,
            symbols_per_frame,
        } = settings;
        Self {
            camera,
            method: match method {
                MethodChoice::KMeans => Detector::KMeans.into(),
                MethodChoice::KMeansRaw => Detector::KMeansRaw.into(),
                MethodChoice::Otsu => Detector::Otsu.into(),
                MethodChoice::Fisher(fisher) => Detector::Fisher(fisher).into(),
                MethodChoice::MaximumLikelihood => Method::MaximumLikelihood,
            },
            symbols_per_frame,
        }
    }
}

/// A part of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region<'a> {
    /// Number of the frame. Numbers rise; those left out are lost frames.
    pub frame: u64,
    /// Column and row of its first pixel in the frame.
    pub origin: [u16; 2],
    /// Columns and rows: 1 to [`REGION_SIDE_MAX`].
    pub size: [u16; 2],
    /// Where the panel is, if that is known from elsewhere: the corner LEDs in pixels of the frame, top left, top right, bottom right,
    /// bottom left.
    pub corners: Option<[[f32; 2]; 4]>,
    /// Grey levels, row by row.
    pub pixels: &'a [u8],
}

/// An answer; it carries the sequence number of its request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Answer<'a> {
    /// The request was not done, and nothing changed, except that after [`Refusal::Place`] no panel is followed and the window is that of
    /// the refused region.
    Refused(Refusal),
    /// Who is here.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// The settings are taken.
    Ready,
    /// What a region showed.
    Report(Report<'a>),
    /// The message that the last symbol completed, if it did.
    Finished(Option<Message<'a>>),
    /// What memory was needed.
    Memory(Memory),
}

/// Who a board is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello<'a> {
    /// [`PROTOCOL`] of its messages.
    pub protocol: u16,
    /// Its name, up to 32 bytes.
    pub board: &'a str,
    /// Ticks of its clock in a second.
    pub ticks_hz: u32,
}

/// What memory a board has needed since it started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Memory {
    /// The deepest that its stack was, bytes.
    pub stack_bytes: u32,
}

/// What a region showed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report<'a> {
    /// The panel, or why there is none.
    pub reading: Result<WireReading, Unread>,
    /// The number of the symbol that the frame shows, where it was read.
    pub symbol: Option<u32>,
    /// The message that the symbol before this frame's completed, if it did.
    #[serde(borrow)]
    pub message: Option<Message<'a>>,
    /// What it took from the region's arrival to this report, in ticks of the board's clock.
    pub ticks: u32,
    /// Of these, what each of [`STAGES`] took.
    pub stage_ticks: [u32; STAGE_COUNT],
}

/// Stages that are timed.
pub const STAGE_COUNT: usize = STAGES.len();

/// One frame's panel, read, as it goes over the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WireReading {
    /// The corner LEDs in pixels of the frame, top left, top right, bottom right, bottom left.
    pub corners: [[f32; 2]; 4],
    /// The bits, LED 8·row + column at that bit.
    pub bits: u64,
    /// The log-likelihood ratio of each LED, row by row, in steps of [`link::panel::LLR_STEP`].
    pub soft: [[i8; SIDE]; SIDE],
    /// The share of bits that are right if the soft values are.
    pub confidence: f32,
    /// Whether the exposure seems to have caught two symbols.
    pub mixed: bool,
}

impl WireReading {
    /// A reading, moved from a region that begins at `origin` into its frame.
    pub(super) fn new(reading: &Reading, origin: [u16; 2]) -> Self {
        let Reading { corners, detection } = reading;
        let mut soft = [[0; SIDE]; SIDE];
        for (to, &from) in soft.iter_mut().flatten().zip(&detection.soft.0) {
            *to = from;
        }
        let [x, y] = origin.map(|c| c as f32);
        Self {
            corners: corners.points().map(|[cx, cy]| [cx + x, cy + y]),
            bits: detection.bits.bits(),
            soft,
            confidence: detection.confidence,
            mixed: detection.mixed.is_some(),
        }
    }
}

/// Why a region gave no reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Unread {
    /// The panel that was followed is not seen; it is looked for where it should be.
    #[error("coasting, frame {missed} without the panel")]
    Coasting {
        /// Frames missed in a row, from 1.
        missed: u32,
    },
    /// The panel that was followed is given up.
    #[error("lost: say where the panel is")]
    Lost,
    /// Nothing is followed.
    #[error("no panel is followed: say where it is")]
    NoPlace,
    /// The panel's cells are not in the region.
    #[error("the panel reaches beyond the region: send a larger one, or one that begins elsewhere")]
    Outside,
    /// The panel is there, and its bits cannot be told apart.
    #[error("the bits cannot be told apart")]
    Undecided,
}

impl From<Loss> for Unread {
    fn from(loss: Loss) -> Self {
        match loss {
            Loss::Coasting { missed, .. } => Self::Coasting { missed },
            Loss::Lost(_) => Self::Lost,
            Loss::NoPlace | Loss::Locate(_) => Self::NoPlace,
            Loss::Cells(_) | Loss::Features(_) => Self::Outside,
            Loss::Detect(_) => Self::Undecided,
        }
    }
}

/// A message that was received whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Message<'a> {
    /// Its bytes: 1 to 1024.
    pub bytes: &'a [u8],
    /// The frame in which it began.
    pub first_frame: u64,
    /// The frame in which it ended.
    pub last_frame: u64,
    /// LEDs that error correction mended.
    pub corrected_bits: u32,
}

/// Why a board did not do what was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The request is of another version of the frames.
    #[error("the board speaks version {speaks} of the frames: use a program that does, or update it")]
    Version {
        /// The version it speaks.
        speaks: u8,
    },
    /// The request is whole, and no message of this protocol.
    #[error("the board does not know this request: update the older side")]
    Unknown,
    /// A setting is out of its range.
    #[error(
        "a setting is out of its range: gamma 1 to 4, black 0 to 64, blur 0.3 to 4 px and 0.5 to 2 times as wide as high, read noise \
         0 to 1e6 electrons, above 0 and at most 1 symbols a frame"
    )]
    Settings,
    /// The region's size is impossible, or not that of its pixels.
    #[error("{pixels} pixels are no region of {width} × {height}, each side 1 to {REGION_SIDE_MAX}")]
    Size {
        /// Columns announced.
        width: u16,
        /// Rows announced.
        height: u16,
        /// Pixels that came.
        pixels: u32,
    },
    /// The corners are no panel's.
    #[error("the corners are no readable panel's: top left, top right, bottom right, bottom left, at least 1.5 px from LED to LED")]
    Corners,
    /// The panel at these corners is not in the region, with a pixel around it, or larger than the board's memory.
    #[error("the panel is not wholly in the region, or too large for the board: send another region")]
    Place,
}
