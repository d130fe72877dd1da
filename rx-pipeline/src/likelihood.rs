//! The bits that make the frame likeliest: the image as a known operator on 64 unknown bits.
//!
//! # The model
//!
//! Once the panel's corners are known, its image is known but for its bits and a few levels. In linear light, 1 at grey 118,
//! a pixel at p sees
//!
//! ```text
//! x(p) = background + Σ (off + contrast·b)·h(p − LED),    b = 0 or 1 for each of the 64 LEDs
//! ```
//!
//! h is the image of an LED of light 1. Lens blur, the LED's disc and the pixel's square together are close to a Gaussian whose variance is
//! the sum of theirs, σ² + D²/16 + 1/12 px² for an LED D px wide, and that sum is all that matters here: it is
//! fitted, not assumed. Noise is that of electrons and read-out, in whose root light all pixels weigh the same; a pixel
//! at grey 255 says "at least" and no more.
//!
//! # The search
//!
//! 1. **Least squares** on the light of the 64 LEDs, and the two groups that these fall into: a first guess of levels and bits.
//! 2. **Interference cancellation**: each LED gets the share of On that the image calls for, given what is expected of the others; the
//!    levels are refitted in between (Gauss and Newton), so that the noise left over falls from round to round.
//! 3. **Flips**: alone, then in groups that grow from each LED (Kernighan & Lin 1970), as long as the likelihood rises. The likelihood that
//!    refitted levels win back is part of a group's gain: without it, wrong bits and wrong levels hold each
//!    other in place.
//!
//! What a panel's levels were in earlier frames is [remembered](Experience), makes the levels of the next one surer, and reads panels
//! whose LEDs are all alike.
//!
//! # Soft values
//!
//! The log-likelihood ratio of a bit is what the likelihood loses when the bit is flipped and the others do their best to make up for it
//! (max-log). The noise is estimated from the frame, so whatever the model does not explain makes all
//! ratios smaller.
//!
//! # Two symbols in one exposure
//!
//! An exposure across a change shows LEDs that were On for a part of it. [`MaximumLikelihood::detect_after`] takes what is known of the symbol
//! before, and reads both: `likelihood/mixture.rs`.
//!
//! # Limits
//!
//! One blur for the whole panel; a plain background behind it. LEDs whose images are sharp discs many pixels wide are no
//! Gaussians; such panels are looked at in larger pixels, and any detector reads them.

mod experience;
mod image;
mod levels;
mod mixture;
mod search;
mod sphere;
mod spots;
mod start;
mod view;

pub use experience::Experience;

use crate::corners::Corners;
use crate::detect::{DetectError, Detection, MIN_CONTRAST_GREY, Mixture, bits_where};
use crate::frame::Frame;
use image::{Curve, Image};
use levels::{Equations, Levels, Pull};
use link::camera::Camera;
use link::panel::{LEDS, LLR_STEP, PanelFrame, SoftPanel};
use search::{Climb, Couplings, LEAST_GAIN};
use sphere::Way;
use spots::Spots;
use start::LeastSquares;
use view::View;

/// Rounds of interference cancellation, and sweeps over the LEDs before and in each.
const ROUNDS: usize = 5;
const FIRST_SWEEPS: usize = 3;
const SWEEPS: usize = 2;
/// Least squares shrink the contrast, and saturation does: searches begin at these multiples of it.
const FIRST_CONTRASTS: [f32; 2] = [1.0, 1.6];
/// Rounds of flipping groups.
const GROUP_ROUNDS: usize = 12;
/// Rounds of growing groups of neighbours: one or two do, but levels that are fitted in between may take back what flips gained, without end.
const GROWN_ROUNDS: usize = 32;
/// Ways tried in a round.
const TRIES: usize = 4;
/// What is fitted beside noise: the LEDs, and the levels.
const FITTED: usize = LEDS + levels::LEVELS;
/// The offset under the root changes with the noise; by less than this, relatively, it stays.
const OFFSET_STEP: f32 = 0.2;
const OFFSET_RANGE: [f32; 2] = [1e-3, 1.0];
/// The noise assumed of a first frame.
const FIRST_NOISE: f32 = 1e-3;
/// If the flips of any LEDs cost more than this, in nats, none need be tried: all soft values are at their ends.
const CLEAR: f32 = 127.0 * LLR_STEP;
/// If two symbols share an exposure, some LED's flip costs less than this, in nats: where α of it is the other symbol's, α² of a flip's
/// cost becomes noise of half the LEDs, so that a flip costs about 2·(1 − 2α)/α² times half the pixels of an LED, 10 to 30.
/// Below α = 1/8 the bits are certain all the same.
const MIXED: f32 = 1000.0;
/// Shares this close to 0 or 1 are settled.
const HARD: f32 = 0.02;
/// Levels are learnt from panels of at least so many LEDs of either kind,
const LEARN_LEDS: u32 = 8;
/// whose bits are at least this sure on the average, in nats.
const LEARN_LLR: f32 = 1.0;

