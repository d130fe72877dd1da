//! Pose candidates. In the patch around a blob, reduced until single LEDs merge, the evidence is a smooth hill, which a few steps climb
//! from anywhere nearby. A second climb at the frame's own resolution then determines the lines.

use super::blob::Blob;
use super::constellation;
use super::evidence::Evidence;
use super::hill_climbing::{self, Pose};
use super::patch::{PATCH_SIDE, Patch};
use crate::frame::Frame;
use crate::lattice::Lattice;
use crate::spots::SHADE_LEAST_PITCH;
use heapless::Vec;
use link::panel::{LEDS, SIDE};

/// Anything smoother counts as ground in a single frame (pitches, standard deviation). More: boards and gradients remain; less: adjacent
/// LEDs of one state count as ground.
const GROUND_SIGMA: f32 = 1.5;
/// The least pitch in a search of isolated spots (px).
const LEAST_RESOLVED_PX: f32 = 2.2;
/// Places at which the rarer grounds are tried (count). More: slower, and panels on white boards and among shadows are found beside higher
/// peaks.
const SELDOM_PLACES: usize = 8;
/// The least share of the light that spots explain at their first place (share of the energy). Higher: faster, and small panels before
/// moving objects are missed.
const LEAST_SHARE: f32 = 0.12;
/// The same in a single frame without its smooth part, in which spots explain most of what is left of a panel. Higher: faster, and panels
/// before clutter are missed.
const LEAST_SHARE_OF_SPOTS: f32 = 0.3;
/// The step from Off to On over the standard deviation among LEDs of one state, at least (ratio): 64 evenly spread brightnesses, cut in two
/// halves, have 3.5, normal ones 2.7. Higher: faster, and faint panels are missed.
const LEAST_DISTINCT: f32 = 3.4;
/// The widest spots whose brightnesses are meaningful (pitches, standard deviation): between two of [`WIDTHS`]. Wider: faster, and panels
/// out of focus are missed.
const TOLD_APART: f32 = 0.3;
/// The least pitch of panels that are found in shadows (px), because closer LEDs have few pixels between them. Lower: small panels are
/// found, and more of them a line off.
const SHADE_SEARCH_LEAST_PITCH_PX: f32 = 6.5;
/// The size of the patch for isolated spots (multiple of the blob's side). More: LEDs are not resolved; less: lattices beside the blob's
/// middle leave it.
const SPOTS_ROOM: f32 = 1.6;
/// Widths of spots to try at the frame's own resolution (pitches, standard deviation). More: slower, and a more precise width.
const WIDTHS: [f32; 3] = [0.2, 0.34, 0.55];
/// The least width (px): a point under a sharp lens.
const LEAST_SIGMA_PX: f32 = 0.6;
/// Candidates for the pose of one blob, at most (count). More: slower, and a panel's pose is seldom missed.
pub(super) const POSE_CANDIDATES: usize = 6;
/// Side of a panel in the coarsened patch, at least (samples). More: hills are narrower, and may lie unnoticed between the seeds.
const COARSE_SIDE: f32 = 20.0;
/// The blur of the coarsened patch's spots, at least (pitches, standard deviation): LEDs merge. More: hills are wider, and neighbouring
/// lines are harder to distinguish.
const COARSE_SIGMA: f32 = 0.55;
/// The size of the fine patch (multiple of the blob's side). More: coarser samples; less: lattices off by a line leave it.
const FINE_ROOM: f32 = 1.3;
/// The ratio of the box around a lattice to its side, above which the fine patch grows in proportion: that of a square turned by 23°.
/// Lower: coarser samples; higher: lattices off by a line leave it.
const FINE_BOX: f32 = 1.31;
/// The size of the patch for the search around a followed panel (multiple of the panel's side). More: farther, and coarser.
const NEAR_ROOM: f32 = 2.6;
/// Seeds to either side in it (count). More: farther and slower.
const NEAR_STEPS: i32 = 10;
/// The distance between these seeds (pitches). Longer: farther, and hills may lie unnoticed between them.
const NEAR_STEP: f32 = 0.6;
/// √λ of the evidence: the assumed faintness of LEDs relative to the noise (share of a spot's energy). Higher: overlapping spots share less
/// of each other's light.
const RIDGE: f32 = 0.1;
/// The part of a patch that counts as noise besides the camera's, because spots of equal width on an even ground do not explain it (share
/// of the patch's contrast). Higher: hills are flatter, and the best pose is less certain.
const MISMATCH: f32 = 0.1;
/// Sizes of the seeds (logarithm of the ratio to the blob's). More, here and in the next two: slower, and fewer hills are missed.
const SCALES: [f32; 3] = [-0.15, 0.0, 0.15];
/// Rotations of the seeds (rad): over a right angle, the period of a lattice.
const ROLLS_RAD: [f32; 11] = [-0.21, -0.07, 0.07, 0.21, -0.35, 0.35, -0.49, 0.49, -0.63, 0.63, 0.78];
/// Centres of the seeds along either axis (pitches).
const SHIFTS: [f32; 3] = [-0.6, 0.0, 0.6];
/// The seeds are narrower than high by this (logarithm of the ratio): halfway to a panel seen from 30° to the side.
const FORESHORTENING: f32 = 0.06;
/// A climb's first step (pitches) and most rounds (count), from a seed. Longer steps leave the hill; shorter ones and fewer rounds do not
/// reach its top.
const FROM_SEED: (f32, usize) = (0.3, 25);
/// The same in the search around a followed panel.
const NEAR: (f32, usize) = (0.3, 12);
/// The same at the frame's own resolution.
const FINE: (f32, usize) = (0.12, 40);
/// The same for each width of spots, before the best of them is known.
const FIRST_OF_A_WIDTH: (f32, usize) = (0.12, 8);

