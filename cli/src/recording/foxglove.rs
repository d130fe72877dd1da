//! Serves a recording's channels to [Foxglove](https://foxglove.dev) while they are written, by its [WebSocket
//! protocol](https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md).
//!
//! A thread accepts connections, and each client has a thread and a queue of its own. The receiver never waits for a client: one that is
//! too slow misses the oldest messages.
//!
//! `tungstenite` without TLS adds 11 packages to the build; the crate `foxglove` (0.30) with its server adds 82, with tokio. No receiver
//! needs what that crate has beyond this file: message types of its own, parameters, services, assets and playback for clients, TLS, a
//! gateway for remote access, and a second writer of MCAP files. It also lacks two necessary limits: its server accepts any page of a
//! browser, and bounds a client's queue by 1024 messages, not by bytes.

use std::collections::{BTreeMap, VecDeque};
use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context;
use serde_json::{Value, json};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

use super::mcap::Schema;
use crate::loopback::{connections, is_silence};
use crate::output::tell;

/// Foxglove's default port.
pub const PORT: &str = "8765";
/// The versions of the protocol, which differ in nothing that is used here.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Web pages that may connect, beside those of this computer.
const PAGES: [&str; 1] = ["https://app.foxglove.dev"];
/// Maximum number of clients.
const CLIENTS_MAX: usize = 8;
/// Maximum size of a client's queue.
const QUEUE_BYTES: usize = 64 << 20;
/// Maximum size of a client's message: a subscription to every channel.
const REQUEST_BYTES: usize = 1 << 16;
/// Interval between checks of the queue while a client is silent.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// A client that reads nothing for this long is disconnected.
const PATIENCE: Duration = Duration::from_secs(5);
/// At the end, a client that reads nothing for this long is abandoned.
const FAREWELL: Duration = Duration::from_millis(500);
/// The opcode of a message of a channel.
const MESSAGE_DATA: u8 = 1;

/// A server of channels to any number of clients, which come and go.
pub struct Server {
    listener: TcpListener,
    state: Arc<Mutex<State>>,
}

#[derive(Default)]
struct State {
    /// The channels' advertisements, by id from 1.
    channels: Vec<Value>,
    clients: BTreeMap<u64, Client>,
    next_client: u64,
    has_ended: bool,
}

#[derive(Default)]
struct Client {
    /// The channel of each subscription.
    subscriptions: BTreeMap<u32, u64>,
    queue: VecDeque<Message>,
    queued_bytes: usize,
}

impl Client {
    fn put(&mut self, message: Message) {
        self.queued_bytes += message.len();
        self.queue.push_back(message);
        while self.queued_bytes > QUEUE_BYTES {
            self.take();
        }
    }

    fn take(&mut self) -> Option<Message> {
        let message = self.queue.pop_front()?;
        self.queued_bytes -= message.len();
        Some(message)
    }
}

impl Server {
    /// A server at a port of this computer, which others cannot reach; 0 for any free one. Clients can connect once it is open.
    pub fn at(port: u16) -> anyhow::Result<Self> {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let listener = TcpListener::bind(address)
            .with_context(|| format!("cannot serve Foxglove at {address}: give a free port, as --foxglove=8766, or 0 for any"))?;
        let state = Arc::default();
        Ok(Self { listener, state })
    }

    /// Prints the address and accepts clients. They get the channels so far in one advertisement.
    pub fn open(&self) -> anyhow::Result<()> {
        tell(format_args!("Foxglove connects to ws://{}", self.listener.local_addr()?));
        let (listener, state) = (self.listener.try_clone()?, Arc::clone(&self.state));
        std::thread::Builder::new().spawn(move || accept(&listener, &state))?;
        Ok(())
    }

    /// Adds a channel, and returns its id.
    pub fn channel(&self, topic: &str, schema: &Schema) -> u16 {
        let mut state = lock(&self.state);
        let id = state.channels.len() as u16 + 1;
        let channel = json!({
            "id": id, "topic": topic, "encoding": "cdr", "schemaName": schema.name, "schema": schema.definition,
            "schemaEncoding": "ros2msg",
        });
        let told = advertised(std::slice::from_ref(&channel));
        state.clients.values_mut().for_each(|client| client.put(told.clone()));
        state.channels.push(channel);
        id
    }

