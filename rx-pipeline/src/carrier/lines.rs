//! A carrier seen by a rolling shutter: its phase grows with time and from line to line.
//!
//! An LED's light differs from its mean by a·b·c, with the unknown bit b = ±1 and the contrast c = S(φ) at the phase φ = f·t + κ·y + φ₀ of
//! its line y at the frame's time t. The square does not depend on the bit: c² is about (1 + cos 4πφ)/2, a plane wave over time and lines
//! with twice the frequency and twice the slope. [`Lines::search`] looks for that wave in the squares of the last frames' light. Half of
//! the wave's phase is φ up to half a cycle. This leaves open whether every second frame has the other sign and, if rows of LEDs are
//! equally far apart, whether every second row has. The sync panel and frames of the same symbol decide.

use super::fit::step;
use super::history::{FRAMES, is_steady};
use super::turn::{Sum, frac};
use super::waveform::{SHAPES, WAVEFORMS};
use super::{CYCLES_MAX, GAP_MAX, MEMORY_PERIODS, PROVEN};
use crate::corners::Corners;
use crate::detect::{Detection, soft_panel};
use link::framing::SYNC_SEEN;
use link::panel::{LEDS, PanelFrame, SIDE, SoftPanel};

/// Minimum number of frames from which a wave is found (count).
const FRAMES_MIN: usize = 12;
/// Frames in the first, coarse step of a search (count).
const COARSE_FRAMES: usize = 48;
/// Maximum time span of those frames (frame periods). More: the search takes longer, because it tries more frequencies.
const COARSE_PERIODS: f64 = 96.0;
/// Step of the slopes in a search, in cycles of the squares over the panel's height: up to a whole cycle of the carrier from row to row.
const SLOPE_STEP: f32 = 0.25;
/// Number of slopes in a search (count).
const SLOPES: u32 = 57;
/// If the phase turns by less over the panel, the exposure of all lines counts as simultaneous (cycles of the squares).
const AT_ONCE: f32 = 0.2;
/// Slopes that are tried if frame times are not steady, because many frequencies must then be tried (count).
const SLOPES_UNSTEADY: usize = 3;
/// Waves that are refined (count).
const CANDIDATES: usize = 6;
/// Maximum number of waves that explain frames about equally well (count).
const RIVALS: usize = 8;
/// Minimum sum of squares of a rival, relative to the greatest (share).
const AS_GREAT: f32 = 0.85;
/// Minimum share of the variation in the LEDs' contrasts that a wave explains.
const EXPLAINED: f32 = 0.2;
/// A wave that explains less is lost (share).
const LOST: f32 = 0.05;
/// Minimum score of the signs for a wave, and minimum margin over all others (nats).
const CLEARLY: f32 = 6.0;
/// Score of a sync panel for a wave (nats).
const SYNC_NATS: f32 = 6.0;
/// Minimum correlation of a sync panel.
const SYNC_SEEN_BY: f32 = 0.85;
/// Score of a pair of successive frames for a wave or against it (nats).
const PAIR_NATS: f32 = 2.0;
/// Minimum correlation of such a pair, in absolute value.
const PAIR_ALIKE: f32 = 0.6;
/// Each sign occurs in at least this share of the LEDs.
const BOTH_SIGNS: f32 = 0.1;
/// Waves that differ in the signs of fewer LEDs count as one (share).
const OTHER: f32 = 0.06;
/// An LED's mean light becomes more certain over about this many frames (count).
const MEAN_FRAMES: f32 = 16.0;
/// Maximum light that counts as an LED's (square, in mean squares).
const SQUARE_MAX: f32 = 4.0;
/// Frames that show whether an outer line of LEDs is not the panel's (count).
const RECENT_FRAMES: usize = 16;
/// Maximum amplitude of the wave in such a line (share of the mean of all LEDs).
const DARK: f32 = 0.3;
/// Minimum expected contrast of the wave there, so that its absence is evidence (mean square; the greatest contrast is 1).
const SEEN_MIN: f32 = 0.1;
/// Share of the signs' certainty that remains from one update of a wave to the next without confirmation.
const STILL_SURE: f32 = 0.97;
/// Certainty of the signs below which the wave is searched for again (nats).
const UNSURE: f32 = 1.0;
/// A wave is contradicted if its residual in the last frames exceeds this multiple of the residual before (mean squares).
const CONTRADICTED: f32 = 1.7;
/// Frames since the change when a contradiction is first noticed (count).
const NOTICED_FRAMES: usize = 8;
/// Increase of the unevenness of light among LEDs since the last failed search at which a wave may have begun (squared relative deviation).
const MORE_UNEVEN: f32 = 0.1;
/// Weight of a frame in the mean unevenness.
const UNEVEN_GAIN: f32 = 0.125;
/// If lines and rows grow this differently from one frame to the next, the panel is another (share).
const OTHER_PLACE: f32 = 0.15;
/// Minimum number of frames between searches while no wave is known (count).
const SEARCH_FRAMES: u32 = 4;
/// Maximum number of frames between such searches (count).
const SEARCH_FRAMES_MAX: u32 = 64;
/// Frames between searches while several waves are possible (count): trying them on all readings takes long.
const RIVALS_FRAMES: u32 = 4 * SEARCH_FRAMES;
/// Maximum certainty of an LED's bit (nats), because its line may show the symbol before or after that of the other lines. Higher: such
/// lines spoil code words; lower: lines of great contrast count too little.
const SURE_MAX: f32 = 4.0;
/// Frames between updates of a known wave (count).
const FOLLOW_FRAMES: u32 = 4;
/// Updates of a known wave between two readings of the last frames with it (count): code words that failed may then decode, because the
/// frames since have shown the wave and the LEDs' means better.
const UPDATES_REREAD: u32 = 4;

