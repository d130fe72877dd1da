//! Symbols without jitter: a ring of panels between the program and hardware that shows one after another by itself.
//!
//! ```text
//! Transmitter::tick ─▶ PanelRing::push ─▶ │ ring in RAM │ ─▶ DMA ─▶ SPI ─▶ shift registers
//!                                                          ▲                    ▲
//!                             a counter, once a symbol ────┴── latch ───────────┘
//! ```
//!
//! A port implements [`PanelOutput`] by its counter and its DMA controller. The rest is the same for each chip: which place
//! is next, how many panels wait, how many have to be ready before the processor stops, and the start of a new timing between two symbols.
//!
//! The program calls [`PanelRing::begin_wanted_timing`] once a symbol, from an interrupt, and then pushes panels as long as
//! [`PanelRing::is_short_of`] is true. A late interrupt moves no edge while panels wait.

use link::{symbol_rate::SymbolRate, waveform::SymbolTiming};

/// Number of panels kept ready: a new message waits for at most these, and the program may be late by this many symbols.
pub const LEAD: usize = 3;

/// A counter that latches panels, and DMA that takes them from a ring in RAM.
pub trait PanelOutput {
    /// The hardware's form of a panel.
    type Entry: ?Sized;

    /// Capacity of the ring in panels: more than [`LEAD`] + 2.
    const PLACES: usize;

    /// Writes a panel to a place.
    fn put(&mut self, place: usize, panel: &Self::Entry);

    /// The place after the last one that the hardware has started.
    fn first_free(&self, timing: SymbolTiming) -> usize;

    /// Begins another timing. At most `room` panels may be shown again. Returns whether it has begun; if not, the ring calls it again at
    /// the next symbol.
    fn begin(&mut self, before: SymbolTiming, timing: SymbolTiming, room: usize) -> bool;
}

/// The writer's end of the ring.
#[derive(Debug)]
pub struct PanelRing<O> {
    output: O,
    next: usize,
    /// Panels that waited at the last check, and those pushed since. If more seem to wait, the ring ran empty.
    ahead: usize,
    timing: SymbolTiming,
    /// The timing that begins with one of the next symbols.
    wanted: Option<SymbolTiming>,
}

impl<O: PanelOutput> PanelRing<O> {
    /// Maximum number of panels made ready: all but the one being shifted.
    pub const LEAD_MAX: usize = O::PLACES - 2;

    /// The ring of hardware that has just started, with [`LEAD`] panels ready.
    pub const fn new(output: O, timing: SymbolTiming) -> Self {
        const { assert!(O::PLACES > LEAD + 2) }
        Self {
            output,
            next: LEAD,
            ahead: LEAD,
            timing,
            wanted: None,
        }
    }

    /// Appends a panel to the waiting ones.
    pub fn push(&mut self, panel: &O::Entry) {
        self.output.put(self.next, panel);
        self.next = (self.next + 1) % O::PLACES;
        self.ahead += 1;
    }

    /// Whether fewer panels wait than `lead`, or than the ring holds. A ring that ran empty continues at the hardware's place.
    pub fn is_short_of(&mut self, lead: usize) -> bool {
        let Some(waiting) = self.waiting() else {
            self.next = self.output.first_free(self.timing);
            self.ahead = 0;
            return true;
        };
        self.ahead = waiting;
        waiting < lead.min(Self::LEAD_MAX)
    }

    /// Requests another rate or waveform, from one of the next symbols on.
    pub fn set_timing(&mut self, timing: SymbolTiming) {
        self.wanted = Some(timing).filter(|timing| *timing != self.timing);
    }

    /// Switches to the requested timing. Call it at the beginning of a symbol.
    pub fn begin_wanted_timing(&mut self) {
        let Some(wanted) = self.wanted else { return };
        let waiting = self.waiting();
        // A ring that ran empty has no room, either.
        let room = waiting.map_or(0, |waiting| Self::LEAD_MAX.saturating_sub(waiting));
        if self.output.begin(self.timing, wanted, room) {
            self.timing = wanted;
            self.wanted = None;
            if waiting.is_some() {
                self.ahead = self.distance();
            }
        }
    }