/// A view of a place in one frame, or in the difference of two.
#[derive(Clone, Copy)]
pub(super) struct View<'a, 'f> {
    pub frame: &'a Frame<'f>,
    pub earlier: Option<&'a Frame<'f>>,
    /// Standard deviation of a pixel's noise in one frame.
    pub noise_grey: f32,
    /// Standard deviation of one LED's image.
    pub spot_sigma_px: f32,
    pub ground: Ground,
    /// Whether panels may be so near that perspective is visible.
    pub is_near: bool,
}

/// The ground to remove from a single frame; the difference of two frames has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ground {
    /// The level around the blob.
    Around,
    /// The smooth part.
    Smooth,
    /// Edges too: all but bright spots.
    Edges,
    /// All but dark spots, such as Off LEDs on a white board.
    Holes,
}

impl Ground {
    /// The number of busiest places at which it is tried if `places` are searched.
    pub fn places(self, places: usize) -> usize {
        match self {
            Self::Around | Self::Edges => places,
            Self::Smooth | Self::Holes => places.min(SELDOM_PLACES),
        }
    }

    fn leaves_only_spots(self) -> bool {
        matches!(self, Self::Edges | Self::Holes)
    }
}

impl View<'_, '_> {
    fn patch(&self, blob: &Blob, step: usize) -> Patch {
        let mut patch = Patch::of(self.frame, self.earlier, blob.centre, step);
        let pitch = blob.side_px / 8.0 / step as f32;
        match self.ground {
            _ if self.earlier.is_some() => {}
            Ground::Around => patch.level_around(),
            Ground::Smooth => patch.without_ground(GROUND_SIGMA * pitch),
            Ground::Edges => patch.spots_only((0.5 * pitch) as usize),
            Ground::Holes => {
                patch.negate();
                patch.spots_only((0.5 * pitch) as usize);
            }
        }
        patch
    }

