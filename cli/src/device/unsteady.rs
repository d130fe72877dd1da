//! Tests the client and the firmware's service over a line that drops, doubles, changes and delays bytes.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::time::Duration;

use link::l2a_table::L2aTable;
use link::serial::{Answer, Faults, Request};

use super::fake::Fake;
use super::{Client, DeviceError, table};

/// Faults of a line: one byte in this many; 0: none.
#[derive(Clone, Copy, Debug)]
struct Line {
    dropped: u64,
    doubled: u64,
    changed: u64,
    /// Maximum reads without data before an answer arrives.
    late: u64,
    /// Number of writes before the transmitter restarts; 0: never.
    restarts: u64,
    /// Whether the line echoes writes.
    echo: bool,
}

struct Wire {
    fake: Fake,
    line: Line,
    seed: u64,
    incoming: VecDeque<u8>,
    /// Reads without data before the next bytes arrive.
    late: u64,
    writes: u64,
}

impl Wire {
    fn new(line: Line, seed: u64) -> Self {
        Self {
            fake: Fake::new(),
            line,
            seed,
            incoming: VecDeque::new(),
            late: 0,
            writes: 0,
        }
    }

    fn number(&mut self) -> u64 {
        self.seed = self.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.seed ^ self.seed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed ^ mixed >> 29
    }

    fn happens(&mut self, one_in: u64) -> bool {
        one_in > 0 && self.number().is_multiple_of(one_in)
    }

    /// The bytes that reach the other end of the line.
    fn carried(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        for &byte in bytes {
            if self.happens(self.line.dropped) {
                continue;
            }
            let byte = if self.happens(self.line.changed) {
                byte ^ 1 << (self.number() % 8)
            } else {
                byte
            };
            out.push(byte);
            if self.happens(self.line.doubled) {
                out.push(byte);
            }
        }
        out
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writes += 1;
        if self.line.restarts > 0 && self.writes.is_multiple_of(self.line.restarts) {
            // Restore its non-volatile memory.
            let table = self.fake.memory.table.clone();
            self.fake = Fake::new();
            if let Some(table) = table {
                self.fake.transmitter.set_table(table.clone());
                self.fake.memory.table = Some(table);
            }
        }
        if self.line.echo {
            self.incoming.extend(bytes);
        }
        let waiting = !self.incoming.is_empty();
        let arrived = self.carried(bytes);
        let answer = self.fake.exchange(&arrived);
        let back = self.carried(&answer);
        self.incoming.extend(back);
        if self.line.late > 0 && !waiting {
            self.late = self.number() % (self.line.late + 1);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Wire {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.late > 0 || self.incoming.is_empty() {
            self.late = self.late.saturating_sub(1);
            return Err(ErrorKind::TimedOut.into());
        }
        self.incoming.read(bytes)
    }
}

fn client(line: Line, seed: u64) -> Result<Client<Wire>, DeviceError> {
    println!("{line:?}, seed {seed}");
    Client::greet(Wire::new(line, seed), Duration::from_secs(1), seed as u32)?.transmitter()
}

/// A table of the largest size.
fn large() -> L2aTable {
    let illuminances: Vec<f32> = (0..16).map(|n| 2_f32.powi(n)).collect();
    let intervals: Vec<f32> = (1..=8).map(|n| 0.25 * n as f32).collect();
    let values: Vec<f32> = (0..128).map(|n| 0.2 + 0.025 * n as f32).collect();
    L2aTable::new(&illuminances, &intervals, &values).expect("a table")
}

const GOOD_LINE: Line = Line {
    dropped: 0,
    doubled: 0,
    changed: 0,
    late: 0,
    restarts: 0,
    echo: false,
};

/// Lines that must carry a table.
const BAD_LINES: [Line; 6] = [
    Line { dropped: 600, ..GOOD_LINE },
    Line { doubled: 600, ..GOOD_LINE },
    Line { changed: 600, ..GOOD_LINE },
    Line { late: 3, ..GOOD_LINE },
    Line {
        restarts: 7,
        echo: true,
        ..GOOD_LINE
    },
    Line {
        dropped: 2000,
        doubled: 2000,
        changed: 2000,
        late: 2,
        restarts: 23,
        echo: true,
    },
];

#[test]
fn a_table_comes_through_every_line_and_back_the_same() {
    for line in BAD_LINES {
        for seed in 0..50 {
            let mut client = client(line, seed).expect("somebody answers");
            table::push(&mut client, &large(), |_| {}).expect("it comes through");
            assert_eq!(table::pull(&mut client), Ok(large()));
        }
    }
}

#[test]
fn what_is_cut_off_leaves_the_old_table_or_the_new() {
    for seed in 0..200 {
        let line = Line { dropped: 40, ..GOOD_LINE };
        let Ok(mut client) = client(line, seed) else {
            continue;
        };
        let outcome = table::push(&mut client, &large(), |_| {});
        let fake = &mut client.into_port().fake;
        let running = fake.transmitter.table();
        assert!(*running == Fake::first_table() || *running == large());
        if outcome.is_ok() {
            assert_eq!(*running, large());
        }
        assert_eq!(fake.memory.table.as_ref().unwrap_or(&Fake::first_table()), running);
    }
}

#[test]
fn a_message_whose_answer_is_lost_is_shown_once() {
    for seed in 0..200 {
        let line = Line { dropped: 100, ..GOOD_LINE };
        let Ok(mut client) = client(line, seed) else {
            continue;
        };
        let send = Request::Send {
            repeats: Some(1),
            message: b"once",
        };
        let sent = client.ask(&send, |answer| (answer == Answer::Done).then_some(()));
        let fake = &mut client.into_port().fake;
        if sent.is_ok() {
            assert!(fake.transmitter.is_sending());
        }
        // The header's toggle bit of a new message has toggled once, not twice.
        let panels = |transmitter: &mut tx_firmware::transmitter::Transmitter<_>| (0..3).map(|_| transmitter.tick()).collect::<Vec<_>>();
        let mut once = Fake::new();
        once.transmitter
            .send(b"once", link::fec::Code::for_length(4), tx_firmware::schedule::Repeats::Times(1))
            .expect("a message");
        if fake.transmitter.is_sending() {
            assert_eq!(panels(&mut fake.transmitter), panels(&mut once.transmitter));
        }
    }
}

#[test]
fn status_comes_through() {
    let mut client = client(GOOD_LINE, 1).expect("an answer");
    let status = client
        .ask(&Request::Status, |answer| match answer {
            Answer::Status(status) => Some(status),
            _ => None,
        })
        .expect("an answer");
    assert_eq!(status.illuminance_lx.map(|lx| lx.to_num::<f64>().round()), Some(2000.0));
    assert_eq!((status.faults, status.uptime_s), (Faults::empty(), 1));
    assert_eq!(client.identity().board, "fake");
}

/// A port with another device.
struct Other(&'static [u8]);

impl Write for Other {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Other {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.0 {
            [] => Err(ErrorKind::TimedOut.into()),
            text => {
                bytes[..text.len()].copy_from_slice(text);
                Ok(text.len())
            }
        }
    }
}

#[test]
fn whoever_is_no_transmitter_is_told_from_nobody() {
    let greeted = |port| Client::greet(port, Duration::from_millis(1), 0).err();
    assert_eq!(greeted(Other(b"")), Some(DeviceError::Silent { tries: 8 }));
    let babble = greeted(Other(b"login: \0\r\n"));
    assert!(matches!(babble, Some(DeviceError::NoTransmitter { .. })), "{babble:?}");
}
