//! The axes of a table to be made.

use link::l2a_table::{L2A_MIN, L2aTable, TableError};

/// That illuminances in lx and intervals are axes that a transmitter's table can have.
///
/// # Errors
/// Names the first value that is not.
pub(super) fn check_axes(illuminance_lx: &[f64], interval: &[f64]) -> Result<(), TableError> {
    let single = |axis: &[f64]| axis.iter().map(|&value| value as f32).collect::<Vec<_>>();
    let ratios = vec![L2A_MIN; illuminance_lx.len() * interval.len()];
    L2aTable::new(&single(illuminance_lx), &single(interval), &ratios).map(drop)
}
