//! What a fitted lattice has to be like to be a panel, one criterion a function.

use super::{Scope, apart, distinctness, shows_off};
use crate::fit::Fit;
use crate::lattice::Lattice;
use crate::locate::LocateError;
use crate::parameters::verification::*;
use crate::spots::{LatticeModel, Slope};
use link::framing::SYNC;

/// What a lattice that passes is like.
pub(super) struct Passed {
    pub signal_to_noise: f32,
    /// What is left unexplained over what may be (ratio of variances): above 1 only in the change between two frames.
    pub misfit: f32,
}

/// All that needs nothing but the fit, with `noise` the variance of a pixel.
pub(super) fn examine(fitted: &Fit, noise: f32, scope: Scope) -> Result<Passed, LocateError> {
    let Fit { spots, slope } = fitted;
    unsaturated(slope)?;
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

fn unsaturated(slope: &Slope) -> Result<(), LocateError> {
    let share = slope.pixels as f32 / slope.window_pixels.max(1) as f32;
    let percent = (100.0 * (1.0 - share)) as u8;
    if percent > MAX_SATURATED_PERCENT {
        return Err(LocateError::Saturated { percent });
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
    let apart = apart(spots);
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

fn random(spots: &LatticeModel, scope: Scope) -> Result<(), LocateError> {
    let states = spots.state.iter().enumerate();
    let pattern = states.fold(0u64, |bits, (led, &state)| bits | u64::from(state != 0.0) << led);
    let (lit, different) = (pattern.count_ones(), neighbours_that_differ(pattern));
    // What begins each block is the same each time, and far from random.
    let is_sync = [pattern, !pattern].contains(&SYNC.bits());
    let stand_out = if shows_off(spots) { !pattern } else { pattern };
    let is_orderly = || repetition(pattern) > MOST_REPETITION || empty_edges(stand_out) > MOST_DARK_EDGES;
    if !LIT.contains(&lit) || !DIFFERENT.contains(&different) || scope.is_single() && !is_sync && is_orderly() {
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
    let aspect = across / down;
    let shear = (lattice.column[0] * lattice.row[0] + lattice.column[1] * lattice.row[1]) / (across * down);
    let roll = libm::atan2f(lattice.column[1], lattice.column[0]);
    if !(ASPECT.contains(&aspect) && shear.abs() < MOST_SHEAR && roll.abs() < MOST_ROLL_RAD) {
        return Err(LocateError::ImpossiblePose {
            aspect,
            roll_deg: roll.to_degrees(),
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
