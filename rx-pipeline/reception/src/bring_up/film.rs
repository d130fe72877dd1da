//! A camera's frames of the walk: first the region that changes, then its levels in each step.

use super::diagnosis::{median, of_several};
use super::lattice::{Lattice, Spots};
use super::{StepLevels, StepPictures, align};

/// The smallest difference that counts, in grey levels.
const VISIBLE_GREY: f32 = 4.0;
/// Minimum difference of On and Off, in grey levels: a smaller one may be noise.
const CONTRAST_MIN_GREY: f32 = 16.0;
/// The level of an Off LED from which frames count as overexposed.
const WHITE_GREY: f32 = 230.0;
/// Maximum number of pixels along a side of a stored frame.
const SIDE_PX: usize = 96;
/// Maximum number of stored frames: 220 MB.
const FRAMES_MAX: usize = 6000;
/// Minimum activity of a pixel of the panel, as a share of the greatest.
const ACTIVE_MIN: f32 = 0.3;

/// Maximum number of LEDs that wiring faults may make show several bits: two columns. More are out of focus or overexposed.
const BLURRED_MAX: usize = 16;

/// Why a panel cannot be read from pictures.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// There are too few frames.
    #[error("{0} frames are too few: film all test panels, or take a picture of each")]
    Few(usize),
    /// There are too many frames.
    #[error("more than {FRAMES_MAX} frames: cut the film to the test panels")]
    Many,
    /// A frame differs in size.
    #[error("a frame differs in size from the first one: use the frames of one camera")]
    Size,
    /// Nothing changes.
    #[error("nothing changes in the frames: film the panel during `vocc device test`, or look for an LED that follows it")]
    Still,
    /// The steps were not found.
    #[error(
        "the test panels are not in the frames: film all of the first part, with the camera still, the panel in focus and no other light \
         that changes"
    )]
    NoSteps,
    /// The frames are overexposed.
    #[error(
        "the frames are overexposed: LEDs that are Off have a grey level of {off:.0} of 255; expose shorter by a factor of four, and film \
         again"
    )]
    Overexposed {
        /// The median level of Off LEDs.
        off: f32,
    },
    /// On and Off differ too little.
    #[error(
        "On and Off differ by {contrast:.0} grey levels, and {CONTRAST_MIN_GREY} are needed: go nearer, focus, or take away what shines on \
         the panel"
    )]
    Faint {
        /// The median difference of On and Off.
        contrast: f32,
    },
    /// Many LEDs show the bits of others.
    #[error("{0} of the LEDs show the light of others, too: focus, move closer, or shorten the exposure, and film again")]
    Blurred(usize),
    /// The frames cut off a part of the panel.
    #[error("the frames cut off a part of the panel: film all of it, with a margin")]
    Cut,
    /// The LEDs form no lattice.
    #[error("{0} LEDs follow the test panels but do not form a lattice: move closer, and hold the camera upright and straight ahead")]
    NoLattice(usize),
}

/// The change of each pixel over a whole film.
#[derive(Clone, Debug)]
pub struct Activity {
    width: usize,
    frames: usize,
    last: Vec<u8>,
    /// The sum of the changes of each pixel.
    sum: Vec<f32>,
}

impl Activity {
    /// A sum over no frames yet.
    pub fn new(width: usize) -> Self {
        Self {
            width,
            frames: 0,
            last: Vec::new(),
            sum: Vec::new(),
        }
    }

    /// Adds the grey levels of the next frame, row by row, for frames of this width.
    ///
    /// # Errors
    /// [`FilmError`] if its size differs from that of the frames before, or if it is one frame too many.
    pub fn add(&mut self, grey: &[u8], width: usize) -> Result<(), FilmError> {
        self.frames += 1;
        if self.frames > FRAMES_MAX {
            return Err(FilmError::Many);
        }
        if self.last.is_empty() {
            self.last = grey.to_vec();
            self.sum = vec![0.0; grey.len()];
        }
        if (grey.len(), width) != (self.last.len(), self.width) {
            return Err(FilmError::Size);
        }
        for ((sum, last), &now) in self.sum.iter_mut().zip(&mut self.last).zip(grey) {
            *sum += f32::from(now.abs_diff(*last));
            *last = now;
        }
        Ok(())
    }

