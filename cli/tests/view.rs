//! `vocc receive --view`: the page, its events, and who is refused.
#![cfg(target_os = "linux")]

mod common;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use common::bounded::{PATIENCE, Watchdog, signal};
use common::ffmpeg::Place;
use common::recording::{MESSAGE, filmed, pixels, y4m};
use common::{command, folder, json_lines, name, paths, refused, says, text, vocc, words, write_key};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serde_json::Value;

/// The port in a line with the page's address.
fn port_of(line: &str) -> Option<u16> {
    let (_, address) = line.split_once("view: http://127.0.0.1:")?;
    Some(address.split_once('/')?.0.parse().expect("a port"))
}

/// A receiver with a page, and its port.
struct Served {
    receive: Child,
    _watchdog: Watchdog,
    port: u16,
    /// The lines of standard error after the address.
    said: Receiver<String>,
}

impl Served {
    /// Starts a command and reads the page's address.
    fn start(receive: &mut Command) -> Self {
        let receive = receive.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut receive = receive.spawn().expect("vocc runs");
        let errors = receive.stderr.take().expect("standard error");
        Self::of(receive, errors)
    }

    fn of(receive: Child, errors: impl Read + Send + 'static) -> Self {
        let watchdog = Watchdog::of(&receive);
        let (say, said) = std::sync::mpsc::channel();
        // Whoever writes there must not wait.
        std::thread::spawn(move || {
            let lines = BufReader::new(errors).lines().map_while(Result::ok);
            lines.for_each(|line| {
                let _ = say.send(line);
            });
        });
        let port = loop {
            let line = said.recv_timeout(PATIENCE).expect("an address");
            if let Some(port) = port_of(&line) {
                break port;
            }
        };
        Self {
            receive,
            _watchdog: watchdog,
            port,
            said,
        }
    }

    /// Starts to receive what the test writes.
    fn input(more: &[&str]) -> (Self, ChildStdin) {
        let mut served = Self::start(command(&["receive", "-", "--json", "--bits", "--view"]).args(more));
        let input = served.receive.stdin.take().expect("standard input");
        (served, input)
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("set");
        stream
    }

    /// The answer to some bytes.
    fn answer(&self, request: &[u8]) -> String {
        let mut stream = self.connect();
        // A request that is refused early is not read to its end.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        text(&answer)
    }

    fn request(&self, path: &str) -> String {
        format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", self.port)
    }

    fn get(&self, path: &str) -> String {
        self.answer(self.request(path).as_bytes())
    }

    /// Opens the page's events.
    fn events(&self) -> Events {
        let mut stream = self.connect();
        stream.write_all(self.request("/events").as_bytes()).expect("sent");
        let mut lines = BufReader::new(stream);
        let mut line = String::new();
        lines.read_line(&mut line).expect("an answer");
        assert_eq!(line, "HTTP/1.1 200 OK\r\n");
        while line != "\r\n" {
            line.clear();
            lines.read_line(&mut line).expect("a header");
        }
        Events(lines)
    }

    /// Waits for a line of standard error.
    fn wait_for(&self, words: &str) {
        while !self.said.recv_timeout(PATIENCE).expect("a line").contains(words) {}
    }

    /// Its output, with the lines of standard error.
    fn end(self) -> std::process::Output {
        let mut output = self.receive.wait_with_output().expect("an end");
        output.stderr = self.said.iter().collect::<Vec<_>>().join("\n").into_bytes();
        output
    }
}

struct Events(BufReader<TcpStream>);

impl Iterator for Events {
    type Item = (String, Value);

    fn next(&mut self) -> Option<Self::Item> {
        let mut event = String::new();
        loop {
            let mut line = String::new();
            if self.0.read_line(&mut line).expect("an event") == 0 {
                return None;
            }
            let line = line.trim_end();
            if let Some(name) = line.strip_prefix("event: ") {
                event = name.into();
            } else if let Some(data) = line.strip_prefix("data: ") {
                return Some((event, serde_json::from_str(data).expect("JSON")));
            }
        }
    }
}

/// The data of all events of a name.
fn of<'a>(events: &'a [(String, Value)], name: &str) -> Vec<&'a Value> {
    events.iter().filter(|(event, _)| event == name).map(|(_, data)| data).collect()
}

