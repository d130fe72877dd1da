//! Himax's HM01B0, a grey camera of 324×324 pixels, over its I2C registers.
//!
//! Registers and their meaning are those of the HM01B0 datasheet; what it leaves open (the analog settings) is what
//! Himax's own example and the drivers in the field write. There is no gamma in this camera: its grey levels are linear in light above
//! [`BLACK_GREY`].

use embedded_hal::i2c::I2c;
use serde::{Deserialize, Serialize};

/// Its address on the bus, 7 bits.
pub const ADDRESS: u8 = 0x24;
/// What its identity registers hold.
pub const MODEL_ID: u16 = 0x01b0;
/// The clock that modules feed it, Hz.
pub const MASTER_CLOCK_HZ: u32 = 24_000_000;
/// Pixel clocks in a line: the least that the sensor takes.
pub const LINE_CLOCKS: u16 = 0x178;
/// The pixel clock, Hz: an eighth of the master clock.
pub const PIXEL_CLOCK_HZ: u32 = MASTER_CLOCK_HZ / 8;
/// The grey level of no light, which the sensor holds by its dark pixels.
pub const BLACK_GREY: u8 = 8;
/// The shortest exposure, lines.
pub const LEAST_LINES: u16 = 2;
/// Lines of a frame's period that cannot be exposed.
const UNEXPOSED_LINES: u16 = 2;

const MODEL_ID_HIGH: u16 = 0x0000;
const MODEL_ID_LOW: u16 = 0x0001;
const MODE_SELECT: u16 = 0x0100;
const SOFTWARE_RESET: u16 = 0x0103;
const UPDATE: u16 = 0x0104;
const INTEGRATION: u16 = 0x0202;
const ANALOG_GAIN: u16 = 0x0205;
const DIGITAL_GAIN: u16 = 0x020e;
const FRAME_LENGTH: u16 = 0x0340;
const LINE_LENGTH: u16 = 0x0342;
const READ_OUT_COLUMNS: u16 = 0x0383;
const READ_OUT_ROWS: u16 = 0x0387;
const BINNING: u16 = 0x0390;
const AUTO_EXPOSURE: u16 = 0x2100;
const MOTION_DETECTION: u16 = 0x2150;
const QVGA_WINDOW: u16 = 0x3010;
const SIX_BITS: u16 = 0x3011;
const WIDTH_OF_PORT: u16 = 0x3059;
const CLOCKS: u16 = 0x3060;

/// Black level, its correction, and the analog part.
const ANALOG: [(u16, u8); 23] = [
    (0x1003, BLACK_GREY),
    (0x1007, BLACK_GREY),
    (0x3044, 0x0a),
    (0x3045, 0x00),
    (0x3047, 0x0a),
    (0x3050, 0xc0),
    (0x3051, 0x42),
    (0x3052, 0x50),
    (0x3053, 0x00),
    (0x3054, 0x03),
    (0x3055, 0xf7),
    (0x3056, 0xf8),
    (0x3057, 0x29),
    (0x3058, 0x1f),
    (0x3064, 0x00),
    (0x3065, 0x04),
    (0x3067, 0x00),
    (0x1000, 0x43),
    (0x1001, 0x40),
    (0x1002, 0x32),
    (0x0350, 0x7f),
    (0x1006, 0x01),
    // The correction of defective pixels stays off: to it a far LED is one.
    (0x1008, 0x00),
];

/// Which pixels are read, and how often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Whether 2×2 pixels are read as one.
    pub is_binned: bool,
    /// Lines in a frame's period, those between frames included.
    pub frame_lines: u16,
}

impl Mode {
    /// 324×244 pixels, 29.995 frames a second.
    pub const QVGA: Self = Self {
        is_binned: false,
        frame_lines: 266,
    };
    /// 162×122 pixels of 2×2, 13.232 frames a second.
    pub const BINNED: Self = Self {
        is_binned: true,
        frame_lines: 603,
    };

    /// Columns of a frame.
    pub const fn width(&self) -> usize {
        if self.is_binned { 162 } else { 324 }
    }

    /// Rows of a frame.
    pub const fn height(&self) -> usize {
        if self.is_binned { 122 } else { 244 }
    }

    /// From one frame to the next, µs.
    pub const fn period_us(&self) -> u32 {
        (self.frame_lines as u64 * LINE_CLOCKS as u64 * 1_000_000 / PIXEL_CLOCK_HZ as u64) as u32
    }

    /// The longest exposure, lines.
    pub const fn most_lines(&self) -> u16 {
        self.frame_lines.saturating_sub(UNEXPOSED_LINES)
    }
}

/// How light becomes grey levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exposure {
    /// Lines that a pixel is exposed for: [`LEAST_LINES`] to [`Mode::most_lines`].
    pub lines: u16,
    /// The analog gain, as a power of 2: 0 to [`Exposure::GAIN_MAX`].
    pub gain_log2: u8,
}

impl Exposure {
    /// The highest analog gain: 8.
    pub const GAIN_MAX: u8 = 3;

