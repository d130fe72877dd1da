//! Every number by which the receiver locates, follows and reads that somebody chose: with its unit, its effect, and
//! the recommended value.
//!
//! They are constants, so that they cost nothing where pixels are reckoned with; who needs another value changes it
//! here and builds. The values are those that `docs/receiver.md` states the results of. What a camera is like is no
//! parameter but a setting ([`link::camera::Camera`]); what memory there is, is a type's `PIXELS`.
//!
//! | stage | parameters |
//! |---|---|
//! | where something stands out in the frame | [`survey`] |
//! | how large it is | [`blob`] |
//! | which poses it may have | [`pose_candidates`], [`hill_climbing`] |
//! | the pose that fits best | [`fitting`] |
//! | whether that is a panel | [`verification`] |
//! | which of the panels found is believed, and how much is tried | [`search`] |
//! | where the panel is in the next frame | [`tracking`] |
//! | which of two readings is right | [`reading`] |
//! | which readings are of one symbol | [`symbols`] |
//! | what an LED leaves in the image | [`spots`] |
//! | in how large pixels it is seen | [`coarse`] |
//! | its bits, from features and from pixels | [`detect`], [`likelihood`] |
//!
//! A *pitch* is the distance from one LED to the next; *grey* is a grey level of 256; an *amplitude ratio* is a
//! signal's over the standard deviation of a pixel's noise, and an *energy ratio* its square.

pub mod detect;
pub mod likelihood;
pub mod spots;

/// Where something stands out: one pass over the frame.
pub mod survey {
    /// Side of a tile in frames of up to [`TILES`] of them (px). Larger: faster, and small panels drown in what is
    /// around them.
    pub const TILE_PX: usize = 16;
    /// Tiles along one side of the frame, at most (count). More: 8 bytes of memory a tile of the square; fewer: coarser
    /// tiles in large frames.
    pub const TILES: usize = if cfg!(feature = "large-frames") { 128 } else { 32 };
    /// Reach of the second difference (sums of 2×2 px). Longer: tuned to larger LEDs.
    pub const LAG: usize = 2;
    /// What a peak has beyond half of all tiles, at least (share of what those have). Higher: faint panels are passed
    /// over; lower: noise makes peaks. The mean of a tile's 64 differences varies by a tenth.
    pub const STANDS_OUT: f32 = 0.25;
    /// Peaks of change looked at in a frame, at most (count). More: slower, and panels among much that moves are found.
    pub const CHANGED_PEAKS: usize = 4;
    /// Busy peaks kept of a frame, at most (count). More: slower, and panels among much clutter are found.
    pub const BUSY_PEAKS: usize = 24;
}

/// How large what stands out is.
pub mod blob {
    use core::ops::RangeInclusive;

    /// Cells along one side of the neighbourhood looked at, at most 64 (count). More: larger panels, and more time for
    /// each peak.
    pub const CELLS: usize = 48;
    /// Side of a cell (px). Larger: larger panels, and the size of small ones less sure.
    pub const CELL_PX: usize = 4;
    /// What a cell of the blob has, at least (share of what the busiest cell has beyond the noise): each is tried.
    /// Before clutter only a high share sets a panel apart; in a large panel only a low one joins its LEDs.
    pub const SHARES: [f32; 4] = [0.1, 0.2, 0.35, 0.55];
    /// What a cell of the blob has, at least (multiple of the median cell). Higher: faint panels are lost; lower: noise
    /// belongs to the blob.
    pub const LEAST_OVER_MEDIAN: f32 = 2.0;
    /// How far from a peak its busiest cell is looked for (cells). Farther: a brighter neighbour may be taken for it.
    pub const NEAR: usize = 4;
    /// Reach of the first difference that makes a cell busy (px). Longer: tuned to larger LEDs.
    pub const REACH: usize = 2;
    /// By how much light spilling over and the smoothing of cells make a blob wider (px). More: smaller panels are
    /// supposed.
    pub const SPILL_PX: f32 = 6.0;
    /// Sides of the smallest and of the largest panel looked for (px). Wider: more that is no panel is tried.
    pub const SIDE_PX: RangeInclusive<f32> = 14.0..=110.0;
    /// A blob smaller than another by less is no other one (ratio of sides). Higher: fewer sizes are tried.
    pub const DISTINCT: f32 = 1.25;
}

