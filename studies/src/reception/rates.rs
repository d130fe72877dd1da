//! The symbol rate, where nobody tells it: the usual ones are tried beside the receiver's own, on the same readings. Whichever makes a
//! message whole is right, as messages bear checksums.

use link::framing::{Deframer, Delivery, Event};
use link::geometry::Geometry;
use link::panel::PanelFrame;
use link::symbol_rate::SymbolRate;
use rx_pipeline::detect::Detection;
use rx_pipeline::symbols::{Symbol, SymbolClock};

/// What transmitters show that were told nothing, in symbols a second: the boards, and most presets.
pub const TRANSMITTERS_HZ: f32 = (SymbolRate::DEFAULT.millihertz() / 1000) as f32;
/// That of the paper, and what slower cameras want.
const OTHERS_HZ: [f32; 12] = [100.0, 80.0, 60.0, 54.0, 50.0, 45.0, 30.0, 27.0, 25.0, 24.0, 20.0, 10.0];
/// The share of a camera's frames at which it can follow symbols.
const FOLLOWED: f32 = SymbolRate::SHARE_OF_FRAMES as f32;
/// Rates that are nearer to each other than this, as a part, are one.
const APART: f32 = 0.01;
/// LEDs that differ between two readings of different symbols: two of one symbol differ in fewer, two of random bits in 32 ± 4.
const DIFFERENT_LEDS: u32 = 13;
/// By how much, as a part, the rate that is seen in some tens of frames may be off.
const AS_SEEN: f32 = 0.15;
/// Pairs of frames that tell how often the panel changes.
const PAIRS_MIN: u32 = 20;

/// The rate that is gone by where none is told, with a camera of `fps` frames a second.
pub fn usual(fps: f32) -> f32 {
    if TRANSMITTERS_HZ <= fps { TRANSMITTERS_HZ } else { FOLLOWED * fps }
}

/// A rate on trial.
struct Trial {
    rate_hz: f32,
    clock: SymbolClock,
    deframer: Box<Deframer>,
    /// Whether it has made a message whole.
    has_made: bool,
    /// What the panel has said of its size.
    geometry: Option<Geometry>,
}

/// A message that one of them has made whole.
struct Made {
    message: Vec<u8>,
    /// All else that is told of it.
    delivery: Delivery<'static>,
}

/// What is told of a panel's symbols.
#[derive(Clone, Copy, Debug)]
pub enum Heard<'a> {
    /// What a symbol meant for the message.
    Event(&'a Event<'a>),
    /// The panel shows so many symbols a second, which is another rate than was gone by.
    Rate(f32),
}

/// The rates tried for one panel.
pub struct Rates {
    trials: Vec<Trial>,
    found_hz: Option<f32>,
    /// The last message that one of them has made whole.
    told: Option<Vec<u8>>,
    changes: Changes,
    fps: f32,
}

impl Trial {
    fn new(rate_hz: f32, fps: f32) -> Option<Self> {
        Some(Self {
            rate_hz,
            clock: SymbolClock::new(rate_hz / fps).ok()?,
            deframer: Box::default(),
            has_made: false,
            geometry: None,
        })
    }

    fn take(&mut self, number: u64, late: f64, detection: &Detection) -> Option<Made> {
        self.clock.set_late(late);
        let ended = match &detection.mixed {
            Some(mixture) => self.clock.push_mixed(number, &detection.soft, mixture),
            None => self.clock.push(number, &detection.soft),
        };
        self.deframe(ended?)
    }

    fn deframe(&mut self, symbol: Symbol) -> Option<Made> {
        let stamp = symbol.first_frame;
        let delivery = match self.deframer.push(symbol.index, stamp, &symbol.panel) {
            Event::Delivered(delivery) => delivery,
            Event::Geometry(geometry) => {
                self.geometry = Some(geometry);
                return None;
            }
            _ => return None,
        };
        self.has_made = true;
        Some(Made {
            message: delivery.message.to_vec(),
            delivery: Delivery { message: &[], ..delivery },
        })
    }
}

impl Made {
    /// What a receiver of that rate would have said.
    fn event(&self) -> Event<'_> {
        Event::Delivered(Delivery {
            message: &self.message,
            ..self.delivery
        })
    }
}

impl Rates {
    /// All usual ones but the receiver's own, where none was told; else none. `fps` is the camera's.
    pub fn beside(own_hz: f32, fps: f32, is_told: bool) -> Self {
        let others = OTHERS_HZ.into_iter().chain([TRANSMITTERS_HZ, fps, FOLLOWED * fps]);
        let others = others.filter(|rate| !is_told && (rate / own_hz - 1.0).abs() > APART);
        let mut trials: Vec<Trial> = others.filter_map(|rate| Trial::new(rate, fps)).collect();
        trials.sort_by(|a, b| a.rate_hz.total_cmp(&b.rate_hz));
        trials.dedup_by(|a, b| (a.rate_hz / b.rate_hz - 1.0).abs() < APART);
        Self {
            trials,
            found_hz: None,
            told: None,
            changes: Changes::default(),
            fps,
        }
    }

    /// The one that has taken the place of the receiver's own.
    pub fn found_hz(&self) -> Option<f32> {
        self.found_hz
    }

    /// The number of the symbol that the last reading shows, by the rate that was found.
    pub fn symbol(&self) -> Option<u32> {
        self.found_hz.and(self.trials.first()?.clock.current())
    }

