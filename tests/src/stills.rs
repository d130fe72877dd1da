//! Single pictures of a panel, drawn without the simulator, and how often their bits are right where they are stated to be.

use std::ops::Range;

use link::camera::Camera;
use link::panel::{LEDS, SIDE};
use reception::still::StillDecoder;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Method;
use rx_pipeline::frame::Frame;

use crate::shake::{Drawing, Film, Light, Shake};

/// LEDs at the corners.
const CORNERS: [usize; 4] = [0, SIDE - 1, LEDS - 1, LEDS - SIDE];
/// Wrong bits from which a panel is wrong: a tenth, as in `tests/tools/other-cameras`.
const WRONG_BITS: u32 = 7;
/// Confidence from which a reading counts as sure.
const SURE: f32 = 0.99;
/// Pitches of the panels (count).
const PITCHES: usize = 6;
/// Corners that are not the panel's: columns and rows by which each differs.
const DISTURBED: [[[f64; 2]; 4]; 6] = [
    // A column beside, a row beside, half a line beside.
    [[1.0, 0.0]; 4],
    [[0.0, -1.0]; 4],
    [[0.5, 0.5]; 4],
    // One corner off, a column wider, the inner LEDs.
    [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
    [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 0.0]],
    [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]],
];

/// Readings of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Pictures with a reading.
    pub read: usize,
    /// Readings that are stated to be sure.
    pub sure: usize,
    /// Of those, the wrong ones.
    pub wrong: usize,
}

impl Tally {
    fn add(&mut self, confidence: f32, wrong_bits: u32) {
        let is_sure = confidence >= SURE;
        self.read += 1;
        self.sure += usize::from(is_sure);
        self.wrong += usize::from(is_sure && wrong_bits >= WRONG_BITS);
    }
}

/// Readings of a set of pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reliability {
    /// Of panels that a search finds.
    pub found: Tally,
    /// At the panel's corners.
    pub at_corners: Tally,
    /// At other corners.
    pub disturbed: Tally,
}

/// Reads a picture for each seed, as `vocc decode` does: where a panel is found, at its corners, and at others.
pub fn reliability(seeds: Range<u64>) -> Reliability {
    let mut decoder = StillDecoder::new(Method::MaximumLikelihood);
    let mut sum = Reliability::default();
    for seed in seeds {
        let film = Film {
            seed,
            // From the smallest LEDs that are read to large ones.
            pitch_px: 3.5 * 1.3_f64.powi((seed % PITCHES as u64) as i32),
            shake: Shake::Random,
            step: 0.0,
            frames: 1,
            light: Light::Steady,
        };
        let mut drawing = Drawing::new(film);
        let (side, taken) = (drawing.side(), drawing.take(0));
        let frame = Frame::new(&taken.grey, side, side).expect("a frame");
        let [first, column, _, row] = CORNERS.map(|led| drawing.still_led_px(led));
        let step = |to: [f64; 2]| [0, 1].map(|axis| (to[axis] - first[axis]) / (SIDE - 1) as f64);
        let (right, down) = (step(column), step(row));
        let corners = |moves: [[f64; 2]; 4]| {
            let mut points = CORNERS.map(|led| drawing.still_led_px(led).map(|c| c as f32));
            for (point, [columns, rows]) in points.iter_mut().zip(moves) {
                for axis in 0..2 {
                    point[axis] += (columns * right[axis] + rows * down[axis]) as f32;
                }
            }
            Corners::new(points).expect("corners")
        };
        for (given, tally) in [
            (None, &mut sum.found),
            (Some([[0.0; 2]; 4]), &mut sum.at_corners),
            (Some(DISTURBED[seed as usize / PITCHES % DISTURBED.len()]), &mut sum.disturbed),
        ] {
            let (still, _) = decoder
                .decode(&frame, Camera::default(), given.map(corners))
                .expect("a frame and its corners");
            if let Ok(still) = still {
                let detection = still.reading.detection;
                tally.add(detection.confidence, (detection.bits.bits() ^ taken.bits).count_ones());
            }
        }
    }
    sum
}
