//! Detects whether frames that are flagged as interlaced are single pictures, such as 25 pictures a second in 50i.
//!
//! A moving object is at one place in all lines of a single picture; in a frame of two pictures, every other line shows another time. If a
//! frame differs from the one before, a line is therefore compared with its neighbours in its own frame and in the frame before. In a
//! single picture only those of its own frame fit. With two pictures neither fit, because both are half a frame away in time.

/// Smallest change of a pixel between two frames that counts as motion, in grey levels: above noise and the errors of codecs.
const MOTION_GREY: u8 = 24;
/// Minimum number of moving pixels in a frame that counts.
const MOVING_MIN: u32 = 64;
/// Minimum ratio of the other lines' misfit to the own lines' in a single picture. An LED of σ = 1.5 px that is switched on has 5; two
/// pictures have 1 on average.
const SINGLE_MIN: u64 = 2;
/// Number of frames that must all be single pictures: more than a cycle of films that mix both (3:2 pulldown has 2 of 5 of two pictures).
pub const FRAMES_MIN: u32 = 8;

/// Compares successive frames.
pub struct Combing {
    width: usize,
    single: u32,
    is_combed: bool,
}

impl Combing {
    /// A comparison of frames of this width.
    pub fn new(width: usize) -> Self {
        Self {
            width,
            single: 0,
            is_combed: false,
        }
    }

    /// Adds a frame and the one before, both row by row.
    pub fn look(&mut self, before: &[u8], frame: &[u8]) {
        let (moving, own, other) = misfits(before, frame, self.width);
        if moving >= MOVING_MIN {
            match other >= SINGLE_MIN * own {
                true => self.single += 1,
                // A ratio in between can be either.
                false => self.is_combed |= 3 * own > 2 * other,
            }
        }
    }

    /// Whether the frames are single pictures: no frame shows two, and enough frames would have.
    pub fn are_single(&self) -> bool {
        !self.is_combed && self.single >= FRAMES_MIN
    }

    /// Whether a frame shows two pictures.
    pub fn is_combed(&self) -> bool {
        self.is_combed
    }
}

/// The moving pixels of a frame, and their differences from the lines above and below, in their own frame and in the
/// frame before.
fn misfits(before: &[u8], frame: &[u8], width: usize) -> (u32, u64, u64) {
    let rows = |frame: &[u8]| frame.len() / width.max(1);
    let (mut moving, mut own, mut other) = (0, 0, 0);
    for y in 1..rows(frame).saturating_sub(1) {
        for at in y * width..(y + 1) * width {
            let pixel = frame[at];
            if pixel.abs_diff(before[at]) < MOTION_GREY {
                continue;
            }
            let misfit = |frame: &[u8]| {
                let around = i32::from(frame[at - width]) + i32::from(frame[at + width]);
                u64::from((2 * i32::from(pixel) - around).unsigned_abs())
            };
            moving += 1;
            own += misfit(frame);
            other += misfit(before);
        }
    }
    (moving, own, other)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 96;

    /// A panel at a time, with random bits.
    fn picture(time: u64, sigma_px: f64) -> Vec<u8> {
        let mut state = time.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678;
        let bits: Vec<f64> = (0..64)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                f64::from((state >> 40) as u8 & 1)
            })
            .collect();
        // Of the nearest LED: cells of 10 pixels, 8 pixels from the edge.
        let grey = |x: usize, y: usize| {
            let [column, row] = [x, y].map(|at| (at.saturating_sub(8) / 10).min(7));
            let [x_px, y_px] = [(x, column), (y, row)].map(|(at, place)| at as f64 - 13.3 - 10.0 * place as f64);
            let light = 200.0 * bits[8 * row + column] * (-(x_px.powi(2) + y_px.powi(2)) / (2.0 * sigma_px.powi(2))).exp();
            (30.0 + light) as u8
        };
        (0..WIDTH * WIDTH).map(|at| grey(at % WIDTH, at / WIDTH)).collect()
    }

    /// A frame whose even lines are of one picture, and the others of another.
    fn woven(even: &[u8], odd: &[u8]) -> Vec<u8> {
        let lines = even.chunks(WIDTH).zip(odd.chunks(WIDTH)).enumerate();
        lines
            .flat_map(|(y, (even, odd))| if y % 2 == 0 { even } else { odd }.to_vec())
            .collect()
    }

    fn looked_at(frames: impl IntoIterator<Item = Vec<u8>>) -> Combing {
        let mut combing = Combing::new(WIDTH);
        let frames: Vec<Vec<u8>> = frames.into_iter().collect();
        frames.windows(2).for_each(|pair| combing.look(&pair[0], &pair[1]));
        combing
    }

    #[test]
    fn pictures_that_are_only_flagged_are_single() {
        for sigma_px in [1.2, 1.5, 3.0] {
            assert!(looked_at((0..12).map(|time| picture(time, sigma_px))).are_single(), "{sigma_px}");
        }
    }

    #[test]
    fn two_pictures_in_a_frame_are_seen() {
        for sigma_px in [0.6, 1.2, 1.5, 3.0] {
            for seed in 0..20 {
                let time = |frame: u64, field: u64| 1000 * seed + 2 * frame + field;
                let frames = (0..12).map(|frame| woven(&picture(time(frame, 0), sigma_px), &picture(time(frame, 1), sigma_px)));
                let combing = looked_at(frames);
                assert!(combing.is_combed() && !combing.are_single(), "{sigma_px}");
            }
        }
    }

    #[test]
    fn pulldown_is_no_film_of_single_pictures() {
        // Of five frames, the third and the fourth are of two pictures each.
        let pictures: Vec<Vec<u8>> = (0..40).map(|time| picture(time, 1.5)).collect();
        let frames = (0..40).map(|frame| {
            let [first, second] = [[0, 0], [1, 1], [1, 2], [2, 3], [3, 3]][frame % 5].map(|of| &pictures[frame / 5 * 4 + of]);
            woven(first, second)
        });
        let combing = looked_at(frames);
        assert!(combing.is_combed() && !combing.are_single());
    }

    #[test]
    fn what_does_not_move_tells_nothing() {
        let combing = looked_at((0..12).map(|_| picture(1, 1.5)));
        assert!(!combing.are_single() && !combing.is_combed());
    }
}
