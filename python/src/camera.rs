//! The properties of a camera, configured or learnt from its frames.

use link::camera::{self, Encoding};
use link::panel::LEDS;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use reception::deep;
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::likelihood::LINE_DELAY_MAX;
use rx_pipeline::pose::Lens;

use crate::errors::{check, refused};
use crate::record::{self, record};

/// A camera's settings. The receiver starts from them and learns; only `focal_px`, for the panel's pose, cannot be learnt.
///
/// `encoding` is "linear", "srgb", "rec709" or a gamma from 1 to 4. `focal_px` is the focal length in pixels, as one number or as two along
/// x and y. `principal_px` is the pixel on the optical axis, by default the middle of the frame. `distortion` has k1, k2, p1, p2, k3, k4,
/// k5, k6, or the first 1, 2, 4 or 5 of them, as OpenCV's calibrateCamera returns them. `line_delay_exposures` is the delay from one line
/// to the next in exposures, -2 to 2; 0 is a global shutter.
///
/// Raises VoccError if a value is out of its range.
///
/// >>> import vocc
/// >>> vocc.Camera(encoding=1.8, blur_sigma_px=0.8).blur_sigma_px
/// 0.8
/// >>> vocc.Camera(encoding=9)
/// Traceback (most recent call last):
///     ...
/// vocc.VoccError: a gamma of 9 is not 1 to 4: give the camera's value, 1 if it is linear; if it is unknown, start with 2.2
#[pyclass(frozen, skip_from_py_object, module = "vocc")]
#[derive(Clone, Copy, Default)]
pub struct Camera {
    camera: camera::Camera,
    /// Whether the encoding is configured.
    encoding: Option<Encoding>,
    focal_px: Option<[f64; 2]>,
    principal_px: Option<[f64; 2]>,
    distortion: [f64; 8],
    line_delay: Option<f32>,
}

