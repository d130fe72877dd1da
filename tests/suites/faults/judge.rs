//! Requirements for a disturbed command.

use std::path::Path;
use std::time::Duration;

use crate::attempt::{self, Outcome};
use crate::commands::{Again, Work};
use crate::fault::{Fault, Signal};
use crate::workshop::{Files, PIPE, Workshop, clear, put};

/// Previous content of an output file.
const OLD: &[u8] = b"what was here before";
/// Time range of the faults for a command that does not run to its end.
const BEGINNING: Duration = Duration::from_secs(2);
/// Suffixes of the files that unfinished work keeps until resumed: a shard's failure, and a search's rounds.
const NOTES: [&str; 2] = [".failed", ".rounds"];
/// A file of estimates up to the end of the run: an interrupted command has learnt less.
const LEARNT: &str = "camera.toml";
/// Files of one frame after another, complete at any number of frames: an interrupted command has fewer.
const TABLE: &str = "pictures/truth.csv";
/// Folders of frames: if the last file exists, all do.
const ARRAYS: &str = "arrays/";
const PICTURES: &str = "pictures/";
const LAST: &str = "frames.json";
const RECORDING: &str = "received.mcap";
/// The first and last bytes of a complete recording.
const MCAP: &[u8] = b"\x89MCAP0\r\n";
/// The kinds of a recording's first and last record, and of the record that ends its data.
const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const DATA_END: u8 = 0x0f;
/// Signal of an aborted program (SIGABRT).
const ABORTED: i32 = 6;

/// A command and its undisturbed outcome.
pub struct Reference {
    /// The command.
    pub work: Work,
    /// Its exit status.
    pub status: i32,
    /// Whether it writes to standard output.
    pub prints: bool,
    /// The files it writes.
    pub written: Files,
    /// Its run time.
    pub time: Duration,
    /// Whether an undisturbed run exists for comparison.
    is_seen: bool,
}

impl Reference {
    /// From an undisturbed run.
    pub fn of(workshop: &Workshop, work: Work) -> Self {
        let folder = workshop.folder();
        let outcome = attempt::run(workshop, &work, None, false, folder.path());
        let status = outcome.status.code().expect("a status");
        assert!(status == 0 || work.again != Again::Resumes, "{}", outcome.errors);
        Self {
            work,
            status,
            prints: outcome.has_printed == Some(true),
            written: workshop.written(folder.path()),
            time: outcome.time,
            is_seen: true,
        }
    }

    /// For a command without an undisturbed run.
    pub fn unseen(work: Work) -> Self {
        Self {
            work,
            status: 0,
            prints: false,
            written: Files::new(),
            time: BEGINNING,
            is_seen: false,
        }
    }

    fn resumes(&self) -> bool {
        self.work.again == Again::Resumes
    }

    /// Size of its largest file in bytes.
    pub fn largest(&self) -> u64 {
        let sizes = self.written.values().map(|bytes| bytes.len() as u64);
        sizes.max().unwrap_or(0)
    }

    /// Whether a fault applies to it.
    pub fn can_suffer(&self, fault: Fault) -> bool {
        let writes_file = |text: &str| text.starts_with('@') && !text.ends_with('/');
        match fault {
            Fault::FullDevice => self.work.again == Again::Replaces && self.work.arguments().any(writes_file),
            Fault::ReadOnlyPlace => self.work.writes(),
            Fault::FullOutput => self.prints,
            Fault::FileLimit(_) => self.work.writes(),
            Fault::ClosedOutput | Fault::OneLineRead | Fault::AddressSpace(_) => self.is_seen,
            _ => true,
        }
    }

    /// Runs the command under a fault, and then undisturbed.
    pub fn suffer(&self, workshop: &Workshop, fault: Fault, over_old: bool, patience: Duration) -> Result<Option<Duration>, String> {
        let folder = workshop.folder();
        let over_old = over_old && self.work.again == Again::Replaces;
        if over_old {
            self.written.keys().for_each(|name| put(folder.path(), name, OLD));
        }
        let outcome = attempt::run(workshop, &self.work, Some(fault), false, folder.path());
        self.ended_well(fault, &outcome, patience)?;
        if !self.is_seen {
            let asides = self.left(workshop, fault, folder.path()).into_keys();
            let aside = asides
                .into_iter()
                .find(|name| name.rsplit('/').next().is_some_and(|name| name.starts_with('.')));
            return aside.map_or(Ok(outcome.after_signal), |name| Err(format!("it left {name}")));
        }
        let left = self.left(workshop, fault, folder.path());
        self.left_well(fault, &outcome, &left, over_old)?;
        if self.work.again == Again::Clears {
            left.keys().for_each(|name| clear(folder.path(), name));
        }
        let again = attempt::run(workshop, &self.work, None, self.resumes(), folder.path());
        if again.status.code() != Some(self.status) {
            return Err(format!("afterwards it ends with {}: {}", again.status, again.errors));
        }
        self.is_whole(&self.left(workshop, fault, folder.path()))
            .map_err(|why| format!("done again, {why}"))?;
        Ok(outcome.after_signal)
    }

