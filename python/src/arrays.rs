//! Converts NumPy arrays: images, and the 64 bits of a panel.

use std::borrow::Cow;

use link::camera::Encoding;
use link::panel::{LEDS, PanelFrame, SIDE};
use numpy::ndarray::{Array2, Array3};
use numpy::{
    IntoPyArray, PyArray2, PyArray3, PyArrayDescrMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyInt, PyString};
use reception::colour::Channel;
use reception::deep::{Compander, SampleKind};
use sim::input::SIDE_MAX;

use crate::errors::refused;

/// An image from Python.
pub enum Image<'py> {
    /// 8-bit grey.
    Grey(PyReadonlyArray2<'py, u8>),
    /// Blue, green and red of each pixel, in the order of OpenCV.
    Colour(PyReadonlyArray3<'py, u8>),
    /// Up to 16 bits.
    Deep(PyReadonlyArray2<'py, u16>),
    /// Linear light, 1 at a grey card.
    Light(PyReadonlyArray2<'py, f32>),
}

/// The pixels of an image, borrowed from Python.
#[derive(Clone, Copy)]
pub struct Pixels<'a> {
    samples: Samples<'a>,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

#[derive(Clone, Copy)]
enum Samples<'a> {
    Grey(&'a [u8]),
    Colour(&'a [u8]),
    Deep(&'a [u16]),
    Light(&'a [f32]),
}

/// The way out in errors about objects that are not images.
const WANTED: &str = "give a NumPy array of shape (height, width) and type uint8, uint16 or float32 (linear light), or (height, width, 3) \
    and uint8 as OpenCV has colours";

impl<'py> Image<'py> {
    /// Converts `object` to an image; `name` is the caller's name for it.
    pub fn of(object: &Bound<'py, PyAny>, name: &str) -> PyResult<Self> {
        let Ok(array) = object.cast::<PyUntypedArray>() else {
            let kind = object.get_type().name()?;
            return Err(PyTypeError::new_err(format!("{name} is of type {kind}: {WANTED}")));
        };
        let shape = array.shape();
        let told = format!("{name} is of shape {shape:?} and type {}", array.dtype());
        let of_size = shape[..shape.len().min(2)]
            .iter()
            .all(|side| (1..=SIDE_MAX as usize).contains(side));
        if !matches!(*shape, [_, _] | [_, _, 3]) || !of_size {
            return Err(refused(format!(
                "{told}, of 1 × 1 to {SIDE_MAX} × {SIDE_MAX} pixels it may be: {WANTED}"
            )));
        }
        if !array.is_c_contiguous() {
            return Err(refused(format!(
                "{told}, but its pixels do not follow one another row by row in memory: give numpy.ascontiguousarray({name})"
            )));
        }
        let taken = if shape.len() == 3 {
            object.extract().map(Self::Colour).ok()
        } else if let Ok(grey) = object.extract() {
            Some(Self::Grey(grey))
        } else if let Ok(deep) = object.extract() {
            Some(Self::Deep(deep))
        } else {
            object.extract().map(Self::Light).ok()
        };
        taken.ok_or_else(|| PyTypeError::new_err(format!("{told}: {WANTED}")))
    }

    /// Its pixels.
    pub fn pixels(&self) -> PyResult<Pixels<'_>> {
        let (samples, shape) = match self {
            Self::Grey(array) => (array.as_slice().map(Samples::Grey), array.shape()),
            Self::Colour(array) => (array.as_slice().map(Samples::Colour), array.shape()),
            Self::Deep(array) => (array.as_slice().map(Samples::Deep), array.shape()),
            Self::Light(array) => (array.as_slice().map(Samples::Light), array.shape()),
        };
        Ok(Pixels {
            samples: samples.map_err(refused)?,
            width: shape[1],
            height: shape[0],
        })
    }
}

impl<'a> Pixels<'a> {
    /// The kind of their samples.
    pub fn kind(&self) -> SampleKind {
        match self.samples {
            Samples::Grey(_) | Samples::Colour(_) => SampleKind::Plain,
            Samples::Deep(_) => SampleKind::Deep,
            Samples::Light(_) => SampleKind::Light,
        }
    }

    /// 8-bit grey. Colours give one channel, `deep` converts samples of more than 8 bits, and light is encoded with a camera's usual curve.
    ///
    /// # Errors
    /// The first value of light that is not a number of at least 0.
    pub fn grey(&self, channel: Channel, deep: &mut Compander) -> Result<Cow<'a, [u8]>, String> {
        Ok(match self.samples {
            Samples::Grey(grey) => Cow::Borrowed(grey),
            Samples::Colour(colours) => {
                let (pixels, _) = colours.as_chunks::<3>();
                let grey = pixels.iter().map(|&[blue, green, red]| channel.of([red, green, blue]));
                Cow::Owned(grey.collect())
            }
            Samples::Deep(samples) => Cow::Owned(deep.grey(samples)),
            Samples::Light(light) => Cow::Owned(encoded(light, self.width)?),
        })
    }
}

/// The grey levels of light.
fn encoded(light: &[f32], width: usize) -> Result<Vec<u8>, String> {
    let grey = light.iter().enumerate().map(|(place, &light)| {
        if light >= 0.0 && light.is_finite() {
            return Ok(Encoding::default().grey(light).round() as u8);
        }
        Err(format!(
            "light of {light} in row {}, column {}: it is a number from 0 up, 1 at a grey card; leave such pixels out, or make them 0",
            place / width,
            place % width
        ))
    });
    grey.collect()
}

/// The panel of an integer, 16 hexadecimal digits, or an array of shape (8, 8).
pub fn panel(object: &Bound<'_, PyAny>) -> PyResult<PanelFrame> {
    let wanted = "give an int from 0 to 2**64 - 1 (bit 8*row + column), 16 hexadecimal digits such as '8040201008040201', or a bool array \
         of shape (8, 8)";
    if object.is_instance_of::<PyInt>() && !object.is_instance_of::<PyBool>() {
        let bits = object.extract::<u64>();
        return bits
            .map(PanelFrame::from_bits)
            .map_err(|_| refused(format!("bits = {object}: {wanted}")));
    }
    if let Ok(text) = object.cast::<PyString>() {
        let text = text.to_cow()?;
        let bits = u64::from_str_radix(&text, 16);
        return match (text.len(), bits) {
            (16, Ok(bits)) if text.bytes().all(|c| c.is_ascii_hexdigit()) => Ok(PanelFrame::from_bits(bits)),
            _ => Err(refused(format!("bits = {text:?}: {wanted}"))),
        };
    }
    let Ok(array) = object.cast::<PyUntypedArray>() else {
        let kind = object.get_type().name()?;
        return Err(PyTypeError::new_err(format!("bits are of type {kind}: {wanted}")));
    };
    check_unmasked(object, "bits are")?;
    let shape = array.shape();
    if array.dtype().kind() != b'b' || shape.len() != 2 {
        let kind = array.dtype();
        return Err(PyTypeError::new_err(format!(
            "bits are an array of shape {shape:?} and type {kind}: {wanted}"
        )));
    }
    if shape != [SIDE, SIDE] {
        return Err(refused(format!("bits are of shape {shape:?}: {wanted}")));
    }
    let array = on_bytes(object)?;
    let on = array.as_array();
    let bits = on.iter().enumerate();
    Ok(PanelFrame::from_bits(
        bits.fold(0, |bits, (led, &on)| bits | u64::from(on != 0) << led),
    ))
}

/// The bytes of an array of bool. Another program may have written other values than 0 and 1, which count as True, but would be invalid as
/// Rust's bool.
fn on_bytes<'py>(object: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, u8>> {
    Ok(object.call_method1("view", ("uint8",))?.extract()?)
}

/// Rejects a masked array, whose mask would be ignored.
fn check_unmasked(object: &Bound<'_, PyAny>, what: &str) -> PyResult<()> {
    match object.hasattr("mask")? {
        true => Err(PyTypeError::new_err(format!(
            "{what} a masked array, which has no values for masked LEDs: give its filled(False), or filled(0.0) for soft values"
        ))),
        false => Ok(()),
    }
}

/// The way out in errors about the results of a function that reads frames.
const READING: &str = "return a NumPy array of bool (True: On), or of float (soft values: On above 0), of shape (n, 8, 8) or (n, 64) for n \
    frames";

/// The panels that a function has read in `count` frames from `first` on, as bits or as soft values, which are On above 0.
pub fn panels_read(object: &Bound<'_, PyAny>, first: u64, count: usize) -> PyResult<Vec<PanelFrame>> {
    let Ok(array) = object.cast::<PyUntypedArray>() else {
        let kind = object.get_type().name()?;
        return Err(PyTypeError::new_err(format!("the detector returned {kind}: {READING}")));
    };
    check_unmasked(object, "the detector returned")?;
    let told = format!(
        "the detector returned an array of shape {:?} and type {}",
        array.shape(),
        array.dtype()
    );
    let is_shape = matches!(*array.shape(), [n, SIDE, SIDE] | [n, LEDS] if n == count);
    if !is_shape {
        return Err(refused(format!("{told} for {count} frames: {READING}")));
    }
    match array.dtype().kind() {
        b'b' => {
            let bits = on_bytes(object)?;
            Ok(panels_of(bits.as_array().iter().map(|&on| on != 0)))
        }
        b'f' => {
            // Converts soft values of any width and byte order.
            let soft = object.call_method1("astype", ("float64",))?;
            let soft = soft.extract::<PyReadonlyArrayDyn<'_, f64>>()?;
            let soft = soft.as_array();
            if let Some(place) = soft.iter().position(|value| value.is_nan()) {
                return Err(refused(format!(
                    "the detector returned NaN for LED {} of frame {}: return a number for each LED, 0 if it is unknown",
                    place % LEDS,
                    first + (place / LEDS) as u64
                )));
            }
            Ok(panels_of(soft.iter().map(|&value| value > 0.0)))
        }
        _ => Err(PyTypeError::new_err(format!("{told}: {READING}"))),
    }
}

/// The panels of successive LEDs.
fn panels_of(leds: impl Iterator<Item = bool>) -> Vec<PanelFrame> {
    let leds: Vec<bool> = leds.collect();
    let bits = |leds: &[bool]| leds.iter().enumerate().fold(0, |bits, (led, &on)| bits | u64::from(on) << led);
    leds.chunks_exact(LEDS).map(|leds| PanelFrame::from_bits(bits(leds))).collect()
}

/// The LEDs of a panel, of shape (8, 8).
pub fn leds(py: Python<'_>, panel: PanelFrame) -> Py<PyArray2<bool>> {
    let leds = Array2::from_shape_fn((SIDE, SIDE), |(row, column)| panel.is_on(row, column));
    leds.into_pyarray(py).unbind()
}

/// The LEDs of panels, of shape (n, 8, 8).
pub fn all_leds(py: Python<'_>, panels: &[PanelFrame]) -> Py<PyArray3<bool>> {
    let leds = py.detach(|| Array3::from_shape_fn((panels.len(), SIDE, SIDE), |(n, row, column)| panels[n].is_on(row, column)));
    leds.into_pyarray(py).unbind()
}

/// A value for each LED, of shape (8, 8).
pub fn of_leds(py: Python<'_>, values: [f32; LEDS]) -> Py<PyArray2<f32>> {
    let values = Array2::from_shape_fn((SIDE, SIDE), |(row, column)| values[SIDE * row + column]);
    values.into_pyarray(py).unbind()
}

/// Rows of numbers, of shape (N, M).
pub fn rows<T: numpy::Element + Copy, const N: usize, const M: usize>(py: Python<'_>, rows: [[T; M]; N]) -> Py<PyArray2<T>> {
    let rows = Array2::from_shape_fn((N, M), |(row, column)| rows[row][column]);
    rows.into_pyarray(py).unbind()
}
