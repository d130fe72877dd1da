//! A camera's geometry, from the user or from a calibration.
//!
//! Besides this tool's own keys, it reads OpenCV calibrations: the output of its `calibration` sample (`%YAML:1.0`, `!!opencv-matrix`,
//! `distortion_coefficients`), of ROS's `camera_calibration` (`image_width`, `camera_name`), and of `ros2 topic echo` for a topic
//! `camera_info`. Errors name other formats.

mod form;
mod yaml;

pub use form::foreign;

use anyhow::{Context, bail, ensure};
use rx_pipeline::pose::Lens;
use serde::{Deserialize, Serialize};

use yaml::Yaml;

/// A lens from the user. Missing values are reported on use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Focal length along x and y, in pixels.
    focal_px: Option<[f64; 2]>,
    /// The pixel on the optical axis; the middle of the frame if `None`.
    principal_px: Option<[f64; 2]>,
    distortion: [f64; 8],
    /// Columns and rows of the calibration frames, if the file has them.
    size: Option<[usize; 2]>,
}

/// The geometry keys of a camera file.
#[derive(Clone, Debug, Default)]
pub struct Keys {
    /// Focal length in pixels: one value, or along x and along y.
    pub focal_px: Option<Focal>,
    /// Focal length in millimetres; requires the pixel pitch.
    pub focal_length_mm: Option<f64>,
    /// Pixel pitch in micrometres.
    pub pixel_pitch_um: Option<f64>,
    /// The pixel on the optical axis.
    pub principal_px: Option<[f64; 2]>,
    /// k1, k2, p1, p2, k3, k4, k5, k6, or the first of them; those of OpenCV's further models only if they are 0.
    pub distortion: Option<Vec<f64>>,
}

/// One focal length, or one per axis.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged, expecting = "no focal length: give one number of pixels, or [x, y]")]
pub enum Focal {
    /// The same along x and y.
    One(f64),
    /// Along x and along y.
    Two([f64; 2]),
}

