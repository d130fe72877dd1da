//! Frames of one panel, and readers for timing.

use std::hint::black_box;
use std::ops::RangeFrom;

use fearless_simd::{self as simd, dispatch};
use link::camera::Camera;
use link::panel::PanelFrame;
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Detector;
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::{Experience, MaximumLikelihood};

use super::error::PrecisionError;
use super::point::Point;
use super::timing::Candidate;
use crate::monte_carlo::{Evaluator, PANEL_PIXELS, Settings, measure as features};
use crate::statistics::FrameErrors;
use sim::renderer::canvas::Region;
use sim::scene::Scene;

/// Frames that are read repeatedly for the time.
const TIMED: usize = 16;

/// Frames of a panel with known position and bits.
pub(super) struct Panels {
    region: Region,
    seen: Vec<(Vec<u8>, Corners, PanelFrame)>,
}

impl Panels {
    /// All frames of the settings.
    pub(super) fn of(scene: &Scene, settings: Settings) -> Result<Self, PrecisionError> {
        let evaluator = Evaluator::new(scene, settings)?;
        let mut workspace = evaluator.workspace();
        let region = evaluator.region();
        let seen = (0..settings.frames).map(|frame| {
            let reading = evaluator.observe(frame, &mut workspace)?;
            Ok((workspace.grey().to_vec(), reading.corners, reading.bits))
        });
        Ok(Self {
            region,
            seen: seen.collect::<Result<_, PrecisionError>>()?,
        })
    }

    /// Wrong bits of each frame from `from` on.
    pub(super) fn errors(&self, reader: &mut Reader, from: RangeFrom<usize>) -> Vec<u32> {
        let seen = self.seen[from].iter();
        seen.map(|(pixels, corners, bits)| self.read(reader, pixels, corners).distance(*bits))
            .collect()
    }

    /// The estimates from the first `frames` frames, starting from a camera.
    pub(super) fn experience(&self, camera: Camera, frames: usize) -> Experience {
        let mut likelihood = Box::new(MaximumLikelihood::<PANEL_PIXELS>::new(camera));
        for (pixels, corners, _) in &self.seen[..frames.min(self.seen.len())] {
            // Nothing is learnt from an unreadable frame.
            if let Ok(frame) = Frame::new(pixels, self.region.width, self.region.height) {
                let _ = likelihood.detect(&frame, corners);
            }
        }
        likelihood.experience()
    }

    /// A reader with the wrong bits of its frames, and the work of reading a few.
    pub(super) fn candidate(&self, name: &str, mut reader: Reader, wrong: &[u32]) -> Candidate<'_> {
        let mut errors = FrameErrors::default();
        wrong.iter().for_each(|&wrong| errors.push(wrong));
        let timed = &self.seen[self.seen.len().saturating_sub(TIMED)..];
        let point = Point::share(name, errors.errors() as f64, errors.bits() as f64, || errors.interval_95());
        Candidate::new(point, timed.len() as f64, move || {
            for (pixels, corners, _) in timed {
                black_box(self.read(&mut reader, pixels, corners));
            }
        })
    }

    /// The bits; all Off if reading fails.
    fn read(&self, reader: &mut Reader, pixels: &[u8], corners: &Corners) -> PanelFrame {
        let read = match reader {
            Reader::Features { detector, map, with_soft } => {
                let (detector, with_soft) = (*detector, *with_soft);
                dispatch!(simd::Level::new(), _simd => {
                    match features(pixels, self.region, corners, map) {
                        Ok(features) if with_soft => soft_bits(&detector, &features),
                        Ok(features) => detector.decide(&features).ok(),
                        Err(_) => None,
                    }
                })
            }
            Reader::Pixels { likelihood, prior } => {
                likelihood.set_experience(**prior);
                let frame = Frame::new(pixels, self.region.width, self.region.height);
                let detection = frame.ok().map(|frame| likelihood.detect(&frame, corners));
                detection.and_then(Result::ok).map(|detection| detection.bits)
            }
        };
        read.unwrap_or_default()
    }
}

/// The bits of a reading with soft values.
fn soft_bits(detector: &Detector, features: &Features) -> Option<PanelFrame> {
    let detection = black_box(detector.detect(features));
    detection.ok().map(|detection| detection.bits)
}

/// A detector and its memory.
pub(super) enum Reader {
    /// From cells.
    Features {
        detector: Detector,
        map: Box<CellMap<PANEL_PIXELS>>,
        with_soft: bool,
    },
    /// From pixels, every frame by the same experience.
    Pixels {
        likelihood: Box<MaximumLikelihood<PANEL_PIXELS>>,
        prior: Box<Experience>,
    },
}

impl Reader {
    pub(super) fn features(detector: Detector, with_soft: bool) -> Self {
        let map = Box::new(CellMap::empty());
        Self::Features { detector, map, with_soft }
    }

    pub(super) fn pixels(camera: Camera, prior: Experience) -> Self {
        Self::Pixels {
            likelihood: Box::new(MaximumLikelihood::new(camera)),
            prior: Box::new(prior),
        }
    }
}
