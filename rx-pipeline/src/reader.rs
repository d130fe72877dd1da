//! One panel, followed and read: the part of a receiver that each panel has its own of.

use crate::cells::{CellMap, CellsError};
use crate::corners::Corners;
use crate::detect::{Detection, Detector, Method};
use crate::features::Features;
use crate::frame::Frame;
use crate::lattice::Lattice;
use crate::likelihood::MaximumLikelihood;
use crate::locate::{Location, Locator};
use crate::profile::{Profile, Stage};
use crate::receiver::{Loss, Outcome, Reading, ReceiverError, ReceiverSettings};
use crate::spots::{Canvas, Scenery, Spots};
use crate::symbols::{Symbol, SymbolClock};
use crate::track::{STILL_FITS, SURELY_FITS, Track, TrackError};
use link::framing::{Deframer, Event};

/// The cells of a pose serve poses whose corners differ by less than this, in pixels.
const SAME_CELLS_PX: f32 = 0.02;

/// The large parts that it takes to read a panel.
pub(crate) struct Tools<'a, const N: usize> {
    pub map: &'a mut CellMap<N>,
    pub canvas: &'a mut Canvas<N>,
    pub likelihood: &'a mut MaximumLikelihood<N>,
}

/// A frame, and what it takes to read it.
struct Place<'a, 'f, 't, const N: usize> {
    number: u64,
    frame: &'a Frame<'f>,
    locator: &'a Locator,
    tools: &'a mut Tools<'t, N>,
}

/// The state of one panel's reception, but for its large parts.
#[derive(Clone, Debug)]
pub(crate) struct Reader {
    method: Method,
    clock: SymbolClock,
    track: Option<Track>,
    /// The pose that the cell map was built for.
    cells: Option<Corners>,
    seen: Option<Corners>,
}

impl Reader {
    pub fn new(settings: &ReceiverSettings) -> Result<Self, ReceiverError> {
        Ok(Self {
            method: settings.method,
            clock: SymbolClock::new(settings.symbols_per_frame)?,
            track: None,
            cells: None,
            seen: None,
        })
    }

    pub fn is_following(&self) -> bool {
        self.track.is_some()
    }

    pub fn corners(&self) -> Option<Corners> {
        self.track.and(self.seen)
    }

    /// Reads the panel where it is expected; `None` if none is followed.
    pub fn follow<const N: usize>(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        locator: &Locator,
        tools: &mut Tools<'_, N>,
        profile: &mut impl Profile,
    ) -> Option<Result<Reading, Loss>> {
        let mut track = self.track?;
        if !track.reaches(number, (frame.width(), frame.height())) {
            self.track = None;
            return None;
        }
        let mut at = Place {
            number,
            frame,
            locator,
            tools,
        };
        let expected = track.predicted(number);
        // As long as it is not known how the panel moves, its bits may look right a line off.
        let unsure = Err(TrackError::OffCourse { off_px: 0.0 }.into());
        let mut attempt = if track.speed_known() {
            self.attempt(&track, expected, SURELY_FITS, &mut at, profile)
        } else {
            unsure
        };
        if let Err(loss) = attempt {
            let near = profile.timed(Stage::Search, || {
                locator.locate_near(frame, &expected, track.spot_sigma_px())
            });
            attempt = match near {
                Some(near) if near.is_close_to(&expected) => {
                    self.attempt(&track, expected, STILL_FITS, &mut at, profile)
                }
                Some(near) => self.attempt(&track, near, SURELY_FITS, &mut at, profile),
                None => Err(loss),
            };
            if attempt.is_err() && !track.speed_known() {
                attempt = self.attempt(&track, expected, SURELY_FITS, &mut at, profile);
            }
        }
        let read = attempt.and_then(|(track, reading)| {
            let reading = self.read_well(frame, track.lattice(), reading, tools, profile)?;
            Ok((track, reading))
        });
        Some(match read {
            Ok((track, reading)) => {
                (self.track, self.seen) = (Some(track), Some(reading.corners));
                Ok(reading)
            }
            Err(loss) => {
                let going_on = track.miss();
                self.track = going_on.then_some(track);
                Err(match loss {
                    Loss::Coasting { why, .. } if going_on => Loss::Coasting {
                        missed: track.missed(),
                        why,
                    },
                    Loss::Coasting { why, .. } => Loss::Lost(why),
                    other => other,
                })
            }
        })
    }

    /// Reads a panel just found, and follows it.
    pub fn begin<const N: usize>(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        location: &Location,
        tools: &mut Tools<'_, N>,
        profile: &mut impl Profile,
    ) -> Result<Reading, Loss> {
        let lattice = &location.spots.lattice;
        let reading = self.read(frame, lattice, tools.map, profile)?;
        let reading = self.read_well(frame, lattice, reading, tools, profile)?;
        let track = Track::new(location.spots, number, (frame.width(), frame.height()));
        (self.track, self.seen) = (Some(track), Some(location.corners));
        Ok(reading)
    }

