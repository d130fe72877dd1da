//! Follows and reads one panel: the part of a receiver that exists once per panel.

#[cfg(feature = "carrier")]
use super::coarser::Coarser;
#[cfg(feature = "surroundings")]
use super::line_watch::LineWatch;
#[cfg(not(feature = "maximum-likelihood"))]
pub(crate) use super::no_likelihood::{MaximumLikelihood, NoExperience as Experience};
use super::outcome::{FrameReading, Loss};
#[cfg(feature = "carrier")]
use super::recent_levels::RecentLevels;
use super::view::View;
use crate::cells::{CellMap, CellsError};
use crate::coarse::Grid;
use crate::corners::Corners;
use crate::detect::{Detection, Detector, Method, Mixture, check_white};
use crate::features::Features;
use crate::frame::Frame;
use crate::lattice::Lattice;
#[cfg(feature = "maximum-likelihood")]
pub(crate) use crate::likelihood::{Experience, MaximumLikelihood};
use crate::locate::{Location, Locator, is_random};
use crate::profile::{Profile, Stage};
use crate::settings::TrackingSettings;
use crate::spots::{LatticeModel, Observation, Residuals};
use crate::surroundings::{Placement, Surroundings, Tiles};
use crate::track::{Gate, Track, TrackError};
#[cfg(feature = "carrier")]
use link::panel::PanelFrame;
use link::panel::{LEDS, SIDE, SoftPanel};

/// Cells are reused while the corners differ by less (pitches): noise alone moves them by less, and a cell's mean hardly changes. Higher:
/// faster, and cells that are off.
const SAME_CELLS: f32 = 0.03;
/// The standard deviation of an LED's image at a given place, at least (pitches): a disc half a pitch wide. Higher: near panels of small
/// LEDs are not recognised; lower: those of large LEDs are not.
const DISC: f32 = 0.125;
/// The additional light that another place has to explain to replace the expected one (share of the light
/// there).
const CLEARLY: f32 = 0.05;
/// Minimum room around a panel that is seen within the picture although it should be partly outside (pitches). It is room for another line,
/// which must not exist. Lower: the rest of the panel is read as one that is a line off.
const LINE_ROOM: f32 = 1.5;
/// Maximum number of lines by which a panel that has jumped is moved (count). More: slower if cameras shake.
const LINES_MOVED: usize = 3;
/// Another place is also accepted if it leaves less than this share of the expected place's residual (share).
const CLEARLY_LEFT: f32 = 0.6;

/// The bits at a place that the surroundings give are unsure if their confidence is below the usual one by this (probability that one is
/// right). Less: slower.
const LESS_SURE: f32 = 0.01;
/// The probability that a panel is in its place if the light beside it may be its own (share).
#[cfg(feature = "surroundings")]
const LINE_OFF: f32 = 0.5;
/// Two places whose middles are nearer show one panel (pitches).
const WIDTH: f32 = SIDE as f32;
/// Minimum confidence of bits from which the surroundings are learnt, or which replace a place between lines (probability that a bit is
/// right).
const SURE: f32 = 0.98;
/// Bits are not read again without shadows if they are surer (probability that one is right). Higher: slower in even light; lower: shadows
/// cost bits.
#[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
const SURE_IN_SHADOWS: f32 = 0.9999;
/// Frames between updates of the surroundings of a panel that hardly moves (count). More: faster, and slow changes are noticed later.
const STEADY_FRAMES: u64 = 8;

/// Successive frames in which a lattice must look too fine before it counts as such (count).
#[cfg(feature = "carrier")]
const TOO_FINE_FRAMES: u8 = 4;

/// A track corrected by a frame.
struct CorrectedTrack {
    track: Track,
    reading: FrameReading,
    /// The share of the light there that the panel explains.
    explained: f32,
    /// Whether the configured method has read the frame, not only the fast detector.
    is_read_well: bool,
}

/// The attempt that explains clearly more light; the first if neither does. If the first attempt has no reading, edges and walls explain as
/// much as a panel, and only bits as random as a message's distinguish a panel from them.
fn better(here: Result<CorrectedTrack, Loss>, elsewhere: Result<CorrectedTrack, Loss>) -> Result<CorrectedTrack, Loss> {
    match (here, elsewhere) {
        (Ok(here), Ok(elsewhere))
            if elsewhere.explained > here.explained + CLEARLY || 1.0 - elsewhere.explained < CLEARLY_LEFT * (1.0 - here.explained) =>
        {
            Ok(elsewhere)
        }
        (Err(_), Ok(elsewhere)) if is_random(elsewhere.reading.detection.bits.bits()) => Ok(elsewhere),
        (here, _) => here,
    }
}

/// The confidence of a reading, if there is one: the probability that a bit is right.
fn confidence(followed: &Result<(Track, FrameReading), Loss>) -> f32 {
    followed.as_ref().map_or(0.0, |(_, reading)| reading.detection.confidence)
}

