//! The whole pipeline: camera frames in, messages out.

use core::borrow::BorrowMut;

use crate::cells::{CellMap, CellsError};
use crate::corners::Corners;
use crate::detect::{DetectError, Detection, Method};
use crate::features::{Features, FeaturesError};
use crate::frame::Frame;
use crate::likelihood::MaximumLikelihood;
use crate::locate::{LocateError, Locator, LocatorSettings};
use crate::symbols::{Symbol, SymbolClock, SymbolRateError};
use link::framing::{Deframer, Event};

/// What a receiver has to know of the link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverSettings {
    /// The camera.
    pub locator: LocatorSettings,
    /// How bits are told apart.
    pub method: Method,
    /// Symbols the panel shows in a camera's frame period: above 0, at most 1.
    pub symbols_per_frame: f32,
}

impl Default for ReceiverSettings {
    /// A camera of γ = 2.2 and about 1.5 px of blur, maximum likelihood, and one symbol a frame.
    fn default() -> Self {
        Self {
            locator: LocatorSettings::default(),
            method: Method::default(),
            symbols_per_frame: 1.0,
        }
    }
}

/// Why there is no receiver with these settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiverError {
    /// The locator does not take its settings.
    #[error(transparent)]
    Locator(#[from] LocateError),
    /// The symbols cannot be followed at this rate.
    #[error(transparent)]
    SymbolRate(#[from] SymbolRateError),
}

/// The large parts of a receiver: the cells of panels of up to `PIXELS` (bounding box), their likelihood, and the message in
/// progress.
///
/// 22 bytes a pixel and about 70 kB: 430 kB for 128×128 pixels; the receiver itself takes 2.5 kB. [`ReceiverMemory::new`] is `const`, so that on a
/// microcontroller this is a `static`, which the receiver borrows; on a computer it can be owned, boxed, or borrowed.
pub struct ReceiverMemory<const PIXELS: usize> {
    map: CellMap<PIXELS>,
    likelihood: MaximumLikelihood<PIXELS>,
    deframer: Deframer,
}

impl<const PIXELS: usize> ReceiverMemory<PIXELS> {
    /// Memory that holds nothing yet.
    pub const fn new() -> Self {
        Self {
            map: CellMap::empty(),
            likelihood: MaximumLikelihood::blind(),
            deframer: Deframer::new(),
        }
    }
}

impl<const PIXELS: usize> Default for ReceiverMemory<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}

/// One frame's panel, read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Where the panel is.
    pub corners: Corners,
    /// Its bits, hard and soft, and how sure they are.
    pub detection: Detection,
}

/// Why a frame gave no reading.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Loss {
    /// No panel was found.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// The panel's cells are not in the frame or the memory.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// The frame and the cells do not match.
    #[error(transparent)]
    Features(#[from] FeaturesError),
    /// The bits could not be told apart.
    #[error(transparent)]
    Detect(#[from] DetectError),
}

/// What one frame brought.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The panel, or why there is none.
    pub reading: Result<Reading, Loss>,
    /// The number of the symbol that the frame shows, where it was read.
    pub symbol: Option<u32>,
    /// What the symbol before this frame's meant for the message.
    pub event: Event<'a>,
}

/// A reading less sure than this is doubtful.
pub const STEADY_CONFIDENCE: f32 = 0.9;
/// So is one whose On cells have less than this share of the gradient radial inwards that they used to have: it is greatest
/// where the cells are centred on the LEDs.
pub const STEADY_GRADIENT: f32 = 0.75;
/// So many doubtful readings in a row make the receiver look for the panel anew.
pub const PATIENCE_FRAMES: u32 = 4;
/// The usual gradient is the mean over about this many steady readings.
const MEMORY_FRAMES: f32 = 16.0;

