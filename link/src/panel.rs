//! The 8×8 LED panel, and a receiver's soft decisions on it.

use crate::orientation::Orientation;

/// LEDs along one side of the panel.
pub const SIDE: usize = 8;
/// LEDs of the panel, and so bits of one symbol.
pub const LEDS: usize = SIDE * SIDE;

/// The On/Off state of the 64 LEDs during one symbol.
///
/// Bit `8·row + column`; row 0 at the top, column 0 at the left, as the camera sees the panel.
///
/// ```
/// use link::panel::PanelFrame;
/// let panel = PanelFrame::from_bits(1 << 10);
/// assert!(panel.is_on(1, 2));
/// assert_eq!(panel.to_string(), "0000000000000400");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PanelFrame(u64);

impl PanelFrame {
    /// The panel whose LED `8·row + column` is On if that bit is set.
    pub const fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// The 64 bits, LED `8·row + column` at that bit.
    pub const fn bits(self) -> u64 {
        self.0
    }

    /// Whether the LED of `row` and `column` (both 0 to 7) is On.
    pub const fn is_on(self, row: usize, column: usize) -> bool {
        self.led(SIDE * row + column)
    }

    /// Whether LED `index` (0 to 63) is On; indices beyond 63 are Off.
    pub const fn led(self, index: usize) -> bool {
        index < LEDS && self.0 >> index & 1 == 1
    }

    /// 1 for each LED that is On, 0 for each that is Off.
    pub fn shares(self) -> [f32; LEDS] {
        core::array::from_fn(|led| if self.led(led) { 1.0 } else { 0.0 })
    }

    /// The number of On LEDs.
    pub const fn count_on(self) -> u32 {
        self.0.count_ones()
    }

    /// The number of LEDs that differ: the bit errors of a reading.
    pub const fn distance(self, other: Self) -> u32 {
        (self.0 ^ other.0).count_ones()
    }

    /// The picture of the panel in that orientation, row by row.
    pub const fn seen(self, orientation: Orientation) -> Self {
        let (mut bits, mut led) = (0, 0);
        while led < LEDS {
            bits |= (self.0 >> led & 1) << orientation.place_of(led);
            led += 1;
        }
        Self(bits)
    }

    /// The inverse of [`seen`](Self::seen): the panel whose picture in that orientation is `self`.
    pub const fn upright(self, orientation: Orientation) -> Self {
        let (mut bits, mut led) = (0, 0);
        while led < LEDS {
            bits |= (self.0 >> orientation.place_of(led) & 1) << led;
            led += 1;
        }
        Self(bits)
    }
}

impl core::fmt::Display for PanelFrame {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// A log-likelihood ratio ln(P(On)/P(Off)) in steps of [`LLR_STEP`]: positive means On, 0 means unknown.
///
/// Values lie in −127 to 127; −128 is not used, so that negation is exact.
pub type Llr = i8;

/// The natural-log likelihood ratio of one step of [`Llr`].
pub const LLR_STEP: f32 = 0.25;

/// A receiver's soft decisions on the 64 LEDs of one symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SoftPanel(pub [Llr; LEDS]);

impl SoftPanel {
    /// A panel without any information: an erasure.
    pub const ERASED: Self = Self([0; LEDS]);

    /// The panel read with certainty `llr` (1 to 127) in each bit.
    pub fn certain(panel: PanelFrame, llr: Llr) -> Self {
        Self(core::array::from_fn(|i| if panel.led(i) { llr } else { llr.saturating_neg() }))
    }

    /// One bit per LED: set if it has a non-zero ratio.
    pub fn seen(&self) -> u64 {
        self.0.iter().enumerate().fold(0, |bits, (i, &llr)| bits | u64::from(llr != 0) << i)
    }

    /// The same reading with the LEDs of `mask` inverted: undoes an XOR with `mask` at the transmitter.
    ///
    /// Values of −128, which no reading may hold, count as −127.
    pub fn flipped(&self, mask: u64) -> Self {
        Self(core::array::from_fn(|i| {
            let llr = self.0[i].max(-Llr::MAX);
            if mask >> i & 1 == 1 { -llr } else { llr }
        }))
    }

    /// The reading in the panel's own rows and columns, if this is one of a picture in that orientation.
    pub fn upright(&self, orientation: Orientation) -> Self {
        Self(core::array::from_fn(|led| self.0[orientation.place_of(led)]))
    }

    /// The agreement of the reading with `panel`: the sum of all ratios, with a positive sign for bits that agree, and the sum of their
    /// squares.
    ///
    /// For a reading that is unrelated to `panel`, sum/√squares has mean 0 and variance 1, and exceeds z with a probability of at most
    /// exp(−z²/2), whatever the magnitudes (Hoeffding 1963, Theorem 2).
    pub fn correlation(&self, panel: PanelFrame) -> (i32, i32) {
        self.0.iter().enumerate().fold((0, 0), |(sum, squares), (i, &llr)| {
            let llr = i32::from(llr);
            (if panel.led(i) { sum + llr } else { sum - llr }, squares + llr * llr)
        })
    }

    /// The likelier state of each LED; Off for a ratio of 0.
    pub fn hard(&self) -> PanelFrame {
        let on = self.0.iter().enumerate().filter(|&(_, &llr)| llr > 0);
        PanelFrame(on.fold(0, |bits, (i, _)| bits | 1 << i))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certain_panels_are_read_back() {
        let panel = PanelFrame::from_bits(0x0123_4567_89ab_cdef);
        assert_eq!(SoftPanel::certain(panel, 5).hard(), panel);
        assert_eq!(SoftPanel::ERASED.hard().count_on(), 0);
    }

    #[test]
    fn flipping_undoes_an_xor_and_leaves_what_is_unknown() {
        let (panel, mask) = (PanelFrame::from_bits(0x0123_4567_89ab_cdef), 0xff00_f0f0_1248_0000);
        let mut reading = SoftPanel::certain(PanelFrame::from_bits(panel.bits() ^ mask), 5);
        reading.0[63] = 0;
        assert_eq!(reading.flipped(mask).hard().distance(panel), 0);
        assert_eq!(reading.flipped(mask).seen(), u64::MAX >> 1);
        assert_eq!(SoftPanel([i8::MIN; LEDS]).flipped(u64::MAX).0, [127; LEDS]);
    }

    #[test]
    fn what_a_picture_shows_is_turned_back() {
        let panel = PanelFrame::from_bits(0x0123_4567_89ab_cdef);
        for orientation in Orientation::ALL {
            let seen = panel.seen(orientation);
            assert_eq!(seen.upright(orientation), panel);
            assert_eq!(SoftPanel::certain(seen, 5).upright(orientation), SoftPanel::certain(panel, 5));
            assert_eq!(seen == panel, orientation == Orientation::UPRIGHT);
        }
    }

    #[test]
    fn correlation_is_full_with_itself_and_negative_with_the_complement() {
        let panel = PanelFrame::from_bits(0x0123_4567_89ab_cdef);
        let reading = SoftPanel::certain(panel, 3);
        assert_eq!(reading.correlation(panel), (3 * 64, 9 * 64));
        assert_eq!(reading.correlation(PanelFrame::from_bits(!panel.bits())), (-3 * 64, 9 * 64));
    }
}