#[test]
fn the_page_is_served_and_nothing_else() {
    let (served, input) = Served::input(&[]);
    let page = served.get("/");
    for header in [
        "HTTP/1.1 200 OK\r\n",
        "Content-Type: text/html",
        "Content-Security-Policy: default-src 'none'; script-src 'self'",
        "X-Content-Type-Options: nosniff",
    ] {
        assert!(page.contains(header), "{header}: {page}");
    }
    assert!(page.contains("<script src=\"/script.js\" defer></script>"));
    assert!(!page.contains("http://") && !page.contains("https://"), "{page}");
    // The Receive tab of the project's own page, and not another copy.
    assert!(page.contains(include_str!("../../page/web/receive.html")), "{page}");
    let script = served.get("/script.js");
    assert!(script.contains(include_str!("../../page/web/receive.js")) && script.contains(include_str!("../../page/web/panel.js")));
    assert!(served.get("/style.css").contains(include_str!("../../page/web/style.css")));

    let port = served.port;
    let request = |method: &str, path: &str, host: &str, more: &str| format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n");
    let host = format!("127.0.0.1:{port}");
    let long = format!("X-Long: {}\r\n", "x".repeat(20 << 10));
    for (request, status) in [
        (request("GET", "/../Cargo.toml", &host, ""), "404"),
        (request("GET", "//", &host, ""), "404"),
        (request("GET", "/events?", &host, ""), "404"),
        (request("POST", "/", &host, "Content-Length: 2\r\n\r\nhi"), "405"),
        (request("OPTIONS", "/events", &host, ""), "405"),
        (request("GET", "/", "evil.example", ""), "403"),
        (request("GET", "/events", &format!("evil.example:{port}"), ""), "403"),
        (request("GET", "/", &format!("127.0.0.1:{}", port ^ 1), ""), "403"),
        (request("GET", "/events", &host, "Origin: http://evil.example\r\n"), "403"),
        (request("GET", "/events", &host, "Origin: null\r\n"), "403"),
        (request("GET", "/", &host, &long), "431"),
        (request("GET", &format!("/{}", "x".repeat(1 << 20)), &host, ""), "431"),
        ("GET / HTTP/1.1\r\n\r\n".into(), "400"),
        (format!("GET / HTTP/1.1\r\nHost: {host}\r\nHost: {host}\r\n\r\n"), "400"),
        ("\r\n\r\n".into(), "400"),
        (request("GET", "/", &host, "").replace("1.1", "9.9"), "505"),
        // A request that never ends.
        (format!("GET / HTTP/1.1\r\nHost: {host}\r\n"), "408"),
    ] {
        let answer = served.answer(request.as_bytes());
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{status}: {answer}");
        assert!(!answer.contains("Access-Control-Allow"), "{answer}");
    }
    // Any bytes, of all values and lengths.
    for length in [1usize, 3, 100, 3000] {
        let bytes: Vec<u8> = (0..length).map(|at| (at * 167 + length) as u8).collect();
        let answer = served.answer(&[&bytes[..], b"\r\n\r\n"].concat());
        assert!(answer.starts_with("HTTP/1.1 400 "), "{length}: {answer}");
    }
    // Connections that say nothing are few, and do not stay.
    let silent: Vec<TcpStream> = (0..16).map(|_| served.connect()).collect();
    let is_refused = |stream: &TcpStream| {
        let mut answer = String::new();
        let read = { stream }.read_to_string(&mut answer);
        read.is_ok() && answer.starts_with("HTTP/1.1 503 ")
    };
    assert!(silent.iter().any(is_refused));
    drop(silent);
    let begun = Instant::now();
    while !served.get("/").starts_with("HTTP/1.1 200 ") {
        assert!(begun.elapsed() < PATIENCE, "the silent ones stay");
    }
    drop(input);
    says(&served.end(), 2, &[]);
}

