//! Maximum-likelihood bits: the image is a known operator on 64 unknown bits.
//!
//! # The model
//!
//! Once the panel's corners are known, its bits and a few levels determine its image. In linear light, 1 at grey 118, a pixel at p sees
//!
//! ```text
//! x(p) = background + Σ (off + contrast·(offset + gain·b))·h(p − LED),    b = 0 or 1 for each of the 64 LEDs
//! ```
//!
//! `offset` and `gain` are 0 and 1 until the frames have shown each LED's own values: below.
//!
//! h is the image of an LED of light 1. Lens blur, the LED's disc and the pixel's square together are close to a Gaussian whose variance is
//! the sum of theirs, σ² + D²/16 + 1/12 px² for an LED D px wide. The model depends on that sum alone, and fits it. Noise is that of
//! electrons and read-out; in its root light all pixels weigh the same. A pixel at grey 255 is a lower bound. On is the brighter state: a
//! solution of negative contrast stands for its complement.
//!
//! Pixels beyond the panel's cells are left out, unless they turn out to be as plain as those between the LEDs: a street around the panel
//! would spoil levels and noise, while a plain board helps with the outermost LEDs. If LEDs are far apart or the blur is wide, blocks of
//! pixels replace single ones.
//!
//! # The search
//!
//! 1. **Least squares** on the light of the 64 LEDs, which fall into two groups: a first guess of levels and bits. In a first frame it
//!    starts from several widths of spots, among them the locator's, and continues with the width of least residuals.
//! 2. **Interference cancellation**: each LED gets its expected share of On, given the expectation of the others. The levels are refitted
//!    in between (Gauss and Newton), so that the residual noise falls from round to round.
//! 3. **Likelihood ascent**: flips of single LEDs, then of neighbours, as long as the likelihood rises.
//! 4. **Sphere decoding**: the likeliest sets of flips of any number of LEDs (K-best; Guo & Nilsson 2006), or, if many pixels are
//!    saturated, groups that grow from each LED (Kernighan & Lin 1970). The likelihood that refitted levels win back is part of a set's
//!    gain (a Schur complement): without it, wrong bits and wrong levels hold each other in place.
//!
//! # Learning
//!
//! The levels of earlier frames give a [prior](Experience) of those of the next frame. The prior makes them surer, and makes panels
//! readable whose LEDs are all alike. It follows the distance, because the light of a nearer panel fills more pixels.
//!
//! If a frame shows much less contrast than usual, nothing is learnt from it; if it shows hardly any, it is not read
//! (`likelihood/proven.rs`): a wiper covers the panel, or its lamps are dark. If bits stay unsure that were sure before, the levels are in
//! doubt: the frame is also read with the levels of the last sure frame, and with none. The reading of surest bits wins, and its levels
//! stay.
//!
//! The two levels of each LED are learnt without known bits, from the moments of its light over panels that differ: unequal LEDs, a dim
//! row, bright patches behind an open frame. An LED of one level does not follow the message; it is reported and erased
//! (`likelihood/leds.rs`). [`MaximumLikelihood::learnt`] returns the estimates.
//!
//! If LEDs overlap, frames also show the camera's encoding curve (`likelihood/curve.rs`): the first of them try other curves, one a frame,
//! and the receiver changes to one that is significantly better.
//!
//! A microcontroller learns the same by the same code: the LEDs take 1.4 kB a panel, the curve 100 bytes. The feature `learn-curve` is
//! optional there.
//!
//! # Soft values
//!
//! The log-likelihood ratio of a bit is the likelihood lost by its flip after the others have adapted (max-log); between the sets that the
//! sphere decoder lists, it is the logarithm of their odds. If more bits are in doubt than a list can represent, all ratios of the panel
//! are made smaller: `docs/detectors.md` shows how sure they then are. The noise is estimated from the frame, so that errors of the model
//! make all ratios smaller. These errors are as wide as an LED, and weigh more than the noise of as many pixels. So the ratios are divided
//! by the dispersion of the residuals of the LEDs' images relative to noise (quasi-likelihood; McCullagh & Nelder 1989).
//!
//! # Two symbols in one exposure
//!
//! An exposure across a change shows LEDs that were On for a part of it. The detector takes the soft values of the symbol before, and reads
//! both symbols: `likelihood/mixture.rs`. If the camera exposes its lines one after another, each row of LEDs shows another moment.
//! `likelihood/lines.rs` learns the delay of a line from such exposures and keeps it.
//!
//! # Limits
//!
//! The panel has a single blur, Gaussian and as wide as high. The curve is a power, at the configured black level. Neither costs many bits:
//! discs of defocus, sharpened frames and curves from linear to γ = 2.6 are read without errors. An uneven background costs bits
//! in the first frames of an open panel, until its LEDs are known, and whenever it moves behind them. If the images of LEDs are sharp discs
//! many pixels wide, larger pixels are used, and any detector reads them.

