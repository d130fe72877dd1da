//! Processes successive frames into readings, poses and messages.

use std::ffi::CString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use atomic_write_file::AtomicWriteFile;
use link::orientation::Orientation;
use link::signing::Verdict;
use numpy::PyArray2;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use reception::colour::Channel;
use reception::deep::Compander;
use reception::diagnostics::{self, Diagnostics};
use reception::keys::Trust;
use reception::loss;
use reception::panel_pose::configured_size;
use reception::signers::{Delivery, Signers};
use reception::{PANELS_MAX, PanelEvent, PanelReport, Reception, ReceptionSettings, Stamp, USUAL_FPS};
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::FrameReading;

use crate::arrays::{self, Image, Pixels};
use crate::camera::{Camera, LearntCamera, camera_of};
use crate::decode::{compander, llr, untrained};
use crate::errors::{check, guarded, refused};
use crate::pose::{self, Pose};
use crate::record::record;

/// Maximum time in seconds: its nanoseconds fit into a `u64`.
const SECONDS_MAX: f64 = 1e10;

record! {
    /// A panel that was read in a frame.
    Reading {
        /// The frame's number.
        frame: u64,
        /// The panel's number, from 0.
        panel: usize,
        /// Its bits, bool of shape (8, 8): in the panel's own rows and columns once `turned_deg` is known. Until then, and if the picture
        /// is mirrored, in those of the picture.
        bits: Py<PyArray2<bool>>,
        /// The log-likelihood ratio of each LED, positive for On, float32 of shape (8, 8).
        llr: Py<PyArray2<f32>>,
        /// The confidence: the mean probability that a bit is right according to the ratios, 0.5 to 1.
        confidence: f32,
        /// The corner LEDs, top left, top right, bottom right and bottom left: x and y in pixels, of shape (4, 2).
        corners_px: Py<PyArray2<f32>>,
        /// The panel's centre, in pixels.
        centre_px: (f32, f32),
        /// The distance between neighbouring LEDs, in pixels.
        pitch_px: f32,
        /// The number of the symbol that it shows, if it is known.
        symbol: Option<u32>,
        /// Whether the panel's bits seem to be the phase of a carrier. False until its frames show it, and then bits and `llr` may be those
        /// of the complement, as the frame shows them.
        has_carrier: bool,
        /// The panel's clockwise rotation in the picture, in degrees: 0, 90, 180 or 270. Known from the first message header on.
        turned_deg: Option<u32>,
        /// Whether the picture is mirrored, if that is known.
        is_mirrored: Option<bool>,
        /// The pose of the panel, if the camera's focal length and the panel's size are configured.
        pose: Option<Py<Pose>>,
        /// Why the pose is unknown.
        no_pose: Option<String>,
    }
}

record! {
    /// Why a panel was not read in a frame.
    Loss {
        /// The frame's number.
        frame: u64,
        /// The panel's number, from 0.
        panel: usize,
        /// The reason in a word for counts, such as "covered" or "no_candidate".
        kind: &'static str,
        /// The reason.
        why: String,
    }
}

record! {
    /// A complete message. Its signature comes after it: see Proof.
    Message {
        /// Its text; bytes that are not UTF-8 are replaced.
        text: String,
        /// Its bytes.
        data: Vec<u8>,
        /// The number of the panel that showed it, from 0.
        panel: usize,
        /// The number of the first frame that showed a part of it.
        first_frame: u64,
        /// The number of the last such frame.
        last_frame: u64,
        /// Number of corrected bits.
        corrected_bits: u32,
        /// "unproven", as no signature has come yet; with `only_trusted`, "proven".
        verdict: &'static str,
        /// The name of the key that signed it, 8 hexadecimal digits, if it is proven.
        signer: Option<String>,
        /// The key's owner.
        signer_name: Option<String>,
        /// The signature's counter.
        counter: Option<u32>,
    }
}

record! {
    /// The verdict on the signer of an earlier message.
    Proof {
        /// The message's text; bytes that are not UTF-8 are replaced.
        text: String,
        /// The message's bytes.
        data: Vec<u8>,
        /// The number of the panel that showed it, from 0.
        panel: usize,
        /// "proven": a trusted key signed it, with a greater counter than any before. "replayed": with one that is not greater. "forged":
        /// the key that it names did not sign it. "unknown": that key is not trusted. "unchecked": it names a key, and none are trusted.
        /// "unsigned": it is shown without a signature.
        verdict: &'static str,
        /// The name of the key that the signature names, 8 hexadecimal digits.
        signer: Option<String>,
        /// The key's owner, if it is trusted.
        signer_name: Option<String>,
        /// The signature's counter.
        counter: Option<u32>,
    }
}

