//! Frames that do not show the panel, and exposures that jump: the receiver reads right bits again soon after.

use super::*;

/// Frames before, and after each interruption (count).
const FRAMES: usize = 12;
/// Frames until bits are right again (count).
const SOON: usize = 3;

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

/// A detector that has read frames of a scene, and is then interrupted again and again.
struct Interrupted {
    scene: Scene,
    number: u64,
    detector: Box<MaximumLikelihood<16384>>,
}

impl Interrupted {
    fn new(scene: Scene, seed: u64) -> Self {
        let camera = Camera {
            encoding: Encoding::Gamma(scene.gamma),
            ..Camera::default()
        };
        let mut new = Self {
            scene,
            number: seed << 20,
            detector: Box::new(MaximumLikelihood::new(camera)),
        };
        assert_eq!(new.wrong_bits(), [0; FRAMES], "{scene:?}");
        new
    }

    /// The wrong bits of each frame.
    fn wrong_bits(&mut self) -> [u32; FRAMES] {
        std::array::from_fn(|_| self.wrong_bits_of(&|scene| scene))
    }

    fn wrong_bits_of(&mut self, change: Change<'_>) -> u32 {
        self.number += 1;
        let bits = random_bits(self.number);
        let scene = Scene {
            bits,
            ..change(self.scene)
        };
        let found = self.detector.detect(&scene.render().frame(), &scene.corners());
        found.map_or(64, |found| (found.bits.bits() ^ bits).count_ones())
    }

    /// Interrupts by frames that are changed in these ways, and checks that bits are right again soon.
    fn by(&mut self, interruption: &[Change<'_>], what: &str) {
        for change in interruption {
            self.wrong_bits_of(*change);
        }
        let wrong = self.wrong_bits();
        assert_eq!(wrong[SOON..], [0; FRAMES - SOON], "{what}, {:?}: {wrong:?}", self.scene);
    }
}

/// All scenes with all encodings, each with a seed.
fn scenes() -> impl Iterator<Item = (u64, Scene)> {
    let by_encoding = |scene: Scene| ENCODINGS.map(|(gamma, exposure)| Scene { gamma, exposure, ..scene });
    (1..).zip(SCENES.into_iter().flat_map(by_encoding))
}

#[test]
fn after_a_wiper_bits_are_right_again() {
    for (seed, scene) in scenes() {
        let mut interrupted = Interrupted::new(scene, seed);
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
                interrupted.by(&interruption, &std::format!("{frames} frames through {passes}"));
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
        let mut interrupted = Interrupted::new(scene, seed + 10);
        for (kind, change) in changes.into_iter().enumerate() {
            for frames in [1, 8] {
                interrupted.by(&std::vec![change; frames], &std::format!("{frames} frames of kind {kind}"));
            }
        }
    }
}

#[test]
fn after_exposures_jump_bits_are_right_again() {
    for (seed, scene) in scenes() {
        let mut from_usual = Interrupted::new(scene, seed + 20);
        for stops in [-2, -1, 1, 2] {
            let jumped = Scene {
                exposure: 2f32.powi(stops) * scene.exposure,
                ..scene
            };
            let what = std::format!("{stops} stops");
            let (away, back): (Change<'_>, Change<'_>) = (&|_| jumped, &|_| scene);
            from_usual.by(&[away; 8], &what);
            Interrupted::new(jumped, seed + 20).by(&[back; 8], &what);
        }
    }
}

/// At night a covered panel looks like LEDs that are all Off, which is not a symbol.
#[test]
fn a_covered_panel_is_not_read_and_teaches_nothing() {
    for (seed, scene) in scenes().filter(|(_, scene)| scene.gamma > 1.0) {
        let mut detector = detector();
        for number in 0..FRAMES as u64 {
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
