//! Tracking: following a panel from frame to frame.
//!
//! A track predicts the panel's lattice from its motion. The bits are read there, and the difference between the frame and the image that
//! these bits should give corrects the prediction. A frame costs one look at the pixels of each spot. The quality of the fit shows whether
//! the panel is still there.

use crate::coarse::Grid;
use crate::corners::{Corners, CornersError};
use crate::detect::{DetectError, bits_where};
use crate::fit::{self, LEVELLING};
use crate::lattice::Lattice;
use crate::locate::may_be_shown;
use crate::spots::{LatticeModel, Observation, Outline, Residuals, Slope, Window};
use core::ops::RangeInclusive;
use link::panel::LEDS;

/// Frames that are further apart are unrelated (frames).
const LONGEST_GAP_FRAMES: u64 = 25;
/// α and β of the place: the gains of a frame's correction for the place and for the speed (share). Higher: follows turns sooner, and noise
/// too.
const PLACE_GAINS: [f32; 2] = [0.8, 0.3];
/// α and β of the shape, which changes more slowly (share).
const SHAPE_GAINS: [f32; 2] = [0.6, 0.12];
/// α of the spots' width, which hardly changes from frame to frame (share). The width is fitted with the levels fixed, and the levels with
/// the width fixed, so both explain the same light: with a higher gain, each would correct the other's error.
const WIDTH_GAIN: f32 = 0.1;
/// A larger error of the prediction may have caused wrong bits (pitches). Higher: jumps are followed, some of them one line too far.
const FARTHEST: f32 = 0.3;
/// Room around the lattice (pitches).
pub(crate) const RIM: f32 = 0.6;
/// Minimum light that a panel at its expected place explains, relative to its usual share (share).
const GATE_SHARE: f32 = 0.85;
/// The same minimum at the likeliest place, and for a panel that has been on course: a frame that straddles two symbols explains as little
/// (share).
const GATE_SHARE_LIKELIEST: f32 = 0.5;
/// The same minimum at a place that the surroundings gave, and for bits that no symbol shows: a single bright line explains half of the
/// usual share with some (share).
const GATE_SHARE_PLACED: f32 = 0.7;
/// Minimum light that a panel explains while its usual share is unknown (share of the light there).
const GATE_LEAST: f32 = 0.25;
/// The same minimum at an unexpected place, because clutter also explains part of its own light (share).
const GATE_LEAST_ELSEWHERE: f32 = 0.7;
/// A frame also shows the panel if it leaves a smaller residual per pixel than this (multiple of the usual residual), and explains more
/// than [`SIGNAL_LEAST`]: this is a symbol with few LEDs On. Higher: things that are not a panel are followed.
const LEFT_MOST: f32 = 1.3;
/// Minimum signal per pixel of such a frame (share of the usual signal). Lower: things that are not a panel are followed.
const SIGNAL_LEAST: f32 = 0.3;
/// A panel that has recently been closer to its expected place has not jumped by a line (pitches). Lower: slower if cameras shake.
const ON_COURSE: f32 = 0.1;
/// A panel that has recently been farther, and explains less light than [`LESS_THAN_USUAL`], may be seen halfway between two lines: its
/// neighbourhood is searched too (pitches). Lower: slower if cameras shake.
const NEAR_COURSE: f32 = 0.2;
/// Light that such a panel explains at most (share of its usual light). Higher: slower if cameras shake.
const LESS_THAN_USUAL: f32 = 0.95;
/// The share of the largest recent distance from the expected place that still counts in the next frame. Higher: slower after a jump, and
/// when a panel has just been found.
const ASTRAY_SHARE: f32 = 0.8;
/// A panel that has jumped is moved by a line if the residual there is expected to be smaller than this (share of the residual at the
/// present place). Higher: LEDs that are Off along a side move it.
const LINE_LEFT: f32 = 0.8;
/// A panel that explains less may lie between its lines (share of the light there). Higher: slower before clutter.
#[cfg(feature = "surroundings")]
const BETWEEN_LINES: f32 = 0.7;
/// Minimum drop in the light that a panel explains, since a search confirmed its place, that raises doubts again (share of the light
/// there).
#[cfg(feature = "surroundings")]
const CLEARLY_LESS: f32 = 0.05;
/// Maximum number of frames between two finds that give a speed (count). More: panels that change their direction seem slow.
#[cfg(feature = "surroundings")]
const COMING_FRAMES: u64 = 32;
/// Maximum speed between them (pitches a frame): half the panel's width.
#[cfg(feature = "surroundings")]
const COMING_PITCHES: f32 = 4.0;
/// Maximum difference of their pitches (share). More: two panels count as one.
#[cfg(feature = "surroundings")]
const COMING_GROWTH: f32 = 0.2;
/// Number of frames over which the usual light is averaged (frames).
const MEMORY_FRAMES: f32 = 16.0;
/// Gain of a frame for the wander, which is the distance from the prediction (share). Higher: the camera's shake is known sooner, but less
/// reliably.
const WANDER_GAIN: f32 = 0.3;
/// A panel that wanders less is at its expected place (pitches). Higher: faster, and a jump by a line is noticed later.
const STEADY: f32 = 0.1;
/// Readings of a panel that wanders more are doubted according to its surroundings (pitches). Lower: more reliable, but panels in clutter
/// are doubted without need.
const WANDERING: f32 = 0.25;
/// A moving panel is predicted at its last place if the prediction with its speed errs more than this (ratio of mean squares).
const STILL: f32 = 1.2;
/// Its speed is used throughout a gap if the prediction with its speed errs less than this (ratio of mean squares).
const STEADILY: f32 = 0.25;
/// LEDs with a smaller distance overlap (standard deviations of a spot). The track is then corrected with the bits of maximum likelihood,
/// because those of simpler detectors are too often wrong, and by a fit in several steps, because place, width and levels are correlated.
/// Higher: slower.
const BLURRED: f32 = 2.0;
/// Maximum number of steps in that fit (count). More: slower, and larger corrections are right.
const BLURRED_STEPS: usize = 6;
/// Maximum number of rounds in which levels settle that are wrong by any factor, and places within [`FARTHEST`] (count).
const ROUNDS: usize = 3;
/// The change of the contrast up to which a frame is about as bright as expected (ratio). Wider: places shift when the exposure jumps.
const AS_BRIGHT: RangeInclusive<f32> = 0.5..=2.0;
/// Light from which the fit has settled (share of the light that frames usually explain).
const SETTLED: f32 = 0.9;
/// Damping of the steps (share of the curvature).
const DAMPING: f32 = 0.05;

