//! The emulated board, and the conversation with it.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use link::serial::{FrameReader, Kind, encode, wire_length};
use rx_pipeline::board::{Answer, REGION_ANSWER_MAX, REGION_REQUEST_MAX, Request, Settings};

/// QEMU lets 2⁶ ns pass with each instruction.
const SHIFT: u32 = 6;
/// Ticks of the board's clock are 40 ns.
const TICK_NS: u64 = 40;

/// A running board.
pub struct Board {
    process: Child,
    to: ChildStdin,
    from: ChildStdout,
    reader: FrameReader<REGION_ANSWER_MAX>,
    wire: Vec<u8>,
    sequence: u32,
}

impl Board {
    /// Starts the board with a program.
    pub fn start(image: &Path) -> Self {
        let mut process = Command::new("qemu-system-arm")
            .args(["-machine", "mps2-an500", "-display", "none", "-monitor", "none"])
            .args(["-chardev", "stdio,id=uart,signal=off", "-serial", "chardev:uart"])
            .arg("-icount")
            .arg(format!("shift={SHIFT},sleep=off"))
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("QEMU runs");
        Self {
            to: process.stdin.take().expect("standard input is a pipe"),
            from: process.stdout.take().expect("standard output is a pipe"),
            process,
            reader: FrameReader::new(),
            wire: vec![0; wire_length(REGION_REQUEST_MAX)],
            sequence: 0,
        }
    }

    /// Starts the board and has it read by these settings.
    pub fn begin(image: &Path, settings: Settings) -> Self {
        let mut board = Self::start(image);
        board.ask(&Request::Begin(settings), |answer| {
            assert_eq!(*answer, Answer::Ready);
        });
        board
    }

    /// Asks, and looks at the answer.
    pub fn ask<T>(&mut self, request: &Request<'_>, look: impl FnOnce(&Answer<'_>) -> T) -> T {
        self.sequence += 1;
        let sent = encode(Kind::Request, self.sequence, request, &mut self.wire);
        self.to
            .write_all(sent.expect("requests are short"))
            .and_then(|()| self.to.flush())
            .expect("the board listens");
        let mut byte = [0];
        loop {
            self.from.read_exact(&mut byte).expect("the board answers");
            let Some(frame) = self.reader.push(byte[0]) else {
                continue;
            };
            let frame = frame.expect("the line is clean");
            assert_eq!(frame.sequence(), self.sequence);
            return look(&frame.message(Kind::Answer).expect("an answer"));
        }
    }

    /// The deepest that the stack has been, bytes.
    pub fn stack_bytes(&mut self) -> u32 {
        self.ask(&Request::Memory, |answer| match answer {
            Answer::Memory(memory) => memory.stack_bytes,
            other => panic!("{other:?}"),
        })
    }
}

/// The instructions that so many ticks are.
pub fn instructions(ticks: u32) -> u64 {
    (u64::from(ticks) * TICK_NS) >> SHIFT
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
