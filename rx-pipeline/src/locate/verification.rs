//! Is it a panel? A lattice fitted to the pixels is verified to be one, or says why it is not.

mod criteria;
mod lines;

use super::bimodality;
use super::pose_candidates::View;
use super::{LocateError, Location};
use crate::corners::Corners;
use crate::fit::{self, Fit};
use crate::lattice::Lattice;
use crate::parameters::verification::*;
use crate::spots::{GreyMetric, LatticeModel, Observation, Residuals, Slope};
use criteria::examine;
use lines::Lines;
use link::panel::LEDS;

/// A lattice that is a panel.
pub(super) struct Verified {
    pub corners: Corners,
    pub spots: LatticeModel,
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
    residuals: &mut Residuals<N>,
    view: &View<'_, '_>,
    metric: &GreyMetric,
    lattice: Lattice,
    state: [i8; LEDS],
) -> Result<Verified, LocateError> {
    let observation = Observation {
        frame: view.frame,
        earlier: view.earlier,
        metric,
    };
    let size = (view.frame.width(), view.frame.height());
    let single = view.earlier.is_none();
    let rim = rim(single);
    let start = LatticeModel {
        lattice,
        sigma: view.spot_sigma_px,
        background: if single {
            metric.light(u8::MAX / 2)
        } else {
            0.0
        },
        off: 0.0,
        contrast: 0.0,
        state: state.map(f32::from),
    };
    let no_lattice = LocateError::NoLattice;
    let window = fit::window(&lattice, rim, size).ok_or(no_lattice)?;
    let fitted =
        fit::levenberg_marquardt(residuals, observation, window, start, STEPS).ok_or(no_lattice)?;
    let fitted = if view.is_near {
        fit::in_perspective(residuals, observation, window, fitted)
    } else {
        fitted
    };
    let noise = view.noise_grey * view.noise_grey + ROUNDING;
    let fitted = on_its_line(residuals, observation, fitted, noise)?;
    let window = fit::window(&fitted.spots.lattice, rim, size).ok_or(no_lattice)?;
    let slope = residuals
        .compare(&fitted.spots, observation, window)
        .ok_or(no_lattice)?;
    let fitted = Fit { slope, ..fitted };
    // What stands still is gone from the difference of two frames: around the panel there is noise alone.
    let around = if single {
        None
    } else {
        residuals.noise_around(&fitted.spots, window)
    };
    let noise = around.map_or(noise, |around| around.max(LEAST_NOISE_AROUND * noise));
    let signal_to_noise = examine(&fitted, noise, single, view.spot_sigma_px)?;
    let lit_around = residuals.lit_around(&fitted.spots, window);
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

/// Room around the lattice in which it is fitted.
fn rim(single: bool) -> f32 {
    if single { NARROW } else { WIDE }
}

/// The fit, or that of the lattice counted from a neighbouring line if this is the right one; an error if the frame does not tell them
/// apart.
fn on_its_line<const N: usize>(
    residuals: &mut Residuals<N>,
    observation: Observation<'_, '_>,
    fitted: Fit,
    noise: f32,
) -> Result<Fit, LocateError> {
    let single = observation.earlier.is_none();
    let Slope {
        squares,
        total,
        pixels,
        ..
    } = fitted.slope;
    let noise_squares = noise * pixels as f32;
    let explains_all =
        squares < BEYOND_DOUBT * BEYOND_DOUBT * noise_squares && total > CLEAR * noise_squares;
    let comparable = !single || squares < HALF_EXPLAINED * total;
    if explains_all || !comparable {
        return Ok(fitted);
    }
    let no_lattice = LocateError::NoLattice;
    let size = (observation.frame.width(), observation.frame.height());
    let wide = fit::window(&fitted.spots.lattice, WIDE, size).ok_or(no_lattice)?;
    let lines = Lines::of(residuals, observation, wide, &fitted.spots).ok_or(no_lattice)?;
    let doubt = lines.here - lines.best_beside;
    // What is behind the panel, or noise, may make up for a line.
    let enough = if single {
        CLEARLY_WORSE * lines.total
    } else {
        WORTH_A_MOVE * noise
    };
    let moved = if doubt > WORTH_A_MOVE * noise {
        let moved = lines.beside;
        let window = fit::window(&moved.lattice, rim(single), size).ok_or(no_lattice)?;
        fit::levenberg_marquardt(residuals, observation, window, moved, STEPS_MOVED)
            .ok_or(no_lattice)?
    } else {
        fitted
    };
    if doubt.abs() < enough {
        return Err(LocateError::EdgeUnseen {
            signal_to_noise: libm::sqrtf(doubt.abs() / noise),
        });
    }
    Ok(moved)
}

/// How far apart the spots are: 1 where they stand alone, less where they overlap.
pub(super) fn apart(spots: &LatticeModel) -> f32 {
    let [across, down] = spots.lattice.pitch();
    (across.min(down) / (CLOSE * spots.sigma)).min(1.0)
}
