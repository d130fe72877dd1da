//! The best LED-to-ambient ratio over ambient illuminance and LED interval, in fixed point.
//!
//! A transmitter measures the ambient light and looks up how bright its LEDs should be: L2A = L / (E·R), with
//! L the luminance of an On LED, E the illuminance and R the reflectance of its surface (Do & Yoo 2020, Eq.
//! (9)), so an L2A is in 1/sr. The table holds it at up to 16 illuminances × 8 normalised intervals, an
//! interval being the gap between neighbouring LEDs over an LED's diameter. Between the nodes it is bilinear
//! in log₂ illuminance and log₂ interval; outside it keeps the value of the nearest edge.
//!
//! | quantity | type | range | resolution |
//! |---|---|---|---|
//! | [`Illuminance`] | U20F12 | 0 to 1 048 576 lx | 1/4096 lx |
//! | [`Interval`] | U4F12 | 0 to 16 | 1/4096 |
//! | [`L2a`] | U3F13 | 0 to 8 (a table holds 0.2 to 4) | 1/8192 |
//!
//! The look-up uses integers only, with two divisions and no floating point, so that it suits a processor
//! without either.

use fixed::traits::Fixed;
use fixed::types::I6F26;
use fixed::types::extra::{U12, U13};
use fixed::{FixedU16, FixedU32};
use heapless::Vec;

use crate::shipped_table;

pub mod image;

use image::{Image, Parts};

/// An ambient illuminance in lux.
pub type Illuminance = FixedU32<U12>;
/// A normalised LED interval.
pub type Interval = FixedU16<U12>;
/// An LED-to-ambient ratio, 1/sr.
pub type L2a = FixedU16<U13>;

/// The most illuminances of a table.
pub const ILLUMINANCES_MAX: usize = 16;
/// The most intervals of a table.
pub const INTERVALS_MAX: usize = 8;
const VALUES_MAX: usize = ILLUMINANCES_MAX * INTERVALS_MAX;
/// The smallest L2A a table may hold (Do & Yoo 2020, Table 1).
pub const L2A_MIN: f32 = 0.2;
/// The largest L2A a table may hold (Do & Yoo 2020, Table 1).
pub const L2A_MAX: f32 = 4.0;
/// The smallest illuminance of an axis, in lux.
pub const ILLUMINANCE_MIN_LX: f32 = 0.01;
/// The largest illuminance of an axis, in lux: several times the sun at noon.
pub const ILLUMINANCE_MAX_LX: f32 = 1_000_000.0;
/// The smallest interval of an axis.
pub const INTERVAL_MIN: f32 = 0.05;
/// The largest interval of an axis.
pub const INTERVAL_MAX: f32 = 15.0;
/// The least difference of two neighbouring values of an axis, in log₂: about 0.14 %.
///
/// It keeps the interpolation between them finer than 2⁻¹⁵ of their distance.
pub const AXIS_STEP_MIN_LOG2: f32 = 1.0 / 512.0;
/// The greatest deviation of [`L2aTable::l2a`] from bilinear interpolation in exact logarithms.
///
/// Half a step of its type, 6.1e-5; twice 2⁻¹⁶ of the range of 3.8 from the fractions' truncation, 1.2e-4; and twice the effect of
/// [`LOG2_ERROR_MAX`] at both ends of the shortest distance, [`AXIS_STEP_MIN_LOG2`], on that range: 4.6e-4.
pub const L2A_ERROR_MAX: f64 = 6.4e-4;
/// The greatest error of [`log2`].
pub const LOG2_ERROR_MAX: f64 = 1.0 / (1 << 24) as f64;

/// The quantity that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// An illuminance, in lux.
    IlluminanceLx,
    /// A normalised interval.
    Interval,
    /// An L2A.
    L2a,
}

impl Quantity {
    /// The minimum and the maximum in a table.
    const fn range(self) -> (f32, f32) {
        match self {
            Self::IlluminanceLx => (ILLUMINANCE_MIN_LX, ILLUMINANCE_MAX_LX),
            Self::Interval => (INTERVAL_MIN, INTERVAL_MAX),
            Self::L2a => (L2A_MIN, L2A_MAX),
        }
    }

