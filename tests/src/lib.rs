//! Shared test code: the reference frames in `frames/` and their ground truth.

pub mod arguments;
pub mod driven_panel;
pub mod emulator;
pub mod firmware;
pub mod hm01b0;
pub mod naive;
pub mod offset;
pub mod poses;
pub mod programs;
pub mod sensor;
pub mod shake;
pub mod sightings;
pub mod simulated_board;
pub mod stills;
pub mod streets;
pub mod terminal;
pub mod trials;
pub mod undersampled;
pub mod vocc;

pub use properties::{all_cases, cases};

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

/// One reference frame.
#[derive(Debug)]
pub struct ReferenceFrame {
    /// Folder and number, for example `parallel/frame-0003`.
    pub name: String,
    /// Its ground truth.
    pub truth: Truth,
    /// The 8-bit image.
    pub png: PathBuf,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear values, row by row.
    pub linear: Vec<f32>,
}

/// Ground truth of a reference frame.
#[derive(Debug, Deserialize)]
pub struct Truth {
    /// Eight rows of eight characters, `1` for On.
    pub bits: Vec<String>,
    /// Its parameters.
    pub params: Params,
    /// Linear value of an Off LED.
    pub lin_off: f64,
    /// Linear value of an On LED.
    pub lin_on: f64,
    /// Pixel positions of the corner LEDs: top left, top right, bottom right, bottom left.
    pub led_corner_centres_px: [[f64; 2]; 4],
    /// Position of the crop on the sensor.
    pub image_origin_in_sensor_px: [f64; 2],
}

/// Parameters of a reference frame.
#[derive(Debug, Deserialize)]
pub struct Params {
    /// Distance in metres.
    pub distance: f64,
    /// Gap between LEDs over their diameter.
    pub interval: f64,
    /// LED-to-ambient ratio.
    pub l2a: f64,
    /// Blur in px.
    pub sigma: f64,
    /// Rotation about the optical axis, in degrees.
    pub roll: f64,
    /// Rotation about the vertical axis, in degrees.
    pub yaw: f64,
    /// Rotation about the horizontal axis, in degrees.
    pub tilt: f64,
}

impl Truth {
    /// The 64 bits, with LED (row, column) at bit 8·row + column.
    pub fn bits(&self) -> u64 {
        let cells = self.bits.iter().flat_map(|row| row.bytes());
        cells.enumerate().fold(0, |bits, (led, cell)| bits | u64::from(cell == b'1') << led)
    }
}

/// The reference frames of a folder, `parallel` or `tilted`, in order.
pub fn reference_frames(folder: &str) -> Vec<ReferenceFrame> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/frames").join(folder);
    let entries = fs::read_dir(&directory).unwrap_or_else(|error| panic!("{}: {error}", directory.display()));
    let mut truths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .collect();
    truths.sort();
    truths.iter().map(|path| load(folder, path)).collect()
}

fn load(folder: &str, path: &Path) -> ReferenceFrame {
    let fault = |error: &dyn std::fmt::Display| -> String { format!("{}: {error}", path.display()) };
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}", fault(&error)));
    let truth = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}", fault(&error)));
    let bytes = fs::read(path.with_extension("npy")).unwrap_or_else(|error| panic!("{}", fault(&error)));
    let matrix = npy(&bytes).unwrap_or_else(|| panic!("{}", fault(&"no matrix of <f4")));
    let number = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    ReferenceFrame {
        name: format!("{folder}/{number}"),
        truth,
        png: path.with_extension("png"),
        width: matrix.width,
        height: matrix.height,
        linear: matrix.values,
    }
}

/// A matrix, row by row.
struct Matrix {
    height: usize,
    width: usize,
    values: Vec<f32>,
}

/// Parses a NumPy file of version 1.0 that holds a single-precision matrix.
fn npy(bytes: &[u8]) -> Option<Matrix> {
    let (length, rest) = bytes.strip_prefix(b"\x93NUMPY\x01\x00")?.split_first_chunk()?;
    let (about, numbers) = rest.split_at_checked(u16::from_le_bytes(*length).into())?;
    let about = std::str::from_utf8(about).ok()?;
    let shape = about
        .trim()
        .strip_prefix("{'descr': '<f4', 'fortran_order': False, 'shape': (")?
        .strip_suffix("), }")?;
    let (height, width) = shape.split_once(", ")?;
    let (height, width) = (height.parse().ok()?, width.parse().ok()?);
    let (numbers, rest) = numbers.as_chunks();
    let values: Vec<f32> = numbers.iter().map(|four| f32::from_le_bytes(*four)).collect();
    (rest.is_empty() && values.len() == height * width).then_some(Matrix { height, width, values })
}