/// Minimum light that a panel must explain at a place to be accepted there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gate {
    /// Relative to the light that frames usually explain.
    share: f32,
    /// The minimum while the usual light is unknown.
    least: f32,
}

impl Gate {
    /// The gate at the expected place.
    pub const SURE: Self = Self {
        share: GATE_SHARE,
        least: GATE_LEAST,
    };
    /// The gate at the expected place if it is also the likeliest.
    pub const STILL: Self = Self {
        share: GATE_SHARE_LIKELIEST,
        least: GATE_LEAST,
    };
    /// The gate at an unexpected place.
    pub const ELSEWHERE: Self = Self {
        share: GATE_SHARE,
        least: GATE_LEAST_ELSEWHERE,
    };
}

/// Averages over frames that show the panel.
#[derive(Clone, Copy, Debug)]
struct Averages {
    /// Share of the light that the panel explains.
    explained: f32,
    /// Mean square of the explained light per pixel (grey levels squared).
    signal: f32,
    /// Mean square of the residual (grey levels squared).
    left: f32,
}

impl Averages {
    fn of(slope: &Slope) -> Self {
        let pixels = slope.pixels.max(1) as f32;
        Self {
            explained: slope.explained(),
            signal: (slope.total - slope.squares) / pixels,
            left: slope.squares / pixels,
        }
    }

    /// The averages with another frame included.
    fn and(self, other: Self) -> Self {
        let mean = |usual: f32, now: f32| usual + (now - usual) / MEMORY_FRAMES;
        Self {
            explained: mean(self.explained, other.explained),
            signal: mean(self.signal, other.signal),
            left: mean(self.left, other.left),
        }
    }

    /// Whether another frame leaves no larger residual, although its symbol may have fewer LEDs On.
    fn leaves_as_little(self, other: Self) -> bool {
        other.left < LEFT_MOST * self.left && other.signal > SIGNAL_LEAST * self.signal
    }
}

