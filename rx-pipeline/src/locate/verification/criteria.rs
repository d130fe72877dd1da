//! The criteria of a panel, one function each.

use super::{Scope, distinctness, shows_off};
use crate::fit::Fit;
use crate::lattice::Lattice;
use crate::locate::LocateError;
use crate::settings::SearchSettings;
use crate::spots::{LatticeModel, Slope};
use core::ops::RangeInclusive;
use link::framing::SYNC;
use link::orientation::Orientation;
use link::panel::LEDS;

// Where there are two values, the first is for the change between two frames, the second for a single frame, which holds all the clutter.

/// What may be left unexplained (multiple of the camera's noise): what stands behind the panel counts too in a
/// single frame, but its noise is better known. Higher: more that is no panel passes.
const EXCUSED_NOISE: [f32; 2] = [1.15, 1.0];
/// What may be left unexplained beside (share of the signal's energy). Higher: more that is no panel passes; lower:
/// panels seen askew do not.
const EXCUSED_SIGNAL: [f32; 2] = [0.07, 0.07];
/// The same in the change between two frames, and within a board, where LEDs are of two brightnesses and none between: discs under a
/// sharp lens, sharpening, codecs and white make spots that are not quite Gaussian. More in proportion, the more distinct they are.
const EXCUSED_IF_DISTINCT: f32 = 0.17;
/// But no more than that.
const EXCUSED_MOST: f32 = 0.3;
/// What a lattice in the change between two frames may leave, if it is then seen there again and again (multiple of what is excused).
/// Higher: lenses and codecs of other kinds are excused, and more that is no panel is remembered.
const MOST_MISFIT: f32 = 2.5;
/// LEDs are distinct if the step from Off to On is greater (multiple of the standard deviation among LEDs of one state). 64
/// brightnesses spread evenly, cut in two halves, have 3.5. Higher: panels of unequal LEDs wait for other frames.
pub(super) const DISTINCT: f32 = 7.5;
/// What the spots explain, at least (energy ratio): LEDs seen this clearly are no accident. Higher: faint panels
/// wait for other frames.
const LEAST_EXPLAINED: [f32; 2] = [700.0, 4000.0];
/// The same for the dimmest outer line of LEDs (energy ratio): below, the lattice may as well be a line off.
const LEAST_EDGE: f32 = 25.0;
/// LEDs that are On, or have changed (count). Scrambled bits have 32 ± 4.
const LIT: RangeInclusive<u32> = 8..=56;
/// Neighbours in rows and columns that differ (count). In random bits 56 ± 5 of 112 do; in pictures, which are
/// smooth, far fewer.
const DIFFERENT: RangeInclusive<u32> = 40..=84;
/// How much a single frame's bits repeat, at most (squared deviations of random ones): 1 of 10 000 panels does more. Higher: windows,
/// text and lattices of a third of a panel's pitch pass; lower: more panels wait for other frames.
const MOST_REPETITION: u32 = 19;
/// Outer lines without an LED that stands out in a single frame, being On or, on a bright board, Off, at most (count): 1 of 10 000
/// panels has more, and so has a lattice that is larger than the panel. Higher: such lattices pass.
const MOST_DARK_EDGES: usize = 1;
/// Columns and rows after which bits may repeat, at most (count).
const FARTHEST_REPEAT: u32 = 4;
/// Off LEDs darker than the ground by more are none, without a board and with one (share of the step from Off to On).
const DARKEST_OFF: [f32; 2] = [-0.3, -1.0];
/// Pitch along rows over pitch along columns (ratio): seen from up to 40° aside.
const ASPECT: RangeInclusive<f32> = 0.72..=1.39;
/// Before the fit the counts of On LEDs and of differing neighbours may be this far out of range, and a lattice this much narrower or
/// wider (ratio): so much the fit changes. Higher: slower; lower: panels are missed whose pose is not yet right.
const SLACK: (u32, u32, f32) = (4, 8, 1.1);
/// The least pitch (px): LEDs closer together run into each other under any blur that is looked for, and any smooth
/// patch looks like them.
pub const LEAST_PITCH_PX: f32 = 2.0;
/// Rows and columns are no further from right angles (cosine).
const MOST_SHEAR: f32 = 0.2;
/// A spot's width over the pitch (ratio): small discs under a sharp lens are the narrowest, LEDs that run into each other
/// the widest. Wider: more that is no panel passes.
const SPOT_OVER_PITCH: RangeInclusive<f32> = 0.08..=0.85;

/// What a lattice that passes is like.
pub(super) struct Passed {
    pub signal_to_noise: f32,
    /// What is left unexplained over what may be (ratio of variances): above 1 only in the change between two frames.
    pub misfit: f32,
}