#[derive(Clone, Copy, Debug)]
struct FrameLight {
    number: u64,
    /// The time of the frame (frame periods).
    time: f64,
    /// The line of the panel's middle.
    middle: f32,
    /// The increase of an LED's line from column to column, and from row to row.
    growth: [f32; 2],
    /// The brightness of each LED above the mean, in `unit`s.
    light: [i8; LEDS],
    unit: f32,
}

impl FrameLight {
    const NONE: Self = Self {
        number: 0,
        time: 0.0,
        middle: 0.0,
        growth: [0.0; 2],
        light: [0; LEDS],
        unit: 0.0,
    };

    fn line(&self, led: usize) -> f32 {
        let [across, down] = self.growth;
        let [column, row] = [led % SIDE, led / SIDE].map(|at| at as f32 - 0.5 * (SIDE - 1) as f32);
        self.middle + across * column + down * row
    }

    /// Number of lines from the first LED to the last.
    fn height(&self) -> f32 {
        (SIDE - 1) as f32 * self.growth.iter().map(|growth| growth.abs()).sum::<f32>()
    }
}

/// A carrier as a function of time and line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wave {
    /// Cycles a frame period.
    frequency: f64,
    /// Cycles a line.
    slope: f32,
    /// The phase at `time` and `line` (cycles).
    phase: f32,
    time: f64,
    line: f32,
    /// The number of its shape.
    shape: usize,
    /// The light of an LED of full contrast.
    amplitude: f32,
    /// The variance of the residual.
    variance: f32,
    /// The share of the variation that the wave explains.
    explained: f32,
    /// The certainty of its signs (nats).
    sure: f32,
}

impl Wave {
    fn contrast(&self, seen: &FrameLight, led: usize) -> f32 {
        let cycles = self.frequency * (seen.time - self.time);
        let phase = (cycles - libm::floor(cycles)) as f32 + self.slope * (seen.line(led) - self.line) + self.phase;
        WAVEFORMS[self.shape][step(f64::from(frac(phase)))]
    }

    /// The wave with the other sign in every second frame.
    fn alternating(&self) -> Self {
        Self {
            frequency: self.frequency + 0.5,
            ..*self
        }
    }

    fn contrasts(&self, seen: &FrameLight) -> [f32; LEDS] {
        core::array::from_fn(|led| self.contrast(seen, led))
    }
}

/// The light of the last frames, and the wave in it.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    /// A ring whose oldest frame is at `next`, once it is full.
    seen: [FrameLight; FRAMES],
    len: usize,
    next: usize,
    /// The mean light of each LED, shrunk towards 0 while few frames are known.
    means: [f32; LEDS],
    wave: Option<Wave>,
    rivals: heapless::Vec<Wave, RIVALS>,
    wait: u32,
    pause: u32,
    /// Updates of the wave since the last frames were read with it.
    updates: u32,
    /// The time of the first frame since the wave may have begun, ended or changed (frame periods).
    since: Option<f64>,
    /// The mean unevenness of light among the LEDs of a frame (squared relative deviation).
    uneven: f32,
    /// The same at the last failed search.
    uneven_before: f32,
}

