//! The serial port over USB: it mirrors UART 0 in both directions.

use embassy_futures::join::join3;
use embassy_rp::{Peri, peripherals::USB};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, pipe::Pipe};
use embassy_time::{Duration, with_timeout};
use embassy_usb::{
    class::cdc_acm::{Receiver, Sender},
    driver::EndpointError,
};
use pico::usb::{self, Driver, PACKET};

use crate::Irqs;

/// A computer that has the port open but accepts nothing for this long is not listening.
const PATIENCE: Duration = Duration::from_millis(100);

static INCOMING: Pipe<CriticalSectionRawMutex, 256> = Pipe::new();
static OUTGOING: Pipe<CriticalSectionRawMutex, 4096> = Pipe::new();

/// A received byte, if there is one.
pub fn read() -> Option<u8> {
    let mut byte = [0];
    matches!(INCOMING.try_read(&mut byte), Ok(1)).then_some(byte[0])
}

/// Sends as many bytes as there is room for: the program never waits for a computer. The checksum of a truncated frame fails.
pub fn write(mut bytes: &[u8]) {
    while let Ok(count) = OUTGOING.try_write(bytes)
        && count < bytes.len()
    {
        bytes = &bytes[count..];
    }
}

/// Serves the port.
#[embassy_executor::task]
pub async fn serve(controller: Peri<'static, USB>) {
    let (mut device, port) = usb::port(Driver::new(controller, Irqs), "vocc receiver");
    let (sender, receiver) = port.split();
    join3(device.run(), listen(receiver), speak(sender)).await;
}

async fn listen(mut port: Receiver<'static, Driver>) {
    let mut bytes = [0; PACKET];
    loop {
        port.wait_connection().await;
        while let Ok(count) = port.read_packet(&mut bytes).await {
            INCOMING.write_all(&bytes[..count]).await;
        }
    }
}

async fn speak(mut port: Sender<'static, Driver>) {
    let mut bytes = [0; PACKET];
    loop {
        let count = OUTGOING.read(&mut bytes).await;
        // If nobody has the port open or reads from it, output is lost, as on a UART without an adapter.
        if port.dtr() {
            let _ = with_timeout(PATIENCE, write_packet(&mut port, &bytes[..count])).await;
        }
    }
}

/// Writes a packet. If nothing follows a full packet, an empty one marks the end.
async fn write_packet(port: &mut Sender<'static, Driver>, bytes: &[u8]) -> Result<(), EndpointError> {
    port.write_packet(bytes).await?;
    if bytes.len() == PACKET && OUTGOING.is_empty() {
        port.write_packet(&[]).await?;
    }
    Ok(())
}
