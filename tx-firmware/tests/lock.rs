//! A locked transmitter: what it refuses, what it permits, and what it remembers of tries.

mod bench;
mod flash;
mod reads;

use std::collections::HashSet;

use bench::Bench;
use flash::{ERASE, Flash, Power, Tear};
use link::checksum::crc32c;
use link::l2a_table::L2aTable;
use link::lock::Challenge;
use link::serial::{Answer, Kind, REQUEST_FRAME_MAX, Refusal, Request, Seed, encode, wire_length};
use link::signing::SecretKey;
use reads::READS;
use tx_firmware::calibration::BENCH;
use tx_firmware::light_watch::{LightSample, SensorRange};
use tx_firmware::matrix::RecordingMatrix;
use tx_firmware::store::{Memory, Permit, PermitError, Store};

/// A bench with the usual LEDs.
type OnBench = Bench<RecordingMatrix>;

const PLACE: core::ops::Range<u32> = 0..2 * ERASE as u32;
const SALT: u64 = 0x0123_4567_89ab_cdef;
const RATE: Request<'_> = Request::WriteSymbolRate { millihertz: 27_000 };
const TAKEN: Answer<'_> = Answer::SymbolRate { millihertz: 27_000 };
const LOCKED: Answer<'_> = Answer::Refused(Refusal::Locked);

fn key(number: u8) -> SecretKey {
    SecretKey::from_seed([number; 32]).expect("a key")
}

fn public(number: u8) -> [u8; 32] {
    key(number).public().to_bytes()
}

/// A bench that key 1 locks.
fn locked() -> Bench {
    let mut bench = Bench::new();
    let lock = Request::WriteLock {
        key: &public(1),
        salt: SALT,
    };
    bench.expect(&lock, &state(0, 0));
    bench
}

fn state(challenge: u32, wait_s: u16) -> Answer<'static> {
    Answer::Lock {
        salt: Some(SALT),
        challenge,
        wait_s,
    }
}

fn challenge(bench: &mut Bench) -> Challenge {
    bench.ask(&Request::ReadLock, |answer| match answer {
        Answer::Lock {
            salt: Some(salt),
            challenge,
            ..
        } => Challenge { salt, number: challenge },
        other => panic!("{other:?}"),
    })
}

/// Gives a permit of this key for the request that comes after it.
fn permit(bench: &mut Bench, key: &SecretKey, request: &Request<'_>) {
    let challenge = challenge(bench);
    permit_for(bench, key, challenge, request);
}

fn permit_for(bench: &mut Bench, key: &SecretKey, challenge: Challenge, request: &Request<'_>) {
    let signature = key.permit(challenge, bench.sequence + 2, request).expect("it fits");
    let permit = Request::Permit {
        challenge: challenge.number,
        signature: &signature,
    };
    bench.expect(&permit, &Answer::Done);
}

fn permitted(bench: &mut Bench, request: &Request<'_>, answer: &Answer<'_>) {
    permit(bench, &key(1), request);
    bench.expect(request, answer);
}

fn restarted(bench: Bench) -> Bench {
    let mut again = Bench::new();
    again.store = store(bench.store.release());
    again.sequence = bench.sequence;
    again
}

fn store<const WRITE: usize>(flash: Flash<WRITE>) -> Store<Flash<WRITE>> {
    Store::new(flash, PLACE).expect("a store")
}

/// Lets time pass.
fn wait(bench: &mut Bench, uptime_s: u64) {
    let dark = LightSample::Missing;
    bench
        .transmitter
        .sense(1000 * uptime_s, SensorRange::Operating, dark)
        .expect("LEDs");
}

fn changes() -> [Request<'static>; 16] {
    [
        Request::BeginTable { length: 24, crc: 0 },
        Request::WriteTable { offset: 0, bytes: b"x" },
        Request::CommitTable {
            crc: L2aTable::default().crc(),
        },
        Request::RollBackTable,
        Request::WriteCalibration(BENCH),
        Request::Send {
            repeats: None,
            message: b"ice",
        },
        Request::StopSending,
        Request::ResetCounters,
        RATE,
        Request::WriteIntensityLimit {
            most_mcd: 0,
            led_diameter_um: 0,
        },
        Request::WriteCarrier {
            millihertz: 90_000,
            cycles: 0,
        },
        Request::WriteKey {
            seed: Seed(&[7; 32]),
            counter: 1,
        },
        Request::EraseKey,
        Request::TestPanel {
            bits: 1,
            share: 1,
            time_ms: 9,
        },
        Request::WriteLock { key: &[2; 32], salt: 1 },
        Request::RemoveLock,
    ]
}