/// The detector: maximum likelihood, searched for over bits and levels.
///
/// `PIXELS` is the largest image of a panel, [a few pixels](self) wider than its cells; LEDs more than 8 px apart are binned
/// before that. It takes 12 bytes a pixel and about 30 kB: 80 kB for 64×64.
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
    camera: Camera,
    curve: Curve,
    experience: Experience,
    image: Image<PIXELS>,
    spots: Spots,
    couplings: Couplings,
}

/// Bits and levels, as far as a search has come.
#[derive(Clone, Copy)]
struct Solution {
    levels: Levels,
    share: [f32; LEDS],
    centre: [[f32; 2]; LEDS],
}

impl<const PIXELS: usize> MaximumLikelihood<PIXELS> {
    /// A detector for frames of `camera` that has seen none.
    pub fn new(camera: Camera) -> Self {
        let mut detector = Self::blind();
        detector.prepare(camera);
        detector
    }

    /// A detector's memory, for a `static`: it sees black before it is [prepared](Self::prepare). It is all zeros, so that it takes no
    /// room in flash.
    pub const fn blind() -> Self {
        Self {
            camera: Camera {
                gamma: 0.0,
                blur_sigma_px: 0.0,
                read_noise_e: 0.0,
            },
            curve: Curve::DARK,
            experience: Experience::NONE,
            image: Image::new(),
            spots: Spots::new(),
            couplings: Couplings::new(),
        }
    }

    /// Gets ready for frames of `camera`, or of the nearest whose values are in their ranges, and forgets all others: a search that
    /// begins from no blur at all may have no end.
    pub fn prepare(&mut self, camera: Camera) {
        self.camera = camera.clamped();
        self.curve = Curve::new(self.camera.gamma);
        self.experience = Experience::NONE;
    }

    /// What has been learnt from the frames so far.
    pub const fn experience(&self) -> Experience {
        self.experience
    }

    /// Goes on with what was learnt elsewhere.
    pub fn set_experience(&mut self, experience: Experience) {
        self.experience = experience;
    }

    /// Reads the panel at `corners`, and learns from it.
    ///
    /// # Errors
    /// [`DetectError::ContrastTooLow`] if all pixels look alike, [`DetectError::OutsideMemory`] if the panel's image is not in
    /// the frame or does not fit into `PIXELS`.
    pub fn detect(
        &mut self,
        frame: &Frame<'_>,
        corners: &Corners,
    ) -> Result<Detection, DetectError> {
        self.detect_after(&SoftPanel::ERASED, frame, corners)
    }

    /// The same where something is known of the symbol `before`, which the exposure may have caught the end of: what it
    /// then shows of the next one can be told apart.
    ///
    /// # Errors
    /// As [`Self::detect`].
    // Not inlined: the stack of those who read panels otherwise stays as it is.
    #[inline(never)]
    pub fn detect_after(
        &mut self,
        before: &SoftPanel,
        frame: &Frame<'_>,
        corners: &Corners,
    ) -> Result<Detection, DetectError> {
        let view = View::new(frame, corners, PIXELS);
        let mut best = self.search(frame, &view, self.experience)?;
        if !self.experience.fits(best.levels.noise) {
            let two = self.two_symbols(frame, &view, before)?;
            if let Some(two) =
                two.filter(|two| two.explain(&self.experience, before, best.levels.noise))
            {
                return Ok(two.detection());
            }
            let anew = self.search(frame, &view, Experience::NONE)?;
            if anew.levels.noise < best.levels.noise {
                best = anew;
            }
        }
        let odds = self.climb_in_groups(&mut best);
        let found = best.bits();
        let bits = bits_where(|led| found.led(led) != (odds[led] < 0.0));
        let llr = core::array::from_fn(|led| {
            if found.led(led) {
                odds[led]
            } else {
                -odds[led]
            }
        });
        let least = odds.iter().copied().fold(f32::INFINITY, f32::min);
        let mixed = !self.experience.fits(best.levels.noise) && least < MIXED;
        let sure = odds.iter().sum::<f32>() >= LEARN_LLR * LEDS as f32;
        if sure && (LEARN_LEDS..=LEDS as u32 - LEARN_LEDS).contains(&bits.count_on()) {
            self.learn(&best);
        }
        Ok(Detection {
            mixed: mixed.then_some(Mixture::INSEPARABLE),
            ..Detection::new(bits, llr)
        })
    }

