//! Films at their own pace as live sources, with the real ffmpeg: through a named pipe, a loopback UDP stream and an RTSP connection.
//!
//! Skipped if ffmpeg or Python is absent (`tests/run` installs them). `cli/tests/live.rs` has the tests without them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

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
        an_rtsp_camera_is_received,
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

/// An RTSP camera of one client: MPEG-TS in RTP, interleaved with the requests' connection (RFC 2326, 10.12).
fn serve(listener: &TcpListener, film: &mut impl Read) -> std::io::Result<()> {
    let (client, _) = listener.accept()?;
    let (mut requests, mut client) = (BufReader::new(client.try_clone()?).lines(), client);
    let mut plays = false;
    while !plays {
        let request: Vec<String> = requests
            .by_ref()
            .map_while(Result::ok)
            .take_while(|line| !line.is_empty())
            .collect();
        let header = |name: &str| request.iter().find_map(|line| line.strip_prefix(name)).unwrap_or_default();
        let method = request.first().and_then(|line| line.split(' ').next()).unwrap_or_default();
        let sdp = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=film\r\nt=0 0\r\nm=video 0 RTP/AVP 33\r\na=control:track\r\n";
        let answer = match method {
            "OPTIONS" => "Public: DESCRIBE, SETUP, PLAY, TEARDOWN\r\n\r\n".to_owned(),
            "DESCRIBE" => format!("Content-Type: application/sdp\r\nContent-Length: {}\r\n\r\n{sdp}", sdp.len()),
            "SETUP" => "Transport: RTP/AVP/TCP;unicast;interleaved=0-1\r\nSession: 1\r\n\r\n".to_owned(),
            "PLAY" => "Session: 1\r\n\r\n".to_owned(),
            other => return Err(std::io::Error::other(format!("{other:?} is not a request of a player"))),
        };
        write!(client, "RTSP/1.0 200 OK\r\nCSeq: {}\r\n{answer}", header("CSeq: "))?;
        plays = method == "PLAY";
    }
    let begun = Instant::now();
    let mut packets = [0; 7 * 188];
    for sequence in (0..=u16::MAX).cycle() {
        film.read_exact(&mut packets)?;
        let time = (begun.elapsed().as_secs_f64() * 90_000.0) as u32;
        let length = (12 + packets.len()) as u16;
        let rtp = [&[0x80, 33][..], &sequence.to_be_bytes(), &time.to_be_bytes(), b"film", &packets].concat();
        client.write_all(&[b"$\0", &length.to_be_bytes()[..], &rtp].concat())?;
    }
    Ok(())
}

fn an_rtsp_camera_is_received(ready: &Ready) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("rtsp://{}/live", listener.local_addr().expect("a port"));
    let mut receive = ready.receive(&["--live", &address, "--json"]);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-nostdin", "-loglevel", "quiet", "-re", "-stream_loop", "-1", "-i", "film.ts"]);
    let mut camera = ready.run(ffmpeg.args(["-c", "copy", "-f", "mpegts", "-"]).stdout(Stdio::piped()));
    let mut film = camera.child.stdout.take().expect("an output");
    // Ends with the receiver, or with the film.
    let served = std::thread::spawn(move || serve(&listener, &mut film));
    let mut lines = receive.lines();
    let is_there = lines.any(|line| json(&line)["message"] == MESSAGE);
    assert!(is_there, "{:?}", served.is_finished().then(|| served.join()));
    assert!(output(Command::new("kill").args(["-INT", &receive.child.id().to_string()])).is_ok());
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