/// Which poses what stands out may have.
pub mod pose_candidates {
    /// Samples along one side of the patch looked at (count). More: finer, and slower by their square.
    pub const PATCH_SIDE: usize = 64;
    /// What is smoother than this counts as ground in a single frame (pitches, standard deviation). More: boards and
    /// gradients show; less: LEDs of one state side by side are taken for ground.
    pub const GROUND_SIGMA: f32 = 1.5;
    /// Samples brighter than all others but one in so many count as no more than those (count): a hot pixel is no brighter
    /// than an LED. More: few bright spots decide; fewer: LEDs are no brighter than what is around.
    pub const BRIGHTEST_ONE_IN: usize = 40;
    /// The least pitch at which LEDs are looked for as spots by themselves (px).
    pub const LEAST_RESOLVED_PX: f32 = 2.2;
    /// The size of the patch in which only spots are left (multiple of the blob's side). More: LEDs are not resolved; less:
    /// lattices beside the blob's middle leave it.
    pub const SPOTS_ROOM: f32 = 1.6;
    /// Widths of spots that are tried at the frame's own resolution (pitches, standard deviation). More: slower, and the
    /// width is better known.
    pub const WIDTHS: [f32; 3] = [0.2, 0.34, 0.55];
    /// The least of them (px): a point under a sharp lens.
    pub const LEAST_SIGMA_PX: f32 = 0.6;
    /// How far within the patch's end its rim is, whose median is the ground (samples). Nearer the end: what lies
    /// beyond the frame decides.
    pub const RIM: usize = 2;
    /// The widest reach of a blur (samples). Longer: slower; shorter: wide spots are cut off.
    pub const BLUR_REACH: usize = 12;
    /// Candidates for the pose of one blob, at most (count). More: slower, and a panel's pose is seldom missed.
    pub const POSE_CANDIDATES: usize = 6;
    /// Side of a panel in the coarsened patch, at least (samples). More: hills are narrower, and may be missed between
    /// the seeds.
    pub const COARSE_SIDE: f32 = 20.0;
    /// The blur of the coarsened patch's spots, at least (pitches, standard deviation): LEDs run into each other. More:
    /// hills are wider, and lines are told apart less.
    pub const COARSE_SIGMA: f32 = 0.55;
    /// The size of the fine patch (multiple of the blob's side). More: coarser samples; less: lattices a line off leave
    /// it.
    pub const FINE_ROOM: f32 = 1.3;
    /// The size of the patch in which a followed panel is looked for again (multiple of the panel's side). More:
    /// farther, and coarser.
    pub const NEAR_ROOM: f32 = 2.6;
    /// Seeds to either side in there (count). More: farther and slower.
    pub const NEAR_STEPS: i32 = 10;
    /// From one of these seeds to the next (pitches). Longer: farther, and hills may be missed between them.
    pub const NEAR_STEP: f32 = 0.6;
    /// √λ of the evidence: how faint LEDs are supposed to be beside the noise (share of a spot's energy). Higher:
    /// overlapping spots share less of each other's light.
    pub const RIDGE: f32 = 0.1;
    /// What counts as noise beside the camera's: spots of equal width on an even ground do not explain it (share of the
    /// patch's contrast). Higher: hills are flatter, and the best pose less sure.
    pub const MISMATCH: f32 = 0.1;
    /// Sizes of the seeds (logarithm of the ratio to the blob's). More of them, and of the next two: slower, and fewer
    /// hills are missed.
    pub const SCALES: [f32; 3] = [-0.15, 0.0, 0.15];
    /// Turns of the seeds (rad).
    pub const ROLLS_RAD: [f32; 4] = [-0.21, -0.07, 0.07, 0.21];
    /// Centres of the seeds along either axis (pitches).
    pub const SHIFTS: [f32; 3] = [-0.6, 0.0, 0.6];
    /// By how much narrower than high the seeds are (logarithm of the ratio): halfway to how a panel looks from 30°
    /// aside.
    pub const FORESHORTENING: f32 = 0.06;
}

