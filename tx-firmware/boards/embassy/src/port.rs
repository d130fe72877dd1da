//! The service of serial ports.

use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, mutex::Mutex};
#[cfg(feature = "signing")]
use embassy_time::Timer;
use embedded_io_async::{Read, Write};
use tx_firmware::{
    service::{ANSWER_MAX, Device, Identity, Service},
    store::Memory,
};

/// A store that several ports share.
pub type SharedStore<S> = Mutex<CriticalSectionRawMutex, S>;

/// The resources of a request.
pub struct RequestContext<D, S: 'static> {
    /// The transmitter.
    pub shared: D,
    /// The store.
    pub store: &'static SharedStore<S>,
}

impl<D: Clone, S> Clone for RequestContext<D, S> {
    fn clone(&self) -> Self {
        Self {
            shared: self.shared.clone(),
            store: self.store,
        }
    }
}

/// The service of one port, with a buffer for its answers.
pub struct PortService {
    service: Service,
    answer: [u8; ANSWER_MAX],
}

impl PortService {
    /// A service for a board of this identity.
    pub const fn new(identity: Identity) -> Self {
        Self {
            service: Service::new(identity),
            answer: [0; ANSWER_MAX],
        }
    }

    /// Processes a byte, and returns the answer if it completes a request.
    pub async fn receive<D: Device, S: Memory>(&mut self, byte: u8, context: &mut RequestContext<D, S>) -> Option<&[u8]> {
        let mut store = context.store.lock().await;
        self.service.receive(byte, &mut context.shared, &mut *store, &mut self.answer)
    }
}

/// Serves a UART.
pub async fn serve<D: Device, S: Memory>(
    mut receive: impl Read,
    mut transmit: impl Write,
    service: &mut PortService,
    mut context: RequestContext<D, S>,
) -> ! {
    let mut bytes = [0; 32];
    loop {
        // A line error damages a frame, which its checksum detects.
        let Ok(count) = receive.read(&mut bytes).await else {
            continue;
        };
        for &byte in bytes.iter().take(count) {
            if let Some(answer) = service.receive(byte, &mut context).await {
                let _ = transmit.write_all(answer).await;
                // Between long requests, let code of lower priority run, which feeds the watchdog.
                #[cfg(feature = "signing")]
                Timer::after_millis(1).await;
            }
        }
    }
}