    /// The region of the panel: all pixels that change much, with a margin.
    ///
    /// # Errors
    /// [`FilmError`] if nothing changes, or if there are too few frames.
    pub fn region(&self) -> Result<Region, FilmError> {
        if self.frames < super::CODES {
            return Err(FilmError::Few(self.frames));
        }
        let height = self.sum.len() / self.width.max(1);
        if self.width < 3 || height < 3 {
            return Err(FilmError::Still);
        }
        // A single pixel may flicker on its own.
        let around = |x: usize, y: usize| {
            let rows = (y - 1..=y + 1).map(|y| &self.sum[y * self.width + x - 1..=y * self.width + x + 1]);
            rows.flatten().sum::<f32>() / 9.0
        };
        let pixels = || (1..height - 1).flat_map(|y| (1..self.width - 1).map(move |x| (x, y)));
        let most = pixels().map(|(x, y)| around(x, y)).fold(0.0, f32::max);
        if most < VISIBLE_GREY {
            return Err(FilmError::Still);
        }
        let (mut from, mut to) = ([self.width, height], [0, 0]);
        for (x, y) in pixels().filter(|&(x, y)| around(x, y) >= ACTIVE_MIN * most) {
            from = [from[0].min(x), from[1].min(y)];
            to = [to[0].max(x + 1), to[1].max(y + 1)];
        }
        let size = [self.width, height];
        // Room for LEDs at the rim that do not change: two columns with their gaps.
        let room = ((to[0] - from[0]).max(to[1] - from[1]) / 4).max(2);
        let from = from.map(|start| start.saturating_sub(room));
        let to: [usize; 2] = std::array::from_fn(|axis| (to[axis] + room).min(size[axis]));
        let longest = (to[0] - from[0]).max(to[1] - from[1]);
        Ok(Region {
            width: self.width,
            height,
            from,
            to,
            bin: longest.div_ceil(SIDE_PX),
        })
    }
}

/// A region of all frames, whose pixels are averaged in squares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// The width of the frame.
    width: usize,
    height: usize,
    from: [usize; 2],
    to: [usize; 2],
    bin: usize,
}

impl Region {
    /// Averaged pixels across and down.
    fn size(&self) -> [usize; 2] {
        std::array::from_fn(|axis| (self.to[axis] - self.from[axis]) / self.bin)
    }

    /// Whether a position in averaged pixels is in the frame.
    fn has(&self, at: [f64; 2]) -> bool {
        let frame = [self.width, self.height];
        (0..2).all(|axis| {
            let pixel = self.from[axis] as f64 + at[axis] * self.bin as f64;
            (0.0..frame[axis] as f64).contains(&pixel)
        })
    }

    fn of(&self, grey: &[u8]) -> Vec<f32> {
        let [across, down] = self.size();
        let bins = (0..down).flat_map(|y| (0..across).map(move |x| (x, y)));
        let mean = |(x, y)| {
            let [left, top] = [self.from[0] + x * self.bin, self.from[1] + y * self.bin];
            let rows = (top..top + self.bin).map(|y| &grey[y * self.width + left..][..self.bin]);
            rows.flatten().map(|&pixel| u32::from(pixel)).sum::<u32>() as f32 / (self.bin * self.bin) as f32
        };
        bins.map(mean).collect()
    }
}

/// The region of a film that shows the panel.
#[derive(Clone, Debug)]
pub struct Film {
    region: Region,
    frames: Vec<Vec<f32>>,
}

impl Film {
    /// A region of no frames yet.
    pub fn of(region: Region) -> Self {
        Self {
            region,
            frames: Vec::new(),
        }
    }

    /// Adds the grey levels of the next frame, row by row.
    ///
    /// # Errors
    /// [`FilmError`] if its size differs from that of the frames before, or if it is one frame too many.
    pub fn add(&mut self, grey: &[u8]) -> Result<(), FilmError> {
        if self.frames.len() == FRAMES_MAX {
            return Err(FilmError::Many);
        }
        if grey.len() < self.region.to[1] * self.region.width {
            return Err(FilmError::Size);
        }
        self.frames.push(self.region.of(grey));
        Ok(())
    }

