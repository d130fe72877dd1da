//! Finds and reads panels on a processor with an FPU: finds them by blinking, then follows them and reads all their pixels by k-means.

use rx_pipeline::{
    detect::Detector,
    receiver::{BlinkSearch, NoSearch, Proof, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings},
    standalone::PanelReceiver,
};
use static_cell::{ConstStaticCell, StaticCell};

use super::{CAMERA, ROOM};

/// Number of pixels in which a panel is read; a larger panel is binned.
const PIXELS: usize = 48 * 48;

pub type Reader = PanelReceiver<PIXELS, &'static mut ReceiverMemory<PIXELS>, &'static mut [u8]>;

/// Makes the reader in its final place, because returning it would copy its 40 kB over the stack. Can be called once.
#[inline(never)]
pub fn take() -> Option<&'static mut Reader> {
    static MEMORY: ConstStaticCell<ReceiverMemory<PIXELS>> = ConstStaticCell::new(ReceiverMemory::new());
    static CHANGE: ConstStaticCell<[u8; ROOM]> = ConstStaticCell::new([0; ROOM]);
    static READER: StaticCell<Result<Reader, ReceiverError>> = StaticCell::new();
    let (memory, change) = (MEMORY.take(), CHANGE.take());
    let settings = ReceiverSettings {
        camera: CAMERA,
        method: Detector::KMeans.into(),
        symbols_per_frame: 1.0,
        ..ReceiverSettings::default()
    };
    let reader = READER.init_with(|| {
        Ok(PanelReceiver {
            receiver: Receiver::new(settings, memory, NoSearch)?,
            settings,
            search: BlinkSearch::new(&mut change[..]),
            proof: Proof::new(1.0),
        })
    });
    reader.as_mut().ok()
}
