//! A transmitter that signs: which messages, with which counters, and who gets to see its key.

mod bench;
mod flash;
mod reads;

use std::collections::HashSet;

use bench::Bench;
use flash::{ERASE, Flash, Power, Tear, mixed};
use link::framing::{Deframer, Event, KeyId, Signature};
use link::l2a_table::L2aTable;
use link::panel::SoftPanel;
use link::serial::{Answer, Kind, Refusal, Request, Seed, encode};
use link::signing::{PublicKey, SecretKey, TrustedKey, Verdict, verdict};
use reads::READS;
use tx_firmware::store::{Memory, RESERVED, Store, StoreError};

const PLACE: core::ops::Range<u32> = 0..2 * ERASE as u32;
/// Bytes that a save writes.
const RECORD: usize = 1024;

/// A key whose bytes are found nowhere by chance, another one for each number.
fn seed(number: u64) -> [u8; 32] {
    core::array::from_fn(|byte| (mixed(number << 8 | byte as u64) >> 40) as u8)
}

fn public(seed: [u8; 32]) -> PublicKey {
    SecretKey::from_seed(seed).expect("a key").public()
}

fn store<const WRITE: usize>(flash: Flash<WRITE>) -> Store<Flash<WRITE>> {
    Store::new(flash, PLACE).expect("a store")
}

fn holds(bytes: &[u8], seed: [u8; 32]) -> bool {
    bytes.windows(seed.len()).any(|window| window == seed)
}

fn signed<const WRITE: usize>(store: &mut Store<Flash<WRITE>>) -> Signature {
    store.sign(b"ice").expect("signed").expect("a signature")
}

/// The answer that names a key.
fn named(seed: [u8; 32], counter: u32) -> Answer<'static> {
    let id = Some(u32::from_be_bytes(public(seed).id().0));
    Answer::Key { id, counter }
}

fn write_key(bench: &mut Bench, seed: [u8; 32], counter: u32) {
    let request = Request::WriteKey {
        seed: Seed(&seed),
        counter,
    };
    bench.expect(&request, &named(seed, counter));
}

fn send(bench: &mut Bench, message: &[u8]) {
    bench.expect(&Request::Send { repeats: None, message }, &Answer::Done);
}

/// The message that the LEDs show within a number of panels, and its signature.
fn shown(bench: &mut Bench, panels: u32) -> Option<(Vec<u8>, Signature)> {
    let mut deframer = Box::new(Deframer::new());
    (0..panels).find_map(|index| {
        let panel = bench.transmitter.tick().expect("it shows");
        match deframer.push(index, 0, &SoftPanel::certain(panel, 20)) {
            Event::Signed(read) => Some((read.message.to_vec(), read.signature)),
            _ => None,
        }
    })
}

#[test]
fn messages_are_proven_with_ever_greater_counters_also_after_restarts() {
    let mut bench = Bench::new();
    write_key(&mut bench, seed(1), 100);
    let mut trusted = [TrustedKey::new(public(seed(1)), None)];
    let mut last = 99;
    for number in 0..3 * RESERVED {
        if number % 50 == 49 {
            let flash = bench.store.release();
            bench = Bench::new();
            bench.store = store(flash);
        }
        let message = number.to_le_bytes();
        send(&mut bench, &message);
        let (read, signature) = shown(&mut bench, 60).expect("a signed message");
        let signer = public(seed(1)).id();
        let counter = signature.counter;
        assert_eq!(read, message);
        assert_eq!(verdict(&mut trusted, &read, &signature), Verdict::Proven { signer, counter });
        assert!(counter > last && counter - last <= RESERVED, "{counter} after {last}");
        last = counter;
    }
}

#[test]
fn without_a_key_and_after_it_is_erased_messages_are_not_signed() {
    let none = Answer::Key { id: None, counter: 0 };
    let mut bench = Bench::new();
    let mut unsigned = Bench::new();
    bench.expect(&Request::ReadKey, &none);
    write_key(&mut bench, seed(1), 7);
    send(&mut bench, b"ice");
    assert!(shown(&mut bench, 60).is_some());
    for _ in 0..2 {
        bench.expect(&Request::EraseKey, &none);
    }
    bench.transmitter = Bench::new().transmitter;
    for bench in [&mut bench, &mut unsigned] {
        send(bench, b"no ice");
    }
    for _ in 0..100 {
        assert_eq!(bench.transmitter.tick(), unsigned.transmitter.tick());
    }
}

