//! `vocc` run as its users run it.
#![allow(dead_code, reason = "no test needs all of it")]

#[cfg(target_os = "linux")]
pub mod bounded;
#[cfg(target_os = "linux")]
pub mod ffmpeg;
pub mod grey_card;
pub mod recording;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The program.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vocc"));
    command.args(arguments);
    command
}

/// What the program prints, and how it ends.
pub fn vocc(arguments: &[&str]) -> Output {
    command(arguments).output().expect("vocc runs")
}

/// Writes the private key of truck 12 to a file, or another one if that is named `other`, and a file that trusts it. The keys are always
/// the same, because signatures decide which panels a camera sees.
pub fn write_key(key: &str, trusted: &str) {
    let (public, secret) = if key.ends_with("other.toml") {
        (
            "8e8e228fe722cf315dfe0608807f5a6d965a0171a9181edc75b623e659620ab4",
            "c8c3de781c2ecd6e8e8f6742655b5bf6b77786da88618b94b0a110f4ddabb98f",
        )
    } else {
        (
            "80bafe5ab9dbbb0958760954b8d6019c1f16aa6caf9eed2ba533caececea7e4e",
            "76a9b3af16eff1491fa7489351e3199f245aed57af308c2ed9c3f6741e24967f",
        )
    };
    let public = format!("name = \"truck 12\"\npublic = \"{public}\"\n");
    std::fs::write(trusted, format!("[[key]]\n{public}")).expect("a file");
    std::fs::write(key, format!("{public}secret = \"{secret}\"\n")).expect("a file");
    // Other users must not read it.
    #[cfg(unix)]
    std::fs::set_permissions(key, std::os::unix::fs::PermissionsExt::from_mode(0o600)).expect("it is ours");
}

/// A folder of one test's own, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// The paths of names in a folder of one test's own, empty, as arguments.
pub fn paths(folder_name: &str) -> impl Fn(&str) -> String {
    let folder = folder(folder_name);
    move |file| name(&folder.join(file)).into()
}

/// How a command ends whose output nobody reads.
pub fn unread(command: &mut Command) -> Option<i32> {
    let mut run = command.stdout(Stdio::piped()).spawn().expect("vocc runs");
    drop(run.stdout.take());
    run.wait().expect("vocc ends").code()
}

/// The arguments of a command line, none of which has a blank.
pub fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// A path as an argument.
pub fn name(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// One object on standard output.
pub fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}{}", text(&output.stdout), text(&output.stderr)))
}

/// An object a line on standard output.
pub fn json_lines(output: &Output) -> Vec<serde_json::Value> {
    let line = |line: &str| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
    text(&output.stdout).lines().map(line).collect()
}

/// Asserts an exit status, no panic, and words on standard error.
pub fn says(output: &Output, status: i32, words: &[&str]) {
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{error}");
    assert!(!error.contains("panicked"), "{error}");
    for word in words {
        assert!(error.contains(word), "{word:?} is not in: {error}");
    }
}

/// Asserts that a command is refused with exit status 2 and all of `words` in the error.
pub fn refused(arguments: &[&str], words: &[&str]) {
    says(&vocc(arguments), 2, words);
}