mod ascent;
mod crop;
mod curve;
mod estimate;
mod experience;
mod flip_search;
mod flips;
mod gauss_newton;
mod ground;
mod image;
mod least_squares;
mod leds;
mod level_prior;
mod levels;
#[cfg(feature = "read-lines")]
mod lines;
mod mixture;
mod model;
mod proven;
mod search;
mod sphere_decoder;

pub use experience::Experience;
#[cfg(feature = "read-lines")]
pub use lines::LINE_DELAY_MAX;

use crate::camera::CameraEstimate;
use crate::corners::Corners;
#[cfg(feature = "carrier")]
use crate::detect::Lights;
use crate::detect::{DetectError, Detection, Mixture, bits_where};
use crate::frame::Frame;
use crate::settings::LikelihoodSettings;
#[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
use crate::spots::{LatticeModel, SHADE_LEAST_PITCH, Shade};
use crop::{Crop, ImagePrior};
use curve::CurveEvidence;
use estimate::Estimate;
use leds::{LedMoments, is_clear_cut};
use level_prior::LevelPrior;
#[cfg(feature = "carrier")]
use levels::Levels;
#[cfg(feature = "read-lines")]
use lines::LineDelay;
use link::camera::{Camera, Encoding};
use link::panel::{LEDS, PanelFrame, SoftPanel};
use model::Model;
use proven::ProvenEstimates;

/// Interval between looks at the surroundings of the cells (frames).
const LOOK_AROUND_FRAMES: u32 = 8;
/// LEDs of either state in a panel that teaches, at least (count).
const LEARN_LEDS: u32 = 8;
/// The average certainty of the bits of a frame that teaches, at least (nats). Lower: levels are learnt from wrong bits.
const LEARN_LLR: f32 = 1.0;
/// The confidence of a frame that is compared under other curves, at least (expected share of right bits). Lower: curves explain wrong bits
/// and wrong places.
const CONFIDENCE_MIN: f32 = 0.95;
/// The light has changed if a search without prior levels leaves less noise by this (factor). Lower: a frame that shares two symbols loses
/// the usual levels, too.
const OTHER_LIGHT: f32 = 2.0;
/// If two symbols share an exposure, some LED's flip costs less (nats). If α of it is the other symbol's, α² of a flip's cost becomes noise
/// of half the LEDs, so that a flip costs about 2·(1 − 2α)/α² times half the pixels of an LED, 10 to 30. Below α = 1/8 the bits are certain
/// nevertheless.
const MIXED: f32 = 1000.0;
/// Maximum share of saturated pixels for a measurement of LEDs, because saturation hides how bright they are (share).
const SATURATED_MAX: f32 = 0.05;

