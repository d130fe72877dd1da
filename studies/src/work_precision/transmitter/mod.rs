//! The luminance computed by the transmitter, against cycles on a small processor, in different arithmetic.

mod paths;
mod tables;

use fixed::types::U32F32;
use link::l2a_table::{Illuminance, L2aTable};
use tx_firmware::ambient::{BAND_OCTAVES, Smoothing};

use self::paths::{BEFORE_LX, INTERVAL, REFLECTANCE, Transmitter};
use super::Measurement;
use super::counts;
use super::diagram::{CostUnit, Diagram};
use super::error::PrecisionError;
use super::numbers::{range, rounded};
use super::point::Point;
use super::quartiles::Quartiles;
use super::scale::Scale;
use super::steps::Steps;

/// Cycles of the paths on an emulated RP2040.
const CYCLES: &str = include_str!("../data/cortex-m0plus.csv");
/// Cycles of an RP2040 in a second.
const RP2040_HZ: f64 = 125e6;
/// Readings for the comparison of luminance.
const READINGS: usize = 20_000;
/// The range of readings, lx: below, the step of an illuminance, 1/4096 lx, dominates the error.
const LIGHT_LX: [f64; 2] = [1.0, 130_000.0];
/// The distance from the filter's change of pace within which readings are left out, in octaves, because any rounding decides there.
const EDGE_OCTAVES: f64 = 0.01;

/// A path in the arithmetic of its own type.
enum Path {
    Fixed(fn(&Transmitter, Illuminance) -> U32F32),
    Single(fn(&Transmitter, Illuminance) -> f32),
    Double(fn(&Transmitter, Illuminance) -> f64),
}

