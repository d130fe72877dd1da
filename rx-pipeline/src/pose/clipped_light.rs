//! The moments of a pixel's light if sensors clip at white.

pub(super) struct ClippedLight {
    pub mean: f64,
    pub variance: f64,
    /// The derivative of the mean by the light.
    pub slope: f64,
}

impl ClippedLight {
    /// Moments of a normal number clipped at white; `None` if nearly all of it is clipped.
    pub fn at(mean: f64, variance: f64, white: f64) -> Option<Self> {
        const CLEAR: f64 = 6.0;
        const LOST: f64 = -1.0;
        let deviation = libm::sqrt(variance);
        let z = (white - mean) / deviation;
        if z > CLEAR {
            return Some(Self {
                mean,
                variance,
                slope: 1.0,
            });
        }
        if z.is_nan() || z < LOST {
            return None;
        }
        let below = 0.5 * libm::erfc(-z * core::f64::consts::FRAC_1_SQRT_2);
        let density = libm::exp(-0.5 * z * z) / libm::sqrt(core::f64::consts::TAU);
        // Relative to white, so that nothing cancels: (x − white)/deviation, clipped at 0.
        let first = -z * below - density;
        let second = (1.0 + z * z) * below + z * density;
        Some(Self {
            mean: white + deviation * first,
            variance: variance * (second - first * first),
            slope: below,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_cut_light_are_those_of_its_density() {
        for z in [-0.9, 0.0, 1.0, 3.0] {
            let (white, deviation) = (5.0, 0.4);
            let mean = white - z * deviation;
            let clipped = ClippedLight::at(mean, deviation * deviation, white).unwrap();
            let (mut first, mut second, step) = (0.0, 0.0, 1e-3);
            for i in -8000..8000 {
                let at = f64::from(i) * step;
                let share = step * libm::exp(-0.5 * at * at) / libm::sqrt(core::f64::consts::TAU);
                let read = (mean + deviation * at).min(white);
                first += share * read;
                second += share * read * read;
            }
            assert!((clipped.mean - first).abs() < 1e-4 && (clipped.variance - (second - first * first)).abs() < 1e-4);
        }
    }
}
