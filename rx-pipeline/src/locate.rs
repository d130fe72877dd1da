//! Where in the frame is a panel? A first locator, for a panel before a plain background.
//!
//! 1. `background`: the commonest grey level and the spread around it.
//! 2. `candidate`: the patches that are brighter. LEDs that are Off show too, as long as they reflect more than what is behind
//!    them, so a patch is as large as the panel whatever it says.
//! 3. `outline`: the rectangle of least area around a patch, up to 20° turned.
//! 4. `lattice`: 64 Gaussian spots of free brightness on an affine lattice, fitted to the patch in linear light by least
//!    squares, and moved by whole rows and columns to where the light is.
//!
//! It takes the sensor's gamma, and no more than a guess of the blur. Beyond it are: a background with structure of its own;
//! LEDs that are no brighter than it when Off; strong perspective, since the lattice is affine; and spots wider than 3 px. Then it
//! says why. What it may not notice is a lattice one row or column off: where noise hides the LEDs that are Off, and now and then where
//! the pitch is less than 2.6 px (turned panels) or, with noise of some grey levels, 3.1 px.

mod background;
mod candidate;
mod lattice;
mod light;
mod outline;

use crate::corners::{Corners, CornersError};
use crate::frame::Frame;
use background::Background;
use core::ops::RangeInclusive;
use lattice::{Fit, Lattice};
use light::{Light, Patch};
use outline::Outline;

/// How the frames were made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocatorSettings {
    /// The exponent γ of the encoding, grey ∝ light^(1/γ): 1 to 4.
    pub gamma: f32,
    /// Standard deviation of the blur in pixels, as a first guess: 0.3 to 4.
    pub blur_sigma_px: f32,
}

impl Default for LocatorSettings {
    /// γ = 2.2 and a blur of 1.5 px (Do & Yoo 2020).
    fn default() -> Self {
        Self {
            gamma: 2.2,
            blur_sigma_px: 1.5,
        }
    }
}

/// Finds the panel in a frame.
///
/// The locator keeps tables of 2 kB; a search takes up to 160 kB of stack (`cargo test --release -p rx-pipeline stack`),
/// most of it for the equations of 72 unknowns.
///
/// ```
/// use rx_pipeline::{frame::Frame, locate::{LocateError, Locator, LocatorSettings}};
/// let locator = Locator::new(LocatorSettings::default())?;
/// let plain = [118; 64 * 64];
/// let nothing = locator.locate(&Frame::new(&plain, 64, 64)?);
/// assert!(matches!(nothing, Err(LocateError::ContrastTooLow { background: 118, .. })));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Locator {
    light: Light,
    blur_sigma_px: f32,
}

/// A panel found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// The centres of the corner LEDs.
    pub corners: Corners,
    /// Root mean square difference between the frame and the fitted spots, in grey levels.
    pub residual_grey: f32,
    /// Standard deviation of one LED's image, in pixels: its own extent, the blur and the pixel together.
    pub spot_sigma_px: f32,
}