/// The state of knowledge after a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WaveState {
    /// No wave.
    Nothing,
    /// Several waves are possible and should be tried on the readings.
    Rivals,
    /// The wave has just been found.
    Now,
    /// The wave was known before.
    Before,
    /// The same, and the last frames should be read again.
    Again,
}

impl Lines {
    pub const NONE: Self = Self {
        seen: [FrameLight::NONE; FRAMES],
        len: 0,
        next: 0,
        means: [0.0; LEDS],
        wave: None,
        rivals: heapless::Vec::new(),
        wait: FRAMES_MIN as u32,
        pause: SEARCH_FRAMES,
        updates: 0,
        since: None,
        uneven: 0.0,
        uneven_before: f32::INFINITY,
    };

    pub fn is_known(&self) -> bool {
        self.wave.is_some()
    }

    /// Whether several waves explain the last frames, so that lines probably have signs of their own.
    pub fn may_have_a_wave(&self) -> bool {
        !self.is_known() && !self.rivals.is_empty()
    }

    /// The known wave, or the possible ones.
    pub fn waves(&self) -> &[Wave] {
        if self.is_known() { self.wave.as_slice() } else { &self.rivals }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// Adds the light of a frame.
    pub fn push(&mut self, number: u64, time: f64, lights: &[f32; LEDS], corners: &Corners) -> WaveState {
        let [a, b, c, d] = corners.points().map(|[_, y]| y);
        let most = lights.iter().fold(f32::MIN_POSITIVE, |most, light| most.max(light.abs()));
        if !most.is_finite() {
            return self.known();
        }
        let unit = most / 127.0;
        let per_led = 0.5 / (SIDE - 1) as f32;
        let growth = [per_led * (b - a + c - d), per_led * (d - a + c - b)];
        let before = self.last(0).growth;
        let changed = libm::hypotf(growth[0] - before[0], growth[1] - before[1]);
        let is_late = !(0.0..GAP_MAX).contains(&(time - self.last(0).time));
        if self.len > 0 && (is_late || changed > OTHER_PLACE * libm::hypotf(growth[0], growth[1])) {
            *self = Self::NONE;
        }
        self.seen[self.next] = FrameLight {
            number,
            time,
            middle: 0.25 * (a + b + c + d),
            growth,
            light: lights.map(|light| libm::roundf(light / unit) as i8),
            unit,
        };
        self.next = (self.next + 1) % FRAMES;
        self.len = (self.len + 1).min(FRAMES);
        self.len = self.latest(FRAMES).take_while(|seen| time - seen.time < MEMORY_PERIODS).count();
        self.wait = self.wait.saturating_sub(1);
        if self.wave.is_none() {
            self.look_for_a_beginning(lights);
        }
        if self.wait > 0 {
            return self.known();
        }
        if let Some(since) = self.since {
            self.wait = SEARCH_FRAMES;
            return self.search_since(since);
        }
        if self.wave.is_some() {
            self.wait = FOLLOW_FRAMES;
            self.follow();
            self.updates += 1;
            if self.updates < UPDATES_REREAD || self.wave.is_none() || self.since.is_some() {
                return self.known();
            }
            self.updates = 0;
            return WaveState::Again;
        }
        let found = self.search();
        self.wait = match found {
            WaveState::Nothing => {
                self.uneven_before = self.uneven;
                let pause = self.pause;
                self.pause = (2 * pause).min(SEARCH_FRAMES_MAX);
                pause
            }
            WaveState::Rivals => RIVALS_FRAMES,
            _ => SEARCH_FRAMES,
        };
        found
    }

    /// Detects that a wave begins on a still panel, because the LEDs then differ more in brightness.
    fn look_for_a_beginning(&mut self, lights: &[f32; LEDS]) {
        let sum: f32 = lights.iter().map(|light| light.abs()).sum();
        let squares: f32 = lights.iter().map(|light| light * light).sum();
        let uneven = LEDS as f32 * squares / (sum * sum).max(f32::MIN_POSITIVE) - 1.0;
        self.uneven += UNEVEN_GAIN * (uneven - self.uneven);
        if self.since.is_none() && self.uneven > self.uneven_before + MORE_UNEVEN {
            self.suspect_change();
        }
    }

    fn suspect_change(&mut self) {
        let back = NOTICED_FRAMES.min(self.len - 1);
        (self.since, self.wait) = (Some(self.last(back).time), SEARCH_FRAMES);
    }

    /// Searches the frames since a change for a wave. Forgets the frames before if it finds one, or if it finds none for long.
    fn search_since(&mut self, since: f64) -> WaveState {
        if self.wave.is_some_and(|wave| !self.is_contradicted(&wave)) {
            self.since = None;
            return WaveState::Before;
        }
        let count = self.latest(FRAMES).take_while(|seen| seen.time >= since).count();
        let is_long = count >= COARSE_FRAMES || self.last(0).time - since > COARSE_PERIODS;
        if count < FRAMES_MIN && !is_long {
            return self.known();
        }
        let (len, wave) = (core::mem::replace(&mut self.len, count), self.wave.take());
        let found = self.search();
        if found == WaveState::Nothing && !is_long {
            (self.len, self.wave) = (len, wave);
            self.learn_means();
            return self.known();
        }
        (self.since, self.uneven_before) = (None, self.uneven);
        if found == WaveState::Rivals {
            self.wait = RIVALS_FRAMES;
        }
        found
    }

    /// Whether the wave's residual in the last frames is much larger than before (mean square).
    fn is_contradicted(&self, wave: &Wave) -> bool {
        let of_frame = |seen: &FrameLight| -> f32 {
            let off = |led: usize| self.light(seen, led).abs() - wave.amplitude * wave.contrast(seen, led).abs();
            (0..LEDS).map(off).map(|off| off * off).sum()
        };
        let left = || self.latest(RECENT_FRAMES).map(of_frame).sum::<f32>() / (LEDS * RECENT_FRAMES) as f32;
        self.len > RECENT_FRAMES && left() > CONTRADICTED * wave.variance
    }

    /// Whether an outer line of LEDs lacks the wave that the others show.
    pub fn misses_one(&self) -> bool {
        let Some(wave) = self.wave.as_ref().filter(|_| self.len >= RECENT_FRAMES) else {
            return false;
        };
        let (mut cross, mut squares) = ([0.0; LEDS], [0.0; LEDS]);
        for seen in self.latest(RECENT_FRAMES) {
            for led in 0..LEDS {
                let contrast = wave.contrast(seen, led).abs();
                cross[led] += self.light(seen, led).abs() * contrast;
                squares[led] += contrast * contrast;
            }
        }
        let is_dark = |(first, step): (usize, usize)| {
            let sum = |of: &[f32; LEDS]| of.iter().skip(first).step_by(step).take(SIDE).sum::<f32>();
            let all = |of: &[f32; LEDS]| of.iter().sum::<f32>();
            sum(&squares) > SEEN_MIN * (SIDE * RECENT_FRAMES) as f32 && sum(&cross) * all(&squares) < DARK * all(&cross) * sum(&squares)
        };
        [(0, 1), (LEDS - SIDE, 1), (0, SIDE), (SIDE - 1, SIDE)].into_iter().any(is_dark)
    }

    /// Continues with a wave that its readings have proven.
    pub fn confirm(&mut self, wave: Wave) {
        if self.wave.is_none() {
            (self.since, self.wait, self.updates) = (None, FOLLOW_FRAMES, 0);
        }
        self.wave = Some(Wave { sure: PROVEN, ..wave });
        self.rivals.clear();
    }

    /// Forgets the light of the last frames, but not the wave.
    pub fn forget_lights(&mut self) {
        (self.len, self.wait, self.means) = (0, FRAMES_MIN as u32, [0.0; LEDS]);
        if self.since.take().is_some() {
            self.wave = None;
        }
    }

    fn known(&self) -> WaveState {
        if self.wave.is_some() {
            WaveState::Before
        } else {
            WaveState::Nothing
        }
    }

    /// The frame `back` frames before the last.
    fn last(&self, back: usize) -> &FrameLight {
        &self.seen[(self.next + 2 * FRAMES - 1 - back) % FRAMES]
    }

    /// The last frames, at most `count`, the latest first.
    fn latest(&self, count: usize) -> impl Iterator<Item = &FrameLight> + Clone {
        (0..self.len.min(count)).map(|back| self.last(back))
    }

    /// The deviation of an LED's light from its mean.
    fn light(&self, seen: &FrameLight, led: usize) -> f32 {
        seen.unit * f32::from(seen.light[led]) - self.means[led]
    }

    /// Demodulates the last frame with the wave.
    pub fn read(&self, detection: &Detection) -> Option<Detection> {
        let wave = self.wave.as_ref()?;
        let llr = match self.since {
            Some(_) => [0.0; LEDS],
            None => self.llrs(self.last(0), wave, wave.sure.min(SURE_MAX)),
        };
        let bits = PanelFrame::from_bits((0..LEDS).fold(0, |bits, led| bits | u64::from(llr[led] > 0.0) << led));
        Some(Detection {
            modulation: detection.modulation,
            ..Detection::new(bits, llr)
        })
    }

    /// The log-likelihood ratios of a frame's LEDs (nats), smaller on lines with less contrast and at most `most`.
    fn llrs(&self, seen: &FrameLight, wave: &Wave, most: f32) -> [f32; LEDS] {
        let scale = 2.0 * wave.amplitude / wave.variance.max(f32::MIN_POSITIVE);
        core::array::from_fn(|led| (scale * self.light(seen, led) * wave.contrast(seen, led)).clamp(-most, most))
    }

    /// The number, time and soft values of a frame; the earliest has index 0.
    pub fn reading(&self, index: usize, wave: &Wave) -> (u64, f64, SoftPanel) {
        let seen = self.last(self.len - 1 - index);
        (seen.number, seen.time, soft_panel(&self.llrs(seen, wave, SURE_MAX)))
    }

    fn learn_means(&mut self) {
        let per_frame = 1.0 / (self.len as f32 + MEAN_FRAMES);
        self.means =
            core::array::from_fn(|led| per_frame * self.latest(FRAMES).map(|seen| seen.unit * f32::from(seen.light[led])).sum::<f32>());
    }

    /// Correlates a frame's squares, relative to their mean, with a wave of that slope (cycles a line).
    fn along(&self, seen: &FrameLight, slope: f32, line: f32, mean_square: f32) -> Sum {
        let per = 1.0 / mean_square;
        let mut sum = Sum::ZERO;
        for led in 0..LEDS {
            let light = self.light(seen, led);
            let square = (light * light * per).min(SQUARE_MAX) - 1.0;
            sum.add(square, slope * (seen.line(led) - line));
        }
        sum
    }

    fn mean_square(&self, count: usize) -> f32 {
        let squares = self
            .latest(count)
            .map(|seen| (0..LEDS).map(|led| self.light(seen, led)).map(|light| light * light).sum::<f32>());
        (squares.sum::<f32>() / (LEDS * self.len.min(count)) as f32).max(f32::MIN_POSITIVE)
    }

    #[cold]
    #[inline(never)]
    fn search(&mut self) -> WaveState {
        self.rivals.clear();
        self.learn_means();
        let now = self.last(0).time;
        let count = self
            .latest(COARSE_FRAMES)
            .take_while(|seen| now - seen.time < COARSE_PERIODS)
            .count();
        if count < FRAMES_MIN {
            return WaveState::Nothing;
        }
        let (last, first) = (*self.last(0), *self.last(count - 1));
        // The time of a frame: half a cycle more per frame leaves the phase there unchanged.
        let (time, line, height) = (self.last(count / 2).time, last.middle, last.height());
        let mean_square = self.mean_square(count);
        let frequency_step = 0.25 / (last.time - first.time).max(1.0);
        let is_steady = is_steady(self.latest(count).map(|seen| seen.time));
        // Steady frames cannot distinguish frequencies that are a whole cycle apart.
        let (least, most) = if is_steady {
            (0.0, 1.0)
        } else {
            (-2.0 * CYCLES_MAX, 2.0 * CYCLES_MAX)
        };
        let tried = ((most - least) / frequency_step) as u32;
        let mut candidates = heapless::Vec::<Candidate, CANDIDATES>::new();
        let sums_of = |slope: f32| {
            let mut sums = [Sum::ZERO; COARSE_FRAMES];
            for (sum, seen) in sums.iter_mut().zip(self.latest(count)) {
                *sum = self.along(seen, slope, line, mean_square);
            }
            sums
        };
        let slopes = (0..SLOPES).map(|slope| SLOPE_STEP * slope as f32 / height);
        let mut likely = heapless::Vec::<Candidate, SLOPES_UNSTEADY>::new();
        if !is_steady {
            for slope in slopes.clone() {
                let size = sums_of(slope).iter().map(Sum::power).sum();
                let frequency = 0.0;
                Candidate { frequency, slope, size }.contend(&mut likely, 1.0, SLOPE_STEP / height);
            }
        }
        for slope in slopes.filter(|slope| is_steady || likely.iter().any(|likely| likely.slope == *slope)) {
            let sums = sums_of(slope);
            for i in 0..=tried {
                let frequency = least + frequency_step * f64::from(i);
                let mut all = Sum::ZERO;
                for (sum, seen) in sums.iter().zip(self.latest(count)) {
                    let cycles = frequency * (seen.time - time);
                    all.add_turned(sum, (cycles - libm::floor(cycles)) as f32);
                }
                let size = all.size();
                Candidate { frequency, slope, size }.contend(&mut candidates, frequency_step, SLOPE_STEP / height);
            }
        }
        let greatest = candidates.iter().fold(0.0f32, |most, candidate| most.max(candidate.size));
        let mut waves = heapless::Vec::<(Wave, f32), { 2 * CANDIDATES }>::new();
        candidates.retain(|candidate| candidate.size > AS_GREAT * greatest);
        for candidate in &candidates {
            let squares = self.refined(*candidate, time, line, [frequency_step, f64::from(SLOPE_STEP / height)], 4);
            let squares = Wave {
                frequency: 0.5 * squares.frequency,
                ..squares
            };
            for wave in [squares, squares.alternating()] {
                let wave = self.fitted(&wave);
                let is_other = wave.explained > EXPLAINED
                    && self.changes_sign(&wave)
                    && waves.iter().all(|(other, _)| self.differ(&wave, other) > OTHER);
                if is_other {
                    waves.push((wave, self.signs(&wave))).ok();
                }
            }
        }
        waves.sort_unstable_by(|a, b| b.1.total_cmp(&a.1));
        let Some((best, score)) = waves.first().copied() else {
            return WaveState::Nothing;
        };
        if 2.0 * best.slope * height < AT_ONCE {
            return WaveState::Nothing;
        }
        let margin = waves.get(1).map_or(score, |(_, other)| score - other).min(score);
        if margin > CLEARLY {
            self.wave = Some(Wave { sure: margin, ..best });
            return WaveState::Now;
        }
        self.rivals.extend(waves.iter().take(RIVALS).map(|(wave, _)| *wave));
        WaveState::Rivals
    }

    /// The strongest wave of the squares in all frames near a candidate, with the frequency of the squares and the slope of the carrier.
    fn refined(&self, candidate: Candidate, time: f64, line: f32, steps: [f64; 2], rounds: u32) -> Wave {
        let mean_square = self.mean_square(FRAMES);
        let sum = |frequency: f64, slope: f32| {
            let mut all = Sum::ZERO;
            for seen in self.latest(FRAMES) {
                let cycles = frequency * (seen.time - time);
                all.add_turned(&self.along(seen, slope, line, mean_square), (cycles - libm::floor(cycles)) as f32);
            }
            all
        };
        let mut best = candidate;
        best.size = sum(best.frequency, best.slope).size();
        let mut by = steps.map(|step| 0.5 * step);
        for _ in 0..rounds {
            for (frequency, slope) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                loop {
                    let next = Candidate {
                        frequency: best.frequency + frequency * by[0],
                        slope: best.slope + (slope * by[1]) as f32,
                        size: 0.0,
                    };
                    let size = sum(next.frequency, next.slope).size();
                    if size <= best.size {
                        break;
                    }
                    best = Candidate { size, ..next };
                }
            }
            by = by.map(|by| 0.5 * by);
        }
        Wave {
            frequency: best.frequency,
            slope: 0.5 * best.slope,
            phase: 0.5 * sum(best.frequency, best.slope).phase(),
            time,
            line,
            shape: 0,
            amplitude: 0.0,
            variance: 0.0,
            explained: 0.0,
            sure: f32::INFINITY,
        }
    }

