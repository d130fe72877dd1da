//! Processes frames one after another into readings, poses and messages.

use link::camera::Camera;
use link::orientation::Orientation;
use link::panel::PanelFrame;
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::detect::Method;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Lens, PanelSize};
use rx_pipeline::profile::{Profile, Stage};
use rx_pipeline::receiver::{CarrierCandidate, FrameReading, Loss, Outcome, ReceiverError, ReceiverSettings, Reread};

use crate::deep::SampleKind;
use crate::diagnosis::{Diagnosis, LinkRates};
use crate::event::PanelEvent;
use crate::panel_pose::{PanelPose, PoseInput, PoseMeter};
use crate::panels::{self, MakePanels, Panels};
use crate::symbol_rate::{self, RateSearch};
use crate::{PANELS_MAX, USUAL_FPS};

/// The settings of a reception.
#[derive(Clone, Copy, Debug)]
pub struct ReceptionSettings {
    /// The camera of the 8-bit grey frames.
    pub camera: Camera,
    /// The delay of each line after the one above, in exposures, if known.
    pub line_delay: Option<f32>,
    /// The detector.
    pub method: Method,
    /// Frames a second.
    pub fps: f32,
    /// Symbols a second, if known; otherwise the usual rates are tried.
    pub symbol_rate_hz: Option<f32>,
    /// The size of the panels, if known; otherwise panels have to announce it.
    pub panel_size: Option<PanelSize>,
}

impl Default for ReceptionSettings {
    /// Defaults: [`USUAL_FPS`], and everything else unknown.
    fn default() -> Self {
        Self {
            camera: Camera::default(),
            line_delay: None,
            method: Method::default(),
            fps: USUAL_FPS,
            symbol_rate_hz: None,
            panel_size: None,
        }
    }
}

impl ReceptionSettings {
    /// The symbols a second that are assumed from the first frame on.
    fn symbol_rate_hz(&self) -> f32 {
        self.symbol_rate_hz.unwrap_or_else(|| symbol_rate::usual(self.fps))
    }

    fn of_receiver(&self) -> ReceiverSettings {
        ReceiverSettings {
            camera: self.camera,
            method: self.method,
            symbols_per_frame: self.symbol_rate_hz() / self.fps,
            ..ReceiverSettings::default()
        }
    }

    fn rate_search(&self) -> RateSearch {
        RateSearch::beside(self.symbol_rate_hz(), self.fps, self.symbol_rate_hz.is_some())
    }
}

/// The time of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamp {
    /// The frame's number. Numbers rise, and a gap means lost frames.
    pub number: u64,
    /// The delay of the frame after the time that its number implies, in frame periods.
    pub late: f64,
}

impl Stamp {
    /// The stamp of a frame from a camera with a constant rate.
    pub fn of(number: u64) -> Self {
        Self { number, late: 0.0 }
    }
}

/// Why a reception rejects a frame.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceptionError {
    /// The settings are invalid.
    #[error(transparent)]
    Receiver(#[from] ReceiverError),
    /// A frame differs in size from those before.
    #[error(
        "it has {} × {} pixels, and those before have {} × {}: give frames of one size, and each film separately",
        size.0, size.1, film.0, film.1
    )]
    Size {
        /// The frame's columns and rows.
        size: (usize, usize),
        /// The columns and rows of the frames before.
        film: (usize, usize),
    },
    /// A frame's samples are of another kind than those before.
    #[error(
        "its samples are {samples}, those of the frames before are {film}: the same level is different light in each; receive the \
         frames of each kind separately"
    )]
    Samples {
        /// The frame's samples.
        samples: SampleKind,
        /// Those of the frames before.
        film: SampleKind,
    },
}

/// The results of a frame for one panel.
#[derive(Clone, Debug)]
pub struct PanelReport {
    /// The panel's number, from 0.
    pub panel: usize,
    /// Events of the panel's symbols.
    pub events: Vec<PanelEvent>,
    /// Its corners and bits, or why it was not read. Rows and columns are the panel's own once its orientation is known. Until then, and in
    /// a mirrored picture, they are those of the picture.
    pub reading: Result<FrameReading, Loss>,
    /// The panel's orientation in the picture, known from the first message header on.
    pub orientation: Option<Orientation>,
    /// The number of the symbol that the frame shows, if it was read.
    pub symbol: Option<u32>,
}

