//! Charts of curves with bands of uncertainty, all in one style.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::Color;
use studies::statistics::Estimate;

use crate::plot::{FONT, Surface};

/// Colours that colour-blind readers can tell apart too (Okabe & Ito 2008).
pub const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
];
/// The colour of On LEDs.
pub const ON: RGBColor = COLOURS[1];
/// The colour of Off LEDs.
pub const OFF: RGBColor = COLOURS[0];

pub const TITLE_PX: i32 = 17;
pub const TEXT_PX: i32 = 15;
const TICK_PX: i32 = 13;

/// One point of a curve.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub x: f64,
    pub y: Estimate,
    pub mark: Mark,
}

/// How a point is marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// By a dot.
    Known,
    /// By a ring: the value may lie beyond.
    End,
    /// By an arrow downwards: nothing is known but that the value is at most `y.high`.
    Bound,
}

/// A curve.
pub struct Curve {
    pub name: String,
    pub colour: RGBColor,
    pub places: Vec<Place>,
}

/// A chart.
pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub curves: Vec<Curve>,
    pub legend: SeriesLabelPosition,
}

/// An axis.
pub struct Axis {
    pub label: String,
    /// Its ends.
    pub range: [f64; 2],
    /// Whether it shows powers of ten; values and ends stay what they are.
    pub is_logarithmic: bool,
}

impl Axis {
    pub fn linear(label: &str, range: [f64; 2]) -> Self {
        Self {
            label: label.into(),
            range,
            is_logarithmic: false,
        }
    }

    pub fn logarithmic(label: &str, range: [f64; 2]) -> Self {
        Self {
            is_logarithmic: true,
            ..Self::linear(label, range)
        }
    }

    /// From 0 to a little above the greatest of `values`.
    pub fn from_zero(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let top = values
            .filter(|v| v.is_finite())
            .fold(f64::MIN_POSITIVE, f64::max);
        Self::linear(label, [0.0, 1.08 * top])
    }

    /// Where a value stands on it.
    fn place(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        let value = value.clamp(low.min(high), high.max(low));
        if self.is_logarithmic {
            value.log10()
        } else {
            value
        }
    }

    fn ends(&self) -> std::ops::Range<f64> {
        self.place(self.range[0])..self.place(self.range[1])
    }

    fn tick(&self, place: f64) -> String {
        if self.is_logarithmic {
            return format!("10{}", superscript(place.round() as i32));
        }
        let text = format!("{place:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    }

    fn ticks(&self) -> usize {
        if self.is_logarithmic {
            let ends = self.ends();
            (ends.end - ends.start).abs().round() as usize + 1
        } else {
            9
        }
    }
}

fn superscript(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let sign = if number < 0 { "⁻" } else { "" };
    let digits = number.unsigned_abs().to_string();
    let raised = digits
        .bytes()
        .map(|digit| DIGITS[usize::from(digit - b'0')]);
    sign.chars().chain(raised).collect()
}

type Plane<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Title, axes and ticks on a part of a surface.
pub fn plane<'a, 'b>(
    surface: &'a Surface<'b>,
    title: &str,
    x: &Axis,
    y: &Axis,
) -> anyhow::Result<Plane<'a, 'b>> {
    let mut plane = ChartBuilder::on(surface)
        .caption(title, (FONT, TITLE_PX))
        .margin(8)
        .margin_right(16)
        .x_label_area_size(44)
        .y_label_area_size(62)
        .build_cartesian_2d(x.ends(), y.ends())?;
    plane
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.10))
        .x_labels(x.ticks())
        .y_labels(y.ticks())
        .x_desc(x.label.as_str())
        .y_desc(y.label.as_str())
        .axis_desc_style((FONT, TEXT_PX))
        .label_style((FONT, TICK_PX))
        .x_label_formatter(&|place| x.tick(*place))
        .y_label_formatter(&|place| y.tick(*place))
        .draw()?;
    Ok(plane)
}

/// The legend of what was drawn.
pub fn legend<'a, 'b: 'a>(
    plane: &mut Plane<'a, 'b>,
    position: SeriesLabelPosition,
) -> anyhow::Result<()> {
    plane
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.25))
        .label_font((FONT, TICK_PX))
        .legend_area_size(26)
        .margin(8)
        .draw()?;
    Ok(())
}

/// Draws a chart on a part of a surface.
pub fn draw(surface: &Surface, chart: &Chart) -> anyhow::Result<()> {
    let mut plane = plane(surface, &chart.title, &chart.x, &chart.y)?;
    let count = chart.curves.len() as i32;
    for (k, curve) in (0..).zip(&chart.curves) {
        // Arrows of several curves stand side by side.
        draw_curve(&mut plane, chart, curve, ARROW_PX * (2 * k - count + 1) / 2)?;
        let colour = curve.colour;
        plane
            .draw_series(std::iter::empty::<Circle<(f64, f64), i32>>())?
            .label(curve.name.as_str())
            .legend(move |(left, middle)| {
                EmptyElement::at((left, middle))
                    + PathElement::new(vec![(0, 0), (20, 0)], colour.stroke_width(2))
                    + Circle::new((10, 0), 3, colour.filled())
            });
    }
    if count > 1 {
        legend(&mut plane, chart.legend.clone())?;
    }
    Ok(())
}

/// The width of an arrow.
const ARROW_PX: i32 = 9;

fn draw_curve<'a, 'b: 'a>(
    plane: &mut Plane<'a, 'b>,
    chart: &Chart,
    curve: &Curve,
    aside_px: i32,
) -> anyhow::Result<()> {
    let at = |place: &Place, value: f64| (chart.x.place(place.x), chart.y.place(value));
    let style = curve.colour.stroke_width(2);
    // A bound is no value: line and band stop before it.
    for run in curve.places.split(|place| place.mark == Mark::Bound) {
        let upper = run.iter().map(|place| at(place, place.y.high));
        let lower = run.iter().rev().map(|place| at(place, place.y.low));
        let band: Vec<(f64, f64)> = upper.chain(lower).collect();
        if run.len() > 1 {
            plane.draw_series([Polygon::new(band, curve.colour.mix(0.20))])?;
        } else {
            // A place alone has a bar.
            plane.draw_series([PathElement::new(band, curve.colour.stroke_width(1))])?;
        }
        let values = run.iter().map(|place| at(place, place.y.value));
        plane.draw_series(LineSeries::new(values, style))?;
    }
    for place in &curve.places {
        let middle = at(place, place.y.value);
        match place.mark {
            Mark::Known => plane.draw_series([Circle::new(middle, 3, curve.colour.filled())])?,
            Mark::End => {
                plane.draw_series([Circle::new(middle, 4, WHITE.filled())])?;
                plane.draw_series([Circle::new(middle, 4, style)])?
            }
            Mark::Bound => plane.draw_series([EmptyElement::at(at(place, place.y.high))
                + PathElement::new(vec![(aside_px - 4, 0), (aside_px + 4, 0)], style)
                + PathElement::new(vec![(aside_px, 0), (aside_px, 9)], style)
                + PathElement::new(
                    vec![(aside_px - 3, 5), (aside_px, 9), (aside_px + 3, 5)],
                    style,
                )])?,
        };
    }
    Ok(())
}
