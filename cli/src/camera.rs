//! User settings of a camera, from a file or from single options.
//!
//! Each value is a starting point that the receiver refines. A file has any of these keys:
//!
//! ```toml
//! encoding = { gamma = 2.2 }   # or "srgb", or "rec709"
//! black_grey = 0.0             # grey level of no light, of 255
//! blur_sigma_px = 1.5          # lens blur, standard deviation
//! blur_aspect = 1.0            # the blur along x over that along y
//! read_noise_e = 3.0
//! line_delay_exposures = 0.02  # how much later each line is exposed than the one above; 0: all at once
//! channel = "brightest"        # how pixels are read: see `frames`
//! bayer = "RGGB"
//! depth = 12
//! focal_px = 3636.4            # or [along x, along y], or focal_length_mm and pixel_pitch_um: for the panel's pose
//! principal_px = [959.5, 539.5]   # the pixel on the optical axis; default: the middle of the frame
//! distortion = [-0.1, 0.0]     # k1, k2, p1, p2, k3, k4, k5, k6, or the first of them, as in OpenCV
//! ```
//!
//! or is an OpenCV calibration: see [`calibration`].

mod calibration;

pub use calibration::Calibration;
use calibration::{Focal, Keys};

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use link::camera::{Camera, Encoding};
use reception::colour::Channel;
use reception::deep::{self, SampleKind};
use reception::learnt;
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::likelihood::LINE_DELAY_MAX;
use serde::{Deserialize, Deserializer, Serialize};
use sim::input;

use crate::files::write;
use crate::frames::{Bayer, PixelArguments};

/// Options of a camera.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct CameraArguments {
    /// The camera, as `vocc receive --save-camera` writes it, or a YAML calibration of OpenCV or ROS. The options below override it. The
    /// receiver starts from these values and learns; only focal_px, for the panel's pose, cannot be learnt.
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// The camera's encoding: linear, srgb, rec709, or a gamma of 1 to 4. The receiver starts from it and learns.
    #[arg(long, value_name = "CURVE", value_parser = encoding, visible_alias = "gamma")]
    encoding: Option<Encoding>,
    /// Grey level of no light, 0 to 64.
    #[arg(long, value_name = "GREY")]
    black: Option<f32>,
    /// Standard deviation of the lens blur in pixels, 0.3 to 4.
    #[arg(long, value_name = "PX")]
    blur: Option<f32>,
}

/// The contents of a camera file.
#[derive(Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default, deserialize_with = "encoding_in_file")]
    encoding: Option<Encoding>,
    black_grey: Option<f32>,
    blur_sigma_px: Option<f32>,
    blur_aspect: Option<f32>,
    read_noise_e: Option<f32>,
    line_delay_exposures: Option<f32>,
    channel: Option<Channel>,
    bayer: Option<Bayer>,
    depth: Option<u8>,
    /// Focal length in pixels: one value, or along x and along y.
    focal_px: Option<Focal>,
    focal_length_mm: Option<f64>,
    pixel_pitch_um: Option<f64>,
    principal_px: Option<[f64; 2]>,
    distortion: Option<Vec<f64>>,
}

/// Checked settings of a camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraHints {
    /// The camera; unset values have defaults.
    pub camera: Camera,
    /// The encoding, if set.
    pub encoding: Option<Encoding>,
    /// Delay from one line to the next, in exposures, if set.
    pub line_delay: Option<f32>,
    /// How to read the pixels.
    pub pixels: PixelArguments,
    /// The lens, as far as it is known.
    pub calibration: Calibration,
}

impl CameraArguments {
    /// Whether any option is set.
    fn is_set(&self) -> bool {
        self.camera.is_some() || self.encoding.is_some() || self.black.is_some() || self.blur.is_some()
    }

    /// The camera if any option is set, for frames that do not come from files.
    pub fn camera_if_any(&self) -> anyhow::Result<Option<Camera>> {
        if self.is_set() {
            return Ok(Some(self.hints(PixelArguments::default())?.camera));
        }
        Ok(None)
    }

    /// The camera file, if given.
    pub fn file(&self) -> Option<PathBuf> {
        self.camera.clone()
    }

