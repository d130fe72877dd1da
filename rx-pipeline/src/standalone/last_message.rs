//! The message that came last.

use link::framing::{Delivery, MESSAGE_MAX};

/// It, and how it came. None has come where there are no bytes.
#[derive(Default)]
pub struct LastMessage {
    pub bytes: heapless::Vec<u8, MESSAGE_MAX>,
    /// When it was complete, µs since the start.
    pub at_us: u64,
    /// Camera frames from its beginning to its end.
    pub frames: u32,
    /// LEDs that error correction mended.
    pub corrected_bits: u32,
}

impl LastMessage {
    /// Takes the place of the one before.
    pub fn keep(&mut self, delivery: &Delivery<'_>, now_us: u64) {
        self.bytes.clear();
        // A message is never longer than there is room for.
        let _ = self.bytes.extend_from_slice(delivery.message);
        self.at_us = now_us;
        self.frames = delivery.last_stamp.saturating_sub(delivery.first_stamp) as u32;
        self.corrected_bits = delivery.corrected_bits;
    }
}
