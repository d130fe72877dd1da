//! The renderers used as timing baselines draw the same image, each to its own accuracy.

use glam::{DMat2, DVec2};
use sim::disc::chords::Chords;
use sim::disc::kernel::Exact;
use sim::disc::outline::Outline;
use studies::baselines::supersampled;
use studies::baselines::{Panel, straightforward};

const SIDE: usize = 52;
const SIGMA_PX: f64 = 1.5;
/// Subpixels along a pixel's side.
const FINER: usize = 8;

/// Panels of interval 1 at 50 m, L2A 2, at several sub-pixel phases.
fn panels() -> impl Iterator<Item = Panel> {
    (0..5).map(|k| Panel {
        bits: 0x9d2c_5680_efc6_0b3a,
        first_px: [0.37, 0.73].map(|step| 10.0 + (f64::from(k) * step).fract()),
        pitch_px: 4.363_636,
        radius_px: 1.090_909,
        off: 2.2,
        on: 16.0,
    })
}

/// The exact linear values, LED by LED.
fn exact(panel: &Panel, sigma_px: f64) -> Vec<f64> {
    let disc = Outline::Ellipse(DMat2::from_diagonal(DVec2::splat(panel.radius_px)));
    let chords = Chords::within(&disc, sigma_px, 1e-9).expect("a blur wide enough for chords");
    let kernel = Exact::new(sigma_px);
    let value = |pixel: usize| {
        let at = DVec2::new((pixel % SIDE) as f64, (pixel / SIDE) as f64);
        let led = |led: usize| {
            let (centre, light) = panel.led(led);
            (light - 1.0) * chords.light(&kernel, at - DVec2::from_array(centre))
        };
        1.0 + (0..64).map(led).sum::<f64>()
    };
    (0..SIDE * SIDE).map(value).collect()
}

/// Maximum and RMS difference of linear values, relative to an On LED's excess over the background.
fn difference(panel: &Panel, ours: &[f64], exact: &[f64]) -> (f64, f64) {
    let differences = || ours.iter().zip(exact).map(|(a, b)| (a - b).abs() / (panel.on - 1.0));
    let squares = differences().map(|d| d * d).sum::<f64>();
    (differences().fold(0.0, f64::max), (squares / ours.len() as f64).sqrt())
}

/// Maximum of both differences over the panels.
fn worst(differences: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    differences.fold((0.0, 0.0), |(greatest, rms), (a, b)| (f64::max(greatest, a), f64::max(rms, b)))
}

/// Blurring pixel averages misplaces sub-pixel detail: 0.9 % of an LED's light at the worst pixel. On an eight times finer raster the
/// discs' jagged edges remain: 0.5 %.
#[test]
fn the_baselines_draw_the_exact_picture_to_a_hundredth_of_an_led() {
    let differences: Vec<_> = panels()
        .map(|panel| {
            let exact = exact(&panel, SIGMA_PX);
            let straight = straightforward::linear(&panel, SIGMA_PX, SIDE);
            let fine = supersampled::linear(&panel, SIGMA_PX, SIDE, FINER);
            let truncated = supersampled::linear(&panel, 1.41, SIDE, FINER);
            [straight, fine, truncated].map(|drawn| difference(&panel, &drawn, &exact))
        })
        .collect();
    let of = |which: usize| worst(differences.iter().map(|d| d[which]));
    let (straight, fine) = (of(0), of(1));
    assert!(straight.0 < 1e-2 && straight.1 < 2e-3, "straightforward: {straight:?}");
    assert!(fine.0 < 6e-3 && fine.1 < 1e-3, "supersampled: {fine:?}");
    // A blur of 1.41 px, the result of truncating a Gaussian of 1.5 px too early, must fail.
    assert!(of(2).0 > 1e-2 && of(2).1 > 2e-3, "too sharp: {:?}", of(2));
}

#[test]
fn both_ways_to_sample_a_disc_give_the_same_picture() {
    for panel in panels() {
        let boxes = straightforward::render(&panel, SIGMA_PX, 2.2, SIDE);
        let raster = straightforward::render_by_raster(&panel, SIGMA_PX, 2.2, SIDE);
        assert!(boxes.iter().any(|&grey| grey > 200));
        assert_eq!(boxes, raster);
    }
}
