//! The whole pipeline: camera frames in, messages out.

mod backoff;
mod blinked;
#[cfg(feature = "carrier")]
mod coarser;
mod history;
mod integer;
mod levels;
#[cfg(feature = "carrier")]
mod lit;
mod memory;
#[cfg(not(feature = "maximum-likelihood"))]
mod no_likelihood;
mod outcome;
mod proof;
mod reader;
mod search;
mod settings;
mod signed;
#[cfg(test)]
mod tests;
mod view;

pub use crate::carrier::Reread;
pub use crate::locate::SearchMemory;
pub use crate::track::{TrackError, TrackErrorKind};
pub use integer::{BlinkSearch, BlinkSearchError, IntegerOutcome, IntegerReading, IntegerReceiver};
pub use memory::ReceiverMemory;
pub use outcome::{Loss, LossKind, Outcome, Reading};
pub use proof::Proof;
pub use search::{FrameSearch, NoSearch, Search};
pub use settings::{ReceiverError, ReceiverSettings};

use core::borrow::BorrowMut;

use crate::camera::Learnt;
use crate::cells::CellsError;
use crate::corners::Corners;
use crate::frame::Frame;
use crate::locate::{LocateError, Location, Locator};
use crate::profile::Profile;
use backoff::Backoff;
use heapless::Vec;
use link::framing::Event;
use link::panel::SoftPanel;
use memory::PanelMemory;
use reader::Reader;
use search::Query;
use signed::SignedDecoder;

/// Frames to messages, of up to `PANELS` panels at a time; of one, if nothing else is said.
///
/// A panel is looked for until it is found, and followed from then on: where it goes, as it grows, through short gaps. When it is lost for
/// [`patience_frames`](crate::settings::TrackingSettings::patience_frames) it is given up, and looked for anew from the next frame on. A
/// frame in which it cannot be read in its expected place gives no reading but a [`Loss`] that says why.
///
/// | parameter | what it says |
/// |---|---|
/// | `PIXELS` | how many a panel is read in: `9216` for any panel; with fewer, such as `4096`, near ones are read more coarsely. A search that begins with nothing has room for panels of 110 px with `25600`, with fewer for smaller ones, until larger pixels make them small |
/// | `M` | where its [memory](ReceiverMemory) is: `ReceiverMemory` itself, `&mut ReceiverMemory`, or a `Box` of it |
/// | `S` | how panels are found: [`FrameSearch`] looks for them; with [`NoSearch`] it waits for [`Receiver::place`] |
/// | `PANELS` | panels read at a time |
///
/// ```
/// use rx_pipeline::frame::Frame;
/// use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};
/// let memory = Box::<ReceiverMemory<4096>>::default();
/// let search = FrameSearch::with_history(Box::<SearchMemory>::default(), vec![0; 2 * 64 * 64]);
/// let mut receiver = Receiver::new(ReceiverSettings::default(), memory, search)?;
/// let outcome = receiver.frame(0, &Frame::new(&[118; 64 * 64], 64, 64)?);
/// let loss = outcome.reading.unwrap_err();
/// assert!(loss.to_string().starts_with("no candidate"));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
///
/// In parts of frames, for a panel whose place is known:
///
/// ```
/// use rx_pipeline::corners::Corners;
/// use rx_pipeline::frame::Frame;
/// use rx_pipeline::receiver::{Loss, NoSearch, Receiver, ReceiverMemory, ReceiverSettings};
/// let memory = Box::<ReceiverMemory<4096>>::default();
/// let mut receiver = Receiver::new(ReceiverSettings::default(), memory, NoSearch)?;
/// // The 40 × 40 pixels of a frame from (600, 300) on, without a panel.
/// let pixels = [118; 40 * 40];
/// let region = Frame::new(&pixels, 40, 40)?;
/// assert_eq!(receiver.region(0, [600, 300], &region, &mut ()).reading, Err(Loss::NoPlace));
///
/// let corners = Corners::new([[606.0, 306.0], [634.0, 306.0], [634.0, 334.0], [606.0, 334.0]])?;
/// receiver.place(corners, [600, 300], (40, 40))?;
/// assert!(matches!(receiver.region(1, [600, 300], &region, &mut ()).reading, Err(Loss::Coasting { .. })));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Receiver<const PIXELS: usize, M, S = NoSearch, const PANELS: usize = 1> {
    locator: Locator,
    panels: [Panel; PANELS],
    memory: M,
    search: S,
    /// Where in the camera's frames the last region began, and its size.
    window: ([u16; 2], (usize, usize)),
}

