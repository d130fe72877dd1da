//! Search: finding panels in whole frames.
//!
//! 1. `survey`: one pass over the frame finds busy places and, with an earlier frame, places that have changed.
//! 2. `blob`: the size of the object there.
//! 3. `pose_candidates`: the poses with the greatest `evidence` around it. One convolution of the patch (`patch`) gives the evidence of 64
//!    spots of any brightness, so hundreds of poses can be tried; `hill_climbing` finds the maxima, with spots of a few widths.
//! 4. `verification`: 64 spots of two brightnesses and of any width are fitted to the pixels in linear light. They must explain the light,
//!    end on all four sides, and show a pattern as random as a scrambled message; otherwise the error names the failed criterion. In a
//!    single frame nothing like these LEDs may lie beyond them on the same lattice.
//!
//! `confirmation` applies steps 3 and 4 at one given place of a single frame.
//!
//! A single frame is first searched for isolated spots only ([`Effort::Spots`]), which takes a twentieth of the time and finds most panels.
//! The full search follows.
//!
//! The difference of two frames contains nothing that stands still, so steps 2 to 4 do not depend on the background. In a single frame step
//! 3 works on the patch without its smooth part, and again without edges (`patch`), for bright or for dark spots; step 4 looks only at
//! pixels within the lattice's own outline. So neither a board nor its surroundings count. If shadows fall across the board, step 4 is
//! repeated without the light between the LEDs; places with small bright spots are searched before merely busy ones. Microcontrollers do
//! neither.
//!
//! The locator needs the sensor's encoding; a configured blur is only its starting point. It does not find panels without a pattern, such
//! as all On. Panels of more than 110 px are searched in larger pixels ([`crate::receiver::FrameSearch`]), in perspective.

mod bimodality;
mod blob;
mod confirmation;
mod constellation;
mod error;
mod evidence;
mod hill_climbing;
mod memory;
mod patch;
mod pose_candidates;
mod survey;
mod suspects;
mod verification;

pub use error::LocateError;
pub use memory::{LocatorMemory, SearchMemory};

use crate::coarse::Grid;
use crate::corners::Corners;
use crate::detect::bits_where;
use crate::frame::Frame;
use crate::lattice::Lattice;
use crate::profile::{Profile, Stage};
use crate::settings::{SearchSettings, SettingError};
use crate::spots::{GreyMetric, LatticeModel, MEASURES_SHADE, PIXEL_VARIANCE, Residuals};
use blob::{Blob, SIDE_PX};
use core::ops::{Range, RangeInclusive};
use link::camera::{Camera, CameraError};
use link::panel::PanelFrame;
pub(crate) use memory::Workspace;
use pose_candidates::{Ground, POSE_CANDIDATES, Scope, SharpPose, Trial, View};
use survey::{Peak, Survey};
use suspects::Suspect;
pub(crate) use suspects::Suspects;
pub use verification::LEAST_PITCH_PX;
use verification::VerifiedLattice;
pub(crate) use verification::{is_random, may_be_shown};

/// Changed peaks tried in a frame, at most (count). More: slower, and panels among much motion are found.
const CHANGED_PEAKS: usize = 4;
/// Busy peaks kept of a frame, at most (count). More: a full search can find panels among more clutter, and takes more memory.
pub const BUSY_PEAKS: usize = if cfg!(feature = "large-frames") { 96 } else { USUAL_PEAKS };
/// Peaks that a search for isolated spots visits, and that the frames of a film take turns at (count). More: slower, and panels among much
/// clutter are found.
const USUAL_PEAKS: usize = 24;
/// The assumed extent of an LED, before any estimate (px, standard deviation).
const LED_SIGMA_PX: f32 = 0.6;
/// The least noise, by rounding (grey).
const LEAST_NOISE_GREY: f32 = 0.3;
/// Columns and rows around a known panel that are excluded from the search (pitches, from the first LED on).
const KNOWN: RangeInclusive<f64> = -3.0..=10.0;
/// A change fainter than this needs a second sighting in another search (amplitude ratio), because moving things may look like a panel
/// once.
const FAINT: f32 = 55.0;
/// The same while the camera moves (amplitude ratio), because edges that move may look like anything.
const FAINT_IN_MOTION: f32 = 200.0;
/// Factor on both for spots of an unexpected width, because some width fits any edge that moves.
const UNEXPECTED: f32 = 2.5;
/// The range of expected widths, relative to the narrowest and to the widest LED under the configured blur (ratio).
const EXPECTED_WIDTH: (f32, f32) = (0.88, 1.15);
/// The pitch over the diameter of the widest LEDs (ratio): they fill two thirds of it.
const PITCH_OVER_LED: f32 = 1.5;
/// The camera has moved if half of the frame changes by more than this many times its noise (factor) plus this (grey).
const IN_MOTION: (f32, f32) = (1.5, 0.5);
/// Busy places searched in every frame (count), besides one more that changes from frame to frame.
const ALWAYS: usize = 2;
/// The interval of frames that are searched for dark LEDs on a white board instead of bright ones (frames).
const HOLES_EVERY: u64 = 4;
/// The side of the largest panel on a level (larger px): that of the smallest on the next level, and a quarter more. Larger: slower;
/// smaller: panels fall between two levels.
const LEVEL_SIDE_MAX_PX: f32 = 70.0;
/// Sides of panels for the search of isolated spots around each place (px): together they resolve pitches of 3 to 20 px. More: slower,
/// and panels of other sizes are found in this way.
const SPOTS_SIDES_PX: [f32; 3] = [40.0, 80.0, 120.0];
/// Poses tried in a frame after failed searches, at changed and at busy places (count). More: new panels are found sooner, and each frame
/// takes longer.
const SPARE_POSES: [u32; 2] = [1, 2];
/// Frames of a cycle through the poses of a place (count): two poses for each of its up to four sizes.
const SPARE_TURNS: u64 = 8;

