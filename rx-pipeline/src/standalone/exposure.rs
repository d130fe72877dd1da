//! How long to expose, by what the frames show: LEDs below white, and what is around them as far above black as that allows.
//!
//! The sensor's grey levels are linear in light, so that one frame tells how much more or less light the next one should get. While a panel
//! is followed its own pixels count. While one is looked for nobody knows where it is, and how bright: then the whole frame's mean counts,
//! and a few shorter exposures are taken in turn, in one of which the LEDs are not white.

use crate::corners::Corners;
use crate::frame::Frame;
use crate::hm01b0::{BLACK_GREY, Exposure, LEAST_LINES, Mode};

/// Where the brightest pixels of a followed panel are meant to be, grey levels.
const BRIGHT: u32 = 200;
/// From here on pixels count as white: how much light there is they do not tell.
const WHITE: u8 = 250;
/// Where a searched frame's mean is meant to be, grey levels.
const MEAN: u32 = 56;
/// Light by this ratio off, in 1/256, is left as it is: each change costs a frame's levels.
const DEAD_BAND: (u32, u32) = (205, 320);
/// The most that the light changes at once.
const STEP_MAX: u32 = 4;
/// How much shorter than by the mean the exposures of a search are, one after another, as powers of 2.
const BRACKETS: [u32; 4] = [0, 2, 4, 1];
/// Frames in which a bracket is tried: after those that show the change, as many as LEDs need to blink.
pub const BRACKET_FRAMES: u32 = 20;
/// Of the pixels of a panel as many are brighter than its bright ones, a hundredth.
const BRIGHTER: usize = 100;
/// Of the pixels of a panel as many are darker than its dark ones, a tenth.
const DARKER: usize = 10;
/// Pixels that a panel's levels are taken from, about.
const SAMPLES: usize = 2048;

/// How bright a part of a frame is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    /// Grey level that a hundredth of the pixels are above.
    pub bright: u8,
    /// Grey level that a tenth of the pixels are below.
    pub dark: u8,
    /// Mean grey level.
    pub mean: u8,
}

impl Levels {
    /// Of a whole frame, by some of its pixels.
    pub fn of_frame(frame: &Frame<'_>) -> Self {
        Self::of(frame, [0, 0], [frame.width(), frame.height()])
    }

    /// Of the panel at `corners`, by the pixels in its upright outline, half a pitch around the LEDs; of the whole frame where the panel is
    /// not in it.
    pub fn of_panel(frame: &Frame<'_>, corners: &Corners) -> Self {
        let margin = 0.5 * corners.pitch_px();
        let points = corners.points();
        let bound = |axis: usize, size: usize| {
            let (low, high) = points.iter().fold((f32::MAX, f32::MIN), |(low, high), point| {
                (low.min(point[axis]), high.max(point[axis]))
            });
            let from = ((low - margin).max(0.0) as usize).min(size);
            (from, ((high + margin + 1.0).max(0.0) as usize).clamp(from, size))
        };
        let ((left, right), (top, bottom)) = (bound(0, frame.width()), bound(1, frame.height()));
        if right - left < 4 || bottom - top < 4 {
            return Self::of_frame(frame);
        }
        Self::of(frame, [left, top], [right - left, bottom - top])
    }

    fn of(frame: &Frame<'_>, [left, top]: [usize; 2], [width, height]: [usize; 2]) -> Self {
        let mut histogram = [0u16; 256];
        // Of large parts every second, third … pixel along both axes.
        let step = (1..).find(|step| width * height / (step * step) <= SAMPLES);
        let step = step.unwrap_or(1);
        let (mut count, mut sum) = (0usize, 0u32);
        for y in (top..top + height).step_by(step) {
            let row = frame.row(y).unwrap_or(&[]);
            for &grey in row.iter().skip(left).take(width).step_by(step) {
                histogram[usize::from(grey)] += 1;
                sum += u32::from(grey);
                count += 1;
            }
        }
        let below = |share: usize| {
            let mut passed = 0;
            let grey = histogram.iter().position(|&here| {
                passed += usize::from(here);
                passed > share
            });
            grey.unwrap_or(usize::from(u8::MAX)) as u8
        };
        Self {
            bright: below(count - count / BRIGHTER - count.min(1)),
            dark: below(count / DARKER),
            mean: (sum / count.max(1) as u32) as u8,
        }
    }
}

