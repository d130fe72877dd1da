//! Error correction: the CCSDS low-density parity-check codes, shortened to whole panels.
//!
//! The codes are systematic: a code word is its information followed by its parity, 64 bits a panel, 8 bytes
//! a panel in little-endian order (byte r is row r, its bit c from the least significant is column c).
//!
//! | code | information | panels: information + parity | rate | source |
//! |---|---|---|---|---|
//! | [`Code::Tc128`] | 8 bytes | 1 + 1 | 1/2 | CCSDS 231.1-O-1 |
//! | [`Code::Tc256`] | 16 bytes | 2 + 2 | 1/2 | CCSDS 231.1-O-1 |
//! | [`Code::Tc512`] | 32 bytes | 4 + 4 | 1/2 | CCSDS 231.1-O-1 |
//! | [`Code::Tm1280`] | 128 bytes | 16 + 4 | 4/5 | CCSDS 131.0-B-2 |
//! | [`Code::Tm1536`] | 128 bytes | 16 + 8 | 2/3 | CCSDS 131.0-B-2 |
//!
//! **Shortening.** A [`Block`] is one code word; only its first bytes carry message. The rest are zeros, known to both ends. Panels that
//! would hold nothing else are not sent, and the decoder treats the known bits as certain. A short block is therefore shorter on the air
//! and also better protected.
//!
//! **Decoding** is min-sum on 8-bit log-likelihood ratios. In steps of [`LLR_STEP`](crate::panel::LLR_STEP) they decode as well as 32-bit
//! floating point (a test compares them). Frames in which every bit has the greatest certainty, some of them wrongly, decode too. The TM
//! codes have punctured parity bits (128 and 256), which are never sent but take part in the decoding and enlarge its working area: see
//! [`Decoder`].

use crate::panel::{LEDS, Llr, PanelFrame, SoftPanel};
use labrador_ldpc::LDPCCode;

/// Information bytes of one panel.
pub const PANEL_BYTES: usize = LEDS / 8;
/// The most information bytes of any code.
pub const INFO_BYTES_MAX: usize = 128;
/// The most panels of any code word.
pub const CODEWORD_PANELS_MAX: usize = 24;
/// Rounds of min-sum after which the decoder gives up.
///
/// Fewer would save time only if decoding fails. More would decode a few more code words in heavy noise, at a cost that matters on a small
/// processor.
pub const MAX_ITERATIONS: usize = 100;

const BITS_MAX: usize = CODEWORD_PANELS_MAX * LEDS;
const LARGEST: LDPCCode = LDPCCode::TM1536;
/// The greatest certainty of a received bit, in steps of [`LLR_STEP`](crate::panel::LLR_STEP): half the range of the decoder's messages. A
/// message is a saturating sum less one of its terms. With bits as sure as the greatest sum that difference would be 0 and carry no
/// information.
pub const SUREST: Llr = 63;
/// A bit that is certainly 0, in the decoder's sign, which is opposite to [`Llr`]'s.
const CERTAIN_ZERO: i8 = i8::MAX;

/// An error-correcting code; the number is its value in the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Code {
    /// 8 bytes in 2 panels.
    Tc128 = 0,
    /// 16 bytes in 4 panels.
    Tc256 = 1,
    /// 32 bytes in 8 panels.
    Tc512 = 2,
    /// 128 bytes in 20 panels.
    Tm1280 = 3,
    /// 128 bytes in 24 panels.
    Tm1536 = 4,
}

impl Code {
    /// All of them, in the order of their values.
    pub const ALL: [Self; 5] = [Self::Tc128, Self::Tc256, Self::Tc512, Self::Tm1280, Self::Tm1536];

    /// The code with that value in the header, if it exists.
    pub const fn from_value(value: u8) -> Option<Self> {
        match value {
            0 => Some(Self::Tc128),
            1 => Some(Self::Tc256),
            2 => Some(Self::Tc512),
            3 => Some(Self::Tm1280),
            4 => Some(Self::Tm1536),
            _ => None,
        }
    }

    /// Information bytes of a whole code word: 8 to 128.
    pub const fn info_bytes(self) -> usize {
        self.ldpc().k() / 8
    }

    /// Panels of a whole code word: 2 to 24.
    pub const fn panels(self) -> usize {
        self.ldpc().n() / LEDS
    }

    /// Parity panels of a code word, 1 to 8; shortening drops none of them.
    pub const fn parity_panels(self) -> usize {
        self.panels() - self.info_bytes() / PANEL_BYTES
    }

