//! A pseudo-terminal for UART 0 of an emulated board.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

/// Interval at which each direction checks whether the other has closed.
const TURN: Duration = Duration::from_millis(50);

/// A terminal that programs can open by name while this lives.
pub struct Terminal {
    name: String,
    socket: UnixStream,
    open: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
    _held: File,
}

impl Terminal {
    /// Opens a terminal for the board that listens at `socket`.
    pub fn open(socket: &Path) -> Self {
        let (inherited, slave) = TTYPort::pair().expect("the system has pseudo-terminals");
        // Started programs do not inherit a copy. With the terminal's master open, no program would notice that the board is gone.
        let mut master = inherited.try_clone_native().expect("the terminal can be shared");
        drop(inherited);
        master.set_timeout(TURN).expect("any time-out will do");
        let socket = UnixStream::connect(socket).expect("the emulator listens");
        let name = slave.name().expect("it has a name");
        // An open handle avoids errors of the terminal; opened as a serial port it would be locked.
        let held = File::open(&name).expect("it can be opened");
        drop(slave);
        let (mut to_board, mut from_board) = (clone(&socket), clone(&socket));
        let mut screen = master.try_clone_native().expect("the terminal can be shared");
        let open = Arc::new(AtomicBool::new(true));
        let [here, there] = [open.clone(), open.clone()];
        let threads = vec![
            std::thread::spawn(move || while pass_on(&mut master, &mut to_board, &here) {}),
            // Programs with an open terminal notice that the board disappears, as if an adapter were unplugged.
            std::thread::spawn(move || {
                while pass_on(&mut from_board, &mut screen, &there) {}
                there.store(false, Ordering::Relaxed);
            }),
        ];
        Self {
            name,
            socket,
            open,
            threads,
            _held: held,
        }
    }

    /// The path to open as a serial port.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.open.store(false, Ordering::Relaxed);
        let _ = self.socket.shutdown(Shutdown::Both);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn clone(socket: &UnixStream) -> UnixStream {
    socket.set_read_timeout(Some(TURN)).expect("any time-out will do");
    socket.try_clone().expect("the socket can be shared")
}

/// Forwards bytes; returns whether more may follow.
fn pass_on(from: &mut impl Read, to: &mut impl Write, open: &AtomicBool) -> bool {
    let mut bytes = [0; 256];
    match from.read(&mut bytes) {
        Ok(0) => false,
        Ok(count) => to.write_all(&bytes[..count]).is_ok(),
        Err(error) => {
            let again = [ErrorKind::TimedOut, ErrorKind::WouldBlock, ErrorKind::Interrupted];
            open.load(Ordering::Relaxed) && again.contains(&error.kind())
        }
    }
}
