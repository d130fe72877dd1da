//! Which pixels of a frame tell of the panel, and where its LEDs are among them.

use crate::corners::Corners;
use crate::frame::Frame;
use crate::parameters::likelihood::crop::{MARGIN_PX, PITCH_MAX_PX};
use crate::parameters::reading::MIN_PITCH_PX;
use crate::spots::{LANES, Window};
use link::panel::{LEDS, SIDE};

/// A panel in a frame, as the likelihood looks at it.
pub(super) struct Crop {
    pub window: Window,
    /// Frame pixels along a side of an image pixel.
    pub bin: usize,
    /// The LEDs, in image pixels.
    pub centre: [[f32; 2]; LEDS],
    /// Distance of neighbouring LEDs, in image pixels.
    pub pitch: f32,
}

impl Crop {
    /// The panel at `corners` in a frame, in as fine pixels as are worth while and as `capacity` of them hold.
    pub fn new(frame: &Frame<'_>, corners: &Corners, capacity: usize) -> Self {
        let homography = corners.homography();
        let centre: [[f32; 2]; LEDS] = core::array::from_fn(|led| {
            let panel = [(led % SIDE) as f64, (led / SIDE) as f64];
            homography.to_image(panel).map(|c| c as f32)
        });
        let pitch_px = corners.pitch_px();
        let margin = 0.5 * pitch_px + MARGIN_PX;
        let range = |axis: usize, end: usize| {
            let values = centre.iter().map(|centre| centre[axis]);
            let (low, high) = values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), c| {
                (low.min(c), high.max(c))
            });
            // A cast of what is negative is 0.
            let from = libm::roundf(low - margin) as usize;
            let to = (libm::roundf(high + margin).max(0.0) as usize + 1).min(end);
            (from, to.saturating_sub(from))
        };
        let ((x, width), (y, height)) = (range(0, frame.width()), range(1, frame.height()));
        let mut bin = libm::ceilf(pitch_px / PITCH_MAX_PX).max(1.0);
        let pixels = |bin: f32| ((width as f32 / bin) + LANES as f32) * (height as f32 / bin);
        while pixels(bin) > capacity as f32 && pitch_px / bin > 2.0 * MIN_PITCH_PX {
            bin += 1.0;
        }
        let origin = [x, y].map(|first| first as f32 + 0.5 * (bin - 1.0));
        Self {
            window: Window {
                x,
                y,
                width,
                height,
            },
            bin: bin as usize,
            centre: centre.map(|[x, y]| [(x - origin[0]) / bin, (y - origin[1]) / bin]),
            pitch: pitch_px / bin,
        }
    }

    /// The variance of an LED's image without any blur, in px² of the image: of a disc about half a pitch wide, and of a pixel.
    pub fn sharp_variance(&self) -> f32 {
        self.pitch * self.pitch / 64.0 + 1.0 / 12.0
    }
}