    const fn ldpc(self) -> LDPCCode {
        match self {
            Self::Tc128 => LDPCCode::TC128,
            Self::Tc256 => LDPCCode::TC256,
            Self::Tc512 => LDPCCode::TC512,
            Self::Tm1280 => LDPCCode::TM1280,
            Self::Tm1536 => LDPCCode::TM1536,
        }
    }
}

impl core::fmt::Display for Code {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Tc128 => "TC128",
            Self::Tc256 => "TC256",
            Self::Tc512 => "TC512",
            Self::Tm1280 => "TM1280",
            Self::Tm1536 => "TM1536",
        })
    }
}

/// One code word. Its first `info_bytes` bytes carry message, and the rest of the information is known to be 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    code: Code,
    info_bytes: usize,
}

impl Block {
    /// A block of `info_bytes` message bytes, clamped to the code's capacity.
    pub const fn new(code: Code, info_bytes: usize) -> Self {
        let most = code.info_bytes();
        Self {
            code,
            info_bytes: if info_bytes < most { info_bytes } else { most },
        }
    }

    /// Message bytes in it.
    pub const fn info_bytes(self) -> usize {
        self.info_bytes
    }

    /// Panels that are sent.
    pub const fn panels(self) -> usize {
        self.info_panels() + self.code.parity_panels()
    }

    /// Received bits (known ones included) below which decoding is not tried: the code's information and a quarter of its parity.
    ///
    /// With fewer, too few parity checks remain, and nearly any reading passes as a code word.
    pub const fn bits_needed(self) -> usize {
        let (n, k) = (self.code.ldpc().n(), self.code.ldpc().k());
        k + (n - k) / 4
    }

    /// The [`Self::panels`] panels that carry `info`, padded with zeros.
    ///
    /// ```
    /// use link::fec::{Block, Code};
    /// let block = Block::new(Code::Tm1280, 20);
    /// assert_eq!(block.encode(b"twenty bytes of text").count(), 3 + 4);
    /// ```
    pub fn encode(self, info: &[u8]) -> impl ExactSizeIterator<Item = PanelFrame> + Clone + use<> {
        let mut words = [0_u64; CODEWORD_PANELS_MAX];
        for (word, bytes) in words.iter_mut().zip(info[..info.len().min(self.info_bytes)].chunks(PANEL_BYTES)) {
            let mut padded = [0; PANEL_BYTES];
            padded.iter_mut().zip(bytes).for_each(|(to, &from)| *to = from);
            *word = u64::from_ne_bytes(padded);
        }
        self.code.ldpc().encode(&mut words[..self.code.panels()]);
        (0..self.panels()).map(move |panel| PanelFrame::from_bits(u64::from_le(words[self.place(panel)])))
    }

    /// Compares the LEDs of `panels` that were seen (non-zero) with the panels that carry `info`. Returns `(different, seen)`.
    pub fn compare(self, info: &[u8], panels: &[SoftPanel]) -> (u32, u32) {
        self.encode(info).zip(panels).fold((0, 0), |(different, seen), (truth, panel)| {
            let wrong = (panel.hard().bits() ^ truth.bits()) & panel.seen();
            (different + wrong.count_ones(), seen + panel.seen().count_ones())
        })
    }

    const fn info_panels(self) -> usize {
        self.info_bytes.div_ceil(PANEL_BYTES)
    }

    /// The position of the `panel`-th sent panel in the whole code word.
    const fn place(self, panel: usize) -> usize {
        let skipped = self.code.info_bytes() / PANEL_BYTES - self.info_panels();
        if panel < self.info_panels() { panel } else { panel + skipped }
    }
}

/// Why a block could not be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Undecodable {
    /// Too many panels were lost.
    #[error("only {known} of the block's bits are known, and at least {needed} are needed: too many panels were lost")]
    TooFewBits {
        /// Bits that were received or are known to be zero.
        known: usize,
        /// [`Block::bits_needed`].
        needed: usize,
    },
    /// Too many bits were wrong.
    #[error("too many of its bits are wrong")]
    NoCodeword,
}

/// The min-sum decoder with its working area: 16 960 bytes for the largest code word and its punctured bits.
pub struct Decoder {
    llrs: [i8; BITS_MAX],
    working: [i8; LARGEST.decode_ms_working_len()],
    signs: [u8; LARGEST.decode_ms_working_u8_len()],
    output: [u8; LARGEST.output_len()],
}

