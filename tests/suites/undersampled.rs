//! A panel that shows bits as the phase of a carrier, in films drawn without the simulator.

use link::waveform::SymbolTiming;
use vocc_tests::sensor::Sensor;
use vocc_tests::undersampled::{Change, Film, FilmResult, PITCH_PX, receive};

const MESSAGE: &[u8] = b"Lane closed ahead";

/// A typical camera with the usual carrier of 1440 Hz.
const USUAL: Film = Film {
    seed: 1,
    fps: 100.0,
    exposure_s: 0.000_25,
    symbol_rate_hz: 90.0,
    cycles: 16,
    clock_ppm: 40.0,
    phase: 0.3,
    jitter_s: 0.0,
    line_delay_s: 0.0,
    pitch_px: PITCH_PX,
    sensor: Sensor::USUAL,
    frames: 150,
    change: None,
};

/// Deviations of the transmitter's clock around changes of the carrier.
const CLOCKS_PPM: [f64; 3] = [0.0, 40.0, -150.0];
/// Frames after a change of the carrier: three repeats of the message.
const CHANGED_FRAMES: usize = 100;

/// Cameras of 24 to 150 frames a second, and panels with LEDs 6 to 30 px apart, over which the phase turns by 0.6 to 6.4 cycles.
const ROLLING_SEEDS: [u64; 8] = [8, 11, 13, 15, 17, 20, 21, 26];

fn received(film: Film) -> FilmResult {
    let fate = receive(film, MESSAGE, |_, _, _| ());
    println!("{film:?}: {fate:?}");
    fate
}

/// At least 28 of 30 random cameras receive the message without any settings except the frame rate, and none receives a wrong one.
#[test]
fn messages_arrive_by_a_carrier() {
    let fates: Vec<FilmResult> = (1..=30).map(|seed| received(Film::of_camera(seed))).collect();
    let delivered = fates.iter().filter(|fate| fate.delivered.is_some()).count();
    assert!(delivered >= 28, "{delivered} of 30");
    assert_eq!(fates.iter().map(|fate| fate.wrong).sum::<usize>(), 0);
}

/// What a new transmitter shows is read by cameras that follow its symbols.
#[test]
fn the_carrier_of_a_new_transmitter_is_received() {
    let timing = SymbolTiming::CARRIER;
    for (seed, fps, exposure_s) in [(1, 100.0, 0.000_25), (2, 120.0, 0.000_25), (3, 100.0, 0.001), (4, 240.0, 0.000_5)] {
        let fate = received(Film {
            seed,
            fps,
            exposure_s,
            symbol_rate_hz: timing.rate().hz(),
            cycles: timing.waveform().cycles().into(),
            frames: (2.0 * fps) as usize,
            ..USUAL
        });
        assert!(fate.delivered.is_some() && fate.wrong == 0, "{fate:?}");
    }
}

/// Cameras with a rolling shutter, and panels near and far, receive the message, too.
#[test]
fn messages_arrive_line_by_line() {
    let films = ROLLING_SEEDS.map(Film::of_rolling_camera);
    assert!(films.iter().all(|film| film.line_delay_s != 0.0));
    for fate in films.map(received) {
        assert!(fate.delivered.is_some() && fate.wrong == 0, "{fate:?}");
    }
}

/// Cameras whose frames several carriers explain about equally well: with global shutters, each fifth frame shows the same phase. A message
/// that takes longer than the receiver remembers arrives, because its first segments prove one of them. By the frames alone none of these
/// messages arrived.
#[test]
fn long_messages_prove_their_carrier() {
    let message: Vec<u8> = (0..512u32).map(|i| (i * 89 % 251) as u8).collect();
    for film in [Film::of_camera(16), Film::of_rolling_camera(13), Film::of_rolling_camera(14)] {
        let fate = receive(film.of_repeats(&message, 4), &message, |_, _, _| ());
        println!("{film:?}: {fate:?}");
        assert!(fate.delivered.is_some() && fate.wrong == 0, "{fate:?}");
    }
}

/// A bright disc lies behind one of the small LEDs. While that LED is On, the disc outshines the others so far that a comparison of the
/// frame's LEDs alone reads all others as Off, and the panel seems to be gone: then 4 of 10 frames are read.
#[test]
fn a_bright_disc_behind_an_led_does_not_hide_the_panel() {
    const FRAMES: usize = 90;
    let fate = received(Film {
        frames: FRAMES,
        ..Film::of_rolling_camera(1027)
    });
    assert!(fate.delivered.is_some() && fate.wrong == 0, "{fate:?}");
    assert!(10 * fate.read >= 7 * FRAMES, "{fate:?}");
}

/// Frames of a still panel keep their sign: no reading is the complement of the panel.
#[test]
fn still_panels_have_no_carrier() {
    for seed in 1..=10 {
        let fate = received(Film {
            cycles: 0,
            ..Film::of_camera(seed)
        });
        assert!(
            fate.delivered.is_some() && fate.wrong == 0 && fate.panels[1] == 0,
            "{seed}: {fate:?}"
        );
    }
}

