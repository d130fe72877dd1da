//! Finds and reads panels on a processor without an FPU, in integer arithmetic.

use rx_pipeline::receiver::{IntegerReceiver, ReceiverError};
use static_cell::{ConstStaticCell, StaticCell};

use super::ROOM;

pub type Reader = IntegerReceiver<&'static mut [u8]>;

/// Makes the reader in its final place, because returning it would copy its 40 kB over the stack. Can be called once.
#[inline(never)]
pub fn take() -> Option<&'static mut Reader> {
    static CHANGE: ConstStaticCell<[u8; ROOM]> = ConstStaticCell::new([0; ROOM]);
    static READER: StaticCell<Result<Reader, ReceiverError>> = StaticCell::new();
    let change = CHANGE.take();
    let reader = READER.init_with(|| IntegerReceiver::new(1.0, &mut change[..]));
    reader.as_mut().ok()
}
