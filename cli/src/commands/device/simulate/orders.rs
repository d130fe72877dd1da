//! Commands to the simulated board while it runs: lines on standard input.

use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::fstat;
use rustix::process::getpgrp;
use rustix::stdio::stdin;
use rustix::termios::{isatty, tcgetpgrp};
use sim::scene::ILLUMINANCE_LX;

use super::light_sensor::Health;

/// Interval between checks of a terminal that another program is using.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// Maximum length of a line in bytes.
const LINE_MAX: usize = 1024;
/// Maximum number of lines that wait for the board.
const LINES_MAX: usize = 64;

/// A command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Sets the light, in lx.
    Light(f64),
    /// Sets the state of the light sensor.
    Sensor(Health),
    /// Stops the symbols: the panel stays as it is, and the serial port answers.
    Halt,
    /// Cuts and restores the power.
    Restart,
}

/// The state of standard input.
#[derive(Debug, PartialEq, Eq)]
pub enum Input {
    Line(String),
    /// No input yet.
    Nothing,
    /// The end of the input.
    End,
}

impl std::str::FromStr for Order {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["light", lux] => illuminance(lux).map(Self::Light),
            ["sensor", "works"] => Ok(Self::Sensor(Health::Works)),
            ["sensor", "missing"] => Ok(Self::Sensor(Health::Missing)),
            ["sensor", "stuck"] => Ok(Self::Sensor(Health::Stuck)),
            ["halt"] => Ok(Self::Halt),
            ["restart"] => Ok(Self::Restart),
            _ => Err(format!(
                "{line:?} is not a command: give `light 5000` (lx), `sensor works`, `sensor missing`, `sensor stuck`, `halt` or `restart`"
            )),
        }
    }
}

/// Parses an illuminance within the allowed range.
pub fn illuminance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(lux) if ILLUMINANCE_LX.contains(&lux) => Ok(lux),
        _ => Err(format!(
            "{text:?} is not light: give {} to {} lx",
            ILLUMINANCE_LX.start(),
            ILLUMINANCE_LX.end()
        )),
    }
}

/// Listens to standard input.
pub struct Orders(Receiver<String>);

impl Orders {
    /// Starts to listen.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn listen() -> std::io::Result<Self> {
        // A sender that is faster than the board has to wait.
        let (sender, lines) = sync_channel(LINES_MAX);
        std::thread::Builder::new().spawn(move || {
            let mut read = Vec::new();
            let mut bytes = [0; LINE_MAX];
            while let Ok(length @ 1..) = wait_and_read(&mut bytes) {
                read.extend_from_slice(&bytes[..length]);
                while let Some(end) = read.iter().position(|&byte| byte == b'\n') {
                    let line: Vec<u8> = read.drain(..=end).collect();
                    if sender.send(text(&line)).is_err() {
                        return;
                    }
                }
                if read.len() > LINE_MAX {
                    let _ = sender.send(text(&std::mem::take(&mut read)));
                }
            }
            if !read.is_empty() {
                let _ = sender.send(text(&read));
            }
        })?;
        Ok(Self(lines))
    }

    /// The input since the last call.
    pub fn next(&self) -> Input {
        match self.0.try_recv() {
            Ok(line) => Input::Line(line),
            Err(TryRecvError::Empty) => Input::Nothing,
            Err(TryRecvError::Disconnected) => Input::End,
        }
    }
}

fn text(line: &[u8]) -> String {
    String::from_utf8_lossy(line).trim().to_owned()
}

/// The next bytes; none at the end of the input.
fn wait_and_read(bytes: &mut [u8]) -> std::io::Result<usize> {
    loop {
        // A shell gives its background jobs /dev/null, which must not count as the end, or its own terminal, which stops jobs that read
        // from it.
        while is_nothing() || is_of_others() {
            std::thread::sleep(LOOK_EVERY);
        }
        let input = stdin();
        let patience = Timespec::try_from(LOOK_EVERY).map_err(std::io::Error::other)?;
        let is_there = poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&patience));
        if !matches!(is_there, Ok(1..)) || is_of_others() {
            continue;
        }
        match std::io::stdin().read(bytes) {
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}

/// Whether standard input is /dev/null.
fn is_nothing() -> bool {
    match (fstat(stdin()), std::fs::metadata("/dev/null")) {
        (Ok(input), Ok(null)) => input.st_rdev == null.rdev(),
        _ => false,
    }
}

/// Whether standard input is a terminal that another program reads from.
fn is_of_others() -> bool {
    isatty(stdin()) && tcgetpgrp(stdin()).is_ok_and(|group| group != getpgrp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_read_and_others_are_told_what_there_is() {
        assert_eq!("light 5000".parse(), Ok(Order::Light(5000.0)));
        assert_eq!(" sensor  stuck".parse(), Ok(Order::Sensor(Health::Stuck)));
        assert_eq!("halt".parse(), Ok(Order::Halt));
        assert_eq!("restart".parse(), Ok(Order::Restart));
        for (line, word) in [
            ("light", "light 5000"),
            ("dim", "sensor missing"),
            ("light NaN", "0.1 to 200000 lx"),
            ("light -1", "0.1 to 200000 lx"),
        ] {
            let told = line.parse::<Order>().expect_err("refused");
            assert!(told.contains(word), "{told}");
        }
    }
}
