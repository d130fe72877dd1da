//! The frames of an evaluation with the truth about them, for other detectors.
//!
//! ```
//! use sim::scene::Scene;
//! use studies::detectors::DetectorChoice;
//! use studies::monte_carlo::{Evaluator, FrameSource, Labels, Settings, Tally};
//! use studies::stop::Stop;
//! let settings = Settings::fast(256, 1, DetectorChoice::KMeans);
//! let evaluator = Evaluator::new(&Scene::load("paper", &[])?, settings)?;
//! let counted = evaluator.run(|_| true)?;
//! let source = FrameSource::new(evaluator, Labels { features: true, reading: true });
//! let mut images = vec![0; 256 * source.pixels()];
//! let mut tally = Tally::default();
//! for frame in source.draw_many(0, &mut images, Stop::NEVER)? {
//!     // A detector of your own reads here.
//!     let read = frame.read.expect("a reading was asked for");
//!     tally.push(&frame, read)?;
//! }
//! assert_eq!(tally.finish()?, counted);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::sync::{Mutex, PoisonError};

use link::panel::PanelFrame;
use rx_pipeline::features::Features;
use sim::renderer::canvas::Region;

use super::accumulator::{Accumulator, AccumulatorError};
use super::error::EvaluateError;
use super::evaluation::{CHUNK, Evaluation};
use super::evaluator::{Evaluator, Workspace};
use crate::parallel::map;
use crate::stop::Stop;

/// Frames that a thread draws at a time.
const PIECE: usize = 128;

/// The labels of a frame beside its picture and the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Labels {
    /// The features of its cells.
    pub features: bool,
    /// The bits that the evaluation's detector reads.
    pub reading: bool,
}

/// The truth about a frame, and its measurements.
pub struct LabelledFrame {
    /// The panel's bits in the middle of the exposure.
    pub bits: PanelFrame,
    /// The centres of its corner LEDs in the picture: top left, top right, bottom right and bottom left, x and y in pixels.
    pub corners_px: [[f32; 2]; 4],
    /// Whether the exposure contains two symbols.
    pub across: bool,
    /// The features of its cells, if requested.
    pub features: Option<Box<Features>>,
    /// The bits that the evaluation's detector reads, if requested.
    pub read: Option<PanelFrame>,
}

/// Draws the frames that an [`Evaluator`] evaluates: frame k of a seed is the same picture here and there.
pub struct FrameSource {
    evaluator: Evaluator,
    labels: Labels,
    /// Workspaces that no thread is using at present.
    rooms: Mutex<Vec<Workspace>>,
}

impl FrameSource {
    /// The frames of `evaluator`.
    pub fn new(evaluator: Evaluator, labels: Labels) -> Self {
        Self {
            evaluator,
            labels,
            rooms: Mutex::default(),
        }
    }

    /// The evaluator whose frames these are.
    pub fn evaluator(&self) -> &Evaluator {
        &self.evaluator
    }

    /// The labels of each frame.
    pub fn labels(&self) -> Labels {
        self.labels
    }

    /// The part of the sensor that pictures show: the panel's cells.
    pub fn region(&self) -> Region {
        self.evaluator.region()
    }

    /// Pixels of a picture.
    pub fn pixels(&self) -> usize {
        let Region { width, height, .. } = self.region();
        width * height
    }

    /// Draws frame `frame` into `image`, row by row.
    ///
    /// # Errors
    /// If it cannot be measured.
    pub fn draw(&self, frame: u64, image: &mut [u8]) -> Result<LabelledFrame, EvaluateError> {
        let mut room = self.room();
        let drawn = self.draw_in(&mut room, frame, image);
        self.keep(room);
        drawn
    }

    /// Draws frames from `first` on into `images`, one picture after another until they are full, on all threads.
    ///
    /// # Errors
    /// [`EvaluateError::Stopped`] as soon as `stop` is set, and an error if a frame cannot be measured.
    pub fn draw_many(&self, first: u64, images: &mut [u8], stop: Stop) -> Result<Vec<LabelledFrame>, EvaluateError> {
        let pieces = (first..).step_by(PIECE).zip(images.chunks_mut(PIECE * self.pixels()));
        let pieces = map(pieces, |(first, images)| self.draw_piece(first, images, stop));
        let pieces: Result<Vec<_>, _> = pieces.into_iter().collect();
        Ok(pieces?.into_iter().flatten().collect())
    }

    /// The same, one after another.
    fn draw_piece(&self, first: u64, images: &mut [u8], stop: Stop) -> Result<Vec<LabelledFrame>, EvaluateError> {
        let mut room = self.room();
        let images = (first..).zip(images.chunks_exact_mut(self.pixels()));
        let drawn = images.map(|(frame, image)| match stop.is_asked() {
            true => Err(EvaluateError::Stopped),
            false => self.draw_in(&mut room, frame, image),
        });
        let drawn = drawn.collect();
        self.keep(room);
        drawn
    }

    fn draw_in(&self, room: &mut Workspace, frame: u64, image: &mut [u8]) -> Result<LabelledFrame, EvaluateError> {
        let Labels { features, reading } = self.labels;
        let (bits, corners, features, read) = if features || reading {
            let observed = self.evaluator.observe(frame, room)?;
            let read = match reading {
                true => Some(self.evaluator.detect_softly(&observed, room)?.0),
                false => None,
            };
            let measured = features.then(|| Box::new(observed.features));
            (observed.bits, observed.corners, measured, read)
        } else {
            let (bits, corners) = self.evaluator.render(frame, room)?;
            (bits, corners, None, None)
        };
        image.copy_from_slice(room.grey());
        Ok(LabelledFrame {
            bits,
            corners_px: corners.points(),
            across: self.evaluator.renderer().straddles(0, &room.moment),
            features,
            read,
        })
    }

    fn room(&self) -> Workspace {
        let kept = self.rooms.lock().unwrap_or_else(PoisonError::into_inner).pop();
        kept.unwrap_or_else(|| self.evaluator.workspace())
    }

    fn keep(&self, room: Workspace) {
        self.rooms.lock().unwrap_or_else(PoisonError::into_inner).push(room);
    }
}

/// Counts frames, pushed from 0 on, as [`Evaluator::run`] does: the same readings give the same sums, bit for bit.
#[derive(Default)]
pub struct Tally {
    part: Evaluation,
    chunk: u64,
    sums: Accumulator,
}

impl Tally {
    /// Counts the next frame, which was read as `read`. Variances are of frames with features.
    ///
    /// # Errors
    /// If there are more frames than can be counted.
    pub fn push(&mut self, frame: &LabelledFrame, read: PanelFrame) -> Result<(), AccumulatorError> {
        self.part.push(frame.features.as_deref(), frame.bits, read, frame.across);
        if self.part.errors.frames() == CHUNK {
            self.put_away()?;
        }
        Ok(())
    }

    /// The evaluation of all frames.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn finish(mut self) -> Result<Evaluation, AccumulatorError> {
        if self.part.errors.frames() > 0 {
            self.put_away()?;
        }
        Ok(self.sums.total())
    }

    fn put_away(&mut self) -> Result<(), AccumulatorError> {
        self.sums.add(self.chunk, std::mem::take(&mut self.part))?;
        self.chunk += 1;
        Ok(())
    }
}
