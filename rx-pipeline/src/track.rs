//! Tracking: following a panel from frame to frame.
//!
//! A track predicts the panel's lattice from its motion. The bits are read there, and the difference between the frame and the image that
//! these bits should give corrects the prediction. A frame costs one look at the pixels of each spot. The quality of the fit tells whether
//! the panel is still there.

use crate::coarse::Grid;
use crate::corners::{Corners, CornersError};
use crate::detect::DetectError;
use crate::fit::{self, LEVELLING};
use crate::lattice::Lattice;
use crate::spots::{LatticeModel, Observation, Outline, Residuals, Slope, Window};
use link::panel::LEDS;

/// Frames further apart say nothing of each other (frames).
const LONGEST_GAP_FRAMES: u64 = 25;
/// α and β of the place: what is taken of a frame's correction for the place itself, and for its speed (share).
/// Higher: follows turns sooner, and noise too.
const PLACE_GAINS: [f32; 2] = [0.8, 0.3];
/// α and β of the shape, which changes more slowly (share).
const SHAPE_GAINS: [f32; 2] = [0.6, 0.12];
/// α of the spots' width, which hardly changes from frame to frame (share). A frame is asked for it with the levels
/// as they were, and for the levels with the width as it was, so that both answer for the same light: more of it,
/// and they would answer each other.
const WIDTH_GAIN: f32 = 0.1;
/// A prediction off by more may have led to wrong bits (pitches). Higher: jumps are followed, one in them by a line
/// too far.
const FARTHEST: f32 = 0.3;
/// Room around the lattice (pitches).
pub(crate) const RIM: f32 = 0.6;
/// Of what frames usually explain, a panel where it is expected explains this much, at least (share of the light
/// there).
const GATE_SHARE: f32 = 0.85;
/// The same where it also looks likeliest to be, or has lately been on course: a frame that straddles two symbols explains this little.
const GATE_SHARE_LIKELIEST: f32 = 0.5;
/// The same where it has been placed by its surroundings.
const GATE_SHARE_PLACED: f32 = 0.7;
/// What it explains as long as it is not known what is usual, at least (share of the light there).
const GATE_LEAST: f32 = 0.25;
/// The same where the panel is not expected: clutter explains some of itself too.
const GATE_LEAST_ELSEWHERE: f32 = 0.7;
/// A frame shows the panel too if it leaves less of each pixel than this (multiple of what frames usually leave), and explains more
/// than this (share of what they usually explain): a symbol with few LEDs On. Higher and lower: what is no panel is followed.
const LEFT_MOST: f32 = 1.3;
/// See there.
const SIGNAL_LEAST: f32 = 0.3;
/// A panel that has lately been nearer to where it was expected has not jumped by a line (pitches). Lower: slower where
/// cameras shake.
const ON_COURSE: f32 = 0.1;
/// One that has lately been farther, and explains less than this share of what it usually does, may be seen halfway between two lines:
/// it is looked for around too (pitches; share). Lower and higher: as above.
const NEAR_COURSE: f32 = 0.2;
/// See there.
const LESS_THAN_USUAL: f32 = 0.95;
/// What of the farthest that it was from there still counts in the next frame (share). Higher: slower after a jump, and when a
/// panel has just been found.
const ASTRAY_SHARE: f32 = 0.8;
/// A panel that has jumped is taken to be a line beside where it was seen if that promises to leave less (share of what it leaves
/// there). Higher: LEDs that are Off along a side move it.
const LINE_LEFT: f32 = 0.8;
/// What frames usually explain is the mean over about so many (frames).
const MEMORY_FRAMES: f32 = 16.0;
/// What a frame changes of how far the panel wanders (share). Higher: the camera's shake is known sooner, and less surely.
const WANDER_GAIN: f32 = 0.3;
/// One that wanders less is where it is expected (pitches). Higher: faster, and a jump by a line is noticed later.
const STEADY: f32 = 0.1;
/// Readings of one that wanders more are doubted by what is around it (pitches). Lower: surer, and panels in clutter are doubted without need.
const WANDERING: f32 = 0.25;
/// A panel that moves as it does now stays near to where it was if its speed makes it miss by more (ratio of mean squares).
const STILL: f32 = 1.2;
/// It goes on at its speed through a gap if that makes it miss by less (ratio of mean squares).
const STEADILY: f32 = 0.25;
/// LEDs nearer to each other run into each other (standard deviations of a spot): what maximum likelihood reads corrects the
/// track, since simpler bits are too often wrong, and a fit in several steps, since place, width and levels hang together. Higher:
/// slower.
const BLURRED: f32 = 2.0;
/// Steps of that fit, at most (count). More: slower, and larger corrections are right.
const BLURRED_STEPS: usize = 6;
/// Rounds in which levels settle that are wrong by any factor, and places within [`FARTHEST`], at most (count).
const ROUNDS: usize = 3;
/// What explains more is settled (share of what frames usually explain).
const SETTLED: f32 = 0.9;
/// The damping of the steps (share of the curvature).
const DAMPING: f32 = 0.05;

