//! What is told of frames: messages and bits on standard output, losses and progress on standard error.

use anyhow::Context;
use link::framing::{Event, SegmentOutcome};
use link::geometry::Geometry;
use rx_pipeline::camera::Learnt;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{Outcome, Reading};
use studies::reception::diagnosis::{Diagnosis, Gone};
use studies::reception::learnt;
use studies::reception::whereabouts::Whereabouts;

use super::Arguments;
use super::places::Places;
use crate::output::{self, Answer, line};
use crate::pose;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::show;

/// What has been told, and how it is to be.
pub struct Report<'a> {
    arguments: &'a Arguments,
    as_json: bool,
    /// Whether where panels are is printed for people.
    with_pose: bool,
    messages: u64,
    /// A frame is told of by its place among all so far.
    places: Places,
    diagnosis: Diagnosis,
    whole: Vec<Whole>,
    progress: Progress,
    /// Where it is kept, too, if that is asked for.
    recording: Option<Recording>,
    /// Why there are no more pictures, or no more is recorded.
    undrawn: Option<anyhow::Error>,
    unrecorded: Option<anyhow::Error>,
}

impl<'a> Report<'a> {
    /// Of so many panels, and frames, if that is known.
    ///
    /// # Errors
    /// When nothing can be recorded.
    pub fn new(arguments: &'a Arguments, panels: usize, as_json: bool, with_pose: bool, total: Option<u64>) -> anyhow::Result<Self> {
        let progress = total.map_or_else(|| Progress::endless("frames"), |total| Progress::new(total, "frames"));
        let recording = arguments.mcap.as_deref();
        Ok(Self {
            arguments,
            as_json,
            with_pose,
            messages: 0,
            places: Places::default(),
            diagnosis: Diagnosis::default(),
            whole: Vec::new(),
            progress,
            recording: recording.map(|path| Recording::create(path, panels)).transpose()?,
            undrawn: None,
            unrecorded: None,
        })
    }

    /// Records something of the frame at hand, if that is asked for.
    pub fn record(&mut self, write: impl FnOnce(&mut Recording) -> anyhow::Result<()>) {
        let Some(recording) = &mut self.recording else {
            return;
        };
        if let Err(error) = write(recording).with_context(|| recording.about()) {
            // Messages are worth more than what is kept of them.
            self.say(&format!("vocc: {error:#}; going on without a recording"));
            self.recording = None;
            self.unrecorded = Some(error);
        }
    }

    /// Begins a frame that the camera took as its `number`th.
    pub fn begin(&mut self, number: u64) {
        self.places.push(number);
    }

    /// Shows that it is done.
    pub fn done(&mut self) {
        self.progress.done(self.places.count());
    }

    /// Says why it cannot be used.
    pub fn lose(&mut self, why: &str) {
        self.say(&format!("frame {}: {why}", self.place()));
        self.done();
    }

    /// Says that the panel shows symbols at another rate than was gone by.
    pub fn found_rate(&self, rate_hz: f32) {
        self.say(&format!(
            "read at {rate_hz} symbols a second; --symbol-rate {rate_hz} reads it best, from the first frame on"
        ));
    }

    /// Says what a panel has told of its size.
    pub fn geometry(&self, panel: usize, geometry: Geometry) {
        self.say(&format!(
            "panel {panel} says how large it is: LEDs of {} m, at an interval of {:.3}",
            geometry.led_diameter_m(),
            geometry.interval()
        ));
    }

    /// Says why there was no message, if there was none: `rates` are those that were gone by, and that of the panel's changes.
    ///
    /// # Errors
    /// When a picture could not be drawn, or something not be recorded.
    pub fn end(mut self, rates: &Gone) -> anyhow::Result<Answer> {
        if let Some(recording) = self.recording.take() {
            let about = recording.about();
            recording.finish().context(about)?;
        }
        if let Some(error) = self.undrawn.take().or(self.unrecorded.take()) {
            return Err(error);
        }
        if self.messages > 0 {
            return Ok(Answer::Yes);
        }
        let frames = self.places.count();
        self.say(&format!("no message in {frames} frames"));
        for line in self.diagnosis.lines(rates) {
            self.say(&line);
        }
        Ok(Answer::No)
    }

    /// The place of the frame at hand among all.
    fn place(&self) -> u64 {
        self.places.count().saturating_sub(1)
    }

    /// Says what was learnt of the camera by a panel; where no message could, in JSON too.
    pub fn learnt(&mut self, panel: usize, learnt: &Learnt) -> anyhow::Result<()> {
        self.diagnosis.learn(learnt);
        if self.as_json {
            if self.messages == 0 {
                output::json(&serde_json::json!({ "panel": panel, "camera": learnt::as_json(learnt) }))?;
            }
        } else {
            self.say(&learnt::as_text(learnt));
        }
        Ok(())
    }

    /// Says something on standard error.
    pub fn say(&self, what: &str) {
        self.progress.aside(|| output::tell(what));
    }

