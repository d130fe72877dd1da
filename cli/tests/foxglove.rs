//! `vocc receive --foxglove`, with a client.
#![cfg(target_os = "linux")]

mod common;

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::time::Duration;

use common::bounded::{self, Watchdog, writer};
use common::ffmpeg::wait_for;
use common::recording::{MESSAGE, filmed, y4m};
use common::{command, folder, name, refused};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{HandshakeError, Message, WebSocket};

/// A receiver of a named pipe that serves at any free port.
struct Served {
    receive: Child,
    _watchdog: Watchdog,
    pipe: PathBuf,
    address: String,
}

impl Served {
    fn start(folder_name: &str, more: &[&str]) -> Self {
        let place = folder(folder_name);
        let pipe = place.join("camera.y4m");
        bounded::pipe(&pipe);
        let mut receive = command(&["receive", name(&pipe), "--foxglove=0"]);
        receive.args(more).current_dir(&place).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut receive = receive.spawn().expect("vocc runs");
        let watchdog = Watchdog::of(&receive);
        let mut told = BufReader::new(receive.stderr.take().expect("standard error"));
        let mut line = String::new();
        told.read_line(&mut line).expect("text");
        std::thread::spawn(move || told.lines().for_each(drop));
        let address = line
            .trim()
            .strip_prefix("Foxglove connects to ws://")
            .expect("an address")
            .to_owned();
        Self {
            receive,
            _watchdog: watchdog,
            pipe,
            address,
        }
    }

    /// A client that names these headers; the status of a refusal otherwise, or 0 if there is no answer.
    fn connect(&self, headers: &[(&'static str, &str)]) -> Result<Client, u16> {
        let stream = TcpStream::connect(&self.address).expect("a server");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a limit");
        let mut request = format!("ws://{}", self.address).into_client_request().expect("a request");
        for (header, value) in headers {
            request
                .headers_mut()
                .insert(*header, HeaderValue::from_str(value).expect("a value"));
        }
        match tungstenite::client(request, stream) {
            Ok((socket, response)) => Ok(Client {
                socket,
                protocol: response.headers()["Sec-WebSocket-Protocol"].to_str().expect("text").into(),
            }),
            Err(HandshakeError::Failure(tungstenite::Error::Http(response))) => Err(response.status().as_u16()),
            Err(_) => Err(0),
        }
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.receive.kill();
        let _ = self.receive.wait();
    }
}

struct Client {
    socket: WebSocket<TcpStream>,
    protocol: String,
}

impl Client {
    fn json(&mut self) -> Value {
        match self.socket.read().expect("a message") {
            Message::Text(text) => serde_json::from_str(text.as_str()).expect("JSON"),
            other => panic!("{other}"),
        }
    }

    fn ask(&mut self, request: &Value) {
        self.socket.send(Message::text(request.to_string())).expect("sent");
        // Requests before a ping are done before its answer.
        self.socket.send(Message::Ping(Vec::new().into())).expect("sent");
        while !self.socket.read().expect("an answer").is_pong() {}
    }

    /// The messages of channels until the server ends: subscription, time and content.
    fn rest(&mut self) -> Vec<(u32, u64, Vec<u8>)> {
        let mut messages = Vec::new();
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    assert_eq!(bytes[0], 1);
                    let subscription = u32::from_le_bytes(bytes[1..5].try_into().expect("four bytes"));
                    let time_ns = u64::from_le_bytes(bytes[5..13].try_into().expect("eight bytes"));
                    messages.push((subscription, time_ns, bytes[13..].to_vec()));
                }
                Ok(Message::Close(_)) => return messages,
                Ok(_) => {}
                Err(error) => panic!("{error} after {} messages", messages.len()),
            }
        }
    }
}

const PROTOCOL: (&str, &str) = ("Sec-WebSocket-Protocol", "other, foxglove.sdk.v1");

