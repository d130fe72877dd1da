//! Whole films, in whole frames and in regions.

mod moving;
mod near;
#[cfg(feature = "surroundings")]
mod shaded;

use super::*;
use crate::detect::Method;
use crate::lattice::Lattice;
use crate::locate::LocateError;
use crate::settings::TrackingSettings;
use crate::synthetic::Scene;
use link::camera::Camera;
use link::fec::Code;
use link::framing::{Deframer, Framer};
use link::panel::PanelFrame;
use properties::prelude::*;
use std::boxed::Box;
use std::vec::Vec;

const PATIENCE_FRAMES: u32 = TrackingSettings::DEFAULT.patience_frames as u32;

const MESSAGE: &[u8] = b"lane closed after the bridge";

type Searching<H = [u8; 0]> = Receiver<4096, Box<ReceiverMemory<4096>>, FrameSearch<Box<SearchMemory>, H>>;

fn receiver(symbols_per_frame: f32) -> Searching {
    let settings = ReceiverSettings {
        symbols_per_frame,
        ..ReceiverSettings::default()
    };
    Receiver::new(settings, Box::default(), FrameSearch::new(Box::default())).unwrap()
}

fn panels(count: usize) -> Vec<PanelFrame> {
    let mut framer = Framer::new(MESSAGE, Code::for_length(MESSAGE.len()), false).unwrap();
    (0..count).map(|_| framer.next_panel()).collect()
}

fn delivery(event: Event<'_>) -> Option<(Vec<u8>, u64, u64)> {
    match event {
        Event::Delivered(d) => Some((d.message.to_vec(), d.first_stamp, d.last_stamp)),
        _ => None,
    }
}

#[test]
fn frames_become_a_message() {
    let mut receiver = receiver(1.0);
    let panels = panels(30);
    let mut delivered = Vec::new();
    for (number, panel) in (0..).zip(&panels) {
        let rendered = Scene {
            bits: panel.bits(),
            noise_grey: 1.0,
            ..Scene::PLAIN
        }
        .render();
        let outcome = receiver.frame(number, &rendered.frame());
        assert_eq!(outcome.reading.unwrap().detection.bits, *panel);
        delivered.extend(delivery(outcome.event));
    }
    delivered.extend(delivery(receiver.finish()));
    let (message, first, last) = delivered.first().cloned().unwrap();
    assert_eq!((message.as_slice(), first), (MESSAGE, 0));
    assert!(last < 30);
}

#[test]
fn slow_panels_and_lost_frames_still_give_the_message() {
    let mut receiver = receiver(0.5);
    let panels = panels(60);
    let mut delivered = None;
    for number in (0..120).filter(|number| number % 11 != 7) {
        let bits = panels[number / 2].bits();
        let rendered = Scene { bits, ..Scene::PLAIN }.render();
        let outcome = receiver.frame(number as u64, &rendered.frame());
        delivered = delivered.or(delivery(outcome.event));
    }
    assert_eq!(delivered.unwrap().0, MESSAGE);
}

/// At two frames a symbol, every other exposure of an unlucky camera catches a change of symbols, from the first one on.
#[test]
fn a_change_in_every_other_exposure_costs_no_message() {
    let panels = panels(41);
    for share in [0.2, 0.5, 0.8] {
        for first in [0, 1] {
            let mut receiver = receiver(0.5);
            let mut delivered = None;
            for number in first..80 {
                let (bits, next) = (panels[number / 2].bits(), panels[number.div_ceil(2)].bits());
                let rendered = Scene {
                    bits,
                    next: (next, share),
                    noise_grey: 1.0,
                    ..Scene::PLAIN
                }
                .render();
                let outcome = receiver.frame(number as u64, &rendered.frame());
                let is_one = number % 2 == 0;
                if let (true, Ok(reading)) = (is_one, outcome.reading) {
                    assert_eq!(reading.detection.bits.bits(), bits, "share {share}, frame {number}");
                }
                delivered = delivered.or(delivery(outcome.event));
            }
            assert_eq!(delivered.unwrap_or_default().0, MESSAGE, "share {share}, from frame {first} on");
        }
    }
}