    /// The level of each LED in each step.
    ///
    /// # Errors
    /// [`FilmError`] if the steps or the LEDs are not found.
    pub fn read(&self) -> Result<StepLevels, FilmError> {
        let aligned = align(&self.frames).ok_or(FilmError::NoSteps)?;
        let spots = Spots::of(&aligned.codes, self.region.size()[0], VISIBLE_GREY);
        let lattice = Lattice::through(&spots).ok_or(FilmError::NoLattice(spots.count()))?;
        if !lattice.places().all(|at| self.region.has(at)) {
            return Err(FilmError::Cut);
        }
        let levels = |picture: &Vec<f32>| lattice.levels(picture, self.region.size());
        let by_place = StepPictures {
            codes: aligned.codes.iter().map(levels).collect(),
            ramp: aligned.ramp.map(|ramp| ramp.iter().map(levels).collect()),
        };
        let reading = StepLevels::of_levels(&by_place, VISIBLE_GREY).ok_or(FilmError::NoSteps)?;
        let [off, on] = lattice.seen().fold([vec![], vec![]], |[mut off, mut on], place| {
            let [one, other] = reading.pairs[0].map(|levels| levels[place]);
            off.push(one.min(other));
            on.push(one.max(other));
            [off, on]
        });
        let [off, on] = [off, on].map(|levels| median(levels).unwrap_or(0.0));
        let contrast = on - off;
        if contrast < CONTRAST_MIN_GREY {
            return Err(if off >= WHITE_GREY {
                FilmError::Overexposed { off }
            } else {
                FilmError::Faint { contrast }
            });
        }
        let blurred = of_several(&reading);
        if blurred > BLURRED_MAX {
            return Err(FilmError::Blurred(blurred));
        }
        Ok(StepLevels {
            offsets: lattice.offsets(),
            ..reading
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bring_up::{Finding, diagnose, walk};
    use link::orientation::Orientation;
    use link::panel::{LEDS, PanelFrame};

    const SIZE: [usize; 2] = [240, 180];

    /// The positions and the look of LEDs in a simulated camera.
    #[derive(Clone, Copy)]
    struct View {
        corners: [[f32; 2]; 4],
        /// An LED that is displaced, and by how much, in pitches.
        off: Option<(usize, [f32; 2])>,
        noise: f32,
        background: f32,
        light: f32,
        /// The radius of an LED's light, in pitches.
        radius: f32,
    }

    const STRAIGHT: View = View {
        background: 30.0,
        light: 150.0,
        radius: 0.25,
        corners: [[60.0, 40.0], [158.0, 40.0], [158.0, 138.0], [60.0, 138.0]],
        off: None,
        noise: 0.0,
    };

    impl View {
        /// Draws discs of a third of the pitch, with soft edges.
        fn frame(&self, levels: &[f32; LEDS], state: &mut u64) -> Vec<u8> {
            let corners = rx_pipeline::corners::Corners::new(self.corners).unwrap();
            let homography = corners.homography();
            let mut grey = vec![self.background; SIZE[0] * SIZE[1]];
            for (led, level) in levels.iter().enumerate() {
                let off = self.off.filter(|&(other, _)| other == led).map_or([0.0; 2], |(_, off)| off);
                let [x, y] = homography.to_image([(led % 8) as f64 + f64::from(off[0]), (led / 8) as f64 + f64::from(off[1])]);
                let radius = corners.pitch_px() * self.radius;
                let reach = radius as i32 + 3;
                for py in y as i32 - reach..=y as i32 + reach {
                    for px in x as i32 - reach..=x as i32 + reach {
                        let distance = (px as f32 - x as f32).hypot(py as f32 - y as f32);
                        let share = (radius + 0.5 - distance).clamp(0.0, 1.0);
                        if let (0..240, 0..180) = (px, py) {
                            grey[py as usize * SIZE[0] + px as usize] += share * level;
                        }
                    }
                }
            }
            let mut noise = || {
                *state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                ((*state >> 40) as f32 / (1 << 24) as f32 - 0.5) * 2.0 * self.noise
            };
            grey.iter().map(|grey| (grey + noise()).clamp(0.0, 255.0) as u8).collect()
        }

        /// A film of all steps, six frames each.
        fn film(&self, fault: impl Fn(u64) -> u64) -> Vec<Vec<u8>> {
            let mut state = 1;
            let panels = (1..20).map(|number: u64| (number.wrapping_mul(0x9e37_79b9_7f4a_7c15), 255, 1));
            let steps = walk().map(|step| (step.panel.bits(), step.share, 6));
            let mut frames = vec![];
            for (bits, share, count) in panels.clone().chain(steps).chain(panels) {
                let light = self.light * f32::from(share) / 255.0;
                let levels = PanelFrame::from_bits(fault(bits)).shares().map(|on| on * light);
                frames.extend((0..count).map(|_| self.frame(&levels, &mut state)));
            }
            frames
        }

        fn findings(&self, fault: impl Fn(u64) -> u64) -> Result<Vec<Finding>, FilmError> {
            let frames = self.film(fault);
            let mut activity = Activity::new(SIZE[0]);
            frames.iter().try_for_each(|frame| activity.add(frame, SIZE[0]))?;
            let mut film = Film::of(activity.region()?);
            frames.iter().try_for_each(|frame| film.add(frame))?;
            Ok(diagnose(&film.read()?))
        }
    }

    #[test]
    fn a_healthy_panel_gives_no_finding_from_anywhere() {
        let views = [
            STRAIGHT,
            View { noise: 12.0, ..STRAIGHT },
            // Seen from the side, rolled by 20°, and small.
            View {
                corners: [[60.0, 40.0], [170.0, 55.0], [168.0, 130.0], [62.0, 150.0]],
                ..STRAIGHT
            },
            View {
                corners: [[80.0, 40.0], [172.0, 73.5], [138.5, 165.5], [46.5, 132.0]],
                ..STRAIGHT
            },
            View {
                corners: [[100.0, 60.0], [142.0, 60.0], [142.0, 102.0], [100.0, 102.0]],
                noise: 4.0,
                ..STRAIGHT
            },
        ];
        for (number, view) in views.iter().enumerate() {
            assert_eq!(view.findings(|bits| bits), Ok(vec![]), "view {number}");
        }
    }

    /// A healthy panel that a camera does not see clearly is rejected, not diagnosed.
    #[test]
    fn what_is_not_seen_well_is_no_fault() {
        // The light of an LED reaches its neighbours.
        for (radius, light) in [(0.9, 80.0), (1.1, 60.0)] {
            let soft = View { radius, light, ..STRAIGHT };
            assert!(matches!(soft.findings(|bits| bits), Err(FilmError::Blurred(_))), "{radius} pitches");
        }
        let soft = View {
            radius: 0.7,
            light: 100.0,
            ..STRAIGHT
        };
        assert_eq!(soft.findings(|bits| bits), Ok(vec![]));
        // The right column is outside the frame.
        let cut = View {
            corners: [[140.0, 40.0], [246.0, 40.0], [246.0, 146.0], [140.0, 146.0]],
            ..STRAIGHT
        };
        assert_eq!(cut.findings(|bits| bits), Err(FilmError::Cut));
        // Columns at the rim that are always lit change as little as the panel's surroundings.
        let columns = 0x0303_0303_0303_0303_u64;
        assert_eq!(
            STRAIGHT.findings(|bits| bits | columns),
            Ok(vec![Finding::ColumnStuck(0), Finding::ColumnStuck(1)])
        );
    }

    #[test]
    fn faults_are_named_by_the_pictures() {
        let noisy = View { noise: 6.0, ..STRAIGHT };
        for row in 0..8 {
            let dead = noisy.findings(|bits| bits & !(0xff << (8 * row)));
            assert_eq!(dead, Ok(vec![Finding::RowDead(row)]));
        }
        let columns = 0x8181_8181_8181_8181_u64;
        assert_eq!(
            noisy.findings(|bits| bits & !columns),
            Ok(vec![Finding::ColumnDead(0), Finding::ColumnDead(7)])
        );
        assert_eq!(noisy.findings(|bits| bits.rotate_left(1)), Ok(vec![Finding::ChainShifted(1)]));
        assert_eq!(noisy.findings(|bits| bits | 1 << 27), Ok(vec![Finding::LedStuck(27)]));
        for orientation in Orientation::ALL.into_iter().skip(1) {
            let seen = noisy.findings(|bits| PanelFrame::from_bits(bits).seen(orientation).bits());
            assert_eq!(seen, Ok(vec![Finding::Turned(orientation)]));
        }
        // Half of the rows follow: the chain is broken.
        assert_eq!(noisy.findings(|bits| bits & 0xffff_ffff), Ok(vec![Finding::ChainBroken(4)]));
    }

    #[test]
    fn an_led_off_its_place_is_named() {
        let view = View {
            off: Some((20, [0.35, 0.0])),
            ..STRAIGHT
        };
        let findings = view.findings(|bits| bits).unwrap();
        let [Finding::OffLattice(20, [right, down])] = findings[..] else {
            panic!("{findings:?}");
        };
        assert!((right - 0.35).abs() < 0.06 && down.abs() < 0.06, "{right}, {down}");
    }

    #[test]
    fn frames_that_are_too_bright_or_too_faint_say_so() {
        let white = View {
            background: 245.0,
            ..STRAIGHT
        };
        assert!(matches!(white.findings(|bits| bits), Err(FilmError::Overexposed { off }) if (240.0..250.0).contains(&off)));
        let faint = View { light: 10.0, ..STRAIGHT };
        assert!(matches!(faint.findings(|bits| bits), Err(FilmError::Faint { contrast }) if (9.0..11.0).contains(&contrast)));
    }

    #[test]
    fn films_without_the_walk_say_so() {
        let mut activity = Activity::new(SIZE[0]);
        assert_eq!(activity.region(), Err(FilmError::Few(0)));
        for _ in 0..20 {
            activity.add(&vec![7; SIZE[0] * SIZE[1]], SIZE[0]).unwrap();
        }
        assert_eq!(activity.region(), Err(FilmError::Still));
        assert_eq!(activity.add(&[7; 100], 10), Err(FilmError::Size));
        assert_eq!(activity.add(&vec![7; SIZE[0] * SIZE[1]], SIZE[1]), Err(FilmError::Size));
        assert_eq!(STRAIGHT.findings(|_| 0), Err(FilmError::Still));
        // A single LED.
        assert_eq!(STRAIGHT.findings(|bits| bits & 1), Err(FilmError::NoLattice(1)));
    }
}
