//! The receiver at work on one frame after another.

use anyhow::ensure;
use rx_pipeline::camera::Learnt;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::ReceiverSettings;
use studies::reception::diagnosis::Gone;
use studies::reception::rates::{Heard, Rates};
use studies::reception::whereabouts::{Sight, Whereabouts};
use studies::reception::{Receiving, USUAL_FPS, receiver};

use super::Arguments;
use super::report::Report;
use super::stage_times::{Spent, StageTimes};
use crate::camera::Told;
use crate::options::{self, Shared};
use crate::output::Answer;
use crate::pose::Surveyor;

/// The receiver and what it has had to say.
pub struct Reception<'a, const PANELS: usize> {
    /// Made for the size of the first frame.
    receiver: Option<Receiving<PANELS>>,
    settings: ReceiverSettings,
    told: Told,
    arguments: &'a Arguments,
    /// Frames a second of the camera.
    fps: f32,
    /// By the number of the panel, from its first reading on.
    rates: [Option<Rates>; PANELS],
    /// Where each panel is, and how it moves.
    surveyor: Surveyor,
    whereabouts: [Whereabouts; PANELS],
    /// What has been learnt of the camera by each panel before the frame at hand.
    learnt: [Option<Learnt>; PANELS],
    report: Report<'a>,
    /// The next frame's number, if it follows the last one.
    next: u64,
    /// Whether frames have been brought to 8 bits from more.
    deep: bool,
    size: Option<(usize, usize)>,
    times: StageTimes,
    pose_times: Spent,
}

impl<'a, const PANELS: usize> Reception<'a, PANELS> {
    /// For so many frames, if that is known.
    pub fn new(arguments: &'a Arguments, told: Told, shared: &Shared, total: Option<u64>) -> anyhow::Result<Self> {
        let fps = arguments.fps.unwrap_or(USUAL_FPS);
        let settings = ReceiverSettings {
            camera: told.camera,
            method: options::untrained(arguments.detector)?,
            symbols_per_frame: arguments.rate_hz(fps) / fps,
        };
        // Settings are refused before the first frame, not with it.
        receiver::<PANELS>(settings, (0, 0))?;
        let surveyor = Surveyor::new(&arguments.panel, told.calibration)?;
        let report = Report::new(arguments, PANELS, shared.json, surveyor.is_asked(), total)?;
        Ok(Self {
            receiver: None,
            settings,
            told,
            arguments,
            fps,
            rates: [const { None }; PANELS],
            surveyor,
            whereabouts: [const { Whereabouts::UNKNOWN }; PANELS],
            learnt: [None; PANELS],
            report,
            deep: false,
            next: 0,
            size: None,
            times: StageTimes::default(),
            pose_times: Spent::default(),
        })
    }

    /// Goes by so many frames a second, unless others were told.
    pub fn by_default(&mut self, fps: f32) -> anyhow::Result<()> {
        match self.arguments.fps {
            None => self.go_by(fps),
            Some(_) => Ok(()),
        }
    }

    fn go_by(&mut self, fps: f32) -> anyhow::Result<()> {
        self.fps = fps;
        self.settings.symbols_per_frame = self.arguments.rate_hz(fps) / fps;
        receiver::<PANELS>(self.settings, (0, 0))?;
        Ok(())
    }

    /// Goes by the time stamps of frames, whose usual rate is `fps`, and of which so many were there twice.
    pub fn by_stamps(&mut self, fps: f32, doubled: usize) -> anyhow::Result<()> {
        if doubled > 0 {
            self.report
                .say(&format!("{doubled} frames have the time of the frame before, and are left out"));
        }
        self.go_by(fps)
    }

    /// The frames to come have been brought to 8 bits from more.
    pub fn is_deep(&mut self) {
        self.deep = true;
        self.settings.camera = self.told.of_pixels(true);
    }

    /// Whether a frame is as large as those before.
    pub fn check_size(&mut self, size: (usize, usize)) -> anyhow::Result<()> {
        let film = *self.size.get_or_insert(size);
        ensure!(
            size == film,
            "it is {} × {} pixels, and the film {} × {}: give frames of one size, each film by itself",
            size.0,
            size.1,
            film.0,
            film.1
        );
        Ok(())
    }

    /// Receives a frame that follows the one before.
    pub fn take_next(&mut self, frame: &Frame) -> anyhow::Result<()> {
        self.take(self.next, 0.0, frame)
    }