    const fn wrong_length(self, count: usize, most: usize) -> TableError {
        TableError::AxisLength {
            quantity: self,
            count,
            most,
        }
    }

    const fn out_of_range(self, index: usize, value: f32) -> TableError {
        let (least, most) = self.range();
        TableError::OutOfRange {
            quantity: self,
            index,
            value,
            least,
            most,
        }
    }
}

impl core::fmt::Display for Quantity {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::IlluminanceLx => "illuminance in lx",
            Self::Interval => "interval",
            Self::L2a => "L2A",
        })
    }
}

/// Why a table was rejected.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// An axis is empty or too long.
    #[error("the table has {count} entries of {quantity}, 1 to {most} are possible: merge or leave out some")]
    AxisLength {
        /// The axis.
        quantity: Quantity,
        /// Its entries.
        count: usize,
        /// The maximum.
        most: usize,
    },
    /// The number of L2A values is not the product of both axes' lengths.
    #[error(
        "the table has {count} values of L2A, {needed} are needed: one for each illuminance and interval, row by row of one illuminance"
    )]
    ValueCount {
        /// Number of values.
        count: usize,
        /// Illuminances × intervals.
        needed: usize,
    },
    /// An entry is out of its range, or not a number.
    #[error("{quantity} number {index} (from 0) of the table is {value}, it must be {least} to {most}")]
    OutOfRange {
        /// Its quantity.
        quantity: Quantity,
        /// Its position in the argument.
        index: usize,
        /// Its value.
        value: f32,
        /// The smallest allowed.
        least: f32,
        /// The largest allowed.
        most: f32,
    },
    /// An axis does not ascend.
    #[error(
        "{quantity} number {index} (from 0) of the table is {value}, it must be at least 0.14 % above the {previous} before it: \
         sort the axis and drop duplicates"
    )]
    NotAscending {
        /// The axis.
        quantity: Quantity,
        /// The entry's position in the argument.
        index: usize,
        /// Its value.
        value: f32,
        /// The value before it.
        previous: f32,
    },
}

/// A table of the best L2A.
///
/// ```
/// use link::l2a_table::{Illuminance, Interval, L2aTable};
/// let table = L2aTable::new(&[50.0, 5000.0], &[0.5, 2.0], &[1.0, 3.0, 2.0, 4.0])?;
/// let l2a = |illuminance_lx, interval| table.l2a(Illuminance::from_num(illuminance_lx), Interval::from_num(interval)).to_num::<f32>();
/// assert_eq!(l2a(50.0, 0.5), 1.0);
/// // Half-way in both logarithms: √(50·5000) = 500 lx, √(0.5·2) = 1.
/// assert!((l2a(500.0, 1.0) - 2.5).abs() < 0.001);
/// // Outside the axes the edge's value holds.
/// assert_eq!(l2a(1.0, 3.0), 3.0);
/// # Ok::<(), link::l2a_table::TableError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct L2aTable {
    /// The stored and transmitted form, in which values are looked up.
    image: Image,
    log_illuminances: Vec<I6F26, ILLUMINANCES_MAX>,
    log_intervals: Vec<I6F26, INTERVALS_MAX>,
}

impl L2aTable {
    /// A table of `l2a[r·intervals.len() + c]` at `illuminances_lx[r]` and `intervals[c]`.
    ///
    /// # Errors
    ///
    /// [`TableError`] for the first wrong entry: axes have 1 to [`ILLUMINANCES_MAX`] and [`INTERVALS_MAX`] entries, strictly ascending, of
    /// 0.01 to 1 000 000 lx and 0.05 to 15; values are 0.2 to 4.
    pub fn new(illuminances_lx: &[f32], intervals: &[f32], l2a: &[f32]) -> Result<Self, TableError> {
        let illuminances: Vec<Illuminance, ILLUMINANCES_MAX> = quantised(Quantity::IlluminanceLx, illuminances_lx)?;
        let intervals: Vec<Interval, INTERVALS_MAX> = quantised(Quantity::Interval, intervals)?;
        let (count, needed) = (l2a.len(), illuminances.len() * intervals.len());
        if count != needed {
            return Err(TableError::ValueCount { count, needed });
        }
        let values: Vec<L2a, VALUES_MAX> = quantised(Quantity::L2a, l2a)?;
        check_lengths(illuminances.len(), intervals.len())?;
        Self::of(image::of(&illuminances, &intervals, &values)).checked()
    }