/// The lattice on which spots lie.
pub mod constellation {
    /// The shortest step from LED to LED (samples). Shorter: slower, and more that repeats is tried.
    pub const SHORTEST: i32 = 2;
    /// The longest (samples). Longer: as above.
    pub const LONGEST: i32 = 12;
    /// How far rows lean, or columns (tangent). More: slower, and diagonals are taken for rows.
    pub const STEEPEST: f32 = 0.45;
    /// Steps along rows and along columns that are paired (count). More: slower.
    pub const PEAKS: usize = 4;
    /// Of pairs of steps that agree nearly as well the shortest are taken (share of the best's agreement). Lower: clutter
    /// makes steps shorter; higher: every other LED is left out.
    pub const AS_GOOD: f32 = 0.6;
}

/// From a seed to the maximum of the evidence near it. A climb has a first step (pitches) and a most of rounds (count):
/// longer steps leave the hill they are on, shorter ones and fewer rounds do not reach its top.
pub mod hill_climbing {
    /// First step and rounds from a seed.
    pub const FROM_SEED: (f32, usize) = (0.3, 25);
    /// First step and rounds where a followed panel is looked for again.
    pub const NEAR: (f32, usize) = (0.3, 12);
    /// First step and rounds at the frame's own resolution.
    pub const FINE: (f32, usize) = (0.12, 40);
    /// First step and rounds with each width of spots, before the best of them is known.
    pub const FIRST_OF_A_WIDTH: (f32, usize) = (0.12, 8);
    /// A climb ends when its step is shorter (pitches). Shorter: more rounds, and a pose nearer to the top.
    pub const LAST_STEP: f32 = 0.02;
    /// Climbs from one lattice to that of a line more, less or further on, at most (count). More: slower, and worse
    /// starts are mended.
    pub const LINES: usize = 4;
    /// Evidence that counts as more for such a lattice (natural logarithm). Higher: lattices a line off stay.
    pub const MARGIN: f32 = 1.0;
}

/// The Levenberg-Marquardt fit of 64 spots to the pixels.
pub mod fitting {
    /// A step that improves the sum of squares by less is the last one (share). Lower: more steps, and a pose nearer to
    /// the best.
    pub const SETTLED: f32 = 3e-3;
    /// The damping of the first step (share of the curvature). Higher: shorter steps.
    pub const DAMPING: f32 = 0.05;
    /// The least damping (share of the curvature).
    pub const LEAST_DAMPING: f32 = 0.01;
    /// What a step that improves multiplies the damping by (factor).
    pub const EASED: f32 = 0.3;
    /// What a step that does not improve makes of the damping: a multiple (factor), and this more (share of the
    /// curvature).
    pub const STIFFENED: (f32, f32) = (4.0, 0.2);
    /// With so much damping no step leads anywhere (share of the curvature). Higher: more steps before giving up.
    pub const STUCK: f32 = 50.0;
    /// Steps in which only the levels settle, since nothing else can before (count).
    pub const LEVELLING: usize = 3;
    /// Steps in which a near panel's tilt settles, at most (count).
    pub const TILTING: usize = 8;
}

/// Whether a lattice fitted to the pixels is a panel. Where there are two values, the first is for the change between
/// two frames, the second for a single frame, which holds all the clutter.
pub mod verification {
    use core::ops::RangeInclusive;

