//! The transmitter's control path, from a reading of the light to the luminance of its LEDs, in different arithmetic.
//!
//! Without `std`, so that the board program in `studies/boards/arithmetic` counts the cycles of the same code whose errors the computer
//! measures.

use fixed::types::{I6F26, U1F31, U12F20, U32F32};
use link::l2a_table::{Illuminance, Interval, L2aTable};
use tx_firmware::ambient::{Ambient, BAND_OCTAVES, Smoothing};
use tx_firmware::calibration::{Calibration, Measured};
use tx_firmware::dimming::Dimming;

use super::tables::{exp2_by_table, log2_by_table};

/// The light before the reading, lx.
pub const BEFORE_LX: u16 = 1000;
/// The interval of the LEDs: between two of the table's.
pub const INTERVAL: Interval = Interval::lit("0.8");
/// The reflectance of the LEDs.
pub const REFLECTANCE: f64 = 0.4;

/// The transmitter's state between readings, in each arithmetic.
pub struct Transmitter {
    ambient: Ambient,
    table: L2aTable,
    calibration: Calibration,
    fixed: Logarithms<I6F26>,
    single: Logarithms<f32>,
    double: Logarithms<f64>,
}

/// The logarithms of the table's axes and of the smoothed light, and the filter's gains for darker, brighter and like light.
struct Logarithms<T> {
    illuminances: [T; 16],
    rows: usize,
    intervals: [T; 8],
    columns: usize,
    values: [T; 128],
    interval: T,
    before: T,
    shares: [T; 3],
}

impl Transmitter {
    /// A settled state at [`BEFORE_LX`], with the shipped table; `None` if its calibration is invalid.
    pub fn new() -> Option<Self> {
        let smoothing = Smoothing::default();
        let measured = Measured {
            luminance_full_cd_m2: U32F32::lit("1000000"),
            shortest_pulse_ns: 0,
            pwm_period_ns: 20_000,
            reflectance: U1F31::from_num(REFLECTANCE),
            interval: INTERVAL,
            sensor_gain: U12F20::ONE,
            low_current_share: U1F31::ONE,
        };
        let mut ambient = Ambient::new(U12F20::ONE, smoothing);
        ambient.sense(BEFORE_LX.into());
        let table = L2aTable::shipped();
        let share = |time_constant_ms: u16| 1.0 - libm::exp(-f64::from(smoothing.sample_period_ms) / f64::from(time_constant_ms));
        let shares = [smoothing.darker_ms, smoothing.brighter_ms, smoothing.still_ms].map(share);
        let logarithms = Logarithms::of(&table, shares);
        Some(Self {
            ambient,
            calibration: Calibration::new(measured).ok()?,
            fixed: logarithms.converted(I6F26::from_num),
            single: logarithms.converted(|value| value as f32),
            double: logarithms,
            table,
        })
    }
}

impl Logarithms<f64> {
    fn of(table: &L2aTable, shares: [f64; 3]) -> Self {
        let (illuminances, intervals) = (table.illuminances_lx(), table.intervals());
        let log = |value: Option<f64>| libm::log2(value.unwrap_or(1.0));
        Self {
            illuminances: core::array::from_fn(|row| log(illuminances.get(row).map(|lx| lx.to_num()))),
            rows: illuminances.len(),
            intervals: core::array::from_fn(|column| log(intervals.get(column).map(|i| i.to_num()))),
            columns: intervals.len(),
            values: core::array::from_fn(|k| table.values().get(k).map_or(0.0, |l2a| l2a.to_num())),
            interval: libm::log2(INTERVAL.to_num()),
            before: libm::log2(BEFORE_LX.into()),
            shares,
        }
    }

    fn converted<T>(&self, to: impl Fn(f64) -> T) -> Logarithms<T> {
        Logarithms {
            illuminances: self.illuminances.map(&to),
            rows: self.rows,
            intervals: self.intervals.map(&to),
            columns: self.columns,
            values: self.values.map(&to),
            interval: to(self.interval),
            before: to(self.before),
            shares: self.shares.map(&to),
        }
    }
}

impl<
    T: Copy + PartialOrd + core::ops::Sub<Output = T> + core::ops::Add<Output = T> + core::ops::Mul<Output = T> + core::ops::Div<Output = T>,