    /// The wave with the shape that explains the LEDs' contrasts best.
    fn fitted(&self, wave: &Wave) -> Wave {
        let count = (LEDS * self.len) as f32;
        let (mut best, mut least) = (*wave, f32::INFINITY);
        for shape in 0..SHAPES {
            let tried = Wave { shape, ..*wave };
            let (mut cross, mut squares, mut seen_squares, mut seen_sum) = (0.0, 0.0, 0.0, 0.0);
            for seen in self.latest(FRAMES) {
                for led in 0..LEDS {
                    let (light, contrast) = (self.light(seen, led).abs(), tried.contrast(seen, led).abs());
                    cross += light * contrast;
                    squares += contrast * contrast;
                    seen_squares += light * light;
                    seen_sum += light;
                }
            }
            let amplitude = cross / f32::max(squares, 1e-3);
            let left = seen_squares - amplitude * cross;
            if left < least {
                least = left;
                let varies = seen_squares - seen_sum * seen_sum / count;
                best = Wave {
                    amplitude,
                    variance: left / count,
                    explained: 1.0 - left / varies.max(f32::MIN_POSITIVE),
                    ..tried
                };
            }
        }
        best
    }

    /// The score of sync panels and pairs of successive frames for a wave (nats).
    fn signs(&self, wave: &Wave) -> f32 {
        let mut score = 0.0;
        let mut after: Option<[f32; LEDS]> = None;
        for seen in self.latest(FRAMES) {
            let contrasts = wave.contrasts(seen);
            let symbol: [f32; LEDS] = core::array::from_fn(|led| self.light(seen, led) * contrasts[led]);
            let size = symbol.iter().map(|light| light.abs()).sum::<f32>().max(f32::MIN_POSITIVE);
            let is_sync = SYNC_SEEN.iter().any(|sync| {
                let agreeing = |(led, light): (usize, &f32)| if sync.led(led) { *light } else { -*light };
                symbol.iter().enumerate().map(agreeing).sum::<f32>().abs() > SYNC_SEEN_BY * size
            });
            if is_sync {
                score += SYNC_NATS;
            }
            if let Some(after) = after {
                let dot = |a: &[f32; LEDS], b: &[f32; LEDS]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
                let alike = dot(&symbol, &after) / libm::sqrtf(dot(&symbol, &symbol) * dot(&after, &after)).max(f32::MIN_POSITIVE);
                if alike.abs() > PAIR_ALIKE {
                    score += PAIR_NATS.copysign(alike);
                }
            }
            after = Some(symbol);
        }
        score
    }

