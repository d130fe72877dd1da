//! The whole link: the transmitter's code, the rendered road, the receiver's code.

use std::collections::VecDeque;

use fixed::types::{I32F32, U1F31, U12F20, U32F32};
use link::camera::Camera;
use link::fec::Code;
use link::framing::{Event, FramingError, Signature, SignedFramer};
use link::intensity::{IntensityLimit, IntensityLimitError};
use link::l2a_table::{Illuminance, Interval};
use link::orientation::Orientation;
use link::panel::PanelFrame;
use rand::Rng;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Method;
use rx_pipeline::frame::{Frame, FrameError};
use rx_pipeline::receiver::{
    CarrierCandidate, FrameReading, FrameSearch, Loss, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings, Reread, SearchMemory,
};
use rx_pipeline::symbols::MessageDecoder;
use tx_firmware::ambient::Smoothing;
use tx_firmware::calibration::{Calibration, CalibrationError, Measured};
use tx_firmware::dimming::Dimming;
use tx_firmware::light_watch::{LightSample, SensorRange};
use tx_firmware::matrix::RecordingMatrix;
use tx_firmware::schedule::Repeats;
use tx_firmware::transmitter::Transmitter;

use crate::accuracy::Level;
use crate::camera::clock::{Moment, WINDOW};
use crate::camera::curve::Curve;
use crate::l2a::{self, L2aError};
use crate::random::{Purpose, stream};
use crate::renderer::canvas::Canvas;
use crate::renderer::{PanelExposure, Renderer};
use crate::scene::Scene;
use crate::view::ViewError;

/// The most pixels of a panel in the receiver.
const PANEL_PIXELS: usize = 160 * 160;

