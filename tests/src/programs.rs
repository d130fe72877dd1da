//! The programs that tests run, made by the commands that a user would give.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The repository's root.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Builds `vocc` in the profile that the running test was built with.
///
/// # Errors
/// What is missing on this computer, in words.
pub fn vocc() -> Result<PathBuf, String> {
    let beside = beside_the_tests()?;
    let optimised = beside.ends_with("release").then_some("--release");
    output(
        Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--locked", "--bin", "vocc"])
            .args(optimised),
    )?;
    Ok(beside.join("vocc"))
}

/// Where Cargo puts programs of the profile that the running test was built with.
fn beside_the_tests() -> Result<PathBuf, String> {
    let test = std::env::current_exe().map_err(|error| error.to_string())?;
    let folder = test.parent().and_then(Path::parent);
    folder
        .map(Path::to_owned)
        .ok_or(format!("{} lies in no target folder", test.display()))
}

/// Runs a command in the repository's root and returns what it prints.
///
/// # Errors
/// Why it failed, in words.
pub fn output(command: &mut Command) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command
        .current_dir(root())
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("{name} cannot be run: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!(
            "{name} failed: {}",
            String::from_utf8_lossy(&output.stderr)
        ))
    }
}
