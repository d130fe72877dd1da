//! The limit of a transmitter's luminous intensity, which comes with its calibration.

use link::intensity::IntensityLimit;
use link::serial::{Answer as Told, Refusal, Request};

use crate::device::DeviceError;
use crate::options::Connection;

/// The limit in use; none where there is none, or the firmware is too old to have one.
pub fn shown(client: &mut Connection) -> Result<Option<IntensityLimit>, DeviceError> {
    match ask(client, &Request::ReadIntensityLimit) {
        Err(DeviceError::NoIntensityLimit) => Ok(None),
        told => told,
    }
}

/// Sets a limit, or takes the one there is back.
pub fn set(client: &mut Connection, limit: Option<IntensityLimit>) -> Result<(), DeviceError> {
    let [most_mcd, led_diameter_um] = IntensityLimit::numbers(limit);
    let request = Request::WriteIntensityLimit { most_mcd, led_diameter_um };
    match ask(client, &request) {
        // What has none need not take it back.
        Err(DeviceError::NoIntensityLimit) if limit.is_none() => Ok(()),
        told => told.map(drop),
    }
}

fn ask(client: &mut Connection, request: &Request<'_>) -> Result<Option<IntensityLimit>, DeviceError> {
    let told = client.ask(request, |answer| match answer {
        Told::IntensityLimit { most_mcd, led_diameter_um } => {
            Some(IntensityLimit::from_numbers([most_mcd, led_diameter_um]).ok().flatten())
        }
        _ => None,
    });
    told.map_err(|error| match error {
        DeviceError::Refused(Refusal::Unknown) => DeviceError::NoIntensityLimit,
        other => other,
    })
}
