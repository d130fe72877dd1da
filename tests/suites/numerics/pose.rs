//! Poses of panels with little information: 200 m away, and nearly edge-on. An unscaled solution in f32 is wrong; the receiver's errors
//! match its covariance.

use glam::{DMat3, DVec3};
use nalgebra::{Cholesky, SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rx_pipeline::pose::{PlaneFit, PlaneImage, Pose, PoseMemory};
use vocc_tests::poses::{image_of, nees};

/// For a pitch of 60 mm; the camera has 25 mm and 6.875 µm.
const HALF_SIDE_M: f64 = 0.21;
const FOCAL_PX: f64 = 25e-3 / 6.875e-6;
/// Standard deviation of an LED's image position (px).
const SIGMA_PX: f64 = 0.02;

type Matrix8 = SMatrix<f64, 8, 8>;
type Vector8 = SVector<f64, 8>;

/// A true pose, its measured LED positions, and the fitted image.
struct Observation {
    place: DVec3,
    rotation: DMat3,
    leds: Vec<([f64; 2], [f64; 2])>,
    fit: PlaneFit,
}

fn seen(seed: u64, distance_m: f64, yaw_deg: f64) -> Observation {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut turn = |most: f64| random.random_range(-most..most);
    let rotation =
        DMat3::from_rotation_z(turn(0.2)) * DMat3::from_rotation_y((yaw_deg + turn(2.0)).to_radians()) * DMat3::from_rotation_x(turn(0.2));
    let place = DVec3::new(turn(0.1), turn(0.1), 1.0) * distance_m;
    let leds: Vec<_> = (0..64)
        .map(|led| {
            let at = [led % 8, led / 8].map(|line| f64::from(line) / 3.5 - 1.0);
            let point = rotation * DVec3::new(at[0], at[1], 0.0) * HALF_SIDE_M + place;
            let mut noise = || SIGMA_PX / FOCAL_PX * random.sample::<f64, _>(StandardNormal);
            (at, [point.x / point.z + noise(), point.y / point.z + noise()])
        })
        .collect();
    let fit = fitted(&leds, (place, rotation));
    Observation {
        place,
        rotation,
        leds,
        fit,
    }
}

/// Gauss-Newton on the eight parameters, scaled, from the true values.
fn fitted(leds: &[([f64; 2], [f64; 2])], (place, rotation): (DVec3, DMat3)) -> PlaneFit {
    let mut image = image_of((place, rotation), HALF_SIDE_M);
    let size = HALF_SIDE_M / place.z;
    let unit = Vector8::from_fn(|i, _| if i < 6 { size } else { 1.0 });
    let moved = |image: &PlaneImage, step: &Vector8| PlaneImage {
        centre: [image.centre[0] + step[0], image.centre[1] + step[1]],
        column: [image.column[0] + step[2], image.column[1] + step[3]],
        row: [image.row[0] + step[4], image.row[1] + step[5]],
        tilt: [image.tilt[0] + step[6], image.tilt[1] + step[7]],
    };
    let mut normal = Matrix8::zeros();
    for _ in 0..5 {
        normal = Matrix8::zeros();
        let mut gradient = Vector8::zeros();
        for (at, measured) in leds {
            let here = image.direction(*at);
            for axis in 0..2 {
                let slopes = Vector8::from_fn(|number, _| {
                    let mut step = Vector8::zeros();
                    step[number] = 1e-5 * unit[number];
                    let (ahead, behind) = (moved(&image, &step), moved(&image, &-step));
                    (ahead.direction(*at)[axis] - behind.direction(*at)[axis]) / 2e-5
                });
                let weight = (FOCAL_PX / SIGMA_PX).powi(2);
                normal += slopes * slopes.transpose() * weight;
                gradient += slopes * (measured[axis] - here[axis]) * weight;
            }
        }
        let step = Cholesky::new(normal).expect("all is told").solve(&gradient);
        image = moved(&image, &step.component_mul(&unit));
    }
    PlaneFit {
        image,
        information: std::array::from_fn(|i| std::array::from_fn(|j| normal[(i, j)] / (unit[i] * unit[j]))),
    }
}

/// Range by the direct linear transform of unscaled pixels, by normal equations in f32, and the column norms.
fn naive_range_m(leds: &[([f64; 2], [f64; 2])]) -> f64 {
    let mut normal = SMatrix::<f32, 8, 8>::zeros();
    let mut right = SVector::<f32, 8>::zeros();
    for ([u, v], measured) in leds {
        let [u, v] = [u, v].map(|c| (c * HALF_SIDE_M) as f32);
        let [x, y] = [measured[0] + 0.264, measured[1] + 0.148].map(|c| (c * FOCAL_PX) as f32);
        for (row, value) in [
            (SVector::<f32, 8>::from([u, v, 1.0, 0.0, 0.0, 0.0, -u * x, -v * x]), x),
            (SVector::<f32, 8>::from([0.0, 0.0, 0.0, u, v, 1.0, -u * y, -v * y]), y),
        ] {
            normal += row * row.transpose();
            right += row * value;
        }
    }
    let Some(h) = normal.lu().solve(&right) else {
        return f64::NAN;
    };
    let focal = FOCAL_PX as f32;
    let (cx, cy) = (0.264 * focal, 0.148 * focal);
    let length = |a: f32, b: f32, c: f32| ((a - cx * c).powi(2) + (b - cy * c).powi(2) + (focal * c).powi(2)).sqrt();
    let middle = length(h[2], h[5], 1.0);
    let scale = (length(h[0], h[3], h[6]) * length(h[1], h[4], h[7])).sqrt();
    f64::from(middle / scale)
}

/// NEES of the pose, range error with its standard deviation, and the naive range error.
fn trial(seen: &Observation, memory: &mut PoseMemory) -> (f64, f64, f64, f64) {
    let pose = Pose::of_image(&seen.fit, HALF_SIDE_M, memory).expect("a pose");
    let range = pose.numbers().range_m;
    let truth = seen.place.length();
    (
        nees((seen.place, seen.rotation), &pose),
        (range.value - truth).abs(),
        range.sigma,
        (naive_range_m(&seen.leds) - truth).abs(),
    )
}

#[test]
fn hard_poses_are_as_wrong_as_they_say_where_naive_ones_are_wrong_unawares() {
    let mut memory = Box::<PoseMemory>::default();
    for (distance_m, yaw_deg) in [(200.0, 0.0), (200.0, 30.0), (30.0, 80.0), (100.0, 75.0)] {
        let count = 200;
        let (mut nees, mut ours, mut sigma, mut naive) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..count {
            let (squared, error, stated, of_naive) = trial(&seen(seed, distance_m, yaw_deg), &mut memory);
            nees += squared / count as f64;
            ours += error * error / count as f64;
            sigma += stated * stated / count as f64;
            naive += f64::from(u8::from(of_naive.is_nan() || of_naive > 5.0 * stated)) / count as f64;
        }
        let band = 3.29 * (12.0 / count as f64).sqrt();
        println!(
            "{distance_m} m, {yaw_deg}°: NEES {nees:.2}, rms {:.3} m, stated {:.3} m, naive wrong {naive}",
            ours.sqrt(),
            sigma.sqrt()
        );
        assert!((nees - 6.0).abs() < band, "{distance_m} m, {yaw_deg}°: NEES {nees}, not 6 ± {band}");
        assert!(ours.sqrt() < 1.2 * sigma.sqrt());
        assert!(naive > 0.1, "{distance_m} m, {yaw_deg}°: the naive way does in {naive}");
    }
}
