//! Runs the RP2040 emulator in `tests/boards/emulator`, which requires Node.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use link::serial::{Kind, REQUEST_FRAME_MAX, Request, encode, wire_length};
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::programs::{output, root};
use crate::trials::Unready;

const FOLDER: &str = "tests/boards/emulator";
/// Timeout for an event; exceeds the time of any command on a busy computer.
const PATIENCE: Duration = Duration::from_secs(600);

/// Number of polls for the emulator's exit.
const LOOKS: usize = 50;
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Ensures that the emulator is installed.
pub fn provide() -> Result<(), Unready> {
    output(Command::new("node").arg("--version"))?;
    let folder = root().join(FOLDER);
    if folder.join("node_modules/rp2040js").is_dir() {
        return Ok(());
    }
    output(Command::new("npm").arg("ci").arg("--no-audit").arg("--prefix").arg(folder)).map(drop)
}

/// Sends a request to the serial line of an emulated board; returns the line, which is open as long as this.
pub fn request(socket: &Path, sequence: u32, request: &Request<'_>) -> UnixStream {
    let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
    let wire = encode(Kind::Request, sequence, request, &mut wire).expect("it fits");
    let mut line = UnixStream::connect(socket).expect("the emulator listens");
    line.write_all(wire).expect("the board takes it");
    line
}

/// Emulated boards, driven by commands and observed by events.
pub struct Emulation<E> {
    process: Child,
    commands: ChildStdin,
    events: Receiver<E>,
}

impl<E: DeserializeOwned + Send + 'static> Emulation<E> {
    /// Starts an emulator script.
    pub fn start<A: AsRef<OsStr>>(script: &str, arguments: impl IntoIterator<Item = A>) -> Self {
        let mut process = Command::new("node")
            .arg(root().join(FOLDER).join(script))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("node runs");
        let commands = process.stdin.take().expect("standard input is a pipe");
        let lines = BufReader::new(process.stdout.take().expect("standard output is a pipe"));
        let (sender, events) = channel();
        std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                let event = serde_json::from_str(&line).expect("the emulator speaks JSON");
                if sender.send(event).is_err() {
                    break;
                }
            }
        });
        Self { process, commands, events }
    }

    /// Sends a command; the script lists them.
    pub fn command(&mut self, command: &Value) {
        writeln!(self.commands, "{command}").expect("the emulator runs");
    }

    /// The next event.
    pub fn next_event(&mut self) -> E {
        self.events.recv_timeout(PATIENCE).expect("the emulator goes on")
    }

    /// Whether the emulator exits within a second; its sockets are closed before that.
    pub fn is_over(&mut self) -> bool {
        let looks = std::iter::repeat_with(|| {
            std::thread::sleep(LOOK_EVERY);
            matches!(self.process.try_wait(), Ok(Some(_)))
        });
        looks.take(LOOKS).any(|is_over| is_over)
    }
}

/// Kills the emulator.
impl<E> Drop for Emulation<E> {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
