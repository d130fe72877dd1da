//! Encodes a message to the endless sequence of panels that shows it.

use super::header::{Announcement, Header, message_crc};
use super::{FramingError, Layout, MESSAGE_MAX, OVERHEAD_PANELS, SYNC};
use crate::fec::{CODEWORD_PANELS_MAX, Code};
use crate::geometry::Geometry;
use crate::panel::PanelFrame;
use crate::scramble;

const SEGMENT_PANELS_MAX: usize = OVERHEAD_PANELS + CODEWORD_PANELS_MAX;

/// A panel of known size shows its size after the first of every this many repeats.
const GEOMETRY_REPEATS: u32 = 16;

/// The panels of one message, or of a beacon, repeated without end.
///
/// It owns a copy of the message and codes one segment at a time, at that segment's start: 1 280 bytes in total.
///
/// ```
/// use link::{fec::Code, framing::Framer};
/// let mut framer = Framer::new(b"Hello, road", Code::for_length(11), false)?;
/// let first: Vec<_> = (0..framer.panels_per_repeat()).map(|_| framer.next_panel()).collect();
/// assert_eq!(framer.repeats(), 1);
/// // The second repeat is the complement of the first.
/// assert!(first.iter().all(|panel| framer.next_panel().bits() == !panel.bits()));
/// # Ok::<(), link::framing::FramingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Framer {
    message: [u8; MESSAGE_MAX],
    content: Announcement,
    /// Whether the current segment is the panel's size rather than content.
    tells_geometry: bool,
    segment: u8,
    repeats: u32,
    /// The transmitted panels of the current segment.
    shown: heapless::Vec<PanelFrame, SEGMENT_PANELS_MAX>,
    /// The number of them that were returned.
    given: usize,
}

impl Framer {
    /// The panels of `message` (1 to [`MESSAGE_MAX`] bytes) under `code`, see [`Code::for_length`].
    ///
    /// Toggle `fresh` with each new message: a receiver treats the same text with the same `fresh` as a repeat.
    ///
    /// # Errors
    ///
    /// [`FramingError`] if the message is empty or too long.
    pub fn new(message: &[u8], code: Code, fresh: bool) -> Result<Self, FramingError> {
        if message.is_empty() {
            return Err(FramingError::Empty);
        }
        let mut copy = [0; MESSAGE_MAX];
        let place = copy
            .get_mut(..message.len())
            .ok_or(FramingError::TooLong { length: message.len() })?;
        place.copy_from_slice(message);
        let header = Header {
            code,
            length: message.len() as u16,
            segment: 0,
            fresh,
            crc: message_crc(message),
        };
        Ok(Self::of(Announcement::Segment(header), copy))
    }

    /// The panels of an idle transmitter: sync and header, no payload.
    pub fn beacon() -> Self {
        Self::of(Announcement::Beacon, [0; MESSAGE_MAX])
    }

    fn of(content: Announcement, message: [u8; MESSAGE_MAX]) -> Self {
        Self {
            message,
            content,
            tells_geometry: false,
            segment: 0,
            repeats: 0,
            shown: heapless::Vec::new(),
            given: 0,
        }
    }

    /// The panel to show next; there is always one.
    pub fn next_panel(&mut self) -> PanelFrame {
        self.next_panel_of(None)
    }

    /// The panel to show next, for a panel of known size: three more panels after the first of every 16 repeats show the size, and belong
    /// to no repeat.
    ///
    /// ```
    /// use link::framing::{Deframer, Event, Framer};
    /// use link::geometry::Geometry;
    /// use link::{l2a_table::Interval, panel::SoftPanel};
    ///
    /// let geometry = Geometry::new(30_000, Interval::ONE)?;
    /// let (mut framer, mut deframer) = (Framer::beacon(), Deframer::new());
    /// let told = (0..6).any(|index| {
    ///     let seen = SoftPanel::certain(framer.next_panel_of(Some(geometry)), 12);
    ///     matches!(deframer.push(index, 0, &seen), Event::Geometry(read) if read == geometry)
    /// });
    /// assert!(told);
    /// # Ok::<(), link::geometry::GeometryError>(())
    /// ```
    pub fn next_panel_of(&mut self, geometry: Option<Geometry>) -> PanelFrame {
        if self.given == 0 {
            self.code_segment(geometry);
        }
        let panel = self.shown.get(self.given).copied().unwrap_or(SYNC);
        self.given += 1;
        if self.given >= self.shown.len() {
            self.given = 0;
            self.pass_to_next_segment();
        }
        panel
    }

