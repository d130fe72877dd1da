//! How long the receiver's stages take.

use std::time::{Duration, Instant};

use rx_pipeline::profile::{Profile, STAGES, Stage};

use crate::output::tell;

/// How long something took in all, how often it was done, and how long at most.
#[derive(Clone, Copy, Default)]
pub struct Spent {
    total: Duration,
    times: u32,
    most: Duration,
}

impl Spent {
    /// Does it once more.
    pub fn on<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let result = work();
        self.add(begun.elapsed());
        result
    }

    fn add(&mut self, time: Duration) {
        self.total += time;
        self.times += 1;
        self.most = self.most.max(time);
    }

    fn print(&self, what: &str) {
        let mean = self.total.as_secs_f64() * 1e6 / f64::from(self.times.max(1));
        tell(format_args!(
            "{what:<9} {:>6} {mean:>10.1} {:>10.1}",
            self.times,
            self.most.as_secs_f64() * 1e6
        ));
    }
}

/// What was spent on each stage.
#[derive(Default)]
pub struct StageTimes {
    begun: Vec<Instant>,
    spent: [Spent; STAGES.len()],
}

impl Profile for StageTimes {
    fn begins(&mut self, _: Stage) {
        self.begun.push(Instant::now());
    }

    fn ends(&mut self, stage: Stage) {
        let spent = self.begun.pop().map(|begun| begun.elapsed()).unwrap_or_default();
        if let Some(index) = STAGES.iter().position(|&other| other == stage) {
            self.spent[index].add(spent);
        }
    }
}

impl StageTimes {
    /// Prints them, and what was spent on poses, on standard error.
    pub fn print(&self, poses: &Spent) {
        tell("stage      times  mean (us)  most (us)");
        for (stage, spent) in STAGES.iter().zip(self.spent) {
            spent.print(&format!("{stage:?}"));
        }
        if poses.times > 0 {
            poses.print("Pose");
        }
    }
}
