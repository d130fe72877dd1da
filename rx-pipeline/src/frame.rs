//! A camera frame: 8-bit grey pixels somewhere in memory.

/// The most columns or rows of a camera's frame: readers of files and streams refuse more.
pub const SIDE_MAX: usize = 8192;

/// A view of 8-bit grey pixels.
///
/// Pixel (0, 0) is the *centre* of the top-left pixel; x grows to the right, y downwards. All positions of this
/// crate are pixels in this frame of reference, so the frame covers x from −0.5 to `width` − 0.5.
///
/// ```
/// use rx_pipeline::frame::Frame;
/// let pixels = [10, 20, 30, 40, 50, 60];
/// let frame = Frame::new(&pixels, 3, 2)?;
/// assert_eq!(frame.row(1), Some(&[40, 50, 60][..]));
/// let right = frame.region(1, 0, 2, 2)?;
/// assert_eq!(right.row(0), Some(&[20, 30][..]));
/// # Ok::<(), rx_pipeline::frame::FrameError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    pixels: &'a [u8],
    width: usize,
    height: usize,
    stride: usize,
}

/// Why pixels do not make a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// No pixel at all.
    #[error("a frame of {width} × {height} pixels is empty: give at least 1 × 1")]
    Empty {
        /// Requested columns.
        width: usize,
        /// Requested rows.
        height: usize,
    },
    /// Rows that overlap in memory.
    #[error("rows start every {stride} bytes but are {width} long: the stride is at least the width")]
    StrideTooShort {
        /// Bytes from one row's start to the next one's.
        stride: usize,
        /// Columns.
        width: usize,
    },
    /// Fewer bytes than the frame needs.
    #[error("{length} bytes do not hold {width} × {height} pixels in rows of {stride} bytes: check the frame's size")]
    TooShort {
        /// Bytes available.
        length: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes from one row's start to the next one's.
        stride: usize,
    },
    /// A region that reaches beyond its frame.
    #[error("the region of {width} × {height} pixels at ({x}, {y}) is not within the frame of {frame_width} × {frame_height}")]
    RegionOutside {
        /// The region's first column.
        x: usize,
        /// The region's first row.
        y: usize,
        /// The region's columns.
        width: usize,
        /// The region's rows.
        height: usize,
        /// The frame's columns.
        frame_width: usize,
        /// The frame's rows.
        frame_height: usize,
    },
}

impl<'a> Frame<'a> {
    /// A frame whose rows follow each other without a gap.
    ///
    /// # Errors
    /// [`FrameError::Empty`] without pixels, [`FrameError::TooShort`] if `pixels` holds fewer than `width`·`height`.
    pub fn new(pixels: &'a [u8], width: usize, height: usize) -> Result<Self, FrameError> {
        Self::with_stride(pixels, width, height, width)
    }

    /// A frame whose rows start every `stride` bytes; the bytes in between are ignored.
    ///
    /// # Errors
    /// As [`Frame::new`], and [`FrameError::StrideTooShort`] if `stride` is less than `width`.
    pub(crate) fn with_stride(pixels: &'a [u8], width: usize, height: usize, stride: usize) -> Result<Self, FrameError> {
        if width == 0 || height == 0 {
            return Err(FrameError::Empty { width, height });
        }
        if stride < width {
            return Err(FrameError::StrideTooShort { stride, width });
        }
        let needed = stride.checked_mul(height - 1).and_then(|rows| rows.checked_add(width));
        if needed.is_none_or(|needed| pixels.len() < needed) {
            return Err(FrameError::TooShort {
                length: pixels.len(),
                width,
                height,
                stride,
            });
        }
        Ok(Self {
            pixels,
            width,
            height,
            stride,
        })
    }

