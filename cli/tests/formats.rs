//! `vocc receive` and `vocc decode` on what cameras, recorders and other programs write: names, depths, damage, and advice.
//! `tests/suites/films.rs` has the films that ffmpeg decodes.

mod common;

use std::path::{Path, PathBuf};
use std::process::Output;

use common::recording::{MESSAGE, filmed, pixels, run};
use common::{command, folder, name, refused, says, text};

const SIZE: (u32, u32) = (320, 240);
const FRAMES: u32 = 16;

fn receive(source: &Path, arguments: &[&str]) -> Output {
    run(command(&["receive"]).arg(source).args(arguments))
}

/// Asserts that the message arrives.
fn delivers(received: &Output) {
    says(received, 0, &[]);
    assert!(text(&received.stdout).contains(MESSAGE), "{}", text(&received.stderr));
}

/// A film's frames in proportion to light, up to `white`.
fn light(film: &Path, white: u16) -> Vec<Vec<u16>> {
    let sample = |grey: u8| (f64::from(white) * (f64::from(grey) / 255.0).powf(2.2)).round() as u16;
    pixels(film)
        .into_iter()
        .map(|frame| frame.into_iter().map(sample).collect())
        .collect()
}

fn write_deep(path: PathBuf, samples: Vec<u16>) {
    let picture = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(SIZE.0, SIZE.1, samples).expect("a picture");
    picture.save(path).expect("a file");
}

#[test]
fn frames_are_read_in_the_order_of_their_numbers() {
    let film = filmed("unpadded", FRAMES);
    for number in 0..FRAMES {
        let from = film.join(format!("frame-{number:06}.png"));
        std::fs::rename(from, film.join(format!("frame{number}.png"))).expect("renamed");
    }
    std::fs::write(film.join("._frame3.png"), "what macOS keeps of it").expect("a file");
    delivers(&receive(&film, &[]));
    let mut by_letters: Vec<String> = (0..FRAMES).map(|number| format!("frame{number}.png")).collect();
    by_letters.sort();
    delivers(&run(command(&["receive"]).args(&by_letters).current_dir(&film)));
}

#[test]
fn the_depth_of_pgm_is_its_own() {
    let film = filmed("pgm-8", FRAMES);
    for (white, depths) in [(4095u16, ["12", "16"]), (1023, ["10", "12"])] {
        let deep = folder(&format!("pgm-{white}"));
        for (number, samples) in light(&film, white).into_iter().enumerate() {
            let mut pgm = format!("P5\n{} {}\n{white}\n", SIZE.0, SIZE.1).into_bytes();
            pgm.extend(samples.iter().flat_map(|sample| sample.to_be_bytes()));
            std::fs::write(deep.join(format!("{number:02}.pgm")), pgm).expect("a file");
        }
        delivers(&receive(&deep, &[]));
        let [one, other] = depths.map(|depth| receive(&deep, &["--bits", "--depth", depth]));
        delivers(&one);
        assert_eq!(text(&one.stdout), text(&other.stdout), "{depths:?}");
    }
}

#[test]
fn a_brighter_picture_changes_no_levels() {
    let film = filmed("white-8", FRAMES);
    let [plain, hot] = [false, true].map(|is_hot| {
        let deep = folder(&format!("white-{is_hot}"));
        for (number, mut samples) in light(&film, 4095).into_iter().enumerate() {
            // Noise, in a corner, above the white of all others.
            if is_hot && number == 9 {
                samples[0] = 4200;
            }
            write_deep(deep.join(format!("{number:02}.png")), samples);
        }
        receive(&deep, &["--bits", "--json"])
    });
    delivers(&plain);
    assert_eq!(text(&plain.stdout), text(&hot.stdout));
    says(&hot, 0, &["09.png has samples up to 4200", "--depth"]);
}

