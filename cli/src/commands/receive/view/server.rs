//! Serves the page and its events to browsers on this computer.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::events::{EventCursor, Events};
use super::request::{self, Refusal};
use crate::loopback::{connections, is_silence};

/// Maximum number of connections. A browser opens up to six at once, and keeps one a page.
const CONNECTIONS_MAX: usize = 12;
/// Stack of a connection's thread, in bytes.
const STACK: usize = 256 << 10;
/// Interval between two checks whether a page was closed.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Interval between two signs of life, without which a page that was cut off keeps its connection.
const SIGN_EVERY: Duration = Duration::from_secs(5);

// All but the shell and the source of the events are files of the project's own page, which are linked here.
const SHELL: &str = include_str!("page/index.html");
/// The line of the shell that the Receive tab replaces.
const MARK: &str = "<!-- receive -->\n";
const RECEIVE: &str = include_str!("page/receive.html");
const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = concat!(
    "\"use strict\";\n",
    include_str!("page/words.js"),
    include_str!("page/say.js"),
    include_str!("page/picture.js"),
    include_str!("page/leds.js"),
    include_str!("page/panel.js"),
    include_str!("page/messages.js"),
    include_str!("page/receive.js"),
    include_str!("page/events.js"),
);

/// Serves until the program ends.
pub fn serve(listener: TcpListener, port: u16, events: Arc<Events>) -> std::io::Result<()> {
    let drawn = Arc::clone(&events);
    std::thread::Builder::new().spawn(move || drawn.draw())?;
    std::thread::Builder::new().spawn(move || accept(&listener, port, &events))?;
    Ok(())
}

/// Counts a connection until it is dropped.
struct Connection(Arc<AtomicUsize>);

impl Drop for Connection {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

fn accept(listener: &TcpListener, port: u16, events: &Arc<Events>) {
    let open = Arc::new(AtomicUsize::new(0));
    for mut stream in connections(listener) {
        let is_one_too_many = open.fetch_add(1, Ordering::Relaxed) >= CONNECTIONS_MAX;
        let (connection, events) = (Connection(Arc::clone(&open)), Arc::clone(events));
        if is_one_too_many {
            // A peer that has left is not a fault.
            let _ = request::refuse_at_once(&mut stream, Refusal::Busy);
            continue;
        }
        let handle = move || {
            let _open = connection;
            // A peer that has left is not a fault.
            let _ = converse(&mut stream, port, &events);
        };
        // Without a thread the connection is closed.
        let _ = std::thread::Builder::new().stack_size(STACK).spawn(handle);
    }
}

fn converse(stream: &mut TcpStream, port: u16, events: &Events) -> std::io::Result<()> {
    let path = match request::read(stream, port) {
        Ok(Some(path)) => path,
        Ok(None) => return Ok(()),
        Err(why) => return request::refuse(stream, why),
    };
    match path.as_str() {
        "/" => request::answer(stream, "text/html; charset=utf-8", &SHELL.replace(MARK, RECEIVE)),
        "/style.css" => request::answer(stream, "text/css; charset=utf-8", STYLE),
        "/script.js" => request::answer(stream, "text/javascript; charset=utf-8", SCRIPT),
        "/events" => tell(stream, events),
        _ => request::refuse(stream, Refusal::Absent),
    }
}

/// Sends new events until the end, or until the page is closed. Frames that a page has no time for are overtaken by newer ones.
fn tell(stream: &mut TcpStream, events: &Events) -> std::io::Result<()> {
    let _watcher = events.watch();
    request::begin_events(stream)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(Duration::from_millis(1)))?;
    let (mut shown, mut signed) = (EventCursor::default(), Instant::now());
    loop {
        let news = events.news(&mut shown, LOOK_EVERY);
        for event in &news.events {
            stream.write_all(event.as_bytes())?;
            signed = Instant::now();
        }
        if news.is_end {
            events.see_end();
            return Ok(());
        }
        if signed.elapsed() > SIGN_EVERY {
            stream.write_all(b":\n\n")?;
            signed = Instant::now();
        }
        if is_closed(stream)? {
            return Ok(());
        }
    }
}

/// Whether the peer has closed the connection; anything else that it sends is dropped.
fn is_closed(stream: &mut TcpStream) -> std::io::Result<bool> {
    match stream.read(&mut [0; 256]) {
        Ok(read) => Ok(read == 0),
        Err(error) if is_silence(&error) => Ok(false),
        Err(error) => Err(error),
    }
}
