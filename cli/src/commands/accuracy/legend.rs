//! The legend of a figure: its curves, and what the marks mean.

use plotters::prelude::*;
use studies::work_precision::Part;

use super::super::figures::chart::COLOURS;
use super::diagram::{FRONT, Mark, TEXT_PX, mark, text};
use crate::plot::Surface;

/// Where more curves than [`COLOURS`] are.
const MORE_COLOURS: [RGBColor; 3] = [
    RGBColor(140, 86, 75),
    RGBColor(120, 130, 0),
    RGBColor(110, 60, 180),
];
/// The height of a row.
const ROW_PX: i32 = 26;
/// The first entry's place.
const LEFT_PX: i32 = 24;
/// From an entry's place to its name.
const NAME_PX: i32 = 32;
const MARKS: [(Option<Mark>, &str); 4] = [
    (Some(Mark::OnFront), "on the front"),
    (Some(Mark::Beaten), "beaten in both"),
    (Some(Mark::Default), "default"),
    (None, "the front"),
];

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

/// The height of the legend of some curves on a surface so wide.
pub fn height_px(curves: &[(String, RGBColor)], width_px: i32) -> i32 {
    let rows = places(curves, width_px)
        .last()
        .map_or(0, |(_, row)| row + 1);
    ROW_PX * (rows + 1) + 8
}

/// Draws it along the top of a surface.
pub fn draw(surface: &Surface, curves: &[(String, RGBColor)]) -> anyhow::Result<()> {
    let (width_px, height_px) = surface.dim_in_pixel();
    for ((name, colour), (left, row)) in curves.iter().zip(places(curves, width_px as i32)) {
        let middle = ROW_PX * row + 18;
        let line = vec![(left, middle), (left + 26, middle)];
        surface.draw(&PathElement::new(line, colour.stroke_width(2)))?;
        mark(surface, (left + 13, middle), *colour, Mark::OnFront)?;
        text(surface, name, (left + NAME_PX, middle - 8), TEXT_PX, BLACK)?;
    }
    let (mut left, middle) = (LEFT_PX, height_px as i32 - 14);
    for (kind, name) in MARKS {
        match kind {
            Some(kind) => mark(surface, (left + 13, middle), BLACK, kind)?,
            None => {
                let line = vec![(left, middle), (left + 26, middle)];
                surface.draw(&PathElement::new(line, FRONT.stroke_width(6)))?;
            }
        }
        text(surface, name, (left + NAME_PX, middle - 8), TEXT_PX, BLACK)?;
        left += width(name);
    }
    let bars = "bars: quartiles of time, 95 % of a sampled error, down to the rms; arrow: at most";
    text(surface, bars, (left, middle - 8), TEXT_PX, BLACK)
}

/// Where entries stand, from left to right and in rows.
fn places(curves: &[(String, RGBColor)], width_px: i32) -> Vec<(i32, i32)> {
    let (mut left, mut row) = (LEFT_PX, 0);
    let place = |(name, _): &(String, RGBColor)| {
        if left + width(name) > width_px && left > LEFT_PX {
            (left, row) = (LEFT_PX, row + 1);
        }
        let place = (left, row);
        left += width(name);
        place
    };
    curves.iter().map(place).collect()
}

/// What an entry takes.
fn width(name: &str) -> i32 {
    NAME_PX + name.chars().count() as i32 * 8 + 18
}
