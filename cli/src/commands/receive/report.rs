//! Reports on frames: messages and bits on standard output, losses and progress on standard error.

use std::io::Write;

use anyhow::Context;
use link::orientation::Orientation;
use link::signing::Verdict as Proof;
use reception::panel_pose::PanelPose;
use reception::signers::{Delivery, Signers};
use reception::{Message, PanelEvent, PanelReport, Reception, learnt};
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::FrameReading;

use super::Arguments;
use super::latency::Latency;
use super::places::Places;
use super::view::Feed;
use crate::files::Growing;
use crate::frames::waiting::Moment;
use crate::keys::keep_counters;
use crate::output::{self, Verdict, line};
use crate::pose;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::show;

/// The state and the settings of the report.
pub struct Report<'a> {
    arguments: &'a Arguments,
    as_json: bool,
    /// Whether to print poses as text.
    with_pose: bool,
    messages: u64,
    /// Maps frame numbers to indices, which name the frames.
    places: Places,
    /// Events of the current frame, with panel numbers.
    deliveries: Vec<(usize, Delivery)>,
    /// Trusted keys, and each panel's last message.
    signers: Signers,
    /// Messages not reported because they were not proven.
    withheld: u64,
    progress: Progress,
    /// The recording, if requested.
    recording: Option<Recording>,
    /// The page, if requested.
    view: Option<Feed>,
    /// The file of message bytes, if requested.
    bytes: Option<Growing>,
    /// Why drawing, recording or writing bytes stopped.
    undrawn: Option<anyhow::Error>,
    unrecorded: Option<anyhow::Error>,
    unwritten: Option<anyhow::Error>,
}

impl<'a> Report<'a> {
    /// A report on `total` frames, if known, of a file or a live source.
    pub fn new(
        arguments: &'a Arguments,
        as_json: bool,
        with_pose: bool,
        total: Option<u64>,
        is_live: bool,
        view: Option<Feed>,
    ) -> anyhow::Result<Self> {
        let progress = total.map_or_else(|| Progress::endless("frames"), |total| Progress::new(total, "frames"));
        let trust = arguments.trusting.trust()?;
        Ok(Self {
            arguments,
            as_json,
            with_pose,
            messages: 0,
            places: Places::default(),
            deliveries: Vec::new(),
            withheld: 0,
            progress,
            recording: Recording::open(
                arguments.mcap.as_deref(),
                arguments.foxglove,
                arguments.panels.into(),
                trust.is_checking(),
                &arguments.recorded,
                is_live,
            )?,
            view,
            signers: Signers::new(trust, arguments.trusting.only_trusted),
            bytes: arguments.out.as_deref().map(Growing::create).transpose()?,
            undrawn: None,
            unrecorded: None,
            unwritten: None,
        })
    }

    /// Time of the current frame in the recording, or as it is served, in nanoseconds.
    pub fn recorded_ns(&self) -> Option<u64> {
        self.recording.as_ref().map(Recording::time_ns)
    }

    /// Records something of the current frame, if requested.
    pub fn record(&mut self, write: impl FnOnce(&mut Recording) -> anyhow::Result<()>) {
        let Some(recording) = &mut self.recording else {
            return;
        };
        if let Err(error) = write(recording).with_context(|| recording.about()) {
            // Messages matter more than their recording.
            self.say(&format!("vocc: {error:#}; continuing without a recording"));
            self.recording.take_if(|recording| !recording.drop_files());
            self.unrecorded = Some(error);
        }
    }

    /// Shows something of the current frame on the page, if requested.
    pub fn view(&mut self, show: impl FnOnce(&mut Feed)) {
        if let Some(view) = &mut self.view {
            show(view);
        }
    }

    /// Writes a message's bytes, if requested.
    fn write(&mut self, message: &[u8]) {
        let Some(file) = &mut self.bytes else {
            return;
        };
        let written = file.write_all(message).and_then(|()| file.flush());
        if let Err(error) = written.context("cannot write the messages' bytes") {
            self.say(&format!("vocc: {error:#}; continuing without them"));
            self.bytes = None;
            self.unwritten = Some(error);
        }
    }

    /// Whether a message has arrived.
    pub fn has_message(&self) -> bool {
        self.messages > 0
    }