#[test]
fn what_is_being_shown_ends_when_another_key_or_none_signs() {
    let mut bench = Bench::new();
    let is_sending = |bench: &mut Bench| {
        bench.ask(&Request::Status, |answer| match answer {
            Answer::Status(status) => status.sending,
            other => panic!("{other:?}"),
        })
    };
    send(&mut bench, b"ice");
    write_key(&mut bench, seed(1), 7);
    assert!(!is_sending(&mut bench));
    send(&mut bench, b"ice");
    // The same key again.
    bench.expect(
        &Request::WriteKey {
            seed: Seed(&seed(1)),
            counter: 7,
        },
        &named(seed(1), 8),
    );
    assert!(is_sending(&mut bench));
    write_key(&mut bench, seed(2), 7);
    assert!(!is_sending(&mut bench));
    send(&mut bench, b"ice");
    bench.expect(&Request::EraseKey, &Answer::Key { id: None, counter: 0 });
    assert!(!is_sending(&mut bench));
}

#[test]
fn a_message_that_is_repeated_or_impossible_takes_no_counter() {
    let mut bench = Bench::new();
    write_key(&mut bench, seed(1), 7);
    let ice = Request::Send {
        repeats: Some(2),
        message: b"ice",
    };
    bench.expect(&ice, &Answer::Done);
    for _ in 0..3 {
        bench.repeat(&ice, |answer| assert_eq!(answer, Answer::Done));
    }
    let empty = Request::Send {
        repeats: None,
        message: b"",
    };
    bench.expect(&empty, &Answer::Refused(Refusal::MessageLength { length: 0, most: 1024 }));
    bench.expect(&Request::ReadKey, &named(seed(1), 8));
}

#[test]
fn a_key_that_is_none_is_refused_and_the_old_one_stays() {
    let mut bench = Bench::new();
    write_key(&mut bench, seed(1), 7);
    for bytes in [&[][..], &[1; 31], &[1; 33], &[0; 32]] {
        let request = Request::WriteKey {
            seed: Seed(bytes),
            counter: 9,
        };
        bench.expect(&request, &Answer::Refused(Refusal::Seed));
    }
    bench.expect(&Request::ReadKey, &named(seed(1), 7));
}

#[test]
fn the_counter_of_a_key_never_goes_back() {
    let mut bench = Bench::new();
    write_key(&mut bench, seed(1), 1000);
    for counter in [1000, 1001, 1002] {
        send(&mut bench, b"ice");
        assert_eq!(shown(&mut bench, 60).expect("a signed message").1.counter, counter);
    }
    // The same key again, because an answer was lost, or from a computer with a wrong clock.
    let again = |counter| Request::WriteKey {
        seed: Seed(Box::leak(Box::new(seed(1)))),
        counter,
    };
    for (asked, first) in [(1000, 1003), (0, 1003), (1010, 1010), (5000, 5000)] {
        bench.expect(&again(asked), &named(seed(1), first));
    }
    send(&mut bench, b"ice");
    assert_eq!(shown(&mut bench, 60).expect("a signed message").1.counter, 5000);
    // Another key begins where it is told.
    write_key(&mut bench, seed(2), 3);
}

#[test]
fn a_counter_at_its_end_signs_no_more_and_the_message_before_goes_on() {
    let mut bench = Bench::new();
    write_key(&mut bench, seed(1), u32::MAX - RESERVED);
    for _ in 0..RESERVED {
        send(&mut bench, b"ice");
    }
    let more = Request::Send {
        repeats: None,
        message: b"more ice",
    };
    bench.expect(&more, &Answer::Refused(Refusal::NoCounter));
    assert_eq!(shown(&mut bench, 60).expect("a signed message").0, b"ice");
}

#[test]
fn what_cannot_be_counted_is_not_signed() {
    let mut bench = Bench::new();
    write_key(&mut bench, seed(1), 7);
    let mut flash = bench.store.release();
    flash.power = Power::For(0);
    bench.store = store(flash);
    let ice = Request::Send {
        repeats: None,
        message: b"ice",
    };
    bench.expect(&ice, &Answer::Refused(Refusal::Store));
    assert!(!bench.transmitter.is_sending());
}