#[test]
fn frames_of_another_depth_are_refused_and_the_rest_is_read() {
    let film = filmed("mixed", 6);
    let deep = light(&film, 4095).swap_remove(3);
    write_deep(film.join("frame-000003.png"), deep);
    let received = receive(&film, &["--bits"]);
    says(
        &received,
        2,
        &[
            "frame 3: its samples are levels of more than 8 bits, those of the frames before are levels of 8 bits",
            "1 of 6 frames",
        ],
    );
    assert!(text(&received.stdout).contains("frame 5:"), "{}", text(&received.stdout));
}

#[test]
fn a_jpeg_without_its_end_marker_is_read_with_a_word() {
    let film = filmed("endless-jpeg", FRAMES);
    let last = film.join(format!("frame-{:06}.png", FRAMES - 1));
    let frame = image::open(&last).expect("a frame").into_luma8();
    let mut jpeg = Vec::new();
    frame
        .write_with_encoder(image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95))
        .expect("encoded");
    std::fs::remove_file(&last).expect("the frame");
    let path = last.with_extension("jpg");
    std::fs::write(&path, &jpeg[..jpeg.len() - 2]).expect("a file");
    let word = ["has no end marker"];
    let received = receive(&film, &[]);
    says(&received, 0, &word);
    delivers(&received);
    let decoded = run(command(&["decode"]).arg(&path));
    assert!(text(&decoded.stderr).contains(word[0]), "{decoded:?}");
    std::fs::write(&path, &jpeg[..jpeg.len() / 2]).expect("a file");
    refused(&["decode", name(&path)], &["ends too soon"]);
}

/// A film that is flagged as interlaced, of these frames.
fn flagged(path: &Path, frames: &[Vec<u8>]) {
    let mut film = b"YUV4MPEG2 W320 H240 F100:1 It Cmono\n".to_vec();
    for frame in frames {
        film.extend(b"FRAME\n".iter().chain(frame));
    }
    std::fs::write(path, film).expect("a film");
}

#[test]
fn progressive_films_that_are_flagged_as_interlaced_are_let_in() {
    let film = filmed("flagged", FRAMES);
    let path = film.join("film.y4m");
    let frames = pixels(&film);
    let piped = |arguments: &[&str]| {
        let mut receive = command(&["receive", "-"]);
        run(receive.args(arguments).stdin(std::fs::File::open(&path).expect("a film")))
    };
    flagged(&path, &frames);
    for received in [receive(&path, &[]), piped(&[])] {
        delivers(&received);
        says(&received, 0, &["flagged as interlaced, and its frames are read as whole pictures"]);
    }
    // Too few frames to tell.
    flagged(&path, &frames[..6]);
    for received in [receive(&path, &[]), piped(&[])] {
        says(&received, 2, &["its first frames have too little motion", "--progressive"]);
    }
    for received in [receive(&path, &["--progressive", "--bits"]), piped(&["--progressive", "--bits"])] {
        assert!(text(&received.stdout).contains("frame 5:"), "{}", text(&received.stderr));
    }
}

#[test]
fn films_of_two_pictures_a_frame_are_refused() {
    let film = filmed("woven", 2 * FRAMES);
    let path = film.join("film.y4m");
    let lines = |pair: &[Vec<u8>]| {
        let lines = pair[0].chunks(320).zip(pair[1].chunks(320)).enumerate();
        lines
            .flat_map(|(y, (one, other))| if y % 2 == 0 { one } else { other }.to_vec())
            .collect()
    };
    flagged(&path, &pixels(&film).chunks(2).map(lines).collect::<Vec<Vec<u8>>>());
    says(&receive(&path, &[]), 2, &["the film is interlaced", "bwdif", "--progressive"]);
}

