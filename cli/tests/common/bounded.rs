//! Time limits, so that a fault fails a test instead of blocking it.

use std::fs::File;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

use rustix::fs::{OFlags, fcntl_setfl};

use super::ffmpeg::wait_for;

/// Time for a program that takes seconds.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// Kills a process that outlives the time limit, unless dropped before.
pub struct Watchdog {
    _alive: Sender<()>,
}

impl Watchdog {
    pub fn of(child: &Child) -> Self {
        Self::within(child, PATIENCE)
    }

    pub fn within(child: &Child, patience: Duration) -> Self {
        let (alive, ended) = channel::<()>();
        let process = child.id().to_string();
        std::thread::spawn(move || {
            if ended.recv_timeout(patience) == Err(RecvTimeoutError::Timeout) {
                eprintln!("process {process} is killed: it has run for {patience:?}");
                let _ = Command::new("kill").args(["-KILL", &process]).status();
            }
        });
        Self { _alive: alive }
    }
}

/// How a command ends, at the latest when its time is up.
pub fn run(command: &mut Command) -> Output {
    let child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let _watchdog = Watchdog::of(&child);
    child.wait_with_output().expect("an end")
}

/// Sends a signal, such as `-INT`, to a process.
pub fn signal(signal: &str, process: u32) {
    let kill = Command::new("kill").args([signal, &process.to_string()]).status();
    assert!(kill.expect("kill runs").success());
}

/// Makes a named pipe.
pub fn pipe(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status();
    assert!(made.expect("mkfifo runs").success());
}

/// Opens a named pipe for writing as soon as it has a reader.
pub fn writer(pipe: &Path) -> File {
    // Without this flag, the call blocks until a reader comes.
    let flags = OFlags::NONBLOCK.bits() as i32;
    let opened = wait_for(|| File::options().write(true).custom_flags(flags).open(pipe).ok());
    fcntl_setfl(&opened, OFlags::empty()).expect("a pipe that blocks when it is full");
    opened
}

#[test]
fn what_has_no_end_is_ended() {
    let mut endless = Command::new("sleep").arg("600").spawn().expect("it runs");
    let _watchdog = Watchdog::within(&endless, Duration::from_millis(10));
    assert!(!endless.wait().expect("an end").success());
}
