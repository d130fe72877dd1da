//! The bits that make the frame likeliest: the image as a known operator on 64 unknown bits.
//!
//! # The model
//!
//! Once the panel's corners are known, its image is known but for its bits and a few levels. In linear light, 1 at grey 118,
//! a pixel at p sees
//!
//! ```text
//! x(p) = background + Σ (off + contrast·(offset + gain·b))·h(p − LED),    b = 0 or 1 for each of the 64 LEDs
//! ```
//!
//! `offset` and `gain` are 0 and 1 until the frames have told each LED's own: below.
//!
//! h is the image of an LED of light 1. Lens blur, the LED's disc and the pixel's square together are close to a Gaussian whose variance is
//! the sum of theirs, σ² + D²/16 + 1/12 px² for an LED D px wide, and that sum is all that matters here: it is
//! fitted, not assumed. Noise is that of electrons and read-out, in whose root light all pixels weigh the same; a pixel
//! at grey 255 says "at least" and no more. On is what is brighter: a solution of negative contrast is its own complement.
//!
//! Pixels beyond the panel's cells are left out, unless they turn out to be as plain as those between the LEDs: a street around the panel
//! would spoil levels and noise, while a plain board tells of the outermost LEDs. Blocks of pixels stand for single ones where LEDs are
//! far apart or the blur is wide.
//!
//! # The search
//!
//! 1. **Least squares** on the light of the 64 LEDs, and the two groups that these fall into: a first guess of levels and bits. In a first
//!    frame it begins from several widths of spots, that which locating has found among them, and goes on with that which leaves least.
//! 2. **Interference cancellation**: each LED gets the share of On that the image calls for, given what is expected of the others; the
//!    levels are refitted in between (Gauss and Newton), so that the noise left over falls from round to round.
//! 3. **Likelihood ascent**: flips of single LEDs, then of neighbours, as long as the likelihood rises.
//! 4. **Sphere decoding**: the likeliest sets of flips of any number of LEDs (K-best; Guo & Nilsson 2006), or where many pixels are
//!    saturated, groups that grow from each LED (Kernighan & Lin 1970). The likelihood that refitted levels win back is part of a set's
//!    gain (a Schur complement): without it, wrong bits and wrong levels hold each other in place.
//!
//! # What is learnt
//!
//! What a panel's levels were in earlier frames is a [prior](Experience) of those of the next one: it makes them surer, and reads panels
//! whose LEDs are all alike. They follow the distance: light fills more pixels of a nearer panel.
//!
//! A frame whose place shows much less contrast than usual teaches nothing, and one that shows hardly any is not read
//! (`likelihood/proven.rs`): a wiper is before the panel, or its lamps are dark. What was learnt is doubted when bits stay unsure that were
//! sure before: the frame is also read by what was known when they were, and by nothing, and what makes its bits surest holds from then on.
//!
//! Of each LED, its two levels are learnt from the moments of its light over panels that differ, no bit being known: unequal LEDs, a dim
//! row, bright patches behind an open frame. An LED of one level does not follow the message; it is named and erased
//! (`likelihood/leds.rs`). [`MaximumLikelihood::learnt`] tells what has been learnt.
//!
//! Where LEDs overlap, frames also tell by which curve the camera encodes light (`likelihood/curve.rs`): in the first of them, other
//! curves are tried, one a frame, and the receiver goes over to one that is better beyond doubt.
//!
//! A microcontroller learns the same by the same code: the LEDs take 1.4 kB a panel, the curve 100 bytes. The curve may be left out there:
//! it is the feature `learn-curve`.
//!
//! # Soft values
//!
//! The log-likelihood ratio of a bit is what the likelihood loses when the bit is flipped and the others do their best to make up for it
//! (max-log); between the sets that the sphere decoder lists, it is the logarithm of their odds. Where more bits are in doubt than a list
//! can tell of, all ratios of the panel are made smaller: `docs/detectors.md` shows how sure they then are. The noise is estimated from the
//! frame, so whatever the model does not explain makes all ratios smaller. Errors of the model are as wide as an LED, and count for more
//! than as many pixels' noise: ratios are divided by how much more is left of the LEDs' images than noise would leave (quasi-likelihood;
//! McCullagh & Nelder 1989).
//!
//! # Two symbols in one exposure
//!
//! An exposure across a change shows LEDs that were On for a part of it. A receiver's detector takes what is known of
//! the symbol before, and reads both: `likelihood/mixture.rs`. Where the camera's lines are exposed one after another, each row of LEDs was
//! caught at another moment; how much later each line is, is learnt from such exposures, and kept: `likelihood/lines.rs`.
//!
//! # Limits
//!
//! One blur for the whole panel, Gaussian and as wide as high; a curve that is a power, at the black level that was told. Neither costs
//! bits to speak of: discs of defocus, sharpened frames, curves from linear to γ = 2.6 are read without errors. A background that is not
//! plain costs bits in the first frames of an open panel, until its LEDs are known, and where it moves behind them. LEDs whose images are
//! sharp discs many pixels wide are looked at in larger pixels, and any detector reads them.

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