/// The place, motion and brightness of a panel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    spots: LatticeModel,
    /// Change of the lattice per frame.
    speed: Lattice,
    speed_known: bool,
    usual: Option<Averages>,
    /// The largest recent distance from the expected place (pitches); none for a panel whose place was given, because its lines are then
    /// known.
    astray: Option<f32>,
    /// Mean confidence of the bits in the last frames.
    trust: f32,
    /// A panel that usually explains less may lie between its lines (share of the light there).
    #[cfg(feature = "surroundings")]
    little: f32,
    last_seen: u64,
    /// Whether the number of the last frame with the panel is unknown.
    any_number: bool,
    missed: u32,
    /// Recent error of predictions with and without the speed (mean square, pitches squared); 0 until it is seen to wander.
    wander: [f32; 2],
    /// Whether the surroundings are not the board on which the LEDs stand, and therefore do not count.
    is_amid_clutter: bool,
    /// Whether the panel is seen in larger pixels, and so is near enough that its tilt is visible.
    is_near: bool,
    frame_size: (usize, usize),
}

/// Why a frame did not show a followed panel.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TrackError {
    /// The frame does not fit the panel at its place.
    #[error("the panel is not where it should be: the grid explains {explained:.2} of the light there, {needed:.2} is needed")]
    DoesNotFit {
        /// Share of the variance that the fitted spots explain.
        explained: f32,
        /// The minimum share that counts as the panel.
        needed: f32,
    },
    /// The expected place has no distinguishable bits.
    #[error("the panel is not where it should be: {0}")]
    Unreadable(#[from] DetectError),
    /// The panel's motion has changed.
    #[error("the panel is {off_px:.1} px from where it was expected, too far to be sure of its bits")]
    OffCourse {
        /// Distance in pixels.
        off_px: f32,
    },
    /// The panel has left the frame.
    #[error("the panel has left the frame")]
    OutOfFrame,
    /// The outline is no longer a panel's.
    #[error("the panel's shape is lost: {0}")]
    Corners(#[from] CornersError),
}

/// The kind of a track's error, without its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TrackErrorKind {
    /// The panel's motion has changed.
    OffCourse,
    /// The frame does not fit the panel at its place.
    DoesNotFit,
    /// The expected place has no distinguishable bits.
    Unreadable,
    /// The outline is no longer a panel's.
    Corners,
    /// The panel has left the frame.
    OutOfFrame,
}

impl TrackError {
    /// The kind of this error.
    pub fn kind(&self) -> TrackErrorKind {
        match self {
            Self::DoesNotFit { .. } => TrackErrorKind::DoesNotFit,
            Self::Unreadable(_) => TrackErrorKind::Unreadable,
            Self::OffCourse { .. } => TrackErrorKind::OffCourse,
            Self::OutOfFrame => TrackErrorKind::OutOfFrame,
            Self::Corners(_) => TrackErrorKind::Corners,
        }
    }
}

impl Track {
    /// A track of a panel that was found in frame `number`.
    pub fn new(spots: LatticeModel, number: u64, frame_size: (usize, usize)) -> Self {
        Self {
            spots,
            speed: AT_REST,
            speed_known: false,
            usual: None,
            astray: Some(1.0),
            trust: 1.0,
            #[cfg(feature = "surroundings")]
            little: BETWEEN_LINES,
            last_seen: number,
            any_number: false,
            missed: 0,
            wander: [0.0; 2],
            is_amid_clutter: false,
            is_near: false,
            frame_size,
        }
    }

    /// Sets whether the panel was located from the inside of its own outline alone.
    pub fn amid_clutter(self, is_amid_clutter: bool) -> Self {
        Self { is_amid_clutter, ..self }
    }

    /// The track with the speed of a panel that was at `place` in frame `before`, if that is not long ago and the panel moves by at most
    /// half its width a frame. Otherwise it is expected at rest.
    #[cfg(feature = "surroundings")]
    pub fn coming_from(self, before: u64, place: &Lattice) -> Self {
        let Some(elapsed @ 1..=COMING_FRAMES) = self.last_seen.checked_sub(before) else {
            return self;
        };
        let (here, elapsed) = (&self.spots.lattice, elapsed as f32);
        let [now, then] = [here, place].map(|lattice| lattice.pitch()[0]);
        if !here.is_beside(place, COMING_PITCHES * elapsed) || (now - then).abs() > COMING_GROWTH * now {
            return self;
        }
        let speed = speed_between(place, here, elapsed);
        Self { speed, ..self }
    }

