//! Fisher's linear discriminant, trained on panels whose bits are known.

use super::discriminant::Discriminant;
use super::standardise::standardised;
use crate::features::Features;
use link::panel::{LEDS, PanelFrame};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Cells per class for a covariance, at least (count). Fewer: discriminants of little training.
const FISHER_CELLS: u64 = 16;
/// A feature's variance within its class, at least (share of that between the classes): below, the training frames had
/// no noise.
const FISHER_FLOOR: f64 = 1e-6;

/// The features that the discriminant weighs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum FisherFeatures {
    /// AGR and GRI.
    #[default]
    AgrGri,
    /// AGR, GRI and NGR.
    AgrGriNgr,
}

/// The scaling of features before they are weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum FisherScaling {
    /// Minus the mean and divided by the standard deviation in the panel: training at one distance, contrast and gain is also valid at
    /// others. It needs panels with about as many LEDs On as Off.
    #[default]
    ByPanel,
    /// No scaling: valid only under the conditions of the training, including the level of an On LED.
    None,
}

/// A trained discriminant: LLR = `weights`·(AGR, GRI, NGR) + `offset`, in nats.
///
/// ```
/// use rx_pipeline::detect::{Detector, Fisher, FisherFeatures, FisherScaling, FisherTraining};
/// # use rx_pipeline::{cells::CellMap, corners::Corners, features::Features, frame::Frame};
/// # use link::panel::PanelFrame;
/// # let corners = Corners::new([[5.0, 5.0], [33.0, 5.0], [33.0, 33.0], [5.0, 33.0]])?;
/// # let map = CellMap::<2048>::new(&corners, 40, 40)?;
/// # let mut pixels = [118; 1600];
/// # for row in 0..8 { for column in 0..4 { pixels[40 * (5 + 4 * row) + 5 + 8 * column] = 200 + (row + column) as u8; } }
/// # let features = Features::measure(&Frame::new(&pixels, 40, 40)?, &map)?;
/// # let bits = PanelFrame::from_bits(0x5555_5555_5555_5555);
/// let mut training = FisherTraining::new(FisherFeatures::AgrGri, FisherScaling::ByPanel);
/// training.add(&features, bits);
/// let fisher = training.finish()?;
/// assert_eq!(Detector::Fisher(fisher).detect(&features)?.bits, bits);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Serialized", into = "Serialized")]
pub struct Fisher {
    weights: [f32; 3],
    offset: f32,
    scaling: FisherScaling,
}

/// A discriminant as serialised, before validation.
#[derive(Serialize, Deserialize)]
struct Serialized([f32; 3], f32, FisherScaling);

impl TryFrom<Serialized> for Fisher {
    type Error = FisherError;

    fn try_from(Serialized(weights, offset, scaling): Serialized) -> Result<Self, FisherError> {
        Self::new(weights, offset, scaling)
    }
}

impl From<Fisher> for Serialized {
    fn from(fisher: Fisher) -> Self {
        Self(fisher.weights, fisher.offset, fisher.scaling)
    }
}

/// Why there is no discriminant.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FisherError {
    /// Too few cells of one class.
    #[error("the training has {on} cells On and {off} Off, and needs at least {FISHER_CELLS} of each: add panels")]
    TooFewCells {
        /// Cells On seen.
        on: u64,
        /// Cells Off seen.
        off: u64,
    },
    /// A feature that never varied, two that always varied together, or features that are not finite.
    #[error("the features' covariance within the classes is singular: train on frames with noise or at several phases")]
    Singular,
    /// A weight that is not finite.
    #[error("weights and offset must be finite: take them from a training")]
    NotFinite,
}

impl Fisher {
    /// The discriminant of an earlier training.
    ///
    /// # Errors
    /// [`FisherError::NotFinite`] if a weight or the offset is not finite.
    pub fn new(weights: [f32; 3], offset: f32, scaling: FisherScaling) -> Result<Self, FisherError> {
        if weights.iter().chain([&offset]).all(|value| value.is_finite()) {
            Ok(Self { weights, offset, scaling })
        } else {
            Err(FisherError::NotFinite)
        }
    }

