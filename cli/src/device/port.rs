//! Opens and lists serial ports.

use std::io::ErrorKind as Io;
use std::time::Duration;

use serialport::{ErrorKind, SerialPort, SerialPortType};

use super::DeviceError;

/// Opens a port or a pseudo-terminal. Reads time out after `patience`.
pub fn open(name: &str, baud: u32, patience: Duration) -> Result<Box<dyn SerialPort>, DeviceError> {
    let port = name.to_owned();
    serialport::new(name, baud)
        .timeout(patience)
        .dtr_on_open(true)
        .open()
        .map_err(|error| match error.kind() {
            ErrorKind::Io(Io::NotFound) => DeviceError::NoSuchPort { port },
            ErrorKind::Io(Io::PermissionDenied) => DeviceError::Forbidden { port },
            // In use by another program: the error depends on how that opened it.
            ErrorKind::NoDevice | ErrorKind::Io(Io::WouldBlock | Io::ResourceBusy) => {
                if std::path::Path::new(name).exists() || !cfg!(unix) {
                    DeviceError::Busy { port }
                } else {
                    DeviceError::NoSuchPort { port }
                }
            }
            _ => DeviceError::NoPort {
                port,
                why: error.description,
            },
        })
}

/// An available port.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PortInfo {
    /// Its name, for --port.
    pub port: String,
    /// `usb`, `pci`, `bluetooth` or `unknown`.
    pub bus: &'static str,
    /// A USB device's product name.
    pub product: Option<String>,
    /// A USB device's serial number.
    pub serial_number: Option<String>,
}

/// This computer's serial ports, USB ones first.
pub fn list() -> Result<Vec<PortInfo>, serialport::Error> {
    let mut ports: Vec<PortInfo> = serialport::available_ports()?
        .into_iter()
        .map(|found| {
            let (bus, product, serial_number) = match found.port_type {
                SerialPortType::UsbPort(usb) => ("usb", usb.product, usb.serial_number),
                SerialPortType::PciPort => ("pci", None, None),
                SerialPortType::BluetoothPort => ("bluetooth", None, None),
                SerialPortType::Unknown => ("unknown", None, None),
            };
            PortInfo {
                port: found.port_name,
                bus,
                product,
                serial_number,
            }
        })
        .collect();
    ports.sort_by_key(|listed| (listed.bus != "usb", listed.port.clone()));
    Ok(ports)
}
