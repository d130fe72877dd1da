//! Draws camera frames of a scene, one at a time.

use link::panel::PanelFrame;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use sim::accuracy::Level;
use sim::renderer::canvas::Region;
use sim::renderer::{self, LinearImage};

use crate::arrays;
use crate::errors::{check, guarded, refused};
use crate::scene::{Decision, decisions, scene_of};

/// Draws camera frames of one scene, at level "fine", "fast" or "reference". The common parts of its frames are computed once.
///
/// Raises VoccError if the scene cannot be seen.
///
/// >>> import vocc
/// >>> renderer = vocc.Renderer("day", level="fast", crop=True)
/// >>> image = renderer.render(bits="8142241818244281")
/// >>> image.shape == renderer.shape, image.dtype
/// (True, dtype('uint8'))
#[pyclass(frozen, module = "vocc")]
pub struct Renderer {
    renderer: renderer::Renderer,
    region: Region,
}

#[pymethods]
impl Renderer {
    #[new]
    #[pyo3(signature = (scene=None, *, level="fine", crop=false))]
    fn new(py: Python<'_>, scene: Option<&Bound<'_, PyAny>>, level: &str, crop: bool) -> PyResult<Self> {
        let scene = scene_of(scene)?;
        let level: Level = check(level.parse())?;
        let renderer = guarded(|| py.detach(|| check(renderer::Renderer::new(&scene, level))))?;
        let region = match crop {
            true => renderer.surroundings(0),
            false => renderer.sensor(),
        };
        Ok(Self { renderer, region })
    }

    /// One frame, of shape (height, width): the camera's uint8 grey levels or, with `linear`, float32 light (float64 at level "reference"),
    /// 1 at a grey card, without noise.
    ///
    /// `bits` are the first panel's: an int (bit 8*row + column), 16 hexadecimal digits or a bool array of shape (8, 8); by default, they
    /// are random by `seed` and `frame`. `frame` is the number of the frame, which determines its time and its random numbers.
    #[pyo3(signature = (bits=None, *, frame=0, seed=1, linear=false))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        bits: Option<&Bound<'py, PyAny>>,
        frame: u64,
        seed: u64,
        linear: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let bits = bits.map(arrays::panel).transpose()?;
        let drawn = guarded(|| Ok(py.detach(|| self.draw(bits, frame, seed, linear))))?;
        let shape = (self.region.height, self.region.width);
        Ok(match drawn {
            RenderedPixels::Grey(grey) => picture(py, shape, grey)?.into_any(),
            RenderedPixels::Light(LinearImage::Single(canvas)) => picture(py, shape, canvas.values().to_vec())?.into_any(),
            RenderedPixels::Light(LinearImage::Double(canvas)) => picture(py, shape, canvas.values().to_vec())?.into_any(),
        })
    }

    /// The random bits of the first panel in a frame: a bool array of shape (8, 8).
    #[pyo3(signature = (*, frame=0, seed=1))]
    fn bits(&self, py: Python<'_>, frame: u64, seed: u64) -> PyResult<Py<PyArray2<bool>>> {
        let shown = self.renderer.shown(seed, frame, None);
        let first = shown.first().ok_or_else(|| refused("the scene has no panel: give one"))?;
        Ok(arrays::leds(py, first.symbols[0]))
    }

    /// Rows and columns of the frames.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.region.height, self.region.width)
    }

    /// The sensor's column and row of the frames' first pixel.
    #[getter]
    fn origin_px(&self) -> (usize, usize) {
        (self.region.x, self.region.y)
    }

    /// The centres of the first panel's corner LEDs, top left, top right, bottom right and bottom left: x and y in pixels of the frame, of
    /// shape (4, 2). (0, 0) is the centre of the top-left pixel. If the camera vibrates, these are the corners in frame 0 of seed 1: see
    /// corners.
    #[getter]
    fn corners_px(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.corners(py, 0, 1)
    }

    /// The same centres in any frame: if the camera vibrates, each frame has its own.
    #[pyo3(signature = (*, frame=0, seed=1))]
    fn corners(&self, py: Python<'_>, frame: u64, seed: u64) -> Py<PyArray2<f64>> {
        let moment = self.renderer.moment(seed, frame);
        arrays::rows(py, self.renderer.corner_leds_in(self.region, &moment))
    }

    /// Maximum error of frames relative to the reference, in grey levels before rounding.
    #[getter]
    fn error_bound_grey(&self) -> f64 {
        self.renderer.level().error_bound_grey()
    }

    /// The simulated effects with reasons: as Scene.plan.
    fn plan(&self) -> Vec<Decision> {
        decisions(self.renderer.plan())
    }
}

enum RenderedPixels {
    Grey(Vec<u8>),
    Light(LinearImage),
}

impl Renderer {
    fn draw(&self, bits: Option<PanelFrame>, frame: u64, seed: u64, linear: bool) -> RenderedPixels {
        let (renderer, region) = (&self.renderer, self.region);
        let shown = renderer.shown(seed, frame, bits);
        let mut image = renderer.linear_image(region);
        renderer.draw_frame(seed, frame, &shown, &mut image);
        if linear {
            return RenderedPixels::Light(image);
        }
        let mut grey = vec![0; region.width * region.height];
        renderer.read_frame(seed, frame, &image, &mut grey);
        RenderedPixels::Grey(grey)
    }
}

fn picture<'py, T: numpy::Element>(py: Python<'py>, shape: (usize, usize), values: Vec<T>) -> PyResult<Bound<'py, PyArray2<T>>> {
    Ok(check(Array2::from_shape_vec(shape, values))?.into_pyarray(py))
}

/// Draws one camera frame of a scene, of shape (height, width), bit for bit as `vocc render` does. For many frames of one scene, use
/// Renderer or frames.
///
/// The frame has uint8 grey levels or, with `linear`, float32 light (float64 at level "reference"), 1 at a grey card, without noise.
/// `bits` are the first panel's: an int, 16 hexadecimal digits or a bool array of shape (8, 8); by default, they are random by `seed` and
/// `frame`. `crop` draws the first panel's surroundings instead of the whole sensor.
///
/// Raises VoccError if the scene cannot be seen.
///
/// >>> import vocc
/// >>> vocc.render("night", bits="8040201008040201", frame=3, level="fine").shape
/// (1080, 1920)
/// >>> light = vocc.render("paper", bits=1, linear=True, crop=True)
/// >>> light.dtype, bool(light.max() > 3)
/// (dtype('float32'), True)
#[pyfunction]
#[pyo3(signature = (scene=None, *, bits=None, frame=0, level="fine", linear=false, seed=1, crop=false))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn render<'py>(
    py: Python<'py>,
    scene: Option<&Bound<'py, PyAny>>,
    bits: Option<&Bound<'py, PyAny>>,
    frame: u64,
    level: &str,
    linear: bool,
    seed: u64,
    crop: bool,
) -> PyResult<Bound<'py, PyAny>> {
    Renderer::new(py, scene, level, crop)?.render(py, bits, frame, seed, linear)
}