    /// Begins the frame with the camera's number `number`.
    pub fn begin(&mut self, number: u64) {
        self.places.push(number);
        let place = self.place();
        self.view(|view| view.begin(place));
    }

    /// Marks the current frame as done.
    pub fn done(&mut self) {
        self.progress.done(self.places.count());
    }

    /// Reports why the current frame is unusable.
    pub fn skip(&mut self, why: &str) {
        self.say(&format!("frame {}: {why}", self.place()));
        self.done();
    }

    /// Finishes the outputs; without a message, reports the reason and a remedy.
    pub fn end(mut self, advice: &[String]) -> anyhow::Result<Verdict> {
        // An error in one output must not lose the other.
        let recorded = self.recording.as_mut().map_or(Ok(()), |recording| {
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
        if self.withheld > 0 {
            self.say(&format!("messages that were not proven: {}", self.withheld));
        }
        if self.messages > 0 {
            return Ok(Verdict::Yes);
        }
        let frames = self.places.count();
        if self.withheld > 0 {
            self.say(&format!("no proven message in {frames} frames"));
            return Ok(Verdict::No);
        }
        self.say(&format!("no message in {frames} frames"));
        for line in advice {
            self.say(line);
        }
        Ok(Verdict::No)
    }

    /// The index of the current frame.
    fn place(&self) -> u64 {
        self.places.count().saturating_sub(1)
    }

    /// Reports a panel's camera estimates from all frames; in JSON the panel's last object.
    pub fn learnt(&mut self, panel: usize, learnt: &CameraEstimate) -> anyhow::Result<()> {
        if self.as_json {
            return output::json(&serde_json::json!({ "panel": panel, "camera": learnt::as_json(learnt) }));
        }
        self.say(&learnt::as_text(learnt));
        Ok(())
    }

    /// Reports the latency and the dropped frames of a live source; in JSON the last object.
    pub fn latency(&self, latency: &Latency) -> anyhow::Result<()> {
        let (frames, dropped) = (self.places.count(), latency.dropped());
        if !latency.is_known() {
            return Ok(());
        }
        if let Some(view) = &self.view {
            view.latency(&latency.as_json());
        }
        if self.as_json {
            return output::json(&serde_json::json!({ "frames": frames, "dropped": dropped, "latency": latency.as_json() }));
        }
        if dropped > 0 {
            self.say(&format!(
                "{dropped} of {} frames were dropped, because newer ones had arrived",
                frames + dropped
            ));
        }
        self.say(&latency.as_text());
        Ok(())
    }

    /// Prints a line on standard error, and on the page.
    pub fn say(&self, what: &str) {
        self.progress.aside(|| output::tell(what));
        if let Some(view) = &self.view {
            view.remark(what);
        }
    }

    fn print(&self, as_text: &str, as_json: &serde_json::Value) -> anyhow::Result<()> {
        self.progress
            .aside(|| if self.as_json { output::json(as_json) } else { line(as_text) })
    }

    /// Prints and draws a panel's reading in a frame, or the reason why there is none.
    pub fn panel(&mut self, report: &PanelReport, frame: &Frame, panel_pose: &PanelPose) -> anyhow::Result<()> {
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
                // The page has it with the frame.
                self.progress
                    .aside(|| output::tell(format_args!("frame {number}{of_panel}: {loss}")));
                return Ok(());
            }
        };
        if let (Some(folder), None) = (&self.arguments.show, &self.undrawn) {
            let path = folder.join(show::in_frame(number, panel));
            if let Err(error) = show::reading(&path, frame, reading, panel_pose) {
                // Messages matter more than their pictures.
                self.say(&format!("vocc: {error:#}; continuing without pictures"));
                self.undrawn = Some(error);
            }
        }
        self.record(|recording| recording.reading(panel, reading, panel_pose.pose()));
        if self.arguments.bits {
            self.bits(number, &of_panel, reading, report, panel_pose)?;
        }
        Ok(())
    }