    /// Steps of the first fit, at most (count). This and the next three, higher: slower, and worse starts are mended.
    pub const STEPS: usize = 20;
    /// Steps of the fit of a lattice that has moved by a line, at most (count).
    pub const STEPS_MOVED: usize = 12;
    /// Steps of the fits that are compared: of the lattice itself, and of one a line beside it (count).
    pub const STEPS_COMPARED: [usize; 2] = [2, 3];
    /// Lattices a line beside that are fitted: those that look best before (count).
    pub const LIKELIEST: usize = 2;
    /// Lines by which a single frame's lattice is moved to where LEDs are On, at most (count).
    pub const LINES_MOVED: usize = 2;
    /// What a lattice holds more than those a line beside it, at least (count: 2 for an LED that is On, 3 if it is just
    /// like one, 1 for one that is Off and shows): else their fits are compared. Higher: slower, and lines that one LED shows are doubted.
    pub const LEAST_LINES_LEAD: i32 = 3;
    /// A place is just like an LED that stands out if it differs from these by less (share of what they have). Higher: a hot
    /// pixel or a corner may make a line; lower: lines that one LED shows are doubted.
    pub const JUST_LIKE: f32 = 0.3;
    /// What a lattice one line off leaves then, at least (ratio of variances). Higher: more panels with a dark outer line wait
    /// for other frames.
    pub const LINES_CLEARLY_WORSE: f32 = 1.6;
    /// An LED of a line that is dimmer than the others shows more than these, being Off, usually do, at least by this (share of an LED
    /// that is On). Higher: panels with a dim outer line are a line off; lower: noise makes lines.
    pub const LEAST_DIM: f32 = 0.25;
    /// LEDs that are Off show if their places stand out by more (share of an LED that is On).
    pub const LEAST_OFF: f32 = 0.1;
    /// The same (multiple of their median deviation, for eight of them together).
    pub const SEEN: f32 = 4.0;
    /// A place looks like an LED that is Off if it differs from what these usually show by less (share of it).
    pub const OFF_WITHIN: f32 = 0.5;
    /// Lattices that are compared by their fits, at most (count).
    pub const LINES_COMPARED: usize = 4;
    /// How far light is carried across a board's end (standard deviations of a spot): so much less than half a pitch beyond
    /// the outer LEDs counts in a single frame. More: what is around a board without a margin disturbs less, and less is seen.
    pub const CARRIED: f32 = 0.8;
    /// Room around the lattice where two lines more could lie, and where none (pitches). More: clutter around the panel
    /// counts.
    pub const WIDE: f32 = 1.8;
    /// The same for no more than the cells (pitches).
    pub const NARROW: f32 = 0.6;
    /// Pixels at grey 255, at most (percent of the panel's). Higher: panels are fitted of which little is known.
    pub const MAX_SATURATED_PERCENT: u8 = 60;
    /// Rounding, and what else no camera is free of (variance, grey²). Higher: noiseless frames are judged more mildly.
    pub const ROUNDING: f32 = 0.1;
    /// What may be left unexplained (multiple of the camera's noise): what stands behind the panel counts too in a
    /// single frame, but its noise is better known. Higher: more that is no panel passes.
    pub const EXCUSED_NOISE: [f32; 2] = [1.15, 1.0];
    /// What may be left unexplained beside (share of the signal's energy). Higher: more that is no panel passes; lower:
    /// panels seen askew do not.
    pub const EXCUSED_SIGNAL: [f32; 2] = [0.07, 0.07];
    /// The same in the change between two frames, and within a board, where LEDs are of two brightnesses and none between: discs under a
    /// sharp lens, sharpening, codecs and white make spots that are not quite Gaussian. More in proportion, the more distinct they are.
    pub const EXCUSED_IF_DISTINCT: f32 = 0.17;
    /// But no more than that.
    pub const EXCUSED_MOST: f32 = 0.3;
    /// What a lattice in the change between two frames may leave, if it is then seen there again and again (multiple of what is excused).
    /// Higher: lenses and codecs of other kinds are excused, and more that is no panel is remembered.
    pub const MOST_MISFIT: f32 = 2.5;
    /// A single frame in which what lies around the panel was taken for its ground is looked at within the panel's outline too if it leaves
    /// no more than this (ratio to what would do). Higher: slower.
    pub const NEARLY_FITS: f32 = 1.25;
    /// The least pitch at which the ground shows between spots (standard deviations of a spot): amid four there is 0.4 of one then.
    pub const GROUND_BETWEEN: f32 = 3.0;
    /// LEDs are distinct if the step from Off to On is greater (multiple of the standard deviation among LEDs of one state). 64
    /// brightnesses spread evenly, cut in two halves, have 3.5. Higher: panels of unequal LEDs wait for other frames.
    pub const DISTINCT: f32 = 7.5;
    /// Spots nearer to each other overlap by so much that the excuse is cut down (standard deviations of a spot).
    pub const CLOSE: f32 = 2.2;
    /// What the spots explain, at least (energy ratio): LEDs seen this clearly are no accident. Higher: faint panels
    /// wait for other frames.
    pub const LEAST_EXPLAINED: [f32; 2] = [700.0, 4000.0];
    /// The same for the dimmest outer line of LEDs (energy ratio): below, the lattice may as well be a line off.
    pub const LEAST_EDGE: f32 = 25.0;
    /// LEDs that are On, or have changed (count). Scrambled bits have 32 ± 4.
    pub const LIT: RangeInclusive<u32> = 8..=56;
    /// Neighbours in rows and columns that differ (count). In random bits 56 ± 5 of 112 do; in pictures, which are
    /// smooth, far fewer.
    pub const DIFFERENT: RangeInclusive<u32> = 40..=84;
    /// How much a single frame's bits repeat, at most (squared deviations of random ones): 1 of 10 000 panels does more. Higher: windows,
    /// text and lattices of a third of a panel's pitch pass; lower: more panels wait for other frames.
    pub const MOST_REPETITION: u32 = 19;
    /// Outer lines without an LED that stands out in a single frame, being On or, on a bright board, Off, at most (count): 1 of 10 000
    /// panels has more, and so has a lattice that is larger than the panel. Higher: such lattices pass.
    pub const MOST_DARK_EDGES: usize = 1;
    /// Columns and rows after which bits may repeat, at most (count).
    pub const FARTHEST_REPEAT: u32 = 4;
    /// Places next to the lattice that look like LEDs, at most (count): more belong to something that goes on.
    pub const LIT_AROUND: [u32; 2] = [2, 3];
    /// Off LEDs darker than the ground by more are none, without a board and with one (share of the step from Off to On).
    pub const DARKEST_OFF: [f32; 2] = [-0.3, -1.0];
    /// How much likelier a panel has to be in a single frame, where its spots overlap, than spots of any brightness
    /// (natural logarithm of the odds). Places without a panel are some 20 000 times as common.
    pub const LEAST_LOG_ODDS: f32 = 10.0;
    /// How unequal LEDs of one state are (share of the step from Off to On, standard deviation). Higher: more that is no panel passes.
    pub const LED_SPREAD: f32 = 0.12;
    /// Pitch along rows over pitch along columns (ratio): seen from up to 40° aside.
    pub const ASPECT: RangeInclusive<f32> = 0.72..=1.39;
    /// The least pitch (px): LEDs closer together run into each other under any blur that is looked for, and any smooth
    /// patch looks like them.
    pub const LEAST_PITCH_PX: f32 = 2.0;
    /// Rows and columns are no further from right angles (cosine).
    pub const MOST_SHEAR: f32 = 0.2;
    /// Rows are turned by no more (rad): 23°.
    pub const MOST_ROLL_RAD: f32 = 0.4;
    /// A spot's width over the pitch (ratio): small discs under a sharp lens are the narrowest, LEDs that run into each other
    /// the widest. Wider: more that is no panel passes.
    pub const SPOT_OVER_PITCH: RangeInclusive<f32> = 0.08..=0.85;
    /// A fit that leaves no more than noise is trusted at once where the signal is greater (energy ratio, per pixel).
    pub const CLEAR: f32 = 8.0;
    /// A single frame of which a fit leaves more is not compared with lattices a line beside (share of the signal).
    pub const HALF_EXPLAINED: f32 = 0.5;
    /// A lattice one line off leaves this much less when it is taken for the right one, and as much more when it is
    /// ruled out (energy ratio).
    pub const WORTH_A_MOVE: f32 = 40.0;
    /// In a single frame a lattice one line off has to leave more, or the frame does not tell them apart (share of the
    /// signal).
    pub const CLEARLY_WORSE: f32 = 0.01;
    /// What is left is next to nothing but noise (amplitude ratio): no other pose is tried. Higher: faster, and the
    /// second best pose may stay.
    pub const BEYOND_DOUBT: f32 = 1.25;
    /// The noise around the panel counts as no less (share of the variance of the whole frame's).
    pub const LEAST_NOISE_AROUND: f32 = 0.3;
}

