//! Why no message arrived, and a remedy.

use std::collections::BTreeMap;

use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::receiver::{FrameReading, Loss, LossKind};

use crate::event::PanelEvent;

/// The share of frames that counts as most of them.
const MOST: f32 = 0.7;
/// The mean confidence above which readings have few wrong bits.
const SURE: f32 = 0.98;
/// LEDs overlap if the distance between them is less than this many standard deviations of the blur.
const APART: f32 = 2.0;
/// Minimum share of frames with a covered panel for covering to count as the cause.
const OFTEN_COVERED: f32 = 0.05;
/// Minimum share of readings with all LEDs alike for that to count as the cause.
const OFTEN_EVEN: f32 = 0.5;
/// The longest exposure that reads the usual carrier: half a cycle of 1440 Hz.
const LONGEST_WITH_CARRIER: &str = "1/2880 s, half a cycle of the usual 1440 Hz";
/// Minimum number of changes a frame at which the panel may show more symbols than there are frames. At the fastest usual rate, 9 of 10
/// frames change.
const EVERY_FRAME: f32 = 0.97;
/// Symbols of a message of a few words, sent twice.
const SHORT: usize = 20;

/// The assumed and the observed rates of a link.
pub struct LinkRates {
    /// Symbols a second.
    pub symbols_hz: f32,
    /// Frames a second.
    pub fps: f32,
    /// Observed changes of the panel per second, if known.
    pub changes_hz: Option<f32>,
}

impl LinkRates {
    /// The advice to check the rates; `has_options` says whether it may name the command line's options.
    fn doubt(&self, has_options: bool) -> String {
        let Self { symbols_hz, fps, .. } = self;
        let [symbols, frames, slower] = match has_options {
            true => [" (--symbol-rate)", " (--fps)", " (`vocc device rate`)"],
            false => [""; 3],
        };
        let seen = self.changes_hz.map_or_else(String::new, |changes| {
            let too_fast = match changes > EVERY_FRAME * fps {
                true => format!(", with every frame; if it shows more than {fps} symbols, film faster or lower its symbol rate{slower}"),
                false => String::new(),
            };
            format!("; here the panel changes about {changes:.0} times a second{too_fast}")
        });
        format!(
            "check that the rates are right, {symbols_hz} symbols a second{symbols} and {fps} frames a second{frames}. The Pico shows 90 \
             symbols{seen}"
        )
    }
}

/// Counts of what frames have shown.
#[derive(Default)]
pub struct Diagnosis {
    read: usize,
    /// Readings in which all LEDs were alike.
    even: usize,
    confidence: f32,
    pitch_px: f32,
    rejected: usize,
    /// For each kind of loss, its count and the last one.
    losses: BTreeMap<LossKind, (usize, Loss)>,
}

impl Diagnosis {
    /// Counts a frame's reading of a panel.
    pub fn count(&mut self, reading: &Result<FrameReading, Loss>) {
        match reading {
            Ok(reading) => {
                self.read += 1;
                self.even += usize::from(reading.detection.lights.is_some_and(|lights| lights.are_even()));
                self.confidence += reading.detection.confidence;
                self.pitch_px = reading.corners.pitch_px();
            }
            Err(loss) => {
                let (count, last) = self.losses.entry(loss.kind()).or_insert((0, *loss));
                *count += 1;
                *last = *loss;
            }
        }
    }

    /// Counts parts of messages that could not be decoded.
    pub fn count_event(&mut self, event: &PanelEvent) {
        self.rejected += usize::from(matches!(event, PanelEvent::Rejected(_)));
    }

