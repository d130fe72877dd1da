//! The search for a symbol rate that is not configured: the usual rates are tried besides the receiver's own, on the same readings. A rate
//! that completes a message is right, because messages have checksums.

use std::collections::VecDeque;

use link::geometry::Geometry;
use link::orientation::Orientation;
use link::panel::{PanelFrame, SoftPanel};
use link::symbol_rate::SymbolRate;
use rx_pipeline::detect::{Detection, Mixture};
use rx_pipeline::receiver::{CarrierCandidate, Reread};
use rx_pipeline::symbols::MessageDecoder;

use crate::Stamp;
use crate::event::{Message, PanelEvent};

/// The default rate of transmitters in symbols a second: the boards' and most presets'.
const TRANSMITTERS_HZ: f32 = (SymbolRate::DEFAULT.millihertz() / 1000) as f32;
/// The paper's rate, and rates for slower cameras.
const OTHERS_HZ: [f32; 12] = [100.0, 80.0, 60.0, 54.0, 50.0, 45.0, 30.0, 27.0, 25.0, 24.0, 20.0, 10.0];
/// Usual exposures, in seconds. For each, a transmitter may be configured with a rate of its own.
const EXPOSURES_S: [f64; 10] = [0.04, 1.0 / 30.0, 0.02, 1.0 / 60.0, 0.01, 1.0 / 120.0, 0.005, 0.004, 0.002, 0.001];
/// The symbol rate that a camera can follow, as a share of its frame rate.
const SHARE_OF_FRAMES: f32 = SymbolRate::SHARE_OF_FRAMES as f32;
/// Usual rates with a smaller relative difference count as the same.
const SAME_RATE: f32 = 0.01;
/// Rates of exposures with a smaller relative difference count as the same, because the clock corrects such an error.
const SAME_CLOCK_RATE: f32 = 5e-4;
/// Minimum number of LEDs that differ between readings of different symbols. Readings of one symbol differ in fewer; random bits differ in
/// 32 ± 4.
const DIFFERENT_LEDS: u32 = 13;
/// Maximum relative error of a rate that was observed over some tens of frames.
const OBSERVED_ERROR_MAX: f32 = 0.15;
/// Number of pairs of frames from which the rate of changes is known.
const PAIRS_MIN: u32 = 20;
/// Number of completed messages that are remembered: more than the frames that are read again can hold.
const COMPLETED: usize = 32;

/// The rate that is assumed if none is configured, with a camera of `fps` frames a second.
pub fn usual(fps: f32) -> f32 {
    if TRANSMITTERS_HZ <= fps {
        TRANSMITTERS_HZ
    } else {
        SHARE_OF_FRAMES * fps
    }
}

/// A rate on trial.
struct Trial {
    rate_hz: f32,
    decoder: Box<MessageDecoder>,
    /// Whether it has completed a message.
    has_message: bool,
    /// The size that the panel has announced.
    geometry: Option<Geometry>,
    /// The last decoded event about the signer.
    signer_event: Option<PanelEvent>,
    /// The number of events that prove a carrier.
    proofs: usize,
}

/// The rates tried for one panel.
#[derive(Default)]
pub struct RateSearch {
    trials: Vec<Trial>,
    found_hz: Option<f32>,
    /// The last message that a trial has completed.
    message: Option<Message>,
    /// Messages from earlier frames that have become readable.
    reread: Vec<Message>,
    /// The last completed messages, latest last: frames that are read again show them again.
    completed: VecDeque<Message>,
    /// The size that the panel has announced at the receiver's own rate.
    geometry: Option<Geometry>,
    /// The event about the signer that was decoded at the receiver's own rate.
    signer_event: Option<PanelEvent>,
    /// The receiver's own rate, while a trial decodes at it, too: unlike the receiver, the trial knows the frames before the carrier.
    own_hz: Option<f32>,
    changes: Changes,
    fps: f32,
}

impl Trial {
    fn new(rate_hz: f32, fps: f32) -> Option<Self> {
        Some(Self {
            rate_hz,
            decoder: Box::new(MessageDecoder::new(rate_hz / fps).ok()?),
            has_message: false,
            geometry: None,
            signer_event: None,
            proofs: 0,
        })
    }