/// Which of the panels found is believed, and how much is tried in a frame.
pub mod search {
    use core::ops::RangeInclusive;

    /// An LED's own extent before anything is known of it (px, standard deviation).
    pub const LED_SIGMA_PX: f32 = 0.6;
    /// Noise below is rounding (grey).
    pub const LEAST_NOISE_GREY: f32 = 0.3;
    /// Columns and rows around a known panel in which no other is looked for (pitches, from the first LED on).
    pub const KNOWN: RangeInclusive<f64> = -3.0..=10.0;
    /// A change fainter than this has to show in another search too (amplitude ratio): moving things may look like a panel once.
    pub const FAINT: f32 = 55.0;
    /// The same where not the panel alone has changed (amplitude ratio): the camera has moved, and edges that move may
    /// look like anything.
    pub const FAINT_IN_MOTION: f32 = 200.0;
    /// Searches back in which it may have shown (count). More: faint panels are found sooner.
    pub const LOOKS_BACK: usize = 3;
    /// Searches back in which a lattice may have shown that leaves too much, or is faint while the camera moves, and those in which it has
    /// to (count). More of the first: such panels are found sooner; of the second: more surely.
    pub const REMEMBERED: usize = 8;
    /// See there.
    pub const SIGHTINGS: usize = 2;
    /// Spots of another width than expected have to show so much more clearly (factor): any width fits some edge that moves.
    pub const UNEXPECTED: f32 = 2.5;
    /// The width expected, over that of the narrowest and of the widest LED under the blur that was told (ratio).
    pub const EXPECTED_WIDTH: (f32, f32) = (0.88, 1.15);
    /// The pitch over the diameter of the widest LEDs (ratio): they fill two thirds of it.
    pub const PITCH_OVER_LED: f32 = 1.5;
    /// The camera has moved when half of the frame changes by more: this many times its noise (factor), and this
    /// (grey).
    pub const IN_MOTION: (f32, f32) = (1.5, 0.5);
    /// Poses of changed places tried in a frame (count). More, as of the next two: panels are found sooner, and each
    /// frame takes longer.
    pub const CHANGED_BUDGET: u32 = 8;
    /// Poses of busy places tried in a frame (count).
    pub const BUSY_BUDGET: u32 = 3;
    /// Busy places looked at in every frame (count); and one more, another each time.
    pub const ALWAYS: usize = 2;
    /// Busy places are looked at for LEDs that are dark on a white board in every so many frames, in the others for bright ones (frames).
    pub const HOLES_EVERY: u64 = 4;
    /// Lattices are the same if no corner differs by more (pitches).
    pub const SAME_LATTICE: f32 = 0.4;
}

