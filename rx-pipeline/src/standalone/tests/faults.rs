//! Faults are reported beside readings, and cleared.

use super::*;

#[test]
fn what_is_wrong_with_the_camera_is_said_and_mended() {
    let faults = [
        (CameraError::Silent, "fault: no camera answers"),
        (
            CameraError::WrongId { id: 0x0360 },
            "fault: the chip at the camera's address says it is 0x0360",
        ),
    ];
    for (fault, said) in faults {
        let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
        bench.fault = Some(fault);
        application.start(&mut bench);
        assert!(bench.text().starts_with(said), "{}", bench.text());
        assert_eq!(application.fault(), Some(Fault::Camera(fault)));
        application.no_frame(&mut bench);
        // First the camera answers without frames; then they come too.
        bench.fault = None;
        application.no_frame(&mut bench);
        assert_eq!(application.fault(), Some(Fault::NoFrames));
        assert!(bench.text().contains("fault: the camera sends no frames"));
        let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"back");
        run(&mut application, &mut bench, &mut scene, 400);
        assert_eq!(application.message(), b"back");
        // Reported once each, however often it was tried.
        assert_eq!(bench.text().matches(said).count(), 1);
        assert_eq!(bench.text().matches("fault: none any more\r\n").count(), 1);
    }
}

/// A panel that is followed and read, and its scene.
fn reading() -> (Application<Follower>, Bench, Scene) {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"ice on the bridge");
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 400);
    assert!(application.is_following());
    bench.output.clear();
    (application, bench, scene)
}

/// A failed write of the exposure is a fault, but the panel is still followed; the next successful write clears the fault.
#[test]
fn a_panel_is_followed_while_the_exposure_cannot_be_written() {
    let (mut application, mut bench, mut scene) = reading();
    bench.is_deaf = true;
    scene.led *= 0.5;
    scene.ground *= 0.5;
    scene.symbols = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"still there").symbols;
    run(&mut application, &mut bench, &mut scene, 400);
    assert_eq!(application.message(), b"still there");
    let silent = Fault::Camera(CameraError::Silent);
    assert_eq!(application.fault(), Some(silent));
    let since_ms = application.trouble().unwrap().since_ms;
    assert!(since_ms > 0 && since_ms < bench.now_us / 1000 - 100);
    assert!(application.is_following());
    assert_eq!(bench.text().matches("fault: no camera answers").count(), 1);
    ask(&mut application, &mut bench, 1, Request::Status, |answer| {
        let Answer::Status(status) = answer else { panic!("{answer:?}") };
        let fault = silent;
        assert_eq!(status.trouble, Some(Trouble { fault, since_ms }));
        assert!(status.is_following);
    });
    bench.is_deaf = false;
    bench.output.clear();
    // While a computer asks, there is no text.
    for _ in 0..160 {
        run(&mut application, &mut bench, &mut scene, 1);
    }
    assert_eq!((application.fault(), bench.starts), (None, 1));
    assert!(bench.text().starts_with("fault: none any more\r\n"), "{}", bench.text());
    assert_eq!(application.counters().lost, 0);
}

/// The same if the light is as before by then: an exposure that may be half written is written again.
#[test]
fn an_exposure_that_failed_is_written_again() {
    let (mut application, mut bench, mut scene) = reading();
    let led = scene.led;
    (bench.is_deaf, scene.led) = (true, 2.5 * led);
    for _ in 0..12 {
        run(&mut application, &mut bench, &mut scene, 1);
    }
    assert!(application.fault().is_some());
    (bench.is_deaf, scene.led) = (false, led);
    for _ in 0..12 {
        run(&mut application, &mut bench, &mut scene, 1);
    }
    assert_eq!(application.fault(), None);
}

/// Frames that are all cut short are another fault than no frames; the next whole frame clears either.
#[test]
fn frames_that_are_never_whole_are_told_from_none() {
    let (mut application, mut bench, mut scene) = reading();
    for cut in [20, 0] {
        bench.cut_short += cut;
        bench.now_us += 1_000_000;
        application.no_frame(&mut bench);
        let expected = if cut > 0 { Fault::NoWholeFrames } else { Fault::NoFrames };
        assert_eq!(application.fault(), Some(expected));
        assert!(!application.is_following());
    }
    run(&mut application, &mut bench, &mut scene, 1);
    assert_eq!(application.fault(), None);
    let text = bench.text();
    let said = [
        "fault: the camera's frames are cut short",
        "fault: the camera sends no frames",
        "fault: none any more",
    ];
    let places = said.map(|said| text.find(said).unwrap());
    assert!(places.is_sorted(), "{text}");
    // None of the missing frames was dropped.
    assert_eq!(application.counters().passed_by, 0);
}

/// A camera that streams but cannot be set up: its frames are read, and the setup is retried.
#[test]
fn a_camera_that_streams_is_set_up_as_soon_as_it_can_be() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"deaf");
    let wrong = CameraError::WrongId { id: 7 };
    (bench.fault, bench.exposure) = (Some(wrong), Some(application.exposure()));
    application.start(&mut bench);
    for _ in 0..120 {
        run(&mut application, &mut bench, &mut scene, 1);
    }
    assert_eq!(application.message(), b"deaf");
    assert_eq!(application.fault(), Some(Fault::Camera(wrong)));
    assert!((2..=6).contains(&bench.starts), "{}", bench.starts);
    bench.fault = None;
    for _ in 0..40 {
        run(&mut application, &mut bench, &mut scene, 1);
    }
    assert_eq!(application.fault(), None);
}
