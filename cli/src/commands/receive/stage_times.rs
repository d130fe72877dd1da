//! How long the receiver's stages take.

use std::time::{Duration, Instant};

use rx_pipeline::profile::{Profile, STAGES, Stage};

use crate::output::tell;

/// How long each stage took in all, how often it ran, and how long at most.
#[derive(Default)]
pub struct StageTimes {
    begun: Vec<Instant>,
    spent: [(Duration, u32, Duration); STAGES.len()],
}

impl Profile for StageTimes {
    fn begins(&mut self, _: Stage) {
        self.begun.push(Instant::now());
    }

    fn ends(&mut self, stage: Stage) {
        let spent = self
            .begun
            .pop()
            .map(|begun| begun.elapsed())
            .unwrap_or_default();
        if let Some(index) = STAGES.iter().position(|&other| other == stage) {
            let (total, count, most) = &mut self.spent[index];
            (*total, *count, *most) = (*total + spent, *count + 1, spent.max(*most));
        }
    }
}

impl StageTimes {
    /// Prints them on standard error.
    pub fn print(&self) {
        tell("stage      times  mean (us)  most (us)");
        for (stage, (total, count, most)) in STAGES.iter().zip(self.spent) {
            let mean = total.as_secs_f64() * 1e6 / f64::from(count.max(1));
            tell(format_args!(
                "{:<9} {count:>6} {mean:>10.1} {:>10.1}",
                format!("{stage:?}"),
                most.as_secs_f64() * 1e6
            ));
        }
    }
}
