//! Soft values at their limits, and code words of which no bit or every bit is certain.

use labrador_ldpc::LDPCCode;
use link::camera::Camera;
use link::fec::{Block, Code, Decoder, Undecodable, combine};
use link::panel::{LEDS, Llr, PanelFrame, SoftPanel};
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::{Detection, Detector};
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::MaximumLikelihood;

use crate::synthetic::{features, spread};

fn assert_sound(detection: &Detection, what: &str) {
    let is_sound = (0.5..=1.0).contains(&detection.confidence);
    assert!(is_sound, "{what}: confidence {}", detection.confidence);
    // −128 cannot be negated.
    let within = detection.soft.0.iter().all(|&llr| llr != Llr::MIN);
    assert!(within, "{what}: {:?}", detection.soft);
}

#[test]
fn the_soft_values_of_any_features_are_within_their_range() {
    // Log-odds computed from probabilities are limited to 17 nats in f32: beyond, 1 − p is 0.
    let log_odds = |llr: f32| {
        let p = 1.0 / (1.0 + (-llr).exp());
        (p / (1.0 - p)).ln()
    };
    assert!(log_odds(20.0).is_infinite() && log_odds(10.0).is_finite());
    let huge = [0.0, 1e-38, 1.0, 1e4, 1e15, 1e19, 1e30, f32::MAX, f32::INFINITY, f32::NAN];
    for agr in huge {
        for gri in huge {
            for sign in [1.0, -1.0] {
                let on = |led: usize| f32::from(u8::from(led.is_multiple_of(3)));
                let panel = features(
                    |led| agr * (on(led) + 0.01 * spread(led, 0.618_034)),
                    |led| sign * gri * (on(led) + 0.01 * spread(led, 0.754_878)),
                );
                for detector in [Detector::KMeans, Detector::KMeansRaw, Detector::Otsu] {
                    if let Ok(detection) = detector.detect(&panel) {
                        assert_sound(&detection, &format!("AGR {agr}, GRI {gri}, {detector:?}"));
                    }
                }
            }
        }
    }
}

const SIDE: usize = 48;

/// A frame from a function of position.
fn pixels(grey: impl Fn(usize, usize) -> u8) -> Vec<u8> {
    (0..SIDE * SIDE).map(|at| grey(at % SIDE, at / SIDE)).collect()
}

#[test]
fn the_soft_values_of_any_frame_are_within_their_range() {
    let corners = Corners::new([[8.0, 8.0], [36.0, 8.0], [36.0, 36.0], [8.0, 36.0]]).expect("a panel");
    let near = |x: usize, y: usize| x.wrapping_sub(8) % 8 < 2 && y.wrapping_sub(8) % 4 < 2;
    let random = |x: usize, y: usize| (128.0 + 127.0 * spread(SIDE * y + x, 0.618_034)) as u8;
    let frames: [(&str, Vec<u8>); 8] = [
        ("black", pixels(|_, _| 0)),
        ("white", pixels(|_, _| 255)),
        ("grey", pixels(|_, _| 118)),
        ("one pixel white", pixels(|x, y| if (x, y) == (8, 8) { 255 } else { 0 })),
        ("all but one pixel white", pixels(|x, y| if (x, y) == (8, 8) { 0 } else { 255 })),
        ("black and white", pixels(|x, y| if near(x, y) { 255 } else { 0 })),
        ("white and black", pixels(|x, y| if near(x, y) { 0 } else { 255 })),
        ("random", pixels(random)),
    ];
    let mut detector = Box::new(MaximumLikelihood::<4096>::new(Camera::default()));
    let read_noises = [0.0, 3.0, 1e6].map(|read_noise_e| Camera {
        read_noise_e,
        ..Camera::default()
    });
    // Receivers reject such blurs; the detector alone must tolerate them.
    let blurs = [0.0, 20.0, 1e30, f32::INFINITY, f32::NAN].map(|blur_sigma_px| Camera {
        blur_sigma_px,
        ..Camera::default()
    });
    for camera in read_noises.into_iter().chain(blurs) {
        detector.prepare(camera);
        for (name, pixels) in &frames {
            let frame = Frame::new(pixels, SIDE, SIDE).expect("a frame");
            // Twice: estimates from the first frame must not harm the second.
            for _ in 0..2 {
                if let Ok(detection) = detector.detect(&frame, &corners) {
                    assert_sound(&detection, name);
                }
            }
        }
    }
}

