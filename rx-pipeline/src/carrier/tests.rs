use super::*;
use crate::detect::Lights;
use link::panel::PanelFrame;
use std::vec::Vec;

/// Symbols a frame period.
const SYMBOLS: f64 = 0.55;

/// The bits of a symbol (xorshift).
fn symbol(number: u64) -> u64 {
    (0..3).fold(number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15), |bits, _| {
        let bits = bits ^ bits >> 31;
        bits.wrapping_mul(0xbf58_476d_1ce4_e5b9)
    })
}

/// The detection of a panel at that contrast: its bits, or their complement.
fn seen(bits: u64, contrast: f32) -> Detection {
    let shown = if contrast < 0.0 { !bits } else { bits };
    let llr = core::array::from_fn(|led| if shown >> led & 1 == 1 { 30.0 } else { -30.0f32 } * contrast.abs());
    Detection {
        modulation: 0.4 * contrast.abs(),
        ..Detection::new(PanelFrame::from_bits(shown), llr)
    }
}

fn corners() -> Corners {
    Corners::new([[10.0, 10.0], [52.0, 10.0], [52.0, 52.0], [10.0, 52.0]]).expect("corners")
}

/// For each frame with a clear reading, whether it shows the panel (true) or its complement; `contrast` gives the contrast of a frame by
/// its number.
fn signs(frames: u64, contrast: impl Fn(u64) -> f32) -> Vec<(u64, bool)> {
    let mut carrier = std::boxed::Box::new(Carrier::NONE);
    let mut signs = Vec::new();
    for number in 0..frames {
        let bits = symbol((number as f64 * SYMBOLS) as u64);
        let mut detection = seen(bits, contrast(number));
        carrier.resolve(number, number as f64, &corners(), &mut detection);
        if detection.soft.0.iter().any(|llr| llr.unsigned_abs() > 8) {
            signs.push((number, detection.bits.bits() == bits));
        }
    }
    signs
}

#[test]
fn frames_get_one_sign() {
    for frequency in [0.0013, 0.04, 0.1, 0.2, 0.2497, 0.333, 0.404, 0.4991, 0.5] {
        for phase in [0.05, 0.35, 0.6] {
            let contrast = |number: u64| {
                let cycles = frequency * number as f64 + phase;
                libm::cos(core::f64::consts::TAU * cycles) as f32
            };
            let signs = signs(260, contrast);
            // A slow carrier changes its sign before it is recognised.
            let later: Vec<bool> = signs
                .iter()
                .filter(|(number, _)| *number >= 160)
                .map(|&(_, is_panel)| is_panel)
                .collect();
            let as_panel = later.iter().filter(|&&is_panel| is_panel).count();
            let others = as_panel.min(later.len() - as_panel);
            let is_slow = frequency < 0.01;
            assert!(
                is_slow || later.len() > 60 && others <= 1,
                "{frequency} {phase}: {others} of {}",
                later.len()
            );
        }
    }
}

#[test]
fn still_panels_are_left_as_they_are() {
    let wiper = |number: u64| if number % 30 < 4 { 0.3 } else { 1.0 };
    let fades = |number: u64| 1.0 - 0.7 * (number as f32 / 300.0);
    for contrast in [&(|_| 1.0f32) as &dyn Fn(u64) -> f32, &wiper, &fades] {
        let signs = signs(300, contrast);
        assert!(signs.len() == 300 && signs.iter().all(|&(_, is_panel)| is_panel));
    }
}

#[test]
fn what_is_no_number_is_no_carrier() {
    let mut carrier = std::boxed::Box::new(Carrier::NONE);
    for number in 0..60 {
        let mut detection = seen(symbol(number / 2), if number % 2 == 0 { 1.0 } else { -1.0 });
        detection.modulation = [f32::NAN, f32::INFINITY, 0.0, -1.0][number as usize % 4];
        carrier.resolve(number, number as f64 + 1e9 * (number % 3) as f64, &corners(), &mut detection);
    }
}