/// Name in the table of cycles, name here, curve, path.
type NamedPath = (&'static str, &'static str, &'static str, Path);

const fn linear<const ENTRIES: usize>(counted: &'static str, name: &'static str) -> NamedPath {
    (counted, name, "linear tables", Path::Fixed(paths::by_table::<ENTRIES, 1>))
}

const fn quadratic<const ENTRIES: usize>(counted: &'static str, name: &'static str) -> NamedPath {
    (counted, name, "quadratic tables", Path::Fixed(paths::by_table::<ENTRIES, 2>))
}

const PATHS: [NamedPath; 12] = [
    ("firmware", "firmware, fixed point", "", Path::Fixed(paths::firmware)),
    ("single_libm", "f32, libm", "", Path::Single(paths::single_libm)),
    ("single_micromath", "f32, micromath", "", Path::Single(paths::single_micromath)),
    ("double_libm", "f64, libm", "", Path::Double(paths::double_libm)),
    linear::<8>("linear_8", "8 entries, linear"),
    linear::<32>("linear_32", "32 entries, linear"),
    linear::<128>("linear_128", "128 entries, linear"),
    linear::<512>("linear_512", "512 entries, linear"),
    quadratic::<8>("quadratic_8", "8 entries, quadratic"),
    quadratic::<32>("quadratic_32", "32 entries, quadratic"),
    quadratic::<128>("quadratic_128", "128 entries, quadratic"),
    quadratic::<512>("quadratic_512", "512 entries, quadratic"),
];

/// Measures it.
pub fn measure(scale: &Scale, _steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let error = ["greatest relative error of the luminance", ""];
    let diagrams = vec![Diagram {
        cost_unit: CostUnit::Cycles,
        ..Diagram::of("Cortex-M0+ of an RP2040", error, "one reading", points(scale))
    }];
    Ok(Measurement {
        method: format!(
            "*firmware* is the flashed code. The others compute in f32 with libm or micromath, in f64, and in fixed point with tables of \
             8 to 512 entries an octave. The error is the greatest over {READINGS} readings from {} to {} lx. The cycles are those of an \
             emulated RP2040 (`tests/tools/count-cycles`).",
            LIGHT_LX[0], LIGHT_LX[1]
        ),
        reference: "The formulas in f64, except within 0.01 octaves of the filter's threshold.".into(),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let points: Vec<&Point> = diagrams.iter().flat_map(|diagram| &diagram.points).collect();
    let cycles = |name: &str| {
        let point = points.iter().find(|point| point.variant == name);
        point.map_or(f64::NAN, |point| point.cost.median)
    };
    let (ours, single) = (cycles(PATHS[0].1), cycles(PATHS[1].1));
    let tables = points.iter().filter(|point| !point.curve.is_empty());
    let readings_a_second = 1000.0 / f64::from(Smoothing::default().sample_period_ms);
    format!(
        "The firmware's fixed point. It takes {ours:.0} cycles, f32 with libm {single:.0}, and tables {} of the firmware's cycles. \
         Tables cost flash, and {readings_a_second} readings a second take only {} of an RP2040's cycles.",
        range(tables.map(|point| point.ratio.median)),
        rounded(ours * readings_a_second / RP2040_HZ)
    )
}

/// All paths with counted cycles.
fn points(scale: &Scale) -> Vec<Point> {
    let cycles = counts::of(CYCLES);
    let count = |name: &str| cycles.iter().find(|(known, _)| known == name).map(|(_, count)| *count);
    let baseline = count(PATHS[0].0).unwrap_or(1.0);
    let counted = PATHS.iter().filter_map(|(name, variant, curve, path)| {
        let cycles = Quartiles::exactly(count(name)?);
        let point = Point::new(*variant, error(path, scale)?).on(curve);
        Some(Point {
            cost: cycles,
            ratio: cycles.times(1.0 / baseline),
            ..point.with_default(*name == PATHS[0].0)
        })
    });
    counted.collect()
}

/// The greatest relative error of a path's luminance; `None` if there is no transmitter.
fn error(path: &Path, scale: &Scale) -> Option<f64> {
    let transmitter = Transmitter::new()?;
    let reference = Reference::new();
    let count = scale.of(READINGS, 400);
    let [darkest, brightest] = LIGHT_LX;
    let errors = (0..count).filter_map(|k| {
        let octaves = (brightest / darkest).log2() * (k as f64 + 0.5) / count as f64;
        let lx = Illuminance::from_num(darkest * octaves.exp2());
        let exact = reference.luminance_cd_m2(lx)?;
        let ours = match path {
            Path::Fixed(path) => path(&transmitter, lx).to_num(),
            Path::Single(path) => path(&transmitter, lx).into(),
            Path::Double(path) => path(&transmitter, lx),
        };
        Some((ours / exact - 1.0).abs())
    });
    Some(errors.fold(0.0, f64::max))
}

/// The same in f64, by other formulas.
struct Reference {
    table: L2aTable,
    smoothing: Smoothing,
}

impl Reference {
    fn new() -> Self {
        Self {
            table: L2aTable::shipped(),
            smoothing: Smoothing::default(),
        }
    }

    /// `None` near the filter's change of pace.
    fn luminance_cd_m2(&self, lx: Illuminance) -> Option<f64> {
        let (before, lx) = (f64::from(BEFORE_LX), lx.to_num::<f64>());
        let (distance, band) = ((lx / before).log2(), BAND_OCTAVES.to_num::<f64>());
        if (distance.abs() - band).abs() < EDGE_OCTAVES {
            return None;
        }
        let time_constant_ms = if distance < -band {
            self.smoothing.darker_ms
        } else if distance > band {
            self.smoothing.brighter_ms
        } else {
            self.smoothing.still_ms
        };
        let ratio = f64::from(self.smoothing.sample_period_ms) / f64::from(time_constant_ms);
        let share = -(-ratio).exp_m1();
        let smoothed = before.powf(1.0 - share) * lx.powf(share);
        Some(self.l2a(smoothed) * smoothed * REFLECTANCE)
    }

    fn l2a(&self, lx: f64) -> f64 {
        let numbers = |values: &[Illuminance]| values.iter().map(|lx| lx.to_num()).collect::<Vec<f64>>();
        let rows = numbers(&self.table.illuminances_lx());
        let columns: Vec<f64> = self.table.intervals().iter().map(|interval| interval.to_num()).collect();
        let ((row, down), (column, along)) = (place(&rows, lx), place(&columns, INTERVAL.to_num()));
        let value = |row: usize, column: usize| {
            let (row, column) = (row.min(rows.len() - 1), column.min(columns.len() - 1));
            self.table.values()[row * columns.len() + column].to_num::<f64>()
        };
        let between = |row| (1.0 - along) * value(row, column) + along * value(row, column + 1);
        (1.0 - down) * between(row) + down * between(row + 1)
    }
}

/// The node before a value, and the fraction of the way to the next in ratios.
fn place(nodes: &[f64], value: f64) -> (usize, f64) {
    let above = nodes.partition_point(|&node| node <= value);
    match (above.checked_sub(1), nodes.get(above)) {
        (Some(below), Some(next)) => (below, (value / nodes[below]).ln() / (next / nodes[below]).ln()),
        (below, _) => (below.unwrap_or(0), 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(name: &str) -> f64 {
        let path = PATHS.iter().find(|path| path.0 == name).unwrap();
        error(&path.3, &Scale::TINY).unwrap()
    }

    #[test]
    fn f64_agrees_with_the_reference_and_f32_and_the_firmware_nearly() {
        assert!(error_of("double_libm") < 1e-12);
        assert!(error_of("single_libm") < 1e-5);
        assert!(error_of("firmware") < 5e-4);
        assert!(error_of("single_micromath") > 10.0 * error_of("single_libm"));
    }

    #[test]
    fn larger_tables_and_parabolas_err_less() {
        let linear = ["linear_8", "linear_32", "linear_128"].map(error_of);
        assert!(linear.is_sorted_by(|a, b| *a > 4.0 * *b), "{linear:?}");
        // A parabola through a logarithm's table errs 9√3/8 · x/2 · 8 = 7.8 times less than a line at the octave's start,
        // x = 1, where both err most.
        assert!(error_of("quadratic_8") < linear[0] / 5.0);
        assert!(error_of("quadratic_32") < 1e-5);
    }
}