#[test]
fn added_soft_values_saturate_instead_of_changing_sides() {
    let sure = |llr: Llr| SoftPanel([llr; LEDS]);
    assert_eq!(100i8.wrapping_add(100), -56, "a sum that wraps says Off");
    for (one, other, sum) in [
        (100, 100, 127),
        (-100, -100, -127),
        (127, 127, 127),
        (-128, -128, -127),
        (127, -127, 0),
        (127, -128, -1),
    ] {
        let mut panel = sure(one);
        combine(&mut panel, &sure(other));
        assert_eq!(panel, sure(sum), "{one} and {other}");
    }
}

#[test]
fn what_was_not_received_is_not_read_as_a_message_of_zeros() {
    // All ratios are 0: every parity check holds, and the decoder succeeds.
    let code = LDPCCode::TC128;
    let (mut output, mut signs) = ([1; 32], [0; 64]);
    let mut working = [0i8; LDPCCode::TC128.decode_ms_working_len()];
    let (found, _) = code.decode_ms(
        &[0i8; 128],
        &mut output[..code.output_len()],
        &mut working,
        &mut signs[..code.decode_ms_working_u8_len()],
        20,
    );
    assert!(found && output[..8] == [0; 8], "found {found}: {output:?}");
    let mut decoder = Decoder::new();
    for code in Code::ALL {
        for length in [1, code.info_bytes()] {
            let block = Block::new(code, length);
            let nothing = vec![SoftPanel::ERASED; block.panels()];
            for panels in [&nothing[..], &[]] {
                let refusal = decoder.decode(block, panels);
                assert!(matches!(refusal, Err(Undecodable::TooFewBits { .. })), "{code}");
            }
        }
    }
}

/// Min-sum decoding adds messages between nodes in eight bits: they must not wrap.
#[test]
fn certain_code_words_decode_and_certain_nonsense_is_refused() {
    assert!([127i8; 4].iter().fold(0i8, |sum, llr| sum.wrapping_add(*llr)) < 0);
    let mut decoder = Decoder::new();
    // Full blocks, and short ones with mostly known zero bits.
    let lengths = Code::ALL.map(|code| [(code, code.info_bytes()), (code, 5)]);
    for (code, length) in lengths.into_iter().flatten() {
        let block = Block::new(code, length);
        let info: Vec<u8> = (0..length).map(|k| (k * 151 + 7) as u8).collect();
        for llr in [1, 12, Llr::MAX] {
            let mut panels: Vec<SoftPanel> = block.encode(&info).map(|panel| SoftPanel::certain(panel, llr)).collect();
            // One bit in a hundred is wrong, as certain as the others.
            for error in 0..panels.len() * LEDS / 100 {
                let led = (error * 97 + 13) % (panels.len() * LEDS);
                panels[led / LEDS].0[led % LEDS] *= -1;
            }
            assert_eq!(decoder.decode(block, &panels), Ok(&info[..]), "{code} at {llr}");
        }
        // −128 never comes from a receiver, but may come from a file.
        let mut lowest: Vec<SoftPanel> = block.encode(&info).map(|panel| SoftPanel::certain(panel, Llr::MAX)).collect();
        let values = lowest.iter_mut().flat_map(|panel| &mut panel.0);
        values.filter(|llr| **llr < 0).for_each(|llr| *llr = Llr::MIN);
        assert_eq!(decoder.decode(block, &lowest), Ok(&info[..]), "{code}");
        // All Off is a code word; random certain bits are not.
        let off = vec![SoftPanel([-Llr::MAX; LEDS]); block.panels()];
        assert_eq!(decoder.decode(block, &off), Ok(&vec![0; info.len()][..]), "{code}");
        let nonsense: Vec<SoftPanel> = (0..block.panels() as u64)
            .map(|k| PanelFrame::from_bits((k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)))
            .map(|panel| SoftPanel::certain(panel, Llr::MAX))
            .collect();
        assert_eq!(decoder.decode(block, &nonsense), Err(Undecodable::NoCodeword), "{code}");
    }
}
