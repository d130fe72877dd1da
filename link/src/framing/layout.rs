//! The layout of a message: its segments and their code.

use super::MESSAGE_MAX;
use crate::fec::{Block, Code};

/// Panels of a segment before its payload: one sync panel, two of the header.
pub const OVERHEAD_PANELS: usize = 3;

/// The segments of a message of one length under one code.
///
/// Every segment but the last is full. A segment has [`OVERHEAD_PANELS`] panels and those of its [`Block`].
///
/// ```
/// use link::{fec::Code, framing::Layout};
/// let layout = Layout::new(Code::Tm1280, 200);
/// assert_eq!(layout.segments(), 2);
/// assert_eq!(layout.panels(), (3 + 16 + 4) + (3 + 9 + 4));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    code: Code,
    length: usize,
}

impl Layout {
    /// The layout of a message of `length` bytes; a length outside 1 to [`MESSAGE_MAX`] is clamped.
    pub const fn new(code: Code, length: usize) -> Self {
        let length = if length < 1 { 1 } else { length };
        Self {
            code,
            length: if length > MESSAGE_MAX { MESSAGE_MAX } else { length },
        }
    }

    /// Segments of the message: 1 to 128.
    pub const fn segments(self) -> usize {
        self.length.div_ceil(self.code.info_bytes())
    }

    /// The code word of segment `segment`; the last one's is shortened to the remaining bytes.
    pub const fn block(self, segment: usize) -> Block {
        Block::new(self.code, self.length.saturating_sub(self.first_byte(segment)))
    }

    /// The position of segment `segment` in the message.
    pub const fn first_byte(self, segment: usize) -> usize {
        segment.saturating_mul(self.code.info_bytes())
    }

    /// Panels of segment `segment`, overhead included.
    pub const fn segment_panels(self, segment: usize) -> usize {
        OVERHEAD_PANELS + self.block(segment).panels()
    }

    /// Panels of the whole message, shown once.
    pub const fn panels(self) -> usize {
        let last = self.segments() - 1;
        last * self.segment_panels(0) + self.segment_panels(last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_segments_of_a_message_hold_exactly_its_bytes() {
        for code in Code::ALL {
            for length in 1..=MESSAGE_MAX {
                let layout = Layout::new(code, length);
                let blocks = (0..layout.segments()).map(|segment| layout.block(segment));
                assert_eq!(blocks.clone().map(Block::info_bytes).sum::<usize>(), length);
                assert_eq!(blocks.map(|block| OVERHEAD_PANELS + block.panels()).sum::<usize>(), layout.panels());
                assert!(layout.segments() <= 128, "{code}, {length} bytes");
            }
        }
    }
}
