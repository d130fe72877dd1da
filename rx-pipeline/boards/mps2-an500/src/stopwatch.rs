//! The time of a receiver's stages.

use rx_pipeline::profile::{Profile, STAGES, Stage};

use crate::clock::{now, since};

/// Measures the time of stages that are not nested.
#[derive(Default)]
pub struct Stopwatch {
    began: u32,
    pub ticks: [u32; STAGES.len()],
}

impl Profile for Stopwatch {
    fn begins(&mut self, _: Stage) {
        self.began = now();
    }

    fn ends(&mut self, stage: Stage) {
        if let Some(ticks) = self.ticks.get_mut(stage as usize) {
            *ticks += since(self.began);
        }
    }
}