    /// Whether both signs occur among the LEDs, which they do not on a still panel.
    fn changes_sign(&self, wave: &Wave) -> bool {
        let signs = self.latest(FRAMES).flat_map(|seen| wave.contrasts(seen));
        let complements = signs.filter(|contrast| *contrast < 0.0).count() as f32 / (LEDS * self.len) as f32;
        (BOTH_SIGNS..1.0 - BOTH_SIGNS).contains(&complements)
    }

    /// The share of recent LEDs whose sign differs between two waves, up to one common sign.
    fn differ(&self, a: &Wave, b: &Wave) -> f32 {
        let (mut other, mut all) = (0, 0);
        for seen in self.latest(SEARCH_FRAMES as usize * 4) {
            for led in 0..LEDS {
                other += usize::from(a.contrast(seen, led) * b.contrast(seen, led) < 0.0);
                all += 1;
            }
        }
        other.min(all - other) as f32 / all.max(1) as f32
    }

    /// Adjusts the wave to the frames seen since.
    #[inline(never)]
    fn follow(&mut self) {
        let Some(before) = self.wave else { return };
        self.learn_means();
        let (first, last) = (*self.last(self.len - 1), *self.last(0));
        let (time, line) = (self.last(self.len / 2).time, last.middle);
        let candidate = Candidate {
            frequency: 2.0 * before.frequency,
            slope: 2.0 * before.slope,
            size: 0.0,
        };
        let steps = [0.1 / (last.time - first.time).max(1.0), f64::from(0.1 / last.height())];
        let squares = self.refined(candidate, time, line, steps, 2);
        let expected = before.phase + frac((before.frequency * (time - before.time)) as f32) + before.slope * (line - before.line);
        let halves = libm::roundf(2.0 * (expected - squares.phase));
        let wave = self.fitted(&Wave {
            frequency: 0.5 * squares.frequency,
            phase: squares.phase + 0.5 * halves,
            sure: before.sure,
            ..squares
        });
        let sure = self.signs(&wave) - self.signs(&wave.alternating());
        let wave = Wave {
            sure: sure.max(STILL_SURE * before.sure),
            ..wave
        };
        if self.is_contradicted(&before) {
            self.suspect_change();
            return;
        }
        self.wave = (wave.explained > LOST && sure > -CLEARLY && wave.sure > UNSURE).then_some(wave);
        if self.wave.is_none() {
            self.suspect_change();
        }
    }
}

