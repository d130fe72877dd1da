//! The serial ports: UART 0 and USB, the same service on each.

use embassy_futures::join::join3;
use embassy_rp::{Peri, peripherals::USB, uart::BufferedUart};
use embassy_usb::{class::cdc_acm::CdcAcmClass, driver::EndpointError};
use on_embassy::port::{self, PortService};
use pico::usb::{self, Driver, PACKET};
use static_cell::StaticCell;
use tx_firmware::{service::Identity, store::Store};

use crate::{Irqs, memory::SteadyFlash, shared::Shared};

const IDENTITY: Identity = Identity {
    firmware: env!("CARGO_PKG_VERSION"),
    board: if cfg!(feature = "rp2350") { "pico2" } else { "pico" },
};

type Port = CdcAcmClass<'static, Driver>;
/// The store of both ports.
pub type SharedStore = port::SharedStore<Store<SteadyFlash>>;
/// The resources of a request.
pub type RequestContext = port::RequestContext<&'static Shared, Store<SteadyFlash>>;

/// Serves both ports.
#[embassy_executor::task]
pub async fn serve(uart: BufferedUart, controller: Peri<'static, USB>, context: RequestContext) {
    let (transmit, receive) = uart.split();
    let (mut device, usb_port) = usb::port(Driver::new(controller, Irqs), "vocc transmitter");
    static SERVICE: StaticCell<PortService> = StaticCell::new();
    let service = SERVICE.init_with(|| PortService::new(IDENTITY));
    let uart = port::serve(receive, transmit, service, context.clone());
    join3(uart, serve_usb(usb_port, context), device.run()).await;
}

async fn serve_usb(mut port: Port, mut context: RequestContext) {
    static SERVICE: StaticCell<PortService> = StaticCell::new();
    let service = SERVICE.init_with(|| PortService::new(IDENTITY));
    let mut bytes = [0; PACKET];
    loop {
        port.wait_connection().await;
        while let Ok(count) = port.read_packet(&mut bytes).await {
            for &byte in bytes.iter().take(count) {
                if let Some(answer) = service.receive(byte, &mut context).await {
                    let _ = write_packets(&mut port, answer).await;
                }
            }
        }
    }
}

/// The last packet is a short or an empty one, which tells the host that nothing follows.
async fn write_packets(port: &mut Port, bytes: &[u8]) -> Result<(), EndpointError> {
    for packet in bytes.chunks(PACKET) {
        port.write_packet(packet).await?;
    }
    if bytes.len().is_multiple_of(PACKET) {
        port.write_packet(&[]).await?;
    }
    Ok(())
}