/// Decodes messages, readings and poses from successive frames.
pub struct Reception {
    settings: ReceptionSettings,
    make_receiver: MakePanels,
    /// Made with the first frame, for its size.
    receiver: Option<Box<dyn Panels>>,
    size: Option<(usize, usize)>,
    samples: Option<SampleKind>,
    panels: Vec<Panel>,
    learnt: Vec<Option<CameraEstimate>>,
    meter: PoseMeter,
    diagnosis: Diagnosis,
}

/// The state of a panel outside the receiver.
struct Panel {
    /// Exists from the first reading on.
    rates: Option<RateSearch>,
    orientation: Option<Orientation>,
    panel_pose: PanelPose,
    /// The last report about the signer since the last message.
    reported: Option<PanelEvent>,
}

impl Reception {
    /// A reception of one panel.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn new(settings: ReceptionSettings) -> Result<Self, ReceiverError> {
        Self::made_by(panels::make::<1>, 1, settings)
    }

    /// A reception of several panels, 1 to [`PANELS_MAX`], each with its own message.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn with_panels(settings: ReceptionSettings, panels: usize) -> Result<Self, ReceiverError> {
        let make = match panels {
            0 | 1 => return Self::new(settings),
            2 => panels::make::<2>,
            3 => panels::make::<3>,
            _ => panels::make::<PANELS_MAX>,
        };
        Self::made_by(make, panels.min(PANELS_MAX), settings)
    }

    fn made_by(make_receiver: MakePanels, panels: usize, settings: ReceptionSettings) -> Result<Self, ReceiverError> {
        // Invalid settings fail here, not with the first frame.
        settings.of_receiver().validate()?;
        let panel = |_| Panel {
            rates: None,
            orientation: None,
            panel_pose: PanelPose::UNKNOWN,
            reported: None,
        };
        Ok(Self {
            settings,
            make_receiver,
            receiver: None,
            size: None,
            samples: None,
            panels: (0..panels).map(panel).collect(),
            learnt: vec![None; panels],
            meter: PoseMeter::new(settings.panel_size),
            diagnosis: Diagnosis::default(),
        })
    }

    /// Sets the camera's frames a second, before the first frame.
    ///
    /// # Errors
    /// If symbols cannot be followed at that rate.
    pub fn set_fps(&mut self, fps: f32) -> Result<(), ReceiverError> {
        self.settings.fps = fps;
        self.settings.of_receiver().validate()
    }

    /// Checks that a frame's samples are of the same kind as those of the frames before. The first frame sets `camera`, the camera of the
    /// 8-bit grey made of such samples.
    ///
    /// # Errors
    /// [`ReceptionError::Samples`] if they are not.
    pub fn check_samples(&mut self, samples: SampleKind, camera: impl FnOnce() -> Camera) -> Result<(), ReceptionError> {
        match self.samples {
            None => {
                self.settings.camera = camera();
                self.samples = Some(samples);
                Ok(())
            }
            Some(film) if film != samples => Err(ReceptionError::Samples { samples, film }),
            Some(_) => Ok(()),
        }
    }

    /// The kind of the film's samples, by its first frame.
    pub fn samples(&self) -> Option<SampleKind> {
        self.samples
    }

    /// Checks that a frame's columns and rows are those of the frames before.
    ///
    /// # Errors
    /// [`ReceptionError::Size`] if they are not.
    pub fn check_size(&self, size: (usize, usize)) -> Result<(), ReceptionError> {
        match self.size {
            Some(film) if film != size => Err(ReceptionError::Size { size, film }),
            _ => Ok(()),
        }
    }

    /// Processes a frame. The result has a report of each panel that was or is followed; if there is none, it says why none was found.
    /// `lens` is the camera's lens, or why it is unknown; `profile` measures the time.
    ///
    /// # Errors
    /// [`ReceptionError`] if the frame's size differs from that of the frames before, or if a setting is out of its range.
    pub fn frame(
        &mut self,
        stamp: Stamp,
        frame: &Frame<'_>,
        lens: &Result<Lens, String>,
        mut profile: &mut dyn Profile,
    ) -> Result<Vec<PanelReport>, ReceptionError> {
        let size = (frame.width(), frame.height());
        self.check_size(size)?;
        let time_s = self.time_s(stamp);
        let receiver = match &mut self.receiver {
            Some(receiver) => receiver,
            None => {
                let mut receiver = (self.make_receiver)(self.settings.of_receiver(), size)?;
                if let Some(delay) = self.settings.line_delay {
                    receiver.set_line_delay(delay);
                }
                self.size = Some(size);
                self.receiver.insert(receiver)
            }
        };
        let (settings, panels, diagnosis) = (&self.settings, &mut self.panels, &mut self.diagnosis);
        let (mut reports, mut proven) = (Vec::new(), Vec::new());
        receiver.frame(stamp, frame, profile, &mut |panel, outcome| {
            diagnosis.count(&outcome.reading);
            let carrier = outcome.reread.as_ref().and_then(|reread| panels[panel].reread(reread, settings));
            proven.extend(carrier.map(|carrier| (panel, carrier)));
            reports.push(panels[panel].report(panel, stamp, &outcome, settings));
        });
        proven.iter().for_each(|(panel, carrier)| receiver.confirm_carrier(*panel, carrier));
        for report in &reports {
            report.events.iter().for_each(|event| diagnosis.count_event(event));
            let panel_pose = &mut self.panels[report.panel].panel_pose;
            match &report.reading {
                Ok(_) if report.orientation.is_some_and(Orientation::is_mirrored) => panel_pose.set_mirrored(),
                Ok(reading) => {
                    // The camera as learnt before this frame.
                    let camera = self.learnt[report.panel].map_or(self.settings.camera, |learnt| learnt.seen);
                    let input = PoseInput {
                        frame,
                        reading,
                        camera: &camera,
                        lens,
                    };
                    Profile::timed(&mut profile, Stage::Pose, || panel_pose.measure(&mut self.meter, time_s, &input));
                }
                Err(loss) => panel_pose.lose(loss),
            }
        }
        self.learnt = learnt(receiver.as_ref(), &self.panels);
        Ok(reports)
    }

    /// Decodes the symbols of the last frames, which were held back because their end was not known. Returns the events with the panels'
    /// numbers.
    pub fn finish(&mut self) -> Vec<(usize, PanelEvent)> {
        let Some(receiver) = &mut self.receiver else {
            return Vec::new();
        };
        let mut events = Vec::new();
        let panels = &mut self.panels;
        receiver.finish(&mut |panel, event| {
            if let Some(rates) = &mut panels[panel].rates {
                let mut brought = rates.finish(PanelEvent::of(&event));
                panels[panel].push_signer_event(&mut brought);
                events.extend(brought.into_iter().map(|event| (panel, event)));
            }
        });
        events.iter().for_each(|(_, event)| self.diagnosis.count_event(event));
        self.learnt = learnt(receiver.as_ref(), &self.panels);
        events
    }

    /// Frees the receiver's memory. The learnt cameras stay available.
    pub fn close(&mut self) {
        self.receiver = None;
    }

    /// The time of a frame in seconds after frame 0.
    pub fn time_s(&self, stamp: Stamp) -> f64 {
        (stamp.number as f64 + stamp.late) / f64::from(self.settings.fps)
    }

    /// The learnt cameras, by panel number; none for a panel that was not read by maximum likelihood.
    pub fn learnt_each(&self) -> &[Option<CameraEstimate>] {
        &self.learnt
    }

    /// Whether a panel's bits seem to be the phase of a carrier; false until its frames show it.
    pub fn has_carrier(&self, panel: usize) -> bool {
        self.receiver.as_ref().is_some_and(|receiver| receiver.has_carrier(panel))
    }

    /// The camera as learnt by the first panel that was read.
    pub fn learnt(&self) -> Option<&CameraEstimate> {
        self.learnt.iter().flatten().next()
    }

    /// A panel's orientation in the picture, known from the first message header on.
    pub fn orientation(&self, panel: usize) -> Option<Orientation> {
        self.panels.get(panel)?.orientation
    }

    /// Where a panel is.
    pub fn panel_pose(&self, panel: usize) -> &PanelPose {
        static UNKNOWN: PanelPose = PanelPose::UNKNOWN;
        self.panels.get(panel).map_or(&UNKNOWN, |panel| &panel.panel_pose)
    }

    /// Symbols a second: the rate that decoded messages, or else the configured or assumed one.
    pub fn symbol_rate_hz(&self) -> f32 {
        let found = self.rates().find_map(RateSearch::found_hz);
        found.unwrap_or_else(|| self.settings.symbol_rate_hz())
    }

    /// Why there is no message, and remedies, one sentence each; `has_options` says whether they may name the command line's options.
    pub fn advice(&self, has_options: bool) -> Vec<String> {
        let rates = LinkRates {
            symbols_hz: self.symbol_rate_hz(),
            fps: self.settings.fps,
            changes_hz: self.rates().find_map(RateSearch::changes_hz),
        };
        self.diagnosis.lines(&rates, self.learnt(), has_options)
    }

    fn rates(&self) -> impl Iterator<Item = &RateSearch> {
        self.panels.iter().filter_map(|panel| panel.rates.as_ref())
    }
}