/// Reads panels in the scenes that `scene` makes; returns the number of readings, all of which must be right.
fn read(receiver: &mut Searching, frames: usize, scene: impl Fn(usize) -> Scene) -> usize {
    let panels = panels(frames);
    let mut read = 0;
    for (number, panel) in panels.iter().enumerate() {
        let scene = Scene {
            bits: panel.bits(),
            ..scene(number)
        };
        if let Ok(reading) = receiver.frame(number as u64, &scene.render().frame()).reading {
            assert_eq!(reading.detection.bits, *panel, "frame {number}");
            read += 1;
        }
    }
    read
}

#[test]
fn a_panel_that_drives_past_is_followed() {
    // 14.5 px a frame: 20 m/s across at 50 m before a camera of 100 frames a second.
    let across = |number: usize| Scene {
        width: 640,
        centre: [60.0 + 14.5 * number as f32, 48.0 + 0.3 * number as f32],
        noise_grey: 1.0,
        ..Scene::PLAIN
    };
    assert!(read(&mut receiver(1.0), 35, across) >= 34);
}

#[test]
fn a_panel_is_read_on_its_own_lines_however_the_camera_shakes() {
    let shaken = |number: usize| {
        let turn = number as f32;
        let shake = [turn * 2.4, turn * 4.1].map(|angle| 2.5 * angle.sin());
        Scene {
            centre: [47.3 + shake[0], 48.6 + shake[1]],
            noise_grey: 1.0,
            ..Scene::PLAIN
        }
    };
    assert!(read(&mut receiver(1.0), 60, shaken) >= 50);
}

#[test]
fn a_soft_panel_that_jumps_is_not_read_halfway_between_its_lines() {
    let shaken = |number: usize| {
        let turn = number as f32;
        let shake = [turn * 2.4, turn * 4.1].map(|angle| 2.9 * angle.sin());
        Scene {
            centre: [47.3 + shake[0], 48.6 + shake[1]],
            pitch_px: 5.6,
            blur_px: [2.3; 2],
            noise_grey: 1.0,
            ..Scene::PLAIN
        }
    };
    assert!(read(&mut receiver(1.0), 60, shaken) >= 40);
}

#[test]
fn a_panel_on_a_board_is_followed_before_a_wall_as_bright_as_its_leds() {
    // A board that ends 0.9 pitches beyond the outer LEDs, rotated like them.
    let wall = |[x, y]: [f32; 2]| {
        let (sin, cos) = 11.0f32.to_radians().sin_cos();
        let (x, y) = (x - 48.0, y - 48.0);
        let on_board = [cos * x + sin * y, cos * y - sin * x].iter().all(|along| along.abs() < 4.4 * 5.4);
        if on_board { 0.2 } else { 5.0 }
    };
    let scene = |_| Scene {
        centre: [48.0; 2],
        pitch_px: 5.4,
        roll_deg: 11.0,
        light: [1.2, 6.0],
        blur_px: [1.0; 2],
        noise_grey: 1.0,
        background: wall,
        ..Scene::PLAIN
    };
    assert!(read(&mut receiver(1.0), 20, scene) >= 18);
}

#[test]
fn a_panel_whose_leds_run_into_each_other_is_followed() {
    // A board as dark as the gaps between the LEDs, before a wall that is bright on one side.
    let wall = |[x, _]: [f32; 2]| if x < 24.0 { 3.0 } else { 1.0 };
    let scene = |_| Scene {
        pitch_px: 5.45,
        light: [1.4, 4.2],
        blur_px: [3.0; 2],
        noise_grey: 1.0,
        background: wall,
        ..Scene::PLAIN
    };
    let mut receiver = receiver(1.0);
    let start = scene(0).corners().shifted(0.3, -0.2).unwrap();
    receiver.place(start, [0, 0], (96, 96)).unwrap();
    assert_eq!(read(&mut receiver, 40, scene), 40);
    let [seen, truth] = [receiver.corners().unwrap(), scene(39).corners()].map(|c| c.points());
    for (seen, truth) in seen.iter().flatten().zip(truth.iter().flatten()) {
        assert!((seen - truth).abs() < 1.0, "{seen} for {truth}");
    }
}

