//! A carrier that begins, ends, jumps or becomes another in mid-film: earlier frames then say nothing of it.

/// A frame's usual cost while the carrier stays as it is, at most (nats). Higher: changes are noticed later.
const USUAL: f32 = 1.0;
/// The cost beyond the usual from which the carrier may have changed (nats). Lower: frames that show no symbol well look like a change.
pub(super) const CHANGED: f32 = 15.0;

/// What is added up, at most (nats): frames that are as usual again take it back soon.
const EXCESS_MAX: f32 = 2.0 * CHANGED;

/// The number of the frame at which the last run of costs above the usual began, if they add up to a change (a CUSUM; Page 1954).
pub(super) fn changed_at(losses: impl Iterator<Item = f32>) -> Option<usize> {
    let (mut from, mut excess) = (0, 0.0f32);
    for (number, loss) in losses.enumerate() {
        excess = (excess + loss - USUAL).clamp(0.0, EXCESS_MAX);
        if excess == 0.0 {
            from = number + 1;
        }
    }
    (excess > CHANGED).then_some(from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_begins_where_costs_begin_to_add_up() {
        let frames = |costs: &[f32]| changed_at(costs.iter().copied().cycle().take(40));
        assert_eq!(frames(&[0.5]), None);
        // One frame of two symbols in four.
        assert_eq!(frames(&[0.2, 0.4, 0.1, 3.0]), None);
        let changed = |after: usize| changed_at([0.5; 40].into_iter().chain(core::iter::repeat_n(3.0, after)));
        assert_eq!(changed(7), None);
        assert_eq!(changed(8), Some(40));
        // It is over.
        let over = core::iter::repeat_n(8.0, 16).chain([0.3; 40]);
        assert_eq!(changed_at(over), None);
    }
}