    fn frame(&mut self, stamp: Stamp, detection: &Detection) -> Option<Message> {
        self.reading(stamp, &detection.soft, detection.mixed.as_ref())
    }

    fn reading(&mut self, stamp: Stamp, soft: &SoftPanel, mixture: Option<&Mixture>) -> Option<Message> {
        self.decoder.set_late(stamp.late);
        let decoded = self.decoder.push(stamp.number, soft, mixture);
        self.proofs += usize::from(Reread::is_proof(&decoded.event));
        let event = PanelEvent::of(&decoded.event);
        self.take(event)
    }

    fn finish(&mut self) -> Option<Message> {
        let event = PanelEvent::of(&self.decoder.finish());
        self.take(event)
    }

    fn take(&mut self, event: Option<PanelEvent>) -> Option<Message> {
        match event? {
            PanelEvent::Message(message) => {
                self.has_message = true;
                Some(message)
            }
            PanelEvent::Geometry(geometry) => {
                self.geometry = Some(geometry);
                None
            }
            signer_event @ (PanelEvent::Signed(_) | PanelEvent::Unsigned) => {
                self.signer_event = Some(signer_event);
                None
            }
            _ => None,
        }
    }
}

impl RateSearch {
    /// A search for a rate that is not configured: it tries all usual rates except the receiver's own, and the rates of usual exposures. If
    /// the rate is configured, it tries none. `fps` is the camera's frames a second.
    pub fn beside(own_hz: f32, fps: f32, is_configured: bool) -> Self {
        let others = OTHERS_HZ.into_iter().chain([TRANSMITTERS_HZ, fps, SHARE_OF_FRAMES * fps]);
        let others = others.filter(|rate| !is_configured && (rate / own_hz - 1.0).abs() > SAME_RATE);
        let mut trials: Vec<Trial> = others.filter_map(|rate| Trial::new(rate, fps)).collect();
        trials.sort_by(|a, b| a.rate_hz.total_cmp(&b.rate_hz));
        trials.dedup_by(|a, b| (a.rate_hz / b.rate_hz - 1.0).abs() < SAME_RATE);
        // Transmitters are configured for a whole number of frames a second.
        let of_exposure = |exposure_s| SymbolRate::for_camera(f64::from(fps.round()), exposure_s);
        let of_exposures = EXPOSURES_S.into_iter().filter_map(|exposure_s| of_exposure(exposure_s).ok());
        for rate in of_exposures.map(|rate| rate.hz() as f32).filter(|_| !is_configured) {
            let mut tried = trials.iter().map(|trial| trial.rate_hz).chain([own_hz]);
            if tried.all(|other| (other / rate - 1.0).abs() > SAME_CLOCK_RATE) {
                trials.extend(Trial::new(rate, fps));
            }
        }
        Self {
            trials,
            fps,
            ..Self::default()
        }
    }

    /// The rate that has replaced the receiver's own.
    pub fn found_hz(&self) -> Option<f32> {
        self.found_hz
    }

    /// The number of the symbol in the last reading, at the rate that was found.
    pub fn symbol(&self) -> Option<u32> {
        self.found_hz.and(self.trials.first()?.decoder.symbol())
    }

    /// The panel's orientation in the picture, from a header that was decoded at one of the rates.
    pub fn orientation(&self) -> Option<Orientation> {
        self.trials.iter().find_map(|trial| trial.decoder.orientation())
    }

    /// Takes the size that the panel has announced since the last call, at the receiver's own rate or at another.
    pub fn take_geometry(&mut self) -> Option<Geometry> {
        let trials = self.trials.iter_mut();
        let by_trial = trials.filter_map(|trial| trial.geometry.take()).last();
        self.geometry.take().or(by_trial)
    }

    /// Takes the event about the signer since the last call, at the receiver's own rate or at another.
    pub fn take_signer_event(&mut self) -> Option<PanelEvent> {
        let trials = self.trials.iter_mut();
        let by_trial = trials.filter_map(|trial| trial.signer_event.take()).last();
        self.signer_event.take().or(by_trial)
    }

    /// Changes of the panel per second in the frames so far; none if the frames are too few.
    pub fn changes_hz(&self) -> Option<f32> {
        Some(self.changes.per_frame()? * self.fps)
    }