/// The large tools for reading a panel.
pub(crate) struct Tools<'a, const N: usize> {
    pub map: &'a mut CellMap<N>,
    pub residuals: &'a mut Residuals<N>,
    pub likelihood: &'a mut MaximumLikelihood<N>,
    pub surroundings: &'a mut Surroundings,
    pub tiles: &'a mut Tiles,
    /// The known part of the symbol whose end the frame may show.
    pub before: SoftPanel,
}

/// A frame, and the tools for reading it.
struct Input<'a, 'f, 't, const N: usize> {
    number: u64,
    frame: &'a Frame<'f>,
    expected: Lattice,
    /// Whether the picture gave this place, not only the earlier motion.
    is_placed: bool,
    locator: &'a Locator,
    tools: &'a mut Tools<'t, N>,
}

impl<const N: usize> Input<'_, '_, '_, N> {
    /// Whether the surroundings of the expected place are unchanged.
    fn agrees(&self, profile: &mut impl Profile) -> bool {
        profile.timed(Stage::Follow, || self.tools.surroundings.agrees(self.frame, &self.expected))
    }

    /// The likely places of a panel that was last seen on `last` and is usually `spread` pitches off its expected place.
    fn placed(&mut self, last: &Lattice, spread: f32, profile: &mut impl Profile) -> Placement {
        let Tools { surroundings, tiles, .. } = &mut *self.tools;
        profile.timed(Stage::Follow, || {
            surroundings.place(self.frame, &self.expected, last, spread, tiles)
        })
    }
}

/// The state of one panel's reception without its large parts.
#[derive(Clone, Debug)]
pub(crate) struct Reader {
    method: Method,
    settings: TrackingSettings,
    track: Option<Track>,
    /// The part and scale of the frame in which track, cells and likelihood work.
    view: View,
    frame_size: (usize, usize),
    /// The corners for which the cell map was built.
    cells: Option<Corners>,
    /// The panel's last corners in the frame.
    seen: Option<Corners>,
    /// Successive frames that were read on a lattice which seems finer than the panel's.
    #[cfg(feature = "carrier")]
    too_fine: u8,
    /// The places that have recently been lit.
    #[cfg(feature = "carrier")]
    recent_levels: RecentLevels,
    /// The places beside the panel.
    #[cfg(feature = "surroundings")]
    line_watch: LineWatch,
    /// The number of the frame in which a search last found the panel, and its place there.
    #[cfg(feature = "surroundings")]
    found: Option<(u64, Lattice)>,
}

impl Reader {
    pub fn new(method: Method, settings: TrackingSettings) -> Self {
        Self {
            method,
            settings,
            track: None,
            view: View::whole((0, 0)),
            frame_size: (0, 0),
            cells: None,
            seen: None,
            #[cfg(feature = "carrier")]
            too_fine: 0,
            #[cfg(feature = "carrier")]
            recent_levels: RecentLevels::NONE,
            #[cfg(feature = "surroundings")]
            line_watch: LineWatch::NEW,
            #[cfg(feature = "surroundings")]
            found: None,
        }
    }

    pub fn is_following(&self) -> bool {
        self.track.is_some()
    }

    pub fn forget(&mut self) {
        // The last place of a panel that has been lost gives its speed once it is found again.
        if self.is_following() {
            self.forget_find();
        }
        self.track = None;
    }

    /// Forgets where a search last found the panel.
    fn forget_find(&mut self) {
        #[cfg(feature = "surroundings")]
        {
            self.found = None;
        }
    }

    pub fn corners(&self) -> Option<Corners> {
        self.track.and(self.seen)
    }

    /// Continues with frames of another size and origin, so that positions change by `shift` px.
    pub fn shift<const N: usize>(&mut self, shift: [i32; 2], frame_size: (usize, usize), map: &mut CellMap<N>) {
        let by = shift.map(|shift| shift as f32);
        let moved = |corners: Corners| corners.shifted(by[0], by[1]).ok();
        self.frame_size = frame_size;
        self.seen = self.seen.and_then(moved);
        #[cfg(feature = "surroundings")]
        {
            self.found = self.found.map(|(number, place)| (number, place.shifted(by)));
        }
        if !self.view.is_whole() {
            self.view.grid = self.view.grid.shifted(shift);
            return;
        }
        self.view = View::whole(frame_size);
        self.track = self.track.map(|track| track.shifted(by, frame_size));
        self.cells = if map.shift(shift, frame_size.0, frame_size.1) {
            self.cells.and_then(moved)
        } else {
            None
        };
    }

