//! A line to a simulated transmitter that may damage what it answers.

use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use serialport::{SerialPort, TTYPort};
use vocc_tests::simulated_board::SimulatedBoard;

use crate::damage::damaged;

/// Between two looks at each end of the line.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// A line to a transmitter, which damages some of its answers if `random` is given.
pub fn line(board: &SimulatedBoard, random: Option<ChaCha8Rng>) -> Line {
    let (mut near, slave) = TTYPort::pair().expect("a pseudo-terminal");
    let port = slave.name().expect("a name");
    let far = serialport::new(board.port(), 115_200).timeout(LOOK_EVERY).open_native();
    let mut far = far.expect("the board's port");
    far.clear(serialport::ClearBuffer::All).expect("cleared");
    near.set_timeout(LOOK_EVERY).expect("set");
    let is_over = Arc::new(AtomicBool::new(false));
    let over = Arc::clone(&is_over);
    let carrying = std::thread::spawn(move || {
        // Held open, so that the end of one user is not the line's.
        let _slave = slave;
        let mut random = random;
        let mut bytes = [0; 4096];
        while !over.load(Ordering::Relaxed) {
            if let Ok(read) = near.read(&mut bytes) {
                let _ = far.write_all(&bytes[..read]);
            }
            if let Ok(read) = far.read(&mut bytes) {
                let answer = match &mut random {
                    Some(random) => damaged(&bytes[..read], random),
                    None => bytes[..read].to_vec(),
                };
                let _ = near.write_all(&answer);
            }
        }
    });
    Line {
        port,
        is_over,
        carrying: Some(carrying),
    }
}

/// The line to the transmitter while it is held.
pub struct Line {
    /// The near end's name.
    pub port: String,
    is_over: Arc<AtomicBool>,
    carrying: Option<JoinHandle<()>>,
}

impl Drop for Line {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(carrying) = self.carrying.take() {
            let _ = carrying.join();
        }
    }
}