use crate::camera::Learnt;
use crate::corners::Corners;
#[cfg(feature = "carrier")]
use crate::detect::Lights;
use crate::detect::{DetectError, Detection, Mixture, bits_where};
use crate::frame::Frame;
use crate::settings::LikelihoodSettings;
use crop::{Crop, Sight};
use curve::CurveEvidence;
use estimate::Estimate;
use leds::{LedMoments, is_clear_cut};
use level_prior::LevelPrior;
#[cfg(feature = "carrier")]
use levels::Levels;
#[cfg(feature = "read-lines")]
use lines::LineDelay;
use link::camera::{Camera, Encoding};
use link::panel::{LEDS, SoftPanel};
use model::Model;
use proven::Proven;

/// What is around the cells is looked at anew after so many (frames).
const LOOK_AROUND_FRAMES: u32 = 8;
/// LEDs of either kind in a panel of which levels are learnt, at least (count).
const LEARN_LEDS: u32 = 8;
/// How sure its bits are on the average, at least (nats). Lower: levels are learnt from wrong bits.
const LEARN_LLR: f32 = 1.0;
/// How sure a frame's bits are that is held against other curves, at least (share that is expected to be right). Lower: wrong bits and
/// wrong places are explained by curves.
const CONFIDENCE_MIN: f32 = 0.95;
/// A search that goes by no levels shows that the light is another where it leaves less noise by this (factor). Lower: what is read anew
/// because two symbols share it loses the usual levels, too.
const OTHER_LIGHT: f32 = 2.0;
/// If two symbols share an exposure, some LED's flip costs less (nats): where α of it is the other symbol's, α² of a
/// flip's cost becomes noise of half the LEDs, so that a flip costs about 2·(1 − 2α)/α² times half the pixels of an
/// LED, 10 to 30. Below α = 1/8 the bits are certain all the same.
const MIXED: f32 = 1000.0;
/// LEDs are not measured in images of which more is saturated (share): how bright they are does not show there.
const SATURATED_MAX: f32 = 0.05;

/// What a frame that seems to show two symbols adds to how unsure bits are (share of wrong bits),
#[cfg(feature = "carrier")]
const UNSURE_MIXED: f32 = 0.05;
/// what a frame changes of that (share),
#[cfg(feature = "carrier")]
const UNSURE_GAIN: f32 = 0.125;
/// and from where on each LED's light is measured (share of wrong bits). Lower: slower.
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
    /// The curve that was told.
    told: Encoding,
    experience: Experience,
    proven: Proven,
    /// What was learnt in the camera's own pixels, where larger ones are looked at.
    in_own_pixels: OwnPixels,
    /// How unsure bits were of late (share of wrong ones).
    #[cfg(feature = "carrier")]
    unsure: f32,
    model: Model<PIXELS>,
}

/// What was learnt of the camera in its own pixels.
struct OwnPixels {
    curve: CurveEvidence,
    /// The standard deviation of the blur, and that of its estimate.
    blur_px: Option<[f32; 2]>,
}

impl OwnPixels {
    /// Nothing.
    const NONE: Self = Self {
        curve: CurveEvidence::NONE,
        blur_px: None,
    };
}

impl<const PIXELS: usize> MaximumLikelihood<PIXELS> {
    /// A detector for frames of `camera` that has seen none.
    pub fn new(camera: Camera) -> Self {
        let mut detector = Self::empty();
        detector.prepare(camera);
        detector
    }

    /// A detector's memory, for a `static`: it sees black before it is [prepared](Self::prepare). It is all zeros, so that it takes no
    /// room in flash.
    pub const fn empty() -> Self {
        Self {
            told: Encoding::Gamma(0.0),
            experience: Experience::NONE,
            proven: Proven::NONE,
            in_own_pixels: OwnPixels::NONE,
            #[cfg(feature = "carrier")]
            unsure: 0.0,
            model: Model::new(),
        }
    }

    /// Gets ready for frames of `camera`, or of the nearest whose values are in their ranges, and forgets all others: a search that
    /// begins from no blur at all may have no end.
    pub fn prepare(&mut self, camera: Camera) {
        self.prepare_with(camera, LikelihoodSettings::DEFAULT);
    }

