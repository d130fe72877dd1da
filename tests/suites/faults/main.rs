//! Runs every command of the program under faults: a disk full at any byte, closed output, signals at any time, read-only folders, inputs
//! that never answer, hostile names, and too little memory.
//!
//! ```text
//! cargo test -p vocc-tests --test faults                               # as the gate does
//! export VOCC_PROGRAM=target/release/vocc VOCC_FAULTS=20000 VOCC_FAULT_SEED=7                     # hours of it, other ones
//! cargo test --release -p vocc-tests --test faults
//! VOCC_STREAM_FRAMES=150000 cargo test --release -p vocc-tests --test faults long_stream
//! ```
#![cfg(target_os = "linux")]

mod attempt;
mod commands;
mod fault;
mod judge;
mod long_stream;
mod names;
mod workshop;

use std::collections::{BTreeMap, BTreeSet};
use std::process::{Command, ExitCode};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vocc_tests::trials::{self, number};
use vocc_tests::{programs, tests};

use commands::{ANSWERED, ASIDE, LARGEST, REFUSING, WORKS, Work, listed};
use fault::{Fault, Signal};
use judge::Reference;
use workshop::Workshop;

/// Number of faults in the gate.
const FEW: u64 = 100;
/// Number of frames of a stream in the gate.
const FEW_FRAMES: u64 = 2000;
/// A command ends within one second; the machine gets two more.
const PATIENCE: Duration = Duration::from_secs(3);

/// [`PATIENCE`] times the load per processor, now or in the last minute, a factor from 1 to 10.
fn patience() -> Duration {
    let load = std::fs::read_to_string("/proc/loadavg").ok();
    // "0.20 0.18 0.12 1/80 11206": averages, and the tasks that run now of all.
    let mut words = load.as_deref().unwrap_or_default().split([' ', '/']);
    let [average, now] = [0, 2].map(|skipped| words.nth(skipped).and_then(|word| word.parse().ok()).unwrap_or(0.0));
    let runnable = f64::max(average, now);
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    PATIENCE.mul_f64((runnable / processors as f64).clamp(1.0, 10.0))
}

/// Number of parallel faults.
const AT_ONCE: usize = 2;

type Test = fn(&Workshop);

fn main() -> ExitCode {
    let tests = tests![
        what_is_broken_does_not_pass,
        every_command_is_disturbed,
        a_reader_who_leaves_changes_only_what_he_reads,
        no_name_steers_a_terminal,
        every_command_ends_at_once_at_its_largest,
        nothing_is_lost_whatever_goes_wrong,
        a_long_stream_takes_no_more_memory_and_is_told_of_at_once,
    ];
    trials::run("faults", Some(1), tests, || programs::vocc_given().map(Workshop::new))
}

/// The judge finds fault with broken files.
fn what_is_broken_does_not_pass(_: &Workshop) {
    attempt::sees_work();
    judge::passes_nothing_broken();
    names::passes_nothing_that_steers();
}

/// The tested commands are exactly those in the program's help.
fn every_command_is_disturbed(workshop: &Workshop) {
    let help = |of: &[&str]| {
        let output = Command::new(workshop.vocc()).args(of).arg("--help").output().expect("vocc runs");
        String::from_utf8(output.stdout).expect("text")
    };
    let mut all = BTreeSet::from([String::new()]);
    for command in listed(&help(&[])) {
        let inner = listed(&help(&[&command]));
        if inner.is_empty() {
            all.insert(command);
        } else {
            all.extend(inner.iter().map(|inner| format!("{command} {inner}")));
        }
    }
    for works in [WORKS, LARGEST] {
        let disturbed: BTreeSet<String> = works.iter().map(|work| work.command.into()).collect();
        assert_eq!(disturbed, all);
    }
}

/// A command and its undisturbed outcome. It runs once for all tests.
fn reference(workshop: &Workshop, work: &Work) -> Arc<Reference> {
    static KNOWN: Mutex<BTreeMap<(&str, &str), Arc<Reference>>> = Mutex::new(BTreeMap::new());
    let key = (work.command, work.arguments);
    let known = KNOWN.lock().expect("nobody panics").get(&key).cloned();
    known.unwrap_or_else(|| {
        let known = Arc::new(Reference::of(workshop, *work));
        KNOWN.lock().expect("nobody panics").insert(key, Arc::clone(&known));
        known
    })
}

/// Checks some commands, a few in parallel.
fn all(works: &[&Work], check: impl Fn(&Work) -> Result<(), String> + Sync) {
    let faults = trials::faults(works.iter(), AT_ONCE, |work| {
        check(work).map_err(|why| format!("{} {}: {why}", work.command, work.arguments))
    });
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), works.len(), faults.join("\n"));
}