    /// Trains on panels with known bits.
    ///
    /// # Errors
    /// As [`FisherTraining::finish`].
    pub fn train<'a>(
        panels: impl IntoIterator<Item = (&'a Features, PanelFrame)>,
        features: FisherFeatures,
        scaling: FisherScaling,
    ) -> Result<Self, FisherError> {
        let mut training = FisherTraining::new(features, scaling);
        for (features, bits) in panels {
            training.add(features, bits);
        }
        training.finish()
    }

    /// The weights of AGR, GRI and NGR; that of NGR is 0 if the training did not use it.
    pub const fn weights(&self) -> [f32; 3] {
        self.weights
    }

    /// The LLR if all (scaled) features are 0.
    pub const fn offset(&self) -> f32 {
        self.offset
    }

    /// The scaling of features before they are weighed.
    pub const fn scaling(&self) -> FisherScaling {
        self.scaling
    }

    pub(super) fn llr(&self, features: &Features) -> [f32; LEDS] {
        let [agr, gri, ngr] = self.weights;
        let uses_ngr = ngr != 0.0;
        scaled(features, self.scaling, uses_ngr).map(|[a, g, n]| agr * a + gri * g + ngr * n + self.offset)
    }
}

/// AGR, GRI and NGR of each cell; NGR is 0 unless `with_ngr` is set.
fn scaled(features: &Features, scaling: FisherScaling, with_ngr: bool) -> [[f32; 3]; LEDS] {
    let scale = |values: &[f32; LEDS]| match scaling {
        FisherScaling::ByPanel => standardised(values),
        FisherScaling::None => *values,
    };
    let (agr, gri) = (scale(&features.agr), scale(&features.gri));
    let ngr = if with_ngr { scale(&features.ngr()) } else { [0.0; LEDS] };
    core::array::from_fn(|cell| [agr[cell], gri[cell], ngr[cell]])
}

/// The means and the covariance within the classes, accumulated panel by panel in constant memory. Trainings on parts of the panels can be
/// [merged](FisherTraining::merge).
#[derive(Clone, Debug)]
pub struct FisherTraining {
    features: FisherFeatures,
    scaling: FisherScaling,
    off: Moments,
    on: Moments,
}

/// Count, mean, and sum of outer products of deviations (Welford 1962; merged by Chan et al. 1979).
#[derive(Clone, Debug, Default)]
struct Moments {
    count: u64,
    mean: Vector3<f64>,
    scatter: Matrix3<f64>,
}

impl FisherTraining {
    /// A training without panels.
    pub fn new(features: FisherFeatures, scaling: FisherScaling) -> Self {
        Self {
            features,
            scaling,
            off: Moments::default(),
            on: Moments::default(),
        }
    }

    /// Adds one panel whose LEDs were `bits`.
    pub fn add(&mut self, features: &Features, bits: PanelFrame) {
        for (cell, sample) in scaled(features, self.scaling, self.with_ngr()).into_iter().enumerate() {
            let class = if bits.led(cell) { &mut self.on } else { &mut self.off };
            class.add(Vector3::from(sample.map(f64::from)));
        }
    }

    /// Adds the panels of another training of the same features and scaling.
    pub fn merge(&mut self, other: &Self) {
        self.on.merge(&other.on);
        self.off.merge(&other.off);
    }