/// Where the panel is in the next frame: an α-β tracker of place, shape and brightness.
pub mod tracking {
    /// Frames in a row that may be missed before the panel counts as lost (frames): at 100 a second 0.12 s. More:
    /// longer gaps are bridged, and a panel that has gone is looked for later.
    pub const PATIENCE_FRAMES: u32 = 12;
    /// Frames further apart say nothing of each other (frames).
    pub const LONGEST_GAP_FRAMES: u64 = 25;
    /// α and β of the place: what is taken of a frame's correction for the place itself, and for its speed (share).
    /// Higher: follows turns sooner, and noise too.
    pub const PLACE_GAINS: [f32; 2] = [0.8, 0.3];
    /// α and β of the shape, which changes more slowly (share).
    pub const SHAPE_GAINS: [f32; 2] = [0.6, 0.12];
    /// α of the spots' width, which hardly changes from frame to frame (share). A frame is asked for it with the levels
    /// as they were, and for the levels with the width as it was, so that both answer for the same light: more of it,
    /// and they would answer each other.
    pub const WIDTH_GAIN: f32 = 0.1;
    /// The most that a near panel's tilt changes in a step (share of its distance, per LED). Higher: followed sooner, and
    /// noise too.
    pub const TILT_STEP: f32 = 0.01;
    /// The most that it is (share of its distance, per LED): a panel of 0.6 m at 1 m, from 40° aside.
    pub const TILT_MAX: f32 = 0.05;
    /// A prediction off by more may have led to wrong bits (pitches). Higher: jumps are followed, one in them by a line
    /// too far.
    pub const FARTHEST: f32 = 0.3;
    /// Room around the lattice (pitches).
    pub const RIM: f32 = 0.6;
    /// Of what frames usually explain, a panel where it is expected explains this much, at least (share of the light
    /// there).
    pub const GATE_SHARE: f32 = 0.85;
    /// The same where it also looks likeliest to be, or has lately been on course: a frame that straddles two symbols explains this little.
    pub const GATE_SHARE_LIKELIEST: f32 = 0.5;
    /// What it explains as long as it is not known what is usual, at least (share of the light there).
    pub const GATE_LEAST: f32 = 0.25;
    /// The same where the panel is not expected: clutter explains some of itself too.
    pub const GATE_LEAST_ELSEWHERE: f32 = 0.7;
    /// A frame shows the panel too if it leaves less of each pixel than this (multiple of what frames usually leave), and explains more
    /// than this (share of what they usually explain): a symbol with few LEDs On. Higher and lower: what is no panel is followed.
    pub const LEFT_MOST: f32 = 1.3;
    /// See there.
    pub const SIGNAL_LEAST: f32 = 0.3;
    /// A panel that has lately been nearer to where it was expected has not jumped by a line (pitches). Lower: slower where
    /// cameras shake.
    pub const ON_COURSE: f32 = 0.1;
    /// One that has lately been farther, and explains less than this share of what it usually does, may be seen halfway between two lines:
    /// it is looked for around too (pitches; share). Lower and higher: as above.
    pub const NEAR_COURSE: f32 = 0.2;
    /// See there.
    pub const LESS_THAN_USUAL: f32 = 0.95;
    /// What of the farthest that it was from there still counts in the next frame (share). Higher: slower after a jump, and when a
    /// panel has just been found.
    pub const ASTRAY_SHARE: f32 = 0.8;
    /// A panel that has jumped is taken to be a line beside where it was seen if that promises to leave less (share of what it leaves
    /// there). Higher: LEDs that are Off along a side move it.
    pub const LINE_LEFT: f32 = 0.8;
    /// What frames usually explain is the mean over about so many (frames).
    pub const MEMORY_FRAMES: f32 = 16.0;
    /// A panel whose bits are less sure over these frames is looked for again (probability that a bit is right). Higher: slower where
    /// noise makes bits unsure.
    pub const TRUST_LEAST: f32 = 0.95;
    /// LEDs nearer to each other run into each other (standard deviations of a spot): what maximum likelihood reads corrects the
    /// track, since simpler bits are too often wrong, and a fit in several steps, since place, width and levels hang together. Higher:
    /// slower.
    pub const BLURRED: f32 = 2.0;
    /// Steps of that fit, at most (count). More: slower, and larger corrections are right.
    pub const BLURRED_STEPS: usize = 6;
    /// Rounds in which levels settle that are wrong by any factor, and places within [`FARTHEST`], at most (count).
    pub const ROUNDS: usize = 3;
    /// What explains more is settled (share of what frames usually explain).
    pub const SETTLED: f32 = 0.9;
    /// The damping of the steps (share of the curvature).
    pub const DAMPING: f32 = 0.05;
}