    fn learn(&mut self, solution: &Solution) {
        self.expect(solution);
        let Solution { levels, share, .. } = solution;
        let equations = Equations::of(&self.image, &self.spots, share, levels, &self.experience);
        if let Some(unsure) = equations.covariance(levels.noise) {
            self.experience.learn(levels, &unsure);
        }
    }

    /// Bits and levels from scratch, or from what is known of the levels.
    fn search(
        &mut self,
        frame: &Frame<'_>,
        view: &View,
        experience: Experience,
    ) -> Result<Solution, DetectError> {
        let blur = self.camera.blur_sigma_px / view.bin as f32;
        let first = Levels {
            background: 1.0,
            off: 0.0,
            contrast: 0.0,
            // An LED is about half a pitch wide.
            variance: blur * blur + view.pitch * view.pitch / 64.0 + 1.0 / 12.0,
            shift: [0.0; 2],
            noise: FIRST_NOISE,
        };
        let mut levels = experience.levels().unwrap_or(first);
        let squares = self.least_squares(frame, view, &levels)?;
        if !experience.is_sure() {
            squares.split(&mut levels);
            let range_grey = self.contrast_grey(&levels);
            if range_grey < MIN_CONTRAST_GREY {
                return Err(DetectError::ContrastTooLow { range_grey });
            }
        }
        let shrunk = FIRST_CONTRASTS.map(|factor| Levels {
            contrast: factor * levels.contrast,
            ..levels
        });
        let unknown = experience.levels().is_none();
        let shrunk = shrunk.into_iter().filter(|_| unknown);
        let (mut best, mut noise) = (None::<(f32, Solution)>, None);
        for levels in shrunk.chain(experience.starts()) {
            let start = Solution {
                levels,
                share: squares.shares(&levels),
                centre: view.centre,
            };
            let found = self.refine(frame, view, start, experience)?;
            // All are held against the same noise.
            let noise = *noise.get_or_insert(found.levels.noise);
            let loss = self.loss(&found.levels, &experience, noise);
            if best.is_none_or(|(least, _)| loss < least) {
                best = Some((loss, found));
            }
        }
        best.map(|(_, best)| best)
            .ok_or(DetectError::ContrastTooLow { range_grey: 0.0 })
    }

    /// The light of each LED by least squares, where the panel is expected.
    fn least_squares(
        &mut self,
        frame: &Frame<'_>,
        view: &View,
        levels: &Levels,
    ) -> Result<LeastSquares, DetectError> {
        self.load(frame, view, levels.noise)?;
        self.spots.centre = view.centre;
        self.spots
            .place(levels.variance, self.image.size, self.image.stride);
        Ok(LeastSquares::solve(&mut self.image, &self.spots))
    }

    /// The height of an On LED above an Off one, in grey levels, about the background's grey.
    fn contrast_grey(&self, levels: &Levels) -> f32 {
        let background = levels.background.max(f32::MIN_POSITIVE);
        levels.contrast * self.spots.peak() / background * self.curve.grey_of_one()
    }

