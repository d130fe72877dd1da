//! Whether long work may go on: the one flag that every long loop looks at.

use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that ends work from elsewhere, such as from a handler of Ctrl-C. Copies are of the same flag.
///
/// It is looked at frame by frame: work that is asked to stop ends with an error that says so
/// ([`crate::monte_carlo::EvaluateError::Stopped`]), and the finished pieces of work are kept.
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
    /// Of work that goes on to its end.
    pub const NEVER: Self = Self(None);

    /// When `flag` is set.
    pub const fn at(flag: &'static AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether work is to end.
    pub fn is_asked(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Whether both look at the same flag.
impl PartialEq for Stop {
    fn eq(&self, other: &Self) -> bool {
        match (self.0, other.0) {
            (Some(own), Some(others)) => std::ptr::eq(own, others),
            (own, others) => own.is_none() && others.is_none(),
        }
    }
}
