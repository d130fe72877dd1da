//! The last line of a searched table: a checksum of the lines above, which detects later changes.

use sim::l2a::file::Fault;

use crate::checksum;

/// The beginning of the last line.
const MARK: &str = "# checksum ";

/// A text with its last line.
pub fn sealed(text: &str) -> String {
    format!("{text}{MARK}{}\n", checksum::of(text.as_bytes()))
}

/// Verifies the last line of a text. A text without one is of an earlier version, or somebody's own table.
///
/// # Errors
/// If the text was changed after it was written.
pub fn verify(text: &str) -> Result<(), Fault> {
    // Git and editors may change the line ends.
    let text = text.replace("\r\n", "\n");
    let Some((before, last)) = text.split_once(MARK) else {
        return Ok(());
    };
    let wanted = checksum::of(before.as_bytes());
    match last.trim_end() == wanted {
        true => Ok(()),
        false => Err(Fault::Changed { wanted }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a table\nl2a = [[2.0]]\n";

    #[test]
    fn any_byte_that_is_changed_is_noticed() {
        let text = sealed(TEXT);
        verify(&text).unwrap();
        verify(&text.replace('\n', "\r\n")).unwrap();
        verify(TEXT).unwrap();
        for at in 0..text.trim_end().len() {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 1;
            let changed = String::from_utf8(bytes).unwrap();
            // Without its mark the line is a comment.
            let has_mark = changed.contains(MARK);
            assert_eq!(verify(&changed).is_err(), has_mark, "{at}: {changed}");
        }
        verify(&(text.clone() + "cells = []\n")).unwrap_err();
        verify(&text.replacen("2.0", "3.0", 1)).unwrap_err();
        verify(&text.replacen("# a table\n", "", 1)).unwrap_err();
    }
}
