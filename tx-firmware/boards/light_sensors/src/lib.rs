//! The light sensors of the transmitter's programs, selected by features: each is a
//! [`LightSensor`](tx_firmware::light_sensor::LightSensor) on any I2C bus.
#![no_std]
#![deny(unsafe_code)]

#[cfg(any(test, feature = "bh1750"))]
mod bh1750;
#[cfg(feature = "no-sensor")]
mod no_sensor;
#[cfg(any(test, feature = "opt3001"))]
mod opt3001;
#[cfg(test)]
mod simulated_bus;
#[cfg(any(test, feature = "tsl2591"))]
mod tsl2591;
#[cfg(any(test, feature = "veml7700"))]
mod veml7700;

#[cfg(feature = "bh1750")]
pub use bh1750::Sensor;
#[cfg(feature = "no-sensor")]
pub use no_sensor::Sensor;
#[cfg(feature = "opt3001")]
pub use opt3001::Sensor;
#[cfg(feature = "tsl2591")]
pub use tsl2591::Sensor;
#[cfg(feature = "veml7700")]
pub use veml7700::Sensor;

/// The sensor did not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lost;
