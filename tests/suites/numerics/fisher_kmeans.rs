//! Fisher's discriminant with collinear features, and two clusters in data that have none.

use link::panel::{LEDS, PanelFrame};
use rx_pipeline::detect::{DetectError, Detector, Fisher, FisherError, FisherFeatures, FisherScaling};
use rx_pipeline::features::Features;

use crate::synthetic::{features, spread};

const BITS: PanelFrame = PanelFrame::from_bits(0x9a3c_5e71_0f96_c3a5);

fn level(led: usize) -> f32 {
    f32::from(u8::from(BITS.led(led)))
}

/// Panels whose GRI is proportional to AGR, except for `noise` relative to the contrast.
fn collinear(panel: usize, noise: f32) -> Features {
    let agr = |led: usize| 1.0 + 0.3 * level(led) + 0.05 * spread(64 * panel + led, 0.618_034);
    let doubt = |led: usize| noise * 0.3 * spread(64 * panel + led, 0.754_878);
    features(agr, |led| 100.0 * (agr(led) + doubt(led) - 1.0))
}

/// Means and inverse covariance within the classes, by the textbook formulas.
fn naive_weights(panels: &[Features]) -> ([f64; 2], f64) {
    let cells = || {
        panels
            .iter()
            .flat_map(|panel| (0..LEDS).map(|led| (BITS.led(led), [f64::from(panel.agr[led]), f64::from(panel.gri[led])])))
    };
    let mean = |want: bool, axis: usize| {
        let values: Vec<f64> = cells().filter(|c| c.0 == want).map(|c| c.1[axis]).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let (on, off) = ([mean(true, 0), mean(true, 1)], [mean(false, 0), mean(false, 1)]);
    let count = cells().count() as f64;
    let covariance = |i: usize, j: usize| {
        let products = cells().map(|(is_on, x)| {
            let centre = if is_on { on } else { off };
            (x[i] - centre[i]) * (x[j] - centre[j])
        });
        products.sum::<f64>() / (count - 2.0)
    };
    let (xx, xy, yy) = (covariance(0, 0), covariance(0, 1), covariance(1, 1));
    let determinant = xx * yy - xy * xy;
    let [x, y] = [on[0] - off[0], on[1] - off[1]];
    let weights = [(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant];
    let offset = -0.5 * (weights[0] * (on[0] + off[0]) + weights[1] * (on[1] + off[1]));
    (weights, offset)
}

#[test]
fn fisher_learns_from_features_that_say_the_same() {
    let training: Vec<Features> = (0..20).map(|panel| collinear(panel, 0.0)).collect();
    // Test data with a noise of 3 % of the contrast, absent from the training.
    let unseen: Vec<Features> = (20..120).map(|panel| collinear(panel, 0.03)).collect();
    let (weights, offset) = naive_weights(&training);
    let naive_errors: usize = unseen
        .iter()
        .map(|panel| {
            let llr = |led: usize| weights[0] * f64::from(panel.agr[led]) + weights[1] * f64::from(panel.gri[led]) + offset;
            (0..LEDS).filter(|&led| (llr(led) > 0.0) != BITS.led(led)).count()
        })
        .sum();
    assert!(naive_errors > 100 * LEDS / 10, "{naive_errors} of {}", 100 * LEDS);
    for scaling in [FisherScaling::None, FisherScaling::ByPanel] {
        let panels = training.iter().map(|panel| (panel, BITS));
        let fisher = Fisher::train(panels, FisherFeatures::AgrGri, scaling).expect("a training");
        assert!(fisher.weights().iter().all(|weight| weight.is_finite()));
        for panel in &unseen {
            let detection = Detector::Fisher(fisher).detect(panel).expect("a reading");
            assert_eq!(detection.bits, BITS, "{scaling:?}");
        }
    }
}

#[test]
fn fisher_refuses_features_that_never_vary() {
    let flat = features(|_| 1.0, |_| 0.0);
    for set in [FisherFeatures::AgrGri, FisherFeatures::AgrGriNgr] {
        for scaling in [FisherScaling::None, FisherScaling::ByPanel] {
            let panels = std::iter::repeat_n((&flat, BITS), 10);
            assert_eq!(Fisher::train(panels, set, scaling), Err(FisherError::Singular));
        }
    }
    let no_number = features(|_| f32::NAN, |_| f32::INFINITY);
    let panels = std::iter::repeat_n((&no_number, BITS), 10);
    let trained = Fisher::train(panels, FisherFeatures::AgrGri, FisherScaling::None);
    assert_eq!(trained, Err(FisherError::Singular));
}

/// Features with little noise, AGR and GRI in different units.
fn scaled(panel: usize, [agr, gri]: [f32; 2]) -> Features {
    let noise = |led: usize, step| 0.2 * spread(64 * panel + led, step);
    Features {
        mean_grey: std::array::from_fn(|led| 100.0 + 50.0 * level(led)),
        ..features(
            |led| agr * (level(led) + noise(led, 0.618_034)),
            // Noise alone.
            |led| gri * noise(led, 0.754_878),
        )
    }
}

#[test]
fn scales_of_1e_minus_4_against_1e4_change_no_bit() {
    let scales = [[1.0, 1.0], [1e-4, 1e4], [1e4, 1e-4], [1e-4, 1e-4], [1e4, 1e4]];
    let mut raw_errors = 0;
    for scale in scales {
        let panels: Vec<Features> = (0..20).map(|panel| scaled(panel, scale)).collect();
        for scaling in [FisherScaling::None, FisherScaling::ByPanel] {
            let known = panels.iter().map(|panel| (panel, BITS));
            let fisher = Fisher::train(known, FisherFeatures::AgrGri, scaling).expect("a training");
            for (number, panel) in panels.iter().enumerate() {
                let read = Detector::Fisher(fisher).decide(panel);
                assert_eq!(read, Ok(BITS), "{scale:?}, {scaling:?}, panel {number}");
            }
        }
        for panel in &panels {
            let raw = Detector::KMeansRaw.decide(panel).unwrap_or_default();
            raw_errors += raw.distance(BITS);
        }
    }
    // In raw features the noise of the larger one dominates.
    assert!(raw_errors > 500, "{raw_errors}");
}

#[test]
fn kmeans_reads_one_led_of_64_at_any_scale() {
    for led in [0, 27, 63] {
        for bits in [1u64 << led, !(1 << led)] {
            let bits = PanelFrame::from_bits(bits);
            let on = |led: usize| f32::from(u8::from(bits.led(led)));
            for scale in [1e-4f32, 1.0, 1e4] {
                let panel = Features {
                    mean_grey: std::array::from_fn(|led| 100.0 + 50.0 * on(led)),
                    ..features(
                        |led| scale * (on(led) + 0.05 * spread(led, 0.618_034)),
                        |led| (on(led) + 0.05 * spread(led, 0.754_878)) / scale,
                    )
                };
                assert_eq!(Detector::KMeans.decide(&panel), Ok(bits), "at {scale}");
            }
        }
    }
}

/// Textbook Lloyd's algorithm: each centre is the mean of its points, from two start points.
fn naive_kmeans(points: &[[f32; 2]], mut centres: [[f32; 2]; 2]) -> [[f32; 2]; 2] {
    for _ in 0..10 {
        let (mut sums, mut counts) = ([[0.0; 2]; 2], [0.0; 2]);
        for &[x, y] in points {
            let distance = |c: [f32; 2]| (x - c[0]).powi(2) + (y - c[1]).powi(2);
            let nearest = usize::from(distance(centres[1]) < distance(centres[0]));
            sums[nearest][0] += x;
            sums[nearest][1] += y;
            counts[nearest] += 1.0;
        }
        centres = [0, 1].map(|k| sums[k].map(|sum| sum / counts[k]));
    }
    centres
}

#[test]
fn identical_points_are_one_class_and_no_nan() {
    let points = [[1.0, 2.0]; LEDS];
    let naive = naive_kmeans(&points, [points[0], points[1]]);
    assert!(naive[1][0].is_nan(), "{naive:?}");
    // Grey varies, so that there is contrast; the features of k-means do not.
    let alike = Features {
        mean_grey: std::array::from_fn(|led| 100.0 + led as f32),
        ..features(|_| 1.0, |_| 2.0)
    };
    for detector in [Detector::KMeans, Detector::KMeansRaw] {
        assert_eq!(detector.detect(&alike), Err(DetectError::OneClass { on: 0 }));
    }
    assert!(matches!(
        Detector::Otsu.detect(&features(|_| 1.0, |_| 2.0)),
        Err(DetectError::ContrastTooLow { .. })
    ));
}

/// All cells have the same GRI: without AGR both clusters would start from one cell.
#[test]
fn clusters_that_start_from_one_point_part_by_the_other_feature() {
    let panel = features(|led| 1.0 + level(led), |_| 7.0);
    let points: Vec<[f32; 2]> = panel.agr.iter().zip(panel.gri).map(|(&a, g)| [a, g]).collect();
    let naive = naive_kmeans(&points, [points[0]; 2]);
    assert!(naive[1][0].is_nan(), "{naive:?}");
    for detector in [Detector::KMeans, Detector::KMeansRaw] {
        assert_eq!(detector.decide(&panel), Ok(BITS));
    }
}

/// All On or all Off: only noise. It is split or refused; in either case every number is finite.
#[test]
fn panels_of_one_class_are_refused_or_split_with_finite_doubt() {
    for noise in [0.0, 1e-7, 1e-3, 0.1] {
        for light in [0.2, 1.0, 2.5] {
            let panel = features(
                |led| light + noise * spread(led, 0.618_034),
                |led| 40.0 * noise * spread(led, 0.754_878),
            );
            for detector in [Detector::KMeans, Detector::KMeansRaw, Detector::Otsu] {
                match detector.detect(&panel) {
                    Ok(detection) => {
                        assert!((1..64).contains(&detection.bits.count_on()));
                        assert!((0.5..=1.0).contains(&detection.confidence), "{detection:?}");
                    }
                    Err(DetectError::ContrastTooLow { range_grey }) => assert!(range_grey < 0.5),
                    Err(error) => assert_eq!(error, DetectError::OneClass { on: 0 }),
                }
            }
        }
    }
}
