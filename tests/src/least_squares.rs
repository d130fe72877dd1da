//! The light of the 64 LEDs of a blurred panel by linear least squares: how ill-conditioned that is, and what a ridge chosen by it
//! makes of it.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use rx_pipeline::corners::Corners;

/// One number for each LED.
type Light = SVector<f64, 64>;

/// The image of each LED of light 1 in a frame, and the eigenvalues of the normal equations.
pub struct Operator {
    /// For each pixel its share of each LED.
    rows: Vec<Light>,
    vectors: SMatrix<f64, 64, 64>,
    values: Light,
}

impl Operator {
    /// LEDs at `corners` whose images are Gaussians of `variance_px2`, in a frame of `width` × `height` pixels.
    pub fn new(corners: &Corners, variance_px2: f64, [width, height]: [usize; 2]) -> Self {
        let homography = corners.homography();
        let centres: [[f64; 2]; 64] =
            std::array::from_fn(|led| homography.to_image([(led % 8) as f64, (led / 8) as f64]));
        let pixel = |x: usize, y: usize| {
            Light::from_fn(|led, _| {
                let [cx, cy] = centres[led];
                let square = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2);
                (-0.5 * square / variance_px2).exp() / (std::f64::consts::TAU * variance_px2)
            })
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let rows: Vec<Light> = places.map(|(x, y)| pixel(x, y)).collect();
        let mut normal = SMatrix::<f64, 64, 64>::zeros();
        for row in &rows {
            normal.ger(1.0, row, row, 1.0);
        }
        let eigen = normal.symmetric_eigen();
        Self {
            rows,
            vectors: eigen.eigenvectors,
            values: eigen.eigenvalues,
        }
    }

    /// The greatest eigenvalue of the normal equations over the least.
    pub fn condition(&self) -> f64 {
        self.values.max() / self.values.min().max(f64::MIN_POSITIVE)
    }

    /// The ridge that amplifies no direction in which there is more noise than light: none where the condition number is below
    /// `signal_to_noise`, the ratio of their variances along the direction that is seen best, else the greatest eigenvalue over it.
    pub fn ridge(&self, signal_to_noise: f64) -> f64 {
        if self.condition() <= signal_to_noise {
            0.0
        } else {
            self.values.max() / signal_to_noise
        }
    }

    /// The greatest eigenvalue: a panel's light along the direction that is seen best, over the light.
    pub fn gain(&self) -> f64 {
        self.values.max()
    }

    /// By how much the light of each LED exceeds their mean, by least squares that are drawn towards the mean by `ridge`.
    pub fn solve(&self, pixels: &[f64], ridge: f64) -> [f64; 64] {
        let mean = self.background_and_mean(pixels);
        let mut right = Light::zeros();
        for (row, pixel) in self.rows.iter().zip(pixels) {
            right += row * (pixel - mean[0] - mean[1] * row.sum());
        }
        let along = self.vectors.transpose() * right;
        let light = self.vectors * along.zip_map(&self.values, |a, value| a / (value + ridge));
        light.into()
    }

    /// Background, and the light of LEDs that are all alike.
    fn background_and_mean(&self, pixels: &[f64]) -> Vector2<f64> {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for (row, &pixel) in self.rows.iter().zip(pixels) {
            let slopes = Vector2::new(1.0, row.sum());
            normal += slopes * slopes.transpose();
            right += slopes * pixel;
        }
        normal
            .cholesky()
            .map_or(Vector2::zeros(), |factors| factors.solve(&right))
    }
}

/// The 32 LEDs of most light.
pub fn brighter_half(light: &[f64; 64]) -> u64 {
    let mut order: [usize; 64] = std::array::from_fn(|led| led);
    order.sort_by(|&a, &b| light[b].total_cmp(&light[a]));
    order[..32].iter().fold(0, |bits, led| bits | 1 << led)
}
