//! The bits that make a frame likeliest. All likelihoods are in nats.

/// Which pixels are looked at.
pub mod crop {
    /// Pixels beyond the cells (px), where the frame has them: what the blur carries there tells of the outermost LEDs,
    /// and of the background. More: slower, and what stands around the panel counts.
    pub const RIM_PX: f32 = 2.0;
    /// What is around the cells is plain if the mean square that is left there is at most this (multiple of that in the
    /// cells). Higher: what stands around counts; lower: noise hides that nothing does.
    pub const PLAIN: f32 = 1.5;
    /// It is looked at anew after so many (frames).
    pub const LOOK_AROUND_FRAMES: u32 = 8;
    /// The widest pitch that is looked at pixel by pixel (px): farther apart, larger pixels say as much. Wider: slower.
    pub const PITCH_MAX_PX: f32 = 8.0;
    /// Spots are looked at in larger pixels until their standard deviation is at most this (px), as larger pixels say as
    /// much. Wider: slower, and spots are cut off where they should not be.
    pub const SIGMA_MAX_PX: f32 = 2.4;
    /// But not in such that LEDs would be nearer (px).
    pub const WIDE_PITCH_MIN_PX: f32 = 2.6;
    /// The part of the pixels at grey 255 from which light is no longer linear in the bits (share). Higher: sets of
    /// flips are listed by a form that saturation bends; lower: fewer sets are looked at.
    pub const OVEREXPOSED: f32 = 0.2;
    /// Of the 49 places between four LEDs, so many at grey 255 make the ground white (count). Fewer: LEDs that run together count
    /// as ground; more: a hot or dead pixel, or clutter, hides that it is.
    pub const FULL_GROUND: usize = 45;
    /// Nearer LEDs run together where they are overexposed, and what is between them is no ground (px of the image).
    pub const APART_PX: f32 = 4.0;
}

/// The first guess: the light of the 64 LEDs by least squares, in rounds of Gauss and Seidel's method.
pub mod least_squares {
    /// Rounds, at most (count).
    pub const ROUNDS: usize = 20;
    /// No more rounds are made where no LED's light changes by more (share of the range of all). Lower: slower.
    pub const SETTLED: f32 = 0.01;
    /// What is added to the diagonal (share of it): the closer LEDs are, the less their difference can be told from
    /// noise. Higher: less contrast; lower: more noise.
    pub const RIDGE: f32 = 0.05;
}

/// A ground under the LEDs that is not plain: a surface of second order in that light.
pub mod ground {
    /// Where LEDs of one state differ by less, the ground is plain (standard deviation, share of the step from Off to On). Lower:
    /// slower.
    pub const CLEAR: f32 = 0.1;
    /// Rounds of telling the surface and the bits from each other (count). More: slower.
    pub const ROUNDS: usize = 8;
    /// What a surface leaves of the LEDs' light, at most (share of what two states alone leave). Higher: noise looks like a
    /// surface, which has five unknowns more.
    pub const UNEVEN: f32 = 0.5;
}

/// Interference cancellation and likelihood ascent, from that guess to bits that no single flip makes likelier.
pub mod search {
    /// The variance of root light that is assumed of a first frame.
    pub const FIRST_NOISE: f32 = 1e-3;
    /// Blurs that a first search may begin with beside the one that is told (px), in rising order. More of them: slower.
    pub const FIRST_BLURS_PX: [f32; 5] = [0.7, 1.1, 1.7, 2.5, 3.6];
    /// The widest spots of which neighbours can be told apart (variance over the squared pitch).
    pub const VARIANCE_PITCH: f32 = 0.5;
    /// Searches begin at these multiples of the contrast found: least squares shrink it, and saturation does. More of
    /// them: slower.
    pub const FIRST_CONTRASTS: [f32; 2] = [1.0, 1.6];
    /// Sweeps over the LEDs before the levels are fitted (count).
    pub const FIRST_SWEEPS: usize = 3;
    /// Fits of the levels, each with sweeps, at most (count). More: slower.
    pub const ROUNDS: usize = 5;
    /// Sweeps over the LEDs in each (count).
    pub const SWEEPS: usize = 2;
    /// LEDs so close to On or Off are decided on (share of the exposure). Higher: faster, and less sure.
    pub const DECIDED: f32 = 0.02;
    /// The offset under the root follows the noise by steps of this (share). Smaller: the frame is taken in more often.
    pub const OFFSET_STEP: f32 = 0.2;
    /// Rounds of flipping single LEDs, at most (count): an ascent has always ended in far fewer.
    pub const ASCENT_ROUNDS: usize = 12;
    /// Rounds of flipping groups of neighbours, at most (count): one or two do, but levels that are fitted in between
    /// may take back what flips gained, without end.
    pub const NEIGHBOUR_ROUNDS: usize = 32;
    /// LEDs of such a group, at most (count). More: slower.
    pub const NEIGHBOURS: usize = 4;
    /// Smaller gains are rounding (nats).
    pub const LEAST_GAIN: f32 = 1e-2;
}

