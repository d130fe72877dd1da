//! What finds and reads panels on a processor with an FPU: found by blinking, followed and read in all of a panel's pixels by k-means.

use rx_pipeline::{
    detect::Detector,
    receiver::{BlinkSearch, NoSearch, Proof, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings},
    standalone::PanelReceiver,
};
use static_cell::{ConstStaticCell, StaticCell};

use super::{CAMERA, ROOM};

/// Pixels that a panel is read in; larger ones are seen in larger pixels.
const PIXELS: usize = 48 * 48;

pub type Reader = PanelReceiver<PIXELS, &'static mut ReceiverMemory<PIXELS>, &'static mut [u8]>;

/// It, made in its place: handed on, its 40 kB would pass through the stack. Once.
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
