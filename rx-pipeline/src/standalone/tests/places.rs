//! A camera that is knocked: the panel jumps within the frame.

use super::*;
use std::println;

/// A message that takes longer to show than a lost panel is still followed.
const LONG: &[u8] = b"the camera is knocked while this message is shown, the first time or the second: whoever looks on sees it whole";

/// A message in progress, with the panel shifted by `by` pixels from now on.
fn knocked(mut application: Application<impl Follow>, mut scene: Scene, long: &[u8], by: [f32; 2]) {
    let mut bench = Bench::default();
    let mode = scene.mode;
    let rate = (1e3 / scene.symbol_s) as u32;
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 200);
    assert_eq!(application.message(), b"before");
    // Halfway through the next message.
    let mut next = Scene::new(mode, rate, long);
    for _ in 0..12 {
        run(&mut application, &mut bench, &mut next, 1);
    }
    assert_eq!((application.counters().found, application.counters().lost), (1, 0));
    next.corners = next.corners.and_then(|corners| corners.shifted(by[0], by[1]).ok());
    bench.output.clear();
    let knocked_us = bench.now_us;
    let (mut lost_us, mut found_us) = (0, 0);
    for _ in 0..400 {
        run(&mut application, &mut bench, &mut next, 1);
        let Counters { found, lost, messages, .. } = application.counters();
        let took_us = bench.now_us - knocked_us;
        if lost == 1 && lost_us == 0 {
            lost_us = took_us;
        }
        if found == 2 && found_us == 0 {
            found_us = took_us;
        }
        if messages == 2 {
            break;
        }
    }
    let took_us = bench.now_us - knocked_us;
    println!(
        "{} × {} px, knocked by {by:?} px: lost after {:.2} s, followed again after {:.2} s, the message is there after {:.2} s",
        mode.width,
        mode.height,
        lost_us as f64 / 1e6,
        found_us as f64 / 1e6,
        took_us as f64 / 1e6,
    );
    let counters = application.counters();
    assert_eq!(application.message(), long, "{counters:?}");
    assert_eq!((counters.lost, counters.found), (1, 2));
    assert!(
        bench.text().starts_with("state: searching\r\nstate: following\r\n"),
        "{}",
        bench.text()
    );
    let centre = application.corners().unwrap().centre_px();
    let truth = next.corners.unwrap().centre_px();
    assert!((centre[0] - truth[0]).hypot(centre[1] - truth[1]) < 1.0);
    assert!(took_us < 20_000_000, "{took_us}");
}

#[test]
fn a_panel_is_found_again_after_the_camera_was_knocked() {
    for by in [[90.0, 40.0], [-80.0, 35.0]] {
        let scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"before");
        knocked(application(QVGA, SYMBOL_MILLIHERTZ), scene, LONG, by);
    }
}

#[test]
fn a_panel_is_found_again_in_integers_after_the_camera_was_knocked() {
    for by in [[40.0, 12.0], [-25.0, 18.0]] {
        let scene = Scene::new(BINNED, 9_000, b"before");
        knocked(in_integers(BINNED, 9_000), scene, LONG, by);
    }
}

/// 48 bytes within four seconds, twice over, at any phase of the first exposure.
#[test]
fn a_long_message_is_there_within_four_seconds() {
    for phase in [0.0, 0.2, 0.5, 0.8] {
        let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
        let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, LONG);
        scene.phase = phase;
        application.start(&mut bench);
        let took_us = run(&mut application, &mut bench, &mut scene, 400);
        assert_eq!(application.message(), LONG);
        assert!(took_us < 4_000_000, "{took_us} µs from phase {phase} on");
    }
}
