//! Changes of the exposure, which multiply grey levels: under an encoding curve that is a power, by the same factor.

use super::Level;
use super::places::AROUND;

/// The ranks of the places that are compared, the darkest first (share): brighter ones may be white. Fewer: things that pass weigh more.
const COMPARED: [f32; 2] = [0.1, 0.5];
/// A smaller change does not count (logarithm of a ratio). Lower: slower if cameras shake, because other ground in sight changes grey
/// levels too.
const CHANGED: f32 = 0.1;

/// The factor by which grey levels have changed, if it is not about 1, whether or not the places have moved.
pub(super) fn change(before: &[Level; AROUND], now: &[Level; AROUND]) -> Option<f32> {
    let [before, now] = [before, now].map(dark_level);
    let change = now / before;
    (libm::logf(change).abs() > CHANGED && change.is_finite()).then_some(change)
}

/// The mean level of the darker places.
fn dark_level(levels: &[Level; AROUND]) -> f32 {
    let mut levels = levels.map(|level| level.mean);
    levels.sort_unstable_by(f32::total_cmp);
    let [first, last] = COMPARED.map(|rank| (rank * AROUND as f32) as usize);
    levels[first..last].iter().sum::<f32>() / (last - first) as f32
}
