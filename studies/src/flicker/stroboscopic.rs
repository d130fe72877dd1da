//! The visibility of moving objects as steps in a modulated light: the stroboscopic visibility measure SVM of CIE TN 006:2016.
//!
//! ```text
//! SVM = (Σ (C/T)^3.7)^(1/3.7)        over components from 80 to 2000 Hz
//! T(f) = 1/(1 + exp(−0.00518·(f − 306.6))) + 20·exp(−f/10)
//! ```
//!
//! C is the amplitude of a component over the mean light, T the visibility threshold of a sine. At 1 half of all people see the effect, in
//! an office and on objects that move at up to 4 m/s. The sources are quotations, and the program by Signify for IEC TR 63158, in which a
//! measurement takes at least 1 s. So lines closer than 1 Hz count as one component here.

use super::Light;

/// The range of components in use, Hz.
const COUNTED_HZ: [f64; 2] = [80.0, 2000.0];
/// The exponent by which components add up.
const EXPONENT: f64 = 3.7;
/// The width of a component, Hz.
const COMPONENT_HZ: f64 = 1.0;

/// The least visible amplitude of a sine over the mean light.
fn threshold(hz: f64) -> f64 {
    1.0 / (1.0 + (-0.005_18 * (hz - 306.6)).exp()) + 20.0 * (-hz / 10.0).exp()
}

/// SVM of a light at a symbol rate in Hz.
///
/// ```
/// use studies::flicker::{Light, stroboscopic};
/// // On and Off 1440 times a second: the fundamental, 4/π, counts alone.
/// let square = stroboscopic(&Light::still(&[1.0, 0.0]), 2.0 * 1440.0);
/// assert!((square - 1.28).abs() < 0.005);
/// // Above 2000 Hz nothing is counted.
/// assert_eq!(stroboscopic(&Light::still(&[1.0, 0.0]), 2.0 * 2001.0), 0.0);
/// ```
pub fn stroboscopic(light: &Light, rate_hz: f64) -> f64 {
    let period = light.period() as f64;
    let line_of = |hz: f64| hz * period / rate_hz;
    let [first, last] = COUNTED_HZ.map(line_of);
    let (mut sum, mut component) = (0.0, (0.0, 0.0));
    let add = |(place, power): (f64, f64)| (power.sqrt() / threshold(place * COMPONENT_HZ)).powf(EXPONENT);
    for line in first.ceil() as usize..=last as usize {
        let place = (line as f64 * rate_hz / (period * COMPONENT_HZ)).round();
        let [re, im] = light.amplitude(line);
        let power = re * re + im * im;
        if place == component.0 {
            component.1 += power;
        } else {
            sum += add(component);
            component = (place, power);
        }
    }
    (sum + add(component)).powf(EXPONENT.recip())
}
