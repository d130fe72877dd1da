//! A carrier that begins, ends, jumps or becomes another in mid-film: earlier frames then say nothing of it.

/// A frame's usual cost while the carrier stays as it is, at most (nats). Higher: changes are noticed later.
const USUAL: f32 = 1.0;
/// The cost beyond the usual from which the carrier may have changed (nats). Lower: frames that show no symbol well look like a change.
pub(super) const CHANGED: f32 = 15.0;

/// The greatest excess that adds up (nats): frames that are as usual again take it back soon.
const EXCESS_MAX: f32 = 2.0 * CHANGED;

/// A change of the carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// The number of the first frame after it.
    pub first: usize,
    /// The cost of that frame and all later ones as if nothing had changed (nats).
    pub loss: f32,
}

/// The change at which the last run of costs above the usual began, if they add up to one (a CUSUM; Page 1954).
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
        // One frame of two symbols in four.
        assert_eq!(frames(&[0.2, 0.4, 0.1, 3.0]), None);
        let changed = |after: usize| change([0.5; 40].into_iter().chain(core::iter::repeat_n(3.0, after)));
        assert_eq!(changed(7), None);
        assert_eq!(changed(8), Some(Change { first: 40, loss: 24.0 }));
        // It is over.
        let over = core::iter::repeat_n(8.0, 16).chain([0.3; 40]);
        assert_eq!(change(over), None);
    }
}
