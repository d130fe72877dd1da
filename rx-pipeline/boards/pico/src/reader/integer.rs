//! What finds and reads panels on a processor without an FPU: all in whole numbers.

use rx_pipeline::receiver::{IntegerReceiver, ReceiverError};
use static_cell::{ConstStaticCell, StaticCell};

use super::ROOM;

pub type Reader = IntegerReceiver<&'static mut [u8]>;

/// It, made in its place: handed on, its 40 kB would pass through the stack. Once.
#[inline(never)]
pub fn take() -> Option<&'static mut Reader> {
    static CHANGE: ConstStaticCell<[u8; ROOM]> = ConstStaticCell::new([0; ROOM]);
    static READER: StaticCell<Result<Reader, ReceiverError>> = StaticCell::new();
    let change = CHANGE.take();
    let reader = READER.init_with(|| IntegerReceiver::new(1.0, &mut change[..]));
    reader.as_mut().ok()
}