/// After failed searches, one pair of frames in this many is searched for panels that the next level shows as well (count). More: faster.
const LARGE_EVERY: u64 = 5;

/// Finds panels in frames.
///
/// ```
/// use link::camera::Camera;
/// use rx_pipeline::{frame::Frame, locate::{LocateError, Locator, LocatorMemory}};
/// let locator = Locator::new(Camera::default())?;
/// let mut memory = Box::new(LocatorMemory::<4096>::new());
/// let plain = [118; 64 * 64];
/// let nothing = locator.locate(&Frame::new(&plain, 64, 64)?, &mut memory);
/// assert_eq!(nothing, Err(LocateError::NothingStandsOut));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Locator {
    metric: GreyMetric,
    blur_sigma_px: f32,
    /// Whether it searches for panels so near that perspective is visible.
    is_near: bool,
    settings: SearchSettings,
}

/// A located panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// The centres of the corner LEDs.
    pub corners: Corners,
    /// Root mean square difference between the frame and the fitted spots, in grey levels.
    pub residual_grey: f32,
    /// Standard deviation of the noise of a pixel, in grey levels.
    pub noise_grey: f32,
    /// Amplitude of all LEDs together over the noise of a pixel.
    pub signal_to_noise: f32,
    /// Residual over allowed residual (ratio of variances).
    pub(crate) misfit: f32,
    /// Standard deviation of one LED's image, in pixels: its own extent, the blur and the pixel together.
    pub spot_sigma_px: f32,
    pub(crate) spots: LatticeModel,
    /// Whether only the area within its own outline was used.
    pub(crate) is_amid_clutter: bool,
}

impl Location {
    /// The states of the fitted LEDs: in a single frame their bits.
    pub fn states(&self) -> PanelFrame {
        bits_where(|led| self.spots.state[led] > 0.5)
    }

    /// Converts a panel from the pixels of a grid to those of the camera's frame.
    pub(crate) fn in_frame(&self, grid: &Grid) -> Result<Self, LocateError> {
        let spots = grid.spots_to_frame(&self.spots);
        Ok(Self {
            corners: grid.corners_to_frame(&self.corners)?,
            spot_sigma_px: spots.sigma,
            spots,
            ..*self
        })
    }
}

/// The part of a frame to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Isolated spots only, whatever surrounds them: cheap, and enough for most single frames.
    Spots,
    /// All changed peaks and the busiest places, as many as [`SearchSettings::full_places`]: for single frames.
    Full,
    /// The highest peaks, and one other place in each frame: pass a number that counts the frames.
    Share(u64),
    /// For use after failed searches: earlier suspects, and a few other poses that change from frame to frame.
    Spare(u64),
    /// A share of one level of larger pixels, besides other levels: fewer poses, and only panels for which the next level is too coarse.
    Level(u64),
    /// The highest changed peak alone, if it is above the noise and the camera at rest: for a level whose turn it is not.
    Changes,
}

impl Effort {
    fn budget(self, share: u16, spare: u32) -> u32 {
        match self {
            Self::Spots | Self::Full => u32::MAX,
            Self::Share(_) => share.into(),
            Self::Spare(_) => spare.min(share.into()),
            Self::Level(_) | Self::Changes => 1,
        }
    }

    /// Whether suspects are tried first at their old place, if the camera is at rest.
    fn looks_again(self) -> bool {
        matches!(self, Self::Spare(_))
    }

    /// The part of `places` changed places to search, and the turn of their poses if not all are tried. `turns` counts the frames with
    /// changed places, because a count of all frames would meet a panel that changes with every second one at every second turn only.
    fn changed(self, places: usize, in_motion: bool, turns: &mut u64) -> (Range<usize>, Option<usize>) {
        match self {
            Self::Changes => return (0..places.min(1), None),
            Self::Spare(_) if places > 0 => {}
            _ => return (0..places, None),
        }
        *turns = turns.wrapping_add(1);
        // In motion, changes are everywhere and seldom a panel's.
        let (turn, is_due) = if in_motion {
            (*turns / 2, turns.is_multiple_of(2))
        } else {
            (*turns, true)
        };
        if !is_due {
            return (0..0, None);
        }
        let places = places as u64;
        let place = (turn % places) as usize;
        (place..place + 1, Some((turn / places % SPARE_TURNS) as usize))
    }