record! {
    /// The results of a frame.
    Received {
        /// The frame's number.
        frame: u64,
        /// The panels that were read.
        readings: Vec<Py<Reading>>,
        /// The panels that were not read, with reasons.
        losses: Vec<Py<Loss>>,
        /// The messages that were completed.
        messages: Vec<Py<Message>>,
        /// Verdicts on the signers of earlier messages.
        proofs: Vec<Py<Proof>>,
    }
}

record! {
    /// The status of the camera or of a panel, in the terms of ROS's diagnostic_msgs.
    Status {
        /// 0: as it should be; 1: worse; 2: it does not work.
        level: u8,
        /// The subject: "vocc: camera" or "vocc: panel 0".
        name: String,
        /// Why it has this level.
        message: String,
        /// The camera's name, or "panel_0".
        hardware_id: String,
        /// Counts and the like, by their keys.
        values: Py<PyDict>,
    }
}

/// Receives messages from successive frames, as `vocc receive` does.
///
/// `fps` is the camera's frames a second (by default 100). `symbol_rate` is the transmitter's symbols a second; by default, the Pico's 90
/// and other usual rates are tried. `camera` configures the camera: a Camera, a LearntCamera or a dict. Up to `panels` are followed at once
/// (at most 4), each with its own message. `detector`, `channel`, `depth`, `interval` and `led_diameter_m` are as for decode.
///
/// `trust` is the path of a file of public keys, as `vocc keys show KEY.toml >> keys.toml` collects: each signature is then checked, and a
/// Proof gives the verdict. `counters` is the path of a file that keeps the greatest counter of each key, so that replays of films from
/// before this receiver are detected, too; a warning says if it cannot be written. With `only_trusted`, messages come only once they are
/// proven.
///
/// Raises VoccError if an argument is out of its range, or a file holds something else.
///
/// >>> import vocc
/// >>> renderer, receiver = vocc.Renderer("paper", level="fast", crop=True), vocc.Receiver(symbol_rate=100)
/// >>> for bits in vocc.transmit("Ice", count=8):
/// ...     for message in receiver.feed(renderer.render(bits)).messages:
/// ...         print(message.text, message.first_frame)
/// Ice 0
#[pyclass(module = "vocc")]
pub struct Receiver {
    reception: Reception,
    told: Camera,
    channel: Channel,
    deep: Compander,
    next: u64,
    is_closed: bool,
    diagnostics: Diagnostics,
    signers: Signers,
    proofs: Vec<Py<Proof>>,
}