/// Why no panel was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LocateError {
    /// Settings no camera has.
    #[error("gamma {gamma} and blur {blur_sigma_px} px: gamma is 1 to 4, the blur 0.3 to 4 px")]
    Settings {
        /// The exponent asked for.
        gamma: f32,
        /// The blur asked for.
        blur_sigma_px: f32,
    },
    /// Nothing is brighter than the background.
    #[error(
        "no 3×3 pixels have a mean grey of {needed} or more before a background of {background}: raise the panel's \
         luminance or the exposure"
    )]
    ContrastTooLow {
        /// The frame's commonest grey level.
        background: u8,
        /// The lowest mean of 3×3 pixels that is told from the background and its noise, in grey levels.
        needed: f32,
    },
    /// Nothing bright has the size of a panel.
    #[error(
        "of {patches} bright patches none is between {} and {} px wide and high: move the camera, or crop the frame",
        candidate::MIN_SIZE_PX,
        candidate::MAX_SIZE_PX
    )]
    NoCandidate {
        /// Bright patches seen.
        patches: u32,
    },
    /// The patch is white throughout.
    #[error(
        "{percent} % of the panel's pixels are at grey 255, at most {MAX_SATURATED_PERCENT} % may be: expose less"
    )]
    Saturated {
        /// Share of the patch's pixels at 255, in percent.
        percent: u8,
    },
    /// Every lattice tried has lost its shape on the way.
    #[error(
        "no 8×8 lattice like that of a panel settles on the bright patch of {width} × {height} px: it may be no panel, or \
         its background may not be plain"
    )]
    NoLattice {
        /// The patch's columns, with a rim.
        width: usize,
        /// The patch's rows, with a rim.
        height: usize,
    },
    /// No lattice of 8×8 spots looks like the patch.
    #[error(
        "the best 8×8 lattice differs from the frame by {residual_grey} grey levels (root mean square), {allowed_grey} \
         would do: the bright patch may be no panel, or its background may not be plain"
    )]
    GridDoesNotFit {
        /// Root mean square difference, in grey levels.
        residual_grey: f32,
        /// The largest accepted here, in grey levels.
        allowed_grey: f32,
    },
    /// The spots that fit best are no LEDs.
    #[error(
        "the best 8×8 lattice has spots of {spot_sigma_px} px (standard deviation) where the blur and the pitch make \
         {expected_px}: the bright patch may be no panel, or the blur in the settings may be wrong"
    )]
    SpotsDoNotFit {
        /// The fitted spots' standard deviation.
        spot_sigma_px: f32,
        /// That of discs half a pitch wide under the blur of the settings.
        expected_px: f32,
    },
    /// The fitted lattice is no readable panel.
    #[error("the lattice found is no panel: {0}")]
    Corners(#[from] CornersError),
}

/// The share of white pixels from which a patch is not fitted, in percent: with fewer than half of them left there is less to fit
/// than to guess.
pub const MAX_SATURATED_PERCENT: u8 = 50;

/// What the fit may leave unexplained: rounding in grey levels, noise against the background's, and a share of the
/// patch's contrast (root mean square), since spots are not quite Gaussian.
struct Tolerance {
    rounding_grey: f32,
    noise: f32,
    contrast: f32,
}

/// The fitted spots' size over that expected. LEDs are never exactly half a pitch wide, nor is the blur known exactly.
const SPOT_RATIO: RangeInclusive<f32> = 0.6..=1.5;

/// Beyond this the lattice is not accepted.
const ACCEPTED: Tolerance = Tolerance {
    rounding_grey: 1.0,
    noise: 1.2,
    contrast: 0.12,
};
/// Below this no other start of the fit can do better.
const PERFECT: Tolerance = Tolerance {
    rounding_grey: 0.33,
    noise: 1.02,
    contrast: 0.002,
};

impl Tolerance {
    fn residual_grey(&self, background: &Background, patch: &Patch) -> f32 {
        let spread = background.spread;
        self.rounding_grey + self.noise * spread + self.contrast * patch.contrast_grey(spread)
    }
}

impl Locator {
    /// A locator for one camera.
    ///
    /// # Errors
    /// [`LocateError::Settings`] if a setting is out of its range.
    pub fn new(settings: LocatorSettings) -> Result<Self, LocateError> {
        let LocatorSettings {
            gamma,
            blur_sigma_px,
        } = settings;
        if !(1.0..=4.0).contains(&gamma) || !(0.3..=4.0).contains(&blur_sigma_px) {
            return Err(LocateError::Settings {
                gamma,
                blur_sigma_px,
            });
        }
        Ok(Self {
            light: Light::new(gamma),
            blur_sigma_px,
        })
    }

    /// The panel in `frame`; where several patches could be one, the brightest that fits.
    ///
    /// # Errors
    /// One variant of [`LocateError`] for each step that may fail, about the brightest patch.
    pub fn locate(&self, frame: &Frame<'_>) -> Result<Location, LocateError> {
        let background = Background::of(frame);
        let threshold = background.threshold_of_nine();
        let found = candidate::find(frame, threshold, background.level);
        if found.patches == 0 {
            return Err(LocateError::ContrastTooLow {
                background: background.level,
                needed: f32::from(threshold) / 9.0,
            });
        }
        let mut first_failure = LocateError::NoCandidate {
            patches: found.patches,
        };
        for (i, outline) in found.outlines.iter().enumerate() {
            match self.fit(frame, outline, &background) {
                Ok(location) => return Ok(location),
                Err(failure) if i == 0 => first_failure = failure,
                Err(_) => {}
            }
        }
        Err(first_failure)
    }