/// The attributes of a camera.
const NAMES: [&str; 9] = [
    "encoding",
    "black_grey",
    "blur_sigma_px",
    "blur_aspect",
    "read_noise_e",
    "focal_px",
    "principal_px",
    "distortion",
    "line_delay_exposures",
];

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (
        encoding=None, *, black_grey=None, blur_sigma_px=None, blur_aspect=None, read_noise_e=None, focal_px=None, principal_px=None,
        distortion=None, line_delay_exposures=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        encoding: Option<&Bound<'_, PyAny>>,
        black_grey: Option<f32>,
        blur_sigma_px: Option<f32>,
        blur_aspect: Option<f32>,
        read_noise_e: Option<f32>,
        focal_px: Option<&Bound<'_, PyAny>>,
        principal_px: Option<[f64; 2]>,
        distortion: Option<Vec<f64>>,
        line_delay_exposures: Option<f32>,
    ) -> PyResult<Self> {
        let usual = camera::Camera::default();
        let encoding = encoding.map(encoding_of).transpose()?;
        let camera = camera::Camera {
            encoding: encoding.unwrap_or(usual.encoding),
            black_grey: black_grey.unwrap_or(usual.black_grey),
            blur_sigma_px: blur_sigma_px.unwrap_or(usual.blur_sigma_px),
            blur_aspect: blur_aspect.unwrap_or(usual.blur_aspect),
            read_noise_e: read_noise_e.unwrap_or(usual.read_noise_e),
        };
        let focal_px = match focal_px {
            None => None,
            Some(focal) => Some(match focal.extract::<f64>() {
                Ok(focal_px) => [focal_px; 2],
                Err(_) => focal.extract()?,
            }),
        };
        let told = distortion.unwrap_or_default();
        if !matches!(told.len(), 0 | 1 | 2 | 4 | 5 | 8) {
            return Err(refused(format!(
                "{} distortion coefficients: give k1, k2, p1, p2, k3, k4, k5, k6, or the first 1, 2, 4 or 5 of them",
                told.len()
            )));
        }
        let mut distortion = [0.0; 8];
        distortion[..told.len()].copy_from_slice(&told);
        let lens = Lens {
            focal_px: focal_px.unwrap_or([1.0; 2]),
            principal_px: principal_px.unwrap_or_default(),
            distortion,
        };
        check(lens.checked())?;
        if let Some(delay) = line_delay_exposures
            && !(-LINE_DELAY_MAX..=LINE_DELAY_MAX).contains(&delay)
        {
            return Err(refused(format!(
                "a line_delay_exposures of {delay} is not -{LINE_DELAY_MAX} to {LINE_DELAY_MAX}: give the time from one line to the next \
                 over that of an exposure"
            )));
        }
        Ok(Self {
            camera: check(camera.checked())?,
            encoding,
            focal_px,
            principal_px,
            distortion,
            line_delay: line_delay_exposures,
        })
    }

    /// "srgb", "rec709", or a gamma, if it is set or learnt; 1 is linear.
    #[getter]
    fn encoding(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let Some(encoding) = self.encoding else {
            return Ok(None);
        };
        Ok(Some(match encoding {
            Encoding::Gamma(gamma) => short(gamma).into_pyobject(py)?.into_any().unbind(),
            Encoding::Srgb => "srgb".into_pyobject(py)?.into_any().unbind(),
            Encoding::Rec709 => "rec709".into_pyobject(py)?.into_any().unbind(),
        }))
    }

    /// The grey level of no light, 0 to 64.
    #[getter]
    fn black_grey(&self) -> f64 {
        short(self.camera.black_grey)
    }

    /// Standard deviation of the lens blur in pixels, 0.3 to 4.
    #[getter]
    fn blur_sigma_px(&self) -> f64 {
        short(self.camera.blur_sigma_px)
    }

    /// The ratio of the blur along x to that along y, 0.5 to 2.
    #[getter]
    fn blur_aspect(&self) -> f64 {
        short(self.camera.blur_aspect)
    }

    /// Read noise in electrons.
    #[getter]
    fn read_noise_e(&self) -> f64 {
        short(self.camera.read_noise_e)
    }

    /// Focal length along x and y in pixels, if it is set.
    #[getter]
    fn focal_px(&self) -> Option<(f64, f64)> {
        self.focal_px.map(|[x, y]| (x, y))
    }

    /// The pixel on the optical axis, if it is set.
    #[getter]
    fn principal_px(&self) -> Option<(f64, f64)> {
        self.principal_px.map(|[x, y]| (x, y))
    }

    /// k1, k2, p1, p2, k3, k4, k5 and k6.
    #[getter]
    fn distortion(&self) -> Vec<f64> {
        self.distortion.to_vec()
    }

    /// The delay of each line after the one above, in exposures, if it is set or learnt.
    #[getter]
    fn line_delay_exposures(&self) -> Option<f64> {
        self.line_delay.map(short)
    }

    /// All attributes by name: Camera accepts them as keywords.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        record::to_dict(slf.as_any(), &NAMES)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        record::repr(slf.as_any(), &NAMES)
    }
}

record! {
    /// The camera and LEDs that a receiver has learnt from a panel's frames.
    LearntCamera {
        /// The camera: learnt values, and otherwise the configured ones. The next receiver can start from it.
        camera: Py<Camera>,
        /// The standard deviation of its blur_sigma_px, in pixels; None if the blur is not learnt, as with near panels.
        blur_deviation_px: Option<f64>,
        /// The standard deviation of a pixel of middle grey, in grey levels.
        noise_grey: f64,
        /// The delay of each line after the one above, in exposures: negative if lines are read from below, 0 for a global shutter, and
        /// None until exposures of two symbols have shown it.
        line_delay_exposures: Option<f64>,
        /// LEDs that do not follow the message, 8*row + column.
        broken_leds: Vec<usize>,
        /// Number of frames of which this was learnt.
        frames: u32,
    }
}

