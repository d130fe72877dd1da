//! A camera of another size, line time and black level than the rest of the tests have.

use super::*;

/// As many symbols a frame as with the other cameras.
const RATE_MILLIHERTZ: u32 = 16_950;

/// A message arrives in usual, dim and bright light, with exposures of this camera.
fn receives(mut application: Application<impl Follow>, brighter: f64) {
    let mut bench = Bench::default();
    let mut scene = Scene::new(OTHER, RATE_MILLIHERTZ, b"another eye");
    scene.ground *= brighter;
    scene.led *= brighter;
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 500);
    assert_eq!(application.message(), b"another eye", "{brighter} {:?}", application.counters());
    run(&mut application, &mut bench, &mut scene, 60);
    let levels = application.levels;
    assert!((100..250).contains(&levels.bright), "{brighter} {levels:?}");
    let exposure = bench.exposure;
    ask(&mut application, &mut bench, 1, Request::Camera, |answer| {
        let Answer::Camera(camera) = answer else { panic!("{answer:?}") };
        assert_eq!((camera.size, camera.period_us), ([256, 200], 40_000));
        assert!((4..=160).contains(&camera.lines) && camera.gain_log2 <= 2, "{camera:?}");
        assert_eq!(camera.exposure_us, u32::from(camera.lines) * 125 / 2);
        assert_eq!(Some(camera.exposure()), exposure);
    });
}

#[test]
fn messages_come_from_another_camera() {
    for brighter in [0.15, 1.0, 8.0] {
        receives(application(OTHER, RATE_MILLIHERTZ), brighter);
        receives(in_integers(OTHER, RATE_MILLIHERTZ), brighter);
    }
}

/// A mode with a value out of its range makes no application, and none makes a panic.
#[test]
fn modes_out_of_range_are_refused() {
    let [mut stopped, mut endless, mut short, mut long, mut loud, mut grey, mut blind] = [OTHER; 7];
    stopped.pixel_clock_hz = 0;
    endless.pixel_clock_hz = 1;
    short.least_lines = 0;
    long.least_lines = 161;
    loud.most_gain_log2 = 7;
    grey.black_grey = 29;
    blind.focal_length_px = f32::INFINITY;
    let period_us = u32::MAX;
    let most_lines = 160;
    for (mode, error) in [
        (stopped, CameraModeError::Period { period_us }),
        (endless, CameraModeError::Period { period_us }),
        (
            short,
            CameraModeError::Lines {
                least_lines: 0,
                most_lines,
            },
        ),
        (
            long,
            CameraModeError::Lines {
                least_lines: 161,
                most_lines,
            },
        ),
        (loud, CameraModeError::Gain { most_gain_log2: 7 }),
        (grey, CameraModeError::Black { black_grey: 29 }),
        (
            blind,
            CameraModeError::FocalLength {
                focal_length_px: f32::INFINITY,
            },
        ),
    ] {
        let settings = Settings {
            mode,
            symbol_millihertz: RATE_MILLIHERTZ,
            was_reset: false,
        };
        let refused = Application::new(follower(OTHER), settings).err();
        assert_eq!(refused, Some(ApplicationError::Mode(error)));
    }
}
