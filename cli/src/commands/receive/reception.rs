//! The receiver at work on one frame after another.

use link::camera::{Camera, Encoding};
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{
    FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory,
};

use super::Arguments;
use super::report::Report;
use super::stage_times::StageTimes;
use crate::options::{self, Shared};
use crate::output::Answer;

/// The most pixels of a panel's bounding box.
const PANEL_PIXELS: usize = 160 * 160;

/// The receiver and what it has had to say.
pub struct Reception<'a, const PANELS: usize> {
    /// Made for the size of the first frame.
    receiver: Option<Receiving<PANELS>>,
    settings: ReceiverSettings,
    report: Report<'a>,
    frames: u64,
    times: StageTimes,
    prints_times: bool,
}

type Receiving<const PANELS: usize> = Receiver<
    PANEL_PIXELS,
    Box<ReceiverMemory<PANEL_PIXELS, PANELS>>,
    FrameSearch<Box<SearchMemory>, Vec<u8>>,
    PANELS,
>;

/// Frames that are kept to see what blinks.
const KEPT_FRAMES: usize = 2;

impl<'a, const PANELS: usize> Reception<'a, PANELS> {
    /// For so many frames, if that is known.
    pub fn new(
        arguments: &'a Arguments,
        shared: &Shared,
        total: Option<u64>,
    ) -> anyhow::Result<Self> {
        let settings = ReceiverSettings {
            camera: Camera {
                encoding: Encoding::Gamma(arguments.gamma),
                blur_sigma_px: arguments.blur,
                ..Camera::default()
            },
            method: options::untrained(arguments.detector)?,
            symbols_per_frame: arguments.symbol_rate / arguments.fps,
        };
        // Settings are refused before the first frame, not with it.
        receiver::<PANELS>(settings, 0)?;
        Ok(Self {
            receiver: None,
            settings,
            report: Report::new(arguments, shared.json, total),
            frames: 0,
            times: StageTimes::default(),
            prints_times: arguments.profile,
        })
    }

    /// Receives a frame.
    pub fn take(&mut self, frame: &Frame) -> anyhow::Result<()> {
        let number = self.frames;
        self.frames += 1;
        if self.receiver.is_none() {
            self.receiver = Some(receiver(self.settings, frame.width() * frame.height())?);
        }
        let Some(receiver) = &mut self.receiver else {
            return Ok(());
        };
        let report = &mut self.report;
        let mut told = Ok(());
        receiver.frame_each(number, frame, &mut self.times, |panel, outcome| {
            let done = report.frame(number, panel, frame, &outcome);
            let said = report.event(&outcome.event, panel);
            if told.is_ok() {
                told = done.and(said);
            }
        });
        self.report.done(self.frames);
        told
    }

    /// Counts a frame that cannot be used.
    pub fn lose(&mut self, why: &str) {
        self.report.say(&format!("frame {}: {why}", self.frames));
        self.frames += 1;
    }

    /// Tells what is left, and whether there was a message.
    pub fn finish(mut self) -> anyhow::Result<Answer> {
        let report = &mut self.report;
        let mut told = Ok(());
        if let Some(receiver) = &mut self.receiver {
            receiver.finish_each(|panel, event| {
                let said = report.event(&event, panel);
                if told.is_ok() {
                    told = said;
                }
            });
        }
        told?;
        let messages = self.report.end();
        if self.prints_times {
            self.times.print();
        }
        if messages > 0 {
            return Ok(Answer::Yes);
        }
        eprintln!("no message in {} frames", self.frames);
        Ok(Answer::No)
    }
}

fn receiver<const PANELS: usize>(
    settings: ReceiverSettings,
    frame_pixels: usize,
) -> anyhow::Result<Receiving<PANELS>> {
    let search = FrameSearch::with_history(Box::default(), vec![0; KEPT_FRAMES * frame_pixels]);
    Ok(Receiver::new(settings, Box::default(), search)?)
}
