//! Where panels are, from their size and the lens, which a person or the panels themselves give.

use link::camera::Camera;
use link::geometry::Geometry;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Closing, Known, Lens, PanelSize, PanelSizeError, Pose};
#[cfg(feature = "poses")]
use rx_pipeline::pose::{PanelObservation, PoseEstimator};
use rx_pipeline::receiver::{Loss, Reading};

/// Pixels around a panel that its pose is measured in; near ones are seen in larger ones.
#[cfg(feature = "poses")]
const POSE_PIXELS: usize = 128 * 128;
/// The scenes' LEDs, m, and their interval: what half a size is checked with.
const USUAL: (f64, f64) = (0.03, 1.0);

/// A pose, or why it is not known.
pub type PoseResult = Result<Pose, String>;

/// A panel's size if both numbers were told: the diameter of an LED in metres, and the gap between two over it.
///
/// ```
/// use reception::whereabouts::told_size;
/// assert_eq!(told_size(Some(0.03), Some(1.0))?.map(|size| size.pitch_m()), Some(0.06));
/// assert_eq!(told_size(None, Some(1.0))?, None);
/// assert!(told_size(None, Some(-1.0)).is_err());
/// # Ok::<(), rx_pipeline::pose::PanelSizeError>(())
/// ```
///
/// # Errors
/// [`PanelSizeError`], also if only half of the size is given.
pub fn told_size(led_diameter_m: Option<f64>, interval: Option<f64>) -> Result<Option<PanelSize>, PanelSizeError> {
    let size = PanelSize::new(led_diameter_m.unwrap_or(USUAL.0), interval.unwrap_or(USUAL.1))?;
    Ok((led_diameter_m.is_some() && interval.is_some()).then_some(size))
}

/// What a pose is measured from: a panel that was read, and what it was seen through.
pub struct PoseInput<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Where the panel is in it, and what it shows.
    pub reading: &'a Reading,
    /// The camera.
    pub camera: &'a Camera,
    /// The lens, or why it is not known.
    pub lens: &'a Result<Lens, String>,
}

/// What poses are measured with: one serves all panels.
pub struct PoseMeter {
    size: Option<PanelSize>,
    /// Made with the first pose: it is large.
    #[cfg(feature = "poses")]
    estimator: Option<Box<PoseEstimator<POSE_PIXELS>>>,
}

impl PoseMeter {
    /// Of panels of a known size, or of panels that have to tell it.
    pub const fn new(size: Option<PanelSize>) -> Self {
        Self {
            size,
            #[cfg(feature = "poses")]
            estimator: None,
        }
    }

    /// The pose of a panel in a single frame.
    ///
    /// # Errors
    /// Why it is not known.
    pub fn pose(&mut self, input: &PoseInput) -> PoseResult {
        let lens = input.lens.as_ref().map_err(String::clone)?;
        self.fit(input, lens, self.size(None)?)
    }

    /// The panel's size: the known one, else what the panel has announced.
    fn size(&self, announced: Option<Geometry>) -> Result<PanelSize, String> {
        self.size
            .or(announced.map(PanelSize::from))
            .ok_or_else(|| "no panel size: give the LEDs' diameter and interval, or wait for the panel to tell them".into())
    }

    #[cfg(feature = "poses")]
    fn fit(&mut self, input: &PoseInput, lens: &Lens, size: PanelSize) -> PoseResult {
        let estimator = self.estimator.get_or_insert_with(|| Box::new(PoseEstimator::new()));
        let pose = estimator.pose(&PanelObservation {
            frame: input.frame,
            corners: &input.reading.corners,
            bits: input.reading.detection.bits,
            camera: input.camera,
            lens,
            size,
        });
        pose.map_err(|why| why.to_string())
    }

    #[cfg(not(feature = "poses"))]
    fn fit(&mut self, _: &PoseInput, _: &Lens, _: PanelSize) -> PoseResult {
        Err("this program measures no poses".into())
    }
}

/// Where a followed panel is, and how fast it comes nearer.
pub struct Whereabouts {
    pose: PoseResult,
    closing: Closing,
    /// What the panel has announced of its size.
    announced: Option<Geometry>,
    axes_px: Option<[[f64; 2]; 4]>,
}

impl Whereabouts {
    /// Of a panel that has not been read.
    pub(crate) const UNKNOWN: Self = Self {
        pose: Err(String::new()),
        closing: Closing::new(),
        announced: None,
        axes_px: None,
    };

    /// Takes what the panel announces of its size; whether that is news.
    pub(crate) fn set_size(&mut self, announced: Geometry) -> bool {
        let before = self.announced.replace(announced);
        if before.is_some_and(|before| before != announced) {
            // By another size it is at another place, which is no motion.
            self.closing = Closing::new();
        }
        before != Some(announced)
    }

    /// Measures it in a frame, taken at a time, in which the panel was read.
    pub(crate) fn measure(&mut self, meter: &mut PoseMeter, time_s: f64, input: &PoseInput) {
        self.axes_px = None;
        self.pose = input.lens.as_ref().map_err(String::clone).and_then(|lens| {
            let size = meter.size(self.announced)?;
            let pose = meter.fit(input, lens, size)?;
            self.closing.take(time_s, &pose);
            self.axes_px = axes_px(&pose, lens, size);
            Ok(pose)
        });
    }

    /// Measures nothing in a mirror image: its panel is nowhere.
    pub(crate) fn pass_over_mirrored(&mut self) {
        self.axes_px = None;
        self.pose = Err("the picture is mirrored: mirror it back, and the panel's place is known".into());
    }

    /// Takes why the panel was not read. All is forgotten of one that is followed no more: what is found next may be another.
    pub(crate) fn lose(&mut self, why: &Loss) {
        if matches!(why, Loss::Lost(_)) {
            *self = Self::UNKNOWN;
        }
        self.axes_px = None;
        self.pose = Err(why.to_string());
    }

    /// The pose, or why it is not known.
    pub fn measured(&self) -> &PoseResult {
        &self.pose
    }

    /// The pose, while it is known.
    pub fn pose(&self) -> Option<&Pose> {
        self.pose.as_ref().ok()
    }

    /// How fast it comes nearer, m/s, once that is known.
    pub fn speed_m_s(&self) -> Option<Known> {
        self.pose().and_then(|_| self.closing.speed_m_s())
    }

    /// When it is here, s, if it comes nearer.
    pub fn time_to_collision_s(&self) -> Option<Known> {
        self.pose().and_then(|_| self.closing.time_to_collision_s())
    }

    /// Where the ends of the panel's axes are seen, while its pose is known: its middle, and half a side along its rows, its columns and
    /// into it (px).
    pub fn axes_px(&self) -> Option<[[f64; 2]; 4]> {
        self.axes_px
    }
}

/// Where the middle and the ends of a panel's axes are seen; none if one of them is not before the camera.
fn axes_px(pose: &Pose, lens: &Lens, size: PanelSize) -> Option<[[f64; 2]; 4]> {
    let half_m = size.half_side_m();
    let ends = [None, Some(0), Some(1), Some(2)].map(|axis: Option<usize>| {
        let along = |row: usize| axis.map_or(0.0, |axis| half_m * pose.rotation[row][axis]);
        [0, 1, 2].map(|row| pose.translation_m[row] + along(row))
    });
    let are_seen = ends.iter().all(|&[_, _, z]| z > 0.0);
    are_seen.then(|| ends.map(|[x, y, z]| lens.pixel([x / z, y / z])))
}
