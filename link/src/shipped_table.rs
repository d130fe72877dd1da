//! The table that the firmware ships with, made from a table file by `vocc table show FILE --rust`.

/// Ambient illuminances of its rows, lx.
#[rustfmt::skip]
pub const ILLUMINANCES_LX: [f32; 4] = [50.0, 300.0, 2000.0, 16000.0];

/// LED intervals of its columns.
#[rustfmt::skip]
pub const INTERVALS: [f32; 4] = [0.5, 1.0, 1.5, 2.0];

/// Its ratios, row by row.
#[rustfmt::skip]
pub const L2A: [f32; 16] = [2.23, 3.858, 4.0, 3.906, 1.887, 2.953, 2.86, 2.78, 1.627, 2.7, 2.62, 2.54, 1.427, 2.54, 2.1, 2.1];
