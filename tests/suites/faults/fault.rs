//! Faults in a program's environment.

use std::fmt;
use std::process::Command;
use std::time::Duration;

use rand::{Rng, RngExt};

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Maximum file size in bytes.
    FileLimit(u64),
    /// Maximum address space in bytes.
    AddressSpace(u64),
    /// Standard output is a full disk.
    FullOutput,
    /// Standard output has no reader.
    ClosedOutput,
    /// Standard output has a reader up to the end of the first line.
    OneLineRead,
    /// Output files are a full device.
    FullDevice,
    /// Output files are in a read-only folder.
    ReadOnlyPlace,
    /// The input of this index is a pipe without a writer; Ctrl-C follows.
    SilentInput(usize),
    /// A signal after a delay.
    Signal(Signal, Duration),
    /// Standard error is a full pipe that nobody reads; a signal follows.
    UnreadErrors(Signal, Duration),
}

/// Signals that end programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Ctrl-C (SIGINT).
    Interrupt,
    /// SIGTERM.
    Terminate,
    /// SIGKILL.
    Kill,
}

impl Signal {
    /// Its number.
    pub fn number(self) -> i32 {
        match self {
            Self::Interrupt => 2,
            Self::Terminate => 15,
            Self::Kill => 9,
        }
    }

    /// Sends it.
    pub fn send(self, process: u32) {
        let number = format!("-{}", self.number());
        // The process may have exited.
        let _ = Command::new("kill")
            .args([number, process.to_string()])
            .stderr(std::process::Stdio::null())
            .status();
    }
}

impl Fault {
    /// A random fault for work of this duration that writes files of up to `bytes`.
    pub fn draw(random: &mut impl Rng, time: Duration, bytes: u64, inputs: usize) -> Self {
        let signal = [Signal::Interrupt, Signal::Terminate, Signal::Kill][random.random_range(0..3usize)];
        match random.random_range(0..10u32) {
            // Buffers hide write errors of the last bytes.
            0 => Self::FileLimit(bytes.saturating_sub(random.random_range(1..64))),
            1 => Self::FileLimit(random.random_range(0..=bytes)),
            // With less, the program does not load or its stack cannot grow.
            2 => Self::AddressSpace(random.random_range(32..600) << 20),
            3 => Self::FullOutput,
            4 => Self::ClosedOutput,
            5 => Self::FullDevice,
            6 => Self::ReadOnlyPlace,
            7 if inputs > 0 => Self::SilentInput(random.random_range(0..inputs)),
            _ => Self::Signal(signal, time.mul_f64(random.random_range(0.0..1.2))),
        }
    }

    /// The command under this fault's resource limit, if it is one.
    pub fn limiting(self, program: &std::path::Path) -> Command {
        let limit = match self {
            Self::FileLimit(bytes) => format!("--fsize={bytes}"),
            Self::AddressSpace(bytes) => format!("--as={bytes}"),
            _ => return Command::new(program),
        };
        let mut command = Command::new("sh");
        // With SIGXFSZ ignored, a write beyond the limit fails as on a full disk.
        command.args(["-c", "trap '' XFSZ; exec prlimit \"$@\"", "sh", &limit]).arg(program);
        command
    }

    /// Words of which the message must contain one.
    pub fn causes(self) -> &'static [&'static str] {
        match self {
            Self::FileLimit(_) => &["File too large"],
            Self::FullOutput | Self::FullDevice => &["No space left on device"],
            Self::AddressSpace(_) => &["memory", "Resource temporarily unavailable", "too large", "thread", "allocat"],
            Self::ReadOnlyPlace => &["Permission denied", "not permitted", "Read-only file system", "No such file"],
            _ => &[],
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FileLimit(bytes) => write!(to, "disk full after {bytes} bytes of a file"),
            Self::AddressSpace(bytes) => write!(to, "{} MiB of address space", bytes >> 20),
            Self::FullOutput => write!(to, "output to a full disk"),
            Self::ClosedOutput => write!(to, "output closed"),
            Self::OneLineRead => write!(to, "output closed after a line"),
            Self::FullDevice => write!(to, "files on a full device"),
            Self::ReadOnlyPlace => write!(to, "files in a place where nobody may write"),
            Self::SilentInput(input) => write!(to, "input {input} a pipe that never answers"),
            Self::Signal(signal, after) => write!(to, "{signal:?} after {after:.3?}"),
            Self::UnreadErrors(signal, after) => write!(to, "errors that nobody reads, {signal:?} after {after:.3?}"),
        }
    }
}