    /// Selects busy places, by their ranks, and the grounds to subtract there. `places` bounds a full search.
    fn busy(self, places: usize) -> (impl Fn(usize, Ground) -> bool, &'static [Ground]) {
        let another = |number: u64| ALWAYS + (number % (USUAL_PEAKS - ALWAYS) as u64) as usize;
        let grounds = match self {
            Self::Spots | Self::Changes => &[][..],
            Self::Full => &[Ground::Around, Ground::Edges, Ground::Smooth, Ground::Holes],
            Self::Share(number) if number % HOLES_EVERY == HOLES_EVERY - 1 => &[Ground::Around, Ground::Holes],
            Self::Share(_) => &[Ground::Around, Ground::Edges],
            Self::Spare(number) => match number % 4 {
                0 | 2 => &[Ground::Edges],
                1 => &[Ground::Around],
                _ => &[Ground::Holes],
            },
            Self::Level(_) => &[Ground::Around],
        };
        let chosen = move |rank: usize, ground: Ground| match self {
            Self::Spots | Self::Changes => true,
            Self::Full => rank < ground.places(places),
            Self::Share(number) | Self::Level(number) => rank < ALWAYS || rank == another(number),
            // In eight frames each of the highest peaks is tried with each ground.
            Self::Spare(number) => rank == ((number / 2 + number / 4) % ALWAYS as u64) as usize || rank == another(number / 4),
        };
        (chosen, grounds)
    }

    /// Poses tried at a busy place, at most.
    fn poses_of_a_place(self) -> u32 {
        if matches!(self, Self::Spare(_)) { 1 } else { u32::MAX }
    }

    /// The sides of the panels among isolated spots around each place, in pixels: in a film one in each frame.
    fn spots_sides_px(self) -> &'static [f32] {
        match self {
            Self::Spots | Self::Full => &SPOTS_SIDES_PX,
            Self::Share(number) | Self::Spare(number) => {
                let side = (number % SPOTS_SIDES_PX.len() as u64) as usize;
                &SPOTS_SIDES_PX[side..=side]
            }
            Self::Level(_) | Self::Changes => &[],
        }
    }

    /// The side of the largest panel in the search, in pixels.
    fn largest_px(self) -> f32 {
        match self {
            Self::Level(_) | Self::Changes => LEVEL_SIDE_MAX_PX,
            Self::Spare(number) if !(number / 2).is_multiple_of(LARGE_EVERY) => LEVEL_SIDE_MAX_PX,
            _ => *SIDE_PX.end(),
        }
    }
}

impl Locator {
    /// A locator for frames of `camera`.
    ///
    /// # Errors
    /// [`CameraError`] if a property of the camera is out of its range.
    pub fn new(camera: Camera) -> Result<Self, CameraError> {
        let camera = camera.checked()?;
        Ok(Self {
            metric: GreyMetric::new(&camera),
            blur_sigma_px: camera.blur_sigma_px,
            is_near: false,
            settings: SearchSettings::DEFAULT,
        })
    }

    /// Replaces the settings.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of its range.
    pub fn with_settings(self, settings: SearchSettings) -> Result<Self, SettingError> {
        settings.validate()?;
        Ok(Self { settings, ..self })
    }

    /// The initial standard deviation of one LED's image, in pixels.
    pub(crate) fn spot_sigma_px(&self) -> f32 {
        libm::sqrtf(self.blur_sigma_px * self.blur_sigma_px + LED_SIGMA_PX * LED_SIGMA_PX + PIXEL_VARIANCE)
    }

    /// The same locator in other pixels of the camera's frames.
    pub(crate) fn seen_in(&self, grid: &Grid) -> Self {
        Self {
            blur_sigma_px: grid.blur_from_frame(self.blur_sigma_px),
            is_near: grid.side > 1,
            ..self.clone()
        }
    }

    pub(crate) fn metric(&self) -> &GreyMetric {
        &self.metric
    }

    /// The most conspicuous panel in a single frame: that at the highest peak that shows one.
    ///
    /// # Errors
    /// The first [`LocateError`] of the peaks, from the highest on; without peaks, [`LocateError::NothingStandsOut`].
    pub fn locate<const N: usize>(&self, frame: &Frame<'_>, memory: &mut LocatorMemory<N>) -> Result<Location, LocateError> {
        self.locate_among(frame, &[], &[], Effort::Full, memory, &mut ())
    }

