//! A computer's requests do not stop the reading of frames.

use super::*;
use link::l2a_table::Interval;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

fn put(bench: &mut Bench, sequence: u32, request: Request) {
    let mut wire = [0; wire_length(REQUEST_MAX)];
    bench.input.extend(encode(Kind::Request, sequence, &request, &mut wire).unwrap());
}

/// The sequence numbers of the answered requests.
fn answered(bench: &mut Bench) -> Vec<u32> {
    let mut reader = FrameReader::<ANSWER_MAX>::new();
    let frames = std::mem::take(&mut bench.output);
    frames
        .iter()
        .filter_map(|&byte| reader.push(byte)?.ok().map(|frame| frame.sequence()))
        .collect()
}

/// Of any number of waiting requests, one is answered each time, in order, and none is lost.
#[test]
fn one_request_is_answered_at_a_time() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    for sequence in 0..8 {
        put(&mut bench, sequence, Request::Status);
    }
    for sequence in 0..8 {
        application.serve(&mut bench);
        assert_eq!(answered(&mut bench), [sequence]);
    }
    application.serve(&mut bench);
    assert!(answered(&mut bench).is_empty());
}

/// Endless requests at the full speed of the line: one answer at most is sent between two frames.
#[test]
fn frames_are_read_beside_requests_without_end() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"through it all");
    application.start(&mut bench);
    let mut most = 0;
    for sequence in 0..200 {
        for _ in 0..16 {
            put(&mut bench, sequence, Request::Status);
        }
        // Bytes beyond the capacity are lost.
        bench.input.truncate(512);
        run(&mut application, &mut bench, &mut scene, 1);
        most = most.max(bench.output.len());
        bench.output.clear();
    }
    assert_eq!(application.message(), b"through it all");
    assert!(most > 50 && most <= wire_length(ANSWER_MAX), "{most}");
    assert_eq!(application.counters().frames, 200);
}

fn number(answer: Answer<'_>) -> u64 {
    match answer {
        Answer::Picture(part) => part.frame,
        other => panic!("{other:?}"),
    }
}

/// All parts of a picture are of one frame while they are requested, and half a second later there is a new one.
#[test]
fn a_picture_is_kept_for_half_a_second() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"picture");
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 3);
    let mut part = |frames: u32, offset| {
        for _ in 0..frames {
            run(&mut application, &mut bench, &mut scene, 1);
        }
        let request = Request::Picture { offset };
        ask(&mut application, &mut bench, offset, request, number)
    };
    let first = part(0, 0);
    // 14 frames take 0.47 s.
    assert_eq!([part(14, 512), part(14, 1024), part(14, 5000)], [first; 3]);
    assert_eq!(part(18, 0), first + 3 * 14 + 18);
}

fn reading(application: &mut Application<impl Follow>, bench: &mut Bench) -> Option<WireReading> {
    ask(application, bench, 7, Request::Reading, |answer| match answer {
        Answer::Reading(reading) => reading,
        other => panic!("{other:?}"),
    })
}

/// Readings in floating point and in integers alike: LEDs, soft values, and the range once the panel has sent its size; and none after the
/// panel has gone.
#[test]
fn readings_are_told_with_their_range() {
    let size = Geometry::new(30_000, Interval::ONE).unwrap();
    let mut floating = application(QVGA, SYMBOL_MILLIHERTZ);
    tells_readings(&mut floating, QVGA, SYMBOL_MILLIHERTZ, size);
    let mut whole = in_integers(BINNED, 9_000);
    tells_readings(&mut whole, BINNED, 9_000, size);
}

fn tells_readings(application: &mut Application<impl Follow>, mode: CameraMode, symbol_millihertz: u32, size: Geometry) {
    let mut bench = Bench::default();
    let mut scene = Scene::of_size(Some(size), mode, symbol_millihertz, b"here I am");
    application.start(&mut bench);
    assert_eq!(reading(application, &mut bench), None);
    run(application, &mut bench, &mut scene, 600);
    // The size is sent between two repeats.
    let told = (0..200).find_map(|_| {
        run(application, &mut bench, &mut scene, 1);
        reading(application, &mut bench).filter(|told| told.pitch_m.is_some() && !told.is_mixed)
    });
    let told = told.expect("the panel tells its size");
    assert!(scene.symbols.contains(&told.bits), "{told:?}");
    for (led, soft) in told.soft.as_flattened().iter().enumerate() {
        assert_eq!(*soft > 0, told.bits >> led & 1 == 1, "{told:?}");
    }
    assert!(told.confidence > 0.9, "{told:?}");
    assert_eq!(told.pitch_m, Some(0.06));
    let range_m = 0.06 * range_pitches(&scene.corners.unwrap(), &mode);
    let found_m = told.range_m().unwrap();
    assert!((found_m / range_m - 1.0).abs() < 0.02, "{found_m} m of {range_m} m");
    scene.corners = None;
    run(application, &mut bench, &mut scene, 100);
    assert_eq!(reading(application, &mut bench), None);
}

/// The numbers of the faults and their values stay as they are: computers with older programs read them.
#[test]
fn faults_keep_their_numbers_on_the_wire() {
    let register = CameraError::Register {
        register: 0x0202,
        written: 1,
        holds: 0xff,
    };
    has_numbers(CameraError::Silent, (0u8, 0u8));
    has_numbers(CameraError::WrongId { id: 0x0360 }, (0u8, 1u8, 0x0360u16));
    has_numbers(register, (0u8, 2u8, 0x0202u16, 1u8, 0xffu8));
    has_numbers(Fault::NoFrames, 1u8);
    has_numbers(Fault::NoWholeFrames, 2u8);
}

/// On the wire, a fault is these numbers.
fn has_numbers<T: DeserializeOwned + PartialEq + Debug>(fault: impl Into<Fault>, expected: T) {
    let mut wire = [0; wire_length(REQUEST_MAX)];
    let bytes = encode(Kind::Answer, 0, &fault.into(), &mut wire).unwrap();
    let mut reader = FrameReader::<REQUEST_MAX>::new();
    let numbers = bytes.iter().find_map(|&byte| {
        let frame = reader.push(byte)?.unwrap();
        Some(frame.message(Kind::Answer).unwrap())
    });
    assert_eq!(numbers, Some(expected));
}
