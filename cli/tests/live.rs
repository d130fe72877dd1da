//! `vocc receive` on live sources: ffmpeg is a script here. `tests/suites/live.rs` has the real one.
#![cfg(target_os = "linux")]

mod common;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use common::bounded::{self, PATIENCE, Watchdog, pipe, signal, writer};
use common::ffmpeg::{Place, wait_for};
use common::recording::{MESSAGE, film, filmed, pixels, y4m};
use common::{command, folder, json_lines, name, refused, says, text};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::process::{Pid, Resource, Rlimit};
use serde_json::Value;

/// Tells the times of 16 frames, and gives the frames.
const FRAMES: &str = "/bin/cat times >&2; /bin/cat frames";

/// What a program has said so far on a standard error that is a file.
fn said(path: &Path) -> String {
    std::fs::read_to_string(path).expect("text")
}

#[test]
fn what_is_no_live_source_is_named() {
    refused(&["receive", "/dev/video99"], &["there is no camera /dev/video99: "]);
    refused(&["receive", "--live", "v4l2:/dev/nothing"], &["there is no camera /dev/nothing: "]);
    refused(&["receive", "--live", "frames"], &["frames is not live: give a camera"]);
    refused(&["receive", "--live", "a.mp4", "b.mp4"], &["--live is for one source"]);
    refused(&["receive", "--live", "road.mp4"], &["cannot read road.mp4"]);
}

#[test]
fn an_option_that_the_source_has_no_use_for_is_refused() {
    let place = Place::new("live-options", "exit 1");
    std::fs::write(place.0.join("film.y4m"), "").expect("a film");
    std::fs::write(place.0.join("frame.png"), "").expect("a frame");
    pipe(&place.0.join("camera.y4m"));
    pipe(&place.0.join("camera"));
    let recorded = ["--mcap", "drive.mcap", "--start", "0"];
    let ffmpeg = ["--ffmpeg", "-framerate 60"];
    let raw = ["--raw", "8x8"];
    for (source, options, why) in [
        (
            &["film.mp4"][..],
            &ffmpeg[..],
            "--ffmpeg is for live sources that ffmpeg decodes, and film.mp4 is not one",
        ),
        (&["frame.png"], &ffmpeg, "and frame.png is not one"),
        (&["-"], &ffmpeg, "and standard input is not one"),
        (&["--live", "-"], &ffmpeg, "and standard input is not one"),
        (&["camera.y4m"], &ffmpeg, "and camera.y4m is not one"),
        (&["camera", "--raw", "8x8"], &ffmpeg, "and camera is not one"),
        (
            &["udp://127.0.0.1:5000"],
            &recorded,
            "--start is for films, and each frame of the live source udp://127.0.0.1:5000 has",
        ),
        (
            &["--live", "film.mp4"],
            &recorded,
            "live source film.mp4 has its own time: omit --start",
        ),
        (&["camera.y4m"], &recorded, "omit --start"),
        (
            &["film.mp4"],
            &raw,
            "--raw is for standard input and named pipes, and film.mp4 is neither",
        ),
        (&["film.y4m"], &raw, "and film.y4m is neither"),
        (&["frame.png"], &raw, "and frame.png is neither"),
        (&["frame.png", "frame.png"], &raw, "and a series of pictures is neither"),
        (&["udp://127.0.0.1:5000"], &raw, "and udp://127.0.0.1:5000 is neither"),
        (
            &["frame.png"],
            &["--progressive"],
            "--progressive is for films and streams, and frame.png is neither",
        ),
    ] {
        let received = place.received(&[source, options].concat());
        says(&received, 2, &[why]);
        assert_eq!(text(&received.stderr).lines().count(), 1, "{received:?}");
        assert!(!place.0.join("drive.mcap.active").exists(), "{source:?}");
    }
    // No option of ffmpeg is given.
    says(&place.received(&["frame.png", "--ffmpeg", " "]), 2, &["frame.png"]);
}

