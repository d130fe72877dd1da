//! Is it a panel? A lattice fitted to the pixels is verified to be one, or says why it is not.

use super::bimodality;
use super::pose_candidates::View;
use super::{LocateError, Location};
use crate::corners::Corners;
use crate::fit::{self, Fit};
use crate::lattice::Lattice;
use crate::parameters::verification::*;
use crate::spots::{Canvas, GreyMetric, Scenery, Slope, Spots, Window};
use link::panel::LEDS;

/// A lattice that is a panel.
pub(super) struct Verified {
    pub corners: Corners,
    pub spots: Spots,
    pub residual_grey: f32,
    pub noise_grey: f32,
    pub signal_to_noise: f32,
}

impl Verified {
    /// Whether there is next to nothing but noise left.
    pub fn is_beyond_doubt(&self) -> bool {
        self.residual_grey < BEYOND_DOUBT * self.noise_grey
    }

    pub fn location(&self) -> Location {
        Location {
            corners: self.corners,
            residual_grey: self.residual_grey,
            noise_grey: self.noise_grey,
            signal_to_noise: self.signal_to_noise,
            spot_sigma_px: self.spots.sigma,
            spots: self.spots,
        }
    }
}

/// Lets the lattice settle on the pixels and examines what comes out.
pub(super) fn verify<const N: usize>(
    canvas: &mut Canvas<N>,
    view: &View<'_, '_>,
    metric: &GreyMetric,
    lattice: Lattice,
    state: [i8; LEDS],
) -> Result<Verified, LocateError> {
    let scenery = Scenery {
        frame: view.frame,
        earlier: view.earlier,
        metric,
    };
    let size = (view.frame.width(), view.frame.height());
    let single = view.earlier.is_none();
    let rim = if single { NARROW } else { WIDE };
    let start = Spots {
        lattice,
        sigma: view.spot_sigma_px,
        background: if single {
            metric.light(u8::MAX / 2)
        } else {
            0.0
        },
        off: 0.0,
        step: 0.0,
        state: state.map(f32::from),
    };
    let no_lattice = LocateError::NoLattice;
    let window = fit::window(&lattice, rim, size).ok_or(no_lattice)?;
    let mut fitted =
        fit::levenberg_marquardt(canvas, scenery, window, start, STEPS).ok_or(no_lattice)?;
    let noise = view.noise_grey * view.noise_grey + ROUNDING;
    let Slope {
        squares,
        total,
        pixels,
        ..
    } = fitted.slope;
    let noise_squares = noise * pixels as f32;
    let explains_all =
        squares < BEYOND_DOUBT * BEYOND_DOUBT * noise_squares && total > CLEAR * noise_squares;
    if !explains_all && (squares < HALF_EXPLAINED * total || !single) {
        let wide = fit::window(&fitted.spots.lattice, WIDE, size).ok_or(no_lattice)?;
        let lines = Lines::of(canvas, scenery, wide, &fitted.spots).ok_or(no_lattice)?;
        let doubt = lines.here - lines.best_beside;
        if doubt > WORTH_A_MOVE * noise {
            let moved = lines.beside;
            let window = fit::window(&moved.lattice, rim, size).ok_or(no_lattice)?;
            fitted = fit::levenberg_marquardt(canvas, scenery, window, moved, STEPS_MOVED)
                .ok_or(no_lattice)?;
        }
        // What is behind the panel, or noise, may make up for a line.
        let enough = if single {
            CLEARLY_WORSE * lines.total
        } else {
            WORTH_A_MOVE * noise
        };
        if doubt.abs() < enough {
            return Err(LocateError::EdgeUnseen {
                signal_to_noise: libm::sqrtf(doubt.abs() / noise),
            });
        }
    }
    let window = fit::window(&fitted.spots.lattice, rim, size).ok_or(no_lattice)?;
    let slope = canvas
        .compare(&fitted.spots, scenery, window)
        .ok_or(no_lattice)?;
    let fitted = Fit { slope, ..fitted };
    // What stands still is gone from the difference of two frames: around the panel there is noise alone.
    let around = if single {
        None
    } else {
        canvas.noise_around(&fitted.spots, window)
    };
    let noise = around.map_or(noise, |around| around.max(LEAST_NOISE_AROUND * noise));
    let signal_to_noise = examine(&fitted, noise, single, view.spot_sigma_px)?;
    let lit_around = canvas.lit_around(&fitted.spots, window);
    if lit_around > LIT_AROUND[usize::from(single)] {
        return Err(LocateError::GoesOn { lit_around });
    }
    if single && apart(&fitted.spots) < 1.0 {
        let log_odds = bimodality::log_odds(&fitted.spots, &fitted.slope, noise);
        if log_odds.is_nan() || log_odds < LEAST_LOG_ODDS {
            return Err(LocateError::Indistinct { log_odds });
        }
    }
    Ok(Verified {
        corners: Corners::new(fitted.spots.lattice.corners())?,
        residual_grey: fitted.residual_grey(),
        noise_grey: libm::sqrtf(noise),
        signal_to_noise,
        spots: fitted.spots,
    })
}