/// Panels in larger pixels than the frame's.
pub mod coarse {
    /// Samples along a larger pixel's row, at most (count), and a 2, 3 or 4 px wide one has no fewer than that. More:
    /// less noise, and slower.
    pub const SAMPLES_ACROSS: usize = 4;
    /// Samples along a larger pixel's column, at most (count). As above.
    pub const SAMPLES_DOWN: usize = 2;
    /// From one level of the search to the next, pixels grow to so many times their side. Larger: fewer levels, between
    /// whose ranges panels fall.
    pub const LEVEL_SIDE: usize = 4;
    /// The side of the largest panel looked for on a level (larger px): as large as the smallest on the next level, and a
    /// quarter. Larger: slower; smaller: panels fall between two levels.
    pub const LEVEL_SIDE_MAX_PX: f32 = 70.0;
    /// Poses of changed and of busy places tried on a level in a frame (count). More: near panels are found sooner, and
    /// each frame takes longer.
    pub const LEVEL_BUDGET: [u32; 2] = [1, 1];
    /// The widest pitch that is looked at in the frame's own pixels, and the widest in larger ones (larger px). Wider:
    /// slower, and LEDs look like discs, which no spot fits. With the hysteresis it is no more than
    /// [`PITCH_MAX_PX`](super::likelihood::crop::PITCH_MAX_PX), from which the likelihood takes pixels together by itself.
    pub const PITCH_MAX: f32 = 7.2;
    /// Pixels change their size only where the pitch is beyond the limit by more (share). Higher: they change less
    /// often as a panel grows and shrinks.
    pub const HYSTERESIS: f32 = 0.1;
    /// Room around the panel that is drawn in larger pixels, and the part of it that has to be left before it is drawn
    /// anew around another place (pitches). More: farther jumps are followed, and slower.
    pub const ROOM: [f32; 2] = [2.0, 1.0];
}