/// Why a link cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum RoadError {
    /// The scene cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The message cannot be sent.
    #[error(transparent)]
    Message(#[from] FramingError),
    /// The transmitter cannot drive the panel.
    #[error("the scene's panel cannot be driven: {0}")]
    Calibration(#[from] CalibrationError),
    /// The table cannot be used.
    #[error(transparent)]
    Table(#[from] L2aError),
    /// The panel's size cannot be transmitted.
    #[error("link.tells_size: {0}")]
    Size(#[from] IntensityLimitError),
    /// The receiver cannot be set up.
    #[error("the receiver cannot be set up: {0}")]
    Receiver(#[from] ReceiverError),
    /// The camera's frame is invalid.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// The message to send, and the settings of the link.
#[derive(Clone, Debug)]
pub struct LinkSettings {
    /// The message, 1 to 1024 bytes.
    pub message: Vec<u8>,
    /// The receiver's detector.
    pub method: Method,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The accuracy of frames.
    pub level: Level,
    /// The code; `None`: the one for the message's length.
    pub code: Option<Code>,
    /// The receiver's camera settings; it learns the rest.
    pub camera: Camera,
    /// Whether the receiver gets the panel's true position instead of searching.
    pub true_corners: bool,
}

impl LinkSettings {
    /// A message read by a receiver with default settings, in frames at the fast level.
    pub fn new(message: Vec<u8>, method: Method, seed: u64) -> Self {
        Self {
            message,
            method,
            seed,
            level: Level::Fast,
            code: None,
            camera: Camera::default(),
            true_corners: false,
        }
    }
}

/// The result of one frame.
#[derive(Debug)]
pub struct FrameReport<'a> {
    /// Number of the frame.
    pub frame: u64,
    /// The camera's grey levels, row by row.
    pub grey: &'a [u8],
    /// The panel's bits in the middle of the exposure.
    pub sent: PanelFrame,
    /// The number of wrong bits: those in which `read` differs from `sent`. In a frame without a reading, all On bits are wrong.
    pub bit_errors: u32,
    /// The bits read, or the reason for none.
    ///
    /// With a carrier, an exposure shows the bits or their complement; with a rolling shutter, this may differ between lines of LEDs. The
    /// receiver learns the signs from many frames. The road gives the reading the signs with the fewest wrong bits, which are at most half.
    pub read: Result<PanelFrame, Loss>,
    /// The panel's position in the reading.
    pub corners: Option<Corners>,
    /// Messages that became whole with this frame.
    pub delivered: Option<ReceivedMessage>,
    /// Whether an exposure was shared between symbols.
    pub straddled: bool,
}

/// A received message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReceivedMessage {
    /// Its bytes.
    pub message: Vec<u8>,
    /// Its first frame.
    pub first_frame: u64,
    /// Its last frame.
    pub last_frame: u64,
    /// Bits changed by error correction.
    pub corrected_bits: u32,
}

/// A received message and its signature, which is not verified.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReceivedSignature {
    /// The message's bytes.
    pub message: Vec<u8>,
    /// The signature, as read.
    pub signature: Signature,
}

type RoadReceiver = Receiver<PANEL_PIXELS, Box<ReceiverMemory<PANEL_PIXELS>>, FrameSearch<Box<SearchMemory>, Vec<u8>>>;

/// One link: transmitter, road and receiver.
pub struct Road {
    scene: Scene,
    seed: u64,
    renderer: Renderer,
    transmitter: Transmitter<RecordingMatrix>,
    /// In a box, because it is large and moves with the road.
    receiver: Box<RoadReceiver>,
    /// The decoder that continues after frames were read again, once the panel's carrier was known.
    reread: Option<Box<MessageDecoder>>,
    true_corners: bool,
    symbols: Symbols,
    received_signature: Option<ReceivedSignature>,
    canvas: Canvas<f32>,
    grey: Vec<u8>,
}

/// The symbols of the next exposures.
#[derive(Default)]
struct Symbols {
    first: u64,
    shown: VecDeque<PanelFrame>,
    /// Shows message and signature, if the message is signed.
    signed: Option<SignedFramer>,
}

impl Road {
    /// Sets transmitter, road and receiver up.
    ///
    /// # Errors
    /// If the scene, the message or the panel cannot be used: see [`RoadError`].
    pub fn new(scene: &Scene, settings: &LinkSettings) -> Result<Self, RoadError> {
        let renderer = Renderer::new(scene, settings.level)?;
        let transmitter = transmitter(scene, settings)?;
        let sensor = renderer.sensor();
        let room = FrameSearch::<Box<SearchMemory>>::bytes(sensor.width, sensor.height);
        let history = vec![0; room];
        let receiver = Receiver::new(
            ReceiverSettings {
                camera: settings.camera,
                method: settings.method,
                symbols_per_frame: symbols_per_frame(scene),
                ..ReceiverSettings::default()
            },
            Box::default(),
            FrameSearch::with_history(Box::default(), history),
        )?;
        let canvas = Canvas::new(renderer.lit_region());
        Ok(Self {
            scene: scene.clone(),
            seed: settings.seed,
            transmitter,
            receiver: Box::new(receiver),
            reread: None,
            true_corners: settings.true_corners,
            symbols: Symbols::default(),
            received_signature: None,
            canvas,
            grey: vec![0; sensor.width * sensor.height],
            renderer,
        })
    }

    /// Shows a signature with the message of the settings, from the first frame on.
    ///
    /// # Errors
    /// If the message is empty or too long.
    pub fn sign(&mut self, settings: &LinkSettings, signature: Signature) -> Result<(), RoadError> {
        let (message, code) = (&settings.message, code(settings));
        // With the transmitter's state of `fresh` for its first message.
        self.symbols.signed = Some(SignedFramer::new(message, code, true, signature)?);
        Ok(())
    }

    /// The last whole signature.
    pub fn received_signature(&self) -> Option<&ReceivedSignature> {
        self.received_signature.as_ref()
    }

    /// The renderer of the frames.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The transmitter.
    pub fn transmitter(&self) -> &Transmitter<RecordingMatrix> {
        &self.transmitter
    }

    /// Exposes, reads and reports frame `frame`; call it with rising numbers.
    ///
    /// # Errors
    /// If a panel in motion leaves the camera's view.
    pub fn frame(&mut self, frame: u64) -> Result<FrameReport<'_>, RoadError> {
        self.look_again(frame)?;
        let moment = self.renderer.moment(self.seed, frame);
        let shown = self.shown(&moment);
        let sent = self.renderer.truth(0, &moment, &shown[0]);
        let seen = self.renderer.seen(0, &moment, &shown[0]);
        let still = self.renderer.view().waveform.is_still();
        let straddled = self.renderer.straddles(0, &moment);
        self.renderer.frame(self.seed, &moment, &shown, &mut self.canvas, &mut self.grey);
        let sensor = self.renderer.sensor();
        let truth = self.renderer.corners_in(sensor, &moment).ok();
        if let Some(corners) = truth.filter(|_| self.true_corners) {
            self.place(corners);
        }
        let outcome = self.receiver.frame(frame, &Frame::new(&self.grey, sensor.width, sensor.height)?);
        let detection = outcome.reading.as_ref().ok().map(|reading| &reading.detection);
        let again = outcome.reread.as_ref();
        let again = again.map(|frames| read_again(frames, symbols_per_frame(&self.scene), &mut self.received_signature));
        let (message, right) = again.unwrap_or_default();
        let proven = right.as_ref().and_then(|(_, carrier)| *carrier);
        let is_followed = proven.is_some_and(|carrier| carrier.is_followed());
        let later = match (right, &mut self.reread, detection) {
            // A decoder of the same carrier continues, as it may know earlier segments.
            (Some((again, _)), decoder, _) if decoder.is_none() || !is_followed => {
                *decoder = Some(again);
                None
            }
            (_, Some(decoder), Some(detection)) => {
                let decoded = decoder.push(frame, &detection.soft, detection.mixed.as_ref());
                received(&decoded.event, &mut self.received_signature)
            }
            _ => None,
        };
        let read = outcome.reading.map(|reading| {
            let reading = truth.map_or(reading, |truth| own_way_up(&reading, &truth));
            let bits = reading.detection.bits;
            let bits = if still { bits } else { own_signs(bits, sent, seen) };
            (bits, reading.corners)
        });
        let delivered = received(&outcome.event, &mut self.received_signature).or(message).or(later);
        if let Some(carrier) = proven {
            self.receiver.confirm_carrier(0, &carrier);
        }
        let read_bits = read.as_ref().map_or(PanelFrame::default(), |read| read.0);
        Ok(FrameReport {
            frame,
            grey: &self.grey,
            sent,
            bit_errors: read_bits.distance(sent),
            corners: read.as_ref().ok().map(|read| read.1),
            read: read.map(|read| read.0),
            delivered,
            straddled,
        })
    }

    /// Ends the reception, and returns the message that the last frame may have completed.
    pub fn finish(&mut self) -> Option<ReceivedMessage> {
        let signature = &mut self.received_signature;
        let later = self.reread.as_mut().and_then(|decoder| received(&decoder.finish(), signature));
        received(&self.receiver.finish(), signature).or(later)
    }

    /// Sets the receiver's position of the panel, unless it follows the panel there. The receiver reports an unreadable position itself.
    fn place(&mut self, corners: Corners) {
        let followed = self.receiver.corners();
        if !followed.is_some_and(|followed| are_near(&followed, &corners)) {
            let sensor = self.renderer.sensor();
            let _ = self.receiver.place(corners, [0; 2], (sensor.width, sensor.height));
        }
    }

    /// Sets the receiver's delay of each camera line relative to the one above: see [`Receiver::set_line_delay`].
    pub fn set_line_delay(&mut self, exposures: f32) {
        self.receiver.set_line_delay(exposures);
    }

    /// Prepares frame `frame`, if its scene differs from that of the frame before.
    fn look_again(&mut self, frame: u64) -> Result<(), RoadError> {
        let Some(scene) = self.scene.at_frame(frame) else {
            return Ok(());
        };
        self.renderer = self.renderer.rebuilt_for(&scene)?;
        self.canvas = Canvas::new(self.renderer.lit_region());
        Ok(())
    }

    /// The symbols of all panels around a moment: the transmitter's for the first, random ones for the others.
    fn shown(&mut self, moment: &Moment) -> Vec<PanelExposure> {
        let mut shown: Vec<PanelExposure> = (0..self.scene.panels.len())
            .map(|index| self.renderer.steady(index, PanelFrame::default()))
            .collect();
        for (index, shown) in shown.iter_mut().enumerate() {
            shown.symbols = std::array::from_fn(|ahead| {
                let symbol = moment.symbol + ahead as u64;
                if index == 0 {
                    self.symbols.get(symbol, &mut self.transmitter)
                } else {
                    random_symbol(self.seed, index, symbol)
                }
            });
        }
        let full = self.transmitter.calibration().measured().luminance_full_cd_m2.to_num::<f64>();
        let luminance = full * self.transmitter.matrix().duty.to_num::<f64>();
        // The transmitter's calibration has already applied the limits.
        shown[0].light = self.renderer.lit(0, luminance);
        shown
    }
}

/// A followed panel within this distance of the truth, in pixels, is read as well as one at a known position.
const FOLLOWED_PX: f32 = 0.5;

fn are_near(a: &Corners, b: &Corners) -> bool {
    let pairs = a.points().into_iter().zip(b.points());
    pairs.into_iter().all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) < FOLLOWED_PX)
}

