//! Runs `vocc` at a serial port.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

/// Result of a `vocc` run.
pub struct Run {
    /// The exit status.
    status: i32,
    /// Standard output.
    output: String,
    /// Standard error.
    errors: String,
}

impl Run {
    /// The only JSON object in its output.
    pub fn json(&self) -> Value {
        let Self { status, output, errors } = self;
        assert_eq!(*status, 0, "{errors}");
        serde_json::from_str(output).unwrap_or_else(|_| panic!("no JSON: {output}, {errors}"))
    }
}

/// Runs `vocc`, the file `program`, in `folder` with `command` and `--json --port PORT`.
pub fn vocc(program: &Path, folder: &Path, command: &[&str], port: &str) -> Run {
    let output = at_port(program, folder, command, port).output().expect("vocc runs");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Run {
        status: output.status.code().unwrap_or(-1),
        output: text(output.stdout),
        errors: text(output.stderr),
    }
}

/// Runs `vocc` like [`vocc`] until it prints a JSON object that satisfies `is_last`, kills it, and returns all objects.
pub fn vocc_until(program: &Path, folder: &Path, command: &[&str], port: &str, is_last: impl Fn(&Value) -> bool) -> Vec<Value> {
    let mut process = at_port(program, folder, command, port)
        .stdout(Stdio::piped())
        .spawn()
        .expect("vocc runs");
    let output = process.stdout.take().expect("standard output is a pipe");
    let mut objects = vec![];
    for line in BufReader::new(output).lines() {
        let line = line.expect("vocc prints text");
        objects.push(serde_json::from_str(&line).unwrap_or_else(|_| panic!("no JSON: {line}")));
        if objects.last().is_some_and(&is_last) {
            break;
        }
    }
    let _ = process.kill();
    let _ = process.wait();
    assert!(objects.last().is_some_and(is_last), "{objects:?}");
    objects
}

/// The timeout exceeds any response time on a busy computer.
fn at_port(program: &Path, folder: &Path, command: &[&str], port: &str) -> Command {
    let mut vocc = Command::new(program);
    vocc.current_dir(folder)
        .args(command)
        .args(["--json", "--timeout", "10", "--port", port]);
    vocc
}