#[test]
fn no_speed_is_mistaken_for_another_line() {
    // About one, two and three pitches a frame.
    for speed_px in [4.4, 8.9, 13.1] {
        let across = |number: usize| Scene {
            width: 400,
            centre: [40.0 + speed_px * number as f32, 48.0],
            ..Scene::PLAIN
        };
        assert!(read(&mut receiver(1.0), 20, across) >= 18, "{speed_px} px a frame");
    }
}

#[test]
fn a_jump_is_found_or_admitted() {
    let jump = |number: usize| Scene {
        centre: if number < 10 { [47.3, 48.6] } else { [40.0, 52.0] },
        ..Scene::PLAIN
    };
    assert!(read(&mut receiver(1.0), 20, jump) >= 18);
}

#[test]
fn growth_and_exposure_changes_are_followed() {
    let grow = |number: usize| {
        let exposure = if number < 15 { 1.0 } else { 0.6 };
        let light = Scene::PLAIN.light.map(|light| light * exposure);
        Scene {
            width: 128,
            height: 128,
            centre: [64.0, 63.0],
            pitch_px: 4.4 * 1.01f32.powi(number as i32),
            light,
            noise_grey: 1.0,
            ..Scene::PLAIN
        }
    };
    assert!(read(&mut receiver(1.0), 40, grow) >= 38);
}

#[test]
fn a_short_occlusion_is_coasted_through_and_a_long_one_ends_openly() {
    let mut receiver = receiver(1.0);
    let plain = Frame::new(&[118; 96 * 96], 96, 96).unwrap();
    let scene = Scene::PLAIN.render();
    assert!(receiver.frame(0, &scene.frame()).reading.is_ok());
    assert!(receiver.frame(1, &scene.frame()).reading.is_ok());
    for missed in 1..=PATIENCE_FRAMES {
        let loss = receiver.frame(u64::from(missed) + 1, &plain).reading.unwrap_err();
        assert!(matches!(loss, Loss::Coasting { missed: m, .. } if m == missed), "{loss}");
    }
    let frame = u64::from(PATIENCE_FRAMES) + 2;
    assert!(matches!(receiver.frame(frame, &plain).reading, Err(Loss::Lost(_))));
    assert_eq!(receiver.corners(), None);
    let nothing = receiver.frame(frame + 1, &plain).reading;
    assert_eq!(nothing, Err(Loss::Locate(LocateError::NothingStandsOut)));
    assert!(receiver.frame(frame + 2, &scene.frame()).reading.is_ok());
}

#[test]
fn what_passes_before_a_panel_does_not_take_it_along() {
    const WIDTH: usize = 60;
    for speed in [23, 37, 51] {
        let mut receiver = receiver(1.0);
        for (number, panel) in panels(20).into_iter().enumerate() {
            // A dark post covers the panel for two to four frames.
            let from = (speed * number).saturating_sub(4 * speed);
            let scene = Scene {
                bits: panel.bits(),
                width: 320,
                centre: [147.3, 48.6],
                noise_grey: 1.0,
                wiper: ([from, from + WIDTH], 0.0, 0.05),
                ..Scene::PLAIN
            };
            let reading = receiver.frame(number as u64, &scene.render().frame()).reading;
            if from + WIDTH < 126 || from > 168 + speed {
                let bits = reading.map(|reading| reading.detection.bits);
                assert_eq!(bits, Ok(panel), "frame {number}, {speed} px a frame");
            }
        }
    }
}