    /// A track of a panel at rest in a given place, whatever the number of the next frame.
    pub fn placed(spots: LatticeModel, frame_size: (usize, usize)) -> Self {
        Self {
            speed_known: true,
            astray: None,
            any_number: true,
            ..Self::new(spots, 0, frame_size)
        }
    }

    /// The track in frames of another size and origin, so that positions change by `shift`.
    pub fn shifted(&self, shift: [f32; 2], frame_size: (usize, usize)) -> Self {
        let mut track = Self { frame_size, ..*self };
        for (centre, shift) in track.spots.lattice.centre.iter_mut().zip(shift) {
            *centre += shift;
        }
        track
    }

    /// The track in other pixels of the same frames, `size` of them.
    pub fn seen_in(&self, before: &Grid, now: &Grid, size: (usize, usize)) -> Self {
        let track = Self { frame_size: size, ..*self };
        if before == now {
            return track;
        }
        let is_near = now.side > 1;
        let finer = before.side as f32 / now.side as f32;
        let speed = self.speed.scaled(self.speed.centre.map(|c| c * finer), finer);
        let mut spots = now.spots_from_frame(&before.spots_to_frame(&self.spots));
        if !is_near {
            spots.lattice.tilt = [0.0; 2];
        }
        Self {
            spots,
            speed,
            is_near,
            ..track
        }
    }

    /// Whether two frames have shown the panel's motion.
    pub fn speed_known(&self) -> bool {
        self.speed_known
    }

    /// Successive frames without the panel.
    pub fn missed(&self) -> u32 {
        self.missed
    }

    /// Counts a frame without the panel; returns whether to continue.
    pub fn miss(&mut self, patience_frames: u32) -> bool {
        self.missed += 1;
        self.missed <= patience_frames
    }

    /// Whether the prediction is valid for frame `number`.
    pub fn reaches(&self, number: u64) -> bool {
        let elapsed = number.checked_sub(self.last_seen);
        self.any_number || elapsed.is_some_and(|elapsed| (1..=LONGEST_GAP_FRAMES).contains(&elapsed))
    }

    /// The lattice expected in frame `number`.
    pub fn predicted(&self, number: u64) -> Lattice {
        let elapsed = number.saturating_sub(self.last_seen) as f32;
        let [moving, still] = self.wander;
        let by_speed = if moving <= STEADILY * still {
            elapsed
        } else if moving <= STILL * still {
            elapsed.min(1.0)
        } else {
            0.0
        };
        moved(&self.spots.lattice, &self.speed, [by_speed, elapsed])
    }

    /// The usual distance from the expected place (pitches).
    pub fn spread(&self) -> f32 {
        let [moving, still] = self.wander;
        libm::sqrtf(moving.min(still))
    }

    /// Whether the panel is at its expected place, except for a negligible distance.
    pub fn is_steady(&self) -> bool {
        self.spread() < STEADY
    }

    /// Whether the distance from the expected place is so large that the track may be one line off.
    pub fn wanders(&self) -> bool {
        self.spread() > WANDERING
    }

    /// Mean squared errors of predictions, including a panel seen after `elapsed` frames.
    fn wander_with(&self, seen: &Lattice, elapsed: f32) -> [f32; 2] {
        let pitch = seen.pitch()[0];
        let mut wander = self.wander;
        for (square, frames) in wander.iter_mut().zip([elapsed, 0.0]) {
            let expected = moved(&self.spots.lattice, &self.speed, [frames; 2]);
            let [dx, dy] = difference(seen, &expected).centre;
            *square += WANDER_GAIN * ((dx * dx + dy * dy) / (pitch * pitch) - *square);
        }
        wander
    }

    /// The panel in the last frame that showed it.
    pub fn spots(&self) -> &LatticeModel {
        &self.spots
    }

    /// Whether the LEDs overlap.
    pub fn is_blurred(&self) -> bool {
        let [across, down] = self.spots.lattice.pitch();
        across.min(down) < BLURRED * self.spots.sigma
    }