    fn bits(
        &self,
        number: u64,
        of_panel: &str,
        reading: &FrameReading,
        report: &PanelReport,
        panel_pose: &PanelPose,
    ) -> anyhow::Result<()> {
        let (bits, [x, y]) = (reading.detection.bits, reading.corners.centre_px());
        self.print(
            &format!(
                "frame {number}{of_panel}: {bits} at ({x:.2}, {y:.2}) px{}",
                pose::panel_pose_text(panel_pose, self.with_pose)
            ),
            &reading_json(number, report, reading, panel_pose),
        )
    }

    /// Stores an event for [`Report::deliver`], and reports messages that are not proven at once if only proven ones are wanted.
    fn take_delivery(&mut self, panel: usize, delivery: Delivery) {
        let only_trusted = self.arguments.trusting.only_trusted;
        match &delivery {
            Delivery::Withheld => {
                self.withheld += 1;
                return;
            }
            Delivery::Message(..) => {
                self.messages += 1;
                self.withheld -= u64::from(only_trusted);
            }
            Delivery::Proof(data, proof) if only_trusted && !matches!(proof, Proof::Proven { .. }) => {
                self.say(&format!("{} {}", output::quoted(data), self.signers.trust().text(proof)));
                return;
            }
            Delivery::Proof(_, proof) if !self.signers.trust().is_checking() => {
                let advice = proof.claim().map_or("", |_| ": --trust checks it");
                self.say(&format!("panel {panel} shows its message {proof}{advice}"));
            }
            Delivery::Proof(..) => {}
        }
        self.deliveries.push((panel, delivery));
    }

    fn keep_counters(&mut self) {
        if let (Err(error), None) = (keep_counters(self.signers.trust_mut()), &self.unwritten) {
            self.say(&format!("vocc: {error:#}; continuing without keeping counters"));
            self.unwritten = Some(error);
        }
    }

    /// Stores a message for [`Report::deliver`], and reports other events of a panel at once.
    pub fn event(&mut self, panel: usize, event: &PanelEvent) {
        if let Some(delivery) = self.signers.delivery(panel, event) {
            self.keep_counters();
            self.take_delivery(panel, delivery);
        }
        match event {
            PanelEvent::Message(_) | PanelEvent::Signed(_) | PanelEvent::Unsigned => {}
            PanelEvent::Rejected(why) => self.say(&why.to_string()),
            PanelEvent::UnsupportedVersion(version) => self.say(&format!(
                "a transmitter of format version {version} was seen; this receiver reads version {}",
                link::framing::VERSION
            )),
            PanelEvent::SegmentFailed { segment, why } => self.say(&format!(
                "segment {segment} could not be decoded ({why}); waiting for it to be shown again"
            )),
            PanelEvent::Geometry(geometry) => self.say(&format!(
                "panel {panel} announces its size: LEDs of {} m, at an interval of {:.3}",
                geometry.led_diameter_m(),
                geometry.interval()
            )),
            PanelEvent::Orientation(orientation) => self.say(&format!("panel {panel} is {orientation} in the picture")),
            PanelEvent::RateFound(rate_hz) => self.say(&format!(
                "read at {rate_hz} symbols a second; --symbol-rate {rate_hz} reads it best, from the first frame on"
            )),
        }
    }

    /// Prints the messages completed by a frame of that moment, with the camera estimates and the pose of each panel.
    pub fn deliver(&mut self, reception: &Reception, moment: &Moment) -> anyhow::Result<()> {
        let is_checking = self.signers.trust().is_checking();
        for (panel, delivery) in std::mem::take(&mut self.deliveries) {
            match &delivery {
                Delivery::Message(message, proof) => {
                    self.record(|recording| recording.message(panel, &message.data));
                    self.write(&message.data);
                    let proof = Some(proof).filter(|_| is_checking);
                    self.record_proof(panel, &message.data, proof);
                    self.message(panel, message, proof, reception, moment)?;
                }
                Delivery::Proof(data, proof) if is_checking => {
                    self.record_proof(panel, data, Some(proof));
                    self.proof(panel, data, proof)?;
                }
                Delivery::Proof(_, proof) => self.unchecked(panel, proof)?,
                Delivery::Withheld => {}
            }
        }
        Ok(())
    }

