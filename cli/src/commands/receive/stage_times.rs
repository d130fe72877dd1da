//! Run times of the receiver's stages.

use std::time::{Duration, Instant};

use rx_pipeline::profile::{Profile, STAGES, Stage};

use crate::output::tell;

/// A stage's total time, number of runs, and maximum.
#[derive(Clone, Copy, Default)]
struct StageTime {
    total: Duration,
    times: u32,
    most: Duration,
}

impl StageTime {
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

/// Run times of all stages.
#[derive(Default)]
pub struct StageTimes {
    begun: Vec<Instant>,
    receiver: [StageTime; STAGES.len()],
    pose: StageTime,
}

impl Profile for StageTimes {
    fn begins(&mut self, _: Stage) {
        self.begun.push(Instant::now());
    }

    fn ends(&mut self, stage: Stage) {
        let time = self.begun.pop().map(|begun| begun.elapsed()).unwrap_or_default();
        match STAGES.iter().position(|&other| other == stage) {
            Some(index) => self.receiver[index].add(time),
            None => self.pose.add(time),
        }
    }
}

impl StageTimes {
    /// Total time from symbols to messages.
    pub fn decoding(&self) -> Duration {
        let decode = STAGES.iter().position(|&stage| stage == Stage::Decode);
        decode.map_or(Duration::ZERO, |index| self.receiver[index].total)
    }

    /// Prints them on standard error.
    pub fn print(&self) {
        tell("stage      times  mean (us)  most (us)");
        for (stage, time) in STAGES.iter().zip(self.receiver) {
            time.print(&format!("{stage:?}"));
        }
        if self.pose.times > 0 {
            self.pose.print("Pose");
        }
    }
}