    /// Whether any client is subscribed to a channel.
    pub fn is_wanted(&self, channel: u16) -> bool {
        let state = lock(&self.state);
        let mut wanted = state.clients.values().flat_map(|client| client.subscriptions.values());
        wanted.any(|&wanted| wanted == u64::from(channel))
    }

    /// Sends a message to subscribed clients.
    pub fn message(&self, channel: u16, time_ns: u64, message: &[u8]) {
        for client in lock(&self.state).clients.values_mut() {
            let wanted = client.subscriptions.iter().filter(|(_, wanted)| **wanted == u64::from(channel));
            let subscriptions: Vec<u32> = wanted.map(|(&subscription, _)| subscription).collect();
            for subscription in subscriptions {
                let parts = [&[MESSAGE_DATA][..], &subscription.to_le_bytes(), &time_ns.to_le_bytes(), message];
                client.put(Message::binary(parts.concat()));
            }
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let left = || {
            let clients = &lock(&self.state).clients;
            (clients.len(), clients.values().map(|client| client.queued_bytes).sum::<usize>())
        };
        lock(&self.state).has_ended = true;
        let begun = Instant::now();
        let (mut last, mut moved) = (left(), begun);
        while begun.elapsed() < PATIENCE && moved.elapsed() < FAREWELL && last.0 > 0 {
            std::thread::sleep(LOOK_EVERY);
            let now = left();
            if now != last {
                (last, moved) = (now, Instant::now());
            }
        }
    }
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

fn advertised(channels: &[Value]) -> Message {
    Message::text(json!({ "op": "advertise", "channels": channels }).to_string())
}

fn accept(listener: &TcpListener, state: &Arc<Mutex<State>>) {
    for stream in connections(listener) {
        let mut open = lock(state);
        if open.has_ended {
            return;
        }
        if open.clients.len() >= CLIENTS_MAX {
            // Closes it.
            continue;
        }
        let id = open.next_client;
        open.next_client += 1;
        open.clients.insert(id, Client::default());
        drop(open);
        let shared = Arc::clone(state);
        let serve = move || {
            // An error is a client that left, or one that does not speak the protocol.
            let _ = serve(stream, id, &shared);
            lock(&shared).clients.remove(&id);
        };
        if std::thread::Builder::new().spawn(serve).is_err() {
            lock(state).clients.remove(&id);
        }
    }
}

/// Whether a page may connect. A page of any site can reach the ports of the computer that shows it, and would see the camera's images.
fn is_trusted(origin: &str) -> bool {
    let is_local = origin.strip_prefix("http://").is_some_and(|host| {
        let host = match host.rsplit_once(':') {
            Some((host, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => host,
            _ => host,
        };
        ["localhost", "127.0.0.1"].contains(&host)
    });
    is_local || PAGES.contains(&origin)
}

/// Accepts the protocol, unless a foreign page or another protocol asks.
#[expect(clippy::result_large_err, reason = "the type of the library's callback")]
fn agree(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let refused = |status: StatusCode, why: &str| {
        let mut refusal = ErrorResponse::new(Some(why.to_owned()));
        *refusal.status_mut() = status;
        refusal
    };
    let headers = request.headers();
    let is_foreign = |origin: &HeaderValue| !origin.to_str().is_ok_and(is_trusted);
    if headers.get_all("Origin").iter().any(is_foreign) {
        return Err(refused(StatusCode::FORBIDDEN, "pages of other sites are refused"));
    }
    let offered = headers
        .get_all("Sec-WebSocket-Protocol")
        .iter()
        .filter_map(|value| value.to_str().ok());
    let offered: Vec<&str> = offered.flat_map(|value| value.split(',')).map(str::trim).collect();
    let Some(protocol) = PROTOCOLS.into_iter().find(|protocol| offered.contains(protocol)) else {
        return Err(refused(
            StatusCode::BAD_REQUEST,
            "the subprotocols are foxglove.sdk.v1 and foxglove.websocket.v1",
        ));
    };
    response
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", HeaderValue::from_static(protocol));
    Ok(response)
}

/// Serves a client until it leaves or the server ends.
fn serve(stream: TcpStream, id: u64, state: &Mutex<State>) -> Result<(), Error> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(REQUEST_BYTES))
        .max_frame_size(Some(REQUEST_BYTES));
    let mut socket =
        tungstenite::accept_hdr_with_config(stream, agree, Some(config)).map_err(|_| Error::Io(ErrorKind::ConnectionAborted.into()))?;
    socket.get_ref().set_read_timeout(Some(LOOK_EVERY))?;
    let name = concat!("vocc ", env!("CARGO_PKG_VERSION"));
    let info = json!({ "op": "serverInfo", "name": name, "capabilities": [], "metadata": {} });
    socket.send(Message::text(info.to_string()))?;
    socket.send(all_channels(id, state))?;
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => change(id, state, |client| obey(client, text.as_str())),
            Ok(_) => {}
            Err(Error::Io(error)) if is_silence(&error) => {}
            Err(error) => return Err(error),
        }
        send_queued(&mut socket, id, state)?;
        if lock(state).has_ended {
            send_queued(&mut socket, id, state)?;
            socket.close(None)?;
            return socket.flush();
        }
    }
}

