//! What may come of a damaged file.

use crate::workshop::Ended;

/// Whether it ended as it should: its exit status if so.
pub fn judged(ended: &Ended, as_json: bool) -> Result<i32, String> {
    let said = |why: &str| Err(format!("{why}: exit status {}, {}", ended.status, ended.errors.trim()));
    if ended.errors.contains("panicked") || ended.errors.contains("memory allocation of") {
        return said("it broke down");
    }
    if !(0..=2).contains(&ended.status) {
        return said("it ended otherwise than with 0, 1 or 2");
    }
    if ended.status == 2 && ended.errors.trim().is_empty() {
        return said("it did not say why");
    }
    for (text, of) in [(&ended.printed, "standard output"), (&ended.errors, "standard error")] {
        if let Some(c) = text.chars().find(|&c| is_obeyed(c)) {
            return said(&format!("{:?} is on {of}", c));
        }
    }
    if as_json {
        let is_json = |line: &str| serde_json::from_str::<serde_json::Value>(line).is_ok();
        if let Some(line) = ended.printed.lines().find(|line| !is_json(line)) {
            return said(&format!("{line:?} is not JSON"));
        }
    }
    Ok(ended.status)
}

/// Whether a terminal obeys a character instead of showing it.
fn is_obeyed(c: char) -> bool {
    let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || c.is_control() && !matches!(c, '\n' | '\t')
}