impl Decoder {
    /// A decoder; `const`, so that it can be a static.
    pub const fn new() -> Self {
        Self {
            llrs: [0; BITS_MAX],
            working: [0; LARGEST.decode_ms_working_len()],
            signs: [0; LARGEST.decode_ms_working_u8_len()],
            output: [0; LARGEST.output_len()],
        }
    }

    /// The message bytes of `block`, from its received `panels`; panels beyond the end of the slice count as lost.
    ///
    /// # Errors
    ///
    /// [`Undecodable`] if too little was received, or too much of it is wrong. A result may still be wrong, rarely: the message's CRC
    /// decides.
    pub fn decode(&mut self, block: Block, panels: &[SoftPanel]) -> Result<&[u8], Undecodable> {
        let (known, needed) = (self.load(block, panels), block.bits_needed());
        if known < needed {
            return Err(Undecodable::TooFewBits { known, needed });
        }
        let code = block.code.ldpc();
        let output = &mut self.output[..code.output_len()];
        let working = &mut self.working[..code.decode_ms_working_len()];
        let signs = &mut self.signs[..code.decode_ms_working_u8_len()];
        let (found, _) = code.decode_ms(&self.llrs[..code.n()], output, working, signs, MAX_ITERATIONS);
        let (info, rest) = output[..block.code.info_bytes()].split_at(block.info_bytes);
        if found && rest.iter().all(|&byte| byte == 0) {
            Ok(info)
        } else {
            Err(Undecodable::NoCodeword)
        }
    }

