//! Messages are bytes. Text output adds hexadecimal digits for bytes that text cannot represent, and escapes what terminals interpret.

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bytes as hexadecimal digits if they are not UTF-8.
pub fn hex_if_no_text(bytes: &[u8]) -> Option<String> {
    str::from_utf8(bytes).is_err().then(|| hex(bytes))
}

/// Whether a terminal interprets a character instead of showing it: C0, DEL, C1, line separators and bidirectional controls.
pub fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_text_holds_is_told() {
        assert_eq!(hex_if_no_text("Brücke".as_bytes()), None);
        assert_eq!(hex_if_no_text(&[0xff, 1]).as_deref(), Some("ff01"));
    }
}