/// Addition to the doubt in the bits if a frame seems to show two symbols (share of wrong bits).
#[cfg(feature = "carrier")]
const UNSURE_MIXED: f32 = 0.05;
/// The weight of a frame in the average doubt (share).
#[cfg(feature = "carrier")]
const UNSURE_GAIN: f32 = 0.125;
/// The doubt from which on each LED's light is measured (share of wrong bits). Lower: slower.
#[cfg(feature = "carrier")]
const UNSURE_MIN: f32 = 0.004;

/// The detector: maximum likelihood, searched for over bits and levels.
///
/// `PIXELS` is the largest image of a panel, [a few pixels](self) wider than its cells; LEDs more than 8 px apart are binned
/// before that. It takes 12 bytes a pixel and about 32 kB: 82 kB for 64×64.
///
/// ```
/// use link::camera::Camera;
/// use rx_pipeline::{corners::Corners, frame::Frame, likelihood::MaximumLikelihood};
/// // An On LED every second column, blurred.
/// let grey = |x: usize| 118.0 + 60.0 * (core::f32::consts::PI * (x as f32 - 6.0) / 4.0).cos();
/// let pixels: Vec<u8> = (0..40 * 40).map(|i| grey(i % 40) as u8).collect();
/// let corners = Corners::new([[6.0, 6.0], [34.0, 6.0], [34.0, 34.0], [6.0, 34.0]])?;
/// let mut detector = Box::new(MaximumLikelihood::<4096>::new(Camera::default()));
/// let detection = detector.detect(&Frame::new(&pixels, 40, 40)?, &corners)?;
/// assert_eq!(detection.bits.bits(), 0x5555_5555_5555_5555);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct MaximumLikelihood<const PIXELS: usize> {
    /// The configured curve.
    configured: Encoding,
    experience: Experience,
    proven: ProvenEstimates,
    /// Estimates from the camera's own pixels, kept while larger ones are used.
    in_own_pixels: OwnPixels,
    /// The recent average doubt in the bits (share of wrong ones).
    #[cfg(feature = "carrier")]
    unsure: f32,
    model: Model<PIXELS>,
}

/// Estimates of the camera from its own pixels.
struct OwnPixels {
    curve: CurveEvidence,
    /// The standard deviation of the blur, and that of its estimate.
    blur_px: Option<[f32; 2]>,
}

impl OwnPixels {
    const NONE: Self = Self {
        curve: CurveEvidence::NONE,
        blur_px: None,
    };
}

impl<const PIXELS: usize> MaximumLikelihood<PIXELS> {
    /// A detector for frames of `camera`, before its first frame.
    pub fn new(camera: Camera) -> Self {
        let mut detector = Self::empty();
        detector.prepare(camera);
        detector
    }

    /// A detector's memory, for a `static`. It must be [prepared](Self::prepare) first, and sees black before. It is all zeros, so that it
    /// takes no room in flash.
    pub const fn empty() -> Self {
        Self {
            configured: Encoding::Gamma(0.0),
            experience: Experience::NONE,
            proven: ProvenEstimates::NONE,
            in_own_pixels: OwnPixels::NONE,
            #[cfg(feature = "carrier")]
            unsure: 0.0,
            model: Model::new(),
        }
    }

    /// Prepares for frames of `camera`, with its values clamped to their ranges, and forgets all earlier frames. A search that starts from
    /// no blur at all may not end.
    pub fn prepare(&mut self, camera: Camera) {
        self.prepare_with(camera, LikelihoodSettings::DEFAULT);
    }

    /// As [`Self::prepare`], with other settings.
    pub fn prepare_with(&mut self, camera: Camera, settings: LikelihoodSettings) {
        let camera = camera.clamped();
        self.configured = camera.encoding;
        self.model.prepare(camera, settings);
        (self.experience, self.proven, self.in_own_pixels) = (Experience::NONE, ProvenEstimates::NONE, OwnPixels::NONE);
        #[cfg(feature = "carrier")]
        {
            self.unsure = 0.0;
        }
    }