#[test]
fn a_locked_transmitter_changes_nothing_and_tells_everything() {
    let mut bench = locked();
    let before = bench.store.release();
    bench.store = store(before.clone()).beside_program(8192..8292);
    let shown = format!("{:?}", bench.transmitter);
    for request in changes() {
        assert!(request.changes());
        bench.expect(&request, &LOCKED);
    }
    for request in READS {
        assert!(!request.changes());
        assert!(!bench.ask(&request, |answer| matches!(answer, Answer::Refused(_))), "{request:?}");
    }
    assert_eq!(format!("{:?}", bench.transmitter), shown);
    assert!(bench.store.release().bytes == before.bytes);
}

#[test]
fn each_change_is_permitted_once() {
    let mut bench = locked();
    for request in changes() {
        permit(&mut bench, &key(1), &request);
        let is_locked = bench.ask(&request, |answer| matches!(answer, Answer::Refused(Refusal::Locked)));
        assert!(!is_locked, "{request:?}");
        if request == Request::RemoveLock {
            break;
        }
        bench.expect(&request, &LOCKED);
    }
    bench.expect(
        &Request::ReadLock,
        &Answer::Lock {
            salt: None,
            challenge: 0,
            wait_s: 0,
        },
    );
    bench.expect(&RATE, &TAKEN);
}

#[test]
fn an_answer_that_is_lost_is_given_again_and_nothing_is_done_twice() {
    let mut bench = locked();
    permitted(&mut bench, &RATE, &TAKEN);
    let operations = bench.store.release();
    let written = operations.operations;
    bench.store = store(operations);
    for _ in 0..3 {
        bench.repeat(&RATE, |answer| assert_eq!(answer, TAKEN));
    }
    // Another request with its number is that request: it is not carried out.
    bench.repeat(&Request::EraseKey, |answer| assert_eq!(answer, TAKEN));
    assert_eq!(bench.store.release().operations, written);

    // The lock itself, whose answer may be lost, too.
    let mut bench = Bench::new();
    let lock = Request::WriteLock {
        key: &public(1),
        salt: SALT,
    };
    bench.expect(&lock, &state(0, 0));
    bench.repeat(&lock, |answer| assert_eq!(answer, state(0, 0)));
}

/// A recording of all bytes at the port, played again at once, after other requests and after a restart.
#[test]
fn a_recorded_conversation_changes_nothing_later() {
    let mut bench = locked();
    let number = challenge(&mut bench);
    let sequence = bench.sequence + 2;
    let signature = key(1).permit(number, sequence, &RATE).expect("it fits");
    let recorded = [
        Request::Permit {
            challenge: number.number,
            signature: &signature,
        },
        RATE,
    ];
    let recorded: Vec<Vec<u8>> = (sequence - 1..)
        .zip(recorded)
        .map(|(sequence, request)| {
            let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
            encode(Kind::Request, sequence, &request, &mut wire).expect("it fits").to_vec()
        })
        .collect();
    let play = |bench: &mut Bench| recorded.iter().map(|bytes| bench.exchange(bytes)).collect::<Vec<_>>()[1].clone();
    let first = play(&mut bench);
    OnBench::answer(&first, sequence, |answer| assert_eq!(answer, TAKEN));
    bench.sequence += 2;

    let back = Request::WriteSymbolRate { millihertz: 90_000 };
    permitted(&mut bench, &back, &Answer::SymbolRate { millihertz: 90_000 });
    let late = play(&mut bench);
    OnBench::answer(&late, sequence, |answer| assert_eq!(answer, LOCKED));
    let mut bench = restarted(bench);
    let later = play(&mut bench);
    OnBench::answer(&later, sequence, |answer| assert_eq!(answer, LOCKED));
    // Such permits are for another challenge: they do not count as wrong.
    bench.ask(&Request::ReadLock, |answer| {
        assert!(matches!(answer, Answer::Lock { wait_s: 0, .. }))
    });
}

