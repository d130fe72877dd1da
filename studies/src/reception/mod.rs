//! What a computer does around the receiver, whoever gives it the frames: the command line, or a program that has them already.
//!
//! | part | does |
//! |---|---|
//! | [`receiver`] | a receiver of up to [`PANELS_MAX`] panels, on the heap, that looks for them in whole frames |
//! | [`rates`] | the symbol rate, where nobody tells it |
//! | [`still`] | single frames |
//! | [`whereabouts`] | where panels are, in metres |
//! | [`picture`], [`colour`], [`deep`] | 8-bit grey of pictures, of colours, and of 9 to 16 bits |
//! | [`stream`] | frames of films that are not compressed: y4m, raw bytes |
//! | [`learnt`] | what was learnt of a camera, in words |
//! | [`diagnosis`] | why no message came, and what would help |

pub mod colour;
pub mod deep;
pub mod diagnosis;
pub mod learnt;
pub mod picture;
pub mod rates;
pub mod still;
pub mod stream;
pub mod whereabouts;

use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings, SearchMemory};

/// The most pixels that a panel is read in; larger ones are seen in larger pixels.
pub const PANEL_PIXELS: usize = 160 * 160;
/// The most panels followed at once.
pub const PANELS_MAX: usize = 4;
/// Frames a second where nobody tells.
pub const USUAL_FPS: f32 = 100.0;

/// A receiver of a computer.
pub type Receiving<const PANELS: usize> =
    Receiver<PANEL_PIXELS, Box<ReceiverMemory<PANEL_PIXELS, PANELS>>, FrameSearch<Box<SearchMemory>, Vec<u8>>, PANELS>;

/// A receiver for frames of a width and height, which has seen none yet.
///
/// # Errors
/// When a setting is out of its range.
pub fn receiver<const PANELS: usize>(
    settings: ReceiverSettings,
    (width, height): (usize, usize),
) -> Result<Receiving<PANELS>, ReceiverError> {
    let room = FrameSearch::<Box<SearchMemory>>::bytes(width, height);
    let search = FrameSearch::with_history(Box::default(), vec![0; room]);
    Receiver::new(settings, Box::default(), search)
}
