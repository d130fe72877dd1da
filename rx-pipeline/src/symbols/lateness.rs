//! The delay of frames relative to their numbers. Without the feature `time-stamps` it is always 0 and takes no memory.

/// The greatest delay of a frame, in frame periods: a year at 30 frames a second.
#[cfg(feature = "time-stamps")]
pub const LATE_MAX_FRAMES: f64 = 1e9;

/// The delay of a frame relative to its number, in frame periods.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lateness {
    #[cfg(feature = "time-stamps")]
    pub frames: f64,
}

impl Lateness {
    /// NaN becomes 0, and the value is clamped to ±[`LATE_MAX_FRAMES`].
    #[cfg(feature = "time-stamps")]
    pub fn new(frames: f64) -> Self {
        let frames = if frames.is_nan() { 0.0 } else { frames };
        Self {
            frames: frames.clamp(-LATE_MAX_FRAMES, LATE_MAX_FRAMES),
        }
    }

    /// The frame periods since a frame with the delay `before` whose number was less by `elapsed`.
    #[cfg(feature = "time-stamps")]
    pub fn since(self, before: Self, elapsed: u64) -> f64 {
        (elapsed as f64 + (self.frames - before.frames)).max(0.0)
    }

    /// The time of a frame with that delay (frame periods).
    #[cfg(feature = "time-stamps")]
    pub fn time_of(self, frame: u64) -> f64 {
        frame as f64 + self.frames
    }

    #[cfg(not(feature = "time-stamps"))]
    pub fn time_of(self, frame: u64) -> f64 {
        frame as f64
    }

    #[cfg(not(feature = "time-stamps"))]
    pub fn since(self, _: Self, elapsed: u64) -> f64 {
        elapsed as f64
    }
}

#[cfg(all(test, feature = "time-stamps"))]
mod tests {
    use super::*;

    #[test]
    fn lateness_that_is_no_number_is_none() {
        for (given, taken) in [(f64::NAN, 0.0), (f64::INFINITY, LATE_MAX_FRAMES), (-3.0, -3.0), (0.2, 0.2)] {
            assert_eq!(Lateness::new(given).frames, taken);
        }
    }

    #[test]
    fn time_runs_on() {
        let [early, late] = [-0.2, 0.4].map(Lateness::new);
        assert!((late.since(early, 3) - 3.6).abs() < 1e-12);
        assert_eq!(Lateness::new(-9.0).since(late, 3), 0.0);
        assert_eq!(late.since(late, 3), 3.0);
    }
}
