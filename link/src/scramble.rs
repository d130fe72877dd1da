//! The fixed pseudo-random words that make every panel of a segment look different.
//!
//! Panel n of a segment is shown as its coded bits XOR [`word`]`(n)`. There are two reasons:
//!
//! * **A new panel is recognisably new.** Camera and panel share no clock, so a receiver often photographs one panel twice and must
//!   distinguish "the same panel again" from "the next one". Text with runs of equal bytes, zero padding and the like would give equal
//!   panels in succession. After scrambling, two successive panels differ in about 32 of their 64 LEDs even if the data repeat: a panel
//!   that differs from the one before in few LEDs is the same panel, read with errors.
//! * **Balance.** Runs of zeros would be dark panels: flicker for an observer, and no contrast for a receiver that learns its threshold
//!   from On and Off LEDs of the same frame.
//!
//! Scrambling is neither secret nor protective: a message can be written that cancels the words.

/// The scrambling word of panel `panel` of a segment; 0 for the sync panel (panel 0), which is not scrambled.
pub const fn word(panel: usize) -> u64 {
    if panel == 0 { 0 } else { split_mix64(panel as u64) }
}

/// Output number `counter` of the SplitMix64 generator started from 0 (Steele, Lea & Flood, OOPSLA 2014).
///
/// ```
/// // The first output of the reference implementation from seed 0.
/// assert_eq!(link::scramble::split_mix64(1), 0xe220_a839_7b1d_cdaf);
/// ```
pub const fn split_mix64(counter: u64) -> u64 {
    mix64(counter.wrapping_mul(GOLDEN))
}

/// The increment of SplitMix64's state between outputs: the golden ratio in 2⁻⁶⁴.
pub const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The output of SplitMix64 in state `z`.
pub const fn mix64(z: u64) -> u64 {
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn successive_words_differ_in_about_half_of_the_leds() {
        for panel in 1..64 {
            let distance = (word(panel) ^ word(panel + 1)).count_ones();
            assert!((20..=44).contains(&distance), "words {panel} and next: {distance}");
        }
    }
}
