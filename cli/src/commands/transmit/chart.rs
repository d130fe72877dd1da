//! The plot of `vocc transmit --flicker`.

use studies::flicker::{Flicker, Practice, Spectrum};

use crate::plot::{Axis, Chart, Drawing, Entry, Line, Mark, Page, Point, RGBColor, Series, colours};

/// Size of a chart in pixels: width, height.
const SIZE_PX: (i32, i32) = (420, 380);
/// Charts per row.
const COLUMNS: usize = 3;
/// Range of frequencies, Hz: to beyond the last limit.
const SHOWN_HZ: [f64; 2] = [0.5, 4000.0];
/// Range of modulations, %.
const SHOWN_PERCENT: [f64; 2] = [0.01, 130.0];

/// Modulation of one LED and of the panel over frequency, one chart per symbol rate.
pub fn draw(flicker: &Flicker, rates_hz: &[f64]) -> anyhow::Result<Drawing> {
    let names = ["the worst LED", "all LEDs together"];
    let limits = [Practice::LowRisk, Practice::NoEffect];
    let limited = limits.map(|practice| format!("limit: {practice}"));
    let own = colours(&[names[0], names[1], &limited[0], &limited[1]]);
    let charts = rates_hz.iter().map(|&rate_hz| {
        let limits = limits.into_iter().zip(&own[2..]);
        let limits = limits.map(|(practice, &colour)| Series::new("", colour, Line::Band, limit(practice)));
        let lights = [&flicker.worst_led, &flicker.panel].into_iter().zip(&own);
        let lights = lights.map(|(light, &colour)| Series::new("", colour, Line::None, points(light, rate_hz)));
        Chart {
            title: format!("{rate_hz} symbols a second"),
            x: Axis::logarithmic("frequency (Hz)", SHOWN_HZ),
            y: Axis::logarithmic("modulation (%)", SHOWN_PERCENT),
            series: limits.chain(lights).collect(),
        }
    });
    let charts: Vec<Chart> = charts.collect();
    let columns = COLUMNS.min(charts.len());
    let entry = |name: &str, colour: RGBColor, line, mark| Entry {
        name: name.into(),
        colour,
        line,
        mark,
        is_ringed: false,
    };
    let legend = vec![vec![
        entry(names[0], own[0], Line::None, Some(Mark::Speck)),
        entry(names[1], own[1], Line::None, Some(Mark::Speck)),
        entry(&limited[0], own[2], Line::Band, None),
        entry(&limited[1], own[3], Line::Band, None),
    ]];
    Page {
        legend,
        ..Page::new(charts, columns, SIZE_PX)
    }
    .draw()
}

/// The modulation at each frequency in range.
fn points(light: &Spectrum, rate_hz: f64) -> Vec<Point> {
    let points = light.lines().map(|line| Point {
        x: line.cycles * rate_hz,
        y: line.percent,
        mark: Mark::Speck,
        ..Point::default()
    });
    let [least_hz, most_hz] = SHOWN_HZ;
    let is_shown = |point: &Point| (least_hz..=most_hz).contains(&point.x) && point.y >= SHOWN_PERCENT[0];
    points.filter(is_shown).collect()
}

/// A practice's limit of the modulation, in range: straight except for the step at 90 Hz.
fn limit(practice: Practice) -> Vec<Point> {
    let first_hz = SHOWN_HZ[0].max(practice.lowest_hz(SHOWN_PERCENT[0]));
    let last_hz = practice.lowest_hz(100.0);
    let corners_hz = [first_hz, 90f64.next_down(), 90.0, last_hz];
    let points = corners_hz.map(|hz| Point {
        x: hz,
        y: practice.limit_percent(hz),
        mark: Mark::None,
        ..Point::default()
    });
    points.into()
}