    /// Continues in other pixels of the camera's frames: `side` times as wide, and mixed with their neighbours by a spot of that variance.
    /// Levels from the old pixels do not apply to the new ones, and larger ones do not show the camera's curve.
    #[cfg_attr(not(feature = "maximum-likelihood"), allow(dead_code))]
    pub(crate) fn go_on_in_pixels(&mut self, side: usize, mixing_variance: f32) {
        if self.sees_own_pixels() {
            self.in_own_pixels = OwnPixels {
                curve: self.experience.curve,
                blur_px: self.experience.blur_px().or(self.in_own_pixels.blur_px),
            };
        } else if side == 1 {
            self.experience.curve = self.in_own_pixels.curve;
            self.model.see_by(self.experience.curve.encoding(self.configured));
        }
        self.model.pixels = [side as f32, mixing_variance];
        self.experience.forget_levels();
        self.proven.forget_levels();
    }

    /// Sets whether the contrast differs from frame to frame because of a carrier.
    #[cfg(feature = "carrier")]
    pub(crate) fn expect_carrier(&mut self, has_carrier: bool) {
        self.experience.levels.has_carrier = has_carrier;
    }

    /// Forgets the LEDs, as after a change to another place.
    #[cfg_attr(not(feature = "maximum-likelihood"), allow(dead_code))]
    pub(crate) fn forget_leds(&mut self) {
        self.experience.leds = LedMoments::NONE;
    }

    /// Forgets all estimates from the panel's image except the line delay.
    #[cfg(feature = "carrier")]
    pub(crate) fn forget(&mut self) {
        self.set_experience(self.experience.of_lines());
        self.proven = ProvenEstimates::NONE;
    }

    /// Whether it sees the camera's own pixels.
    fn sees_own_pixels(&self) -> bool {
        let [side, _] = self.model.pixels;
        side == 1.0
    }

    /// Estimates of the camera and the LEDs from the frames so far; `None` before the first.
    pub fn learnt(&self) -> Option<CameraEstimate> {
        let levels = self.experience.levels.mean_levels()?;
        let [side, mixing] = self.model.pixels;
        let [blur, deviation] = self.experience.blur_px()?;
        let seen = Camera {
            blur_sigma_px: side * libm::sqrtf((blur * blur - mixing).max(0.0)),
            ..self.model.camera
        };
        let (told, own) = (self.model.camera.blur_sigma_px, &self.in_own_pixels);
        let (camera, blur_deviation_px) = if self.sees_own_pixels() {
            (seen, Some(deviation))
        } else {
            let camera = Camera {
                encoding: own.curve.encoding(self.configured),
                blur_sigma_px: own.blur_px.map_or(told, |[blur, _]| blur),
                ..self.model.camera
            };
            (camera, own.blur_px.map(|[_, deviation]| deviation))
        };
        Some(CameraEstimate {
            camera: camera.clamped(),
            seen: seen.clamped(),
            blur_deviation_px,
            noise_grey: self.model.noise_grey(levels.noise),
            #[cfg(feature = "read-lines")]
            line_delay: self.experience.line_delay.known(),
            broken: self.model.leds.broken(),
            frames: self.experience.levels.frames(),
        })
    }

    /// The estimates from the frames so far, as a prior.
    pub const fn experience(&self) -> Experience {
        self.experience
    }

    /// Continues with the estimates of another detector.
    pub fn set_experience(&mut self, experience: Experience) {
        self.experience = experience;
        self.model.see_by(experience.curve.encoding(self.configured));
    }

    /// Sets the delay of each line relative to the one above, in exposures, until frames show another one; 0, which is final, if all are
    /// exposed at once. A delay that is NaN or beyond ±2 is ignored.
    #[cfg(feature = "read-lines")]
    pub fn set_line_delay(&mut self, delay: f32) {
        if delay.abs() <= LINE_DELAY_MAX {
            self.experience.line_delay = LineDelay::configured(delay);
        }
    }

