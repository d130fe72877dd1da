//! The whole pipeline: camera frames in, messages out.

pub(crate) mod history;
mod outcome;
pub(crate) mod reader;
mod settings;

pub use outcome::{Loss, Outcome, Reading};
pub use settings::{ReceiverError, ReceiverSettings};

use core::borrow::BorrowMut;

use crate::cells::{CellMap, CellsError};
use crate::corners::Corners;
use crate::detect::Method;
use crate::frame::Frame;
use crate::likelihood::MaximumLikelihood;
use crate::locate::{Effort, Locator, LocatorMemory};
use crate::profile::Profile;
use history::History;
use link::framing::{Deframer, Event};
use reader::{Reader, Tools};

/// The large parts of a receiver: the cells of panels of up to `PIXELS` (bounding box), their likelihood, the locator's memory, and the message
/// in progress.
///
/// 30 bytes a pixel and about 200 kB: 690 kB for 128×128 pixels; the receiver itself takes 4 kB. [`ReceiverMemory::new`] is `const`, so that on a
/// microcontroller this is a `static`, which the receiver borrows; on a computer it can be owned, boxed, or borrowed.
pub struct ReceiverMemory<const PIXELS: usize> {
    pub(crate) map: CellMap<PIXELS>,
    likelihood: MaximumLikelihood<PIXELS>,
    pub(crate) locator: LocatorMemory<PIXELS>,
    pub(crate) deframer: Deframer,
}

impl<const PIXELS: usize> ReceiverMemory<PIXELS> {
    /// A constant, so that its parts are not made one by one on the stack before they are put together.
    const EMPTY: Self = Self {
        map: CellMap::empty(),
        likelihood: MaximumLikelihood::blind(),
        locator: LocatorMemory::new(),
        deframer: Deframer::new(),
    };

    /// Memory that holds nothing yet. On a computer, `Box::default()` makes it where it stays, and takes no room for it on the stack.
    pub const fn new() -> Self {
        Self::EMPTY
    }

    /// Gets ready for a camera and a panel.
    pub(crate) fn prepare(&mut self, settings: &ReceiverSettings) {
        self.deframer = Deframer::new();
        if settings.method == Method::MaximumLikelihood {
            self.likelihood.prepare(settings.camera);
        }
    }

    /// What a panel is read with.
    pub(crate) fn tools(&mut self) -> Tools<'_, PIXELS> {
        Tools {
            map: &mut self.map,
            canvas: &mut self.locator.canvas,
            likelihood: &mut self.likelihood,
        }
    }
}

impl<const PIXELS: usize> Default for ReceiverMemory<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}

/// Frames to messages, for one panel.
///
/// It looks for the panel until it has found one, and follows it from then on: where it goes, as it grows, through short gaps. When it has lost it
/// for [`crate::track::PATIENCE_FRAMES`] frames it looks for one anew. A frame it cannot read with the panel in its expected place gives no
/// reading but a [`Loss`] that says why.
///
/// `M` is where its [memory](ReceiverMemory) is: `ReceiverMemory` itself, `&mut ReceiverMemory`, or a `Box` of it. `H` keeps the last frames
/// while the panel is looked for, so that one that does not stand out is found by its blinking: anything that lends a slice of bytes, of
/// twice a frame's pixels (one frame's does with less certainty). Without it, as with [`Receiver::new`], each frame is searched alone.
///
/// ```
/// use rx_pipeline::{frame::Frame, receiver::{Receiver, ReceiverMemory, ReceiverSettings}};
/// let mut memory = Box::new(ReceiverMemory::<4096>::new());
/// let mut receiver = Receiver::new(ReceiverSettings::default(), memory.as_mut())?;
/// let outcome = receiver.frame(0, &Frame::new(&[118; 64 * 64], 64, 64)?);
/// let loss = outcome.reading.unwrap_err();
/// assert!(loss.to_string().starts_with("no candidate"));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Receiver<const PIXELS: usize, M, H = [u8; 0]> {
    locator: Locator,
    reader: Reader,
    history: History<H>,
    memory: M,
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>> Receiver<PIXELS, M> {
    /// A receiver that has seen nothing, and finds panels that stand out in single frames.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range.
    pub fn new(settings: ReceiverSettings, memory: M) -> Result<Self, ReceiverError> {
        Self::with_history(settings, memory, [])
    }
}

