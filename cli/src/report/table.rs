//! Tables of ratios for people: lines, a terminal sketch, and a plot.

use studies::reach::LEAST_PITCH_PX;
use studies::table::{ReachEntry, RegretEntry, TableFile};
use tx_firmware::calibration::BENCH;

use crate::plot::{Axis, Chart, Drawing, Line, Page, Point, Series, colours};

/// Size of a chart in pixels: width, height.
const SIZE_PX: (i32, i32) = (500, 460);

/// Head of [`reach_line`]s. The duty is that of an On LED whose maximum luminance is the bench's.
pub const REACH_HEAD: &str = concat!(
    "illuminance  interval     L2A   95 %              reach   lose ≤ 1 %         best    mean       peak",
    "     duty"
);

/// Formats an entry by reach, with the distance up to which the panel is found, if it is known.
pub fn reach_line(entry: &ReachEntry, found_to_m: Option<f64>) -> String {
    // The end of the lossless range shows which border it is.
    let border = match entry.at_border {
        true if entry.best_l2a <= entry.loses_nothing[0] => "≤",
        true => "≥",
        false => " ",
    };
    let flat = if entry.is_flat { ", flat" } else { "" };
    let lost = entry.lost_at_m.map_or(String::new(), |lost| format!(", lost at {lost} m"));
    let found = found_to_m.map_or(String::new(), |found_m| format!(", {LEAST_PITCH_PX} px apart at {found_m:.0} m"));
    format!(
        "{:>8} lx  {:>8}  {:>6.3}   {:.3} to {:.3}  {:>6.1} m   {:.2} to {:.2}   {border}{:>5.2}  {}{flat}{lost}{found}",
        entry.illuminance_lx,
        entry.interval,
        entry.l2a,
        entry.l2a_95[0],
        entry.l2a_95[1],
        entry.reach_m,
        entry.loses_nothing[0],
        entry.loses_nothing[1],
        entry.best_l2a,
        light(entry.mean_cd, entry.peak_cd, entry.luminance_cd_m2),
    )
}

/// What the distance at which LEDs merge leaves out.
const DIM: &str = "in dim light a receiver must be nearer to find a panel";

/// States the assumption behind a reach, and how far away a receiver finds a panel.
pub fn found_line(file: &TableFile) -> String {
    if file.regret.record.is_some() {
        return format!(
            "no reach goes beyond the distance at which LEDs are {LEAST_PITCH_PX} px apart, because a receiver finds no panel farther \
             away; {DIM}"
        );
    }
    let list = |numbers: &[f64], digits: usize| {
        let numbers = numbers.iter().map(|number| format!("{number:.digits$}"));
        numbers.collect::<Vec<_>>().join(", ")
    };
    let ends = file.found_to_m().map_or(String::new(), |ends| {
        let intervals = file.ratios.interval.iter().map(f64::to_string).collect::<Vec<_>>();
        format!(", beyond {} m at interval {}", list(&ends, 0), intervals.join(", "))
    });
    format!("reach assumes a panel at a known place; a receiver finds none whose LEDs are less than {LEAST_PITCH_PX} px apart{ends}; {DIM}")
}

/// Head of [`regret_line`]s.
pub const REGRET_HEAD: &str = concat!(
    "illuminance  interval     L2A   95 %            reach          lost   ≤ 1 % more        mean       peak",
    "     duty"
);

/// Formats an entry by least regret.
pub fn regret_line(entry: &RegretEntry) -> String {
    let reach = entry.reach_m.iter().copied();
    let flat = if entry.is_flat { ", flat" } else { "" };
    format!(
        "{:>8} lx  {:>8}  {:>6.3}   {:.2} to {:.2}  {:>5.1} to {:>5.1} m  {:>4.1} %  {:.2} to {:.2}  {}{flat}",
        entry.illuminance_lx,
        entry.interval,
        entry.l2a,
        entry.l2a_95[0],
        entry.l2a_95[1],
        reach.clone().fold(f64::INFINITY, f64::min),
        reach.fold(0.0, f64::max),
        100.0 * entry.most_lost,
        entry.no_worse[0],
        entry.no_worse[1],
        light(entry.mean_cd, entry.peak_cd, entry.luminance_cd_m2),
    )
}

fn light(mean_cd: f64, peak_cd: f64, luminance_cd_m2: f64) -> String {
    let full_cd_m2: f64 = BENCH.luminance_full_cd_m2.to_num();
    let duty = 100.0 * luminance_cd_m2 / full_cd_m2;
    format!("{mean_cd:>7.3} cd {peak_cd:>7.3} cd {duty:>5.1} %")
}

