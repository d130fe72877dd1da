//! The poses of panels, from their size and the lens. The user configures both, or the panels announce their size.

use link::camera::Camera;
use link::geometry::Geometry;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Closing, Estimate, Lens, PanelSize, PanelSizeError, Pose};
#[cfg(feature = "poses")]
use rx_pipeline::pose::{PanelObservation, PoseEstimator};
use rx_pipeline::receiver::{FrameReading, Loss};

/// Maximum number of pixels around a panel in which its pose is measured; a nearer panel is binned.
#[cfg(feature = "poses")]
const POSE_PIXELS: usize = 128 * 128;
/// The LED diameter in metres and the interval of the scenes: if only one number of a size is given, it is validated with the other of
/// these.
const USUAL: (f64, f64) = (0.03, 1.0);

/// A pose, or why it is not known.
pub type PoseResult = Result<Pose, String>;

/// A panel's size if both numbers are configured: the diameter of an LED in metres, and the gap between two LEDs in diameters.
///
/// ```
/// use reception::panel_pose::configured_size;
/// assert_eq!(configured_size(Some(0.03), Some(1.0))?.map(|size| size.pitch_m()), Some(0.06));
/// assert_eq!(configured_size(None, Some(1.0))?, None);
/// assert!(configured_size(None, Some(-1.0)).is_err());
/// # Ok::<(), rx_pipeline::pose::PanelSizeError>(())
/// ```
///
/// # Errors
/// [`PanelSizeError`] if a number is out of range, even if it is the only one.
pub fn configured_size(led_diameter_m: Option<f64>, interval: Option<f64>) -> Result<Option<PanelSize>, PanelSizeError> {
    let size = PanelSize::new(led_diameter_m.unwrap_or(USUAL.0), interval.unwrap_or(USUAL.1))?;
    Ok((led_diameter_m.is_some() && interval.is_some()).then_some(size))
}

/// The input of a pose: a panel that was read, and the camera that saw it.
pub struct PoseInput<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// The panel's corners in the frame, and its bits.
    pub reading: &'a FrameReading,
    /// The camera.
    pub camera: &'a Camera,
    /// The lens, or why it is unknown.
    pub lens: &'a Result<Lens, String>,
}

/// Measures poses; one serves all panels.
pub struct PoseMeter {
    size: Option<PanelSize>,
    /// Made with the first pose, because it is large.
    #[cfg(feature = "poses")]
    estimator: Option<Box<PoseEstimator<POSE_PIXELS>>>,
}

impl PoseMeter {
    /// A meter for panels of a known size, or for panels that have to announce it.
    pub const fn new(size: Option<PanelSize>) -> Self {
        Self {
            size,
            #[cfg(feature = "poses")]
            estimator: None,
        }
    }

    /// The panel's size: the configured one, or else the one that the panel has announced.
    fn size(&self, announced: Option<Geometry>) -> Result<PanelSize, String> {
        self.size
            .or(announced.map(PanelSize::from))
            .ok_or_else(|| "no panel size: give the LEDs' diameter and interval, or wait until the panel announces them".into())
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
        Err("this program does not measure poses".into())
    }
}

/// The pose of a followed panel, and its closing speed.
#[derive(Clone, Debug)]
pub struct PanelPose {
    pose: PoseResult,
    closing: Closing,
    /// The size that the panel has announced.
    announced: Option<Geometry>,
    axes_px: Option<[[f64; 2]; 4]>,
}

impl PanelPose {
    /// The state of a panel that has not been read.
    pub(crate) const UNKNOWN: Self = Self {
        pose: Err(String::new()),
        closing: Closing::new(),
        announced: None,
        axes_px: None,
    };

    /// The pose of a panel in a single picture.
    pub fn in_picture(meter: &mut PoseMeter, input: &PoseInput) -> Self {
        let mut panel_pose = Self::UNKNOWN;
        panel_pose.measure(meter, 0.0, input);
        panel_pose
    }

    /// Sets the size that the panel announces; returns whether that is new.
    pub(crate) fn set_size(&mut self, announced: Geometry) -> bool {
        let before = self.announced.replace(announced);
        if before.is_some_and(|before| before != announced) {
            // With another size the panel seems to jump, which is not a motion.
            self.closing = Closing::new();
        }
        before != Some(announced)
    }

    /// Measures the pose from a frame taken at this time, in which the panel was read.
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

    /// Sets the pose to unknown, because the picture is mirrored.
    pub(crate) fn set_mirrored(&mut self) {
        self.axes_px = None;
        self.pose = Err("the picture is mirrored: mirror it back to get the panel's pose".into());
    }

    /// Sets the reason why the panel was not read. If the panel is no longer followed, its state is cleared, because the next panel may be
    /// another one.
    pub(crate) fn lose(&mut self, why: &Loss) {
        if matches!(why, Loss::Lost(_)) {
            *self = Self::UNKNOWN;
        }
        self.axes_px = None;
        self.pose = Err(why.to_string());
    }

    /// The pose, or why it is unknown.
    pub fn measured(&self) -> &PoseResult {
        &self.pose
    }

    /// The pose, if it is known.
    pub fn pose(&self) -> Option<&Pose> {
        self.pose.as_ref().ok()
    }

    /// Closing speed in m/s, if it is known.
    pub fn speed_m_s(&self) -> Option<Estimate> {
        self.pose().and_then(|_| self.closing.speed_m_s())
    }

    /// Time to collision in seconds, if the panel approaches.
    pub fn time_to_collision_s(&self) -> Option<Estimate> {
        self.pose().and_then(|_| self.closing.time_to_collision_s())
    }

    /// The image of the panel's axes in pixels, if the pose is known: its middle, and the ends of half a side along its rows, its columns
    /// and into it.
    pub fn axes_px(&self) -> Option<[[f64; 2]; 4]> {
        self.axes_px
    }
}

/// The image of a panel's middle and of the ends of its axes; none if one of them is not in front of the camera.
fn axes_px(pose: &Pose, lens: &Lens, size: PanelSize) -> Option<[[f64; 2]; 4]> {
    let half_m = size.half_side_m();
    let ends = [None, Some(0), Some(1), Some(2)].map(|axis: Option<usize>| {
        let along = |row: usize| axis.map_or(0.0, |axis| half_m * pose.rotation[row][axis]);
        [0, 1, 2].map(|row| pose.translation_m[row] + along(row))
    });
    let are_seen = ends.iter().all(|&[_, _, z]| z > 0.0);
    are_seen.then(|| ends.map(|[x, y, z]| lens.pixel([x / z, y / z])))
}
