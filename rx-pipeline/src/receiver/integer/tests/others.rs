//! Things that blink and are not panels: they are found, but never reported as followed.

use super::*;
use std::println;

const WIDTH: usize = 160;
const HEIGHT: usize = 80;
/// 0.68 symbols a frame, as on an RP2040.
const RATE: f32 = 0.68;
const FRAMES: u64 = 400;

/// Draws frames of lamps.
struct Scene {
    seed: u64,
    pixels: Vec<f64>,
}

impl Scene {
    fn new() -> Self {
        Self {
            seed: 0x9e37_79b9_7f4a_7c15,
            pixels: std::vec![12.0; WIDTH * HEIGHT],
        }
    }

    fn random(&mut self) -> u64 {
        self.seed ^= self.seed << 13;
        self.seed ^= self.seed >> 7;
        self.seed ^= self.seed << 17;
        self.seed
    }

    /// Adds lamps with the brightness `light`.
    fn lamps(&mut self, corners: &Corners, light: impl Fn(usize) -> f64) {
        let place = corners.homography();
        for lamp in 0..64 {
            let [x, y] = place.to_image([f64::from(lamp as u8 % 8), f64::from(lamp as u8 / 8)]);
            for row in y as usize - 3..y as usize + 5 {
                for column in x as usize - 3..x as usize + 5 {
                    let square = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                    self.pixels[row * WIDTH + column] += light(lamp) * (-square / 1.6).exp();
                }
            }
        }
    }

    /// The camera's frame of the scene; the next frame starts dark.
    fn frame(&mut self) -> Vec<u8> {
        let pixels = std::mem::replace(&mut self.pixels, std::vec![12.0; WIDTH * HEIGHT]);
        let noisy = |grey: f64| (grey + (self.random() % 5) as f64 - 2.0).clamp(0.0, 255.0) as u8;
        pixels.into_iter().map(noisy).collect()
    }
}

/// Counts over some frames.
#[derive(Debug, Default)]
struct Outcome {
    /// Frames with a reading.
    read: u32,
    /// Number of finds.
    found: u32,
    /// Frames in which a panel was reported as followed.
    followed: u32,
    last: Option<Corners>,
}

/// Processes frames. A naive receiver accepts everything that it finds.
fn run(is_naive: bool, mut draw: impl FnMut(&mut Scene, u64)) -> Outcome {
    let room = std::vec![0; BlinkSearch::bytes(WIDTH, HEIGHT)];
    let mut receiver = IntegerReceiver::new(RATE, room).unwrap();
    let (mut scene, mut outcome) = (Scene::new(), Outcome::default());
    for number in 0..FRAMES {
        draw(&mut scene, number);
        let pixels = scene.frame();
        let frame = Frame::new(&pixels, WIDTH, HEIGHT).unwrap();
        let had_none = receiver.track.is_none();
        let seen = receiver.frame(number, &frame, &mut ());
        outcome.read += u32::from(seen.reading.is_some());
        outcome.followed += u32::from(seen.is_following);
        outcome.last = seen.reading.map(|reading| reading.corners).or(outcome.last);
        outcome.found += u32::from(had_none && receiver.track.is_some());
        if is_naive {
            let is_panel = Event::Beacon { inverted: false };
            receiver.proof.judge(number, &is_panel);
        }
    }
    outcome
}

/// Checks that a naive receiver accepts it as a panel for most of the time, and that this receiver never does.
fn assert_rejected(what: &str, draw: impl Fn(&mut Scene, u64)) {
    let naive = run(true, &draw);
    let careful = run(false, &draw);
    println!(
        "{what}: followed in {} of {FRAMES} frames naively, in {}",
        naive.followed, careful.followed
    );
    assert!(naive.followed > 200, "{what}: {naive:?}");
    assert_eq!(careful.followed, 0, "{what}: {careful:?}");
    // A place is given up after 30 symbols, which are 45 frames, and skipped for 90 symbols.
    assert!((1..=4).contains(&careful.found), "{what}: {careful:?}");
    assert!(careful.read < 200, "{what}: {careful:?}");
}

fn block() -> Corners {
    corners(20.3, 22.4, 4.3, 0.03)
}

/// A sign with half of its lamps brighter than the others.
fn sign(lamp: usize) -> f64 {
    if (lamp % 8 < 4) == (lamp / 8 < 4) { 180.0 } else { 110.0 }
}

#[test]
fn lamps_that_all_switch_together_are_not_followed() {
    assert_rejected("a sign that flickers", |scene, number| {
        let is_lit = number % 5 < 3;
        scene.lamps(&block(), |lamp| if is_lit { sign(lamp) } else { 0.0 });
    });
}

#[test]
fn a_few_lamps_that_blink_are_not_followed() {
    assert_rejected("a sign that is switched on, five lamps of which blink", |scene, number| {
        let (is_lit, random) = (number > 3, scene.random());
        let blinking = 0x0100_0040_0010_0802u64;
        scene.lamps(&block(), |lamp| match lamp {
            _ if !is_lit => 0.0,
            _ if (blinking & random) >> lamp & 1 == 1 => 0.0,
            _ => sign(lamp),
        });
    });
}

/// A window that mirrors a moving edge in the places of the lamps.
#[test]
fn an_edge_that_moves_over_lamps_is_not_followed() {
    assert_rejected("an edge over lamps", |scene, number| {
        scene.lamps(&block(), |lamp| if lamp as u64 % 8 == number % 8 { 170.0 } else { 0.0 });
    });
}

/// A bright surface with a moving edge is not even found.
#[test]
fn a_bright_edge_that_moves_is_not_found() {
    let outcome = run(false, |scene, number| {
        let edge = 40 + (3 * number % 60) as usize;
        for row in scene.pixels.chunks_exact_mut(WIDTH).skip(20).take(40) {
            row[30..edge].fill(170.0);
        }
    });
    assert_eq!((outcome.followed, outcome.found), (0, 0), "{outcome:?}");
}

/// A panel beside a larger flickering sign is followed once the sign has been rejected.
#[test]
fn a_panel_beside_a_sign_is_followed() {
    let panel = corners(105.4, 25.2, 3.6, 0.0);
    let outcome = run(false, |scene, number| {
        let is_lit = number % 5 < 3;
        scene.lamps(&block(), |lamp| if is_lit { sign(lamp) } else { 0.0 });
        let symbol = number * 68 / 100;
        let bits = (symbol + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let bits = (bits ^ bits >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        scene.lamps(&panel, |lamp| if bits >> lamp & 1 == 1 { 150.0 } else { 0.0 });
    });
    assert!(outcome.followed > 150, "{outcome:?}");
    let [x, y] = outcome.last.unwrap().centre_px();
    let [u, v] = panel.centre_px();
    assert!((x - u).hypot(y - v) < 1.0, "{outcome:?}");
}