    /// Standard deviation of one LED's image, in pixels.
    pub fn spot_sigma_px(&self) -> f32 {
        self.spots.sigma
    }

    /// Compares frame `number` with the panel on `lattice`, which was `expected`, with each LED On for its share of the exposure, and
    /// corrects the track if they fit. Also returns the share of the light that the panel explains.
    pub fn corrected<const N: usize>(
        &self,
        number: u64,
        observation: Observation<'_, '_>,
        [lattice, expected]: [Lattice; 2],
        state: [f32; LEDS],
        gate: Gate,
        residuals: &mut Residuals<N>,
    ) -> Result<(Self, f32), TrackError> {
        let window = fit::window(&lattice, RIM, self.frame_size).ok_or(TrackError::OutOfFrame)?;
        let start = LatticeModel {
            lattice,
            state,
            ..self.spots
        };
        // Microcontrollers have no flash left for this.
        let is_symbol = cfg!(not(feature = "surroundings")) || may_be_shown(bits_where(|led| state[led] > 0.5).bits());
        let share = if is_symbol { gate.share } else { gate.share.max(GATE_SHARE_PLACED) };
        let needed = self.usual.map_or(gate.least, |usual| share * usual.explained);
        let nothing = TrackError::DoesNotFit { explained: 0.0, needed };
        let is_alone = self.is_amid_clutter || self.is_blurred();
        let observation = Observation {
            within: is_alone.then(|| Outline::of(&start)),
            ..observation
        };
        let (spots, slope) = self.settled(start, observation, window, residuals).ok_or(nothing)?;
        let now = Averages::of(&slope);
        let explained = now.explained;
        let is_as_usual = self.usual.is_some_and(|usual| usual.leaves_as_little(now));
        if explained.is_nan() || explained < needed && !is_as_usual {
            return Err(TrackError::DoesNotFit { explained, needed });
        }
        let levels = spots.relevelled(&slope, self.is_amid_clutter).ok_or(nothing)?;
        let shaped = self.reshaped(&spots, &slope).ok_or(nothing)?;
        let off = difference(&shaped.lattice, &lattice);
        let off_px = libm::hypotf(off.centre[0], off.centre[1]);
        if off_px.is_nan() || off_px > FARTHEST * lattice.pitch()[0] {
            return Err(TrackError::OffCourse { off_px });
        }
        let seen = moved(&lattice, &off, [PLACE_GAINS[0], SHAPE_GAINS[0]]);
        Corners::new(seen.corners())?;
        let [dx, dy] = difference(&shaped.lattice, &expected).centre;
        let astray = libm::hypotf(dx, dy) / lattice.pitch()[0];
        let usual = match self.usual {
            // The light that few LEDs explain is not the usual one.
            Some(usual) if explained < needed => usual,
            Some(usual) => usual.and(now),
            None => now,
        };
        let sigma = self.spots.sigma + WIDTH_GAIN * (shaped.sigma - self.spots.sigma);
        let track = Self {
            spots: LatticeModel {
                lattice: seen,
                sigma,
                ..levels
            },
            usual: Some(usual),
            astray: self.astray.map(|before| astray.max(ASTRAY_SHARE * before)),
            ..self.moved_on(number, seen, &shaped.lattice, &off)
        };
        Ok((track, explained))
    }

    /// Whether the panel has been at its expected place, so that it cannot be one line off.
    pub fn is_on_course(&self) -> bool {
        self.astray.is_none_or(|astray| astray < ON_COURSE)
    }

    /// Checks that the panel at a given place explains as much light as a single symbol does.
    ///
    /// # Errors
    /// [`TrackError::DoesNotFit`] if it explains less.
    pub fn check(&self, explained: f32) -> Result<(), TrackError> {
        let needed = GATE_SHARE_PLACED * self.usual.map_or(0.0, |usual| usual.explained);
        if explained < needed {
            return Err(TrackError::DoesNotFit { explained, needed });
        }
        Ok(())
    }

    /// The track after frame `number` has shown the panel on `lattice` without further information.
    pub fn carried(&self, number: u64, lattice: Lattice) -> Self {
        self.moved_on(number, lattice, &lattice, &AT_REST)
    }

