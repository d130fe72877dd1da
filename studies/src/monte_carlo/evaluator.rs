//! Renders, measures and reads random frames.

use crate::parallel::{map_with, threads};
use fearless_simd::{self as simd, dispatch};
use link::camera::Camera;
use link::panel::{LEDS, PanelFrame, SoftPanel};
use rand::Rng;
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::{Detector, Fisher, FisherFeatures, FisherScaling, FisherTraining, Method};
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::{Experience, MaximumLikelihood};
use sim::accuracy::Level;
use sim::camera::clock::Moment;
use sim::random::{Purpose, stream, uniform};
use sim::renderer::canvas::{Canvas, Region};
use sim::renderer::{PanelExposure, Renderer};
use sim::road::camera_of;
use sim::scene::Scene;
use sim::view::{View, ViewError};

use super::accumulator::Accumulator;
use super::carrier::KnownCarrier;
use super::error::EvaluateError;
use super::evaluation::{CHUNK, Evaluation, chunks};
use super::observation::{Observation, PANEL_PIXELS, measure};
use crate::detectors::DetectorChoice;
use crate::detectors::genie::{Genie, LikelihoodTable};
use crate::stop::Stop;

/// The reflectances of `--random-reflectance`: Table 1 of Do & Yoo 2020.
pub const REFLECTANCES: [f64; 2] = [0.3, 0.5];
/// Training frames of a detector.
const TRAINING_FRAMES: u64 = 500;
/// Frames before the first one from which maximum likelihood learns, like a receiver that follows a panel.
const EXPERIENCE_FRAMES: u64 = 256;
/// XOR mask from the seed of an evaluation to that of its training frames.
const TRAINING_SEED: u64 = 0x6c65_6172_6e69_6e67;

/// The settings of an evaluation.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Frames.
    pub frames: u64,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Whether each frame's reflectance is drawn from [`REFLECTANCES`].
    pub random_reflectance: bool,
    /// The detector.
    pub detector: DetectorChoice,
    /// The accuracy of frames.
    pub level: Level,
    /// The receiver's camera settings; none: those of the scene.
    pub camera: Option<Camera>,
    /// The flag that ends the work early.
    pub stop: Stop,
}

impl Settings {
    /// Settings for panels of random reflectance, at the fast level.
    pub const fn fast(frames: u64, seed: u64, detector: DetectorChoice) -> Self {
        Self {
            frames,
            seed,
            random_reflectance: true,
            detector,
            level: Level::Fast,
            camera: None,
            stop: Stop::NEVER,
        }
    }
}

/// The prepared scene of an evaluation, with bounds that hold for all its reflectances.
///
/// # Errors
/// If the scene cannot be seen.
pub fn view(scene: &Scene, random_reflectance: bool) -> Result<View, ViewError> {
    View::with_reflectances(scene, random_reflectance.then_some(REFLECTANCES))
}

/// A receiver's method for the detector of that name: given the camera, or trained on frames of the scene.
///
/// # Errors
/// [`EvaluateError::NoReceiver`] for a genie, and the reason if a detector cannot be trained.
pub fn receiving_method(scene: &Scene, detector: DetectorChoice, seed: u64, level: Level) -> Result<Method, EvaluateError> {
    match detector.untrained() {
        Some(method) => Ok(method),
        None => {
            let settings = Settings {
                random_reflectance: false,
                level,
                ..Settings::fast(0, seed, detector)
            };
            Evaluator::new(scene, settings)?.method().ok_or(EvaluateError::NoReceiver)
        }
    }
}

/// Renders, measures and reads random frames of one scene.
pub struct Evaluator {
    renderer: Renderer,
    settings: Settings,
    rule: DecisionRule,
    prior: Experience,
    region: Region,
    corners: Corners,
    /// The carrier of the first panel, for a receiver that follows it.
    carrier: Option<KnownCarrier>,
}

/// Checks that a scene has no carrier: in a single frame, nothing distinguishes bits from their complement.
fn check_still(scene: &Scene) -> Result<(), EvaluateError> {
    match scene.link.carrier_cycles {
        Some(cycles @ 1..) => Err(EvaluateError::Carrier { cycles }),
        _ => Ok(()),
    }
}

/// The decision on bits.
enum DecisionRule {
    Receiver(Method),
    Genie(LikelihoodTable),
}

/// The memory of a thread; made once, reused for each frame.
pub struct Workspace {
    pub(crate) canvas: Canvas<f32>,
    pub(crate) grey: Vec<u8>,
    map: Box<CellMap<PANEL_PIXELS>>,
    likelihood: Box<MaximumLikelihood<PANEL_PIXELS>>,
    pub(crate) shown: Vec<PanelExposure>,
    /// The time of the exposure.
    pub(crate) moment: Moment,
    /// The first panel's ratio of LED to ambient light in the next frames, at most the scene's; `None`: the scene's.
    pub(crate) l2a: Option<f64>,
}

