//! The `vocc` program at a serial port.

use std::path::Path;

use vocc_tests::vocc::Run;

use crate::image::Programs;

/// Runs `vocc` in `folder` with the arguments of `command` and `--json --port PORT`.
pub fn vocc(programs: &Programs, folder: &Path, command: &[&str], port: &str) -> Run {
    vocc_tests::vocc::vocc(&programs.vocc, folder, command, port)
}
