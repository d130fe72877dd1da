//! The whole pipeline: camera frames in, messages out.

mod backoff;
mod blinked;
#[cfg(feature = "carrier")]
mod coarser;
mod history;
mod integer;
mod levels;
#[cfg(feature = "surroundings")]
mod line_watch;
mod memory;
#[cfg(not(feature = "maximum-likelihood"))]
mod no_likelihood;
mod outcome;
mod proof;
mod reader;
#[cfg(feature = "carrier")]
mod recent_levels;
mod search;
mod settings;
mod signed;
#[cfg(test)]
mod tests;
mod view;

#[cfg(feature = "carrier")]
pub use crate::carrier::CarrierCandidate;
#[cfg(feature = "carrier")]
pub use crate::carrier::GAP_MAX as CARRIER_GAP_MAX;
pub use crate::carrier::Reread;
pub use crate::locate::SearchMemory;
pub use crate::track::{TrackError, TrackErrorKind};
pub use integer::{BlinkSearch, BlinkSearchError, IntegerOutcome, IntegerReading, IntegerReceiver};
pub use memory::ReceiverMemory;
pub use outcome::{FrameReading, Loss, LossKind, Outcome};
pub use proof::Proof;
pub use search::{FrameSearch, NoSearch, Search};
pub use settings::{ReceiverError, ReceiverSettings};

use core::borrow::BorrowMut;

use crate::camera::CameraEstimate;
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

/// Decodes frames into messages, from up to `PANELS` panels at a time (by default one).
///
/// The receiver searches for a panel and then follows it as it moves and grows, also through short gaps. If a panel stays lost for
/// [`patience_frames`](crate::settings::TrackingSettings::patience_frames), the receiver gives it up and searches again from the next frame
/// on. A frame in which the panel cannot be read in its expected place yields a [`Loss`] with the reason instead of a reading.
///
/// | parameter | meaning |
/// |---|---|
/// | `PIXELS` | the number of pixels in which a panel is read: `9216` for any panel; with fewer, such as `4096`, near panels are read more coarsely. A search from scratch has room for panels of 110 px with `25600`, and for smaller ones with fewer; larger panels are found in larger pixels |
/// | `M` | where its [memory](ReceiverMemory) is: `ReceiverMemory` itself, `&mut ReceiverMemory`, or a `Box` of it |
/// | `S` | how panels are found: [`FrameSearch`] searches for them; with [`NoSearch`], the receiver waits for [`Receiver::place`] |
/// | `PANELS` | maximum number of panels at a time |
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
/// Reading parts of frames, for a panel whose place is known:
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
    /// The origin of the last region in the camera's frame, and its size.
    window: ([u16; 2], (usize, usize)),
}

/// The state of one panel's reception outside the [`ReceiverMemory`].
struct Panel {
    reader: Reader,
    decoder: SignedDecoder,
    /// Schedules searches for a panel that is already followed.
    again: Backoff,
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS, PANELS>>, S: Search<PIXELS>, const PANELS: usize>
    Receiver<PIXELS, M, S, PANELS>
{
    /// A receiver that has not seen a frame.
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

    /// Forgets everything and continues with other settings.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range; then nothing changes.
    // Not inlined, so that a microcontroller's stack is free again before the next frame arrives.
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

    /// Processes frame `number` and reports the outcome for each panel that was or is followed, once per panel. If there is room for one
    /// more panel, reports the reason why none was found, under the number that it would have.
    ///
    /// Numbers rise; omitted numbers are lost frames.
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
        // The first free place for a panel, unless this frame has just freed it.
        let mut vacant = None;
        // The first panel that may be elsewhere, and its reading.
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
                again.shorten();
            }
            // Two tracks of one panel: drop the second.
            let twice = matches!(&followed, Some(Ok(FrameReading { corners, .. }))
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
            // A panel that is followed one line off is nearby.
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
        // The absence of another panel is not a loss.
        let nothing_more = matches!(
            reading,
            Err(Loss::NoPlace | Loss::Locate(LocateError::NothingStandsOut | LocateError::NoCandidate { .. }))
        );
        if known.is_empty() || !nothing_more {
            tell(index, decoder.outcome(number, reading, profile));
        }
    }