#[pymethods]
impl Receiver {
    #[new]
    #[pyo3(signature = (
        camera=None, *, fps=None, symbol_rate=None, detector="best", panels=1, channel="brightest", depth=None, interval=None,
        led_diameter_m=None, trust=None, counters=None, only_trusted=false
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        camera: Option<&Bound<'_, PyAny>>,
        fps: Option<f32>,
        symbol_rate: Option<f32>,
        detector: &str,
        panels: usize,
        channel: &str,
        depth: Option<u8>,
        interval: Option<f64>,
        led_diameter_m: Option<f64>,
        trust: Option<PathBuf>,
        counters: Option<PathBuf>,
        only_trusted: bool,
    ) -> PyResult<Self> {
        let trust = match trust {
            Some(path) => check(Trust::read(&path, counters))?,
            None if only_trusted || counters.is_some() => {
                return Err(refused(
                    "counters and only_trusted need keys: give trust, the path of a file of public keys",
                ));
            }
            None => Trust::default(),
        };
        let fps = fps.unwrap_or(USUAL_FPS);
        if !(fps > 0.0 && fps.is_finite()) {
            return Err(refused(format!("fps = {fps}: give the camera's frames a second, above 0")));
        }
        if !(1..=PANELS_MAX).contains(&panels) {
            return Err(refused(format!("panels = {panels}: give 1 to {PANELS_MAX}")));
        }
        let told = camera.map(camera_of).transpose()?;
        let deep = compander(depth, told.as_ref());
        let told = told.unwrap_or_default();
        let settings = ReceptionSettings {
            camera: told.camera(),
            line_delay: told.line_delay(),
            method: untrained(detector)?,
            fps,
            symbol_rate_hz: symbol_rate,
            panel_size: check(configured_size(led_diameter_m, interval))?,
        };
        Ok(Self {
            reception: check(Reception::with_panels(settings, panels))?,
            told,
            channel: check(channel.parse())?,
            deep: deep?,
            next: 0,
            is_closed: false,
            diagnostics: Diagnostics::new("camera"),
            signers: Signers::new(trust, only_trusted),
            proofs: Vec::new(),
        })
    }

    /// Processes an image and returns its results.
    ///
    /// `image` is as for decode, such as the result of `cv2.VideoCapture.read`. All images must have one size and one kind of
    /// samples: uint8, uint16 or float32. `frame` is its number, one more
    /// than that of the image before without it; skipped numbers are lost frames. `late` says how many frame periods later than
    /// its number says it was taken.
    ///
    /// Raises VoccError or TypeError if the image is invalid or of another size, or if the receiver is closed.
    #[pyo3(signature = (image, *, frame=None, late=0.0))]
    fn feed(&mut self, py: Python<'_>, image: &Bound<'_, PyAny>, frame: Option<u64>, late: f64) -> PyResult<Received> {
        self.check_open()?;
        let number = frame.unwrap_or(self.next);
        if number < self.next {
            return Err(refused(format!(
                "frame = {number} comes after frame {}: numbers rise, and lost frames are skipped",
                self.next - 1
            )));
        }
        if number == u64::MAX {
            return Err(refused(format!(
                "frame = {number}: give a smaller number, because none could follow"
            )));
        }
        if !late.is_finite() {
            return Err(refused(format!("late = {late}: give a number of frame periods")));
        }
        let image = Image::of(image, "image")?;
        let pixels = image.pixels()?;
        let stamp = Stamp { number, late };
        let reports = guarded(|| py.detach(|| self.frame(stamp, pixels)))?;
        self.next = number + 1;
        self.diagnostics.count(&reports);
        self.received(py, number, reports)
    }

    /// Closes the receiver. Returns the messages that are completed by the last symbol, which was held back because its end was not known.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Vec<Py<Message>>> {
        self.check_open()?;
        self.is_closed = true;
        let reception = &mut self.reception;
        let events = guarded(|| Ok(py.detach(|| reception.finish())))?;
        reception.close();
        self.proofs.clear();
        let mut messages = Vec::new();
        for (panel, event) in events {
            messages.extend(self.message(py, panel, &event)?);
        }
        Ok(messages)
    }

    /// The status of the camera and of each panel, if a report is due: with the first image, once a second of `time_s`, when a panel is
    /// found or given up, and after a silence; else None.
    ///
    /// `time_s` is the time of the last image, from any origin at or before the first one's; `latency_s` how long after it the messages of
    /// that image were there; `dropped` the images that were left out before it, and `unusable` those that could not be fed.
    ///
    /// Raises VoccError of times that are not 0 to 1e10 s.
    ///
    /// >>> import vocc
    /// >>> receiver, image = vocc.Receiver(), vocc.render("paper", level="fast", crop=True)
    /// >>> _ = receiver.feed(image)
    /// >>> [(status.name, status.level) for status in receiver.diagnose(0.0) or []]
    /// [('vocc: camera', 0), ('vocc: panel 0', 0)]
    /// >>> receiver.diagnose(0.5) is None
    /// True
    #[pyo3(signature = (time_s, *, latency_s=None, dropped=0, unusable=0))]
    fn diagnose(
        &mut self,
        py: Python<'_>,
        time_s: f64,
        latency_s: Option<f64>,
        dropped: u64,
        unusable: u64,
    ) -> PyResult<Option<Vec<Py<Status>>>> {
        let time = duration("time_s", time_s)?;
        if let Some(latency_s) = latency_s {
            self.diagnostics.add_latency(duration("latency_s", latency_s)?);
        }
        self.diagnostics.count_dropped(dropped);
        self.diagnostics.count_unusable(unusable);
        let report = self.diagnostics.report_if_due(time.as_nanos() as u64, self.reception.learnt_each());
        report.map(|report| statuses(py, report)).transpose()
    }

    /// The status of a camera from which no image has come for `since_s` seconds, if a report is due: after 3 s, and then once a second;
    /// else None.
    ///
    /// Raises VoccError of a time that is not 0 to 1e10 s.
    ///
    /// >>> import vocc
    /// >>> [(status.name, status.level) for status in vocc.Receiver().diagnose_silence(3.2) or []]
    /// [('vocc: camera', 2)]
    fn diagnose_silence(&mut self, py: Python<'_>, since_s: f64) -> PyResult<Option<Vec<Py<Status>>>> {
        let report = self.diagnostics.report_silence(duration("since_s", since_s)?);
        report.map(|report| statuses(py, report)).transpose()
    }

    /// Closes the receiver and frees its memory.
    fn close(&mut self) {
        self.reception.close();
        self.is_closed = true;
    }

    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __exit__(&mut self, _kind: &Bound<'_, PyAny>, _value: &Bound<'_, PyAny>, _traceback: &Bound<'_, PyAny>) {
        self.close();
    }

    /// The camera as learnt by the first panel that was read; None until one has been read by maximum likelihood.
    #[getter]
    fn camera(&self, py: Python<'_>) -> PyResult<Option<LearntCamera>> {
        let kind = self.reception.samples();
        let are_encoded = kind.is_some_and(|kind| kind.are_encoded(self.told.told_encoding()));
        let learnt = self.reception.learnt();
        learnt.map(|learnt| self.told.learnt(py, learnt, are_encoded)).transpose()
    }

    /// The proofs that the last call of feed or finish brought.
    #[getter]
    fn proofs(&self, py: Python<'_>) -> Vec<Py<Proof>> {
        self.proofs.iter().map(|proof| proof.clone_ref(py)).collect()
    }

    /// Symbols a second: the configured rate, or the rate that decoded messages.
    #[getter]
    fn symbol_rate_hz(&self) -> f32 {
        self.reception.symbol_rate_hz()
    }

    /// The number of the next frame.
    #[getter]
    fn next_frame(&self) -> u64 {
        self.next
    }

    /// Whether the receiver is closed.
    #[getter]
    fn closed(&self) -> bool {
        self.is_closed
    }
}

