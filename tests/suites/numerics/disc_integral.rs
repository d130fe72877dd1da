//! The reference level against values with thirty digits: see `tests/fixtures/light.py`.

use std::path::Path;
use std::str::FromStr;

use glam::{DMat2, DVec2};
use libm::erf;
use sim::accuracy::REFERENCE;
use sim::disc::chords::{Chord, Chords};
use sim::disc::kernel::Exact;
use sim::disc::outline::Outline;

/// The rows of a CSV file next to the script that computed it.
fn table<const COLUMNS: usize>(name: &str) -> Vec<[f64; COLUMNS]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name);
    let text = std::fs::read_to_string(&path).expect("a table");
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| f64::from_str(number).expect("a number")).collect();
        <[f64; COLUMNS]>::try_from(numbers).expect("a number in each column")
    };
    text.lines().skip(1).map(row).collect()
}

/// The light at one pixel.
struct Light {
    sigma_px: f64,
    outline: Outline,
    at: DVec2,
    value: f64,
}

fn lights() -> Vec<Light> {
    let row = |[sigma_px, xx, xy, yx, yy, x, y, value]: [f64; 8]| {
        let shape = DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(yx, yy));
        Light {
            sigma_px,
            outline: Outline::Ellipse(shape),
            at: DVec2::new(x, y),
            value,
        }
    };
    table("light.csv").into_iter().map(row).collect()
}

impl Light {
    fn name(&self) -> String {
        format!("σ {} px, {:?}, at {}", self.sigma_px, self.outline, self.at)
    }

    /// The light at the reference level: by chords if available, otherwise by pixel.
    fn drawn(&self) -> f64 {
        match Chords::within(&self.outline, self.sigma_px, REFERENCE) {
            Some(chords) => chords.light(&Exact::new(self.sigma_px), self.at),
            None => self.outline.light(self.sigma_px, self.at),
        }
    }
}

#[test]
fn the_reference_level_holds_nine_digits_of_an_led_s_light() {
    let lights = lights();
    assert!(lights.len() > 500, "{} values", lights.len());
    for light in lights {
        for value in [light.drawn(), light.outline.light(light.sigma_px, light.at)] {
            let error = (value - light.value).abs();
            assert!(error < 1e-9, "{}: {value} against {}: {error:e}", light.name(), light.value);
        }
    }
}

#[test]
fn far_tails_keep_nine_digits_of_their_own() {
    let tails: Vec<Light> = lights()
        .into_iter()
        .filter(|light| light.sigma_px > 0.0 && light.value > 1e-30)
        .collect();
    let darkest = tails.iter().map(|light| light.value).fold(1.0, f64::min);
    assert!(darkest < 1e-28, "the darkest is {darkest:e}");
    for light in tails {
        let value = light.outline.light(light.sigma_px, light.at);
        let error = (value / light.value - 1.0).abs();
        assert!(error < 1e-9, "{}: {value:e} against {:e}: {error:e}", light.name(), light.value);
    }
}

/// A point at which bell, step and difference of steps are computed, with their values.
struct Edge {
    sigma_px: f64,
    exact: Exact,
    start: f64,
    end: f64,
    values: [f64; 3],
}

fn edges() -> impl Iterator<Item = Edge> {
    let row = |[sigma_px, start, end, bell, step, between]: [f64; 6]| Edge {
        sigma_px,
        exact: Exact::new(sigma_px),
        start,
        end,
        values: [bell, step, between],
    };
    table("edge.csv").into_iter().map(row)
}

/// Maximum relative error of bells, steps and differences of steps.
pub fn edge_error() -> f64 {
    let error = |edge: Edge| {
        let Edge { exact, start, end, .. } = edge;
        let ours = [exact.bell(start), exact.step(start), exact.between(start, end - start)];
        let errors = ours.into_iter().zip(edge.values).map(|(ours, value)| (ours / value - 1.0).abs());
        errors.fold(0.0, f64::max)
    };
    edges().map(error).fold(0.0, f64::max)
}

#[test]
fn bells_and_steps_do_not_cancel() {
    let mut naive_fails = 0;
    for Edge {
        sigma_px,
        exact,
        start,
        end,
        values: [bell, _, between],
    } in edges()
    {
        let naive = |at: f64| erf(at / (sigma_px * std::f64::consts::SQRT_2)) / 2.0;
        let naive_bell = naive(start + 0.5) - naive(start - 0.5);
        let naive_between = exact.step(end) - exact.step(start);
        naive_fails += usize::from((naive_bell / bell - 1.0).abs() > 1e-3);
        naive_fails += usize::from((naive_between / between - 1.0).abs() > 1e-3);
    }
    // Subtraction from almost 1 loses all digits of light of 1e-16 and less.
    assert!(naive_fails > 50, "{naive_fails}");
    assert!(edge_error() < 1e-11, "{:e}", edge_error());
}