/// Signs until the power goes after `bytes` bytes, then restarts and signs: no counter comes twice.
fn cut_while_signing<const WRITE: usize>(before: &Flash<WRITE>, used: &HashSet<u32>, bytes: usize, tear: Tear) -> bool {
    let mut used = used.clone();
    let mut cut = store(Flash {
        power: Power::For((bytes / WRITE) as u64),
        tear,
        ..before.clone()
    });
    let mut is_cut = false;
    for _ in 0..2 {
        match cut.sign(b"ice") {
            Ok(signature) => assert!(used.insert(signature.expect("a signature").counter), "cut after {bytes} bytes"),
            Err(_) => is_cut = true,
        }
    }
    let mut restarted = store(cut.release().restarted());
    for _ in 0..2 {
        let signature = signed(&mut restarted);
        assert_eq!(signature.key, public(seed(1)).id());
        assert!(
            used.insert(signature.counter),
            "{} twice, cut after {bytes} bytes",
            signature.counter
        );
    }
    is_cut
}

#[test]
fn no_counter_comes_twice_wherever_the_power_goes() {
    // After these starts the record is in the middle of a unit, at its end, and at its beginning.
    for starts in [0, 1, 6, 7, 8, 14, 15] {
        let mut used = HashSet::new();
        let mut flash = Flash::<4>::new();
        let mut first = store(flash);
        first.save_key(seed(1), 5).expect("room");
        flash = first.release();
        for _ in 0..starts {
            let mut started = store(flash);
            assert!(used.insert(signed(&mut started).counter));
            flash = started.release();
        }
        let mut cuts = 0;
        for bytes in 0..=RECORD + 8 {
            cuts += u32::from(cut_while_signing(&flash, &used, bytes, Tear::Bytes(bytes % 4)));
        }
        for tear in (0..6).map(Tear::Bits) {
            cuts += u32::from(cut_while_signing(&flash, &used, 0, tear));
            cuts += u32::from(cut_while_signing(&flash, &used, 100, tear));
        }
        assert!(cuts >= RECORD as u32, "{cuts}");
    }
}

/// A memory whose both units hold records with this key.
fn filled(seed: [u8; 32]) -> Flash<4> {
    let mut store = store(Flash::new());
    store.save_key(seed, 5).expect("room");
    store.save_table(&L2aTable::default()).expect("room");
    let mut flash = store.release();
    for _ in 0..12 {
        let mut started = self::store(flash);
        signed(&mut started);
        flash = started.release();
    }
    assert!(flash.bytes.chunks(ERASE).take(2).all(|unit| holds(unit, seed)));
    flash
}

#[test]
fn another_key_and_none_leave_no_trace_of_the_one_before_and_all_else_as_it_was() {
    for replace in [true, false] {
        let mut store = store(filled(seed(1)));
        if replace {
            store.save_key(seed(2), 9).expect("room");
        } else {
            store.erase_key().expect("room");
        }
        let key = store.key();
        let flash = store.release();
        assert!(!holds(&flash.bytes, seed(1)));
        let mut restarted = self::store(flash);
        assert_eq!(key, Ok(replace.then(|| (public(seed(2)).id(), 9))));
        assert_eq!((restarted.key(), restarted.table()), (key, Ok(Some(L2aTable::default()))));
    }
}

#[test]
fn a_power_cut_in_a_change_of_the_key_leaves_the_old_one_or_the_new_and_once_more_leaves_no_trace() {
    let before = filled(seed(1));
    let known: [Option<KeyId>; 2] = [seed(1), seed(2)].map(|seed| Some(public(seed).id()));
    let mut cuts = 0;
    for tear in (0..6).map(Tear::Bits).chain([Tear::Bytes(2)]) {
        for operations in 0.. {
            let mut cut = store(Flash {
                power: Power::For(operations),
                tear,
                ..before.clone()
            });
            let saved = cut.save_key(seed(2), 9);
            let mut restarted = store(cut.release().restarted());
            let found = restarted.key().expect("readable").map(|(id, _)| id);
            assert!(known.contains(&found), "{tear:?}, cut at {operations}");
            assert_eq!(restarted.table(), Ok(Some(L2aTable::default())), "{tear:?}, cut at {operations}");
            if saved.is_ok() {
                assert_eq!(found, known[1]);
                break;
            }
            cuts += 1;
            restarted.save_key(seed(2), 9).expect("with power");
            assert_eq!(restarted.key().map(|key| key.map(|(id, _)| id)), Ok(known[1]));
            assert!(!holds(&restarted.release().bytes, seed(1)), "{tear:?}, cut at {operations}");
        }
    }
    assert!(cuts > 7 * 128, "{cuts}");
}

