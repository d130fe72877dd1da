//! Rasterises the shapes and text of the SVG document at twice the size.

use ab_glyph::{Font, FontRef, OutlineCurve, Point};
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle};
use tiny_skia::{FillRule, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform};

/// Raster pixels per pixel of the SVG document.
const SCALE: f32 = 2.0;

/// A raster canvas.
pub struct Raster<'a> {
    pixels: Pixmap,
    font: FontRef<'a>,
}

impl<'a> Raster<'a> {
    /// A transparent canvas for a document of this size; `None` if the size is 0 or too large, or the font is damaged.
    pub fn new((width, height): (u32, u32), font: &'a [u8]) -> Option<Self> {
        let scaled = |length: u32| length.checked_mul(SCALE as u32);
        Some(Self {
            pixels: Pixmap::new(scaled(width)?, scaled(height)?)?,
            font: FontRef::try_from_slice(font).ok()?,
        })
    }

    pub fn png(&self) -> image::ImageResult<Vec<u8>> {
        let mut file = Vec::new();
        // Plots are drawn once and stored long: a small file justifies the time.
        PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::NoFilter).write_image(
            self.pixels.data(),
            self.pixels.width(),
            self.pixels.height(),
            image::ExtendedColorType::Rgba8,
        )?;
        Ok(file)
    }

    /// Fills one pixel of the document.
    pub fn pixel(&mut self, at: BackendCoord, colour: BackendColor) {
        self.fill(rectangle(at, (at.0 + 1, at.1 + 1)), colour);
    }

    /// Draws a rectangle, filled or outlined.
    pub fn rectangle(&mut self, upper_left: BackendCoord, bottom_right: BackendCoord, style: &impl BackendStyle, fill: bool) {
        let path = rectangle(upper_left, bottom_right);
        if fill {
            self.fill(path, style.color());
        } else {
            self.stroke(path, style.color(), 1);
        }
    }

    pub fn path(&mut self, points: &[BackendCoord], style: &impl BackendStyle) {
        self.stroke(polyline(points, false), style.color(), style.stroke_width());
    }

    pub fn polygon(&mut self, points: &[BackendCoord], colour: BackendColor) {
        self.fill(polyline(points, true), colour);
    }

    /// Draws a circle, filled or outlined.
    pub fn circle(&mut self, centre: BackendCoord, radius: u32, style: &impl BackendStyle, fill: bool) {
        let path = PathBuilder::from_circle(centre.0 as f32, centre.1 as f32, radius as f32);
        if fill {
            self.fill(path, style.color());
        } else {
            self.stroke(path, style.color(), style.stroke_width());
        }
    }

    /// Draws text as the SVG document does: see `SVGBackend::draw_text`.
    pub fn text(&mut self, text: &str, style: &impl BackendTextStyle, at: BackendCoord) {
        let em = (style.size() / 1.24) as f32;
        let scale = em / self.font.units_per_em().unwrap_or(2048.0);
        let (outline, advance) = outline(&self.font, text);
        let left = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * advance * scale,
            HPos::Right => -advance * scale,
        };
        let base = match style.anchor().v_pos {
            VPos::Top => 0.76 * em,
            VPos::Center => 0.25 * em,
            VPos::Bottom => -0.25 * em,
        };
        let turn = match style.transform() {
            FontTransform::Rotate90 => 90.0,
            FontTransform::Rotate180 => 180.0,
            FontTransform::Rotate270 => 270.0,
            _ => 0.0,
        };
        let place = Transform::from_scale(scale, -scale)
            .post_translate(left, base)
            .post_rotate(turn)
            .post_translate(at.0 as f32, at.1 as f32);
        self.fill(outline.and_then(|path| path.transform(place)), style.color());
    }

    fn fill(&mut self, path: Option<Path>, colour: BackendColor) {
        if let Some(path) = path {
            let scale = Transform::from_scale(SCALE, SCALE);
            self.pixels.fill_path(&path, &paint(colour), FillRule::Winding, scale, None);
        }
    }

    fn stroke(&mut self, path: Option<Path>, colour: BackendColor, width: u32) {
        if let Some(path) = path {
            let scale = Transform::from_scale(SCALE, SCALE);
            let stroke = Stroke {
                width: width as f32,
                ..Stroke::default()
            };
            self.pixels.stroke_path(&path, &paint(colour), &stroke, scale, None);
        }
    }
}

fn paint(colour: BackendColor) -> Paint<'static> {
    let (red, green, blue) = colour.rgb;
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, (colour.alpha * 255.0).round() as u8);
    paint
}

/// `None` if it is empty.
fn rectangle(upper_left: BackendCoord, bottom_right: BackendCoord) -> Option<Path> {
    let [left, top] = [upper_left.0, upper_left.1].map(|at| at as f32);
    let [right, bottom] = [bottom_right.0, bottom_right.1].map(|at| at as f32);
    let rectangle = Rect::from_ltrb(left, top, right, bottom)?;
    Some(PathBuilder::from_rect(rectangle))
}

fn polyline(points: &[BackendCoord], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (index, &(x, y)) in points.iter().enumerate() {
        let [x, y] = [x as f32, y as f32];
        if index == 0 {
            path.move_to(x, y);
        } else {
            path.line_to(x, y);
        }
    }
    if closed {
        path.close();
    }
    path.finish()
}

/// The outline of a text from the origin to the right, and its advance, in font units.
fn outline(font: &FontRef, text: &str) -> (Option<Path>, f32) {
    let mut path = PathBuilder::new();
    let (mut right, mut last) = (0.0, None);
    for letter in text.chars() {
        let glyph = font.glyph_id(letter);
        right += last.map_or(0.0, |last| font.kern_unscaled(last, glyph));
        let mut end = None;
        for curve in font.outline(glyph).iter().flat_map(|outline| &outline.curves) {
            add(&mut path, curve, right, &mut end);
        }
        if end.is_some() {
            path.close();
        }
        right += font.h_advance_unscaled(glyph);
        last = Some(glyph);
    }
    (path.finish(), right)
}

/// Appends a curve, in a new contour unless it continues the previous one.
fn add(path: &mut PathBuilder, curve: &OutlineCurve, right: f32, end: &mut Option<Point>) {
    let (OutlineCurve::Line(from, to) | OutlineCurve::Quad(from, _, to) | OutlineCurve::Cubic(from, _, _, to)) = curve;
    if *end != Some(*from) {
        if end.is_some() {
            path.close();
        }
        path.move_to(right + from.x, from.y);
    }
    match curve {
        OutlineCurve::Line(_, to) => path.line_to(right + to.x, to.y),
        OutlineCurve::Quad(_, by, to) => path.quad_to(right + by.x, by.y, right + to.x, to.y),
        OutlineCurve::Cubic(_, by, near, to) => path.cubic_to(right + by.x, by.y, right + near.x, near.y, right + to.x, to.y),
    }
    *end = Some(*to);
}