    /// The same with other settings.
    pub fn prepare_with(&mut self, camera: Camera, settings: LikelihoodSettings) {
        let camera = camera.clamped();
        self.told = camera.encoding;
        self.model.prepare(camera, settings);
        (self.experience, self.proven, self.in_own_pixels) = (Experience::NONE, Proven::NONE, OwnPixels::NONE);
        #[cfg(feature = "carrier")]
        {
            self.unsure = 0.0;
        }
    }

    /// Goes on in other pixels of the camera's frames: `side` times as wide, and mixed with their neighbours by a spot of that variance.
    /// What was learnt of the levels in the old ones says nothing of theirs, and larger ones nothing of the camera's curve.
    #[cfg_attr(not(feature = "maximum-likelihood"), allow(dead_code))]
    pub(crate) fn go_on_in_pixels(&mut self, side: usize, mixing_variance: f32) {
        if self.sees_own_pixels() {
            self.in_own_pixels = OwnPixels {
                curve: self.experience.curve,
                blur_px: self.experience.blur_px().or(self.in_own_pixels.blur_px),
            };
        } else if side == 1 {
            self.experience.curve = self.in_own_pixels.curve;
            self.model.see_by(self.experience.curve.encoding(self.told));
        }
        self.model.pixels = [side as f32, mixing_variance];
        self.experience.forget_levels();
        self.proven.forget_levels();
    }

    /// Reckons from now on with panels whose contrast is another in each frame, or no longer.
    #[cfg(feature = "carrier")]
    pub(crate) fn expect_carrier(&mut self, has_carrier: bool) {
        self.experience.levels.has_carrier = has_carrier;
    }

    /// Goes on with LEDs of which nothing is known, as those of another place are.
    #[cfg_attr(not(feature = "maximum-likelihood"), allow(dead_code))]
    pub(crate) fn forget_leds(&mut self) {
        self.experience.leds = LedMoments::NONE;
    }

    /// Forgets what the panel's image has taught, but for how lines are read.
    #[cfg(feature = "carrier")]
    pub(crate) fn forget(&mut self) {
        self.set_experience(self.experience.of_lines());
        self.proven = Proven::NONE;
    }

    /// Whether it sees the camera's own pixels.
    fn sees_own_pixels(&self) -> bool {
        let [side, _] = self.model.pixels;
        side == 1.0
    }