    /// The diagnosis, one item a line, with the camera that was `learnt`; `has_options` says whether it may name the command line's
    /// options.
    pub fn lines(&self, rates: &LinkRates, learnt: Option<&CameraEstimate>, has_options: bool) -> Vec<String> {
        let lost: usize = self.losses.values().map(|(count, _)| count).sum();
        let frames = lost + self.read;
        let mut lines = Vec::new();
        if let Some((count, loss)) = self.losses.values().max_by_key(|(count, _)| *count) {
            lines.push(format!("in {count} of {frames} frames: {loss}"));
        }
        if self.read == 0 {
            if frames > 0 {
                let look = match has_options {
                    true => "; look at a frame, and try it with `vocc decode FRAME`",
                    false => "",
                };
                lines.push(format!(
                    "no panel was found: its LEDs should be at least 2 px apart, not all white or all black, and change from frame to \
                     frame; if it has a carrier, expose for at most {LONGEST_WITH_CARRIER}{look}"
                ));
            }
            return lines;
        }
        let confidence = self.confidence / self.read as f32;
        lines.push(format!(
            "the panel was read in {} of {frames} frames, LEDs {:.1} px apart, {:.0} % sure",
            self.read,
            self.pitch_px,
            100.0 * confidence
        ));
        let blur = learnt.map(|learnt| learnt.camera.blur_sigma_px);
        lines.push(self.advice(confidence, frames, blur, &rates.doubt(has_options)));
        lines
    }

    /// Number of frames in which the panel was covered or dark.
    fn covered(&self) -> usize {
        self.losses.get(&LossKind::Covered).map_or(0, |(count, _)| *count)
    }

