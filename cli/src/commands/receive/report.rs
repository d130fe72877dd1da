//! What is told of frames: messages and bits on standard output, losses and progress on standard error.

use std::io::Write;

use anyhow::Context;
use link::orientation::Orientation;
use reception::whereabouts::Whereabouts;
use reception::{Message, PanelEvent, PanelReport, Reception, learnt};
use rx_pipeline::camera::Learnt;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::Reading;

use super::Arguments;
use super::latency::Latency;
use super::places::Places;
use crate::files::Growing;
use crate::frames::waiting::Moment;
use crate::output::{self, Verdict, line};
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
    /// Messages that have become whole in the frame at hand, with the numbers of their panels.
    new_messages: Vec<(usize, Message)>,
    progress: Progress,
    /// Where it is kept, too, if that is asked for.
    recording: Option<Recording>,
    /// Where the bytes of messages go, if that is asked for.
    bytes: Option<Growing>,
    /// Why there are no more pictures, no more is recorded, or no more bytes are written.
    undrawn: Option<anyhow::Error>,
    unrecorded: Option<anyhow::Error>,
    unwritten: Option<anyhow::Error>,
}

impl<'a> Report<'a> {
    /// Of `total` frames, if that is known, of a source that may be live.
    ///
    /// # Errors
    /// When nothing can be recorded.
    pub fn new(arguments: &'a Arguments, as_json: bool, with_pose: bool, total: Option<u64>, is_live: bool) -> anyhow::Result<Self> {
        let progress = total.map_or_else(|| Progress::endless("frames"), |total| Progress::new(total, "frames"));
        let recording = arguments.mcap.as_deref();
        Ok(Self {
            arguments,
            as_json,
            with_pose,
            messages: 0,
            places: Places::default(),
            new_messages: Vec::new(),
            progress,
            recording: recording
                .map(|path| Recording::create(path, arguments.panels.into(), &arguments.recorded, is_live))
                .transpose()?,
            bytes: arguments.out.as_deref().map(Growing::create).transpose()?,
            undrawn: None,
            unrecorded: None,
            unwritten: None,
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

    /// Writes a message's bytes, if that is asked for.
    fn write(&mut self, message: &[u8]) {
        let Some(file) = &mut self.bytes else {
            return;
        };
        let written = file.write_all(message).and_then(|()| file.flush());
        if let Err(error) = written.context("cannot write the messages' bytes") {
            self.say(&format!("vocc: {error:#}; going on without them"));
            self.bytes = None;
            self.unwritten = Some(error);
        }
    }

    /// Whether a message has come.
    pub fn has_message(&self) -> bool {
        self.messages > 0
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
    pub fn skip(&mut self, why: &str) {
        self.say(&format!("frame {}: {why}", self.place()));
        self.done();
    }

    /// Says why there was no message, if there was none, and what would help.
    ///
    /// # Errors
    /// When a picture could not be drawn, or something not be recorded or written.
    pub fn end(mut self, advice: &[String]) -> anyhow::Result<Verdict> {
        // One that cannot be finished is no reason to lose the other.
        let recorded = self.recording.take().map_or(Ok(()), |recording| {
            let about = recording.about();
            recording.finish().context(about)
        });
        if let Some(file) = self.bytes.take().filter(|_| self.messages > 0) {
            file.keep().context("cannot write the messages' bytes")?;
        }
        recorded?;
        if let Some(error) = self.undrawn.take().or(self.unrecorded.take()).or(self.unwritten.take()) {
            return Err(error);
        }
        if self.messages > 0 {
            return Ok(Verdict::Yes);
        }
        let frames = self.places.count();
        self.say(&format!("no message in {frames} frames"));
        for line in advice {
            self.say(line);
        }
        Ok(Verdict::No)
    }

    /// The place of the frame at hand among all.
    fn place(&self) -> u64 {
        self.places.count().saturating_sub(1)
    }

    /// Says what was learnt of the camera by a panel in all frames; in JSON it is the panel's last object.
    pub fn learnt(&mut self, panel: usize, learnt: &Learnt) -> anyhow::Result<()> {
        if self.as_json {
            return output::json(&serde_json::json!({ "panel": panel, "camera": learnt::as_json(learnt) }));
        }
        self.say(&learnt::as_text(learnt));
        Ok(())
    }

    /// Says how long it took from frames to text, and how many were dropped, where the source was live; in JSON it is the last object.
    pub fn latency(&self, latency: &Latency) -> anyhow::Result<()> {
        let (frames, dropped) = (self.places.count(), latency.dropped());
        if !latency.is_known() {
            return Ok(());
        }
        if self.as_json {
            return output::json(&serde_json::json!({ "frames": frames, "dropped": dropped, "latency": latency.as_json() }));
        }
        if dropped > 0 {
            self.say(&format!(
                "{dropped} of {} frames were dropped, as newer ones had come",
                frames + dropped
            ));
        }
        self.say(&latency.as_text());
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

    /// Prints and draws what a frame shows of a panel, and says why it shows nothing.
    pub fn panel(&mut self, report: &PanelReport, frame: &Frame, whereabouts: &Whereabouts) -> anyhow::Result<()> {
        let panel = report.panel;
        for event in &report.events {
            self.event(panel, event);
        }
        let of_panel = if self.arguments.panels > 1 {
            format!(", panel {panel}")
        } else {
            String::new()
        };
        let number = self.place();
        let reading = match &report.reading {
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
            self.bits(number, &of_panel, reading, report, whereabouts)?;
        }
        Ok(())
    }

    fn bits(&self, number: u64, of_panel: &str, reading: &Reading, report: &PanelReport, whereabouts: &Whereabouts) -> anyhow::Result<()> {
        let bits = reading.detection.bits.to_string();
        let [x, y] = reading.corners.centre_px();
        let (turned_deg, is_mirrored) = turned(report.orientation);
        self.print(
            &format!(
                "frame {number}{of_panel}: {bits} at ({x:.2}, {y:.2}) px{}",
                pose::whereabouts_text(whereabouts, self.with_pose)
            ),
            &serde_json::json!({
                "frame": number, "panel": report.panel, "bits": bits, "symbol": report.symbol, "centre_px": [x, y],
                "pitch_px": reading.corners.pitch_px(), "confidence": reading.detection.confidence,
                "turned_deg": turned_deg, "is_mirrored": is_mirrored,
                "pose": pose::whereabouts_json(whereabouts),
            }),
        )
    }

    /// Keeps a message for [`Report::deliver`], and tells the rest of what a panel's symbols brought.
    pub fn event(&mut self, panel: usize, event: &PanelEvent) {
        match event {
            PanelEvent::Message(message) => {
                self.messages += 1;
                self.new_messages.push((panel, message.clone()));
            }
            // Nobody checks signatures yet.
            PanelEvent::Signed(_) | PanelEvent::Unsigned => {}
            PanelEvent::Rejected(why) => self.say(&why.to_string()),
            PanelEvent::UnsupportedVersion(version) => self.say(&format!(
                "a transmitter of format version {version} was seen; this receiver reads version {}",
                link::framing::VERSION
            )),
            PanelEvent::SegmentFailed { segment, why } => self.say(&format!(
                "segment {segment} could not be decoded ({why}); waiting for it to be shown again"
            )),
            PanelEvent::Geometry(geometry) => self.say(&format!(
                "panel {panel} says how large it is: LEDs of {} m, at an interval of {:.3}",
                geometry.led_diameter_m(),
                geometry.interval()
            )),
            PanelEvent::Orientation(orientation) => self.say(&format!("panel {panel} is {orientation} in the picture")),
            PanelEvent::RateFound(rate_hz) => self.say(&format!(
                "read at {rate_hz} symbols a second; --symbol-rate {rate_hz} reads it best, from the first frame on"
            )),
        }
    }

    /// Prints the messages that have become whole with a frame of that moment, with what is learnt of each panel's camera, and where the panel
    /// is.
    pub fn deliver(&mut self, reception: &Reception, moment: &Moment) -> anyhow::Result<()> {
        for (panel, message) in std::mem::take(&mut self.new_messages) {
            self.record(|recording| recording.message(panel, &message.data));
            self.write(&message.data);
            self.message(panel, &message, reception, moment)?;
        }
        Ok(())
    }

    fn message(&self, panel: usize, message: &Message, reception: &Reception, moment: &Moment) -> anyhow::Result<()> {
        let [first, last] = [message.first_frame, message.last_frame].map(|number| self.places.of(number));
        let (corrected, whereabouts) = (message.corrected_bits, reception.whereabouts(panel));
        let learnt = reception.learnt_each().get(panel).and_then(Option::as_ref);
        let (turned_deg, is_mirrored) = turned(reception.orientation(panel));
        let of_panel = if self.arguments.panels > 1 {
            format!("panel {panel}: ")
        } else {
            String::new()
        };
        let mut told = serde_json::json!({
            "message": String::from_utf8_lossy(&message.data), "panel": panel, "first_frame": first, "last_frame": last,
            "corrected_bits": corrected, "turned_deg": turned_deg, "is_mirrored": is_mirrored,
            "camera": learnt.map(learnt::as_json), "pose": pose::whereabouts_json(whereabouts),
        });
        if let Some(hex) = self.arguments.hex.of(&message.data) {
            told["message_hex"] = hex.into();
        }
        if let Some(latency) = Latency::since(moment) {
            told["latency_s"] = latency.as_secs_f64().into();
        }
        self.print(
            &format!(
                "{of_panel}{} in frames {first} to {last}, {corrected} bits corrected{}",
                output::quoted(&message.data),
                pose::whereabouts_text(whereabouts, self.with_pose)
            ),
            &told,
        )
    }
}

/// By how many degrees a panel is turned clockwise in the picture, and whether in a mirror image; as far as that is known.
fn turned(orientation: Option<Orientation>) -> (Option<u32>, Option<bool>) {
    let degrees = orientation.map(|orientation| 90 * u32::from(orientation.quarter_turns()));
    (degrees, orientation.map(Orientation::is_mirrored))
}
