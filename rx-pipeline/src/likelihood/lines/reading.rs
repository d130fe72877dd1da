//! Frames that show two symbols, read row by row.

use super::split::split;
use super::{LineDelay, Rows};
use crate::detect::{DetectError, Detection, Mixture, correlation, soft_panel};
use crate::frame::Frame;
use crate::likelihood::MaximumLikelihood;
use crate::likelihood::crop::Crop;
use crate::likelihood::experience::Experience;
use crate::likelihood::mixture::TwoSymbols;
use crate::symbols::REPEAT_CORRELATION;
use link::panel::{LEDS, SoftPanel};

impl<const PIXELS: usize> MaximumLikelihood<PIXELS> {
    /// The two symbols of a frame that leaves `noise` as one symbol: by a change that all lines saw at once, or line by line if that
    /// explains the frame better.
    // Not inlined: it would grow the stack of all reading code.
    #[inline(never)]
    pub(in crate::likelihood) fn explained(
        &mut self,
        at_once: Option<TwoSymbols>,
        frame: &Frame<'_>,
        crop: &Crop,
        before: &SoftPanel,
        noise: f32,
    ) -> Result<Option<Detection>, DetectError> {
        let Experience { levels, line_delay, .. } = self.experience;
        let rows = self.model.rows(crop);
        let are_at_once = line_delay.is_at_once(&rows);
        // Successive symbols differ: if the second equals the first, no change happened, and another row changed.
        let is_change = |beginning: &[f32; LEDS]| !is_repeated(beginning, before);
        let at_once = at_once.filter(|two| {
            let explain = two.explain(&levels, before, noise);
            explain && (are_at_once || is_change(&two.beginning))
        });
        let is_explained = at_once
            .as_ref()
            .is_some_and(|two| levels.fits_surely(two.noise) && line_delay.known().unwrap_or(0.0) == 0.0);
        if is_explained || are_at_once {
            return Ok(self.read_at_once(at_once, &rows));
        }
        let mut find = |delay: &LineDelay| {
            let model = &mut self.model;
            let found = model.two_symbols_by_lines(frame, crop, before, &levels, delay)?;
            Ok(found.filter(|two| two.explain_by_rows(&levels, before, noise) && is_change(&two.beginning)))
        };
        let (mut delay, mut by_lines) = (line_delay, find(&line_delay)?);
        if delay.known().is_some() && by_lines.is_none() && at_once.is_none() {
            // The known delay may be wrong.
            delay = LineDelay::UNKNOWN;
            by_lines = find(&delay)?;
        }
        let better = |by_lines: &TwoSymbols<_>| at_once.as_ref().is_none_or(|two| by_lines.explain_better_than(two));
        if let Some(two) = by_lines.filter(better) {
            delay.add_slope(two.share.slope, two.share.precision, &rows);
            delay.read_two();
            self.experience.line_delay = delay;
            return Ok(Some(two.detection()));
        }
        Ok(self.read_at_once(at_once, &rows))
    }

    /// The reading of a change that all lines saw at once, if it was one.
    fn read_at_once(&mut self, two: Option<TwoSymbols>, rows: &Rows) -> Option<Detection> {
        let two = two?;
        self.experience.line_delay.saw_at_once(rows);
        Some(two.detection())
    }

    /// The reading that leaves `noise`; with two separate symbols if it shows one above a line and another below.
    #[inline(never)]
    pub(in crate::likelihood) fn split(&mut self, detection: Detection, crop: &Crop, before: &SoftPanel, noise: f32) -> Detection {
        let rows = self.model.rows(crop);
        let Experience { levels, line_delay, .. } = &mut self.experience;
        let is_clear = levels.fits(noise);
        let Some(split) = split(detection.bits, before, noise, line_delay, &rows) else {
            return detection;
        };
        let of = |is_ended: bool| {
            SoftPanel(core::array::from_fn(|led| {
                // A row caught by the change itself is ambiguous.
                let is_caught = !is_clear && split.is_beside(led, &rows);
                if split.ended.led(led) == is_ended && !is_caught {
                    detection.soft.0[led]
                } else {
                    0
                }
            }))
        };
        Detection {
            mixed: Some(Mixture {
                share: split.middle(),
                growth: split.growth(&rows),
                ending: of(true),
                beginning: of(false),
            }),
            ..detection
        }
    }
}

/// Whether a symbol that begins seems to be the one `before`.
fn is_repeated(beginning: &[f32; LEDS], before: &SoftPanel) -> bool {
    correlation(&soft_panel(beginning), before) >= REPEAT_CORRELATION
}