    /// The evidence of spots with that standard deviation in samples, widened by `blur`.
    fn evidence(&self, patch: &Patch, sigma: f32, own_sigma: f32) -> Evidence {
        let step = patch.step as f32;
        let frames = if self.earlier.is_some() { core::f32::consts::SQRT_2 } else { 1.0 };
        let noise = frames * self.noise_grey / step + MISMATCH * patch.contrast();
        Evidence::new(patch, own_sigma, sigma, noise, RIDGE)
    }

    /// The trials for a pose, one after another: widths of spots, and the scope of the comparison.
    pub fn trials(&self, start: &Lattice) -> Vec<Trial, 2> {
        let [across, down] = start.pitch();
        let told = Vec::from([self.spot_sigma_px]);
        let any = Vec::from(WIDTHS.map(|width| width * across.min(down)));
        let trial = |widths_px, scope| Trial { widths_px, scope };
        match (self.earlier, self.ground) {
            (Some(_), _) => [trial(told, Scope::Change), trial(any, Scope::Change)].into(),
            (None, Ground::Around) => [trial(told, Scope::Ground), trial(any, Scope::Board)].into(),
            (None, _) => [trial(any, Scope::Board)].into_iter().collect(),
        }
    }

    /// The least share of the light that spots have to explain at their first place.
    pub fn least_share(&self) -> f32 {
        match self.ground {
            _ if self.earlier.is_some() => LEAST_SHARE,
            Ground::Around => LEAST_SHARE,
            Ground::Smooth | Ground::Edges | Ground::Holes => LEAST_SHARE_OF_SPOTS,
        }
    }

    /// Whether the LEDs of a panel of the blob's size are resolved as isolated spots.
    pub fn resolves(&self, blob: &Blob) -> bool {
        let any = self.earlier.is_some() || !self.ground.leaves_only_spots();
        any || blob.side_px >= 8.0 * LEAST_RESOLVED_PX
    }

    /// Whether only isolated spots are left of the frame.
    pub fn leaves_only_spots(&self) -> bool {
        self.earlier.is_none() && self.ground.leaves_only_spots()
    }

    /// The candidates for the pose of a blob, computed one by one: the evidence's maxima.
    pub fn pose_candidates(self, blob: Blob) -> impl Iterator<Item = Lattice> {
        core::iter::once_with(move || self.climb_starts(&blob).into_maxima()).flatten()
    }

    /// The lattice of the spots in a blob.
    pub fn on_spots(&self, blob: &Blob) -> Option<Lattice> {
        let step = (libm::ceilf(blob.side_px * SPOTS_ROOM / PATCH_SIDE as f32) as usize).max(1);
        let patch = self.patch(blob, step);
        constellation::lattice(&patch).map(|lattice| patch.to_frame_lattice(&lattice.most_upright()))
    }

    fn climb_starts(&self, blob: &Blob) -> ClimbStarts {
        let step = ((blob.side_px / COARSE_SIDE) as usize).max(1);
        let patch = self.patch(blob, step);
        let pitch = blob.side_px / 8.0 / step as f32;
        let sigma = (self.spot_sigma_px / step as f32).max(COARSE_SIGMA * pitch);
        let evidence = self.evidence(&patch, sigma, self.spot_sigma_px / step as f32);
        let mut seeds = Ranking::default();
        for scale in SCALES {
            let log_pitch = libm::logf(pitch) + scale;
            let log_pitch = [log_pitch - FORESHORTENING, log_pitch];
            let overlap = evidence.overlap(log_pitch.map(libm::expf));
            for pose in grid(patch.to_samples(blob.centre), pitch, log_pitch) {
                seeds.offer(evidence.of_overlapping(&pose.lattice(), &overlap), pose);
            }
        }
        ClimbStarts { evidence, patch, seeds }
    }