/// How much of the light in a place the panel has to explain there to be taken for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gate {
    /// Of what frames usually explain.
    share: f32,
    /// As long as it is not known what is usual.
    least: f32,
}

impl Gate {
    /// Where the panel is expected.
    pub const SURE: Self = Self {
        share: GATE_SHARE,
        least: GATE_LEAST,
    };
    /// Where it is expected and also looks likeliest to be.
    pub const STILL: Self = Self {
        share: GATE_SHARE_LIKELIEST,
        least: GATE_LEAST,
    };
    /// Where it is not expected.
    pub const ELSEWHERE: Self = Self {
        share: GATE_SHARE,
        least: GATE_LEAST_ELSEWHERE,
    };
}

/// What frames that show the panel are like, on average.
#[derive(Clone, Copy, Debug)]
struct Usual {
    /// Share of the light that the panel explains.
    explained: f32,
    /// What it explains and what it leaves of each pixel (grey levels squared).
    signal: f32,
    left: f32,
}

impl Usual {
    fn of(slope: &Slope) -> Self {
        let pixels = slope.pixels.max(1) as f32;
        Self {
            explained: slope.explained(),
            signal: (slope.total - slope.squares) / pixels,
            left: slope.squares / pixels,
        }
    }

    /// With another frame.
    fn and(self, other: Self) -> Self {
        let mean = |usual: f32, now: f32| usual + (now - usual) / MEMORY_FRAMES;
        Self {
            explained: mean(self.explained, other.explained),
            signal: mean(self.signal, other.signal),
            left: mean(self.left, other.left),
        }
    }

    /// Whether another frame leaves no more, though its symbol may have fewer LEDs On.
    fn leaves_as_little(self, other: Self) -> bool {
        other.left < LEFT_MOST * self.left && other.signal > SIGNAL_LEAST * self.signal
    }
}

/// Where a panel is, how it moves, and how bright it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    spots: LatticeModel,
    /// Change of the lattice in a frame.
    speed: Lattice,
    speed_known: bool,
    usual: Option<Usual>,
    /// How far from where it was expected it has been lately (pitches); none of a panel whose place was told, and so its lines.
    astray: Option<f32>,
    /// How sure the bits of the last frames were, on average.
    trust: f32,
    last_seen: u64,
    /// Whether the number of the frame last seen is not known.
    any_number: bool,
    missed: u32,
    /// How far from its prediction it was lately, with its speed and without (mean square, pitches squared): not at all until it is seen
    /// to wander.
    wander: [f32; 2],
    /// Whether what is around it is no ground that its LEDs stand on, and so does not count.
    is_amid_clutter: bool,
    /// Whether it is seen in larger pixels, and so near that its tilt shows.
    is_near: bool,
    frame_size: (usize, usize),
}

/// Why a followed panel was not seen in a frame.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The frame does not look like the panel in its place.
    #[error("the panel is not where it should be: the grid explains {explained:.2} of the light there, {needed:.2} is needed")]
    DoesNotFit {
        /// Share of the variance that the fitted spots explain.
        explained: f32,
        /// The least that counts as the panel.
        needed: f32,
    },
    /// The place where the panel should be has no bits to tell apart.
    #[error("the panel is not where it should be: {0}")]
    Unreadable(#[from] DetectError),
    /// The panel moved otherwise than it used to.
    #[error("the panel is {off_px:.1} px from where it was expected, too far to be sure of its bits")]
    OffCourse {
        /// Distance in pixels.
        off_px: f32,
    },
    /// The panel has left the frame.
    #[error("the panel has left the frame")]
    OutOfFrame,
    /// What was followed is no panel any more.
    #[error("the panel's shape is lost: {0}")]
    Corners(#[from] CornersError),
}

/// What errors of a track have in common, whatever their numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrackErrorKind {
    /// The panel moved otherwise than it used to.
    OffCourse,
    /// The frame does not look like the panel in its place.
    DoesNotFit,
    /// That place has no bits to tell apart.
    Unreadable,
    /// What was followed is no panel any more.
    Corners,
    /// The panel has left the frame.
    OutOfFrame,
}

impl TrackError {
    /// What it has in common with errors of other numbers.
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
    /// Follows the panel that was found in frame `number`.
    pub fn new(spots: LatticeModel, number: u64, frame_size: (usize, usize)) -> Self {
        Self {
            spots,
            speed: AT_REST,
            speed_known: false,
            usual: None,
            astray: Some(1.0),
            trust: 1.0,
            last_seen: number,
            any_number: false,
            missed: 0,
            wander: [0.0; 2],
            is_amid_clutter: false,
            is_near: false,
            frame_size,
        }
    }