/// Flips of many LEDs at once, and the soft values.
pub mod flip_search {
    use link::panel::LLR_STEP;

    /// If the flips of any LEDs cost more, none need be tried (nats): all soft values are at their ends.
    pub const CLEAR: f32 = 127.0 * LLR_STEP;
    /// What is left of an LED's image counts up to this for how well the model fits (multiple of the noise). Higher: a single
    /// broken LED makes all others doubtful.
    pub const MISFIT_MAX: f32 = 100.0;
    /// Where all flips cost more than this, no misfit makes them doubtful (nats).
    pub const BEYOND_DOUBT: f32 = MISFIT_MAX * CLEAR;
    /// Rounds, at most (count). More: slower, and fewer wrong bits where LEDs overlap.
    pub const ROUNDS: usize = 12;
    /// Sets of flips tried in a round (count).
    pub const TRIES: usize = 4;
    /// LEDs of a group that grows by couplings, at most (count).
    pub const GROUP_LEDS: usize = 8;
    /// Sets that the sphere decoder keeps (count). More: slower, and fewer wrong bits and surer soft values where LEDs
    /// overlap.
    pub const LIST_SETS: usize = 64;
    /// Sets that cost more than the bits found so far by this much are given up (nats): so sure a soft value need not
    /// be. Lower: faster, and bits on which all sets agree lose their soft values.
    pub const LIST_MARGIN: f32 = 24.0;
    /// So many wrong bits of a panel (count, as its soft values have it) are the whole doubt that the list holds; with so many, it holds
    /// [`DOUBT_LISTED`] of what there is, and no less with more. Lower: soft values are less sure than they may be; higher: surer.
    pub const LIST_HOLDS: [f32; 2] = [1.0, 3.0];
    /// What doubtful soft values are worth then (share). Lower, higher: as before. It leaves least surprise over 16 noisy and crowded
    /// scenes.
    pub const DOUBT_LISTED: f32 = 0.4;
}

/// The levels' fit to a frame.
pub mod fitting {
    use core::ops::RangeInclusive;

    /// A usual deviation of the spots' variance (share), where no earlier frame has told it; no step is longer. Wider:
    /// a frame that says little of the blur changes it more.
    pub const USUAL_VARIANCE: f32 = 0.5;
    /// The same of the LEDs' places (px).
    pub const USUAL_SHIFT_PX: f32 = 0.2;
    /// The spots' variance (px²).
    pub const VARIANCE_PX2: RangeInclusive<f32> = 0.2..=20.0;
    /// The most that one step shifts the LEDs (px).
    pub const SHIFT_MAX_PX: f32 = 0.5;
    /// The darkest background (light, 1 at middle grey).
    pub const BACKGROUND_MIN: f32 = 1e-4;
    /// What is added to the diagonal of what is scaled to ones there: f32 can tell no less.
    pub const RIDGE: f32 = 1e-4;
    /// Levels that follow flips by more are no longer linear in them (share of the contrast).
    pub const TRUSTED: f32 = 0.03;
}

/// What earlier frames tell of the levels.
pub mod level_prior {
    /// Levels are averaged over about so many (frames). More: surer, and changes of light are followed later.
    pub const MEMORY_FRAMES: u32 = 64;
    /// After more that do not fit, all is forgotten (frames in a row).
    pub const MISFITS_MAX: u32 = 4;
    /// A frame fits if its noise is at most this (multiple of what it was). Higher: mixtures of symbols pass for one.
    pub const NOISIER: f32 = 1.3;
    /// What was learnt in frames of more noise was learnt from a worse fit (multiple of a frame's).
    pub const QUIETER: f32 = 2.0;
    /// After so many the noise is known (frames).
    pub const FRAMES_MIN: u32 = 4;
    /// The levels' deviations, at least: of background, Off, contrast, variance (share; Off in terms of the contrast), x
    /// and y (px). Less: a changed frame is held to the levels of others.
    pub const LEAST_SPREAD: [f32; 6] = [0.004, 0.008, 0.008, 0.004, 0.1, 0.1];
    /// Those after the first frame.
    pub const FIRST_SPREAD: [f32; 6] = [0.1, 0.3, 0.3, 0.1, 0.2, 0.2];
    /// Levels known so well are sure (share of the contrast): then panels are read whose LEDs are all alike.
    pub const SURE: f32 = 0.1;
    /// How far beside the usual levels searches begin too, where these are not sure (standard deviations).
    pub const SPREAD: f32 = 1.2;
    /// What is added to the variance of what is scaled to variance 1: f32 can tell no less.
    pub const RIDGE: f32 = 1e-4;
    /// LEDs of either kind in a panel of which levels are learnt, at least (count).
    pub const LEARN_LEDS: u32 = 8;
    /// How sure its bits are on the average, at least (nats). Lower: levels are learnt from wrong bits.
    pub const LEARN_LLR: f32 = 1.0;
}

