//! The PIN of a locked transmitter: its source, and the key derived from it.

use std::fmt;
use std::io::{BufRead, IsTerminal, Read, Write};
use std::path::{Path, PathBuf};

use argon2::{Algorithm, Argon2, Params, Version};
use link::signing::SecretKey;
use reception::keys;

/// Bytes of a PIN.
const LENGTH: std::ops::RangeInclusive<usize> = 6..=128;
/// Argon2id's memory in KiB, passes and lanes: the second recommended choice of RFC 9106.
const COST: (u32, u32, u32) = (64 * 1024, 3, 4);

/// Why there is no PIN.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PinError {
    #[error("cannot read the PIN from {}: {why}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's error.
        why: String,
    },
    #[error("{} can be read by other users: `chmod 600` it, and if they may have read it, change the PIN", .0.display())]
    Open(PathBuf),
    #[error("the PIN has {} bytes: give {} to {}, in the first line", .0, LENGTH.start(), LENGTH.end())]
    Length(usize),
    #[error("the PIN is needed, and there is no terminal to ask for it: give --pin-file FILE, or --pin-file - for standard input")]
    NoTerminal,
    #[error("the two PINs differ, and nothing was changed: type the same one twice")]
    Differ,
    #[error("cannot derive a key from the PIN: {0}")]
    Derive(String),
}

/// A PIN. It is not printed.
#[derive(Clone, PartialEq)]
pub struct Pin(Vec<u8>);

impl fmt::Debug for Pin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Pin")
    }
}

impl Pin {
    fn new(line: &[u8]) -> Result<Self, PinError> {
        let line = line.strip_suffix(b"\n").unwrap_or(line);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if LENGTH.contains(&line.len()) {
            Ok(Self(line.into()))
        } else {
            Err(PinError::Length(line.len()))
        }
    }

    /// The first line of a file, or of standard input if it is `-`.
    pub fn read(path: &Path) -> Result<Self, PinError> {
        let unreadable = |error: std::io::Error| PinError::Unreadable {
            path: path.into(),
            why: error.to_string(),
        };
        // A longer one is refused.
        let most = *LENGTH.end() as u64 + 3;
        let mut line = Vec::new();
        if path == Path::new("-") {
            std::io::stdin()
                .lock()
                .take(most)
                .read_until(b'\n', &mut line)
                .map_err(unreadable)?;
        } else {
            let file = std::fs::File::open(path).map_err(unreadable)?;
            if file.metadata().is_ok_and(|metadata| metadata.is_file()) && keys::is_open(path) {
                return Err(PinError::Open(path.into()));
            }
            std::io::BufReader::new(file.take(most))
                .read_until(b'\n', &mut line)
                .map_err(unreadable)?;
        }
        Self::new(&line)
    }

    /// Asks for a PIN at the terminal, which does not show it.
    pub fn ask(question: &str) -> Result<Self, PinError> {
        if !std::io::stdin().is_terminal() {
            return Err(PinError::NoTerminal);
        }
        let _ = write!(std::io::stderr(), "{question}: ");
        let mut line = Vec::new();
        let hidden = HiddenEcho::new();
        let read = std::io::stdin().lock().read_until(b'\n', &mut line);
        drop(hidden);
        let _ = writeln!(std::io::stderr());
        read.map_err(|_| PinError::NoTerminal)?;
        Self::new(&line)
    }

    /// Asks for a new PIN, twice.
    pub fn ask_new() -> Result<Self, PinError> {
        let first = Self::ask("new PIN")?;
        if Self::ask("the new PIN again")? == first {
            Ok(first)
        } else {
            Err(PinError::Differ)
        }
    }

    /// The private key of a lock with this salt.
    pub fn key(&self, salt: u64) -> Result<SecretKey, PinError> {
        let failed = |error: &dyn fmt::Display| PinError::Derive(error.to_string());
        let (memory, passes, lanes) = COST;
        let params = Params::new(memory, passes, lanes, Some(32)).map_err(|error| failed(&error))?;
        let mut seed = [0; 32];
        Argon2::new(Algorithm::Argon2id, Version::V0x13, params)
            .hash_password_into(&self.0, &salt.to_le_bytes(), &mut seed)
            .map_err(|error| failed(&error))?;
        SecretKey::from_seed(seed).map_err(|error| failed(&error))
    }
}

/// Hides what is typed until it is dropped.
struct HiddenEcho {
    #[cfg(unix)]
    before: Option<rustix::termios::Termios>,
}

impl HiddenEcho {
    #[cfg(unix)]
    fn new() -> Self {
        use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};
        let terminal = std::io::stdin();
        let before = tcgetattr(&terminal).ok();
        if let Some(mut line) = before.clone() {
            line.local_modes.remove(LocalModes::ECHO);
            let _ = tcsetattr(&terminal, OptionalActions::Flush, &line);
        }
        Self { before }
    }

    #[cfg(not(unix))]
    fn new() -> Self {
        Self {}
    }
}

impl Drop for HiddenEcho {
    fn drop(&mut self) {
        #[cfg(unix)]
        if let Some(before) = &self.before {
            let _ = rustix::termios::tcsetattr(std::io::stdin(), rustix::termios::OptionalActions::Now, before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_is_the_first_line_without_its_end() {
        for line in ["123456", "123456\n", "123456\r\n"] {
            assert_eq!(Pin::new(line.as_bytes()), Ok(Pin(b"123456".into())));
        }
        assert_eq!(Pin::new(b"12345\n"), Err(PinError::Length(5)));
        assert_eq!(Pin::new(&[b'1'; 129]), Err(PinError::Length(129)));
        assert!(!format!("{:?}", Pin(b"123456".into())).contains('1'));
    }

    /// Computed by the reference implementation: `argon2.low_level.hash_secret_raw(b"123456", b"saltsalt", 3, 65536, 4, 32, Type.ID)` in
    /// Python's argon2-cffi.
    #[test]
    fn a_key_is_that_of_the_reference_implementation_and_of_one_salt() {
        let pin = Pin(b"123456".into());
        let salt = u64::from_le_bytes(*b"saltsalt");
        let seed = pin.key(salt).unwrap().to_bytes();
        let digits: String = seed[..32].iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(digits, "79abb1cfa004546f5d38b51056e7eb376fa5714801d09ed4306a735b6db4e7df");
        assert_ne!(pin.key(salt + 1).unwrap().to_bytes(), seed);
    }
}
