//! A function of one variable, tabulated for whole rows of pixels.
//!
//! Pixels are one apart, so a row of them samples a function at positions that share one sub-pixel phase. The table holds such rows at
//! equally spaced phases, each contiguous; between two phases it interpolates linearly, which is one vector operation.

/// Rows of f32 at `phases` + 1 phases from 0 to 1.
///
/// With n phases the interpolation errs by at most max|f''|/(8·n²), and the table holds f rounded to f32.
#[derive(Clone, Debug)]
pub struct PhaseTable {
    phases: usize,
    length: usize,
    values: Vec<f32>,
}

impl PhaseTable {
    /// Rows of `length` values at `phases` + 1 phases (at least 2); `fill` gets a phase from 0 to 1 and the row to fill.
    pub fn new(phases: usize, length: usize, fill: impl Fn(f64, &mut [f64])) -> Self {
        let phases = phases.max(1);
        let mut exact = vec![0.0; length];
        let mut values = Vec::with_capacity((phases + 1) * length);
        for phase in 0..=phases {
            fill(phase as f64 / phases as f64, &mut exact);
            values.extend(exact.iter().map(|&value| value as f32));
        }
        Self { phases, length, values }
    }

    /// The length of a row.
    pub fn length(&self) -> usize {
        self.length
    }

    /// The rows on either side of a phase from 0 to 1, and the fraction of the way between them.
    #[inline(always)]
    pub fn around(&self, phase: f64) -> (&[f32], &[f32], f32) {
        let place = phase.clamp(0.0, 1.0) * self.phases as f64;
        let index = (place as usize).min(self.phases - 1);
        let start = index * self.length;
        let (left, right) = self.values[start..start + 2 * self.length].split_at(self.length);
        (left, right, (place - index as f64) as f32)
    }
}