    /// Interference cancellation, then flips of single LEDs.
    fn refine(
        &mut self,
        frame: &Frame<'_>,
        view: &View,
        start: Solution,
        experience: Experience,
    ) -> Result<Solution, DetectError> {
        let mut solution = start;
        if experience.is_sure() && self.settle_at_once(&mut solution, &experience) {
            return Ok(solution);
        }
        solution = start;
        self.expect_with_noise(&mut solution);
        for _ in 0..FIRST_SWEEPS {
            self.climb(&mut solution).soften();
        }
        for _ in 0..ROUNDS {
            self.fit(&mut solution, &experience);
            let offset = self.offset(solution.levels.noise);
            if (offset - self.image.offset).abs() > OFFSET_STEP * offset {
                self.load(frame, view, solution.levels.noise)?;
                self.expect_with_noise(&mut solution);
            }
            for _ in 0..SWEEPS {
                self.climb(&mut solution).soften();
            }
            if experience.fits_surely(solution.levels.noise) && is_hard(&solution.share) {
                break;
            }
        }
        self.climb(&mut solution).harden();
        self.fit(&mut solution, &experience);
        self.climb(&mut solution).settle();
        self.fit(&mut solution, &experience);
        for _ in 0..GROWN_ROUNDS {
            let odds = self.climb(&mut solution).losses();
            if self.is_clear(&solution, &odds, &experience) || !self.climb(&mut solution).grow() {
                break;
            }
            self.fit(&mut solution, &experience);
            self.climb(&mut solution).settle();
        }
        Ok(solution)
    }

    /// Makes the bits those that least squares call for, and flips single LEDs; whether that explains the frame as well as others were.
    fn settle_at_once(&mut self, solution: &mut Solution, experience: &Experience) -> bool {
        solution.share = solution.share.map(hard);
        self.expect(solution);
        self.fit(solution, experience);
        self.climb(solution).settle();
        self.fit(solution, experience);
        experience.fits_surely(solution.levels.noise)
    }

    /// Flips groups as long as that helps; what each LED's flip costs in the end, in nats.
    fn climb_in_groups(&mut self, solution: &mut Solution) -> [f32; LEDS] {
        let experience = self.experience;
        self.expect(solution);
        let mut odds = self.climb(solution).losses();
        if self.is_clear(solution, &odds, &experience) {
            return odds;
        }
        self.fit(solution, &experience);
        for _ in 0..GROUP_ROUNDS {
            let Some(pull) = Equations::and_pull(
                &self.image,
                &self.spots,
                &solution.share,
                &solution.levels,
                &experience,
            ) else {
                break;
            };
            let risen = if self.image.glares() {
                self.try_groups(solution, &pull, &experience, &mut odds)
            } else {
                self.try_ways(solution, &pull, &experience, &mut odds)
            };
            if !risen {
                break;
            }
        }
        odds
    }