    /// The likeliest pose with the shape of `expected`, its centre up to about a panel's width from there.
    pub fn near(&self, expected: &Lattice) -> Option<Lattice> {
        let [across, down] = expected.pitch();
        let blob = Blob {
            centre: expected.centre,
            side_px: 8.0 * across.max(down),
        };
        let step = (libm::ceilf(blob.side_px * NEAR_ROOM / PATCH_SIDE as f32) as usize).max(1);
        let patch = self.patch(&blob, step);
        let pitch = across.max(down) / step as f32;
        let evidence = self.evidence(
            &patch,
            (self.spot_sigma_px / step as f32).max(COARSE_SIGMA * pitch),
            self.spot_sigma_px / step as f32,
        );
        let pose = Pose::new(
            patch.to_samples(expected.centre),
            [across, down].map(|pitch| libm::logf(pitch / step as f32)),
            libm::atan2f(expected.column[1], expected.column[0]),
        );
        let overlap = evidence.overlap(pose.pitch);
        let mut best: Option<(f32, Pose)> = None;
        for (x, y) in (-NEAR_STEPS..=NEAR_STEPS).flat_map(|x| (-NEAR_STEPS..=NEAR_STEPS).map(move |y| (x, y))) {
            let moved = [x, y].map(|c| c as f32 * NEAR_STEP * pitch);
            let pose = pose.at([pose.centre[0] + moved[0], pose.centre[1] + moved[1]]);
            if let Some(value) = evidence.of_overlapping(&pose.lattice(), &overlap)
                && best.is_none_or(|best| value > best.0)
            {
                best = Some((value, pose));
            }
        }
        let (_, pose) = hill_climbing::climb(&evidence, best?.1, NEAR)?;
        let near = patch.to_frame_lattice(&pose.lattice());
        self.sharpened(&near, &[self.spot_sigma_px], 0.0).map(|sharpened| sharpened.lattice)
    }

    /// The pose near `start`, if it explains enough for a verification.
    pub fn promising(&self, start: &Lattice, widths_px: &[f32], scope: Scope) -> Option<SharpPose> {
        let pose = self.sharpened(start, widths_px, self.least_share())?;
        (scope == Scope::Change || pose.is_of_two_brightnesses()).then_some(pose)
    }

    /// The pose near `start` at the frame's own resolution, and its spots, with one of these standard deviations; `None` if they explain a
    /// smaller share of the light.
    pub fn sharpened(&self, start: &Lattice, widths_px: &[f32], least_share: f32) -> Option<SharpPose> {
        let [across, down] = start.pitch();
        let blob = Blob {
            centre: start.centre,
            side_px: 8.0 * across.max(down),
        };
        let [width, height] = start.extent(0.0);
        let width_over_side = width.max(height) / ((SIDE - 1) as f32 * across.max(down));
        let room = FINE_ROOM * (width_over_side / FINE_BOX).max(1.0);
        let step = (libm::ceilf(blob.side_px * room / PATCH_SIDE as f32) as usize).max(1);
        let patch = self.patch(&blob, step);
        let step = step as f32;
        let pitch = [across, down].map(|pitch| pitch / step);
        let pose = Pose::new(
            patch.to_samples(start.centre),
            pitch.map(libm::logf),
            libm::atan2f(start.column[1], start.column[0]),
        );
        // Only the pose of each width is kept, because the evidence is large for a small stack.
        let mut best: Option<(f32, Pose, f32)> = None;
        for &width_px in widths_px {
            let sigma = width_px.max(LEAST_SIGMA_PX) / step;
            let evidence = self.evidence(&patch, sigma, sigma);
            let Some((value, pose)) = hill_climbing::climb(&evidence, pose, FIRST_OF_A_WIDTH) else {
                continue;
            };
            if best.as_ref().is_none_or(|best| value > best.0) {
                best = Some((value, pose, sigma));
            }
        }
        let (_, pose, sigma) = best?;
        let evidence = self.evidence(&patch, sigma, sigma);
        if least_share > 0.0 && evidence.share(&patch, &pose.lattice())? < least_share {
            return None;
        }
        let (value, pose) = hill_climbing::explore(&evidence, pose, FINE)?;
        // Poses have right angles; a leaning start may be better.
        let leaning = start.scaled(patch.to_samples(start.centre), 1.0 / step);
        let lattice = match evidence.of(&leaning) {
            Some(other) if other > value => leaning,
            _ => pose.lattice(),
        };
        Some(SharpPose {
            brightness: evidence.brightness(&lattice)?,
            lattice: patch.to_frame_lattice(&lattice),
            spot_sigma_px: sigma * step,
        })
    }
}

