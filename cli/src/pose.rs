//! Where a panel is, in metres and degrees, for people and for scripts.

use link::camera::Camera;
use link::geometry::Geometry;
use link::panel::PanelFrame;
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Appearance, Closing, Known, PanelSize, Pose, PoseEstimator, Seen};
use rx_pipeline::receiver::Reading;
use serde_json::{Value, json};

use crate::camera::Calibration;

/// Pixels around a panel that its pose is measured in; near ones are seen in larger ones.
const POSE_PIXELS: usize = 128 * 128;

/// Options that tell of the panel.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct PanelArguments {
    /// The gap between the edges of two of the panel's LEDs over their diameter, as the scenes' `interval`: with --led-diameter and the
    /// camera's focal_px in --camera, the panel's pose in metres is printed.
    #[arg(long, value_name = "I")]
    interval: Option<f64>,
    /// Diameter of the panel's LEDs in metres; the scenes' is 0.03.
    #[arg(long, value_name = "M")]
    led_diameter: Option<f64>,
}

impl PanelArguments {
    /// The panel's size, if it was told.
    fn size(&self) -> anyhow::Result<Option<PanelSize>> {
        let told = self.led_diameter.zip(self.interval);
        // What was told by half is checked, too.
        PanelSize::new(
            self.led_diameter.unwrap_or(0.03),
            self.interval.unwrap_or(1.0),
        )?;
        Ok(told
            .map(|(diameter, interval)| PanelSize::new(diameter, interval))
            .transpose()?)
    }
}

/// What poses are measured with.
pub struct PoseMeter {
    size: Option<PanelSize>,
    /// Whether anything was told for its sake.
    is_asked: bool,
    calibration: Calibration,
    estimator: Option<Box<PoseEstimator<POSE_PIXELS>>>,
}

/// A pose, or why there is none.
pub type Measured = Result<Pose, String>;

impl PoseMeter {
    /// By what was told of the panel and of the camera.
    pub fn new(panel: &PanelArguments, calibration: Calibration) -> anyhow::Result<Self> {
        Ok(Self {
            size: panel.size()?,
            is_asked: panel.interval.or(panel.led_diameter).is_some()
                || calibration != Calibration::default(),
            calibration,
            estimator: None,
        })
    }

    /// Whether somebody who has told of it wants to know it.
    pub fn is_asked(&self) -> bool {
        self.is_asked
    }

    /// Where the ends of a panel's axes are seen.
    fn axes_px(&self, pose: &Pose, frame: [usize; 2]) -> Option<[[f64; 2]; 4]> {
        let (lens, half_m) = (self.calibration.lens(frame).ok()?, self.size?.half_side_m());
        let seen = |axis: Option<usize>| {
            let along = |row: usize| axis.map_or(0.0, |axis| half_m * pose.rotation[row][axis]);
            let [x, y, z] = [0, 1, 2].map(|row| pose.translation_m[row] + along(row));
            lens.pixel([x / z, y / z])
        };
        Some([None, Some(0), Some(1), Some(2)].map(seen))
    }

    /// The pose of a panel that was read.
    pub fn pose(
        &mut self,
        frame: &Frame,
        corners: &Corners,
        bits: PanelFrame,
        camera: &Camera,
    ) -> Measured {
        self.followed(frame, corners, bits, camera, None, &mut None)
    }

    /// The same of a panel that is followed, and that may have said how large it is; how it looks is kept.
    fn followed(
        &mut self,
        frame: &Frame,
        corners: &Corners,
        bits: PanelFrame,
        camera: &Camera,
        said: Option<Geometry>,
        look: &mut Option<Appearance>,
    ) -> Measured {
        let before = look.take();
        let lens = self.calibration.lens([frame.width(), frame.height()])?;
        let size = match (self.size, said) {
            (Some(told), _) => told,
            (None, Some(said)) => PanelSize::new(said.led_diameter_m(), said.interval())
                .map_err(|why| format!("the panel tells a size that cannot be: {why}"))?,
            (None, None) => {
                return Err(
                    "no panel size: give --interval and --led-diameter; the panel has not told it"
                        .into(),
                );
            }
        };
        let estimator = self
            .estimator
            .get_or_insert_with(|| Box::new(PoseEstimator::new()));
        let pose = estimator.pose(&Seen {
            frame,
            corners,
            bits,
            camera,
            lens: &lens,
            size,
            before,
        });
        *look = estimator.appearance();
        pose.map_err(|why| why.to_string())
    }
}

