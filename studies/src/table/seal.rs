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
    let mut lines = text.split_inclusive('\n');
    let before: usize = lines.by_ref().take_while(|line| !is_seal(line)).map(str::len).sum();
    let (before, last) = text.split_at(before);
    let wanted = checksum::of(before.as_bytes());
    match last.is_empty() || last.trim_end().strip_prefix(MARK) == Some(&*wanted) {
        true => Ok(()),
        false => Err(Fault::Changed { wanted }),
    }
}

/// Whether a line is a last line; another comment may begin in the same way.
fn is_seal(line: &str) -> bool {
    let sum = line.trim_end().strip_prefix(MARK);
    sum.is_some_and(|sum| sum.len() == 16 && sum.bytes().all(|digit| digit.is_ascii_hexdigit()))
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
        for at in 0..TEXT.trim_end().len() {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 1;
            verify(&String::from_utf8(bytes).unwrap()).unwrap_err();
        }
        // Only a whole line is the checksum.
        for other in ["# checksum of run 3\n", "tables = [\"a # checksum b.toml\"]\n"] {
            verify(&format!("{other}{TEXT}")).unwrap();
            verify(&sealed(&format!("{other}{TEXT}"))).unwrap();
        }
        verify(&(text.clone() + "cells = []\n")).unwrap_err();
        verify(&text.replacen("2.0", "3.0", 1)).unwrap_err();
        verify(&text.replacen("# a table\n", "", 1)).unwrap_err();
    }
}