impl Fit {
    fn residual_grey(&self) -> f32 {
        libm::sqrtf(self.slope.squares / self.slope.pixels.max(1) as f32)
    }
}

/// How a lattice fits, and how the best one counted from a neighbouring line does.
struct Lines {
    here: f32,
    total: f32,
    best_beside: f32,
    beside: Spots,
}

impl Lines {
    fn of<const N: usize>(
        canvas: &mut Canvas<N>,
        scenery: Scenery<'_, '_>,
        window: Window,
        spots: &Spots,
    ) -> Option<Self> {
        const STEPS: [(i32, i32); 8] = [
            (-1, 0),
            (1, 0),
            (0, -1),
            (0, 1),
            (1, 1),
            (-1, 1),
            (1, -1),
            (-1, -1),
        ];
        let pair = scenery.earlier.is_some();
        let here = fit::levenberg_marquardt(canvas, scenery, window, *spots, STEPS_COMPARED[0])?;
        let mut lines = Self {
            here: here.slope.squares,
            total: here.slope.total,
            best_beside: f32::INFINITY,
            beside: here.spots,
        };
        let mut beside: [(f32, Spots); 8] = STEPS.map(|(columns, rows)| {
            let shifted = fit::shifted(&here.spots, columns, rows);
            let slope = canvas.compare(&shifted, scenery, window);
            let expected = slope.map(|slope| shifted.expected_squares(&slope, pair));
            (expected.unwrap_or(f32::INFINITY), shifted)
        });
        beside.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        for (_, shifted) in &beside[..LIKELIEST] {
            if let Some(there) =
                fit::levenberg_marquardt(canvas, scenery, window, *shifted, STEPS_COMPARED[1])
                && there.slope.squares < lines.best_beside
            {
                (lines.best_beside, lines.beside) = (there.slope.squares, there.spots);
            }
        }
        Some(lines)
    }
}

/// How far apart the spots are: 1 where they stand alone, less where they overlap.
pub(super) fn apart(spots: &Spots) -> f32 {
    let [across, down] = spots.lattice.pitch();
    (across.min(down) / (CLOSE * spots.sigma)).min(1.0)
}

