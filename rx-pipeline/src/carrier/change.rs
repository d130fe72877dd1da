//! Detects that a carrier begins, ends, jumps or is replaced by another in the middle of a film, which makes earlier frames useless.

/// Maximum cost of a frame while the carrier is unchanged (nats). Higher: changes are noticed later.
const USUAL: f32 = 1.0;
/// Excess cost from which the carrier may have changed (nats). Lower: frames with unclear symbols look like a change.
pub(super) const CHANGED: f32 = 15.0;

/// Maximum accumulated excess (nats), so that usual frames soon cancel it.
const EXCESS_MAX: f32 = 2.0 * CHANGED;

/// A change of the carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// The number of the first frame after the change.
    pub first: usize,
    /// The cost of that frame and all later ones without a change (nats).
    pub loss: f32,
}

/// The start of the last run of costs above the usual, if they add up to a change (a CUSUM; Page 1954).
pub(super) fn change(losses: impl Iterator<Item = f32>) -> Option<Change> {
    let (mut change, mut excess) = (Change { first: 0, loss: 0.0 }, 0.0f32);
    for (number, loss) in losses.enumerate() {
        excess = (excess + loss - USUAL).clamp(0.0, EXCESS_MAX);
        change.loss += loss;
        if excess == 0.0 {
            let first = number + 1;
            change = Change { first, loss: 0.0 };
        }
    }
    (excess > CHANGED).then_some(change)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_begins_where_costs_begin_to_add_up() {
        let frames = |costs: &[f32]| change(costs.iter().copied().cycle().take(40));
        assert_eq!(frames(&[0.5]), None);
        // One frame in four shows two symbols.
        assert_eq!(frames(&[0.2, 0.4, 0.1, 3.0]), None);
        let changed = |after: usize| change([0.5; 40].into_iter().chain(core::iter::repeat_n(3.0, after)));
        assert_eq!(changed(7), None);
        assert_eq!(changed(8), Some(Change { first: 40, loss: 24.0 }));
        // The change is over.
        let over = core::iter::repeat_n(8.0, 16).chain([0.3; 40]);
        assert_eq!(change(over), None);
    }
}