    /// Flips the group of LEDs that gains most, if any does; the odds against each LED's flip where none does.
    fn try_groups(
        &mut self,
        solution: &mut Solution,
        pull: &Pull,
        experience: &Experience,
        odds: &mut [f32; LEDS],
    ) -> bool {
        let mut climb = Climb {
            image: &mut self.image,
            spots: &self.spots,
            levels: &solution.levels,
            share: &mut solution.share,
        };
        climb.couple_by_flips(pull, &mut self.couplings);
        let mut groups = self.couplings.groups();
        *odds = groups.map(|group| (-group.gain).max(0.0));
        groups.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain));
        self.take_best(solution, &mut groups[..TRIES], experience)
    }

    /// The same where all pixels are linear in the bits: of all ways to flip any number of LEDs.
    fn try_ways(
        &mut self,
        solution: &mut Solution,
        pull: &Pull,
        experience: &Experience,
        odds: &mut [f32; LEDS],
    ) -> bool {
        let climb = Climb {
            image: &mut self.image,
            spots: &self.spots,
            levels: &solution.levels,
            share: &mut solution.share,
        };
        climb.couple(pull, &mut self.couplings);
        *odds = climb.losses();
        let Some(mut ways) = sphere::search(&mut self.couplings) else {
            return false;
        };
        let ways_to_try = ways.as_mut_slice();
        let tries = TRIES.min(ways_to_try.len());
        let risen = self.take_best(solution, &mut ways_to_try[..tries], experience);
        for (odds, found) in odds.iter_mut().zip(ways.odds()) {
            *odds = found.unwrap_or(*odds);
        }
        risen
    }

    /// Flips whichever of `ways` raises the likelihood most; false where none does. Their gains become what they really are, where they
    /// promised any.
    fn take_best(
        &mut self,
        solution: &mut Solution,
        ways: &mut [Way],
        experience: &Experience,
    ) -> bool {
        let before = *solution;
        let mut best = LEAST_GAIN;
        for way in ways.iter_mut().filter(|way| way.gain > LEAST_GAIN) {
            let mut tried = before;
            self.expect(&tried);
            way.gain = self.gain_of(&mut tried, way.flips, experience);
            if way.gain > best {
                (best, *solution) = (way.gain, tried);
            }
        }
        self.expect(solution);
        best > LEAST_GAIN
    }

    /// Whether the frame fits what was seen before, and no bit is anywhere near a doubt, alone or in a group.
    fn is_clear(&self, solution: &Solution, odds: &[f32; LEDS], experience: &Experience) -> bool {
        let least = odds.iter().copied().fold(f32::INFINITY, f32::min);
        experience.fits_surely(solution.levels.noise) && least * self.spots.independence() > CLEAR
    }

    /// Flips LEDs, refits the levels and flips single LEDs back or others with them; by how much the likelihood rises.
    fn gain_of(&mut self, solution: &mut Solution, flips: u64, experience: &Experience) -> f32 {
        let before = *solution;
        let noise = before.levels.noise;
        let loss_before = self.loss(&before.levels, experience, noise);
        for led in (0..LEDS).filter(|led| flips >> led & 1 == 1) {
            self.climb(solution).flip(led);
        }
        self.fit(solution, experience);
        self.climb(solution).settle();
        self.fit(solution, experience);
        loss_before - self.loss(&solution.levels, experience, noise)
    }

    /// The negative log-likelihood of pixels and levels.
    fn loss(&self, levels: &Levels, experience: &Experience, noise: f32) -> f32 {
        self.image.loss(noise) + experience.loss(levels)
    }

    fn climb<'a>(&'a mut self, solution: &'a mut Solution) -> Climb<'a, PIXELS> {
        Climb {
            image: &mut self.image,
            spots: &self.spots,
            levels: &solution.levels,
            share: &mut solution.share,
        }
    }

    /// One step of the fit of the levels; nothing where the pixels do not determine them.
    fn fit(&mut self, solution: &mut Solution, experience: &Experience) {
        let equations = Equations::of(
            &self.image,
            &self.spots,
            &solution.share,
            &solution.levels,
            experience,
        );
        equations.step(&mut solution.levels);
        self.expect_with_noise(solution);
    }

    /// Makes the image hold what is expected of a solution.
    fn expect(&mut self, solution: &Solution) {
        let levels = &solution.levels;
        let [dx, dy] = levels.shift;
        self.spots.centre = solution.centre.map(|[x, y]| [x + dx, y + dy]);
        self.spots
            .place(levels.variance, self.image.size, self.image.stride);
        self.image.expect(
            &self.spots,
            levels.background,
            &levels.light(&solution.share),
        );
    }

    /// The same, and what the image leaves becomes the solution's noise.
    fn expect_with_noise(&mut self, solution: &mut Solution) {
        self.expect(solution);
        solution.levels.noise = self.noise();
    }

    fn noise(&self) -> f32 {
        self.image
            .mean_square(FITTED)
            .max(self.curve.rounding_variance())
    }

    fn load(&mut self, frame: &Frame<'_>, view: &View, noise: f32) -> Result<(), DetectError> {
        let offset = self.offset(noise);
        let fits = self
            .image
            .load(frame, view.window, view.bin, &self.curve, offset);
        fits.then_some(()).ok_or(DetectError::OutsideMemory {
            width: view.window.width / view.bin,
            height: view.window.height / view.bin,
            capacity: PIXELS,
        })
    }

    /// What is added to light under the root: 3/8 electron and the read noise's variance (Murtagh et al. 1995), at the
    /// electrons that make the noise.
    fn offset(&self, noise: f32) -> f32 {
        let light_of_an_electron = 4.0 * (noise - self.curve.rounding_variance());
        let [least, most] = OFFSET_RANGE;
        (light_of_an_electron * (0.375 + self.camera.read_noise_e * self.camera.read_noise_e))
            .clamp(least, most)
    }
}

impl Solution {
    fn bits(&self) -> PanelFrame {
        bits_where(|led| self.share[led] > 0.5)
    }
}

/// On or Off, whichever is nearer.
fn hard(share: f32) -> f32 {
    if share > 0.5 { 1.0 } else { 0.0 }
}

fn is_hard(share: &[f32; LEDS]) -> bool {
    share.iter().all(|share| share.min(1.0 - share) < HARD)
}

#[cfg(test)]
mod tests;
