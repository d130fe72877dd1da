//! A board with a private key: the public key verifies what its LEDs show.

use std::path::Path;

use link::framing::{Deframer, Event, Signature};
use link::panel::SoftPanel;
use link::serial::{Request, Seed};
use link::signing::{SecretKey, TrustedKey, Verdict, verdict};
use vocc_tests::firmware::say;

use crate::emulator::{Emulator, Event as Happening};
use crate::image::Programs;
use crate::measure::JITTER_MAX_NS;
use crate::panel::{Record, Symbol};
use crate::serial::{assert_beacons, fill_store};
use crate::terminal::Terminal;
use crate::vocc::vocc;

const SEED: [u8; 32] = *b"the private key of a board's own";
const FIRST_COUNTER: u32 = 1_760_000_000;
pub const WRITE_KEY: Request<'_> = Request::WriteKey {
    seed: Seed(&SEED),
    counter: FIRST_COUNTER,
};
/// Maximum time for a signature, a verification or a hash, in cycles: a quarter of a second.
const COMPUTING_MAX: u64 = 31_250_000;
/// Time within which a sent message is verified, including its signature of 20 panels, in ms.
pub const PROVEN_MS: u32 = 1_000;

/// The panels with their light.
pub fn record(events: &[Happening]) -> Record {
    let mut record = Record::default();
    record.extend(events);
    record
}

/// Asserts that symbols kept their time while `function` computed `what`, and that it took no longer than it may.
pub fn assert_symbols_went_on(events: &[Happening], function: &str, what: &str) {
    let symbols = record(events).symbols;
    let lengths_ns = symbols.windows(2).map(|pair| pair[1].ns - pair[0].ns);
    let (shortest_ns, longest_ns) = lengths_ns.fold((u64::MAX, 0), |(least, most), ns| (least.min(ns), most.max(ns)));
    assert!(longest_ns - shortest_ns <= JITTER_MAX_NS as u64, "{shortest_ns} to {longest_ns} ns");
    let cycles = events.last().and_then(|last| last.cycles.as_ref()).expect("cycles were counted");
    let cycles = cycles[function]["most"].as_u64().expect("it ran");
    say(&format!(
        "{what}: {cycles} cycles with interrupts; symbols of {shortest_ns} to {longest_ns} ns meanwhile"
    ));
    assert!(cycles <= COMPUTING_MAX);
}

/// The first signed message in the symbols.
pub fn signed(symbols: &[Symbol]) -> Option<(Vec<u8>, Signature)> {
    let mut deframer = Box::new(Deframer::new());
    (0..).zip(symbols).find_map(|(index, symbol)| {
        let seen = SoftPanel::certain(symbol.panel, 20);
        match deframer.push(index, symbol.ns, &seen) {
            Event::Signed(read) => Some((read.message.to_vec(), read.signature)),
            _ => None,
        }
    })
}

/// (e) The board signs messages while its symbols continue, continues its counter after a restart, and erases its key permanently.
pub fn a_message_is_signed_on_the_board_and_proven_by_the_public_key(programs: &Programs, folder: &Path) {
    let public = SecretKey::from_seed(SEED).expect("a key").public();
    let mut trusted = [TrustedKey::new(public, None)];
    drop(Emulator::power_up_still(programs, folder, &[]));
    for (start, message) in [(0, &b"Signed by a board"[..]), (1, b"Signed after a restart")] {
        let mut board = Emulator::power_up(programs, folder, &["--time", "9SecretKey4sign"]);
        board.run_ms(100);
        if start == 0 {
            board.ask(1, &WRITE_KEY, PROVEN_MS);
        }
        let events = board.ask(2, &Request::Send { repeats: None, message }, PROVEN_MS);
        let (read, signature) = signed(&record(&events).symbols).expect("a signed message");
        assert_eq!(read, message);
        let told = Verdict::Proven {
            signer: public.id(),
            counter: FIRST_COUNTER + 64 * start,
        };
        assert_eq!(verdict(&mut trusted, &read, &signature), told);
        assert_symbols_went_on(&events, "9SecretKey4sign", &format!("a signature of {} bytes", message.len()));
    }
    let flash = || std::fs::read(folder.join("flash.bin")).expect("the flash is a file");
    let holds_key = |flash: &[u8]| flash.windows(SEED.len()).any(|window| window == SEED);
    assert!(holds_key(&flash()));

    let mut board = Emulator::power_up(programs, folder, &[]);
    board.run_ms(100);
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let key = |words: &[&str]| vocc(programs, folder, &[&["device", "key"], words].concat(), terminal.name()).json();
    assert_eq!(key(&[])["signer"], public.id().to_string());
    assert_eq!(key(&["--erase"])["signer"], serde_json::Value::Null);
    assert!(!holds_key(&flash()));
}

/// Each of 16 sectors takes the maximum time to erase, together longer than the watchdog's period.
pub fn a_key_clears_a_full_store_while_symbols_go_on(programs: &Programs, folder: &Path) {
    fill_store(programs, folder);
    let mut board = Emulator::power_up(programs, folder, &["--slow-flash"]);
    let mut events = board.run_ms(100);
    events.extend(board.ask(1, &WRITE_KEY, 8_000));
    assert!(events.iter().all(|event| event.reset.is_none()));
    assert_beacons(&record(&events));
    board.store_still(3, PROVEN_MS);
    let message = b"Signed by a board";
    let events = board.ask(2, &Request::Send { repeats: None, message }, PROVEN_MS);
    assert!(signed(&record(&events).symbols).is_some_and(|(read, _)| read == message));
    let flash = std::fs::read(folder.join("flash.bin")).expect("the flash is a file");
    assert!(!flash.windows(64).any(|window| window == [0x5a; 64]));
}
