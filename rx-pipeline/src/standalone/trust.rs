//! The public keys that a receiver trusts.

use link::framing::SignedPayload;
use link::signing::{KEY_BYTES, PublicKey, TrustedKey, Verdict, verdict};
use serde::{Deserialize, Serialize};

/// The most trusted keys.
pub const KEYS_MAX: usize = 16;

/// Why a text is not a list of public keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum TrustError {
    /// The text has no key.
    #[error("there is no key: take the lines that `vocc keys show` prints")]
    Empty,
    /// A line of another kind.
    #[error("line {line} is not `[[key]]`, `name = …` or `public = …`: take the lines that `vocc keys show` prints")]
    Line {
        /// Its number, from 1.
        line: u16,
    },
    /// The digits are not a key.
    #[error("line {line}: the key is not {} hexadecimal digits in quotes: take the line that `vocc keys show` prints", 2 * KEY_BYTES)]
    Digits {
        /// The line's number, from 1.
        line: u16,
    },
    /// The digits are not a valid key.
    #[error("line {line}: the key is not an Ed25519 public key, or is a weak one: get it again from its owner")]
    Key {
        /// The line's number, from 1.
        line: u16,
    },
    /// Two keys have the same name.
    #[error("line {line}: a key above has the same first four bytes, by which messages name it: leave one of the two out")]
    SameId {
        /// The line's number, from 1.
        line: u16,
    },
    /// Too many keys.
    #[error("line {line}: there are more than {KEYS_MAX} keys: leave some out")]
    TooMany {
        /// The number of the line with the first key too many, from 1.
        line: u16,
    },
}

/// The trusted keys, and the greatest counter of each since the start.
#[derive(Debug, Default)]
pub struct Trust(heapless::Vec<TrustedKey, KEYS_MAX>);

impl Trust {
    /// The keys in a text that `vocc keys show` has printed.
    ///
    /// # Errors
    /// [`TrustError`] names the first line that cannot be used.
    pub fn parse(text: &str) -> Result<Self, TrustError> {
        let mut trust = Self::default();
        for (line, content) in (1..).zip(text.lines()) {
            let (name, value) = content.split_once('=').unwrap_or((content, ""));
            match name.trim() {
                "" | "[[key]]" | "name" => {}
                comment if comment.starts_with('#') => {}
                "public" => {
                    let bytes = bytes(value.trim()).ok_or(TrustError::Digits { line })?;
                    let key = PublicKey::from_bytes(bytes).map_err(|_| TrustError::Key { line })?;
                    if trust.0.iter().any(|other| other.key().id() == key.id()) {
                        return Err(TrustError::SameId { line });
                    }
                    let key = TrustedKey::new(key, None);
                    trust.0.push(key).map_err(|_| TrustError::TooMany { line })?;
                }
                _ => return Err(TrustError::Line { line }),
            }
        }
        if trust.is_empty() { Err(TrustError::Empty) } else { Ok(trust) }
    }

    /// Whether there are no keys: nothing is checked.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Verifies a message by its signature, if there are keys; a proven one counts as seen from now on.
    // Not inlined, so that it can be timed.
    #[inline(never)]
    pub fn verdict(&mut self, signed: &SignedPayload<'_>) -> Verdict {
        match self.0.as_mut_slice() {
            [] => Verdict::Unchecked {
                signer: signed.signature.key,
                counter: signed.signature.counter,
            },
            keys => verdict(keys, signed.message, &signed.signature),
        }
    }
}

/// The bytes of hexadecimal digits in quotes.
fn bytes(value: &str) -> Option<[u8; KEY_BYTES]> {
    let digits = value.strip_prefix('"')?.strip_suffix('"')?.as_bytes();
    let (pairs, rest) = digits.as_chunks::<2>();
    let mut bytes = [0; KEY_BYTES];
    if pairs.len() != KEY_BYTES || !rest.is_empty() {
        return None;
    }
    for (byte, &[high, low]) in bytes.iter_mut().zip(pairs) {
        let [high, low] = [char::from(high).to_digit(16)?, char::from(low).to_digit(16)?];
        *byte = (16 * high + low) as u8;
    }
    Some(bytes)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use link::signing::SecretKey;
    use std::format;
    use std::string::String;

    /// The lines of `vocc keys show` for the key of that seed.
    pub fn lines(seed: u8) -> String {
        let public = SecretKey::from_seed([seed; KEY_BYTES]).unwrap().public().to_bytes();
        let digits: String = public.iter().map(|byte| format!("{byte:02x}")).collect();
        format!("# 1a2b3c4d\n[[key]]\nname = \"truck = {seed}\"\npublic = \"{digits}\"\n")
    }

    #[test]
    fn the_lines_of_keys_are_read() {
        let trust = Trust::parse(&format!("{}\n{}", lines(1), lines(2))).unwrap();
        let keys = [1, 2].map(|seed| TrustedKey::new(SecretKey::from_seed([seed; 32]).unwrap().public(), None));
        assert_eq!(trust.0, keys);
    }

    #[test]
    fn the_first_line_that_cannot_be_used_is_named() {
        let why = |text: &str| Trust::parse(text).unwrap_err();
        assert_eq!(why("[[key]]\nsecret = \"00\"\n"), TrustError::Line { line: 2 });
        let whole = lines(1);
        let cut = whole.replace("\"\n", "\n");
        let (short, other) = (
            whole.replace("public = \"", "public = \"0"),
            whole.replace("public = \"", "public = \"+"),
        );
        for wrong in [cut, short, other, "public\n".into()] {
            let told = why(&wrong);
            assert!(matches!(told, TrustError::Digits { line: 1 | 4 }), "{wrong}: {told}");
        }
        let weak = format!("public = \"01{}\"", "00".repeat(31));
        assert_eq!(why(&weak), TrustError::Key { line: 1 });
        assert_eq!(why(&format!("{whole}{whole}")), TrustError::SameId { line: 8 });
        for empty in ["", "[[key]]\nname = \"truck\"\n"] {
            assert_eq!(why(empty), TrustError::Empty);
        }
        let many: String = (1..=17).map(lines).collect();
        assert_eq!(why(&many), TrustError::TooMany { line: 4 * 17 });
    }
}