/// The ratio over illuminance as block characters, one line per interval, scaled to the range of all ratios.
pub fn sketch(file: &TableFile) -> Vec<String> {
    const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let all = || file.ratios.l2a.iter().flatten().copied();
    let (low, high) = all().fold((f64::INFINITY, 0.0f64), |(low, high), ratio| (low.min(ratio), high.max(ratio)));
    let block = |ratio: f64| {
        let share = (ratio - low) / (high - low).max(f64::MIN_POSITIVE);
        BLOCKS[((share * 8.0) as usize).min(7)]
    };
    let columns = file.ratios.interval.iter().enumerate();
    columns
        .map(|(column, interval)| {
            let ratios = file.ratios.l2a.iter().filter_map(|row| row.get(column));
            let blocks: String = ratios.map(|&ratio| String::from(block(ratio)).repeat(3)).collect();
            format!("interval {interval:<4} {blocks}")
        })
        .collect()
}

/// Plots the ratio over illuminance; for a table by reach also the reach over the ratio at minimum and maximum illuminance, for one of
/// least regret the loss of each ratio there.
pub fn draw(file: &TableFile) -> anyhow::Result<Drawing> {
    let mut charts = vec![over_light(file)];
    let lights = &file.ratios.illuminance_lx;
    let ends = [lights.first(), lights.last()];
    let mut ends: Vec<f64> = ends.into_iter().flatten().copied().collect();
    ends.dedup();
    if !file.reach.details.is_empty() {
        charts.extend(ends.iter().map(|&light| reach_over_ratio(file, light)));
    }
    if !file.regret.details.is_empty() {
        charts.extend(ends.iter().map(|&light| loss_over_ratio(file, light)));
    }
    let columns = charts.len();
    Page::new(charts, columns, SIZE_PX).draw()
}

/// The table's ratios over illuminance, with 95 % bands if known.
pub fn over_light(file: &TableFile) -> Chart {
    let lights = &file.ratios.illuminance_lx;
    let of_column = |column: usize, interval: f64| {
        let rows = lights.iter().zip(&file.ratios.l2a);
        let known = rows.filter_map(move |(&light, row)| {
            let ratio = row.get(column).copied().filter(|ratio| ratio.is_finite())?;
            Some(Point {
                x: light,
                y: ratio,
                y_range: file.l2a_95([light, interval]),
                ..Point::default()
            })
        });
        known.collect()
    };
    let all = file.ratios.l2a.iter().flatten().copied();
    let bands = lights.iter().flat_map(|&light| {
        let intervals = file.ratios.interval.iter();
        intervals.filter_map(move |&interval| file.l2a_95([light, interval]))
    });
    let highest = all.chain(bands.map(|[_, high]| high)).filter(|ratio| ratio.is_finite());
    Chart {
        title: "Ratios of the table".into(),
        x: Axis::around_logarithms("ambient illuminance (lx)", lights.iter().copied()),
        y: Axis::from_zero("L2A (1/sr)", highest.collect::<Vec<_>>().into_iter()),
        series: by_interval(&file.ratios.interval, of_column),
    }
}

fn reach_over_ratio(file: &TableFile, light: f64) -> Chart {
    let of_column = |_, interval: f64| {
        let points = file
            .reach
            .details_at([light, interval])
            .map(|point| Point::within(point.l2a, point.reach_m, point.reach_m_95));
        points.collect()
    };
    let ratios = || file.reach.details.iter().map(|point| point.l2a);
    let [low, high] = [ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max)];
    let found_to_m = file.found_to_m().unwrap_or_default();
    let reach_m = file.reach.details.iter().map(|point| point.reach_m);
    let mut series = by_interval(&file.ratios.interval, of_column);
    let found = series.iter().zip(&found_to_m);
    let found = found.map(|(series, &y)| Series::straight("", series.colour, [[low, y], [high, y]]));
    let found: Vec<Series> = found.collect();
    series.extend(found);
    let thin = if found_to_m.is_empty() { "" } else { "; thin: found to" };
    Chart {
        title: format!("Reach at {light} lx{thin}"),
        x: Axis::around_logarithms("L2A (1/sr)", ratios()),
        y: Axis::from_zero("reach (m)", reach_m.chain(found_to_m.iter().copied())),
        series,
    }
}

/// Maximum loss of each ratio at one illuminance.
fn loss_over_ratio(file: &TableFile, light: f64) -> Chart {
    let of_column = |_, interval: f64| {
        let points = file.regret.details_at([light, interval]).map(|point| Point {
            x: point.l2a,
            y: 100.0 * point.most_lost,
            ..Point::default()
        });
        points.collect()
    };
    let points = || file.regret.details.iter();
    Chart {
        title: format!("Lost in the worst scene at {light} lx"),
        x: Axis::around_logarithms("L2A (1/sr)", points().map(|point| point.l2a)),
        y: Axis::from_zero("reach lost (%)", points().map(|point| 100.0 * point.most_lost)),
        series: by_interval(&file.ratios.interval, of_column),
    }
}

/// One series per interval.
pub fn by_interval(intervals: &[f64], points: impl Fn(usize, f64) -> Vec<Point>) -> Vec<Series> {
    let names: Vec<String> = intervals.iter().map(|interval| format!("interval {interval}")).collect();
    let columns = intervals.iter().enumerate();
    let columns = columns.zip(&names).zip(colours(&names));
    columns
        .map(|(((column, &interval), name), colour)| Series::new(name, colour, Line::Band, points(column, interval)))
        .collect()
}
