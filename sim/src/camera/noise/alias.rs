//! Walker's alias method, with eight random bits if they suffice.
//!
//! A distribution over N levels becomes N equally likely columns, each of which holds a part of its own level and is filled by one other
//! (Walker 1977). A column is split at a 40-bit position. Eight random bits decide on the side of a draw, unless they equal the position's
//! upper eight bits, once in 256 draws; then 32 more bits are drawn. So a draw costs 8 bits and those of the column, and a probability is
//! off by at most 2⁻⁴⁰.

use rand::Rng;

/// One column: its own level and another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C, align(4))]
pub struct Column {
    /// The upper eight bits of the part that is `own`, in 2⁻⁸.
    part: u8,
    /// The level that fills the column.
    other: u8,
    /// The XOR of the column's own level and `other`.
    change: u8,
}

/// The lower 32 bits of a column's part, for draws that the upper eight do not decide.
pub type Fine = u32;

impl Column {
    fn own(self) -> u8 {
        self.other ^ self.change
    }

    /// The level for eight random bits, or `None` if they do not decide: see [`Column::settle`].
    #[inline(always)]
    pub fn level(self, chance: u8) -> Option<u8> {
        // All ones or all zeros, because a branch would be mispredicted half of the time.
        let mask = u8::from(chance < self.part).wrapping_neg();
        let level = self.other ^ (self.change & mask);
        (chance != self.part).then_some(level)
    }

    /// Adds `share` times the distribution of the column to a distribution over all levels.
    pub fn add_law(self, fine: Fine, share: f64, law: &mut [f64; 256]) {
        let own = (f64::from(self.part) + f64::from(fine) / 2f64.powi(32)) / 256.0;
        law[usize::from(self.own())] += share * own;
        law[usize::from(self.other)] += share * (1.0 - own);
    }

    /// The level if eight bits did not decide.
    #[cold]
    #[inline(never)]
    pub fn settle(self, fine: Fine, random: &mut impl Rng) -> u8 {
        if random.next_u32() < fine { self.own() } else { self.other }
    }
}

/// Builds columns; owns the memory for it.
#[derive(Debug, Default)]
pub struct Builder {
    parts: Vec<f64>,
    small: Vec<usize>,
    large: Vec<usize>,
}

impl Builder {
    /// Fills `columns`, and `fine` beside them, with the distribution of the levels from `first` on; levels of probability 0 fill the rest.
    /// There must be at least as many columns as probabilities.
    pub fn build(&mut self, first: u8, probabilities: &[f64], columns: &mut [Column], fine: &mut [Fine]) {
        let sum: f64 = probabilities.iter().sum();
        let scale = columns.len() as f64 / sum;
        self.parts.clear();
        self.parts.extend(probabilities.iter().map(|p| p * scale));
        self.parts.resize(columns.len(), 0.0);
        self.small.clear();
        self.large.clear();
        for (index, &part) in self.parts.iter().enumerate() {
            let own = first.saturating_add(index as u8);
            // A full column holds its own level on either side.
            (columns[index], fine[index]) = (split(own, own, 0.0), 0);
            if part < 1.0 {
                self.small.push(index);
            } else {
                self.large.push(index);
            }
        }
        while let (Some(&less), Some(&more)) = (self.small.last(), self.large.last()) {
            self.small.pop();
            let part = self.parts[less];
            columns[less] = split(columns[less].own(), columns[more].own(), part);
            fine[less] = lower_bits(part);
            self.parts[more] -= 1.0 - part;
            if self.parts[more] < 1.0 {
                self.large.pop();
                self.small.push(more);
            }
        }
    }
}

/// A column's part in 2⁻⁴⁰.
fn in_steps(part: f64) -> u64 {
    ((part * (1u64 << 40) as f64).round() as u64).min((1 << 40) - 1)
}

fn split(own: u8, other: u8, part: f64) -> Column {
    Column {
        part: (in_steps(part) >> 32) as u8,
        other,
        change: own ^ other,
    }
}

fn lower_bits(part: f64) -> Fine {
    in_steps(part) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_for_the_law_they_were_built_from() {
        let probabilities = [1e-9, 0.3, 0.001, 0.0, 0.648_999_999, 0.05];
        let (mut columns, mut fine) = ([Column::default(); 16], [0; 16]);
        Builder::default().build(250, &probabilities, &mut columns, &mut fine);
        let mut built = [0.0; 256];
        for (column, fine) in columns.iter().zip(fine) {
            column.add_law(fine, 1.0 / 16.0, &mut built);
        }
        for (index, p) in probabilities.iter().enumerate() {
            assert!(
                (built[250 + index] - p).abs() < 2f64.powi(-40),
                "level {index}: {} for {p}",
                built[250 + index]
            );
        }
    }
}
