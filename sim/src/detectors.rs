//! The detectors by the names that users know them by.

use rx_pipeline::detect::Detector;

/// A choice of detector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DetectorChoice {
    /// The best there is.
    #[default]
    Best,
    /// The paper's k-means, on standardised features.
    KMeans,
    /// k-means on the features as they are.
    KMeansRaw,
    /// Fisher's discriminant, trained on frames of the scene.
    Fisher,
    /// The same with the neighbour greyscale ratio as a third feature.
    FisherNgr,
    /// Otsu's threshold on the grey.
    Otsu,
}

/// The names of the detectors.
pub const DETECTORS: [(&str, DetectorChoice); 6] = [
    ("best", DetectorChoice::Best),
    ("kmeans", DetectorChoice::KMeans),
    ("kmeans-raw", DetectorChoice::KMeansRaw),
    ("fisher", DetectorChoice::Fisher),
    ("fisher-ngr", DetectorChoice::FisherNgr),
    ("otsu", DetectorChoice::Otsu),
];

impl DetectorChoice {
    /// The detector, where it needs no frames to learn from.
    pub fn untrained(self) -> Option<Detector> {
        match self {
            Self::Best | Self::KMeans => Some(Detector::KMeans),
            Self::KMeansRaw => Some(Detector::KMeansRaw),
            Self::Otsu => Some(Detector::Otsu),
            Self::Fisher | Self::FisherNgr => None,
        }
    }
}
