//! Decides whether something that was found by its blinking is a panel.
//!
//! Lamps of a sign that all switch together, a lit window or a moving edge can look like 64 LEDs for a moment. A panel differs: it shows
//! one symbol after another, each with a different half of its LEDs On, and they form frames of the link. It must keep doing so: after a
//! knock, LEDs of a panel that is now elsewhere may lie where others were.

use crate::corners::Corners;
use link::framing::Event;
use link::panel::LEDS;

/// Symbols in which a place has to prove that it is a panel, again after each proof.
const PROOF_SYMBOLS: u32 = 30;
/// Minimum number of symbols for a proof by blinking.
const LEAST_SYMBOLS: u32 = 16;
/// Maximum number of LEDs that have not blinked, because they are broken.
const MOST_STILL: usize = 4;
/// An LED blinks if it is On in at least one sixth of the symbols, and Off in at least one sixth. A panel's LED fails this once in 240
/// times (16 symbols) to once in 17 000 times (30 symbols). Of the LEDs that an edge moves over, one row is On at a time, which is one
/// eighth.
const LEAST_PART: u32 = 6;
/// Minimum number of LEDs that differ between two symbols; readings of one symbol differ in fewer.
const OTHER_SYMBOL: u32 = 13;
/// Number of symbols for which a place that has proved to be no panel is skipped.
const REST_SYMBOLS: u32 = 90;
/// Number of symbols for which a place that was lost before a proof is skipped, so that others get their turn.
const SHORT_REST_SYMBOLS: u32 = 15;
/// Number of skipped places that are stored.
const PLACES: usize = 4;

/// The number of frames in which the symbols of a proof are shown, at a rate above 0.
pub fn proof_frames(symbols_per_frame: f32) -> u64 {
    ((PROOF_SYMBOLS as f32 / symbols_per_frame) as u64).saturating_add(1)
}

/// The symbols of a place since it was found.
#[derive(Clone, Copy)]
pub struct BlinkHistory {
    /// The frame in which it was found, or last proved to be a panel.
    since: u64,
    /// The last frame that was judged.
    latest: u64,
    /// Whether it has proved to be a panel before.
    was_panel: bool,
    is_proved: bool,
    symbols: u32,
    last: u64,
    /// For each LED, the number of symbols in which it was On.
    on: [u8; LEDS],
}

/// The judgement of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It has not shown enough symbols.
    Unsure,
    /// A panel.
    Panel,
    /// It was a panel, and has not proved to be one for the duration of a proof.
    Gone,
    /// It is not a panel.
    Other,
}

impl BlinkHistory {
    /// The state of a place that was found in that frame.
    pub fn new(found: u64) -> Self {
        Self {
            since: found,
            latest: found,
            was_panel: false,
            is_proved: false,
            symbols: 0,
            last: 0,
            on: [0; LEDS],
        }
    }

    /// Adds a reading's bits, whose two groups of LEDs must be far apart, because noise and evenly spread light form two groups as well.
    pub fn see(&mut self, bits: u64) {
        let is_new = self.symbols == 0 || (bits ^ self.last).count_ones() >= OTHER_SYMBOL;
        if self.is_proved || !is_new || self.symbols >= u32::from(u8::MAX) {
            return;
        }
        self.last = bits;
        self.symbols += 1;
        for (led, on) in self.on.iter_mut().enumerate() {
            *on += (bits >> led & 1) as u8;
        }
        self.is_proved = self.symbols >= LEAST_SYMBOLS && self.still() <= MOST_STILL;
    }

    /// Adds an event of its symbols. A header that was read (not only expected), a beacon or a size is a proof: none of 10⁸ random readings
    /// passed as a header. The end of a segment is not a proof, because a segment that a lost panel began ends by itself.
    pub fn add_event(&mut self, event: &Event<'_>) {
        self.is_proved |= matches!(
            event,
            Event::Header { expected: false, .. } | Event::Beacon { .. } | Event::Geometry(_)
        );
    }

