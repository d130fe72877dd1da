//! Requests for the page: one GET a connection, and only from the page itself.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use crate::loopback::is_silence;

/// Maximum length of a request. A browser sends the cookies of all pages on 127.0.0.1, whatever their port.
const REQUEST_MAX: usize = 16 << 10;
/// Maximum time for a request to arrive.
const PATIENCE: Duration = Duration::from_secs(2);
/// Maximum time for a piece of an answer to be taken.
const WRITE_PATIENCE: Duration = Duration::from_secs(5);
/// Maximum rest of a refused request that is read, so that its sender reads the answer before the connection is reset.
const REST_MAX: usize = 1 << 20;
const REST_PATIENCE: Duration = Duration::from_millis(300);

/// The page may load only its own parts, and no other page may embed it.
const HEADERS: &str = "Cache-Control: no-store\r\n\
    Connection: close\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self'; base-uri 'none'; \
    form-action 'none'; frame-ancestors 'none'\r\n\
    Cross-Origin-Opener-Policy: same-origin\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Referrer-Policy: no-referrer\r\n\
    X-Content-Type-Options: nosniff\r\n";

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    Malformed,
    Foreign,
    Absent,
    Method,
    Late,
    Long,
    Busy,
    Version,
}

impl Refusal {
    fn status(self) -> &'static str {
        match self {
            Self::Malformed => "400 Bad Request",
            Self::Foreign => "403 Forbidden",
            Self::Absent => "404 Not Found",
            Self::Method => "405 Method Not Allowed",
            Self::Late => "408 Request Timeout",
            Self::Long => "431 Request Header Fields Too Large",
            Self::Busy => "503 Service Unavailable",
            Self::Version => "505 HTTP Version Not Supported",
        }
    }

    fn text(self) -> String {
        match self {
            Self::Malformed => "This is no HTTP request.".into(),
            Self::Foreign => "Only the page itself may ask: open it at the address that vocc has printed.".into(),
            Self::Absent => "There is no such page: open / instead.".into(),
            Self::Method => "Only GET is answered.".into(),
            Self::Late => format!("The request took more than {} s.", PATIENCE.as_secs()),
            Self::Long => format!("The request has more than {REQUEST_MAX} bytes."),
            Self::Busy => "Too many connections: close other windows with this page.".into(),
            Self::Version => "Only HTTP/1.0 and 1.1 are answered.".into(),
        }
    }
}

/// The path that a connection asks for; `None` if it leaves without a request.
pub fn read(stream: &mut TcpStream, port: u16) -> Result<Option<String>, Refusal> {
    let until = Instant::now() + PATIENCE;
    let mut request = Vec::new();
    let mut piece = [0; 1024];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() || stream.set_read_timeout(Some(left)).is_err() {
            return Err(Refusal::Late);
        }
        let read = match stream.read(&mut piece) {
            Ok(read) => read,
            // It may be late now.
            Err(error) if is_silence(&error) => continue,
            Err(_) => return Ok(None),
        };
        if read == 0 {
            return if request.is_empty() { Ok(None) } else { Err(Refusal::Malformed) };
        }
        // The end may be split over two pieces.
        let unseen = request.len().saturating_sub(3);
        request.extend_from_slice(&piece[..read]);
        if let Some(end) = request[unseen..].windows(4).position(|four| four == b"\r\n\r\n") {
            let head = &request[..unseen + end];
            return match head.len() {
                0..=REQUEST_MAX => path(head, port).map(Some),
                _ => Err(Refusal::Long),
            };
        }
        if request.len() > REQUEST_MAX {
            return Err(Refusal::Long);
        }
    }
}

/// The path of a request, without its last empty line, to the page on that port.
fn path(request: &[u8], port: u16) -> Result<String, Refusal> {
    let request = std::str::from_utf8(request).map_err(|_| Refusal::Malformed)?;
    let mut lines = request.split("\r\n");
    let words: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, path, version] = words[..] else {
        return Err(Refusal::Malformed);
    };
    match version {
        "HTTP/1.1" | "HTTP/1.0" => {}
        _ if version.starts_with("HTTP/") => return Err(Refusal::Version),
        _ => return Err(Refusal::Malformed),
    }
    let host = host(port);
    let (mut hosts, mut is_foreign) = (0, false);
    for line in lines {
        let (name, value) = line.split_once(':').ok_or(Refusal::Malformed)?;
        if name.is_empty() || name.contains(|letter: char| !letter.is_ascii_graphic()) {
            return Err(Refusal::Malformed);
        }
        let value = value.trim_matches([' ', '\t']);
        match name.to_ascii_lowercase().as_str() {
            "host" => {
                hosts += 1;
                // A foreign name that resolves to this computer.
                is_foreign |= value != host;
            }
            "origin" => is_foreign |= value.strip_prefix("http://") != Some(host.as_str()),
            // Another page may link to this one, but not load parts of it.
            "sec-fetch-site" => is_foreign |= path != "/" && !matches!(value, "same-origin" | "none"),
            _ => {}
        }
    }
    match (hosts, is_foreign) {
        (1, false) => {}
        (1, true) => return Err(Refusal::Foreign),
        _ => return Err(Refusal::Malformed),
    }
    match method {
        "GET" => Ok(path.to_owned()),
        _ => Err(Refusal::Method),
    }
}

