//! A model of automatic exposure.

/// An automatic exposure (Do & Yoo 2020, Table 1): the longest time until the ISO speed is at its minimum, then in inverse proportion to
/// the light.
///
/// ```
/// use link::exposure::AutoExposure;
/// let camera = AutoExposure { longest_s: 0.001, iso_min: 100.0, iso_max: 51_200.0 };
/// // What counts is time × ISO speed: ten times 0.001 s at ISO 100, then a tenth of it.
/// assert_eq!(camera.time_and_iso(1.0), (0.001, 1000.0));
/// assert_eq!(camera.time_and_iso(0.01), (0.0001, 100.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoExposure {
    /// The longest time, s.
    pub longest_s: f64,
    /// The least ISO speed.
    pub iso_min: f64,
    /// The greatest ISO speed.
    pub iso_max: f64,
}

impl AutoExposure {
    /// The time, s, and the ISO speed whose product is closest to `wanted_s`.
    pub fn time_and_iso(&self, wanted_s: f64) -> (f64, f64) {
        let iso = (wanted_s / self.longest_s).max(self.iso_min).min(self.iso_max);
        ((wanted_s / iso).min(self.longest_s), iso)
    }
}
