use crate::detect::Mixture;
use crate::likelihood::MaximumLikelihood;
use crate::likelihood::tests::{NEXT, acquainted};
use crate::synthetic::Scene;
use link::panel::{PanelFrame, SoftPanel};

/// The reading of a frame in which the next symbol's share is `share` in the panel's middle, and grows by `growth` from line to line.
fn read_by_lines(detector: &mut MaximumLikelihood<16384>, share: f32, growth: f32) -> Option<Mixture> {
    let scene = Scene {
        next: (NEXT, share),
        growth,
        noise_grey: 1.0,
        ..Scene::PLAIN
    };
    let before = SoftPanel::certain(PanelFrame::from_bits(scene.bits), 100);
    let found = detector.detect_after(&before, &scene.render().frame(), &scene.corners(), None);
    found.unwrap().mixed
}

/// The number of LEDs with non-zero soft values, and of the wrong ones among them.
fn told(soft: &SoftPanel, bits: u64) -> [u32; 2] {
    let sure = (0..64).filter(|&led| soft.0[led].unsigned_abs() > 8);
    let sure = sure.fold(0u64, |sure, led| sure | 1 << led);
    let wrong = (soft.hard().bits() ^ bits) & sure;
    [sure.count_ones(), wrong.count_ones()]
}

#[test]
fn rows_that_were_caught_at_different_moments_are_read() {
    for growth in [0.01, 0.03, -0.03, 0.1, 1.0, -1.0] {
        for share in [0.35, 0.6] {
            let mut detector = acquainted(1.0);
            // At the start of a film the direction of reading is unknown.
            assert_eq!(read_by_lines(&mut detector, 0.0, 0.0), None);
            let mixture = read_by_lines(&mut detector, share, growth).expect("two symbols");
            let [ended, wrongly] = told(&mixture.ending, Scene::PLAIN.bits);
            assert!(ended >= 16 && 10 * wrongly <= ended, "{share} {growth}: {wrongly} of {ended}");
            let [begun, wrongly] = told(&mixture.beginning, NEXT);
            assert!(begun >= 16 && 10 * wrongly <= begun, "{share} {growth}: {wrongly} of {begun}");
            assert!(mixture.growth[1] * growth > 0.0, "{mixture:?}");
            let learnt = detector.learnt().and_then(|learnt| learnt.line_delay);
            assert!(learnt.is_some_and(|learnt| learnt * growth > 0.0), "{growth}: {learnt:?}");
        }
    }
}

#[test]
fn the_time_between_lines_is_learnt_and_kept() {
    for growth in [0.02, -0.02, 0.05] {
        let mut detector = acquainted(1.0);
        for share in [0.3, 0.7, 0.45, 0.6] {
            read_by_lines(&mut detector, share, growth).expect("two symbols");
        }
        let learnt = detector.learnt().and_then(|learnt| learnt.line_delay).unwrap();
        assert!((learnt / growth - 1.0).abs() < 0.15, "{learnt} for {growth}");
    }
}

#[test]
fn lines_that_are_exposed_at_once_are_found_to_be() {
    let mut detector = acquainted(1.0);
    for share in [0.3, 0.6, 0.4, 0.7, 0.35, 0.65, 0.25, 0.45] {
        let mixture = read_by_lines(&mut detector, share, 0.0).expect("two symbols");
        assert_eq!(mixture.growth, [0.0; 2]);
    }
    assert_eq!(detector.learnt().unwrap().line_delay, Some(0.0));
    let mut told = acquainted(1.0);
    told.set_line_delay(0.0);
    for share in [0.1, 0.3, 0.55, 0.8] {
        assert_eq!(read_by_lines(&mut told, share, 0.0), read_by_lines(&mut detector, share, 0.0));
    }
}

#[test]
fn what_is_told_of_lines_is_a_hint() {
    let mut detector = acquainted(1.0);
    for told in [f32::NAN, f32::INFINITY, 2.1] {
        detector.set_line_delay(told);
        assert_eq!(detector.learnt().unwrap().line_delay, None);
    }
    detector.set_line_delay(-0.05);
    assert_eq!(detector.learnt().unwrap().line_delay, Some(-0.05));
    for share in [0.3, 0.7, 0.45, 0.6] {
        read_by_lines(&mut detector, share, 0.03).expect("two symbols");
    }
    let learnt = detector.learnt().unwrap().line_delay.unwrap();
    assert!((0.024..0.036).contains(&learnt), "{learnt}");
}
