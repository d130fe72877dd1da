//! The contents of the board's memory before it starts, and its reports, in postcard, one value after another. The tests share this file.

use link::signing::Verdict;
use serde::{Deserialize, Serialize};

/// The address of the cases: the board's PSRAM.
pub const START: usize = 0x8000_0000;
/// The most bytes of all cases.
pub const BYTES: usize = 64 << 10;

/// The header before the cases.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Head<'a> {
    /// The trusted keys, as `vocc keys show` prints them.
    pub keys: &'a str,
    /// The number of cases.
    pub cases: u32,
}

/// A message and its signature in the transmitted form.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Case<'a> {
    pub message: &'a [u8],
    pub signature: &'a [u8],
}

/// The board's report on a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub verdict: Verdict,
    /// Ticks of the board's clock for the verdict.
    pub ticks: u32,
    /// Maximum depth of the stack, in bytes.
    pub stack_bytes: u32,
}