/// The exposure for the frames to come, while a panel of those levels is followed; the same one where there is nothing to mend.
pub fn for_panel(now: Exposure, levels: Levels, mode: Mode) -> Exposure {
    if levels.bright >= WHITE {
        return of_sensitivity(now.sensitivity() / 2, mode);
    }
    let light = u32::from(levels.bright.saturating_sub(BLACK_GREY)).max(1);
    adjusted(now, BRIGHT - u32::from(BLACK_GREY), light, mode)
}

/// The exposure for the frames to come, while a panel is looked for: by the mean, and in turn shorter ones.
///
/// `by_mean` is what the mean alone would ask for, and goes on with each call; `turn` counts brackets.
pub fn for_search(by_mean: &mut Exposure, now: Exposure, levels: Levels, turn: u32, mode: Mode) -> Exposure {
    let light = u32::from(levels.mean.saturating_sub(BLACK_GREY)).max(1);
    // What the mean would be by the exposure that it asks for, which this frame may not have had.
    let in_mean = (light * by_mean.sensitivity() / now.sensitivity().max(1)).max(1);
    *by_mean = adjusted(*by_mean, MEAN - u32::from(BLACK_GREY), in_mean, mode);
    let shorter = BRACKETS[turn as usize % BRACKETS.len()];
    of_sensitivity(rounded(by_mean.sensitivity(), 1 << shorter), mode)
}

fn adjusted(now: Exposure, wanted: u32, light: u32, mode: Mode) -> Exposure {
    let ratio = (wanted * 256 / light).clamp(256 / STEP_MAX, 256 * STEP_MAX);
    if (DEAD_BAND.0..=DEAD_BAND.1).contains(&ratio) {
        return now;
    }
    of_sensitivity(rounded(now.sensitivity() * ratio, 256), mode)
}

/// Of two or three lines half a line is a quarter of the light.
const fn rounded(numerator: u32, denominator: u32) -> u32 {
    (numerator + denominator / 2) / denominator
}

/// The longest exposure that leaves symbols whole: a quarter of the time between frames.
const fn most_lines(mode: Mode) -> u16 {
    let quarter = mode.frame_lines / 4;
    if quarter < mode.most_lines() { quarter } else { mode.most_lines() }
}

