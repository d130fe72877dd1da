//! Sums of rotating phasors.

/// The fractional part: x − ⌊x⌋.
pub(super) fn frac(x: f32) -> f32 {
    x - libm::floorf(x)
}

/// A sum of phasors, as cosine and sine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sum([f32; 2]);

impl Sum {
    pub const ZERO: Self = Self([0.0; 2]);

    /// Adds an amplitude at the negative of a phase (cycles).
    pub fn add(&mut self, amplitude: f32, phase: f32) {
        let (cosine, sine) = (sine(phase + 0.25), sine(phase));
        self.0[0] += amplitude * cosine;
        self.0[1] -= amplitude * sine;
    }

    /// Adds another sum, rotated backwards by a phase (cycles).
    pub fn add_turned(&mut self, other: &Self, phase: f32) {
        let (cosine, sine) = (sine(phase + 0.25), sine(phase));
        let [re, im] = other.0;
        self.0[0] += re * cosine + im * sine;
        self.0[1] += im * cosine - re * sine;
    }

    pub fn size(&self) -> f32 {
        libm::sqrtf(self.power())
    }

    pub fn power(&self) -> f32 {
        let [re, im] = self.0;
        re * re + im * im
    }

    /// The phase of the sum (cycles): that of a wave cos 2π(x + phase).
    pub fn phase(&self) -> f32 {
        let [re, im] = self.0;
        libm::atan2f(im, re) / core::f32::consts::TAU
    }
}

/// sin 2πx with an error of at most 0.0011 for |x| below 10⁴: a parabola and its square as a correction.
fn sine(x: f32) -> f32 {
    // The nearest whole number or nearly so, by the fastest method.
    let x = x - ((x + 16384.5) as i32 - 16384) as f32;
    let parabola = 8.0 * x - 16.0 * x * x.abs();
    0.775 * parabola + 0.225 * parabola * parabola.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_are_as_good_as_stated() {
        for i in -3000..3000 {
            let x = i as f32 / 1000.0;
            assert!((sine(x) - libm::sinf(core::f32::consts::TAU * x)).abs() < 1.1e-3, "{x}");
        }
    }
}
