//! Reads the receiver's frames on this computer, to find whether the light is the reason if a text does not arrive.

use std::path::Path;

use link::camera::{Camera, Encoding};
use link::framing::Event as Received;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};

const PANEL_PIXELS: usize = 128 * 128;
/// The camera according to its datasheet and the driver: linear, black at 8.
const CAMERA: Camera = Camera {
    encoding: Encoding::Gamma(1.0),
    black_grey: 8.0,
    blur_sigma_px: 0.6,
    blur_aspect: 1.0,
    read_noise_e: 4.0,
};

/// The texts in a film of concatenated PGM pictures.
pub fn texts(film: &Path, symbols_per_frame: f32) -> Vec<String> {
    let bytes = std::fs::read(film).expect("a film");
    let settings = ReceiverSettings {
        camera: CAMERA,
        symbols_per_frame,
        ..ReceiverSettings::default()
    };
    let memory = Box::<ReceiverMemory<PANEL_PIXELS>>::default();
    let search = FrameSearch::new(Box::<SearchMemory>::default());
    let mut receiver = Receiver::new(settings, memory, search).expect("a usable link");
    let mut texts = vec![];
    let mut rest = &bytes[..];
    for number in 0.. {
        let Some((pixels, width, height, behind)) = picture(rest) else {
            break;
        };
        let frame = Frame::new(pixels, width, height).expect("a whole frame");
        if let Received::Delivered(delivery) = receiver.frame(number, &frame).event {
            texts.push(String::from_utf8_lossy(delivery.message).into_owned());
        }
        rest = behind;
    }
    texts
}

/// The first picture: its pixels, columns and rows, and the bytes after it.
fn picture(film: &[u8]) -> Option<(&[u8], usize, usize, &[u8])> {
    let end = film.iter().position(|&byte| byte == b'\n')?;
    let head = std::str::from_utf8(&film[..end]).ok()?;
    let mut words = head.split(' ').skip(1).map(|word| word.parse().ok());
    let (width, height): (usize, usize) = (words.next()??, words.next()??);
    let (pixels, behind) = film[end + 1..].split_at_checked(width * height)?;
    Some((pixels, width, height, behind))
}
