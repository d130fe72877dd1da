//! Reads the bits of single frames.

use link::panel::LLR_STEP;
use numpy::PyArray2;
use pyo3::prelude::*;
use reception::colour::Channel;
use reception::deep::Compander;
use reception::panel_pose::{PanelPose, PoseInput, PoseMeter, configured_size};
use reception::still::{StillDecoder, StillReading};
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Method;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::FrameReading;
use studies::detectors::DetectorChoice;

use crate::arrays::{self, Image};
use crate::camera::{Camera, LearntCamera, camera_of};
use crate::errors::{check, guarded, refused};
use crate::pose::{self, Pose};
use crate::record::record;

record! {
    /// The reading of a single image.
    Decoded {
        /// Whether a panel was read.
        found: bool,
        /// The bits, bool of shape (8, 8). This and all following attributes are None if no panel was read.
        bits: Option<Py<PyArray2<bool>>>,
        /// The log-likelihood ratio of each LED, positive for On, float32 of shape (8, 8).
        llr: Option<Py<PyArray2<f32>>>,
        /// The expected share of right bits, 0.5 to 1, by the ratios and by the place.
        confidence: Option<f32>,
        /// Whether the image shows a panel there: "confirmed", "elsewhere" or "unconfirmed".
        place: Option<&'static str>,
        /// The corner LEDs of the panel that the image shows instead, of shape (4, 2), where the place is "elsewhere".
        elsewhere_px: Option<Py<PyArray2<f32>>>,
        /// The clockwise rotation of the panel by the given corners, in degrees: 0, 90, 180 or 270.
        turned_deg: Option<u32>,
        /// The corner LEDs, top left, top right, bottom right and bottom left: x and y in pixels, of shape (4, 2).
        corners_px: Option<Py<PyArray2<f32>>>,
        /// The panel's centre, in pixels.
        centre_px: Option<(f32, f32)>,
        /// The distance between neighbouring LEDs, in pixels.
        pitch_px: Option<f32>,
        /// Why no panel was read.
        why: Option<String>,
        /// The pose of the panel, if the camera's focal length and the panel's size are configured.
        pose: Option<Py<Pose>>,
        /// Why the pose is unknown.
        no_pose: Option<String>,
        /// The learnt camera.
        camera: Option<Py<LearntCamera>>,
    }
}

/// The method of a detector that learns from no frames.
pub fn untrained(detector: &str) -> PyResult<Method> {
    let choice: DetectorChoice = check(detector.parse())?;
    choice.untrained().ok_or_else(|| {
        refused(
            "this detector needs frames with known bits (fisher and fisher-ngr learn from them, the genie knows everything else too), \
             and there are none here: choose ml, kmeans, kmeans-raw or otsu, or call evaluate",
        )
    })
}

/// Converts four points: x and y of the top left, top right, bottom right and bottom left LED.
fn corners_of(argument: &Bound<'_, PyAny>) -> PyResult<Corners> {
    let points: Vec<Vec<f32>> = argument.extract().map_err(|_| wrong_corners(argument))?;
    let points: Vec<[f32; 2]> = points
        .into_iter()
        .map(|point| <[f32; 2]>::try_from(point).map_err(|_| wrong_corners(argument)))
        .collect::<PyResult<_>>()?;
    let points: [[f32; 2]; 4] = points.try_into().map_err(|_| wrong_corners(argument))?;
    check(Corners::new(points))
}

fn wrong_corners(argument: &Bound<'_, PyAny>) -> PyErr {
    let told = argument.repr().map(|told| told.to_string());
    refused(format!(
        "corners = {}: give x and y of the top left, top right, bottom right and bottom left LED, of shape (4, 2)",
        told.unwrap_or_default()
    ))
}