/// The part of the image to compare a lattice with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// The change between two frames, in which all that stands still cancels.
    Change,
    /// A single frame in which the ground between the LEDs continues around them.
    Ground,
    /// A single frame as far as a board is sure to reach, without its surroundings.
    Board,
    /// The same, without the shadows on the board.
    ShadedBoard,
}

impl Scope {
    pub fn is_single(self) -> bool {
        self != Self::Change
    }

    pub fn is_board(self) -> bool {
        matches!(self, Self::Board | Self::ShadedBoard)
    }
}

/// One way to try a pose.
pub(super) struct Trial {
    /// Candidate standard deviations of the spots; the likeliest wins.
    pub widths_px: Vec<f32, 3>,
    pub scope: Scope,
}

/// A pose at the frame's own resolution.
pub(super) struct SharpPose {
    pub lattice: Lattice,
    /// The brightness of its LEDs.
    pub brightness: [f32; LEDS],
    /// The approximate standard deviation of one LED's image.
    pub spot_sigma_px: f32,
}

impl SharpPose {
    /// Whether its LEDs have two brightnesses rather than any. True for overlapping spots, whose brightnesses are not meaningful.
    pub fn is_of_two_brightnesses(&self) -> bool {
        let [across, down] = self.lattice.pitch();
        if self.spot_sigma_px > TOLD_APART * across.min(down) {
            return true;
        }
        self.distinctness() > LEAST_DISTINCT
    }

    /// Whether its LEDs are so distinct, and the ground is so visible between them, that only shadows on the board may prevent a fit.
    pub fn may_be_shaded(&self) -> bool {
        let [across, down] = self.lattice.pitch();
        across.min(down) > SHADE_SEARCH_LEAST_PITCH_PX.max(SHADE_LEAST_PITCH * self.spot_sigma_px) && self.distinctness() > LEAST_DISTINCT
    }

    fn distinctness(&self) -> f32 {
        distinctness(&self.brightness, &two_states(&self.brightness))
    }
}

/// The evidence around a blob, with the poses to climb it from.
pub(super) struct ClimbStarts {
    evidence: Evidence,
    patch: Patch,
    seeds: Ranking,
}

impl ClimbStarts {
    /// The evidence's maxima as lattices in the frame's pixels.
    fn into_maxima(self) -> impl Iterator<Item = Lattice> {
        let Self { evidence, patch, seeds } = self;
        seeds.0.into_iter().filter_map(move |(_, seed)| {
            let (_, pose) = hill_climbing::climb(&evidence, seed, FROM_SEED)?;
            Some(patch.to_frame_lattice(&pose.lattice().most_upright()))
        })
    }
}

/// Poses with their evidence, the best first.
#[derive(Default)]
struct Ranking(Vec<(f32, Pose), POSE_CANDIDATES>);

impl Ranking {
    fn offer(&mut self, value: Option<f32>, pose: Pose) {
        let Some(value) = value else { return };
        let place = self.0.iter().position(|other| other.0 < value).unwrap_or(self.0.len());
        if self.0.is_full() && place < self.0.len() {
            self.0.pop();
        }
        // If the list is full, this fails only for the worst.
        let _worst = self.0.insert(place, (value, pose));
    }
}

