//! A locked board makes a change with a permit only, and its symbols go on while it verifies one.

use std::path::Path;

use link::lock::Challenge;
use link::serial::Request;
use link::signing::SecretKey;

use crate::emulator::Emulator;
use crate::image::Programs;
use crate::signing::{PROVEN_MS, WRITE_KEY, assert_symbols_went_on, record, signed};

const PIN_SEED: [u8; 32] = *b"a key that is derived from a PIN";
const SALT: u64 = 1;
const MESSAGE: &[u8] = b"Permitted";
const VERIFICATION: &str = "13has_permitted";

/// A change without a permit is refused, and with one it is made.
pub fn a_locked_board_wants_a_permit_while_symbols_go_on(programs: &Programs, folder: &Path) {
    let key = SecretKey::from_seed(PIN_SEED).expect("a key");
    let send = Request::Send {
        repeats: None,
        message: MESSAGE,
    };
    let lock = Request::WriteLock {
        key: &key.public().to_bytes(),
        salt: SALT,
    };
    let challenge = Challenge { salt: SALT, number: 0 };
    let permit = Request::Permit {
        challenge: challenge.number,
        signature: &key.permit(challenge, 5, &send).expect("it fits"),
    };

    let mut board = Emulator::power_up_still(programs, folder, &["--time", VERIFICATION]);
    board.run_ms(100);
    let mut events = board.ask(1, &WRITE_KEY, PROVEN_MS);
    events.extend(board.ask(2, &lock, PROVEN_MS));
    events.extend(board.ask(3, &send, PROVEN_MS));
    assert_eq!(signed(&record(&events).symbols), None);
    events.extend(board.ask(4, &permit, PROVEN_MS));
    let shown = board.ask(5, &send, 2 * PROVEN_MS);
    assert!(signed(&record(&shown).symbols).is_some_and(|(read, _)| read == MESSAGE));

    events.extend(shown);
    assert!(events.iter().all(|event| event.reset.is_none()));
    assert_symbols_went_on(&events, VERIFICATION, "a permit's verification");
}