    /// How long a pixel is exposed, µs.
    pub const fn time_us(&self) -> u32 {
        (self.lines as u64 * LINE_CLOCKS as u64 * 1_000_000 / PIXEL_CLOCK_HZ as u64) as u32
    }

    /// Grey levels for a given light, in lines at gain 1.
    pub const fn sensitivity(&self) -> u32 {
        (self.lines as u32) << self.gain_log2
    }
}

/// What is wrong with a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum CameraError {
    /// Nobody acknowledges.
    #[error("no camera answers at I2C address 0x24: look at SDA, SCL and 3.3 V")]
    Silent,
    /// Somebody else is there.
    #[error(
        "the chip at I2C address 0x24 says it is {id:#06x}, an HM01B0 says 0x01b0: connect an HM01B0"
    )]
    WrongId {
        /// What its identity registers hold.
        id: u16,
    },
    /// A register does not keep what is written to it.
    #[error(
        "register {register:#06x} of the camera holds {holds:#04x} after {written:#04x} was written: the bus or the camera is faulty"
    )]
    Register {
        /// Its address.
        register: u16,
        /// What was written.
        written: u8,
        /// What it holds.
        holds: u8,
    },
}

/// A camera on a bus.
#[derive(Debug)]
pub struct Hm01b0<B> {
    bus: B,
    mode: Mode,
}

impl<B: I2c> Hm01b0<B> {
    /// A camera that has not been talked to.
    pub fn new(bus: B, mode: Mode) -> Self {
        Self { bus, mode }
    }

    /// Sets the camera up and starts its frames.
    ///
    /// # Errors
    /// [`CameraError`] if it is not there, is another one, or does not take its settings.
    pub fn start(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        let mode = self.mode;
        self.identify()?;
        self.write(SOFTWARE_RESET, 0)?;
        self.write(MODE_SELECT, 0)?;
        for (register, value) in ANALOG {
            self.write(register, value)?;
        }
        self.write(AUTO_EXPOSURE, 0)?;
        self.write(MOTION_DETECTION, 0)?;
        let step = if mode.is_binned { 3 } else { 1 };
        self.write(READ_OUT_COLUMNS, step)?;
        self.write(READ_OUT_ROWS, step)?;
        self.write(BINNING, if mode.is_binned { 3 } else { 0 })?;
        self.write(QVGA_WINDOW, 1)?;
        self.write(SIX_BITS, 0x70)?;
        // Eight wires, and a pixel clock that stands still between lines: an eighth of the master clock.
        self.write(WIDTH_OF_PORT, 0x02)?;
        self.write(CLOCKS, 0x20)?;
        self.write_pair(FRAME_LENGTH, mode.frame_lines)?;
        self.write_pair(LINE_LENGTH, LINE_CLOCKS)?;
        self.expose(exposure)?;
        // What was written last, and what frames depend on most.
        for (register, written) in [
            (AUTO_EXPOSURE, 0),
            (BINNING, if mode.is_binned { 3 } else { 0 }),
        ] {
            let holds = self.read(register)?;
            if holds != written {
                return Err(CameraError::Register {
                    register,
                    written,
                    holds,
                });
            }
        }
        self.write(MODE_SELECT, 1)
    }

    /// Exposes like this from one of the next frames on.
    ///
    /// # Errors
    /// [`CameraError::Silent`].
    pub fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        self.write_pair(INTEGRATION, exposure.lines)?;
        self.write(ANALOG_GAIN, exposure.gain_log2.min(Exposure::GAIN_MAX) << 4)?;
        // In steps of 1/256: 1.
        self.write_pair(DIGITAL_GAIN, 0x0100)?;
        self.write(UPDATE, 1)
    }

    /// Whether it is there, and an HM01B0.
    ///
    /// # Errors
    /// [`CameraError::Silent`] or [`CameraError::WrongId`].
    pub fn identify(&mut self) -> Result<(), CameraError> {
        let id = u16::from_be_bytes([self.read(MODEL_ID_HIGH)?, self.read(MODEL_ID_LOW)?]);
        if id == MODEL_ID {
            Ok(())
        } else {
            Err(CameraError::WrongId { id })
        }
    }

    fn read(&mut self, register: u16) -> Result<u8, CameraError> {
        let mut value = [0];
        self.bus
            .write_read(ADDRESS, &register.to_be_bytes(), &mut value)
            .map_err(|_| CameraError::Silent)?;
        Ok(value[0])
    }

    fn write(&mut self, register: u16, value: u8) -> Result<(), CameraError> {
        let [high, low] = register.to_be_bytes();
        self.bus
            .write(ADDRESS, &[high, low, value])
            .map_err(|_| CameraError::Silent)
    }

    /// Two registers, the high byte first.
    fn write_pair(&mut self, register: u16, value: u16) -> Result<(), CameraError> {
        let [high, low] = value.to_be_bytes();
        self.write(register, high)?;
        self.write(register + 1, low)
    }
}

#[cfg(test)]
mod tests;