#[test]
fn the_same_key_written_again_uses_no_counter_twice_whenever_the_power_goes() {
    let mut before = store(filled(seed(1)));
    let used: HashSet<u32> = (0..3).map(|_| signed(&mut before).counter).collect();
    let before = before.release();
    let more = used.iter().max().expect("some") + 1000;
    let mut cuts = 0;
    for (counter, tear) in [
        (0, Tear::Bits(1)),
        (more, Tear::Bits(1)),
        (more, Tear::Bits(3)),
        (more, Tear::Bytes(2)),
    ] {
        for operations in 0.. {
            let mut cut = store(Flash {
                power: Power::For(operations),
                tear,
                ..before.clone()
            });
            let saved = cut.save_key(seed(1), counter);
            let mut flash = cut.release().restarted();
            let mut here = used.clone();
            for _ in 0..3 {
                let mut restarted = store(flash);
                let next = signed(&mut restarted).counter;
                assert!(here.insert(next), "counter {next} twice, {tear:?}, cut at {operations}");
                flash = restarted.release();
            }
            if saved.is_ok() {
                break;
            }
            cuts += 1;
        }
    }
    assert!(cuts > 3 * 128, "{cuts}");
}

#[test]
fn a_key_written_again_costs_no_erasure() {
    let mut store = store(filled(seed(1)));
    let mut erased = Vec::new();
    for _ in 0..3 {
        store.save_key(seed(2), 9).expect("room");
        let flash = store.release();
        erased.push(flash.erased);
        store = self::store(flash);
    }
    assert_eq!(erased[1..], [erased[0]; 2]);
}

#[test]
fn counters_that_leave_no_room_are_refused() {
    let mut store = store(Flash::<4>::new());
    for counter in [u32::MAX, u32::MAX - RESERVED + 1] {
        assert_eq!(store.save_key(seed(1), counter), Err(StoreError::NoCounter));
    }
    assert_eq!(store.key(), Ok(None));
    store.save_key(seed(1), u32::MAX - RESERVED).expect("room");
    assert_eq!(signed(&mut store).counter, u32::MAX - RESERVED);
}

/// Neither answers nor debug output of requests and transmitter contain the key.
#[test]
fn a_key_is_never_read_back() {
    let mut bench = Bench::new();
    let (secret, counter) = (seed(1), 7);
    let write = Request::WriteKey {
        seed: Seed(&secret),
        counter,
    };
    let mut told = Vec::new();
    let mut printed = format!("{write:?}");
    let send = Request::Send {
        repeats: None,
        message: b"ice",
    };
    for request in [write, send].into_iter().chain(READS) {
        let mut wire = [0; 128];
        let wire = encode(Kind::Request, 1, &request, &mut wire).expect("it fits");
        told.extend(bench.exchange(wire));
        printed += &format!("{:?}{:?}{:?}", bench.service, bench.transmitter, SecretKey::from_seed(secret));
    }
    assert!(told.len() > 200, "{}", told.len());
    let pieces = secret.windows(4);
    assert!(!pieces.clone().any(|piece| told.windows(4).any(|window| window == piece)));
    let digits = |piece: &[u8]| format!("{piece:?}").trim_matches(['[', ']']).to_owned();
    let hex = |piece: &[u8]| piece.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    assert!(
        !pieces
            .clone()
            .any(|piece| printed.contains(&digits(piece)) || printed.contains(&hex(piece)))
    );
    assert_eq!(
        StoreError::NoSigning.to_string(),
        "this firmware signs no messages: build it with the feature `signing`"
    );
}
