//! The last frames, while a panel is looked for by its blinking.

use crate::frame::Frame;
use core::borrow::BorrowMut;

/// Two frames, the latest first, in a buffer that somebody else provides.
#[derive(Clone, Debug)]
pub(crate) struct History<H> {
    buffer: H,
    size: (usize, usize),
    kept: usize,
    /// Which half holds the latest frame.
    latest: usize,
}

impl<H: BorrowMut<[u8]>> History<H> {
    pub fn new(buffer: H) -> Self {
        Self {
            buffer,
            size: (0, 0),
            kept: 0,
            latest: 0,
        }
    }

    /// Frames that the buffer has room for.
    fn room(&self, size: (usize, usize)) -> usize {
        let bytes = self.buffer.borrow().len();
        (bytes / size.0.saturating_mul(size.1).max(1)).min(2)
    }

    pub fn forget(&mut self) {
        self.kept = 0;
    }

    /// Copies a frame, over the oldest.
    pub fn keep(&mut self, frame: &Frame<'_>) {
        let size = (frame.width(), frame.height());
        let room = self.room(size);
        if room == 0 {
            return;
        }
        if size != self.size {
            (self.size, self.kept) = (size, 0);
        }
        self.latest = (self.latest + 1) % room;
        self.kept = (self.kept + 1).min(room);
        let area = size.0 * size.1;
        if let Some(place) = self
            .buffer
            .borrow_mut()
            .get_mut(area * self.latest..area * (self.latest + 1))
        {
            for (to, from) in place.chunks_exact_mut(size.0).zip(frame.rows()) {
                to.copy_from_slice(from);
            }
        }
    }

    /// Hands the kept frames of the size of `frame` on, the latest first.
    pub fn with_earlier<T>(&self, frame: &Frame<'_>, work: impl FnOnce(&[Frame<'_>]) -> T) -> T {
        let size = (frame.width(), frame.height());
        let room = self.room(size);
        if size != self.size || self.kept == 0 || room == 0 {
            return work(&[]);
        }
        let area = size.0 * size.1;
        let half = |index: usize| {
            let bytes = self.buffer.borrow().get(area * index..area * (index + 1))?;
            Frame::new(bytes, size.0, size.1).ok()
        };
        let (latest, oldest) = (half(self.latest), half((self.latest + 1) % room));
        match (latest, oldest) {
            (Some(latest), Some(oldest)) if self.kept == 2 => work(&[latest, oldest]),
            (Some(latest), _) => work(&[latest]),
            _ => work(&[]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(history: &History<[u8; 8]>, frame: &Frame<'_>) -> std::vec::Vec<u8> {
        history.with_earlier(frame, |earlier| {
            earlier
                .iter()
                .filter_map(|frame| frame.pixel(0, 0))
                .collect()
        })
    }

    #[test]
    fn the_last_two_frames_are_kept_latest_first() {
        let mut history = History::new([0; 8]);
        let pixels = [[1u8; 4], [2; 4], [3; 4]];
        let frames = pixels
            .each_ref()
            .map(|pixels| Frame::new(pixels, 2, 2).unwrap());
        assert!(kept(&history, &frames[0]).is_empty());
        frames.iter().for_each(|frame| history.keep(frame));
        assert_eq!(kept(&history, &frames[0]), [3, 2]);
        let other = Frame::new(&pixels[0], 4, 1).unwrap();
        assert!(kept(&history, &other).is_empty());
        history.keep(&other);
        assert_eq!(kept(&history, &other), [1]);
        history.forget();
        assert!(kept(&history, &other).is_empty());
    }

    #[test]
    fn too_little_room_keeps_nothing() {
        let mut history = History::new([0u8; 8]);
        let frame = Frame::new(&[7; 9], 3, 3).unwrap();
        history.keep(&frame);
        assert!(kept(&history, &frame).is_empty());
    }
}