    /// The track moved to the lattice `seen` in frame `number`; `there` is the measured lattice, and `off` the measured error of its shape.
    fn moved_on(&self, number: u64, seen: Lattice, there: &Lattice, off: &Lattice) -> Self {
        let elapsed = number.saturating_sub(self.last_seen).max(1) as f32;
        Self {
            spots: LatticeModel {
                lattice: seen,
                ..self.spots
            },
            speed: self.corrected_speed(&seen, &self.off_course(there, off, elapsed), elapsed),
            speed_known: true,
            wander: self.wander_with(&seen, elapsed),
            last_seen: number,
            any_number: false,
            missed: 0,
            ..*self
        }
    }

    /// Mean confidence of its recent bits: the probability that one is right.
    pub fn trust(&self) -> f32 {
        self.trust
    }

    /// The track after bits with that confidence.
    pub fn read_with(self, confidence: f32) -> Self {
        Self {
            trust: self.trust + (confidence - self.trust) / MEMORY_FRAMES,
            ..self
        }
    }

    /// The track with full confidence, after a search has found the panel at its place.
    pub fn trusted(self) -> Self {
        Self {
            trust: 1.0,
            #[cfg(feature = "surroundings")]
            little: self.little.min(self.usually_explained() - CLEARLY_LESS),
            ..self
        }
    }

    /// Whether a panel explains so little light that it may lie between its lines.
    #[cfg(feature = "surroundings")]
    pub fn explains_little(&self) -> bool {
        self.usually_explained() < self.little
    }

    #[cfg(not(feature = "surroundings"))]
    pub fn explains_little(&self) -> bool {
        false
    }

    /// The track without confidence: its bits count as random.
    pub fn distrusted(self) -> Self {
        Self { trust: 0.5, ..self }
    }

    /// The share of the light that the panel usually explains; 1 while it is unknown.
    fn usually_explained(&self) -> f32 {
        self.usual.map_or(1.0, |usual| usual.explained)
    }

    /// Whether the panel may be seen halfway between two lines: it is not at its expected place, and the share of the light that it
    /// explains is smaller than usual.
    pub fn may_be_elsewhere(&self, explained: f32) -> bool {
        self.astray.is_some_and(|astray| astray > NEAR_COURSE) && explained < LESS_THAN_USUAL * self.usually_explained()
    }

    /// The lattice shifted by a line, if one is expected to leave a clearly smaller residual: a panel that has jumped may be seen one line
    /// off. Overlapping LEDs and clutter do not show this.
    pub fn line_beside<const N: usize>(&self, observation: Observation<'_, '_>, residuals: &mut Residuals<N>) -> Option<Lattice> {
        if self.is_blurred() || self.is_amid_clutter {
            return None;
        }
        let window = fit::window(&self.spots.lattice, 1.0 + RIM, self.frame_size)?;
        let mut left = |spots: &LatticeModel| {
            let slope = residuals.compare(spots, observation, window)?;
            Some(spots.expected_squares(&slope, false))
        };
        let here = left(&self.spots)?;
        let around = (0..9).filter(|&i| i != 4);
        let (least, beside) = around
            .map(|i| fit::shifted(&self.spots, i % 3 - 1, i / 3 - 1))
            .filter_map(|beside| Some((left(&beside)?, beside.lattice)))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (least < LINE_LEFT * here).then_some(beside)
    }

    /// The spots, and their differences from the frame, after levels and place have settled if the brightness or the motion has changed.
    fn settled<const N: usize>(
        &self,
        mut spots: LatticeModel,
        observation: Observation<'_, '_>,
        window: Window,
        residuals: &mut Residuals<N>,
    ) -> Option<(LatticeModel, Slope)> {
        let mut slope = residuals.compare(&spots, observation, window)?;
        if self.is_blurred() {
            // Levels that were found from the change between two frames do not fit a single frame.
            let levelling = if self.usual.is_none() { LEVELLING } else { 0 };
            for _ in 0..levelling {
                spots = spots.relevelled(&slope, false)?;
                slope = residuals.compare(&spots, observation, window)?;
            }
            let fit = fit::levenberg_marquardt(residuals, observation, window, spots, BLURRED_STEPS)?;
            return Some((fit.spots, fit.slope));
        }
        let settles = |slope: &Slope| slope.explained() >= SETTLED * self.usually_explained();
        if self.usual.is_some() && !settles(&slope) {
            let levels = spots.relevelled(&slope, self.is_amid_clutter)?;
            // If the exposure has jumped, levels that are wrong by a factor would shift the place.
            if !is_as_bright(&levels, &spots) {
                spots = levels;
                slope = residuals.compare(&spots, observation, window)?;
            }
        }
        for _ in 0..ROUNDS {
            if settles(&slope) {
                break;
            }
            let place = self.reshaped(&spots, &slope)?.lattice;
            let levels = spots.relevelled(&slope, self.is_amid_clutter)?;
            spots = LatticeModel { lattice: place, ..levels };
            slope = residuals.compare(&spots, observation, window)?;
        }
        Some((spots, slope))
    }