#[test]
fn events_have_what_json_has() {
    let film = filmed("view-film", 32);
    let (served, mut input) = Served::input(&["--symbol-rate", "90"]);
    let events = served.events();
    let stream = y4m(&film);
    let told = std::thread::spawn(move || events.collect::<Vec<_>>());
    // In pieces, so that the page has time for some frames before the last.
    for piece in stream.chunks(stream.len().div_ceil(8)) {
        input.write_all(piece).expect("read");
        std::thread::sleep(Duration::from_millis(100));
    }
    drop(input);
    let output = served.end();
    says(&output, 0, &[]);
    let (lines, events) = (json_lines(&output), told.join().expect("events"));
    assert_eq!(events[0].0, "source");
    assert_eq!(
        events[0].1,
        serde_json::json!({ "name": "standard input", "is_live": false, "is_checked": false })
    );

    let frames = of(&events, "frame");
    let mut read = 0;
    for frame in &frames {
        let panel = &frame["panels"][0];
        let line = lines.iter().find(|line| line["frame"] == frame["frame"]);
        assert_eq!(panel["why"].is_string(), line.is_none(), "{frame}");
        let Some(line) = line else { continue };
        for (key, value) in line.as_object().expect("an object") {
            assert_eq!(&panel[key], value, "{key}");
        }
        read += 1;
        // The outline is around the panel's middle.
        let corners: Vec<[f64; 2]> = serde_json::from_value(panel["corners_px"].clone()).expect("corners");
        for (axis, centre_px) in [0, 1].map(|axis| (axis, line["centre_px"][axis].as_f64().expect("a number"))) {
            let mean_px = corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0;
            assert!((mean_px - centre_px).abs() < 1.0, "{mean_px} and {centre_px}");
        }
        for picture in [&frame["picture"], &panel["picture"]] {
            assert!(picture["jpeg"].as_str().is_some_and(|jpeg| jpeg.starts_with("/9j/")), "{picture}");
        }
    }
    // How many are shown depends on the computer's other work.
    assert!(read >= 1, "{} frames", frames.len());
    // The last state is that of the last frame.
    let last = frames[frames.len() - 1];
    assert_eq!(last["frame"], 31);
    assert_eq!(last["camera"], lines[lines.len() - 1]["camera"]);
    assert!(last["camera"]["blur_sigma_px"].is_number(), "{last}");

    let sent: Vec<&Value> = lines.iter().filter(|line| line["message"].is_string()).collect();
    let shown = of(&events, "message");
    assert_eq!(shown[shown.len() - 1]["report"], *sent[sent.len() - 1]);
    assert_eq!(shown[shown.len() - 1]["times"], sent.len());
    assert_eq!(sent[0]["message"], MESSAGE);
    let (last, end) = &events[events.len() - 1];
    assert_eq!(last, "end");
    assert_eq!(
        (&end["frames"], &end["read"], &end["messages"], &end["why"]),
        (
            &32.into(),
            &lines.iter().filter(|line| line["bits"].is_string()).count().into(),
            &sent.len().into(),
            &Value::Null
        )
    );
}

#[test]
fn the_page_says_why_nothing_is_read() {
    let (served, mut input) = Served::input(&["--raw", "64x48"]);
    let events = served.events();
    input.write_all(&[90; 64 * 48]).expect("read");
    let mut events = events.skip_while(|(event, _)| event != "frame");
    let (_, frame) = events.next().expect("a frame");
    let why = frame["panels"][0]["why"].as_str().expect("a reason").to_owned();
    assert!(why.contains("no candidate"), "{why}");
    assert_eq!(frame["size_px"], serde_json::json!([64, 48]));
    // A fault ends it.
    input.write_all(&[90; 100]).expect("read");
    drop(input);
    let events: Vec<_> = events.collect();
    let end = of(&events, "end");
    let fault = end[0]["why"].as_str().expect("a fault");
    let output = served.end();
    assert_eq!(output.status.code(), Some(2));
    assert!(!fault.is_empty());
    // What would help is a remark, as on standard error.
    let remarks = of(&events, "remark");
    assert!(
        remarks.iter().any(|remark| remark["text"] == "no message in 1 frames"),
        "{remarks:?}"
    );
}

#[test]
fn a_signer_and_the_verdict_are_shown() {
    let path = paths("view-signed");
    let [key, trusted, film] = ["key.toml", "keys.toml", "film"].map(&path);
    write_key(&key, &trusted);
    let link = "link day --message hi --level fast --set camera.width_px=320 --set camera.height_px=240 --counter 7 --sign";
    says(&vocc(&[&words(link)[..], &[&key, "--save", &film]].concat()), 0, &[]);
    let (served, mut input) = Served::input(&["--trust", &trusted]);
    let events = served.events();
    input.write_all(&y4m(film.as_ref())).expect("read");
    drop(input);
    let events: Vec<_> = events.collect();
    says(&served.end(), 0, &[]);
    assert_eq!(of(&events, "source")[0]["is_checked"], true);
    let messages = of(&events, "message");
    let last = messages.iter().rfind(|message| message["proof"].is_object()).expect("a proof");
    assert_eq!(
        (&last["report"]["message"], &last["proof"]["verdict"]),
        (&"hi".into(), &"proven".into())
    );
    assert_eq!(
        (&last["proof"]["signer_name"], &last["proof"]["counter"]),
        (&"truck 12".into(), &7.into())
    );
}

