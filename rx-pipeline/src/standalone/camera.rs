//! A standalone receiver's camera: its properties, its settings and its faults.

use super::exposure;
use serde::{Deserialize, Serialize};

/// A camera's registers.
pub trait Camera {
    /// Resets the camera and starts its frames.
    ///
    /// # Errors
    /// [`CameraError`] gives the camera's fault.
    fn start(&mut self, exposure: Exposure) -> Result<(), CameraError>;

    /// Sets the exposure of one of the next frames and of all later ones.
    ///
    /// # Errors
    /// [`CameraError`] gives the camera's fault.
    fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError>;
}

/// The exposure: how light becomes grey levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exposure {
    /// Lines that a pixel is exposed for: [`CameraMode::least_lines`] to [`CameraMode::most_lines`].
    pub lines: u16,
    /// The analog gain, as a power of 2: 0 to [`CameraMode::most_gain_log2`].
    pub gain_log2: u8,
}

impl Exposure {
    /// Grey levels per light, relative to an exposure of one line at gain 1.
    pub const fn sensitivity(&self) -> u32 {
        (self.lines as u32) << self.gain_log2
    }
}

/// A camera's mode: the size and the timing of its frames, its lens, its black level, and its range of exposures.
///
/// Above the black level, grey levels must be linear in light: without gamma, automatic exposure or automatic gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraMode {
    /// Columns of a frame.
    pub width: usize,
    /// Rows of a frame.
    pub height: usize,
    /// The focal length of the lens in pixels of a frame: above 0.
    pub focal_length_px: f32,
    /// The grey level of no light: 0 to [`CameraMode::BLACK_GREY_MAX`].
    pub black_grey: u8,
    /// Pixel clocks in a line, those between lines included.
    pub line_clocks: u16,
    /// The pixel clock, Hz.
    pub pixel_clock_hz: u32,
    /// Lines in a frame's period, those between frames included.
    pub frame_lines: u16,
    /// The shortest exposure, lines: at least 1.
    pub least_lines: u16,
    /// The longest exposure, lines.
    pub most_lines: u16,
    /// The highest analog gain, as a power of 2: 0 to [`CameraMode::GAIN_LOG2_MAX`].
    pub most_gain_log2: u8,
}

impl CameraMode {
    /// The highest black level: half of the mean that a search aims at.
    pub const BLACK_GREY_MAX: u8 = (exposure::MEAN / 2) as u8;
    /// The highest gain, as a power of 2, with which the products of the exposure control fit into 32 bits.
    pub const GAIN_LOG2_MAX: u8 = 6;
    /// The longest frame period, µs: that of the lowest symbol rate, a thousandth of a symbol a second.
    const PERIOD_MAX_US: u32 = 1_000_000_000;

    /// The frame period, µs.
    pub const fn period_us(&self) -> u32 {
        self.lines_us(self.frame_lines)
    }

    /// The exposure time of a pixel, µs.
    pub const fn exposure_us(&self, exposure: Exposure) -> u32 {
        self.lines_us(exposure.lines)
    }

    /// The duration of that many lines, µs, up to `u32::MAX`.
    const fn lines_us(&self, lines: u16) -> u32 {
        let clocks = lines as u64 * self.line_clocks as u64;
        match (clocks * 1_000_000).checked_div(self.pixel_clock_hz as u64) {
            Some(us) if us < u32::MAX as u64 => us as u32,
            _ => u32::MAX,
        }
    }

    /// The longest exposure that mostly shows single symbols: a quarter of the time between frames.
    pub(super) const fn longest_lines(&self) -> u16 {
        let quarter = self.frame_lines / 4;
        if quarter < self.most_lines { quarter } else { self.most_lines }
    }

    /// This mode, if all its values are in their ranges.
    ///
    /// # Errors
    /// [`CameraModeError`] for the first value that is not.
    pub fn checked(self) -> Result<Self, CameraModeError> {
        let Self {
            focal_length_px,
            black_grey,
            least_lines,
            most_gain_log2,
            ..
        } = self;
        let (period_us, most_lines) = (self.period_us(), self.longest_lines());
        if !(1..=Self::PERIOD_MAX_US).contains(&period_us) {
            Err(CameraModeError::Period { period_us })
        } else if !(1..=most_lines).contains(&least_lines) {
            Err(CameraModeError::Lines { least_lines, most_lines })
        } else if most_gain_log2 > Self::GAIN_LOG2_MAX {
            Err(CameraModeError::Gain { most_gain_log2 })
        } else if black_grey > Self::BLACK_GREY_MAX {
            Err(CameraModeError::Black { black_grey })
        } else if !(focal_length_px > 0.0 && focal_length_px.is_finite()) {
            Err(CameraModeError::FocalLength { focal_length_px })
        } else {
            Ok(self)
        }
    }
}

/// Why a receiver cannot use a camera's mode.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CameraModeError {
    /// The frame period is out of range.
    #[error(
        "the camera's frame period is {period_us} µs: give clocks a line, a pixel clock and lines a frame that make 1 to {} µs",
        CameraMode::PERIOD_MAX_US
    )]
    Period {
        /// The frame period.
        period_us: u32,
    },
    /// The shortest exposure is too short or too long.
    #[error("the camera's shortest exposure is {least_lines} lines: give 1 to {most_lines}, a quarter of a frame or the longest exposure")]
    Lines {
        /// The shortest exposure.
        least_lines: u16,
        /// The maximum.
        most_lines: u16,
    },
    /// The gain is too high.
    #[error(
        "the camera's highest gain is 2 to the power of {most_gain_log2}: give a power of 0 to {}",
        CameraMode::GAIN_LOG2_MAX
    )]
    Gain {
        /// The gain, as a power of 2.
        most_gain_log2: u8,
    },
    /// The black level is too high.
    #[error(
        "the camera's black level is {black_grey}: set the camera to one of 0 to {}",
        CameraMode::BLACK_GREY_MAX
    )]
    Black {
        /// The black level.
        black_grey: u8,
    },
    /// The focal length is not a positive number.
    #[error("the focal length of the camera's lens is {focal_length_px} px: give a finite number above 0")]
    FocalLength {
        /// The focal length.
        focal_length_px: f32,
    },
}

/// A fault of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum CameraError {
    /// No device acknowledges.
    #[error("no camera answers: look at SDA, SCL and the camera's supply")]
    Silent,
    /// Another device answers.
    #[error("the chip at the camera's address says it is {id:#06x}: connect the camera that the program was built for")]
    WrongId {
        /// The value of its identity registers.
        id: u16,
    },
    /// A register does not keep a written value.
    #[error("register {register:#06x} of the camera holds {holds:#04x} after {written:#04x} was written: the bus or the camera is faulty")]
    Register {
        /// Its address.
        register: u16,
        /// The written value.
        written: u8,
        /// The value read back.
        holds: u8,
    },
}
