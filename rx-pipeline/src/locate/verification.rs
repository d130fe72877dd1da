//! Verification: a lattice fitted to the pixels is confirmed as a panel, or rejected with a reason.

mod beyond;
mod criteria;
mod led_likeness;
mod lines;
mod settling;

use super::bimodality;
use super::pose_candidates::{self, Ground, Scope, SharpPose, View};
use super::{LocateError, Location, Locator};
use crate::corners::Corners;
use crate::fit::Fit;
use crate::spots::{LatticeModel, Observation, Residuals, Shade};
pub use criteria::LEAST_PITCH_PX;
use criteria::{DISTINCT, FitQuality, examine};
pub(crate) use criteria::{is_random, may_be_shown};
use led_likeness::LedLikeness;
use settling::Settling;

/// Room around the lattice, with space for further lines (pitches). More: clutter around the panel counts.
const WIDE: f32 = 1.8;
/// The same for the cells alone (pitches).
const NARROW: f32 = 0.6;
/// Rounding, and similar noise of any camera (variance, grey²). Higher: noiseless frames are judged more mildly.
const ROUNDING: f32 = 0.1;
/// The least pitch at which the ground is visible between spots (standard deviations of a spot): in the middle of four spots, 0.4 of one
/// remains.
const GROUND_BETWEEN: f32 = 3.0;
/// Places next to the lattice that look like LEDs, at most (count; in the change between two frames, and in a single frame): more belong to
/// a pattern that continues.
const LIT_AROUND: [u32; 2] = [2, 3];
/// Minimum pitch for a search of further LEDs, because the residuals of closer spots are curved like LEDs (standard deviations of a spot;
/// without a board, where the fit may make them too narrow, and within one).
const APART: [f32; 2] = [2.6, 2.2];
/// The residual up to which no other pose is tried, relative to noise (amplitude ratio). Higher: faster, and the second best pose may stay.
const BEYOND_DOUBT: f32 = 1.25;
/// The misfit up to which no other pose is tried (ratio of variances). Panels off by a line have about 0.5. Higher: faster, and panels may
/// be off by a line.
const CLEAR: f32 = 0.1;
/// The least noise around the panel (share of the variance of the whole frame's).
const LEAST_NOISE_AROUND: f32 = 0.3;

/// A lattice that was verified as a panel.
pub(super) struct VerifiedLattice {
    pub corners: Corners,
    pub spots: LatticeModel,
    pub residual_grey: f32,
    pub noise_grey: f32,
    pub signal_to_noise: f32,
    /// Residual over allowed residual (ratio of variances).
    pub misfit: f32,
    pub is_amid_clutter: bool,
}

impl VerifiedLattice {
    /// Whether the residual is within the allowed one.
    pub fn fits(&self) -> bool {
        self.misfit <= 1.0
    }

    /// Whether the residual is hardly more than noise.
    pub fn is_beyond_doubt(&self) -> bool {
        self.fits() && self.residual_grey < BEYOND_DOUBT * self.noise_grey
    }

    /// Whether it fits so well that no neighbouring line could.
    pub fn is_clear(&self) -> bool {
        self.is_beyond_doubt() || self.misfit < CLEAR
    }

    /// Whether it fits and the other does not, or leaves a smaller residual.
    pub fn is_better_than(&self, other: &Self) -> bool {
        let rank = |one: &Self| (!one.fits(), one.residual_grey);
        rank(self) < rank(other)
    }

    pub fn location(&self) -> Location {
        Location {
            corners: self.corners,
            residual_grey: self.residual_grey,
            noise_grey: self.noise_grey,
            signal_to_noise: self.signal_to_noise,
            misfit: self.misfit,
            spot_sigma_px: self.spots.sigma,
            spots: self.spots,
            is_amid_clutter: self.is_amid_clutter,
        }
    }
}

impl Scope {
    /// Room around the lattice in which it is fitted.
    fn rim(self) -> f32 {
        if self.is_single() { NARROW } else { WIDE }
    }
}