impl Keys {
    /// The calibration from these keys, if all values are in range.
    pub fn calibration(&self) -> anyhow::Result<Calibration> {
        let focal_px = match (self.focal_px, self.focal_length_mm, self.pixel_pitch_um) {
            (Some(Focal::One(focal_px)), None, None) => Some([focal_px; 2]),
            (Some(Focal::Two(focal_px)), None, None) => Some(focal_px),
            (None, Some(focal_length_mm), Some(pitch_um)) => {
                ensure!(
                    focal_length_mm > 0.0 && pitch_um > 0.0,
                    "a focal length of {focal_length_mm} mm and a pixel pitch of {pitch_um} µm are not both above 0: give those of the \
                     lens and of the sensor"
                );
                Some([focal_length_mm * 1e3 / pitch_um; 2])
            }
            (None, None, None) => None,
            (Some(_), ..) => bail!("the focal length is given twice: give either focal_px or focal_length_mm and pixel_pitch_um"),
            _ => bail!("the focal length is incomplete: give both focal_length_mm and pixel_pitch_um"),
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

/// k1, k2, p1, p2, k3, k4, k5, k6, padded with 0. OpenCV's s1 to s4 and τx, τy may follow if they are 0.
fn coefficients(told: &[f64]) -> anyhow::Result<[f64; 8]> {
    ensure!(
        matches!(told.len(), 0 | 1 | 2 | 4 | 5 | 8 | 12 | 14),
        "{} distortion coefficients: give k1, k2, p1, p2, k3, k4, k5, k6, or the first 1, 2, 4 or 5 of them",
        told.len()
    );
    let (told, further) = told.split_at(told.len().min(8));
    for (numbers, what, flag) in [
        (further.get(..4), "a thin prism (s1 to s4)", "CALIB_THIN_PRISM_MODEL"),
        (further.get(4..), "a tilted sensor (τx, τy)", "CALIB_TILTED_MODEL"),
    ] {
        ensure!(
            numbers.unwrap_or_default().iter().all(|&number| number == 0.0),
            "the distortion has {what}, which is not supported: calibrate without {flag}"
        );
    }
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

    /// The keys for a camera file; the frame size has none.
    pub fn keys(&self) -> Keys {
        let told = self.distortion.iter().any(|&c| c != 0.0);
        Keys {
            focal_px: self.focal_px.map(Focal::Two),
            principal_px: self.principal_px,
            distortion: told.then(|| self.distortion.to_vec()),
            ..Keys::default()
        }
    }

    /// Whether any value is known.
    pub fn is_set(&self) -> bool {
        *self != Self::default()
    }

    /// The lens for frames of `size`, or the reason why it is unknown.
    pub fn lens(&self, size: [usize; 2]) -> Result<Lens, String> {
        let Some(focal_px) = self.focal_px else {
            return Err("no focal length: give focal_px in --camera, or OpenCV's calibration file".into());
        };
        if let Some(calibrated) = self.size.filter(|&calibrated| calibrated != size) {
            let [[a, b], [c, d]] = [calibrated, size];
            return Err(format!(
                "the camera was calibrated with frames of {a} × {b}, and these are {c} × {d}: calibrate it at that size"
            ));
        }
        let usual = Lens::pinhole(1.0, size);
        Ok(Lens {
            focal_px,
            principal_px: self.principal_px.unwrap_or(usual.principal_px),
            distortion: self.distortion,
        })
    }

    /// Reads OpenCV's YAML and ROS's variants; `None` if `text` is not such a calibration.
    pub fn of_opencv(text: &str) -> anyhow::Result<Option<Self>> {
        if let Some(message) = form::camera_info(text) {
            let file = OpenCv::of_message(message).context("ROS's camera_info cannot be read")?;
            return file.calibration().map(Some);
        }
        if !text.lines().any(|line| line.starts_with("camera_matrix")) {
            return Ok(None);
        }
        // OpenCV's directive predates YAML's and is not valid YAML.
        let text = match text.split_once('\n') {
            Some((first, rest)) if first.starts_with("%YAML:") => rest,
            _ => text,
        };
        let file = OpenCv::read(text).context("OpenCV's calibration cannot be read")?;
        file.calibration().map(Some)
    }
}

/// The required keys of OpenCV's file; it has others.
struct OpenCv {
    image_width: Option<usize>,
    image_height: Option<usize>,
    camera_matrix: Vec<f64>,
    distortion_model: Option<String>,
    distortion_coefficients: Vec<f64>,
}

impl OpenCv {
    fn calibration(self) -> anyhow::Result<Calibration> {
        let file = self;
        if let Some(model) = &file.distortion_model {
            ensure!(
                matches!(model.as_str(), "plumb_bob" | "rational_polynomial"),
                "the distortion model {model:?} is not supported: give plumb_bob or rational_polynomial"
            );
        }
        let [fx, skew, cx, below, fy, cy, g, h, one] = file.camera_matrix[..] else {
            bail!("camera_matrix has {} numbers instead of 3 × 3", file.camera_matrix.len());
        };
        ensure!(
            skew == 0.0 && [below, g, h] == [0.0; 3] && one == 1.0,
            "camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]: give the one that OpenCV's calibrateCamera returns"
        );
        Calibration {
            focal_px: Some([fx, fy]),
            principal_px: Some([cx, cy]),
            distortion: coefficients(&file.distortion_coefficients)?,
            size: file.image_width.zip(file.image_height).map(|(width, height)| [width, height]),
        }
        .checked()
    }

    /// Reads a `sensor_msgs/CameraInfo` message of ROS 1 or 2.
    fn of_message(text: &str) -> anyhow::Result<Self> {
        let message = Yaml::read(text)?;
        let get = |names: [&'static str; 2]| anyhow::Ok((names[0], message.get(names[0])?.or(message.get(names[1])?)));
        let numbers = |names| {
            let (name, list) = get(names)?;
            list.map(Yaml::numbers).transpose().context(name)
        };
        let count = |name| message.get(name)?.map(Yaml::count).transpose().context(name);
        for name in ["binning_x", "binning_y"] {
            let binning = count(name)?.unwrap_or_default();
            ensure!(
                binning <= 1,
                "{name} is {binning}, and the calibration is that of all pixels: write the one of the frames as focal_px, principal_px and \
                 distortion"
            );
        }
        Ok(Self {
            image_width: count("width")?,
            image_height: count("height")?,
            camera_matrix: numbers(["k", "K"])?.context("k is missing")?,
            distortion_model: get(["distortion_model"; 2])?
                .1
                .map(Yaml::text)
                .transpose()?
                .filter(|model| !model.is_empty()),
            distortion_coefficients: numbers(["d", "D"])?.unwrap_or_default(),
        })
    }

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
    fn coefficients_of_further_models_are_read_where_they_are_0_and_named_where_not() {
        for (further, refused) in [
            ("0., 0., 0., 0.", None),
            ("0., 0., 0., 0., 0., 0.", None),
            ("0., 0., 1e-3, 0.", Some("thin prism")),
            ("0., 0., 0., 0., 0., 1e-3", Some("tilted sensor")),
        ] {
            let data = format!("-2e-4, 0., 0.1, 0.2, 0.3, {further} ]");
            let read = Calibration::of_opencv(&OPENCV.replace("-2e-4, 0. ]", &data));
            match refused {
                None => {
                    let lens = read.unwrap().unwrap().lens([1920, 1080]).unwrap();
                    assert_eq!(lens.distortion, [-0.15, 0.02, 1e-4, -2e-4, 0.0, 0.1, 0.2, 0.3]);
                }
                Some(what) => assert!(format!("{:#}", read.unwrap_err()).contains(what), "{further}"),
            }
        }
    }

    #[test]
    fn what_ros_shows_of_a_camera_is_read() {
        let ros2 = "header:\n  stamp:\n    sec: 1\n    nanosec: 2\n  frame_id: front\nheight: 480\nwidth: 640\ndistortion_model: \
            plumb_bob\nd:\n- 0.1\n- -0.2\n- 0.0\n- 0.0\n- 0.0\nk:\n- 500.0\n- 0.0\n- 320.5\n- 0.0\n- 501.0\n- 240.5\n- 0.0\n- 0.0\n- 1.0\n\
            r:\n- 1.0\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  do_rectify: false\n---\n";
        let ros1 = "header: \n  seq: 7\nheight: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nD: [0.1, -0.2, 0.0, 0.0, 0.0]\n\
            K: [500.0, 0.0, 320.5, 0.0, 501.0, 240.5, 0.0, 0.0, 1.0]\nbinning_x: 0\n---\n";
        let file = Calibration::of_opencv(ROS).unwrap();
        for text in [ros2, &ros2.repeat(2), &format!("---\n{ros2}"), ros1] {
            assert_eq!(Calibration::of_opencv(text).unwrap(), file);
        }
        for (from, to, wrong) in [
            ("- 500.0", "- 0.0", "focal length"),
            ("plumb_bob", "equidistant", "equidistant"),
            ("binning_x: 0", "binning_x: 2", "binning_x is 2"),
            ("- 501.0\n", "", "8 numbers instead of 3 × 3"),
        ] {
            let error = Calibration::of_opencv(&ros2.replace(from, to)).unwrap_err();
            assert!(format!("{error:#}").contains(wrong), "{error:#}");
        }
    }

    #[test]
    fn forms_that_are_not_read_are_named() {
        for (text, form) in [
            ("<?xml version=\"1.0\"?>\n<opencv_storage>\n</opencv_storage>", "XML"),
            ("{\"camera_matrix\": [[1, 0, 0]]}", "JSON"),
            ("[[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]", "JSON"),
            (
                "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0, 0, 0]\n  distortion_model: radtan\n  intrinsics: [500, 500, \
                 320, 240]\n  resolution: [640, 480]\n",
                "Kalibr",
            ),
            ("mtx:\n- [500, 0, 320]\ndist: [0.1]\n", "YAML"),
        ] {
            let named = foreign(text);
            assert!(named.is_some_and(|named| named.contains(form)), "{form}: {named:?}");
        }
        for own in [
            "blur_sigma_px = 1.5\n",
            "# by hand: 2026\nencoding = \"srgb\"\n",
            "",
            "focal_px = 0: 1",
            "[camera]\n",
        ] {
            assert_eq!(foreign(own), None);
        }
    }

    #[test]
    fn what_is_no_calibration_is_refused() {
        for (from, to, wrong) in [
            ("3.6363636e+03", "-3.0", "focal length of -3 px"),
            ("0., 0., 1. ]", "0., 1. ]", "8 numbers instead of 3 × 3"),
            ("0., 0., 1. ]", "0., 1., 1. ]", "not [fx 0 cx"),
            ("-2e-4, 0. ]", "0., 0., 0. ]", "6 distortion coefficients"),
            ("rows: 3", "rows: [", "cannot be read"),
            ("data: [ 3.6", "data: [ wide, 3.6", "camera_matrix: \"wide\" is not a number"),
            ("   data: [ 3.6", "   date: [ 3.6", "camera_matrix: it has no data"),
            ("camera_matrix:", "camera_matrix_0:", "camera_matrix is missing"),
            (
                "image_width: 1920",
                "image_width: -1920",
                "image_width: \"-1920\" is not a whole number",
            ),
            ("flags: 0", "image_height: 1080", "image_height is given twice"),
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
        assert!(twice.calibration().unwrap_err().to_string().contains("given twice"));
        let half = Keys {
            pixel_pitch_um: None,
            ..keys
        };
        assert!(half.calibration().unwrap_err().to_string().contains("focal length is incomplete"));
        let unknown = Keys::default().calibration().unwrap().lens([640, 480]).unwrap_err();
        assert!(unknown.contains("give focal_px in --camera"));
    }
}
