//! A camera's geometry, as a person or a calibration tells it.
//!
//! Beside keys of our own, a calibration of OpenCV is read as it is: what its `calibration` sample writes (`%YAML:1.0`,
//! `!!opencv-matrix`, `distortion_coefficients`), and what ROS's `camera_calibration` makes of it (`image_width`, `camera_name`).

mod yaml;

use anyhow::{Context, bail, ensure};
use rx_pipeline::pose::Lens;
use serde::{Deserialize, Serialize};

use yaml::Yaml;

/// What is told of a lens; what is missing of it is said when it is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Focal length along x and y, in pixels.
    focal_px: Option<[f64; 2]>,
    /// The pixel on the optical axis; where nobody tells, the middle of the frame.
    principal_px: Option<[f64; 2]>,
    distortion: [f64; 8],
    /// Columns and rows of the frames that it was calibrated with, where that is told.
    size: Option<[usize; 2]>,
}

/// The keys of a camera's file that tell of its geometry.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// Focal length in pixels: one, or along x and along y.
    pub focal_px: Option<Focal>,
    /// Focal length in millimetres, with the pixels' pitch.
    pub focal_length_mm: Option<f64>,
    /// Pitch of the pixels in micrometres.
    pub pixel_pitch_um: Option<f64>,
    /// The pixel on the optical axis.
    pub principal_px: Option<[f64; 2]>,
    /// k1, k2, p1, p2, k3, k4, k5, k6, as many as there are.
    pub distortion: Option<Vec<f64>>,
}

/// A focal length, or two.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Focal {
    /// The same along x and y.
    One(f64),
    /// Along x and along y.
    Two([f64; 2]),
}

impl Keys {
    /// What they say, if all of it is in range.
    pub fn calibration(&self) -> anyhow::Result<Calibration> {
        let focal_px = match (self.focal_px, self.focal_length_mm, self.pixel_pitch_um) {
            (Some(Focal::One(focal_px)), None, None) => Some([focal_px; 2]),
            (Some(Focal::Two(focal_px)), None, None) => Some(focal_px),
            (None, Some(focal_length_mm), Some(pitch_um)) => Some([focal_length_mm * 1e3 / pitch_um; 2]),
            (None, None, None) => None,
            (Some(_), ..) => bail!("the focal length is told twice: give focal_px, or focal_length_mm and pixel_pitch_um"),
            _ => bail!("half a focal length is told: give both focal_length_mm and pixel_pitch_um"),
        };
        Calibration {
            focal_px,
            principal_px: self.principal_px,
            distortion: coefficients(self.distortion.as_deref().unwrap_or_default())?,
            size: None,
        }
        .checked()
    }
}

/// k1, k2, p1, p2, k3, k4, k5, k6, of which the last may be left out.
fn coefficients(told: &[f64]) -> anyhow::Result<[f64; 8]> {
    ensure!(
        matches!(told.len(), 0 | 1 | 2 | 4 | 5 | 8),
        "{} distortion coefficients: give k1, k2, p1, p2, k3, k4, k5, k6, or the first 1, 2, 4 or 5 of them",
        told.len()
    );
    let mut all = [0.0; 8];
    all[..told.len()].copy_from_slice(told);
    Ok(all)
}

impl Calibration {
    fn checked(self) -> anyhow::Result<Self> {
        let focal_px = self.focal_px.unwrap_or([1.0; 2]);
        let principal_px = self.principal_px.unwrap_or_default();
        Lens {
            focal_px,
            principal_px,
            distortion: self.distortion,
        }
        .checked()?;
        Ok(self)
    }

    /// The keys by which a camera's file tells the same, but for the size of the frames.
    pub fn keys(&self) -> Keys {
        let told = self.distortion.iter().any(|&c| c != 0.0);
        Keys {
            focal_px: self.focal_px.map(Focal::Two),
            principal_px: self.principal_px,
            distortion: told.then(|| self.distortion.to_vec()),
            ..Keys::default()
        }
    }

    /// Whether anything is known.
    pub fn is_told(&self) -> bool {
        *self != Self::default()
    }

    /// The lens before frames of `size`; why not, if it is not known.
    pub fn lens(&self, size: [usize; 2]) -> Result<Lens, String> {
        let Some(focal_px) = self.focal_px else {
            return Err("no focal length: give focal_px in --camera, or OpenCV's calibration file".into());
        };
        if let Some(calibrated) = self.size.filter(|&calibrated| calibrated != size) {
            let [[a, b], [c, d]] = [calibrated, size];
            return Err(format!(
                "the camera was calibrated with frames of {a} × {b} and these are {c} × {d}: calibrate it with such frames"
            ));
        }
        let usual = Lens::pinhole(1.0, size);
        Ok(Lens {
            focal_px,
            principal_px: self.principal_px.unwrap_or(usual.principal_px),
            distortion: self.distortion,
        })
    }

    /// Reads OpenCV's YAML; `None` if it is no calibration of OpenCV.
    pub fn of_opencv(text: &str) -> anyhow::Result<Option<Self>> {
        if !text.lines().any(|line| line.starts_with("camera_matrix")) {
            return Ok(None);
        }
        // Older than YAML's own directive, and no YAML.
        let text = match text.split_once('\n') {
            Some((first, rest)) if first.starts_with("%YAML:") => rest,
            _ => text,
        };
        let file = OpenCv::read(text).context("OpenCV's calibration cannot be read")?;
        if let Some(model) = &file.distortion_model {
            ensure!(
                matches!(model.as_str(), "plumb_bob" | "rational_polynomial"),
                "the distortion model {model:?} is none that is read: give plumb_bob or rational_polynomial"
            );
        }
        let [fx, skew, cx, below, fy, cy, g, h, one] = file.camera_matrix[..] else {
            bail!("camera_matrix has {} numbers instead of 3 × 3", file.camera_matrix.len());
        };
        ensure!(
            skew == 0.0 && [below, g, h] == [0.0; 3] && one == 1.0,
            "camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]: give the one that OpenCV's calibrateCamera returns"
        );
        let calibration = Self {
            focal_px: Some([fx, fy]),
            principal_px: Some([cx, cy]),
            distortion: coefficients(&file.distortion_coefficients)?,
            size: file.image_width.zip(file.image_height).map(|(width, height)| [width, height]),
        };
        calibration.checked().map(Some)
    }
}

