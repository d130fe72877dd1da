//! The serial port over USB.

use embassy_rp::{peripherals::USB, usb};
use embassy_usb::{
    Builder, UsbDevice,
    class::cdc_acm::{CdcAcmClass, State},
};
use static_cell::StaticCell;

/// Bytes of a packet: the maximum at full speed (USB 2.0, 5.8.3).
pub const PACKET: usize = 64;

/// The chip's USB controller.
pub type Driver = usb::Driver<'static, USB>;

/// The working memory of the device.
struct Memory {
    configuration: [u8; 128],
    control: [u8; PACKET],
    state: State<'static>,
}

/// A device that is a serial port, and the port. Can be called once.
pub fn port(driver: Driver, product: &'static str) -> (UsbDevice<'static, Driver>, CdcAcmClass<'static, Driver>) {
    static MEMORY: StaticCell<Memory> = StaticCell::new();
    let Memory {
        configuration,
        control,
        state,
    } = MEMORY.init_with(|| Memory {
        configuration: [0; 128],
        control: [0; PACKET],
        state: State::new(),
    });
    // Raspberry Pi's identifiers for a serial port on a Pico.
    let mut config = embassy_usb::Config::new(0x2e8a, 0x000a);
    config.manufacturer = Some("vocc");
    config.product = Some(product);
    let mut builder = Builder::new(driver, config, configuration, &mut [], &mut [], control);
    let port = CdcAcmClass::new(&mut builder, state, PACKET as u16);
    (builder.build(), port)
}