/// A wave of the squares of light: cycles a frame period, cycles a line, and amplitude.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    frequency: f64,
    slope: f32,
    size: f32,
}

impl Candidate {
    /// Enters the list of the greatest candidates. Each of them represents its neighbours.
    fn contend<const N: usize>(self, candidates: &mut heapless::Vec<Self, N>, frequency_step: f64, slope_step: f32) {
        let is_near = |other: &&mut Self| {
            let apart = (other.frequency - self.frequency).abs();
            apart.min((1.0 - apart).abs()) < 5.0 * frequency_step && (other.slope - self.slope).abs() < 5.0 * slope_step
        };
        if let Some(near) = candidates.iter_mut().find(is_near) {
            if self.size > near.size {
                *near = self;
            }
        } else if let Err(new) = candidates.push(self)
            && let Some(least) = candidates.iter_mut().min_by(|a, b| a.size.total_cmp(&b.size))
            && new.size > least.size
        {
            *least = new;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::panel::LLR_STEP;

    const WAVE: Wave = Wave {
        frequency: 0.31,
        slope: 0.02,
        phase: 0.1,
        time: 0.0,
        line: 30.0,
        shape: 0,
        amplitude: 0.3,
        variance: 0.001,
        explained: 0.9,
        sure: 20.0,
    };

    /// Frames of a panel with [`WAVE`]. One row or column, given by its first LED and the step between its LEDs, does not show the wave.
    fn seen(dark: Option<(usize, usize)>) -> Lines {
        let mut lines = Lines {
            wave: Some(WAVE),
            wait: u32::MAX,
            ..Lines::NONE
        };
        for number in 0..RECENT_FRAMES as u64 {
            see(&mut lines, number, dark);
        }
        lines
    }

    /// Shows one more such frame.
    fn see(lines: &mut Lines, number: u64, dark: Option<(usize, usize)>) -> WaveState {
        let corners = Corners::new([[9.0, 9.0], [51.0, 9.0], [51.0, 51.0], [9.0, 51.0]]).expect("corners");
        let is_dark = |led: usize| dark.is_some_and(|(first, step)| (0..SIDE).any(|i| first + step * i == led));
        let frame = FrameLight {
            number,
            time: number as f64,
            middle: 30.0,
            growth: [0.0, 6.0],
            ..FrameLight::NONE
        };
        let contrasts = WAVE.contrasts(&frame);
        let sign = |led: usize| {
            if 0x6c1d_93a5_0b7e_f248u64.rotate_left(number as u32) >> led & 1 == 1 {
                0.3
            } else {
                -0.3
            }
        };
        let light = core::array::from_fn(|led| if is_dark(led) { 0.01 } else { sign(led) * contrasts[led] });
        lines.push(number, number as f64, &light, &corners)
    }

    /// A panel with such a line is followed one line off.
    #[test]
    fn an_outer_line_without_light_is_missed() {
        assert!(!seen(None).misses_one());
        assert!(!seen(Some((3 * SIDE, 1))).misses_one());
        for outer in [(0, 1), (LEDS - SIDE, 1), (0, SIDE), (SIDE - 1, SIDE)] {
            let mut lines = seen(Some(outer));
            assert!(lines.misses_one(), "{outer:?}");
            lines.forget_lights();
            assert!(lines.is_known() && !lines.misses_one());
        }
    }

    /// Later frames show the wave better, so code words that failed may decode.
    #[test]
    fn frames_are_read_again_while_a_wave_is_followed() {
        let mut lines = seen(None);
        // The LEDs' means, of few symbols, add to the residual.
        let wave = Wave { variance: 0.02, ..WAVE };
        (lines.wave, lines.wait) = (Some(wave), 0);
        let again = (0..64).filter(|number| see(&mut lines, RECENT_FRAMES as u64 + number, None) == WaveState::Again);
        assert_eq!(again.count(), 4);
    }

    /// A line may show another symbol.
    #[test]
    fn no_bit_of_a_line_is_very_sure() {
        let lines = seen(None);
        let (_, _, soft) = lines.reading(0, &WAVE);
        let surest = soft.0.iter().map(|llr| llr.abs()).max().expect("LEDs");
        assert_eq!(f32::from(surest) * LLR_STEP, SURE_MAX);
    }

    #[test]
    fn a_proof_hides_no_change_of_the_wave_that_is_followed() {
        let mut lines = seen(None);
        lines.since = Some(3.0);
        lines.confirm(WAVE);
        assert_eq!((lines.since, lines.wave.map(|wave| wave.sure)), (Some(3.0), Some(PROVEN)));
    }

    /// The certainty of unconfirmed signs decreases.
    #[test]
    fn evidence_on_signs_fades() {
        let mut lines = seen(None);
        lines.follow();
        let sure = lines.wave.expect("a wave").sure;
        assert!((0.9 * WAVE.sure..WAVE.sure).contains(&sure), "{sure}");
    }
}
