//! Conversion between light and grey levels.

use core::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::MIDDLE_GREY;

/// A camera's curve from light to grey levels.
///
/// Light is relative: 1 at grey [`MIDDLE_GREY`] for every curve. In a file it is `"srgb"`, `"rec709"` or `{ gamma = 2.2 }`.
///
/// ```
/// use link::camera::Encoding;
///
/// assert_eq!(Encoding::LINEAR.light(236.0), 2.0);
/// let grey = Encoding::Srgb.grey(0.25);
/// assert!((Encoding::Srgb.light(grey) - 0.25).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// grey = 118·light^(1/γ), γ from 1 to 4 (Do & Yoo 2020, Eq. 11).
    Gamma(f32),
    /// IEC 61966-2-1: most photographs.
    Srgb,
    /// ITU-R BT.709: most video.
    Rec709,
}

impl Default for Encoding {
    /// γ = 2.2.
    fn default() -> Self {
        Self::Gamma(Self::USUAL_GAMMA as f32)
    }
}

impl Encoding {
    /// Grey levels in proportion to light.
    pub const LINEAR: Self = Self::Gamma(1.0);
    /// The default γ, before it is rounded to f32.
    pub const USUAL_GAMMA: f64 = 2.2;
    /// The range of γ.
    pub const GAMMA: RangeInclusive<f32> = 1.0..=4.0;

    /// The nearest γ in range; NaN becomes the minimum.
    pub(super) fn clamped(self) -> Self {
        match self {
            Self::Gamma(gamma) => Self::Gamma(gamma.max(*Self::GAMMA.start()).min(*Self::GAMMA.end())),
            other => other,
        }
    }
}

/// A gamma curve with a straight foot: c = slope·l up to `foot` (a value of c), and above it c = (1 + lift)·l^(1/exponent) − lift. Light l
/// and level c are both 1 at white.
struct Footed<F> {
    slope: F,
    foot: F,
    lift: F,
    exponent: F,
}

macro_rules! curves {
    ($light:ident, $grey:ident, $float:ty, $pow:path) => {
        impl Footed<$float> {
            fn $light(&self, level: $float) -> $float {
                if level <= self.foot {
                    level / self.slope
                } else {
                    $pow((level + self.lift) / (1.0 + self.lift), self.exponent)
                }
            }

            fn $grey(&self, light: $float) -> $float {
                if light * self.slope <= self.foot {
                    light * self.slope
                } else {
                    (1.0 + self.lift) * $pow(light, 1.0 / self.exponent) - self.lift
                }
            }
        }

        impl Encoding {
            /// The light of a grey level; 0 below 0.
            pub fn $light(self, grey: $float) -> $float {
                const MIDDLE: $float = MIDDLE_GREY as $float;
                let grey = grey.max(0.0);
                let footed = match self {
                    Self::Gamma(gamma) => return $pow(grey / MIDDLE, gamma.into()),
                    Self::Srgb => SRGB,
                    Self::Rec709 => REC_709,
                };
                let footed = footed.map(|c| c as $float);
                footed.$light(grey / 255.0) / footed.$light(MIDDLE / 255.0)
            }

            /// The grey level of light, neither rounded nor clipped at white; 0 below 0.
            pub fn $grey(self, light: $float) -> $float {
                const MIDDLE: $float = MIDDLE_GREY as $float;
                let light = light.max(0.0);
                let footed = match self {
                    Self::Gamma(gamma) => {
                        return MIDDLE * $pow(light, 1.0 / <$float>::from(gamma));
                    }
                    Self::Srgb => SRGB,
                    Self::Rec709 => REC_709,
                };
                let footed = footed.map(|c| c as $float);
                255.0 * footed.$grey(light * footed.$light(MIDDLE / 255.0))
            }
        }
    };
}

curves!(light, grey, f32, libm::powf);
curves!(light_f64, grey_f64, f64, libm::pow);

impl<F> Footed<F> {
    fn map<T>(self, f: impl Fn(F) -> T) -> Footed<T> {
        Footed {
            slope: f(self.slope),
            foot: f(self.foot),
            lift: f(self.lift),
            exponent: f(self.exponent),
        }
    }
}

const SRGB: Footed<f64> = Footed {
    slope: 12.92,
    foot: 0.04045,
    lift: 0.055,
    exponent: 2.4,
};

const REC_709: Footed<f64> = Footed {
    slope: 4.5,
    foot: 0.081_242_858_298_635_13,
    lift: 0.099_296_826_809_442_94,
    exponent: 1.0 / 0.45,
};

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Encoding; 5] = [
        Encoding::LINEAR,
        Encoding::Gamma(2.2),
        Encoding::Gamma(4.0),
        Encoding::Srgb,
        Encoding::Rec709,
    ];

    #[test]
    fn light_and_grey_are_each_other_turned_round() {
        for encoding in ALL {
            assert!((encoding.light_f64(118.0) - 1.0).abs() < 1e-12);
            for grey in (0..=255).map(f64::from) {
                let light = encoding.light_f64(grey);
                // The feet of the standards' curves meet their arcs to four digits.
                assert!((encoding.grey_f64(light) - grey).abs() < 0.01, "{encoding:?} {grey}");
                let single = encoding.light(grey as f32);
                assert!((f64::from(single) - light).abs() <= 2e-6 * light + 1e-12);
                assert!((encoding.grey(single) - grey as f32).abs() < 0.011);
            }
            assert_eq!((encoding.light(-3.0), encoding.grey(-1.0)), (0.0, 0.0));
            assert_eq!(encoding.light(f32::NAN), 0.0);
        }
    }

    #[test]
    fn the_standards_values_come_out() {
        // IEC 61966-2-1: half of white is the level 188 of 255; BT.709: 0.5 is the level 0.7055.
        let white = |encoding: Encoding| encoding.light_f64(255.0);
        assert!((Encoding::Srgb.grey_f64(0.5 * white(Encoding::Srgb)) - 187.516).abs() < 1e-3);
        assert!((Encoding::Rec709.grey_f64(0.5 * white(Encoding::Rec709)) / 255.0 - 0.70552).abs() < 1e-4);
    }
}
