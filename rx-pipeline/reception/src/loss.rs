//! Why frames gave no reading, as one word per kind, for counts.

use rx_pipeline::receiver::{Loss, LossKind};

/// The kind of a loss, without its numbers.
///
/// ```
/// use rx_pipeline::receiver::Loss;
/// assert_eq!(reception::loss::name(&Loss::NoPlace), "no_place");
/// ```
pub fn name(loss: &Loss) -> &'static str {
    match loss.kind() {
        LossKind::Covered => "covered",
        LossKind::Undetected => "undetected",
        LossKind::EdgeUnseen => "edge_unseen",
        LossKind::Coasting(_) => "coasting",
        LossKind::ContrastTooLow => "contrast_too_low",
        LossKind::Lost(_) => "given_up",
        LossKind::NoCandidate => "no_candidate",
        LossKind::NoPlace => "no_place",
        LossKind::NotRandom => "not_random",
        LossKind::Saturated => "saturated",
        LossKind::NoFeatures => "no_features",
        LossKind::NoGrid => "no_grid",
        LossKind::NoPanel => "no_panel",
        LossKind::GoesOn => "goes_on",
        LossKind::NoCells => "no_cells",
    }
}
