//! Bytes stay bytes, and no name or message controls a terminal.
#![cfg(unix)]

mod common;

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use common::recording::run;
use common::{command, folder, json, json_lines, name, says, text, vocc};
use mcap::MessageStream;

const SMALL: [&str; 2] = ["--set=camera.width_px=480", "--set=camera.height_px=320"];

/// A film of a message, and the output of `link --json`.
fn film(place: &Path, message: &[u8], more: &[&str]) -> serde_json::Value {
    let file = place.join("message");
    std::fs::write(&file, message).expect("room");
    let film = place.join("film");
    let link = ["link", "day", "--json", "--message-file", name(&file), "--save", name(&film)];
    let link = vocc(&[&link[..], &SMALL, more].concat());
    says(&link, 0, &[]);
    json(&link)
}

#[test]
fn a_message_of_any_bytes_comes_out_as_it_went_in() {
    for (case, message) in [b"\xff\x01", b"\xfe\x01"].into_iter().enumerate() {
        let place = folder(&format!("bytes-{case}"));
        let sent = film(&place, message, &[]);
        let hex = format!("{:02x}{:02x}", message[0], message[1]);
        assert_eq!((&sent["message_hex"], &sent["sent_hex"]), (&hex[..].into(), &hex[..].into()));
        let path = |file: &str| name(&place.join(file)).to_owned();
        let (out, recording) = (path("out"), path("film.mcap"));
        let received = vocc(&["receive", &path("film"), "--json", "--out", &out, "--mcap", &recording]);
        says(&received, 0, &[]);
        assert_eq!(json_lines(&received)[0]["message_hex"], hex);
        assert_eq!(std::fs::read(out).expect("written"), message);
        let bytes = std::fs::read(recording).expect("a recording");
        let recorded = MessageStream::new(&bytes)
            .expect("an MCAP file")
            .map(|message| message.expect("whole"));
        let recorded: Vec<_> = recorded
            .filter(|message| message.channel.topic == "/panel_0/message_bytes")
            .collect();
        let (dimensions, offset, data): ([u32; 1], u32, Vec<u8>) = cdr::deserialize(&recorded[0].data).expect("bytes");
        assert_eq!((dimensions, offset, &data[..]), ([0], 0, &message[..]));
        let shown = vocc(&["receive", &path("film")]);
        let escaped = format!(r#""\x{:x}\u{{1}}""#, message[0]);
        assert!(text(&shown.stdout).starts_with(&escaped), "{}", text(&shown.stdout));
    }
}

#[test]
fn a_text_is_told_as_digits_on_demand() {
    let place = folder("bytes-text");
    let sent = film(&place, "Eis\u{9b}\u{202e}".as_bytes(), &[]);
    assert_eq!(
        (sent["message"].as_str(), sent.get("message_hex")),
        (Some("Eis\u{9b}\u{202e}"), None)
    );
    let film = place.join("film");
    let plain = vocc(&["receive", name(&film), "--json"]);
    assert_eq!(json_lines(&plain)[0].get("message_hex"), None);
    // The output contains nothing that controls a terminal.
    assert!(plain.stdout.is_ascii(), "{}", text(&plain.stdout));
    let told = vocc(&["receive", name(&film), "--json", "--hex"]);
    assert_eq!(json_lines(&told)[0]["message_hex"], "456973c29be280ae");
}

#[test]
fn what_is_learnt_after_the_message_is_in_the_last_object() {
    let place = folder("bytes-learnt");
    // About sixteen frames complete the message, before single LEDs are learnt.
    let message = "Braking hard: queue behind the bend, 200 m ahead";
    film(&place, message.as_bytes(), &["--set", "panel.dead_leds=[9,40]", "--frames", "60"]);
    let received = vocc(&["receive", name(&place.join("film")), "--json"]);
    let lines = json_lines(&received);
    let last = lines.last().expect("lines");
    assert_eq!(last["camera"]["broken_leds"], serde_json::json!([9, 40]), "{last}");
    assert_eq!(lines[0]["camera"]["broken_leds"], serde_json::json!([]));
    assert!(lines[0]["message"] == message && last.get("message").is_none());
}

#[test]
fn files_of_any_name_are_read() {
    let place = folder("bytes-names");
    let first = place.join("a.png");
    says(&vocc(&[&["render", "day", "--out", name(&first)], &SMALL[..]].concat()), 0, &[]);
    let names = [&b"a.png"[..], b"b\xff\x1b[2J.png", b"c.png"];
    let paths = names.map(|name| place.join(OsStr::from_bytes(name)));
    for path in &paths[1..] {
        std::fs::copy(&first, path).expect("room");
    }
    let decoded = run(command(&["decode", "--json"]).args(&paths));
    says(&decoded, 0, &[]);
    let lines = json_lines(&decoded);
    assert_eq!(lines.len(), 3);
    let hex: String = paths[1].as_os_str().as_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!((&lines[1]["found"], &lines[1]["file_hex"]), (&true.into(), &hex.into()));
    assert_eq!(lines[2].get("file_hex"), None);
    let shown = run(command(&["decode"]).args(&paths));
    assert!(text(&shown.stdout).contains(r"b\xff\u{1b}[2J.png: "), "{}", text(&shown.stdout));
}

#[test]
fn the_last_number_that_there_is_is_one() {
    let place = folder("bytes-last");
    let frames = ["18446744073709551614.png", "18446744073709551615.png"].map(|frame| place.join(frame));
    says(&vocc(&[&["render", "day", "--out", name(&frames[0])], &SMALL[..]].concat()), 0, &[]);
    std::fs::copy(&frames[0], &frames[1]).expect("room");
    let received = vocc(&["receive", name(&frames[0]), name(&frames[1]), "--bits", "--json"]);
    says(&received, 1, &["no message in 2 frames"]);
    assert_eq!(json_lines(&received).iter().filter(|line| line["bits"].is_string()).count(), 2);
}

#[test]
fn nothing_from_outside_reaches_a_terminal() {
    const HOSTILE: &str = "\u{1b}[2J\u{9b}\u{202e}\u{7f}";
    let place = folder("bytes-hostile");
    let scene = place.join("scene.toml");
    std::fs::write(&scene, format!("[pose]\n\"a{HOSTILE}\" = 1 # {HOSTILE}\n")).expect("room");
    let missing = place.join(format!("{HOSTILE}.png"));
    let option = format!("--{HOSTILE}");
    for arguments in [["plan", name(&scene)], ["decode", name(&missing)], ["plan", &option]] {
        let refused = vocc(&arguments);
        says(&refused, 2, &[]);
        let said = text(&refused.stderr);
        let is_hostile = |c: char| HOSTILE.contains(c) && c.is_control() || c == '\u{202e}';
        assert!(!said.is_empty() && !said.contains(is_hostile), "{said:?}");
    }
}
