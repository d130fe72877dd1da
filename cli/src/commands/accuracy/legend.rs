//! The legend of a figure: its curves, and what the marks mean.

use plotters::prelude::*;
use sim::precision::Part;

use super::super::figures::chart::COLOURS;
use super::diagram::{FRONT, Mark, TEXT_PX, mark, text};
use crate::plot::Surface;

/// Where more curves than [`COLOURS`] are.
const MORE_COLOURS: [RGBColor; 3] = [
    RGBColor(140, 86, 75),
    RGBColor(120, 130, 0),
    RGBColor(110, 60, 180),
];
/// The height of a legend.
pub const HEIGHT_PX: i32 = 58;
/// The first curve's place.
const LEFT_PX: i32 = 24;

/// The curves of a part in the order in which they appear, with their colours.
pub fn curves(part: &Part) -> Vec<(String, RGBColor)> {
    let mut names: Vec<String> = Vec::new();
    for point in part.diagrams.iter().flat_map(|diagram| &diagram.points) {
        if !point.curve.is_empty() && !names.contains(&point.curve) {
            names.push(point.curve.clone());
        }
    }
    let colours = COLOURS.into_iter().chain(MORE_COLOURS);
    names.into_iter().zip(colours.cycle()).collect()
}

/// The colour of a curve; black for variants that stand alone.
pub fn colour(curves: &[(String, RGBColor)], curve: &str) -> RGBColor {
    let known = curves.iter().find(|(name, _)| name == curve);
    known.map_or(BLACK, |(_, colour)| *colour)
}

/// Draws it along the top of a surface.
pub fn draw(surface: &Surface, curves: &[(String, RGBColor)]) -> anyhow::Result<()> {
    let mut left = LEFT_PX;
    for (name, colour) in curves {
        let line = vec![(left, 18), (left + 26, 18)];
        surface.draw(&PathElement::new(line, colour.stroke_width(2)))?;
        mark(surface, (left + 13, 18), *colour, Mark::OnFront)?;
        text(surface, name, (left + 32, 10), TEXT_PX, BLACK)?;
        left += 32 + width(name);
    }
    left = LEFT_PX;
    let marks = [
        (Some(Mark::OnFront), "on the front"),
        (Some(Mark::Beaten), "beaten in both"),
        (Some(Mark::Default), "default"),
        (None, "the front"),
    ];
    for (kind, name) in marks {
        match kind {
            Some(kind) => mark(surface, (left + 13, 44), BLACK, kind)?,
            None => {
                let line = vec![(left, 44), (left + 26, 44)];
                surface.draw(&PathElement::new(line, FRONT.stroke_width(6)))?;
            }
        }
        text(surface, name, (left + 32, 36), TEXT_PX, BLACK)?;
        left += 32 + width(name);
    }
    text(
        surface,
        "bars: quartiles of time, 95 % of a sampled error, down to the rms; arrow: at most",
        (left, 36),
        TEXT_PX,
        BLACK,
    )
}

fn width(name: &str) -> i32 {
    name.chars().count() as i32 * 8 + 22
}
