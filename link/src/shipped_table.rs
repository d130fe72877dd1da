//! The table that the firmware ships with, made from a table file by `vocc table show FILE --rust`.

/// Ambient illuminances of its rows, lx.
#[rustfmt::skip]
pub const ILLUMINANCES_LX: [f32; 1] = [1000.0];

/// LED intervals of its columns.
#[rustfmt::skip]
pub const INTERVALS: [f32; 4] = [0.5, 1.0, 1.5, 2.0];

/// Its ratios, row by row.
#[rustfmt::skip]
pub const L2A: [f32; 4] = [1.35, 2.05, 2.95, 3.9];