    /// Panels that show the whole message once: 5 to 640, or 3 for a beacon.
    pub fn panels_per_repeat(&self) -> u32 {
        match self.content {
            Announcement::Segment(header) => header.layout().panels() as u32,
            Announcement::Beacon | Announcement::Geometry(_) | Announcement::Signature(_) => OVERHEAD_PANELS as u32,
        }
    }

    /// Whole repeats so far; wraps around after 2³².
    pub fn repeats(&self) -> u32 {
        self.repeats
    }

    /// The identity of its message in headers: `fresh` and the CRC-32C.
    pub(super) fn message_name(&self) -> (bool, u32) {
        match self.content {
            Announcement::Segment(header) => (header.fresh, header.crc),
            Announcement::Beacon | Announcement::Geometry(_) | Announcement::Signature(_) => (false, 0),
        }
    }

    fn code_segment(&mut self, geometry: Option<Geometry>) {
        let is_due = self.segment == 0 && self.repeats % GEOMETRY_REPEATS == 1;
        let told = geometry.filter(|_| is_due && !self.tells_geometry);
        self.tells_geometry = told.is_some();
        let (content, payload, number) = match (told, self.content) {
            (Some(geometry), _) => {
                let number = self.repeats / GEOMETRY_REPEATS;
                (Announcement::Geometry(geometry), None, number)
            }
            (None, Announcement::Segment(header)) => {
                let header = header.of_segment(self.segment);
                let number = u32::from(self.segment) ^ self.repeats;
                (Announcement::Segment(header), Some(self.payload(header)), number)
            }
            (None, content) => (content, None, self.repeats),
        };
        let shown = coded(content, payload.into_iter().flatten(), number);
        self.shown.clear();
        self.shown.extend(shown.take(SEGMENT_PANELS_MAX));
    }

    fn payload(&self, header: Header) -> impl Iterator<Item = PanelFrame> + use<> {
        let first = header.layout().first_byte(header.segment.into()).min(MESSAGE_MAX);
        header.block().encode(&self.message[first..])
    }

    fn pass_to_next_segment(&mut self) {
        if self.tells_geometry {
            return;
        }
        self.segment += 1;
        if usize::from(self.segment) >= self.segments() {
            self.segment = 0;
            self.repeats = self.repeats.wrapping_add(1);
        }
    }

    fn segments(&self) -> usize {
        match self.content {
            Announcement::Segment(header) => Layout::segments(header.layout()),
            Announcement::Beacon | Announcement::Geometry(_) | Announcement::Signature(_) => 1,
        }
    }
}

/// The panels of sync, header and payload, scrambled; in complement for odd numbers.
pub(super) fn coded(content: Announcement, payload: impl Iterator<Item = PanelFrame>, number: u32) -> impl Iterator<Item = PanelFrame> {
    let polarity = polarity_mask(number);
    let panels = core::iter::once(SYNC).chain(content.to_panels()).chain(payload);
    panels
        .enumerate()
        .map(move |(n, panel)| PanelFrame::from_bits(panel.bits() ^ scramble::word(n) ^ polarity))
}

