//! Control of the exposure: LEDs below white, and their surroundings as far above black as that allows.
//!
//! The sensor's grey levels are linear in light, so one frame gives the factor for the next one's exposure. While a panel is followed, its
//! own pixels count. During a search the panel's place and brightness are unknown. The whole frame's mean counts then, and a few shorter
//! exposures take turns, so that the LEDs are not white in one of them.

use super::camera::{CameraMode, Exposure};
use crate::corners::Corners;
use crate::frame::Frame;

/// The target of a followed panel's brightest pixels, grey levels.
const BRIGHT: u32 = 200;
/// The grey level from which on pixels count as white and do not show the amount of light.
const WHITE: u8 = 250;
/// The target of a searched frame's mean, grey levels.
pub(super) const MEAN: u32 = 56;
/// The range of factors that cause no change, in 1/256, because each change spoils a frame's levels.
const DEAD_BAND: (u32, u32) = (205, 320);
/// The greatest factor of a single change.
const STEP_MAX: u32 = 4;
/// Successive reductions of a search's exposure relative to the mean's, as powers of 2.
const BRACKETS: [u32; 4] = [0, 2, 4, 1];
/// Frames per bracket: those until the change shows, and as many as LEDs need to blink.
pub const BRACKET_FRAMES: u32 = 20;
/// The part of a panel's pixels that may be brighter than its bright level: a hundredth.
const BRIGHTER: usize = 100;
/// The part of a panel's pixels that may be darker than its dark level: a tenth.
const DARKER: usize = 10;
/// Pixels that determine a panel's levels, approximately.
const SAMPLES: usize = 2048;

/// The brightness of a part of a frame.
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
    /// Levels of a whole frame, from some of its pixels.
    pub fn of_frame(frame: &Frame<'_>) -> Self {
        Self::of(frame, [0, 0], [frame.width(), frame.height()])
    }

    /// Levels of the panel at `corners`, from the pixels in its upright outline, half a pitch around the LEDs; of the whole frame if the
    /// panel is not in it.
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
        // In large parts, every second, third … pixel along both axes.
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

/// The next exposure while a panel with those levels is followed; the same one if no change is needed.
pub fn for_panel(now: Exposure, levels: Levels, mode: &CameraMode) -> Exposure {
    if levels.bright >= WHITE {
        return of_sensitivity(now.sensitivity() / 2, mode);
    }
    let light = u32::from(levels.bright.saturating_sub(mode.black_grey)).max(1);
    adjusted(now, above_black(BRIGHT, mode), light, mode)
}

/// The next exposure during a search: by the mean, and shorter ones in turn.
///
/// `by_mean` is the exposure for the mean alone, and is updated by each call; `turn` counts brackets.
pub fn for_search(by_mean: &mut Exposure, now: Exposure, levels: Levels, turn: u32, mode: &CameraMode) -> Exposure {
    let light = u32::from(levels.mean.saturating_sub(mode.black_grey)).max(1);
    // The mean at the exposure `by_mean`, which this frame may not have had.
    let in_mean = (light * by_mean.sensitivity() / now.sensitivity().max(1)).max(1);
    *by_mean = adjusted(*by_mean, above_black(MEAN, mode), in_mean, mode);
    let shorter = BRACKETS[turn as usize % BRACKETS.len()];
    of_sensitivity(rounded(by_mean.sensitivity(), 1 << shorter), mode)
}

/// The light of a grey level, in grey levels.
fn above_black(grey: u32, mode: &CameraMode) -> u32 {
    grey.saturating_sub(mode.black_grey.into())
}

fn adjusted(now: Exposure, wanted: u32, light: u32, mode: &CameraMode) -> Exposure {
    let ratio = (wanted * 256 / light).clamp(256 / STEP_MAX, 256 * STEP_MAX);
    if (DEAD_BAND.0..=DEAD_BAND.1).contains(&ratio) {
        return now;
    }
    of_sensitivity(rounded(now.sensitivity() * ratio, 256), mode)
}

/// Rounded, because half a line of two or three is a quarter of the light.
const fn rounded(numerator: u32, denominator: u32) -> u32 {
    (numerator + denominator / 2) / denominator
}

