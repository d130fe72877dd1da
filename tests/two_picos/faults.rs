//! What goes wrong on the way, and that the receiver reads on.

use std::path::Path;

use serde_json::json;

use crate::image::Programs;
use crate::pair::{Event, Pair};
use crate::talk::{ARRIVES_IN_S, send, talking};

/// Another text, since one that is repeated is given out once, arrives.
fn reads_on(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let from = pair.record.len();
    send(pair, programs, folder, "Hello again");
    let is_there = |event: &Event| event.text.as_deref() == Some("message: Hello again");
    if !pair.record[from..].iter().any(is_there) {
        pair.wait_for("message: Hello again", ARRIVES_IN_S);
    }
}

/// Lines through the panel are lost, in every frame for a while.
pub fn frames_with_a_lost_line_are_left_out(programs: &Programs, folder: &Path) {
    let mut pair = talking(programs, folder);
    pair.tell(&json!({ "lost_lines": [55] }));
    pair.run_ms(3_000);
    pair.tell(&json!({ "lost_lines": [] }));
    reads_on(&mut pair, programs, folder);
    let resets = pair
        .record
        .iter()
        .filter_map(|event| event.reset.as_deref());
    assert_eq!(resets.collect::<Vec<_>>(), [""; 0]);
}