    fn record_proof(&mut self, panel: usize, data: &[u8], proof: Option<&Proof>) {
        if let Some(proof) = proof {
            let text = format!("{} {}", output::quoted(data), self.signers.trust().text(proof));
            self.record(|recording| recording.verdict(panel, &text));
        }
    }

    /// Without trusted keys, standard output keeps one line a message; in JSON, the signer is an object without `message`.
    fn unchecked(&self, panel: usize, proof: &Proof) -> anyhow::Result<()> {
        if !self.as_json {
            return Ok(());
        }
        let mut told = serde_json::json!({ "panel": panel });
        self.signers.trust().add_json(&mut told, proof);
        self.progress.aside(|| output::json(&told))
    }

    /// Prefix of a line if several panels are followed.
    fn of_panel(&self, panel: usize) -> String {
        if self.arguments.panels > 1 {
            format!("panel {panel}: ")
        } else {
            String::new()
        }
    }

    fn proof(&self, panel: usize, data: &[u8], proof: &Proof) -> anyhow::Result<()> {
        let mut told = serde_json::json!({ "message": String::from_utf8_lossy(data), "panel": panel });
        if let Some(hex) = self.arguments.hex.of(data) {
            told["message_hex"] = hex.into();
        }
        self.signers.trust().add_json(&mut told, proof);
        let text = format!(
            "{}{} {}",
            self.of_panel(panel),
            output::quoted(data),
            self.signers.trust().text(proof)
        );
        if let Some(view) = &self.view {
            view.message(&told, true);
        }
        self.print(&text, &told)
    }

    fn message(
        &self,
        panel: usize,
        message: &Message,
        proof: Option<&Proof>,
        reception: &Reception,
        moment: &Moment,
    ) -> anyhow::Result<()> {
        let [first, last] = [message.first_frame, message.last_frame].map(|number| self.places.of(number));
        let (corrected, panel_pose) = (message.corrected_bits, reception.panel_pose(panel));
        let learnt = reception.learnt_each().get(panel).and_then(Option::as_ref);
        let (turned_deg, is_mirrored) = turned(reception.orientation(panel));
        let of_panel = self.of_panel(panel);
        let mut told = serde_json::json!({
            "message": String::from_utf8_lossy(&message.data), "panel": panel, "first_frame": first, "last_frame": last,
            "corrected_bits": corrected, "turned_deg": turned_deg, "is_mirrored": is_mirrored,
            "camera": learnt.map(learnt::as_json), "pose": pose::panel_pose_json(panel_pose),
        });
        if let Some(hex) = self.arguments.hex.of(&message.data) {
            told["message_hex"] = hex.into();
        }
        if let Some(latency) = Latency::since(moment) {
            told["latency_s"] = latency.as_secs_f64().into();
        }
        let proof_text = proof.map_or_else(String::new, |proof| {
            self.signers.trust().add_json(&mut told, proof);
            format!(", {}", self.signers.trust().text(proof))
        });
        if let Some(view) = &self.view {
            view.message(&told, false);
        }
        self.print(
            &format!(
                "{of_panel}{} in frames {first} to {last}, {corrected} bits corrected{}{proof_text}",
                output::quoted(&message.data),
                pose::panel_pose_text(panel_pose, self.with_pose)
            ),
            &told,
        )
    }
}

/// A panel's reading in a frame, as `--bits` prints it in JSON.
pub fn reading_json(number: u64, report: &PanelReport, reading: &FrameReading, panel_pose: &PanelPose) -> serde_json::Value {
    let (turned_deg, is_mirrored) = turned(report.orientation);
    serde_json::json!({
        "frame": number, "panel": report.panel, "bits": reading.detection.bits.to_string(), "symbol": report.symbol,
        "centre_px": reading.corners.centre_px(), "pitch_px": reading.corners.pitch_px(), "confidence": reading.detection.confidence,
        "turned_deg": turned_deg, "is_mirrored": is_mirrored,
        "pose": pose::panel_pose_json(panel_pose),
    })
}

/// The panel's clockwise rotation in the image in degrees, and whether it is mirrored, if known.
fn turned(orientation: Option<Orientation>) -> (Option<u32>, Option<bool>) {
    let degrees = orientation.map(Orientation::turned_deg);
    (degrees, orientation.map(Orientation::is_mirrored))
}
