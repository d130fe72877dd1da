//! What can go wrong around a program.

use std::fmt;
use std::process::Command;
use std::time::Duration;

use rand::{Rng, RngExt};

/// Something that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// No file may grow beyond so many bytes.
    FileLimit(u64),
    /// The address space ends after so many bytes.
    AddressSpace(u64),
    /// What is printed finds a full disk.
    FullOutput,
    /// Nobody reads what is printed.
    ClosedOutput,
    /// What is to be written goes to a device that is full.
    FullDevice,
    /// What is to be written goes to a place where nobody may.
    ReadOnlyPlace,
    /// Such an input is a pipe that nobody writes to; Ctrl-C follows.
    SilentInput(usize),
    /// A signal after some time.
    Signal(Signal, Duration),
}

/// Signals by which programs are ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Ctrl-C.
    Interrupt,
    /// A request to end.
    Terminate,
    /// The end.
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
        // The process may have ended by now.
        let _ = Command::new("kill")
            .args([number, process.to_string()])
            .stderr(std::process::Stdio::null())
            .status();
    }
}

impl Fault {
    /// One of all that can go wrong with work that takes some time and writes at most so many bytes into a file.
    pub fn draw(random: &mut impl Rng, time: Duration, bytes: u64, inputs: usize) -> Self {
        let signal = [Signal::Interrupt, Signal::Terminate, Signal::Kill][random.random_range(0..3usize)];
        match random.random_range(0..10u32) {
            // The last bytes are where buffers hide errors.
            0 => Self::FileLimit(bytes.saturating_sub(random.random_range(1..64))),
            1 => Self::FileLimit(random.random_range(0..=bytes)),
            // In less the system neither loads the program nor lets its stack grow.
            2 => Self::AddressSpace(random.random_range(32..600) << 20),
            3 => Self::FullOutput,
            4 => Self::ClosedOutput,
            5 => Self::FullDevice,
            6 => Self::ReadOnlyPlace,
            7 if inputs > 0 => Self::SilentInput(random.random_range(0..inputs)),
            _ => Self::Signal(signal, time.mul_f64(random.random_range(0.0..1.2))),
        }
    }

    /// The command under this fault, as far as it is one of its limits.
    pub fn limiting(self, program: &std::path::Path) -> Command {
        let limit = match self {
            Self::FileLimit(bytes) => format!("--fsize={bytes}"),
            Self::AddressSpace(bytes) => format!("--as={bytes}"),
            _ => return Command::new(program),
        };
        let mut command = Command::new("sh");
        // A write beyond the limit is then an error, as it is on a full disk, and not the end.
        command.args(["-c", "trap '' XFSZ; exec prlimit \"$@\"", "sh", &limit]).arg(program);
        command
    }

    /// The words of which one is to be in the message.
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
            Self::FullDevice => write!(to, "files on a full device"),
            Self::ReadOnlyPlace => write!(to, "files in a place where nobody may write"),
            Self::SilentInput(input) => write!(to, "input {input} a pipe that never answers"),
            Self::Signal(signal, after) => write!(to, "{signal:?} after {after:.3?}"),
        }
    }
}
