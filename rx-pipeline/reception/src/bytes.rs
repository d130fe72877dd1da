//! Messages are bytes. Text output adds hexadecimal digits for bytes that text cannot represent.

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Bytes as hexadecimal digits if they are not UTF-8.
pub fn hex_if_no_text(bytes: &[u8]) -> Option<String> {
    str::from_utf8(bytes).is_err().then(|| hex(bytes))
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
