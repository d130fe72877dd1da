//! Whether soft bits are as reliable as stated.

use std::fmt;

use link::panel::{LLR_STEP, PanelFrame, SoftPanel};

use super::share_95;

/// The starts of bins, in steps of a log-likelihood ratio: at 0, 0.5, 1, 2, 3, 4.5, 6.5, 9, 13 and 20 nats.
const EDGES: [u8; 10] = [0, 2, 4, 8, 12, 18, 26, 36, 52, 80];

/// Bits by their reported certainty, with the numbers of wrong ones. Bits without information are not counted.
///
/// ```
/// use link::panel::{PanelFrame, SoftPanel};
/// use studies::statistics::Reliability;
/// let (mut reliability, truth) = (Reliability::default(), PanelFrame::from_bits(u64::MAX));
/// // e⁻¹/(1 + e⁻¹): the reported error is 27 %, and no bit is wrong.
/// reliability.push(&SoftPanel::certain(truth, 4), truth);
/// let bin = reliability.bins().next().unwrap();
/// assert!((bin.stated - 0.269).abs() < 0.001 && bin.bits == 64 && bin.wrong == 0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reliability([Sums; EDGES.len()]);

/// Sums over the panels that have bits in a bin, of their bits n and wrong bits e.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    bits: u64,
    wrong: u64,
    /// Σ n², Σ n·e and Σ e²: bits of one panel are wrong together.
    squares: [u64; 3],
    stated: f64,
}

/// Bits of about the same certainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// The wrong share of them by their soft values.
    pub stated: f64,
    /// Their number, not 0.
    pub bits: u64,
    /// The number of wrong ones.
    pub wrong: u64,
    /// The 95 % interval of the wrong share, for bits that are wrong together within a panel.
    pub wrong_95: [f64; 2],
}

/// Columns of a table: the stated error rate, the measured one with its interval, and the counts.
impl fmt::Display for Bin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([low, high], share) = (self.wrong_95, self.wrong as f64 / self.bits as f64);
        let Self { stated, bits, wrong, .. } = self;
        write!(f, "{stated:.1e} | {share:.1e} ({low:.1e} to {high:.1e}) | {wrong} of {bits}")
    }
}

impl Reliability {
    /// Counts the bits of one panel.
    pub fn push(&mut self, soft: &SoftPanel, truth: PanelFrame) {
        let mut counts = [[0u64; 2]; EDGES.len()];
        let wrong = soft.hard().bits() ^ truth.bits();
        for (led, llr) in soft.0.iter().enumerate() {
            let sure = llr.unsigned_abs();
            if sure == 0 {
                continue;
            }
            let bin = EDGES.partition_point(|&edge| edge <= sure) - 1;
            counts[bin][0] += 1;
            counts[bin][1] += wrong >> led & 1;
            self.0[bin].stated += 1.0 / (1.0 + f64::from(f32::from(sure) * LLR_STEP).exp());
        }
        for (sums, [bits, wrong]) in self.0.iter_mut().zip(counts) {
            sums.bits += bits;
            sums.wrong += wrong;
            let squares = [bits * bits, bits * wrong, wrong * wrong];
            sums.squares.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
        }
    }

    /// Adds the counts of another.
    pub fn merge(&mut self, other: &Self) {
        for (own, others) in self.0.iter_mut().zip(&other.0) {
            own.bits += others.bits;
            own.wrong += others.wrong;
            own.stated += others.stated;
            own.squares.iter_mut().zip(others.squares).for_each(|(own, other)| *own += other);
        }
    }

    /// The bins with bits, the least certain ones first.
    pub fn bins(&self) -> impl Iterator<Item = Bin> {
        self.0.iter().filter(|sums| sums.bits > 0).map(Sums::bin)
    }
}

impl Sums {
    fn bin(&self) -> Bin {
        let (bits, wrong) = (self.bits as f64, self.wrong as f64);
        Bin {
            stated: self.stated / bits,
            bits: self.bits,
            wrong: self.wrong,
            wrong_95: share_95(wrong / self.crowding(), bits / self.crowding()),
        }
    }

    /// The factor on the variance of the share by correlation within panels (Cochran 1977, section 9A: the ratio estimator of clusters); at
    /// least 1.
    fn crowding(&self) -> f64 {
        let share = self.wrong as f64 / self.bits as f64;
        let [bits, both, wrong] = self.squares.map(|sum| sum as f64);
        let clustered = wrong - 2.0 * share * both + share * share * bits;
        let alone = share * (1.0 - share) * self.bits as f64;
        if alone > 0.0 { (clustered / alone).max(1.0) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Panels of 64 bits that state e⁻²/(1 + e⁻²), and are wrong with that share: each bit independently, or all of a panel together.
    fn counted(seed: u64, panels: u32, together: bool) -> Bin {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut reliability = Reliability::default();
        let share = 1.0 / (1.0 + 2f64.exp());
        for _ in 0..panels {
            let all = random.random_bool(share);
            let wrong = (0..64).fold(0, |bits, led| {
                let is_wrong = if together { all } else { random.random_bool(share) };
                bits | u64::from(is_wrong) << led
            });
            let read = PanelFrame::from_bits(random.random());
            let truth = PanelFrame::from_bits(read.bits() ^ wrong);
            reliability.push(&SoftPanel::certain(read, 8), truth);
        }
        let bins: Vec<Bin> = reliability.bins().collect();
        assert_eq!(bins.len(), 1, "seed {seed}");
        bins[0]
    }

    #[test]
    fn intervals_hold_the_truth_though_bits_are_wrong_together() {
        for together in [false, true] {
            let held = (0..200).filter(|&seed| {
                let bin = counted(seed, 100, together);
                let [low, high] = bin.wrong_95;
                (low..high).contains(&bin.stated)
            });
            let held = held.count();
            assert!((180..=198).contains(&held), "{held} of 200, together: {together}");
        }
    }

    #[test]
    fn parts_add_up_to_the_whole() {
        let truth = PanelFrame::from_bits(0x1234_5678_9abc_def0);
        let soft = |step: i8| SoftPanel::certain(PanelFrame::from_bits(0x1234_5678_9abc_deff), step);
        let (mut whole, mut part) = (Reliability::default(), Reliability::default());
        whole.push(&soft(3), truth);
        part.push(&soft(90), truth);
        whole.merge(&part);
        let bins: Vec<Bin> = whole.bins().collect();
        assert_eq!(bins.len(), 2);
        assert!(bins.iter().all(|bin| bin.bits == 64 && bin.wrong == 4));
    }

    #[test]
    fn what_is_not_known_is_not_counted() {
        let mut reliability = Reliability::default();
        reliability.push(&SoftPanel::ERASED, PanelFrame::from_bits(u64::MAX));
        assert_eq!(reliability.bins().count(), 0);
    }
}
