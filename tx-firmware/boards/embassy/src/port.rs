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

/// What a request is carried out with.
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

/// A service and room for its answers.
pub struct Clerk {
    service: Service,
    answer: [u8; ANSWER_MAX],
}

impl Clerk {
    /// A clerk of one port.
    pub const fn new(identity: Identity) -> Self {
        Self {
            service: Service::new(identity),
            answer: [0; ANSWER_MAX],
        }
    }

    /// Takes a byte, and returns the answer if that completes a request.
    pub async fn receive<D: Device, S: Memory>(&mut self, byte: u8, context: &mut RequestContext<D, S>) -> Option<&[u8]> {
        let mut store = context.store.lock().await;
        self.service.receive(byte, &mut context.shared, &mut *store, &mut self.answer)
    }
}

/// Serves a UART.
pub async fn serve<D: Device, S: Memory>(
    mut receive: impl Read,
    mut transmit: impl Write,
    clerk: &mut Clerk,
    mut context: RequestContext<D, S>,
) -> ! {
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
