//! The plot beside a table.

use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use studies::table::{Survey, TableFile};

use crate::plot::{FONT, Surface, svg as draw_svg};

/// Pixels across and down.
const SIZE: (u32, u32) = (1000, 460);

/// Colours of the curves, which the colour-blind can tell apart (Okabe & Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// One ratio with its interval, over something.
struct Dot {
    x: f64,
    l2a: f64,
    l2a_95: [f64; 2],
}

/// Dots that belong together.
struct Curve {
    label: String,
    dots: Vec<Dot>,
}

/// What is drawn in one half.
struct Panel<'a> {
    title: &'a str,
    x_label: &'a str,
    log_x: bool,
    curves: Vec<Curve>,
}

/// The best ratios of the settings on the left, those that the table could hold on the right.
pub fn svg(file: &TableFile, survey: &Survey) -> anyhow::Result<String> {
    draw_svg(SIZE, |surface| {
        let [left, right] = &surface.split_evenly((1, 2))[..] else {
            anyhow::bail!("a plot has two halves");
        };
        settings(file, survey).draw(left, survey.search.range)?;
        let over_light = survey.illuminance_lx.len() > 1;
        let panel = if over_light {
            over_illuminance(file, survey)
        } else {
            over_interval(file, survey)
        };
        panel.draw(right, survey.search.range)
    })
}

/// The best ratio over the distance, in the table's first light and first yaw.
fn settings<'a>(file: &TableFile, survey: &Survey) -> Panel<'a> {
    let curve = |&interval: &f64| Curve {
        label: format!("interval {interval}"),
        dots: file
            .cells
            .iter()
            .filter(|cell| cell.interval == interval)
            .filter(|cell| cell.illuminance_lx == survey.illuminance_lx[0])
            .filter(|cell| cell.yaw_deg == survey.yaw_deg[0])
            .map(|cell| Dot {
                x: cell.distance_m,
                l2a: cell.l2a,
                l2a_95: cell.l2a_95,
            })
            .collect(),
    };
    Panel {
        title: "Best at each distance",
        x_label: "distance (m)",
        log_x: false,
        curves: survey.interval.iter().map(curve).collect(),
    }
}

/// The two rules over the interval.
fn over_interval<'a>(file: &TableFile, _: &Survey) -> Panel<'a> {
    let mean = |entry: &studies::table::Entry| Dot {
        x: entry.interval,
        l2a: entry.mean_l2a,
        l2a_95: entry.range_l2a,
    };
    let least = |entry: &studies::table::Entry| Dot {
        x: entry.interval,
        l2a: entry.least_ber_l2a,
        l2a_95: entry.least_ber_l2a_95,
    };
    Panel {
        title: "Over all distances",
        x_label: "LED interval",
        log_x: false,
        curves: vec![
            Curve {
                label: "mean and range".into(),
                dots: file.entries.iter().map(mean).collect(),
            },
            Curve {
                label: "least mean BER, 95 %".into(),
                dots: file.entries.iter().map(least).collect(),
            },
        ],
    }
}

/// What the table holds over the illuminance.
fn over_illuminance<'a>(file: &TableFile, survey: &Survey) -> Panel<'a> {
    let curve = |&interval: &f64| Curve {
        label: format!("interval {interval}"),
        dots: file
            .entries
            .iter()
            .filter(|entry| entry.interval == interval)
            .map(|entry| Dot {
                x: entry.illuminance_lx,
                l2a: entry.l2a(survey.rule),
                l2a_95: entry.l2a_95(survey.rule),
            })
            .collect(),
    };
    Panel {
        title: "What the table holds",
        x_label: "ambient illuminance (lx)",
        log_x: true,
        curves: survey.interval.iter().map(curve).collect(),
    }
}

impl Panel<'_> {
    fn draw(&self, surface: &Surface, [_, high]: [f64; 2]) -> anyhow::Result<()> {
        let x = || {
            self.curves
                .iter()
                .flat_map(|curve| &curve.dots)
                .map(|dot| dot.x)
        };
        let (first, last) = (
            x().fold(f64::INFINITY, f64::min),
            x().fold(f64::NEG_INFINITY, f64::max),
        );
        let mut chart = ChartBuilder::on(surface);
        chart
            .caption(self.title, (FONT, 20))
            .margin(12)
            .x_label_area_size(48)
            .y_label_area_size(52);
        let top = high * 1.08;
        // Room for the marks of a single place and of the ends.
        if self.log_x {
            let chart =
                chart.build_cartesian_2d((first / 1.3..last * 1.3).log_scale(), 0.0..top)?;
            self.fill(chart, |x| format!("{x}"))
        } else {
            let room = 0.08 * (last - first).max(0.5);
            let chart = chart.build_cartesian_2d(first - room..last + room, 0.0..top)?;
            self.fill(chart, |x| {
                format!("{x:.1}").trim_end_matches(".0").to_string()
            })
        }
    }

    fn fill<'a, X: Ranged<ValueType = f64> + ValueFormatter<f64>>(
        &self,
        mut chart: ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, RangedCoordf64>>,
        x_text: impl Fn(&f64) -> String,
    ) -> anyhow::Result<()> {
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(BLACK.mix(0.12))
            .x_desc(self.x_label)
            .y_desc("best L2A (1/sr)")
            .x_label_formatter(&x_text)
            .axis_desc_style((FONT, 16))
            .label_style((FONT, 14))
            .draw()?;
        for (number, curve) in self.curves.iter().enumerate() {
            let colour = COLOURS[number % COLOURS.len()];
            let points = curve.dots.iter().map(|dot| (dot.x, dot.l2a));
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)).point_size(3))?
                .label(&curve.label)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
                });
            chart.draw_series(curve.dots.iter().map(|dot| {
                let [low, high] = dot.l2a_95;
                ErrorBar::new_vertical(dot.x, low, dot.l2a, high, colour.filled(), 8)
            }))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerRight)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font((FONT, 14))
            .draw()?;
        Ok(())
    }
}
