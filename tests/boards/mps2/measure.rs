//! The memory and the instructions on the board.

use rx_pipeline::profile::STAGES;
use vocc_tests::firmware::{Size, median, say, size};

use crate::Images;
use crate::board::instructions;
use crate::format::Report;

/// The flash that `docs/embedded-receiver.md` states, rounded up: with rustup's `core`, and with one that is built anew.
const FLASH_MAX: u32 = 320 * 1024;
const FLASH_MAX_CORE_ANEW: u32 = 304 * 1024;
const RAM_MAX: u32 = 380_000;
pub const KMEANS_STACK_MAX: u32 = 84 * 1024;
pub const STACK_MAX: u32 = 140 * 1024;

/// The costs of a film on the board.
#[derive(Default)]
pub struct Costs {
    frames: Vec<u64>,
    stages: Vec<Vec<u64>>,
    stack_bytes: u32,
}

impl Costs {
    /// Adds a frame.
    pub fn add(&mut self, report: &Report) {
        self.frames.push(instructions(report.ticks));
        self.stages.push(report.stage_ticks.map(instructions).to_vec());
        self.stack_bytes = report.stack_bytes;
    }

    /// Prints all measurements.
    pub fn tell(&self, what: &str) {
        say(&format!(
            "{what}: {} instructions a frame, {} at most, {} in the first; stack {} bytes",
            median(&self.frames),
            greatest(&self.frames),
            self.frames.first().copied().unwrap_or_default(),
            self.stack_bytes,
        ));
        for (index, stage) in STAGES.into_iter().enumerate() {
            let column: Vec<u64> = self.stages.iter().map(|frame| frame[index]).collect();
            if greatest(&column) > 0 {
                say(&format!(
                    "{what}: {stage:?} {} instructions a frame, {} at most",
                    median(&column),
                    greatest(&column)
                ));
            }
        }
    }

    /// Checks that half of the frames took at most the first number of instructions, all at most the second, and that the stack was at most
    /// this deep.
    pub fn assert_within(&self, [half, most]: [u64; 2], stack_bytes: u32) {
        assert!(median(&self.frames) <= half, "{:?}", self.frames);
        assert!(greatest(&self.frames) <= most, "{:?}", self.frames);
        assert!(self.stack_bytes <= stack_bytes, "{}", self.stack_bytes);
    }
}

fn greatest(values: &[u64]) -> u64 {
    values.iter().copied().max().unwrap_or_default()
}

/// Flash and static RAM are within their limits.
pub fn it_is_small(images: &Images) {
    let image = &images.receiver;
    let elf = std::fs::read(image).expect("the image is built");
    let Size { flash, ram } = size(&elf);
    // `tests/tools/cargo-embedded` puts the output of Debian's compiler into a folder with this name.
    let core_is_anew = image.iter().any(|folder| folder == "debian");
    let flash_max = if core_is_anew { FLASH_MAX_CORE_ANEW } else { FLASH_MAX };
    say(&format!("flash {flash} bytes of {flash_max}, static RAM {ram} bytes of {RAM_MAX}"));
    assert!(flash <= flash_max && ram <= RAM_MAX);
}
