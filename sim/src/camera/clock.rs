//! The times of exposures and of symbol changes: two clocks without synchronisation.

use link::waveform::Waveform;

use crate::camera::exposure::Exposure;
use crate::scene::{Link, Scene};

/// The symbols that one exposure may see.
pub const WINDOW: usize = Link::WINDOW;

/// The start of a frame's exposure, in the transmitter's symbols.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The seed of the frame's run.
    pub seed: u64,
    /// Number of the frame.
    pub frame: u64,
    /// Start of the exposure, in seconds.
    pub start_s: f64,
    /// Length of the exposure, in seconds.
    pub exposure_s: f64,
    /// The symbol shown at the start.
    pub symbol: u64,
    /// The age of that symbol at the start, in seconds.
    pub since_change_s: f64,
    /// The duration of a symbol, in seconds.
    pub symbol_s: f64,
    /// Seconds of the transmitter's clock per second of the camera's.
    pub transmitter_rate: f64,
}

impl Moment {
    /// The moment of frame `frame` of run `seed` of the scene.
    ///
    /// ```
    /// use sim::{camera::clock::Moment, camera::exposure::Exposure, scene::Scene};
    /// let scene = Scene::load("paper", &[])?;
    /// let moment = Moment::of(&scene, &Exposure::of(&scene), 1, 7);
    /// assert_eq!((moment.symbol, moment.middle_symbol(0.0)), (7, 0));
    /// # Ok::<(), sim::scene::SceneError>(())
    /// ```
    pub fn of(scene: &Scene, exposure: &Exposure, seed: u64, frame: u64) -> Self {
        let transmitter_rate = 1.0 + scene.link.clock_ppm * 1e-6;
        let symbol_s = 1.0 / (scene.link.symbol_rate_hz * transmitter_rate);
        let start_s = frame as f64 / scene.camera.frame_rate_hz;
        // A start within a nanosecond of a change counts as after it, so that rounding does not matter.
        let symbols = start_s / symbol_s + scene.link.phase;
        let symbol = (symbols + 1e-9 / symbol_s).floor();
        Self {
            seed,
            frame,
            start_s,
            exposure_s: exposure.time_s,
            symbol: symbol as u64,
            since_change_s: (symbols - symbol).max(0.0) * symbol_s,
            symbol_s,
            transmitter_rate,
        }
    }

    /// The middle of the exposure, in seconds.
    pub fn middle_s(&self) -> f64 {
        self.start_s + self.exposure_s / 2.0
    }

    /// The symbol in the middle of an exposure delayed by `delay_s`, counted in the window that starts with [`Moment::symbol`].
    pub fn middle_symbol(&self, delay_s: f64) -> usize {
        let middle = (self.since_change_s + delay_s + self.exposure_s / 2.0) / self.symbol_s;
        (middle as usize).min(WINDOW - 1)
    }

    /// The part of each symbol of the window in an exposure delayed by `delay_s`. The parts add up to 1.
    pub fn shares(&self, delay_s: f64) -> [f64; WINDOW] {
        let from = self.since_change_s + delay_s;
        let to = from + self.exposure_s;
        std::array::from_fn(|i| {
            let begin = i as f64 * self.symbol_s;
            let end = if i + 1 == WINDOW { f64::INFINITY } else { begin + self.symbol_s };
            ((to.min(end) - from.max(begin)) / self.exposure_s).max(0.0)
        })
    }

    /// The contrast of each symbol of the window in its part of an exposure delayed by `delay_s`: 1 for still panels.
    pub fn contrasts(&self, delay_s: f64, waveform: Waveform) -> [f64; WINDOW] {
        if waveform.is_still() {
            return [1.0; WINDOW];
        }
        let [from, to] = self.exposed(delay_s);
        std::array::from_fn(|i| {
            let last = if i + 1 == WINDOW { f64::INFINITY } else { i as f64 + 1.0 };
            waveform.contrast(from.max(i as f64), to.min(last))
        })
    }

    /// The contrast of a whole exposure delayed by `delay_s`.
    pub fn contrast(&self, delay_s: f64, waveform: Waveform) -> f64 {
        let [from, to] = self.exposed(delay_s);
        waveform.contrast(from, to)
    }

    /// Start and end of an exposure delayed by `delay_s`, in symbols since the start of [`Moment::symbol`].
    fn exposed(&self, delay_s: f64) -> [f64; 2] {
        let from_s = self.since_change_s + delay_s;
        [from_s, from_s + self.exposure_s].map(|at_s| at_s / self.symbol_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(overrides: &[&str], frame: u64) -> Moment {
        let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
        let scene = Scene::load("paper", &overrides).unwrap();
        Moment::of(&scene, &Exposure::of(&scene), 1, frame)
    }

    #[test]
    fn equal_clocks_keep_their_phase() {
        for frame in [0, 1, 99, 12_345] {
            let moment = moment(&[], frame);
            assert_eq!(moment.symbol, frame);
            assert!((moment.since_change_s - 0.005).abs() < 1e-9);
            assert_eq!(moment.shares(0.0), [1.0, 0.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn a_straddling_exposure_is_shared() {
        // The first exposure starts 0.4 ms before a change and lasts 1 ms.
        let moment = moment(&["link.phase=0.96", "ambient.illuminance_lx=1000"], 0);
        let shares = moment.shares(0.0);
        assert!((shares[0] - 0.4).abs() < 1e-9 && (shares[1] - 0.6).abs() < 1e-9, "{shares:?}");
        assert_eq!(moment.middle_symbol(0.0), 1);
        assert!((moment.shares(0.03).iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_contrasts_of_a_straddling_exposure_add_up_to_that_of_the_whole() {
        let carrier = Waveform::new(14).unwrap();
        let moment = moment(&["link.phase=0.96", "ambient.illuminance_lx=1000"], 0);
        for delay_s in [0.0, 0.000_1, 0.000_4, 0.003] {
            let parts = moment.shares(delay_s).into_iter().zip(moment.contrasts(delay_s, carrier));
            let sum: f64 = parts.map(|(share, contrast)| share * contrast).sum();
            assert!((sum - moment.contrast(delay_s, carrier)).abs() < 1e-9, "{delay_s} s");
        }
        assert_eq!(moment.contrasts(0.0, Waveform::STILL), [1.0; WINDOW]);
    }
}