/// A reading in the panel's own rows and columns, which are known here before the first header.
fn own_way_up(reading: &FrameReading, truth: &Corners) -> FrameReading {
    let off = |reading: &FrameReading| {
        let [[x, y], [true_x, true_y]] = [&reading.corners, truth].map(|corners| corners.points()[0]);
        (x - true_x).hypot(y - true_y)
    };
    let turned = (1..4).map(|turns| reading.upright(Orientation::new(turns, false)));
    turned.fold(*reading, |best, other| if off(&other) < off(&best) { other } else { best })
}

/// The bits of a panel with a carrier in the panel's own signs, which are known here before the first sync panel. A receiver that
/// follows the carrier reads `sent`, another one `seen`; both up to the sign of the frame.
fn own_signs(bits: PanelFrame, sent: PanelFrame, seen: PanelFrame) -> PanelFrame {
    let inverted = sent.bits() ^ seen.bits();
    let read = [0, u64::MAX, inverted, !inverted].map(|signs| PanelFrame::from_bits(bits.bits() ^ signs));
    read.into_iter().min_by_key(|read| read.distance(sent)).unwrap_or(bits)
}

impl Symbols {
    /// Symbol `index`, at most the window before the last requested one.
    fn get(&mut self, index: u64, transmitter: &mut Transmitter<RecordingMatrix>) -> PanelFrame {
        while index >= self.first + self.shown.len() as u64 {
            let Ok(panel) = transmitter.tick();
            let signed = self.signed.as_mut();
            let signed = signed.map(|framer| framer.next_panel_of(transmitter.calibration().geometry()));
            self.shown.push_back(signed.unwrap_or(panel));
        }
        while self.shown.len() > 2 * WINDOW {
            self.shown.pop_front();
            self.first += 1;
        }
        self.shown[index.saturating_sub(self.first) as usize]
    }
}