    fn fit(
        &self,
        frame: &Frame<'_>,
        outline: &Outline,
        background: &Background,
    ) -> Result<Location, LocateError> {
        let window = outline.window(frame);
        let patch = Patch::of(frame, window, background.level);
        let percent = patch.saturated_percent();
        if percent > MAX_SATURATED_PERCENT {
            return Err(LocateError::Saturated { percent });
        }
        let allowed_grey = ACCEPTED.residual_grey(background, &patch);
        let perfect_grey = PERFECT.residual_grey(background, &patch);
        let fit =
            |start: Lattice| lattice::fit(frame, window, &self.light, background.level, start);
        let mut best = None;
        for start in outline.starts(self.blur_sigma_px) {
            best = better(best, fit(start));
            if best
                .as_ref()
                .is_some_and(|best| best.residual_grey < perfect_grey)
            {
                break;
            }
        }
        if let Some(Fit {
            lattice,
            residual_grey,
        }) = best
            && residual_grey >= perfect_grey
        {
            best = lattice.neighbours().map(fit).fold(best, better);
        }
        let (width, height) = window.size();
        let Fit {
            lattice,
            residual_grey,
        } = best.ok_or(LocateError::NoLattice { width, height })?;
        if residual_grey > allowed_grey {
            return Err(LocateError::GridDoesNotFit {
                residual_grey,
                allowed_grey,
            });
        }
        let (spot_sigma_px, expected_px) =
            (lattice.sigma, lattice.blurred(self.blur_sigma_px).sigma);
        if !SPOT_RATIO.contains(&(spot_sigma_px / expected_px)) {
            return Err(LocateError::SpotsDoNotFit {
                spot_sigma_px,
                expected_px,
            });
        }
        Ok(Location {
            corners: Corners::new(lattice.corners())?,
            residual_grey,
            spot_sigma_px: lattice.sigma,
        })
    }
}