    fn advice(&self, confidence: f32, frames: usize, blur: Option<f32>, doubt: &str) -> String {
        let covered = self.covered();
        match blur {
            _ if self.even as f32 > OFTEN_EVEN * self.read as f32 => format!(
                "all LEDs are lit alike: exposures span about a whole number of the carrier's cycles, which hides the symbols; expose for \
                 at most {LONGEST_WITH_CARRIER}"
            ),
            _ if covered as f32 > OFTEN_COVERED * frames as f32 => format!(
                "the panel was covered or dark in {covered} of {frames} frames, as behind a wiper: remove what covers it, or make the \
                 film longer"
            ),
            _ if (self.read as f32) < MOST * frames as f32 => {
                "too few of the panel's symbols were seen: keep the panel whole and still in the picture, or make the film longer"
                    .to_owned()
            }
            Some(blur) if confidence < SURE && self.pitch_px < APART * blur => {
                format!("the LEDs merge under a blur of {blur:.1} px: focus, move closer, or use a longer lens")
            }
            _ if confidence < SURE => {
                "many bits are unreliable: expose longer or brighten the panel if it is noisy, expose less if it is white".to_owned()
            }
            _ if self.read < SHORT => format!("{} frames are shorter than a message: make the film longer", self.read),
            _ if self.rejected > 0 => {
                format!("messages began, but none was complete: {doubt}. If they are right, make the film longer")
            }
            _ => format!("the bits are reliable, but no message begins in them: {doubt}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rx_pipeline::cells::CellMap;
    use rx_pipeline::corners::Corners;
    use rx_pipeline::detect::{DetectError, Detector, Lights};
    use rx_pipeline::features::Features;
    use rx_pipeline::frame::Frame;
    use rx_pipeline::locate::LocateError;
    use rx_pipeline::receiver::TrackError;

    const USUAL: LinkRates = LinkRates {
        symbols_hz: 90.0,
        fps: 100.0,
        changes_hz: None,
    };

    #[test]
    fn losses_of_a_kind_count_together() {
        let mut diagnosis = Diagnosis::default();
        for lit in [3, 5, 7] {
            diagnosis.count(&Err(LocateError::NotRandom { lit, different: 9 }.into()));
            diagnosis.count(&Err(LocateError::NothingStandsOut.into()));
        }
        diagnosis.count(&Err(LocateError::NotRandom { lit: 8, different: 9 }.into()));
        let lines = diagnosis.lines(&USUAL, None, false);
        assert!(lines[0].starts_with("in 4 of 7 frames: no random pattern: 8 LEDs"), "{lines:?}");
        assert!(
            lines[1].starts_with("no panel was found") && lines[1].contains("carrier") && !lines[1].contains("vocc"),
            "{lines:?}"
        );
    }

    #[test]
    fn frames_without_the_panel_count_by_their_reason() {
        let mut diagnosis = Diagnosis::default();
        let gone = Loss::Lost(TrackError::OutOfFrame);
        let coasting = |missed, why| Loss::Coasting { missed, patience: 12, why };
        for missed in 1..=3 {
            diagnosis.count(&Err(coasting(missed, TrackError::OffCourse { off_px: missed as f32 })));
            diagnosis.count(&Err(coasting(missed, TrackError::OutOfFrame)));
        }
        diagnosis.count(&Err(coasting(4, TrackError::OffCourse { off_px: 4.0 })));
        diagnosis.count(&Err(gone));
        let lines = diagnosis.lines(&USUAL, None, false);
        assert!(
            lines[0].starts_with("in 4 of 8 frames: coasting, frame 4 of 12 without the panel: the panel is 4.0 px"),
            "{lines:?}"
        );
    }

    /// A reading with a high confidence.
    fn reading() -> FrameReading {
        let corners = Corners::new([[6.0, 6.0], [34.0, 6.0], [34.0, 34.0], [6.0, 34.0]]).unwrap();
        let grey = |i: usize| if i % 40 % 8 < 4 { 200 } else { 60 };
        let pixels: Vec<u8> = (0..40 * 40).map(grey).collect();
        let map = CellMap::<2048>::new(&corners, 40, 40).unwrap();
        let features = Features::measure(&Frame::new(&pixels, 40, 40).unwrap(), &map).unwrap();
        let detection = Detector::KMeans.detect(&features).unwrap();
        FrameReading { corners, detection }
    }

    #[test]
    fn a_panel_that_changes_with_every_frame_may_be_too_fast() {
        let advice = |changes_hz| {
            let mut diagnosis = Diagnosis::default();
            (0..60).for_each(|_| diagnosis.count(&Ok(reading())));
            let rates = LinkRates {
                symbols_hz: 27.0,
                fps: 30.0,
                changes_hz: Some(changes_hz),
            };
            diagnosis.lines(&rates, None, true).pop().unwrap()
        };
        let too_fast = "if it shows more than 30 symbols, film faster or lower its symbol rate (`vocc device rate`)";
        assert!(advice(30.0).contains(too_fast), "{}", advice(30.0));
        assert!(!advice(27.0).contains("film faster"), "{}", advice(27.0));
    }

    #[test]
    fn a_panel_behind_a_wiper_is_not_said_to_be_underexposed() {
        let mut diagnosis = Diagnosis::default();
        for number in 0..60 {
            diagnosis.count(&match number % 10 {
                0 => Err(DetectError::Covered { percent: 3 }.into()),
                _ => Ok(reading()),
            });
        }
        let rates = LinkRates {
            symbols_hz: 25.0,
            fps: 30.0,
            changes_hz: None,
        };
        let lines = diagnosis.lines(&rates, None, false);
        assert!(
            lines[0].starts_with("in 6 of 60 frames: the panel shows 3 % of its usual contrast"),
            "{lines:?}"
        );
        assert!(lines[2].starts_with("the panel was covered or dark in 6 of 60 frames"), "{lines:?}");
    }

    #[test]
    fn exposures_of_whole_cycles_are_named() {
        let mut diagnosis = Diagnosis::default();
        let mut reading = reading();
        reading.detection.lights = Some(Lights {
            above_mean: std::array::from_fn(|led| if led % 2 == 0 { 0.01 } else { -0.01 }),
            mean: 0.4,
        });
        (0..60).for_each(|_| diagnosis.count(&Ok(reading)));
        let lines = diagnosis.lines(&USUAL, None, false);
        assert!(
            lines[1].starts_with("all LEDs are lit alike") && lines[1].contains("expose for at most 1/2880 s"),
            "{lines:?}"
        );
    }
}
