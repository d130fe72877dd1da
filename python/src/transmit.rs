//! The panels that the transmitter shows.

use link::fec::Code;
use link::framing::Framer;
use link::panel::PanelFrame;
use link::raw;
use numpy::PyArray3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyString};

use crate::arrays;
use crate::errors::{check, refused};

/// Maximum number of panels at a time: 1 GB.
const COUNT_MAX: usize = 1 << 24;

/// The successive panels of a message: a bool array of shape (n, 8, 8), as `vocc transmit` prints them.
///
/// `message` is a str or bytes, 1 to 1024 bytes long. The panels show it once, or repeat it up to `count` panels. `raw` sends 64 bits of
/// payload per panel, without framing or error correction, as the paper does.
///
/// Raises VoccError if the message is empty or too long.
///
/// >>> import vocc
/// >>> vocc.transmit("Ice on the bridge").shape
/// (10, 8, 8)
/// >>> vocc.as_hex(vocc.transmit("Ice")[0])
/// '9936c96cb24d6693'
#[pyfunction]
#[pyo3(signature = (message, *, count=None, raw=false))]
pub fn transmit(py: Python<'_>, message: &Bound<'_, PyAny>, count: Option<usize>, raw: bool) -> PyResult<Py<PyArray3<bool>>> {
    let message: Vec<u8> = if let Ok(text) = message.cast::<PyString>() {
        text.to_cow()?.as_bytes().to_vec()
    } else if let Ok(bytes) = message.cast::<PyBytes>() {
        bytes.as_bytes().to_vec()
    } else {
        let kind = message.get_type().name()?;
        return Err(PyTypeError::new_err(format!("a message is a str or bytes; this is of type {kind}")));
    };
    if let Some(count) = count.filter(|&count| count > COUNT_MAX) {
        return Err(refused(format!("count = {count}: give 0 to {COUNT_MAX} panels")));
    }
    // Its error states the allowed lengths, also for `raw`.
    let framer = Framer::new(&message, Code::for_length(message.len()), false);
    let mut framer = check(framer)?;
    let panels: Vec<PanelFrame> = py.detach(|| {
        if raw {
            let once = raw::panels(&message);
            let count = count.unwrap_or(once.len());
            let once: Vec<PanelFrame> = once.collect();
            once.into_iter().cycle().take(count).collect()
        } else {
            let count = count.unwrap_or_else(|| framer.panels_per_repeat() as usize);
            (0..count).map(|_| framer.next_panel()).collect()
        }
    });
    Ok(arrays::all_leds(py, &panels))
}

/// The 16 hexadecimal digits of a panel, bit 8*row + column, as the command line prints them.
///
/// >>> import vocc
/// >>> vocc.as_hex(1 << 63)
/// '8000000000000000'
#[pyfunction]
pub fn as_hex(bits: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(arrays::panel(bits)?.to_string())
}

/// The LEDs of a panel as a bool array of shape (8, 8), from an int or 16 hexadecimal digits.
///
/// >>> import vocc
/// >>> vocc.as_bits("8040201008040201").diagonal().all()
/// np.True_
#[pyfunction]
pub fn as_bits<'py>(bits: &Bound<'py, PyAny>) -> PyResult<Py<numpy::PyArray2<bool>>> {
    Ok(arrays::leds(bits.py(), arrays::panel(bits)?))
}
