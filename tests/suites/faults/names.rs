//! File names of bytes that are not text and would steer a terminal.

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::Path;
use std::process::Command;

use crate::attempt::input;
use crate::commands::Work;
use crate::judge::Reference;
use crate::workshop::Workshop;

/// Clears a terminal, also by its C1 form, and reverses the text after it.
const PREFIX: &[u8] = b"\xff\x1b[2J\xc2\x9b2J\xe2\x80\xae";

/// Whether the command names a file that may have any name.
pub fn has_some(work: &Work) -> bool {
    let is_named = |text: &&str| text.starts_with(['<', '@']);
    work.arguments().any(|text| is_named(&text)) && !work.arguments.contains('%')
}

/// Runs a command with such names: its status is that with plain names, and neither output carries a name's bytes.
pub fn try_all(workshop: &Workshop, known: &Reference) -> Result<(), String> {
    let work = &known.work;
    let folder = workshop.folder();
    let hostile = |name: &str| OsString::from_vec([PREFIX, name.as_bytes()].concat());
    let arguments = work.arguments().map(|text| match text.split_at(1) {
        ("<", name) => {
            let bytes = std::fs::read(folder.path().join(name)).expect("an input");
            std::fs::write(folder.path().join(hostile(name)), bytes).expect("room");
            hostile(name)
        }
        ("@", name) => hostile(name),
        _ => text.into(),
    });
    let arguments: Vec<OsString> = arguments.collect();
    let before = entries(folder.path());
    let mut command = Command::new(workshop.vocc());
    command.args(work.command.split_whitespace()).args(&arguments);
    command.current_dir(folder.path()).stdin(input(work, folder.path()));
    let output = command.output().expect("vocc runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    if output.status.code() != Some(known.status) {
        return Err(format!("{} with plain names, now {}: {errors}", known.status, output.status));
    }
    if entries(folder.path()) == before && !known.written.is_empty() {
        return Err("no file of such a name is written".into());
    }
    for (what, printed) in [("output", &output.stdout), ("errors", &output.stderr)] {
        steers(printed).map_or(Ok(()), |at| Err(format!("{what} steers a terminal: {at}")))?;
    }
    Ok(())
}

/// The first line that is not text, or holds a character that steers a terminal.
fn steers(printed: &[u8]) -> Option<String> {
    let is_steering = |letter: char| letter.is_control() && letter != '\t' || letter == '\u{202e}';
    let lines = printed.split(|&byte| byte == b'\n');
    let steering = |line: &&[u8]| std::str::from_utf8(line).map_or(true, |text| text.contains(is_steering));
    lines.into_iter().find(steering).map(|line| line.escape_ascii().to_string())
}

fn entries(folder: &Path) -> usize {
    std::fs::read_dir(folder).expect("a folder").count()
}

/// Names that steer a terminal are found, and plain text is not.
pub fn passes_nothing_that_steers() {
    assert_eq!(steers("plain: é\tx\n".as_bytes()), None);
    for name in [PREFIX, b"\xff", b"\x1b[2J", "\u{9b}2J".as_bytes(), "\u{202e}".as_bytes(), b"\r"] {
        assert!(steers(&[b"line\n", name, b"\n"].concat()).is_some(), "{}", name.escape_ascii());
    }
}