    /// The discriminant w = S⁻¹·(μ_on − μ_off), S the pooled covariance within the classes, with the offset that makes it the
    /// log-likelihood ratio of Gaussian classes (Fisher 1936; Bishop 2006, section 4.2.2).
    ///
    /// # Errors
    /// [`FisherError::TooFewCells`], and [`FisherError::Singular`] if the features do not vary within a class.
    pub fn finish(&self) -> Result<Fisher, FisherError> {
        let (on, off) = (self.on.count, self.off.count);
        if on < FISHER_CELLS || off < FISHER_CELLS {
            return Err(FisherError::TooFewCells { on, off });
        }
        let difference = self.on.mean - self.off.mean;
        let mut covariance = (self.on.scatter + self.off.scatter) / (on + off - 2) as f64;
        for i in 0..3 {
            covariance[(i, i)] += FISHER_FLOOR * difference[i] * difference[i];
        }
        if !self.with_ngr() {
            covariance[(2, 2)] = 1.0;
        }
        let discriminant = Discriminant::between(self.on.mean, self.off.mean, covariance).ok_or(FisherError::Singular)?;
        let [weights] = discriminant.weights.data.0;
        Fisher::new(weights.map(|weight| weight as f32), discriminant.offset as f32, self.scaling).map_err(|_| FisherError::Singular)
    }

    fn with_ngr(&self) -> bool {
        self.features == FisherFeatures::AgrGriNgr
    }
}

impl Moments {
    fn add(&mut self, sample: Vector3<f64>) {
        self.count += 1;
        let before = sample - self.mean;
        self.mean += before / self.count as f64;
        self.scatter += before * (sample - self.mean).transpose();
    }

    fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if count == 0 {
            return;
        }
        let share = other.count as f64 / count as f64;
        let difference = other.mean - self.mean;
        self.scatter += other.scatter + difference * difference.transpose() * (self.count as f64 * share);
        self.mean += difference * share;
        self.count = count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Detector;
    use crate::detect::tests::{features_of, noise};
    use properties::prelude::*;

    const BITS: u64 = 0x9a3c_5e71_0f96_c3a5;

    #[test]
    fn too_little_training_is_refused() {
        let training = FisherTraining::new(FisherFeatures::AgrGri, FisherScaling::None);
        assert_eq!(training.finish(), Err(FisherError::TooFewCells { on: 0, off: 0 }));
        let flat = features_of(BITS, 0.0, &[[0.0; 2]; LEDS]);
        let panels = [(&flat, PanelFrame::from_bits(BITS))];
        let trained = Fisher::train(panels, FisherFeatures::AgrGriNgr, FisherScaling::ByPanel);
        assert_eq!(trained, Err(FisherError::Singular));
        assert!(Fisher::new([1.0, f32::NAN, 0.0], 0.0, FisherScaling::None).is_err());
    }

    properties! {
        #[test]
        fn what_was_learnt_on_one_panel_reads_another(noises in prop::array::uniform2(noise()), bits: u64) {
            prop_assume!((24..40).contains(&bits.count_ones()));
            let known = features_of(BITS, 10.0, &noises[0]);
            let unknown = features_of(bits, 10.0, &noises[1]);
            for features in [FisherFeatures::AgrGri, FisherFeatures::AgrGriNgr] {
                let panels = [(&known, PanelFrame::from_bits(BITS))];
                let fisher = Fisher::train(panels, features, FisherScaling::ByPanel).unwrap();
                let detection = Detector::Fisher(fisher).detect(&unknown).unwrap();
                prop_assert_eq!(detection.bits.bits(), bits);
                prop_assert_eq!(detection.soft.hard().bits(), bits);
            }
        }

        #[test]
        fn merged_trainings_are_one(noises in prop::array::uniform3(noise())) {
            let panels = noises.map(|noise| features_of(BITS, 5.0, &noise));
            let [mut all, mut first, mut second] =
                [(); 3].map(|()| FisherTraining::new(FisherFeatures::AgrGri, FisherScaling::None));
            for (i, panel) in panels.iter().enumerate() {
                all.add(panel, PanelFrame::from_bits(BITS));
                if i == 0 { &mut first } else { &mut second }.add(panel, PanelFrame::from_bits(BITS));
            }
            first.merge(&second);
            let (all, merged) = (all.finish().unwrap(), first.finish().unwrap());
            for (a, b) in all.weights().into_iter().zip(merged.weights()) {
                prop_assert!((a - b).abs() <= 1e-4 * a.abs().max(1.0));
            }
        }
    }
}