    /// What the panel has said of its size since this was last asked: by the receiver's own rate, of which `event` is the last, or by one of
    /// the others.
    pub fn take_geometry(&mut self, event: &Event) -> Option<Geometry> {
        let trials = self.trials.iter_mut();
        let by_trial = trials.filter_map(|trial| trial.geometry.take()).last();
        match event {
            Event::Geometry(said) => Some(*said),
            _ => by_trial,
        }
    }

    /// How often the panel changes a second, by the frames so far; none where they are too few.
    pub fn seen_hz(&self) -> Option<f32> {
        Some(self.changes.per_frame()? * self.fps)
    }

    /// Tells what became of a panel's symbols in a frame that was taken so many frame periods `late`: by the receiver's own rate, whose
    /// `event` that is, or by one that makes a message whole of the frame's reading where that one makes none.
    pub fn hear(&mut self, event: &Event<'_>, number: u64, late: f64, detection: Option<&Detection>, tell: impl FnMut(Heard<'_>)) {
        let made = |rates: &mut Self| rates.take(number, late, detection?);
        self.hear_or(event, made, tell);
    }

    /// The same of the symbol that the last frames showed.
    pub fn hear_last(&mut self, event: &Event<'_>, tell: impl FnMut(Heard<'_>)) {
        self.hear_or(event, Self::finish, tell);
    }

    fn hear_or(&mut self, event: &Event<'_>, made: impl FnOnce(&mut Self) -> Option<Made>, mut tell: impl FnMut(Heard<'_>)) {
        let found_before = self.found_hz;
        if found_before.is_none() && matches!(event, Event::Delivered(_)) {
            // No more are tried: the receiver's own is right.
            self.trials.clear();
        }
        if let Some(made) = made(self) {
            tell(Heard::Event(&made.event()));
        }
        if let (None, Some(rate_hz)) = (found_before, self.found_hz) {
            tell(Heard::Rate(rate_hz));
        }
        if self.found_hz.is_none() && !self.repeats(event) {
            tell(Heard::Event(event));
        }
    }

    /// Takes the reading of a frame; gives the message that becomes whole by it.
    fn take(&mut self, number: u64, late: f64, detection: &Detection) -> Option<Made> {
        self.changes.take(number, detection);
        let trials = self.trials.iter_mut();
        let made = trials.filter_map(|trial| trial.take(number, late, detection));
        let made = made.collect();
        self.choose(made)
    }

    /// The message that becomes whole by the last symbol.
    fn finish(&mut self) -> Option<Made> {
        let trials = self.trials.iter_mut();
        let made = trials.filter_map(|trial| {
            let symbol = trial.clock.flush()?;
            trial.deframe(symbol)
        });
        let made = made.collect();
        self.choose(made)
    }

    /// A message that is new among those that became whole at once.
    fn choose(&mut self, made: Vec<Made>) -> Option<Made> {
        let is_new = |made: &Made| self.told.as_ref() != Some(&made.message);
        let made = made.into_iter().find(is_new);
        if let Some(made) = &made {
            self.told = Some(made.message.clone());
        }
        self.settle();
        made
    }

    /// A rate that has made a message whole, and at which the panel was seen to change about, goes on alone. Others may make a message
    /// whole, too, and sooner, where few frames are lost.
    fn settle(&mut self) {
        let (None, Some(seen_hz)) = (self.found_hz, self.seen_hz()) else {
            return;
        };
        let away = |trial: &&Trial| (trial.rate_hz / seen_hz - 1.0).abs();
        let able = self.trials.iter().filter(|trial| trial.has_made);
        let able = able.filter(|trial| away(trial) < AS_SEEN);
        let nearest = able.min_by(|a, b| away(a).total_cmp(&away(b)));
        if let Some(&Trial { rate_hz, .. }) = nearest {
            self.found_hz = Some(rate_hz);
            self.trials.retain(|trial| trial.rate_hz == rate_hz);
        }
    }

    /// Whether the receiver's own rate now makes whole the message that another has made whole before.
    fn repeats(&mut self, event: &Event) -> bool {
        let Event::Delivered(delivery) = event else {
            return false;
        };
        self.told.take().is_some_and(|told| told == delivery.message)
    }
}

/// How often readings of one frame and the next differ.
#[derive(Default)]
struct Changes {
    last: Option<(u64, PanelFrame)>,
    pairs: u32,
    changed: u32,
}

impl Changes {
    /// Takes a reading; one of two symbols at once is of neither.
    fn take(&mut self, number: u64, detection: &Detection) {
        let bits = detection.bits;
        if let Some((before, last)) = self.last
            && number.checked_sub(1) == Some(before)
        {
            self.pairs += 1;
            self.changed += u32::from(last.distance(bits) >= DIFFERENT_LEDS);
        }
        self.last = Some((number, bits));
    }

    fn per_frame(&self) -> Option<f32> {
        (self.pairs >= PAIRS_MIN).then(|| self.changed as f32 / self.pairs as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_is_too_slow_for_transmitters_is_to_follow_what_it_can() {
        assert_eq!([100.0, 90.0, 30.0].map(usual), [90.0, 90.0, 27.0]);
        let rates = |own, fps, told| {
            let trials = Rates::beside(own, fps, told).trials;
            trials.iter().map(|trial| trial.rate_hz).collect::<Vec<_>>()
        };
        assert!(rates(90.0, 100.0, true).is_empty());
        let of_fast = rates(90.0, 100.0, false);
        assert!(of_fast.contains(&100.0) && !of_fast.contains(&90.0), "{of_fast:?}");
        assert_eq!(rates(27.0, 30.0, false), [10.0, 20.0, 24.0, 25.0, 30.0]);
    }
}