    /// Reads the panel at `corners`, and learns from it.
    ///
    /// # Errors
    /// [`DetectError::ContrastTooLow`] if all pixels look alike, [`DetectError::OutsideMemory`] if the panel's image is not in
    /// the frame or does not fit into `PIXELS`, [`DetectError::Covered`] if its place shows hardly any of the contrast that it had before.
    pub fn detect(&mut self, frame: &Frame<'_>, corners: &Corners) -> Result<Detection, DetectError> {
        self.detect_after(&SoftPanel::ERASED, frame, corners, None)
    }

    /// As [`Self::detect`], given the soft values of the symbol `before`: if the exposure caught its end, both symbols can be separated. A
    /// first search may start from a known width of the LEDs' images (standard deviation in px; lens, LED and pixel together).
    ///
    /// # Errors
    /// As [`Self::detect`].
    // Not inlined: it would grow the stack of all reading code.
    #[inline(never)]
    pub(crate) fn detect_after(
        &mut self,
        before: &SoftPanel,
        frame: &Frame<'_>,
        corners: &Corners,
        spot_sigma_px: Option<f32>,
    ) -> Result<Detection, DetectError> {
        let mut detection = self.read(before, frame, corners, spot_sigma_px)?;
        if detection.mixed.is_none() && self.proven.doubts(detection.confidence) {
            detection = self.read_by_others(before, frame, corners, spot_sigma_px, detection);
        }
        #[cfg(feature = "carrier")]
        if self.is_asked_for_lights(&detection) {
            detection.lights = self.lights(frame, corners);
        }
        Ok(detection)
    }

    /// The shadows across a panel with spots `spots` in a frame, if the ground between its LEDs is uneven.
    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    pub(crate) fn shade_on(&self, frame: &Frame<'_>, spots: &LatticeModel) -> Option<Shade> {
        if !spots.stand_apart(SHADE_LEAST_PITCH) {
            return None;
        }
        Shade::uneven_on(&spots.lattice, |at| self.model.metric.light_at(frame, at))
    }

    /// Reads a panel without shadows, and learns nothing from it.
    ///
    /// # Errors
    /// As [`Self::detect`].
    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    #[cold]
    #[inline(never)]
    pub(crate) fn detect_without(
        &mut self,
        shade: Shade,
        before: &SoftPanel,
        frame: &Frame<'_>,
        corners: &Corners,
        spot_sigma_px: f32,
    ) -> Result<Detection, DetectError> {
        let learnt = self.experience();
        self.model.shade = Some(shade);
        let detection = self.read(before, frame, corners, Some(spot_sigma_px));
        self.model.shade = None;
        self.set_experience(learnt);
        detection
    }

    /// Whether the bits stay unsure or a carrier is expected: lines exposed one after another may then give single LEDs another contrast.
    #[cfg(feature = "carrier")]
    fn is_asked_for_lights(&mut self, detection: &Detection) -> bool {
        let mixed = if detection.mixed.is_some() { UNSURE_MIXED } else { 0.0 };
        self.unsure += UNSURE_GAIN * (1.0 - detection.confidence + mixed - self.unsure);
        self.unsure > UNSURE_MIN || self.experience.levels.has_carrier
    }

    /// The light of each LED by least squares, independent of the bits.
    #[cfg(feature = "carrier")]
    #[inline(never)]
    fn lights(&mut self, frame: &Frame<'_>, corners: &Corners) -> Option<Lights> {
        let levels = self.experience.levels.mean_levels()?;
        let (crop, variance) = self.look(frame, corners, None).ok()?;
        let found = self.model.least_squares(frame, &crop, &Levels { variance, ..levels }).ok()?;
        let mean = found.light.iter().sum::<f32>() / LEDS as f32;
        let all = mean.abs() + core::f32::consts::TAU * variance * found.background;
        (all > 0.0).then(|| Lights {
            above_mean: found.light.map(|light| (light - mean) / all),
            mean: mean / all,
        })
    }

