//! Bits from the features of cells.

/// The darkest that a mean is taken for in a ratio (grey): half a level is what rounding leaves unknown.
pub const DARKEST_GREY: f32 = 0.5;
/// The least difference between the brightest and the darkest cell's mean that can be told from rounding (grey). Higher:
/// faint panels are refused; lower: rounding is read as bits.
pub const MIN_CONTRAST_GREY: f32 = 0.5;
/// A cell of a brighter mean is white, but for what a codec leaves of that (grey). Higher: ripples of white are read as bits.
pub const WHITE_GREY: f32 = 248.0;
/// White cells of a panel that is read, at most (count): scrambled bits light 32 ± 4 LEDs. Higher: what shines over from its
/// neighbours is read as an LED; lower: bright panels with many LEDs On are refused.
pub const WHITE_CELLS_MAX: usize = 48;
/// What is added to each standardised feature's variance within a class (share of its variance in the panel). Higher:
/// all soft values are less sure; none: those of a frame without noise are infinite.
pub const VARIANCE_FLOOR: f32 = 0.01;
/// Rounds of Lloyd's algorithm, at most (count): it ends when no cell changes sides, which 64 cells in two groups have
/// always done in far fewer.
pub const KMEANS_ROUNDS: usize = 32;
/// Cells of either class from which a covariance is taken, at least (count). Fewer: discriminants of little training.
pub const FISHER_CELLS: u64 = 16;
/// A feature's variance within its class, at least (share of that between the classes): below, the training frames had
/// no noise.
pub const FISHER_FLOOR: f64 = 1e-6;