/// Frames to messages.
///
/// It looks for the panel once and then reads it where it was. It looks again at once when a frame cannot be read
/// there, and when [`PATIENCE_FRAMES`] readings in a row were doubtful (see [`STEADY_CONFIDENCE`], [`STEADY_GRADIENT`]); then it
/// keeps whichever place has the greater gradient. It does not follow a panel that moves from frame to frame.
///
/// `M` is where its [memory](ReceiverMemory) is: `ReceiverMemory` itself, `&mut ReceiverMemory`, or a `Box` of it.
///
/// ```
/// use rx_pipeline::{frame::Frame, receiver::{Receiver, ReceiverMemory, ReceiverSettings}};
/// let mut memory = ReceiverMemory::<4096>::new();
/// let mut receiver = Receiver::new(ReceiverSettings::default(), &mut memory)?;
/// let outcome = receiver.frame(0, &Frame::new(&[118; 64 * 64], 64, 64)?);
/// let loss = outcome.reading.unwrap_err();
/// assert!(loss.to_string().starts_with("no 3×3 pixels have a mean grey of 119.5"));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Receiver<const PIXELS: usize, M> {
    locator: Locator,
    method: Method,
    clock: SymbolClock,
    pose: Option<Pose>,
    doubtful_frames: u32,
    usual_gradient: f32,
    memory: M,
}

/// A panel's place in frames of one size.
#[derive(Clone, Copy, PartialEq)]
struct Pose {
    corners: Corners,
    frame_size: (usize, usize),
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>> Receiver<PIXELS, M> {
    /// A receiver that has seen nothing.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range.
    pub fn new(settings: ReceiverSettings, mut memory: M) -> Result<Self, ReceiverError> {
        if let Method::MaximumLikelihood(camera) = settings.method {
            memory.borrow_mut().likelihood.prepare(camera);
        }
        Ok(Self {
            locator: Locator::new(settings.locator)?,
            method: settings.method,
            clock: SymbolClock::new(settings.symbols_per_frame)?,
            pose: None,
            doubtful_frames: 0,
            usual_gradient: 0.0,
            memory,
        })
    }

    /// Takes in frame `number`. Numbers rise; those that are left out are lost frames.
    ///
    /// Messages carry as stamps the numbers of the frames that first showed their symbols.
    pub fn frame(&mut self, number: u64, frame: &Frame<'_>) -> Outcome<'_> {
        let reading = self.read(frame);
        let ended = reading.as_ref().ok().and_then(|reading| {
            let detection = &reading.detection;
            if detection.mixed {
                self.clock.push_mixed(number, &detection.soft)
            } else {
                self.clock.push(number, &detection.soft)
            }
        });
        let symbol = reading.as_ref().ok().and_then(|_| self.clock.current());
        let event = self.deframe(ended);
        Outcome {
            reading,
            symbol,
            event,
        }
    }

    /// Takes in the symbol that the last frames showed, of which [`Receiver::frame`] waits for the end.
    pub fn finish(&mut self) -> Event<'_> {
        let ended = self.clock.flush();
        self.deframe(ended)
    }

    fn deframe(&mut self, ended: Option<Symbol>) -> Event<'_> {
        match ended {
            Some(symbol) => self.memory.borrow_mut().deframer.push(
                symbol.index,
                symbol.first_frame,
                &symbol.panel,
            ),
            None => Event::Nothing,
        }
    }

    /// Where the panel is taken to be.
    pub fn corners(&self) -> Option<Corners> {
        self.pose.map(|pose| pose.corners)
    }

    /// Reads the panel at `corners` from now on, in frames of `width` × `height`, until it can no longer be read there.
    ///
    /// # Errors
    /// [`CellsError`] if its cells do not fit into the frame or the memory; then nothing changes but that the panel will be
    /// looked for.
    pub fn place(
        &mut self,
        corners: Corners,
        width: usize,
        height: usize,
    ) -> Result<(), CellsError> {
        (self.doubtful_frames, self.usual_gradient) = (0, 0.0);
        self.settle(Pose {
            corners,
            frame_size: (width, height),
        })
    }