    /// Reads the panel at its expected place; `None` if none is followed.
    pub fn follow<const N: usize>(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        locator: &Locator,
        tools: &mut Tools<'_, N>,
        canvas: &mut [u8],
        profile: &mut impl Profile,
    ) -> Option<Result<FrameReading, Loss>> {
        let track = self.track?;
        if (frame.width(), frame.height()) != self.frame_size || !track.reaches(number) {
            self.track = None;
            return None;
        }
        let grid = self.view.grid;
        let (expected, spread) = (grid.lattice_to_frame(&track.predicted(number)), track.spread());
        let last = grid.lattice_to_frame(&track.spots().lattice);
        let mut input = Input {
            number,
            frame,
            expected,
            is_placed: false,
            locator,
            tools,
        };
        let is_known = input.tools.surroundings.is_known();
        let is_steady = is_known && track.is_steady() && input.agrees(profile);
        let mut placement = (is_known && !is_steady).then(|| input.placed(&last, spread, profile));
        let elsewhere = placement.as_ref().and_then(|placement| placement.elsewhere(&expected));
        let learnt = elsewhere.map(|_| input.tools.likelihood.experience());
        let mut followed = self.follow_to(&track, elsewhere, &mut input, canvas, profile);
        let mut track = track.seen_in(&grid, &self.view.grid, self.view.frame_size());
        if let Some(learnt) = learnt.filter(|_| confidence(&followed) < track.trust() - LESS_SURE && grid.side == self.view.grid.side) {
            let grid = self.view.grid;
            followed = self.surer(followed, learnt, &track, &mut input, canvas, profile);
            track = track.seen_in(&grid, &self.view.grid, self.view.frame_size());
        }
        let is_in_place = matches!(&followed, Ok((track, _)) if track.is_steady());
        if is_steady && !is_in_place {
            let placed = input.placed(&last, spread, profile);
            if let Some(elsewhere) = placed.elsewhere(&expected) {
                let grid = self.view.grid;
                let again = self.follow_to(&track, Some(elsewhere), &mut input, canvas, profile);
                track = track.seen_in(&grid, &self.view.grid, self.view.frame_size());
                followed = again.or(followed);
            }
            placement = Some(placed);
        }
        Some(match followed {
            Ok((followed, mut reading)) => {
                #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
                let undoubted = reading.detection.confidence;
                self.track = Some(followed);
                let lattice = self.view.grid.lattice_to_frame(&followed.spots().lattice);
                if let Some(placement) = placement.filter(|_| track.wanders() || followed.wanders()) {
                    reading.detection = reading.detection.doubted(placement.confidence(&lattice));
                }
                let is_due = !is_steady || number.is_multiple_of(STEADY_FRAMES);
                if is_due && reading.detection.mixed.is_none() && reading.detection.confidence > SURE {
                    let surroundings = &mut *input.tools.surroundings;
                    profile.timed(Stage::Follow, || surroundings.learn(frame, &lattice, reading.detection.bits));
                }
                #[cfg(feature = "surroundings")]
                self.check_lines(frame, &lattice, &mut reading.detection, input.tools);
                #[cfg(feature = "carrier")]
                let bits = reading.detection.bits;
                #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
                let reading = self.without_shadows(frame, reading, undoubted, input.tools, canvas, profile);
                let reading = self.in_frame(reading);
                #[cfg(feature = "carrier")]
                self.follow_coarser(number, frame, bits, &lattice, input.tools);
                reading
            }
            Err(loss) => {
                let loss = self.view.loss_in_frame(loss, self.frame_size);
                Err(self.miss(track, loss))
            }
        })
    }

    /// The reading at the expected place, if its bits are surer than those read `elsewhere`: a shadow that passes moves the surroundings,
    /// too. `learnt` holds the earlier estimates.
    #[cold]
    fn surer<const N: usize>(
        &mut self,
        elsewhere: Result<(Track, FrameReading), Loss>,
        learnt: Experience,
        track: &Track,
        input: &mut Input<'_, '_, '_, N>,
        canvas: &mut [u8],
        profile: &mut impl Profile,
    ) -> Result<(Track, FrameReading), Loss> {
        let (view, learnt_there) = (self.view, input.tools.likelihood.experience());
        let in_same_pixels = |view_here: View| view_here.grid.side == view.grid.side;
        let view_here = view.of(&input.expected, self.settings.max_pitch_px, self.frame_size, N);
        if !view_here.is_some_and(in_same_pixels) {
            return elsewhere;
        }
        input.tools.likelihood.set_experience(learnt);
        let here = self.follow_to(track, None, input, canvas, profile);
        if confidence(&here) > confidence(&elsewhere) {
            return here;
        }
        input.tools.likelihood.set_experience(learnt_there);
        if self.view != view {
            (self.view, self.cells) = (view, None);
        }
        elsewhere
    }

    /// Moves the track by a line if the light beside the panel shows that its LEDs are there, and doubts the reading if that is possible.
    #[cfg(feature = "surroundings")]
    fn check_lines<const N: usize>(&mut self, frame: &Frame<'_>, lattice: &Lattice, detection: &mut Detection, tools: &mut Tools<'_, N>) {
        let (bits, is_single) = (detection.bits, detection.mixed.is_none());
        if is_single {
            self.line_watch.see(frame, lattice, bits);
        }
        if self.line_watch.is_doubtful() {
            *detection = detection.doubted(LINE_OFF);
        }
        let moved = self.line_watch.moved(lattice, bits).filter(|_| is_single);
        let Some((moved, bits)) = moved else { return };
        let [here, there] = [lattice, &moved].map(|lattice| self.view.grid.lattice_from_frame(lattice).centre);
        let by = core::array::from_fn(|i| there[i] - here[i]);
        self.track = self.track.map(|track| track.shifted(by, self.view.frame_size()));
        self.forget_places();
        tools.likelihood.forget_leds();
        // Surroundings that agree with a place a line off were learnt there. Others are older, and still right.
        if tools.surroundings.agrees(frame, lattice) {
            *tools.surroundings = Surroundings::UNKNOWN;
            tools.surroundings.learn(frame, &moved, bits);
        }
    }