#[test]
fn blinking_gives_a_panel_away_that_does_not_stand_out() {
    let settings = ReceiverSettings::default();
    let search = FrameSearch::with_history(Box::default(), std::vec![0u8; 2 * 96 * 96]);
    let mut receiver: Searching<Vec<u8>> = Receiver::new(settings, Box::default(), search).unwrap();
    let clutter = |pixels: &mut [u8]| {
        for (i, grey) in pixels.iter_mut().enumerate() {
            let (x, y) = ((i % 96) as f32, (i / 96) as f32);
            let wave = (x / 3.1).sin() * (y / 2.7).cos() + ((x + 2.0 * y) / 5.0).sin();
            *grey = (f32::from(*grey) + 25.0 * wave).clamp(0.0, 255.0) as u8;
        }
    };
    let mut found = None;
    for (number, panel) in panels(4).iter().enumerate() {
        let mut rendered = Scene {
            bits: panel.bits(),
            light: [1.2, 5.0],
            noise_grey: 1.0,
            ..Scene::PLAIN
        }
        .render();
        clutter(&mut rendered.pixels);
        found = found.or(receiver.frame(number as u64, &rendered.frame()).reading.ok());
    }
    let [x, y] = found.unwrap().corners.centre_px();
    assert!((x - 47.3).abs() < 0.3 && (y - 48.6).abs() < 0.3, "{x} {y}");
}

#[test]
fn frames_of_other_sizes_end_what_was_followed() {
    let mut receiver = receiver(1.0);
    let scene = Scene::PLAIN;
    assert!(receiver.frame(0, &scene.render().frame()).reading.is_ok());
    let small = Frame::new(&[118; 16], 4, 4).unwrap();
    assert_eq!(receiver.frame(1, &small).reading, Err(Loss::Locate(LocateError::NothingStandsOut)));
    assert_eq!(receiver.corners(), None);
    let larger = Scene { width: 128, ..scene };
    assert!(receiver.frame(2, &larger.render().frame()).reading.is_ok());
}

#[test]
fn a_known_place_needs_no_search() {
    let mut receiver = receiver(1.0);
    // Off LEDs as dark as the background: there is no outline, so the panel cannot be located.
    let scene = Scene {
        light: [1.0, 9.0],
        ..Scene::PLAIN
    };
    receiver.place(scene.corners(), [0; 2], (scene.width, scene.height)).unwrap();
    let reading = receiver.frame(0, &scene.render().frame()).reading.unwrap();
    assert_eq!(reading.detection.bits.bits(), scene.bits);
    assert!(receiver.place(scene.corners(), [0; 2], (20, 20)).is_err());
    assert_eq!(receiver.corners(), None);
}

#[test]
fn what_gives_unsure_bits_is_looked_for_again() {
    let settings = ReceiverSettings {
        method: Method::MaximumLikelihood,
        ..ReceiverSettings::default()
    };
    let scene = Scene {
        width: 128,
        noise_grey: 1.0,
        ..Scene::PLAIN
    };
    let pitch_px = Lattice::through(&scene.corners()).pitch()[0];
    for lines_off in [-2.0, 1.0, 2.0] {
        let search = FrameSearch::new(Box::default());
        let mut receiver: Searching = Receiver::new(settings, Box::default(), search).unwrap();
        let beside = scene.corners().shifted(lines_off * pitch_px, 0.0).unwrap();
        receiver.place(beside, [0; 2], (scene.width, scene.height)).unwrap();
        let right: Vec<bool> = (0..)
            .zip(panels(100))
            .map(|(number, panel)| {
                let rendered = Scene {
                    bits: panel.bits(),
                    ..scene
                }
                .render();
                let outcome = receiver.frame(number, &rendered.frame());
                outcome.reading.unwrap().detection.bits == panel
            })
            .collect();
        assert!(!right[0] && right[80..].iter().all(|&right| right));
    }
}

properties! {
    #![cases(24)]

    #[test]
    fn no_frame_panics(
        pixels in prop::collection::vec(prop_oneof![any::<u8>(), Just(0u8), Just(255u8)], 1..5000),
        width in 1usize..100,
        number: u64,
    ) {
        let mut receiver = receiver(1.0);
        let scene = Scene::PLAIN;
        prop_assert!(receiver.frame(7, &scene.render().frame()).reading.is_ok());
        let height = pixels.len() / width;
        if let Ok(frame) = Frame::new(&pixels, width, height) {
            let reading = receiver.frame(number, &frame).reading;
            if reading.is_ok() {
                prop_assert!(receiver.corners().is_some());
            }
        }
    }
}

