//! Random frames of a scene with the truth: data for training and testing detectors.

use link::panel::PanelFrame;
use numpy::ndarray::{Array2, Array3, Array4};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArray4};
use pyo3::prelude::*;
use rx_pipeline::features::Features;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, FrameSource, LabelledFrame, Labels, Settings};

use crate::arrays;
use crate::errors::{check, guarded, refused};
use crate::evaluate::single_precision;
use crate::record::record;
use crate::scene::scene_of;
use crate::work::Work;

record! {
    /// A frame with the truth.
    Frame {
        /// Its number, which determines the frame together with the scene and the seed.
        frame: u64,
        /// The region of the panel, uint8 of shape (height, width).
        image: Py<PyArray2<u8>>,
        /// The panel's bits in the middle of the exposure, bool of shape (8, 8).
        bits: Py<PyArray2<bool>>,
        /// The centres of the corner LEDs, top left, top right, bottom right and bottom left: x and y in pixels of the image, of shape
        /// (4, 2).
        corners_px: Py<PyArray2<f32>>,
        /// Whether the exposure contains two symbols.
        across: bool,
        /// AGR, GRI and NGR of each LED's cell, of shape (8, 8, 3); None if not requested.
        features: Option<Py<PyArray3<f32>>>,
    }
}

record! {
    /// Many frames with the truth.
    Batch {
        /// The number of the first frame.
        first: u64,
        /// The region of the panel, uint8 of shape (n, height, width).
        images: Py<PyArray3<u8>>,
        /// The panel's bits, bool of shape (n, 8, 8).
        bits: Py<PyArray3<bool>>,
        /// The centres of the corner LEDs, of shape (n, 4, 2).
        corners_px: Py<PyArray3<f32>>,
        /// Whether each exposure contains two symbols, bool of shape (n,).
        across: Py<PyArray1<bool>>,
        /// AGR, GRI and NGR of each LED's cell, of shape (n, 8, 8, 3); None if not requested.
        features: Option<Py<PyArray4<f32>>>,
    }
}

/// An iterator over random frames of a scene: see frames.
#[pyclass(module = "vocc")]
pub struct Frames {
    source: FrameSource,
    next: u64,
    end: u64,
    batch: Option<u64>,
    work: Work,
}

/// Maximum number of pixels in a batch: 4 GB.
const BATCH_PIXELS_MAX: u64 = 1 << 32;

/// Rejects batches that are too large.
pub fn check_batch(batch: u64, source: &FrameSource, or: &str) -> PyResult<()> {
    let most = BATCH_PIXELS_MAX / source.pixels() as u64;
    if (1..=most).contains(&batch) {
        return Ok(());
    }
    let region = source.region();
    Err(refused(format!(
        "batch = {batch}: give 1 to {most} frames of {} × {} pixels{or}",
        region.width, region.height
    )))
}

/// The random frames that `evaluate` draws of a scene with a seed, with the truth: an iterator of Frame or, with `batch`, of Batch with
/// that many frames.
///
/// Frames are numbered `first` to `first + n - 1`: frame k of a seed is the same in any run. They show the first panel's cells, and all
/// images have one size. `features`: measure each LED's cell as the paper's detectors do. `threads` draw each batch (by default 1; None:
/// all processors); single frames are drawn in the calling thread.
///
/// Raises VoccError if the scene cannot be seen.
///
/// >>> import vocc
/// >>> for frame in vocc.frames("night", 3, seed=7):
/// ...     print(frame.frame, frame.image.shape, int(frame.bits.sum()))
/// 0 (40, 40) 35
/// 1 (40, 40) 30
/// 2 (40, 40) 35
/// >>> batch = next(vocc.frames("night", 1000, seed=7, batch=1000, features=True))
/// >>> batch.images.shape, batch.bits.shape, batch.features.shape
/// ((1000, 40, 40), (1000, 8, 8), (1000, 8, 8, 3))
#[pyfunction]
#[pyo3(signature = (
    scene=None, n=1000, seed=1, *, first=0, batch=None, features=false, random_reflectance=false, level="fast", threads=1
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn frames(
    py: Python<'_>,
    scene: Option<&Bound<'_, PyAny>>,
    n: u64,
    seed: u64,
    first: u64,
    batch: Option<u64>,
    features: bool,
    random_reflectance: bool,
    level: &str,
    threads: Option<usize>,
) -> PyResult<Frames> {
    let scene = scene_of(scene)?;
    let end = first
        .checked_add(n)
        .ok_or_else(|| refused(format!("first = {first} and n = {n} add up to more than 2**64 - 1")))?;
    let settings = Settings {
        random_reflectance,
        level: single_precision(level)?,
        ..Settings::fast(n, seed, DetectorChoice::KMeans)
    };
    let evaluator = guarded(|| py.detach(|| check(Evaluator::new(&scene, settings))))?;
    let labels = Labels {
        features,
        ..Labels::default()
    };
    let source = FrameSource::new(evaluator, labels);
    if let Some(batch) = batch {
        check_batch(batch, &source, ", or None for one by one")?;
    }
    Ok(Frames {
        source,
        next: first,
        end,
        work: Work::on(threads)?,
        batch,
    })
}