/// Positions of all pixels that an outline lights, along x or y.
fn pixels(reach: f64, sigma_px: f64, shift: f64) -> impl Iterator<Item = f64> + Clone {
    let last = (reach + 9.0 * sigma_px + 1.0).ceil() as i64;
    (-last..=last).map(move |at| at as f64 + shift)
}

#[test]
fn no_light_is_lost() {
    let circle = |radius: f64| DMat2::from_diagonal(DVec2::splat(radius));
    let tilted = DMat2::from_cols(DVec2::new(1.7, 0.3), DVec2::new(-0.2, 1.1));
    let cases = [
        (0.0, circle(0.0005)),
        (0.0, tilted),
        (0.0, circle(500.0)),
        (0.001, circle(20.0)),
        (0.05, circle(0.0005)),
        (0.05, tilted),
        (0.05, circle(100.0)),
        (1.5, circle(0.0005)),
        (1.5, tilted),
        (1.5, circle(20.0)),
        (10.0, tilted),
        (50.0, circle(0.0005)),
        (50.0, tilted),
        (50.0, circle(500.0)),
    ];
    for (sigma_px, shape) in cases {
        let outline = Outline::Ellipse(shape);
        let area = std::f64::consts::PI * shape.determinant().abs();
        let columns = pixels(outline.reach().x, sigma_px, 0.137);
        let rows = pixels(outline.reach().y, sigma_px, -0.291);
        if sigma_px <= 10.0 {
            let row = |y| {
                let light = |x| outline.light(sigma_px, DVec2::new(x, y));
                columns.clone().map(light).sum::<f64>()
            };
            let flux = rows.clone().map(row).sum::<f64>() / area;
            let lost = (flux - 1.0).abs();
            assert!(lost < 1e-12, "{outline:?} at σ {sigma_px} px: {lost:e}");
        }
        // A chord's light is separable in x and y, and so is its sum.
        if let Some(chords) = Chords::within(&outline, sigma_px, REFERENCE) {
            let kernel = Exact::new(sigma_px);
            let chord = |c: &Chord| {
                let along_x: f64 = columns.clone().map(|x| kernel.bell(x - c.u)).sum();
                let along_y: f64 = rows.clone().map(|y| kernel.between(y - c.bottom, c.bottom - c.top)).sum();
                c.weight * along_x * along_y
            };
            let flux = chords.0.iter().map(chord).sum::<f64>() / area;
            let lost = (flux - 1.0).abs();
            assert!(lost < 1e-12, "chords of {outline:?} at σ {sigma_px} px: {lost:e}");
        }
    }
}

/// Naive methods fail on these values.
#[test]
fn the_naive_ways_miss_these_values() {
    let worst = |error: &dyn Fn(&Light) -> Option<f64>| lights().iter().filter_map(error).fold(0.0, f64::max);
    // 64 samples per pixel, without blur.
    let sampled = |light: &Light| {
        let Outline::Ellipse(shape) = light.outline else {
            return None;
        };
        let to_disc = shape.inverse();
        let inside = (0..64).filter(|k| {
            let offset = |step: i32| (f64::from(step) + 0.5) / 8.0 - 0.5;
            let at = light.at + DVec2::new(offset(k % 8), offset(k / 8));
            (to_disc * at).length_squared() <= 1.0
        });
        let error = (inside.count() as f64 / 64.0 - light.value).abs();
        (light.sigma_px == 0.0).then_some(error)
    };
    assert!(worst(&sampled) > 1e-2, "{}", worst(&sampled));
    // A fixed number of chords for all outlines and blurs.
    let chords = |light: &Light| {
        let Outline::Ellipse(shape) = light.outline else {
            return None;
        };
        let chords = Chords::new(shape, 64);
        let error = |kernel| (chords.light(&kernel, light.at) - light.value).abs();
        (light.sigma_px > 0.0).then(|| error(Exact::new(light.sigma_px)))
    };
    assert!(worst(&chords) > 1e-2, "{}", worst(&chords));
    // Difference of steps close to 1: loses all light on one side of the tail.
    let subtracted = |light: &Light| {
        let chords = Chords::within(&light.outline, light.sigma_px, REFERENCE)?;
        let kernel = Exact::new(light.sigma_px);
        let chord = |c: &Chord| {
            let step = kernel.step(light.at.y - c.top) - kernel.step(light.at.y - c.bottom);
            c.weight * kernel.bell(light.at.x - c.u) * step
        };
        Some((chords.0.iter().map(chord).sum::<f64>() / light.value - 1.0).abs())
    };
    assert!(worst(&subtracted) > 0.99, "{}", worst(&subtracted));
}
