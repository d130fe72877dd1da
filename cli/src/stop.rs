//! Handles Ctrl-C and the other signals that end a program.
//!
//! A command that keeps its finished work requests [`stop`] and ends by itself as soon as the flag is set, from all loops down to the
//! single frame. Work that takes longer is abandoned, and all other commands end at once, as without a handler. In any case no file is left
//! half written.

use std::io::{BufRead, Read};
use std::path::Path;
use std::process::{Child, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Context;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;
use studies::stop::Stop;

use crate::output::{self, Verdict};

/// Whether a signal has arrived.
static ASKED: AtomicBool = AtomicBool::new(false);
/// Whether the command ends by itself on a signal.
static IS_HEARD: AtomicBool = AtomicBool::new(false);
/// Whether the program must end now.
static IS_OVERDUE: AtomicBool = AtomicBool::new(false);
/// Whether a file has been written.
static HAS_WRITTEN: AtomicBool = AtomicBool::new(false);
/// Whether the command has returned, and only its error is left to print.
static IS_DONE: AtomicBool = AtomicBool::new(false);
/// Locked while a file is written.
static WRITING: Mutex<()> = Mutex::new(());

/// A child process.
static OTHER: Mutex<Option<Child>> = Mutex::new(None);

/// Time for a command to end by itself, so that the program ends within a second.
const PATIENCE: Duration = Duration::from_millis(900);
/// Interval between two checks of the flag while no data arrive.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Bytes per read from a source that may block forever.
const PIECE: usize = 1 << 18;

/// Handles the signals until the program ends.
pub fn watch() -> anyhow::Result<()> {
    let mut watched = vec![SIGINT, SIGTERM];
    // `nohup` keeps a program running after its terminal closes.
    if !is_ignored(SIGHUP) {
        watched.push(SIGHUP);
    }
    let mut signals = Signals::new(watched).context("cannot watch for Ctrl-C")?;
    let watching = std::thread::Builder::new().spawn(move || signals.forever().for_each(end));
    watching.context("cannot watch for Ctrl-C")?;
    Ok(())
}

/// Whether the parent process set this signal to be ignored.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status
        .lines()
        .find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    ignored.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

fn end(signal: i32) {
    ASKED.store(true, Ordering::Relaxed);
    let is_heard = IS_HEARD.load(Ordering::Relaxed);
    if is_heard {
        std::thread::sleep(PATIENCE);
    }
    IS_OVERDUE.store(true, Ordering::Relaxed);
    let _whole = writing();
    if is_heard {
        end_other();
        last_words();
        std::process::exit(1);
    }
    // Does not return.
    let _ = emulate_default_handler(signal);
}

/// Reports that the command was interrupted, unless it has ended meanwhile; then only lets it exit. Nobody may be reading standard error,
/// and the command itself may wait there: another waiting thread delays nothing.
fn last_words() {
    let (sender, told) = sync_channel(1);
    let telling = std::thread::Builder::new().spawn(move || {
        // On a busy machine it may start late.
        let _ = sender.send(());
        match IS_DONE.load(Ordering::Relaxed) {
            true => std::thread::sleep(PATIENCE),
            false => output::tell(overdue(HAS_WRITTEN.load(Ordering::Relaxed))),
        }
        drop(sender);
    });
    if telling.is_ok() {
        let _ = told.recv();
        let _ = told.recv_timeout(LOOK_EVERY);
    }
}

fn overdue(has_written: bool) -> &'static str {
    match has_written {
        true => "vocc: interrupted; the files that were complete are kept",
        false => "vocc: interrupted",
    }
}

/// Notes that a file has been written.
pub fn written() {
    HAS_WRITTEN.store(true, Ordering::Relaxed);
}

/// Notes that the command has returned.
pub fn done() {
    IS_DONE.store(true, Ordering::Relaxed);
}

/// The stop flag, for a command that ends by itself with its finished work.
pub fn stop() -> Stop {
    IS_HEARD.store(true, Ordering::Relaxed);
    Stop::at(&ASKED)
}

/// Prints the place of an interrupted command's saved work, and that only `--resume` draws it.
pub fn interrupted(kept: &Path) -> Verdict {
    output::tell(format_args!(
        "interrupted: {} keeps the finished part; continue with --resume, which draws it",
        kept.display()
    ));
    Verdict::No
}

