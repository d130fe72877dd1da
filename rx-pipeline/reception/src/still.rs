//! The bits of single frames.

use link::camera::Camera;
use link::panel::{LEDS, PanelFrame, SIDE};
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::cells::{CellMap, CellsError};
use rx_pipeline::corners::{Corners, Homography};
use rx_pipeline::detect::{Detection, Method, check_white};
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::MaximumLikelihood;
use rx_pipeline::locate::{Location, Locator, LocatorMemory};
use rx_pipeline::receiver::{
    FrameReading, FrameSearch, NoSearch, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings, Search, SearchMemory,
};
use rx_pipeline::settings::SearchSettings;

/// Maximum number of pixels in a panel's bounding box.
pub const PANEL_PIXELS: usize = 512 * 512;
/// Maximum number of pixels that the likelihood uses; larger panels are binned.
pub const LIKELIHOOD_PIXELS: usize = 128 * 128;
/// Pixels in which a panel is searched for and read if no corners are given; a larger panel is binned. The largest bins mix a board's edge
/// with its LEDs, so the limit leaves room for smaller bins.
const SEARCH_PIXELS: usize = 256 * 256;

/// The probability that the place of a reading is right if the frame confirms it, as measured: see `docs/detectors.md`.
const CONFIRMED: f32 = 0.997;
/// The same if the frame does not confirm it.
const UNCONFIRMED: f32 = 0.5;
/// Maximum distance between an LED's place as read and as confirmed by the frame, in pitches.
const SAME: f32 = 0.4;
/// Pixels around a panel that a confirmation compares with its model: a box of up to 90 px, and 1.8 pitches around it.
const CONFIRMATION_PIXELS: usize = 144 * 144;

/// A panel's place and bits, or why they cannot be read.
pub type Still = Result<StillReading, String>;

/// A panel that was read in a single frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillReading {
    /// Its corners and bits. Their confidence includes that of the place.
    pub reading: FrameReading,
    /// Whether the frame shows a panel there.
    pub place: PlaceCheck,
}

/// Whether a frame shows a panel at the place of a reading, by the criteria of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaceCheck {
    /// It does.
    Confirmed,
    /// It shows a panel with these corners, and at least one LED is elsewhere.
    Elsewhere(Corners),
    /// It does not show enough: the panel is faint, out of focus or partly covered, an outer line of LEDs is dark, or there is no panel.
    Unconfirmed,
}

impl PlaceCheck {
    /// The name of the state, for JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::Elsewhere(_) => "elsewhere",
            Self::Unconfirmed => "unconfirmed",
        }
    }

    /// The corners of the panel that the frame shows instead.
    pub fn elsewhere(&self) -> Option<&Corners> {
        match self {
            Self::Elsewhere(corners) => Some(corners),
            _ => None,
        }
    }

    /// The expected share of LEDs that were read at their places.
    fn share(&self, read: &Corners) -> f32 {
        match self {
            Self::Confirmed => CONFIRMED,
            Self::Elsewhere(shown) => CONFIRMED * leds_alike(read, shown) as f32 / LEDS as f32,
            Self::Unconfirmed => UNCONFIRMED,
        }
    }
}

/// Whether the On LEDs of two lattices are at the same places. Such lattices may differ in outer lines that are dark.
fn show_the_same(read: (&Corners, PanelFrame), shown: (&Corners, PanelFrame)) -> bool {
    let limit = f64::from(SAME * shown.0.pitch_px());
    let [read, shown] = [read, shown].map(|(corners, bits)| lights(corners, bits));
    let is_near = |[x, y]: [f64; 2]| shown.iter().any(|[u, v]| (x - u).hypot(y - v) <= limit);
    read.len() == shown.len() && read.into_iter().all(is_near)
}

/// The places of the On LEDs.
fn lights(corners: &Corners, bits: PanelFrame) -> Vec<[f64; 2]> {
    let map = corners.homography();
    (0..LEDS).filter(|&led| bits.led(led)).map(|led| place_of(&map, led)).collect()
}