impl Receiver {
    fn check_open(&self) -> PyResult<()> {
        match self.is_closed {
            true => Err(refused("the receiver is closed: make another one")),
            false => Ok(()),
        }
    }

    fn frame(&mut self, stamp: Stamp, pixels: Pixels<'_>) -> PyResult<Vec<PanelReport>> {
        let (width, height) = (pixels.width, pixels.height);
        check(self.reception.check_size((width, height)))?;
        let grey = check(pixels.grey(self.channel, &mut self.deep))?;
        let frame = check(Frame::new(&grey, width, height))?;
        let (told, kind) = (self.told, pixels.kind());
        let camera = || told.of_pixels(kind.are_encoded(told.told_encoding()));
        check(self.reception.check_samples(kind, camera))?;
        let lens = self.told.lens([width, height]);
        check(self.reception.frame(stamp, &frame, &lens, &mut ()))
    }

    fn received(&mut self, py: Python<'_>, frame: u64, reports: Vec<PanelReport>) -> PyResult<Received> {
        let mut received = Received {
            frame,
            readings: Vec::new(),
            losses: Vec::new(),
            messages: Vec::new(),
            proofs: Vec::new(),
        };
        self.proofs.clear();
        for report in reports {
            let panel = report.panel;
            for event in report.events {
                received.messages.extend(self.message(py, panel, &event)?);
            }
            match report.reading {
                Ok(reading) => {
                    let reading = self.reading(py, frame, panel, reading, report.symbol, report.orientation)?;
                    received.readings.push(Py::new(py, reading)?);
                }
                Err(loss) => {
                    let why = loss.to_string();
                    let kind = loss::name(&loss);
                    received.losses.push(Py::new(py, Loss { frame, panel, kind, why })?);
                }
            }
        }
        received.proofs = self.proofs(py);
        Ok(received)
    }