    /// The camera from these options, otherwise from a file, otherwise the default.
    fn over(&self, file: &File) -> Camera {
        let usual = Camera::default();
        Camera {
            encoding: self.encoding.or(file.encoding).unwrap_or(usual.encoding),
            black_grey: self.black.or(file.black_grey).unwrap_or(usual.black_grey),
            blur_sigma_px: self.blur.or(file.blur_sigma_px).unwrap_or(usual.blur_sigma_px),
            blur_aspect: file.blur_aspect.unwrap_or(usual.blur_aspect),
            read_noise_e: file.read_noise_e.unwrap_or(usual.read_noise_e),
        }
    }

    /// Reads the file, if given, and checks all values.
    pub fn hints(&self, pixels: PixelArguments) -> anyhow::Result<CameraHints> {
        let (file, calibration) = match &self.camera {
            Some(path) => read(path)?,
            None => Default::default(),
        };
        let encoding = self.encoding.or(file.encoding);
        // First without the file, so that an option's fault is not attributed to it.
        let camera = self.over(&File::default()).checked()?;
        let camera = match &self.camera {
            Some(path) => {
                let checked = self.over(&file).checked();
                checked.with_context(|| format!("in the camera file {}", path.display()))?
            }
            None => camera,
        };
        let pixels = pixels.or(PixelArguments {
            channel: file.channel,
            bayer: file.bayer,
            depth: file.depth,
        });
        Ok(CameraHints {
            camera,
            encoding,
            line_delay: file.line_delay_exposures,
            pixels,
            calibration,
        })
    }
}

impl CameraHints {
    /// The camera with the encoding of the receiver's pixels: linear deep pictures are encoded for the receiver.
    pub fn of_pixels(&self, samples: SampleKind) -> Camera {
        Camera {
            encoding: if samples.are_encoded(self.encoding) {
                Encoding::default()
            } else {
                self.camera.encoding
            },
            ..self.camera
        }
    }

    /// The encoding of the film's own samples, from the one learnt from the receiver's pixels.
    fn of_samples(&self, learnt: Encoding, samples: SampleKind) -> Encoding {
        match samples.are_encoded(self.encoding) {
            true => deep::of_samples(learnt),
            false => learnt,
        }
    }

    /// Writes the learnt values and the pixel settings atomically, as a file that `--camera` reads; `samples` are
    /// those of the pictures.
    pub fn save(&self, path: &Path, learnt: &CameraEstimate, samples: SampleKind) -> anyhow::Result<()> {
        let camera = learnt.camera;
        let encoding = self.of_samples(camera.encoding, samples);
        let camera = Camera { encoding, ..camera }.clamped();
        let geometry = self.calibration.keys();
        let file = File {
            encoding: Some(camera.encoding),
            black_grey: Some(camera.black_grey),
            blur_sigma_px: Some(camera.blur_sigma_px),
            blur_aspect: Some(camera.blur_aspect),
            read_noise_e: Some(camera.read_noise_e),
            // A learnt delay of 0 is valid only for panels of one size; in the file it would apply to all sizes.
            line_delay_exposures: learnt.line_delay.filter(|&delay| delay != 0.0).or(self.line_delay),
            channel: self.pixels.channel,
            bayer: self.pixels.bayer,
            depth: self.pixels.depth,
            focal_px: geometry.focal_px,
            principal_px: geometry.principal_px,
            distortion: geometry.distortion,
            ..File::default()
        };
        write(path, format!("# {}\n{}", learnt::as_text(learnt), toml::to_string(&file)?))
    }
}