    /// Switches to the panel whose LEDs are a subset of the places of the followed `lattice`, if that has seemed so for some frames.
    #[cfg(feature = "carrier")]
    fn follow_coarser<const N: usize>(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        bits: PanelFrame,
        lattice: &Lattice,
        tools: &mut Tools<'_, N>,
    ) {
        self.recent_levels.see(bits);
        let coarser = Coarser::of(bits.bits()).or_else(|| Coarser::of(self.recent_levels.places()?));
        self.too_fine = if coarser.is_some() { self.too_fine.saturating_add(1) } else { 0 };
        let (Some(coarser), Some(track)) = (coarser.filter(|_| self.too_fine >= TOO_FINE_FRAMES), self.track) else {
            return;
        };
        let Some(lattice) = coarser.panel(frame, lattice) else { return };
        let spots = LatticeModel {
            lattice,
            ..self.view.grid.spots_to_frame(track.spots())
        };
        let track = Track::new(spots, number, self.frame_size);
        let view = self.look_at(&spots.lattice, tools);
        self.track = view.map(|view| track.seen_in(&Grid::FRAME, &view.grid, view.frame_size()));
        self.forget_places();
        tools.likelihood.forget();
        *tools.surroundings = Surroundings::UNKNOWN;
    }

    /// Forgets the places of a lattice, because another is followed from now on.
    fn forget_places(&mut self) {
        #[cfg(feature = "carrier")]
        {
            (self.too_fine, self.recent_levels) = (0, RecentLevels::NONE);
        }
        #[cfg(feature = "surroundings")]
        {
            self.line_watch = LineWatch::NEW;
        }
    }

    /// Reads the panel at its expected place in the frame, or at `place` if the surroundings gave one.
    fn follow_to<const N: usize>(
        &mut self,
        track: &Track,
        place: Option<&Lattice>,
        input: &mut Input<'_, '_, '_, N>,
        canvas: &mut [u8],
        profile: &mut impl Profile,
    ) -> Result<(Track, FrameReading), Loss> {
        let (is_placed, place) = (place.is_some(), place.unwrap_or(&input.expected));
        let before = self.view.grid;
        let out_of_frame = Loss::from(TrackError::OutOfFrame);
        let view = self.look_at(place, input.tools).ok_or(out_of_frame)?;
        let track = track.seen_in(&before, &view.grid, view.frame_size());
        let drawn = profile.timed(Stage::Cells, || view.draw(input.frame, canvas)).ok_or(out_of_frame)?;
        let mut input = Input {
            number: input.number,
            frame: &drawn,
            expected: view.grid.lattice_from_frame(place),
            is_placed,
            locator: input.locator,
            tools: input.tools,
        };
        let CorrectedTrack {
            track: corrected,
            reading,
            explained,
            is_read_well,
        } = self.correct(&track, &mut input, profile)?;
        let spots = corrected.spots();
        let reading = if is_read_well {
            let corners = Corners::new(spots.lattice.corners()).map_err(TrackError::from)?;
            FrameReading { corners, ..reading }
        } else {
            self.read_well(&drawn, spots, reading, input.tools, profile)?
        };
        let mixture = reading.detection.mixed;
        let by_both = mixture.and_then(|mixture| corrected_by_both(&track, &mixture, &mut input));
        if input.is_placed && by_both.is_none() {
            track.check(explained)?;
        }
        let track = match by_both {
            Some(by_both) => by_both,
            None if mixture.is_none() => corrected.read_with(reading.detection.confidence),
            None if input.is_placed => track.carried(input.number, input.expected),
            None => track,
        };
        Ok((track, reading))
    }

    /// Switches the view to a panel on `lattice` of the frame, in pixels of a suitable size; `None` if it is outside.
    fn look_at<const N: usize>(&mut self, lattice: &Lattice, tools: &mut Tools<'_, N>) -> Option<View> {
        let now = self.view.of(lattice, self.settings.max_pitch_px, self.frame_size, N)?;
        let before = core::mem::replace(&mut self.view, now);
        if before == now {
            return Some(now);
        }
        let (width, height) = now.frame_size();
        let cells = before.shift_to(&now).and_then(|shift| {
            let [dx, dy] = shift.map(|shift| shift as f32);
            let moved = tools.map.shift(shift, width, height);
            moved.then_some(self.cells?.shifted(dx, dy).ok()?)
        });
        self.cells = cells;
        if before.grid.side != now.grid.side {
            let Grid { side, .. } = now.grid;
            tools.likelihood.go_on_in_pixels(side, now.grid.mixing_variance());
        }
        Some(now)
    }

