//! The limit of a transmitter's luminous intensity, which is set together with its calibration.

use link::intensity::IntensityLimit;
use link::serial::{Answer, Request};

use crate::device::DeviceError;
use crate::options::Connection;

/// The limit in use; none if there is none, or if the firmware does not know limits.
pub fn in_use(client: &mut Connection) -> Result<Option<IntensityLimit>, DeviceError> {
    match ask(client, &Request::ReadIntensityLimit) {
        Err(DeviceError::NoIntensityLimit) => Ok(None),
        outcome => outcome,
    }
}

/// Sets or removes the limit.
pub fn set(client: &mut Connection, limit: Option<IntensityLimit>) -> Result<(), DeviceError> {
    let [most_mcd, led_diameter_um] = IntensityLimit::numbers(limit);
    let request = Request::WriteIntensityLimit { most_mcd, led_diameter_um };
    match ask(client, &request) {
        // Firmware without limits has none to remove.
        Err(DeviceError::NoIntensityLimit) if limit.is_none() => Ok(()),
        outcome => outcome.map(drop),
    }
}

fn ask(client: &mut Connection, request: &Request<'_>) -> Result<Option<IntensityLimit>, DeviceError> {
    let outcome = client.ask(request, |answer| match answer {
        Answer::IntensityLimit { most_mcd, led_diameter_um } => {
            Some(IntensityLimit::from_numbers([most_mcd, led_diameter_um]).ok().flatten())
        }
        _ => None,
    });
    outcome.map_err(|error| error.if_unknown(DeviceError::NoIntensityLimit))
}
