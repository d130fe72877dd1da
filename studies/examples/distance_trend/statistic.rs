//! Measures of the distance between On and Off features.

use studies::statistics::{Distinguishability, Moments};

/// The features of On and Off LEDs at one setting.
#[derive(Clone, Default)]
pub struct Clouds {
    on: Moments,
    off: Moments,
    /// Sums over frames of each frame's own Bvar, Wvar and B2W.
    of_frames: [f64; 3],
}

impl Clouds {
    /// Adds a frame.
    pub fn push(&mut self, features: &[[f64; 2]; 64], bits: u64) {
        let (mut on, mut off) = (Moments::default(), Moments::default());
        for (led, &feature) in features.iter().enumerate() {
            if bits >> led & 1 == 1 { &mut on } else { &mut off }.push(feature);
        }
        let own = Distinguishability::of(&on, &off);
        for (sum, value) in self.of_frames.iter_mut().zip([own.bvar, own.wvar, own.b2w.unwrap_or(0.0)]) {
            *sum += value;
        }
        self.on.merge(&on);
        self.off.merge(&off);
    }

    /// Bvar / Wvar with AGR and GRI scaled.
    fn scaled(&self, scales: [f64; 2]) -> f64 {
        let (on, off) = (self.on.mean(), self.off.mean());
        let (mut between, mut within) = (0.0, 0.0);
        for axis in 0..2 {
            let scale = scales[axis].powi(2);
            between += scale * (on[axis] - off[axis]).powi(2);
            within += scale * (self.on.covariance()[axis][axis] + self.off.covariance()[axis][axis]);
        }
        between / within
    }
}

/// A statistic to be maximised.
type Statistic = fn(&Clouds) -> f64;

/// All statistics; the first is the simulator's.
pub const STATISTICS: [(&str, Statistic); 7] = [
    ("frames pooled", |clouds| clouds.scaled([1.0, 1.0])),
    ("GRI of grey 0 to 1", |clouds| clouds.scaled([1.0, 1.0 / 255.0])),
    ("AGR alone", |clouds| clouds.scaled([1.0, 0.0])),
    ("GRI alone", |clouds| clouds.scaled([0.0, 1.0])),
    ("Fisher's criterion", |clouds| {
        Distinguishability::of(&clouds.on, &clouds.off).fisher.unwrap_or(0.0)
    }),
    ("mean of each frame's B2W", |clouds| clouds.of_frames[2]),
    ("mean Bvar / mean Wvar of frames", |clouds| {
        clouds.of_frames[0] / clouds.of_frames[1]
    }),
];
