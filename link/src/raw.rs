//! Raw mode: 64 message bits a panel and nothing else, as in Do & Yoo 2020.
//!
//! Bytes fill a panel in little-endian order, so that byte r is row r and bit c of it (from the least
//! significant) is column c: 8 bytes a panel, the last panel padded with zeros. There is no sync, no check
//! and no correction: this is for measuring bit error rates and for comparison with the paper, not for
//! carrying messages.
//!
//! ```
//! use link::raw;
//! let panels = raw::panels(b"raw bytes");
//! assert_eq!(panels.len(), 2);
//! assert!(raw::bytes(panels).eq(*b"raw bytes\0\0\0\0\0\0\0"));
//! ```

use crate::panel::PanelFrame;

/// Bytes of one raw panel.
pub const PANEL_BYTES: usize = 8;

/// The panels that show `bytes`, 8 a panel; the last one padded with zeros.
pub fn panels(bytes: &[u8]) -> impl ExactSizeIterator<Item = PanelFrame> {
    bytes.chunks(PANEL_BYTES).map(|chunk| {
        let mut padded = [0; PANEL_BYTES];
        padded.iter_mut().zip(chunk).for_each(|(to, &from)| *to = from);
        PanelFrame::from_bits(u64::from_le_bytes(padded))
    })
}

/// The bytes that `panels` show, padding included.
pub fn bytes(panels: impl IntoIterator<Item = PanelFrame>) -> impl Iterator<Item = u8> {
    panels.into_iter().flat_map(|panel| panel.bits().to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    #[test]
    fn byte_r_is_row_r_and_its_bit_c_is_column_c() {
        let panel = panels(&[0, 0, 0b0010_0000]).next().unwrap();
        assert_eq!(panel.count_on(), 1);
        assert!(panel.is_on(2, 5));
    }

    properties! {
        #[test]
        fn bytes_come_back_followed_by_padding(message: [u8; 21], length in 0_usize..=21) {
            let message = &message[..length];
            prop_assert_eq!(panels(message).len(), length.div_ceil(PANEL_BYTES));
            let mut back = bytes(panels(message));
            prop_assert!(message.iter().all(|&byte| back.next() == Some(byte)));
            prop_assert!(back.all(|byte| byte == 0));
        }
    }
}