/// The page's host as browsers name it: they leave out HTTP's own port.
pub fn host(port: u16) -> String {
    match port {
        80 => "127.0.0.1".into(),
        _ => format!("127.0.0.1:{port}"),
    }
}

/// Answers with a file of the page.
pub fn answer(stream: &mut TcpStream, kind: &str, body: &str) -> std::io::Result<()> {
    respond(stream, "200 OK", kind, body)
}

/// Begins an answer of events.
pub fn begin_events(stream: &mut TcpStream) -> std::io::Result<()> {
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
    stream.write_all(format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{HEADERS}\r\n").as_bytes())
}

/// Refuses a request without a wait for its rest.
pub fn refuse_at_once(stream: &mut TcpStream, why: Refusal) -> std::io::Result<()> {
    stream.set_nonblocking(true)?;
    say_no(stream, why)?;
    // If a request that has come is not read, the peer loses the answer.
    stream.read(&mut [0; 4096]).map(drop)
}

/// Refuses a request, and reads its rest.
pub fn refuse(stream: &mut TcpStream, why: Refusal) -> std::io::Result<()> {
    say_no(stream, why)?;
    let (until, mut rest, mut piece) = (Instant::now() + REST_PATIENCE, 0, [0; 4096]);
    while rest < REST_MAX {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            break;
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut piece)? {
            0 => break,
            read => rest += read,
        }
    }
    Ok(())
}

fn say_no(stream: &mut TcpStream, why: Refusal) -> std::io::Result<()> {
    respond(stream, why.status(), "text/plain; charset=utf-8", &(why.text() + "\n"))?;
    stream.shutdown(Shutdown::Write)
}

fn respond(stream: &mut TcpStream, status: &str, kind: &str, body: &str) -> std::io::Result<()> {
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
    let allow = if status.starts_with("405") { "Allow: GET\r\n" } else { "" };
    let length = body.len();
    let head = format!("HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{allow}{HEADERS}\r\n");
    stream.write_all(&[head.as_bytes(), body.as_bytes()].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: &str = "Host: 127.0.0.1:8080";

    fn asked(request: &str) -> Result<String, Refusal> {
        path(request.replace('\n', "\r\n").as_bytes(), 8080)
    }

    #[test]
    fn the_page_is_given_only_to_itself() {
        let get = |path: &str, more: &str| asked(&format!("GET {path} HTTP/1.1\n{HOST}{more}"));
        let origin = "\nOrigin: http://127.0.0.1:8080";
        for more in [
            "",
            "\nAccept: */*",
            origin,
            "\nSec-Fetch-Site: same-origin",
            "\nSec-Fetch-Site: none",
        ] {
            assert_eq!(get("/events", more), Ok("/events".into()), "{more}");
        }
        for more in [
            "\nOrigin: http://evil.example",
            "\nOrigin: null",
            "\nOrigin: https://127.0.0.1:8080",
            "\nOrigin: http://127.0.0.1:8081",
            "\nORIGIN:http://127.0.0.1:8080.evil.example",
            "\nSec-Fetch-Site: cross-site",
        ] {
            assert_eq!(get("/events", more), Err(Refusal::Foreign), "{more}");
        }
        // A link on another page.
        assert_eq!(get("/", "\nSec-Fetch-Site: cross-site"), Ok("/".into()));
        for host in [
            "evil.example",
            "evil.example:8080",
            "127.0.0.1",
            "127.0.0.1:80",
            "localhost:8080",
            "[::1]:8080",
            "",
        ] {
            assert_eq!(asked(&format!("GET / HTTP/1.1\nHost: {host}")), Err(Refusal::Foreign), "{host}");
        }
        assert_eq!(path(b"GET / HTTP/1.1\r\nHost: 127.0.0.1", 80), Ok("/".into()));
    }

    #[test]
    fn other_requests_are_refused() {
        for (request, why) in [
            ("", Refusal::Malformed),
            ("GET /", Refusal::Malformed),
            ("GET  / HTTP/1.1\nHost: 127.0.0.1:8080", Refusal::Malformed),
            ("GET / HTTP/1.1", Refusal::Malformed),
            ("GET / HTTP/1.1\nHost: 127.0.0.1:8080\nHost: 127.0.0.1:8080", Refusal::Malformed),
            ("GET / HTTP/1.1\nHost: 127.0.0.1:8080\n folded: line", Refusal::Malformed),
            ("GET / HTTP/1.1\nHost : 127.0.0.1:8080", Refusal::Malformed),
            ("GET / HTTP/1.1\nHost: 127.0.0.1:8080\nnothing", Refusal::Malformed),
            ("GET / FTP/1.1\nHost: 127.0.0.1:8080", Refusal::Malformed),
            ("GET / HTTP/2.0\nHost: 127.0.0.1:8080", Refusal::Version),
            ("POST / HTTP/1.1\nHost: 127.0.0.1:8080", Refusal::Method),
            ("HEAD / HTTP/1.1\nHost: 127.0.0.1:8080", Refusal::Method),
            ("get / HTTP/1.1\nHost: 127.0.0.1:8080", Refusal::Method),
            ("POST / HTTP/1.1\nHost: evil.example", Refusal::Foreign),
        ] {
            assert_eq!(asked(request), Err(why), "{request}");
        }
        assert_eq!(
            path(b"GET / HTTP/1.1\r\nHost: 127.0.0.1:8080\r\nX: \xff", 8080),
            Err(Refusal::Malformed)
        );
    }
}