    /// Runs the command with a closed standard output, and with one that is closed after a line.
    pub fn go_unread(&self, workshop: &Workshop, patience: Duration) -> Result<(), String> {
        [Fault::ClosedOutput, Fault::OneLineRead].into_iter().try_for_each(|fault| {
            let folder = workshop.folder();
            let outcome = attempt::run(workshop, &self.work, Some(fault), false, folder.path());
            self.ended_well(fault, &outcome, patience)?;
            let left = self.left(workshop, fault, folder.path());
            self.is_whole(&left).map_err(|why| format!("{fault}: {why}"))
        })
    }

    /// The files written to the folder. After SIGKILL, which cannot be handled, excludes temporary files.
    fn left(&self, workshop: &Workshop, fault: Fault, folder: &Path) -> Files {
        let mut left = workshop.written(folder);
        let is_killed = matches!(fault, Fault::Signal(Signal::Kill, _));
        let is_aside = |name: &str| name.rsplit('/').next().is_some_and(|name| name.starts_with('.'));
        left.retain(|name, _| name != PIPE && !(is_killed && is_aside(name)));
        left
    }

    /// Checks for a valid status or the signal sent, no panic, the true cause, and no false success.
    fn ended_well(&self, fault: Fault, outcome: &Outcome, patience: Duration) -> Result<(), String> {
        let said = |why: String| Err(format!("{why}: {}", outcome.errors.trim()));
        let lacked_memory = matches!(fault, Fault::AddressSpace(_)) && has_no_memory(outcome.signal(), &outcome.errors);
        let may_die_of = match fault {
            Fault::Signal(signal, _) | Fault::UnreadErrors(signal, _) => Some(signal.number()),
            Fault::SilentInput(_) => Some(Signal::Interrupt.number()),
            Fault::AddressSpace(_) if lacked_memory => Some(ABORTED),
            _ => None,
        };
        let is_status = outcome.status.code().is_some_and(|status| (0..=2).contains(&status));
        if !is_status && (outcome.signal().is_none() || outcome.signal() != may_die_of) {
            return said(format!("it ended with {}", outcome.status));
        }
        if outcome.errors.contains("panicked") && !lacked_memory {
            return said("it panicked".into());
        }
        if let Some(time) = outcome.after_signal.filter(|time| *time > patience) {
            return said(format!("it took {time:.1?} to end"));
        }
        if matches!(fault, Fault::ClosedOutput | Fault::OneLineRead) && outcome.status.code() != Some(self.status) {
            return said(format!(
                "it ended with {}, and where it is read with {}",
                outcome.status, self.status
            ));
        }
        let causes = fault.causes();
        let is_named = causes.is_empty() || causes.iter().any(|cause| outcome.errors.contains(cause));
        match outcome.status.code() {
            Some(2) if outcome.errors.is_empty() && !matches!(fault, Fault::UnreadErrors(..)) => said("it said nothing".into()),
            Some(2) if self.status != 2 && !is_named => said("it named another cause".into()),
            Some(0 | 1) if matches!(fault, Fault::FullDevice | Fault::ReadOnlyPlace | Fault::FullOutput) => {
                said("it ended as if all were well".into())
            }
            _ => Ok(()),
        }
    }

