//! Files and streams of every kind that `vocc` reads, damaged at random: each ends with an answer or with an error that says why, soon, in
//! little memory, and without a character that a terminal would obey.
//!
//! ```text
//! cargo test -p vocc-tests --test damaged                                        # as the gate does
//! VOCC_DAMAGE_SECONDS=900 cargo test -p vocc-tests --test damaged                # other ones for so long; prints the seed
//! VOCC_DAMAGE_SEED=7 VOCC_DAMAGE_CASE=1234 cargo test -p vocc-tests --test damaged   # one of them; says where its file is
//! ```
//!
//! `VOCC_PROGRAM` names a program that is already built.
#![cfg(target_os = "linux")]

mod board;
mod damage;
mod judge;
mod kinds;
mod workshop;

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant, UNIX_EPOCH};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vocc_tests::trials::{self, number};
use vocc_tests::{programs, tests};

use damage::damaged;
use kinds::KINDS;
use workshop::Workshop;

/// Cases of each kind in the gate.
const FEW: u64 = 3;
/// Cases at a time.
const AT_ONCE: usize = 2;

type Test = fn(&Workshop);

fn main() -> ExitCode {
    let tests = tests![what_is_whole_is_read, what_is_damaged_is_read_or_refused];
    trials::run("damaged", Some(1), tests, || programs::vocc_given().map(Workshop::new))
}

/// Each kind is read to its end before it is damaged, so that damage to it means something.
fn what_is_whole_is_read(workshop: &Workshop) {
    let faults = trials::faults(KINDS.iter(), AT_ONCE, |kind| {
        match workshop.run(kind, &workshop.whole(kind), None, false) {
            Ok(ended) if ended.status == kind.status && ended.says(kind.word) => Ok(()),
            Ok(ended) => Err(format!("{}: {}: {}{}", kind.name, ended.status, ended.printed, ended.errors)),
            Err(why) => Err(format!("{}: {why}", kind.name)),
        }
    });
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn what_is_damaged_is_read_or_refused(workshop: &Workshop) {
    let time = number("VOCC_DAMAGE_SECONDS").map(Duration::from_secs);
    let seed = number("VOCC_DAMAGE_SEED").unwrap_or_else(|| match time {
        Some(_) => UNIX_EPOCH
            .elapsed()
            .map_or(0, |since| u64::from(since.subsec_nanos()) ^ since.as_secs() & u64::from(u32::MAX)),
        None => 1,
    });
    let all = number("VOCC_DAMAGE_CASE").map(|case| case..case + 1);
    let all = all.unwrap_or(0..time.map_or(FEW * KINDS.len() as u64, |_| u64::MAX));
    if time.is_some() {
        eprintln!("seed {seed}");
    }
    let (begun, ends) = (Instant::now(), Mutex::new(BTreeMap::<_, u64>::new()));
    let is_one = all.end - all.start == 1;
    let cases = all.take_while(|_| time.is_none_or(|time| begun.elapsed() <= time));
    let faults = trials::faults(cases, AT_ONCE, |case| {
        let (what, ended) = damage_one(workshop, seed, case, is_one);
        let status = ended
            .map_err(|why| format!("{what}: {why}"))
            .inspect_err(|fault| eprintln!("{fault}"))?;
        *ends.lock().expect("nobody panics").entry(status).or_default() += 1;
        Ok(())
    });
    eprintln!(
        "ends of seed {seed} by exit status: {:?}",
        ends.into_inner().expect("nobody panics")
    );
    assert!(faults.is_empty(), "{}:\n{}", faults.len(), faults.join("\n"));
}

/// Damages a kind and runs its command: what it is, and its exit status. Cases are reproducible individually, but for what a board answers:
/// that is damaged by pieces as they come.
fn damage_one(workshop: &Workshop, seed: u64, case: u64, keeps: bool) -> (String, Result<i32, String>) {
    let random = &mut ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1 << 32) ^ case);
    let kind = &KINDS[(case % KINDS.len() as u64) as usize];
    let what = format!("case {case} of seed {seed}: {}", kind.name);
    let damage = damaged(&workshop.whole(kind), random);
    if keeps {
        let path = std::env::temp_dir().join(format!("damaged-{seed}-{case}"));
        std::fs::write(&path, &damage).expect("room");
        eprintln!("{what}: {}", path.display());
    }
    let as_json = random.random_range(0..2u32) == 0;
    let ended = workshop.run(kind, &damage, Some(random), as_json);
    (what, ended.and_then(|ended| judge::judged(&ended, as_json)))
}
