//! No light sensor: the sensor is reported as missing, and the panel has the night limit.

use tx_firmware::{
    light_sensor::LightSensor,
    light_watch::{LightSample, SensorRange},
};

use crate::Lost;

/// No sensor on a bus.
pub struct Sensor<B> {
    _bus: B,
}

impl<B> Sensor<B> {
    /// It needs no delay.
    pub fn new<D>(bus: B, _: D) -> Self {
        Self { _bus: bus }
    }
}

impl<B> LightSensor for Sensor<B> {
    type Error = Lost;

    fn start(&mut self, _: u64, _: SensorRange) -> Result<(), Lost> {
        Ok(())
    }

    fn take(&mut self, _: u64) -> Result<Option<LightSample>, Lost> {
        Ok(None)
    }
}
