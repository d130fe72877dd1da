//! Frames in, one after another; readings, poses and messages out.

use link::camera;
use link::framing::Event;
use numpy::PyArray2;
use pyo3::prelude::*;
use rx_pipeline::camera::Learnt;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::Known;
use rx_pipeline::receiver::{Reading as Read, ReceiverSettings};
use studies::reception::colour::Channel;
use studies::reception::deep::Compander;
use studies::reception::rates::{self, Heard, Rates};
use studies::reception::whereabouts::{Measured, Sight, Whereabouts};
use studies::reception::{PANELS_MAX, Receiving, USUAL_FPS, receiver};

use crate::arrays::{self, Image, Pixels};
use crate::camera::{Camera, LearntCamera, camera_of};
use crate::decode::{compander, llr, untrained};
use crate::errors::{check, guarded, refused};
use crate::pose::{self, Pose, Surveyor};
use crate::record::record;

record! {
    /// A panel that was read in a frame.
    Reading {
        /// The frame's number.
        frame: u64,
        /// The panel's number, from 0.
        panel: usize,
        /// Its bits, bool of shape (8, 8).
        bits: Py<PyArray2<bool>>,
        /// The log-likelihood ratio of each LED, positive for On, float32 of shape (8, 8).
        llr: Py<PyArray2<f32>>,
        /// The share of bits that are right if the ratios are, 0.5 to 1.
        confidence: f32,
        /// The corner LEDs, top left, top right, bottom right and bottom left: x and y in pixels, of shape (4, 2).
        corners_px: Py<PyArray2<f32>>,
        /// The panel's centre, in pixels.
        centre_px: (f32, f32),
        /// The distance of neighbouring LEDs, in pixels.
        pitch_px: f32,
        /// The number of the symbol that it shows, where that is known.
        symbol: Option<u32>,
        /// Where the panel is, where the camera's focal length and the panel's size were told.
        pose: Option<Py<Pose>>,
        /// Why that is not known.
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
        /// Why.
        why: String,
    }
}

record! {
    /// A message that has become whole.
    Message {
        /// Its text; what is no UTF-8 is replaced.
        text: String,
        /// Its bytes.
        data: Vec<u8>,
        /// The number of the panel that showed it, from 0.
        panel: usize,
        /// The number of the first frame that showed a part of it.
        first_frame: u64,
        /// The number of the last one.
        last_frame: u64,
        /// Bits that were corrected.
        corrected_bits: u32,
    }
}

record! {
    /// What a frame has brought.
    Received {
        /// The frame's number.
        frame: u64,
        /// The panels that were read.
        readings: Vec<Py<Reading>>,
        /// Those that were not, and why.
        losses: Vec<Py<Loss>>,
        /// The messages that have become whole.
        messages: Vec<Py<Message>>,
    }
}

/// Receives messages from frames that are fed one after another, as `vocc receive` does.
///
/// `fps` is the camera's frames a second (100 without it). `symbol_rate` is what the transmitter shows a second; where it is not told, 90
/// as the Pico shows, and what else is usual, is tried. `camera` is what is known of the camera: a Camera, a LearntCamera or a dict.
/// `panels` are followed at once, up to 4, each with its own message. `detector`, `channel`, `depth`, `interval` and `led_diameter_m` are
/// as for decode.
///
/// Raises VoccError of what is out of its range.
///
/// >>> import vocc
/// >>> renderer, receiver = vocc.Renderer("paper", level="fast", crop=True), vocc.Receiver(symbol_rate=100)
/// >>> for bits in vocc.transmit("Ice", count=8):
/// ...     for message in receiver.feed(renderer.render(bits)).messages:
/// ...         print(message.text, message.first_frame)
/// Ice 0
#[pyclass(module = "vocc")]
pub struct Receiver {
    told: Camera,
    settings: ReceiverSettings,
    fps: f32,
    symbol_rate: Option<f32>,
    panels: usize,
    channel: Channel,
    deep: Compander,
    surveyor: Surveyor,
    /// Made for the size of the first frame.
    session: Option<Box<dyn Session>>,
    size: Option<(usize, usize)>,
    /// Whether the pixels are encoded for it.
    are_encoded: bool,
    learnt: Vec<Option<Learnt>>,
    found_hz: Option<f32>,
    next: u64,
    is_closed: bool,
}

