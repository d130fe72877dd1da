//! The contents of the board's memory before it starts, and its reports, in postcard, one value after another. The tests share this file.

use link::camera::Camera;
use link::panel::SIDE;
use rx_pipeline::detect::{Detector, Fisher, Method};
use rx_pipeline::profile::STAGES;
use rx_pipeline::receiver::{self, ReceiverSettings};
use serde::{Deserialize, Serialize};

/// The address of the film: the board's PSRAM, 16 MB.
pub const START: usize = 0x6000_0000;
pub const BYTES: usize = 16 << 20;

/// The header before the regions.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Head {
    pub method: MethodChoice,
    pub camera: Camera,
    pub symbols_per_frame: f32,
    /// The corner LEDs in the first region, in pixels of the frame: top left, top right, bottom right, bottom left.
    pub corners: [[f32; 2]; 4],
    /// The number of regions.
    pub regions: u32,
}

/// The detector.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub enum MethodChoice {
    KMeans,
    KMeansRaw,
    Otsu,
    Fisher(Fisher),
    MaximumLikelihood,
}

/// A square part of a frame.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Region<'a> {
    /// Column and row of its first pixel in the frame.
    pub origin: [u16; 2],
    /// Number of columns, and of rows.
    pub side: u16,
    /// Grey levels, row by row.
    pub pixels: &'a [u8],
}

/// The board's report on a region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub reading: Option<RegionReading>,
    /// Ticks of the board's clock from grey levels to bits.
    pub ticks: u32,
    /// The ticks of each stage.
    pub stage_ticks: [u32; STAGES.len()],
    /// Maximum depth of the stack, in bytes.
    pub stack_bytes: u32,
}

/// The reading of a panel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionReading {
    /// The corner LEDs in pixels of the region.
    pub corners: [[f32; 2]; 4],
    pub bits: u64,
    /// The log-likelihood ratio of each LED, row by row.
    pub soft: [[i8; SIDE]; SIDE],
}

impl Head {
    pub fn settings(&self) -> ReceiverSettings {
        ReceiverSettings {
            camera: self.camera,
            method: match self.method {
                MethodChoice::KMeans => Detector::KMeans.into(),
                MethodChoice::KMeansRaw => Detector::KMeansRaw.into(),
                MethodChoice::Otsu => Detector::Otsu.into(),
                MethodChoice::Fisher(fisher) => Detector::Fisher(fisher).into(),
                MethodChoice::MaximumLikelihood => Method::MaximumLikelihood,
            },
            symbols_per_frame: self.symbols_per_frame,
            ..ReceiverSettings::default()
        }
    }
}

impl From<receiver::FrameReading> for RegionReading {
    fn from(reading: receiver::FrameReading) -> Self {
        let receiver::FrameReading { corners, detection } = reading;
        let mut soft = [[0; SIDE]; SIDE];
        soft.as_flattened_mut().copy_from_slice(&detection.soft.0);
        Self {
            corners: corners.points(),
            bits: detection.bits.bits(),
            soft,
        }
    }
}