    /// The same, of a panel that was found by what is within its own outline alone.
    pub fn amid_clutter(self, is_amid_clutter: bool) -> Self {
        Self { is_amid_clutter, ..self }
    }

    /// Follows a panel at rest in a given place, whatever the number of the next frame.
    pub fn placed(spots: LatticeModel, frame_size: (usize, usize)) -> Self {
        Self {
            speed_known: true,
            astray: None,
            any_number: true,
            ..Self::new(spots, 0, frame_size)
        }
    }

    /// The same track in frames that begin elsewhere, so that positions change by `shift`, and are of another size.
    pub fn shifted(&self, shift: [f32; 2], frame_size: (usize, usize)) -> Self {
        let mut track = Self { frame_size, ..*self };
        for (centre, shift) in track.spots.lattice.centre.iter_mut().zip(shift) {
            *centre += shift;
        }
        track
    }

    /// The same track in other pixels of the same frames, `size` of them.
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

    /// Whether two frames have shown how the panel moves.
    pub fn speed_known(&self) -> bool {
        self.speed_known
    }

    /// Frames missed in a row.
    pub fn missed(&self) -> u32 {
        self.missed
    }

    /// Counts a frame that did not show the panel; whether to go on looking.
    pub fn miss(&mut self, patience_frames: u32) -> bool {
        self.missed += 1;
        self.missed <= patience_frames
    }

    /// Whether the prediction holds for frame `number`.
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

    /// How far from where it is expected it usually is (pitches).
    pub fn spread(&self) -> f32 {
        let [moving, still] = self.wander;
        libm::sqrtf(moving.min(still))
    }

    /// Whether it is where it is expected, but for what hardly shows.
    pub fn is_steady(&self) -> bool {
        self.spread() < STEADY
    }

    /// Whether it is so far from where it is expected that it may be a line off.
    pub fn wanders(&self) -> bool {
        self.spread() > WANDERING
    }

    /// Mean squares of how far off predictions were, with another that was seen after so many frames.
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

    /// The panel as it was last seen.
    pub fn spots(&self) -> &LatticeModel {
        &self.spots
    }

    /// Whether the LEDs run into each other.
    pub fn is_blurred(&self) -> bool {
        let [across, down] = self.spots.lattice.pitch();
        across.min(down) < BLURRED * self.spots.sigma
    }

    /// Standard deviation of one LED's image, in pixels.
    pub fn spot_sigma_px(&self) -> f32 {
        self.spots.sigma
    }

    /// Compares frame `number` with the panel on `lattice`, which was `expected`, each LED On for its share of the exposure, and corrects
    /// the track if that fits; with the share of the light that it explains.
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
        let needed = self.usual.map_or(gate.least, |usual| gate.share * usual.explained);
        let nothing = TrackError::DoesNotFit { explained: 0.0, needed };
        let is_alone = self.is_amid_clutter || self.is_blurred();
        let observation = Observation {
            within: is_alone.then(|| Outline::of(&start)),
            ..observation
        };
        let (spots, slope) = self.settled(start, observation, window, residuals).ok_or(nothing)?;
        let now = Usual::of(&slope);
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
            // What few LEDs explain is not what to expect of others.
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

    /// Whether it has been where it was expected, so that it cannot be a line off.
    pub fn is_on_course(&self) -> bool {
        self.astray.is_none_or(|astray| astray < ON_COURSE)
    }

    /// Checks that what the panel explains of the light where it was placed is what a single symbol explains.
    ///
    /// # Errors
    /// [`TrackError::DoesNotFit`] if it is less.
    pub fn check(&self, explained: f32) -> Result<(), TrackError> {
        let needed = GATE_SHARE_PLACED * self.usual.map_or(0.0, |usual| usual.explained);
        if explained < needed {
            return Err(TrackError::DoesNotFit { explained, needed });
        }
        Ok(())
    }

    /// The same where frame `number` shows it on `lattice`, and nothing else of it is known.
    pub fn carried(&self, number: u64, lattice: Lattice) -> Self {
        self.moved_on(number, lattice, &lattice, &AT_REST)
    }

    /// The same on the lattice on which frame `number` has `seen` it, where it was measured to be `there` and off its shape by as much as
    /// `off`.
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

    /// How sure its bits were of late, on average: the probability that one is right.
    pub fn trust(&self) -> f32 {
        self.trust
    }

    /// The same after bits that were as sure as that.
    pub fn read_with(self, confidence: f32) -> Self {
        Self {
            trust: self.trust + (confidence - self.trust) / MEMORY_FRAMES,
            ..self
        }
    }