#[pymethods]
impl Receiver {
    #[new]
    #[pyo3(signature = (
        camera=None, *, fps=None, symbol_rate=None, detector="best", panels=1, channel="brightest", depth=None, interval=None,
        led_diameter_m=None
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
    ) -> PyResult<Self> {
        let fps = fps.unwrap_or(USUAL_FPS);
        if !(fps > 0.0 && fps.is_finite()) {
            return Err(refused(format!("fps = {fps}: give the camera's frames a second, above 0")));
        }
        if !(1..=PANELS_MAX).contains(&panels) {
            return Err(refused(format!("panels = {panels}: give 1 to {PANELS_MAX}")));
        }
        let told = camera.map(camera_of).transpose()?;
        let rate_hz = symbol_rate.unwrap_or_else(|| rates::usual(fps));
        let settings = ReceiverSettings {
            camera: told.unwrap_or_default().camera(),
            method: untrained(detector)?,
            symbols_per_frame: rate_hz / fps,
        };
        // Settings are refused before the first frame, not with it.
        check(receiver::<1>(settings, (0, 0)))?;
        Ok(Self {
            deep: compander(depth, told.as_ref())?,
            surveyor: Surveyor::new(interval, led_diameter_m, told)?,
            told: told.unwrap_or_default(),
            settings,
            fps,
            symbol_rate,
            panels,
            channel: check(channel.parse())?,
            session: None,
            size: None,
            are_encoded: false,
            learnt: Vec::new(),
            found_hz: None,
            next: 0,
            is_closed: false,
        })
    }

    /// Takes in an image and tells what it has brought.
    ///
    /// `image` is as for decode: what `cv2.VideoCapture.read` gives goes straight in. All are of one size. `frame` is its number, one more
    /// than that of the image before without it; numbers that are left out are lost frames. `late` says how many frame periods later than
    /// its number says it was taken.
    ///
    /// Raises VoccError or TypeError of an image that is none or of another size, and of a receiver that is closed.
    #[pyo3(signature = (image, *, frame=None, late=0.0))]
    fn feed(&mut self, py: Python<'_>, image: &Bound<'_, PyAny>, frame: Option<u64>, late: f64) -> PyResult<Received> {
        self.check_open()?;
        let number = frame.unwrap_or(self.next);
        if number < self.next {
            return Err(refused(format!(
                "frame = {number} comes after frame {}: numbers rise, and those of lost frames are left out",
                self.next - 1
            )));
        }
        if number == u64::MAX {
            return Err(refused(format!("frame = {number}: give a number below it, none could follow")));
        }
        if !late.is_finite() {
            return Err(refused(format!("late = {late}: give a number of frame periods")));
        }
        let image = Image::of(image, "image")?;
        let pixels = image.pixels()?;
        let taken = guarded(|| py.detach(|| self.take(number, late, pixels)))?;
        self.next = number + 1;
        self.record(py, number, taken)
    }

    /// Closes the receiver; gives the messages that become whole by the last symbol, whose end it has been waiting for.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Vec<Py<Message>>> {
        self.check_open()?;
        self.is_closed = true;
        let Some(mut session) = self.session.take() else {
            return Ok(Vec::new());
        };
        let messages = guarded(|| Ok(py.detach(|| session.finish())))?;
        self.learnt = session.learnt();
        messages.into_iter().map(|whole| whole.record(py)).collect()
    }

    /// Closes the receiver and gives its memory back.
    fn close(&mut self) {
        self.session = None;
        self.is_closed = true;
    }

    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __exit__(&mut self, _kind: &Bound<'_, PyAny>, _value: &Bound<'_, PyAny>, _traceback: &Bound<'_, PyAny>) {
        self.close();
    }

    /// What was learnt of the camera by the first panel that was read; None before one was, by maximum likelihood.
    #[getter]
    fn camera(&self, py: Python<'_>) -> PyResult<Option<LearntCamera>> {
        let learnt = self.learnt.iter().flatten().next();
        learnt.map(|learnt| self.told.learnt(py, learnt, self.are_encoded)).transpose()
    }

    /// The symbols a second that are gone by: those told, or those by which messages were read.
    #[getter]
    fn symbol_rate_hz(&self) -> f32 {
        self.found_hz.unwrap_or(self.settings.symbols_per_frame * self.fps)
    }

    /// The number of the next frame.
    #[getter]
    fn next_frame(&self) -> u64 {
        self.next
    }

    /// Whether it was closed.
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

    fn take(&mut self, number: u64, late: f64, pixels: Pixels<'_>) -> PyResult<Taken> {
        let size = (pixels.width, pixels.height);
        let film = self.size.unwrap_or(size);
        if size != film {
            return Err(refused(format!(
                "it is {} × {} pixels, and the film {} × {}: give frames of one size, each film by itself",
                size.0, size.1, film.0, film.1
            )));
        }
        let grey = check(pixels.grey(self.channel, &mut self.deep))?;
        let frame = check(Frame::new(&grey, pixels.width, pixels.height))?;
        let session = match &mut self.session {
            Some(session) => session,
            None => {
                self.are_encoded = pixels.are_encoded(self.told.told_encoding());
                self.settings.camera = self.told.of_pixels(self.are_encoded);
                let (settings, rates) = (self.settings, (self.fps, self.symbol_rate));
                let delay = self.told.line_delay();
                self.session.insert(match self.panels {
                    1 => Reception::<1>::begin(settings, delay, rates, size)?,
                    2 => Reception::<2>::begin(settings, delay, rates, size)?,
                    3 => Reception::<3>::begin(settings, delay, rates, size)?,
                    _ => Reception::<PANELS_MAX>::begin(settings, delay, rates, size)?,
                })
            }
        };
        self.size = Some(size);
        let taken = session.take(number, late, &frame, &mut self.surveyor);
        self.learnt = session.learnt();
        self.found_hz = session.found_hz();
        Ok(taken)
    }

    fn record(&self, py: Python<'_>, frame: u64, taken: Taken) -> PyResult<Received> {
        let mut received = Received {
            frame,
            readings: Vec::new(),
            losses: Vec::new(),
            messages: Vec::new(),
        };
        for whole in taken.whole {
            received.messages.push(whole.record(py)?);
        }
        for Told { panel, read, symbol } in taken.told {
            let Shown {
                read: Read { corners, detection },
                pose,
                closing,
            } = match read {
                Ok(shown) => *shown,
                Err(why) => {
                    let loss = Loss { frame, panel, why };
                    received.losses.push(Py::new(py, loss)?);
                    continue;
                }
            };
            let (pose, no_pose) = match pose {
                Ok(pose) => {
                    let pose = pose::as_record(py, &pose, closing);
                    (Some(Py::new(py, pose)?), None)
                }
                Err(why) => (None, Some(why)),
            };
            let reading = Reading {
                frame,
                panel,
                bits: arrays::leds(py, detection.bits),
                llr: llr(py, &detection.soft),
                confidence: detection.confidence,
                corners_px: arrays::rows(py, corners.points()),
                centre_px: corners.centre_px().into(),
                pitch_px: corners.pitch_px(),
                symbol,
                pose,
                no_pose,
            };
            received.readings.push(Py::new(py, reading)?);
        }
        Ok(received)
    }
}

