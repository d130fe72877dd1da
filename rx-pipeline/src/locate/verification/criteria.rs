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

// Of two values, the first is for the change between two frames, the second for a single frame, which holds all the clutter.

/// The allowed residual from noise (multiple of the camera's noise): a single frame shows the background behind the panel too, but its
/// noise is better known. Higher: more false positives.
const EXCUSED_NOISE: [f32; 2] = [1.15, 1.0];
/// The allowed residual in addition to noise (share of the signal's energy). Higher: more false positives; lower: panels seen askew are
/// lost.
const EXCUSED_SIGNAL: [f32; 2] = [0.07, 0.07];
/// The same for LEDs of two clear brightnesses in the change between two frames and within a board: discs under a sharp lens, sharpening,
/// codecs and white make spots that are not quite Gaussian. It grows in proportion to the distinctness.
const EXCUSED_IF_DISTINCT: f32 = 0.17;
/// The greatest residual allowed in this way.
const EXCUSED_MOST: f32 = 0.3;
/// The greatest residual of a lattice in the change between two frames that later sightings may confirm (multiple of the allowed one).
/// Higher: lenses and codecs of other kinds pass, and more false positives are remembered.
const MOST_MISFIT: f32 = 2.5;
/// LEDs are distinct if the step from Off to On is greater (multiple of the standard deviation among LEDs of one state). 64 evenly spread
/// brightnesses, cut in two halves, have 3.5. Higher: panels of unequal LEDs wait for other frames.
pub(super) const DISTINCT: f32 = 7.5;
/// The energy that the spots explain, at least (ratio to noise): such clear LEDs are not due to chance. Higher: faint panels wait for other
/// frames.
const LEAST_EXPLAINED: [f32; 2] = [700.0, 4000.0];
/// The same for the dimmest outer line of LEDs (ratio to noise): below, the lattice may be off by a line.
const LEAST_EDGE: f32 = 25.0;
/// LEDs that are On, or have changed (count). Scrambled bits have 32 ± 4.
const LIT: RangeInclusive<u32> = 8..=56;
/// Neighbours in rows and columns that differ (count). In random bits 56 ± 5 of 112 do; in pictures, which are
/// smooth, far fewer.
const DIFFERENT: RangeInclusive<u32> = 40..=84;
/// Neighbours that differ in two symbols of one exposure, at least (count): 42 ± 7 do, and fewer in one of 50. Lower: bright lines are
/// followed as panels; higher: exposures of two symbols are lost.
const LEAST_DIFFERENT_OF_TWO: u32 = 27;
/// Maximum repetition of a single frame's bits (squared deviations of random ones): 1 of 10 000 panels exceeds it. Higher: windows, text
/// and lattices of a third of a panel's pitch pass; lower: more panels wait for other frames.
const MOST_REPETITION: u32 = 19;
/// Outer lines of a single frame in which no LED stands out (as On or, on a bright board, as Off), at most (count). 1 of 10 000 panels has
/// more, and so has a lattice that is larger than the panel. Higher: such lattices pass.
const MOST_DARK_EDGES: usize = 1;
/// The greatest period of a repetition, in columns and rows (count).
const FARTHEST_REPEAT: u32 = 4;
/// The darkest Off LEDs relative to the ground, without a board and with one (share of the step from Off to On).
const DARKEST_OFF: [f32; 2] = [-0.3, -1.0];
/// Pitch along rows over pitch along columns (ratio): seen from up to 40° to the side.
const ASPECT: RangeInclusive<f32> = 0.72..=1.39;
/// Tolerance before the fit on the counts of On LEDs and of differing neighbours, and on the aspect (ratio), because the fit changes them.
/// Higher: slower; lower: panels whose pose is not yet right are missed.
const SLACK: (u32, u32, f32) = (4, 8, 1.1);
/// The least pitch (px): closer LEDs merge under any supported blur, and any smooth patch looks like them.
pub const LEAST_PITCH_PX: f32 = 2.0;
/// A lattice of a smaller pitch has collapsed into a line (px).
const COLLAPSED_PX: f32 = 0.1;
/// The greatest deviation of rows and columns from right angles (cosine).
const MOST_SHEAR: f32 = 0.2;
/// A spot's width over the pitch (ratio): small discs under a sharp lens are the narrowest, merged LEDs the widest. Wider: more false
/// positives.
const SPOT_OVER_PITCH: RangeInclusive<f32> = 0.08..=0.85;

/// The results for a lattice that passes.
pub(super) struct FitQuality {
    pub signal_to_noise: f32,
    /// Residual over allowed residual (ratio of variances): above 1 only in the change between two frames.
    pub misfit: f32,
}