/// The scene's camera as a data sheet describes it to a receiver.
pub fn camera_of(scene: &Scene) -> Camera {
    Camera {
        encoding: Curve::of(&scene.camera).standard(),
        black_grey: scene.camera.black_grey as f32,
        read_noise_e: scene.camera.read_noise_e as f32,
        ..Camera::default()
    }
}

/// The scene's camera, with its blur.
pub fn calibrated_camera_of(scene: &Scene) -> Camera {
    Camera {
        blur_sigma_px: scene.camera.blur_sigma_px as f32,
        ..camera_of(scene)
    }
}

/// The dimming by the transmitter of the scene's first panel in the scene's light.
///
/// ```
/// use sim::{road, scene::Scene};
/// let day = Scene::load("day", &["link.l2a=2".into()])?;
/// assert_eq!(road::dimming(&day)?.l2a, 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If the panel cannot be driven, or the table cannot be used.
pub fn dimming(scene: &Scene) -> Result<Dimming, RoadError> {
    let illuminance = Illuminance::saturating_from_num(scene.ambient.illuminance_lx);
    let interval = Interval::saturating_from_num(scene.panels[0].interval);
    let l2a = l2a::table_of(scene)?.l2a(illuminance, interval);
    Ok(Dimming::new(l2a, illuminance, &calibration(scene)?))
}