#[test]
fn an_address_is_read_by_ffmpeg() {
    let place = Place::with_frames("live-address", &format!("echo \"$@\" > told; {FRAMES}"));
    let address = "rtsp://me:secret@localhost/live";
    let received = place.received(&[address, "--verbose", "--json", "--ffmpeg", "-framerate 60"]);
    says(&received, 0, &["ffmpeg -nostdin ", "-i rtsp://me:***@localhost/live "]);
    assert!(!text(&received.stderr).contains("secret"), "{received:?}");
    let told = std::fs::read_to_string(place.0.join("told")).expect("arguments");
    assert!(
        told.contains("-framerate 60 -rtsp_flags prefer_tcp") && told.contains(address),
        "{told}"
    );
    let lines = json_lines(&received);
    let message = lines.iter().find(|line| line["message"] == MESSAGE).expect("a message");
    assert!(message["latency_s"].as_f64().is_some_and(|latency_s| latency_s > 0.0), "{message}");
    let last = lines.last().expect("a line");
    assert_eq!((&last["frames"], &last["dropped"]), (&16.into(), &0.into()));
    for part in ["to_text", "queue", "reading", "decoding"] {
        let part = &last["latency"][part];
        let [median_s, worst_s] = ["median_s", "worst_s"].map(|key| part[key].as_f64().expect("a number"));
        assert!(0.0 < median_s && median_s <= worst_s, "{last}");
    }
    // The times of these frames are not those of a clock.
    assert_eq!(last["latency"]["source"], Value::Null);
    let absent = Place::new("live-absent", "");
    says(
        &absent.received(&[address]),
        2,
        &["ffmpeg, which reads rtsp://me:***@localhost/live, is not on the PATH"],
    );
    let broken = Place::new("live-broken", "echo \"[error] $0: Connection refused\" >&2; exit 1");
    says(&broken.received(&[address, "--live"]), 2, &["Connection refused", "check it with"]);
}

#[test]
fn no_output_shows_a_password() {
    let script = r#"for word; do case $word in *://*) echo "[error] $word refused it's%20me, it's me" >&2; esac; done; exit 1"#;
    let place = Place::new("live-password", script);
    let address = "rtsp://me:it's%20me@localhost/live";
    let shown = "rtsp://me:***@localhost/live";
    let ftp = "ftp://me:it's%20me@localhost/film.mp4";
    for (arguments, words) in [
        (
            &[address, "--verbose"][..],
            &["-i rtsp://me:***@localhost/live ", "rtsp://me:***@localhost/live refused ***, ***"][..],
        ),
        (&["--live", address, "--verbose"], &["-i rtsp://me:***@localhost/live "]),
        (
            &["srt://localhost:9000?passphrase=it's%20me", "--verbose"],
            &["srt://localhost:9000?passphrase=***"],
        ),
        (
            &["udp://localhost:9000", "--verbose", "--ffmpeg", "-passphrase it's%20me"],
            &["-passphrase *** "],
        ),
        (&[address, "--raw", "8x8"], &["rtsp://me:***@localhost/live is neither"]),
        (&[address, address], &[shown, "give it alone"]),
        (&[ftp], &["ftp://me:***@localhost/film.mp4 begins with ftp://"]),
        (&["film.mp4", ftp], &["ftp://me:***@localhost/film.mp4 is live or an address"]),
        (&["--live", ftp], &["ftp://me:***@localhost/film.mp4 begins with ftp://"]),
    ] {
        let received = place.received(arguments);
        says(&received, 2, words);
        let told = text(&received.stderr);
        assert!(
            !told.contains("me@") && !told.contains("s%20") && !told.contains("s me"),
            "{arguments:?}: {told}"
        );
    }
    let decoded = bounded::run(&mut command(&["decode", address]));
    says(&decoded, 2, &[shown]);
    assert!(!text(&decoded.stderr).contains("s%20"), "{decoded:?}");
}