/// The keys of OpenCV's file that are needed; it has others.
struct OpenCv {
    image_width: Option<usize>,
    image_height: Option<usize>,
    camera_matrix: Vec<f64>,
    distortion_model: Option<String>,
    distortion_coefficients: Vec<f64>,
}

impl OpenCv {
    fn read(text: &str) -> anyhow::Result<Self> {
        let file = Yaml::read(text)?;
        let size = |key| file.get(key)?.map(Yaml::count).transpose().context(key);
        let model = file.get("distortion_model")?.map(Yaml::text).transpose();
        let numbers = |key| {
            let Some(matrix) = file.get(key)? else {
                return Ok(None);
            };
            let data = matrix.get("data").and_then(|data| data.context("it has no data")?.numbers());
            data.map(Some).context(key)
        };
        Ok(Self {
            image_width: size("image_width")?,
            image_height: size("image_height")?,
            camera_matrix: numbers("camera_matrix")?.context("camera_matrix is missing")?,
            distortion_model: model.context("distortion_model")?,
            distortion_coefficients: numbers("distortion_coefficients")?.unwrap_or_default(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENCV: &str = "%YAML:1.0\n---\ncalibration_time: \"Mon 23 Nov 2026\"\nimage_width: 1920\nimage_height: 1080\nflags: 0\n\
        camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 3.6363636e+03, 0., 959.5, 0., 3640., 539.25,\n       \
        0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -1.5e-01, 0.02, 1e-4,\n       \
        -2e-4, 0. ]\navg_reprojection_error: 1.5e-01\n";
    const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: front\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
        data: [500.0, 0, 320.5, 0, 501.0, 240.5, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  \
        data: [0.1, -0.2, 0, 0, 0]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";

    #[test]
    fn calibrations_of_opencv_and_ros_are_read_as_they_are() {
        let lens = Calibration::of_opencv(OPENCV).unwrap().unwrap().lens([1920, 1080]).unwrap();
        assert_eq!(lens.focal_px, [3636.3636, 3640.0]);
        assert_eq!(lens.principal_px, [959.5, 539.25]);
        assert_eq!(lens.distortion[..5], [-0.15, 0.02, 1e-4, -2e-4, 0.0]);
        let ros = Calibration::of_opencv(ROS).unwrap().unwrap();
        assert_eq!(ros.lens([640, 480]).unwrap().focal_px, [500.0, 501.0]);
        let other_size = ros.lens([320, 240]).unwrap_err();
        assert!(other_size.contains("640 × 480") && other_size.contains("320 × 240"), "{other_size}");
        assert_eq!(Calibration::of_opencv("blur_sigma_px = 1.0").unwrap(), None);
    }

    #[test]
    fn what_is_no_calibration_is_refused() {
        for (from, to, wrong) in [
            ("3.6363636e+03", "-3.0", "focal length of -3 px"),
            ("0., 0., 1. ]", "0., 1. ]", "8 numbers instead of 3 × 3"),
            ("0., 0., 1. ]", "0., 1., 1. ]", "not [fx 0 cx"),
            ("-2e-4, 0. ]", "0., 0., 0. ]", "6 distortion coefficients"),
            ("rows: 3", "rows: [", "cannot be read"),
            ("data: [ 3.6", "data: [ wide, 3.6", "camera_matrix: \"wide\" is no number"),
            ("   data: [ 3.6", "   date: [ 3.6", "camera_matrix: it has no data"),
            ("camera_matrix:", "camera_matrix_0:", "camera_matrix is missing"),
            (
                "image_width: 1920",
                "image_width: -1920",
                "image_width: \"-1920\" is no whole number",
            ),
            ("flags: 0", "image_height: 1080", "image_height is told twice"),
        ] {
            let error = Calibration::of_opencv(&OPENCV.replace(from, to)).unwrap_err();
            assert!(format!("{error:#}").contains(wrong), "{error:#}");
        }
        let fisheye = ROS.replace("plumb_bob", "equidistant");
        assert!(Calibration::of_opencv(&fisheye).unwrap_err().to_string().contains("equidistant"));
    }

    #[test]
    fn a_focal_length_is_told_once_and_whole() {
        let keys = Keys {
            focal_length_mm: Some(25.0),
            pixel_pitch_um: Some(6.875),
            ..Keys::default()
        };
        let lens = keys.calibration().unwrap().lens([1920, 1080]).unwrap();
        assert!((lens.focal_px[0] - 25e3 / 6.875).abs() < 1e-9);
        assert_eq!(lens.principal_px, [959.5, 539.5]);
        let twice = Keys {
            focal_px: Some(Focal::One(3636.0)),
            ..keys.clone()
        };
        assert!(twice.calibration().unwrap_err().to_string().contains("told twice"));
        let half = Keys {
            pixel_pitch_um: None,
            ..keys
        };
        assert!(half.calibration().unwrap_err().to_string().contains("half a focal length"));
        let unknown = Keys::default().calibration().unwrap().lens([640, 480]).unwrap_err();
        assert!(unknown.contains("give focal_px in --camera"));
    }
}