/// What a frame has brought, without Python.
#[derive(Default)]
struct Taken {
    told: Vec<Told>,
    whole: Vec<Whole>,
}

/// What it has brought of one panel.
struct Told {
    panel: usize,
    read: Result<Box<Shown>, String>,
    symbol: Option<u32>,
}

/// A panel that was read.
struct Shown {
    read: Read,
    pose: Measured,
    /// How fast it comes nearer, and when it is here.
    closing: [Option<Known>; 2],
}

/// A message that has become whole.
struct Whole {
    panel: usize,
    data: Vec<u8>,
    first: u64,
    last: u64,
    corrected: u32,
}

impl Whole {
    fn of(panel: usize, event: &Event<'_>) -> Option<Self> {
        let Event::Delivered(delivery) = event else {
            return None;
        };
        Some(Self {
            panel,
            data: delivery.message.to_vec(),
            first: delivery.first_stamp,
            last: delivery.last_stamp,
            corrected: delivery.corrected_bits,
        })
    }

    fn record(self, py: Python<'_>) -> PyResult<Py<Message>> {
        let message = Message {
            text: String::from_utf8_lossy(&self.data).into_owned(),
            data: self.data,
            panel: self.panel,
            first_frame: self.first,
            last_frame: self.last,
            corrected_bits: self.corrected,
        };
        Py::new(py, message)
    }
}