#[test]
fn the_memory_is_as_large_as_stated() {
    type Whole = Receiver<9216, &'static mut ReceiverMemory<9216>, FrameSearch<&'static mut SearchMemory>>;
    let memory = size_of::<ReceiverMemory<9216>>();
    assert!(memory <= 31 * 9216 + 44_500);
    let further = size_of::<ReceiverMemory<9216, 2>>() - memory;
    assert!(further <= 22 * 9216 + 34_500);
    assert!(size_of::<SearchMemory>() <= 198_000);
    // The size that the feature `carrier` adds, and that of the last found place, which `surroundings` adds.
    let carrier = size_of::<crate::carrier::Carrier>() + size_of::<super::recent_levels::RecentLevels>();
    assert!(carrier <= 27_500, "{carrier}");
    let found = size_of::<Option<(u64, Lattice)>>();
    assert!(size_of::<Whole>() - size_of::<Deframer>() - carrier - found < 5_000);
    let all = memory + size_of::<SearchMemory>() + size_of::<Whole>();
    assert!(all < 594_000, "{all}");
}

#[test]
fn settings_out_of_range_are_refused() {
    let refusal = |settings| Receiver::<16, _>::new(settings, ReceiverMemory::new(), NoSearch).err();
    let too_many_symbols = ReceiverSettings {
        symbols_per_frame: 2.0,
        ..ReceiverSettings::default()
    };
    let error = refusal(too_many_symbols);
    assert!(matches!(error, Some(ReceiverError::SymbolRate(_))));
    let blurred_to_nothing = Camera {
        blur_sigma_px: f32::INFINITY,
        ..Camera::default()
    };
    let error = refusal(ReceiverSettings {
        camera: blurred_to_nothing,
        ..ReceiverSettings::default()
    });
    assert!(matches!(error, Some(ReceiverError::Camera(_))));
}

#[test]
fn of_a_panel_given_up_a_frame_tells_once() {
    let memory = Box::<ReceiverMemory<4096, 2>>::default();
    let search = FrameSearch::new(Box::<SearchMemory>::default());
    let mut receiver = Receiver::new(ReceiverSettings::default(), memory, search).unwrap();
    let scene = Scene::PLAIN.render();
    let plain = [118; 96 * 96];
    let mut told = |number: u64, pixels: &[u8]| {
        let frame = Frame::new(pixels, 96, 96).unwrap();
        let mut told = Vec::new();
        receiver.frame_each(number, &frame, &mut (), |panel, outcome| {
            told.push((panel, outcome.reading));
        });
        told
    };
    assert!(matches!(told(0, &scene.pixels)[..], [(0, Ok(_))]));
    let given_up = u64::from(PATIENCE_FRAMES) + 1;
    for number in 1..given_up {
        let told = told(number, &plain);
        assert!(matches!(told[..], [(0, Err(Loss::Coasting { .. }))]), "{told:?}");
    }
    let last = told(given_up, &plain);
    assert!(matches!(last[..], [(0, Err(Loss::Lost(_)))]), "{last:?}");
    let nothing = Loss::Locate(LocateError::NothingStandsOut);
    assert_eq!(told(given_up + 1, &plain), [(0, Err(nothing))]);
    assert!(matches!(told(given_up + 2, &scene.pixels)[..], [(0, Ok(_))]));
}

#[test]
fn two_panels_deliver_their_own_messages() {
    let messages: [&[u8]; 2] = [b"left lane closed", b"ambulance behind"];
    let mut framers = messages.map(|m| Framer::new(m, Code::for_length(m.len()), false).unwrap());
    let memory = Box::<ReceiverMemory<4096, 2>>::default();
    let search = FrameSearch::with_history(Box::<SearchMemory>::default(), std::vec![0; 2 * 200 * 96]);
    let mut receiver = Receiver::new(ReceiverSettings::default(), memory, search).unwrap();
    let mut delivered = Vec::new();
    for number in 0..30u64 {
        let x = [45.0 + 0.4 * number as f32, 150.0];
        let mut seen = framers.iter_mut().zip(x).zip([4.4, 5.2]).map(|((framer, x), pitch_px)| {
            let scene = Scene {
                bits: framer.next_panel().bits(),
                width: 200,
                centre: [x, 48.0],
                pitch_px,
                noise_grey: 1.0,
                ..Scene::PLAIN
            };
            scene.render().pixels
        });
        let (left, right) = (seen.next().unwrap(), seen.next().unwrap());
        let both: Vec<u8> = left.iter().zip(&right).map(|(&a, &b)| a.max(b)).collect();
        receiver.frame_each(number, &Frame::new(&both, 200, 96).unwrap(), &mut (), |_, outcome| {
            if let Event::Delivered(delivery) = outcome.event {
                delivered.push(delivery.message.to_vec());
            }
        });
    }
    assert!(receiver.corners_each().iter().all(Option::is_some));
    for message in messages {
        assert!(delivered.iter().any(|got| got == message), "{delivered:?}");
    }
}