impl Workspace {
    /// The grey levels of the last frame.
    pub fn grey(&self) -> &[u8] {
        &self.grey
    }
}

impl Evaluator {
    /// Prepares an evaluation of `scene`'s first panel.
    ///
    /// # Errors
    /// If the scene cannot be seen or the panel cannot be measured.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, EvaluateError> {
        check_still(scene)?;
        Self::begun(scene, settings, None, None)
    }

    /// As [`Self::new`], for a receiver that follows the panel, with the estimates from a similar panel, and the carrier if there is one.
    /// Erased bits count as right.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn experienced(scene: &Scene, settings: Settings, experience: Option<Experience>) -> Result<Self, EvaluateError> {
        if settings.detector == DetectorChoice::Genie {
            check_still(scene)?;
        }
        Self::begun(scene, settings, experience, None)
    }

    /// An evaluation of `scene` with the settings, the decision and the estimates of another evaluator, which was made for a similar panel.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn taught(scene: &Scene, teacher: &Self) -> Result<Self, EvaluateError> {
        check_still(scene)?;
        Self::begun(scene, teacher.settings, Some(teacher.prior), teacher.method())
    }

    fn begun(scene: &Scene, settings: Settings, experience: Option<Experience>, method: Option<Method>) -> Result<Self, EvaluateError> {
        let renderer = Renderer::of(view(scene, settings.random_reflectance)?, settings.level);
        let region = renderer.cells_region(0);
        let corners = renderer.corners_in(region, &renderer.moment(settings.seed, 0))?;
        let mut evaluator = Self {
            carrier: KnownCarrier::of(&renderer),
            renderer,
            settings,
            rule: DecisionRule::Receiver(Method::default()),
            prior: Experience::NONE,
            region,
            corners,
        };
        // Geometric errors show in the first frame.
        evaluator.observe(0, &mut evaluator.workspace())?;
        let choice = settings.detector;
        evaluator.rule = match (method.or(choice.untrained()), choice.learns()) {
            (Some(method), _) => DecisionRule::Receiver(method),
            (_, Some(features)) => DecisionRule::Receiver(Detector::Fisher(evaluator.train(features)?).into()),
            _ => DecisionRule::Genie(LikelihoodTable::new(&evaluator.renderer)),
        };
        let looks_at_features = matches!(evaluator.rule, DecisionRule::Receiver(Method::Features(_)));
        if !looks_at_features {
            evaluator.prior = match experience {
                Some(experience) => experience,
                None => evaluator.gather_experience()?,
            };
        }
        Ok(evaluator)
    }

    /// The renderer of the frames.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The drawn part of the sensor.
    pub fn region(&self) -> Region {
        self.region
    }

    /// The receiver's method, trained if necessary; `None` for a genie.
    pub fn method(&self) -> Option<Method> {
        match self.rule {
            DecisionRule::Receiver(method) => Some(method),
            DecisionRule::Genie(_) => None,
        }
    }

    /// The initial estimates of maximum likelihood in every frame.
    pub(crate) fn experience(&self) -> Experience {
        self.prior
    }

    /// The receiver's camera settings.
    fn camera(&self) -> Camera {
        let scene = &self.renderer.view().scene;
        self.settings.camera.unwrap_or_else(|| camera_of(scene))
    }

    /// Memory for a thread.
    pub fn workspace(&self) -> Workspace {
        Workspace {
            canvas: Canvas::new(self.region),
            grey: vec![0; self.region.width * self.region.height],
            map: Box::new(CellMap::empty()),
            likelihood: Box::new(MaximumLikelihood::new(self.camera())),
            shown: (0..self.renderer.view().panels.len())
                .map(|index| self.renderer.steady(index, PanelFrame::default()))
                .collect(),
            moment: self.renderer.moment(self.settings.seed, 0),
            l2a: None,
        }
    }

    /// Evaluates all frames; `progress` gets the number of finished frames and may end the run by returning false.
    ///
    /// # Errors
    /// If a frame cannot be measured.
    pub fn run(&self, mut progress: impl FnMut(u64) -> bool) -> Result<Evaluation, EvaluateError> {
        let mut sums = Accumulator::default();
        let (chunks, batch) = (chunks(self.settings.frames), 16 * threads() as u64);
        for first in (0..chunks).step_by(batch as usize) {
            let batch = first..chunks.min(first + batch);
            let parts = map_with(batch, || self.workspace(), |workspace, chunk| self.chunk(chunk, workspace));
            for (chunk, part) in (first..).zip(parts) {
                sums.add(chunk, part?)?;
            }
            if !progress(sums.total().errors.frames()) {
                break;
            }
        }
        Ok(sums.total())
    }

    /// Evaluates chunk `chunk` (see [`chunks`]): [`CHUNK`] frames, or fewer at the end.
    ///
    /// # Errors
    /// If a frame cannot be measured.
    pub fn chunk(&self, chunk: u64, workspace: &mut Workspace) -> Result<Evaluation, EvaluateError> {
        let end = self.settings.frames.min((chunk + 1) * CHUNK);
        self.evaluate(chunk * CHUNK..end, workspace)
    }

    /// Evaluates a range of frames.
    ///
    /// # Errors
    /// If a frame cannot be measured.
    pub fn evaluate(&self, frames: std::ops::Range<u64>, workspace: &mut Workspace) -> Result<Evaluation, EvaluateError> {
        let mut part = Evaluation::default();
        for frame in frames {
            let observed = self.observe(frame, workspace)?;
            let mut read = self.detect(&observed, workspace)?;
            if let Some(carrier) = self.carrier {
                read = carrier.without_erased(&self.renderer, &workspace.moment, read, observed.bits);
            }
            let is_across = self.renderer.straddles(0, &workspace.moment);
            part.push(Some(&observed.features), observed.bits, read, is_across);
        }
        Ok(part)
    }

    /// The estimates of blur and noise that a receiver would have, from other frames than those evaluated.
    fn gather_experience(&self) -> Result<Experience, EvaluateError> {
        let mut workspace = self.workspace();
        let mut likelihood = MaximumLikelihood::<PANEL_PIXELS>::new(self.camera());
        for frame in 0..EXPERIENCE_FRAMES {
            let observed = self.observe_of(self.settings.seed ^ TRAINING_SEED, frame, &mut workspace)?;
            let Region { width, height, .. } = self.region;
            let picture = Frame::new(&workspace.grey, width, height)?;
            // Nothing is learnt from an unreadable frame.
            let _ = likelihood.detect(&picture, &observed.corners);
        }
        Ok(likelihood.experience())
    }

    /// The bits as read; all Off if reading fails, so that all On bits count as wrong.
    fn detect(&self, observed: &Observation, workspace: &mut Workspace) -> Result<PanelFrame, EvaluateError> {
        let (bits, _) = self.detect_softly(observed, workspace)?;
        Ok(bits)
    }

    /// The bits of the last observed frame, all Off if reading fails, and their soft values, if the detector computes them.
    ///
    /// # Errors
    /// If the frame cannot be measured.
    pub fn detect_softly(
        &self,
        observed: &Observation,
        workspace: &mut Workspace,
    ) -> Result<(PanelFrame, Option<SoftPanel>), EvaluateError> {
        let Workspace {
            grey,
            likelihood,
            shown,
            moment,
            ..
        } = workspace;
        let Region { width, height, .. } = self.region;
        let picture = Frame::new(grey, width, height)?;
        Ok(match &self.rule {
            DecisionRule::Receiver(Method::Features(detector)) => {
                let decided = dispatch!(simd::Level::new(), _simd => detector.decide(&observed.features));
                return Ok((decided.unwrap_or_default(), None));
            }
            DecisionRule::Receiver(Method::MaximumLikelihood) => {
                likelihood.set_experience(self.prior);
                likelihood.detect(&picture, &observed.corners)
            }
            DecisionRule::Genie(table) => {
                let start = likelihood
                    .detect(&picture, &observed.corners)
                    .map_or(observed.bits, |detection| detection.bits);
                let mut genie = Genie::new(&self.renderer, table, moment, shown, self.region, grey);
                return Ok((genie.bits(&[observed.bits, start]), None));
            }
        }
        .map_or((PanelFrame::default(), None), |detection| (detection.bits, Some(detection.soft))))
    }

    /// Renders and measures frame `frame`.
    ///
    /// # Errors
    /// If it cannot be measured.
    pub fn observe(&self, frame: u64, workspace: &mut Workspace) -> Result<Observation, EvaluateError> {
        self.observe_of(self.settings.seed, frame, workspace)
    }

    /// Renders frame `frame`, which [`Evaluator::observe`] would measure; returns the panel's bits, and its corner LEDs in the drawn
    /// region.
    ///
    /// # Errors
    /// If the shifted corners do not make a panel.
    pub fn render(&self, frame: u64, workspace: &mut Workspace) -> Result<(PanelFrame, Corners), EvaluateError> {
        let seed = self.settings.seed;
        self.expose(seed, frame, workspace);
        let Workspace {
            canvas,
            grey,
            shown,
            moment,
            ..
        } = workspace;
        self.renderer.read_out(seed, frame, canvas, grey);
        Ok((self.renderer.truth(0, moment, &shown[0]), self.corners(moment, &shown[0])?))
    }

    /// The same for another seed.
    fn observe_of(&self, seed: u64, frame: u64, workspace: &mut Workspace) -> Result<Observation, EvaluateError> {
        self.expose(seed, frame, workspace);
        self.observe_exposed(seed, frame, workspace)
    }

    /// Draws a frame's light.
    pub(crate) fn expose(&self, seed: u64, frame: u64, workspace: &mut Workspace) {
        self.draw_frame(seed, frame, workspace.l2a, &mut workspace.shown);
        workspace.moment = self.renderer.moment(seed, frame);
        self.renderer.draw(&workspace.moment, &workspace.shown, &mut workspace.canvas);
    }

    /// Reads out and measures the drawn frame.
    pub(crate) fn observe_exposed(&self, seed: u64, frame: u64, workspace: &mut Workspace) -> Result<Observation, EvaluateError> {
        let Workspace { canvas, grey, .. } = workspace;
        self.renderer.read_out(seed, frame, canvas, grey);
        self.measure(workspace)
    }

    /// Measures the frame that was read out.
    pub(crate) fn measure(&self, workspace: &mut Workspace) -> Result<Observation, EvaluateError> {
        // All work on frames passes here.
        if self.settings.stop.is_asked() {
            return Err(EvaluateError::Stopped);
        }
        let Workspace {
            grey, map, shown, moment, ..
        } = workspace;
        let shown = shown[0];
        let corners = self.corners(moment, &shown)?;
        let features = dispatch!(
            simd::Level::new(),
            _simd => measure(grey, self.region, &corners, map)
        )?;
        Ok(Observation {
            bits: self.renderer.seen(0, moment, &shown),
            features,
            corners,
        })
    }

    /// The corner LEDs in the drawn region.
    fn corners(&self, moment: &Moment, shown: &PanelExposure) -> Result<Corners, EvaluateError> {
        let [x, y] = shown.shift_px.map(|shift| shift as f32);
        let corners = match self.renderer.shakes() {
            true => self.renderer.corners_in(self.region, moment)?,
            false => self.corners,
        };
        Ok(corners.shifted(x, y)?)
    }

    /// The grey level at the pixel nearest to the centre of each LED, in the last frame of `workspace`.
    pub fn led_greys(&self, workspace: &Workspace) -> [u8; LEDS] {
        let ellipses = &self.renderer.view().panels[0].ellipses;
        let [x_px, y_px] = self.renderer.shaken_px(&workspace.moment);
        let shift = workspace.shown[0].shift_px;
        let shift = [shift[0] + x_px, shift[1] + y_px];
        let Region { x, y, width, height } = self.region;
        let place = |centre: f64, start: usize, end: usize| (centre - start as f64).round().clamp(0.0, end as f64 - 1.0) as usize;
        std::array::from_fn(|led| {
            let centre = ellipses[led].centre;
            let column = place(centre.x + shift[0], x, width);
            workspace.grey[place(centre.y + shift[1], y, height) * width + column]
        })
    }

    /// The random part of a frame: all panels' symbols, and the first one's phase and reflectance. `l2a` may replace the scene's ratio.
    pub(crate) fn draw_frame(&self, seed: u64, frame: u64, l2a: Option<f64>, shown: &mut [PanelExposure]) {
        let mut random = stream(seed, frame, Purpose::Phase);
        let view = self.renderer.view();
        for (index, shown) in shown.iter_mut().enumerate() {
            shown.symbols = std::array::from_fn(|_| PanelFrame::from_bits(random.next_u64()));
            if index > 0 {
                continue;
            }
            shown.shift_px = [uniform(&mut random), uniform(&mut random)];
            let panel = &view.panels[0];
            let drawn = self.settings.random_reflectance.then(|| {
                let [low, high] = REFLECTANCES;
                low + (high - low) * uniform(&mut random)
            });
            if drawn.is_some() || l2a.is_some() {
                let (reflectance, l2a) = (drawn.unwrap_or(panel.panel.reflectance), l2a.unwrap_or(panel.l2a));
                shown.light = view.exposure.led_light(&view.scene, &panel.panel, reflectance, l2a);
            }
        }
    }

    /// Fisher's discriminant from other frames than those evaluated.
    fn train(&self, features: FisherFeatures) -> Result<Fisher, EvaluateError> {
        let mut training = FisherTraining::new(features, FisherScaling::ByPanel);
        let mut workspace = self.workspace();
        let seed = self.settings.seed ^ TRAINING_SEED;
        for frame in 0..TRAINING_FRAMES {
            let observed = self.observe_of(seed, frame, &mut workspace)?;
            training.add(&observed.features, observed.bits);
        }
        Ok(training.finish()?)
    }
}