    /// Converts a reading in the view to the frame.
    fn in_frame(&mut self, reading: FrameReading) -> Result<FrameReading, Loss> {
        let corners = self.view.grid.corners_to_frame(&reading.corners);
        let corners = corners.map_err(TrackError::from)?;
        self.seen = Some(corners);
        Ok(FrameReading { corners, ..reading })
    }

    /// Reads the panel at its expected place, or at the likeliest one, and corrects the track by the frame.
    fn correct<const N: usize>(
        &mut self,
        track: &Track,
        input: &mut Input<'_, '_, '_, N>,
        profile: &mut impl Profile,
    ) -> Result<CorrectedTrack, Loss> {
        let expected = input.expected;
        let is_read_well = self.reads_well_at_once(track);
        let here = self.attempt(track, expected, Gate::SURE, is_read_well, input, profile);
        let is_known = track.speed_known() || input.is_placed;
        // As long as the panel's motion is unknown, bits may look right one line off. Microcontrollers have no flash left to compare the
        // lines then.
        let here = match here {
            Ok(here) if is_known && here.track.is_on_course() => return Ok(here),
            Ok(here) if is_known || cfg!(feature = "surroundings") => {
                let here = self.on_its_line(track, Ok(here), input, profile);
                if is_known && !matches!(&here, Ok(now) if now.track.may_be_elsewhere(now.explained)) {
                    return here;
                }
                here
            }
            // A panel that has been on course is likely still at its expected place.
            Err(Loss::Coasting {
                why: TrackError::DoesNotFit { .. },
                ..
            }) if is_known && track.is_on_course() => match self.attempt_still(track, is_read_well, input, profile) {
                Ok(here) if here.track.is_on_course() => return Ok(here),
                here => here,
            },
            here => here,
        };
        let near = profile.timed(Stage::Search, || {
            let sigma_px = track.spot_sigma_px();
            input.locator.locate_near(input.frame, &expected, sigma_px)
        });
        match (near, here) {
            // The rest of a panel at the picture's edge looks like a panel that is one line off.
            (Some(near), here @ Err(Loss::Cells(_))) if !has_room(&near, input.frame) => here,
            (Some(near), here) if !near.is_close_to(&expected) && !self.is_held(track, &expected, &near) => {
                let elsewhere = self.attempt(track, near, Gate::ELSEWHERE, is_read_well, input, profile);
                let elsewhere = self.on_its_line(track, elsewhere, input, profile);
                better(here, elsewhere)
            }
            (_, Ok(here)) => Ok(here),
            (Some(_), Err(_)) => self.attempt(track, expected, Gate::STILL, is_read_well, input, profile),
            (None, Err(loss)) => Err(loss),
        }
    }

    /// The attempt at the expected place of a panel that has been on course: by the fast detector and, if its bits do not fit, by the
    /// configured method, which knows each LED's usual light. The fast detector compares only the LEDs of one frame: if light behind one
    /// LED outshines the others, it reads them all as Off.
    fn attempt_still<const N: usize>(
        &mut self,
        track: &Track,
        is_read_well: bool,
        input: &mut Input<'_, '_, '_, N>,
        profile: &mut impl Profile,
    ) -> Result<CorrectedTrack, Loss> {
        let expected = input.expected;
        let here = self.attempt(track, expected, Gate::STILL, is_read_well, input, profile);
        let is_read_again = cfg!(feature = "surroundings") && !is_read_well && self.method == Method::MaximumLikelihood;
        if here.is_ok() || !is_read_again {
            return here;
        }
        let learnt = input.tools.likelihood.experience();
        let read_well = self.attempt(track, expected, Gate::STILL, true, input, profile);
        read_well.inspect_err(|_| input.tools.likelihood.set_experience(learnt))
    }

    /// Whether a panel that hardly moves is still on `lattice`, because LEDs that have been lit there would be missing on `there`.
    #[cfg(feature = "carrier")]
    fn is_held(&self, track: &Track, lattice: &Lattice, there: &Lattice) -> bool {
        track.is_steady() && self.recent_levels.leaves_leds(lattice, there)
    }

    #[cfg(not(feature = "carrier"))]
    fn is_held(&self, _: &Track, _: &Lattice, _: &Lattice) -> bool {
        false
    }

    /// The attempt, or one that is a line beside it if that explains more light.
    fn on_its_line<const N: usize>(
        &mut self,
        track: &Track,
        attempt: Result<CorrectedTrack, Loss>,
        input: &mut Input<'_, '_, '_, N>,
        profile: &mut impl Profile,
    ) -> Result<CorrectedTrack, Loss> {
        let mut found = attempt?;
        for _ in 0..LINES_MOVED {
            let observation = observation(input.frame, input.locator);
            let beside = found.track.line_beside(observation, input.tools.residuals);
            let Some(beside) = beside.filter(|beside| !self.is_held(track, &input.expected, beside)) else {
                break;
            };
            match self.attempt(track, beside, Gate::ELSEWHERE, found.is_read_well, input, profile) {
                Ok(other) if other.explained > found.explained => found = other,
                _ => break,
            }
        }
        Ok(found)
    }

