//! How long each stage takes, for whoever has a clock.
//!
//! This crate has none. A [`Profile`] is told when a stage begins and ends; `()` is the one that does not listen, and costs nothing.

/// A part of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// The pass over the whole frame for what stands out.
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
    /// Where a panel that was read is, in metres: measured beside the receiver.
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

/// Somebody who takes the time.
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
    /// A stage begins.
    fn begins(&mut self, stage: Stage);
    /// The stage that began last ends.
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
