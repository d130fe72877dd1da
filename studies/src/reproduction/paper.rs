//! Numbers that the text of section 4.4 states for its figures; the figures mark them.

/// The L2A beyond which Bvar "barely increases", at interval 1 and 50 m (figure 14a).
pub const BVAR_LEVELS_OFF_L2A: f64 = 2.5;
/// The best L2A at interval 1 and 50 m (figure 14b).
pub const BEST_L2A: f64 = 2.0;
/// The interval up to which Bvar increases, at L2A 1 and 50 m (figure 17a).
pub const BVAR_PEAK_INTERVAL: f64 = 1.5;