#[test]
fn a_source_that_goes_away_is_waited_for() {
    // It comes twice, and then not any more.
    let script = format!("echo again >> runs; if [ $(/usr/bin/wc -l < runs) = 3 ]; then exec /bin/sleep 600; fi; {FRAMES}");
    let place = Place::with_frames("live-again", &script);
    let mut receive = place.receive(&["udp://127.0.0.1:5000", "--live", "--json"]);
    let mut receive = receive.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("vocc runs");
    let _watchdog = Watchdog::of(&receive);
    let mut told = BufReader::new(receive.stderr.take().expect("standard error"))
        .lines()
        .map(|line| line.expect("text"));
    let mut says = |word: &str| told.any(|line| line.contains(word));
    for word in ["udp://127.0.0.1:5000 is gone: waiting for it", "is back after", "is gone"] {
        assert!(says(word), "{word}");
    }
    signal("-INT", receive.id());
    let ended = std::thread::spawn(move || told.for_each(drop));
    let received = receive.wait_with_output().expect("an end");
    ended.join().expect("an end");
    assert!(received.status.code().is_some_and(|code| code < 2), "{received:?}");
    let last = json_lines(&received).pop().expect("a line");
    let [frames, dropped] = ["frames", "dropped"].map(|key| last[key].as_u64().expect("a number"));
    assert_eq!(frames + dropped, 32, "{last}");
}

/// Receives one message after another, with `between` before each further one, and stops then: the last lines, and what was said.
fn received_again(place: &Place, arguments: &[&str], messages: &[&str], mut between: impl FnMut(usize)) -> (Vec<Value>, String) {
    let path = place.0.join("said");
    let stderr = File::create(&path).expect("a file");
    let mut receive = place
        .receive(arguments)
        .stdout(Stdio::piped())
        .stderr(stderr)
        .spawn()
        .expect("vocc runs");
    let _watchdog = Watchdog::within(&receive, 3 * PATIENCE);
    let lines = BufReader::new(receive.stdout.take().expect("standard output")).lines();
    let mut lines = lines.map(|line| serde_json::from_str::<Value>(&line.expect("text")).expect("JSON"));
    for (run, message) in (1..).zip(messages) {
        assert!(lines.any(|line| line["message"] == *message), "{message}: {}", said(&path));
        if run < messages.len() {
            between(run);
        }
    }
    signal("-INT", receive.id());
    let last = lines.collect();
    assert!(receive.wait().expect("an end").success(), "{}", said(&path));
    (last, said(&path))
}

#[test]
fn messages_come_after_each_return_of_a_source() {
    let messages = ["bend ahead", "ice ahead", "fog ahead"];
    let place = Place::filming("live-returns", &messages);
    let address = "udp://127.0.0.1:5000";
    let (_, told) = received_again(&place, &["--live", address, "--json"], &messages, |run| {
        place.mark(&format!("over-{run}"));
    });
    for word in ["is gone: waiting for it", "is back after"] {
        assert_eq!(told.matches(&format!("{address} {word}")).count(), 2, "{told}");
    }
}

