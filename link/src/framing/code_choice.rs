//! The code for a message's length.

use crate::fec::Code;

/// The longest message for which TM1280 is strong enough: shortening protects it.
const TM1280_LENGTH_MAX: usize = 64;

impl Code {
    /// The code for a message of `length` bytes.
    ///
    /// **The rule:** first take the codes with which one repeat alone delivers at least 99.5 % of the messages if 2 % of the LEDs are read
    /// wrongly, without soft information. Of these, use the one with the fewest panels; of equals, the one that fails less often on a
    /// noisier channel. 2 % is a typical error rate of a receiver at an L2A near the best; at higher rates, repeats combine.
    ///
    /// | bytes | TC128 | TC256 | TC512 | TM1280 | TM1536 |
    /// |---|---|---|---|---|---|
    /// | 8 | 5.0 (0.1) | 6.0 (0.1) | 8.0 (0.1) | 8.0 (0.1) | 12.0 (0.1) |
    /// | 16 | 10.0 (0.2) | 7.0 (0.0) | 9.0 (0.0) | 9.0 (0.0) | 13.0 (0.0) |
    /// | 24 | 15.0 (0.3) | 13.0 (0.1) | 10.0 (0.1) | 10.0 (0.1) | 14.0 (0.1) |
    /// | 32 | 20.1 (0.7) | 14.0 (0.1) | 11.0 (0.1) | 11.0 (0.1) | 15.0 (0.1) |
    /// | 40 | 25.1 (0.6) | 20.0 (0.1) | 19.0 (0.1) | 12.0 (0.1) | 16.0 (0.1) |
    /// | 64 | 40.2 (1.0) | 28.0 (0.1) | 22.0 (0.1) | 15.0 (0.1) | 19.0 (0.1) |
    /// | 72 | 45.4 (1.5) | 34.0 (0.2) | 30.0 (0.2) | 16.2 (1.0) | 20.0 (0.2) |
    /// | 128 | 80.6 (1.7) | 56.0 (0.0) | 44.0 (0.0) | 38.9 (69.1) | 27.0 (0.0) |
    /// | 256 | 162.6 (3.2) | 112.0 (0.4) | 88.0 (0.4) | 81.3 (86.8) | 54.1 (0.4) |
    /// | 1024 | 690.5 (17.6) | 448.0 (0.0) | 352.0 (0.0) | 355.3 (100.0) | 216.0 (0.0) |
    ///
    /// Mean panels until delivery and, in brackets, per cent of messages not delivered by one repeat; 1000
    /// messages a cell (fewer beyond 128 bytes), hard decisions, 2 % wrong:
    /// `cargo run --release -p vocc-link --example code_choice 1000 1 bsc 0.02`.
    ///
    /// * TM1280 has the rate for long messages but not the strength, which only shortening to 64 bytes and less provides. At 72 bytes it
    ///   misses the rule.
    /// * At 17 to 32 bytes TC512 and TM1280 take the same number of panels; TC512 fails less often in more noise:
    ///
    /// | bytes | TC128 | TC256 | TC512 | TM1280 | TM1536 |
    /// |---|---|---|---|---|---|
    /// | 24 | 16.7 (18.0) | 13.5 (6.5) | 10.4 (4.5) | 10.6 (4.5) | 15.0 (6.5) |
    /// | 32 | 22.3 (21.5) | 14.6 (6.5) | 11.1 (1.0) | 11.4 (4.0) | 15.5 (3.5) |
    /// | 64 | 48.4 (37.5) | 29.1 (9.0) | 22.4 (3.5) | 28.1 (83.5) | 20.1 (6.0) |
    /// | 128 | 103.8 (53.0) | 58.8 (11.5) | 44.5 (2.5) | 47.3 (100.0) | 40.0 (46.5) |
    /// | 256 | 247.7 (79.0) | 128.2 (27.0) | 89.8 (9.0) | 93.2 (100.0) | 90.5 (74.0) |
    ///
    /// The same with soft decisions, 8 % of them with the wrong sign: `… code_choice 200 1 awgn 0.08`. Here too TM1536 delivers a message
    /// of 128 bytes in the fewest panels, although one repeat often does not suffice; in this much noise, TM1536 is better already at 64
    /// bytes.
    ///
    /// ```
    /// use link::fec::Code;
    /// assert_eq!(Code::for_length(8), Code::Tc128);
    /// assert_eq!(Code::for_length(1024), Code::Tm1536);
    /// ```
    pub const fn for_length(length: usize) -> Self {
        match length {
            0..=8 => Self::Tc128,
            9..=16 => Self::Tc256,
            17..=32 => Self::Tc512,
            33..=TM1280_LENGTH_MAX => Self::Tm1280,
            _ => Self::Tm1536,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::framing::{Layout, MESSAGE_MAX};

    #[test]
    fn no_code_that_is_strong_enough_has_fewer_panels() {
        for length in 1..=MESSAGE_MAX {
            let panels = |code| Layout::new(code, length).panels();
            let strong_enough = |code: &Code| *code != Code::Tm1280 || length <= TM1280_LENGTH_MAX;
            let fewest = Code::ALL.into_iter().filter(strong_enough).map(panels).min();
            assert_eq!(Some(panels(Code::for_length(length))), fewest, "{length} bytes");
        }
    }
}
