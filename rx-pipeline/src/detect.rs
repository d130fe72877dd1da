//! Features to bits: the On LEDs, and the certainty of each decision.
//!
//! | detector | looks at | needs | choose it |
//! |---|---|---|---|
//! | [`Detector::KMeans`] | AGR and GRI, each over its standard deviation in the panel | nothing | as the default |
//! | [`Detector::KMeansRaw`] | AGR and GRI as they are | nothing | to compare: GRI, in grey levels, swamps AGR |
//! | [`Detector::Otsu`] | the cells' mean grey | nothing | if LEDs are many pixels wide, or on the smallest processor |
//! | [`Detector::Fisher`] | AGR, GRI and, optionally, NGR | training | if frames with known bits are available |
//!
//! The first three use one panel alone, so it needs LEDs of both states: they would split a panel that is all On or all Off in two, too.
//! The panels of a scrambled message have both states.
//!
//! # Soft values
//!
//! The log-likelihood ratio of a bit follows from Gaussian classes of one covariance, Σ: with x the cell's features,
//! LLR = (μ_on − μ_off)ᵀ·Σ⁻¹·(x − (μ_on + μ_off)/2), without priors. Fisher learns μ and Σ in training. The others take
//! them from the panel itself, by the classes they have just found, in standardised features. To Σ they add
//! a hundredth of each feature's variance in the panel on its diagonal, so that a frame without noise has finite values.
//!
//! The model has limits. If the classes overlap, a split by the panel itself cuts their tails off, underestimates Σ, and so overstates how
//! sure the bits are. Blur correlates the errors of neighbouring cells, but they count as independent. And because Σ is not round, the
//! sign of a soft value may differ from k-means' bit close to the border.

mod detection;
mod discriminant;
mod error;
mod fisher;
mod kmeans;
mod otsu;
mod soft;
mod standardise;

#[cfg(feature = "carrier")]
pub use detection::Lights;
pub use detection::{Detection, Mixture};
pub use error::DetectError;
pub(crate) use error::MIN_CONTRAST_GREY;
pub use fisher::{Fisher, FisherError, FisherFeatures, FisherScaling, FisherTraining};
pub use otsu::otsu_threshold;

pub(crate) use detection::{bits_where, lit, wrong_bits};
#[cfg(feature = "carrier")]
pub(crate) use soft::limited_to;
pub(crate) use soft::{correlation, soft_panel};

use crate::features::Features;
use error::WHITE_CELLS_MAX;
use link::panel::PanelFrame;
use standardise::standardised;

/// A cell of a brighter mean is white, with some room for a codec's errors (grey). Higher: ripples of white are read as bits.
const WHITE_GREY: f32 = 248.0;

/// The classifier of On and Off.
///
/// ```
/// use rx_pipeline::{cells::CellMap, corners::Corners, detect::Detector, features::Features, frame::Frame};
/// let corners = Corners::new([[5.0, 5.0], [33.0, 5.0], [33.0, 33.0], [5.0, 33.0]])?;
/// let map = CellMap::<2048>::new(&corners, 40, 40)?;
/// let mut pixels = [118; 1600];
/// for row in [9, 25] {
///     pixels[40 * row + 13] = 200; // the third LED of the second and sixth row
/// }
/// let features = Features::measure(&Frame::new(&pixels, 40, 40)?, &map)?;
/// let detection = Detector::KMeans.detect(&features)?;
/// assert_eq!(detection.bits.bits(), 1 << (8 + 2) | 1 << (8 * 5 + 2));
/// assert!(detection.soft.0[10] > 0 && detection.soft.0[0] < 0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Detector {
    /// Two clusters in the plane of AGR and GRI, each divided by its standard deviation over the 64 cells, started from
    /// the cells of lowest and highest GRI.
    #[default]
    KMeans,
    /// The same without the division.
    KMeansRaw,
    /// The threshold on the cells' mean grey that separates the classes best (Otsu 1979).
    Otsu,
    /// Fisher's linear discriminant, trained beforehand.
    Fisher(Fisher),
}

/// How a panel is read: from its cells' features, or from its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Method {
    /// From AGR, GRI and NGR.
    Features(Detector),
    /// The bits of greatest likelihood, given the pixels.
    #[default]
    MaximumLikelihood,
}