    /// The message to deliver after an event, if any. Proofs are appended to the others.
    fn message(&mut self, py: Python<'_>, panel: usize, event: &PanelEvent) -> PyResult<Option<Py<Message>>> {
        let Some(delivery) = self.signers.delivery(panel, event) else {
            return Ok(None);
        };
        self.keep_counters(py)?;
        match delivery {
            Delivery::Withheld => Ok(None),
            Delivery::Message(message, proof) => {
                let claim = self.claim(&proof);
                let message = Message {
                    text: String::from_utf8_lossy(&message.data).into_owned(),
                    data: message.data,
                    panel,
                    first_frame: message.first_frame,
                    last_frame: message.last_frame,
                    corrected_bits: message.corrected_bits,
                    verdict: claim.verdict,
                    signer: claim.signer,
                    signer_name: claim.signer_name,
                    counter: claim.counter,
                };
                Py::new(py, message).map(Some)
            }
            Delivery::Proof(data, proof) => {
                let claim = self.claim(&proof);
                let proof = Proof {
                    text: String::from_utf8_lossy(&data).into_owned(),
                    data,
                    panel,
                    verdict: claim.verdict,
                    signer: claim.signer,
                    signer_name: claim.signer_name,
                    counter: claim.counter,
                };
                self.proofs.push(Py::new(py, proof)?);
                Ok(None)
            }
        }
    }

    fn claim(&self, proof: &Verdict) -> Claim {
        let claim = proof.claim();
        Claim {
            verdict: proof.name(),
            signer: claim.map(|(signer, _)| signer.to_string()),
            signer_name: claim.and_then(|(signer, _)| self.signers.trust().name(signer)).map(Into::into),
            counter: claim.map(|(_, counter)| counter),
        }
    }

    /// Replaces the file of counters after a proof. The received message matters more than this file.
    fn keep_counters(&mut self, py: Python<'_>) -> PyResult<()> {
        let kept = match self.signers.trust_mut().take_counters() {
            Ok(None) => return Ok(()),
            Ok(Some((path, text))) => write_whole(path, &text).map_err(|error| format!("cannot write {}: {error}", path.display())),
            Err(error) => Err(error.to_string()),
        };
        let Err(why) = kept else {
            return Ok(());
        };
        let why = format!("{}; the counter of this proof is not kept", why.escape_debug());
        let why = CString::new(why).map_err(refused)?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &why, 1)
    }

    fn reading(
        &self,
        py: Python<'_>,
        frame: u64,
        panel: usize,
        reading: FrameReading,
        symbol: Option<u32>,
        orientation: Option<Orientation>,
    ) -> PyResult<Reading> {
        let FrameReading { corners, detection } = reading;
        let panel_pose = self.reception.panel_pose(panel);
        let (pose, no_pose) = match panel_pose.measured() {
            Ok(pose) => {
                let closing = [panel_pose.speed_m_s(), panel_pose.time_to_collision_s()];
                (Some(Py::new(py, pose::as_record(py, pose, closing))?), None)
            }
            Err(why) => (None, Some(why.clone())),
        };
        Ok(Reading {
            frame,
            panel,
            bits: arrays::leds(py, detection.bits),
            llr: llr(py, &detection.soft),
            confidence: detection.confidence,
            corners_px: arrays::rows(py, corners.points()),
            centre_px: corners.centre_px().into(),
            pitch_px: corners.pitch_px(),
            symbol,
            has_carrier: self.reception.has_carrier(panel),
            turned_deg: orientation.map(Orientation::turned_deg),
            is_mirrored: orientation.map(Orientation::is_mirrored),
            pose,
            no_pose,
        })
    }
}

/// Seconds, at most [`SECONDS_MAX`].
fn duration(name: &str, seconds: f64) -> PyResult<Duration> {
    match seconds {
        0.0..=SECONDS_MAX => Ok(Duration::from_secs_f64(seconds)),
        _ => Err(refused(format!("{name} = {seconds}: give seconds from 0 to {SECONDS_MAX}"))),
    }
}

fn statuses(py: Python<'_>, report: Vec<diagnostics::Status>) -> PyResult<Vec<Py<Status>>> {
    let record = |status: diagnostics::Status| {
        let values = PyDict::new(py);
        for (key, value) in status.values {
            values.set_item(key, value)?;
        }
        let status = Status {
            level: status.level as u8,
            name: status.name,
            message: status.message,
            hardware_id: status.hardware_id,
            values: values.unbind(),
        };
        Py::new(py, status)
    };
    report.into_iter().map(record).collect()
}

/// A verdict's values, as attributes.
struct Claim {
    verdict: &'static str,
    signer: Option<String>,
    signer_name: Option<String>,
    counter: Option<u32>,
}

/// Replaces a file as a whole.
fn write_whole(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = AtomicWriteFile::open(path)?;
    file.write_all(text.as_bytes())?;
    file.commit()
}
