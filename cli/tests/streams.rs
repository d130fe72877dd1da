//! `vocc receive` on streams: y4m, pictures of its view, and reasons for lost frames.

mod common;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Output, Stdio};

use common::recording::{MESSAGE, film, film_with, filmed, pixels, run, y4m, y4m_at};
use common::{command, says, text};

/// Receives a file on standard input.
fn receive(file: &Path, arguments: &[&str]) -> Output {
    let input = std::fs::File::open(file).expect("the file");
    run(command(&[]).args(["receive", "-"]).args(arguments).stdin(input))
}

#[test]
fn y4m_is_received() {
    let folder = filmed("y4m", 16);
    let mut stream = y4m(&folder);
    let file = folder.join("film.y4m");
    std::fs::write(&file, &stream).expect("a file");
    let whole = receive(&file, &[]);
    assert!(text(&whole.stdout).contains(MESSAGE), "{}", text(&whole.stderr));
    std::fs::write(&file, &stream[..stream.len() - 9]).expect("a file");
    let cut = receive(&file, &[]);
    assert_eq!(cut.status.code(), Some(2));
    assert!(text(&cut.stdout).contains(MESSAGE) && text(&cut.stderr).contains("colours"));
    // An empty line in place of a frame is not the end of a stream.
    stream.push(b'\n');
    std::fs::write(&file, &stream).expect("a file");
    let damaged = receive(&file, &[]);
    assert_eq!(damaged.status.code(), Some(2));
    assert!(
        text(&damaged.stdout).contains(MESSAGE) && text(&damaged.stderr).contains("should begin"),
        "{}",
        text(&damaged.stderr)
    );
}

#[test]
fn what_is_seen_is_drawn_and_what_is_lost_is_explained() {
    let folder = filmed("show", 4);
    let mut stream: Vec<u8> = pixels(&folder).concat();
    stream.extend(vec![118; 320 * 240]);
    let file = folder.join("film.gray");
    std::fs::write(&file, stream).expect("a file");
    let drawn = folder.join("seen");
    let arguments = ["--raw", "320x240", "--profile", "--show", common::name(&drawn)];
    let output = receive(&file, &arguments);
    let told = text(&output.stderr);
    assert!(told.contains("frame 4: coasting, frame 1 of 12"), "{told}");
    assert!(told.contains("Follow"), "{told}");
    let picture = image::open(drawn.join("frame-000002-panel-0.png")).expect("a picture").into_rgb8();
    let green = picture.pixels().filter(|pixel| pixel[1] > 150 && pixel[0] < 100).count();
    let red = picture.pixels().filter(|pixel| pixel[0] > 150 && pixel[1] < 100).count();
    assert!(green > 500 && red > 500, "{green} green and {red} red pixels");
    assert!(!drawn.join("frame-000004-panel-0.png").exists());
}

#[test]
fn frames_of_another_size_are_refused_and_the_rest_is_read() {
    let folder = filmed("sizes", 3);
    for (name, width, height) in [("a", 1u32, 1u32), ("b", 7, 200), ("c", 640, 3)] {
        image::GrayImage::from_pixel(width, height, image::Luma([255]))
            .save(folder.join(format!("frame-000001{name}.png")))
            .expect("a file");
    }
    let output = run(command(&[]).args(["receive", "--bits"]).arg(&folder));
    says(&output, 2, &["7 × 200", "one size", "3 of 6 frames could not be used"]);
    let read = text(&output.stdout);
    assert!(read.contains("frame 0:") && read.contains("frame 5:"), "{read}");
}

#[test]
fn a_stream_that_pauses_is_told_to_be_waited_for() {
    let mut receive = command(&["receive", "-", "--raw", "320x240"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("vocc runs");
    let mut told = String::new();
    let mut errors = BufReader::new(receive.stderr.take().expect("standard error"));
    errors.read_line(&mut told).expect("a line");
    assert_eq!(told, "0 frames, 10 s so far\n");
    drop(receive.stdin.take());
    assert_eq!(receive.wait().expect("vocc ends").code(), Some(1));
}

#[test]
fn a_rate_that_nobody_tells_is_found_and_a_wrong_one_is_doubted() {
    let message = "Ice on the bridge, drive slowly, keep your distance and mind the gap";
    for rate in [45, 90, 100] {
        let folder = film(&format!("rate-{rate}"), message, 4200 / rate, rate);
        // If frames are missing, only the rate gives the number of symbols in a gap.
        for lost in (3..4200 / rate).step_by(7) {
            std::fs::remove_file(folder.join(format!("frame-{lost:06}.png"))).expect("a frame");
        }
        let receive = |arguments: &[&str]| run(command(&["receive"]).arg(&folder).args(arguments));
        let found = receive(&[]);
        let told = text(&found.stderr);
        assert_eq!(text(&found.stdout).matches(message).count(), 1, "{rate}: {told}");
        // 100 is close enough to 90 to be read with that clock.
        let is_said = told.contains("read at 45 symbols a second");
        assert_eq!(is_said, rate == 45, "{rate}: {told}");
        // Once the rate is found, symbols have the same numbers as with a configured rate.
        let last_symbol = |arguments: &[&str]| {
            let numbered = receive(&[&["--bits", "--json"], arguments].concat());
            let lines = text(&numbered.stdout);
            let symbol = |line| {
                let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
                line["symbol"].as_u64()
            };
            let last = lines.lines().rev().find_map(symbol);
            last.expect("a symbol")
        };
        if is_said {
            assert_eq!(last_symbol(&[]), last_symbol(&["--symbol-rate", "45"]));
        }
        let wrong = receive(&["--symbol-rate", if rate == 45 { "90" } else { "45" }]);
        let told = text(&wrong.stderr);
        assert_eq!(wrong.status.code(), Some(1), "{rate}: {told}");
        assert!(told.contains("symbols a second (--symbol-rate) and 100"), "{rate}: {told}");
        assert!(told.contains("here the panel changes about"), "{rate}: {told}");
    }
}

/// A transmitter shows 23.077 symbols a second if it is told of a camera with 30 frames a second and an exposure of 1/100 s.
#[test]
fn a_long_message_at_the_rate_for_an_exposure_arrives_with_nothing_told() {
    const FRAME: usize = "FRAME\n".len() + 320 * 240 * 3 / 2;
    let message = "Ice on the bridge, drive slowly, keep your distance and mind the gap. ".repeat(3);
    let folder = film_with(
        "exposure-rate",
        &message,
        240,
        &["camera.frame_rate_hz=30", "link.symbol_rate_hz=23.077"],
    );
    let mut stream = y4m_at(&folder, 30);
    // If frames show no panel, only the rate gives the number of symbols in a gap: at the usual 27 a second no message arrives.
    let first = stream.len() - 240 * FRAME;
    for frame in stream[first..].chunks_exact_mut(FRAME).skip(10).step_by(11) {
        frame["FRAME\n".len()..][..320 * 240].fill(118);
    }
    let file = folder.join("film.y4m");
    std::fs::write(&file, stream).expect("a file");
    let output = receive(&file, &[]);
    let told = text(&output.stderr);
    assert!(text(&output.stdout).contains(message.trim_end()), "{told}");
    assert!(told.contains("read at 23.077 symbols a second"), "{told}");
    let usual = receive(&file, &["--symbol-rate", "27"]);
    assert!(!text(&usual.stdout).contains(message.trim_end()));
}