    /// Reads the panel on `lattice` and corrects the track by what the frame shows there.
    fn attempt<const N: usize>(
        &mut self,
        track: &Track,
        lattice: Lattice,
        share: f32,
        at: &mut Place<'_, '_, '_, N>,
        profile: &mut impl Profile,
    ) -> Result<(Track, Reading), Loss> {
        let reading = self
            .read(at.frame, &lattice, at.tools.map, profile)
            .map_err(|loss| match loss {
                Loss::Detect(why) => TrackError::from(why).into(),
                other => other,
            })?;
        let bits = reading.detection.bits;
        let scenery = Scenery {
            frame: at.frame,
            earlier: None,
            light: at.locator.light(),
        };
        let corrected = profile.timed(Stage::Follow, || {
            track.corrected(at.number, scenery, lattice, bits, share, at.tools.canvas)
        });
        Ok((corrected?, reading))
    }

    /// Reads the panel fast: well enough to follow it.
    fn read<const N: usize>(
        &mut self,
        frame: &Frame<'_>,
        lattice: &Lattice,
        map: &mut CellMap<N>,
        profile: &mut impl Profile,
    ) -> Result<Reading, Loss> {
        let corners = Corners::new(lattice.corners()).map_err(TrackError::from)?;
        if !self.cells.is_some_and(|built| are_close(&built, &corners)) {
            self.cells = None;
            profile.timed(Stage::Cells, || {
                map.build(&corners, frame.width(), frame.height())
            })?;
            self.cells = Some(corners);
        }
        let features = profile.timed(Stage::Features, || Features::measure(frame, map))?;
        let detector = match self.method {
            Method::Features(detector) => detector,
            Method::MaximumLikelihood(_) => Detector::default(),
        };
        let detection: Detection = profile.timed(Stage::Detect, || detector.detect(&features))?;
        Ok(Reading { corners, detection })
    }

    /// Reads a panel whose place is known as well as the method does; `fast` is what served to follow it.
    fn read_well<const N: usize>(
        &self,
        frame: &Frame<'_>,
        lattice: &Lattice,
        fast: Reading,
        tools: &mut Tools<'_, N>,
        profile: &mut impl Profile,
    ) -> Result<Reading, Loss> {
        let Method::MaximumLikelihood(_) = self.method else {
            return Ok(fast);
        };
        let corners = Corners::new(lattice.corners()).map_err(TrackError::from)?;
        let detection =
            profile.timed(Stage::Detect, || tools.likelihood.detect(frame, &corners))?;
        Ok(Reading { corners, detection })
    }

    /// Reads at a given place from now on.
    pub fn place<const N: usize>(
        &mut self,
        corners: Corners,
        frame_size: (usize, usize),
        spot_sigma_px: f32,
        map: &mut CellMap<N>,
    ) -> Result<(), CellsError> {
        (self.track, self.cells, self.seen) = (None, None, None);
        map.build(&corners, frame_size.0, frame_size.1)?;
        self.cells = Some(corners);
        let lattice = Lattice::through(&corners);
        let spots = Spots {
            lattice,
            sigma: spot_sigma_px,
            background: 1.0,
            off: 0.0,
            step: 1.0,
            state: [0; 64],
        };
        (self.track, self.seen) = (Some(Track::placed(spots, frame_size)), Some(corners));
        Ok(())
    }

    pub fn outcome<'a>(
        &mut self,
        number: u64,
        reading: Result<Reading, Loss>,
        deframer: &'a mut Deframer,
        profile: &mut impl Profile,
    ) -> Outcome<'a> {
        let read = reading.as_ref().ok();
        let ended = read.and_then(|Reading { detection, .. }| {
            if detection.mixed {
                self.clock.push_mixed(number, &detection.soft)
            } else {
                self.clock.push(number, &detection.soft)
            }
        });
        let symbol = read.and_then(|_| self.clock.current());
        profile.begins(Stage::Decode);
        let event = deframe(deframer, ended);
        profile.ends(Stage::Decode);
        Outcome {
            reading,
            symbol,
            event,
        }
    }

    pub fn finish<'a>(&mut self, deframer: &'a mut Deframer) -> Event<'a> {
        let ended = self.clock.flush();
        deframe(deframer, ended)
    }
}

fn deframe(deframer: &mut Deframer, ended: Option<Symbol>) -> Event<'_> {
    match ended {
        Some(symbol) => deframer.push(symbol.index, symbol.first_frame, &symbol.panel),
        None => Event::Nothing,
    }
}

fn are_close(a: &Corners, b: &Corners) -> bool {
    a.points()
        .iter()
        .flatten()
        .zip(b.points().iter().flatten())
        .all(|(a, b)| (a - b).abs() < SAME_CELLS_PX)
}

impl From<TrackError> for Loss {
    fn from(why: TrackError) -> Self {
        Self::Coasting { missed: 0, why }
    }
}