    /// Checks that files are old or new, with nothing in between and nothing else.
    fn left_well(&self, fault: Fault, outcome: &Outcome, left: &Files, over_old: bool) -> Result<(), String> {
        for (name, bytes) in left {
            let Some(whole) = self.written.get(name) else {
                if self.resumes() && NOTES.iter().any(|note| name.ends_with(note)) {
                    continue;
                }
                return Err(format!("it left {name}"));
            };
            let is_old = over_old && bytes == OLD;
            let is_kept = self.resumes() || !self.work.repeats;
            let is_learnt = matches!(fault, Fault::Signal(..)) && name == LEARNT && keys(bytes) == keys(whole);
            let can_finish = matches!(fault, Fault::Signal(Signal::Interrupt | Signal::Terminate, _));
            let is_shorter = can_finish && is_beginning(name, left, whole);
            if !is_old && !is_kept && !is_learnt && !is_shorter && bytes != whole {
                return Err(format!("{name} is {} bytes of {}", bytes.len(), whole.len()));
            }
        }
        let is_cut = [ABORTED, Signal::Kill.number()].map(Some).contains(&outcome.signal());
        sets_are_whole(&self.written, left, is_cut)?;
        if over_old && left.len() != self.written.len() {
            return Err("an old file is gone".into());
        }
        let has_finished = outcome.status.code() == Some(self.status) && self.status < 2;
        match fault {
            Fault::FileLimit(_) | Fault::AddressSpace(_) if has_finished => self
                .is_whole(left)
                .map_err(|why| format!("it ended as if all were well, but {why}")),
            Fault::ClosedOutput | Fault::OneLineRead => self.is_whole(left),
            _ => Ok(()),
        }
    }

    /// Checks for all files of an undisturbed run, and no others.
    fn is_whole(&self, left: &Files) -> Result<(), String> {
        for (name, whole) in &self.written {
            match left.get(name) {
                None => return Err(format!("{name} is missing")),
                Some(bytes) if self.work.repeats && bytes != whole => {
                    return Err(format!("{name} differs from that of an undisturbed run"));
                }
                Some(_) => {}
            }
        }
        let other = left.keys().find(|name| !self.written.contains_key(*name));
        other.map_or(Ok(()), |name| Err(format!("{name} is left over")))
    }
}

/// Whether the libraries below the program aborted it for lack of memory: Rust's on an allocation or at the start of a thread, or C's.
///
/// Which of them fails first depends on the random layout of the address space.
fn has_no_memory(signal: Option<i32>, errors: &str) -> bool {
    let reasons = ["memory allocation of", "failed to allocate an alternative stack", "out of memory"];
    signal == Some(ABORTED) && reasons.iter().any(|reason| errors.contains(reason)) && panics_of_threads_only(errors)
}

/// Whether each panic is that of a thread without memory for its signal stack.
fn panics_of_threads_only(errors: &str) -> bool {
    let mut parts = errors.split("panicked at ").skip(1);
    parts.all(|part| {
        part.lines()
            .next()
            .is_some_and(|place| place.contains("/library/std/src/sys/pal/unix/stack_overflow.rs:"))
    })
}

/// Checks that folders of frames are complete if they claim to be, and that either all arrays exist or none, unless the program was killed.
fn sets_are_whole(written: &Files, left: &Files, is_cut: bool) -> Result<(), String> {
    for folder in [ARRAYS, PICTURES] {
        let is_told = left.contains_key(&format!("{folder}{LAST}"));
        let is_begun = left.keys().any(|name| name.starts_with(folder));
        let is_owed = is_told || folder == ARRAYS && is_begun && !is_cut;
        let missing = written.keys().find(|name| name.starts_with(folder) && !left.contains_key(*name));
        if let Some(name) = missing.filter(|_| is_owed) {
            return Err(format!("it left a part of {folder}, without {name}"));
        }
    }
    Ok(())
}

/// Whether a file is the result of a command that was interrupted after fewer frames.
fn is_beginning(name: &str, left: &Files, whole: &[u8]) -> bool {
    let bytes = &left[name];
    match name {
        TABLE => {
            let is_picture = |name: &&String| name.starts_with(&format!("{PICTURES}frame-")) && name.ends_with(".png");
            let rows = bytes.iter().filter(|&&byte| byte == b'\n').count();
            let is_told = left.contains_key(&format!("{PICTURES}{LAST}"));
            // The first line names the columns.
            !is_told && bytes.ends_with(b"\n") && whole.starts_with(bytes) && rows == 1 + left.keys().filter(is_picture).count()
        }
        RECORDING => is_recording(bytes) && bytes.len() < whole.len(),
        _ => false,
    }
}

