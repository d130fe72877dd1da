//! The sequence of panels: a message's repeats, then beacons.
//!
//! A [`Schedule`] always has a next panel. It shows beacons until there is a message and again after the message's last repeat, so that
//! receivers still detect an idle transmitter.
//!
//! **A new message starts at once**, with the next panel, wherever the old one is. On the road the newer message matters, and waiting for
//! the old one's end could take 640 panels: seven seconds at 90 a second. A receiver looks for the start of a segment at every panel, so it
//! misses nothing of the new message; only the interrupted segment is lost.
//!
//! Each message toggles the `fresh` bit of the headers: the same text sent again is delivered again.

#[cfg(feature = "signing")]
use link::framing::{Signature, SignedFramer};
use link::{
    fec::Code,
    framing::{Framer, FramingError},
    geometry::Geometry,
    panel::PanelFrame,
};

/// Only a transmitter with signing has memory for signatures.
#[cfg(feature = "signing")]
type Panels = SignedFramer;
#[cfg(not(feature = "signing"))]
type Panels = Framer;

/// The number of repeats of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Repeats {
    /// Until another message replaces it.
    Forever,
    /// This many repeats, then beacons. With an even number, every LED is On for exactly half of the time, except in the three panels that
    /// show a known size. 0 shows none.
    Times(u32),
}

/// The current message and its repeats.
///
/// ```
/// use link::fec::Code;
/// use tx_firmware::schedule::{Repeats, Schedule};
///
/// let mut schedule = Schedule::new();
/// let message = b"ice ahead";
/// schedule.send(message, Code::for_length(message.len()), Repeats::Times(2))?;
/// for _ in 0..2 * schedule.panels_per_repeat() {
///     assert!(schedule.is_sending());
///     schedule.next_panel();
/// }
/// assert!(!schedule.is_sending()); // beacons from here on
/// # Ok::<(), link::framing::FramingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Schedule {
    framer: Panels,
    /// `None` while beaconing.
    repeats: Option<Repeats>,
    fresh: bool,
}

impl Default for Schedule {
    fn default() -> Self {
        Self::new()
    }
}

impl Schedule {
    /// A schedule that shows beacons.
    pub fn new() -> Self {
        Self {
            framer: Panels::from(Framer::beacon()),
            repeats: None,
            fresh: false,
        }
    }

    /// Shows `message` (1 to 1024 bytes) under `code` from the next panel on, in place of the current content.
    ///
    /// # Errors
    /// [`FramingError`] if the message is empty or too long; the current content then continues.
    pub fn send(&mut self, message: &[u8], code: Code, repeats: Repeats) -> Result<(), FramingError> {
        let framer = Framer::new(message, code, !self.fresh)?;
        self.begin(Panels::from(framer), repeats);
        Ok(())
    }

    /// The same with a signature after each repeat of the message.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    #[cfg(feature = "signing")]
    pub fn send_signed(&mut self, message: &[u8], code: Code, repeats: Repeats, signature: Signature) -> Result<(), FramingError> {
        let framer = SignedFramer::new(message, code, !self.fresh, signature)?;
        self.begin(framer, repeats);
        Ok(())
    }

    fn begin(&mut self, framer: Panels, repeats: Repeats) {
        self.framer = framer;
        self.fresh = !self.fresh;
        self.repeats = Some(repeats);
    }

    /// Shows beacons from the next panel on.
    pub fn stop(&mut self) {
        self.framer = Panels::from(Framer::beacon());
        self.repeats = None;
    }

    /// The panel of the next symbol.
    pub fn next_panel(&mut self) -> PanelFrame {
        self.next_panel_of(None)
    }

    /// The panel to show next, with the panel's size if that is known: see [`Framer::next_panel_of`].
    pub fn next_panel_of(&mut self, geometry: Option<Geometry>) -> PanelFrame {
        if self.repeats.is_some() && !self.is_sending() {
            self.stop();
        }
        self.framer.next_panel_of(geometry)
    }

    /// Whether the next panel is one of a message.
    pub fn is_sending(&self) -> bool {
        match self.repeats {
            None => false,
            Some(Repeats::Forever) => true,
            Some(Repeats::Times(times)) => self.framer.repeats() < times,
        }
    }

