//! `vocc receive` on live sources: ffmpeg is a script here. `tests/suites/live.rs` has the real one.
#![cfg(target_os = "linux")]

mod common;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, SystemTime};

use common::bounded::{self, Watchdog, pipe, signal, writer};
use common::ffmpeg::{Place, wait_for};
use common::recording::{MESSAGE, film, filmed, pixels, y4m};
use common::{command, folder, json_lines, name, refused, says, text};
use rustix::fs::{OFlags, fcntl_setfl};
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
    refused(&["receive", "--live", "frames"], &["frames is not live: name a camera"]);
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
            "--ffmpeg is for a live source that ffmpeg decodes, and film.mp4 is none",
        ),
        (&["frame.png"], &ffmpeg, "and frame.png is none"),
        (&["-"], &ffmpeg, "and standard input is none"),
        (&["--live", "-"], &ffmpeg, "and standard input is none"),
        (&["camera.y4m"], &ffmpeg, "and camera.y4m is none"),
        (&["camera", "--raw", "8x8"], &ffmpeg, "and camera is none"),
        (
            &["udp://127.0.0.1:5000"],
            &recorded,
            "--start is for films, and each frame of the live source udp://127.0.0.1:5000 has",
        ),
        (
            &["--live", "film.mp4"],
            &recorded,
            "live source film.mp4 has a time of its own: leave --start out",
        ),
        (&["camera.y4m"], &recorded, "leave --start out"),
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
    says(
        &broken.received(&[address, "--live"]),
        2,
        &["Connection refused", "check whether it is there"],
    );
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
    for word in ["udp://127.0.0.1:5000 is gone: it is waited for", "is back after", "is gone"] {
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
    let _watchdog = Watchdog::of(&receive);
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
    for word in ["is gone: it is waited for", "is back after"] {
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
            wait_for(|| said(&place.0.join("said")).contains("camera is gone: it").then_some(()));
            place.mark("camera");
        } else {
            place.mark("silent-2");
            place.mark("over-2");
        }
    });
    assert!(
        told.contains("camera is gone (nothing has come for 10 s): it is waited for"),
        "{told}"
    );
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
    // The first 16, from which the rate is learnt, 4 that wait, and one that comes as the first of these is taken.
    const FRAMES_MAX: u64 = 16 + 4 + 1;
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
            let sentence = " of 80 frames were dropped, as newer ones had come";
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

#[test]
fn two_cameras_are_received_side_by_side() {
    let films = [("live-left", "bend ahead"), ("live-right", "ice ahead")];
    let mut received = films.map(|(name, message)| {
        let frames = y4m(&film(&format!("{name}-frames"), message, 48, 90));
        let pipe_path = folder(name).join("camera.y4m");
        pipe(&pipe_path);
        let mut receive = command(&["receive", common::name(&pipe_path), "--json", "--panels", "2"]);
        let receive = receive.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("vocc runs");
        (receive, pipe_path, frames)
    });
    let _watchdogs = received.each_ref().map(|(receive, ..)| Watchdog::of(receive));
    // Frame by frame in turn, so that neither ends before the other begins.
    let mut cameras = received.each_ref().map(|(_, path, _)| writer(path));
    let pieces = received.each_ref().map(|(.., frames)| frames.chunks(frames.len().div_ceil(48)));
    let [left, right] = pieces;
    for (left, right) in left.zip(right) {
        cameras[0].write_all(left).expect("read");
        cameras[1].write_all(right).expect("read");
    }
    drop(cameras);
    for ((receive, ..), (_, message)) in received.each_mut().into_iter().zip(films) {
        let mut told = String::new();
        std::io::Read::read_to_string(&mut receive.stdout.take().expect("standard output"), &mut told).expect("text");
        assert!(receive.wait().expect("an end").success());
        let messages: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        let messages: Vec<&Value> = messages
            .iter()
            .map(|line| &line["message"])
            .filter(|message| message.is_string())
            .collect();
        assert!(!messages.is_empty() && messages.iter().all(|&told| told == message), "{told}");
    }
}

#[test]
fn two_panels_of_a_live_source_have_their_own_messages() {
    let films = [("live-panel-left", "bend ahead"), ("live-panel-right", "ice ahead")];
    let [left, right] = films.map(|(name, message)| pixels(&film(name, message, 96, 90)));
    let mut stream = b"YUV4MPEG2 W640 H240 F100:1 Ip Cmono\n".to_vec();
    for (left, right) in left.iter().zip(&right) {
        stream.extend(b"FRAME\n");
        for (left, right) in left.chunks(320).zip(right.chunks(320)) {
            stream.extend_from_slice(left);
            stream.extend_from_slice(right);
        }
    }
    let path = folder("live-panels").join("camera.y4m");
    pipe(&path);
    let receive = command(&["receive", name(&path), "--json", "--panels", "2"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("vocc runs");
    let _watchdog = Watchdog::of(&receive);
    let writing = std::thread::spawn(move || writer(&path).write_all(&stream));
    let received = receive.wait_with_output().expect("an end");
    writing.join().expect("an end").expect("read");
    let lines = json_lines(&received);
    let panel_of = |message: &str| {
        let mut told = lines
            .iter()
            .filter(|line| line["message"] == message)
            .map(|line| line["panel"].as_u64());
        let panel = told.next().flatten();
        assert!(panel.is_some() && told.all(|other| other == panel), "{message}: {received:?}");
        panel
    };
    assert_ne!(panel_of("bend ahead"), panel_of("ice ahead"));
    assert_eq!(lines.last().expect("a line")["frames"], 96);
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
        let text = b"no frame has come for ";
        let report = messages
            .iter()
            .find(|(topic, _, report)| topic == "/diagnostics" && report.windows(text.len()).any(|part| part == text))?;
        Some(Duration::from_nanos(report.1 - last_image))
    });
    signal("-TERM", receive.id());
    receive.wait().expect("an end");
    assert!((2.5..60.0).contains(&silence.as_secs_f64()), "{silence:?}");
}