/// Whether a recording is complete: it has records from its first magic bytes to the last, including the first and the last record.
fn is_recording(bytes: &[u8]) -> bool {
    let inner = bytes.strip_prefix(MCAP).and_then(|bytes| bytes.strip_suffix(MCAP));
    let Some(mut rest) = inner else { return false };
    let mut kinds = Vec::new();
    while let Some((&kind, after)) = rest.split_first() {
        let content = after.split_first_chunk().and_then(|(&length, content)| {
            let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
            content.get(length..)
        });
        let Some(next) = content else { return false };
        kinds.push(kind);
        rest = next;
    }
    kinds.first() == Some(&HEADER) && kinds.contains(&DATA_END) && kinds.last() == Some(&FOOTER)
}

/// The keys that a TOML file sets, without comments, and whether its last line is complete.
fn keys(toml: &[u8]) -> (Vec<&[u8]>, bool) {
    let lines = toml.split(|&byte| byte == b'\n');
    let lines = lines.filter(|line| !line.starts_with(b"#"));
    let keys = lines.map(|line| line.split(|&byte| byte == b'=').next().unwrap_or_default());
    (keys.collect(), toml.ends_with(b"\n"))
}

/// Tests the judge itself: it passes no broken file.
pub fn passes_nothing_broken() {
    let files = |names: &[&str]| names.iter().map(|name| (String::from(*name), b"a\n".to_vec())).collect::<Files>();
    let written = files(&["arrays/frames.json", "arrays/frames.npy", "arrays/truth.npy"]);
    let judged = |names: &[&str], is_cut| sets_are_whole(&written, &files(names), is_cut).is_ok();
    assert!(judged(&[], false) && sets_are_whole(&written, &written, false).is_ok());
    assert!(judged(&["arrays/frames.npy"], true) && !judged(&["arrays/frames.npy"], false));
    assert!(!judged(&["arrays/frames.json", "arrays/frames.npy"], true));
    assert!(!judged(&["arrays/frames.npy", "arrays/truth.npy"], false));

    let table = |rows: &[u8], others: &[&str]| {
        let mut left = files(others);
        left.insert(TABLE.into(), rows.into());
        is_beginning(TABLE, &left, b"head\n1\n2\n3\n")
    };
    let pictures = ["pictures/frame-000000.png", "pictures/frame-000001.png"];
    assert!(table(b"head\n1\n2\n", &pictures));
    assert!(!table(b"head\n1\n", &pictures) && !table(b"head\n1\n2", &pictures) && !table(b"head\n1\n3\n", &pictures));
    assert!(!table(b"head\n1\n2\n", &[&pictures[..], &["pictures/frames.json"]].concat()));

    let record = |kind: u8, content: &[u8]| [&[kind][..], &(content.len() as u64).to_le_bytes(), content].concat();
    let recording = |records: &[Vec<u8>]| [MCAP, &records.concat(), MCAP].concat();
    let [header, data, end, footer] = [HEADER, 0x05, DATA_END, FOOTER].map(|kind| record(kind, b"some"));
    let all = [header, data, end, footer];
    assert!(is_recording(&recording(&all)));
    for missing in [0, 2, 3] {
        let some = all
            .iter()
            .enumerate()
            .filter(|(place, _)| *place != missing)
            .map(|(_, record)| record.clone());
        assert!(!is_recording(&recording(&some.collect::<Vec<_>>())), "{missing}");
    }
    assert!(has_no_memory(Some(ABORTED), "memory allocation of 41 bytes failed"));
    assert!(has_no_memory(
        Some(ABORTED),
        "Fatal glibc error: failed to register TLS destructor: out of memory"
    ));
    let thread = "thread '<unnamed>' (7) panicked at /rustc/1/library/std/src/sys/pal/unix/stack_overflow.rs:236:13:\n\
                  failed to allocate an alternative stack: Cannot allocate memory (os error 12)\n";
    assert!(has_no_memory(Some(ABORTED), thread) && !has_no_memory(None, thread));
    let panic = "thread 'main' (8) panicked at cli/src/main.rs:1:1:\nmemory allocation of\n";
    assert!(!has_no_memory(Some(ABORTED), panic) && !has_no_memory(Some(ABORTED), &format!("{thread}{panic}")));
    assert!(!has_no_memory(Some(ABORTED), "it aborted"));

    let whole = recording(&all);
    for at in 0..whole.len() {
        assert!(!is_recording(&[&whole[..at], &whole[at + 1..]].concat()), "{at}");
    }
    assert!(!is_recording(MCAP) && !is_recording(&[MCAP, MCAP].concat()));
}
