//! Values with a range, and the error for those outside.

use std::ops::RangeInclusive;

use link::panel::LEDS;

use super::values::{L2a, Leds};

/// A value out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key} = {value}: must be {allowed}; {way_out}")]
pub struct RangeError {
    /// The scene key.
    pub key: String,
    /// Its value.
    pub value: String,
    /// The allowed values.
    pub allowed: String,
    /// The remedy.
    pub way_out: String,
}

/// A value with a range of its numbers.
pub(super) trait Ranged {
    /// # Errors
    /// The first number out of range; `key` names it.
    fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError>;
}

impl Ranged for f64 {
    fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError> {
        if range.contains(self) {
            return Ok(());
        }
        let key = key();
        Err(RangeError {
            value: self.to_string(),
            allowed: format!("a number from {} to {}", range.start(), range.end()),
            way_out: format!("set it with {key}=… or in the scene file"),
            key,
        })
    }
}

macro_rules! ranged_as_f64 {
    ($($number:ty)*) => {$(
        impl Ranged for $number {
            fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError> {
                (*self as f64).check(range, key)
            }
        }
    )*};
}

ranged_as_f64!(u8 u16 u32 usize);

impl<T: Ranged> Ranged for Option<T> {
    fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError> {
        self.as_ref().map_or(Ok(()), |value| value.check(range, key))
    }
}

impl Ranged for [f64; 3] {
    fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError> {
        self.iter().try_for_each(|part| part.check(range.clone(), key))
    }
}

impl Ranged for L2a {
    fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError> {
        match self {
            Self::Ratio(ratio) => ratio.check(range, key),
            Self::Table(_) => Ok(()),
        }
    }
}

impl Ranged for Leds {
    /// The range is that of the count; each LED of a list must be one of the panel's.
    fn check(&self, range: RangeInclusive<f64>, key: &dyn Fn() -> String) -> Result<(), RangeError> {
        match self {
            Self::Count(count) => count.check(range, key),
            Self::List(list) => list.iter().try_for_each(|led| led.check(0.0..=(LEDS - 1) as f64, key)),
        }
    }
}