    /// Decodes the symbols of the last frames, which [`Receiver::frame_each`] holds back until they are complete.
    pub fn finish_each(&mut self, mut tell: impl FnMut(usize, Event<'_>)) {
        for (index, Panel { decoder, .. }) in self.panels.iter_mut().enumerate() {
            tell(index, decoder.finish());
        }
    }

    /// The last corners of each followed panel, by panel number.
    pub fn corners_each(&self) -> [Option<Corners>; PANELS] {
        self.panels.each_ref().map(|panel| panel.reader.corners())
    }

    /// The learnt camera and LEDs, by panel number; none for a panel that has not been read by maximum likelihood.
    pub fn learnt_each(&self) -> [Option<CameraEstimate>; PANELS] {
        self.memory.borrow().panels.each_ref().map(PanelMemory::learnt)
    }

    /// Whether each panel seems to have a carrier, by panel number.
    pub fn has_carrier_each(&self) -> [bool; PANELS] {
        self.panels.each_ref().map(|panel| panel.decoder.has_carrier())
    }

    /// Continues with one of the carriers that explain the frames about equally well, because its readings [prove](Reread::is_proof) it. A
    /// panel that does not exist is ignored.
    #[cfg(feature = "carrier")]
    pub fn confirm_carrier(&mut self, panel: usize, carrier: &CarrierCandidate) {
        if let Some(panel) = self.panels.get_mut(panel) {
            panel.decoder.confirm_carrier(carrier);
        }
    }

    /// Sets the delay, in frame periods, of the next frames after the times that their numbers imply: see
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

    /// Sets the initial delay of each line after the one above, in exposures, until frames show another. It is negative if lines are read
    /// from below; 0, which is final, means a global shutter. A delay beyond ±[`LINE_DELAY_MAX`](crate::likelihood::LINE_DELAY_MAX) is
    /// ignored.
    ///
    /// ```
    /// use rx_pipeline::receiver::{NoSearch, Receiver, ReceiverMemory, ReceiverSettings};
    /// let memory = Box::<ReceiverMemory<4096>>::default();
    /// let mut receiver = Receiver::new(ReceiverSettings::default(), memory, NoSearch)?;
    /// // 20.4 ms from the first of 1080 lines to the last, exposed for 0.87 ms.
    /// receiver.set_line_delay(20.4 / 1079.0 / 0.87);
    /// # Ok::<(), rx_pipeline::receiver::ReceiverError>(())
    /// ```
    #[cfg(feature = "read-lines")]
    pub fn set_line_delay(&mut self, delay: f32) {
        for panel in &mut self.memory.borrow_mut().panels {
            panel.set_line_delay(delay);
        }
    }

    /// Continues with regions of `size` that begin at `origin`.
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

/// The methods for a receiver of one panel.
impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>, S: Search<PIXELS>> Receiver<PIXELS, M, S> {
    /// Processes frame `number`. Numbers rise; omitted numbers are lost frames.
    ///
    /// Messages are stamped with the numbers of the frames that first showed their symbols.
    pub fn frame(&mut self, number: u64, frame: &Frame<'_>) -> Outcome<'_> {
        self.frame_timed(number, frame, &mut ())
    }

    /// Processes a frame like [`Receiver::frame`], with a `profile` that measures the time of each stage.
    pub fn frame_timed(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> Outcome<'_> {
        let mut told = Outcome::NOTHING;
        self.frame_each(number, frame, profile, |_, outcome| told = outcome);
        told
    }

    /// Processes the region of frame `number` that begins at `origin` (column and row). All positions in the outcome are relative to the
    /// region.
    ///
    /// Numbers are as for [`Receiver::frame`]. Regions may change their origin and size from frame to frame: a followed panel keeps its
    /// place in the camera's frame.
    pub fn region(&mut self, number: u64, origin: [u16; 2], region: &Frame<'_>, profile: &mut impl Profile) -> Outcome<'_> {
        self.move_to(origin, (region.width(), region.height()));
        self.frame_timed(number, region, profile)
    }

    /// Reads the panel at `corners` (in pixels of the camera's frame) from now on, until it is lost there. The regions begin at `origin`
    /// and are `size` (width, height) px large; whole frames begin at `[0, 0]`.
    ///
    /// The panel is assumed to be at rest: until two frames have shown its motion, it may move by at most 0.3 pitches a frame.
    ///
    /// # Errors
    /// [`CellsError`] if its cells do not fit into the region or the memory; then no panel is followed.
    pub fn place(&mut self, corners: Corners, origin: [u16; 2], size: (usize, usize)) -> Result<(), CellsError> {
        self.window = (origin, size);
        let [x, y] = origin.map(f32::from);
        // Corners beyond the numeric range are outside every region.
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

    /// Decodes the symbol of the last frames, which [`Receiver::frame`] holds back until it is complete.
    pub fn finish(&mut self) -> Event<'_> {
        let [panel] = &mut self.panels;
        panel.decoder.finish()
    }

    /// The learnt camera and LEDs; none before the panel was read, or if the method is not maximum likelihood.
    pub fn learnt(&self) -> Option<CameraEstimate> {
        let [learnt] = self.learnt_each();
        learnt
    }

    /// Stops following the panel, if one is followed. A message that it has begun is kept.
    pub fn give_up(&mut self) {
        let [panel] = &mut self.panels;
        panel.reader.forget();
    }

    /// The last corners of the panel, if one is followed.
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
