//! The detectors by their public names.

pub(crate) mod genie;

use std::str::FromStr;

use rx_pipeline::detect::{Detector, FisherFeatures, Method};
use serde::{Deserialize, Serialize};

/// A choice of detector; files contain its name in [`DETECTORS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum DetectorChoice {
    /// The best one.
    #[default]
    Best,
    /// Maximum likelihood over the bits.
    MaximumLikelihood,
    /// The paper's k-means, on standardised features.
    KMeans,
    /// k-means on the raw features.
    KMeansRaw,
    /// Fisher's discriminant of AGR and GRI, trained on frames of the scene.
    Fisher,
    /// The same with NGR as a third feature.
    FisherNgr,
    /// Otsu's threshold on the grey.
    Otsu,
    /// Maximum likelihood with everything but the bits known: a bound on wrong panels, not a receiver.
    Genie,
}

/// The names of the detectors.
pub const DETECTORS: [(&str, DetectorChoice); 8] = [
    ("best", DetectorChoice::Best),
    ("ml", DetectorChoice::MaximumLikelihood),
    ("kmeans", DetectorChoice::KMeans),
    ("kmeans-raw", DetectorChoice::KMeansRaw),
    ("fisher", DetectorChoice::Fisher),
    ("fisher-ngr", DetectorChoice::FisherNgr),
    ("otsu", DetectorChoice::Otsu),
    ("genie", DetectorChoice::Genie),
];

/// An unknown detector.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no detector {name:?}: choose one of {}", DETECTORS.map(|(name, _)| name).join(", "))]
pub struct DetectorError {
    /// The requested name.
    pub name: String,
}

impl FromStr for DetectorChoice {
    type Err = DetectorError;

    fn from_str(name: &str) -> Result<Self, DetectorError> {
        DETECTORS
            .iter()
            .find(|(known, _)| *known == name)
            .map(|&(_, choice)| choice)
            .ok_or_else(|| DetectorError { name: name.into() })
    }
}

impl TryFrom<String> for DetectorChoice {
    type Error = DetectorError;

    fn try_from(name: String) -> Result<Self, DetectorError> {
        name.parse()
    }
}

impl From<DetectorChoice> for String {
    fn from(choice: DetectorChoice) -> Self {
        choice.name().into()
    }
}

impl DetectorChoice {
    /// Its name in [`DETECTORS`].
    pub fn name(self) -> &'static str {
        DETECTORS
            .iter()
            .find(|(_, choice)| *choice == self)
            .map_or("best", |(name, _)| name)
    }

    /// The receiver's method, for detectors without training.
    pub fn untrained(self) -> Option<Method> {
        match self {
            Self::Best | Self::MaximumLikelihood => Some(Method::default()),
            Self::KMeans => Some(Detector::KMeans.into()),
            Self::KMeansRaw => Some(Detector::KMeansRaw.into()),
            Self::Otsu => Some(Detector::Otsu.into()),
            Self::Fisher | Self::FisherNgr | Self::Genie => None,
        }
    }

    /// Whether it uses estimates from other frames.
    pub(crate) fn looks_back(self) -> bool {
        !matches!(self.untrained(), Some(Method::Features(_)))
    }

    /// The features of its training, if it needs any.
    pub fn learns(self) -> Option<FisherFeatures> {
        match self {
            Self::Fisher => Some(FisherFeatures::AgrGri),
            Self::FisherNgr => Some(FisherFeatures::AgrGriNgr),
            _ => None,
        }
    }
}