/// If the reader closes standard output, every command still completes its files and returns its status.
fn a_reader_who_leaves_changes_only_what_he_reads(workshop: &Workshop) {
    let works = WORKS.iter().filter(|work| !work.is_slow);
    let works: Vec<&Work> = works.chain(REFUSING).chain(ASIDE).chain(ANSWERED).collect();
    all(&works, |work| reference(workshop, work).go_unread(workshop, patience()));
    for work in REFUSING {
        assert_ne!(reference(workshop, work).status, 0, "{work:?} is to be refused");
    }
    for work in ANSWERED {
        assert_ne!(reference(workshop, work).status, 2, "{work:?} is to be answered");
    }
}

/// Every command reads and writes files of any name, and prints none that steers a terminal.
fn no_name_steers_a_terminal(workshop: &Workshop) {
    let works = WORKS.iter().chain(REFUSING).chain(ASIDE);
    let works: Vec<&Work> = works.filter(|work| !work.is_slow && names::has_some(work)).collect();
    all(&works, |work| names::try_all(workshop, &reference(workshop, work)));
}

/// A stop at once, during the work or at any other time ends every command, whether or not its errors are read.
fn every_command_ends_at_once_at_its_largest(workshop: &Workshop) {
    all(&LARGEST.iter().collect::<Vec<_>>(), |&work| {
        let known = Reference::unseen(work);
        let seed = work.arguments.bytes().fold(number("VOCC_FAULT_SEED").unwrap_or(1), |seed, byte| {
            seed.wrapping_mul(31).wrapping_add(byte.into())
        });
        let any = ChaCha8Rng::seed_from_u64(seed).random_range(0..3000);
        let after = Duration::from_millis;
        let stops = [
            Fault::Signal(Signal::Interrupt, after(100)),
            Fault::Signal(Signal::Terminate, after(1200)),
            Fault::Signal(Signal::Interrupt, after(any)),
            Fault::UnreadErrors(Signal::Terminate, after(500)),
        ];
        stops.into_iter().try_for_each(|fault| {
            known
                .suffer(workshop, fault, false, patience())
                .map(drop)
                .map_err(|why| format!("{fault}: {why}"))
        })
    });
}

fn nothing_is_lost_whatever_goes_wrong(workshop: &Workshop) {
    let (count, seed) = (number("VOCC_FAULTS").unwrap_or(FEW), number("VOCC_FAULT_SEED").unwrap_or(1));
    let is_gate = count == FEW;
    let known = |work: &Work| match work.is_slow && is_gate {
        true => Arc::new(Reference::unseen(*work)),
        false => reference(workshop, work),
    };
    let known: Vec<Arc<Reference>> = WORKS.iter().map(known).collect();
    let counts = Mutex::new(BTreeMap::<&str, u64>::new());
    let longest = Mutex::new((Duration::ZERO, String::new()));
    let faults = trials::faults(0..count, AT_ONCE, |trial| {
        // Trials are reproducible individually.
        let random = &mut ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1 << 32) ^ trial);
        let (known, fault, over_old) = draw(&known, random);
        let what = format!("fault {trial} of seed {seed}: {:?}: {fault}", known.work.command);
        *counts.lock().expect("nobody panics").entry(kind(fault)).or_default() += 1;
        let time = known.suffer(workshop, fault, over_old, patience());
        let time = time.map_err(|why| format!("{what}: {why}"))?;
        let mut longest = longest.lock().expect("nobody panics");
        if let Some(time) = time.filter(|time| *time > longest.0) {
            *longest = (time, what);
        }
        Ok(())
    });
    let (time, of) = longest.into_inner().expect("nobody panics");
    eprintln!("{count} faults of seed {seed}: {:?}", counts.into_inner().expect("nobody panics"));
    eprintln!("the longest way to an end after a signal: {time:.2?}, {of}");
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
}

fn a_long_stream_takes_no_more_memory_and_is_told_of_at_once(workshop: &Workshop) {
    long_stream::run(workshop, number("VOCC_STREAM_FRAMES").unwrap_or(FEW_FRAMES));
}

/// A random command by relative frequency, and a fault for it.
fn draw<'a>(known: &'a [Arc<Reference>], random: &mut impl Rng) -> (&'a Reference, Fault, bool) {
    let turns = known.iter().flat_map(|known| (0..known.work.turns).map(move |_| &**known));
    let turns: Vec<&Reference> = turns.collect();
    let known = turns[random.random_range(0..turns.len())];
    loop {
        let fault = Fault::draw(random, known.time, known.largest(), known.work.inputs());
        if known.can_suffer(fault) {
            return (known, fault, random.random_range(0..2u32) == 0);
        }
    }
}

fn kind(fault: Fault) -> &'static str {
    match fault {
        Fault::FileLimit(_) => "disk full",
        Fault::AddressSpace(_) => "little memory",
        Fault::FullOutput => "output full",
        Fault::ClosedOutput | Fault::OneLineRead => "output closed",
        Fault::FullDevice => "device full",
        Fault::ReadOnlyPlace => "read-only place",
        Fault::SilentInput(_) => "silent input",
        Fault::Signal(..) => "signal",
        Fault::UnreadErrors(..) => "unread errors",
    }
}
