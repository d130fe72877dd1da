//! The panels that the transmitter shows.

use std::path::PathBuf;

use link::fec::Code;
use link::framing::{Framer, SignedFramer};
use link::panel::PanelFrame;
use link::raw;
use link::symbol_rate::SymbolRate;
use link::waveform::Waveform;
use numpy::PyArray3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyString};
use reception::keys::{OwnKey, counter_now};
use studies::flicker::panels;

use crate::arrays;
use crate::errors::{check, refused};
use crate::record::record;

/// Maximum number of panels at a time: 1 GB.
const COUNT_MAX: usize = 1 << 24;

/// The successive panels of a message: a bool array of shape (n, 8, 8), as `vocc transmit` prints them.
///
/// `message` is a str or bytes, 1 to 1024 bytes long. The panels show it once, or repeat it up to `count` panels. `raw` sends 64 bits of
/// payload per panel, without framing or error correction, as the paper does.
///
/// `sign` is the path of a private key that `vocc keys new` made: its signature is shown after each repeat of the message. `counter` must
/// rise with each message of a key; by default it is the number of seconds since 1970.
///
/// Raises VoccError if the message is empty or too long, or if the file holds no private key.
///
/// >>> import vocc
/// >>> vocc.transmit("Ice on the bridge").shape
/// (10, 8, 8)
/// >>> vocc.as_hex(vocc.transmit("Ice")[0])
/// '9936c96cb24d6693'
#[pyfunction]
#[pyo3(signature = (message, *, count=None, raw=false, sign=None, counter=None))]
pub fn transmit(
    py: Python<'_>,
    message: &Bound<'_, PyAny>,
    count: Option<usize>,
    raw: bool,
    sign: Option<PathBuf>,
    counter: Option<u32>,
) -> PyResult<Py<PyArray3<bool>>> {
    let message = bytes_of(message)?;
    if let Some(count) = count.filter(|&count| count > COUNT_MAX) {
        return Err(refused(format!("count = {count}: give 0 to {COUNT_MAX} panels")));
    }
    // Its error states the allowed lengths, also for `raw`.
    let code = Code::for_length(message.len());
    let mut framer = check(Framer::new(&message, code, false))?;
    if let Some(path) = sign {
        if raw {
            return Err(refused("raw panels have no signature: leave out raw or sign"));
        }
        let key = check(OwnKey::read(&path))?;
        let counter = check(counter.or_else(counter_now).ok_or("this computer's clock is not set: give counter"))?;
        let mut framer = check(SignedFramer::new(&message, code, false, key.sign(&message, counter)))?;
        let count = count.unwrap_or_else(|| framer.panels_per_repeat() as usize);
        let panels: Vec<PanelFrame> = py.detach(|| (0..count).map(|_| framer.next_panel()).collect());
        return Ok(arrays::all_leds(py, &panels));
    }
    if counter.is_some() {
        return Err(refused("counter belongs to a signature: give sign, the path of a private key"));
    }
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

fn bytes_of(message: &Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    if let Ok(text) = message.cast::<PyString>() {
        return Ok(text.to_cow()?.as_bytes().to_vec());
    }
    if let Ok(bytes) = message.cast::<PyBytes>() {
        return Ok(bytes.as_bytes().to_vec());
    }
    let kind = message.get_type().name()?;
    Err(PyTypeError::new_err(format!("a message is a str or bytes; this is of type {kind}")))
}

record! {
    /// The flicker of a panel's light.
    Flicker {
        /// Symbols a second.
        symbol_rate_hz: f64,
        /// Cycles of the carrier a symbol, 0 for still panels.
        carrier_cycles: u16,
        /// The carrier's frequency, 0 for still panels.
        carrier_hz: f64,
        /// The greatest modulation, of any LED and of all together, relative to the limit of low risk of IEEE Std 1789-2015. Up to 1, the
        /// practice is met at every frequency.
        low_risk_times: f64,
        /// The longest flicker period of the worst LED, in seconds. IEEE Std 802.15.7 allows 0.005.
        longest_period_s: f64,
        /// P_st^LM of the worst LED (IEC TR 61547-1): at 1, half of all people see flicker.
        pst_lm: f64,
        /// SVM of the worst LED (CIE TN 006): at 1, half of all people see moving objects in steps.
        svm: f64,
    }
}

/// The flicker of a panel that shows a message again and again, or beacons without one, as `vocc transmit --flicker` computes it.
///
/// `carrier_cycles` is as `link.carrier_cycles` of a scene: cycles of the carrier a symbol, 0 for still panels.
///
/// Raises VoccError if the message is empty or too long, or if no transmitter shows such a carrier.
///
/// >>> import vocc
/// >>> flicker = vocc.flicker("Ice on the bridge", carrier_cycles=16)
/// >>> flicker.carrier_hz, flicker.low_risk_times < 1
/// (1440.0, True)
/// >>> flicker.longest_period_s < 0.005, flicker.pst_lm < 1, flicker.svm < 1
/// (True, True, True)
/// >>> vocc.flicker("Ice on the bridge").low_risk_times > 100
/// True
#[pyfunction]
#[pyo3(signature = (message=None, *, symbol_rate_hz=90.0, carrier_cycles=0))]
pub fn flicker(py: Python<'_>, message: Option<&Bound<'_, PyAny>>, symbol_rate_hz: f64, carrier_cycles: u32) -> PyResult<Flicker> {
    let message = message.map(bytes_of).transpose()?;
    let panels = check(panels(message.as_deref()))?;
    let rate = check(SymbolRate::from_hz(symbol_rate_hz))?;
    let waveform = check(Waveform::new(carrier_cycles))?;
    let carrier_hz = check(waveform.carrier_hz(rate.hz()))?;
    let (low_risk_times, measures) = py.detach(|| {
        let light = studies::flicker::Flicker::with_waveform(&panels, waveform);
        (light.low_risk_times(rate.hz()), light.worst_led_measures(rate.hz()))
    });
    Ok(Flicker {
        symbol_rate_hz: rate.hz(),
        carrier_cycles: waveform.cycles(),
        carrier_hz,
        low_risk_times,
        longest_period_s: measures.longest_period_s,
        pst_lm: measures.short_term,
        svm: measures.stroboscopic,
    })
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
