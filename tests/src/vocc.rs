//! The `vocc` program at a serial port.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What a run of `vocc` left.
pub struct Run {
    /// The exit status.
    status: i32,
    /// Standard output.
    output: String,
    /// Standard error.
    errors: String,
}

impl Run {
    /// The one JSON object that it printed.
    ///
    /// # Panics
    /// When it failed, or printed none.
    pub fn json(&self) -> Value {
        let Self {
            status,
            output,
            errors,
        } = self;
        assert_eq!(*status, 0, "{errors}");
        serde_json::from_str(output).unwrap_or_else(|_| panic!("no JSON: {output}, {errors}"))
    }
}

/// Runs `vocc`, which is the file `program`, in `folder` with the words of `command` and `--json --port PORT`.
///
/// # Panics
/// When it cannot be run.
pub fn vocc(program: &Path, folder: &Path, command: &[&str], port: &str) -> Run {
    let output = Command::new(program)
        .current_dir(folder)
        .args(command)
        .args(["--json", "--port", port])
        .output()
        .expect("vocc runs");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Run {
        status: output.status.code().unwrap_or(-1),
        output: text(output.stdout),
        errors: text(output.stderr),
    }
}