    /// The table shipped with the firmware: the ratios of least loss of range for cameras of unknown exposure and detector, computed by
    /// `vocc table regret` and checked in as `link/shipped_table.toml`, which records its inputs.
    pub fn shipped() -> Self {
        Self::of(image::of(
            &shipped_table::ILLUMINANCES_LX.map(Illuminance::saturating_from_num),
            &shipped_table::INTERVALS.map(Interval::saturating_from_num),
            &shipped_table::L2A.map(L2a::saturating_from_num),
        ))
    }

    /// The table of an image whose axes have valid lengths.
    fn of(image: Image) -> Self {
        let parts = Parts::of(&image);
        let (log_illuminances, log_intervals) = (
            parts.illuminances().map(log2).collect(),
            parts.intervals().map(|interval| log2(interval.into())).collect(),
        );
        Self {
            image,
            log_illuminances,
            log_intervals,
        }
    }

    /// The same table, if its numbers are valid.
    fn checked(self) -> Result<Self, TableError> {
        let parts = Parts::of(&self.image);
        check_axis(Quantity::IlluminanceLx, parts.illuminances(), &self.log_illuminances)?;
        check_axis(Quantity::Interval, parts.intervals(), &self.log_intervals)?;
        for (index, value) in parts.values().enumerate() {
            check_range(Quantity::L2a, index, value)?;
        }
        Ok(self)
    }

    /// The L2A at that illuminance and interval; outside the axes, the value of the nearest edge.
    ///
    /// The result lies between the four surrounding values, is continuous, and is exact at the nodes.
    pub fn l2a(&self, illuminance_lx: Illuminance, interval: Interval) -> L2a {
        let row = Segment::on(&self.log_illuminances, log2(illuminance_lx));
        let column = Segment::on(&self.log_intervals, log2(interval.into()));
        let parts = Parts::of(&self.image);
        let along = |row: usize| column.between(|column| parts.finer_value(row, column));
        // Interpolated in finer steps than the result's, so that only the last rounding matters.
        L2a::from_bits(((row.between(along) + HALF) >> FINER) as u16)
    }

    /// The illuminances of its rows, ascending.
    pub fn illuminances_lx(&self) -> Vec<Illuminance, ILLUMINANCES_MAX> {
        Parts::of(&self.image).illuminances().collect()
    }

    /// The intervals of its columns, ascending.
    pub fn intervals(&self) -> Vec<Interval, INTERVALS_MAX> {
        Parts::of(&self.image).intervals().collect()
    }

    /// Its values, row by row: the value at illuminance r and interval c has the number r·(intervals) + c.
    pub fn values(&self) -> Vec<L2a, VALUES_MAX> {
        Parts::of(&self.image).values().collect()
    }
}

impl Default for L2aTable {
    /// [`L2aTable::shipped`].
    fn default() -> Self {
        Self::shipped()
    }
}

/// Extra fractional bits during interpolation.
const FINER: u32 = 16;
const HALF: i64 = 1 << (FINER - 1);

/// Two neighbouring entries of an axis, and the position of a value between them.
struct Segment {
    below: usize,
    above: usize,
    /// From `below` (0) to `above` (1 << 16).
    fraction: i64,
}

impl Segment {
    fn on(axis: &[I6F26], value: I6F26) -> Self {
        let above = axis.partition_point(|&entry| entry <= value);
        let below = above.saturating_sub(1);
        match (axis.get(below), axis.get(above)) {
            (Some(&from), Some(&to)) if from <= value && from < to => {
                let (part, whole) = (
                    i64::from(value.to_bits()) - i64::from(from.to_bits()),
                    i64::from(to.to_bits()) - i64::from(from.to_bits()),
                );
                Self {
                    below,
                    above,
                    fraction: (part << 16) / whole,
                }
            }
            _ => Self {
                below,
                above: below,
                fraction: 0,
            },
        }
    }