fn place_of(map: &Homography, led: usize) -> [f64; 2] {
    map.to_image([led % SIDE, led / SIDE].map(|line| line as f64))
}

fn are_alike(read: &Corners, shown: &Corners) -> bool {
    leds_alike(read, shown) == LEDS
}

/// The number of LEDs that two lattices have in the same places.
fn leds_alike(read: &Corners, shown: &Corners) -> usize {
    let limit = f64::from(SAME * shown.pitch_px());
    let (read, shown) = (read.homography(), shown.homography());
    let is_alike = |led: &usize| {
        let ([x, y], [u, v]) = (place_of(&read, *led), place_of(&shown, *led));
        (x - u).hypot(y - v) <= limit
    };
    (0..LEDS).filter(is_alike).count()
}

/// Why a frame cannot be processed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StillError {
    /// The panel's corners do not fit into the frame.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// The receiver's settings are invalid.
    #[error(transparent)]
    Receiver(#[from] ReceiverError),
}

/// A reading or why there is none, and the estimate of the camera.
type Read = (Result<FrameReading, String>, Option<CameraEstimate>);
type StillReceiver<S> = Receiver<SEARCH_PIXELS, Box<ReceiverMemory<SEARCH_PIXELS>>, S>;

/// Reads single frames independently.
pub struct StillDecoder {
    method: Method,
    search: SearchSettings,
    map: Box<CellMap<PANEL_PIXELS>>,
    likelihood: Box<MaximumLikelihood<LIKELIHOOD_PIXELS>>,
    locator: Box<LocatorMemory<CONFIRMATION_PIXELS>>,
    /// Room for a part of the frame in larger pixels.
    larger: Vec<u8>,
}

impl StillDecoder {
    /// A decoder with this detector.
    pub fn new(method: Method) -> Self {
        Self {
            method,
            search: SearchSettings::DEFAULT,
            map: Box::new(CellMap::empty()),
            likelihood: Box::new(MaximumLikelihood::new(Camera::default())),
            locator: Box::default(),
            larger: Vec::new(),
        }
    }

    /// The same decoder with another search.
    pub fn with_search(self, search: SearchSettings) -> Self {
        Self { search, ..self }
    }

    /// The panel in a single frame, at the given corners or at the place that a search finds, and the learnt camera.
    ///
    /// # Errors
    /// [`StillError`] if the input is invalid.
    pub fn decode(&mut self, frame: &Frame, camera: Camera, given: Option<Corners>) -> Result<(Still, Option<CameraEstimate>), StillError> {
        if let Some(corners) = given {
            let read = self.read_at(camera, frame, corners)?;
            return Ok(self.with_place(frame, camera, read));
        }
        let read = self.search(camera, frame)?;
        let found = self.with_place(frame, camera, read);
        Ok(self.shown_elsewhere(frame, camera, &found.0).unwrap_or(found))
    }

    /// The panel at the place that the frame shows instead of the found one, if the frame confirms it there.
    fn shown_elsewhere(&mut self, frame: &Frame, camera: Camera, found: &Still) -> Option<(Still, Option<CameraEstimate>)> {
        let shown = *found.as_ref().ok()?.place.elsewhere()?;
        let read = self.read_at(camera, frame, shown).ok()?;
        let (still, learnt) = self.with_place(frame, camera, read);
        matches!(&still, Ok(reading) if reading.place == PlaceCheck::Confirmed).then_some((still, learnt))
    }

    fn with_place(&mut self, frame: &Frame, camera: Camera, (read, learnt): Read) -> (Still, Option<CameraEstimate>) {
        let camera = learnt.map_or(camera, |learnt| learnt.camera);
        (read.map(|reading| self.confirmed(frame, camera, reading)), learnt)
    }