/// What is learnt of the camera.
pub mod camera {
    /// The least blur by which its deviation is reckoned from that of the spots' variance (px).
    pub const BLUR_MIN: f32 = 0.3;
}

/// Which curve the camera encodes light by.
pub mod curve {
    /// The exponents that are tried. More of them: a curve is learnt the later, and nearer ones are hard to tell apart and change few bits.
    pub const GAMMAS: [f32; 5] = [1.0, 1.4, 1.8, 2.2, 2.6];
    /// How sure a frame's bits are that is held against other curves, at least (share that is expected to be right). Lower: wrong bits and
    /// wrong places are explained by curves.
    pub const CONFIDENCE_MIN: f32 = 0.95;
    /// Fits of the levels under another curve (count). Fewer: faster, and other curves look worse than they are.
    pub const FITS: usize = 2;
    /// Each curve is tried so often before the best of them is tried again (frames). Fewer: by chance that is not the best.
    pub const FIRST_FRAMES: u32 = 2;
    /// A curve is taken after so many frames in which it was tried, at least (frames).
    pub const FRAMES_MIN: u32 = 3;
    /// Frames in which a curve is tried, at most (frames). More: the first frames are slower for longer.
    pub const FRAMES_MAX: u32 = 32;
    /// By how many of its own standard deviations a curve's gain differs from none, at least. Higher: curves are learnt later; lower: by
    /// chance.
    pub const DEVIATIONS: f32 = 4.0;
    /// What a better curve may lose of what is expected in one unit (share of what it gains). Higher: a codec's or filter's errors are
    /// taken for a curve.
    pub const LOSS_MAX: f32 = 0.2;
    /// A curve under which frames are less likely by this is tried no more (nats).
    pub const GIVEN_UP: f32 = 32.0;
}

/// Two symbols in one exposure, of which α is the part of the one that begins.
pub mod mixture {
    use core::ops::RangeInclusive;

    /// If two symbols share an exposure, some LED's flip costs less (nats): where α of it is the other symbol's, α² of a
    /// flip's cost becomes noise of half the LEDs, so that a flip costs about 2·(1 − 2α)/α² times half the pixels of an
    /// LED, 10 to 30. Below α = 1/8 the bits are certain all the same.
    pub const MIXED: f32 = 1000.0;
    /// Fits of α and the levels, each with sweeps (count).
    pub const ROUNDS: usize = 6;
    /// Sweeps over the LEDs in each (count).
    pub const SWEEPS: usize = 2;
    /// α; beyond it is one symbol's exposure (share).
    pub const SHARE: RangeInclusive<f32> = 0.03..=0.97;
    /// Half the width of the parabola by which α is improved (share).
    pub const PARABOLA: f32 = 0.02;
    /// The most that one step changes α (share).
    pub const STEP_MAX: f32 = 0.2;
    /// What two symbols leave, at most (share of the noise that one leaves): they have 65 unknowns more. Higher: noise
    /// is taken for a second symbol.
    pub const LEFT: f32 = 0.87;
    /// What leaves less is explained, even where other frames left less still (share of the noise that one leaves).
    pub const NEXT_TO_NOTHING: f32 = 0.25;
    /// How well the symbol that ended agrees with the one known before, at least (correlation): a panel in other light
    /// looks like two symbols too, but the first then is anything.
    pub const SAME: f32 = 0.5;
}