/// The exposure of that sensitivity, in lines at gain 1: the longest allowed one before gain.
pub fn of_sensitivity(sensitivity: u32, mode: &CameraMode) -> Exposure {
    let most = u32::from(mode.longest_lines());
    let gain_log2 = (0..mode.most_gain_log2)
        .find(|&gain| sensitivity >> gain <= most)
        .unwrap_or(mode.most_gain_log2);
    let lines = (sensitivity >> gain_log2).min(most).max(mode.least_lines.into());
    Exposure {
        lines: lines as u16,
        gain_log2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::standalone::tests::{BINNED, OTHER, QVGA};
    use properties::prelude::*;

    /// The grey level of a linear sensor for light of `full` grey levels a line.
    fn grey(light: f64, exposure: Exposure, mode: &CameraMode) -> u8 {
        (f64::from(mode.black_grey) + light * f64::from(exposure.sensitivity())) as u8
    }

    fn settled(led: f64, background: f64, mut exposure: Exposure, mode: &CameraMode) -> (Exposure, Levels) {
        let mut levels = Levels::default();
        for _ in 0..16 {
            levels = Levels {
                bright: grey(led, exposure, mode),
                dark: grey(background, exposure, mode),
                mean: 0,
            };
            exposure = for_panel(exposure, levels, mode);
        }
        (exposure, levels)
    }

    properties! {
        /// Within the sensor's range, LEDs end up below white and well above black, from any exposure, and stay.
        #[test]
        fn leds_come_below_white(log_light in -3.5..3.0f64, start in 2u32..2128, ratio in 0.0..1.0f64) {
            for mode in [&QVGA, &BINNED, &OTHER] {
                let led = log_light.exp2();
                let longest = of_sensitivity(u32::MAX >> 8, mode).sensitivity();
                let needed = 150.0 / led;
                prop_assume!(needed >= f64::from(mode.least_lines) * 4.0 && needed <= f64::from(longest) / 1.5);
                let (exposure, levels) = settled(led, led * ratio, of_sensitivity(start, mode), mode);
                prop_assert!((140..WHITE).contains(&levels.bright), "{exposure:?} {levels:?}");
                prop_assert_eq!(for_panel(exposure, levels, mode), exposure);
            }
        }

        /// Any sensitivity becomes an exposure within the sensor's range.
        #[test]
        fn exposures_are_possible(sensitivity in 0u32..1 << 24) {
            for mode in [&QVGA, &BINNED, &OTHER] {
                let exposure = of_sensitivity(sensitivity, mode);
                prop_assert!(exposure.lines >= mode.least_lines && exposure.lines <= mode.most_lines);
                prop_assert!(exposure.gain_log2 <= mode.most_gain_log2);
            }
        }
    }

    /// As close as whole lines allow, in the brightest light, too: half a line of two and a half, and as much by the dead band.
    #[test]
    fn the_shortest_exposures_are_the_nearest() {
        for needed in (20..=100).map(|tenths| f64::from(tenths) / 10.0) {
            let led = f64::from(above_black(BRIGHT, &QVGA)) / needed;
            for start in [2, 3, 4, 8, 16] {
                let (exposure, _) = settled(led, 0.0, of_sensitivity(start, &QVGA), &QVGA);
                let light = f64::from(exposure.sensitivity()) / needed;
                assert!((0.79..1.26).contains(&light), "{needed} lines wanted from {start}: {exposure:?}");
            }
        }
    }

    /// For LEDs up to 60 times as bright as the frame's mean, one of a search's brackets shows them below white and above black.
    #[test]
    fn a_bracket_fits_leds_that_are_brighter_than_all_else() {
        for brighter in [1.5, 4.0, 12.0, 40.0, 60.0] {
            let ground = 0.2;
            let (mut by_mean, mut exposure) = (of_sensitivity(500, &QVGA), of_sensitivity(500, &QVGA));
            let mut fits = false;
            for frame in 0..12 * BRACKET_FRAMES {
                let levels = Levels {
                    mean: grey(ground, exposure, &QVGA),
                    ..Levels::default()
                };
                let led = grey(brighter * ground, exposure, &QVGA);
                fits |= frame > 2 * BRACKET_FRAMES && (60..WHITE).contains(&led);
                exposure = for_search(&mut by_mean, exposure, levels, frame / BRACKET_FRAMES, &QVGA);
            }
            assert!(fits, "{brighter}");
        }
    }

    /// Only the light above the camera's own black level counts, and its own limits apply.
    #[test]
    fn another_camera_has_its_own_black_level_and_limits() {
        let now = Exposure { lines: 10, gain_log2: 0 };
        // A quarter of the light that is wanted.
        let [bright, mean] = [BRIGHT, MEAN].map(|wanted| OTHER.black_grey + (above_black(wanted, &OTHER) / 4) as u8);
        let levels = Levels { bright, dark: 0, mean };
        let four_times = Exposure { lines: 40, gain_log2: 0 };
        assert_eq!(for_panel(now, levels, &OTHER), four_times);
        assert_eq!(for_search(&mut now.clone(), now, levels, 0, &OTHER), four_times);
        let limits = [0, 1 << 20].map(|sensitivity| of_sensitivity(sensitivity, &OTHER));
        let expected = [(4, 0), (160, 2)].map(|(lines, gain_log2)| Exposure { lines, gain_log2 });
        assert_eq!(limits, expected);
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