#[test]
fn a_camera_that_vanishes_and_one_that_falls_silent_are_received_again() {
    let messages = ["bend ahead", "ice ahead", "fog ahead"];
    let place = Place::filming("live-camera", &messages);
    place.mark("camera");
    let learnt = ["--save-camera", "learnt.toml", "--ffmpeg", "-framerate 100"];
    let arguments = [&["--live", "v4l2:camera", "--json"][..], &learnt].concat();
    let (last, told) = received_again(&place, &arguments, &messages, |run| {
        if run == 1 {
            std::fs::remove_file(place.0.join("camera")).expect("a device");
            place.mark("over-1");
            wait_for(|| said(&place.0.join("said")).contains("camera is gone: waiting").then_some(()));
            // The device is looked for each second, and ffmpeg is not run without it.
            std::thread::sleep(Duration::from_millis(2500));
            let runs = std::fs::read_to_string(place.0.join("runs")).expect("arguments");
            assert_eq!(runs.lines().count(), 1, "{runs}");
            place.mark("camera");
        } else {
            place.mark("silent-2");
            place.mark("over-2");
        }
    });
    assert!(told.contains("camera is gone (no data for 10 s): waiting for it"), "{told}");
    assert_eq!(told.matches("camera is back after").count(), 2, "{told}");
    let runs = std::fs::read_to_string(place.0.join("runs")).expect("arguments");
    assert_eq!(runs.matches("-framerate 100 -f v4l2 -ts abs -i camera ").count(), 3, "{runs}");
    // Ctrl-C keeps what was learnt.
    let [.., camera, latency] = &last[..] else {
        panic!("{last:?}");
    };
    assert!(camera["camera"]["frames"].as_u64().is_some_and(|frames| frames > 0), "{camera}");
    assert!(latency["latency"]["source"]["median_s"].is_number(), "{latency}");
    let saved = std::fs::read_to_string(place.0.join("learnt.toml")).expect("a camera");
    assert!(saved.contains("gamma"), "{saved}");
}