/// Reads a camera file, in this tool's format or OpenCV's.
fn read(path: &Path) -> anyhow::Result<(File, Calibration)> {
    let about = || format!("cannot read the camera file {}", path.display());
    let text = input::read_text(path, input::SCENE_MAX).with_context(about)?;
    if let Some(calibration) = Calibration::of_opencv(&text).with_context(about)? {
        return Ok((File::default(), calibration));
    }
    if let Some(form) = calibration::foreign(&text) {
        bail!("{}: it is {form}", about());
    }
    let file: File = toml::from_str(&text).with_context(about)?;
    if let Some(depth) = file.depth {
        ensure!(
            (9..=16).contains(&depth),
            "{}: a depth of {depth} bits is not 9 to 16",
            path.display()
        );
    }
    let keys = Keys {
        focal_px: file.focal_px,
        focal_length_mm: file.focal_length_mm,
        pixel_pitch_um: file.pixel_pitch_um,
        principal_px: file.principal_px,
        distortion: file.distortion.clone(),
    };
    let calibration = keys.calibration().with_context(about)?;
    if let Some(delay) = file.line_delay_exposures {
        ensure!(
            delay.abs() <= LINE_DELAY_MAX,
            "{}: a line_delay_exposures of {delay} is not -{LINE_DELAY_MAX} to {LINE_DELAY_MAX}: give the time from one line to the next \
             over that of an exposure",
            path.display()
        );
    }
    Ok((file, calibration))
}

/// Parses "linear", "srgb", "rec709" or a gamma.
fn encoding(text: &str) -> Result<Encoding, String> {
    match text {
        "linear" => Ok(Encoding::LINEAR),
        "srgb" => Ok(Encoding::Srgb),
        "rec709" => Ok(Encoding::Rec709),
        number => number
            .parse()
            .map(Encoding::Gamma)
            .map_err(|_| format!("{text:?} is not an encoding: give linear, srgb, rec709, or a gamma of 1 to 4")),
    }
}

/// An encoding in a file: in the option's form, or as `--save-camera` writes it.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "no encoding: give \"linear\", \"srgb\", \"rec709\", or a gamma of 1 to 4 as { gamma = 2.2 }"
)]
enum FileEncoding {
    Gamma(f32),
    Curve(Encoding),
    Name(String),
}