/// The 64×64 pixels of a frame around a place.
fn cut(frame: &Frame<'_>, [x, y]: [f32; 2]) -> ([u16; 2], Vec<u8>) {
    let origin = [x, y].map(|c| c as usize - 32);
    let region = frame.region(origin[0], origin[1], 64, 64).unwrap();
    (origin.map(|c| c as u16), region.rows().flatten().copied().collect())
}

#[test]
fn moving_regions_give_what_whole_frames_give() {
    let mut framer = Framer::new(MESSAGE, Code::for_length(MESSAGE.len()), false).unwrap();
    let settings = ReceiverSettings::default();
    let mut whole = receiver(1.0);
    let mut part = Receiver::new(settings, Box::<ReceiverMemory<4096>>::default(), NoSearch).unwrap();
    let mut messages = [const { Vec::new() }; 2];
    let mut centre = [60.0, 60.0];
    for number in 0..30 {
        let scene = Scene {
            bits: framer.next_panel().bits(),
            width: 300,
            height: 120,
            centre: [60.2 + 0.9 * number as f32, 60.4 - 0.3 * number as f32],
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        let rendered = scene.render();
        let frame = rendered.frame();
        let (origin, pixels) = cut(&frame, centre);
        let region = Frame::new(&pixels, 64, 64).unwrap();
        if number == 0 {
            whole.place(scene.corners(), [0; 2], (300, 120)).unwrap();
            part.place(scene.corners(), origin, (64, 64)).unwrap();
        }
        let whole = whole.frame(number, &frame);
        let part = part.region(number, origin, &region, &mut ());
        let (whole_reading, reading) = (whole.reading.unwrap(), part.reading.unwrap());
        assert_eq!(reading.detection.bits.bits(), scene.bits, "frame {number}");
        let pairs = reading.detection.soft.0.iter().zip(whole_reading.detection.soft.0);
        for (&a, b) in pairs {
            assert!(i32::from(a).abs_diff(i32::from(b)) <= 1, "frame {number}");
        }
        assert_eq!(part.symbol, whole.symbol);
        for (messages, event) in messages.iter_mut().zip([whole.event, part.event]) {
            if let Event::Delivered(delivery) = event {
                messages.push((delivery.message.to_vec(), delivery.last_stamp));
            }
        }
        let [x, y] = reading.corners.centre_px();
        centre = [x + origin[0] as f32, y + origin[1] as f32];
    }
    assert_eq!(messages[0], messages[1]);
    assert_eq!(messages[0][0].0, MESSAGE);
}

#[test]
fn a_region_that_misses_the_panel_ends_nothing() {
    let scene = Scene::PLAIN;
    let rendered = scene.render();
    let settings = ReceiverSettings::default();
    let mut receiver = Receiver::new(settings, Box::<ReceiverMemory<4096>>::default(), NoSearch).unwrap();
    let region = rendered.frame();
    let corners = scene.corners().shifted(500.0, 400.0).unwrap();
    receiver.place(corners, [500, 400], (scene.width, scene.height)).unwrap();
    assert!(receiver.region(0, [500, 400], &region, &mut ()).reading.is_ok());
    for origin in [[900, 400], [0, 0], [u16::MAX; 2]] {
        let number = u64::from(origin[0]) % 7 + 1;
        assert!(receiver.region(number, origin, &region, &mut ()).reading.is_err());
    }
    assert!(receiver.region(9, [500, 400], &region, &mut ()).reading.is_ok());
}
