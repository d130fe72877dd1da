//! Stub of the carrier's phase, for panels without a carrier.

use crate::corners::Corners;
use crate::detect::Detection;
use link::panel::SoftPanel;

/// A stub: nothing is read again.
#[derive(Clone, Copy, Debug)]
pub struct Reread<'a>(core::marker::PhantomData<&'a ()>);

/// No carrier.
pub(crate) struct Carrier;

impl Carrier {
    pub const NONE: Self = Self;

    pub fn is_likely(&self) -> bool {
        false
    }

    pub fn reads_by_lines(&self) -> bool {
        false
    }

    pub fn misses_a_line(&self) -> bool {
        false
    }

    pub fn move_panel(&mut self) {}

    pub fn as_seen(&self, _time: f64, symbol: SoftPanel) -> SoftPanel {
        symbol
    }

    pub fn resolve(&mut self, _number: u64, _time: f64, _corners: &Corners, _detection: &mut Detection) -> Option<Reread<'_>> {
        None
    }
}