#[test]
fn frames_that_come_faster_than_they_are_read_are_dropped_and_counted() {
    // The first 16, from which the rate is learnt, 4 that wait, and up to 4 in the pipe that come as the first of these is taken.
    const FRAMES_MAX: u64 = 16 + 4 + 4;
    let times: Vec<u32> = (0..80).collect();
    let place = Place::with_frames_at("live-drops", &format!("{FRAMES}; echo > given"), 100, &times);
    for format in [&["--json"][..], &[]] {
        let (mut reader, mut writer) = std::io::pipe().expect("a pipe");
        // The program's first line waits, because the pipe is full.
        fcntl_setfl(&writer, OFlags::NONBLOCK).expect("set");
        while writer.write(b"\n").is_ok() {}
        fcntl_setfl(&writer, OFlags::empty()).expect("set");
        let arguments = [&["--live", "film.mp4", "--bits"], format].concat();
        let receive = place
            .receive(&arguments)
            .stdout(writer)
            .stderr(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        let _watchdog = Watchdog::of(&receive);
        wait_for(|| std::fs::remove_file(place.0.join("given")).ok());
        let mut told = String::new();
        reader.read_to_string(&mut told).expect("text");
        let received = receive.wait_with_output().expect("an end");
        assert!(received.status.code().is_some_and(|code| code < 2), "{received:?}");
        let [frames, dropped] = if format.is_empty() {
            let said = text(&received.stderr);
            let sentence = " of 80 frames were dropped, because newer ones had arrived";
            let (before, _) = said.split_once(sentence).expect("a sentence");
            let dropped = before.lines().next_back().expect("a number").parse().expect("a number");
            [80 - dropped, dropped]
        } else {
            let last: Value = serde_json::from_str(told.lines().next_back().expect("a line")).expect("JSON");
            ["frames", "dropped"].map(|key| last[key].as_u64().expect("a number"))
        };
        assert_eq!(frames + dropped, 80);
        assert!(frames <= FRAMES_MAX, "{frames}");
    }
}

#[test]
fn frames_of_a_clock_that_stands_still_are_numbered_by_their_arrival() {
    // A film at a fifth of its pace, so that no frame arrives later than its period.
    let receive = |name: &str, times: &[u32]| {
        let place = Place::with_frames_at(name, FRAMES, 20, times);
        let received = place.received(&["udp://127.0.0.1:5000", "--symbol-rate", "18", "--json"]);
        let lines = json_lines(&received);
        assert!(lines.iter().any(|line| line["message"] == MESSAGE), "{received:?}");
        (lines.last().expect("a line")["frames"].clone(), received)
    };
    let (frames, received) = receive("live-one-time", &[7; 40]);
    says(
        &received,
        0,
        &["all frames of the live source have one time: they are numbered by their arrival"],
    );
    assert_eq!(frames, 40);
    let stops: Vec<u32> = (0..20).chain([20; 40]).collect();
    let (frames, received) = receive("live-stopped-clock", &stops);
    says(
        &received,
        0,
        &[
            "the clock of the live source stands still",
            "16 frames have the time of the frame before",
        ],
    );
    assert_eq!(frames, 20 + 40 - 16);
}

#[test]
fn a_pipe_named_like_a_film_is_left_to_ffmpeg() {
    let place = Place::with_frames("live-pipe", &format!("/bin/cat film.mp4 > given; {FRAMES}"));
    let film = place.0.join("film.mp4");
    std::fs::remove_file(&film).expect("a film");
    pipe(&film);
    let write = {
        let film = film.clone();
        std::thread::spawn(move || writer(&film).write_all(b"all of it"))
    };
    let received = place.received(&["film.mp4"]);
    says(&received, 0, &["latency, median (and worst) of 16 frames"]);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
    write.join().expect("an end").expect("written");
    let given = std::fs::read_to_string(place.0.join("given")).expect("what ffmpeg read");
    assert_eq!(given, "all of it");
}

#[test]
fn messages_are_told_while_frames_still_come() {
    let film = y4m(&filmed("live-told-frames", 24));
    let place = folder("live-told");
    let path = place.join("camera.y4m");
    pipe(&path);
    let mut receive = command(&["receive", name(&path), "--json"]);
    // A pipe of y4m needs no ffmpeg.
    let mut receive = receive.env("PATH", &place).stdout(Stdio::piped()).spawn().expect("vocc runs");
    let _watchdog = Watchdog::of(&receive);
    let mut camera = writer(&path);
    camera.write_all(&film).expect("read");
    let mut told = String::new();
    let mut lines = BufReader::new(receive.stdout.take().expect("standard output"));
    lines.read_line(&mut told).expect("a line");
    assert!(told.contains(MESSAGE) && told.ends_with('\n'), "{told}");
    drop(camera);
    assert!(receive.wait().expect("an end").success());
}

/// The messages of a recording, whether it is whole or not: topic, time and content.
fn recorded(path: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap_or_default();
    let Ok(messages) = mcap::MessageStream::new_with_options(&bytes, mcap::read::Options::IgnoreEndMagic.into()) else {
        return Vec::new();
    };
    messages
        .map_while(Result::ok)
        .map(|message| (message.channel.topic.clone(), message.log_time, message.data.to_vec()))
        .collect()
}

#[test]
fn a_recording_that_was_cut_off_has_all_that_came() {
    let place = Place::with_frames("live-recording", &format!("{FRAMES}; exec /bin/sleep 600"));
    let since = SystemTime::UNIX_EPOCH.elapsed().expect("after 1970").as_nanos() as u64;
    let address = "tcp://127.0.0.1:5000";
    let arguments = [address, "--mcap", "drive.mcap"];
    let mut receive = place.receive(&arguments).stdout(Stdio::null()).spawn().expect("vocc runs");
    let _watchdog = Watchdog::of(&receive);
    let active = place.0.join("drive.mcap.active");
    let images = |messages: &[(String, u64, Vec<u8>)]| messages.iter().filter(|(topic, ..)| topic == "/camera/image").count();
    wait_for(|| (images(&recorded(&active)) == 16).then_some(()));
    signal("-KILL", receive.id());
    receive.wait().expect("an end");
    let messages = recorded(&active);
    let until = SystemTime::UNIX_EPOCH.elapsed().expect("after 1970").as_nanos() as u64;
    assert_eq!(images(&messages), 16);
    assert!(messages.iter().all(|(_, time_ns, _)| (since..=until).contains(time_ns)));
    let message = messages.iter().find(|(topic, ..)| topic == "/panel_0/message").expect("a message");
    assert_eq!(cdr::deserialize::<String>(&message.2).expect("a text"), MESSAGE);
    assert!(!place.0.join("drive.mcap").exists());
    says(&place.received(&arguments), 2, &["drive.mcap.active", "move it away"]);
}

/// A camera on a named pipe that films without end, at most a frame in 20 ms, until nobody reads. It notes when it gives each frame.
struct EndlessCamera {
    given: Arc<Mutex<Vec<Instant>>>,
    filming: JoinHandle<()>,
}

impl EndlessCamera {
    fn film(path: &Path, frames: Vec<Vec<u8>>) -> Self {
        let given: Arc<Mutex<Vec<Instant>>> = Arc::default();
        let noted = Arc::clone(&given);
        let mut pipe = writer(path);
        let filming = std::thread::spawn(move || {
            let mut is_read = pipe.write_all(b"YUV4MPEG2 W160 H120 F100:1 Ip Cmono\n").is_ok();
            let mut frames = frames.iter().cycle();
            while is_read && let Some(frame) = frames.next() {
                noted.lock().expect("no panic").push(Instant::now());
                is_read = pipe.write_all(b"FRAME\n").and_then(|()| pipe.write_all(frame)).is_ok();
                std::thread::sleep(Duration::from_millis(20));
            }
        });
        Self { given, filming }
    }
}

/// The images of a recording in `folder`, in all its files, by their times.
fn images(folder: &Path) -> Vec<Vec<u8>> {
    let files = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path());
    let recordings = files.filter(|path| path.file_name().is_some_and(|file| file.to_string_lossy().starts_with("drive")));
    // A file that is renamed meanwhile may have both names.
    let images: BTreeMap<u64, Vec<u8>> = recordings
        .flat_map(|path| recorded(&path))
        .filter(|(topic, ..)| topic == "/camera/image")
        .map(|(_, time_ns, image)| (time_ns, pixels_of(&image)))
        .collect();
    images.into_values().collect()
}