    /// The most conspicuous panel in `frame`, alone or by its change from the `earlier` frames (latest first), other than those `known`.
    /// Earlier frames of another size are ignored.
    ///
    /// # Errors
    /// As [`Locator::locate`].
    pub fn locate_among<const N: usize>(
        &self,
        frame: &Frame<'_>,
        earlier: &[Frame<'_>],
        known: &[Corners],
        effort: Effort,
        memory: &mut LocatorMemory<N>,
        profile: &mut impl Profile,
    ) -> Result<Location, LocateError> {
        let LocatorMemory { residuals, search } = memory;
        let workspace = Workspace { residuals, search };
        self.search(frame, earlier, known, effort, workspace, profile)
    }

    /// The same in separate parts of memory.
    pub(crate) fn search<const N: usize>(
        &self,
        frame: &Frame<'_>,
        earlier: &[Frame<'_>],
        known: &[Corners],
        effort: Effort,
        workspace: Workspace<'_, N>,
        profile: &mut impl Profile,
    ) -> Result<Location, LocateError> {
        let same_size = |other: &&Frame<'_>| (other.width(), other.height()) == (frame.width(), frame.height());
        let Workspace { residuals, search } = workspace;
        let SearchMemory {
            busy,
            spotted,
            changed,
            suspects,
            turns,
        } = search;
        let mut survey = profile.timed(Stage::Survey, || {
            Survey::<BUSY_PEAKS>::of(frame, earlier.iter().find(same_size), busy, spotted.first_mut(), changed)
        });
        let in_motion = survey.noise_of_change_grey > IN_MOTION.0 * survey.noise_grey + IN_MOTION.1;
        let is_clear = survey
            .changed
            .first()
            .is_some_and(|peak| peak.strength > survey.noise_of_change_grey);
        if effort == Effort::Changes && (in_motion || !is_clear) {
            return Err(LocateError::NothingStandsOut);
        }
        // Searches that use no change leave the suspects as they are.
        let suspected = suspects.begin();
        let unknown = |peak: &Peak| known.iter().all(|corners| !near(corners, peak.centre));
        for places in [&mut survey.busy, &mut survey.spotted, &mut survey.changed] {
            places.retain(unknown);
        }
        let mut attempt = Attempt {
            locator: self,
            residuals,
            failure: None,
            places: 0,
            largest_px: effort.largest_px(),
            spots_sides_px: effort.spots_sides_px(),
            turn: None,
            budget: effort.budget(self.settings.changed_poses, SPARE_POSES[0]),
        };
        let enough = if in_motion { FAINT_IN_MOTION } else { FAINT };
        let mut is_faint = false;
        // Returns a panel found by a change if it is certain, and keeps it as a suspect otherwise.
        let mut sure = |found: Location, attempt: &mut Attempt<'_, N>, is_faint: &mut bool| {
            let (suspect, doubt) = self.suspected(&found, enough);
            let doubt = doubt.filter(|_| !suspected.confirm(&suspect, !in_motion));
            let Some(doubt) = doubt else { return Some(found) };
            attempt.failure.get_or_insert(doubt);
            *is_faint |= !suspect.is_misfit;
            suspects.keep(suspect);
            None
        };
        if effort == Effort::Spots {
            let view = View {
                ground: Ground::Edges,
                ..self.view(frame, None, survey.noise_grey)
            };
            let mut places = survey.around(Ground::Edges).iter().take(USUAL_PEAKS);
            let found = profile.timed(Stage::Search, || places.find_map(|peak| attempt.on_spots(peak, view)));
            return found.ok_or_else(|| attempt.failure());
        }
        let change = |before| self.view(frame, Some(before), survey.noise_of_change_grey);
        if effort.looks_again() && !in_motion {
            for suspect in suspected.latest() {
                let seen = earlier.iter().filter(same_size).find_map(|before| {
                    let view = change(before);
                    profile.timed(Stage::Search, || attempt.again(&suspect, view))
                });
                if let Some(found) = seen.and_then(|found| sure(found, &mut attempt, &mut is_faint)) {
                    return Ok(found);
                }
            }
        }
        let (places, turn) = effort.changed(survey.changed.len().min(CHANGED_PEAKS), in_motion, turns);
        for peak in &survey.changed[places] {
            is_faint = false;
            attempt.turn = turn;
            for before in earlier.iter().filter(same_size) {
                let view = change(before);
                let found = profile.timed(Stage::Search, || attempt.at(peak, view));
                if let Some(found) = found.and_then(|found| sure(found, &mut attempt, &mut is_faint)) {
                    return Ok(found);
                }
            }
            // The next frame confirms a suspect sooner than a full search would, but never twice in a row.
            if effort != Effort::Full && !suspected.was_faint() && is_faint && !in_motion {
                return Err(attempt.failure());
            }
        }
        let (chosen, grounds) = effort.busy(self.settings.full_places.into());
        // One budget per ground, because each ground suits other panels.
        let mut budgets = [effort.budget(self.settings.busy_poses, SPARE_POSES[1]); 4];
        attempt.turn = None;
        for rank in 0..BUSY_PEAKS {
            for (&ground, left) in grounds.iter().zip(&mut budgets).filter(|(ground, _)| chosen(rank, **ground)) {
                let Some(peak) = survey.around(ground).get(rank) else {
                    continue;
                };
                let view = View {
                    ground,
                    ..self.view(frame, None, survey.noise_grey)
                };
                let here = effort.poses_of_a_place().min(*left);
                attempt.budget = here;
                if let Some(found) = profile.timed(Stage::Search, || attempt.at(peak, view)) {
                    return Ok(found);
                }
                *left -= here - attempt.budget;
            }
        }
        Err(attempt.failure())
    }

    /// A panel found by a change, as a suspect, and the reason for doubt, if any: a certain one has at least the amplitude ratio `enough`.
    fn suspected(&self, found: &Location, enough: f32) -> (Suspect, Option<LocateError>) {
        // Overlapping spots add up to anything smooth.
        let apart = found.spots.apart();
        let surprise = if self.expects(&found.spots) { 1.0 } else { UNEXPECTED };
        let needed = surprise * enough / (apart * apart);
        let suspect = Suspect::new(found.spots.lattice, found.spots.sigma, found.misfit > 1.0);
        let doubt = if suspect.is_misfit {
            Some(LocateError::GridDoesNotFit {
                residual_grey: found.residual_grey,
                allowed_grey: found.residual_grey / libm::sqrtf(found.misfit),
            })
        } else {
            (found.signal_to_noise < needed || needed.is_nan()).then_some(LocateError::ContrastTooLow {
                signal_to_noise: found.signal_to_noise,
                needed,
            })
        };
        (suspect, doubt)
    }

    /// The likeliest pose, in `frame` alone, of a panel with the size and rotation of `expected`, at most about a panel's width away.
    pub(crate) fn locate_near(&self, frame: &Frame<'_>, expected: &Lattice, spot_sigma_px: f32) -> Option<Lattice> {
        let view = View {
            spot_sigma_px,
            ..self.view(frame, None, 0.0)
        };
        view.near(expected)
    }

    /// Whether spots have the width of LEDs under the configured blur.
    fn expects(&self, spots: &LatticeModel) -> bool {
        let [across, down] = spots.lattice.pitch();
        // A disc's variance along an axis is a sixteenth of the square of its diameter.
        let widest_disc = across.max(down) / PITCH_OVER_LED / 4.0;
        let told = self.spot_sigma_px();
        let widest = libm::sqrtf(told * told + widest_disc * widest_disc);
        (EXPECTED_WIDTH.0 * told..=EXPECTED_WIDTH.1 * widest).contains(&spots.sigma)
    }

    fn view<'a, 'f>(&self, frame: &'a Frame<'f>, earlier: Option<&'a Frame<'f>>, noise_grey: f32) -> View<'a, 'f> {
        View {
            frame,
            earlier,
            noise_grey: noise_grey.max(LEAST_NOISE_GREY),
            spot_sigma_px: self.spot_sigma_px(),
            ground: Ground::Around,
            is_near: self.is_near,
        }
    }
}

/// Whether a position is within a panel's outline or close to it.
fn near(corners: &Corners, [x, y]: [f32; 2]) -> bool {
    let [column, row] = corners.homography().to_panel([x.into(), y.into()]);
    KNOWN.contains(&column) && KNOWN.contains(&row)
}

impl Survey<BUSY_PEAKS> {
    /// The places to search with that ground.
    fn around(&self, ground: Ground) -> &[Peak] {
        match ground {
            Ground::Edges if cfg!(feature = "surroundings") => &self.spotted,
            _ => &self.busy,
        }
    }
}

/// A search in progress, and the first reason of its failure so far.
struct Attempt<'a, const N: usize> {
    locator: &'a Locator,
    residuals: &'a mut Residuals<N>,
    failure: Option<LocateError>,
    places: usize,
    largest_px: f32,
    /// The sides of panels among isolated spots, besides those of blobs (px).
    spots_sides_px: &'static [f32],
    /// The turn of poses at a place: the likeliest one of each size, then the next ones. `None`: all of one size, then all of the next.
    turn: Option<usize>,
    /// Poses left to try.
    budget: u32,
}