/// Lines that are read out one after another, so that α grows from line to line.
pub mod lines {
    /// The greatest time between two lines that is reckoned with (exposures).
    pub const LINE_DELAY_MAX: f32 = 2.0;
    /// By how much α may differ between a panel's middle and its ends, to begin with where nothing is known. More of them: slower.
    pub const SPREADS: [f32; 5] = [0.15, 0.35, 0.8, 1.8, 4.0];
    /// As many, read from above and from below.
    pub const SLOPES: usize = 2 * SPREADS.len();
    /// Values of α in the panel's middle that are tried with each (count).
    pub const MIDDLES: usize = 32;
    /// Half the width of the parabola by which the slope is improved (share of it).
    pub const LINE_STEP: f32 = 0.05;
    /// The most that one step changes the slope (share of it).
    pub const SLOPE_STEP_MAX: f32 = 0.4;
    /// How far what a person tells may be off (share of it, one standard deviation).
    pub const TOLD_UNSURE: f32 = 0.3;
    /// How far what a frame shows may be off beyond what noise explains (share of it, one standard deviation).
    pub const SEEN_UNSURE: f32 = 0.1;
    /// What earlier frames say of the slope is kept from one to the next (share): exposures change with the light. Higher: surer.
    pub const KEEP: f32 = 0.9;
    /// After so many changes that all lines saw at once, all lines are exposed at once (frames).
    pub const AT_ONCE_FRAMES: u32 = 8;
    /// As far as panels up to this height can show (multiple of that of the highest that showed one).
    pub const HIGHER: f32 = 1.5;
    /// A change crosses a panel within a row or two of LEDs where α would differ by so much between its middle and its ends.
    pub const STEEP: f32 = 1.5;
    /// By how much α differs so where nothing but a clean edge was seen.
    pub const STEP_ROWS: f32 = 7.0;
    /// A change that nearly has a clean edge may have caught LEDs that are so near to it (share of half the panel): a row.
    pub const BESIDE: f32 = 0.25;
    /// Places of an edge that are looked at, one less (count).
    pub const EDGES: usize = 16;
    /// How much likelier an LED that agrees is its symbol's than one by chance (nats): wrong in one of 50.
    pub const SAME_NATS: f32 = 0.67;
    /// How much less likely one that does not (nats).
    pub const OTHER_NATS: f32 = 3.2;
    /// What it takes to see two symbols in a clean reading (nats): where nothing is known of the lines, and where they are known to be
    /// that slow. Lower: chance is taken for a part of the symbol before.
    pub const SPLIT: f32 = 15.0;
    /// How far the steepness of a clean edge may be off (share of it, one standard deviation).
    pub const EDGE_UNSURE: f32 = 0.7;
    /// See [`SPLIT`].
    pub const SPLIT_KNOWN: f32 = 4.0;
    /// How sure an LED must be read to tell whether it is the symbol's before (nats).
    pub const TELLING_NATS: f32 = 4.0;
    /// LEDs that differ from the symbol before in the rest of the reading, at least (count).
    pub const DIFFER: u32 = 2;
}

/// What is learnt of single LEDs.
pub mod leds {
    use core::ops::RangeInclusive;

    /// Light that is neither On nor Off (contrasts).
    pub const BETWEEN: RangeInclusive<f32> = 0.25..=0.75;
    /// More LEDs of such light are a mixture of symbols (count).
    pub const BETWEEN_MAX: usize = 18;
    /// Panels that are remembered, so that they do not count twice (count).
    pub const SEEN_PANELS: usize = 16;
    /// A panel is new if so many LEDs differ from each of those (count).
    pub const NEW_LEDS: u32 = 16;
    /// The light of LEDs is averaged over about so many new panels (count).
    pub const MEMORY_PANELS: u32 = 48;
    /// LEDs are not measured in images of which more is saturated (share): how bright they are does not show there.
    pub const SATURATED_MAX: f32 = 0.05;
    /// After so many, LEDs have levels of their own (count).
    pub const LEARN_PANELS: u32 = 5;
    /// After so many without any change, an LED is broken (count): a sound one stays as it is so long once in 2¹⁵.
    pub const BROKEN_PANELS: u32 = 16;
    /// How LEDs of one panel differ in brightness (share). Lower: they are held to be more alike.
    pub const SPREAD: f32 = 0.15;
    /// By how much moments beyond the first are less sure (per contrast² of noise). Lower: in noise, LEDs get levels that are
    /// not theirs.
    pub const HIGH_MOMENTS: f32 = 20.0;
    /// Gains so near to 1 need no proof (share).
    pub const USUAL_GAIN: f32 = 0.35;
    /// LEDs of other gains must have been in either state in more panels than this (count): one may have been a mixture.
    pub const SEEN_IN_BOTH: f32 = 1.5;
    /// Levels nearer to each other are one (contrasts).
    pub const GAP_MIN: f32 = 0.15;
    /// Light beyond is cut off there (contrasts): it is no LED's.
    pub const LIT_MAX: f32 = 3.0;
    /// The most skewed that levels are taken to be (no unit): one state in a dozen panels.
    pub const SKEWNESS_MAX: f32 = 3.0;
    /// Sweeps over the LEDs in which their light is measured (count).
    pub const LIGHT_SWEEPS: usize = 2;
    /// Light is measured in every so many frames once the LEDs are known (frames).
    pub const EVERY_FRAMES: u32 = 4;
}
