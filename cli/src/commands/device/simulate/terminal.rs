//! A serial port without hardware: a pseudo-terminal with the board at one end.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, ioctl_tiocnxcl, tcgetattr, tcsetattr};

/// The board's end.
pub struct Terminal {
    board: File,
    /// The computer's end. It is also open here, because otherwise the board would see a hangup while no computer has it open.
    computer: File,
    name: String,
}

impl Terminal {
    pub fn open() -> anyhow::Result<Self> {
        Self::opened().context("cannot open a pseudo-terminal")
    }

    fn opened() -> anyhow::Result<Self> {
        let board = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&board)?;
        unlockpt(&board)?;
        let name = ptsname(&board, Vec::new())?.into_string()?;
        let computer = File::options().read(true).write(true).open(&name)?;
        let mut line = tcgetattr(&computer)?;
        line.make_raw();
        tcsetattr(&computer, OptionalActions::Now, &line)?;
        // Writes must not block if nobody reads the answers.
        rustix::io::ioctl_fionbio(&board, true)?;
        Ok(Self {
            board: board.into(),
            computer,
            name,
        })
    }

    /// The port's name, for --port.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The received bytes; empty if none arrive within `patience`.
    pub fn read<'a>(&mut self, patience: Duration, bytes: &'a mut [u8]) -> anyhow::Result<&'a [u8]> {
        let patience = Timespec::try_from(patience)?;
        let mut waited = [PollFd::new(&self.board, PollFlags::IN)];
        match poll(&mut waited, Some(&patience)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        match self.board.read(bytes) {
            Ok(length) => {
                // A program with exclusive access may have ended; without this, others would be rejected from then on.
                ioctl_tiocnxcl(&self.computer)?;
                Ok(&bytes[..length])
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(&[]),
            Err(error) => Err(error).context("the pseudo-terminal failed"),
        }
    }

    /// Sends bytes; those that do not fit into the buffer are lost, as on a wire.
    pub fn write(&mut self, bytes: &[u8]) {
        let _ = self.board.write_all(bytes);
    }
}

/// The user's name for the port, removed at the end.
pub struct Link {
    path: PathBuf,
    to: PathBuf,
}

impl Link {
    /// Makes `path` a link to the port `to`. Replaces a link that an ended board has left.
    ///
    /// # Errors
    /// If something else exists at `path`.
    pub fn new(path: &Path, to: &str) -> anyhow::Result<Self> {
        if path.is_symlink() && !path.exists() {
            std::fs::remove_file(path).with_context(|| format!("cannot replace the link {}", path.display()))?;
        }
        match std::os::unix::fs::symlink(to, path) {
            Ok(()) => Ok(Self {
                path: path.into(),
                to: to.into(),
            }),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                bail!("{} exists: remove it, or give the link another name", path.display())
            }
            Err(error) => Err(error).with_context(|| format!("cannot make the link {}", path.display())),
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        if std::fs::read_link(&self.path).is_ok_and(|to| to == self.to) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
