//! ROS 2 messages: their fields in order, and their definitions.

use glam::{DMat3, DQuat};
use reception::diagnostics::Status;
use rx_pipeline::corners::Corners;
use rx_pipeline::pose::{Lens, Pose as PanelPose};
use serde::Serialize;

/// A message type.
pub trait Ros: Serialize {
    const NAME: &'static str;
    /// Its definition, with those of all nested types.
    const DEFINITION: &'static str;
}

/// A type's name, and the file of its definition.
macro_rules! ros {
    ($message:ty, $package:literal, $name:literal) => {
        impl Ros for $message {
            const NAME: &'static str = concat!($package, "/msg/", $name);
            const DEFINITION: &'static str = include_str!(concat!("ros/", $name, ".msg"));
        }
    };
}

#[derive(Clone, Copy, Serialize)]
pub struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Clone, Copy, Serialize)]
pub struct Header<'a> {
    pub stamp: Time,
    frame_id: &'a str,
}

impl<'a> Header<'a> {
    /// A header for a frame of reference, at a time in nanoseconds.
    pub fn at(time_ns: u64, frame_id: &'a str) -> Self {
        const SECOND_NS: u64 = 1_000_000_000;
        Self {
            stamp: Time {
                sec: i32::try_from(time_ns / SECOND_NS).unwrap_or(i32::MAX),
                nanosec: (time_ns % SECOND_NS) as u32,
            },
            frame_id,
        }
    }
}

#[derive(Serialize)]
pub struct CompressedImage<'a> {
    pub header: Header<'a>,
    pub format: &'static str,
    pub data: Vec<u8>,
}

ros!(CompressedImage<'_>, "sensor_msgs", "CompressedImage");

#[derive(Serialize)]
pub struct CameraInfo<'a> {
    header: Header<'a>,
    height: u32,
    width: u32,
    distortion_model: &'static str,
    d: Vec<f64>,
    k: [f64; 9],
    r: [f64; 9],
    p: [f64; 12],
    binning: [u32; 2],
    /// The full, unrectified image.
    region: [u32; 4],
    is_rectified: bool,
}

impl<'a> CameraInfo<'a> {
    /// Camera info for frames of this width and height.
    pub fn of(header: Header<'a>, [width, height]: [u32; 2], lens: &Lens) -> Self {
        let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
        let is_rational = lens.distortion[5..] != [0.0; 3];
        let (distortion_model, terms) = if is_rational {
            ("rational_polynomial", 8)
        } else {
            ("plumb_bob", 5)
        };
        Self {
            header,
            height,
            width,
            distortion_model,
            d: lens.distortion[..terms].to_vec(),
            k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            binning: [0; 2],
            region: [0; 4],
            is_rectified: false,
        }
    }
}

ros!(CameraInfo<'_>, "sensor_msgs", "CameraInfo");

#[derive(Serialize)]
pub struct Text<'a> {
    pub data: &'a str,
}

ros!(Text<'_>, "std_msgs", "String");

#[derive(Serialize)]
pub struct Bytes<'a> {
    /// Empty: no layout.
    dimensions: [u32; 1],
    data_offset: u32,
    data: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub fn of(data: &'a [u8]) -> Self {
        Self {
            dimensions: [0],
            data_offset: 0,
            data,
        }
    }
}

ros!(Bytes<'_>, "std_msgs", "UInt8MultiArray");

#[derive(Serialize)]
pub struct PoseWithCovarianceStamped<'a> {
    header: Header<'a>,
    /// x, y, z; then the quaternion's x, y, z, w.
    position: [f64; 3],
    orientation: [f64; 4],
    covariance: [[f64; 6]; 6],
}

impl<'a> PoseWithCovarianceStamped<'a> {
    pub fn of(header: Header<'a>, pose: &PanelPose) -> Self {
        let rotation = DMat3::from_cols_array_2d(&pose.rotation).transpose();
        Self {
            header,
            position: pose.translation_m,
            orientation: DQuat::from_mat3(&rotation).normalize().to_array(),
            covariance: pose.covariance,
        }
    }
}

ros!(PoseWithCovarianceStamped<'_>, "geometry_msgs", "PoseWithCovarianceStamped");

#[derive(Serialize)]
pub struct DiagnosticArray<'a> {
    header: Header<'a>,
    status: Vec<DiagnosticStatus<'a>>,
}

impl<'a> DiagnosticArray<'a> {
    pub fn of(header: Header<'a>, statuses: &'a [Status]) -> Self {
        let status = statuses.iter().map(|status| DiagnosticStatus {
            level: status.level as u8,
            name: &status.name,
            message: &status.message,
            hardware_id: &status.hardware_id,
            values: &status.values,
        });
        Self {
            header,
            status: status.collect(),
        }
    }
}

ros!(DiagnosticArray<'_>, "diagnostic_msgs", "DiagnosticArray");

#[derive(Serialize)]
struct DiagnosticStatus<'a> {
    level: u8,
    name: &'a str,
    message: &'a str,
    hardware_id: &'a str,
    /// Keys with their values.
    values: &'a [(String, String)],
}

/// Drawings on an image.
#[derive(Serialize)]
pub struct ImageAnnotations {
    /// Empty.
    circles: [u32; 1],
    points: Vec<PointsAnnotation>,
    texts: Vec<TextAnnotation>,
}

#[derive(Serialize)]
struct PointsAnnotation {
    timestamp: Time,
    kind: u8,
    points: Vec<[f64; 2]>,
    outline_color: [f64; 4],
    outline_colors: Vec<[f64; 4]>,
    fill_color: [f64; 4],
    thickness: f64,
}

#[derive(Serialize)]
struct TextAnnotation {
    timestamp: Time,
    position: [f64; 2],
    text: String,
    font_size: f64,
    text_color: [f64; 4],
    background_color: [f64; 4],
}

/// A closed polyline.
const LINE_LOOP: u8 = 2;
const YELLOW: [f64; 4] = [1.0, 0.8, 0.0, 1.0];
const NOTHING: [f64; 4] = [0.0; 4];

impl ImageAnnotations {
    /// A panel's outline, half a pitch outside its corner LEDs, with its bits below.
    pub fn outline(timestamp: Time, corners: &Corners, bits: String) -> Self {
        let homography = corners.homography();
        let (near, far) = (-0.5, 7.5);
        let points = [[near, near], [far, near], [far, far], [near, far]].map(|corner| homography.to_image(corner));
        let pitch_px = f64::from(corners.pitch_px());
        let [x, y] = points[3];
        Self {
            circles: [0],
            points: vec![PointsAnnotation {
                timestamp,
                kind: LINE_LOOP,
                points: points.to_vec(),
                outline_color: YELLOW,
                outline_colors: Vec::new(),
                fill_color: NOTHING,
                thickness: 1.0,
            }],
            texts: vec![TextAnnotation {
                timestamp,
                position: [x, y + 2.0 * pitch_px],
                text: bits,
                font_size: 12.0,
                text_color: YELLOW,
                background_color: NOTHING,
            }],
        }
    }
}

ros!(ImageAnnotations, "foxglove_msgs", "ImageAnnotations");