    fn between(&self, value: impl Fn(usize) -> i64) -> i64 {
        let (from, to) = (value(self.below), value(self.above));
        from + (((to - from) * self.fraction) >> 16)
    }
}

/// log₂ of `value`, to [`LOG2_ERROR_MAX`]; 0 counts as the smallest positive value.
///
/// It squares the mantissa m, which is 1 to 2, again and again: each time the square reaches 2, the next bit of the logarithm is 1.
///
/// ```
/// use link::l2a_table::{Illuminance, log2};
/// assert_eq!(log2(Illuminance::from_num(1024)), 10);
/// ```
pub fn log2(value: Illuminance) -> I6F26 {
    let bits = value.to_bits().max(1);
    let exponent = bits.ilog2();
    let mut log = exponent.cast_signed() - Illuminance::FRAC_NBITS.cast_signed();
    // The mantissa with 31 fractional bits.
    let mut mantissa = u64::from(bits) << (31 - exponent);
    for _ in 0..I6F26::FRAC_NBITS {
        mantissa = (mantissa * mantissa) >> 31;
        let doubled = mantissa >> 32;
        mantissa >>= doubled;
        log = log << 1 | doubled as i32;
    }
    I6F26::from_bits(log)
}

fn check_lengths(rows: usize, columns: usize) -> Result<(), TableError> {
    let axes = [
        (Quantity::IlluminanceLx, rows, ILLUMINANCES_MAX),
        (Quantity::Interval, columns, INTERVALS_MAX),
    ];
    let wrong = axes.into_iter().find(|&(_, count, most)| !(1..=most).contains(&count));
    wrong.map_or(Ok(()), |(quantity, count, most)| Err(quantity.wrong_length(count, most)))
}

/// Numbers rounded to fixed point, checked for count and range.
fn quantised<T: Fixed, const MOST: usize>(quantity: Quantity, given: &[f32]) -> Result<Vec<T, MOST>, TableError> {
    let (least, most) = quantity.range();
    let mut numbers = Vec::new();
    for (index, &value) in given.iter().enumerate() {
        if !(least..=most).contains(&value) {
            return Err(quantity.out_of_range(index, value));
        }
        let too_long = |_| quantity.wrong_length(given.len(), MOST);
        numbers.push(T::saturating_from_num(value)).map_err(too_long)?;
    }
    Ok(numbers)
}

fn check_range<T: Fixed>(quantity: Quantity, index: usize, value: T) -> Result<(), TableError> {
    let (least, most) = quantity.range();
    if (T::saturating_from_num(least)..=T::saturating_from_num(most)).contains(&value) {
        Ok(())
    } else {
        Err(quantity.out_of_range(index, value.to_num()))
    }
}