    /// Receives frame `number` of the camera, taken so many frame periods `late`.
    pub fn take(&mut self, number: u64, late: f64, frame: &Frame) -> anyhow::Result<()> {
        self.next = number + 1;
        self.report.begin(number);
        if self.receiver.is_none() {
            let mut receiver = receiver(self.settings, (frame.width(), frame.height()))?;
            if let Some(delay) = self.told.line_delay {
                receiver.tell_line_delay(delay);
            }
            self.receiver = Some(receiver);
        }
        let Some(receiver) = &mut self.receiver else {
            return Ok(());
        };
        let (report, rates) = (&mut self.report, &mut self.rates);
        let (arguments, fps) = (self.arguments, self.fps);
        let time_s = (number as f64 + late) / f64::from(fps);
        report.record(|recording| recording.frame(time_s, frame));
        let lens = self.surveyor.lens(frame);
        let (meter, whereabouts) = (&mut self.surveyor.meter, &mut self.whereabouts);
        let poses = &mut self.pose_times;
        let (learnt, settings) = (&self.learnt, &self.settings);
        let mut told = Ok(());
        receiver.set_late(late);
        receiver.frame_each(number, frame, &mut self.times, |panel, outcome| {
            let rates = rates[panel].get_or_insert_with(|| arguments.rates(fps));
            let detection = outcome.reading.as_ref().ok();
            let detection = detection.map(|reading| &reading.detection);
            rates.hear(&outcome.event, number, late, detection, |heard| {
                tell(report, panel, heard);
            });
            let symbol = rates.symbol().or(outcome.symbol);
            let whereabouts = &mut whereabouts[panel];
            let said = rates.take_geometry(&outcome.event);
            if let Some(said) = said.filter(|&said| whereabouts.hear(said)) {
                report.geometry(panel, said);
            }
            match &outcome.reading {
                Ok(reading) => {
                    let camera = learnt[panel].map_or(settings.camera, |learnt| learnt.camera);
                    let sight = Sight {
                        frame,
                        reading,
                        camera: &camera,
                        lens: lens.clone(),
                    };
                    poses.on(|| whereabouts.measure(meter, time_s, &sight));
                }
                Err(why) => whereabouts.lose(why),
            }
            let done = report.frame(panel, frame, &outcome, symbol, whereabouts);
            if told.is_ok() {
                told = done;
            }
        });
        told?;
        self.learnt = receiver.learnt_each();
        report.deliver(&self.learnt, &self.whereabouts)?;
        self.report.done();
        Ok(())
    }

    /// Counts a frame that cannot be used.
    pub fn lose(&mut self, number: u64, why: &str) {
        self.next = number + 1;
        self.report.begin(number);
        self.report.lose(why);
    }

    /// Tells what is left, and whether there was a message.
    pub fn finish(mut self) -> anyhow::Result<Answer> {
        let mut learnt = [None; PANELS];
        if let Some(receiver) = &mut self.receiver {
            receiver.finish_each(|panel, event| {
                if let Some(rates) = &mut self.rates[panel] {
                    rates.hear_last(&event, |heard| tell(&mut self.report, panel, heard));
                }
            });
            learnt = receiver.learnt_each();
        }
        self.report.deliver(&learnt, &self.whereabouts)?;
        for (panel, learnt) in learnt.iter().enumerate() {
            if let Some(learnt) = learnt {
                self.report.learnt(panel, learnt)?;
            }
        }
        let learnt = learnt.into_iter().flatten().next();
        if let Some(path) = &self.arguments.save_camera {
            match &learnt {
                Some(learnt) => self.told.save(path, learnt, self.deep)?,
                None => self.report.say(&format!(
                    "no panel was read, so nothing was learnt of the camera: {} is not written",
                    path.display()
                )),
            }
        }
        if self.arguments.profile {
            self.times.print(&self.pose_times);
        }
        let gone = Gone {
            symbols_hz: self.arguments.rate_hz(self.fps),
            fps: self.fps,
            changes_hz: self.rates.iter().flatten().find_map(Rates::seen_hz),
            has_options: true,
        };
        self.report.end(&gone)
    }
}

/// Tells what became of a panel's symbols.
fn tell(report: &mut Report, panel: usize, heard: Heard<'_>) {
    match heard {
        Heard::Event(event) => report.event(event, panel),
        Heard::Rate(rate_hz) => report.found_rate(rate_hz),
    }
}