/// The learnt cameras, by panel number.
fn learnt(receiver: &dyn Panels, panels: &[Panel]) -> Vec<Option<CameraEstimate>> {
    let each = receiver.learnt().into_iter().zip(panels);
    let upright = |learnt: CameraEstimate, panel: &Panel| CameraEstimate {
        broken: PanelFrame::from_bits(learnt.broken).upright(panel.turn()).bits(),
        ..learnt
    };
    each.map(|(learnt, panel)| learnt.map(|learnt| upright(learnt, panel))).collect()
}

impl Panel {
    /// The rotation that makes the panel's readings upright.
    fn turn(&self) -> Orientation {
        self.orientation.unwrap_or_default().turn()
    }

    /// Appends the event about the signer, if there is a new one.
    fn push_signer_event(&mut self, events: &mut Vec<PanelEvent>) {
        if events.iter().any(|event| matches!(event, PanelEvent::Message(_))) {
            self.reported = None;
        }
        let signer_event = self.rates.as_mut().and_then(RateSearch::take_signer_event);
        if let Some(signer_event) = signer_event.filter(|signer_event| signer_event.adds_to(self.reported.as_ref())) {
            self.reported = Some(signer_event.clone());
            events.push(signer_event);
        }
    }

    /// Decodes frames again whose signs have become known, or may have; returns the carrier that this has proven.
    fn reread(&mut self, frames: &Reread<'_>, settings: &ReceptionSettings) -> Option<CarrierCandidate> {
        let rates = self.rates.get_or_insert_with(|| settings.rate_search());
        rates.reread(frames, settings.symbol_rate_hz())
    }