    /// Decodes frames again after their signs have become known, also at the receiver's own rate, and continues from there. If several
    /// carriers explain the frames, returns the one that its readings have proven.
    pub fn reread(&mut self, frames: &Reread<'_>, own_hz: f32) -> Option<CarrierCandidate> {
        let own = self.found_hz.is_none().then_some(own_hz);
        let others = self.trials.iter().map(|trial| trial.rate_hz);
        let rates: Vec<f32> = own.into_iter().chain(others.filter(|rate| Some(*rate) != own)).collect();
        let fps = self.fps;
        let (trials, proven) = frames.decode(|readings| {
            let readings: Vec<_> = readings.collect();
            let mut trials: Vec<Trial> = rates.iter().filter_map(|&rate_hz| Trial::new(rate_hz, fps)).collect();
            for trial in &mut trials {
                let reading = |&(number, late, ref soft): &(u64, f64, SoftPanel)| trial.reading(Stamp { number, late }, soft, None);
                self.reread.extend(readings.iter().filter_map(reading));
            }
            let proofs = trials.iter().map(|trial| trial.proofs).max()?;
            Some((proofs, trials))
        })?;
        if !proven.is_some_and(|carrier| carrier.is_followed()) {
            (self.trials, self.own_hz) = (trials, own);
        }
        proven
    }

    /// The events of a panel's symbols in a frame, at the receiver's `own` rate. If that rate completes no message, one that another rate
    /// completes is among them.
    pub fn frame(&mut self, own: Option<PanelEvent>, stamp: Stamp, detection: Option<&Detection>) -> Vec<PanelEvent> {
        self.resolve(own, |rates| {
            let detection = detection?;
            rates.changes.take(stamp.number, detection);
            rates.new_message(|trial| trial.frame(stamp, detection))
        })
    }

    /// The events of the last symbol, at the end of the film.
    pub fn finish(&mut self, own: Option<PanelEvent>) -> Vec<PanelEvent> {
        self.resolve(own, |rates| rates.new_message(Trial::finish))
    }

    fn resolve(&mut self, own: Option<PanelEvent>, by_trial: impl FnOnce(&mut Self) -> Option<Message>) -> Vec<PanelEvent> {
        let found_before = self.found_hz;
        if found_before.is_none() && matches!(own, Some(PanelEvent::Message(_))) {
            // The receiver's own rate is right, so the search ends.
            self.trials.clear();
        }
        let mut events: Vec<PanelEvent> = by_trial(self).map(PanelEvent::Message).into_iter().collect();
        if let (None, Some(rate_hz)) = (found_before, self.found_hz) {
            events.push(PanelEvent::RateFound(rate_hz));
        }
        match own {
            // A panel's size is reported once, whichever rate decoded it.
            Some(PanelEvent::Geometry(geometry)) => self.geometry = Some(geometry),
            Some(event @ (PanelEvent::Signed(_) | PanelEvent::Unsigned)) => self.signer_event = Some(event),
            Some(event) if self.found_hz.is_none() => {
                if let PanelEvent::Message(message) = &event {
                    self.complete(message);
                }
                if !self.repeats(&event) {
                    events.push(event);
                }
            }
            _ => {}
        }
        events
    }

    /// The first new message among those that are completed at the same time.
    fn new_message(&mut self, mut of: impl FnMut(&mut Trial) -> Option<Message>) -> Option<Message> {
        let mut messages = core::mem::take(&mut self.reread);
        messages.retain(|message| self.is_unread(message));
        messages.extend(self.trials.iter_mut().filter_map(&mut of));
        let is_new = |message: &Message| self.message.as_ref().is_none_or(|last| last.data != message.data);
        let message = messages.into_iter().find(is_new);
        if let Some(message) = &message {
            self.complete(message);
            self.message = Some(message.clone());
        }
        self.settle();
        message
    }

    fn complete(&mut self, message: &Message) {
        if self.completed.len() == COMPLETED {
            self.completed.pop_front();
        }
        self.completed.push_back(message.clone());
    }

    /// Whether a message from frames that are read again is neither a repetition of the last one nor completed from the same frames before.
    fn is_unread(&self, message: &Message) -> bool {
        let is_same = |other: &Message| other.data == message.data;
        let overlaps = |other: &Message| other.first_frame <= message.last_frame && message.first_frame <= other.last_frame;
        !self.completed.back().is_some_and(is_same) && !self.completed.iter().any(|other| is_same(other) && overlaps(other))
    }