/// The pixels of a recorded image.
fn pixels_of(image: &[u8]) -> Vec<u8> {
    let (_, _, png): (((i32, u32), String), String, Vec<u8>) = cdr::deserialize(image).expect("an image");
    image::load_from_memory(&png).expect("a PNG").into_luma8().into_raw()
}

#[test]
fn a_kill_loses_at_most_the_last_second_of_a_recording() {
    const SECOND: Duration = Duration::from_secs(1);
    // A second has less than a chunk, so that frames wait for the flush.
    let middle = |frame: &Vec<u8>| {
        frame
            .chunks(320)
            .skip(60)
            .take(120)
            .flat_map(|row| &row[80..240])
            .copied()
            .collect()
    };
    let frames: Vec<Vec<u8>> = pixels(&film("live-killed-frames", MESSAGE, 100, 90)).iter().map(middle).collect();
    for (place, options) in [("live-killed", &[][..]), ("live-killed-parts", &["--max-size", "200k"])] {
        let place = folder(place);
        pipe(&place.join("camera.y4m"));
        let mut receive = command(&["receive", "camera.y4m", "--bits", "--json", "--mcap", "drive.mcap"]);
        receive
            .args(options)
            .current_dir(&place)
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut receive = receive.spawn().expect("vocc runs");
        let _watchdog = Watchdog::of(&receive);
        let camera = EndlessCamera::film(&place.join("camera.y4m"), frames.clone());
        // Frames that were read, and when that was known here.
        let mut told: Vec<(usize, Instant)> = Vec::new();
        let mut is_killed = false;
        for line in BufReader::new(receive.stdout.take().expect("standard output")).lines() {
            let line: Value = serde_json::from_str(&line.expect("text")).expect("JSON");
            let (Some(frame), true) = (line["frame"].as_u64(), line["bits"].is_string()) else {
                continue;
            };
            told.push((frame as usize, Instant::now()));
            let given = camera.given.lock().expect("no panic")[frame as usize];
            let is_divided = options.is_empty() || place.join("drive-0001.mcap").exists();
            if !is_killed && is_divided && given > told[0].1 + 3 * SECOND {
                signal("-KILL", receive.id());
                is_killed = true;
            }
        }
        receive.wait().expect("an end");
        camera.filming.join().expect("an end");
        // What was read a second before the last frame was even given has been written since.
        let (last, _) = *told.last().expect("a frame");
        let last_given = camera.given.lock().expect("no panic")[last];
        let kept = told
            .iter()
            .rev()
            .find(|(_, known)| *known + SECOND <= last_given)
            .expect("a frame")
            .0;
        let images = images(&place);
        assert!(images.len() > kept, "{} images, and frame {kept} is not among them", images.len());
        let is_whole = images.iter().zip(frames.iter().cycle()).all(|(image, frame)| image == frame);
        assert!(is_whole, "{options:?}");
        assert_eq!(place.join("drive-0001.mcap").exists(), !options.is_empty());
    }
}