/// A carrier that begins on a still panel, ends or jumps: the message arrives about as soon as in the slowest film that begins with it.
#[test]
fn a_carrier_that_changes_in_mid_film_is_learnt_anew() {
    const CHANGES: [(&str, Change, u32); 5] = [
        (
            "begins",
            Change {
                frames: 40,
                cycles: 0,
                late: 0.0,
            },
            16,
        ),
        (
            "begins late",
            Change {
                frames: 140,
                cycles: 0,
                late: 0.0,
            },
            16,
        ),
        (
            "ends",
            Change {
                frames: 140,
                cycles: 16,
                late: 0.0,
            },
            0,
        ),
        (
            "jumps by an eighth",
            Change {
                frames: 140,
                cycles: 16,
                late: 0.125,
            },
            16,
        ),
        (
            "jumps by a quarter",
            Change {
                frames: 140,
                cycles: 16,
                late: 0.25,
            },
            16,
        ),
    ];
    let mut latest = 0;
    for (kind, (name, change, cycles)) in CHANGES.into_iter().enumerate() {
        // Each clock with at least one change.
        let clocks = if properties::all_cases() {
            &CLOCKS_PPM[..]
        } else {
            &CLOCKS_PPM[kind % CLOCKS_PPM.len()..][..1]
        };
        for &clock_ppm in clocks {
            let film = Film {
                cycles,
                clock_ppm,
                frames: change.frames + CHANGED_FRAMES,
                change: Some(change),
                ..USUAL
            };
            let fate = received(film);
            assert!(fate.delivered.is_some() && fate.wrong == 0, "{name}, {clock_ppm} ppm: {fate:?}");
            latest = latest.max(fate.delivered.unwrap_or_default() - change.frames);
        }
    }
    println!("{latest} frames after a change at the latest");
}

/// The same changes with a rolling shutter.
#[test]
fn a_carrier_that_changes_is_learnt_anew_line_by_line() {
    let jumps = [3, 7, 10, 12].map(|seed| (seed, 100, Film::of_rolling_camera(seed).cycles, 0.25));
    let begins = [8, 10, 12].map(|seed| (seed, 60, 0, 0.0));
    for (seed, frames, cycles, late) in jumps.into_iter().chain(begins) {
        let film = Film::of_rolling_camera(seed);
        assert_ne!(film.line_delay_s, 0.0);
        let fate = received(Film {
            frames: frames + CHANGED_FRAMES,
            change: Some(Change { frames, cycles, late }),
            ..film
        });
        assert!(fate.delivered.is_some() && fate.wrong == 0, "{seed}: {fate:?}");
    }
}

/// Contrast near 0, a constant phase, a carrier within 0.1 Hz of a multiple of the frame rate, exposures of whole cycles: a message may be
/// missing, but none is wrong.
#[test]
fn blind_cameras_receive_nothing_wrong() {
    let hz = USUAL.symbol_rate_hz * f64::from(USUAL.cycles);
    // The carrier is a multiple of the frame rate, so that the phase is constant.
    let parked = |phase| Film {
        fps: 120.0,
        clock_ppm: 0.0,
        phase,
        ..USUAL
    };
    // The contrast is 0 at this phase; a quarter of a cycle is 1/64 of a symbol.
    let blind = (0.25 - (USUAL.exposure_s / 2.0 + 0.5 / 120.0) * hz).rem_euclid(1.0) / f64::from(USUAL.cycles);
    let cases = [
        ("parked at full contrast", parked(blind + 0.25 / 16.0), true),
        ("parked at no contrast", parked(blind), false),
        ("parked next to no contrast", parked(blind + 0.01 / 16.0), true),
        (
            "0.1 Hz beside",
            Film {
                clock_ppm: 0.1 / hz * 1e6,
                frames: 240,
                ..parked(blind)
            },
            true,
        ),
        (
            "a whole cycle",
            Film {
                exposure_s: 1.0 / hz,
                ..USUAL
            },
            false,
        ),
        (
            "nearly a whole cycle",
            Film {
                exposure_s: 0.95 / hz,
                ..USUAL
            },
            false,
        ),
        (
            "half a cycle",
            Film {
                exposure_s: 0.5 / hz,
                ..USUAL
            },
            true,
        ),
        (
            "half the frame rate",
            Film {
                fps: 64.0,
                symbol_rate_hz: 57.6,
                cycles: 25,
                clock_ppm: 20.0,
                ..USUAL
            },
            true,
        ),
    ];
    for (name, film, is_delivered) in cases {
        let fate = received(film);
        assert_eq!((fate.wrong, fate.delivered.is_some()), (0, is_delivered), "{name}: {fate:?}");
    }
}