/// All that needs nothing but the fit, with `noise` the variance of a pixel.
pub(super) fn examine(fitted: &Fit, noise: f32, scope: Scope, settings: &SearchSettings) -> Result<Passed, LocateError> {
    let Fit { spots, slope } = fitted;
    unsaturated(slope, settings.max_saturated_percent)?;
    let misfit = explained_down_to_noise(fitted, noise, scope)?;
    let signal_to_noise = clear(slope, noise, scope)?;
    random(spots, scope)?;
    all_edges_seen(spots, slope, noise)?;
    let darkest = match scope {
        Scope::Change => f32::NEG_INFINITY,
        Scope::Ground => DARKEST_OFF[0],
        Scope::Board => DARKEST_OFF[1],
    };
    if spots.off < darkest * spots.contrast {
        return Err(LocateError::NoLattice);
    }
    seen_from_before(&spots.lattice)?;
    as_wide_as_leds(spots)?;
    Ok(Passed { signal_to_noise, misfit })
}

/// What can be told of a pose before the fit: whether its pattern and shape are not too far from a panel's. LEDs that are on in `states`, or
/// have changed, are not 0.
pub(super) fn foresee(lattice: &Lattice, states: &[i8; LEDS]) -> Result<(), LocateError> {
    let pattern = states
        .iter()
        .enumerate()
        .fold(0u64, |bits, (led, &state)| bits | u64::from(state != 0) << led);
    let (lit, different) = counts(pattern);
    let near = |range: &RangeInclusive<u32>, slack: u32, value: u32| (range.start() - slack..=range.end() + slack).contains(&value);
    if !near(&LIT, SLACK.0, lit) || !near(&DIFFERENT, SLACK.1, different) {
        return Err(LocateError::NotRandom { lit, different });
    }
    possible(lattice, SLACK.2)
}

fn unsaturated(slope: &Slope, max_percent: u8) -> Result<(), LocateError> {
    let share = slope.pixels as f32 / slope.window_pixels.max(1) as f32;
    let percent = (100.0 * (1.0 - share)) as u8;
    if percent > max_percent {
        return Err(LocateError::Saturated { percent, max_percent });
    }
    Ok(())
}

/// What is left over what may be.
fn explained_down_to_noise(fitted: &Fit, noise: f32, scope: Scope) -> Result<f32, LocateError> {
    let Fit { spots, slope } = fitted;
    let pixels = slope.pixels as f32;
    let signal = (slope.total - noise * pixels).max(0.0);
    let mode = usize::from(scope.is_single());
    // Spots that overlap can stand in for each other: the closer they are the less may be left.
    let apart = spots.apart();
    let distinctness = distinctness(fitted);
    let excused = if scope != Scope::Ground && distinctness > DISTINCT {
        (EXCUSED_IF_DISTINCT * distinctness / DISTINCT).min(EXCUSED_MOST)
    } else {
        EXCUSED_SIGNAL[mode]
    };
    let allowed = EXCUSED_NOISE[mode] * noise * pixels + excused * apart * apart * apart * apart * signal;
    let most = if scope.is_single() { 1.0 } else { MOST_MISFIT };
    let misfit = slope.squares / allowed;
    if misfit.is_nan() || misfit > most {
        return Err(LocateError::GridDoesNotFit {
            residual_grey: fitted.residual_grey(),
            allowed_grey: libm::sqrtf(allowed / pixels.max(1.0)),
        });
    }
    Ok(misfit)
}

/// The signal-to-noise ratio, in amplitude.
fn clear(slope: &Slope, noise: f32, scope: Scope) -> Result<f32, LocateError> {
    let explained = (slope.total - slope.squares) / noise;
    let needed = LEAST_EXPLAINED[usize::from(scope.is_single())];
    if explained < needed {
        return Err(LocateError::ContrastTooLow {
            signal_to_noise: libm::sqrtf(explained.max(0.0)),
            needed: libm::sqrtf(needed),
        });
    }
    Ok(libm::sqrtf(explained))
}

/// Whether a pattern may be a message's, by how many LEDs are On and how many neighbours differ.
pub(crate) fn is_random(pattern: u64) -> bool {
    are_random(counts(pattern))
}

fn are_random((lit, different): (u32, u32)) -> bool {
    LIT.contains(&lit) && DIFFERENT.contains(&different)
}

/// LEDs that are On, and neighbours that differ.
fn counts(pattern: u64) -> (u32, u32) {
    (pattern.count_ones(), neighbours_that_differ(pattern))
}

fn random(spots: &LatticeModel, scope: Scope) -> Result<(), LocateError> {
    let states = spots.state.iter().enumerate();
    let pattern = states.fold(0u64, |bits, (led, &state)| bits | u64::from(state != 0.0) << led);
    let (lit, different) = counts(pattern);
    // What begins each block is the same each time, and far from random.
    let is_sync = || {
        let mut seen = Orientation::ALL.into_iter().map(|orientation| SYNC.seen(orientation).bits());
        seen.any(|sync| [pattern, !pattern].contains(&sync))
    };
    let stand_out = if shows_off(spots) { !pattern } else { pattern };
    let is_orderly = || repetition(pattern) > MOST_REPETITION || empty_edges(stand_out) > MOST_DARK_EDGES;
    if !are_random((lit, different)) || scope.is_single() && is_orderly() && !is_sync() {
        return Err(LocateError::NotRandom { lit, different });
    }
    Ok(())
}