    /// The judgement at frame `number`, if [`PROOF_SYMBOLS`] take `proof_frames` frames. Missing frames do not count.
    pub fn verdict(&mut self, number: u64, proof_frames: u64) -> Verdict {
        let unseen = number.saturating_sub(self.latest).saturating_sub(1);
        self.since = self.since.saturating_add(unseen);
        self.latest = number;
        if self.is_proved {
            *self = Self {
                was_panel: true,
                ..Self::new(number)
            };
        }
        let is_due = number.saturating_sub(self.since) >= proof_frames;
        match (self.was_panel, is_due) {
            (true, false) => Verdict::Panel,
            (true, true) => Verdict::Gone,
            (false, true) => Verdict::Other,
            (false, false) => Verdict::Unsure,
        }
    }

    /// Number of LEDs that have not blinked.
    fn still(&self) -> usize {
        let is_still = |&&on: &&u8| {
            let on = u32::from(on);
            on.min(self.symbols - on) * LEAST_PART < self.symbols
        };
        self.on.iter().filter(is_still).count()
    }
}

/// A part of a frame: for columns and rows, the first and the end, which is not included.
pub type Area = [[usize; 2]; 2];

/// Places that are skipped for a while.
#[derive(Clone, Copy)]
pub struct SkippedPlaces {
    places: [Option<(Area, u64)>; PLACES],
    /// The entry that is overwritten next.
    next: usize,
}

impl SkippedPlaces {
    pub const NONE: Self = Self {
        places: [None; PLACES],
        next: 0,
    };

    /// Skips a place from frame `number` on, if it is not a panel or was lost before its proof.
    pub fn add(&mut self, corners: &Corners, verdict: Verdict, number: u64, proof_frames: u64) {
        let symbols = match verdict {
            Verdict::Panel | Verdict::Gone => return,
            Verdict::Other => REST_SYMBOLS,
            Verdict::Unsure => SHORT_REST_SYMBOLS,
        };
        let frames = proof_frames.saturating_mul(symbols.into()) / u64::from(PROOF_SYMBOLS);
        if let Some(place) = self.places.get_mut(self.next) {
            *place = Some((around(corners), number.saturating_add(frames)));
        }
        self.next = (self.next + 1) % PLACES;
    }

    /// The places that are skipped in frame `number`.
    pub fn areas(&self, number: u64) -> impl Iterator<Item = Area> {
        let places = self.places.into_iter().flatten();
        places.filter(move |&(_, until)| number < until).map(|(area, _)| area)
    }
}

