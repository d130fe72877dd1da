//! Films at their own pace as live sources: through a named pipe and a loopback UDP stream, with the real ffmpeg.
//!
//! Skipped if ffmpeg or Python is absent (`tests/run` installs them). `cli/tests/live.rs` has the tests without them.

use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;
use vocc_tests::programs::{self, output, root};
use vocc_tests::tests;
use vocc_tests::trials::{self, Unready};

const MESSAGE: &str = "bend ahead";
const FRAMES: u64 = 96;
/// Time for a process that takes seconds; a named pipe without a peer blocks without end.
const PATIENCE: Duration = Duration::from_secs(180);

/// `vocc`, and a film of a link at 100 frames per second.
struct Ready {
    vocc: PathBuf,
    folder: TempDir,
}

type Test = fn(&Ready);

fn main() -> ExitCode {
    let tests = tests![
        all_frames_of_a_named_pipe_are_received,
        a_loopback_stream_is_received_until_ctrl_c,
        the_reader_in_the_documentation_has_each_message_at_once,
    ];
    trials::run("live", None, tests, provide)
}

fn provide() -> Result<Ready, Unready> {
    programs::provide("ffmpeg")?;
    programs::provide("python3")?;
    let vocc = programs::vocc()?;
    let folder = tempfile::tempdir()?;
    let frames = folder.path().join("frames");
    output(&mut programs::link(&vocc, &frames, MESSAGE, FRAMES))?;
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-loglevel", "error", "-framerate", "100", "-i"]);
    ffmpeg.arg(frames.join("frame-%06d.png"));
    ffmpeg.args(["-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-g", "10", "-bf", "0"]);
    output(ffmpeg.arg(folder.path().join("film.ts")))?;
    Ok(Ready { vocc, folder })
}

impl Ready {
    /// Plays the film at its own pace, `times` times more; -1 loops forever.
    fn play(&self, times: &str, to: &str) -> ChildGuard {
        let mut ffmpeg = Command::new("ffmpeg");
        ffmpeg.args(["-nostdin", "-loglevel", "error", "-re", "-stream_loop", times, "-i", "film.ts"]);
        self.run(ffmpeg.args(["-c", "copy", "-f", "mpegts", "-y", to]))
    }

    fn receive(&self, arguments: &[&str]) -> ChildGuard {
        let mut receive = Command::new(&self.vocc);
        self.run(receive.arg("receive").args(arguments).stdout(Stdio::piped()))
    }

    fn run(&self, command: &mut Command) -> ChildGuard {
        ChildGuard::of(command.current_dir(self.folder.path()).spawn().expect("it runs"))
    }

    fn pipe(&self, name: &str) {
        if let Err(error) = output(Command::new("mkfifo").arg(self.folder.path().join(name))) {
            panic!("{error}");
        }
    }
}

/// A child process that is killed with the test, or when its time is up.
struct ChildGuard {
    child: Child,
    _alive: Sender<()>,
}

impl ChildGuard {
    fn of(child: Child) -> Self {
        let (alive, ended) = channel();
        let process = child.id().to_string();
        std::thread::spawn(move || {
            if ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                eprintln!("process {process} is killed: it has run for {PATIENCE:?}");
                let _ = Command::new("kill").args(["-KILL", &process]).status();
            }
        });
        Self { child, _alive: alive }
    }

    fn lines(&mut self) -> impl Iterator<Item = String> + use<> {
        let lines = BufReader::new(self.child.stdout.take().expect("an output")).lines();
        lines.map(|line| line.expect("text"))
    }
}

impl Drop for ChildGuard {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn json(line: &str) -> Value {
    serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))
}

/// Prints the latency's stages from the last line.
fn print(last: &Value) {
    assert!(
        last["latency"]["to_text"]["median_s"]
            .as_f64()
            .is_some_and(|median_s| median_s > 0.0),
        "{last}"
    );
    eprintln!("{last}");
}

fn all_frames_of_a_named_pipe_are_received(ready: &Ready) {
    ready.pipe("camera.ts");
    let mut receive = ready.receive(&["camera.ts", "--json"]);
    let _camera = ready.play("0", "camera.ts");
    let lines: Vec<Value> = receive.lines().map(|line| json(&line)).collect();
    assert!(receive.child.wait().expect("an end").success());
    let message = lines.iter().find(|line| line["message"] == MESSAGE).expect("a message");
    assert!(message["latency_s"].is_number(), "{message}");
    let last = lines.last().expect("a line");
    assert_eq!((&last["frames"], &last["dropped"]), (&FRAMES.into(), &0.into()));
    print(last);
}

fn a_loopback_stream_is_received_until_ctrl_c(ready: &Ready) {
    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    let address = format!("udp://{}", free.expect("a port"));
    let mut receive = ready.receive(&["--live", &address, "--json"]);
    let _camera = ready.play("-1", &format!("{address}?pkt_size=1316"));
    let mut lines = receive.lines();
    let is_there = lines.any(|line| json(&line)["message"] == MESSAGE);
    assert!(is_there);
    let interrupted = output(Command::new("kill").args(["-INT", &receive.child.id().to_string()]));
    assert!(interrupted.is_ok());
    let last = lines.last().expect("a line");
    assert!(receive.child.wait().expect("an end").success());
    print(&json(&last));
}

fn the_reader_in_the_documentation_has_each_message_at_once(ready: &Ready) {
    let page = std::fs::read_to_string(root().join("docs/live.md")).expect("a page");
    let (_, reader) = page.split_once("```python\n").expect("a reader");
    let (reader, _) = reader.split_once("```").expect("its end");
    ready.pipe("camera.y4m");
    let mut receive = ready.receive(&["camera.y4m", "--json"]);
    let told = receive.child.stdout.take().expect("an output");
    let mut python = Command::new("python3");
    let mut python = ready.run(python.args(["-c", reader]).stdin(told).stdout(Stdio::piped()));
    std::fs::write(ready.folder.path().join("film.y4m"), y4m(ready.folder.path())).expect("a film");
    // Held open so that the stream does not end before the message is read.
    let mut camera = Command::new("sh");
    let _camera = ready.run(camera.args(["-c", "exec 3>camera.y4m; cat film.y4m >&3; exec sleep 600"]));
    let line = python.lines().next().expect("a line");
    let latency = line.strip_prefix(MESSAGE).map(|latency| latency.trim().parse::<f64>());
    assert!(matches!(latency, Some(Ok(_))), "{line}");
}

/// Decodes the film in a folder.
fn y4m(folder: &Path) -> Vec<u8> {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-loglevel", "error", "-i"]).arg(folder.join("film.ts"));
    let decoded = ffmpeg.args(["-f", "yuv4mpegpipe", "-"]).output().expect("ffmpeg runs");
    assert!(decoded.status.success());
    decoded.stdout
}
