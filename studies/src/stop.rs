//! Interruption of long work: the flag that every long loop checks.

use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that ends work from elsewhere, such as from a handler of Ctrl-C. Copies refer to the same flag.
///
/// It is checked frame by frame: stopped work ends with an error ([`crate::monte_carlo::EvaluateError::Stopped`]), and finished pieces of
/// work are kept.
///
/// ```
/// use std::sync::atomic::{AtomicBool, Ordering};
/// use studies::stop::Stop;
/// static FLAG: AtomicBool = AtomicBool::new(false);
/// let stop = Stop::at(&FLAG);
/// assert!(!stop.is_asked() && !Stop::NEVER.is_asked());
/// FLAG.store(true, Ordering::Relaxed);
/// assert!(stop.is_asked());
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Stop(Option<&'static AtomicBool>);

impl Stop {
    /// The flag of work that runs to its end.
    pub const NEVER: Self = Self(None);

    /// Stops once `flag` is set.
    pub const fn at(flag: &'static AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether work is to end.
    pub fn is_asked(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Whether both refer to the same flag.
impl PartialEq for Stop {
    fn eq(&self, other: &Self) -> bool {
        match (self.0, other.0) {
            (Some(own), Some(others)) => std::ptr::eq(own, others),
            (own, others) => own.is_none() && others.is_none(),
        }
    }
}