    /// Counts a frame without the panel; returns the loss to report, which says whether the panel is given up.
    fn miss(&mut self, mut track: Track, loss: Loss) -> Loss {
        let patience = self.settings.patience_frames.into();
        let going_on = track.miss(patience);
        self.track = going_on.then_some(track);
        match loss {
            Loss::Coasting { why, .. } if going_on => Loss::Coasting {
                missed: track.missed(),
                patience,
                why,
            },
            Loss::Coasting { why, .. } => Loss::Lost(why),
            other => other,
        }
    }

    /// Whether bits are so unsure, or so little of the light is explained, that the followed place may not be a panel, or may lie beside
    /// one. Only maximum likelihood shows this.
    pub fn is_doubtful(&self) -> bool {
        let is_unsure = |track: &Track| track.trust() < self.settings.min_confidence || track.explains_little();
        self.method == Method::MaximumLikelihood && self.track.as_ref().is_some_and(is_unsure)
    }

    /// Marks the panel as followed at a wrong place.
    pub fn distrust(&mut self) {
        self.track = self.track.map(Track::distrusted);
    }

    /// Reads a panel that a search has found while one is followed, and switches to it if its bits are surer. Otherwise, or if it is the
    /// same panel, nothing changes.
    pub fn find_again<const N: usize>(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        location: &Location,
        tools: &mut Tools<'_, N>,
        canvas: &mut [u8],
        profile: &mut impl Profile,
    ) -> Option<FrameReading> {
        let (track, place) = (self.track?, Lattice::through(&self.corners()?));
        if place.is_close_to(&location.spots.lattice) {
            self.track = Some(track.trusted());
            return None;
        }
        let (before, learnt, around) = (self.clone(), tools.likelihood.experience(), *tools.surroundings);
        tools.likelihood.forget_leds();
        let found = self.begin(number, frame, location, tools, canvas, profile);
        let lies_between_lines = track.explains_little() && place.is_beside(&location.spots.lattice, WIDTH);
        let least = track.trust().min(if lies_between_lines { SURE } else { 1.0 });
        let is_surer = |reading: &FrameReading| reading.detection.confidence > least;
        let found = found.ok().filter(is_surer);
        if found.is_none() {
            self.go_back(before, tools);
            tools.likelihood.set_experience(learnt);
            *tools.surroundings = around;
        }
        found
    }

    /// Returns to the state `before`.
    fn go_back<const N: usize>(&mut self, before: Self, tools: &mut Tools<'_, N>) {
        let grid = before.view.grid;
        let track = before.track.and_then(|track| {
            let view = self.look_at(&grid.lattice_to_frame(&track.spots().lattice), tools)?;
            Some(track.seen_in(&grid, &view.grid, view.frame_size()))
        });
        *self = Self {
            track,
            view: self.view,
            cells: None,
            ..before
        };
    }

    /// Reads a panel that was just found, and follows it.
    pub fn begin<const N: usize>(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        location: &Location,
        tools: &mut Tools<'_, N>,
        canvas: &mut [u8],
        profile: &mut impl Profile,
    ) -> Result<FrameReading, Loss> {
        self.watch((frame.width(), frame.height()));
        self.forget_places();
        *tools.surroundings = Surroundings::UNKNOWN;
        let out_of_frame = TrackError::OutOfFrame;
        let view = self.look_at(&location.spots.lattice, tools);
        let view = view.ok_or(out_of_frame)?;
        let drawn = view.draw(frame, canvas).ok_or(out_of_frame)?;
        let track = Track::new(location.spots, number, self.frame_size).amid_clutter(location.is_amid_clutter);
        #[cfg(feature = "surroundings")]
        let track = match self.found.replace((number, location.spots.lattice)) {
            Some((before, place)) => track.coming_from(before, &place),
            None => track,
        };
        let track = track.seen_in(&Grid::FRAME, &view.grid, view.frame_size());
        let spots = track.spots();
        let reading = self
            .read(&drawn, &spots.lattice, tools.map, profile)
            .and_then(|reading| self.read_well(&drawn, spots, reading, tools, profile))
            .map_err(|loss| view.loss_in_frame(loss, self.frame_size))?;
        tools.surroundings.learn(frame, &location.spots.lattice, reading.detection.bits);
        self.track = Some(track);
        #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
        let reading = self.without_shadows(frame, reading, reading.detection.confidence, tools, canvas, profile);
        self.in_frame(reading)
    }

    /// The bits of a reading in the view, read again without the shadows across the panel, if that makes them surer than the bits were
    /// before any doubt in their place. Their confidence does not change, because bits become surer without shadows at a wrong place, too.
    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    fn without_shadows<const N: usize>(
        &self,
        frame: &Frame<'_>,
        reading: FrameReading,
        undoubted: f32,
        tools: &mut Tools<'_, N>,
        canvas: &mut [u8],
        profile: &mut impl Profile,
    ) -> FrameReading {
        if self.method != Method::MaximumLikelihood || undoubted > SURE_IN_SHADOWS {
            return reading;
        }
        let again = profile.timed(Stage::Detect, || {
            let lattice = Lattice::through(&reading.corners);
            let spots = LatticeModel {
                lattice,
                ..*self.track.as_ref()?.spots()
            };
            let in_frame = self.view.grid.spots_to_frame(&spots);
            let shade = tools.likelihood.shade_on(frame, &in_frame)?.on(lattice);
            let drawn = self.view.draw(frame, canvas)?;
            let Tools { likelihood, before, .. } = &mut *tools;
            likelihood.detect_without(shade, before, &drawn, &reading.corners, spots.sigma).ok()
        });
        match again.filter(|again| again.confidence > undoubted) {
            Some(again) => FrameReading {
                detection: reading.detection.with_bits_of(&again),
                ..reading
            },
            None => reading,
        }
    }