    /// Panels per repeat of the last content, message or beacon.
    pub fn panels_per_repeat(&self) -> u32 {
        self.framer.panels_per_repeat()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use link::{
        framing::{Deframer, Event},
        panel::SoftPanel,
    };
    use properties::prelude::*;
    use std::{boxed::Box, vec, vec::Vec};

    const CODE: Code = Code::Tc256;

    fn take(schedule: &mut Schedule, panels: u32) -> Vec<PanelFrame> {
        (0..panels).map(|_| schedule.next_panel()).collect()
    }

    fn beacons(panels: u32) -> Vec<PanelFrame> {
        take(&mut Schedule::new(), panels)
    }

    /// The messages that a receiver delivers from `panels` without reading errors.
    fn delivered(panels: &[PanelFrame]) -> Vec<Vec<u8>> {
        let mut deframer = Box::new(Deframer::new());
        let mut messages = vec![];
        for (index, &panel) in (0u32..).zip(panels) {
            if let Event::Delivered(delivery) = deframer.push(index, 0, &SoftPanel::certain(panel, 20)) {
                messages.push(delivery.message.to_vec());
            }
        }
        messages
    }

    #[test]
    fn an_idle_schedule_beacons() {
        let mut framer = Framer::beacon();
        let expected: Vec<_> = (0..12).map(|_| framer.next_panel()).collect();
        assert_eq!(beacons(12), expected);
    }

    #[test]
    fn a_message_is_shown_so_many_times_and_then_beacons() {
        for times in 0..4 {
            let mut schedule = Schedule::new();
            schedule.send(b"to be repeated", CODE, Repeats::Times(times)).unwrap();
            let mut framer = Framer::new(b"to be repeated", CODE, true).unwrap();
            let length = times * framer.panels_per_repeat();
            let expected: Vec<_> = (0..length).map(|_| framer.next_panel()).collect();
            assert_eq!(take(&mut schedule, length), expected);
            assert!(!schedule.is_sending());
            assert_eq!(take(&mut schedule, 9), beacons(9));
        }
    }

    #[test]
    fn forever_goes_on() {
        let mut schedule = Schedule::new();
        schedule.send(b"on and on", CODE, Repeats::Forever).unwrap();
        take(&mut schedule, 10_000);
        assert!(schedule.is_sending());
    }

    #[test]
    fn stopping_leads_to_beacons_at_once() {
        let mut schedule = Schedule::new();
        schedule.send(b"cut short", CODE, Repeats::Forever).unwrap();
        take(&mut schedule, 4);
        schedule.stop();
        assert_eq!(take(&mut schedule, 6), beacons(6));
    }

    #[test]
    fn a_refused_message_disturbs_nothing() {
        let mut schedule = Schedule::new();
        schedule.send(b"goes on", CODE, Repeats::Forever).unwrap();
        take(&mut schedule, 3);
        let mut undisturbed = schedule.clone();
        let refused = schedule.send(b"", CODE, Repeats::Forever);
        assert_eq!(refused, Err(FramingError::Empty));
        assert_eq!(take(&mut schedule, 30), take(&mut undisturbed, 30));
    }

    #[test]
    fn the_same_text_sent_anew_is_delivered_anew() {
        let mut schedule = Schedule::new();
        let mut panels = vec![];
        for _ in 0..3 {
            schedule.send(b"same", CODE, Repeats::Forever).unwrap();
            panels.extend(take(&mut schedule, 40));
        }
        assert_eq!(delivered(&panels), [b"same", b"same", b"same"]);
    }

    #[cfg(feature = "signing")]
    #[test]
    fn each_of_so_many_repeats_has_its_signature() {
        let signature = Signature {
            key: link::framing::KeyId([1; 4]),
            counter: 7,
            proof: [9; 64],
        };
        for times in 0..4 {
            let mut schedule = Schedule::new();
            let times_more = Repeats::Times(times);
            schedule.send_signed(b"to be repeated", CODE, times_more, signature).unwrap();
            let mut framer = SignedFramer::new(b"to be repeated", CODE, true, signature).unwrap();
            let length = times * framer.panels_per_repeat();
            let expected: Vec<_> = (0..length).map(|_| framer.next_panel()).collect();
            assert_eq!(take(&mut schedule, length), expected);
            assert!(!schedule.is_sending());
            assert_eq!(take(&mut schedule, 9), beacons(9));
        }
    }

    properties! {
        #[test]
        fn a_message_that_breaks_into_another_is_received_within_its_first_repeat(
            old in prop::collection::vec(any::<u8>(), 1..100), shown in 0u32..60,
            new in prop::collection::vec(any::<u8>(), 1..100),
        ) {
            prop_assume!(old != new);
            let mut schedule = Schedule::new();
            schedule.send(&old, Code::for_length(old.len()), Repeats::Forever).unwrap();
            let mut panels = take(&mut schedule, shown);
            schedule.send(&new, Code::for_length(new.len()), Repeats::Times(1)).unwrap();
            let repeat = schedule.panels_per_repeat();
            panels.extend(take(&mut schedule, repeat));
            prop_assert_eq!(delivered(&panels).pop(), Some(new));
        }
    }
}
