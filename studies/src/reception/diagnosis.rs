//! Why no message came, and what would help.

use std::collections::BTreeMap;

use rx_pipeline::camera::Learnt;
use rx_pipeline::receiver::{Loss, Reading};

/// A share of frames that counts as most of them.
const MOST: f32 = 0.7;
/// Readings surer than this on average hold few wrong bits.
const SURE: f32 = 0.98;
/// LEDs nearer to each other than so many standard deviations of the blur run into each other.
const APART: f32 = 2.0;
/// A message of a few words, sent twice over, takes so many symbols about.
const SHORT: usize = 20;

/// What a message was looked for by.
pub struct Gone {
    /// Symbols a second.
    pub symbols_hz: f32,
    /// Frames a second.
    pub fps: f32,
    /// How often the panel was seen to change a second, if that is known.
    pub changes_hz: Option<f32>,
    /// Whether advice may name the command line's options.
    pub has_options: bool,
}

impl Gone {
    /// What may be wrong with them.
    fn doubt(&self) -> String {
        let Self { symbols_hz, fps, .. } = self;
        let seen = self.changes_hz.map_or_else(String::new, |changes| {
            format!("; here the panel changes about {changes:.0} times a second")
        });
        let [symbols, frames] = match self.has_options {
            true => [" (--symbol-rate)", " (--fps)"],
            false => [""; 2],
        };
        format!("are {symbols_hz} symbols a second{symbols} and {fps} frames a second{frames} right? The Pico shows 90 symbols{seen}")
    }
}

/// What frames have shown, counted.
#[derive(Default)]
pub struct Diagnosis {
    read: usize,
    confidence: f32,
    pitch_px: f32,
    rejected: usize,
    /// How often each reason was given, by its beginning, and how it was said last.
    losses: BTreeMap<String, (usize, String)>,
    learnt: Option<Learnt>,
}

impl Diagnosis {
    /// Counts what a frame brought.
    pub fn take(&mut self, reading: &Result<Reading, Loss>) {
        match reading {
            Ok(reading) => {
                self.read += 1;
                self.confidence += reading.detection.confidence;
                self.pitch_px = reading.corners.pitch_px();
            }
            Err(loss) => {
                let said = loss.to_string();
                let kind = said.split([':', ',']).next().unwrap_or_default().to_owned();
                let (count, last) = self.losses.entry(kind).or_default();
                *count += 1;
                *last = said;
            }
        }
    }

    /// Counts a part of a message that could not be decoded.
    pub fn reject(&mut self) {
        self.rejected += 1;
    }

    /// Takes what was learnt of the camera.
    pub fn learn(&mut self, learnt: &Learnt) {
        self.learnt.get_or_insert(*learnt);
    }

    /// What there is to say, a line each.
    pub fn lines(&self, rates: &Gone) -> Vec<String> {
        let lost: usize = self.losses.values().map(|(count, _)| count).sum();
        let frames = lost + self.read;
        let mut lines = Vec::new();
        if let Some((count, said)) = self.losses.values().max_by_key(|(count, _)| *count) {
            lines.push(format!("in {count} of {frames} frames: {said}"));
        }
        if self.read == 0 {
            if frames > 0 {
                let look = match rates.has_options {
                    true => "; look at a frame, and try it with `vocc decode FRAME --corners …`",
                    false => "",
                };
                lines.push(format!(
                    "no panel was found: it is found best where its LEDs are at least 2 px apart, neither white nor black throughout, and \
                     change from frame to frame{look}"
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
        lines.push(self.advice(confidence, frames, rates));
        lines
    }

    fn advice(&self, confidence: f32, frames: usize, rates: &Gone) -> String {
        let blur = self.learnt.map(|learnt| learnt.camera.blur_sigma_px);
        match blur {
            _ if (self.read as f32) < MOST * frames as f32 => {
                "too few of its symbols were seen: keep the panel whole and still in the picture, or make the film longer".to_owned()
            }
            Some(blur) if confidence < SURE && self.pitch_px < APART * blur => {
                format!("the LEDs run into each other under a blur of {blur:.1} px: focus, come nearer, or use a longer lens")
            }
            _ if confidence < SURE => {
                "many bits are unsure: expose longer or brighten the panel where it is noisy, less where it is white".to_owned()
            }
            _ if self.read < SHORT => format!("{} frames hold less than a message: make the film longer", self.read),
            _ if self.rejected > 0 => format!(
                "beginnings of messages were seen, but not read to their end: {}. Else make the film longer",
                rates.doubt()
            ),
            _ => format!(
                "the bits are sure, but no message begins in them: {}. Else see that the picture is neither mirrored nor upside down",
                rates.doubt()
            ),
        }
    }
}