/// The exposure of that sensitivity, in lines at gain 1: as long as may be before gain is used.
pub fn of_sensitivity(sensitivity: u32, mode: Mode) -> Exposure {
    let most = u32::from(most_lines(mode));
    let gain_log2 = (0..Exposure::GAIN_MAX)
        .find(|&gain| sensitivity >> gain <= most)
        .unwrap_or(Exposure::GAIN_MAX);
    let lines = (sensitivity >> gain_log2).clamp(LEAST_LINES.into(), most);
    Exposure {
        lines: lines as u16,
        gain_log2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    /// What a linear sensor shows of light that it would give `full` grey levels a line.
    fn grey(light: f64, exposure: Exposure) -> u8 {
        (f64::from(BLACK_GREY) + light * f64::from(exposure.sensitivity())) as u8
    }

    fn settled(led: f64, background: f64, mut exposure: Exposure, mode: Mode) -> (Exposure, Levels) {
        let mut levels = Levels::default();
        for _ in 0..16 {
            levels = Levels {
                bright: grey(led, exposure),
                dark: grey(background, exposure),
                mean: 0,
            };
            exposure = for_panel(exposure, levels, mode);
        }
        (exposure, levels)
    }

    properties! {
        /// Wherever the sensor can do it, LEDs end up below white and well above black, from any exposure, and stay.
        #[test]
        fn leds_come_below_white(log_light in -3.5..3.0f64, start in 2u32..2128, ratio in 0.0..1.0f64) {
            for mode in [Mode::QVGA, Mode::BINNED] {
                let led = log_light.exp2();
                let longest = of_sensitivity(u32::MAX >> 8, mode).sensitivity();
                let needed = 150.0 / led;
                prop_assume!(needed >= f64::from(LEAST_LINES) * 4.0 && needed <= f64::from(longest) / 1.5);
                let (exposure, levels) = settled(led, led * ratio, of_sensitivity(start, mode), mode);
                prop_assert!((140..WHITE).contains(&levels.bright), "{exposure:?} {levels:?}");
                prop_assert_eq!(for_panel(exposure, levels, mode), exposure);
            }
        }

        /// Any sensitivity becomes an exposure that the sensor takes.
        #[test]
        fn exposures_are_possible(sensitivity in 0u32..1 << 24) {
            for mode in [Mode::QVGA, Mode::BINNED] {
                let exposure = of_sensitivity(sensitivity, mode);
                prop_assert!(exposure.lines >= LEAST_LINES && exposure.lines <= mode.most_lines());
                prop_assert!(exposure.gain_log2 <= Exposure::GAIN_MAX);
            }
        }
    }

    /// As near as whole lines come, in the brightest light, too: half a line of two and a half, and as much by the dead band.
    #[test]
    fn the_shortest_exposures_are_the_nearest() {
        for needed in (20..=100).map(|tenths| f64::from(tenths) / 10.0) {
            let led = f64::from(BRIGHT - u32::from(BLACK_GREY)) / needed;
            for start in [2, 3, 4, 8, 16] {
                let (exposure, _) = settled(led, 0.0, of_sensitivity(start, Mode::QVGA), Mode::QVGA);
                let light = f64::from(exposure.sensitivity()) / needed;
                assert!((0.79..1.26).contains(&light), "{needed} lines wanted from {start}: {exposure:?}");
            }
        }
    }

    /// One of a search's brackets shows LEDs that are brighter than the frame's mean by any ratio up to 60 below white, and above black.
    #[test]
    fn a_bracket_fits_leds_that_are_brighter_than_all_else() {
        for brighter in [1.5, 4.0, 12.0, 40.0, 60.0] {
            let ground = 0.2;
            let (mut by_mean, mut exposure) = (of_sensitivity(500, Mode::QVGA), of_sensitivity(500, Mode::QVGA));
            let mut fits = false;
            for frame in 0..12 * BRACKET_FRAMES {
                let levels = Levels {
                    mean: grey(ground, exposure),
                    ..Levels::default()
                };
                let led = grey(brighter * ground, exposure);
                fits |= frame > 2 * BRACKET_FRAMES && (60..WHITE).contains(&led);
                exposure = for_search(&mut by_mean, exposure, levels, frame / BRACKET_FRAMES, Mode::QVGA);
            }
            assert!(fits, "{brighter}");
        }
    }

    #[test]
    fn levels_are_those_of_the_panel() {
        let pixels: std::vec::Vec<u8> = (0..100 * 80)
            .map(|i| match (i % 100, i / 100) {
                (30..60, 20..50) if i % 5 == 0 => 180,
                (30..60, 20..50) => 20,
                _ => 255,
            })
            .collect();
        let frame = Frame::new(&pixels, 100, 80).unwrap();
        let corners = Corners::new([[32.0, 22.0], [57.0, 22.0], [57.0, 47.0], [32.0, 47.0]]).unwrap();
        let levels = Levels::of_panel(&frame, &corners);
        assert_eq!((levels.bright, levels.dark), (180, 20));
        assert_eq!(Levels::of_frame(&frame).bright, 255);
    }
}