/// Blocks the program's exit until the guard is dropped, so that files are written atomically.
pub fn writing() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Refuses further writes once the program must end; a file in progress holds [`writing`] and is completed.
pub fn allow() -> std::io::Result<()> {
    match IS_OVERDUE.load(Ordering::Relaxed) {
        true => Err(std::io::Error::other("interrupted")),
        false => Ok(()),
    }
}

/// Blocks if the program must end, so that no later error is printed.
pub fn give_way() {
    while IS_OVERDUE.load(Ordering::Relaxed) {
        std::thread::park();
    }
}

/// Registers a child process to be killed with this one, or on [`end_other`].
pub fn end_with(other: Child) {
    end_other();
    *started() = Some(other);
}

/// Kills the child process, if it still runs.
pub fn end_other() {
    if let Some(mut other) = started().take() {
        let _ = other.kill();
        let _ = other.wait();
    }
}

/// The child's exit status; `None` if a signal arrives first, or if it is unavailable.
pub fn wait_for_other() -> Option<ExitStatus> {
    while !ASKED.load(Ordering::Relaxed) {
        let status = started().as_mut()?.try_wait();
        match status {
            Ok(None) => std::thread::sleep(LOOK_EVERY),
            ended => return ended.ok().flatten(),
        }
    }
    None
}

fn started() -> MutexGuard<'static, Option<Child>> {
    OTHER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Input from a source that may block forever; ends on a stop request.
pub struct Input {
    pieces: Receiver<std::io::Result<Vec<u8>>>,
    piece: Vec<u8>,
    taken: usize,
    stop: Stop,
}

impl Input {
    /// Input from a source that another thread reads.
    pub fn new(source: impl Read + Send + 'static, stop: Stop) -> std::io::Result<Self> {
        let (sender, pieces) = sync_channel(2);
        std::thread::Builder::new().spawn(move || read_all(source, &sender))?;
        Ok(Self {
            pieces,
            piece: Vec::new(),
            taken: 0,
            stop,
        })
    }

    /// The next piece; empty at the end of the source or on a stop request.
    fn next(&self) -> std::io::Result<Vec<u8>> {
        while !self.stop.is_asked() {
            match self.pieces.recv_timeout(LOOK_EVERY) {
                Ok(piece) => return piece,
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
        Ok(Vec::new())
    }
}

fn read_all(mut source: impl Read, to: &SyncSender<std::io::Result<Vec<u8>>>) {
    loop {
        let mut piece = vec![0; PIECE];
        let read = source.read(&mut piece).map(|length| {
            piece.truncate(length);
            piece
        });
        let is_last = match &read {
            Ok(piece) => piece.is_empty(),
            Err(error) => error.kind() != std::io::ErrorKind::Interrupted,
        };
        // The receiver was dropped.
        if to.send(read).is_err() || is_last {
            return;
        }
    }
}

impl BufRead for Input {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.taken == self.piece.len() {
            (self.piece, self.taken) = (self.next()?, 0);
        }
        Ok(&self.piece[self.taken..])
    }

    fn consume(&mut self, length: usize) {
        self.taken += length;
    }
}

impl Read for Input {
    fn read(&mut self, room: &mut [u8]) -> std::io::Result<usize> {
        let mut there = self.fill_buf()?;
        let length = there.read(room)?;
        self.consume(length);
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A source that never returns.
    struct Silent;

    impl Read for Silent {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            loop {
                std::thread::park();
            }
        }
    }

    #[test]
    fn all_that_comes_in_is_read_to_its_end() {
        let sent: Vec<u8> = (0..3 * PIECE + 7).map(|k| k as u8).collect();
        let mut read = Vec::new();
        let mut input = Input::new(std::io::Cursor::new(sent.clone()), Stop::NEVER).expect("a thread");
        input.read_to_end(&mut read).expect("read");
        assert!(read == sent);
        assert_eq!(input.read(&mut [0]).expect("the end"), 0);
    }

    #[test]
    fn a_source_that_never_answers_can_be_ended() {
        static FLAG: AtomicBool = AtomicBool::new(false);
        let mut input = Input::new(Silent, Stop::at(&FLAG)).expect("a thread");
        let reader = std::thread::spawn(move || input.read(&mut [0]));
        FLAG.store(true, Ordering::Relaxed);
        assert_eq!(reader.join().expect("ends").expect("the end"), 0);
    }
}
