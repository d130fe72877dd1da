//! The transmitter of an optical camera link: ambient light in, an 8×8 LED panel out.
//!
//! A camera distinguishes On from Off best at one ratio of LED light to ambient light (L2A). With too little light both look alike; with
//! too much each LED floods its neighbours (Do & Yoo 2020). This firmware measures the light, looks up the best ratio in a table, dims its
//! LEDs to it, and shows its message panel by panel. It needs no operating system and no heap, and reaches hardware through
//! [`embedded_hal`] traits alone.
//!
//! ```
//! use fixed::types::I32F32;
//! use link::{fec::Code, l2a_table::L2aTable};
//! use tx_firmware::{
//!     ambient::Smoothing,
//!     calibration::{BENCH, Calibration},
//!     light_watch::{LightSample, SensorRange},
//!     matrix::RecordingMatrix,
//!     schedule::Repeats,
//!     transmitter::Transmitter,
//! };
//!
//! let calibration = Calibration::new(BENCH)?;
//! let matrix = RecordingMatrix::default();
//! let mut transmitter =
//!     Transmitter::new(matrix, calibration, L2aTable::shipped(), Smoothing::default());
//!
//! transmitter.send(b"ice ahead", Code::for_length(9), Repeats::Forever)?;
//! let sample = LightSample::Light { lux: I32F32::lit("2000"), word: 0x5c35 };
//! transmitter.sense(100, SensorRange::Operating, sample)?;
//! let panel = transmitter.tick()?;
//!
//! assert_eq!(transmitter.matrix().panel, panel);
//! assert!(transmitter.matrix().duty > 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The layers
//!
//! Two paths meet at the LEDs. Each step is a module, and each can be used by itself.
//!
//! ```text
//! once a sensor period                                       once a symbol
//!
//! light sensor                                               message
//!    │  a reading, or none                                      │  bytes
//! light_watch  sensor plausible?                                │
//!    │  lux                                                     │
//! ambient      gain, smoothing → illuminance E               schedule   repeats, then beacons
//!    │                                                          │        (framing and error correction: link)
//! L2A table (link)    E, interval → ratio r                     │  PanelFrame: 64 bits
//!    │                                                          │
//! dimming      L* = r·E·R within the driver's limits            │
//!    │  duty                                                    │
//!    └──────────────────────────── matrix ──────────────────────┘
//!                                    │
//!                 drive, shift_register, max7219, or a driver of yours
//! ```
//!
//! - [`transmitter`] ties them together: [`Transmitter`](transmitter::Transmitter) has one method for each timer.
//! - [`light_sensor`] is the trait of light sensors, and polls one.
//! - [`light_watch`] detects a sensor that is missing, stuck, saturated or silent, within a stated time.
//! - [`ambient`] smooths readings: it follows dusk quickly, and ignores the flicker of lamps.
//! - [`calibration`] holds the bench measurements of one panel, checked once at start-up.
//! - [`dimming`] turns light and ratio into a duty, and names the limit that applied.
//! - [`schedule`] selects the next panel.
//! - [`service`] answers a computer at the serial port; [`store`] keeps table and calibration in flash memory.
//! - [`drive`] chooses PWM frequency and resolution for a duty.
//! - [`symbol_clock`] divides a board's clock into symbols, or into quarters of a carrier's cycles.
//! - [`panel_ring`] keeps panels ready for hardware that shows one after another by itself, without jitter.
//! - [`matrix`] is the trait of LED hardware; [`shift_register`] and [`max7219`] implement it.
//!
//! # What to choose
//!
//! **Your LEDs.** For a panel with an output for each LED, eight shift registers and a PWM on their
//! output enable, take [`ShiftRegisterPanel`](shift_register::ShiftRegisterPanel). For a cheap
//! row-scanned module take [`Max7219Panel`](max7219::Max7219Panel), whose page lists its limits. For anything else implement
//! [`LedMatrix`](matrix::LedMatrix), two methods; its documentation has a complete driver. In a simulator or a test take
//! [`RecordingMatrix`](matrix::RecordingMatrix): it records the panel and the duty, below the same code that is flashed.
//!
//! **The PWM frequency.** An exposure should contain 20 PWM periods or more. But a short period makes the driver's shortest pulse, and so
//! the dimmest light, a larger share of the full luminance: 100 ns in 20 µs is 1/200. If your timer can set period and pulse, [`drive`]
//! chooses both: 1/470 with the same error, and eight times less with a low LED current. Below the floor [`dimming`] stays at the floor as
//! long as that does not flare, then goes dark.
//!
//! **The smoothing.** [`Smoothing::default`](ambient::Smoothing) suits a road; give it your
//! sensor's period.
//!
//! **The symbol rate.** At most 1/(frame period + exposure) of the slowest camera, so that each
//! symbol gets one whole exposure however the two clocks drift: 90 a second for 100 frames a second
//! at 1/1000 s.
//!
//! # Numbers
//!
//! The control path is fixed point throughout, for microcontrollers without a floating-point unit.
//! Each type holds the whole range of its quantity (E: 0.01 to 130 000 lx, luminance: to 10⁶
//! cd/m²), so nothing overflows; the errors against the same formulas in `f64` are constants of
//! their modules, checked by property tests: [`ambient::FILTER_ERROR_OCTAVES`],
//! [`power::EXP2_ERROR`], [`dimming::LUMINANCE_ERROR_CD_M2`], [`dimming::DUTY_ERROR`], [`drive::FIDELITY_PPM`].
//! Nothing panics on any input.

#![no_std]

pub mod ambient;
pub mod calibration;
pub mod dimming;
pub mod drive;
pub mod light_sensor;
pub mod light_watch;
pub mod matrix;
pub mod max7219;
pub mod panel_ring;
pub mod power;
pub mod program;
pub mod schedule;
pub mod service;
pub mod shift_register;
pub mod store;
pub mod symbol_clock;
pub mod transmitter;

/// The main loop of a port.
#[cfg(doctest)]
#[doc = include_str!("../../docs/porting.md")]
struct Porting;
