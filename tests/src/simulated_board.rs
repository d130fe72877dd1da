//! A simulated transmitter that runs beside a test.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};

/// The transmitter, until it is dropped.
pub struct SimulatedBoard {
    run: Child,
    port: String,
    /// It ends with its input.
    _input: Option<ChildStdin>,
}

impl SimulatedBoard {
    /// Starts it.
    ///
    /// # Panics
    /// If the program does not run, or names no port.
    pub fn start(vocc: &Path) -> Self {
        let mut run = Command::new(vocc)
            .args(["device", "simulate"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("vocc runs");
        let mut port = String::new();
        let output = run.stdout.take().expect("a pipe");
        BufReader::new(output).read_line(&mut port).expect("a port");
        let input = run.stdin.take();
        Self {
            run,
            port: port.trim().into(),
            _input: input,
        }
    }

    /// Its serial port's name.
    pub fn port(&self) -> &str {
        &self.port
    }
}

impl Drop for SimulatedBoard {
    fn drop(&mut self) {
        let _ = self.run.kill();
        let _ = self.run.wait();
    }
}