/// Readings of a panel whose lines are exposed one after another. `contrast` gives the contrast by frame number and row; `noise` is the
/// amplitude of the noise, relative to full contrast.
fn by_lines(frames: u64, noise: f32, contrast: impl Fn(u64, usize) -> f32) -> Vec<(u64, PanelFrame, u64)> {
    let mut carrier = std::boxed::Box::new(Carrier::NONE);
    let mut state = 1u64;
    (0..frames)
        .map(|number| {
            let bits = symbol((number as f64 * SYMBOLS) as u64);
            let lights = core::array::from_fn(|led| {
                state = symbol(state);
                let noise = noise * ((state >> 40) as f32 / (1 << 23) as f32 - 1.0);
                let sign = if bits >> led & 1 == 1 { 1.0 } else { -1.0 };
                0.3 * (sign * contrast(number, led / 8) + noise)
            });
            let is_shown = |led: usize| (bits >> led & 1 == 1) == (contrast(number, led / 8) >= 0.0);
            let shown = (0..64).fold(0, |shown, led| shown | u64::from(is_shown(led)) << led);
            let mut detection = Detection {
                lights: Some(Lights {
                    above_mean: lights,
                    mean: 0.5,
                }),
                ..seen(shown, 0.01)
            };
            carrier.resolve(number, number as f64, &corners(), &mut detection);
            (number, detection.bits, bits)
        })
        .collect()
}

#[test]
fn rows_of_still_panels_are_left_as_they_are() {
    let shades = |_, row: usize| 1.0 - 0.05 * row as f32;
    for (noise, contrast) in [
        (0.1, &(|_, _| 1.0f32) as &dyn Fn(u64, usize) -> f32),
        (0.8, &|_, _| 1.0),
        (0.3, &shades),
    ] {
        assert!(
            by_lines(100, noise, contrast).iter().all(|(_, read, bits)| read.bits() == *bits),
            "{noise}"
        );
    }
}

/// A carrier seen by a rolling shutter, from the phase of the first row in frame 0 and the cycles per frame and per row.
fn rolling(phase: f64, frequency: f64, slope: f64) -> impl Fn(u64, usize) -> f32 {
    move |number, row| libm::cos(core::f64::consts::TAU * (phase + frequency * number as f64 + slope * row as f64)) as f32
}

/// Soft values are no surer than the sign, neither when the carrier has just been found nor next to a blind phase.
#[test]
fn no_bit_is_surer_than_the_sign() {
    let contrast = rolling(0.05, 0.2497, 0.0);
    let mut carrier = std::boxed::Box::new(Carrier::NONE);
    let (mut is_first, mut next_to_blind) = (true, 0);
    for number in 0..300 {
        let mut detection = Detection {
            modulation: 0.4 * contrast(number, 0).abs(),
            ..seen(symbol((number as f64 * SYMBOLS) as u64), 1.0f32.copysign(contrast(number, 0)))
        };
        carrier.resolve(number, number as f64, &corners(), &mut detection);
        let Some(fit) = carrier.fit else { continue };
        let surest = detection.soft.0.iter().map(|llr| llr.unsigned_abs()).max().expect("LEDs");
        if core::mem::take(&mut is_first) {
            assert!(f32::from(surest) * link::panel::LLR_STEP <= fit.sure && surest > 0, "{surest}");
        }
        if (0.01..0.12).contains(&fit.contrast_at(number as f64).abs()) {
            next_to_blind += 1;
            assert!(surest < 100, "{number}: {surest}");
        }
    }
    assert!(!is_first && next_to_blind > 0);
}

/// Rows that are inverted by a carrier in step with the frames.
#[test]
fn rows_in_step_are_told_by_sync_panels() {
    const INVERTED: u64 = 0x00ff_ff00_00ff_ff00;
    for inverted in [INVERTED, 0] {
        let mut carrier = std::boxed::Box::new(Carrier::NONE);
        let mut right = 0;
        for number in 0..120 {
            let index = number / 2;
            let bits = if index % 8 == 0 {
                link::framing::SYNC_SEEN[0].bits()
            } else {
                symbol(index)
            };
            let mut detection = seen(bits ^ inverted, 1.0);
            carrier.resolve(number, number as f64, &corners(), &mut detection);
            right += u32::from(number >= 60 && [bits, !bits].contains(&detection.bits.bits()));
        }
        assert_eq!(right, 60, "{inverted:x}");
    }
}