/// The area within one pitch of a panel.
fn around(corners: &Corners) -> Area {
    let pitch = corners.pitch_px();
    [0, 1].map(|axis| {
        let ends = corners.points().map(|point| point[axis]);
        let least = ends.iter().fold(f32::MAX, |least, &end| least.min(end));
        let most = ends.iter().fold(f32::MIN, |most, &end| most.max(end));
        [(least - pitch) as usize, (most + pitch) as usize + 1]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROOF_FRAMES: u64 = 45;

    fn random(seed: &mut u64) -> u64 {
        *seed ^= *seed << 13;
        *seed ^= *seed >> 7;
        *seed ^= *seed << 17;
        *seed
    }

    /// The judgement of a place at the end of its proof; `bits` gives the bits of each frame.
    fn judged(mut bits: impl FnMut(u64) -> u64) -> Verdict {
        let mut blinked = BlinkHistory::new(7);
        for number in 7..7 + PROOF_FRAMES {
            assert_ne!(blinked.verdict(number, PROOF_FRAMES), Verdict::Other);
            blinked.see(bits(number));
        }
        blinked.verdict(7 + PROOF_FRAMES, PROOF_FRAMES)
    }

    /// Each symbol is shown in one and a half frames, and three LEDs are broken: all 10 000 panels are accepted.
    #[test]
    fn panels_prove_to_be_panels() {
        let mut seed = 0x1234_5678_9abc_def1;
        for trial in 0..10_000u64 {
            let broken = 0x8000_0400_0020_0000u64;
            let (mut symbol, mut index) = (random(&mut seed), 0);
            let verdict = judged(|number| {
                if number * 2 / 3 != index {
                    (symbol, index) = (random(&mut seed), number * 2 / 3);
                }
                let dark = symbol & !broken;
                if trial % 2 == 0 { dark } else { dark | broken }
            });
            assert_eq!(verdict, Verdict::Panel, "{trial}");
        }
    }

    #[test]
    fn lamps_that_switch_together_are_no_panel() {
        let halves = 0xf0f0_f0f0_0f0f_0f0fu64;
        assert_eq!(judged(|_| halves), Verdict::Other);
        assert_eq!(judged(|number| halves * (number % 2)), Verdict::Other);
    }

    #[test]
    fn a_few_lamps_that_blink_at_random_are_no_panel() {
        let mut seed = 99;
        let few = 0x0100_0040_0010_0802u64;
        let verdict = judged(|_| 0xffff_0000_ffff_0000 ^ random(&mut seed) & few);
        assert_eq!(verdict, Verdict::Other);
    }

    /// An edge that moves back and forth, so that one column at a time differs.
    #[test]
    fn a_moving_edge_is_no_panel() {
        for inverted in [0, u64::MAX] {
            let verdict = judged(|number| inverted ^ 0x0101_0101_0101_0101 << (number % 8));
            assert_eq!(verdict, Verdict::Other);
            let verdict = judged(|number| inverted ^ 0xff << (8 * (number * 3 % 8)));
            assert_eq!(verdict, Verdict::Other);
        }
    }

    #[test]
    fn what_the_link_says_is_proof_enough() {
        let mut blinked = BlinkHistory::new(0);
        blinked.add_event(&Event::Nothing);
        for number in 0..PROOF_FRAMES {
            assert_eq!(blinked.verdict(number, PROOF_FRAMES), Verdict::Unsure);
        }
        assert_eq!(blinked.verdict(PROOF_FRAMES, PROOF_FRAMES), Verdict::Other);
        blinked.add_event(&Event::Beacon { inverted: false });
        assert_eq!(blinked.verdict(99, PROOF_FRAMES), Verdict::Panel);
    }

    #[test]
    fn what_was_a_panel_has_to_prove_it_again() {
        let mut blinked = BlinkHistory::new(0);
        blinked.add_event(&Event::Beacon { inverted: false });
        for number in 20..20 + PROOF_FRAMES {
            assert_eq!(blinked.verdict(number, PROOF_FRAMES), Verdict::Panel);
        }
        let verdict = blinked.verdict(20 + PROOF_FRAMES, PROOF_FRAMES);
        assert_eq!(verdict, Verdict::Gone);
    }

    #[test]
    fn frames_that_nobody_saw_say_nothing() {
        let mut blinked = BlinkHistory::new(7);
        assert_eq!(blinked.verdict(8, PROOF_FRAMES), Verdict::Unsure);
        assert_eq!(blinked.verdict(1000, PROOF_FRAMES), Verdict::Unsure);
    }

    #[test]
    fn places_are_passed_over_for_a_while() {
        let corners = [[20.0, 30.0], [41.0, 30.0], [41.0, 51.0], [20.0, 51.0]];
        let corners = Corners::new(corners).unwrap();
        let mut skipped = SkippedPlaces::NONE;
        skipped.add(&corners, Verdict::Panel, 100, PROOF_FRAMES);
        assert_eq!(skipped.areas(100).count(), 0);
        skipped.add(&corners, Verdict::Other, 100, PROOF_FRAMES);
        assert_eq!(skipped.areas(234).next(), Some([[17, 45], [27, 55]]));
        assert_eq!(skipped.areas(235).count(), 0);
        for number in 0..9 {
            skipped.add(&corners, Verdict::Unsure, number, PROOF_FRAMES);
        }
        assert_eq!((skipped.areas(8).count(), skipped.areas(28).count()), (4, 2));
    }
}