    /// The number of panels to prepare before the processor stops for `stop_ms`.
    pub fn lead_before_stop(&self, stop_ms: u32) -> usize {
        // The faster of the two timings may still apply.
        let rate = self.timing.rate();
        lead_before_stop(self.wanted.map_or(rate, |wanted| wanted.rate().max(rate)), stop_ms)
    }

    /// The hardware.
    pub const fn output(&self) -> &O {
        &self.output
    }

    /// Panels that wait; `None` if the ring ran empty.
    fn waiting(&self) -> Option<usize> {
        let distance = self.distance();
        (distance <= self.ahead).then_some(distance)
    }

    fn distance(&self) -> usize {
        (self.next + O::PLACES - self.output.first_free(self.timing)) % O::PLACES
    }
}

/// The number of panels shown in `stop_ms`, and of those that are always ready.
///
/// ```
/// use link::symbol_rate::SymbolRate;
/// use tx_firmware::panel_ring::lead_before_stop;
/// assert_eq!(lead_before_stop(SymbolRate::DEFAULT, 410), 37 + 3); // 90 a second
/// ```
pub const fn lead_before_stop(rate: SymbolRate, stop_ms: u32) -> usize {
    (rate.millihertz() as u64 * stop_ms as u64).div_ceil(1_000_000) as usize + LEAD
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use properties::prelude::*;
    use std::{vec, vec::Vec};

    /// Hardware that takes a panel a symbol.
    #[derive(Debug)]
    struct Counter {
        places: [u32; Counter::PLACES],
        taken: usize,
        shown: Vec<u32>,
        ready_to_change: bool,
        /// Panels that it shows again when another timing begins, as far as there is room.
        again: usize,
        begun: Vec<(SymbolTiming, SymbolTiming, usize)>,
    }

    impl PanelOutput for Counter {
        type Entry = u32;
        const PLACES: usize = 16;

        fn put(&mut self, place: usize, panel: &u32) {
            self.places[place] = *panel;
        }

        fn first_free(&self, _: SymbolTiming) -> usize {
            self.taken
        }

        fn begin(&mut self, before: SymbolTiming, timing: SymbolTiming, room: usize) -> bool {
            self.begun.push((before, timing, room));
            if self.ready_to_change {
                self.taken = (self.taken + Self::PLACES - self.again.min(room)) % Self::PLACES;
            }
            self.ready_to_change
        }
    }

    impl Counter {
        fn symbol(&mut self) {
            self.shown.push(self.places[self.taken]);
            self.taken = (self.taken + 1) % Self::PLACES;
        }
    }

    /// The ring as it starts, with three dark panels.
    fn ring() -> PanelRing<Counter> {
        let counter = Counter {
            places: [0; Counter::PLACES],
            taken: 0,
            shown: vec![],
            ready_to_change: true,
            again: 0,
            begun: vec![],
        };
        PanelRing::new(counter, timing(90_000))
    }

    fn timing(millihertz: u32) -> SymbolTiming {
        SymbolTiming::still(SymbolRate::from_millihertz(millihertz).unwrap())
    }

    fn fill(ring: &mut PanelRing<Counter>, lead: usize, next: &mut u32) {
        while ring.is_short_of(lead) {
            ring.push(next);
            *next += 1;
        }
    }

    #[test]
    fn a_lead_beyond_the_ring_only_fills_it() {
        let mut next = 1;
        fill(&mut ring(), usize::MAX, &mut next);
        assert_eq!(next as usize + LEAD, 1 + PanelRing::<Counter>::LEAD_MAX);
        // Half a day at the greatest rate.
        assert!(lead_before_stop(SymbolRate::from_millihertz(300_000).unwrap(), 43_200_000) > 12_960_000);
    }

    #[test]
    fn a_full_ring_outlasts_a_stop() {
        let mut ring = ring();
        let mut next = 1;
        fill(&mut ring, PanelRing::<Counter>::LEAD_MAX, &mut next);
        let ready = PanelRing::<Counter>::LEAD_MAX;
        for _ in 0..ready {
            ring.output.symbol();
        }
        let expected: Vec<u32> = [0; LEAD].into_iter().chain(1..).take(ready).collect();
        assert_eq!(ring.output.shown, expected);
    }

    #[test]
    fn a_ring_that_ran_empty_goes_on_from_where_the_hardware_is() {
        let mut ring = ring();
        let mut next = 1;
        // By one symbol, by some, and by all but a round.
        for late in [1, 5, Counter::PLACES - LEAD - 1] {
            let first = next;
            for _ in 0..LEAD + late {
                ring.output.symbol();
            }
            let before = ring.output.shown.len();
            fill(&mut ring, LEAD, &mut next);
            for _ in 0..LEAD {
                ring.output.symbol();
            }
            assert_eq!(ring.output.shown[before..], [first, first + 1, first + 2], "late by {late}");
            fill(&mut ring, LEAD, &mut next);
        }
    }

    #[test]
    fn a_timing_is_asked_for_until_it_begins() {
        let mut ring = ring();
        ring.set_timing(timing(90_000));
        ring.begin_wanted_timing();
        assert!(ring.output.begun.is_empty(), "it has this timing");

        ring.output.ready_to_change = false;
        ring.set_timing(timing(45_000));
        ring.begin_wanted_timing();
        ring.output.ready_to_change = true;
        ring.begin_wanted_timing();
        ring.begin_wanted_timing();
        let room = PanelRing::<Counter>::LEAD_MAX - LEAD;
        assert_eq!(ring.output.begun, [(timing(90_000), timing(45_000), room); 2]);
    }

    #[test]
    fn panels_that_a_new_timing_shows_again_are_followed_by_the_waiting_ones() {
        // From no panel to more than there is room for.
        for again in 0..Counter::PLACES {
            let mut ring = ring();
            let mut next = 1;
            fill(&mut ring, 6, &mut next);
            for _ in 0..LEAD {
                ring.output.symbol();
            }
            ring.output.again = again;
            ring.set_timing(timing(45_000));
            ring.begin_wanted_timing();
            let shown = ring.output.shown.len();
            let repeated = again.min(PanelRing::<Counter>::LEAD_MAX - LEAD);
            for _ in 0..repeated {
                ring.output.symbol();
                fill(&mut ring, LEAD, &mut next);
            }
            for _ in 0..8 {
                fill(&mut ring, LEAD, &mut next);
                ring.output.symbol();
            }
            let expected: Vec<u32> = (1..=8).collect();
            assert_eq!(ring.output.shown[shown + repeated..], expected, "{again} panels again");
        }
    }

    #[test]
    fn a_timing_that_is_taken_back_never_begins() {
        let mut ring = ring();
        ring.set_timing(timing(45_000));
        ring.set_timing(timing(90_000));
        ring.begin_wanted_timing();
        assert!(ring.output.begun.is_empty());
    }

    #[test]
    fn before_a_stop_the_faster_timing_counts() {
        let mut ring = ring();
        assert_eq!(ring.lead_before_stop(100), 9 + LEAD);
        ring.set_timing(timing(45_000));
        assert_eq!(ring.lead_before_stop(100), 9 + LEAD);
        ring.set_timing(timing(180_000));
        assert_eq!(ring.lead_before_stop(100), 18 + LEAD);
    }

    #[test]
    fn no_room_is_left_in_a_full_ring_or_one_that_ran_empty() {
        let mut full = ring();
        fill(&mut full, PanelRing::<Counter>::LEAD_MAX, &mut 1);
        let mut empty = ring();
        for _ in 0..=LEAD {
            empty.output.symbol();
        }
        for mut ring in [full, empty] {
            ring.set_timing(timing(45_000));
            ring.begin_wanted_timing();
            assert_eq!(ring.output.begun[0].2, 0);
        }
    }

    properties! {
        /// The program is late by fewer symbols than panels wait.
        #[test]
        fn every_panel_is_shown_once_and_in_order(
            delays in prop::collection::vec(0usize..LEAD, 1..100), leads in prop::collection::vec(LEAD..14, 100),
        ) {
            let mut ring = ring();
            let mut next = 1;
            for (delay, lead) in delays.into_iter().zip(leads) {
                fill(&mut ring, lead, &mut next);
                for _ in 0..=delay {
                    ring.output.symbol();
                }
            }
            let shown = &ring.output.shown;
            let expected: Vec<u32> = [0; LEAD].into_iter().chain(1..).take(shown.len()).collect();
            prop_assert_eq!(shown, &expected);
        }
    }
}