impl Camera {
    /// The camera of a receiver of 8-bit frames.
    pub fn camera(&self) -> camera::Camera {
        self.camera
    }

    /// The encoding, if it is set.
    pub fn told_encoding(&self) -> Option<Encoding> {
        self.encoding
    }

    /// For a receiver of pixels that are unchanged, or were encoded for it: see `SampleKind::are_encoded`.
    pub fn of_pixels(&self, are_encoded: bool) -> camera::Camera {
        let mut camera = self.camera;
        if are_encoded {
            camera.encoding = Encoding::default();
        }
        camera
    }

    /// The delay of each line after the one above, in exposures, if it is set.
    pub fn line_delay(&self) -> Option<f32> {
        self.line_delay
    }

    /// The lens for frames of a width and height, or the reason why it is unknown.
    pub fn lens(&self, size: [usize; 2]) -> Result<Lens, String> {
        let Some(focal_px) = self.focal_px else {
            return Err("no focal length: give camera=Camera(focal_px=…)".into());
        };
        let usual = Lens::pinhole(1.0, size);
        Ok(Lens {
            focal_px,
            principal_px: self.principal_px.unwrap_or(usual.principal_px),
            distortion: self.distortion,
        })
    }

    /// The learnt camera with the configured lens. The encoding is that of the given images, even if their pixels were encoded for the
    /// receiver.
    pub fn learnt(&self, py: Python<'_>, learnt: &CameraEstimate, are_encoded: bool) -> PyResult<LearntCamera> {
        let mut camera = learnt.camera;
        if are_encoded {
            camera.encoding = deep::of_samples(camera.encoding);
        }
        let camera = camera.clamped();
        let camera = Self {
            camera,
            encoding: Some(camera.encoding),
            line_delay: learnt.line_delay.or(self.line_delay),
            ..*self
        };
        let broken = (0..LEDS).filter(|led| learnt.broken >> led & 1 == 1);
        Ok(LearntCamera {
            camera: Py::new(py, camera)?,
            blur_deviation_px: learnt.blur_deviation_px.map(short),
            noise_grey: short(learnt.noise_grey),
            line_delay_exposures: learnt.line_delay.map(short),
            broken_leds: broken.collect(),
            frames: learnt.frames,
        })
    }
}

/// Converts an argument to a camera: a Camera, a LearntCamera, or a dict of attributes.
pub fn camera_of(argument: &Bound<'_, PyAny>) -> PyResult<Camera> {
    if let Ok(camera) = argument.cast::<Camera>() {
        return Ok(*camera.get());
    }
    if let Ok(learnt) = argument.cast::<LearntCamera>() {
        return Ok(*learnt.get().camera.get());
    }
    if let Ok(dict) = argument.cast::<PyDict>() {
        let class = argument.py().get_type::<Camera>();
        let camera = class.call((), Some(dict))?;
        return Ok(*camera.cast::<Camera>()?.get());
    }
    let kind = argument.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "a camera is a Camera, a LearntCamera or a dict of a Camera's attributes; this is of type {kind}"
    )))
}

/// Converts a name or a number to an encoding.
fn encoding_of(argument: &Bound<'_, PyAny>) -> PyResult<Encoding> {
    if let Ok(gamma) = argument.extract::<f32>()
        && !argument.is_instance_of::<PyBool>()
    {
        return Ok(Encoding::Gamma(gamma));
    }
    match argument.extract::<String>() {
        Ok(name) if name == "linear" => Ok(Encoding::LINEAR),
        Ok(name) if name == "srgb" => Ok(Encoding::Srgb),
        Ok(name) if name == "rec709" => Ok(Encoding::Rec709),
        _ => Err(refused(format!(
            "{} is not an encoding: give linear, srgb, rec709, or a gamma of 1 to 4",
            argument.repr()?
        ))),
    }
}

/// The double with the fewest digits that rounds to this number.
fn short(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(value.into())
}
