//! The serial port over USB: what goes to UART 0 goes there too, and what comes from there is heard as well.

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

/// A computer that has the port open and takes nothing for so long does not listen.
const PATIENCE: Duration = Duration::from_millis(100);

static INCOMING: Pipe<CriticalSectionRawMutex, 256> = Pipe::new();
static OUTGOING: Pipe<CriticalSectionRawMutex, 4096> = Pipe::new();

/// A byte that has come.
pub fn read() -> Option<u8> {
    let mut byte = [0];
    matches!(INCOMING.try_read(&mut byte), Ok(1)).then_some(byte[0])
}

/// Sends what there is room for: the program never waits for a computer. A frame that is cut fails its checksum.
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
        // Where nobody has the port open, or takes anything, what is said is lost, as on a UART without an adapter.
        if port.dtr() {
            let _ = with_timeout(PATIENCE, write_packet(&mut port, &bytes[..count])).await;
        }
    }
}

/// An empty packet after a full one tells the computer that nothing follows, where nothing does.
async fn write_packet(port: &mut Sender<'static, Driver>, bytes: &[u8]) -> Result<(), EndpointError> {
    port.write_packet(bytes).await?;
    if bytes.len() == PACKET && OUTGOING.is_empty() {
        port.write_packet(&[]).await?;
    }
    Ok(())
}
