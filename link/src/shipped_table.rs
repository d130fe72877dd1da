//! The table that the firmware ships with, made from a table file by `vocc table show FILE --rust`.

/// Ambient illuminances of its rows, lx.
#[rustfmt::skip]
pub const ILLUMINANCES_LX: [f32; 4] = [50.0, 300.0, 2000.0, 16000.0];

/// LED intervals of its columns.
#[rustfmt::skip]
pub const INTERVALS: [f32; 4] = [0.5, 1.0, 1.5, 2.0];

/// Its ratios, row by row.
#[rustfmt::skip]
pub const L2A: [f32; 16] = [2.72, 3.867, 3.911, 3.955, 0.964, 1.856, 2.877, 3.796, 0.753, 1.428, 2.264, 3.292, 0.72, 1.23, 1.956, 2.63];
