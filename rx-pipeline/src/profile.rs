//! Timing of the stages, for callers with a clock.
//!
//! This crate has no clock. It reports the begin and end of each stage to a [`Profile`]; `()` ignores these and costs nothing.

/// A part of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// The survey of the whole frame.
    Survey,
    /// A peak of the survey: its size, pose candidates, fit and verification.
    Search,
    /// The cells of a pose.
    Cells,
    /// AGR and GRI of the cells.
    Features,
    /// Features to bits.
    Detect,
    /// The pose corrected by a frame.
    Follow,
    /// Symbols to messages.
    Decode,
    /// The pose of a panel in metres: timed outside the receiver.
    Pose,
}

/// The receiver's stages, in the order of the pipeline.
pub const STAGES: [Stage; 7] = [
    Stage::Survey,
    Stage::Search,
    Stage::Cells,
    Stage::Features,
    Stage::Detect,
    Stage::Follow,
    Stage::Decode,
];

/// A consumer of the stages' begin and end.
///
/// ```
/// use rx_pipeline::profile::{Profile, Stage};
/// #[derive(Default)]
/// struct Count(u32);
/// impl Profile for Count {
///     fn begins(&mut self, _: Stage) {}
///     fn ends(&mut self, _: Stage) { self.0 += 1; }
/// }
/// let mut count = Count::default();
/// assert_eq!(count.timed(Stage::Detect, || 7), 7);
/// assert_eq!(count.0, 1);
/// ```
pub trait Profile {
    /// Called as a stage begins.
    fn begins(&mut self, stage: Stage);
    /// Called as the stage that began last ends.
    fn ends(&mut self, stage: Stage);

    /// Runs `work` as a stage.
    fn timed<T>(&mut self, stage: Stage, work: impl FnOnce() -> T) -> T
    where
        Self: Sized,
    {
        self.begins(stage);
        let result = work();
        self.ends(stage);
        result
    }
}

impl<P: Profile + ?Sized> Profile for &mut P {
    fn begins(&mut self, stage: Stage) {
        (**self).begins(stage);
    }

    fn ends(&mut self, stage: Stage) {
        (**self).ends(stage);
    }
}

impl Profile for () {
    fn begins(&mut self, _: Stage) {}
    fn ends(&mut self, _: Stage) {}
}
