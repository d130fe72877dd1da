//! The serial ports: UART 0 and USB, the same service on each.

use embassy_futures::join::join3;
use embassy_rp::{
    Peri,
    peripherals::USB,
    uart::{BufferedUart, BufferedUartRx, BufferedUartTx},
};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, mutex::Mutex};
#[cfg(feature = "signing")]
use embassy_time::Timer;
use embassy_usb::{class::cdc_acm::CdcAcmClass, driver::EndpointError};
use embedded_io_async::{Read, Write};
use pico::usb::{self, Driver, PACKET};
use static_cell::StaticCell;
use tx_firmware::{
    service::{ANSWER_MAX, Identity, Service},
    store::Store,
};

use crate::{Irqs, memory::SteadyFlash, shared::Shared};

const IDENTITY: Identity = Identity {
    firmware: env!("CARGO_PKG_VERSION"),
    board: if cfg!(feature = "rp2350") { "pico2" } else { "pico" },
};

type Port = CdcAcmClass<'static, Driver>;
pub type SharedStore = Mutex<CriticalSectionRawMutex, Store<SteadyFlash>>;

/// What a request is carried out with.
#[derive(Clone, Copy)]
pub struct RequestContext {
    pub shared: &'static Shared,
    pub store: &'static SharedStore,
}

/// A service and room for its answers.
struct Clerk {
    service: Service,
    answer: [u8; ANSWER_MAX],
}

impl Clerk {
    const fn new() -> Self {
        Self {
            service: Service::new(IDENTITY),
            answer: [0; ANSWER_MAX],
        }
    }

    async fn receive(&mut self, byte: u8, context: &mut RequestContext) -> Option<&[u8]> {
        let mut store = context.store.lock().await;
        self.service.receive(byte, &mut context.shared, &mut *store, &mut self.answer)
    }
}

/// Serves both ports.
#[embassy_executor::task]
pub async fn serve(uart: BufferedUart, controller: Peri<'static, USB>, context: RequestContext) {
    let (transmit, receive) = uart.split();
    let (mut device, port) = usb::port(Driver::new(controller, Irqs), "vocc transmitter");
    join3(serve_uart(receive, transmit, context), serve_usb(port, context), device.run()).await;
}

async fn serve_uart(mut receive: BufferedUartRx, mut transmit: BufferedUartTx, mut context: RequestContext) {
    static CLERK: StaticCell<Clerk> = StaticCell::new();
    let clerk = CLERK.init_with(Clerk::new);
    let mut bytes = [0; 32];
    loop {
        // A line error spoils a frame, whose checksum tells.
        let Ok(count) = receive.read(&mut bytes).await else {
            continue;
        };
        for &byte in bytes.iter().take(count) {
            if let Some(answer) = clerk.receive(byte, &mut context).await {
                let _ = transmit.write_all(answer).await;
                // What runs at a lower priority, and feeds the watchdog, has its turn between requests that each take long.
                #[cfg(feature = "signing")]
                Timer::after_millis(1).await;
            }
        }
    }
}

async fn serve_usb(mut port: Port, mut context: RequestContext) {
    static CLERK: StaticCell<Clerk> = StaticCell::new();
    let clerk = CLERK.init_with(Clerk::new);
    let mut bytes = [0; PACKET];
    loop {
        port.wait_connection().await;
        while let Ok(count) = port.read_packet(&mut bytes).await {
            for &byte in bytes.iter().take(count) {
                if let Some(answer) = clerk.receive(byte, &mut context).await {
                    let _ = write_packets(&mut port, answer).await;
                }
            }
        }
    }
}

/// The last packet is a short one, if need be an empty one: it tells the host that nothing follows.
async fn write_packets(port: &mut Port, bytes: &[u8]) -> Result<(), EndpointError> {
    for packet in bytes.chunks(PACKET) {
        port.write_packet(packet).await?;
    }
    if bytes.len().is_multiple_of(PACKET) {
        port.write_packet(&[]).await?;
    }
    Ok(())
}