#[test]
fn a_disk_that_fills_leaves_the_files_that_were_finished() {
    let [before, after] = [MESSAGE, "ice ahead"].map(|message| pixels(&film(&format!("live-full-{}", &message[..3]), message, 100, 90)));
    let place = folder("live-full");
    let (camera, path) = (place.join("camera.y4m"), place.join("said"));
    pipe(&camera);
    let receive = "receive camera.y4m --json --mcap drive.mcap --max-size 200k";
    let script = format!("trap '' XFSZ; exec {} {receive}", env!("CARGO_BIN_EXE_vocc"));
    let mut receive = std::process::Command::new("sh");
    receive.args(["-c", &script]).current_dir(&place).stdout(Stdio::piped());
    let receive = receive.stderr(File::create(&path).expect("a file")).spawn().expect("sh runs");
    let _watchdog = Watchdog::of(&receive);
    let mut camera = writer(&camera);
    camera.write_all(b"YUV4MPEG2 W320 H240 F100:1 Ip Cmono\n").expect("read");
    let mut film = |frames: &[Vec<u8>], until: &dyn Fn() -> bool| {
        for frame in frames.iter().cycle().take_while(|_| !until()) {
            camera.write_all(b"FRAME\n").and_then(|()| camera.write_all(frame)).expect("read");
        }
    };
    film(&before, &|| place.join("drive-0001.mcap").exists());
    let limit = Rlimit {
        current: Some(50_000),
        ..rustix::process::getrlimit(Resource::Fsize)
    };
    let process = Pid::from_raw(receive.id() as i32);
    rustix::process::prlimit(process, Resource::Fsize, limit).expect("limited");
    film(&after, &|| said(&path).contains("continuing without a recording"));
    // Twice the film.
    let rest = Cell::new(200);
    film(&after, &|| rest.replace(rest.get() - 1) == 0);
    drop(camera);
    let mut received = receive.wait_with_output().expect("an end");
    received.stderr = said(&path).into_bytes();
    says(
        &received,
        2,
        &["cannot write drive-0", "File too large", "continuing without a recording"],
    );
    assert!(
        json_lines(&received).iter().any(|line| line["message"] == "ice ahead"),
        "{received:?}"
    );
    let numbers = (0..).map(|number| match number {
        0 => "drive.mcap".to_owned(),
        number => format!("drive-{number:04}.mcap"),
    });
    let finished = numbers.map(|file| place.join(file)).take_while(|path| path.exists());
    let images: Vec<Vec<u8>> = finished.flat_map(|path| whole_images(&path)).collect();
    assert!(images.len() > 2, "{}", images.len());
    let is_whole = images.iter().zip(before.iter().cycle()).all(|(image, frame)| image == frame);
    assert!(is_whole, "{} images", images.len());
}

/// The images of a file that was finished.
fn whole_images(path: &Path) -> Vec<Vec<u8>> {
    let bytes = std::fs::read(path).expect("a recording");
    let summary = mcap::Summary::read(&bytes).expect("a file").expect("a summary");
    let messages: Vec<_> = mcap::MessageStream::new(&bytes)
        .expect("a file")
        .collect::<Result<_, _>>()
        .expect("whole messages");
    assert_eq!(summary.stats.expect("statistics").message_count, messages.len() as u64);
    let images = messages.iter().filter(|message| message.channel.topic == "/camera/image");
    images.map(|image| pixels_of(&image.data)).collect()
}

