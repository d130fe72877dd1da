//! Frames that do not show the panel, and exposures that jump: the receiver reads right bits again soon after.

use super::*;

/// Frames before, and after each interruption (count).
const FRAMES: u64 = 12;
/// Frames until bits are right again (frames).
const SOON: u64 = 3;
/// Interruptions, one after another (count).
const INTERRUPTIONS: u32 = 2;

/// Day and night.
const SCENES: [Scene; 2] = [
    Scene {
        light: [1.5, 4.0],
        noise_grey: 1.0,
        ..Scene::PLAIN
    },
    Scene {
        light: [1.0, 9.0],
        noise_grey: 1.0,
        background: |_| 0.004,
        ..Scene::PLAIN
    },
];
/// Exponents of the curve, and exposures that keep a panel readable two stops up and two stops down.
const ENCODINGS: [(f32, f32); 2] = [(2.2, 0.8), (1.0, 0.35)];

type Change<'a> = &'a dyn Fn(Scene) -> Scene;

/// The wrong bits of frames of a scene, except soon after each interruption by frames changed in these ways.
fn wrong_bits_after(scene: &Scene, seed: u64, interruption: &[Change<'_>]) -> u32 {
    let camera = Camera {
        encoding: Encoding::Gamma(scene.gamma),
        ..Camera::default()
    };
    let mut detector = Box::new(MaximumLikelihood::<16384>::new(camera));
    let mut number = seed << 20;
    let mut wrong_bits = |change: Change<'_>| {
        number += 1;
        let bits = random_bits(number);
        let scene = Scene { bits, ..change(*scene) };
        let found = detector.detect(&scene.render().frame(), &scene.corners());
        found.map_or(64, |found| (found.bits.bits() ^ bits).count_ones())
    };
    let mut wrong: u32 = (0..FRAMES).map(|_| wrong_bits(&|scene| scene)).sum();
    for _ in 0..INTERRUPTIONS {
        for change in interruption {
            wrong_bits(*change);
        }
        let after = |number| (number, wrong_bits(&|scene| scene));
        let late = (0..FRAMES).map(after).filter(|(number, _)| *number >= SOON);
        wrong += late.map(|(_, wrong)| wrong).sum::<u32>();
    }
    wrong
}

/// All scenes with all encodings, each with a seed.
fn scenes() -> impl Iterator<Item = (u64, Scene)> {
    let by_encoding = |scene: Scene| ENCODINGS.map(|(gamma, exposure)| Scene { gamma, exposure, ..scene });
    (1..).zip(SCENES.into_iter().flat_map(by_encoding))
}

#[test]
fn after_a_wiper_bits_are_right_again() {
    for (seed, scene) in scenes() {
        for (passes, own) in [(0.0, 0.0), (0.0, 0.03), (0.1, 0.03), (0.3, 0.01)] {
            let between = properties::all_cases().then_some(4);
            for frames in [1, 8].into_iter().chain(between) {
                let wiper = |columns| {
                    move |scene: Scene| Scene {
                        wiper: (columns, passes, own),
                        ..scene
                    }
                };
                let (comes, covers, goes) = (wiper([0, 48]), wiper([0, 96]), wiper([40, 96]));
                let mut interruption: std::vec::Vec<Change<'_>> = std::vec![&covers; frames + 2];
                (interruption[0], interruption[frames + 1]) = (&comes, &goes);
                let wrong = wrong_bits_after(&scene, seed, &interruption);
                assert_eq!(wrong, 0, "{frames} frames through {passes}, {scene:?}");
            }
        }
    }
}

#[test]
fn after_lamps_dip_and_flashes_dazzle_bits_are_right_again() {
    for (seed, scene) in scenes() {
        let dip = |scene: Scene| Scene {
            light: [scene.light[0]; 2],
            ..scene
        };
        let dark = |scene: Scene| Scene { light: [1.0; 2], ..scene };
        let flash = |scene: Scene| Scene { exposure: 3000.0, ..scene };
        let glare = |scene: Scene| Scene {
            wiper: ([0, 96], 1.0, 3.0),
            ..scene
        };
        let changes: [Change<'_>; 4] = [&dip, &dark, &flash, &glare];
        for (kind, change) in changes.into_iter().enumerate() {
            for frames in [1, 8] {
                let wrong = wrong_bits_after(&scene, seed + 10, &std::vec![change; frames]);
                assert_eq!(wrong, 0, "{frames} frames of kind {kind}, {scene:?}");
            }
        }
    }
}

#[test]
fn after_exposures_jump_bits_are_right_again() {
    for (seed, scene) in scenes() {
        for stops in [-2, -1, 1, 2] {
            let jumped = Scene {
                exposure: 2f32.powi(stops) * scene.exposure,
                ..scene
            };
            for (from, to) in [(scene, jumped), (jumped, scene)] {
                let jump: Change<'_> = &|_| to;
                let wrong = wrong_bits_after(&from, seed + 20, &[jump; 8]);
                assert_eq!(wrong, 0, "{stops} stops to {to:?}");
            }
        }
    }
}

/// At night a covered panel looks like LEDs that are all Off, which is no symbol.
#[test]
fn a_covered_panel_is_not_read_and_teaches_nothing() {
    for (seed, scene) in scenes().filter(|(_, scene)| scene.gamma > 1.0) {
        let mut detector = detector();
        for number in 0..FRAMES {
            let bits = random_bits((seed + 40) << 20 | number);
            assert_eq!(read(&mut detector, &Scene { bits, ..scene }).bits.bits(), bits);
        }
        let learnt = |detector: &MaximumLikelihood<16384>| {
            let Experience {
                levels,
                leds,
                is_plain_around,
                curve,
                ..
            } = detector.experience();
            (levels, leds, is_plain_around, curve)
        };
        let before = learnt(&detector);
        for number in 0..8 {
            let covered = Scene {
                bits: random_bits((seed + 50) << 20 | number),
                wiper: ([0, 96], 0.0, 0.03),
                ..scene
            };
            match detector.detect(&covered.render().frame(), &covered.corners()) {
                Err(DetectError::Covered { .. } | DetectError::ContrastTooLow { .. }) => {}
                found => assert!(found.is_ok_and(|found| found.bits.bits() == 0), "{found:?}"),
            }
        }
        assert_eq!(learnt(&detector), before);
    }
}
