//! The values of scene keys beyond numbers, words and paths.

use serde::{Deserialize, Serialize};

/// The shape of a blur.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Psf {
    /// A Gaussian (Do & Yoo 2020, Eqs. 14 and 15).
    #[default]
    Gauss,
    /// A disc, as of a lens out of focus: its radius is twice the standard deviation.
    Disc,
}

/// A camera's curve from light to grey levels: see [`crate::camera::curve`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// grey = 118·x^(1/γ) (Do & Yoo 2020, Eq. 11).
    #[default]
    Gamma,
    /// In proportion to light.
    Linear,
    /// IEC 61966-2-1.
    Srgb,
    /// ITU-R BT.709.
    Rec709,
    /// The gamma curve, bent from grey 150 on so that bright areas clip later.
    Shoulder,
}

impl Encoding {
    /// Their names in scenes.
    pub const NAMES: [&'static str; 5] = ["gamma", "linear", "srgb", "rec709", "shoulder"];
}

/// Some of a panel's LEDs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Leds {
    /// A number of LEDs, 0 to 64, selected by the panel's seed.
    Count(u8),
    /// LEDs by number, 8·row + column.
    List(Vec<u8>),
}

/// The LED-to-ambient ratio: a number, or looked up in the transmitter's table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum L2a {
    /// The ratio L/(E·R) itself; a transmitter is limited to [`L2A_MIN`](link::l2a_table::L2A_MIN) to
    /// [`L2A_MAX`](link::l2a_table::L2A_MAX).
    Ratio(f64),
    /// `"table"`: the ratio of `link.table`'s table, or of the transmitter's own without one.
    Table(TableWord),
}

/// The word `table`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableWord {
    /// Look the ratio up.
    Table,
}

/// The ratio of an On LED's light to an Off one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Contrast {
    /// 1 + π·r, by the exposures of Do & Yoo 2020, Eqs. (12) and (13).
    Exposure,
    /// 1 + r, as their Eq. (10) is printed.
    Eq10,
}

impl Contrast {
    /// The ratio of On to Off luminous exposure at the ratio `l2a`.
    ///
    /// ```
    /// use sim::scene::Contrast;
    /// assert_eq!(Contrast::Eq10.on_over_off(2.0), 3.0);
    /// assert!((Contrast::Exposure.on_over_off(2.0) - 7.2832).abs() < 1e-4);
    /// ```
    pub fn on_over_off(self, l2a: f64) -> f64 {
        match self {
            Self::Exposure => 1.0 + std::f64::consts::PI * l2a,
            Self::Eq10 => 1.0 + l2a,
        }
    }
}

/// Whether an effect is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// If leaving it out could change a pixel by more than the tolerance.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}
