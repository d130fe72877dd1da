//! Logarithms and powers of 2 by tables, in fixed point.

use fixed::types::{I6F26, U32F32};
use link::l2a_table::Illuminance;

/// Entries of the largest table, and two beyond the octave for the polynomial.
const LARGEST: usize = 512 + 2;
/// Fraction bits of the entries.
const BITS: u32 = 30;

/// A table of [`LARGEST`] entries or fewer, for `ENTRIES` steps.
struct Tables<const ENTRIES: usize>;

impl<const ENTRIES: usize> Tables<ENTRIES> {
    const LOG2: [u32; LARGEST] = logarithms(ENTRIES);
    /// 2^(k/ENTRIES).
    const EXP2: [u32; LARGEST] = powers(ENTRIES);
}

/// log₂ of an illuminance; 0 counts as the smallest step.
pub fn log2_by_table<const ENTRIES: usize, const ORDER: usize>(value: Illuminance) -> I6F26 {
    let bits = value.to_bits().max(1);
    let exponent = bits.ilog2();
    // The mantissa's fraction with 31 bits.
    let fraction = (bits << (31 - exponent)) & 0x7fff_ffff;
    let log = between::<ENTRIES, ORDER>(&Tables::<ENTRIES>::LOG2, fraction);
    let whole = exponent.cast_signed() - Illuminance::FRAC_NBITS.cast_signed();
    I6F26::from_bits((whole << 26) + (log >> (BITS - 26)) as i32)
}

/// 2 to the power `log`.
pub fn exp2_by_table<const ENTRIES: usize, const ORDER: usize>(log: I6F26) -> U32F32 {
    let bits = log.to_bits();
    let fraction = (bits.cast_unsigned() & 0x03ff_ffff) << 5;
    let mantissa = between::<ENTRIES, ORDER>(&Tables::<ENTRIES>::EXP2, fraction) as u64;
    let places = (bits >> 26) + (32 - BITS).cast_signed();
    U32F32::from_bits(if places < 0 {
        mantissa >> places.unsigned_abs().min(63)
    } else {
        mantissa << places.min(31)
    })
}

/// The value at a fraction of 31 bits: the line through two entries, or the parabola through three.
fn between<const ENTRIES: usize, const ORDER: usize>(table: &[u32; LARGEST], fraction: u32) -> i64 {
    let shift = 31 - ENTRIES.ilog2();
    let at = (fraction >> shift) as usize;
    let part = i64::from(fraction & ((1 << shift) - 1));
    let [a, b] = [table[at], table[at + 1]].map(i64::from);
    let line = a + (((b - a) * part) >> shift);
    if ORDER < 2 {
        return line;
    }
    let bend = i64::from(table[at + 2]) - 2 * b + a;
    // t·(t − 1)/2, with 31 bits of fraction.
    let t = part << (31 - shift);
    let weight = (t * (t - (1 << 31))) >> 32;
    line + ((bend * weight) >> 31)
}

/// By repeated squaring: the mantissa is squared, and each time the square reaches 2 the next bit is 1.
const fn logarithms(entries: usize) -> [u32; LARGEST] {
    let mut table = [0; LARGEST];
    let mut k = 0;
    while k < entries + 2 && k < LARGEST {
        let mut mantissa = ((1u64 << 32) * (entries + k) as u64 / entries as u64) as u128;
        let mut log = 0u32;
        if mantissa >= 1 << 33 {
            mantissa >>= 1;
            log = 1;
        }
        let mut bit = 0;
        while bit < BITS {
            mantissa = (mantissa * mantissa) >> 32;
            let doubled = (mantissa >> 33) as u32;
            mantissa >>= doubled;
            log = log << 1 | doubled;
            bit += 1;
        }
        table[k] = log;
        k += 1;
    }
    table
}

/// By the power series of e^(x·ln 2).
const fn powers(entries: usize) -> [u32; LARGEST] {
    /// ln 2 with 60 bits of fraction.
    const LN_2: u128 = 799_144_290_325_165_979;
    const ONE: u128 = 1 << 60;
    let mut table = [0; LARGEST];
    let mut k = 0;
    while k < entries + 2 && k < LARGEST {
        let x = LN_2 * k as u128 / entries as u128;
        let (mut sum, mut term) = (ONE, 30);
        while term > 0 {
            sum = ONE + ((x * sum) >> 60) / term;
            term -= 1;
        }
        table[k] = ((sum + (1 << (59 - BITS))) >> (60 - BITS)) as u32;
        k += 1;
    }
    table
}