#[test]
fn time_stamps_that_are_there_are_not_passed_over() {
    let film = filmed("stamped-alike", 4);
    let stamps = film.join("timestamps.csv");
    let lines: String = (0..4).map(|number| format!("{number},17.5\n")).collect();
    std::fs::write(&stamps, lines).expect("a file");
    says(&receive(&film, &[]), 2, &["all 4 frames have the same time, 17.5 s"]);
    std::fs::remove_file(&stamps).expect("the file");
    std::fs::create_dir(&stamps).expect("a folder");
    says(&receive(&film, &[]), 2, &["cannot read the time stamps", "not an ordinary file"]);
    std::fs::remove_dir(&stamps).expect("the folder");
    if cfg!(unix) {
        common::bounded::pipe(&stamps);
        says(&receive(&film, &[]), 2, &["cannot read the time stamps", "not an ordinary file"]);
        std::fs::remove_file(&stamps).expect("the pipe");
        let linked = std::process::Command::new("ln").args(["-s", "nowhere"]).arg(&stamps).status();
        assert!(linked.expect("ln runs").success());
        says(&receive(&film, &[]), 2, &["cannot read the time stamps"]);
    }
}

#[test]
fn what_is_neither_picture_nor_film_is_named_with_what_helps() {
    let place = folder("foreign");
    let dump = place.join("dump.dat");
    std::fs::write(&dump, [7; 1000]).expect("a file");
    let pipe = "-f yuv4mpegpipe - | vocc receive -";
    refused(&["receive", name(&dump)], &["neither a picture", pipe, "--raw WIDTHxHEIGHT"]);
    let address = "ftp://example.org/film.mp4";
    for arguments in [&["receive"][..], &["receive", "--live"], &["decode"]] {
        refused(
            &[arguments, &[address]].concat(),
            &[address, "begins with ftp://", "rtsp", "http", pipe],
        );
        refused(&[arguments, &["file:///road.mp4"]].concat(), &["give its path"]);
    }
    let road = place.join("road.mp4");
    std::fs::write(&road, b"\0\0\0\x18ftypmp42").expect("a file");
    for (source, what) in [
        (name(&road), "is a film"),
        ("/dev/video99", "is a camera"),
        ("RTSP://host/live", "is an address"),
    ] {
        refused(&["decode", source], &[what, "vocc receive", source]);
    }
    // A picture by its content alone is one.
    let film = filmed("nameless", 1);
    let nameless = film.join("frame");
    std::fs::rename(film.join("frame-000000.png"), &nameless).expect("renamed");
    says(&receive(&nameless, &["--bits"]), 1, &["no message in 1 frames"]);
    let misnamed = film.join("frame.mod");
    std::fs::rename(nameless, &misnamed).expect("renamed");
    says(&run(command(&["decode"]).arg(misnamed)), 0, &[]);
}

#[test]
fn calibrations_of_other_forms_are_named() {
    let place = folder("calibrations");
    for (file, held, form) in [
        (
            "camchain.yaml",
            "cam0:\n  camera_model: pinhole\n  intrinsics: [500, 500, 320, 240]\n",
            "Kalibr",
        ),
        (
            "camera.xml",
            "<?xml version=\"1.0\"?>\n<opencv_storage>\n</opencv_storage>\n",
            "XML",
        ),
        (
            "camera.json",
            "{\"camera_matrix\": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}\n",
            "JSON",
        ),
    ] {
        let path = place.join(file);
        std::fs::write(&path, held).expect("a file");
        let said = run(command(&["decode", "frame.png", "--camera"]).arg(&path));
        says(
            &said,
            2,
            &[file, form, "focal_px"].map(|word| if form == "XML" && word == "focal_px" { "YAML" } else { word }),
        );
        assert!(!text(&said.stderr).contains("TOML parse error"), "{said:?}");
    }
}

#[test]
fn a_film_on_its_side_is_named() {
    let film = filmed("on-its-side", FRAMES);
    for entry in std::fs::read_dir(&film).expect("a folder") {
        let path = entry.expect("an entry").path();
        image::open(&path).expect("a frame").rotate90().save(&path).expect("a frame");
    }
    let received = receive(&film, &[]);
    delivers(&received);
    says(&received, 0, &["turned by 90° clockwise"]);
}
