//! The signature after a message: its bytes, and the framer that shows it.

use super::header::{Announcement, SignatureHeader};
use super::transmit::coded;
use super::{Framer, FramingError, OVERHEAD_PANELS};
use crate::checksum::crc32c;
use crate::fec::{Block, Code};
use crate::geometry::Geometry;
use crate::panel::PanelFrame;
use serde::{Deserialize, Serialize};

/// Bytes of a signature's payload.
pub const SIGNATURE_BYTES: usize = 72;
/// The code word of a signature's payload.
pub const SIGNATURE_BLOCK: Block = Block::new(Code::for_length(SIGNATURE_BYTES), SIGNATURE_BYTES);
/// Panels that a signature adds to each repeat of its message.
pub const SIGNATURE_PANELS: usize = OVERHEAD_PANELS + SIGNATURE_BLOCK.panels();

/// The name of a key: the first four bytes of the public key. Several keys may share it; the signature decides which of them has signed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct KeyId(pub [u8; 4]);

impl core::fmt::Display for KeyId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:08x}", u32::from_be_bytes(self.0))
    }
}

/// The signature of a message in its transmitted form: the claimed key, its counter, and the proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The signing key, if the signature is genuine.
    pub key: KeyId,
    /// Rises with each signature that a key makes.
    pub counter: u32,
    /// Ed25519 of message, length and counter.
    pub proof: [u8; 64],
}

impl Signature {
    /// The transmitted bytes.
    pub fn to_bytes(&self) -> [u8; SIGNATURE_BYTES] {
        let mut bytes = [0; SIGNATURE_BYTES];
        let parts = self.key.0.into_iter().chain(self.counter.to_le_bytes()).chain(self.proof);
        bytes.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
        bytes
    }

    /// The signature of transmitted bytes.
    pub fn from_bytes(bytes: &[u8; SIGNATURE_BYTES]) -> Self {
        let (mut key, mut counter, mut proof) = ([0; 4], [0; 4], [0; 64]);
        let places = key.iter_mut().chain(&mut counter).chain(&mut proof);
        places.zip(bytes).for_each(|(to, &from)| *to = from);
        Self {
            key: KeyId(key),
            counter: u32::from_le_bytes(counter),
            proof,
        }
    }

    /// The 10 bits that identify it in its header.
    pub fn check(&self) -> u16 {
        (crc32c(&[&self.to_bytes()]) & 0x3ff) as u16
    }
}

/// A [`Framer`] that shows a signature after each repeat of its message.
///
/// ```
/// use link::fec::Code;
/// use link::framing::{Deframer, Event, KeyId, Signature, SignedFramer};
/// use link::panel::SoftPanel;
///
/// let signature = Signature { key: KeyId([1; 4]), counter: 7, proof: [9; 64] };
/// let mut framer = SignedFramer::new(b"ice", Code::for_length(3), false, signature)?;
/// let (mut deframer, mut signed) = (Deframer::new(), None);
/// for index in 0..framer.panels_per_repeat() {
///     let seen = SoftPanel::certain(framer.next_panel(), 12);
///     if let Event::Signed(read) = deframer.push(index, 0, &seen) {
///         signed = Some((read.message.to_vec(), read.signature));
///     }
/// }
/// assert_eq!(signed, Some((b"ice".to_vec(), signature)));
/// # Ok::<(), link::framing::FramingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SignedFramer {
    framer: Framer,
    /// `None` if the panels are not signed.
    signature: Option<Signature>,
    /// The remaining panels of the current signature, the next one last.
    shown: heapless::Vec<PanelFrame, SIGNATURE_PANELS>,
}

impl SignedFramer {
    /// The panels of a message, as [`Framer::new`] makes them, and of its signature.
    ///
    /// # Errors
    /// [`FramingError`] if the message is empty or too long.
    pub fn new(message: &[u8], code: Code, fresh: bool, signature: Signature) -> Result<Self, FramingError> {
        Ok(Self {
            signature: Some(signature),
            ..Framer::new(message, code, fresh)?.into()
        })
    }

    /// Replaces the signature from the next repeat on. A greater counter shows receivers that the message is not a replay.
    pub fn sign_anew(&mut self, signature: Signature) {
        self.signature = Some(signature);
    }

    /// The panel to show next; there is always one.
    pub fn next_panel(&mut self) -> PanelFrame {
        self.next_panel_of(None)
    }

    /// The panel to show next, for a panel of known size: see [`Framer::next_panel_of`].
    pub fn next_panel_of(&mut self, geometry: Option<Geometry>) -> PanelFrame {
        if let Some(panel) = self.shown.pop() {
            return panel;
        }
        let repeat = self.framer.repeats();
        let panel = self.framer.next_panel_of(geometry);
        if let Some(signature) = self.signature.filter(|_| self.framer.repeats() != repeat) {
            self.code_signature(&signature, repeat);
        }
        panel
    }

    /// Panels that show message and signature once.
    pub fn panels_per_repeat(&self) -> u32 {
        self.framer.panels_per_repeat() + self.signature.map_or(0, |_| SIGNATURE_PANELS as u32)
    }

    /// Whole repeats so far, each with its signature; wraps around after 2³².
    pub fn repeats(&self) -> u32 {
        let unfinished = u32::from(!self.shown.is_empty());
        self.framer.repeats().wrapping_sub(unfinished)
    }

    fn code_signature(&mut self, signature: &Signature, repeat: u32) {
        let (fresh, crc) = self.framer.message_name();
        let header = SignatureHeader {
            check: signature.check(),
            fresh,
            crc,
        };
        let payload = SIGNATURE_BLOCK.encode(&signature.to_bytes());
        self.shown.extend(coded(Announcement::Signature(header), payload, repeat));
        self.shown.reverse();
    }
}

/// The panels of a framer, without signatures.
impl From<Framer> for SignedFramer {
    fn from(framer: Framer) -> Self {
        Self {
            framer,
            signature: None,
            shown: heapless::Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn signature(counter: u32) -> Signature {
        Signature {
            key: KeyId([0xa1, 0xb2, 0xc3, 0xd4]),
            counter,
            proof: core::array::from_fn(|byte| (byte as u8).wrapping_mul(37) ^ counter as u8),
        }
    }

    properties! {
        #[test]
        fn signed_panels_are_the_messages_with_a_signature_after_each_repeat_and_light_leds_half_of_the_time(
            code in 0_u8..5, message in prop::collection::vec(any::<u8>(), 1..=200), counter: u32,
        ) {
            let code = Code::from_value(code).unwrap();
            let mut plain = Framer::new(&message, code, true).unwrap();
            let mut signed = SignedFramer::new(&message, code, true, signature(counter)).unwrap();
            let (repeat, round) = (plain.panels_per_repeat() as usize, signed.panels_per_repeat() as usize);
            let shown: Vec<_> = (0..2 * round).map(|_| signed.next_panel()).collect();
            prop_assert_eq!((signed.repeats(), signed.panels_per_repeat() as usize), (2, round));
            for round in shown.chunks(round) {
                prop_assert!(round[..repeat].iter().all(|&panel| panel == plain.next_panel()));
            }
            for led in 0..64 {
                prop_assert_eq!(shown.iter().filter(|panel| panel.led(led)).count(), round);
            }
        }

        #[test]
        fn a_signature_comes_back(counter: u32) {
            prop_assert_eq!(Signature::from_bytes(&signature(counter).to_bytes()), signature(counter));
        }
    }

    #[test]
    fn a_key_is_named_by_its_first_bytes() {
        assert_eq!(signature(0).key.to_string(), "a1b2c3d4");
    }
}