    /// Sets the size of the frames.
    fn watch(&mut self, frame_size: (usize, usize)) {
        if self.frame_size != frame_size {
            (self.frame_size, self.cells) = (frame_size, None);
            self.forget_find();
        }
    }

    /// Reads the panel on `lattice`, with the configured method if `is_read_well`, and corrects the track by the frame.
    fn attempt<const N: usize>(
        &mut self,
        track: &Track,
        lattice: Lattice,
        gate: Gate,
        is_read_well: bool,
        input: &mut Input<'_, '_, '_, N>,
        profile: &mut impl Profile,
    ) -> Result<CorrectedTrack, Loss> {
        let mut reading = self
            .read(input.frame, &lattice, input.tools.map, profile)
            .map_err(|loss| match loss {
                Loss::Detect(why) => TrackError::from(why).into(),
                other => other,
            })?;
        if is_read_well {
            let Input { frame, tools, .. } = &mut *input;
            let spots = LatticeModel { lattice, ..*track.spots() };
            reading = self.read_well(frame, &spots, reading, tools, profile)?;
        }
        let bits = reading.detection.bits;
        let observation = observation(input.frame, input.locator);
        let corrected = profile.timed(Stage::Follow, || {
            track.corrected(
                input.number,
                observation,
                [lattice, input.expected],
                bits.shares(),
                gate,
                input.tools.residuals,
            )
        });
        let (track, explained) = corrected?;
        Ok(CorrectedTrack {
            track,
            reading,
            explained,
            is_read_well,
        })
    }

    /// Reads the panel with a fast detector, which suffices for following it.
    fn read<const N: usize>(
        &mut self,
        frame: &Frame<'_>,
        lattice: &Lattice,
        map: &mut CellMap<N>,
        profile: &mut impl Profile,
    ) -> Result<FrameReading, Loss> {
        let corners = Corners::new(lattice.corners()).map_err(TrackError::from)?;
        if !self.cells.is_some_and(|built| are_close(&built, &corners)) {
            profile.timed(Stage::Cells, || self.build(corners, map))?;
        }
        let features = profile.timed(Stage::Features, || Features::measure(frame, map))?;
        check_white(&features)?;
        let detector = match self.method {
            Method::Features(detector) => detector,
            Method::MaximumLikelihood => Detector::default(),
        };
        let detection: Detection = profile.timed(Stage::Detect, || detector.detect(&features))?;
        Ok(FrameReading { corners, detection })
    }

    /// Whether the LEDs overlap so much that only maximum likelihood gives bits that can correct the track.
    fn reads_well_at_once(&self, track: &Track) -> bool {
        self.method == Method::MaximumLikelihood && track.is_blurred()
    }

    /// Rebuilds the cells of a panel.
    // Not inlined, so that a microcontroller's flash has only one copy.
    #[inline(never)]
    fn build<const N: usize>(&mut self, corners: Corners, map: &mut CellMap<N>) -> Result<(), CellsError> {
        self.cells = None;
        if !self.view.is_whole() {
            self.view.check_cells(&corners, self.frame_size)?;
        }
        let [width, height] = self.view.size;
        map.build(&corners, width, height)?;
        self.cells = Some(corners);
        Ok(())
    }

    /// Reads a panel at a known place with the configured method; `fast` is the reading with which it was followed.
    fn read_well<const N: usize>(
        &self,
        frame: &Frame<'_>,
        spots: &LatticeModel,
        fast: FrameReading,
        tools: &mut Tools<'_, N>,
        profile: &mut impl Profile,
    ) -> Result<FrameReading, Loss> {
        if self.method != Method::MaximumLikelihood {
            return Ok(fast);
        }
        let corners = Corners::new(spots.lattice.corners()).map_err(TrackError::from)?;
        let detection = profile.timed(Stage::Detect, || {
            let Tools { likelihood, before, .. } = &mut *tools;
            likelihood.detect_after(before, frame, &corners, Some(spots.sigma))
        })?;
        Ok(FrameReading { corners, detection })
    }