/// Which of two readings is right, and when cells are made anew.
pub mod reading {
    /// The least pitch that is read (px).
    ///
    /// A square cell holds a pixel centre wherever it lies and however it is turned once its inscribed circle has the
    /// radius √2/2, that is, from a side of √2 px on. 1.5 px keeps a little distance from that.
    pub const MIN_PITCH_PX: f32 = 1.5;
    /// Cells serve poses whose corners differ by less (pitches): noise alone moves them by less, and a cell's mean
    /// hardly notices. Higher: faster, and cells that are off.
    pub const SAME_CELLS: f32 = 0.03;
    /// What a place has to explain more to be taken for the panel's instead of the expected one (share of the light
    /// there).
    pub const CLEARLY: f32 = 0.05;
    /// Room that a panel which should be partly out of the picture has to have where it is seen instead (pitches): for
    /// another line, which is not there. Less: what is left of it is read as a panel a line off.
    pub const LINE_ROOM: f32 = 1.5;
    /// Lines by which a panel that has jumped is moved, at most (count). More: slower where cameras shake.
    pub const LINES_MOVED: usize = 3;
    /// Or what it leaves of what is left at the expected one (share).
    pub const CLEARLY_LEFT: f32 = 0.6;
}

/// Which readings are of one symbol.
pub mod symbols {
    /// The correlation from which a reading is the last symbol again (1 for the same, 0 for another). Higher: symbols
    /// are taken for two; lower: two are taken for one. [`crate::symbols`] computes both.
    pub const REPEAT_CORRELATION: f32 = 0.6;
    /// The correlation of two sure readings up to which they are of two symbols, however soon one follows the other: frames were lost that
    /// nobody counted. Higher: noise makes symbols; lower: one in a hundred such losses, and more, is not seen.
    pub const OTHER_CORRELATION: f32 = 0.3;
    /// By how much the two clocks may disagree (share): rates that are off by 500 ppm are followed, and crystals of 100 ppm beside.
    /// Higher: gaps are counted less surely; lower: symbols are counted twice where a film's rate is off by more.
    pub const CLOCK_TOLERANCE: f64 = 6e-4;
    /// The longest exposure of usual cameras (share of the frame period). Higher: gaps are counted less surely, and chance is taken for two
    /// symbols more often; lower: more frames that catch two have to show that exposures are longer.
    pub const EXPOSURE_USUAL: f64 = 0.1;
    /// The longest exposure that is followed (share of the frame period): with more, hardly a frame shows one symbol.
    pub const EXPOSURE_MAX: f64 = 0.8;
    /// The frames that tell how long exposures are: after so many (count) they count half. Higher: surer; lower: follows a changing camera.
    pub const FRAMES_KEPT: u32 = 128;
    /// The soft value of an LED below which it is doubtful (quarters of a nat). Higher: more symbols are lost that other light makes look
    /// like two; lower: exposures that two symbols shared evenly are taken for one.
    pub const SURE_LLR: u8 = 64;
    /// Doubtful LEDs of a reading that shows a single symbol, at most (count). Higher: as a lower [`SURE_LLR`].
    pub const DOUBTFUL_MAX: usize = 8;
    /// The correlation of a symbol's On LEDs from which a reading shows it and another (1 where all are On, 0 in another symbol). Higher:
    /// noise hides shared exposures; lower: more symbols that only look like one. [`crate::symbols`] computes how many.
    pub const SHARED_ON: f32 = 0.8;
    /// That of its Off LEDs up to which it does (0 where half of them are On, 1 where the symbol is shown alone). Higher: noisy repeats are
    /// taken for shared exposures; lower: shared exposures that add few On LEDs are taken for repeats.
    pub const SHARED_OFF: f32 = 0.5;
    /// LEDs of a symbol known to be On, and known to be Off, from which it can be told in another reading (count). Higher: fewer symbols
    /// can; lower: chance tells.
    pub const SHARED_LEAST: u32 = 20;
}