/// The fit of smaller residual.
fn better(one: Option<Fit>, other: Option<Fit>) -> Option<Fit> {
    match (one, other) {
        (Some(one), Some(other)) => Some(if other.residual_grey < one.residual_grey {
            other
        } else {
            one
        }),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Scene;
    use proptest::prelude::*;

    fn locate(frame: &Frame<'_>) -> Result<Location, LocateError> {
        Locator::new(LocatorSettings::default())
            .unwrap()
            .locate(frame)
    }

    /// The greatest distance between a corner found and the true one, in pixels.
    fn error_px(found: &Location, scene: &Scene) -> f32 {
        let pairs = found
            .corners
            .points()
            .into_iter()
            .zip(scene.corners().points());
        pairs
            .map(|([ax, ay], [bx, by])| libm::hypotf(ax - bx, ay - by))
            .fold(0.0, f32::max)
    }

    #[test]
    fn settings_no_camera_has_are_refused() {
        for (gamma, blur_sigma_px) in [(0.5, 1.5), (f32::NAN, 1.5), (2.2, 0.0), (2.2, 9.0)] {
            assert!(matches!(
                Locator::new(LocatorSettings {
                    gamma,
                    blur_sigma_px
                }),
                Err(LocateError::Settings { .. })
            ));
        }
    }

    #[test]
    fn a_white_patch_is_saturated() {
        let mut pixels = [100; 100 * 100];
        for row in pixels.chunks_mut(100).skip(30).take(40) {
            row[30..70].fill(255);
        }
        let frame = Frame::new(&pixels, 100, 100).unwrap();
        assert!(matches!(
            locate(&frame),
            Err(LocateError::Saturated { percent: 90..=100 })
        ));
    }

    #[test]
    fn a_lone_spot_is_no_candidate() {
        let mut pixels = [100; 100 * 100];
        for row in pixels.chunks_mut(100).skip(50).take(5) {
            row[50..55].fill(180);
        }
        assert_eq!(
            locate(&Frame::new(&pixels, 100, 100).unwrap()),
            Err(LocateError::NoCandidate { patches: 1 })
        );
    }

    #[test]
    fn stripes_are_no_lattice() {
        let mut pixels = [100; 100 * 100];
        for row in pixels.chunks_mut(100).skip(30).take(40) {
            for pixels in row[30..69].chunks_mut(3) {
                pixels.copy_from_slice(&[240, 110, 110]);
            }
        }
        let result = locate(&Frame::new(&pixels, 100, 100).unwrap());
        assert!(
            matches!(result, Err(LocateError::GridDoesNotFit { .. })),
            "{result:?}"
        );
    }

    #[test]
    fn the_panel_is_found_anywhere_in_a_large_frame() {
        let scene = Scene {
            width: 1920,
            height: 300,
            centre: [1850.2, 51.7],
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        let found = locate(&scene.render().frame()).unwrap();
        assert!(error_px(&found, &scene) < 0.2);
    }

    #[test]
    fn a_search_fits_on_its_stack() {
        let stack_bytes = if cfg!(debug_assertions) { 768 } else { 160 } * 1024;
        let rendered = Scene::PLAIN.render();
        let search = move || locate(&rendered.frame()).is_ok();
        let thread = std::thread::Builder::new()
            .stack_size(stack_bytes)
            .spawn(search)
            .unwrap();
        assert!(thread.join().unwrap());
    }

    /// Panels of a pitch from `least_px` on, upright or turned. Turned ones of less than 2.6 px are now and then found a row off.
    fn scene(least_px: f32) -> impl Strategy<Value = Scene> {
        let bits =
            any::<u64>().prop_filter("both states", |bits| (16..48).contains(&bits.count_ones()));
        let turned = (least_px.max(2.6)..9.0, -15.0f32..15.0);
        let upright = (least_px..9.0, Just(0.0));
        let shape = (prop_oneof![upright, turned], 0.95f32..1.1, 0.33f32..0.67);
        let light = (0.3f32..0.5, 0.3f32..3.0);
        (bits, shape, light, 46.0f32..50.0, 46.0f32..50.0).prop_map(
            |(bits, ((pitch_px, roll_deg), aspect, fill), (reflectance, l2a), x, y)| {
                let off = reflectance / 0.18;
                let light = [off, off * (1.0 + core::f32::consts::PI * l2a)];
                Scene {
                    bits,
                    pitch_px,
                    roll_deg,
                    aspect,
                    fill,
                    light,
                    centre: [x, y],
                    ..Scene::PLAIN
                }
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn panels_before_a_plain_background_are_found(scene in scene(2.3)) {
            let found = locate(&scene.render().frame()).unwrap();
            prop_assert!(error_px(&found, &scene) < 0.2, "{}", error_px(&found, &scene));
        }

        #[test]
        fn noise_does_not_shift_the_lattice(scene in scene(4.0), noise_grey in 0.5f32..2.0) {
            let scene = Scene { noise_grey, ..scene };
            let found = locate(&scene.render().frame()).unwrap();
            prop_assert!(error_px(&found, &scene) < 0.4 * scene.pitch_px, "{}", error_px(&found, &scene));
        }

        #[test]
        fn no_frame_panics(
            pixels in prop::collection::vec(prop_oneof![any::<u8>(), Just(0u8), Just(255u8)], 1..6000),
            width in 1usize..100,
        ) {
            let height = pixels.len() / width;
            if let Ok(frame) = Frame::new(&pixels, width, height)
                && let Ok(location) = locate(&frame)
            {
                prop_assert!(location.residual_grey.is_finite());
            }
        }

        #[test]
        fn no_rectangle_panics(x in 0usize..60, y in 0usize..60, width in 1usize..60, height in 1usize..60, grey: u8, back: u8) {
            let mut pixels = [back; 3600];
            for row in pixels.chunks_mut(60).skip(y).take(height) {
                for pixel in row.iter_mut().skip(x).take(width) {
                    *pixel = grey;
                }
            }
            if let Ok(location) = locate(&Frame::new(&pixels, 60, 60).unwrap()) {
                prop_assert!(location.residual_grey.is_finite());
            }
        }
    }
}
