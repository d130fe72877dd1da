//! The normal distribution's density and its integrals, from a table, because an LED's blurred image needs thousands of them.

/// The table's range to either side, in standard deviations.
const REACH: usize = 6;
/// Its lines per standard deviation.
const FINE: usize = 16;
const LINES: usize = 2 * REACH * FINE + 1;

/// The density, its integral and the integral of that, at a number of standard deviations.
#[derive(Clone, Copy)]
pub(super) struct Integrals {
    /// φ(t).
    pub density: f64,
    /// Φ(t): the integral of φ from −∞ to t.
    pub once: f64,
    /// t·Φ(t) + φ(t): the integral of Φ from −∞ to t.
    pub twice: f64,
}

/// Lines of the table, from −[`REACH`] on.
pub(super) struct Gauss([Integrals; LINES]);

impl Gauss {
    /// An empty table.
    pub const EMPTY: Self = Self(
        [Integrals {
            density: 0.0,
            once: 0.0,
            twice: 0.0,
        }; LINES],
    );
    /// The greatest error of any of the three.
    #[cfg(test)]
    const ERROR: f64 = 3e-6;

    /// Computes the table, if it is empty.
    pub fn prepare(&mut self) {
        if self.0[LINES - 1].once > 0.0 {
            return;
        }
        for (line, integrals) in self.0.iter_mut().enumerate() {
            let t = place(line);
            let density = libm::exp(-0.5 * t * t) / libm::sqrt(core::f64::consts::TAU);
            let once = 0.5 * libm::erfc(-t * core::f64::consts::FRAC_1_SQRT_2);
            *integrals = Integrals {
                density,
                once,
                twice: t * once + density,
            };
        }
    }

    /// A Taylor series about the nearest line, to the third power for the integrals and to the second for the density.
    pub fn at(&self, t: f64) -> Integrals {
        let end = REACH as f64;
        let inside = t.clamp(-end, end);
        let line = ((inside + end) * FINE as f64 + 0.5) as usize;
        let near = self.0[line.min(LINES - 1)];
        let (at, p) = (place(line), near.density);
        let off = inside - at;
        // Derivatives of φ: φ' = −t·φ, φ'' = (t² − 1)·φ.
        let (first, second) = (-at * p, (at * at - 1.0) * p);
        Integrals {
            density: p + off * (first + off / 2.0 * second),
            once: near.once + off * (p + off / 2.0 * (first + off / 3.0 * second)),
            // Beyond the end, Φ is 0 or 1.
            twice: near.twice + off * (near.once + off / 2.0 * (p + off / 3.0 * first)) + (t - inside).max(0.0),
        }
    }
}

fn place(line: usize) -> f64 {
    line as f64 / FINE as f64 - REACH as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    properties! {
        #[test]
        fn the_table_keeps_its_bound(t in -9.0f64..9.0) {
            let mut table = Gauss::EMPTY;
            table.prepare();
            let density = libm::exp(-0.5 * t * t) / libm::sqrt(core::f64::consts::TAU);
            let once = 0.5 * libm::erfc(-t / core::f64::consts::SQRT_2);
            let told = table.at(t);
            for (told, truth) in [(told.density, density), (told.once, once), (told.twice, t * once + density)] {
                prop_assert!((told - truth).abs() < Gauss::ERROR, "{t}: {told}, not {truth}");
            }
        }
    }
}