    /// Turns a frame's outcome into the panel's report. The pose is measured afterwards.
    fn report(&mut self, panel: usize, stamp: Stamp, outcome: &Outcome<'_>, settings: &ReceptionSettings) -> PanelReport {
        let rates = self.rates.get_or_insert_with(|| settings.rate_search());
        let detection = outcome.reading.as_ref().ok().map(|reading| &reading.detection);
        let own = PanelEvent::of(&outcome.event);
        let mut events = rates.frame(own, stamp, detection);
        if let Some(geometry) = rates.take_geometry()
            && self.panel_pose.set_size(geometry)
        {
            events.push(PanelEvent::Geometry(geometry));
        }
        let symbol = rates.symbol().or(outcome.symbol);
        let orientation = rates.orientation().or(outcome.orientation);
        self.push_signer_event(&mut events);
        let before = core::mem::replace(&mut self.orientation, orientation);
        if orientation != before
            && let Some(orientation) = orientation
            && (orientation != Orientation::UPRIGHT || before.is_some())
        {
            events.push(PanelEvent::Orientation(orientation));
        }
        PanelReport {
            panel,
            events,
            reading: outcome.reading.map(|reading| reading.upright(self.turn())),
            orientation,
            symbol,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Message;
    use link::fec::Code;
    use link::framing::{Framer, KeyId, Signature, SignedFramer};

    const SIDE: usize = 96;

    /// The pose of a panel before the camera.
    #[derive(Clone, Copy, Debug)]
    struct Hold {
        /// Clockwise roll.
        roll_deg: f64,
        is_mirrored: bool,
    }

    impl Hold {
        const UPRIGHT: Self = Self {
            roll_deg: 0.0,
            is_mirrored: false,
        };

        /// The position of LED `led` in the picture.
        fn at(self, led: usize) -> [f64; 2] {
            let [across, down] = [led % 8, led / 8].map(|place| 4.5 * (place as f64 - 3.5));
            let across = if self.is_mirrored { -across } else { across };
            let (sin, cos) = self.roll_deg.to_radians().sin_cos();
            [47.7 + cos * across - sin * down, 45.8 + sin * across + cos * down]
        }
    }

    /// Frames of 96×96 pixels of a panel that shows a message, with the bits of each. An On LED is a spot of light, and each symbol is in
    /// two frames.
    fn film(message: &[u8], held: Hold) -> impl Iterator<Item = (PanelFrame, Vec<u8>)> {
        let mut framer = Framer::new(message, Code::for_length(message.len()), false).unwrap();
        film_of(move || framer.next_panel(), held)
    }

    /// The same film of any panels.
    fn film_of(mut next_panel: impl FnMut() -> PanelFrame, held: Hold) -> impl Iterator<Item = (PanelFrame, Vec<u8>)> {
        let mut shown = PanelFrame::default();
        (0..).map(move |number: u32| {
            if number.is_multiple_of(2) {
                shown = next_panel();
            }
            let mut light = vec![1.0; SIDE * SIDE];
            for led in (0..64).filter(|&led| shown.led(led)) {
                let [x, y] = held.at(led);
                for (i, light) in light.iter_mut().enumerate() {
                    let square = ((i % SIDE) as f64 - x).powi(2) + ((i / SIDE) as f64 - y).powi(2);
                    *light += 2.0 * (-square / 5.0).exp();
                }
            }
            let grey = light.into_iter().map(|light: f64| (118.0 * light.powf(1.0 / 2.2)) as u8);
            (shown, grey.collect())
        })
    }

    #[test]
    fn a_signature_is_told_once_and_again_where_the_message_is_shown_again() {
        let signature = Signature {
            key: KeyId([1; 4]),
            counter: 5,
            proof: [7; 64],
        };
        let signed = || SignedFramer::new(b"ice ahead", Code::Tc256, false, signature).unwrap();
        let rounds = 2 * signed().panels_per_repeat();
        let (mut first, mut idle, mut again) = (signed(), Framer::beacon(), signed());
        let mut shown = (0..rounds).map(|_| first.next_panel()).collect::<Vec<_>>();
        shown.extend((0..12).map(|_| idle.next_panel()));
        shown.extend((0..rounds).map(|_| again.next_panel()));
        for symbol_rate_hz in [Some(30.0), None] {
            let settings = ReceptionSettings {
                fps: 60.0,
                symbol_rate_hz,
                ..ReceptionSettings::default()
            };
            let mut reception = Reception::new(settings).unwrap();
            let lens = Err(String::new());
            let mut panels = shown.clone().into_iter();
            let film = film_of(|| panels.next().unwrap_or_default(), Hold::UPRIGHT);
            let mut told = Vec::new();
            for (number, (_, grey)) in (0..).zip(film.take(2 * shown.len())) {
                let frame = Frame::new(&grey, SIDE, SIDE).unwrap();
                let reports = reception.frame(Stamp::of(number), &frame, &lens, &mut ()).unwrap();
                told.extend(reports.into_iter().flat_map(|report| report.events));
            }
            told.extend(reception.finish().into_iter().map(|(_, event)| event));
            let told: Vec<&str> = told
                .iter()
                .filter_map(|event| match event {
                    PanelEvent::Message(_) => Some("message"),
                    PanelEvent::Signed(signed) => {
                        assert_eq!((&signed.data[..], signed.signature), (&b"ice ahead"[..], signature));
                        Some("signed")
                    }
                    PanelEvent::Unsigned => Some("unsigned"),
                    _ => None,
                })
                .collect();
            assert_eq!(told, ["message", "signed", "message", "signed"], "{symbol_rate_hz:?}");
        }
    }

    #[test]
    fn any_number_of_panels_delivers_a_message_and_a_pose() {
        for panels in [1, 3] {
            let settings = ReceptionSettings {
                fps: 60.0,
                panel_size: Some(PanelSize::new(0.03, 1.0).unwrap()),
                ..ReceptionSettings::default()
            };
            let mut reception = Reception::with_panels(settings, panels).unwrap();
            let lens = Ok(Lens::pinhole(1000.0, [SIDE; 2]));
            let mut events = Vec::new();
            for (number, (_, grey)) in (0..).zip(film(b"ice ahead", Hold::UPRIGHT).take(80)) {
                let frame = Frame::new(&grey, SIDE, SIDE).unwrap();
                for report in reception.frame(Stamp::of(number), &frame, &lens, &mut ()).unwrap() {
                    assert_eq!(report.panel, 0);
                    events.extend(report.events);
                }
            }
            events.extend(reception.finish().into_iter().map(|(_, event)| event));
            let message = Message {
                data: b"ice ahead".to_vec(),
                first_frame: 0,
                last_frame: 12,
                corrected_bits: 0,
            };
            assert_eq!(events, [PanelEvent::Message(message), PanelEvent::Unsigned]);
            let range_m = reception.panel_pose(0).pose().unwrap().numbers().range_m.value;
            assert!((10.0..17.0).contains(&range_m), "{range_m} m");
            assert!(reception.learnt().is_some() && reception.learnt_each().len() == panels);
        }
    }

    #[test]
    fn a_message_is_delivered_however_the_panel_is_held_and_the_panel_told_as_it_is() {
        let rolls_deg = [0.0, 90.0, 180.0, -87.0, 30.0, 45.0, -60.0, 130.0];
        let held = rolls_deg.into_iter().map(|roll_deg| Hold { roll_deg, ..Hold::UPRIGHT });
        let mirrored = [0.0, 90.0, 180.0, -90.0, 45.0].into_iter().map(|roll_deg| Hold {
            roll_deg,
            is_mirrored: true,
        });
        for held in held.chain(mirrored) {
            let settings = ReceptionSettings {
                fps: 60.0,
                panel_size: Some(PanelSize::new(0.03, 1.0).unwrap()),
                ..ReceptionSettings::default()
            };
            let mut reception = Reception::new(settings).unwrap();
            let lens = Ok(Lens::pinhole(1000.0, [SIDE; 2]));
            let (mut events, mut known, mut turns) = (Vec::new(), 0, 0);
            for (number, (shown, grey)) in (0..).zip(film(b"ice ahead", held).take(40)) {
                let frame = Frame::new(&grey, SIDE, SIDE).unwrap();
                for report in reception.frame(Stamp::of(number), &frame, &lens, &mut ()).unwrap() {
                    events.extend(report.events);
                    let (Ok(reading), Some(orientation)) = (report.reading, report.orientation) else {
                        continue;
                    };
                    assert_eq!(orientation.is_mirrored(), held.is_mirrored);
                    (known, turns) = (known + 1, orientation.quarter_turns());
                    let pose = reception.panel_pose(0).measured();
                    if held.is_mirrored {
                        assert_eq!(reading.detection.bits, shown.seen(orientation));
                        assert!(pose.as_ref().is_err_and(|why| why.contains("mirrored")), "{pose:?}");
                        continue;
                    }
                    assert_eq!(reading.detection.bits, shown, "{held:?}, frame {number}");
                    assert_eq!(reading.detection.soft.hard(), shown);
                    let ([x, y], [true_x, true_y]) = (reading.corners.points()[0], held.at(0));
                    assert!((f64::from(x) - true_x).hypot(f64::from(y) - true_y) < 0.5, "{held:?}");
                    let roll_deg = pose.as_ref().unwrap().numbers().roll.value.to_degrees();
                    let off_deg = (roll_deg - held.roll_deg + 540.0).rem_euclid(360.0) - 180.0;
                    assert!(off_deg.abs() < 2.0, "{roll_deg} for {held:?}");
                }
            }
            assert!(known > 20, "{held:?}: known in {known} of 40 frames");
            let named = Orientation::new(turns, held.is_mirrored);
            assert_eq!(
                events.contains(&PanelEvent::Orientation(named)),
                named != Orientation::UPRIGHT,
                "{events:?}"
            );
            let of_message = |event: &PanelEvent| matches!(event, PanelEvent::Message(message) if message.data == b"ice ahead");
            assert!(events.iter().any(of_message), "{held:?}: {events:?}");
        }
    }

    #[test]
    fn settings_and_sizes_that_do_not_fit_are_refused() {
        let settings = ReceptionSettings {
            symbol_rate_hz: Some(200.0),
            ..ReceptionSettings::default()
        };
        assert!(matches!(Reception::new(settings).err(), Some(ReceiverError::SymbolRate(_))));
        let mut reception = Reception::new(ReceptionSettings::default()).unwrap();
        assert!(reception.set_fps(0.0).is_err() && reception.set_fps(30.0).is_ok());
        let no_lens = Err(String::new());
        let mut frame = |number, width, height| {
            let frame = Frame::new(&[90; 64 * 48], width, height).unwrap();
            reception
                .frame(Stamp::of(number), &frame, &no_lens, &mut ())
                .map(|reports| reports.len())
        };
        assert_eq!(frame(0, 64, 48), Ok(1));
        assert!(matches!(frame(1, 48, 64), Err(ReceptionError::Size { .. })));
    }
}