/// A y4m stream of two films side by side, by frames after its header.
fn side_by_side([left, right]: [PathBuf; 2]) -> Vec<Vec<u8>> {
    let mut pieces = vec![b"YUV4MPEG2 W640 H240 F100:1 Ip Cmono\n".to_vec()];
    for (left, right) in pixels(&left).iter().zip(pixels(&right)) {
        let mut frame = b"FRAME\n".to_vec();
        for (left, right) in left.chunks(320).zip(right.chunks(320)) {
            frame.extend_from_slice(left);
            frame.extend_from_slice(right);
        }
        pieces.push(frame);
    }
    pieces
}

#[test]
fn two_cameras_see_two_panels_each() {
    let cameras = [
        ("live-left", ["bend ahead", "ice ahead"]),
        ("live-right", ["fog ahead", "jam ahead"]),
    ];
    let received = cameras.map(|(name, messages)| {
        let pieces = side_by_side(messages.map(|message| film(&format!("{name}-{}", &message[..3]), message, 96, 90)));
        let pipe_path = folder(name).join("camera.y4m");
        pipe(&pipe_path);
        let mut receive = command(&["receive", common::name(&pipe_path), "--json", "--panels", "2"]);
        let receive = receive.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("vocc runs");
        (receive, pipe_path, pieces)
    });
    let _watchdogs = received.each_ref().map(|(receive, ..)| Watchdog::of(receive));
    // Frame by frame in turn, so that neither ends before the other begins.
    let mut writers = received.each_ref().map(|(_, path, _)| writer(path));
    for number in 0..97 {
        for (writer, (.., pieces)) in writers.iter_mut().zip(&received) {
            writer.write_all(&pieces[number]).expect("read");
        }
    }
    drop(writers);
    for ((receive, ..), (_, messages)) in received.into_iter().zip(cameras) {
        let received = receive.wait_with_output().expect("an end");
        assert!(received.status.success(), "{received:?}");
        let lines = json_lines(&received);
        let told: BTreeSet<(&str, u64)> = lines
            .iter()
            .filter_map(|line| Some((line["message"].as_str()?, line["panel"].as_u64()?)))
            .collect();
        // Each message has a panel of its own.
        let (told_messages, panels): (BTreeSet<&str>, BTreeSet<u64>) = told.iter().copied().unzip();
        assert_eq!(told_messages, messages.into(), "{received:?}");
        assert_eq!((told.len(), panels.len()), (2, 2), "{told:?}");
        assert_eq!(lines.last().expect("a line")["frames"], 96);
    }
}

#[test]
fn a_silent_source_is_an_error_in_the_recording() {
    let place = Place::with_frames("live-silence", &format!("{FRAMES}; exec /bin/sleep 600"));
    let arguments = ["tcp://127.0.0.1:5000", "--mcap", "drive.mcap"];
    let mut receive = place.receive(&arguments).stdout(Stdio::null()).spawn().expect("vocc runs");
    let _watchdog = Watchdog::of(&receive);
    let active = place.0.join("drive.mcap.active");
    let silence = wait_for(|| {
        let messages = recorded(&active);
        let last_image = messages.iter().rev().find(|(topic, ..)| topic == "/camera/image")?.1;
        let text = b"no frame for ";
        let report = messages
            .iter()
            .find(|(topic, _, report)| topic == "/diagnostics" && report.windows(text.len()).any(|part| part == text))?;
        Some(Duration::from_nanos(report.1 - last_image))
    });
    signal("-TERM", receive.id());
    receive.wait().expect("an end");
    assert!((2.5..60.0).contains(&silence.as_secs_f64()), "{silence:?}");
}
