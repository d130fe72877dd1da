//! Builds the programs under test with a user's commands.

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::JoinHandle;

use crate::trials::Unready;

/// Exit status by which this folder's scripts report that a program is neither installed nor installable.
const ABSENT: i32 = 77;

/// The repository's root.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Builds `vocc` in the profile of the running test.
///
/// Uses `cargo test --workspace`: `cargo build` would select other features of shared packages, and recompile most of them and all crates
/// here.
pub fn vocc() -> Result<PathBuf, Unready> {
    let beside = beside_the_tests()?;
    let optimised = beside.ends_with("release").then_some("--release");
    output(
        Command::new(env!("CARGO"))
            .args(["test", "--quiet", "--locked", "--workspace", "--no-run"])
            .args(["--test", "command_line"])
            .args(optimised),
    )?;
    Ok(beside.join("vocc"))
}

/// The program that `VOCC_PROGRAM` names, or the one built here.
pub fn vocc_given() -> Result<PathBuf, Unready> {
    match std::env::var_os("VOCC_PROGRAM") {
        Some(path) => Ok(std::fs::canonicalize(path)?),
        None => vocc(),
    }
}

/// Reads text to its end, beside other work.
pub fn read_aside(from: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut from) = from {
            let _ = from.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Cargo's output folder for the profile of the running test.
fn beside_the_tests() -> Result<PathBuf, Unready> {
    let test = std::env::current_exe()?;
    let folder = test.parent().and_then(Path::parent);
    folder
        .map(Path::to_owned)
        .ok_or_else(|| Unready::Failed(format!("{} lies in no target folder", test.display())))
}

/// `vocc link` with `frames` small frames of the day preset, saved to a folder.
pub fn link(vocc: &Path, folder: &Path, message: &str, frames: u64) -> Command {
    let mut link = Command::new(vocc);
    link.args("link day --level fast --set camera.width_px=320 --set camera.height_px=240".split(' '));
    link.args(["--message", message, "--frames", &frames.to_string(), "--save"])
        .arg(folder);
    link
}

/// Ensures that a program is installed.
pub fn provide(program: &str) -> Result<(), Unready> {
    output(Command::new("bash").args(["tests/tools/provide", program])).map(drop)
}

/// Runs a command in the repository's root and returns its output.
pub fn output(command: &mut Command) -> Result<String, Unready> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command
        .current_dir(root())
        .stdin(Stdio::null())
        .output()
        .map_err(|error| match error.kind() {
            ErrorKind::NotFound => Unready::Absent(format!("{name} is missing")),
            _ => Unready::Failed(format!("{name} cannot be run: {error}")),
        })?;
    let errors = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        Some(ABSENT) => Err(Unready::Absent(errors.trim().to_owned())),
        _ => Err(Unready::Failed(format!("{name} failed: {errors}"))),
    }
}
