//! A service that is asked, asked twice, and asked nonsense.

use super::*;
use crate::receiver::ReceiverMemory;
use crate::synthetic::Scene;
use link::serial::{FrameReader, Kind, encode, wire_length};
use properties::prelude::*;
use std::boxed::Box;
use std::vec::Vec;

struct Bench;

impl Machine for Bench {
    const BOARD: &'static str = "bench";
    const TICKS_HZ: u32 = 1;

    fn ticks(&self) -> u32 {
        0
    }

    fn stack_bytes(&self) -> u32 {
        0
    }
}

type Board = Service<4096, Box<ReceiverMemory<4096>>>;

fn board() -> Board {
    Service::new(Box::default()).unwrap()
}

fn request(sequence: u32, request: &Request<'_>) -> Vec<u8> {
    let mut wire = std::vec![0; wire_length(REGION_REQUEST_MAX)];
    encode(Kind::Request, sequence, request, &mut wire).unwrap().to_vec()
}

/// The last answer to these bytes, on the wire.
fn said(board: &mut Board, bytes: &[u8]) -> Option<Vec<u8>> {
    bytes
        .iter()
        .fold(None, |said, &byte| board.receive(byte, &Bench).map(<[u8]>::to_vec).or(said))
}

fn understood<T>(wire: &[u8], look: impl FnOnce(&Answer<'_>) -> T) -> T {
    let mut reader = Box::new(FrameReader::<REGION_ANSWER_MAX>::new());
    let (&last, first) = wire.split_last().unwrap();
    for &byte in first {
        assert!(reader.push(byte).is_none());
    }
    let frame = reader.push(last).unwrap().unwrap();
    look(&frame.message(Kind::Answer).unwrap())
}

fn ask<T>(board: &mut Board, sequence: u32, of: &Request<'_>, look: impl FnOnce(&Answer<'_>) -> T) -> T {
    understood(&said(board, &request(sequence, of)).unwrap(), look)
}

fn refusal(board: &mut Board, sequence: u32, of: &Request<'_>) -> Option<Refusal> {
    ask(board, sequence, of, |answer| match answer {
        Answer::Refused(refusal) => Some(*refusal),
        _ => None,
    })
}

#[test]
fn what_is_asked_twice_is_done_once() {
    let mut board = board();
    let scene = Scene::PLAIN;
    let rendered = scene.render();
    let region = Region {
        frame: 3,
        origin: [10, 20],
        size: [96, 96],
        corners: Some(scene.corners().shifted(10.0, 20.0).unwrap().points()),
        pixels: &rendered.pixels,
    };
    let asked = request(1, &Request::Region(region));
    let first = said(&mut board, &asked).unwrap();
    understood(&first, |answer| {
        let Answer::Report(Report {
            reading: Ok(sight),
            symbol: Some(0),
            ..
        }) = answer
        else {
            panic!("{answer:?}");
        };
        assert_eq!(sight.bits, scene.bits);
        let [x, y] = scene.corners().points()[2];
        let [seen_x, seen_y] = sight.corners[2];
        assert!((x + 10.0 - seen_x).abs() < 0.01 && (y + 20.0 - seen_y).abs() < 0.01);
    });
    assert_eq!(said(&mut board, &asked), Some(first));
    // Anew it would be a frame whose number does not rise.
    let again = Region { corners: None, ..region };
    ask(&mut board, 2, &Request::Region(again), |answer| {
        assert!(
            matches!(
                answer,
                Answer::Report(Report {
                    reading: Err(Unread::NoPlace),
                    ..
                })
            ),
            "{answer:?}"
        );
    });
}