impl<'a, const N: usize> Attempt<'a, N> {
    /// A search without a bound, at a single place.
    fn single(locator: &'a Locator, residuals: &'a mut Residuals<N>) -> Self {
        Self {
            locator,
            residuals,
            failure: None,
            places: 1,
            largest_px: f32::INFINITY,
            spots_sides_px: &SPOTS_SIDES_PX,
            turn: None,
            budget: u32::MAX,
        }
    }

    fn failure(&self) -> LocateError {
        let places = self.places;
        self.failure.unwrap_or(match places {
            0 => LocateError::NothingStandsOut,
            _ => LocateError::NoCandidate { places },
        })
    }

    fn at(&mut self, peak: &Peak, view: View<'_, '_>) -> Option<Location> {
        self.places += 1;
        if self.budget == 0 {
            return None;
        }
        let mut best = Best::default();
        let mut blobs = Blob::around(peak, view.frame, view.earlier);
        blobs.retain(|blob| blob.side_px <= self.largest_px && view.resolves(blob));
        if view.leaves_only_spots() {
            let lattices = self.patches_of_spots(peak, &blobs).filter_map(|blob| view.on_spots(&blob));
            if let Some(found) = self.among(lattices, &view, &mut best) {
                return Some(found);
            }
        }
        let (blobs, passed_over) = match (self.turn, blobs.len()) {
            (None, _) | (_, 0) => (&blobs[..], 0),
            (Some(turn), sizes) => (&blobs[turn % sizes..][..1], turn / sizes),
        };
        for &blob in blobs {
            if self.budget == 0 || best.fits() {
                break;
            }
            if let Some(found) = self.among(view.pose_candidates(blob).skip(passed_over), &view, &mut best) {
                return Some(found);
            }
        }
        self.failure = self.failure.or(best.failure);
        best.verified.map(|verified| verified.location())
    }

