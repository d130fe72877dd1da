mod honesty;
mod interruptions;

use super::*;
#[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
use crate::lattice::Lattice;
use crate::synthetic::Scene;
use link::camera::Camera;
use link::panel::PanelFrame;
use properties::prelude::*;
use std::boxed::Box;
use std::sync::LazyLock;

fn detector() -> Box<MaximumLikelihood<16384>> {
    Box::new(MaximumLikelihood::new(Camera::default()))
}

fn read(detector: &mut MaximumLikelihood<16384>, scene: &Scene) -> Detection {
    detector.detect(&scene.render().frame(), &scene.corners()).unwrap()
}

#[test]
fn panels_of_any_size_and_turn_are_read() {
    for (pitch_px, roll_deg, fill) in [(2.4, 0.0, 0.66), (3.3, 8.0, 0.5), (5.0, 0.0, 0.4), (9.0, 3.0, 0.5)] {
        let scene = Scene {
            pitch_px,
            roll_deg,
            fill,
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        let detection = read(&mut detector(), &scene);
        assert_eq!((detection.bits.bits(), detection.mixed), (scene.bits, None), "{scene:?}");
    }
}

#[test]
fn the_blur_need_not_be_known() {
    for blur_sigma_px in [0.9, 1.2, 2.0, 2.4] {
        let camera = Camera {
            blur_sigma_px,
            ..Camera::default()
        };
        let mut detector = Box::new(MaximumLikelihood::<16384>::new(camera));
        let scene = Scene {
            pitch_px: 2.8,
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        assert_eq!(read(&mut detector, &scene).bits.bits(), scene.bits, "{blur_sigma_px} px");
    }
}

/// Pseudorandom bits.
pub(super) fn random_bits(seed: u64) -> u64 {
    let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) ^ mixed << 17
}

/// The wrong bits of the first `frames` frames; a frame that cannot be read counts as wrong throughout.
fn wrong_bits(scene: &Scene, frames: u64) -> (u32, Box<MaximumLikelihood<16384>>) {
    let mut detector = detector();
    let wrong = (0..frames)
        .map(|seed| {
            let bits = random_bits(seed);
            let scene = Scene { bits, ..*scene };
            let found = detector.detect(&scene.render().frame(), &scene.corners());
            found.map_or(64, |found| (found.bits.bits() ^ bits).count_ones())
        })
        .sum();
    (wrong, detector)
}

/// Sunlight right of an edge, and the shade of a bridge left of it.
#[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
fn shade_edge<const EDGE_PX: usize>([x, _]: [f32; 2]) -> f32 {
    0.1 + 0.9 / (1.0 + libm::expf((EDGE_PX as f32 - x) / 0.8))
}

#[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
#[test]
fn the_edge_of_a_shadow_costs_bits_only_if_it_is_not_subtracted() {
    let edges = [
        shade_edge::<30>,
        shade_edge::<41>,
        shade_edge::<44>,
        shade_edge::<47>,
        shade_edge::<60>,
    ];
    let mut wrong_with_shadows = 0;
    for background in edges {
        for pitch_px in [8.0, 9.5, 11.0] {
            for frame in 0..4 {
                let bits = random_bits(frame);
                let scene = Scene {
                    background,
                    bits,
                    pitch_px,
                    light: [0.1, 3.0],
                    noise_grey: 1.0,
                    ..Scene::PLAIN
                };
                let (rendered, corners) = (scene.render(), scene.corners());
                let frame = rendered.frame();
                let mut detector = detector();
                let plain = detector
                    .detect(&frame, &corners)
                    .map_or(64, |found| (found.bits.bits() ^ bits).count_ones());
                wrong_with_shadows += plain;
                let spots = LatticeModel {
                    lattice: Lattice::through(&corners),
                    sigma: 1.6,
                    background: 1.0,
                    off: 0.0,
                    contrast: 1.0,
                    state: [0.0; LEDS],
                };
                let shade = detector.shade_on(&frame, &spots);
                let learnt = detector.learnt();
                let wrong = shade.map_or(plain, |shade| {
                    let read = detector.detect_without(shade, &SoftPanel::ERASED, &frame, &corners, spots.sigma);
                    (read.unwrap().bits.bits() ^ bits).count_ones()
                });
                assert_eq!(wrong, 0, "{scene:?}");
                assert_eq!(detector.learnt(), learnt, "{scene:?}");
            }
        }
    }
    assert!(wrong_with_shadows > 100, "{wrong_with_shadows}");
}

#[test]
fn no_blur_need_be_told() {
    for (blur, pitch_px) in [(0.6, 4.4), (1.0, 4.4), (2.2, 5.0), (3.0, 6.6), (4.0, 9.0)] {
        let scene = Scene {
            blur_px: [blur; 2],
            pitch_px,
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        let (wrong, detector) = wrong_bits(&scene, 8);
        assert_eq!(wrong, 0, "{blur} px");
        let learnt = detector.learnt().unwrap().camera.blur_sigma_px;
        assert!((learnt / blur - 1.0).abs() < 0.15, "{learnt} for {blur} px");
    }
}

#[test]
fn on_is_brighter_than_off_whatever_the_blur() {
    for (blur, pitch_px) in [(2.2, 4.4), (3.0, 5.0), (3.0, 5.45), (4.0, 7.0)] {
        let scene = Scene {
            blur_px: [blur; 2],
            pitch_px,
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        for bits in (0..8).map(random_bits) {
            let scene = Scene { bits, ..scene };
            let found = read(&mut detector(), &scene);
            let right = i32::try_from((!(found.bits.bits() ^ bits)).count_ones()).unwrap();
            assert!(right > 40, "{right} of 64 at {blur} px");
        }
    }
}

#[test]
fn other_curves_cost_no_bits() {
    for gamma in [1.0, 1.8, 2.6] {
        let scene = Scene {
            gamma,
            noise_grey: 1.0,
            light: [0.9, 3.0],
            ..Scene::PLAIN
        };
        assert_eq!(wrong_bits(&scene, 8).0, 0, "γ = {gamma}");
    }
}

#[test]
fn blur_unequal_along_x_and_y_costs_no_bits() {
    for blur_px in [[0.9, 1.8], [1.9, 1.0]] {
        let scene = Scene {
            blur_px,
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        assert_eq!(wrong_bits(&scene, 8).0, 0, "{blur_px:?}");
    }
}

#[test]
fn broken_leds_are_named_and_erased() {
    const DEAD: u64 = 1 << 9 | 1 << 30 | 1 << 62;
    let scene = Scene {
        gain: |led| if DEAD >> led & 1 == 1 { 0.0 } else { 1.0 },
        noise_grey: 2.0,
        ..Scene::PLAIN
    };
    let (_, mut detector) = wrong_bits(&scene, 32);
    assert_eq!(detector.learnt().unwrap().broken, DEAD);
    let bits = random_bits(99);
    let found = read(&mut detector, &Scene { bits, ..scene });
    assert_eq!((found.bits.bits() ^ bits) & !DEAD, 0);
    for (led, llr) in found.soft.0.iter().enumerate() {
        assert_eq!(*llr == 0, DEAD >> led & 1 == 1, "{led}: {llr}");
    }
}

#[test]
fn a_dim_row_and_unequal_leds_are_read_once_they_are_known() {
    let scene = Scene {
        gain: |led| match led / 8 {
            5 => 0.35,
            _ => 0.8 + 0.4 * (led * 37 % 64) as f32 / 63.0,
        },
        noise_grey: 2.0,
        ..Scene::PLAIN
    };
    let (before, mut detector) = wrong_bits(&scene, 24);
    let after: u32 = (100..116)
        .map(|seed| {
            let bits = random_bits(seed);
            (read(&mut detector, &Scene { bits, ..scene }).bits.bits() ^ bits).count_ones()
        })
        .sum();
    assert!(before > 0, "nothing had to be learnt");
    assert_eq!((after, detector.learnt().unwrap().broken), (0, 0));
}

/// A short message that repeats leaves many LEDs in one state: a count of frames alone would see it as broken.
#[test]
fn leds_that_a_short_message_never_changes_are_not_broken() {
    let mut detector = detector();
    for frame in 0..64 {
        let scene = Scene {
            bits: random_bits(frame % 4),
            noise_grey: 2.0,
            ..Scene::PLAIN
        };
        assert_eq!(read(&mut detector, &scene).bits.bits(), scene.bits);
    }
    let same = (0..4).map(random_bits).fold([!0, !0], |[on, off], bits| [on & bits, off & !bits]);
    assert!((same[0] | same[1]).count_ones() >= 4, "{same:x?}");
    assert_eq!(detector.learnt().unwrap().broken, 0);
}

/// If the ground between the LEDs is uneven, some bits are wrong. Soft values that call all of them right would cost more nats than a bit
/// has, ln 2.
#[test]
fn what_the_model_does_not_explain_makes_bits_doubtful() {
    let scene = Scene {
        background: |[x, _]| 1.0 + 0.25 / (1.0 + (0.3 * (x - 52.0)).powi(4)),
        noise_grey: 1.0,
        light: [1.5, 4.0],
        ..Scene::PLAIN
    };
    let (mut wrong, mut nats) = (0, 0.0);
    for bits in (0..16).map(random_bits) {
        let found = read(&mut detector(), &Scene { bits, ..scene });
        wrong += (found.bits.bits() ^ bits).count_ones();
        for (led, &llr) in found.soft.0.iter().enumerate() {
            let sign = if bits >> led & 1 == 1 { -1.0 } else { 1.0 };
            nats += (sign * f32::from(llr) * link::panel::LLR_STEP).exp().ln_1p();
        }
    }
    nats /= 16.0 * 64.0;
    assert!(wrong > 16, "nothing was doubtful");
    assert!(nats < 0.69, "{nats} nats a bit, {wrong} wrong");
}

#[test]
fn what_stands_around_the_panel_is_left_out() {
    let scene = Scene {
        pitch_px: 3.4,
        noise_grey: 1.0,
        background: |[x, y]| {
            let outside = (x - 47.3).abs().max((y - 48.6).abs()) > 14.0;
            let stripe = ((x + 2.0 * y) / 3.0).floor() as i32 % 2 == 0;
            if outside && stripe { 6.0 } else { 1.0 }
        },
        ..Scene::PLAIN
    };
    assert_eq!(wrong_bits(&scene, 8).0, 0);
}

#[test]
fn corners_a_quarter_of_a_pixel_off_do_no_harm() {
    let scene = Scene {
        pitch_px: 3.0,
        noise_grey: 2.0,
        ..Scene::PLAIN
    };
    let corners = scene.corners().shifted(0.25, -0.2).unwrap();
    let detection = detector().detect(&scene.render().frame(), &corners).unwrap();
    assert_eq!(detection.bits.bits(), scene.bits);
}

#[test]
fn what_was_seen_before_tells_all_on_from_all_off() {
    let mut detector = detector();
    let panel = |bits| Scene {
        bits,
        noise_grey: 2.0,
        ..Scene::PLAIN
    };
    for seed in 1..12u64 {
        read(&mut detector, &panel(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    }
    for bits in [u64::MAX, 0, 1 << 27, !(1 << 8)] {
        let detection = read(&mut detector, &panel(bits));
        assert_eq!(detection.bits.bits(), bits);
        assert!(detection.confidence > 0.99 && detection.mixed.is_none(), "{bits:x}");
    }
}

/// A detector after some panels in noise.
pub(super) fn acquainted(noise_grey: f32) -> Box<MaximumLikelihood<16384>> {
    let mut detector = detector();
    for seed in 1..8u64 {
        let scene = Scene {
            bits: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15),
            noise_grey,
            ..Scene::PLAIN
        };
        assert_eq!(read(&mut detector, &scene).mixed, None);
    }
    detector
}

pub(super) const NEXT: u64 = 0x5555_3333_0f0f_00ff;

/// The soft values of both symbols if the next one has a `share` of the exposure.
fn two_symbols(noise_grey: f32, share: f32, before: &SoftPanel) -> Option<Mixture> {
    let scene = Scene {
        next: (NEXT, share),
        noise_grey,
        ..Scene::PLAIN
    };
    acquainted(noise_grey)
        .detect_after(before, &scene.render().frame(), &scene.corners(), None)
        .unwrap()
        .mixed
}

#[test]
fn two_symbols_of_one_exposure_are_read_both() {
    let bits = Scene::PLAIN.bits;
    let before = SoftPanel::certain(PanelFrame::from_bits(bits), 100);
    for share in [0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9] {
        let Some(mixture) = two_symbols(1.0, share, &before) else {
            panic!("not told at {share}");
        };
        assert_eq!(mixture.beginning.hard().bits(), NEXT, "{share}");
        // In equal halves, On then Off looks like Off then On.
        if share != 0.5 {
            assert_eq!(mixture.ending.hard().bits(), bits, "{share}");
        }
    }
}

#[test]
fn two_symbols_whose_order_nothing_tells_are_not_guessed() {
    for share in [0.3, 0.5, 0.7] {
        assert_eq!(two_symbols(1.0, share, &SoftPanel::ERASED), Some(Mixture::INSEPARABLE));
    }
}

#[test]
fn the_smaller_share_is_the_more_doubtful_one() {
    let before = SoftPanel::certain(PanelFrame::from_bits(Scene::PLAIN.bits), 10);
    let sum = |soft: &SoftPanel| soft.0.iter().map(|llr| u32::from(llr.unsigned_abs())).sum::<u32>();
    for (share, next_is_surer) in [(0.35, false), (0.65, true)] {
        let mixture = two_symbols(12.0, share, &before).unwrap();
        assert_ne!(mixture, Mixture::INSEPARABLE, "{share}");
        assert_eq!(sum(&mixture.beginning) > sum(&mixture.ending), next_is_surer, "{share}");
    }
}

#[test]
fn the_prior_can_be_handed_on() {
    let (mut one, mut other) = (detector(), detector());
    for seed in 1..8u64 {
        let bits = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        read(
            &mut one,
            &Scene {
                bits,
                noise_grey: 2.0,
                ..Scene::PLAIN
            },
        );
    }
    other.set_experience(one.experience());
    let scene = Scene {
        noise_grey: 2.0,
        ..Scene::PLAIN
    };
    assert_eq!(read(&mut one, &scene), read(&mut other, &scene));
    assert_eq!(one.experience(), other.experience());
}

#[test]
fn what_is_no_panel_or_outside_frame_or_memory_is_refused() {
    let scene = Scene::PLAIN;
    let far = scene.corners().shifted(500.0, 0.0).unwrap();
    let mut tiny = Box::new(MaximumLikelihood::<64>::new(Camera::default()));
    let rendered = scene.render();
    let refused = |found: Result<Detection, DetectError>| matches!(found, Err(DetectError::OutsideMemory { .. }));
    assert!(refused(detector().detect(&rendered.frame(), &far)));
    assert!(refused(tiny.detect(&rendered.frame(), &scene.corners())));
    let plain = Frame::new(&[118; 96 * 96], 96, 96).unwrap();
    assert!(matches!(
        detector().detect(&plain, &scene.corners()),
        Err(DetectError::ContrastTooLow { .. })
    ));
}

properties! {
    #![cases(64)]

    #[test]
    fn noise_makes_soft_values_smaller(bits: u64) {
        prop_assume!((16..48).contains(&bits.count_ones()));
        let sum = |noise_grey| {
            let scene = Scene { bits, pitch_px: 2.6, noise_grey, ..Scene::PLAIN };
            let soft = read(&mut detector(), &scene).soft;
            soft.0.iter().map(|llr| i32::from(llr.unsigned_abs())).sum::<i32>()
        };
        prop_assert!(sum(30.0) < sum(3.0));
    }

    #[test]
    fn no_pixels_and_no_place_panic(
        pixels in prop::collection::vec(any::<u8>(), 48 * 40),
        black: bool,
        corners in prop::array::uniform4(prop::array::uniform2(-20.0f32..70.0)),
        jitter in prop::array::uniform8(-4.0f32..4.0),
    ) {
        let pixels = if black { std::vec![0; 48 * 40] } else { pixels };
        let frame = Frame::new(&pixels, 48, 40).unwrap();
        let square = [[8.0, 8.0], [36.0, 8.0], [36.0, 32.0], [8.0, 32.0]];
        let near = core::array::from_fn(|i| {
            let [x, y]: [f32; 2] = square[i];
            [x + jitter[2 * i], y + jitter[2 * i + 1]]
        });
        let mut detector = detector();
        for corners in [corners, near] {
            if let Ok(corners) = Corners::new(corners)
                && let Ok(detection) = detector.detect(&frame, &corners)
            {
                prop_assert!(detection.soft.0.iter().all(|&llr| llr > i8::MIN));
                prop_assert!((0.5..=1.0).contains(&detection.confidence));
            }
        }
    }

    #[test]
    fn no_two_symbols_panic(
        next: u64,
        share in 0.0f32..=1.0,
        noise_grey in 0.0f32..60.0,
        light in prop::array::uniform2(0.0f32..40.0),
        before in prop::collection::vec(-127i8..=127, LEDS),
    ) {
        let before = SoftPanel(before.try_into().unwrap());
        let scene = Scene { next: (next, share), noise_grey, light, ..Scene::PLAIN };
        static KNOWN: LazyLock<Experience> = LazyLock::new(|| acquainted(1.0).experience());
        let mut detector = detector();
        detector.set_experience(*KNOWN);
        if let Ok(detection) = detector.detect_after(&before, &scene.render().frame(), &scene.corners(), None) {
            prop_assert!((0.5..=1.0).contains(&detection.confidence));
            for soft in detection.mixed.iter().flat_map(|mixture| [mixture.ending, mixture.beginning]) {
                prop_assert!(soft.0.iter().all(|&llr| llr > i8::MIN));
            }
        }
    }
}

/// A panel in other light is not a mixture, although On LEDs that are darker than before look as if they had been On for a part of the
/// exposure.
///
/// Of 10 000 panels, 4 are nevertheless read as a mixture, all of them dimmed to less than a quarter. If lines may be exposed one after
/// another, a panel's end that seems to show the symbol before has so few LEDs that chance agreement suffices. At that rate the bounds fail
/// in one case of a hundred. `VOCC_TEST_CASES=all cargo test -p vocc-rx-pipeline --lib in_other_light -- --nocapture` recounts.
#[test]
fn a_panel_in_other_light_is_hardly_ever_read_as_two_symbols() {
    let (count, bound) = if properties::all_cases() { (10_000, 10) } else { (1_000, 2) };
    let known = acquainted(1.0).experience();
    let mut detector = detector();
    let [off, on] = Scene::PLAIN.light;
    let before = SoftPanel::certain(PanelFrame::from_bits(Scene::PLAIN.bits), 100);
    let cases = (0..).map(|case| (random_bits(2 * case), random_bits(2 * case + 1)));
    let told_apart = cases.filter(|(bits, _)| (16..48).contains(&bits.count_ones()) && (bits ^ Scene::PLAIN.bits).count_ones() > 20);
    let mut read_as_two = 0;
    for (bits, random) in told_apart.take(count) {
        let share = 0.2 + 0.7 * (random >> 40) as f32 / (1u64 << 24) as f32;
        let scene = Scene {
            bits,
            light: [off, off + share * (on - off)],
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        detector.set_experience(known);
        let detection = detector
            .detect_after(&before, &scene.render().frame(), &scene.corners(), None)
            .unwrap();
        assert_eq!(detection.bits.bits(), bits, "{share}");
        read_as_two += usize::from(detection.mixed.is_some_and(|mixture| mixture != Mixture::INSEPARABLE));
    }
    std::println!("{read_as_two} of {count}");
    assert!(read_as_two <= bound, "{read_as_two} of {count}");
}

#[test]
fn off_leds_are_dark_dots_on_a_board_that_clips() {
    // A white board of 8 × 8 pitches in the sun, with a road around it: On LEDs are invisible on it.
    let board = |[x, y]: [f32; 2]| {
        let (sin, cos) = 11.0f32.to_radians().sin_cos();
        let (x, y) = (x - 48.0, y - 48.0);
        let is_on_it = [cos * x + sin * y, cos * y - sin * x].iter().all(|along| along.abs() < 4.0 * 9.0);
        if is_on_it { 7.0 } else { 1.0 }
    };
    let scene = Scene {
        centre: [48.0; 2],
        pitch_px: 9.0,
        roll_deg: 11.0,
        fill: 0.35,
        // Relative to the road.
        light: [-4.0, 9.0],
        blur_px: [0.7; 2],
        noise_grey: 1.0,
        background: board,
        ..Scene::PLAIN
    };
    let (wrong, _) = wrong_bits(&scene, 6);
    assert_eq!(wrong, 0);
}