/// The transmitter of the scene's first panel, in its light, with the message.
fn transmitter(scene: &Scene, settings: &LinkSettings) -> Result<Transmitter<RecordingMatrix>, RoadError> {
    let calibration = calibration(scene)?;
    let mut transmitter = Transmitter::new(RecordingMatrix::default(), calibration, l2a::table_of(scene)?, Smoothing::default());
    transmitter.send(&settings.message, code(settings), Repeats::Forever)?;
    let light = LightSample::Light {
        lux: I32F32::saturating_from_num(scene.ambient.illuminance_lx),
        word: 0,
    };
    let Ok(_) = transmitter.sense(0, SensorRange::Operating, light);
    Ok(transmitter)
}

fn code(settings: &LinkSettings) -> Code {
    settings.code.unwrap_or(Code::for_length(settings.message.len()))
}

/// The bench measurements of the scene's first panel. A panel without limits gets the luminance of the highest ratio in this light; a
/// luminance floor becomes a shortest pulse.
fn calibration(scene: &Scene) -> Result<Calibration, RoadError> {
    let panel = &scene.panels[0];
    let full = l2a::full_luminance_cd_m2(scene, panel).max(1.0);
    let period_ns = if panel.pwm_hz > 0.0 { 1e9 / panel.pwm_hz } else { 20_000.0 };
    let calibration = Calibration::new(Measured {
        luminance_full_cd_m2: U32F32::saturating_from_num(full),
        shortest_pulse_ns: (panel.luminance_min_cd_m2.unwrap_or(0.0) / full * period_ns).round() as u32,
        pwm_period_ns: period_ns.round() as u32,
        reflectance: U1F31::saturating_from_num(panel.reflectance),
        interval: Interval::saturating_from_num(panel.interval),
        sensor_gain: U12F20::ONE,
        low_current_share: U1F31::ONE,
    })?;
    if !scene.link.tells_size {
        return Ok(calibration);
    }
    Ok(calibration.limited_to(Some(IntensityLimit::from_cd(None, panel.led_diameter_m)?)))
}

/// A symbol of another vehicle's panel.
fn random_symbol(seed: u64, panel: usize, symbol: u64) -> PanelFrame {
    PanelFrame::from_bits(stream(seed ^ (panel as u64) << 32, symbol, Purpose::Bits).next_u64())
}

fn symbols_per_frame(scene: &Scene) -> f32 {
    (scene.link.symbol_rate_hz / scene.camera.frame_rate_hz) as f32
}

/// The right decoder of frames that are read again, and the panel's carrier if they prove it.
type RightDecoder = (Box<MessageDecoder>, Option<CarrierCandidate>);

/// The last message of frames that are read again, for each possible carrier of the panel, and the decoder of the right one.
fn read_again(
    frames: &Reread<'_>,
    symbols_per_frame: f32,
    signature: &mut Option<ReceivedSignature>,
) -> (Option<ReceivedMessage>, Option<RightDecoder>) {
    let mut last = None;
    let right = frames.decode(|readings| {
        let (mut decoder, mut proofs) = (Box::new(MessageDecoder::new(symbols_per_frame).ok()?), 0);
        for (number, _, soft) in readings {
            let event = decoder.push(number, &soft, None).event;
            proofs += usize::from(Reread::is_proof(&event));
            last = received(&event, signature).or(last.take());
        }
        Some((proofs, decoder))
    });
    (last, right)
}

/// The completed message; a completed signature replaces the last one.
fn received(event: &Event<'_>, signature: &mut Option<ReceivedSignature>) -> Option<ReceivedMessage> {
    match event {
        Event::Signed(signed) => {
            *signature = Some(ReceivedSignature {
                message: signed.message.to_vec(),
                signature: signed.signature,
            });
            None
        }
        Event::Delivered(delivery) => Some(ReceivedMessage {
            message: delivery.message.to_vec(),
            first_frame: delivery.first_stamp,
            last_frame: delivery.last_stamp,
            corrected_bits: delivery.corrected_bits,
        }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cameras_of_both_ends_agree_where_nothing_is_said() {
        assert_eq!(camera_of(&Scene::default()), Camera::default());
        assert_eq!(calibrated_camera_of(&Scene::default()), Camera::default());
    }
}