    /// Columns, at least 1.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows, at least 1.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// The pixels of row `y`; `None` below the frame.
    pub fn row(&self, y: usize) -> Option<&'a [u8]> {
        if y >= self.height {
            return None;
        }
        let start = y * self.stride;
        self.pixels.get(start..start + self.width)
    }

    /// The rows from top to bottom, each [`Frame::width`] pixels.
    pub fn rows(&self) -> impl Iterator<Item = &'a [u8]> + Clone {
        self.pixels.chunks(self.stride).take(self.height).map(|row| &row[..self.width])
    }

    /// The four pixels around a position, row by row, and its distances from the first one (px); `None` beyond the frame.
    pub(crate) fn four_around(&self, [x, y]: [f32; 2]) -> Option<([u8; 4], [f32; 2])> {
        let (i, j) = (libm::floorf(x), libm::floorf(y));
        if !(i >= 0.0 && j >= 0.0) {
            return None;
        }
        let distance = [x - i, y - j];
        let (i, j) = (i as usize, j as usize);
        let [upper, lower] = [self.row(j)?.get(i..i + 2)?, self.row(j + 1)?.get(i..i + 2)?];
        Some(([upper[0], upper[1], lower[0], lower[1]], distance))
    }

    /// The grey level of one pixel; `None` outside the frame.
    pub fn pixel(&self, x: usize, y: usize) -> Option<u8> {
        self.row(y)?.get(x).copied()
    }

    /// The grey level of the pixel nearest to a position; `None` outside the frame.
    #[cfg(any(feature = "carrier", feature = "surroundings"))]
    pub(crate) fn nearest(&self, [x, y]: [f32; 2]) -> Option<u8> {
        let is_within = x >= 0.0 && y >= 0.0;
        self.pixel((x + 0.5) as usize, (y + 0.5) as usize).filter(|_| is_within)
    }

    /// The `width` × `height` pixels whose top-left one is (`x`, `y`). Their positions start at (0, 0) again.
    ///
    /// # Errors
    /// [`FrameError::Empty`] and [`FrameError::RegionOutside`].
    pub fn region(&self, x: usize, y: usize, width: usize, height: usize) -> Result<Self, FrameError> {
        if width == 0 || height == 0 {
            return Err(FrameError::Empty { width, height });
        }
        let within = |start: usize, length: usize, limit: usize| start <= limit && length <= limit - start;
        if !within(x, width, self.width) || !within(y, height, self.height) {
            let (frame_width, frame_height) = (self.width, self.height);
            return Err(FrameError::RegionOutside {
                x,
                y,
                width,
                height,
                frame_width,
                frame_height,
            });
        }
        Self::with_stride(&self.pixels[y * self.stride + x..], width, height, self.stride)
    }
}

/// The value between four neighbours, given row by row, at those distances from the first one (0 to 1).
pub(crate) fn bilinear([a, b, c, d]: [f32; 4], [u, v]: [f32; 2]) -> f32 {
    let (above, below) = (a + u * (b - a), c + u * (d - c));
    above + v * (below - above)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_frame_is_refused() {
        assert_eq!(Frame::new(&[], 0, 3).unwrap_err(), FrameError::Empty { width: 0, height: 3 });
        assert_eq!(
            Frame::with_stride(&[0; 9], 3, 3, 2).unwrap_err(),
            FrameError::StrideTooShort { stride: 2, width: 3 }
        );
        assert!(matches!(Frame::new(&[0; 8], 3, 3), Err(FrameError::TooShort { length: 8, .. })));
        assert!(matches!(Frame::new(&[0; 8], usize::MAX, 2), Err(FrameError::TooShort { .. })));
    }

    #[test]
    fn the_last_row_needs_no_padding() {
        let frame = Frame::with_stride(&[1, 2, 9, 3, 4], 2, 2, 3).unwrap();
        assert_eq!(frame.rows().map(|row| row[1]).sum::<u8>(), 6);
        assert_eq!(frame.pixel(1, 1), Some(4));
        assert_eq!(frame.pixel(2, 1), None);
        assert_eq!(frame.row(2), None);
    }

    #[test]
    fn regions_stay_within_their_frame() {
        let pixels: [u8; 20] = core::array::from_fn(|i| i as u8);
        let frame = Frame::new(&pixels, 5, 4).unwrap();
        let region = frame.region(1, 2, 3, 2).unwrap();
        assert_eq!(region.row(1), Some(&[16, 17, 18][..]));
        assert!(region.region(0, 0, 4, 1).is_err());
        assert!(frame.region(5, 0, 1, 1).is_err());
        assert!(frame.region(usize::MAX, 0, 2, 1).is_err());
        assert!(frame.region(0, 0, 0, 1).is_err());
    }
}
