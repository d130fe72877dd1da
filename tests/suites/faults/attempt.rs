//! One run of a command with something going wrong, and what came of it.

use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};

use crate::commands::Work;
use crate::fault::{Fault, Signal};
use crate::workshop::{PIPE, Workshop};

/// After this time a command is taken to run for ever.
const FOR_EVER: Duration = Duration::from_secs(120);
/// When Ctrl-C follows an input that does not answer.
const SILENCE: Duration = Duration::from_millis(300);
/// Where nobody may write, whoever he is.
const READ_ONLY: &str = "/sys";

/// How a command ended.
pub struct Outcome {
    /// With what status, or by which signal.
    pub status: ExitStatus,
    /// What it said on standard error.
    pub errors: String,
    /// Whether it said something on standard output; none where nobody looked.
    pub has_printed: Option<bool>,
    /// How long it took.
    pub time: Duration,
    /// How long it took after the signal, if it got one.
    pub after_signal: Option<Duration>,
}

/// What a run needs beside the command.
struct Surroundings {
    arguments: Vec<String>,
    /// Kept open while it runs.
    port: Option<(TTYPort, TTYPort)>,
}

/// Runs a command in a folder, to its end.
pub fn run(workshop: &Workshop, work: &Work, fault: Option<Fault>, resume: bool, folder: &Path) -> Outcome {
    let surroundings = surroundings(work, fault, resume, folder);
    let mut command = match fault {
        Some(fault) => fault.limiting(workshop.vocc()),
        None => Command::new(workshop.vocc()),
    };
    command.args(work.command.split_whitespace());
    command.args(&surroundings.arguments).current_dir(folder);
    command.stdin(input(work, folder)).stderr(Stdio::piped());
    let is_looked_at = fault.is_none();
    command.stdout(match fault {
        Some(Fault::FullOutput) => device("/dev/full"),
        Some(Fault::ClosedOutput) | None => Stdio::piped(),
        _ => Stdio::null(),
    });
    let begun = Instant::now();
    let mut child = command.spawn().expect("it runs");
    let output = child.stdout.take();
    let printed = output.filter(|_| is_looked_at).map(|mut output| {
        std::thread::spawn(move || {
            let mut text = Vec::new();
            output.read_to_end(&mut text).is_ok() && !text.is_empty()
        })
    });
    let errors = read(child.stderr.take());
    let signal = match fault {
        Some(Fault::Signal(signal, after)) => Some((signal, after)),
        Some(Fault::SilentInput(_)) => Some((Signal::Interrupt, SILENCE)),
        _ => None,
    };
    let Some((status, after_signal)) = end(&mut child, begun, signal) else {
        panic!("{} with {fault:?} does not end", work.command);
    };
    drop(surroundings.port);
    Outcome {
        status,
        errors: errors.join().expect("text"),
        has_printed: printed.map(|printed| printed.join().expect("text")),
        time: begun.elapsed(),
        after_signal,
    }
}

/// Waits for the end, and sends a signal before it; none where it does not come.
fn end(child: &mut Child, begun: Instant, signal: Option<(Signal, Duration)>) -> Option<(ExitStatus, Option<Duration>)> {
    let mut sent = None;
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return Some((status, sent.map(|sent: Instant| sent.elapsed())));
        }
        match signal {
            Some((signal, after)) if sent.is_none() && begun.elapsed() >= after => {
                signal.send(child.id());
                sent = Some(Instant::now());
            }
            _ => {}
        }
        if begun.elapsed() > FOR_EVER {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn read(errors: Option<ChildStderr>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut errors) = errors {
            let _ = errors.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

fn input(work: &Work, folder: &Path) -> Stdio {
    match work.input {
        Some(name) => std::fs::File::open(folder.join(name)).expect("an input").into(),
        None => Stdio::null(),
    }
}

fn device(path: &str) -> Stdio {
    std::fs::File::options().write(true).open(path).expect("a device").into()
}

fn surroundings(work: &Work, fault: Option<Fault>, resume: bool, folder: &Path) -> Surroundings {
    let mut port = None;
    let mut inputs = 0;
    let mut arguments: Vec<String> = Vec::new();
    for text in work.arguments() {
        arguments.push(match text.split_at(1) {
            ("@", name) => place(name, fault),
            ("<", name) => {
                let is_silent = fault == Some(Fault::SilentInput(inputs));
                inputs += 1;
                if is_silent { pipe(folder) } else { name.into() }
            }
            ("%", _) => {
                let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
                let name = slave.name().expect("a name");
                port = Some((master, slave));
                name
            }
            _ => text.to_string(),
        });
    }
    arguments.extend(resume.then(|| "--resume".into()));
    Surroundings { arguments, port }
}

fn place(name: &str, fault: Option<Fault>) -> String {
    match fault {
        Some(Fault::ReadOnlyPlace) => format!("{READ_ONLY}/{name}"),
        Some(Fault::FullDevice) if !name.ends_with('/') => "/dev/full".into(),
        _ => name.into(),
    }
}

/// A pipe that nobody writes to.
fn pipe(folder: &Path) -> String {
    let made = Command::new("mkfifo").arg(folder.join(PIPE)).status();
    assert!(made.is_ok_and(|status| status.success()), "a pipe");
    PIPE.into()
}

impl Outcome {
    /// The signal that it died of.
    pub fn signal(&self) -> Option<i32> {
        self.status.signal()
    }
}