/// Checks all criteria that depend only on the fit, with `noise` the variance of a pixel.
pub(super) fn examine(fitted: &Fit, noise: f32, scope: Scope, settings: &SearchSettings) -> Result<FitQuality, LocateError> {
    let Fit { spots, slope } = fitted;
    unsaturated(slope, settings.max_saturated_percent)?;
    let misfit = explained_down_to_noise(fitted, noise, scope)?;
    let signal_to_noise = clear(slope, noise, scope)?;
    random(spots, scope)?;
    all_edges_seen(spots, slope, noise)?;
    let darkest = match scope {
        Scope::Change => f32::NEG_INFINITY,
        Scope::Ground => DARKEST_OFF[0],
        Scope::Board | Scope::ShadedBoard => DARKEST_OFF[1],
    };
    if spots.off < darkest * spots.contrast {
        return Err(LocateError::NoLattice);
    }
    seen_from_before(&spots.lattice)?;
    as_wide_as_leds(spots)?;
    Ok(FitQuality { signal_to_noise, misfit })
}

/// Checks a pose before the fit: its pattern and shape must be near a panel's. The entries of `states` are not 0 for LEDs that are On or
/// have changed.
pub(super) fn check_states(lattice: &Lattice, states: &[i8; LEDS]) -> Result<(), LocateError> {
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

/// Residual over allowed residual.
fn explained_down_to_noise(fitted: &Fit, noise: f32, scope: Scope) -> Result<f32, LocateError> {
    let Fit { spots, slope } = fitted;
    let pixels = slope.pixels as f32;
    let signal = (slope.total - noise * pixels).max(0.0);
    let mode = usize::from(scope.is_single());
    // Overlapping spots can replace each other: the closer they are, the less is allowed.
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

/// Whether a pattern may be a message's, by its numbers of On LEDs and of differing neighbours.
pub(crate) fn is_random(pattern: u64) -> bool {
    are_random(counts(pattern))
}

/// Whether a pattern may be a message's, or that of two symbols in one exposure, which lights three quarters of the LEDs. Edges and bright
/// lines do not.
pub(crate) fn may_be_shown(pattern: u64) -> bool {
    neighbours_that_differ(pattern) >= LEAST_DIFFERENT_OF_TWO
}

fn are_random((lit, different): (u32, u32)) -> bool {
    LIT.contains(&lit) && DIFFERENT.contains(&different)
}

/// On LEDs, and differing neighbours.
fn counts(pattern: u64) -> (u32, u32) {
    (pattern.count_ones(), neighbours_that_differ(pattern))
}

fn random(spots: &LatticeModel, scope: Scope) -> Result<(), LocateError> {
    let states = spots.state.iter().enumerate();
    let pattern = states.fold(0u64, |bits, (led, &state)| bits | u64::from(state != 0.0) << led);
    let (lit, different) = counts(pattern);
    // A block always starts with the same pattern, which is far from random.
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

/// The similarity of a pattern to itself a few columns and rows on: the squared surplus of equal over unequal pairs, divided by the number
/// of pairs; the maximum over all shifts. In random bits it averages at most 1 per shift.
fn repetition(pattern: u64) -> u32 {
    let steps =
        (0..=FARTHEST_REPEAT).flat_map(|down| (-(FARTHEST_REPEAT as i32)..=FARTHEST_REPEAT as i32).map(move |across| (across, down)));
    steps
        .filter(|&(across, down)| down > 0 || across > 0)
        .map(|(across, down)| {
            let columns = across.unsigned_abs();
            let within = column_mask(columns);
            // Pairs `columns` to the right and `down` rows below; or to the left.
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

/// All columns except the last `columns`.
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

/// Checks that a panel of this lattice faces the camera and is near enough.
fn seen_from_before(lattice: &Lattice) -> Result<(), LocateError> {
    let [across, down] = lattice.pitch();
    let pitch_px = across.min(down);
    if pitch_px < LEAST_PITCH_PX {
        return Err(LocateError::TooSmall { pitch_px });
    }
    possible(lattice, 1.0)
}

/// Checks that a panel of this lattice faces the camera; aspects `slack` times beyond the range pass, too.
fn possible(lattice: &Lattice, slack: f32) -> Result<(), LocateError> {
    let [across, down] = lattice.pitch();
    if across.min(down) < COLLAPSED_PX {
        return Err(LocateError::NoLattice);
    }
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

/// Checks that spots have a possible width of LEDs at their pitch, under any blur.
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
    fn two_symbols_may_be_shown_in_one_exposure_and_lines_may_not() {
        let two = (0..1000).filter(|&i| may_be_shown(split_mix64(2 * i) | split_mix64(2 * i + 1)));
        assert!(two.count() >= 970);
        for line in [
            0xff,
            0xff << 24,
            0x0101_0101_0101_0101,
            0xff00_0000_0000_00ff,
            0xffff_ffff,
            u64::MAX,
        ] {
            assert!(!may_be_shown(line), "{line:#x}");
        }
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