#[test]
fn a_client_stays_while_the_program_is_stopped_and_goes_on() {
    let served = Served::start("foxglove-stopped", &[]);
    let mut client = served.connect(&[PROTOCOL]).expect("a client");
    for _ in 0..20 {
        for name in ["-STOP", "-CONT"] {
            bounded::signal(name, served.receive.id());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    client.ask(&json!({ "op": "subscribe", "subscriptions": [{ "id": 1, "channelId": 1 }] }));
}

#[test]
fn what_is_recorded_is_served() {
    let film = y4m(&filmed("foxglove-frames", 32));
    let mut served = Served::start("foxglove-served", &["--mcap", "drive.mcap", "--frame-id", "front"]);
    let mut client = served.connect(&[PROTOCOL]).expect("a client");
    assert_eq!(client.protocol, "foxglove.sdk.v1");
    let info = client.json();
    assert_eq!((&info["op"], &info["capabilities"]), (&"serverInfo".into(), &json!([])));
    let advertised = client.json();
    assert_eq!(advertised["op"], "advertise");
    let channels = advertised["channels"].as_array().expect("channels").clone();
    let subscriptions: Vec<Value> = channels
        .iter()
        .map(|channel| json!({ "id": 100 + channel["id"].as_u64().expect("an id"), "channelId": channel["id"] }))
        .collect();
    client.ask(&json!({ "op": "subscribe", "subscriptions": subscriptions }));
    // One that asks for nothing gets nothing, and one that leaves harms nobody.
    let mut idle = served
        .connect(&[("Sec-WebSocket-Protocol", "foxglove.websocket.v1")])
        .expect("a client");
    idle.ask(&json!({ "op": "subscribe", "subscriptions": [{ "id": 1, "channelId": 1 }] }));
    idle.ask(&json!({ "op": "unsubscribe", "subscriptionIds": [1] }));
    drop(served.connect(&[PROTOCOL]));

    let reading = std::thread::spawn(move || client.rest());
    let mut camera = writer(&served.pipe);
    camera.write_all(&film).expect("read");
    drop(camera);
    let messages = reading.join().expect("messages");
    assert!(idle.rest().is_empty());
    assert!(served.receive.wait().expect("an end").success());

    let bytes = std::fs::read(served.pipe.with_file_name("drive.mcap")).expect("a recording");
    let recorded = mcap::MessageStream::new(&bytes).expect("a recording");
    let recorded: Vec<_> = recorded.map(|message| message.expect("whole")).collect();
    let mut known = BTreeMap::new();
    for channel in &channels {
        let text = |key: &str| channel[key].as_str().expect("text").to_owned();
        assert_eq!((&text("encoding")[..], &text("schemaEncoding")[..]), ("cdr", "ros2msg"));
        known.insert(
            100 + channel["id"].as_u64().expect("an id"),
            (text("topic"), text("schemaName"), text("schema")),
        );
    }
    assert!(recorded.len() > 2 * 32 && messages.len() == recorded.len());
    for ((subscription, time_ns, content), recorded) in messages.iter().zip(&recorded) {
        let (topic, name, schema) = &known[&u64::from(*subscription)];
        let recorded_schema = recorded.channel.schema.as_ref().expect("a schema");
        assert_eq!(topic, &recorded.channel.topic);
        assert_eq!((name, schema.as_bytes()), (&recorded_schema.name, &recorded_schema.data[..]));
        assert_eq!((time_ns, &content[..]), (&recorded.log_time, &recorded.data[..]));
    }
    let texts = messages
        .iter()
        .filter(|(subscription, ..)| known[&u64::from(*subscription)].0 == "/panel_0/message");
    let texts: Vec<String> = texts.map(|(.., content)| cdr::deserialize(content).expect("a text")).collect();
    assert!(!texts.is_empty() && texts.iter().all(|text| text == MESSAGE), "{texts:?}");
}

#[test]
fn pages_of_other_sites_and_other_protocols_are_refused() {
    let served = Served::start("foxglove-refused", &[]);
    let with_origin = |origin| served.connect(&[PROTOCOL, ("Origin", origin)]).map(|client| client.protocol);
    for origin in ["https://evil.example", "null", "http://localhost.evil.example"] {
        assert_eq!(with_origin(origin), Err(403), "{origin}");
    }
    for origin in ["https://app.foxglove.dev", "http://localhost:8080"] {
        assert_eq!(with_origin(origin), Ok("foxglove.sdk.v1".into()), "{origin}");
    }
    assert_eq!(
        served.connect(&[("Sec-WebSocket-Protocol", "other")]).map(|client| client.protocol),
        Err(400)
    );
    assert_eq!(served.connect(&[]).map(|client| client.protocol), Err(400));
}

#[test]
fn clients_are_bounded_and_nonsense_harms_nobody() {
    let served = Served::start("foxglove-many", &[]);
    let mut noise = TcpStream::connect(&served.address).expect("a server");
    noise.write_all(&[0xff; 100_000]).ok();
    drop(noise);
    let mut large = served.connect(&[PROTOCOL]).expect("a client");
    large.socket.send(Message::text("x".repeat(1 << 17))).ok();
    assert!((0..9).any(|_| large.socket.read().is_err()), "it is closed");
    drop(large);
    // Nine connections at once, of which eight are served.
    let mut open = Vec::new();
    wait_for(|| {
        open.push(TcpStream::connect(&served.address).expect("a server"));
        open.retain(|stream| {
            stream.set_read_timeout(Some(Duration::from_millis(20))).expect("a limit");
            !matches!(stream.peek(&mut [0]), Ok(0))
        });
        (open.len() == 8).then_some(())
    });
    let ninth = TcpStream::connect(&served.address).expect("a server");
    ninth.set_read_timeout(Some(Duration::from_secs(60))).expect("a limit");
    assert_eq!(ninth.peek(&mut [0]).expect("an end"), 0);
    drop(open);
    wait_for(|| {
        let stream = TcpStream::connect(&served.address).ok()?;
        stream.set_read_timeout(Some(Duration::from_millis(200))).ok()?;
        (!matches!(stream.peek(&mut [0]), Ok(0))).then_some(())
    });
    let mut client = wait_for(|| served.connect(&[PROTOCOL]).ok());
    assert_eq!(client.json()["op"], "serverInfo");
}

#[test]
fn a_port_that_is_taken_is_named() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    let frame = folder("foxglove-port").join("frame.png");
    assert!(common::vocc(&["render", "day", "--out", name(&frame)]).status.success());
    let option = format!("--foxglove={port}");
    refused(
        &["receive", name(&frame), &option],
        &[&format!("127.0.0.1:{port}"), "give a free port"],
    );
    refused(&["receive", name(&frame), "--foxglove=65536"], &["65536"]);
    // A port is not a source.
    refused(&["receive", "--foxglove", "0"], &["cannot use 0 as a frame"]);
    refused(&["receive", name(&frame), "--frame-id", "front"], &["--mcap"]);
}