/// Outer lines in which no LED stands out.
fn empty_edges(pattern: u64) -> usize {
    let lines = [0xff, 0xff << 56, 0x0101_0101_0101_0101, 0x8080_8080_8080_8080];
    lines.iter().filter(|&line| pattern & line == 0).count()
}

/// How much a pattern is like itself a few columns and rows on: the square of what like places are more than unlike ones, over all that are
/// compared. In random bits it is 1 at most on average.
fn repetition(pattern: u64) -> u32 {
    let steps =
        (0..=FARTHEST_REPEAT).flat_map(|down| (-(FARTHEST_REPEAT as i32)..=FARTHEST_REPEAT as i32).map(move |across| (across, down)));
    steps
        .filter(|&(across, down)| down > 0 || across > 0)
        .map(|(across, down)| {
            let columns = across.unsigned_abs();
            let within = column_mask(columns);
            // Places whose counterpart is `columns` to the right and `down` rows below; or to the left.
            let (there, here) = if across >= 0 {
                (pattern >> (8 * down + columns), pattern)
            } else {
                (pattern >> (8 * down), pattern >> columns)
            };
            let compared = within & (u64::MAX >> (8 * down));
            let places = compared.count_ones();
            let unlike = ((there ^ here) & compared).count_ones();
            let surplus = places.saturating_sub(2 * unlike);
            surplus * surplus / places
        })
        .max()
        .unwrap_or(0)
}

/// All but the last so many columns.
fn column_mask(columns: u32) -> u64 {
    0x0101_0101_0101_0101 * (0xff >> columns)
}

fn all_edges_seen(spots: &LatticeModel, slope: &Slope, noise: f32) -> Result<(), LocateError> {
    let edge = spots.dimmest_edge(slope) / noise;
    if edge < LEAST_EDGE {
        return Err(LocateError::EdgeUnseen {
            signal_to_noise: libm::sqrtf(edge.max(0.0)),
        });
    }
    Ok(())
}

/// Whether the lattice is that of a panel that is read from before it, and not from too far.
fn seen_from_before(lattice: &Lattice) -> Result<(), LocateError> {
    let [across, down] = lattice.pitch();
    let pitch_px = across.min(down);
    if pitch_px < LEAST_PITCH_PX {
        return Err(LocateError::TooSmall { pitch_px });
    }
    possible(lattice, 1.0)
}

/// Whether a lattice is that of a panel that is read from before it; `slack` times narrower or wider ones pass, too.
fn possible(lattice: &Lattice, slack: f32) -> Result<(), LocateError> {
    let [across, down] = lattice.pitch();
    let aspect = across / down;
    let shear = (lattice.column[0] * lattice.row[0] + lattice.column[1] * lattice.row[1]) / (across * down);
    if !((ASPECT.start() / slack..=ASPECT.end() * slack).contains(&aspect) && shear.abs() < MOST_SHEAR * slack) {
        return Err(LocateError::ImpossiblePose {
            aspect,
            angle_deg: libm::acosf(shear.clamp(-1.0, 1.0)).to_degrees(),
        });
    }
    Ok(())
}

/// Whether spots are as wide as LEDs can be at their pitch, under whatever blur.
fn as_wide_as_leds(spots: &LatticeModel) -> Result<(), LocateError> {
    let [across, down] = spots.lattice.pitch();
    let narrowest_px = SPOT_OVER_PITCH.start() * across.min(down);
    let widest_px = SPOT_OVER_PITCH.end() * across.min(down);
    if !(narrowest_px..=widest_px).contains(&spots.sigma) {
        return Err(LocateError::SpotsDoNotFit {
            spot_sigma_px: spots.sigma,
            narrowest_px,
            widest_px,
        });
    }
    Ok(())
}

/// Pairs of neighbours in rows and columns that differ.
fn neighbours_that_differ(pattern: u64) -> u32 {
    let rows = (pattern ^ pattern >> 8) & (u64::MAX >> 8);
    let columns = (pattern ^ pattern >> 1) & column_mask(1);
    rows.count_ones() + columns.count_ones()
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::scramble::split_mix64;

    #[test]
    fn random_bits_differ_from_their_neighbours_half_of_the_time() {
        assert_eq!(neighbours_that_differ(0), 0);
        assert_eq!(neighbours_that_differ(u64::MAX), 0);
        // A chessboard differs everywhere.
        assert_eq!(neighbours_that_differ(0xaa55_aa55_aa55_aa55), 112);
        assert!(DIFFERENT.contains(&neighbours_that_differ(0x9a3c_5e71_0f96_c3a5)));
    }

    #[test]
    fn patterns_that_repeat_are_told_from_random_bits() {
        // Every third row and column is dark.
        assert_eq!(repetition(0x3636_0036_3600_3636), 40);
        let repeating = (1..1000).filter(|&i| repetition(split_mix64(i)) > MOST_REPETITION);
        assert!(repeating.count() <= 1);
    }

    #[test]
    fn outer_lines_without_an_led_that_is_on_are_counted() {
        assert_eq!(empty_edges(0x0050_265a_3a5c_2e00), 4);
        assert_eq!(empty_edges(SYNC.bits()), 0);
    }
}
