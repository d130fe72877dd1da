//! How well the steps are seen in which a modulated light shows what moves: the stroboscopic visibility measure SVM of CIE TN 006:2016.
//!
//! ```text
//! SVM = (Σ (C/T)^3.7)^(1/3.7)        over components from 80 to 2000 Hz
//! T(f) = 1/(1 + exp(−0.00518·(f − 306.6))) + 20·exp(−f/10)
//! ```
//!
//! C is the amplitude of a component over the mean light, T the least that is seen as a sine; at 1 half of all people see it, in an
//! office and of things that move at up to 4 m/s. Known here by quotations, and by the program of Signify's that belongs to
//! IEC TR 63158, in which a measurement takes 1 s at least. So lines nearer together than 1 Hz are one component here.

use super::Light;

/// Components below and above are left out, Hz.
const COUNTED_HZ: [f64; 2] = [80.0, 2000.0];
/// The exponent by which components add up.
const EXPONENT: f64 = 3.7;
/// The width of a component, Hz.
const COMPONENT_HZ: f64 = 1.0;

/// The least amplitude over the mean light at which the stroboscopic effect of a sine is seen.
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