/// Fits the lattice to the pixels and examines the result.
pub(super) fn verify<const N: usize>(
    residuals: &mut Residuals<N>,
    view: &View<'_, '_>,
    locator: &Locator,
    scope: Scope,
    SharpPose {
        lattice,
        brightness,
        spot_sigma_px,
    }: &SharpPose,
) -> Result<VerifiedLattice, LocateError> {
    let Locator { metric, settings, .. } = locator;
    let state = match scope {
        Scope::Change => pose_candidates::three_states(brightness),
        _ => pose_candidates::two_states(brightness),
    };
    criteria::check_states(lattice, &state)?;
    let on = |state: i8| match view.ground {
        Ground::Holes if scope.is_single() => 1 - state,
        _ => state,
    };
    let single = scope.is_single();
    let start = LatticeModel {
        lattice: *lattice,
        sigma: *spot_sigma_px,
        background: if single { metric.light(u8::MAX / 2) } else { 0.0 },
        off: 0.0,
        contrast: 0.0,
        state: state.map(|state| on(state).into()),
    };
    let shade = match scope {
        Scope::ShadedBoard => {
            let shade = Shade::uneven_on(lattice, |at| metric.light_at(view.frame, at));
            Some(shade.ok_or(LocateError::NoLattice)?)
        }
        _ => None,
    };
    let observation = Observation {
        frame: view.frame,
        earlier: view.earlier,
        metric,
        within: None,
        shade: shade.as_ref(),
    };
    let noise = view.noise_grey * view.noise_grey + ROUNDING;
    let mut settling = Settling {
        residuals,
        observation,
        is_near: view.is_near,
    };
    let (fitted, observation) = match scope {
        Scope::Board | Scope::ShadedBoard => settling.within_a_board(start)?,
        _ => (settling.on_its_line(scope, start, noise)?, observation),
    };
    let window = settling.window(&fitted.spots, scope.rim())?;
    let slope = residuals
        .compare(&fitted.spots, observation, window)
        .ok_or(LocateError::NoLattice)?;
    let fitted = Fit { slope, ..fitted };
    // Static content cancels in the difference of two frames: only noise remains around the panel.
    let around = if single {
        None
    } else {
        residuals.noise_around(&fitted.spots, window)
    };
    let noise = around.map_or(noise, |around| around.max(LEAST_NOISE_AROUND * noise));
    let FitQuality { signal_to_noise, misfit } = examine(&fitted, noise, scope, settings)?;
    let lit_around = match scope {
        Scope::Board | Scope::ShadedBoard => LedLikeness::of(observation, &fitted.spots).lit_around(),
        _ => residuals.lit_around(&fitted.spots, window),
    };
    if lit_around > LIT_AROUND[usize::from(single)] {
        return Err(LocateError::GoesOn { lit_around });
    }
    if single {
        let is_apart = fitted.spots.stand_apart(APART[usize::from(scope.is_board())]);
        if is_apart && let Some(lit_around) = beyond::goes_on(observation, &fitted.spots) {
            return Err(LocateError::GoesOn { lit_around });
        }
        let log_odds = bimodality::log_odds(&fitted.spots, &fitted.slope, noise);
        if log_odds.is_nan() || may_be_no_panel(&fitted, scope) && log_odds < settings.min_log_odds {
            return Err(LocateError::Indistinct { log_odds });
        }
    }
    Ok(VerifiedLattice {
        corners: Corners::new(fitted.spots.lattice.corners())?,
        residual_grey: fitted.residual_grey(),
        noise_grey: libm::sqrtf(noise),
        signal_to_noise,
        misfit,
        is_amid_clutter: scope.is_board(),
        spots: LatticeModel {
            background: fitted.spots.background + shade.map_or(0.0, |shade| shade.mean()),
            ..fitted.spots
        },
    })
}

/// Whether spots of any brightness could explain as much.
fn may_be_no_panel(fitted: &Fit, scope: Scope) -> bool {
    fitted.spots.apart() < 1.0 || scope.is_board() && distinctness(fitted) < DISTINCT
}

/// The separation of LEDs of different states, in brightness or in change, by the residual of each.
fn distinctness(Fit { spots, slope }: &Fit) -> f32 {
    let off_by = |led: usize| slope.led_agreement(led) / (slope.led_weight(led) * spots.contrast).max(f32::MIN_POSITIVE);
    let brightness = core::array::from_fn(|led| spots.state[led] + off_by(led));
    pose_candidates::distinctness(&brightness, &spots.state.map(|state| state as i8))
}

/// Whether Off LEDs stand out from the ground more than On LEDs, as on a bright board, where they are dark. False for overlapping spots,
/// because a lower ground with higher spots looks the same.
fn shows_off(spots: &LatticeModel) -> bool {
    spots.stand_apart(GROUND_BETWEEN) && spots.off.abs() > (spots.off + spots.contrast).abs()
}