#[test]
fn impossible_requests_are_refused() {
    let mut board = board();
    let pixels = [118; 64 * 64];
    let region = Region {
        frame: 0,
        origin: [0; 2],
        size: [64; 2],
        corners: None,
        pixels: &pixels,
    };
    let wrong = |board: &mut Board, region| refusal(board, 1, &Request::Region(region));
    for size in [[64, 63], [0, 0], [4096, 1], [16, 256]] {
        let [width, height] = size;
        assert_eq!(
            wrong(&mut board, Region { size, ..region }),
            Some(Refusal::Size {
                width,
                height,
                pixels: 4096
            })
        );
        assert!(ask(&mut board, 2, &Request::Hello, |answer| matches!(answer, Answer::Hello(_))));
    }
    let mirrored = Some([[40.0, 8.0], [8.0, 8.0], [8.0, 40.0], [40.0, 40.0]]);
    assert_eq!(
        wrong(
            &mut board,
            Region {
                corners: mirrored,
                ..region
            }
        ),
        Some(Refusal::Corners)
    );
    let outside = Some([[8.0, 8.0], [70.0, 8.0], [70.0, 70.0], [8.0, 70.0]]);
    ask(&mut board, 2, &Request::Hello, |_| ());
    assert_eq!(
        wrong(
            &mut board,
            Region {
                corners: outside,
                ..region
            }
        ),
        Some(Refusal::Place)
    );
    let settings = Settings {
        symbols_per_frame: 2.0,
        ..Settings::default()
    };
    assert_eq!(refusal(&mut board, 3, &Request::Begin(settings)), Some(Refusal::Settings));
    // A request that there is not.
    let mut wire = [0; 32];
    let unknown = encode(Kind::Request, 4, &99u8, &mut wire).unwrap();
    let answer = said(&mut board, unknown).unwrap();
    understood(&answer, |answer| assert_eq!(*answer, Answer::Refused(Refusal::Unknown)));
    assert!(ask(&mut board, 5, &Request::Finish, |answer| { *answer == Answer::Finished(None) }));
}

#[test]
fn the_longest_messages_fit_their_frames() {
    let region = Region {
        frame: u64::MAX,
        origin: [u16::MAX; 2],
        size: [128; 2],
        corners: Some([[f32::MAX; 2]; 4]),
        pixels: &[7; REGION_SIDE_MAX * REGION_SIDE_MAX],
    };
    let wire = request(u32::MAX, &Request::Region(region));
    assert!(said(&mut board(), &wire).is_some());
    let report = Report {
        reading: Ok(WireReading {
            corners: [[0.0; 2]; 4],
            bits: u64::MAX,
            soft: [[-127; 8]; 8],
            confidence: 1.0,
            mixed: true,
        }),
        symbol: Some(u32::MAX),
        message: Some(Message {
            bytes: &[1; 1024],
            first_frame: u64::MAX,
            last_frame: u64::MAX,
            corrected_bits: u32::MAX,
        }),
        ticks: u32::MAX,
        stage_ticks: [u32::MAX; STAGE_COUNT],
    };
    let mut wire = [0; ANSWER_WIRE_MAX];
    let length = encode(Kind::Answer, u32::MAX, &Answer::Report(report), &mut wire).unwrap().len();
    understood(&wire[..length], |answer| assert_eq!(*answer, Answer::Report(report)));
}

properties! {
    #![cases(24)]

    #[test]
    fn no_region_panics_and_no_garbage_silences(
        garbage in prop::collection::vec(any::<u8>(), 0..300),
        origins in prop::collection::vec(any::<[u16; 2]>(), 4),
        sizes in prop::collection::vec([0u16..80, 0u16..80], 4),
        corners in prop::option::of(prop::array::uniform4(prop::array::uniform2(-10.0f32..90.0))),
        grey in any::<u8>(),
    ) {
        let mut board = board();
        let scene = Scene::PLAIN;
        let rendered = scene.render();
        for (i, (origin, size)) in (1..).zip(origins.iter().zip(&sizes)) {
            let known = Region { frame: 2 * u64::from(i), origin: *origin, size: [96; 2], corners: None, pixels: &rendered.pixels };
            said(&mut board, &request(2 * i, &Request::Region(known)));
            let pixels = std::vec![grey; usize::from(size[0]) * usize::from(size[1])];
            let other = Region { frame: 2 * u64::from(i) + 1, origin: [origin[0], size[0]], size: *size, corners, pixels: &pixels };
            said(&mut board, &garbage);
            let answer = said(&mut board, &request(2 * i + 1, &Request::Region(other)));
            prop_assert!(answer.is_some());
        }
    }
}
