//! The frames of one source, and their reports.

use std::time::Instant;

use reception::deep::SampleKind;
use reception::{Reception, ReceptionSettings, Stamp, USUAL_FPS};
use rx_pipeline::frame::Frame;

use super::Arguments;
use super::latency::Latency;
use super::report::Report;
use super::stage_times::StageTimes;
use super::view::{Details, Feed};
use super::watch::Watch;
use crate::camera::CameraHints;
use crate::frames::waiting::Moment;
use crate::options::{self, SharedOptions};
use crate::output::Verdict;
use crate::recording::Recording;

/// A reception and its report.
pub struct Session<'a> {
    reception: Reception,
    hints: CameraHints,
    arguments: &'a Arguments,
    report: Report<'a>,
    /// The number of the next consecutive frame.
    next: u64,
    times: StageTimes,
    latency: Latency,
    watch: Watch,
}

impl<'a> Session<'a> {
    /// A session for `total` frames, if known, of a file or a live source, on a page if requested.
    pub fn new(
        arguments: &'a Arguments,
        hints: CameraHints,
        shared: &SharedOptions,
        total: Option<u64>,
        is_live: bool,
        view: Option<Feed>,
    ) -> anyhow::Result<Self> {
        let settings = ReceptionSettings {
            camera: hints.camera,
            line_delay: hints.line_delay,
            method: options::untrained(arguments.detector)?,
            fps: arguments.fps.unwrap_or(USUAL_FPS),
            symbol_rate_hz: arguments.symbol_rate,
            panel_size: arguments.panel.size()?,
        };
        let reception = Reception::with_panels(settings, arguments.panels.into())?;
        let with_pose = arguments.panel.is_set() || hints.calibration.is_set();
        Ok(Self {
            reception,
            hints,
            arguments,
            report: Report::new(arguments, shared.json, with_pose, total, is_live, view)?,
            next: 0,
            times: StageTimes::default(),
            latency: Latency::default(),
            watch: Watch::new(arguments.recorded.frame_id()),
        })
    }

    /// Sets the stream's frame rate unless the user gave one.
    pub fn set_usual_fps(&mut self, fps: f32) -> anyhow::Result<()> {
        if self.arguments.fps.is_none() {
            self.reception.set_fps(fps)?;
        }
        Ok(())
    }

    /// Sets the usual rate of frames with time stamps; `doubled` frames were duplicates.
    pub fn set_stamped_fps(&mut self, fps: f32, doubled: usize) -> anyhow::Result<()> {
        self.say_doubled(doubled);
        Ok(self.reception.set_fps(fps)?)
    }

    /// Reports how many frames repeat the time of the frame before, if any.
    pub fn say_doubled(&self, doubled: usize) {
        if doubled > 0 {
            self.say(&format!("{doubled} frames have the time of the frame before, and are skipped"));
        }
    }

    /// Whether a message has arrived.
    pub fn has_message(&self) -> bool {
        self.report.has_message()
    }

    /// Checks that a frame has the size and the kind of samples of those before.
    pub fn check(&mut self, size: (usize, usize), samples: SampleKind) -> anyhow::Result<()> {
        self.reception.check_size(size)?;
        Ok(self.reception.check_samples(samples, || self.hints.of_pixels(samples))?)
    }

    /// Prints a line on standard error.
    pub fn say(&self, what: &str) {
        self.report.say(what);
    }

    /// Receives the next consecutive frame.
    pub fn next_frame(&mut self, frame: &Frame) -> anyhow::Result<()> {
        self.frame(Stamp::of(self.next), frame, &Moment::default())
    }

    /// Receives a frame of that stamp and moment.
    pub fn frame(&mut self, stamp: Stamp, frame: &Frame, moment: &Moment) -> anyhow::Result<()> {
        let (begun, decoded) = (Instant::now(), self.times.decoding());
        self.next = stamp.number.saturating_add(1);
        self.report.begin(stamp.number);
        let time_s = self.reception.time_s(stamp);
        let lens = self.hints.calibration.lens([frame.width(), frame.height()]);
        self.report
            .record(|recording| recording.frame(time_s, moment.unix(), frame, lens.as_ref().ok()));
        let panels = self.reception.frame(stamp, frame, &lens, &mut self.times)?;
        self.watch.frame(&panels);
        for panel in panels {
            let panel_pose = self.reception.panel_pose(panel.panel);
            self.report.panel(&panel, frame, panel_pose)?;
            self.report.view(|view| view.panel(panel, panel_pose));
        }
        self.report.deliver(&self.reception, moment)?;
        self.report.done();
        let latency = self.latency.add(moment, begun, self.times.decoding() - decoded);
        self.watch.record(&mut self.report, &self.reception, moment.after_dropped, latency);
        let details = Details {
            symbol_rate_hz: self.reception.symbol_rate_hz(),
            latency,
            dropped: self.latency.dropped(),
            learnt: self.reception.learnt().copied(),
        };
        self.report.view(|view| view.frame(frame, details));
        Ok(())
    }

    /// Flushes the recording while no frame arrives.
    pub fn idle(&mut self) {
        self.watch.silence(&mut self.report);
        self.report.record(Recording::keep_up);
    }

    /// Counts an unusable frame.
    pub fn skip(&mut self, number: u64, why: &str) {
        self.next = number.saturating_add(1);
        self.report.begin(number);
        self.report.skip(why);
        self.watch.unusable();
    }

    /// Reports the remaining events, and whether there was a message.
    pub fn finish(mut self) -> anyhow::Result<Verdict> {
        for (panel, event) in self.reception.finish() {
            self.report.event(panel, &event);
            self.watch.event(panel, &event);
        }
        self.report.deliver(&self.reception, &Moment::default())?;
        for (panel, learnt) in self.reception.learnt_each().iter().enumerate() {
            if let Some(learnt) = learnt {
                self.report.learnt(panel, learnt)?;
            }
        }
        self.watch.finish(&mut self.report, &self.reception);
        self.report.latency(&self.latency)?;
        let saved = self.save_camera();
        if self.arguments.profile {
            self.times.print();
        }
        let verdict = self.report.end(&self.reception.advice(true));
        saved.and(verdict)
    }

    /// Writes the camera estimates, if requested.
    fn save_camera(&self) -> anyhow::Result<()> {
        let Some(path) = &self.arguments.save_camera else {
            return Ok(());
        };
        match self.reception.learnt() {
            Some(learnt) => self.hints.save(path, learnt, self.reception.samples().unwrap_or(SampleKind::Plain)),
            None => {
                self.say(&format!(
                    "no panel was read, so nothing was learnt about the camera: {} is not written",
                    path.display()
                ));
                Ok(())
            }
        }
    }
}