    /// The same where nothing is held against it any longer.
    pub fn trusted(self) -> Self {
        Self { trust: 1.0, ..self }
    }

    /// The same where nothing speaks for it any longer.
    pub fn distrusted(self) -> Self {
        Self { trust: 0.5, ..self }
    }

    /// The share of the light that it usually explains; all of it, as long as nothing is known.
    fn usually_explained(&self) -> f32 {
        self.usual.map_or(1.0, |usual| usual.explained)
    }

    /// Whether it may be seen halfway between two lines, by the share of the light that it explains: it is not where it was expected, and
    /// explains less than usual.
    pub fn may_be_elsewhere(&self, explained: f32) -> bool {
        self.astray.is_some_and(|astray| astray > NEAR_COURSE) && explained < LESS_THAN_USUAL * self.usually_explained()
    }

    /// The lattice counted from a neighbouring line that promises to leave clearly less of a frame than this one, if there is one: a
    /// panel that has jumped may be seen a line off. LEDs that run into each other do not tell, nor does clutter.
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

    /// The spots, and how they differ from the frame, once levels and place have settled where brightness has changed, or the panel moves
    /// otherwise than before.
    fn settled<const N: usize>(
        &self,
        mut spots: LatticeModel,
        observation: Observation<'_, '_>,
        window: Window,
        residuals: &mut Residuals<N>,
    ) -> Option<(LatticeModel, Slope)> {
        let mut slope = residuals.compare(&spots, observation, window)?;
        if self.is_blurred() {
            // Levels that come from the change between two frames are no single frame's.
            let levelling = if self.usual.is_none() { LEVELLING } else { 0 };
            for _ in 0..levelling {
                spots = spots.relevelled(&slope, false)?;
                slope = residuals.compare(&spots, observation, window)?;
            }
            let fit = fit::levenberg_marquardt(residuals, observation, window, spots, BLURRED_STEPS)?;
            return Some((fit.spots, fit.slope));
        }
        for _ in 0..ROUNDS {
            if slope.explained() >= SETTLED * self.usually_explained() {
                break;
            }
            let place = self.reshaped(&spots, &slope)?.lattice;
            let levels = spots.relevelled(&slope, self.is_amid_clutter)?;
            spots = LatticeModel { lattice: place, ..levels };
            slope = residuals.compare(&spots, observation, window)?;
        }
        Some((spots, slope))
    }

    /// The shape one step down the slope, with its tilt where that shows.
    fn reshaped(&self, spots: &LatticeModel, slope: &Slope) -> Option<LatticeModel> {
        let mut shaped = spots.reshaped(slope, DAMPING)?;
        if self.is_near {
            let tilt = difference(&spots.tilted(slope).lattice, &spots.lattice);
            shaped.lattice = moved(&shaped.lattice, &tilt, [1.0; 2]);
        }
        Some(shaped)
    }

    /// By how much a panel `seen` now is off the place where its speed alone would have led it, and off the shape by as much as `off`.
    fn off_course(&self, seen: &Lattice, off: &Lattice, elapsed: f32) -> Lattice {
        let led = moved(&self.spots.lattice, &self.speed, [elapsed; 2]);
        Lattice {
            centre: difference(seen, &led).centre,
            ..*off
        }
    }

    /// The change of the lattice in a frame, where the panel is `seen` now, `off` the prediction over `elapsed` frames.
    fn corrected_speed(&self, seen: &Lattice, off: &Lattice, elapsed: f32) -> Lattice {
        if self.speed_known {
            let gains = [PLACE_GAINS[1] / elapsed, SHAPE_GAINS[1] / elapsed];
            let tilt = self.speed.tilt;
            return Lattice {
                tilt,
                ..moved(&self.speed, off, gains)
            };
        }
        let whole = difference(seen, &self.spots.lattice);
        Lattice {
            centre: whole.centre.map(|c| c / elapsed),
            ..AT_REST
        }
    }
}

/// No change of a lattice.
const AT_REST: Lattice = Lattice {
    centre: [0.0; 2],
    column: [0.0; 2],
    row: [0.0; 2],
    tilt: [0.0; 2],
};

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

fn difference(a: &Lattice, b: &Lattice) -> Lattice {
    moved(a, b, [-1.0; 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_of_few_leds_is_known_by_what_it_leaves() {
        let usual = Usual {
            explained: 0.95,
            signal: 400.0,
            left: 20.0,
        };
        let few = Usual {
            explained: 0.88,
            signal: 150.0,
            ..usual
        };
        assert!(usual.leaves_as_little(few));
        assert!(!usual.leaves_as_little(Usual { left: 30.0, ..few }));
        let dark = Usual { signal: 100.0, ..few };
        assert!(!usual.leaves_as_little(dark));
    }
}