impl From<Detector> for Method {
    fn from(detector: Detector) -> Self {
        Self::Features(detector)
    }
}

impl Detector {
    /// Reads the panel.
    ///
    /// # Errors
    /// As [`Detector::decide`].
    pub fn detect(&self, features: &Features) -> Result<Detection, DetectError> {
        let bits = self.decide(features)?;
        let llr = match self {
            Self::KMeans | Self::KMeansRaw => {
                let (agr, gri) = (standardised(&features.agr), standardised(&features.gri));
                let samples = core::array::from_fn(|cell| [agr[cell], gri[cell]]);
                discriminant::llr_by_split(&samples, bits)?
            }
            Self::Otsu => {
                let samples = standardised(&features.mean_grey).map(|grey| [grey]);
                discriminant::llr_by_split(&samples, bits)?
            }
            Self::Fisher(fisher) => fisher.llr(features),
        };
        Ok(Detection::new(bits, llr))
    }

    /// The panel's bits without soft values, in at most a third of the time of [`Detector::detect`].
    ///
    /// # Errors
    /// [`DetectError::ContrastTooLow`] if all cells look alike, [`DetectError::OneClass`] if they do so in the detector's features.
    #[inline(always)]
    pub fn decide(&self, features: &Features) -> Result<PanelFrame, DetectError> {
        check_contrast(features)?;
        match self {
            Self::KMeans => kmeans::split(&standardised(&features.agr), &standardised(&features.gri)),
            Self::KMeansRaw => kmeans::split(&features.agr, &features.gri),
            Self::Otsu => otsu::split(&features.mean_grey),
            Self::Fisher(fisher) => {
                let llr = fisher.llr(features);
                Ok(bits_where(|cell| llr[cell] > 0.0))
            }
        }
    }
}

fn check_contrast(features: &Features) -> Result<(), DetectError> {
    let grey = &features.mean_grey;
    let brightest = grey.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let darkest = grey.iter().copied().fold(f32::INFINITY, f32::min);
    let range_grey = brightest - darkest;
    if range_grey >= MIN_CONTRAST_GREY {
        Ok(())
    } else {
        Err(DetectError::ContrastTooLow { range_grey })
    }
}