fn encoding_in_file<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Encoding>, D::Error> {
    let told = FileEncoding::deserialize(deserializer)?;
    let encoding = match told {
        FileEncoding::Gamma(gamma) => Ok(Encoding::Gamma(gamma)),
        FileEncoding::Curve(encoding) => Ok(encoding),
        FileEncoding::Name(name) => encoding(&name),
    };
    encoding.map(Some).map_err(serde::de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> anyhow::Result<CameraHints> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("camera.toml");
        std::fs::write(&path, text)?;
        let arguments = CameraArguments {
            camera: Some(path),
            ..CameraArguments::default()
        };
        arguments.hints(PixelArguments::default())
    }

    /// The settings that a saved file gives when read back.
    fn saved(told: &CameraHints, camera: Camera, samples: SampleKind) -> CameraHints {
        let learnt = CameraEstimate {
            camera,
            seen: camera,
            blur_deviation_px: Some(0.01),
            noise_grey: 1.0,
            line_delay: Some(0.02),
            broken: 1 << 9,
            frames: 20,
        };
        assert!(learnt::as_text(&learnt).ends_with("; broken LEDs: row 2 column 2"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        told.save(&path, &learnt, samples).unwrap();
        let arguments = CameraArguments {
            camera: Some(path),
            ..CameraArguments::default()
        };
        arguments.hints(PixelArguments::default()).unwrap()
    }

    #[test]
    fn a_camera_that_was_written_is_read() {
        let camera = Camera {
            encoding: Encoding::Srgb,
            black_grey: 16.0,
            blur_sigma_px: 0.75,
            blur_aspect: 1.25,
            read_noise_e: 5.0,
        };
        let before = told("bayer = \"GRBG\"\nchannel = \"red\"\ndepth = 12\nfocal_px = 900\ndistortion = [0.1]").unwrap();
        let again = saved(&before, camera, SampleKind::Plain);
        assert_eq!(again.camera, camera);
        assert_eq!(again.pixels.bayer, before.pixels.bayer);
        assert_eq!(again.pixels.channel, Some(Channel::Red));
        assert_eq!(again.pixels.depth, Some(12));
        assert_eq!(again.calibration, before.calibration);
        assert_eq!((before.line_delay, again.line_delay), (None, Some(0.02)));
    }

    #[test]
    fn an_option_overrules_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        std::fs::write(&path, "blur_sigma_px = 1.0\nblack_grey = 4.0").unwrap();
        let arguments = CameraArguments {
            camera: Some(path),
            blur: Some(2.0),
            ..CameraArguments::default()
        };
        let camera = arguments.hints(PixelArguments::default()).unwrap().camera;
        assert_eq!((camera.blur_sigma_px, camera.black_grey), (2.0, 4.0));
    }

    #[test]
    fn an_error_names_where_the_value_is_from() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        let said = |text: &str, blur: Option<f32>| {
            std::fs::write(&path, text).unwrap();
            let arguments = CameraArguments {
                camera: Some(path.clone()),
                blur,
                ..CameraArguments::default()
            };
            format!("{:#}", arguments.hints(PixelArguments::default()).unwrap_err())
        };
        assert!(said("blur_sigma_px = 9", None).contains("camera.toml"));
        let option = said("blur_sigma_px = 1", Some(9.0));
        assert!(option.contains("a blur of 9 px") && !option.contains("camera.toml"), "{option}");
    }

    #[test]
    fn a_file_names_encodings_as_the_option_does() {
        for (text, encoding) in [
            ("encoding = \"linear\"", Encoding::LINEAR),
            ("encoding = \"srgb\"", Encoding::Srgb),
            ("encoding = 1.8", Encoding::Gamma(1.8)),
            ("encoding = 2", Encoding::Gamma(2.0)),
            ("encoding = { gamma = 1.8 }", Encoding::Gamma(1.8)),
        ] {
            assert_eq!(told(text).unwrap().encoding, Some(encoding), "{text}");
        }
        for text in ["encoding = \"log\"", "encoding = true", "encoding = { gama = 2 }"] {
            let said = format!("{:#}", told(text).unwrap_err());
            assert!(said.contains("encoding: give") && said.contains("linear"), "{said}");
        }
        let focal = format!("{:#}", told("focal_px = \"3636\"").unwrap_err());
        assert!(focal.contains("give one number of pixels, or [x, y]"), "{focal}");
    }

    #[test]
    fn a_deep_film_is_read_alike_by_what_was_learnt_of_it() {
        let learnt = |gamma| Camera {
            encoding: Encoding::Gamma(gamma),
            ..Camera::default()
        };
        let untold = told("").unwrap();
        // Linear samples: encoded for the receiver both times.
        let linear = saved(&untold, learnt(2.1), SampleKind::Deep);
        assert_eq!(linear.encoding, Some(Encoding::LINEAR));
        assert_eq!(linear.of_pixels(SampleKind::Deep), untold.of_pixels(SampleKind::Deep));
        // Encoded samples keep their encoding.
        let encoded = saved(&untold, learnt(3.96), SampleKind::Deep);
        assert_eq!(encoded.encoding, Some(Encoding::Gamma(1.8)));
        assert_eq!(saved(&encoded, learnt(1.7), SampleKind::Deep).encoding, Some(Encoding::Gamma(1.7)));
        // 8-bit samples are not encoded again.
        assert_eq!(saved(&untold, learnt(2.1), SampleKind::Plain).encoding, Some(Encoding::Gamma(2.1)));
    }

    #[test]
    fn nonsense_is_refused() {
        assert_eq!(told("").unwrap().camera, Camera::default());
        let gamma = told("encoding = { gamma = 1.8 }\nbayer = \"grbg\"\nchannel = \"red\"").unwrap();
        assert_eq!(gamma.camera.encoding, Encoding::Gamma(1.8));
        assert!(gamma.pixels.bayer.is_some());
        for nonsense in [
            "blur = 2",
            "focal_px = 0",
            "focal_length_mm = 25",
            "focal_length_mm = -25\npixel_pitch_um = -6.875",
            "focal_px = [3000, nan]",
            "distortion = [0, 0, 0]",
            "principal_px = [1e9, 0]",
            "encoding = \"log\"",
            "encoding = { gamma = 9 }",
            "blur_sigma_px = nan",
            "blur_sigma_px = \"wide\"",
            "black_grey = -1",
            "bayer = \"RGB\"",
            "depth = 8",
            "line_delay_exposures = 3",
            "line_delay_exposures = nan",
            "]",
        ] {
            assert!(told(nonsense).is_err(), "{nonsense}");
        }
    }
}
