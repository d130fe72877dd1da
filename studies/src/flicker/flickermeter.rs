//! The short-term flicker of a light, P_st^LM: the light flickermeter of IEC TR 61547-1.
//!
//! A lamp's light passes filters that model eye and brain, is squared, and is smoothed over 0.3 s. The percentiles of the result give one
//! number; at 1 half of all people see the flicker. The source for the report's equations (A.4) to (A.6) is the program that its authors
//! published with it (Beeckman, `light_flickermeter_metric_PstLM`, 2017); in print, (A.5) has a slip, 44 758 for 44.758. Here the filters
//! act on the Fourier series, exactly and without an initial transient.

use std::f64::consts::{PI, TAU};

use super::Light;
use super::light::transform;

const HIGH_PASS_HZ: f64 = 0.05;
/// The Butterworth low-pass filter of sixth order, Hz (A.4).
const LOW_PASS_HZ: f64 = 35.0;
/// The filter of eye and brain, from s⁴ down (A.5).
const EYE_NUMERATOR: [f64; 5] = [0.041_661, 44.758, 2715.6, 29_839.0, 0.0];
const EYE_DENOMINATOR: [f64; 5] = [1.0, 196.32, 11_781.0, 534_820.0, 3_505_380.0];
/// The factor that scales the threshold to 1 (A.6).
const SCALE: f64 = 1.101_603_155_420_234e6;
/// The time constant of the smoothing, s.
const SMOOTHED_S: f64 = 0.3;
/// The highest frequency in use: the filters leave 2e-6 of lines above.
const HIGHEST_HZ: f64 = 200.0;
/// Samples a second, at least, because squares of lines go up to 400 Hz.
const SAMPLED_HZ: f64 = 1000.0;
/// Time constants of the smoothing until its initial state has decayed (count).
const FORGOTTEN: f64 = 30.0;
/// Shares of time in which the level is exceeded, %, with their weights under the square root (IEC 61000-4-15, 5.7.2).
const EXCEEDED: [(&[f64], f64); 5] = [
    (&[0.1], 0.0314),
    (&[0.7, 1.0, 1.5], 0.0525),
    (&[2.2, 3.0, 4.0], 0.0657),
    (&[6.0, 8.0, 10.0, 13.0, 17.0], 0.28),
    (&[30.0, 50.0, 80.0], 0.08),
];

/// P_st^LM of a light at a symbol rate in Hz.
///
/// ```
/// use studies::flicker::{Light, short_term};
/// // A lamp that sways by 0.4 % in squares of 8.8 Hz is just about seen to do so; 4 % are ten times as much.
/// let swaying = |part: f64| short_term(&Light::still(&[1.0 + part, 1.0 - part]), 2.0 * 8.8);
/// assert!((0.7..1.4).contains(&swaying(0.004)));
/// assert!((swaying(0.04) / swaying(0.004) - 10.0).abs() < 1e-6);
/// ```
pub fn short_term(light: &Light, rate_hz: f64) -> f64 {
    let period_s = light.period() as f64 / rate_hz;
    if light.period() == 0 {
        return 0.0;
    }
    let samples = (SAMPLED_HZ * period_s).max(1.0) as usize;
    let samples = samples.next_power_of_two();
    let lines = 1..=(HIGHEST_HZ * period_s) as usize;
    let seen = |line| match lines.contains(&line) {
        true => times(light.amplitude(line), filters(line as f64 / period_s)).into(),
        false => (0.0, 0.0),
    };
    let (re, im): (Vec<f64>, Vec<f64>) = (0..samples).map(seen).unzip();
    // The series, from the transforms of its real and imaginary parts.
    let [re, im] = [re, im].map(|parts| transform(&parts));
    let squares: Vec<f64> = re.iter().zip(&im).map(|([a, _], [_, b])| SCALE * (a + b).powi(2)).collect();
    severity(smoothed(&squares, period_s / samples as f64))
}

/// A first-order low-pass filter of a periodic series (bilinear), in its steady state.
fn smoothed(series: &[f64], step_s: f64) -> Vec<f64> {
    let share = step_s / (2.0 * SMOOTHED_S + step_s);
    let kept = (2.0 * SMOOTHED_S - step_s) / (2.0 * SMOOTHED_S + step_s);
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let (mut last, mut level) = (series[series.len() - 1], mean);
    let periods = (FORGOTTEN * SMOOTHED_S / (step_s * series.len() as f64)).ceil() as usize;
    let mut settled = Vec::new();
    for _ in 0..=periods {
        settled = series
            .iter()
            .map(|&value| {
                level = kept * level + share * (value + last);
                last = value;
                level
            })
            .collect();
    }
    settled
}

/// The severity from the levels' percentiles.
fn severity(mut levels: Vec<f64>) -> f64 {
    levels.sort_by(|a, b| b.total_cmp(a));
    let exceeded = |percent: &f64| levels[((percent / 100.0 * levels.len() as f64) as usize).min(levels.len() - 1)];
    let parts = EXCEEDED.map(|(percents, weight)| weight * percents.iter().map(exceeded).sum::<f64>() / percents.len() as f64);
    parts.iter().sum::<f64>().sqrt()
}

/// The response of all filters at a frequency in Hz.
fn filters(hz: f64) -> [f64; 2] {
    let high_pass = over([0.0, hz], [HIGH_PASS_HZ, hz]);
    let relative = hz / LOW_PASS_HZ;
    let low_pass = [1.0, 3.0, 5.0].into_iter().fold([1.0, 0.0], |passed, twelfth: f64| {
        let damping = 2.0 * (twelfth * PI / 12.0).cos();
        over(passed, [1.0 - relative * relative, damping * relative])
    });
    let at = |polynomial: [f64; 5]| {
        let s = [0.0, TAU * hz];
        polynomial.into_iter().fold([0.0; 2], |sum, factor| {
            let [re, im] = times(sum, s);
            [re + factor, im]
        })
    };
    times(times(high_pass, low_pass), over(at(EYE_NUMERATOR), at(EYE_DENOMINATOR)))
}

/// The product of complex numbers.
fn times([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}

/// The quotient of complex numbers.
fn over(one: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    let square = c * c + d * d;
    times(one, [c / square, -d / square])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the report's own algorithm in the time domain, with SciPy, of 200 s at 4000 samples a second.
    #[test]
    fn what_it_says_is_what_the_published_meter_says() {
        let bits = [1, 0, 0, 1, 1, 1, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0];
        let swaying = |part: f64, signs: &[f64]| signs.iter().map(|sign| 1.0 + part * sign).collect::<Vec<_>>();
        let sequence: Vec<f64> = bits.iter().map(|&bit| f64::from(2 * bit - 1)).collect();
        for (light, rate_hz, published) in [
            (swaying(0.004, &[1.0, -1.0]), 2.0 * 8.8, 1.1709),
            (swaying(0.01, &[1.0, -1.0]), 2.0 * 0.325, 0.7880),
            (swaying(0.02, &[1.0, -1.0]), 2.0 * 33.3, 2.0097),
            (swaying(0.01, &sequence), 20.0, 2.3939),
        ] {
            let found = short_term(&Light::still(&light), rate_hz);
            assert!((found / published - 1.0).abs() < 0.01, "{found} against {published}");
        }
    }

    #[test]
    fn a_steady_light_and_none_do_not_flicker() {
        for light in [vec![], vec![0.0; 3], vec![1.0; 5]] {
            assert!(short_term(&Light::still(&light), 90.0) < 1e-9, "{light:?}");
        }
    }
}
