//! A locked board makes a change with a permit only, and its symbols go on while it verifies one.

use std::path::Path;

use link::lock::Challenge;
use link::serial::Request;
use link::signing::SecretKey;
use vocc_tests::firmware::say;

use crate::emulator::Emulator;
use crate::image::Programs;
use crate::measure::JITTER_MAX_NS;
use crate::signing::{PROVEN_MS, WRITE_KEY, after, record, signed};

const PIN_SEED: [u8; 32] = *b"a key that is derived from a PIN";
const SALT: u64 = 1;
const MESSAGE: &[u8] = b"Permitted";
/// Maximum time to verify a permit, in cycles: a quarter of a second, as for a signature.
const VERIFYING_MAX: u64 = 31_250_000;
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

    let mut board = Emulator::power_up(programs, folder, &["--time", VERIFICATION]);
    board.run_ms(100);
    let mut events = after(&mut board, 1, &WRITE_KEY, PROVEN_MS);
    events.extend(after(&mut board, 2, &lock, PROVEN_MS));
    events.extend(after(&mut board, 3, &send, PROVEN_MS));
    assert_eq!(signed(&record(&events).symbols), None);
    events.extend(after(&mut board, 4, &permit, PROVEN_MS));
    let shown = after(&mut board, 5, &send, 2 * PROVEN_MS);
    assert!(signed(&record(&shown).symbols).is_some_and(|(read, _)| read == MESSAGE));

    events.extend(shown);
    assert!(events.iter().all(|event| event.reset.is_none()));
    let symbols = record(&events).symbols;
    let lengths_ns = symbols.windows(2).map(|pair| pair[1].ns - pair[0].ns);
    let (shortest_ns, longest_ns) = lengths_ns.fold((u64::MAX, 0), |(least, most), ns| (least.min(ns), most.max(ns)));
    assert!(longest_ns - shortest_ns <= JITTER_MAX_NS as u64, "{shortest_ns} to {longest_ns} ns");
    let cycles = events.last().and_then(|last| last.cycles.as_ref()).expect("cycles were counted");
    let cycles = cycles[VERIFICATION]["most"].as_u64().expect("it verified");
    say(&format!(
        "a permit's verification: {cycles} cycles with interrupts; symbols of {shortest_ns} to {longest_ns} ns meanwhile"
    ));
    assert!(cycles <= VERIFYING_MAX);
}