    /// Continues with one rate alone: a rate that has completed a message and is close to the observed rate of changes. Other rates may
    /// complete a message too, and sooner, if few frames are lost.
    fn settle(&mut self) {
        let (None, Some(changes_hz)) = (self.found_hz, self.changes_hz()) else {
            return;
        };
        let away = |trial: &&Trial| (trial.rate_hz / changes_hz - 1.0).abs();
        let able = self.trials.iter().filter(|trial| trial.has_message);
        let able = able.filter(|trial| away(trial) < OBSERVED_ERROR_MAX);
        let nearest = able.min_by(|a, b| away(a).total_cmp(&away(b)));
        if let Some(&Trial { rate_hz, .. }) = nearest {
            if self.own_hz == Some(rate_hz) {
                self.trials.clear();
                return;
            }
            self.found_hz = Some(rate_hz);
            self.trials.retain(|trial| trial.rate_hz == rate_hz);
        }
    }

    /// Whether the receiver's own rate completes the message that another rate has completed before.
    fn repeats(&mut self, event: &PanelEvent) -> bool {
        let PanelEvent::Message(message) = event else {
            return false;
        };
        self.message.take().is_some_and(|before| before.data == message.data)
    }
}

/// How often readings of successive frames differ.
#[derive(Default)]
struct Changes {
    last: Option<(u64, PanelFrame)>,
    pairs: u32,
    changed: u32,
}

impl Changes {
    /// Counts a reading. A reading of two symbols at once belongs to neither and does not count.
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
            let trials = RateSearch::beside(own, fps, told).trials;
            trials.iter().map(|trial| trial.rate_hz).collect::<Vec<_>>()
        };
        assert!(rates(90.0, 100.0, true).is_empty());
        let of_fast = rates(90.0, 100.0, false);
        assert!(of_fast.contains(&100.0) && !of_fast.contains(&90.0), "{of_fast:?}");
        let of_slow = rates(27.0, 30.0, false);
        let (usual, of_exposures) = of_slow.split_at(5);
        assert_eq!(usual, [10.0, 20.0, 24.0, 25.0, 30.0]);
        // Exposures of 1/120 s and 1/60 s need 24 and 20; short ones need the receiver's own rate.
        assert_eq!(of_exposures, [13.636, 15.0, 18.75, 23.077, 26.087, 26.786]);
    }

    /// Two messages in turn, of which frames that are read again show the earlier one, too.
    #[test]
    fn messages_in_frames_that_are_read_again_are_reported_once() {
        let message = |data: u8, first_frame: u64| Message {
            data: vec![data],
            first_frame,
            last_frame: first_frame + 20,
            corrected_bits: 0,
        };
        let mut rates = RateSearch::beside(90.0, 100.0, true);
        for (data, first_frame) in [(1, 0), (2, 30)] {
            rates.reread = vec![message(data, first_frame)];
            assert!(rates.new_message(|_| None).is_some());
        }
        rates.reread = vec![message(1, 0), message(2, 31), message(2, 90)];
        assert_eq!(rates.new_message(|_| None), None);
        rates.reread = vec![message(1, 60)];
        assert_eq!(rates.new_message(|_| None), Some(message(1, 60)));
    }

    #[test]
    fn the_rate_that_a_transmitter_is_told_for_an_exposure_is_tried() {
        // Cameras of 29.97 frames a second are configured as 30.
        for (fps, told_fps) in [(30.0, 30.0), (29.97, 30.0), (60.0, 60.0), (100.0, 100.0)] {
            for exposure_s in EXPOSURES_S {
                let told = SymbolRate::for_camera(told_fps, exposure_s).expect("a rate").hz() as f32;
                let own = usual(fps);
                let trials = RateSearch::beside(own, fps, false).trials;
                let tried = trials.iter().map(|trial| trial.rate_hz).chain([own]);
                let off = tried.map(|rate| (rate / told - 1.0).abs()).fold(f32::INFINITY, f32::min);
                assert!(off < 6e-4, "{told} symbols before {fps} frames a second: off by {off}");
            }
        }
    }
}