/// Where a followed panel is, and how fast it comes nearer.
pub struct Whereabouts {
    pose: Measured,
    closing: Closing,
    look: Option<Appearance>,
    /// What the panel has said of its size.
    said: Option<Geometry>,
    /// Where the ends of its axes are seen: the middle, and half a side along its rows, its columns and into it (px).
    axes_px: Option<[[f64; 2]; 4]>,
}

impl Whereabouts {
    /// Of a panel that has not been read.
    pub const UNKNOWN: Self = Self {
        pose: Err(String::new()),
        closing: Closing::new(),
        look: None,
        said: None,
        axes_px: None,
    };

    /// Takes in what the panel says of its size; whether that is news.
    pub fn hear(&mut self, said: Geometry) -> bool {
        self.said.replace(said) != Some(said)
    }

    /// Measures it in a frame in which the panel was read.
    pub fn measure(
        &mut self,
        meter: &mut PoseMeter,
        time_s: f64,
        frame: &Frame,
        reading: &Reading,
        camera: &Camera,
    ) {
        let Reading { corners, detection } = reading;
        let bits = detection.bits;
        self.pose = meter.followed(frame, corners, bits, camera, self.said, &mut self.look);
        self.axes_px = None;
        if let Ok(pose) = &self.pose {
            self.closing.take(time_s, pose);
            self.axes_px = meter.axes_px(pose, [frame.width(), frame.height()]);
        }
    }

    /// Where the ends of the panel's axes are seen, while its pose is known: its middle, and half a side along its rows, its columns and into
    /// it (px).
    pub fn axes_px(&self) -> Option<[[f64; 2]; 4]> {
        self.axes_px
    }

    /// How fast it comes nearer, once that is known.
    pub fn speed_m_s(&self) -> Option<Known> {
        self.pose().and_then(|_| self.closing.speed_m_s())
    }

    /// Takes in why the panel was not read.
    pub fn lose(&mut self, why: &str) {
        self.axes_px = None;
        self.pose = Err(why.to_owned());
    }

    /// The pose, while it is known.
    pub fn pose(&self) -> Option<&Pose> {
        self.pose.as_ref().ok()
    }

    /// For scripts: the pose, and how fast it comes nearer once that is known.
    pub fn as_json(&self) -> Value {
        let mut pose = as_json(&self.pose);
        if self.pose.is_ok() {
            if let Some(Known { value, sigma }) = self.closing.speed_m_s() {
                pose["closing_speed_m_s"] = value.into();
                pose["closing_speed_sigma_m_s"] = sigma.into();
            }
            if let Some(Known { value, sigma }) = self.closing.time_to_collision_s() {
                pose["time_to_collision_s"] = value.into();
                pose["time_to_collision_sigma_s"] = sigma.into();
            }
        }
        pose
    }

    /// For people, to follow what else is said, if it `is_asked`.
    pub fn as_text(&self, is_asked: bool) -> String {
        if !is_asked {
            return String::new();
        }
        let mut text = format!("; {}", as_text(&self.pose));
        if let (Ok(_), Some(speed)) = (&self.pose, self.closing.speed_m_s()) {
            text += &format!("; coming nearer at {} m/s", with_sigma(speed));
            if let Some(time) = self.closing.time_to_collision_s() {
                text += &format!(", here in {} s", with_sigma(time));
            }
        }
        text
    }
}