    /// Reads a panel with unsure bits (`here`) again, with the estimates of the last sure frame and with none. Keeps the estimates that
    /// make the bits surest.
    #[cold]
    #[inline(never)]
    fn read_by_others(
        &mut self,
        before: &SoftPanel,
        frame: &Frame<'_>,
        corners: &Corners,
        spot_sigma_px: Option<f32>,
        here: Detection,
    ) -> Detection {
        let learnt = self.experience;
        let (mut surest, mut best) = (here, learnt);
        for other in [self.proven.experience(), learnt.of_lines()] {
            self.set_experience(other);
            if let Ok(found) = self.read(before, frame, corners, spot_sigma_px)
                && found.mixed.is_none()
                && found.confidence > surest.confidence
            {
                (surest, best) = (found, self.experience);
            }
        }
        self.set_experience(best);
        surest
    }

    /// Reads the panel with the estimates so far, and updates them.
    #[inline(never)]
    fn read(
        &mut self,
        before: &SoftPanel,
        frame: &Frame<'_>,
        corners: &Corners,
        spot_sigma_px: Option<f32>,
    ) -> Result<Detection, DetectError> {
        let was_plain_around = self.experience.is_plain_around;
        let (mut crop, variance) = self.look(frame, corners, spot_sigma_px)?;
        self.experience.set_scale(crop.scale);
        let Experience { leds, light_noise, .. } = &self.experience;
        self.model.set_leds(leds.levels(*light_noise));
        let mut best = self.model.search(frame, &crop, &self.experience.levels, variance)?;
        if self.look_around(frame, corners, &mut crop, &mut best)? {
            best = self.model.search(frame, &crop, &self.experience.levels, variance)?;
        }
        let fits = self.fits(&best);
        if !self.may_be_single(&best) {
            let two = self.model.two_symbols(frame, &crop, before, &self.experience.levels)?;
            #[cfg(feature = "carrier")]
            let two = two.filter(|two| !self.experience.levels.has_carrier || !two.is_one_by_carrier());
            let noise = best.levels.noise;
            #[cfg(feature = "read-lines")]
            if let Some(detection) = self.explained(two, frame, &crop, before, noise)? {
                return Ok(detection);
            }
            #[cfg(not(feature = "read-lines"))]
            if let Some(two) = two.filter(|two| two.explain(&self.experience.levels, before, noise)) {
                return Ok(two.detection());
            }
        }
        let mut is_other_light = false;
        // In a shorter exposure, a panel whose LEDs are all Off explains a frame with as little noise as usual.
        if !fits || !shows_a_message(&best.bits()) {
            let anew = self.model.search(frame, &crop, &LevelPrior::NONE, best.levels.variance)?;
            is_other_light = OTHER_LIGHT * anew.levels.noise < best.levels.noise;
            if is_other_light || !fits && anew.levels.noise < best.levels.noise {
                best = anew;
            }
        }
        let prior = if is_other_light {
            &LevelPrior::NONE
        } else {
            &self.experience.levels
        };
        let flip_cost = self.model.ascend_in_groups(&mut best, prior);
        let least = self.model.least_cost(&flip_cost);
        let flip_cost = self.model.tempered(&mut best, flip_cost);
        let found = best.bits();
        let bits = bits_where(|led| found.led(led) != (flip_cost[led] < 0.0));
        let llr: [f32; LEDS] = core::array::from_fn(|led| {
            if !self.model.leds.follows(led) {
                0.0
            } else if found.led(led) {
                flip_cost[led]
            } else {
                -flip_cost[led]
            }
        });
        let worth = flip_search::worth(&llr);
        let mixed = !self.fits(&best) && least < MIXED;
        let sure = flip_cost.iter().sum::<f32>() >= LEARN_LLR * LEDS as f32;
        let detection = Detection {
            #[cfg(feature = "carrier")]
            modulation: best.levels.modulation_of_mean(),
            mixed: mixed.then_some(Mixture::INSEPARABLE),
            ..Detection::new(bits, llr.map(|llr| llr * worth))
        };
        let shown = self.proven.contrast_shown(&best.levels);
        let is_random = shows_a_message(&bits);
        let teaches = sure && is_random && !self.model.is_without_shadows() && self.proven.teaches(shown);
        if !teaches {
            self.experience.is_plain_around = was_plain_around;
            // All LEDs Off, or On, explain anything that does not show the panel, but poorly.
            let is_blank = !is_random && !self.fits(&best);
            if is_blank || ProvenEstimates::is_covered(shown) {
                let percent = if is_blank { 0 } else { (100.0 * shown) as u8 };
                return Err(DetectError::Covered { percent });
            }
        }
        #[cfg(feature = "read-lines")]
        let detection = self.split(detection, &crop, before, best.levels.noise);
        if teaches {
            let read = best;
            self.proven.read_by(&self.experience, detection.confidence);
            self.learn(&mut best);
            if cfg!(feature = "learn-curve") && detection.confidence > CONFIDENCE_MIN {
                self.learn_curve(frame, &crop, &read);
            }
        }
        Ok(detection)
    }