    fn read_at(&mut self, camera: Camera, frame: &Frame, corners: Corners) -> Result<Read, StillError> {
        let size = (frame.width(), frame.height());
        match self.map.build(&corners, size.0, size.1) {
            // A receiver reads it in larger pixels, and assumes its place to be known to a fraction of a pitch.
            Err(CellsError::TooLarge { .. }) => {
                let shown = self.shown(frame, camera, &corners).map(|shown| shown.corners);
                let mut receiver = self.receiver(camera, NoSearch)?;
                receiver.place(shown.filter(|shown| are_alike(&corners, shown)).unwrap_or(corners), [0; 2], size)?;
                return Ok(read_by(&mut receiver, frame));
            }
            built => built?,
        }
        // Each frame is independent.
        self.likelihood.prepare(camera);
        let detection = self.detect(frame, &corners);
        let reading = detection.map(|detection| FrameReading { corners, detection });
        Ok((reading, self.likelihood.learnt()))
    }

    fn search(&self, camera: Camera, frame: &Frame) -> Result<Read, StillError> {
        let room = FrameSearch::<Box<SearchMemory>>::bytes(frame.width(), frame.height());
        let search = FrameSearch::with_history(Box::<SearchMemory>::default(), vec![0; room]);
        Ok(read_by(&mut self.receiver(camera, search.thorough())?, frame))
    }

    fn receiver<S: Search<SEARCH_PIXELS>>(&self, camera: Camera, search: S) -> Result<StillReceiver<S>, ReceiverError> {
        let settings = ReceiverSettings {
            camera,
            method: self.method,
            search: self.search,
            ..ReceiverSettings::default()
        };
        Receiver::new(settings, Box::default(), search)
    }

    /// A reading with the frame's confirmation of its place.
    fn confirmed(&mut self, frame: &Frame, camera: Camera, reading: FrameReading) -> StillReading {
        let place = match self.shown(frame, camera, &reading.corners) {
            Some(shown) if are_alike(&reading.corners, &shown.corners) => PlaceCheck::Confirmed,
            Some(shown) if !show_the_same((&reading.corners, reading.detection.bits), (&shown.corners, shown.states())) => {
                PlaceCheck::Elsewhere(shown.corners)
            }
            _ => PlaceCheck::Unconfirmed,
        };
        let detection = reading.detection.doubted(place.share(&reading.corners));
        StillReading {
            reading: FrameReading { detection, ..reading },
            place,
        }
    }

    /// The panel that the frame shows at those corners or near them.
    fn shown(&mut self, frame: &Frame, camera: Camera, corners: &Corners) -> Option<Location> {
        self.larger.resize(frame.width() * frame.height(), 0);
        let locator = Locator::new(camera).ok()?;
        locator.locate_at(frame, corners, &mut self.locator, &mut self.larger).ok()
    }

    fn detect(&mut self, frame: &Frame, corners: &Corners) -> Result<Detection, String> {
        let why = |error: &dyn std::error::Error| error.to_string();
        let features = Features::measure(frame, &self.map).map_err(|error| why(&error))?;
        check_white(&features).map_err(|error| why(&error))?;
        match &self.method {
            Method::Features(detector) => detector.detect(&features),
            Method::MaximumLikelihood => self.likelihood.detect(frame, corners),
        }
        .map_err(|error| why(&error))
    }
}

/// The reading of a frame by a receiver that has seen no other.
fn read_by<S: Search<SEARCH_PIXELS>>(receiver: &mut StillReceiver<S>, frame: &Frame) -> Read {
    let reading = receiver.frame(0, frame).reading;
    (reading.map_err(|loss| loss.to_string()), receiver.learnt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattices_that_differ_in_dark_outer_lines_show_the_same() {
        let at =
            |rows: f32| Corners::new([[10.0, 10.0], [80.0, 10.0], [80.0, 80.0], [10.0, 80.0]].map(|[x, y]| [x, y + 10.0 * rows])).unwrap();
        let (here, below) = (at(0.0), at(1.0));
        // The first row is dark, and so is the row below the last one.
        let bits = 0x1234_5678_9abc_de00;
        let [read, shown] = [bits, bits >> 8].map(PanelFrame::from_bits);
        assert!(show_the_same((&here, read), (&below, shown)));
        assert!(!show_the_same((&here, read), (&below, read)));
        assert!(!show_the_same((&here, PanelFrame::from_bits(bits | 1)), (&below, shown)));
    }
}