#[pymethods]
impl Frames {
    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    /// Number of frames or batches that are left.
    fn __len__(&self) -> usize {
        let left = self.end - self.next;
        usize::try_from(left.div_ceil(self.batch.unwrap_or(1))).unwrap_or(usize::MAX)
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        if self.next >= self.end {
            return Ok(None);
        }
        match self.batch {
            None => self.one(py).map(Some),
            Some(batch) => self.many(py, batch).map(Some),
        }
    }

    /// Rows and columns of the images.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        let region = self.source.region();
        (region.height, region.width)
    }

    /// The sensor's column and row of the images' first pixel.
    #[getter]
    fn origin_px(&self) -> (usize, usize) {
        let region = self.source.region();
        (region.x, region.y)
    }
}

impl Frames {
    fn one<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (frame, shape) = (self.next, self.shape());
        let mut grey = vec![0; self.source.pixels()];
        let drawn = guarded(|| py.detach(|| check(self.source.draw(frame, &mut grey))))?;
        self.next += 1;
        let features = drawn.features.map(|features| {
            let values = Array3::from_shape_vec((8, 8, 3), triples(&features));
            Ok::<_, PyErr>(check(values)?.into_pyarray(py).unbind())
        });
        let frame = Frame {
            frame,
            image: check(Array2::from_shape_vec(shape, grey))?.into_pyarray(py).unbind(),
            bits: arrays::leds(py, drawn.bits),
            corners_px: arrays::rows(py, drawn.corners_px),
            across: drawn.across,
            features: features.transpose()?,
        };
        Ok(Bound::new(py, frame)?.into_any())
    }

    fn many<'py>(&mut self, py: Python<'py>, batch: u64) -> PyResult<Bound<'py, PyAny>> {
        let first = self.next;
        let count = batch.min(self.end - first) as usize;
        let (images, frames) = draw(py, &self.source, &self.work, first, count)?;
        self.next += count as u64;
        let bits: Vec<PanelFrame> = frames.iter().map(|frame| frame.bits).collect();
        let across: Vec<bool> = frames.iter().map(|frame| frame.across).collect();
        let features = self.source.labels().features.then(|| all_features(py, &frames));
        let batch = Batch {
            first,
            images: pictures(py, &self.source, images)?,
            bits: arrays::all_leds(py, &bits),
            corners_px: all_corners(py, &frames)?,
            across: across.into_pyarray(py).unbind(),
            features: features.transpose()?,
        };
        Ok(Bound::new(py, batch)?.into_any())
    }
}

/// Draws `count` frames, with their pictures concatenated.
pub fn draw(py: Python<'_>, source: &FrameSource, work: &Work, first: u64, count: usize) -> PyResult<(Vec<u8>, Vec<LabelledFrame>)> {
    work.run(py, None, |control| {
        let mut images = vec![0; count * source.pixels()];
        let frames = source.draw_many(first, &mut images, control.stop)?;
        Ok::<_, studies::monte_carlo::EvaluateError>((images, frames))
    })
}

/// Pictures, of shape (n, height, width).
pub fn pictures(py: Python<'_>, source: &FrameSource, images: Vec<u8>) -> PyResult<Py<PyArray3<u8>>> {
    let (region, count) = (source.region(), images.len() / source.pixels());
    let images = Array3::from_shape_vec((count, region.height, region.width), images);
    Ok(check(images)?.into_pyarray(py).unbind())
}

/// Corners of frames, of shape (n, 4, 2).
pub fn all_corners(py: Python<'_>, frames: &[LabelledFrame]) -> PyResult<Py<PyArray3<f32>>> {
    let corners = frames.iter().flat_map(|frame| frame.corners_px).flatten();
    let corners = Array3::from_shape_vec((frames.len(), 4, 2), corners.collect());
    Ok(check(corners)?.into_pyarray(py).unbind())
}

/// Features of frames that have them, of shape (n, 8, 8, 3).
pub fn all_features(py: Python<'_>, frames: &[LabelledFrame]) -> PyResult<Py<PyArray4<f32>>> {
    let values = frames.iter().filter_map(|frame| frame.features.as_deref());
    let values = Array4::from_shape_vec((frames.len(), 8, 8, 3), values.flat_map(triples).collect());
    Ok(check(values)?.into_pyarray(py).unbind())
}

/// AGR, GRI and NGR of each LED, one LED after another.
fn triples(features: &Features) -> Vec<f32> {
    let ngr = features.ngr();
    let of_leds = features.agr.iter().zip(&features.gri).zip(&ngr);
    of_leds.flat_map(|((&agr, &gri), &ngr)| [agr, gri, ngr]).collect()
}