> Logarithms<T>
{
    /// The smoothed logarithm after a reading; `band` and `zero` are numbers of the type.
    fn smoothed(&self, log: T, band: T, zero: T) -> T {
        let distance = log - self.before;
        let pace = if distance < zero - band {
            0
        } else if distance > band {
            1
        } else {
            2
        };
        self.before + distance * self.shares[pace]
    }

    /// Bilinear in the logarithms, with the edges' values beyond them.
    fn l2a(&self, log: T, zero: T) -> T {
        let (row, down) = place(&self.illuminances[..self.rows], log, zero);
        let (column, along) = place(&self.intervals[..self.columns], self.interval, zero);
        let next = if column + 1 < self.columns { column + 1 } else { column };
        let below = if row + 1 < self.rows { row + 1 } else { row };
        let between = |row: usize| {
            let values = &self.values[row * self.columns..];
            values[column] + (values[next] - values[column]) * along
        };
        let (first, second) = (between(row), between(below));
        first + (second - first) * down
    }
}

/// The entry before a value, and the fraction of the way to the next.
fn place<T: Copy + PartialOrd + core::ops::Sub<Output = T> + core::ops::Div<Output = T>>(axis: &[T], value: T, zero: T) -> (usize, T) {
    let above = axis.iter().take_while(|&&entry| entry <= value).count();
    if above == 0 {
        return (0, zero);
    }
    if above == axis.len() {
        return (above - 1, zero);
    }
    let (from, to) = (axis[above - 1], axis[above]);
    (above - 1, (value - from) / (to - from))
}

/// As in the firmware.
pub fn firmware(transmitter: &Transmitter, lx: Illuminance) -> U32F32 {
    let mut ambient = transmitter.ambient.clone();
    let smoothed = ambient.sense(lx.into());
    let l2a = transmitter.table.l2a(smoothed, INTERVAL);
    Dimming::new(l2a, smoothed, &transmitter.calibration).wanted_cd_m2
}

/// In single precision, by any logarithm and power of 2.
fn single(transmitter: &Transmitter, lx: Illuminance, log2: fn(f32) -> f32, exp2: fn(f32) -> f32) -> f32 {
    let logarithms = &transmitter.single;
    let reading = lx.to_bits() as f32 * (1.0 / 4096.0);
    let log = logarithms.smoothed(log2(reading), BAND_OCTAVES.to_num(), 0.0);
    logarithms.l2a(log, 0.0) * exp2(log) * REFLECTANCE as f32
}

/// In f32 by libm.
pub fn single_libm(transmitter: &Transmitter, lx: Illuminance) -> f32 {
    single(transmitter, lx, libm::log2f, libm::exp2f)
}

/// In f32 by micromath.
pub fn single_micromath(transmitter: &Transmitter, lx: Illuminance) -> f32 {
    use micromath::F32Ext;
    single(transmitter, lx, F32Ext::log2, |log| F32Ext::exp(log * core::f32::consts::LN_2))
}

/// In f64 by libm.
pub fn double_libm(transmitter: &Transmitter, lx: Illuminance) -> f64 {
    let logarithms = &transmitter.double;
    let reading = f64::from(lx.to_bits()) / 4096.0;
    let log = logarithms.smoothed(libm::log2(reading), BAND_OCTAVES.to_num(), 0.0);
    logarithms.l2a(log, 0.0) * libm::exp2(log) * REFLECTANCE
}

/// In fixed point with tables of `ENTRIES` steps an octave, with a polynomial of order 1 or 2 in between.
pub fn by_table<const ENTRIES: usize, const ORDER: usize>(transmitter: &Transmitter, lx: Illuminance) -> U32F32 {
    let logarithms = &transmitter.fixed;
    let log = log2_by_table::<ENTRIES, ORDER>(lx);
    let log = logarithms.smoothed(log, BAND_OCTAVES, I6F26::ZERO);
    let light = exp2_by_table::<ENTRIES, ORDER>(log);
    let l2a = logarithms.l2a(log, I6F26::ZERO).to_bits() as u64;
    // 32 bits of the light's fraction and 26 of the ratio's.
    let product = (u128::from(light.to_bits()) * u128::from(l2a)) >> 26;
    const SHARE: u64 = (REFLECTANCE * (1u64 << 32) as f64) as u64;
    U32F32::from_bits(((product * u128::from(SHARE)) >> 32) as u64)
}