    /// Loads the received and the known bits; returns their number.
    fn load(&mut self, block: Block, panels: &[SoftPanel]) -> usize {
        self.llrs.fill(0);
        for (index, panel) in panels.iter().take(block.panels()).enumerate() {
            let place = LEDS * block.place(index);
            for (row, leds) in panel.0.chunks_exact(8).enumerate() {
                let bits = self.llrs[place + 8 * row..].iter_mut();
                // The decoder counts a byte's bits from the most significant and takes positive for 0.
                bits.zip(leds.iter().rev())
                    .for_each(|(bit, &led)| *bit = led.saturating_neg().clamp(-SUREST, SUREST));
            }
        }
        self.llrs[8 * block.info_bytes..8 * block.code.info_bytes()].fill(CERTAIN_ZERO);
        self.llrs.iter().filter(|&&llr| llr != 0).count()
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

/// Adds the ratios of two readings of the same panel; saturates at ±127.
pub fn combine(one: &mut SoftPanel, other: &SoftPanel) {
    for (llr, more) in one.0.iter_mut().zip(&other.0) {
        *llr = llr.saturating_add(*more).max(-Llr::MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scramble::split_mix64;
    use properties::prelude::*;

    /// The readings of a block's panels with `errors` wrong LEDs, spread by `seed`.
    fn read_with_errors(block: Block, info: &[u8], errors: usize, seed: u64) -> Vec<SoftPanel> {
        let mut panels: Vec<_> = block.encode(info).map(|panel| SoftPanel::certain(panel, 12)).collect();
        let leds = (LEDS * panels.len()) as u64;
        for error in 0..errors as u64 {
            let led = (split_mix64(seed.wrapping_add(error)) % leds) as usize;
            panels[led / LEDS].0[led % LEDS] *= -1;
        }
        panels
    }

    properties! {
        #[test]
        fn one_error_in_a_hundred_is_corrected(code in 0_u8..5, length in 1_usize..=128, info: [u8; 32], seed: u64) {
            let block = Block::new(Code::from_value(code).unwrap(), length);
            let info: Vec<u8> = info.iter().copied().cycle().take(block.info_bytes()).collect();
            let panels = read_with_errors(block, &info, block.panels() * LEDS / 200, seed);
            let mut decoder = Decoder::new();
            prop_assert_eq!(decoder.decode(block, &panels), Ok(&info[..]));
            let (different, seen) = block.compare(&info, &panels);
            prop_assert!(different as usize <= block.panels() * LEDS / 200);
            prop_assert_eq!(seen as usize, LEDS * block.panels());
        }

        #[test]
        fn any_readings_are_decoded_or_refused_without_panic(code in 0_u8..5, length: usize, seed: u64, count in 0_usize..30) {
            let panels: Vec<_> = (0..count as u64).map(|n| SoftPanel(core::array::from_fn(|led| {
                split_mix64(seed.wrapping_add(64 * n + led as u64)) as i8
            }))).collect();
            let block = Block::new(Code::from_value(code).unwrap(), length);
            if let Ok(info) = Decoder::new().decode(block, &panels) {
                prop_assert_eq!(info.len(), block.info_bytes());
            }
        }
    }

    #[test]
    fn a_block_of_which_nothing_was_received_is_refused_and_not_read_as_zeros() {
        for code in Code::ALL {
            let block = Block::new(code, 1);
            let refusal = Decoder::new().decode(block, &[]).unwrap_err();
            assert!(matches!(refusal, Undecodable::TooFewBits { .. }), "{code}: {refusal}");
        }
    }

    #[test]
    fn a_lost_panel_of_a_long_code_is_recovered() {
        let info: Vec<u8> = (0..128).collect();
        for code in [Code::Tm1280, Code::Tm1536] {
            let block = Block::new(code, 128);
            let mut panels = read_with_errors(block, &info, 0, 0);
            panels[5] = SoftPanel::ERASED;
            assert_eq!(Decoder::new().decode(block, &panels), Ok(&info[..]), "{code}");
        }
    }

    /// Approximately normal: the sum of 12 uniform numbers (Irwin and Hall).
    fn gaussian(seed: u64) -> f32 {
        let uniform = |n| split_mix64(split_mix64(seed).wrapping_add(n)) as f32 / u64::MAX as f32;
        (0..12).map(uniform).sum::<f32>() - 6.0
    }

    #[test]
    fn eight_bits_decode_as_well_as_floating_point() {
        const SIGMA: f32 = 0.78;
        let (block, code) = (Block::new(Code::Tc512, 32), LDPCCode::TC512);
        let (mut eight_bits, mut floating) = (0, 0);
        for trial in 0..200_u64 {
            let info: [u8; 32] = core::array::from_fn(|n| split_mix64(32 * trial + n as u64) as u8);
            let mut exact = Vec::new();
            let panels: Vec<_> = block
                .encode(&info)
                .enumerate()
                .map(|(n, panel)| {
                    let llrs: [f32; LEDS] = core::array::from_fn(|led| {
                        let level = if panel.led(led) { 1.0 } else { -1.0 };
                        2.0 * (level + SIGMA * gaussian((trial << 16) + (LEDS * n + led) as u64)) / (SIGMA * SIGMA)
                    });
                    exact.extend(llrs.chunks_exact(8).flat_map(|row| row.iter().rev().map(|llr| -llr)));
                    SoftPanel(llrs.map(|llr| (llr / crate::panel::LLR_STEP).round().clamp(-127.0, 127.0) as Llr))
                })
                .collect();
            let mut output = [0; 64];
            let (mut working, mut signs) = ([0.0; LDPCCode::TC512.decode_ms_working_len()], [0; 32]);
            let (found, _) = code.decode_ms(&exact, &mut output, &mut working, &mut signs, MAX_ITERATIONS);
            floating += u32::from(found && output[..32] == info);
            eight_bits += u32::from(Decoder::new().decode(block, &panels) == Ok(&info[..]));
        }
        assert!(
            (60..=190).contains(&floating),
            "a comparison in easy or hopeless noise says nothing: {floating}"
        );
        assert!(eight_bits + 6 >= floating, "{eight_bits} of 200 against {floating}");
    }

    #[test]
    fn shortening_leaves_out_the_panels_that_hold_only_zeros() {
        assert_eq!(Block::new(Code::Tm1280, 1).panels(), 5);
        assert_eq!(Block::new(Code::Tm1280, 9).panels(), 6);
        assert_eq!(Block::new(Code::Tm1536, 128).panels(), 24);
        assert_eq!(Block::new(Code::Tc128, 1000).panels(), 2);
    }

    #[test]
    fn the_largest_code_is_the_largest() {
        for code in Code::ALL {
            assert!(code.panels() <= CODEWORD_PANELS_MAX && code.info_bytes() <= INFO_BYTES_MAX);
            assert!(code.ldpc().decode_ms_working_len() <= LARGEST.decode_ms_working_len());
            assert_eq!(Code::from_value(code as u8), Some(code));
        }
        assert_eq!(size_of::<Decoder>(), 16_960);
    }

    #[test]
    fn the_coded_bytes_are_those_of_the_code_s_reference_implementation() {
        let shown = Block::new(Code::Tc128, 8).encode(&[0, 1, 2, 3, 4, 5, 6, 7]);
        let bytes: Vec<u8> = crate::raw::bytes(shown).collect();
        assert_eq!(bytes, [0, 1, 2, 3, 4, 5, 6, 7, 0x34, 0x99, 0x98, 0x87, 0x94, 0xe1, 0x62, 0x56]);
    }
}