    /// The shape after one step down the slope, with its tilt if that is visible.
    fn reshaped(&self, spots: &LatticeModel, slope: &Slope) -> Option<LatticeModel> {
        let mut shaped = spots.reshaped(slope, DAMPING)?;
        if self.is_near {
            let tilt = difference(&spots.tilted(slope).lattice, &spots.lattice);
            shaped.lattice = moved(&shaped.lattice, &tilt, [1.0; 2]);
        }
        Some(shaped)
    }

    /// The error of the prediction with the speed alone for a panel `seen` now, with the error of its shape `off`.
    fn off_course(&self, seen: &Lattice, off: &Lattice, elapsed: f32) -> Lattice {
        let led = moved(&self.spots.lattice, &self.speed, [elapsed; 2]);
        Lattice {
            centre: difference(seen, &led).centre,
            ..*off
        }
    }

    /// The new change of the lattice per frame, if the panel is `seen` now and the prediction over `elapsed` frames had the error `off`.
    fn corrected_speed(&self, seen: &Lattice, off: &Lattice, elapsed: f32) -> Lattice {
        if self.speed_known {
            let gains = [PLACE_GAINS[1] / elapsed, SHAPE_GAINS[1] / elapsed];
            let tilt = self.speed.tilt;
            return Lattice {
                tilt,
                ..moved(&self.speed, off, gains)
            };
        }
        speed_between(&self.spots.lattice, seen, elapsed)
    }
}

/// A lattice that does not change.
const AT_REST: Lattice = Lattice {
    centre: [0.0; 2],
    column: [0.0; 2],
    row: [0.0; 2],
    tilt: [0.0; 2],
};

/// The speed of a panel that moves from one place to another over `elapsed` frames and keeps its shape.
fn speed_between(from: &Lattice, to: &Lattice, elapsed: f32) -> Lattice {
    Lattice {
        centre: difference(to, from).centre.map(|c| c / elapsed),
        ..AT_REST
    }
}

/// `lattice` moved by the shares `[place, shape]` of `by`.
fn moved(lattice: &Lattice, by: &Lattice, [place, shape]: [f32; 2]) -> Lattice {
    let sum = |a: [f32; 2], b: [f32; 2], share: f32| [a[0] + share * b[0], a[1] + share * b[1]];
    Lattice {
        centre: sum(lattice.centre, by.centre, place),
        column: sum(lattice.column, by.column, shape),
        row: sum(lattice.row, by.row, shape),
        tilt: sum(lattice.tilt, by.tilt, shape),
    }
}

/// Whether levels are close enough to those `before` that a step of the place with these is right.
fn is_as_bright(levels: &LatticeModel, before: &LatticeModel) -> bool {
    let contrast = levels.contrast / before.contrast;
    let background = (levels.background - before.background) / levels.contrast;
    AS_BRIGHT.contains(&contrast) && background.abs() < 1.0
}

fn difference(a: &Lattice, b: &Lattice) -> Lattice {
    moved(a, b, [-1.0; 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_of_few_leds_is_known_by_what_it_leaves() {
        let usual = Averages {
            explained: 0.95,
            signal: 400.0,
            left: 20.0,
        };
        let few = Averages {
            explained: 0.88,
            signal: 150.0,
            ..usual
        };
        assert!(usual.leaves_as_little(few));
        assert!(!usual.leaves_as_little(Averages { left: 30.0, ..few }));
        let dark = Averages { signal: 100.0, ..few };
        assert!(!usual.leaves_as_little(dark));
    }
}
