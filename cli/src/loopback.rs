//! Common parts of servers on the loopback interface.

use std::io::ErrorKind;
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

/// Wait after a connection that could not be accepted, for example because there are too many open files.
const RETRY_AFTER: Duration = Duration::from_millis(50);

/// The incoming connections, without end.
pub fn connections(listener: &TcpListener) -> impl Iterator<Item = TcpStream> + '_ {
    std::iter::repeat_with(|| listener.accept()).filter_map(|accepted| match accepted {
        Ok((stream, _)) => Some(stream),
        Err(_) => {
            std::thread::sleep(RETRY_AFTER);
            None
        }
    })
}

/// Whether a peer has sent nothing yet. A program that was stopped and continues is interrupted while it waits.
pub fn is_silence(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
