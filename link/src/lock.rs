//! The lock of a transmitter's serial ports: permits, each for one request. Feature `signing`.
//!
//! A locked transmitter has a public key. Each request that [changes something](crate::serial::Request::changes) needs a permit,
//! an Ed25519 signature over these bytes:
//!
//! ```text
//!  "vocc permit 1" │ salt, 8 bytes │ challenge, 4 bytes │ sequence number, 4 bytes │ body of the request      numbers little-endian
//! ```
//!
//! The transmitter counts the challenges, also across restarts, and accepts each once. So a recorded permit is useless later, and an
//! intercepted one fits no other request. Each lock has a new random salt, so that a permit fits one lock only.
//!
//! `vocc` derives the private key from a PIN and the salt, with a deliberately slow function. The transmitter never learns the PIN.
//!
//! ```
//! use link::{lock::Challenge, serial::Request, signing::SecretKey};
//!
//! let key = SecretKey::from_seed([7; 32])?;
//! let challenge = Challenge { salt: 1, number: 41 };
//! let signature = key.permit(challenge, 5, &Request::EraseKey).expect("it fits");
//!
//! let body = [20];
//! assert!(key.public().has_permitted(challenge, 5, &body, &signature));
//! assert!(!key.public().has_permitted(Challenge { number: 42, ..challenge }, 5, &body, &signature));
//! # Ok::<(), link::signing::KeyError>(())
//! ```

use serde::Serialize;

use crate::serial::REQUEST_FRAME_MAX;
use crate::signing::{PublicKey, SecretKey};

/// The prefix of the signed bytes, so that a signature for another purpose does not fit.
const CONTEXT: &[u8; 13] = b"vocc permit 1";
const PREFIX_BYTES: usize = CONTEXT.len() + 8 + 4 + 4;

/// The challenge that a permit answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Challenge {
    /// The lock's salt.
    pub salt: u64,
    /// The number, which is used once.
    pub number: u32,
}

impl Challenge {
    fn prefix(self, sequence: u32) -> [u8; PREFIX_BYTES] {
        let mut prefix = [0; PREFIX_BYTES];
        let numbers = self.salt.to_le_bytes().into_iter().chain(self.number.to_le_bytes());
        let parts = CONTEXT.iter().copied().chain(numbers).chain(sequence.to_le_bytes());
        prefix.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
        prefix
    }
}

impl SecretKey {
    /// The permit of a request with this sequence number; `None` for a request that does not fit into a frame.
    pub fn permit(&self, challenge: Challenge, sequence: u32, request: &impl Serialize) -> Option<[u8; 64]> {
        let mut signed = [0; PREFIX_BYTES + REQUEST_FRAME_MAX];
        let (prefix, body) = signed.split_first_chunk_mut()?;
        *prefix = challenge.prefix(sequence);
        let length = PREFIX_BYTES + postcard::to_slice(request, body).ok()?.len();
        Some(*self.0.sk.sign(&signed[..length], None))
    }
}

impl PublicKey {
    /// Whether a permit for a request with this sequence number and body was made by this key.
    pub fn has_permitted(&self, challenge: Challenge, sequence: u32, body: &[u8], signature: &[u8; 64]) -> bool {
        self.verifies(&[&challenge.prefix(sequence), body], signature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::framing::MESSAGE_MAX;
    use crate::serial::Request;

    const CHALLENGE: Challenge = Challenge {
        salt: 0x0123_4567_89ab_cdef,
        number: 7,
    };

    #[test]
    fn a_permit_is_for_one_request_one_challenge_and_one_lock() {
        let key = SecretKey::from_seed([1; 32]).unwrap();
        let request = Request::WriteSymbolRate { millihertz: 90_000 };
        let permit = key.permit(CHALLENGE, 5, &request).unwrap();
        let mut place = [0; 16];
        let body = postcard::to_slice(&request, &mut place).unwrap();
        let public = key.public();
        assert!(public.has_permitted(CHALLENGE, 5, body, &permit));

        for bit in 0..8 * body.len() {
            let mut other = [0; 16];
            other[..body.len()].copy_from_slice(body);
            other[bit / 8] ^= 1 << (bit % 8);
            assert!(!public.has_permitted(CHALLENGE, 5, &other[..body.len()], &permit));
        }
        for bit in 0..8 * permit.len() {
            let mut other = permit;
            other[bit / 8] ^= 1 << (bit % 8);
            assert!(!public.has_permitted(CHALLENGE, 5, body, &other));
        }
        assert!(!public.has_permitted(CHALLENGE, 6, body, &permit));
        assert!(!public.has_permitted(CHALLENGE, 5, &body[..body.len() - 1], &permit));
        for other in [Challenge { salt: 0, ..CHALLENGE }, Challenge { number: 8, ..CHALLENGE }] {
            assert!(!public.has_permitted(other, 5, body, &permit));
        }
        let stranger = SecretKey::from_seed([2; 32]).unwrap().public();
        assert!(!stranger.has_permitted(CHALLENGE, 5, body, &permit));
    }

    #[test]
    fn the_longest_request_has_a_permit() {
        let key = SecretKey::from_seed([1; 32]).unwrap();
        let request = Request::Send {
            repeats: Some(u32::MAX),
            message: &[0xff; MESSAGE_MAX],
        };
        assert!(key.permit(CHALLENGE, 5, &request).is_some());
        let longer = Request::Send {
            repeats: None,
            message: &[0; REQUEST_FRAME_MAX],
        };
        assert!(key.permit(CHALLENGE, 5, &longer).is_none());
    }

    /// A message's signature is no valid permit, and a permit signs no message.
    #[test]
    fn signatures_for_messages_are_no_permits() {
        let key = SecretKey::from_seed([1; 32]).unwrap();
        let permit = key.permit(CHALLENGE, 5, &Request::EraseKey).unwrap();
        let signature = crate::framing::Signature {
            key: key.public().id(),
            counter: 7,
            proof: permit,
        };
        assert!(!key.public().has_signed(&[20], &signature));
        let signed = key.sign(&[20], 7);
        assert!(!key.public().has_permitted(CHALLENGE, 5, &[20], &signed.proof));
    }
}
