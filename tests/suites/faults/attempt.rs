//! A run of a command under a fault, and its outcome.

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};
use vocc_tests::programs::read_aside;
use vocc_tests::simulated_board::SimulatedBoard;

use crate::commands::Work;
use crate::fault::{Fault, Signal};
use crate::workshop::{PIPE, Workshop};

/// A command without processor time for so long is hung: on a busy machine a long run takes longer, but goes on.
const IDLE: Duration = Duration::from_secs(120);
/// A command that takes longer is hung, whatever it does.
const FOR_EVER: Duration = Duration::from_secs(1800);
/// Time between two looks at a command's processor time.
const LOOK: Duration = Duration::from_secs(1);
/// Delay of Ctrl-C after an input that does not answer.
const SILENCE: Duration = Duration::from_millis(300);
/// A folder that no user can write to.
const READ_ONLY: &str = "/sys";

/// Outcome of a command.
pub struct Outcome {
    /// Exit status or signal.
    pub status: ExitStatus,
    /// Standard error.
    pub errors: String,
    /// Whether it wrote to standard output; `None` if that was not captured.
    pub has_printed: Option<bool>,
    /// Run time.
    pub time: Duration,
    /// Time from the signal to the exit, if a signal was sent.
    pub after_signal: Option<Duration>,
}

/// Resources of a run besides the command.
struct Surroundings {
    arguments: Vec<String>,
    /// Held open during the run.
    port: Option<(TTYPort, TTYPort)>,
    /// The same.
    board: Option<SimulatedBoard>,
}

/// Runs a command in a folder until it exits.
pub fn run(workshop: &Workshop, work: &Work, fault: Option<Fault>, resume: bool, folder: &Path) -> Outcome {
    let surroundings = surroundings(workshop, work, fault, resume, folder);
    let mut command = match fault {
        Some(fault) => fault.limiting(workshop.vocc()),
        None => Command::new(workshop.vocc()),
    };
    command.args(work.command.split_whitespace());
    command.args(&surroundings.arguments).current_dir(folder);
    // Without memory, Rust's library waits without end for the lock that it holds while it prints a backtrace.
    command.env("RUST_BACKTRACE", "0");
    let full = matches!(fault, Some(Fault::UnreadErrors(..))).then(full_pipe);
    command.stdin(input(work, folder)).stderr(match &full {
        Some((_, full)) => full.try_clone().expect("a pipe").into(),
        None => Stdio::piped(),
    });
    let is_looked_at = fault.is_none();
    command.stdout(match fault {
        Some(Fault::FullOutput) => device("/dev/full"),
        Some(Fault::ClosedOutput | Fault::OneLineRead) | None => Stdio::piped(),
        _ => Stdio::null(),
    });
    let begun = Instant::now();
    let mut child = command.spawn().expect("it runs");
    let output = child.stdout.take();
    let output = match fault {
        Some(Fault::OneLineRead) => output.and_then(read_line_aside),
        _ => output,
    };
    let printed = output.filter(|_| is_looked_at).map(|mut output| {
        std::thread::spawn(move || {
            let mut text = Vec::new();
            output.read_to_end(&mut text).is_ok() && !text.is_empty()
        })
    });
    let errors = read_aside(child.stderr.take());
    let signal = match fault {
        Some(Fault::Signal(signal, after) | Fault::UnreadErrors(signal, after)) => Some((signal, after)),
        Some(Fault::SilentInput(_)) => Some((Signal::Interrupt, SILENCE)),
        _ => None,
    };
    let Some((status, after_signal)) = end(&mut child, begun, signal) else {
        panic!("{} with {fault:?} does not end", work.command);
    };
    drop((surroundings.port, surroundings.board));
    Outcome {
        status,
        errors: errors.join().expect("text"),
        has_printed: printed.map(|printed| printed.join().expect("text")),
        time: begun.elapsed(),
        after_signal,
    }
}

/// Reads the first line of an output, which then has no reader.
fn read_line_aside(output: ChildStdout) -> Option<ChildStdout> {
    std::thread::spawn(move || BufReader::new(output).read_line(&mut String::new()));
    None
}

/// Waits for the exit, and sends a signal before it; `None` if the command hangs.
fn end(child: &mut Child, begun: Instant, signal: Option<(Signal, Duration)>) -> Option<(ExitStatus, Option<Duration>)> {
    let mut sent = None;
    let (mut ticks, mut worked, mut looked) = (0, begun, begun);
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
        if looked.elapsed() > LOOK {
            looked = Instant::now();
            let now = processor_ticks(child.id());
            if now > ticks {
                (ticks, worked) = (now, looked);
            }
        }
        if worked.elapsed() > IDLE || begun.elapsed() > FOR_EVER {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Processor time of a running program in the kernel's ticks; 0 if it is gone.
fn processor_ticks(program: u32) -> u64 {
    let line = std::fs::read_to_string(format!("/proc/{program}/stat")).unwrap_or_default();
    // The name before may hold spaces. The user's and the system's time are the fields 14 and 15.
    let (_, fields) = line.rsplit_once(')').unwrap_or_default();
    fields
        .split_whitespace()
        .skip(11)
        .take(2)
        .filter_map(|ticks| ticks.parse::<u64>().ok())
        .sum()
}

/// Tests the count itself: it sees work.
pub fn sees_work() {
    let begun = Instant::now();
    while processor_ticks(std::process::id()) == 0 {
        assert!(begun.elapsed() < IDLE, "this loop is work");
    }
}

/// Standard input of a command.
pub fn input(work: &Work, folder: &Path) -> Stdio {
    match work.input {
        Some(name) => std::fs::File::open(folder.join(name)).expect("an input").into(),
        None => Stdio::null(),
    }
}

/// A pipe that is full as long as its reader is held.
fn full_pipe() -> (std::io::PipeReader, std::io::PipeWriter) {
    let (reader, mut writer) = std::io::pipe().expect("a pipe");
    let full = writer.try_clone().expect("a pipe");
    // More than a pipe takes: it waits for the reader's end.
    std::thread::spawn(move || writer.write_all(&[b'x'; 1 << 20]));
    // Until it is full.
    std::thread::sleep(Duration::from_millis(50));
    (reader, full)
}

fn device(path: &str) -> Stdio {
    std::fs::File::options().write(true).open(path).expect("a device").into()
}

fn surroundings(workshop: &Workshop, work: &Work, fault: Option<Fault>, resume: bool, folder: &Path) -> Surroundings {
    let (mut port, mut board) = (None, None);
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
            ("%", "board") => board.insert(SimulatedBoard::start(workshop.vocc())).port().into(),
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
    Surroundings { arguments, port, board }
}

fn place(name: &str, fault: Option<Fault>) -> String {
    match fault {
        Some(Fault::ReadOnlyPlace) => format!("{READ_ONLY}/{name}"),
        Some(Fault::FullDevice) if !name.ends_with('/') => "/dev/full".into(),
        _ => name.into(),
    }
}

/// A pipe without a writer.
fn pipe(folder: &Path) -> String {
    let made = Command::new("mkfifo").arg(folder.join(PIPE)).status();
    assert!(made.is_ok_and(|status| status.success()), "a pipe");
    PIPE.into()
}

impl Outcome {
    /// The signal that killed it.
    pub fn signal(&self) -> Option<i32> {
        self.status.signal()
    }
}