/// A pose for scripts: angles in degrees, standard deviations beside, covariances of metres and radians.
pub fn as_json(measured: &Measured) -> Value {
    let pose = match measured {
        Ok(pose) => pose,
        Err(why) => return json!({ "known": false, "why": why }),
    };
    let numbers = pose.numbers();
    let angles = [
        numbers.azimuth,
        numbers.elevation,
        numbers.roll,
        numbers.yaw,
        numbers.pitch,
    ];
    let [azimuth, elevation, roll, yaw, pitch] = angles.map(in_degrees);
    let solutions = pose.solutions.map(|solution| {
        let [roll, yaw, pitch] = solution.angles().map(f64::to_degrees);
        json!({
            "probability": solution.probability, "range_m": solution.range_m, "roll_deg": roll, "yaw_deg": yaw, "pitch_deg": pitch,
        })
    });
    json!({
        "known": true,
        "range_m": numbers.range_m.value, "range_sigma_m": numbers.range_m.sigma,
        "azimuth_deg": azimuth.value, "azimuth_sigma_deg": azimuth.sigma,
        "elevation_deg": elevation.value, "elevation_sigma_deg": elevation.sigma,
        "roll_deg": roll.value, "roll_sigma_deg": roll.sigma,
        "yaw_deg": yaw.value, "yaw_sigma_deg": yaw.sigma,
        "pitch_deg": pitch.value, "pitch_sigma_deg": pitch.sigma,
        "translation_m": pose.translation_m, "rotation": pose.rotation, "covariance": pose.covariance,
        "solutions": solutions, "inflation": pose.inflation,
    })
}

/// A pose for people.
pub fn as_text(measured: &Measured) -> String {
    let pose = match measured {
        Ok(pose) => pose,
        Err(why) => return format!("pose unknown: {why}"),
    };
    let numbers = pose.numbers();
    let metres = with_sigma(numbers.range_m);
    let [azimuth, elevation, roll, yaw, pitch] = [
        numbers.azimuth,
        numbers.elevation,
        numbers.roll,
        numbers.yaw,
        numbers.pitch,
    ]
    .map(|known| with_sigma(in_degrees(known)));
    let [_, other] = pose.solutions;
    let mirrored = if other.probability > 0.01 {
        let [_, yaw, pitch] = other.angles().map(f64::to_degrees);
        format!(
            "; or, by {:.0} %, yaw {yaw:.0}°, pitch {pitch:.0}°",
            100.0 * other.probability
        )
    } else {
        String::new()
    };
    format!(
        "{metres} m off, azimuth {azimuth}°, elevation {elevation}°, roll {roll}°, yaw {yaw}°, pitch {pitch}°{mirrored}"
    )
}

fn in_degrees(known: Known) -> Known {
    Known {
        value: known.value.to_degrees(),
        sigma: known.sigma.to_degrees(),
    }
}

/// A number with its standard deviation, with two digits of that.
pub fn with_sigma(Known { value, sigma }: Known) -> String {
    let digits = (1.0 - sigma.max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$} ± {sigma:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_are_known_of_it() {
        let of = |value, sigma| with_sigma(Known { value, sigma });
        assert_eq!(of(50.1234, 0.0123), "50.123 ± 0.012");
        assert_eq!(of(7.4, 12.0), "7 ± 12");
        assert_eq!(of(1.0, 0.0), "1.000000 ± 0.000000");
    }

    #[test]
    fn a_panel_s_size_is_checked() {
        let told = |interval, led_diameter| {
            PanelArguments {
                interval,
                led_diameter,
            }
            .size()
        };
        assert!(told(None, None).unwrap().is_none());
        assert!(told(Some(1.0), None).unwrap().is_none());
        assert_eq!(
            told(Some(1.0), Some(0.03)).unwrap().unwrap().pitch_m(),
            0.06
        );
        for (interval, diameter) in [
            (Some(-1.0), None),
            (None, Some(f64::NAN)),
            (Some(1.0), Some(0.0)),
        ] {
            assert!(told(interval, diameter).is_err());
        }
    }
}