/// Poses of one size around a centre: any rotation, and centres up to 0.6 pitches away, with the spacing of a hill's width.
fn grid(centre: [f32; 2], pitch: f32, log_pitch: [f32; 2]) -> impl Iterator<Item = Pose> {
    ROLLS_RAD.into_iter().flat_map(move |roll_rad| {
        let pose = Pose::new(centre, log_pitch, roll_rad);
        SHIFTS
            .into_iter()
            .flat_map(move |x| SHIFTS.map(move |y| pose.at([centre[0] + x * pitch, centre[1] + y * pitch])))
    })
}

/// The states of LEDs by brightness: 1 above and 0 below halfway between their two groups.
pub(super) fn two_states(brightness: &[f32; LEDS]) -> [i8; LEDS] {
    let mean = |of: &dyn Fn(f32) -> bool| {
        let (sum, count) = brightness
            .iter()
            .filter(|&&b| of(b))
            .fold((0.0, 0.0f32), |(sum, n), b| (sum + b, n + 1.0));
        sum / count.max(1.0)
    };
    let mut middle = mean(&|_| true);
    for _ in 0..ROUNDS {
        middle = 0.5 * (mean(&|b| b > middle) + mean(&|b| b <= middle));
    }
    brightness.map(|b| i8::from(b > middle))
}

/// The states of LEDs by change: 1 or −1 if it exceeds half of the average change among those that changed, otherwise 0.
pub(super) fn three_states(change: &[f32; LEDS]) -> [i8; LEDS] {
    let mut level = change.iter().fold(0.0f32, |most, c| most.max(c.abs()));
    for _ in 0..ROUNDS {
        let (sum, count) = change
            .iter()
            .filter(|c| c.abs() > 0.5 * level)
            .fold((0.0, 0.0f32), |(sum, n), c| (sum + c.abs(), n + 1.0));
        level = sum / count.max(1.0);
    }
    change.map(|c| i8::from(c > 0.5 * level) - i8::from(c < -0.5 * level))
}

/// The separation of LEDs of different states, in brightness or in change: the least step from one state to the next over the standard
/// deviation within states.
pub(super) fn distinctness(brightness: &[f32; LEDS], states: &[i8; LEDS]) -> f32 {
    let (mut squares, mut least, mut below) = (0.0, f32::INFINITY, None);
    for state in [-1, 0, 1] {
        let members = || brightness.iter().zip(states).filter(|&(_, &of)| of == state).map(|(b, _)| *b);
        let count = members().count() as f32;
        if count == 0.0 {
            continue;
        }
        let mean = members().sum::<f32>() / count;
        squares += members().map(|b| (b - mean) * (b - mean)).sum::<f32>();
        least = below.map_or(least, |below| least.min(mean - below));
        below = Some(mean);
    }
    let distinctness = least / libm::sqrtf(squares / LEDS as f32 + 1e-6);
    // NaN if there are no two states.
    distinctness.max(0.0)
}

/// Rounds until 64 values in two groups settle.
const ROUNDS: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use link::scramble::split_mix64;

    #[test]
    fn two_brightnesses_are_told_from_any() {
        let sharpened = |spread: f32, spot_sigma_px: f32| {
            let even = |led: usize, salt: u64| (split_mix64(salt << 32 | led as u64) >> 40) as f32 / (1 << 24) as f32 - 0.5;
            let on = |led: usize| if even(led, 1) > 0.0 { 1.0 } else { 0.0 };
            SharpPose {
                lattice: Lattice::turned([50.0; 2], 6.0, 6.0, 0.1),
                brightness: core::array::from_fn(|led| on(led) + spread * even(led, 2)),
                spot_sigma_px,
            }
        };
        assert!(sharpened(0.8, 1.2).is_of_two_brightnesses());
        assert!(!sharpened(2.0, 1.2).is_of_two_brightnesses());
        // Overlapping spots pass, whatever their brightnesses.
        assert!(sharpened(2.0, 2.4).is_of_two_brightnesses());
    }
}
