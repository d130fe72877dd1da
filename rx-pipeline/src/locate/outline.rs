//! The rectangle around a bright patch, as the start of the lattice.

use super::candidate::{MAX_SIZE_PX, MIN_SIZE_PX, Window, sums_of_nine};
use super::lattice::Lattice;
use crate::frame::Frame;
use link::panel::SIDE;

/// The greatest roll looked for, in degrees either way.
const MAX_ROLL_DEG: i16 = 20;
/// A patch stops about this far outside its outermost LEDs' centres, in standard deviations of the blur: where the edge LEDs are Off,
/// mixed, and On.
const MARGINS: [f32; 3] = [2.1, 1.5, 2.7];
/// By how much the rectangle around few and uneven LEDs may be turned wrongly: 6°.
const ROLL_DOUBT_RAD: f32 = 0.105;
/// Room around the patch that the fit looks at too, in pixels.
const RIM_PX: usize = 4;

/// A patch of bright pixels with its rectangle of least area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Nine times the sum of the patch's grey levels above the background.
    pub excess: u64,
    bounds: Window,
    roll_rad: f32,
    centre: [f32; 2],
    size: [f32; 2],
}

/// The first and last bright pixel of a row.
#[derive(Clone, Copy)]
struct Span {
    y: usize,
    first: usize,
    last: usize,
}

impl Outline {
    /// The outline of the pixels in the window around which 3×3 pixels sum up to at least `threshold`, if it has a panel's size.
    pub fn of(frame: &Frame<'_>, window: Window, threshold: u16, background: u8) -> Option<Self> {
        let mut spans = heapless::Vec::<Span, MAX_SIZE_PX>::new();
        let mut excess = 0;
        let left = window.x.0.max(1);
        let columns = left..window.x.1.min(frame.width().saturating_sub(1));
        for y in window.y.0..window.y.1 {
            let mut bright = sums_of_nine(frame, columns.clone(), y).map(|sum| sum >= threshold);
            if let Some(first) = bright.position(|bright| bright) {
                let last = bright
                    .rposition(|bright| bright)
                    .map_or(first, |last| first + 1 + last);
                spans
                    .push(Span {
                        y,
                        first: left + first,
                        last: left + last,
                    })
                    .ok()?;
            }
            let above = sums_of_nine(frame, columns.clone(), y).filter(|&sum| sum >= threshold);
            excess += above
                .map(|sum| u64::from(sum.saturating_sub(9 * u16::from(background))))
                .sum::<u64>();
        }
        let x = (
            spans.iter().map(|span| span.first).min()?,
            spans.iter().map(|span| span.last).max()? + 1,
        );
        let y = (spans.first()?.y, spans.last()?.y + 1);
        let has_size =
            |(first, end): (usize, usize)| (MIN_SIZE_PX..=MAX_SIZE_PX).contains(&(end - first));
        if !has_size(x) || !has_size(y) {
            return None;
        }
        let rectangles =
            (-MAX_ROLL_DEG..=MAX_ROLL_DEG).map(|degrees| Rectangle::around(&spans, degrees));
        let Rectangle {
            roll_rad,
            centre,
            size,
        } = rectangles.min_by(|a, b| a.area().total_cmp(&b.area()))?;
        Some(Self {
            excess,
            bounds: Window { x, y },
            roll_rad,
            centre,
            size,
        })
    }

    /// The pixels to be fitted.
    pub fn window(&self, frame: &Frame<'_>) -> Window {
        let grown = |(first, end): (usize, usize), limit: usize| {
            (first.saturating_sub(RIM_PX), (end + RIM_PX).min(limit))
        };
        Window {
            x: grown(self.bounds.x, frame.width()),
            y: grown(self.bounds.y, frame.height()),
        }
    }

    /// Lattices to start the fit from, likeliest first: the rectangle less a margin, as it is turned and otherwise.
    pub fn starts(&self, blur_sigma_px: f32) -> impl Iterator<Item = Lattice> {
        let found = self.roll_rad;
        let rolls = [found, 0.0, found - ROLL_DOUBT_RAD, found + ROLL_DOUBT_RAD];
        let all = rolls
            .into_iter()
            .flat_map(|roll| MARGINS.map(|margin| (roll, margin)));
        all.map(move |(roll, margin)| self.lattice(roll, margin, blur_sigma_px))
    }

    fn lattice(&self, roll_rad: f32, margin: f32, blur_sigma_px: f32) -> Lattice {
        let margin_px = margin * blur_sigma_px;
        let (sin, cos) = (libm::sinf(roll_rad), libm::cosf(roll_rad));
        let [across, down] = self
            .size
            .map(|size| (size - 2.0 * margin_px).max(1.0) / (SIDE - 1) as f32);
        Lattice {
            centre: self.centre,
            column: [across * cos, across * sin],
            row: [-down * sin, down * cos],
            sigma: 0.0,
        }
        .blurred(blur_sigma_px)
    }
}

struct Rectangle {
    roll_rad: f32,
    centre: [f32; 2],
    size: [f32; 2],
}

impl Rectangle {
    /// The smallest rectangle turned by `degrees` around the ends of all spans.
    fn around(spans: &[Span], degrees: i16) -> Self {
        let roll_rad = f32::from(degrees).to_radians();
        let (sin, cos) = (libm::sinf(roll_rad), libm::cosf(roll_rad));
        let mut ends = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        for &Span { y, first, last } in spans {
            for x in [first, last] {
                let (x, y) = (x as f32, y as f32);
                for ([low, high], value) in
                    ends.iter_mut().zip([cos * x + sin * y, cos * y - sin * x])
                {
                    *low = low.min(value);
                    *high = high.max(value);
                }
            }
        }
        let [across, down] = ends.map(|[low, high]| (low + high) / 2.0);
        let centre = [cos * across - sin * down, sin * across + cos * down];
        Self {
            roll_rad,
            centre,
            size: ends.map(|[low, high]| high - low),
        }
    }

    fn area(&self) -> f32 {
        self.size[0] * self.size[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_square_is_outlined() {
        let (sin, cos) = (libm::sinf(0.2), libm::cosf(0.2));
        let pixels: [u8; 6400] = core::array::from_fn(|i| {
            let (x, y) = ((i % 80) as f32 - 42.0, (i / 80) as f32 - 38.0);
            let inside = (cos * x + sin * y).abs() <= 20.0 && (cos * y - sin * x).abs() <= 16.0;
            if inside { 200 } else { 100 }
        });
        let frame = Frame::new(&pixels, 80, 80).unwrap();
        let outline = Outline::of(
            &frame,
            Window {
                x: (0, 80),
                y: (0, 80),
            },
            1350,
            100,
        )
        .unwrap();
        assert!(
            (outline.roll_rad - 0.2).abs() < 0.03,
            "{}",
            outline.roll_rad
        );
        approx::assert_abs_diff_eq!(outline.centre[..], [42.0, 38.0][..], epsilon = 0.7);
        approx::assert_abs_diff_eq!(outline.size[..], [40.0, 32.0][..], epsilon = 1.2);
    }
}