    /// The patches in which to search for isolated spots: a few sizes around a place, and its blobs.
    fn patches_of_spots<'b>(&self, peak: &Peak, blobs: &'b [Blob]) -> impl Iterator<Item = Blob> + use<'b, N> {
        let centre = peak.centre;
        let sizes = self.spots_sides_px.iter().map(move |&side_px| Blob { centre, side_px });
        sizes.chain(blobs.iter().copied())
    }

    /// A panel beyond doubt among candidates for its pose; keeps the best of the others.
    fn among(&mut self, mut candidates: impl Iterator<Item = Lattice>, view: &View<'_, '_>, best: &mut Best) -> Option<Location> {
        let mut starts = heapless::Vec::<Lattice, { POSE_CANDIDATES + 1 }>::new();
        let mut tried = heapless::Vec::<_, { 2 * POSE_CANDIDATES }>::new();
        while self.budget > 0
            && let Some(candidate) = candidates.next()
        {
            if starts.iter().any(|start| candidate.is_close_to(start)) {
                continue;
            }
            let _full = starts.push(candidate);
            self.budget -= 1;
            for Trial { widths_px, scope } in view.trials(&candidate) {
                let Some(pose) = view.promising(&candidate, &widths_px, scope) else {
                    continue;
                };
                let same = |(other, scope_of_other): &(Lattice, Scope)| scope == *scope_of_other && pose.lattice.is_close_to(other);
                if tried.iter().any(same) {
                    continue;
                }
                let _full = tried.push((pose.lattice, scope));
                match self.verified(view, scope, &pose) {
                    Ok(verified) if verified.is_beyond_doubt() => {
                        return Some(verified.location());
                    }
                    // A pose that passes may still be the second best.
                    Ok(verified) => {
                        let fits = verified.fits();
                        best.offer(verified);
                        if fits {
                            break;
                        }
                    }
                    Err(why) => {
                        best.failure.get_or_insert(why);
                    }
                }
            }
        }
        None
    }

    /// A clear panel on the lattice of the spots around a place: in its blobs, or in patches of a few sizes.
    fn on_spots(&mut self, peak: &Peak, view: View<'_, '_>) -> Option<Location> {
        self.places += 1;
        let mut blobs = Blob::around(peak, view.frame, None);
        blobs.retain(|blob| view.resolves(blob));
        for candidate in self.patches_of_spots(peak, &blobs).filter_map(|blob| view.on_spots(&blob)) {
            for Trial { widths_px, scope } in view.trials(&candidate) {
                let pose = view.sharpened(&candidate, &widths_px, view.least_share());
                match pose.and_then(|pose| self.verified(&view, scope, &pose).ok()) {
                    Some(verified) if verified.is_clear() => return Some(verified.location()),
                    _ => {}
                }
            }
        }
        None
    }

    /// A suspect at its old place.
    fn again(&mut self, suspect: &Suspect, view: View<'_, '_>) -> Option<Location> {
        let pose = view.promising(&suspect.lattice, &[suspect.spot_sigma_px()], Scope::Change)?;
        let verified = self.verified(&view, Scope::Change, &pose).ok()?;
        Some(verified.location())
    }

    /// Verifies a pose in that scope. If only its surroundings may have failed it, verifies it within the panel's own outline, and if only
    /// shadows on the board may have, without these.
    fn verified(&mut self, view: &View<'_, '_>, scope: Scope, pose: &SharpPose) -> Result<VerifiedLattice, LocateError> {
        let mut verify = |scope| verification::verify(self.residuals, view, self.locator, scope, pose);
        match verify(scope) {
            Err(why) if scope == Scope::Ground && why.may_be_of_the_surroundings() => verify(Scope::Board).map_err(|_| why),
            Err(why) if MEASURES_SHADE && scope == Scope::Board && why.may_be_of_shadows() && pose.may_be_shaded() => {
                verify(Scope::ShadedBoard).map_err(|_| why)
            }
            verified => verified,
        }
    }
}

/// The best panel of a place, and the first reason why a pose is not a panel.
#[derive(Default)]
struct Best {
    verified: Option<VerifiedLattice>,
    failure: Option<LocateError>,
}

impl Best {
    fn offer(&mut self, verified: VerifiedLattice) {
        if self.verified.as_ref().is_none_or(|best| verified.is_better_than(best)) {
            self.verified = Some(verified);
        }
    }