/// The advertisement of all channels so far. Those that the client's queue has are among them.
fn all_channels(id: u64, state: &Mutex<State>) -> Message {
    let mut state = lock(state);
    let known = advertised(&state.channels);
    if let Some(client) = state.clients.get_mut(&id) {
        while client.take().is_some() {}
    }
    known
}

fn send_queued(socket: &mut WebSocket<TcpStream>, id: u64, state: &Mutex<State>) -> Result<(), Error> {
    loop {
        let next = lock(state).clients.get_mut(&id).and_then(Client::take);
        match next {
            Some(message) => socket.send(message)?,
            None => return Ok(()),
        }
    }
}

fn change(id: u64, state: &Mutex<State>, change: impl FnOnce(&mut Client)) {
    if let Some(client) = lock(state).clients.get_mut(&id) {
        change(client);
    }
}

/// Handles a client's request; requests other than subscriptions need capabilities that are not offered.
fn obey(client: &mut Client, request: &str) {
    let request: Value = serde_json::from_str(request).unwrap_or_default();
    let listed = |key: &str| request[key].as_array().cloned().unwrap_or_default();
    let id_of = |id: &Value| id.as_u64().and_then(|id| u32::try_from(id).ok());
    match request["op"].as_str() {
        Some("subscribe") => {
            let subscriptions = listed("subscriptions");
            let subscriptions = subscriptions
                .iter()
                .filter_map(|told| Some((id_of(&told["id"])?, told["channelId"].as_u64()?)));
            client.subscriptions.extend(subscriptions);
        }
        Some("unsubscribe") => {
            for id in listed("subscriptionIds").iter().filter_map(id_of) {
                client.subscriptions.remove(&id);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_this_computer_and_of_foxglove_may_connect() {
        for origin in [
            "https://app.foxglove.dev",
            "http://localhost:8080",
            "http://127.0.0.1",
            "http://localhost",
        ] {
            assert!(is_trusted(origin), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "null",
            "",
            "https://app.foxglove.dev.evil.example",
            "http://localhost.evil.example",
            "http://localhost:1@evil.example",
            "http://evil.example:127.0.0.1",
            "https://localhost",
        ] {
            assert!(!is_trusted(origin), "{origin}");
        }
    }

    #[test]
    fn a_slow_client_misses_the_oldest_messages() {
        let mut client = Client::default();
        for number in 0..5_u8 {
            client.put(Message::binary(vec![number; QUEUE_BYTES / 4]));
        }
        let kept: Vec<u8> = std::iter::from_fn(|| client.take()).map(|message| message.into_data()[0]).collect();
        assert_eq!((kept, client.queued_bytes), (vec![1, 2, 3, 4], 0));
    }

    #[test]
    fn what_a_client_asks_for_is_noted() {
        let mut client = Client::default();
        obey(
            &mut client,
            r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":7,"channelId":1},{"id":-1}]}"#,
        );
        assert_eq!(client.subscriptions, [(0, 3), (7, 1)].into());
        obey(&mut client, r#"{"op":"unsubscribe","subscriptionIds":[0,99,"7"]}"#);
        for nonsense in [
            "",
            "{",
            "[]",
            "7",
            r#"{"op":7}"#,
            r#"{"op":"subscribe"}"#,
            r#"{"op":"advertise","channels":[{}]}"#,
        ] {
            obey(&mut client, nonsense);
        }
        assert_eq!(client.subscriptions, [(7, 1)].into());
    }
}