#[test]
fn a_live_source_shows_its_latency_and_stops() {
    let place = Place::with_frames("view-live", "/bin/cat times >&2; /bin/cat frames; exec /bin/sleep 600");
    let served = Served::start(&mut place.receive(&["udp://127.0.0.1:5000", "--view", "--json"]));
    let mut events = served.events();
    assert_eq!(events.next().expect("the source").1["is_live"], true);
    let mut frames = events.by_ref().filter(|(event, _)| event == "frame");
    let (_, frame) = frames.find(|(_, frame)| frame["frame"] == 15).expect("the last frame");
    assert!(frame["latency_s"].as_f64().is_some_and(|latency_s| latency_s > 0.0), "{frame}");
    signal("-INT", served.receive.id());
    let output = served.end();
    assert!(output.status.code().is_some_and(|code| code < 2), "{output:?}");
    let events: Vec<_> = events.collect();
    // The program does not wait long for a page after Ctrl-C.
    if let Some(end) = of(&events, "end").first() {
        assert_eq!(end["latency"], json_lines(&output).pop().expect("a line")["latency"]);
    }
}

#[test]
fn a_page_that_reads_nothing_keeps_no_frame_from_the_receiver() {
    let (served, mut input) = Served::input(&["--raw", "64x48"]);
    let mut page = served.connect();
    page.write_all(served.request("/events").as_bytes()).expect("sent");
    (0..1000).for_each(|_| input.write_all(&[90; 64 * 48]).expect("read"));
    drop(input);
    says(&served.end(), 1, &["no message in 1000 frames"]);
}

#[test]
fn without_a_page_open_it_ends_as_without_a_page() {
    let film = filmed("view-unwatched", 24);
    let arguments = ["receive", name(&film), "--json", "--bits"];
    let plain = vocc(&arguments);
    let viewed = vocc(&[&arguments[..], &["--view"]].concat());
    says(&viewed, 0, &["view: http://127.0.0.1:"]);
    assert_eq!(text(&viewed.stdout), text(&plain.stdout));
    assert_eq!(pixels(&film).len(), 24);
}

/// Starts to receive a film with a terminal as standard error.
fn at_a_terminal(film: &Path) -> Served {
    let person = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&person).and_then(|()| unlockpt(&person)).expect("set");
    let terminal = ptsname(&person, Vec::new()).expect("a name").into_string().expect("a name");
    let terminal = File::options().read(true).write(true).open(terminal).expect("opens");
    let mut receive = command(&["receive", name(film), "--json", "--view"]);
    let receive = receive.stdout(Stdio::piped()).stderr(terminal).spawn().expect("vocc runs");
    Served::of(receive, File::from(person))
}

#[test]
fn a_person_who_has_not_opened_the_page_yet_is_waited_for() {
    let film = filmed("view-terminal", 24);
    let mut served = at_a_terminal(&film);
    served.wait_for("all is received");
    assert!(served.receive.try_wait().expect("runs").is_none());
    let events: Vec<_> = served.events().collect();
    assert_eq!(of(&events, "frame")[0]["frame"], 23);
    assert_eq!(of(&events, "message")[0]["report"]["message"], MESSAGE);
    assert_eq!(of(&events, "end")[0]["frames"], 24);
    says(&served.end(), 0, &[]);

    let mut served = at_a_terminal(&film);
    served.wait_for("all is received");
    assert!(served.receive.try_wait().expect("runs").is_none());
    signal("-INT", served.receive.id());
    says(&served.end(), 0, &[]);
}

#[test]
fn a_port_that_is_taken_or_is_none_is_refused_before_anything_is_opened() {
    let taken = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let place = folder("view-taken");
    let recording = place.join("drive.mcap");
    let view = format!("--view={port}");
    let output = vocc(&["receive", "absent.y4m", &view, "--mcap", name(&recording)]);
    says(
        &output,
        2,
        &[
            &format!("cannot serve the page at 127.0.0.1:{port}"),
            "choose another port",
            "in use",
        ],
    );
    assert!(!text(&output.stderr).contains("absent.y4m"), "{output:?}");
    assert_eq!(std::fs::read_dir(&place).expect("a folder").count(), 0);
    for address in ["0.0.0.0:8080", "65536", "-1", "example.com", "127.0.0.1:", "[::1]:80"] {
        refused(&["receive", "-", &format!("--view={address}")], &["on 127.0.0.1 alone"]);
    }
    refused(&["receive", "--view", "8080", "frames"], &["write --view=8080"]);
}