    /// Whether a frame may show the same panel in the same light.
    fn fits(&self, estimate: &Estimate) -> bool {
        let usual = &self.experience.levels;
        usual.fits(usual.usual_noise(&estimate.levels))
    }

    /// As [`Self::fits`], but false for a frame that is much noisier than the first ones: until the usual noise is known, a mixture that is
    /// read as one symbol may look like a carrier's complement.
    fn may_be_single(&self, estimate: &Estimate) -> bool {
        if cfg!(not(feature = "carrier")) {
            return self.fits(estimate);
        }
        let usual = &self.experience.levels;
        usual.fits_so_far(usual.usual_noise(&estimate.levels))
    }

    /// The prior knowledge of the panel's image.
    fn image_prior(&self, is_plain_around: bool) -> ImagePrior {
        ImagePrior {
            is_plain_around,
            spot_sigma_px: self.experience.spot_sigma_px().unwrap_or(0.0),
        }
    }

    /// The panel in pixels that suit the width of its spots, and the initial variance of these.
    fn look(&mut self, frame: &Frame<'_>, corners: &Corners, spot_sigma_px: Option<f32>) -> Result<(Crop, f32), DetectError> {
        let image_prior = self.image_prior(self.experience.is_plain_around);
        let crop = Crop::new(frame, corners, PIXELS, image_prior);
        if self.experience.spot_sigma_px().is_some() {
            return Ok((crop, image_prior.spot_sigma_px * image_prior.spot_sigma_px));
        }
        let usual = match spot_sigma_px {
            Some(sigma_px) => (sigma_px * sigma_px) / (crop.scale.bin * crop.scale.bin) as f32,
            None => self.model.usual_variance(&crop.scale),
        };
        let variance = self.model.first_variance(frame, &crop, usual)?;
        let spot_sigma_px = crop.scale.bin as f32 * libm::sqrtf(variance);
        let wider = Crop::new(
            frame,
            corners,
            PIXELS,
            ImagePrior {
                spot_sigma_px,
                ..image_prior
            },
        );
        let ratio = crop.scale.bin as f32 / wider.scale.bin as f32;
        Ok((wider, variance * ratio * ratio))
    }

