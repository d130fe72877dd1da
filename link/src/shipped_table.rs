//! The table that the firmware ships with, made from a table file by `vocc table show FILE --rust`.

/// Ambient illuminances of its rows, lx.
#[rustfmt::skip]
pub const ILLUMINANCES_LX: [f32; 4] = [50.0, 300.0, 2000.0, 16000.0];

/// LED intervals of its columns.
#[rustfmt::skip]
pub const INTERVALS: [f32; 4] = [0.5, 1.0, 1.5, 2.0];

/// Its ratios, row by row.
#[rustfmt::skip]
pub const L2A: [f32; 16] = [2.178, 3.763, 3.884, 3.899, 1.924, 3.45, 3.814, 3.849, 1.6, 2.661, 3.174, 3.606, 1.442, 2.091, 2.607, 2.722];
