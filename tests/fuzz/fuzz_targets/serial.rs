//! Any bytes at the serial port of a transmitter, open or locked: no panic, no answer that is none, the next hello is answered, and the
//! locked one keeps its key.
//!
//! ```sh
//! cargo install cargo-fuzz
//! cd tests && cargo +nightly fuzz run --fuzz-dir fuzz serial
//! ```
#![no_main]

#[path = "../../../tx-firmware/tests/flash/mod.rs"]
mod flash;

use std::cell::RefCell;

use flash::{ERASE, Flash};
use libfuzzer_sys::fuzz_target;
use link::l2a_table::L2aTable;
use link::serial::{ANSWER_FRAME_MAX, Answer, FrameReader, Kind, Request, Seed, encode};
use link::signing::SecretKey;
use tx_firmware::ambient::Smoothing;
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::matrix::RecordingMatrix;
use tx_firmware::service::{ANSWER_MAX, Identity, Service};
use tx_firmware::store::Store;
use tx_firmware::transmitter::Transmitter;

struct Board {
    transmitter: Transmitter<RecordingMatrix>,
    store: Store<Flash<4>>,
    service: Service,
}

impl Board {
    fn new() -> Self {
        let calibration = Calibration::new(BENCH).expect("possible values");
        Self {
            transmitter: Transmitter::new(RecordingMatrix::default(), calibration, L2aTable::default(), Smoothing::default()),
            store: Store::new(Flash::new(), 0..2 * ERASE as u32)
                .expect("a store")
                .beside_program(2 * ERASE as u32..3 * ERASE as u32),
            service: Service::new(Identity {
                firmware: "fuzzed",
                board: "none",
            }),
        }
    }

    /// A board that signs and that only its owner may change.
    fn locked() -> Self {
        let mut board = Self::new();
        let seed = Seed(&[7; 32]);
        board.send(&Request::WriteKey { seed, counter: 1 });
        let owner = SecretKey::from_seed([1; 32]).expect("a key").public().to_bytes();
        board.send(&Request::WriteLock { key: &owner, salt: 1 });
        board
    }

    fn send(&mut self, request: &Request<'_>) -> Option<Reply> {
        let mut wire = [0; 128];
        self.receive(encode(Kind::Request, 1, request, &mut wire).expect("it fits"))
    }

    /// The last answer to these bytes.
    fn receive(&mut self, bytes: &[u8]) -> Option<Reply> {
        let mut last = None;
        for &byte in bytes {
            let mut out = [0; ANSWER_MAX];
            let Self {
                transmitter,
                store,
                service,
            } = self;
            let Some(answer) = service.receive(byte, transmitter, store, &mut out) else {
                continue;
            };
            let mut reader = FrameReader::<ANSWER_FRAME_MAX>::new();
            for &byte in answer {
                if let Some(frame) = reader.push(byte) {
                    let frame = frame.expect("answers are whole");
                    last = Some(match frame.answer().expect("answers are answers") {
                        Answer::Hello(_) => Reply::Hello,
                        Answer::Key { id: Some(_), .. } => Reply::Key,
                        _ => Reply::Other,
                    });
                }
            }
        }
        last
    }
}

/// The kinds of answers that are told apart.
#[derive(Debug, PartialEq, Eq)]
enum Reply {
    Hello,
    /// The board has a key.
    Key,
    Other,
}

thread_local! {
    /// Not begun anew for each input: what the inputs before left is part of the game.
    static BOARDS: RefCell<[Board; 2]> = RefCell::new([Board::new(), Board::locked()]);
}

fuzz_target!(|bytes: &[u8]| {
    let [which, bytes @ ..] = bytes else { return };
    let is_locked = which % 2 == 1;
    BOARDS.with_borrow_mut(|boards| {
        let board = &mut boards[usize::from(is_locked)];
        board.receive(bytes);
        // The end of a frame that the bytes have begun.
        board.receive(&[0]);
        assert_eq!(board.send(&Request::Hello), Some(Reply::Hello));
        if is_locked {
            assert_eq!(board.send(&Request::ReadKey), Some(Reply::Key));
        }
        let _ = board.transmitter.tick();
    });
});