fn examine(fitted: &Fit, noise: f32, single: bool, spot_sigma_px: f32) -> Result<f32, LocateError> {
    let Fit { spots, slope } = fitted;
    let pixels = slope.pixels as f32;
    let saturated_percent = (100.0 * (1.0 - pixels / slope.window_pixels.max(1) as f32)) as u8;
    if saturated_percent > MAX_SATURATED_PERCENT {
        return Err(LocateError::Saturated {
            percent: saturated_percent,
        });
    }
    let signal = (slope.total - noise * pixels).max(0.0);
    let mode = usize::from(single);
    // Spots that overlap can stand in for each other: the closer they are the less may be left.
    let [across, down] = spots.lattice.pitch();
    let apart = apart(spots);
    let allowed = EXCUSED_NOISE[mode] * noise * pixels
        + EXCUSED_SIGNAL[mode] * apart * apart * apart * apart * signal;
    if slope.squares.is_nan() || slope.squares > allowed {
        return Err(LocateError::GridDoesNotFit {
            residual_grey: fitted.residual_grey(),
            allowed_grey: libm::sqrtf(allowed / pixels.max(1.0)),
        });
    }
    let explained = (slope.total - slope.squares) / noise;
    if explained < LEAST_EXPLAINED[mode] {
        return Err(LocateError::ContrastTooLow {
            signal_to_noise: libm::sqrtf(explained.max(0.0)),
            needed: libm::sqrtf(LEAST_EXPLAINED[mode]),
        });
    }
    let pattern = spots
        .state
        .iter()
        .enumerate()
        .fold(0u64, |bits, (led, &state)| {
            bits | u64::from(state != 0.0) << led
        });
    let (lit, different) = (pattern.count_ones(), neighbours_that_differ(pattern));
    if !LIT.contains(&lit) || !DIFFERENT.contains(&different) {
        return Err(LocateError::NotRandom { lit, different });
    }
    let edge = spots.dimmest_edge(slope) / noise;
    if edge < LEAST_EDGE {
        return Err(LocateError::EdgeUnseen {
            signal_to_noise: libm::sqrtf(edge.max(0.0)),
        });
    }
    if single && spots.off < DARKEST_OFF * spots.step {
        return Err(LocateError::NoLattice);
    }
    let lattice = &spots.lattice;
    let shear =
        (lattice.column[0] * lattice.row[0] + lattice.column[1] * lattice.row[1]) / (across * down);
    let roll = libm::atan2f(lattice.column[1], lattice.column[0]);
    // A disc's variance along an axis is a sixteenth of its diameter's square.
    let disc = across.max(down) / PITCH_OVER_LED / 4.0;
    let narrowest = SPOT_RATIO.0 * spot_sigma_px;
    let widest = SPOT_RATIO.1 * libm::sqrtf(spot_sigma_px * spot_sigma_px + disc * disc);
    let possible =
        ASPECT.contains(&(across / down)) && shear.abs() < MOST_SHEAR && roll.abs() < MOST_ROLL_RAD;
    if across.min(down) < LEAST_PITCH_PX {
        return Err(LocateError::TooSmall {
            pitch_px: across.min(down),
        });
    }
    if !possible {
        return Err(LocateError::ImpossiblePose {
            aspect: across / down,
            roll_deg: roll.to_degrees(),
        });
    }
    if !(narrowest..=widest).contains(&spots.sigma) {
        return Err(LocateError::SpotsDoNotFit {
            spot_sigma_px: spots.sigma,
            narrowest_px: narrowest,
            widest_px: widest,
        });
    }
    Ok(libm::sqrtf(explained))
}

/// Pairs of neighbours in rows and columns that differ.
fn neighbours_that_differ(pattern: u64) -> u32 {
    const NOT_LAST_COLUMN: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    let rows = (pattern ^ pattern >> 8) & (u64::MAX >> 8);
    let columns = (pattern ^ pattern >> 1) & NOT_LAST_COLUMN;
    rows.count_ones() + columns.count_ones()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_bits_differ_from_their_neighbours_half_of_the_time() {
        assert_eq!(neighbours_that_differ(0), 0);
        assert_eq!(neighbours_that_differ(u64::MAX), 0);
        // A chessboard differs everywhere.
        assert_eq!(neighbours_that_differ(0xaa55_aa55_aa55_aa55), 112);
        assert!(DIFFERENT.contains(&neighbours_that_differ(0x9a3c_5e71_0f96_c3a5)));
    }
}