    fn read(&mut self, frame: &Frame<'_>) -> Result<Reading, Loss> {
        let frame_size = (frame.width(), frame.height());
        let Some(pose) = self.pose.filter(|pose| pose.frame_size == frame_size) else {
            return self.read_anew(frame);
        };
        let Ok((kept, gradient)) = self.read_here(frame, pose.corners) else {
            return self.read_anew(frame);
        };
        let usual = self.usual_gradient;
        if kept.detection.confidence >= STEADY_CONFIDENCE && gradient >= STEADY_GRADIENT * usual {
            self.doubtful_frames = 0;
            self.usual_gradient += (gradient - usual) / MEMORY_FRAMES;
            return Ok(kept);
        }
        self.doubtful_frames += 1;
        if self.doubtful_frames < PATIENCE_FRAMES {
            return Ok(kept);
        }
        match self.read_anew(frame) {
            // The usual gradient is that of the new place now.
            Ok(anew) if self.usual_gradient > gradient => Ok(anew),
            _ => {
                self.settle(pose)?;
                self.usual_gradient = gradient;
                Ok(kept)
            }
        }
    }

    /// Looks for the panel and reads it.
    fn read_anew(&mut self, frame: &Frame<'_>) -> Result<Reading, Loss> {
        self.pose = None;
        self.doubtful_frames = 0;
        let corners = self.locator.locate(frame)?.corners;
        self.settle(Pose {
            corners,
            frame_size: (frame.width(), frame.height()),
        })?;
        match self.read_here(frame, corners) {
            Ok((reading, gradient)) => {
                self.usual_gradient = gradient;
                Ok(reading)
            }
            Err(loss) => {
                self.pose = None;
                Err(loss)
            }
        }
    }

    fn settle(&mut self, pose: Pose) -> Result<(), CellsError> {
        self.pose = None;
        let (width, height) = pose.frame_size;
        self.memory
            .borrow_mut()
            .map
            .build(&pose.corners, width, height)?;
        self.pose = Some(pose);
        Ok(())
    }