#[test]
fn a_permit_for_another_request_or_port_is_of_no_use() {
    let mut bench = locked();
    permit(&mut bench, &key(1), &RATE);
    let other = Request::WriteSymbolRate { millihertz: 28_000 };
    bench.expect(&other, &Answer::Refused(Refusal::WrongPermit { wait_s: 0 }));
    bench.expect(&RATE, &LOCKED);

    permit(&mut bench, &key(1), &RATE);
    let first = core::mem::replace(&mut bench.service, OnBench::another_port());
    bench.expect(&RATE, &LOCKED);
    bench.sequence -= 1;
    bench.service = first;
    bench.expect(&RATE, &TAKEN);
}

#[test]
fn wrong_tries_are_slowed_and_restarts_do_not_help() {
    let mut bench = locked();
    let wrong = |bench: &mut Bench| {
        permit(bench, &key(2), &RATE);
        bench.ask(&RATE, |answer| match answer {
            Answer::Refused(Refusal::WrongPermit { wait_s }) => wait_s,
            other => panic!("{other:?}"),
        })
    };
    let mut now_s = 0;
    for expected in [0, 0, 0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 600, 600, 600] {
        let wait_s = wrong(&mut bench);
        assert_eq!(wait_s, expected);
        if wait_s == 0 {
            continue;
        }
        // Even the right permit is not verified now.
        let waiting = Answer::Refused(Refusal::Wait { wait_s });
        permitted(&mut bench, &RATE, &waiting);
        now_s += u64::from(wait_s);
        wait(&mut bench, now_s - 1);
        permitted(&mut bench, &RATE, &Answer::Refused(Refusal::Wait { wait_s: 1 }));
        wait(&mut bench, now_s);
    }
    // After a restart the wait begins anew.
    let mut bench = restarted(bench);
    permitted(&mut bench, &RATE, &Answer::Refused(Refusal::Wait { wait_s: 600 }));
    wait(&mut bench, 600);
    permitted(&mut bench, &RATE, &TAKEN);
    for _ in 0..3 {
        assert_eq!(wrong(&mut bench), 0);
    }
}

#[test]
fn the_right_pin_never_waits_however_often_the_power_goes() {
    let mut bench = locked();
    for _ in 0..40 {
        permitted(&mut bench, &RATE, &TAKEN);
        permitted(&mut bench, &RATE, &TAKEN);
        bench = restarted(bench);
    }
}

/// The signature of the bytes of a request.
fn proof(key: &SecretKey, lock: Challenge) -> [u8; 64] {
    key.permit(lock, 1, &Request::EraseKey).expect("it fits")
}

fn tried(store: &mut Store<Flash<4>>, key: &SecretKey) -> (u32, Result<(), PermitError>) {
    let number = store.lock(0).expect("readable").expect("a lock").challenge;
    let signature = proof(key, Challenge { salt: SALT, number });
    let permit = Permit {
        challenge: number,
        signature: &signature,
        sequence: 1,
        body: &[20],
    };
    (number, store.permit(&permit, 0))
}

#[test]
fn a_challenge_never_comes_twice_and_a_wrong_try_counts_wherever_the_power_goes() {
    for starts in [0, 1, 2, 3] {
        let mut first = store(Flash::<4>::new());
        first.save_lock(Some((public(1), SALT))).expect("room");
        let mut flash = first.release();
        let mut used = HashSet::new();
        for _ in 0..starts {
            let mut started = store(flash);
            assert!(used.insert(tried(&mut started, &key(1)).0));
            flash = started.release();
        }
        let mut cuts = 0;
        for tear in (0..4).map(Tear::Bits).chain([Tear::Bytes(2)]) {
            for operations in (0..260).chain([100_000]) {
                let mut cut = store(Flash {
                    power: Power::For(operations),
                    tear,
                    ..flash.clone()
                });
                let (number, outcome) = tried(&mut cut, &key(2));
                let is_verified = matches!(outcome, Err(PermitError::Wrong { .. }));
                cuts += u32::from(!is_verified);
                let mut restarted = store(cut.release().restarted());
                let next = restarted.lock(0).expect("readable").expect("a lock").challenge;
                if is_verified {
                    assert!(next > number, "{next} after {number}, {tear:?}, cut at {operations}");
                }
                assert!(!used.contains(&next));
                // Three more wrong tries than were verified reach a wait.
                let mut tries = 0;
                while !matches!(tried(&mut restarted, &key(2)).1, Err(PermitError::Wait { .. })) {
                    tries += 1;
                }
                assert!(tries + u32::from(is_verified) <= 4, "{tries}, {tear:?}, cut at {operations}");
            }
        }
        assert!(cuts > 4 * 200, "{cuts}");
    }
}

