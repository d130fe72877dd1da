//! The last message.

use link::framing::{Delivery, MESSAGE_MAX};
use link::signing::Verdict;

/// The message and its reception. No bytes: no message yet.
#[derive(Default)]
pub struct LastMessage {
    pub bytes: heapless::Vec<u8, MESSAGE_MAX>,
    /// When it was complete, µs since the start.
    pub at_us: u64,
    /// Camera frames from its beginning to its end.
    pub frames: u32,
    /// LEDs that error correction changed.
    pub corrected_bits: u32,
    pub verdict: Verdict,
}

impl LastMessage {
    /// Whether there is a message without a signature so far.
    pub fn is_unproven(&self) -> bool {
        !self.bytes.is_empty() && self.verdict == Verdict::Unproven
    }

    /// Replaces the message.
    pub fn keep(&mut self, delivery: &Delivery<'_>, now_us: u64) {
        self.bytes.clear();
        // A message always fits.
        let _ = self.bytes.extend_from_slice(delivery.message);
        self.at_us = now_us;
        self.frames = delivery.last_stamp.saturating_sub(delivery.first_stamp) as u32;
        self.corrected_bits = delivery.corrected_bits;
        self.verdict = Verdict::Unproven;
    }
}