/// Reads the bits of a single image as `vocc decode` does: at `corners`, or at the place that a search finds.
///
/// `image` is a uint8, uint16 or float32 array of shape (height, width), or (height, width, 3) with colours in OpenCV's order, of which
/// `channel` is read: brightest, red, green, blue or grey. `detector` is best, ml, kmeans, kmeans-raw or otsu. With the panel's `interval`
/// and `led_diameter_m`, and the camera's `focal_px`, the pose is measured.
///
/// Raises VoccError or TypeError if `image` is not an image. An image without a panel is not an error.
///
/// >>> import vocc
/// >>> renderer = vocc.Renderer("day")
/// >>> seen = vocc.decode(renderer.render(bits="8142241818244281"))
/// >>> vocc.as_hex(seen.bits), [round(x, 1) for x in seen.centre_px]
/// ('8142241818244281', [959.5, 539.5])
#[pyfunction]
#[pyo3(signature = (
    image, *, corners=None, detector="best", camera=None, channel="brightest", depth=None, interval=None, led_diameter_m=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn decode(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    corners: Option<&Bound<'_, PyAny>>,
    detector: &str,
    camera: Option<&Bound<'_, PyAny>>,
    channel: &str,
    depth: Option<u8>,
    interval: Option<f64>,
    led_diameter_m: Option<f64>,
) -> PyResult<Decoded> {
    let method = untrained(detector)?;
    let corners = corners.map(corners_of).transpose()?;
    let told = camera.map(camera_of).transpose()?;
    let channel: Channel = check(channel.parse())?;
    let mut deep = compander(depth, told.as_ref())?;
    let mut meter = PoseMeter::new(check(configured_size(led_diameter_m, interval))?);
    let told = told.unwrap_or_default();
    let image = Image::of(image, "image")?;
    let pixels = image.pixels()?;
    let are_encoded = pixels.kind().are_encoded(told.told_encoding());
    let (read, learnt) = guarded(|| {
        py.detach(|| {
            let grey = check(pixels.grey(channel, &mut deep))?;
            let frame = check(Frame::new(&grey, pixels.width, pixels.height))?;
            let camera = told.of_pixels(are_encoded);
            let mut still = StillDecoder::new(method);
            let (read, learnt) = check(still.decode(&frame, camera, corners))?;
            let camera = learnt.map_or(camera, |learnt| learnt.camera);
            let lens = told.lens([frame.width(), frame.height()]);
            let read = read.map(|still| {
                let input = PoseInput {
                    frame: &frame,
                    reading: &still.reading,
                    camera: &camera,
                    lens: &lens,
                };
                (still, PanelPose::in_picture(&mut meter, &input))
            });
            Ok((read, learnt))
        })
    })?;
    let learnt = learnt.map(|learnt| Py::new(py, told.learnt(py, &learnt, are_encoded)?));
    let camera = learnt.transpose()?;
    let (still, panel_pose) = match read {
        Ok(read) => read,
        Err(why) => {
            return Ok(Decoded {
                found: false,
                bits: None,
                llr: None,
                confidence: None,
                place: None,
                elsewhere_px: None,
                turned_deg: None,
                corners_px: None,
                centre_px: None,
                pitch_px: None,
                why: Some(why),
                pose: None,
                no_pose: None,
                camera,
            });
        }
    };
    let StillReading {
        reading: FrameReading { corners, detection },
        place,
    } = still;
    let (pose, no_pose) = match panel_pose.measured() {
        Ok(pose) => (Some(Py::new(py, pose::as_record(py, pose, [None; 2]))?), None),
        Err(why) => (None, Some(why.clone())),
    };
    Ok(Decoded {
        found: true,
        bits: Some(arrays::leds(py, detection.bits)),
        llr: Some(llr(py, &detection.soft)),
        confidence: Some(detection.confidence),
        place: Some(place.name()),
        elsewhere_px: place.elsewhere().map(|shown| arrays::rows(py, shown.points())),
        turned_deg: Some(corners.turned_deg()),
        corners_px: Some(arrays::rows(py, corners.points())),
        centre_px: Some(corners.centre_px().into()),
        pitch_px: Some(corners.pitch_px()),
        why: None,
        pose,
        no_pose,
        camera,
    })
}

/// Converts samples of `depth` bits to 8; by default the depth that the first image needs.
pub fn compander(depth: Option<u8>, told: Option<&Camera>) -> PyResult<Compander> {
    if let Some(depth) = depth.filter(|depth| !(9..=16).contains(depth)) {
        return Err(refused(format!("depth = {depth}: give 9 to 16 bits, or None")));
    }
    let encoding = told.and_then(Camera::told_encoding);
    let encoding = encoding.unwrap_or(link::camera::Encoding::LINEAR);
    Ok(Compander::new(depth, encoding))
}

/// Log-likelihood ratios, of shape (8, 8).
pub fn llr(py: Python<'_>, soft: &link::panel::SoftPanel) -> Py<PyArray2<f32>> {
    arrays::of_leds(py, soft.0.map(|steps| f32::from(steps) * LLR_STEP))
}