/// The receiver at work, of whatever number of panels.
trait Session: Send + Sync {
    fn take(&mut self, number: u64, late: f64, frame: &Frame, surveyor: &mut Surveyor) -> Taken;
    fn finish(&mut self) -> Vec<Whole>;
    fn learnt(&self) -> Vec<Option<Learnt>>;
    fn found_hz(&self) -> Option<f32>;
}

/// The same of so many.
struct Reception<const PANELS: usize> {
    receiver: Receiving<PANELS>,
    /// By the number of the panel, from its first reading on.
    rates: [Option<Rates>; PANELS],
    whereabouts: [Whereabouts; PANELS],
    camera: camera::Camera,
    own_hz: f32,
    fps: f32,
    is_told: bool,
}

impl<const PANELS: usize> Reception<PANELS> {
    fn begin(
        settings: ReceiverSettings,
        line_delay: Option<f32>,
        (fps, symbol_rate): (f32, Option<f32>),
        size: (usize, usize),
    ) -> PyResult<Box<dyn Session>> {
        let mut receiver = check(receiver(settings, size))?;
        if let Some(delay) = line_delay {
            receiver.tell_line_delay(delay);
        }
        Ok(Box::new(Self {
            receiver,
            rates: [const { None }; PANELS],
            whereabouts: [const { Whereabouts::UNKNOWN }; PANELS],
            camera: settings.camera,
            own_hz: symbol_rate.unwrap_or_else(|| rates::usual(fps)),
            fps,
            is_told: symbol_rate.is_some(),
        }))
    }
}

impl<const PANELS: usize> Session for Reception<PANELS> {
    fn take(&mut self, number: u64, late: f64, frame: &Frame, surveyor: &mut Surveyor) -> Taken {
        let mut taken = Taken::default();
        let learnt = self.receiver.learnt_each();
        let (fps, own_hz, is_told) = (self.fps, self.own_hz, self.is_told);
        let (rates, whereabouts) = (&mut self.rates, &mut self.whereabouts);
        let (camera, lens) = (&self.camera, surveyor.lens(frame));
        let time_s = (number as f64 + late) / f64::from(fps);
        self.receiver.set_late(late);
        self.receiver.frame_each(number, frame, &mut (), |panel, outcome| {
            let rates = rates[panel].get_or_insert_with(|| Rates::beside(own_hz, fps, is_told));
            let detection = outcome.reading.as_ref().ok();
            let detection = detection.map(|reading| &reading.detection);
            rates.hear(&outcome.event, number, late, detection, |heard| {
                if let Heard::Event(event) = heard {
                    taken.whole.extend(Whole::of(panel, event));
                }
            });
            let symbol = rates.symbol().or(outcome.symbol);
            let whereabouts = &mut whereabouts[panel];
            if let Some(said) = rates.take_geometry(&outcome.event) {
                whereabouts.hear(said);
            }
            if let Err(why) = &outcome.reading {
                whereabouts.lose(why);
            }
            let read = outcome.reading.map_err(|why| why.to_string()).map(|read| {
                let camera = learnt[panel].map_or(*camera, |learnt| learnt.camera);
                let sight = Sight {
                    frame,
                    reading: &read,
                    camera: &camera,
                    lens: lens.clone(),
                };
                whereabouts.measure(&mut surveyor.meter, time_s, &sight);
                Box::new(Shown {
                    read,
                    pose: whereabouts.measured().clone(),
                    closing: [whereabouts.speed_m_s(), whereabouts.time_to_collision_s()],
                })
            });
            taken.told.push(Told { panel, read, symbol });
        });
        taken
    }

    fn finish(&mut self) -> Vec<Whole> {
        let mut whole = Vec::new();
        let rates = &mut self.rates;
        self.receiver.finish_each(|panel, event| {
            if let Some(rates) = &mut rates[panel] {
                rates.hear_last(&event, |heard| {
                    if let Heard::Event(event) = heard {
                        whole.extend(Whole::of(panel, event));
                    }
                });
            }
        });
        whole
    }

    fn learnt(&self) -> Vec<Option<Learnt>> {
        self.receiver.learnt_each().to_vec()
    }

    fn found_hz(&self) -> Option<f32> {
        self.rates.iter().flatten().find_map(Rates::found_hz)
    }
}