    /// What the frames so far have told of the camera and the LEDs; none before the first.
    pub fn learnt(&self) -> Option<Learnt> {
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
                encoding: own.curve.encoding(self.told),
                blur_sigma_px: own.blur_px.map_or(told, |[blur, _]| blur),
                ..self.model.camera
            };
            (camera, own.blur_px.map(|[_, deviation]| deviation))
        };
        Some(Learnt {
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

    /// What has been learnt from the frames so far.
    pub const fn experience(&self) -> Experience {
        self.experience
    }

    /// Goes on with what was learnt elsewhere.
    pub fn set_experience(&mut self, experience: Experience) {
        self.experience = experience;
        self.model.see_by(experience.curve.encoding(self.told));
    }

    /// Goes by lines that are each later than the one above by `delay` exposures, until frames show otherwise; 0, which is final, where all
    /// are exposed at once. A delay that is no number within ±2 is not taken.
    #[cfg(feature = "read-lines")]
    pub fn tell_line_delay(&mut self, delay: f32) {
        if delay.abs() <= LINE_DELAY_MAX {
            self.experience.line_delay = LineDelay::told(delay);
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

    /// The same where something is known of the symbol `before`, which the exposure may have caught the end of: what it
    /// then shows of the next one can be told apart. How wide the LEDs' images are (standard deviation in px, lens, LED and pixel together)
    /// may be known from elsewhere: a first search begins with that.
    ///
    /// # Errors
    /// As [`Self::detect`].
    // Not inlined: the stack of those who read panels otherwise stays as it is.
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

    /// Whether single LEDs may differ in contrast, as lines do that are exposed one after another before a carrier: then bits stay unsure.
    #[cfg(feature = "carrier")]
    fn is_asked_for_lights(&mut self, detection: &Detection) -> bool {
        let mixed = if detection.mixed.is_some() { UNSURE_MIXED } else { 0.0 };
        self.unsure += UNSURE_GAIN * (1.0 - detection.confidence + mixed - self.unsure);
        self.unsure > UNSURE_MIN || self.experience.levels.has_carrier
    }

    /// The light of each LED by least squares, whatever the bits are.
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

    /// Reads a panel whose bits are unsure `here` by what was learnt when they were surer, and by nothing; goes on with what makes them
    /// surest.
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

    /// Reads the panel by what was learnt so far, and learns from it.
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
        let mut is_other_light = false;
        if !self.fits(&best) {
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
            let anew = self.model.search(frame, &crop, &LevelPrior::NONE, best.levels.variance)?;
            if anew.levels.noise < best.levels.noise {
                is_other_light = OTHER_LIGHT * anew.levels.noise < best.levels.noise;
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
        let is_random = (LEARN_LEDS..=LEDS as u32 - LEARN_LEDS).contains(&bits.count_on());
        let teaches = sure && is_random && self.proven.teaches(shown);
        if !teaches {
            self.experience.is_plain_around = was_plain_around;
            // All LEDs Off, or On, explain whatever does not show them, but not well.
            let is_blank = !is_random && !self.fits(&best);
            if is_blank || Proven::is_covered(shown) {
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

    /// Whether a frame may be of the same panel in the same light.
    fn fits(&self, estimate: &Estimate) -> bool {
        let usual = &self.experience.levels;
        usual.fits(usual.usual_noise(&estimate.levels))
    }

    /// What is known of the panel's image.
    fn sight(&self, is_plain_around: bool) -> Sight {
        Sight {
            is_plain_around,
            spot_sigma_px: self.experience.spot_sigma_px().unwrap_or(0.0),
        }
    }

    /// The panel in pixels as wide as befits its spots, and the variance to begin with of those.
    fn look(&mut self, frame: &Frame<'_>, corners: &Corners, spot_sigma_px: Option<f32>) -> Result<(Crop, f32), DetectError> {
        let sight = self.sight(self.experience.is_plain_around);
        let crop = Crop::new(frame, corners, PIXELS, sight);
        if self.experience.spot_sigma_px().is_some() {
            return Ok((crop, sight.spot_sigma_px * sight.spot_sigma_px));
        }
        let usual = match spot_sigma_px {
            Some(sigma_px) => (sigma_px * sigma_px) / (crop.scale.bin * crop.scale.bin) as f32,
            None => self.model.usual_variance(&crop.scale),
        };
        let variance = self.model.first_variance(frame, &crop, usual)?;
        let spot_sigma_px = crop.scale.bin as f32 * libm::sqrtf(variance);
        let wider = Crop::new(frame, corners, PIXELS, Sight { spot_sigma_px, ..sight });
        let ratio = crop.scale.bin as f32 / wider.scale.bin as f32;
        Ok((wider, variance * ratio * ratio))
    }

    /// Whether what is around the panel has turned out not to be plain, so that it has to be searched anew without. If it has turned out to
    /// be, the estimate goes on with it.
    fn look_around(&mut self, frame: &Frame<'_>, corners: &Corners, crop: &mut Crop, estimate: &mut Estimate) -> Result<bool, DetectError> {
        let noise = estimate.levels.noise;
        let sight = |is_plain_around| Sight {
            is_plain_around,
            spot_sigma_px: crop.scale.bin as f32 * libm::sqrtf(estimate.levels.variance),
        };
        if self.experience.is_plain_around {
            self.experience.is_plain_around = self.model.is_plain_around(crop, noise);
            if !self.experience.is_plain_around {
                *crop = Crop::new(frame, corners, PIXELS, sight(false));
            }
            return Ok(!self.experience.is_plain_around);
        }
        if !self.experience.levels.age().is_multiple_of(LOOK_AROUND_FRAMES) {
            return Ok(false);
        }
        let wider = Crop::new(frame, corners, PIXELS, sight(true));
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

    /// Learns of the camera's curve from a panel that was read, and goes on by another if that is better beyond doubt.
    // Not inlined: the stack of those who read panels otherwise stays as it is.
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
            self.model.see_by(curve.encoding(self.told));
            let [from, to] = &gain.levels;
            levels.go_over(from, to);
            leds.go_over();
        }
    }

    fn learn(&mut self, estimate: &mut Estimate) {
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
        let Experience {
            levels, leds, light_noise, ..
        } = &mut self.experience;
        let panel = estimate.bits();
        if levels.frames() == 1 && !leds.are_known() {
            // Whatever was learnt before was learnt from a worse fit.
            *leds = LedMoments::NONE;
        }
        let is_bright = self.model.image.saturated_share() > SATURATED_MAX;
        if levels.fits(levels.usual_noise(&estimate.levels)) && !is_bright && leds.is_new(panel) {
            let (lit, noise) = self.model.ascent(estimate).measure_light();
            let lit = self.model.above_ground(&lit);
            // As long as the noise is not known, a mixture of two symbols looks like one.
            if levels.fits_surely(levels.usual_noise(&estimate.levels)) || is_clear_cut(&lit) {
                leds.update(panel, &lit);
                *light_noise = noise;
            }
        }
    }
}

#[cfg(test)]
mod tests;
