//! The last frames, kept while the receiver searches for a blinking panel.

use crate::frame::Frame;
use heapless::Vec;

/// Maximum number of frames of one size in the history.
pub(super) const SLOTS: usize = 3;

/// The layout of frames of one size, one after the other, in a buffer that the caller provides.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    size: (usize, usize),
    kept: usize,
    /// The slot of the latest frame.
    latest: usize,
}

impl History {
    pub fn forget(&mut self) {
        self.kept = 0;
    }

    /// The slot for the next frame, of at most `slots`: it replaces the oldest. `None` if the buffer is too small.
    pub fn next<'a>(&mut self, buffer: &'a mut [u8], size: (usize, usize), slots: usize) -> Option<&'a mut [u8]> {
        let area = size.0.checked_mul(size.1)?;
        let room = (buffer.len() / area.max(1)).min(slots).min(SLOTS);
        if room == 0 {
            return None;
        }
        if size != self.size {
            (self.size, self.kept) = (size, 0);
        }
        self.latest = (self.latest + 1) % room;
        self.kept = (self.kept + 1).min(room);
        buffer.get_mut(area * self.latest..area * (self.latest + 1))
    }

    /// Copies a frame into the next slot.
    pub fn keep(&mut self, buffer: &mut [u8], frame: &Frame<'_>, slots: usize) {
        let size = (frame.width(), frame.height());
        if let Some(place) = self.next(buffer, size, slots) {
            for (to, from) in place.chunks_exact_mut(size.0).zip(frame.rows()) {
                to.copy_from_slice(from);
            }
        }
    }

    /// The stored frames, the latest first, if they have that size and that number of slots.
    pub fn frames<'a>(&self, buffer: &'a [u8], size: (usize, usize), slots: usize) -> Vec<Frame<'a>, SLOTS> {
        let area = self.size.0 * self.size.1;
        let room = (buffer.len() / area.max(1)).min(slots).min(SLOTS);
        if size != self.size {
            return Vec::new();
        }
        (0..self.kept.min(room))
            .filter_map(|age| {
                let slot = (self.latest + room - age) % room;
                let pixels = buffer.get(area * slot..area * (slot + 1))?;
                Frame::new(pixels, size.0, size.1).ok()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(history: &History, buffer: &[u8], frame: &Frame<'_>) -> std::vec::Vec<u8> {
        let frames = history.frames(buffer, (frame.width(), frame.height()), 2);
        frames.iter().filter_map(|frame| frame.pixel(0, 0)).collect()
    }

    #[test]
    fn the_last_two_frames_are_kept_latest_first() {
        let (mut history, mut buffer) = (History::default(), [0; 8]);
        let pixels = [[1u8; 4], [2; 4], [3; 4]];
        let frames = pixels.each_ref().map(|pixels| Frame::new(pixels, 2, 2).unwrap());
        assert!(kept(&history, &buffer, &frames[0]).is_empty());
        frames.iter().for_each(|frame| history.keep(&mut buffer, frame, 2));
        assert_eq!(kept(&history, &buffer, &frames[0]), [3, 2]);
        let other = Frame::new(&pixels[0], 4, 1).unwrap();
        assert!(kept(&history, &buffer, &other).is_empty());
        history.keep(&mut buffer, &other, 2);
        assert_eq!(kept(&history, &buffer, &other), [1]);
        history.forget();
        assert!(kept(&history, &buffer, &other).is_empty());
    }

    #[test]
    fn too_little_room_keeps_nothing() {
        let (mut history, mut buffer) = (History::default(), [0; 8]);
        let frame = Frame::new(&[7; 9], 3, 3).unwrap();
        history.keep(&mut buffer, &frame, 2);
        assert!(kept(&history, &buffer, &frame).is_empty());
    }
}