    /// Reads the panel in the cells that the memory holds; with the mean gradient radial inwards of the cells that are On.
    fn read_here(&mut self, frame: &Frame<'_>, corners: Corners) -> Result<(Reading, f32), Loss> {
        let memory = self.memory.borrow_mut();
        let features = Features::measure(frame, &memory.map)?;
        let detection = match &self.method {
            Method::Features(detector) => detector.detect(&features)?,
            Method::MaximumLikelihood(_) => memory.likelihood.detect(frame, &corners)?,
        };
        let on = features
            .gri
            .iter()
            .enumerate()
            .filter(|&(led, _)| detection.bits.led(led));
        let gradient =
            on.map(|(_, gri)| gri).sum::<f32>() / detection.bits.count_on().max(1) as f32;
        Ok((Reading { corners, detection }, gradient))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Scene;
    use link::fec::Code;
    use link::framing::Framer;
    use link::panel::PanelFrame;
    use proptest::prelude::*;
    use std::boxed::Box;
    use std::vec::Vec;

    const MESSAGE: &[u8] = b"lane closed after the bridge";

    fn receiver(symbols_per_frame: f32) -> Receiver<4096, Box<ReceiverMemory<4096>>> {
        let settings = ReceiverSettings {
            symbols_per_frame,
            ..ReceiverSettings::default()
        };
        Receiver::new(settings, Box::new(ReceiverMemory::new())).unwrap()
    }

    fn panels(count: usize) -> Vec<PanelFrame> {
        let mut framer = Framer::new(MESSAGE, Code::for_length(MESSAGE.len()), false).unwrap();
        (0..count).map(|_| framer.next_panel()).collect()
    }

    fn delivery(event: Event<'_>) -> Option<(Vec<u8>, u64, u64)> {
        match event {
            Event::Delivered(d) => Some((d.message.to_vec(), d.first_stamp, d.last_stamp)),
            _ => None,
        }
    }

    #[test]
    fn frames_become_a_message() {
        let mut receiver = receiver(1.0);
        let panels = panels(30);
        let mut delivered = Vec::new();
        for (number, panel) in (0..).zip(&panels) {
            let rendered = Scene {
                bits: panel.bits(),
                noise_grey: 1.0,
                ..Scene::PLAIN
            }
            .render();
            let outcome = receiver.frame(number, &rendered.frame());
            assert_eq!(outcome.reading.unwrap().detection.bits, *panel);
            delivered.extend(delivery(outcome.event));
        }
        delivered.extend(delivery(receiver.finish()));
        let (message, first, last) = delivered.first().cloned().unwrap();
        assert_eq!((message.as_slice(), first), (MESSAGE, 0));
        assert!(last < 30);
    }

    #[test]
    fn slow_panels_and_lost_frames_still_give_the_message() {
        let mut receiver = receiver(0.5);
        let panels = panels(60);
        let mut delivered = None;
        for number in (0..120).filter(|number| number % 11 != 7) {
            let bits = panels[number / 2].bits();
            let rendered = Scene {
                bits,
                ..Scene::PLAIN
            }
            .render();
            let outcome = receiver.frame(number as u64, &rendered.frame());
            delivered = delivered.or(delivery(outcome.event));
        }
        assert_eq!(delivered.unwrap().0, MESSAGE);
    }

    #[test]
    fn the_panel_is_looked_for_again_where_it_went() {
        let mut receiver = receiver(1.0);
        let panels = panels(20);
        let jump = |number: usize| {
            if number < 10 {
                [47.3, 48.6]
            } else {
                [40.0, 52.0]
            }
        };
        for (number, panel) in panels.iter().enumerate() {
            let centre = jump(number);
            let scene = Scene {
                bits: panel.bits(),
                centre,
                ..Scene::PLAIN
            };
            let reading = receiver
                .frame(number as u64, &scene.render().frame())
                .reading
                .unwrap();
            if number < 10 || number >= 10 + PATIENCE_FRAMES as usize {
                assert_eq!(reading.detection.bits, *panel, "frame {number}");
            }
        }
    }

    #[test]
    fn frames_without_a_panel_say_why() {
        let mut receiver = receiver(1.0);
        let scene = Scene::PLAIN;
        assert!(receiver.frame(0, &scene.render().frame()).reading.is_ok());
        let plain = Frame::new(&[118; 96 * 96], 96, 96).unwrap();
        let loss = receiver.frame(1, &plain).reading.unwrap_err();
        assert!(matches!(
            loss,
            Loss::Locate(LocateError::ContrastTooLow {
                background: 118,
                ..
            })
        ));
        assert_eq!(receiver.corners(), None);
        assert!(receiver.frame(2, &scene.render().frame()).reading.is_ok());
        let small = Frame::new(&[118; 16], 4, 4).unwrap();
        assert!(receiver.frame(3, &small).reading.is_err());
    }

    #[test]
    fn a_known_place_needs_no_search() {
        let mut receiver = receiver(1.0);
        // Off LEDs as dark as the background: no outline, so no locating.
        let scene = Scene {
            light: [1.0, 9.0],
            ..Scene::PLAIN
        };
        receiver
            .place(scene.corners(), scene.width, scene.height)
            .unwrap();
        let reading = receiver.frame(0, &scene.render().frame()).reading.unwrap();
        assert_eq!(reading.detection.bits.bits(), scene.bits);
        assert!(receiver.place(scene.corners(), 20, 20).is_err());
        assert_eq!(receiver.corners(), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_frame_panics(
            pixels in prop::collection::vec(prop_oneof![any::<u8>(), Just(0u8), Just(255u8)], 1..5000),
            width in 1usize..100,
            number: u64,
        ) {
            let mut receiver = receiver(1.0);
            let scene = Scene::PLAIN;
            prop_assert!(receiver.frame(7, &scene.render().frame()).reading.is_ok());
            let height = pixels.len() / width;
            if let Ok(frame) = Frame::new(&pixels, width, height) {
                let reading = receiver.frame(number, &frame).reading;
                prop_assert_eq!(reading.is_ok(), receiver.corners().is_some());
            }
        }
    }

    #[test]
    fn the_memory_is_as_large_as_stated() {
        assert!(size_of::<ReceiverMemory<16384>>() < 430_000);
        assert!(size_of::<Receiver<16384, &mut ReceiverMemory<16384>>>() < 2_500);
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let settings = ReceiverSettings {
            symbols_per_frame: 2.0,
            ..ReceiverSettings::default()
        };
        let error = Receiver::<16, _>::new(settings, ReceiverMemory::new()).err();
        assert!(matches!(error, Some(ReceiverError::SymbolRate(_))));
    }
}
