//! Himax's HM01B0, a grey camera of 324×324 pixels, over its I2C registers.
//!
//! Registers follow the HM01B0 datasheet. The analog settings, which it leaves open, follow Himax's own example and the drivers in the
//! field. This camera has no gamma: its grey levels are linear in light above its black level.

use crate::standalone::{Camera, CameraError, CameraMode, Exposure};
use embedded_hal::{delay::DelayNs, i2c::I2c};

/// Its address on the bus, 7 bits.
const ADDRESS: u8 = 0x24;
/// The value of its identity registers.
const MODEL_ID: u16 = 0x01b0;
/// The pixel pitch, µm.
const PIXEL_PITCH_UM: f32 = 3.6;
/// The focal length of its usual lens (HM01B0-MNA-00FT870), µm.
const FOCAL_LENGTH_UM: f32 = 870.0;
/// The clock that modules supply, Hz.
const MASTER_CLOCK_HZ: u32 = 24_000_000;
/// Pixel clocks in a line: the sensor's minimum.
const LINE_CLOCKS: u16 = 0x178;
/// The pixel clock, Hz: an eighth of the master clock.
const PIXEL_CLOCK_HZ: u32 = MASTER_CLOCK_HZ / 8;
/// The grey level of no light, which the sensor holds by means of its dark pixels.
const BLACK_GREY: u8 = 8;
/// The shortest exposure, lines.
const LEAST_LINES: u16 = 2;
/// The highest analog gain, as a power of 2: 8.
const MOST_GAIN_LOG2: u8 = 3;
/// The pause after a software reset, ms.
const RESET_MS: u32 = 100;
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

/// Black level, its correction, and the analog part: the datasheet leaves bits open, and these need not read back as written.
const ANALOG: [(u16, u8); 24] = [
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
    // The correction of defective pixels stays off, because it removes a far LED.
    (0x1008, 0x00),
    (SIX_BITS, 0x70),
];

/// The pixels of a frame, and the frame rate.
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

    /// The properties of this mode that a receiver must know.
    pub const fn camera_mode(&self) -> CameraMode {
        let (width, height, pixels_as_one) = if self.is_binned { (162, 122, 2.0) } else { (324, 244, 1.0) };
        CameraMode {
            width,
            height,
            focal_length_px: FOCAL_LENGTH_UM / (PIXEL_PITCH_UM * pixels_as_one),
            black_grey: BLACK_GREY,
            line_clocks: LINE_CLOCKS,
            pixel_clock_hz: PIXEL_CLOCK_HZ,
            frame_lines: self.frame_lines,
            least_lines: LEAST_LINES,
            most_lines: self.frame_lines.saturating_sub(UNEXPOSED_LINES),
            most_gain_log2: MOST_GAIN_LOG2,
        }
    }
}

/// A camera on a bus, and a delay.
#[derive(Debug)]
pub struct Hm01b0<B, D> {
    bus: B,
    delay: D,
    mode: Mode,
}

/// The registers of a mode, by the datasheet.
fn read_out(mode: Mode) -> [(u16, u8); 12] {
    let (step, binning) = if mode.is_binned { (3, 3) } else { (1, 0) };
    let [frame_high, frame_low] = mode.frame_lines.to_be_bytes();
    let [line_high, line_low] = LINE_CLOCKS.to_be_bytes();
    [
        (AUTO_EXPOSURE, 0),
        (MOTION_DETECTION, 0),
        (READ_OUT_COLUMNS, step),
        (READ_OUT_ROWS, step),
        (BINNING, binning),
        (QVGA_WINDOW, 1),
        // Eight data lines, and a pixel clock that pauses between lines: an eighth of the master clock.
        (WIDTH_OF_PORT, 0x02),
        (CLOCKS, 0x20),
        (FRAME_LENGTH, frame_high),
        (FRAME_LENGTH + 1, frame_low),
        (LINE_LENGTH, line_high),
        (LINE_LENGTH + 1, line_low),
    ]
}

/// The registers of an exposure; digital gain, in steps of 1/256, is 1.
fn exposing(exposure: Exposure) -> [(u16, u8); 5] {
    let [high, low] = exposure.lines.to_be_bytes();
    let gain = exposure.gain_log2.min(MOST_GAIN_LOG2) << 4;
    [
        (INTEGRATION, high),
        (INTEGRATION + 1, low),
        (ANALOG_GAIN, gain),
        (DIGITAL_GAIN, 0x01),
        (DIGITAL_GAIN + 1, 0x00),
    ]
}

impl<B: I2c, D: DelayNs> Hm01b0<B, D> {
    /// A camera without any access to the bus yet.
    pub fn new(bus: B, delay: D, mode: Mode) -> Self {
        Self { bus, delay, mode }
    }

    /// Checks that the device is there and is an HM01B0.
    ///
    /// # Errors
    /// [`CameraError::Silent`] or [`CameraError::WrongId`].
    fn identify(&mut self) -> Result<(), CameraError> {
        let id = u16::from_be_bytes([self.read(MODEL_ID_HIGH)?, self.read(MODEL_ID_LOW)?]);
        if id == MODEL_ID { Ok(()) } else { Err(CameraError::WrongId { id }) }
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
        self.bus.write(ADDRESS, &[high, low, value]).map_err(|_| CameraError::Silent)
    }

    /// Checks that a register holds the written value.
    fn check(&mut self, register: u16, written: u8) -> Result<(), CameraError> {
        let holds = self.read(register)?;
        if holds == written {
            return Ok(());
        }
        Err(CameraError::Register { register, written, holds })
    }
}

impl<B: I2c, D: DelayNs> Camera for Hm01b0<B, D> {
    /// Sets the camera up and starts its frames. Takes 100 ms and about 60 transfers.
    fn start(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        self.identify()?;
        self.write(SOFTWARE_RESET, 0)?;
        self.delay.delay_ms(RESET_MS);
        self.write(MODE_SELECT, 0)?;
        for (register, value) in ANALOG.into_iter().chain(read_out(self.mode)) {
            self.write(register, value)?;
        }
        self.expose(exposure)?;
        for (register, value) in read_out(self.mode).into_iter().chain(exposing(exposure)) {
            self.check(register, value)?;
        }
        self.write(MODE_SELECT, 1)
    }

    fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        for (register, value) in exposing(exposure) {
            self.write(register, value)?;
        }
        self.write(UPDATE, 1)
    }
}

#[cfg(test)]
mod tests;