/// One panel's reception, but for what is in the [`ReceiverMemory`].
struct Panel {
    reader: Reader,
    decoder: SignedDecoder,
    /// When it is looked for although it is followed.
    again: Backoff,
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS, PANELS>>, S: Search<PIXELS>, const PANELS: usize>
    Receiver<PIXELS, M, S, PANELS>
{
    /// A receiver that has seen nothing.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range.
    pub fn new(settings: ReceiverSettings, mut memory: M, search: S) -> Result<Self, ReceiverError> {
        let (clock, locator) = (settings.clock()?, settings.locator()?);
        memory.borrow_mut().prepare(&settings);
        Ok(Self {
            locator,
            panels: core::array::from_fn(|_| Panel {
                reader: Reader::new(settings.method, settings.tracking),
                decoder: SignedDecoder::of(clock.clone()),
                again: Backoff::NONE,
            }),
            memory,
            search,
            window: ([0; 2], (0, 0)),
        })
    }

    /// Forgets everything and goes by other settings.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range; then nothing changes.
    // Not inlined: what it takes of a microcontroller's stack is free again before the next frame comes.
    #[inline(never)]
    pub fn begin(&mut self, settings: &ReceiverSettings) -> Result<(), ReceiverError> {
        let (clock, locator) = (settings.clock()?, settings.locator()?);
        self.locator = locator;
        for panel in &mut self.panels {
            panel.reader = Reader::new(settings.method, settings.tracking);
            panel.decoder.restart(clock.clone());
            panel.again = Backoff::NONE;
        }
        self.memory.borrow_mut().prepare(settings);
        self.search.forget();
        Ok(())
    }

    /// Takes in frame `number` and tells of each panel that was or is followed what the frame brought; and if there is room for one more,
    /// under the number of the panel that it would be, why none was found. Of a panel it tells once.
    ///
    /// Numbers rise; those that are left out are lost frames.
    pub fn frame_each<'a>(
        &'a mut self,
        number: u64,
        frame: &Frame<'_>,
        profile: &mut impl Profile,
        mut tell: impl FnMut(usize, Outcome<'a>),
    ) {
        let ReceiverMemory {
            panels,
            residuals,
            canvas,
            tiles,
        } = self.memory.borrow_mut();
        let mut known = Vec::<Corners, PANELS>::new();
        // The first panel that is not followed, unless this frame has just ended it.
        let mut vacant = None;
        // The first panel that may not be where it is followed, and what was read there.
        let (mut doubtful, mut is_any_doubtful) = (None, false);
        for (index, (panel, memory)) in self.panels.iter_mut().zip(panels).enumerate() {
            let Panel { reader, decoder, again } = panel;
            memory.expect_carrier(decoder.has_carrier());
            let tools = &mut memory.tools(residuals, tiles, decoder.before(number));
            let followed = reader.follow(number, frame, &self.locator, tools, canvas, profile);
            let misses_a_line = decoder.misses_a_line();
            if misses_a_line {
                reader.distrust();
            }
            let is_doubtful = reader.is_doubtful() && (misses_a_line || !decoder.reads_by_lines());
            is_any_doubtful |= is_doubtful;
            if !is_doubtful {
                again.calm_down();
            }
            // Two tracks on one panel are one too many.
            let twice = matches!(&followed, Some(Ok(Reading { corners, .. }))
                if known.iter().any(|other| overlap(other, corners)));
            match followed {
                Some(reading) if !twice && doubtful.is_none() && is_doubtful && again.is_due() => {
                    doubtful = Some((index, reader, decoder, again, memory, reading, misses_a_line));
                }
                Some(reading) if !twice => {
                    known.extend(reader.corners());
                    if !reader.is_following() {
                        vacant.get_or_insert(None);
                    }
                    tell(index, decoder.outcome(number, reading, profile));
                }
                _ => {
                    reader.forget();
                    vacant.get_or_insert(Some((index, reader, decoder, memory)));
                }
            }
        }
        let (are_all_followed, vacant) = (vacant.is_none(), vacant.flatten());
        if vacant.is_none() && doubtful.is_none() {
            if are_all_followed && !is_any_doubtful {
                self.search.forget();
            }
            return;
        }
        let query = Query {
            number,
            frame,
            locator: &self.locator,
            known: &known,
            residuals,
        };
        let mut found = self.search.find(query, profile);
        if let Some((index, reader, decoder, again, memory, mut reading, misses_a_line)) = doubtful {
            let place = reader.corners();
            let is_here = |location: &Location| place.is_some_and(|place| overlap(&place, &location.corners));
            // One that is followed a line off is near.
            let may_be_anywhere = vacant.is_none() && !misses_a_line;
            if let Ok(location) = &found
                && (may_be_anywhere || is_here(location))
            {
                let tools = &mut memory.tools(residuals, tiles, decoder.before(number));
                if let Some(elsewhere) = reader.find_again(number, frame, location, tools, canvas, profile) {
                    (reading, *again) = (Ok(elsewhere), Backoff::NONE);
                    decoder.move_panel();
                }
                found = Err(Loss::NoPlace);
            }
            again.wait_longer();
            known.extend(reader.corners());
            tell(index, decoder.outcome(number, reading, profile));
        }
        let Some((index, reader, decoder, memory)) = vacant else {
            return;
        };
        let tools = &mut memory.tools(residuals, tiles, decoder.before(number));
        let reading = found.and_then(|location| reader.begin(number, frame, &location, tools, canvas, profile));
        if reader.is_following() && known.len() + 1 == PANELS {
            self.search.forget();
        }
        // That there is no further panel is no loss.
        let nothing_more = matches!(
            reading,
            Err(Loss::NoPlace | Loss::Locate(LocateError::NothingStandsOut | LocateError::NoCandidate { .. }))
        );
        if known.is_empty() || !nothing_more {
            tell(index, decoder.outcome(number, reading, profile));
        }
    }

    /// Takes in the symbols that the last frames showed, of which [`Receiver::frame_each`] waits for the end.
    pub fn finish_each(&mut self, mut tell: impl FnMut(usize, Event<'_>)) {
        for (index, Panel { decoder, .. }) in self.panels.iter_mut().enumerate() {
            tell(index, decoder.finish());
        }
    }

    /// Where the panels were last seen that are followed, by their numbers.
    pub fn corners_each(&self) -> [Option<Corners>; PANELS] {
        self.panels.each_ref().map(|panel| panel.reader.corners())
    }

    /// What the frames have told of the camera and the LEDs, by the numbers of the panels; none of a panel that has not been read by
    /// maximum likelihood.
    pub fn learnt_each(&self) -> [Option<Learnt>; PANELS] {
        self.memory.borrow().panels.each_ref().map(PanelMemory::learnt)
    }

    /// Says that the frames from now on were taken so many frame periods later than their numbers say: see
    /// [`SymbolClock::set_late`](crate::symbols::SymbolClock::set_late).
    ///
    /// ```
    /// use rx_pipeline::receiver::{NoSearch, Receiver, ReceiverMemory, ReceiverSettings};
    /// let memory = Box::<ReceiverMemory<4096>>::default();
    /// let mut receiver = Receiver::new(ReceiverSettings::default(), memory, NoSearch)?;
    /// // A camera of 30 frames a second that took its 12th frame after 0.405 s.
    /// receiver.set_late(0.405 * 30.0 - 12.0);
    /// # Ok::<(), rx_pipeline::receiver::ReceiverError>(())
    /// ```
    #[cfg(feature = "time-stamps")]
    pub fn set_late(&mut self, frames: f64) {
        for panel in &mut self.panels {
            panel.decoder.set_late(frames);
        }
    }

    /// Goes by lines of the camera that are each exposed later than the one above by `delay` exposures, until frames show otherwise:
    /// negative where lines are read from below; 0, which is final, where all are exposed at once. A delay beyond
    /// ±[`LINE_DELAY_MAX`](crate::likelihood::LINE_DELAY_MAX) is not taken.
    ///
    /// ```
    /// use rx_pipeline::receiver::{NoSearch, Receiver, ReceiverMemory, ReceiverSettings};
    /// let memory = Box::<ReceiverMemory<4096>>::default();
    /// let mut receiver = Receiver::new(ReceiverSettings::default(), memory, NoSearch)?;
    /// // 20.4 ms from the first of 1080 lines to the last, exposed for 0.87 ms.
    /// receiver.tell_line_delay(20.4 / 1079.0 / 0.87);
    /// # Ok::<(), rx_pipeline::receiver::ReceiverError>(())
    /// ```
    #[cfg(feature = "read-lines")]
    pub fn tell_line_delay(&mut self, delay: f32) {
        for panel in &mut self.memory.borrow_mut().panels {
            panel.tell_line_delay(delay);
        }
    }

    /// Goes on in regions of `size` that begin at `origin`.
    fn move_to(&mut self, origin: [u16; 2], size: (usize, usize)) {
        if self.window == (origin, size) {
            return;
        }
        let before = self.window.0;
        let shift = [0, 1].map(|i| i32::from(before[i]) - i32::from(origin[i]));
        let memories = &mut self.memory.borrow_mut().panels;
        for (panel, memory) in self.panels.iter_mut().zip(memories) {
            panel.reader.shift(shift, size, &mut memory.map);
        }
        self.search.forget();
        self.window = (origin, size);
    }
}

/// One panel.
impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>, S: Search<PIXELS>> Receiver<PIXELS, M, S> {
    /// Takes in frame `number`. Numbers rise; those that are left out are lost frames.
    ///
    /// Messages carry as stamps the numbers of the frames that first showed their symbols.
    pub fn frame(&mut self, number: u64, frame: &Frame<'_>) -> Outcome<'_> {
        self.frame_timed(number, frame, &mut ())
    }

    /// The same, with somebody who takes the time of each stage.
    pub fn frame_timed(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> Outcome<'_> {
        let mut told = Outcome::NOTHING;
        self.frame_each(number, frame, profile, |_, outcome| told = outcome);
        told
    }

    /// Takes in the region of frame `number` that begins at `origin` (column and row). All positions in the outcome are the region's own.
    ///
    /// Numbers are as for [`Receiver::frame`]. Regions may begin elsewhere, and be of another size, from frame to frame: what is followed
    /// stays where it is in the camera's frame.
    pub fn region(&mut self, number: u64, origin: [u16; 2], region: &Frame<'_>, profile: &mut impl Profile) -> Outcome<'_> {
        self.move_to(origin, (region.width(), region.height()));
        self.frame_timed(number, region, profile)
    }

    /// Reads the panel at `corners` (in pixels of the camera's frame) from now on, until it is lost there, in regions that begin at
    /// `origin` and are `size` (width, height) px large; whole frames begin at `[0, 0]`.
    ///
    /// The panel is taken to be at rest: until two frames have shown how it moves, it may move by no more than 0.3 pitches a frame.
    ///
    /// # Errors
    /// [`CellsError`] if its cells do not fit into the region or the memory; then no panel is followed.
    pub fn place(&mut self, corners: Corners, origin: [u16; 2], size: (usize, usize)) -> Result<(), CellsError> {
        self.window = (origin, size);
        let [x, y] = origin.map(f32::from);
        // Corners beyond what can be reckoned with are outside of every region.
        let corners = corners.shifted(-x, -y).unwrap_or(corners);
        let ReceiverMemory {
            panels: [memory],
            residuals,
            tiles,
            ..
        } = self.memory.borrow_mut();
        let [panel] = &mut self.panels;
        let tools = &mut memory.tools(residuals, tiles, SoftPanel::ERASED);
        panel.reader.place(corners, size, &self.locator, tools)
    }

    /// Takes in the symbol that the last frames showed, of which [`Receiver::frame`] waits for the end.
    pub fn finish(&mut self) -> Event<'_> {
        let [panel] = &mut self.panels;
        panel.decoder.finish()
    }

    /// What the frames have told of the camera and the LEDs; none before the panel was read, or where the method is not maximum likelihood.
    pub fn learnt(&self) -> Option<Learnt> {
        let [learnt] = self.learnt_each();
        learnt
    }

    /// Follows the panel no more, if one is followed; what it has begun to say is not forgotten.
    pub fn give_up(&mut self) {
        let [panel] = &mut self.panels;
        panel.reader.forget();
    }

    /// Where the panel was last seen, while it is followed.
    pub fn corners(&self) -> Option<Corners> {
        let [panel] = &self.panels;
        panel.reader.corners()
    }
}

/// Whether the centre of one panel lies on the other.
fn overlap(a: &Corners, b: &Corners) -> bool {
    let [column, row] = a.homography().to_panel(b.centre_px().map(f64::from));
    (-0.5..=7.5).contains(&column) && (-0.5..=7.5).contains(&row)
}