    fn print(&self, as_text: &str, as_json: &serde_json::Value) -> anyhow::Result<()> {
        self.progress
            .aside(|| if self.as_json { output::json(as_json) } else { line(as_text) })
    }

    /// Prints and draws what a frame shows of a panel, with the number of the `symbol`, and says why it shows nothing.
    pub fn frame(
        &mut self,
        panel: usize,
        frame: &Frame,
        outcome: &Outcome,
        symbol: Option<u32>,
        whereabouts: &Whereabouts,
    ) -> anyhow::Result<()> {
        let of_panel = if self.arguments.panels > 1 {
            format!(", panel {panel}")
        } else {
            String::new()
        };
        let number = self.place();
        self.diagnosis.take(&outcome.reading);
        let reading = match &outcome.reading {
            Ok(reading) => reading,
            Err(loss) => {
                self.say(&format!("frame {number}{of_panel}: {loss}"));
                return Ok(());
            }
        };
        if let (Some(folder), None) = (&self.arguments.show, &self.undrawn) {
            let path = folder.join(format!("frame-{number:06}-panel-{panel}.png"));
            if let Err(error) = show::reading(&path, frame, reading, whereabouts) {
                // Messages are worth more than pictures of them.
                self.say(&format!("vocc: {error:#}; going on without pictures"));
                self.undrawn = Some(error);
            }
        }
        self.record(|recording| recording.reading(panel, reading, whereabouts.pose()));
        if self.arguments.bits {
            self.bits(number, panel, &of_panel, reading, symbol, whereabouts)?;
        }
        Ok(())
    }

    fn bits(
        &self,
        number: u64,
        panel: usize,
        of_panel: &str,
        reading: &Reading,
        symbol: Option<u32>,
        whereabouts: &Whereabouts,
    ) -> anyhow::Result<()> {
        let bits = reading.detection.bits.to_string();
        let [x, y] = reading.corners.centre_px();
        self.print(
            &format!(
                "frame {number}{of_panel}: {bits} at ({x:.2}, {y:.2}) px{}",
                pose::whereabouts_text(whereabouts, self.with_pose)
            ),
            &serde_json::json!({
                "frame": number, "panel": panel, "bits": bits, "symbol": symbol, "centre_px": [x, y],
                "pitch_px": reading.corners.pitch_px(), "confidence": reading.detection.confidence,
                "pose": pose::whereabouts_json(whereabouts),
            }),
        )
    }

    /// Keeps a message for [`Report::deliver`], and says why a part of one was lost.
    pub fn event(&mut self, event: &Event<'_>, panel: usize) {
        match event {
            Event::Delivered(delivery) => {
                self.messages += 1;
                self.whole.push(Whole {
                    panel,
                    text: String::from_utf8_lossy(delivery.message).into_owned(),
                    first: self.places.of(delivery.first_stamp),
                    last: self.places.of(delivery.last_stamp),
                    corrected: delivery.corrected_bits,
                });
            }
            Event::Rejected(why) => {
                self.diagnosis.reject();
                self.say(&why.to_string());
            }
            Event::UnsupportedVersion(version) => self.say(&format!(
                "a transmitter of format version {version} was seen; this receiver reads version {}",
                link::framing::VERSION
            )),
            Event::Segment {
                header,
                outcome: SegmentOutcome::Failed(why),
                ..
            } => self.say(&format!(
                "segment {} could not be decoded ({why}); waiting for it to be shown again",
                header.segment
            )),
            _ => {}
        }
    }

    /// Prints the messages that have become whole, with what is learnt of each panel's camera, and where the panel is.
    pub fn deliver(&mut self, learnt: &[Option<Learnt>], whereabouts: &[Whereabouts]) -> anyhow::Result<()> {
        for message in std::mem::take(&mut self.whole) {
            let panel = message.panel;
            let learnt = learnt.get(panel).and_then(Option::as_ref);
            self.record(|recording| recording.message(panel, &message.text));
            self.message(&message, learnt, &whereabouts[panel])?;
        }
        Ok(())
    }

    fn message(&self, message: &Whole, learnt: Option<&Learnt>, whereabouts: &Whereabouts) -> anyhow::Result<()> {
        let Whole {
            panel,
            text,
            first,
            last,
            corrected,
        } = message;
        let of_panel = if self.arguments.panels > 1 {
            format!("panel {panel}: ")
        } else {
            String::new()
        };
        self.print(
            &format!(
                "{of_panel}{text:?} in frames {first} to {last}, {corrected} bits corrected{}",
                pose::whereabouts_text(whereabouts, self.with_pose)
            ),
            &serde_json::json!({
                "message": text, "panel": panel, "first_frame": first, "last_frame": last, "corrected_bits": corrected,
                "camera": learnt.map(learnt::as_json), "pose": pose::whereabouts_json(whereabouts),
            }),
        )
    }
}

/// A message that has become whole in the frame at hand.
struct Whole {
    panel: usize,
    text: String,
    first: u64,
    last: u64,
    corrected: u32,
}