/// Checks an axis, whose logarithms are given too, for range and order.
fn check_axis<T: Fixed>(quantity: Quantity, axis: impl Iterator<Item = T>, logs: &[I6F26]) -> Result<(), TableError> {
    let mut before: Option<(T, I6F26)> = None;
    for (index, (value, &log)) in axis.zip(logs).enumerate() {
        check_range(quantity, index, value)?;
        if let Some((previous, previous_log)) = before
            && log - previous_log < I6F26::from_num(AXIS_STEP_MIN_LOG2)
        {
            return Err(TableError::NotAscending {
                quantity,
                index,
                value: value.to_num(),
                previous: previous.to_num(),
            });
        }
        before = Some((value, log));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    /// An ascending axis of `count` entries within a range, from numbers in 0 to 1.
    fn axis(steps: &[f32], least: f32, most: f32) -> std::vec::Vec<f32> {
        let whole: f32 = steps.iter().map(|step| step + 0.05).sum::<f32>() + 0.05;
        let mut sum = 0.0;
        steps
            .iter()
            .map(|step| {
                sum += step + 0.05;
                least * (most / least).powf(sum / whole)
            })
            .collect()
    }

    prop_compose! {
        fn any_table()(
            illuminances in prop::collection::vec(0.0_f32..1.0, 1..=16),
            intervals in prop::collection::vec(0.0_f32..1.0, 1..=8),
        )(
            values in prop::collection::vec(0.2_f32..=4.0, illuminances.len() * intervals.len()),
            illuminances in Just(illuminances), intervals in Just(intervals),
        ) -> L2aTable {
            L2aTable::new(&axis(&illuminances, 0.1, 200_000.0), &axis(&intervals, 0.1, 10.0), &values).unwrap()
        }
    }

    /// Any illuminance, uniform in its logarithm.
    fn any_illuminance() -> impl Strategy<Value = Illuminance> {
        (any::<u32>(), 0_u32..32).prop_map(|(bits, shift)| Illuminance::from_bits(bits >> shift))
    }

    fn any_interval() -> impl Strategy<Value = Interval> {
        (any::<u16>(), 0_u32..16).prop_map(|(bits, shift)| Interval::from_bits(bits >> shift))
    }

    properties! {
        #[test]
        fn log2_is_within_its_bound(value in any_illuminance()) {
            prop_assume!(value != 0);
            let error = log2(value).to_num::<f64>() - value.to_num::<f64>().log2();
            prop_assert!(error.abs() <= LOG2_ERROR_MAX, "{error} at {value}");
        }

        #[test]
        fn log2_is_monotone(bits: u32) {
            prop_assert!(log2(Illuminance::from_bits(bits)) <= log2(Illuminance::from_bits(bits.saturating_add(1))));
        }

        #[test]
        fn the_nodes_have_their_values(table in any_table()) {
            for (r, &illuminance) in table.illuminances_lx().iter().enumerate() {
                for (c, &interval) in table.intervals().iter().enumerate() {
                    prop_assert_eq!(table.l2a(illuminance, interval), table.values()[r * table.intervals().len() + c]);
                }
            }
        }

        #[test]
        fn every_result_lies_within_the_four_values_around(table in any_table(), e in any_illuminance(), i in any_interval()) {
            let columns = table.intervals().len();
            let around = |place: usize, count: usize| [place.saturating_sub(1), place.min(count - 1)];
            let rows = around(table.illuminances_lx().partition_point(|&node| node <= e), table.illuminances_lx().len());
            let cells = around(table.intervals().partition_point(|&node| node <= i), columns);
            let corners = rows.map(|r| cells.map(|c| table.values()[r * columns + c]));
            let corners = corners.as_flattened();
            let l2a = table.l2a(e, i);
            prop_assert!(corners.iter().min().unwrap() <= &l2a && &l2a <= corners.iter().max().unwrap());
        }

        #[test]
        fn it_is_the_bilinear_interpolation_in_logarithms(table in any_table(), e in any_illuminance(), i in any_interval()) {
            let place = |axis: &[f64], value: f64| {
                let value = value.max(axis[0]).min(axis[axis.len() - 1]);
                let below = axis.partition_point(|&node| node <= value).clamp(1, axis.len().max(2) - 1) - 1;
                let above = (below + 1).min(axis.len() - 1);
                let span = (axis[above] / axis[below]).log2();
                (below, above, if span > 0.0 { (value / axis[below]).log2() / span } else { 0.0 })
            };
            let rows: std::vec::Vec<f64> = table.illuminances_lx().iter().map(|node| node.to_num()).collect();
            let columns: std::vec::Vec<f64> = table.intervals().iter().map(|node| node.to_num()).collect();
            let r = place(&rows, e.to_num());
            let c = place(&columns, i.to_num());
            let value = |row: usize, column: usize| table.values()[row * columns.len() + column].to_num::<f64>();
            let along = |row| value(row, c.0) + c.2 * (value(row, c.1) - value(row, c.0));
            let exact = along(r.0) + r.2 * (along(r.1) - along(r.0));
            let error = (table.l2a(e, i).to_num::<f64>() - exact).abs();
            prop_assert!(error < 0.0005, "{error}");
        }

        #[test]
        fn it_is_continuous(table in any_table(), e in any_illuminance(), i in any_interval()) {
            // Nodes of the tables made here are at least log₂(100)·0.05/8.45 = 0.039 apart in log₂, so that L2A
            // changes by at most 3.8/0.039 < 100 a unit of log₂. One step of an argument is this much of it:
            let step = |bits: f64| (1.0 + 1.0 / bits.max(1.0)).log2();
            let jump = |next: L2a| (next.to_num::<f64>() - table.l2a(e, i).to_num::<f64>()).abs();
            let allowed = |bits: f64| 100.0 * step(bits) + 0.001;
            let next_e = table.l2a(Illuminance::from_bits(e.to_bits().saturating_add(1)), i);
            prop_assert!(jump(next_e) <= allowed(e.to_bits().into()));
            let next_i = table.l2a(e, Interval::from_bits(i.to_bits().saturating_add(1)));
            prop_assert!(jump(next_i) <= allowed(i.to_bits().into()));
        }

        #[test]
        fn it_rises_where_the_table_rises(
            steps in prop::collection::vec(0.0_f32..0.3, 12),
            one in any_illuminance(), other in any_illuminance(), i in any_interval(),
        ) {
            let mut value = 0.2;
            let values: std::vec::Vec<f32> = steps.iter().map(|step| { value += step; value }).collect();
            let table = L2aTable::new(&[10.0, 100.0, 200.0, 5000.0], &[0.5, 1.0, 2.0], &values).unwrap();
            let (low, high) = (one.min(other), one.max(other));
            prop_assert!(table.l2a(low, i) <= table.l2a(high, i));
        }

        #[test]
        fn any_numbers_are_taken_or_refused_without_panic(
            illuminances in prop::collection::vec(any::<f32>(), 0..20), intervals in prop::collection::vec(any::<f32>(), 0..10),
            values in prop::collection::vec(any::<f32>(), 0..20), e in any_illuminance(), i in any_interval(),
        ) {
            if let Ok(table) = L2aTable::new(&illuminances, &intervals, &values) {
                prop_assert!((L2A_MIN - 0.001..=L2A_MAX).contains(&table.l2a(e, i).to_num::<f32>()));
            }
        }
    }

    #[test]
    fn log2_is_within_its_bound_at_the_powers_of_two_and_beside_them() {
        for bits in (0..32).flat_map(|shift| [1_u32 << shift, (1 << shift) + 1, u32::MAX >> shift]) {
            let value = Illuminance::from_bits(bits);
            let error = log2(value).to_num::<f64>() - value.to_num::<f64>().log2();
            assert!(error.abs() <= LOG2_ERROR_MAX, "{error} at {value}");
        }
    }

    #[test]
    fn the_shipped_table_is_one() {
        let (illuminances, intervals) = (shipped_table::ILLUMINANCES_LX, shipped_table::INTERVALS);
        let checked = L2aTable::new(&illuminances, &intervals, &shipped_table::L2A);
        assert_eq!(checked, Ok(L2aTable::shipped()));
    }

    #[test]
    fn errors_name_the_entry_the_value_and_the_range() {
        let message = |illuminances: &[f32], intervals: &[f32], values: &[f32]| {
            L2aTable::new(illuminances, intervals, values).unwrap_err().to_string()
        };
        assert_eq!(
            message(&[1.0, 2.0], &[1.0], &[1.0, 5.0]),
            "L2A number 1 (from 0) of the table is 5, it must be 0.2 to 4"
        );
        assert_eq!(
            message(&[1.0, f32::NAN], &[1.0], &[1.0, 1.0]),
            "illuminance in lx number 1 (from 0) of the table is NaN, it must be 0.01 to 1000000"
        );
        assert!(message(&[1.0], &[2.0, 1.0], &[1.0, 1.0]).starts_with("interval number 1 (from 0) of the table is 1,"));
        assert!(message(&[], &[1.0], &[]).starts_with("the table has 0 entries of illuminance in lx, 1 to 16"));
        assert!(message(&[1.0], &[1.0; 9], &[1.0; 9]).contains("interval"));
        assert!(message(&[1.0], &[1.0], &[1.0; 2]).starts_with("the table has 2 values of L2A, 1 are needed"));
        let many: std::vec::Vec<f32> = (1..=17).map(|n| n as f32).collect();
        assert!(message(&many, &[1.0], &[1.0; 17]).starts_with("the table has 17 entries"));
    }
}
