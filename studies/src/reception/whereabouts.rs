//! Where panels are, with what a computer knows beside a frame: the panels' size and the lens, as told by a person or by the panels.

use link::camera::Camera;
use link::geometry::Geometry;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Closing, Known, Lens, PanelSize, PanelSizeError, Pose, PoseEstimator, Seen};
use rx_pipeline::receiver::{Loss, Reading};

/// Pixels around a panel that its pose is measured in; near ones are seen in larger ones.
const POSE_PIXELS: usize = 128 * 128;
/// The scenes' LEDs, m, and their interval: what half a size is checked with.
const USUAL: (f64, f64) = (0.03, 1.0);

/// A pose, or why there is none.
pub type Measured = Result<Pose, String>;

/// A panel's size if both numbers were told: the diameter of an LED in metres, and the gap between two over it.
///
/// ```
/// use studies::reception::whereabouts::told_size;
/// assert_eq!(told_size(Some(0.03), Some(1.0))?.map(|size| size.pitch_m()), Some(0.06));
/// assert_eq!(told_size(None, Some(1.0))?, None);
/// assert!(told_size(None, Some(-1.0)).is_err());
/// # Ok::<(), rx_pipeline::pose::PanelSizeError>(())
/// ```
///
/// # Errors
/// [`PanelSizeError`], also of what was told by half.
pub fn told_size(led_diameter_m: Option<f64>, interval: Option<f64>) -> Result<Option<PanelSize>, PanelSizeError> {
    let size = PanelSize::new(led_diameter_m.unwrap_or(USUAL.0), interval.unwrap_or(USUAL.1))?;
    Ok((led_diameter_m.is_some() && interval.is_some()).then_some(size))
}

/// A panel that was read, and what it was seen through.
pub struct Sight<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Where the panel is in it, and what it shows.
    pub reading: &'a Reading,
    /// The camera.
    pub camera: &'a Camera,
    /// The lens, or why it is not known.
    pub lens: Result<Lens, String>,
}

/// What poses are measured with: one serves all panels.
pub struct PoseMeter {
    told: Option<PanelSize>,
    /// Made with the first pose: it is large.
    estimator: Option<Box<PoseEstimator<POSE_PIXELS>>>,
}

impl PoseMeter {
    /// Of panels whose size was told, or which have to tell it themselves.
    pub const fn new(told: Option<PanelSize>) -> Self {
        Self { told, estimator: None }
    }

    /// The pose of a panel in a single frame.
    ///
    /// # Errors
    /// Why it is not known.
    pub fn pose(&mut self, sight: &Sight) -> Measured {
        let lens = sight.lens.clone()?;
        self.fitted(sight, &lens, self.size(None)?)
    }

    /// The size to go by: what was told counts, then what the panel has said.
    fn size(&self, said: Option<Geometry>) -> Result<PanelSize, String> {
        if let Some(told) = self.told {
            return Ok(told);
        }
        said.map(PanelSize::from)
            .ok_or_else(|| "no panel size: give the LEDs' diameter and interval, or wait for the panel to tell them".into())
    }

    fn fitted(&mut self, sight: &Sight, lens: &Lens, size: PanelSize) -> Measured {
        let estimator = self.estimator.get_or_insert_with(|| Box::new(PoseEstimator::new()));
        let pose = estimator.pose(&Seen {
            frame: sight.frame,
            corners: &sight.reading.corners,
            bits: sight.reading.detection.bits,
            camera: sight.camera,
            lens,
            size,
        });
        pose.map_err(|why| why.to_string())
    }
}

/// Where a followed panel is, and how fast it comes nearer.
pub struct Whereabouts {
    pose: Measured,
    closing: Closing,
    /// What the panel has said of its size.
    said: Option<Geometry>,
    axes_px: Option<[[f64; 2]; 4]>,
}

impl Whereabouts {
    /// Of a panel that has not been read.
    pub const UNKNOWN: Self = Self {
        pose: Err(String::new()),
        closing: Closing::new(),
        said: None,
        axes_px: None,
    };

    /// Takes in what the panel says of its size; whether that is news.
    pub fn hear(&mut self, said: Geometry) -> bool {
        let before = self.said.replace(said);
        if before.is_some_and(|before| before != said) {
            // By another size it is at another place, which is no motion.
            self.closing = Closing::new();
        }
        before != Some(said)
    }

    /// Measures it in a frame, taken at a time, in which the panel was read.
    pub fn measure(&mut self, meter: &mut PoseMeter, time_s: f64, sight: &Sight) {
        self.axes_px = None;
        self.pose = sight.lens.clone().and_then(|lens| {
            let size = meter.size(self.said)?;
            let pose = meter.fitted(sight, &lens, size)?;
            self.closing.take(time_s, &pose);
            self.axes_px = axes_px(&pose, &lens, size);
            Ok(pose)
        });
    }

    /// Takes in why the panel was not read. All is forgotten of one that is followed no more: what is found next may be another.
    pub fn lose(&mut self, why: &Loss) {
        if matches!(why, Loss::Lost(_)) {
            *self = Self::UNKNOWN;
        }
        self.axes_px = None;
        self.pose = Err(why.to_string());
    }

    /// The pose, or why it is not known.
    pub fn measured(&self) -> &Measured {
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