/// The complement of every LED for odd numbers, 0 for even ones.
fn polarity_mask(number: u32) -> u64 {
    if number & 1 == 1 { u64::MAX } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::l2a_table::Interval;
    use properties::prelude::*;

    fn framer(code: u8, message: &[u8]) -> Framer {
        Framer::new(message, Code::from_value(code).unwrap(), false).unwrap()
    }

    /// The panels of the first `repeats` repeats.
    fn shown(mut framer: Framer, repeats: u32) -> Vec<PanelFrame> {
        (0..repeats * framer.panels_per_repeat()).map(|_| framer.next_panel()).collect()
    }

    /// The longest run of LED `led` in one state.
    fn longest_run(panels: &[PanelFrame], led: usize) -> usize {
        panels.chunk_by(|a, b| a.led(led) == b.led(led)).map(<[_]>::len).max().unwrap_or(0)
    }

    properties! {
        #[test]
        fn each_led_is_on_in_exactly_half_of_two_repeats_and_never_runs_longer_than_one(
            code in 0_u8..5, message in prop::collection::vec(any::<u8>(), 1..=1024), skipped in 0_u32..3,
        ) {
            let framer = framer(code, &message);
            let repeat = framer.panels_per_repeat() as usize;
            let panels = shown(framer, 5);
            let window = &panels[skipped as usize * repeat..][..2 * repeat];
            for led in 0..64 {
                prop_assert_eq!(window.iter().filter(|panel| panel.led(led)).count(), repeat);
                prop_assert!(longest_run(&panels, led) <= repeat);
            }
        }

        #[test]
        fn panels_that_repeat_their_data_differ_all_the_same(code in 0_u8..5, byte: u8, length in 1_usize..=1024) {
            let panels = shown(framer(code, &vec![byte; length]), 2);
            for pair in panels.windows(2) {
                prop_assert!(pair[0].distance(pair[1]) >= 8, "{} then {}", pair[0], pair[1]);
            }
        }
    }

    properties! {
        #[test]
        fn what_tells_the_size_lights_leds_half_of_the_time_and_leaves_the_message_as_it_is(
            message in prop::collection::vec(any::<u8>(), 1..=64), diameter_um in Geometry::LED_DIAMETER_UM, interval: u16,
        ) {
            let geometry = Geometry::new(diameter_um, Interval::from_bits(interval)).unwrap();
            let plain = framer(2, &message);
            let mut telling = plain.clone();
            let repeat = plain.panels_per_repeat() as usize;
            let half = GEOMETRY_REPEATS as usize * repeat + 3;
            let with_size: Vec<_> = (0..2 * half).map(|_| telling.next_panel_of(Some(geometry))).collect();
            let tells = |number: usize| (repeat..repeat + 3).contains(&(number % half));
            for led in 0..64 {
                let on = with_size.iter().enumerate().filter(|(number, panel)| tells(*number) && panel.led(led)).count();
                prop_assert_eq!(on, 3);
            }
            let message_alone = with_size.iter().enumerate().filter(|(number, _)| !tells(*number)).map(|(_, &panel)| panel);
            prop_assert!(message_alone.eq(shown(plain, 2 * GEOMETRY_REPEATS)));
            prop_assert_eq!(telling.repeats(), 2 * GEOMETRY_REPEATS);
        }
    }

    #[test]
    fn a_message_must_have_1_to_1024_bytes() {
        assert_eq!(Framer::new(&[], Code::Tc128, false).unwrap_err(), FramingError::Empty);
        let refusal = Framer::new(&[0; 1025], Code::Tc128, false).unwrap_err();
        assert_eq!(refusal, FramingError::TooLong { length: 1025 });
        assert!(Framer::new(&[0; 1024], Code::Tc128, false).is_ok());
    }

    #[test]
    fn the_sync_panel_begins_each_segment_in_alternating_polarity() {
        let panels = shown(framer(0, &[7; 24]), 3);
        let upright: Vec<_> = panels.iter().step_by(5).map(|panel| panel.bits() == SYNC.bits()).collect();
        assert_eq!(upright, [true, false, true, false, true, false, true, false, true]);
    }

    #[test]
    fn the_framer_is_as_small_as_documented() {
        assert!(size_of::<Framer>() <= 1280, "{}", size_of::<Framer>());
    }
}
