//! Following of a panel by a shaking camera, in films drawn without the simulator.

use std::ops::Add;

use vocc_tests::shake::{Film, FilmResult, Light, Shake, receive};

/// Messages arrive although a panel jumps by half a pitch or more per frame, rolls, or rotates about a distant centre.
#[test]
fn panels_are_followed_before_a_camera_that_shakes() {
    let cases = [
        (Shake::Random, 4.0, 2.0),
        (Shake::Random, 5.5, 5.5),
        (Shake::Random, 8.0, 8.0),
        (Shake::Smooth, 5.5, 2.75),
        (Shake::Smooth, 8.0, 8.0),
        (Shake::Turn, 5.5, 1.0),
    ];
    for (shake, pitch_px, step) in cases {
        for seed in 1..=2 {
            let film = Film {
                seed,
                pitch_px,
                shake,
                step,
                frames: 60,
                light: Light::Steady,
            };
            let fate = receive(film, false);
            println!("{film:?}: {fate:?}");
            assert_eq!(fate.delivered, 1, "{film:?}: {fate:?}");
            assert!(fate.read >= 50 && fate.line_off <= 2, "{film:?}: {fate:?}");
        }
    }
}

/// The panel is followed and read while the exposure jumps, and behind a veil of sunlight.
#[test]
fn panels_are_read_while_the_light_changes() {
    for light in [Light::Jumps, Light::Veil] {
        let films = (1..=6).map(|seed| Film {
            seed,
            pitch_px: 5.5,
            shake: Shake::Smooth,
            step: 0.55,
            frames: 90,
            light,
        });
        let result = films.map(|film| receive(film, false)).fold(FilmResult::default(), Add::add);
        println!("{light:?}: {result:?}");
        assert_eq!(result.delivered, 6, "{light:?}: {result:?}");
        assert!(result.legible_unread <= 40 && result.line_off <= 15, "{light:?}: {result:?}");
    }
}

/// A panel that is found one line off, or moved a line by a veil, is back on its lines after a few symbols, and its readings are not sure
/// until then.
#[test]
fn a_panel_one_line_off_returns_to_its_lines() {
    let shaking = |step| Film {
        seed: 2010,
        pitch_px: 5.5,
        shake: Shake::Smooth,
        step,
        frames: 60,
        light: Light::Steady,
    };
    let veiled = Film {
        seed: 2012,
        pitch_px: 11.0,
        shake: Shake::Smooth,
        step: 1.1,
        frames: 120,
        light: Light::Veil,
    };
    for film in [shaking(5.5), shaking(11.0), veiled] {
        let result = receive(film, false);
        println!("{film:?}: {result:?}");
        assert_eq!(result.delivered, 1, "{film:?}: {result:?}");
        assert!(result.line_off <= 25 && result.surely <= 4, "{film:?}: {result:?}");
    }
}
