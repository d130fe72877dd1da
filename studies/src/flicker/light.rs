//! A light that repeats, as its Fourier series.

use std::f64::consts::{PI, TAU};

use link::panel::{LEDS, PanelFrame};
use link::waveform::Waveform;

/// A light that is switched symbol by symbol, with a period in symbols.
///
/// Over its mean it is 1 + Σ Re a(k)·exp(2πi·k·t/P) at a time t, in symbols since the middle of the first of P:
///
/// ```text
/// a(k) = 2·X(k)/X(0) · sinc(ν)                                        panels that stand still; ν = k/P cycles a symbol
/// a(k) = 2·B(k)/P · (sinc(ν/n) − sinc(ν/2n)) · sin(πν)/(n·sin(πν/n))   a carrier of n cycles a symbol
/// ```
///
/// where X is the transform of the symbols' light, and B that of their signs: −1 with all LEDs Off, 1 with all On. The last factor is the
/// transform of a symbol: a held one, or n cycles that start in the middle of a half.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// X or B.
    bins: Vec<[f64; 2]>,
    /// X(0) or P.
    mean: f64,
    waveform: Waveform,
    /// The longest run of light above its mean, or below, in symbols.
    longest_run: f64,
}

impl Light {
    /// A light with held symbols, in any unit.
    pub fn still(symbols: &[f64]) -> Self {
        let bins = transform(symbols);
        let mean = bins.first().map_or(0.0, |bin| bin[0]);
        let above: Vec<f64> = symbols.iter().map(|light| light - mean / symbols.len() as f64).collect();
        Self {
            longest_run: longest_run(&above) as f64,
            bins,
            mean,
            waveform: Waveform::STILL,
        }
    }

    /// A light with a waveform. With a carrier its average is half of `full`, the light of all LEDs, for any symbols.
    pub fn of(symbols: &[f64], full: f64, waveform: Waveform) -> Self {
        if waveform.is_still() {
            return Self::still(symbols);
        }
        let signs: Vec<f64> = symbols.iter().map(|light| 2.0 * light / full - 1.0).collect();
        let says = signs.iter().any(|&sign| sign != 0.0);
        Self {
            // Runs last half a cycle within a symbol, and at most that at its ends.
            longest_run: if says { 0.5 / f64::from(waveform.cycles()) } else { 0.0 },
            bins: transform(&signs),
            mean: symbols.len() as f64,
            waveform,
        }
    }

    /// The light of an LED of panels that repeat.
    pub fn of_led(panels: &[PanelFrame], led: usize, waveform: Waveform) -> Self {
        let symbols: Vec<f64> = panels.iter().map(|panel| f64::from(panel.led(led))).collect();
        Self::of(&symbols, 1.0, waveform)
    }

    /// The light of all LEDs of panels that repeat.
    pub fn of_panel(panels: &[PanelFrame], waveform: Waveform) -> Self {
        let counts: Vec<f64> = panels.iter().map(|panel| f64::from(panel.count_on())).collect();
        Self::of(&counts, LEDS as f64, waveform)
    }

    /// Symbols of a period.
    pub fn period(&self) -> usize {
        self.bins.len()
    }

    /// The longest flicker period, in symbols: twice the longest time for which the light stays above its mean, or below; 0 for a steady
    /// one.
    ///
    /// IEEE Std 802.15.7 calls the longest invisible period of change the maximum flickering time period, and 5 ms of it, 200 Hz, safe
    /// (quoted in Sensors 2016, 16(3), 418, section 4.1).
    ///
    /// ```
    /// use link::waveform::Waveform;
    /// use studies::flicker::Light;
    /// assert_eq!(Light::still(&[1.0, 1.0, 1.0, 0.0]).longest_period(), 6.0);
    /// let carrier = Waveform::new(16)?;
    /// assert_eq!(Light::of(&[1.0, 1.0, 1.0, 0.0], 1.0, carrier).longest_period(), 1.0 / 16.0);
    /// # Ok::<(), link::waveform::WaveformError>(())
    /// ```
    pub fn longest_period(&self) -> f64 {
        2.0 * self.longest_run
    }

    /// a(k): real and imaginary part.
    pub(super) fn amplitude(&self, line: usize) -> [f64; 2] {
        match self.bins.get(line % self.period().max(1)) {
            Some(bin) if self.mean > 0.0 => bin.map(|part| 2.0 * part / self.mean * self.shape(line)),
            _ => [0.0; 2],
        }
    }