    /// Whether the panel's surroundings are not plain, so that the search must be repeated without them. If they are plain, the estimate
    /// continues with them.
    fn look_around(&mut self, frame: &Frame<'_>, corners: &Corners, crop: &mut Crop, estimate: &mut Estimate) -> Result<bool, DetectError> {
        let noise = estimate.levels.noise;
        let image_prior = |is_plain_around| ImagePrior {
            is_plain_around,
            spot_sigma_px: crop.scale.bin as f32 * libm::sqrtf(estimate.levels.variance),
        };
        if self.experience.is_plain_around {
            self.experience.is_plain_around = self.model.is_plain_around(crop, noise);
            if !self.experience.is_plain_around {
                *crop = Crop::new(frame, corners, PIXELS, image_prior(false));
            }
            return Ok(!self.experience.is_plain_around);
        }
        if !self.experience.levels.age().is_multiple_of(LOOK_AROUND_FRAMES) {
            return Ok(false);
        }
        let wider = Crop::new(frame, corners, PIXELS, image_prior(true));
        if wider.scale.bin != crop.scale.bin {
            return Ok(false);
        }
        let mut moved = *estimate;
        self.model.move_to(frame, &wider, &mut moved)?;
        self.experience.is_plain_around = self.model.is_plain_around(&wider, noise);
        if self.experience.is_plain_around {
            (*crop, *estimate) = (wider, moved);
            self.model.fit(estimate, &self.experience.levels);
            self.model.ascent(estimate).flip_singly();
            self.model.fit(estimate, &self.experience.levels);
        } else {
            self.model.move_to(frame, crop, estimate)?;
        }
        Ok(false)
    }

    /// Compares a panel under another curve, and changes to that curve if it is significantly better.
    // Not inlined: it would grow the stack of all reading code.
    #[inline(never)]
    fn learn_curve(&mut self, frame: &Frame<'_>, crop: &Crop, estimate: &Estimate) {
        let now = self.model.camera.encoding;
        let most_frames = self.model.settings.curve_frames.into();
        let Experience { levels, leds, curve, .. } = &mut self.experience;
        let tells = estimate.overlaps(&crop.scale) && levels.fits_surely(levels.usual_noise(&estimate.levels));
        let Some(tried) = curve.next(now, most_frames).filter(|_| tells) else {
            return;
        };
        let Some(gain) = self.model.try_curve(tried, frame, crop, estimate) else {
            return;
        };
        if curve.update(now, tried, &gain, most_frames) {
            self.model.see_by(curve.encoding(self.configured));
            let [from, to] = &gain.levels;
            levels.convert(from, to);
            leds.discount();
        }
    }

    fn learn(&mut self, estimate: &mut Estimate) {
        let may_be_single = self.may_be_single(estimate);
        self.model.expect(estimate);
        let (levels, equations) = (&estimate.levels, self.model.equations(estimate, &self.experience.levels));
        if let Some(unsure) = equations.covariance(levels.noise) {
            #[cfg(feature = "carrier")]
            let unsure = if self.experience.levels.has_carrier {
                unsure + levels.spread_by_carrier()
            } else {
                unsure
            };
            self.experience.levels.update(levels, &unsure);
        }
        if cfg!(feature = "carrier") && !may_be_single {
            return;
        }
        let Experience {
            levels, leds, light_noise, ..
        } = &mut self.experience;
        let panel = estimate.bits();
        if levels.frames() == 1 && !leds.are_known() {
            // All earlier moments come from a worse fit.
            *leds = LedMoments::NONE;
        }
        let is_bright = self.model.image.saturated_share() > SATURATED_MAX;
        if levels.fits(levels.usual_noise(&estimate.levels)) && !is_bright && leds.is_new(panel) {
            let (lit, noise) = self.model.ascent(estimate).measure_light();
            let lit = self.model.above_ground(&lit);
            // While the noise is unknown, a mixture of two symbols looks like one.
            if levels.fits_surely(levels.usual_noise(&estimate.levels)) || is_clear_cut(&lit) {
                leds.update(panel, &lit);
                *light_noise = noise;
            }
        }
    }
}

/// Whether bits may be a message's, with enough LEDs of either state.
fn shows_a_message(bits: &PanelFrame) -> bool {
    (LEARN_LEDS..=LEDS as u32 - LEARN_LEDS).contains(&bits.count_on())
}

#[cfg(test)]
mod tests;
