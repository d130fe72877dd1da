//! What a computer asks does not keep frames from being read.

use super::*;

fn put(bench: &mut Bench, sequence: u32, request: Request) {
    let mut wire = [0; wire_length(REQUEST_MAX)];
    bench
        .input
        .extend(encode(Kind::Request, sequence, &request, &mut wire).unwrap());
}

/// The numbers of the requests that were answered.
fn answered(bench: &mut Bench) -> Vec<u32> {
    let mut reader = FrameReader::<ANSWER_MAX>::new();
    let frames = std::mem::take(&mut bench.output);
    frames
        .iter()
        .filter_map(|&byte| reader.push(byte)?.ok().map(|frame| frame.sequence()))
        .collect()
}

/// However many requests wait, one is answered each time, in their order, and none is lost.
#[test]
fn one_request_is_answered_at_a_time() {
    let (mut application, mut bench) =
        (application(Mode::QVGA, SYMBOL_MILLIHERTZ), Bench::default());
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

/// Requests without end, as fast as the line is: between two frames one answer is all that is sent.
#[test]
fn frames_are_read_beside_requests_without_end() {
    let (mut application, mut bench) =
        (application(Mode::QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(Mode::QVGA, SYMBOL_MILLIHERTZ, b"through it all");
    application.start(&mut bench);
    let mut most = 0;
    for sequence in 0..200 {
        for _ in 0..16 {
            put(&mut bench, sequence, Request::Status);
        }
        // What there is no room for is lost.
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

/// All parts of a picture are of one frame as long as they are asked for, and half a second later there is a new one.
#[test]
fn a_picture_is_kept_for_half_a_second() {
    let (mut application, mut bench) =
        (application(Mode::QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(Mode::QVGA, SYMBOL_MILLIHERTZ, b"picture");
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