    /// |a(k)|, %.
    pub(super) fn amplitude_percent(&self, line: usize) -> f64 {
        let period = self.period();
        if self.mean <= 0.0 || period == 0 {
            return 0.0;
        }
        // The transform is periodic and symmetric.
        let bin = line % period;
        let bin = bin.min(period - bin);
        200.0 * self.bins[bin][0].hypot(self.bins[bin][1]) / self.mean * self.shape(line).abs()
    }

    /// The transform of a symbol at k cycles a period, real about its middle.
    fn shape(&self, line: usize) -> f64 {
        let period = self.period();
        let cycles = f64::from(self.waveform.cycles());
        let is_whole = line.is_multiple_of(period);
        let angle = PI * line as f64 / period as f64;
        if self.waveform.is_still() {
            // Multiples of the symbol rate do not affect a held symbol.
            return if is_whole { 0.0 } else { angle.sin() / angle };
        }
        let of_cycle = sinc(angle / cycles) - sinc(angle / (2.0 * cycles));
        let times = match line / period {
            count if is_whole && count.is_multiple_of(self.waveform.cycles().into()) => angle.cos() / (angle / cycles).cos(),
            _ if is_whole => 0.0,
            _ => angle.sin() / (cycles * (angle / cycles).sin()),
        };
        of_cycle * times
    }

    /// The highest line in use, in cycles a symbol.
    pub(super) fn highest_cycles(&self) -> f64 {
        match self.waveform.cycles() {
            0 => super::HIGHEST_CYCLES,
            cycles => super::HIGHEST_CARRIERS * f64::from(cycles),
        }
    }
}

fn sinc(angle: f64) -> f64 {
    if angle == 0.0 { 1.0 } else { angle.sin() / angle }
}

/// The longest run of one sign in a periodic series.
fn longest_run(series: &[f64]) -> usize {
    let sign = |value: &f64| (*value > 0.0, *value < 0.0);
    let (mut run, mut longest, mut last) = (0, 0, (false, false));
    for value in series.iter().chain(series) {
        let now = sign(value);
        run = if now == last { run + 1 } else { 1 };
        last = now;
        if now.0 || now.1 {
            longest = longest.max(run);
        }
    }
    longest
}

/// The greatest error of [`transform`], relative to the sum of all absolute values.
#[cfg(test)]
const TRANSFORM_ERROR: f64 = 1e-14;

/// The discrete Fourier transform of `values`: real and imaginary parts.
pub(super) fn transform(values: &[f64]) -> Vec<[f64; 2]> {
    let length = values.len();
    let root = |k: usize| {
        let (sin, cos) = (-TAU * k as f64 / length as f64).sin_cos();
        [cos, sin]
    };
    let roots: Vec<[f64; 2]> = (0..length).map(root).collect();
    decimated(values, 1, &roots)
}

/// The transform of every `stride`-th of `values`, which divides their number, by as many parts as its least factor (Cooley & Tukey 1965).
fn decimated(values: &[f64], stride: usize, roots: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let length = roots.len() / stride;
    let Some(factor) = (2..=length).find(|factor| length.is_multiple_of(*factor)) else {
        return values.first().map(|&value| [value, 0.0]).into_iter().collect();
    };
    let parts: Vec<_> = (0..factor)
        .map(|part| decimated(&values[part * stride..], factor * stride, roots))
        .collect();
    let bin = |k: usize| {
        // The root of part · k is periodic.
        let (at, mut root) = (k % (length / factor), 0);
        parts.iter().fold([0.0; 2], |[re, im], bins| {
            let [[x, y], [cos, sin]] = [bins[at], roots[root * stride]];
            root += k;
            if root >= length {
                root -= length;
            }
            [re + x * cos - y * sin, im + x * sin + y * cos]
        })
    };
    (0..length).map(bin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_transform_is_that_of_its_definition() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for length in [1, 2, 3, 4, 6, 7, 30, 64, 97, 180, 1001, 1024] {
            let values: Vec<f64> = (0..length).map(|_| f64::from(random.next_u32() % 65)).collect();
            let total: f64 = values.iter().sum();
            let bins = transform(&values);
            assert_eq!(bins.len(), length);
            for (k, &[re, im]) in bins.iter().enumerate() {
                let angle = |n: usize| TAU * (n * k % length) as f64 / length as f64;
                let by = |of: fn(f64) -> f64| -> f64 { values.iter().enumerate().map(|(n, value)| value * of(angle(n))).sum() };
                let error = (re - by(f64::cos)).hypot(im + by(f64::sin));
                assert!(error <= TRANSFORM_ERROR * total, "{length}: bin {k} by {}", error / total);
            }
        }
    }
}
