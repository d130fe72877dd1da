//! The drawing surface, saved as SVG and as PNG.
//!
//! Text is set in DejaVu Sans, which is built in, so plots look the same without installed fonts.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::builder::{PathBufValueParser, TypedValueParser};
use plotters::prelude::{DrawingArea, IntoDrawingArea, IntoFont, RGBColor, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, FontTransform, TextStyle, register_font};

use super::palette::{BLACK, WHITE};
use super::raster::Raster;
use super::sheet::Sheet;
use crate::files;

/// The font of all text.
const FONT: &str = "DejaVu Sans";

/// A drawing surface: white, in pixels from the top left.
pub type Surface<'a> = DrawingArea<Sheet<'a>, plotters::coord::Shift>;

/// A finished drawing.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// As an SVG document.
    pub svg: String,
    /// As a PNG image of twice the size.
    pub png: Vec<u8>,
}

/// Draws a plot of this width and height in pixels.
pub fn draw(size_px: (u32, u32), draw: impl FnOnce(&Surface) -> anyhow::Result<()>) -> anyhow::Result<Drawing> {
    know_font()?;
    let raster = Raster::new(size_px, dejavu::sans::regular());
    let mut raster = raster.with_context(|| format!("no plot is {size_px:?} pixels large"))?;
    let mut svg = String::new();
    {
        let surface = Sheet::new(&mut svg, &mut raster, size_px).into_drawing_area();
        surface.fill(&WHITE)?;
        draw(&surface)?;
        surface.present()?;
    }
    let png = raster.png()?;
    Ok(Drawing { svg, png })
}

/// Registers the font, which plotters needs to measure text.
fn know_font() -> anyhow::Result<()> {
    register_font(FONT, FontStyle::Normal, dejavu::sans::regular()).map_err(|_| anyhow!("the font {FONT} is damaged"))
}

/// Alignment of text relative to its anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// To the right and below.
    Corner,
    /// Below, centred.
    Below,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// To the right, rotated, reading upwards.
    Upright,
}

/// Draws black text of this size.
pub fn words(surface: &Surface, words: &str, at: (i32, i32), size_px: i32, stand: Anchor) -> anyhow::Result<()> {
    coloured(surface, words, at, size_px, stand, BLACK)
}

/// Draws coloured text of this size.
pub fn coloured(surface: &Surface, words: &str, at: (i32, i32), size_px: i32, stand: Anchor, colour: RGBColor) -> anyhow::Result<()> {
    let mut font = (FONT, size_px).into_font();
    if stand == Anchor::Upright {
        font = font.transform(FontTransform::Rotate270);
    }
    let anchor = match stand {
        Anchor::Corner => Pos::new(HPos::Left, VPos::Top),
        Anchor::Below | Anchor::Upright => Pos::new(HPos::Center, VPos::Top),
        Anchor::Left => Pos::new(HPos::Right, VPos::Center),
        Anchor::Right => Pos::new(HPos::Left, VPos::Center),
    };
    let style: TextStyle = font.color(&colour).pos(anchor);
    Ok(surface.draw(&Text::new(words.to_string(), at, style))?)
}

/// Width of text of this size.
pub fn width_px(words: &str, size_px: i32) -> i32 {
    let size = know_font().ok().and_then(|()| (FONT, size_px).into_font().box_size(words).ok());
    // DejaVu's letters are slightly wider than half the font size.
    size.map_or(words.chars().count() as i32 * size_px * 5 / 9, |size| size.0 as i32)
}

/// Writes a plot as `stem`.svg and `stem`.png, each atomically.
pub fn save(stem: &Path, drawing: &Drawing) -> anyhow::Result<()> {
    let [svg, png] = files_of(stem);
    files::write(&svg, &drawing.svg)?;
    files::write(&png, &drawing.png)
}

/// A drawing's files.
pub fn files_of(stem: &Path) -> [PathBuf; 2] {
    ["svg", "png"].map(|kind| stem.with_added_extension(kind))
}

/// Parses a drawing's name, without the extension of either file.
pub fn stem() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(without_ending)
}

fn without_ending(name: PathBuf) -> Result<PathBuf, String> {
    match name.extension().and_then(OsStr::to_str) {
        Some("svg" | "png") => Ok(name.with_extension("")),
        Some("jpg" | "jpeg" | "pdf" | "gif" | "webp" | "eps") => {
            Err("a plot is drawn as .svg and .png: give its name without an ending".into())
        }
        _ => Ok(name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(text: &str) -> Drawing {
        draw((200, 60), |surface| words(surface, text, (10, 20), 20, Anchor::Corner)).expect("a drawing")
    }

    fn dark_pixels(drawing: &Drawing) -> usize {
        let image = image::load_from_memory(&drawing.png).expect("a PNG");
        assert_eq!((image.width(), image.height()), (400, 120));
        image.to_luma8().pixels().filter(|p| p.0[0] < 128).count()
    }

    #[test]
    fn text_is_drawn_without_any_font_of_the_system() {
        assert_eq!(dark_pixels(&page("")), 0);
        assert!(dark_pixels(&page("σ ≥ 1/m²")) > 200);
    }

    #[test]
    fn what_is_no_drawing_is_refused() {
        assert!(draw((0, 10), |_| Ok(())).is_err());
        assert!(draw((10, 10), |_| Err(anyhow!("no data"))).is_err());
    }
}