/// Checks that not too many cells are white: among many white cells, an Off LED shows only ripples of its neighbours' light.
///
/// # Errors
/// [`DetectError::TooWhite`] if more are white.
pub fn check_white(features: &Features) -> Result<(), DetectError> {
    let is_white = |&&grey: &&f32| grey > WHITE_GREY;
    match features.mean_grey.iter().filter(is_white).count() {
        0..=WHITE_CELLS_MAX => Ok(()),
        white => Err(DetectError::TooWhite { white }),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use link::panel::LEDS;
    use properties::prelude::*;

    /// Features of a panel of `bits`, each On cell `contrast` times one standard deviation of noise above an Off one.
    pub(crate) fn features_of(bits: u64, contrast: f32, noise: &[[f32; 2]; LEDS]) -> Features {
        let level = |cell: usize| if bits >> cell & 1 == 1 { contrast } else { 0.0 };
        let mean_grey = core::array::from_fn(|cell| 120.0 + level(cell) + noise[cell][0]);
        let panel_grey = mean_grey.iter().sum::<f32>() / 64.0;
        Features {
            mean_grey,
            agr: mean_grey.map(|grey| grey / panel_grey),
            gri: core::array::from_fn(|cell| 2.0 * (level(cell) + noise[cell][1])),
            saturated: [0; 64],
            pixels: [20; 64],
            panel_grey,
        }
    }

    pub(crate) fn noise() -> impl Strategy<Value = [[f32; 2]; LEDS]> {
        prop::collection::vec(prop::array::uniform2(-1.0f32..1.0), LEDS).prop_map(|noise| noise.try_into().unwrap())
    }

    const UNTRAINED: [Detector; 3] = [Detector::KMeans, Detector::KMeansRaw, Detector::Otsu];

    #[test]
    fn panels_without_contrast_are_refused() {
        let flat = features_of(0, 0.0, &[[0.0; 2]; LEDS]);
        for detector in UNTRAINED {
            assert_eq!(detector.detect(&flat), Err(DetectError::ContrastTooLow { range_grey: 0.0 }));
        }
        let mut no_gradient = features_of(0xff, 10.0, &[[0.0; 2]; LEDS]);
        no_gradient.gri = [0.0; LEDS];
        for detector in UNTRAINED {
            assert_eq!(detector.detect(&no_gradient).unwrap().bits.bits(), 0xff);
        }
        let mut alike = no_gradient;
        alike.agr = [1.0; LEDS];
        assert_eq!(Detector::KMeans.detect(&alike), Err(DetectError::OneClass { on: 0 }));
    }

    #[test]
    fn panels_that_are_white_all_over_are_refused() {
        let mut white = features_of(0xff, 4.0, &[[0.0; 2]; LEDS]);
        white.mean_grey = white.mean_grey.map(|grey| grey + 130.0);
        let refused = Err(DetectError::TooWhite { white: LEDS });
        assert_eq!(check_white(&white), refused);
        white.mean_grey[..LEDS - WHITE_CELLS_MAX].fill(240.0);
        assert_eq!(check_white(&white), Ok(()));
    }

    #[test]
    fn panels_without_noise_have_finite_certainty() {
        for detector in UNTRAINED {
            let detection = detector.detect(&features_of(0x1234_5678, 30.0, &[[0.0; 2]; LEDS])).unwrap();
            assert_eq!(detection.bits.bits(), 0x1234_5678);
            assert_eq!(detection.soft.hard(), detection.bits);
            assert!(detection.confidence > 0.999 && detection.confidence <= 1.0);
        }
    }

    properties! {
        #[test]
        fn clear_panels_are_read(bits in 1u64..u64::MAX, noise in noise()) {
            for detector in UNTRAINED {
                let detection = detector.detect(&features_of(bits, 12.0, &noise)).unwrap();
                prop_assert_eq!(detection.bits.bits(), bits);
                prop_assert_eq!(detection.soft.hard().bits(), bits);
            }
        }

        #[test]
        fn nearer_classes_are_less_certain(bits: u64, noise in noise()) {
            prop_assume!((16..48).contains(&bits.count_ones()));
            for detector in UNTRAINED {
                let near = detector.detect(&features_of(bits, 4.0, &noise)).unwrap();
                let far = detector.detect(&features_of(bits, 12.0, &noise)).unwrap();
                prop_assert!(near.confidence <= far.confidence);
            }
        }

        #[test]
        fn kmeans_ignores_affine_changes_of_grey(bits: u64, noise in noise(), gain in 0.3f32..2.0, black in 0.0f32..60.0) {
            prop_assume!((8..56).contains(&bits.count_ones()));
            let features = features_of(bits, 8.0, &noise);
            let mean_grey = features.mean_grey.map(|grey| gain * grey + black);
            let panel_grey = gain * features.panel_grey + black;
            let agr = mean_grey.map(|grey| grey / panel_grey);
            let gri = features.gri.map(|gri| gain * gri);
            let changed = Features { mean_grey, agr, gri, panel_grey, ..features };
            let (one, other) = (Detector::KMeans.detect(&features).unwrap(), Detector::KMeans.detect(&changed).unwrap());
            prop_assert_eq!(one.bits, other.bits);
            let furthest = one.soft.0.iter().zip(&other.soft.0).map(|(a, b)| a.abs_diff(*b)).max();
            prop_assert!(furthest <= Some(1), "{:?}", furthest);
        }

        #[test]
        fn no_features_panic(
            agr in prop::collection::vec(prop::num::f32::ANY, LEDS),
            gri in prop::collection::vec(prop::num::f32::ANY, LEDS),
            grey in prop::collection::vec(prop::num::f32::ANY, LEDS),
        ) {
            let [agr, gri, mean_grey] = [agr, gri, grey].map(|values| <[f32; LEDS]>::try_from(values).unwrap());
            let features = Features { agr, gri, mean_grey, ..features_of(0, 0.0, &[[0.0; 2]; LEDS]) };
            for detector in UNTRAINED {
                if let Ok(detection) = detector.detect(&features) {
                    prop_assert!((1..64).contains(&detection.bits.count_on()));
                }
            }
        }
    }
}