impl<const PIXELS: usize, M: BorrowMut<ReceiverMemory<PIXELS>>, H: BorrowMut<[u8]>>
    Receiver<PIXELS, M, H>
{
    /// A receiver that has seen nothing, and finds panels by their blinking too, in frames of up to half as many pixels as `history` has bytes.
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range.
    pub fn with_history(
        settings: ReceiverSettings,
        mut memory: M,
        history: H,
    ) -> Result<Self, ReceiverError> {
        memory.borrow_mut().prepare(&settings);
        Ok(Self {
            locator: Locator::new(settings.camera)?,
            reader: Reader::new(&settings)?,
            history: History::new(history),
            memory,
        })
    }

    /// Takes in frame `number`. Numbers rise; those that are left out are lost frames.
    ///
    /// Messages carry as stamps the numbers of the frames that first showed their symbols.
    pub fn frame(&mut self, number: u64, frame: &Frame<'_>) -> Outcome<'_> {
        self.frame_timed(number, frame, &mut ())
    }

    /// The same, with somebody who takes the time of each stage.
    pub fn frame_timed(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        profile: &mut impl Profile,
    ) -> Outcome<'_> {
        let memory = self.memory.borrow_mut();
        let followed =
            self.reader
                .follow(number, frame, &self.locator, &mut memory.tools(), profile);
        let reading = followed.unwrap_or_else(|| {
            let found = self.history.with_earlier(frame, |earlier| {
                self.locator.locate_among(
                    frame,
                    earlier,
                    &[],
                    Effort::Share(number),
                    &mut memory.locator,
                    profile,
                )
            });
            self.history.keep(frame);
            found.map_err(Loss::from).and_then(|location| {
                self.reader
                    .begin(number, frame, &location, &mut memory.tools(), profile)
            })
        });
        if self.reader.is_following() {
            self.history.forget();
        }
        self.reader
            .outcome(number, reading, &mut memory.deframer, profile)
    }

    /// Takes in the symbol that the last frames showed, of which [`Receiver::frame`] waits for the end.
    pub fn finish(&mut self) -> Event<'_> {
        self.reader.finish(&mut self.memory.borrow_mut().deframer)
    }

    /// Where the panel was last seen, while it is followed.
    pub fn corners(&self) -> Option<Corners> {
        self.reader.corners()
    }

    /// Reads the panel at `corners` from now on, in frames of `width` × `height`, until it is lost there.
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
        let spot_sigma_px = self.locator.spot_sigma_px();
        self.reader.place(
            corners,
            (width, height),
            spot_sigma_px,
            &mut self.memory.borrow_mut().map,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locate::LocateError;
    use crate::synthetic::Scene;
    use crate::track::PATIENCE_FRAMES;
    use link::camera::Camera;
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

    /// Reads panels in the scenes that `scene` makes of them; how many were read, and none of them wrongly.
    fn read(
        receiver: &mut Receiver<4096, Box<ReceiverMemory<4096>>>,
        frames: usize,
        scene: impl Fn(usize) -> Scene,
    ) -> usize {
        let panels = panels(frames);
        let mut read = 0;
        for (number, panel) in panels.iter().enumerate() {
            let scene = Scene {
                bits: panel.bits(),
                ..scene(number)
            };
            if let Ok(reading) = receiver
                .frame(number as u64, &scene.render().frame())
                .reading
            {
                assert_eq!(reading.detection.bits, *panel, "frame {number}");
                read += 1;
            }
        }
        read
    }

    #[test]
    fn a_panel_that_drives_past_is_followed() {
        // 14.5 px a frame: 20 m/s across at 50 m before a camera of 100 frames a second.
        let across = |number: usize| Scene {
            width: 640,
            centre: [60.0 + 14.5 * number as f32, 48.0 + 0.3 * number as f32],
            noise_grey: 1.0,
            ..Scene::PLAIN
        };
        assert!(read(&mut receiver(1.0), 35, across) >= 34);
    }

    #[test]
    fn no_speed_is_mistaken_for_another_line() {
        // About one, two and three pitches a frame.
        for speed_px in [4.4, 8.9, 13.1] {
            let across = |number: usize| Scene {
                width: 400,
                centre: [40.0 + speed_px * number as f32, 48.0],
                ..Scene::PLAIN
            };
            assert!(
                read(&mut receiver(1.0), 20, across) >= 18,
                "{speed_px} px a frame"
            );
        }
    }

    #[test]
    fn a_jump_is_found_or_admitted() {
        let jump = |number: usize| Scene {
            centre: if number < 10 {
                [47.3, 48.6]
            } else {
                [40.0, 52.0]
            },
            ..Scene::PLAIN
        };
        assert!(read(&mut receiver(1.0), 20, jump) >= 18);
    }

    #[test]
    fn growth_and_exposure_changes_are_followed() {
        let grow = |number: usize| {
            let exposure = if number < 15 { 1.0 } else { 0.6 };
            let light = Scene::PLAIN.light.map(|light| light * exposure);
            Scene {
                width: 128,
                height: 128,
                centre: [64.0, 63.0],
                pitch_px: 4.4 * 1.01f32.powi(number as i32),
                light,
                noise_grey: 1.0,
                ..Scene::PLAIN
            }
        };
        assert!(read(&mut receiver(1.0), 40, grow) >= 38);
    }

    #[test]
    fn a_short_occlusion_is_coasted_through_and_a_long_one_ends_openly() {
        let mut receiver = receiver(1.0);
        let plain = Frame::new(&[118; 96 * 96], 96, 96).unwrap();
        let scene = Scene::PLAIN.render();
        assert!(receiver.frame(0, &scene.frame()).reading.is_ok());
        assert!(receiver.frame(1, &scene.frame()).reading.is_ok());
        for missed in 1..=PATIENCE_FRAMES {
            let loss = receiver
                .frame(u64::from(missed) + 1, &plain)
                .reading
                .unwrap_err();
            assert!(
                matches!(loss, Loss::Coasting { missed: m, .. } if m == missed),
                "{loss}"
            );
        }
        let frame = u64::from(PATIENCE_FRAMES) + 2;
        assert!(matches!(
            receiver.frame(frame, &plain).reading,
            Err(Loss::Lost(_))
        ));
        assert_eq!(receiver.corners(), None);
        let nothing = receiver.frame(frame + 1, &plain).reading;
        assert_eq!(nothing, Err(Loss::Locate(LocateError::NothingStandsOut)));
        assert!(receiver.frame(frame + 2, &scene.frame()).reading.is_ok());
    }

    #[test]
    fn blinking_gives_a_panel_away_that_does_not_stand_out() {
        let settings = ReceiverSettings::default();
        let mut receiver = Receiver::with_history(
            settings,
            Box::new(ReceiverMemory::<4096>::new()),
            std::vec![0u8; 2 * 96 * 96],
        )
        .unwrap();
        let clutter = |pixels: &mut [u8]| {
            for (i, grey) in pixels.iter_mut().enumerate() {
                let (x, y) = ((i % 96) as f32, (i / 96) as f32);
                let wave = (x / 3.1).sin() * (y / 2.7).cos() + ((x + 2.0 * y) / 5.0).sin();
                *grey = (f32::from(*grey) + 25.0 * wave).clamp(0.0, 255.0) as u8;
            }
        };
        let mut found = None;
        for (number, panel) in panels(4).iter().enumerate() {
            let mut rendered = Scene {
                bits: panel.bits(),
                light: [1.2, 5.0],
                noise_grey: 1.0,
                ..Scene::PLAIN
            }
            .render();
            clutter(&mut rendered.pixels);
            found = found.or(receiver
                .frame(number as u64, &rendered.frame())
                .reading
                .ok());
        }
        let [x, y] = found.unwrap().corners.centre_px();
        assert!((x - 47.3).abs() < 0.3 && (y - 48.6).abs() < 0.3, "{x} {y}");
    }

    #[test]
    fn frames_of_other_sizes_end_what_was_followed() {
        let mut receiver = receiver(1.0);
        let scene = Scene::PLAIN;
        assert!(receiver.frame(0, &scene.render().frame()).reading.is_ok());
        let small = Frame::new(&[118; 16], 4, 4).unwrap();
        assert_eq!(
            receiver.frame(1, &small).reading,
            Err(Loss::Locate(LocateError::NothingStandsOut))
        );
        assert_eq!(receiver.corners(), None);
        let larger = Scene {
            width: 128,
            ..scene
        };
        assert!(receiver.frame(2, &larger.render().frame()).reading.is_ok());
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
                if reading.is_ok() {
                    prop_assert!(receiver.corners().is_some());
                }
            }
        }
    }

    #[test]
    fn the_memory_is_as_large_as_stated() {
        assert!(size_of::<ReceiverMemory<16384>>() < 700_000);
        assert!(size_of::<Receiver<16384, &mut ReceiverMemory<16384>>>() < 4_000);
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let refusal = |settings| Receiver::<16, _>::new(settings, ReceiverMemory::new()).err();
        let too_many_symbols = ReceiverSettings {
            symbols_per_frame: 2.0,
            ..ReceiverSettings::default()
        };
        let error = refusal(too_many_symbols);
        assert!(matches!(error, Some(ReceiverError::SymbolRate(_))));
        let blurred_to_nothing = Camera {
            blur_sigma_px: f32::INFINITY,
            ..Camera::default()
        };
        let error = refusal(ReceiverSettings {
            camera: blurred_to_nothing,
            ..ReceiverSettings::default()
        });
        assert!(matches!(error, Some(ReceiverError::Camera(_))));
    }
}