    /// Reads at a given place from now on.
    pub fn place<const N: usize>(
        &mut self,
        corners: Corners,
        frame_size: (usize, usize),
        locator: &Locator,
        tools: &mut Tools<'_, N>,
    ) -> Result<(), CellsError> {
        (self.track, self.cells, self.seen) = (None, None, None);
        self.forget_find();
        self.forget_places();
        *tools.surroundings = Surroundings::UNKNOWN;
        self.watch(frame_size);
        let lattice = Lattice::through(&corners);
        let [across, _] = lattice.pitch();
        let spots = spots_on(lattice, locator.spot_sigma_px().max(DISC * across));
        let view = self.look_at(&lattice, tools);
        let view = view.ok_or_else(|| View::whole(frame_size).outside_frame(&corners))?;
        let seen = view.grid.corners_from_frame(&corners).unwrap_or(corners);
        self.build(seen, tools.map)
            .map_err(|error| view.error_in_frame(error, frame_size))?;
        let track = Track::placed(spots, frame_size);
        let track = track.seen_in(&Grid::FRAME, &view.grid, view.frame_size());
        (self.track, self.seen) = (Some(track), Some(corners));
        Ok(())
    }
}

/// A track corrected with both symbols of a mixture, as far as they are known: either symbol alone would correct it wrongly.
fn corrected_by_both<const N: usize>(track: &Track, mixture: &Mixture, input: &mut Input<'_, '_, '_, N>) -> Option<Track> {
    let (number, place) = (input.number, input.expected);
    let observation = observation(input.frame, input.locator);
    let residuals = &mut *input.tools.residuals;
    let corrected = track.corrected(number, observation, [place; 2], mixture.lit()?, Gate::SURE, residuals);
    corrected.ok().map(|(corrected, _)| corrected)
}

/// Spots on a lattice without any other knowledge.
fn spots_on(lattice: Lattice, sigma: f32) -> LatticeModel {
    LatticeModel {
        lattice,
        sigma,
        background: 1.0,
        off: 0.0,
        contrast: 1.0,
        state: [0.0; LEDS],
    }
}

fn observation<'a, 'f>(frame: &'a Frame<'f>, locator: &'a Locator) -> Observation<'a, 'f> {
    Observation {
        frame,
        earlier: None,
        metric: locator.metric(),
        within: None,
        shade: None,
    }
}

/// Whether the frame has room for another line of LEDs on all sides of a lattice.
fn has_room(lattice: &Lattice, frame: &Frame<'_>) -> bool {
    let extent = lattice.extent(LINE_ROOM);
    let limit = [frame.width(), frame.height()];
    (0..2).all(|i| {
        let (low, high) = (lattice.centre[i] - 0.5 * extent[i], lattice.centre[i] + 0.5 * extent[i]);
        low >= 0.0 && high < limit[i] as f32
    })
}

fn are_close(a: &Corners, b: &Corners) -> bool {
    let limit = SAME_CELLS * a.pitch_px();
    let (a, b) = (a.points(), b.points());
    a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < limit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Scene;
    use link::camera::Camera;
    use link::panel::PanelFrame;
    use std::boxed::Box;

    #[test]
    fn where_nothing_was_read_only_bits_like_a_messages_tell_a_panel_from_an_edge() {
        let followed = |bits: u64, explained: f32| -> Result<CorrectedTrack, Loss> {
            let corners = Scene::PLAIN.corners();
            let spots = spots_on(Lattice::through(&corners), 1.5);
            let detection = Detection::new(PanelFrame::from_bits(bits), [20.0; LEDS]);
            Ok(CorrectedTrack {
                track: Track::new(spots, 0, (96, 96)),
                reading: FrameReading { corners, detection },
                explained,
                is_read_well: false,
            })
        };
        let lost = || Err(TrackError::OutOfFrame.into());
        // No LED On, all On, and five whole rows.
        for edge in [0, u64::MAX, 0xffff_ffff_ff00_0000] {
            assert!(better(lost(), followed(edge, 0.9)).is_err());
        }
        assert!(better(lost(), followed(Scene::PLAIN.bits, 0.9)).is_ok());
        // If both places are read, only the light decides.
        let both = better(followed(Scene::PLAIN.bits, 0.5), followed(0, 0.9));
        assert!(both.is_ok_and(|followed| followed.explained == 0.9));
    }

    #[cfg(feature = "surroundings")]
    #[test]
    fn a_place_that_explains_little_light_raises_doubts() {
        let scene = Scene {
            pitch_px: 10.0,
            blur_px: [1.0; 2],
            ..Scene::PLAIN
        };
        let rendered = scene.render();
        let frame = rendered.frame();
        let locator = Locator::new(Camera::default()).unwrap();
        let lattice = Lattice::through(&scene.corners());
        let followed_with = |bits: u64| {
            let track = Track::new(spots_on(lattice, 2.5), 0, (scene.width, scene.height));
            let shares = PanelFrame::from_bits(bits).shares();
            let mut residuals = Box::new(Residuals::<9216>::new());
            let corrected = track.corrected(1, observation(&frame, &locator), [lattice; 2], shares, Gate::STILL, &mut residuals);
            let mut reader = Reader::new(Method::MaximumLikelihood, TrackingSettings::DEFAULT);
            reader.track = Some(corrected.unwrap().0);
            reader
        };
        assert!(!followed_with(scene.bits).is_doubtful());
        assert!(followed_with(scene.bits ^ 0x8181_8181_8181_8181).is_doubtful());
    }
}
