//! A computer at the receiver's port.

use std::path::Path;

use serde_json::Value;

use vocc_tests::terminal::Terminal;
use vocc_tests::vocc::vocc;

use crate::image::Programs;
use crate::pair::Pair;

/// What `vocc device status` tells of the receiver.
pub fn status(pair: &mut Pair, programs: &Programs, folder: &Path) -> Value {
    ask(pair, programs, folder, &["device", "status"])
}

fn ask(pair: &mut Pair, programs: &Programs, folder: &Path, words: &[&str]) -> Value {
    pair.real_time(true);
    let terminal = Terminal::open(&pair.socket("receiver"));
    let answer = vocc(&programs.vocc, folder, words, terminal.name()).json();
    pair.real_time(false);
    answer
}
