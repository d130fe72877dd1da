//! Any bytes at the serial port of a transmitter: no panic, no answer that is none, and the next hello is answered.
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
use link::serial::{ANSWER_FRAME_MAX, Answer, FrameReader, Kind, Request, encode};
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
            store: Store::new(Flash::new(), 0..2 * ERASE as u32).expect("a store"),
            service: Service::new(Identity {
                firmware: "fuzzed",
                board: "none",
            }),
        }
    }

    /// The kinds of answers to these bytes.
    fn hear(&mut self, bytes: &[u8]) -> Option<bool> {
        let mut is_hello = None;
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
                    let answer = frame.answer().expect("answers are answers");
                    is_hello = Some(matches!(answer, Answer::Hello(_)));
                }
            }
        }
        is_hello
    }
}

thread_local! {
    /// Not begun anew for each input: what the inputs before left is part of the game.
    static BOARD: RefCell<Board> = RefCell::new(Board::new());
}

fuzz_target!(|bytes: &[u8]| {
    BOARD.with_borrow_mut(|board| {
        board.hear(bytes);
        let mut wire = [0; 32];
        let hello = encode(Kind::Request, 1, &Request::Hello, &mut wire).expect("it fits");
        assert_eq!(board.hear(hello), Some(true));
        let _ = board.transmitter.tick();
    });
});
