//! The plot of a table.

use studies::table::{CriterionSurvey, Entry, TableFile};

use crate::plot::{Axis, Chart, Drawing, Line, Page, Point, Series, colours};
use crate::report::table;

/// Size of a chart in pixels: width, height.
const SIZE_PX: (i32, i32) = (500, 460);

/// The best ratios of the settings on the left, the candidates for the table on the right.
pub fn draw(file: &TableFile, survey: &CriterionSurvey) -> anyhow::Result<Drawing> {
    let right = if survey.illuminance_lx.len() > 1 {
        table::over_light(file)
    } else {
        over_interval(file, survey)
    };
    Page::new(vec![over_distance(file, survey), right], 2, SIZE_PX).draw()
}

/// The best ratio over distance, at the table's first illuminance and first yaw.
fn over_distance(file: &TableFile, survey: &CriterionSurvey) -> Chart {
    let of_interval = |interval: f64| {
        let cells = file.search.details.iter().filter(move |cell| {
            let first = (survey.illuminance_lx[0], survey.yaw_deg[0]);
            cell.interval == interval && (cell.illuminance_lx, cell.yaw_deg) == first
        });
        cells.map(|cell| Point::within(cell.distance_m, cell.l2a, cell.l2a_95))
    };
    let distances = survey.distance_m.iter().copied();
    Chart {
        title: "Best at each distance".into(),
        x: Axis::around("distance (m)", distances),
        y: ratios(survey),
        series: table::by_interval(&survey.interval, |_, interval| of_interval(interval).collect()),
    }
}

/// The two rules over the interval.
fn over_interval(file: &TableFile, survey: &CriterionSurvey) -> Chart {
    let mean = |entry: &Entry| Point::within(entry.interval, entry.mean_l2a, entry.range_l2a);
    let least = |entry: &Entry| Point::within(entry.interval, entry.least_ber_l2a, entry.least_ber_l2a_95);
    let [means, least] = [
        file.search.entries.iter().map(mean).collect(),
        file.search.entries.iter().map(least).collect(),
    ];
    let names = ["mean and range", "least mean BER, 95 %"];
    let rules = names.into_iter().zip([means, least]).zip(colours(&names));
    Chart {
        title: "Over all distances".into(),
        x: Axis::around("LED interval", survey.interval.iter().copied()),
        y: ratios(survey),
        series: rules
            .map(|((name, points), colour)| Series::new(name, colour, Line::Band, points))
            .collect(),
    }
}

/// An axis from 0 to slightly above the searched ratios.
fn ratios(survey: &CriterionSurvey) -> Axis {
    Axis::from_zero("best L2A (1/sr)", survey.search.range.into_iter())
}