    fn fits(&self) -> bool {
        self.verified.as_ref().is_some_and(VerifiedLattice::fits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::scramble::split_mix64;
    use std::boxed::Box;
    use std::vec::Vec;

    const SIDE: usize = 128;
    const BITS: u64 = 0x9a3c_5e71_0f96_c3a5;
    const TRUTH: Lattice = Lattice {
        centre: [63.4, 62.8],
        column: [4.8, 0.5],
        row: [-0.5, 5.0],
        tilt: [0.0; 2],
    };

    /// A panel with a board that ends one and a half pitches beyond the LEDs, between a bright wall and a dark one: light of the board, and
    /// light of Off and On LEDs relative to it.
    fn before_two_walls(board_light: f32, [off, on]: [f32; 2], blur_sigma_px: f32) -> Vec<u8> {
        let light = |i: usize| {
            let at = [(i % SIDE) as f32, (i / SIDE) as f32];
            let [column, row] = TRUTH.coordinates(at).unwrap();
            let board = [column, row].iter().all(|c| (-1.5..8.5).contains(c));
            let mut light = match board {
                true => board_light,
                false if at[0] > 75.0 => 2.5,
                false => 0.8,
            };
            for led in 0..64 {
                let [x, y] = TRUTH.position((led % 8) as f32, (led / 8) as f32);
                let squared = (at[0] - x) * (at[0] - x) + (at[1] - y) * (at[1] - y);
                let height = if BITS >> led & 1 == 1 { on } else { off };
                let variance = blur_sigma_px * blur_sigma_px + 0.4;
                light += height * (-0.5 * squared / variance).exp();
            }
            light
        };
        (0..SIDE * SIDE).map(|i| (118.0 * light(i).powf(1.0 / 2.2)).round() as u8).collect()
    }

    #[test]
    fn each_changed_place_and_pose_has_its_turn_at_any_symbol_rate() {
        for frames_per_symbol in 1..=8 {
            let mut turns = 0;
            let mut met = std::collections::BTreeSet::new();
            for frame in 0..frames_per_symbol * CHANGED_PEAKS as u64 * SPARE_TURNS {
                let changed = if frame.is_multiple_of(frames_per_symbol) {
                    CHANGED_PEAKS
                } else {
                    0
                };
                let (places, turn) = Effort::Spare(frame).changed(changed, false, &mut turns);
                met.extend(turn.map(|turn| (places.start, turn)));
            }
            assert_eq!(met.len(), CHANGED_PEAKS * SPARE_TURNS as usize, "{frames_per_symbol}");
        }
    }

    #[test]
    fn boards_are_found_from_one_frame_under_any_blur() {
        for blur_sigma_px in [0.7, 1.0, 1.5] {
            expect_found(&before_two_walls(0.3, [0.2, 3.0], blur_sigma_px));
        }
    }

    /// On LEDs are hardly brighter than the board, because both are nearly white, and Off LEDs are dark.
    #[test]
    fn white_boards_are_found_by_their_dark_leds() {
        for blur_sigma_px in [0.6, 0.7, 0.8] {
            expect_found(&before_two_walls(4.8, [-3.0, 0.3], blur_sigma_px));
        }
    }

    /// The light of an edge of shadow moves across the panel.
    #[test]
    fn panels_half_in_the_shade_are_found_from_one_frame() {
        let truth = TRUTH.scaled(TRUTH.centre, 1.5);
        for edge_px in [48.0, 55.0, 62.0, 69.0, 76.0] {
            let sunlight = |x: f32| 0.15 + 0.85 / (1.0 + ((edge_px - x) / 0.8).exp());
            let light = |i: usize| {
                let at = [(i % SIDE) as f32, (i / SIDE) as f32];
                let [column, row] = truth.coordinates(at).unwrap();
                let is_board = [column, row].iter().all(|c| (-1.5..8.5).contains(c));
                let mut light = sunlight(at[0]) * if is_board { 0.8 } else { 0.5 };
                for led in 0..64 {
                    let [x, y] = truth.position((led % 8) as f32, (led / 8) as f32);
                    let squared = (at[0] - x) * (at[0] - x) + (at[1] - y) * (at[1] - y);
                    let height = if BITS >> led & 1 == 1 { 2.5 } else { 0.1 };
                    light += height * (-0.5 * squared / 2.4).exp();
                }
                light
            };
            let pixels: Vec<u8> = (0..SIDE * SIDE).map(|i| (118.0 * light(i).powf(1.0 / 2.2)).round() as u8).collect();
            expect_found_on(&truth, &pixels);
        }
    }

    /// A dark board with a lattice of lamps, about half of them On.
    fn lamps(columns: usize, rows: usize, bits: u64, pitch_px: f32) -> Vec<u8> {
        let middle = [columns, rows].map(|lines| 0.5 * (lines - 1) as f32);
        let light = |i: usize| {
            let [x, y] = [i % SIDE, i / SIDE].map(|c| (c as f32 - 63.6) / pitch_px);
            let [column, row] = [x + middle[0], y + middle[1]];
            let (near_column, near_row) = (column.round(), row.round());
            let is_lamp = (0.0..columns as f32).contains(&near_column) && (0.0..rows as f32).contains(&near_row);
            let number = near_row.max(0.0) as u64 * columns as u64 + near_column.max(0.0) as u64;
            let is_on = is_lamp && split_mix64(bits ^ number) & 1 == 1;
            let (u, v) = (column - near_column, row - near_row);
            0.3 + f32::from(is_on) * 3.0 * (-(u * u + v * v) / 0.16).exp()
        };
        (0..SIDE * SIDE).map(|i| (118.0 * light(i).powf(1.0 / 2.2)).round() as u8).collect()
    }

    #[test]
    fn boards_of_more_lamps_are_no_panels() {
        let locator = Locator::new(Camera::default()).unwrap();
        let mut memory = Box::new(LocatorMemory::<25_600>::new());
        let mut seen = |columns, rows, bits, pitch_px| {
            let pixels = lamps(columns, rows, bits, pitch_px);
            locator.locate(&Frame::new(&pixels, SIDE, SIDE).unwrap(), &mut memory).is_ok()
        };
        assert!(seen(8, 8, 1, 5.3));
        for (columns, rows) in [(9, 8), (10, 8), (9, 9), (12, 10), (16, 9)] {
            for bits in 1..=4 {
                assert!(!seen(columns, rows, bits << 32, 5.3), "{columns} × {rows}, {bits}");
            }
        }
    }

    #[test]
    fn a_given_place_is_confirmed_or_corrected() {
        let pixels = before_two_walls(0.3, [0.2, 3.0], 0.7);
        let locator = Locator::new(Camera::default()).unwrap();
        let mut memory = Box::new(LocatorMemory::<25_600>::new());
        let frame = Frame::new(&pixels, SIDE, SIDE).unwrap();
        let mut at = |columns: f32, rows: f32| {
            let corners = [[0.0, 0.0], [7.0, 0.0], [7.0, 7.0], [0.0, 7.0]].map(|[u, v]| TRUTH.position(u + columns, v + rows));
            locator.locate_at(&frame, &Corners::new(corners).unwrap(), &mut memory, &mut [])
        };
        for (columns, rows) in [(0.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.4, 0.3)] {
            let seen = Lattice::through(&at(columns, rows).unwrap().corners);
            assert!(seen.is_close_to(&TRUTH), "{columns} {rows}: {seen:?}");
        }
        assert!(at(20.0, 0.0).is_err());
    }

    /// Merged LEDs among patches of noise that are busier.
    #[test]
    fn panels_beside_busier_things_are_found_at_further_places() {
        const WIDE: usize = 4 * SIDE;
        let panel = before_two_walls(0.3, [0.2, 3.0], 1.5);
        let noise = |i: usize| (split_mix64(i as u64) >> 56) as u8;
        let pixels: Vec<u8> = (0..WIDE * WIDE)
            .map(|i| {
                let (x, y) = (i % WIDE, i / WIDE);
                match (x / SIDE, y / SIDE) {
                    (1, 1) => panel[y % SIDE * SIDE + x % SIDE],
                    _ if x % SIDE < 32 && y % SIDE < 32 => noise(x / 2 + y / 2 * WIDE),
                    _ => 60,
                }
            })
            .collect();
        let frame = Frame::new(&pixels, WIDE, WIDE).unwrap();
        let mut memory = Box::new(LocatorMemory::<25_600>::new());
        let mut found = |full_places| {
            let settings = SearchSettings {
                full_places,
                ..SearchSettings::DEFAULT
            };
            let locator = Locator::new(Camera::default()).unwrap().with_settings(settings).unwrap();
            locator.locate(&frame, &mut memory).map(|found| Lattice::through(&found.corners))
        };
        assert!(found(8).is_err());
        let at = Lattice {
            centre: TRUTH.centre.map(|c| c + SIDE as f32),
            ..TRUTH
        };
        assert!(found(BUSY_PEAKS as u16).is_ok_and(|seen| seen.is_close_to(&at)));
    }

    #[test]
    fn a_full_search_may_examine_all_peaks() {
        let of = |full_places| SearchSettings {
            full_places,
            ..SearchSettings::DEFAULT
        };
        assert_eq!(of(BUSY_PEAKS as u16).validate(), Ok(()));
        assert!(of(BUSY_PEAKS as u16 + 1).validate().is_err());
    }

    #[test]
    fn spots_alone_show_a_panel() {
        let pixels = before_two_walls(0.3, [0.2, 3.0], 0.7);
        let locator = Locator::new(Camera::default()).unwrap();
        let mut memory = Box::new(LocatorMemory::<25_600>::new());
        let frame = Frame::new(&pixels, SIDE, SIDE).unwrap();
        let found = locator.locate_among(&frame, &[], &[], Effort::Spots, &mut memory, &mut ()).unwrap();
        assert!(Lattice::through(&found.corners).is_close_to(&TRUTH), "{found:?}");
    }

    fn expect_found(pixels: &[u8]) {
        expect_found_on(&TRUTH, pixels);
    }

    fn expect_found_on(truth: &Lattice, pixels: &[u8]) {
        let locator = Locator::new(Camera::default()).unwrap();
        let mut memory = Box::new(LocatorMemory::<25_600>::new());
        let frame = Frame::new(pixels, SIDE, SIDE).unwrap();
        let found = locator.locate(&frame, &mut memory).unwrap();
        let seen = Lattice::through(&found.corners);
        assert!(seen.is_close_to(truth), "{seen:?}");
        assert_eq!(found.spots.state, core::array::from_fn(|led| (BITS >> led & 1) as f32));
    }
}
