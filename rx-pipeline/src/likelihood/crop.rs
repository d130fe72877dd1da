//! The pixels of a frame that show the panel, and the positions of its LEDs among them.

use core::ops::Range;

use crate::corners::Corners;
use crate::corners::MIN_PITCH_PX;
use crate::frame::Frame;
use crate::spots::{LANES, PIXEL_VARIANCE, Window};
use link::panel::{LEDS, SIDE};

/// Pixels beyond the cells, within the frame (px): blur carries light of the outermost LEDs there, and they show the background. More:
/// slower, and the surroundings of the panel count.
const RIM_PX: f32 = 2.0;
/// The widest pitch at full resolution (px): at wider ones, larger pixels are as accurate. Wider: slower.
const PITCH_MAX_PX: f32 = 8.0;
/// Pixels are binned until the standard deviation of spots is at most this (px), because larger pixels are as accurate. Wider: slower, and
/// spots are truncated too early.
const SIGMA_MAX_PX: f32 = 2.4;
/// Binning stops before the pitch falls below this (px).
const WIDE_PITCH_MIN_PX: f32 = 2.6;

/// The prior knowledge of a panel's image.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImagePrior {
    /// Whether the surroundings of its cells are plain, so that they are used too.
    pub is_plain_around: bool,
    /// The standard deviation of its spots, in px of the frame; 0 if unknown.
    pub spot_sigma_px: f32,
}

/// The resolution of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Frame pixels along a side of an image pixel.
    pub bin: usize,
    /// Distance of neighbouring LEDs, in image pixels.
    pub pitch: f32,
}

impl Scale {
    /// The variance of an LED's image without any blur, in px² of the image: of a disc about half a pitch wide, and of a pixel.
    pub fn sharp_variance(&self) -> f32 {
        self.pitch * self.pitch / 64.0 + PIXEL_VARIANCE
    }
}

/// A panel in a frame, as the likelihood uses it.
pub(super) struct Crop {
    pub window: Window,
    pub scale: Scale,
    /// The LEDs, in image pixels.
    pub centre: [[f32; 2]; LEDS],
    /// The corners of the cells, in image pixels.
    cells: Quadrilateral,
    /// The corners of the used pixels: those of the cells, or of a rim around them.
    edge: Quadrilateral,
}

type Quadrilateral = [[f32; 2]; 4];

impl Crop {
    /// The panel at `corners` in a frame, in the finest pixels that are useful and fit into `capacity`.
    pub fn new(
        frame: &Frame<'_>,
        corners: &Corners,
        capacity: usize,
        ImagePrior {
            is_plain_around,
            spot_sigma_px,
        }: ImagePrior,
    ) -> Self {
        let homography = corners.homography();
        let centre: [[f32; 2]; LEDS] = core::array::from_fn(|led| {
            let panel = [(led % SIDE) as f64, (led / SIDE) as f64];
            homography.to_image(panel).map(|c| c as f32)
        });
        let pitch_px = corners.pitch_px();
        let outline = |rim: f32| {
            let [low, high] = [-rim, SIDE as f32 - 1.0 + rim].map(f64::from);
            [[low, low], [high, low], [high, high], [low, high]].map(|panel| homography.to_image(panel).map(|c| c as f32))
        };
        let cells = outline(0.5);
        let edge = if is_plain_around { outline(0.5 + RIM_PX / pitch_px) } else { cells };
        let range = |axis: usize, end: usize| {
            let values = edge.iter().map(|corner| corner[axis]);
            let (low, high) = values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
            // A cast of a negative number is 0.
            let from = libm::roundf(low) as usize;
            let to = (libm::roundf(high).max(0.0) as usize + 1).min(end);
            (from, to.saturating_sub(from))
        };
        let ((x, width), (y, height)) = (range(0, frame.width()), range(1, frame.height()));
        let mut bin = libm::ceilf(pitch_px / PITCH_MAX_PX).max(1.0);
        while spot_sigma_px > SIGMA_MAX_PX * bin && pitch_px >= WIDE_PITCH_MIN_PX * (bin + 1.0) {
            bin += 1.0;
        }
        let pixels = |bin: f32| ((width as f32 / bin) + LANES as f32) * (height as f32 / bin);
        while pixels(bin) > capacity as f32 && pitch_px / bin > 2.0 * MIN_PITCH_PX {
            bin += 1.0;
        }
        let origin = [x, y].map(|first| first as f32 + 0.5 * (bin - 1.0));
        let within = |[x, y]: [f32; 2]| [(x - origin[0]) / bin, (y - origin[1]) / bin];
        Self {
            window: Window { x, y, width, height },
            scale: Scale {
                bin: bin as usize,
                pitch: pitch_px / bin,
            },
            centre: centre.map(within),
            cells: cells.map(within),
            edge: edge.map(within),
        }
    }

    /// The image pixel in the middle of an LED and its three neighbours right and below.
    pub fn between(&self, led: usize) -> [usize; 2] {
        let four = [led, led + 1, led + SIDE, led + SIDE + 1];
        [0, 1].map(|axis| {
            let sum: f32 = four.iter().map(|&led| self.centre[led][axis]).sum();
            // A cast of a negative number is 0.
            libm::roundf(0.25 * sum) as usize
        })
    }

    /// The used pixels of row `y` of an image `width` pixels wide.
    pub fn columns(&self, y: usize, width: usize) -> Range<usize> {
        columns(&self.edge, y, width)
    }

    /// The used pixels of that row within the cells.
    pub fn cell_columns(&self, y: usize, width: usize) -> Range<usize> {
        columns(&self.cells, y, width)
    }
}

/// The pixels of row `y`, `width` wide, in a convex quadrilateral.
fn columns(corners: &Quadrilateral, y: usize, width: usize) -> Range<usize> {
    let y = y as f32;
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (before, after) = (y - from[1], to[1] - y);
        if before * after >= 0.0 && from[1] != to[1] {
            let x = from[0] + (to[0] - from[0]) * before / (before + after);
            (low, high) = (low.min(x), high.max(x));
        }
    }
    // Casts of negative numbers are 0, and of infinity the greatest number.
    let first = (libm::ceilf(low.max(0.0)) as usize).min(width);
    let end = ((libm::floorf(high) + 1.0).max(0.0) as usize).min(width);
    first..end.max(first)
}