#[test]
fn a_power_cut_in_a_change_of_the_pin_leaves_the_old_one_or_the_new() {
    let mut first = store(Flash::<4>::new());
    first.save_lock(Some((public(1), SALT))).expect("room");
    first.save_table(&L2aTable::default()).expect("room");
    let before = first.release();
    let mut cuts = 0;
    for new in [Some((public(2), SALT)), None] {
        for tear in (0..4).map(Tear::Bits).chain([Tear::Bytes(2)]) {
            for operations in 0.. {
                let mut cut = store(Flash {
                    power: Power::For(operations),
                    tear,
                    ..before.clone()
                });
                let saved = cut.save_lock(new);
                let mut restarted = store(cut.release().restarted());
                assert_eq!(restarted.table(), Ok(Some(L2aTable::default())));
                let is_open = restarted.lock(0).expect("readable").is_none();
                assert!(!is_open || new.is_none());
                if !is_open {
                    let opens: Vec<bool> = [1, 2].map(|pin| tried(&mut restarted, &key(pin)).1.is_ok()).into();
                    assert!(
                        opens == [true, false] || opens == [false, true] && new.is_some(),
                        "cut at {operations}"
                    );
                    assert!(saved.is_err() || opens[1]);
                }
                if saved.is_ok() {
                    break;
                }
                cuts += 1;
            }
        }
    }
    assert!(cuts > 2 * 5 * 200, "{cuts}");
}

#[test]
fn what_cannot_be_counted_is_not_verified() {
    let mut bench = locked();
    let mut flash = bench.store.release();
    flash.power = Power::For(0);
    bench.store = store(flash);
    permitted(&mut bench, &RATE, &Answer::Refused(Refusal::Store));
    assert!(bench.transmitter.symbol_rate().millihertz() == 90_000);
}

#[test]
fn keys_that_are_none_lock_nothing() {
    let mut bench = Bench::new();
    let mut neutral = [0; 32];
    neutral[0] = 1;
    for key in [&[][..], &[1; 31], &[2; 32], &neutral] {
        bench.expect(&Request::WriteLock { key, salt: 1 }, &Answer::Refused(Refusal::LockKey));
    }
    bench.expect(&RATE, &TAKEN);
}

/// Records of the earlier format have half of the length, and no lock.
#[test]
fn what_earlier_firmware_stored_is_read_and_outlives_a_power_cut_in_the_first_save() {
    let mut new = store(Flash::<4>::new());
    new.save_table(&L2aTable::default()).expect("room");
    new.save_key([7; 32], 5).expect("room");
    let record = new.release().bytes[ERASE..ERASE + 508].to_vec();
    let mut before = Flash::<4>::new();
    for (index, place) in before.bytes[..ERASE].chunks_exact_mut(512).take(3).enumerate() {
        let (content, crc) = place.split_last_chunk_mut::<4>().expect("a record");
        content.copy_from_slice(&record);
        content[0] = 1;
        content[1..5].copy_from_slice(&(70 + index as u32).to_le_bytes());
        *crc = crc32c(&[content]).to_le_bytes();
    }
    // The newest is the third: the others have no table.
    for place in before.bytes[..1024].chunks_exact_mut(512) {
        let (content, crc) = place.split_last_chunk_mut::<4>().expect("a record");
        content[5..347].fill(0xff);
        *crc = crc32c(&[content]).to_le_bytes();
    }
    let contents = |flash: Flash<4>| {
        let mut store = store(flash);
        (store.table(), store.key().map(|key| key.is_some()), store.lock(0))
    };
    let kept = (Ok(Some(L2aTable::default())), Ok(true), Ok(None));
    assert_eq!(contents(before.clone()), kept);
    for operations in 0.. {
        let mut cut = store(Flash {
            power: Power::For(operations),
            ..before.clone()
        });
        let saved = cut.save_lock(Some((public(1), SALT)));
        let (table, key, lock) = contents(cut.release().restarted());
        assert_eq!((&table, &key), (&kept.0, &kept.1), "cut at {operations}");
        if saved.is_ok() {
            assert!(lock.expect("readable").is_some());
            assert!(operations > 200);
            break;
        }
    }
}
