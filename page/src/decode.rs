//! Reads the bits of single pictures.

use link::camera::{Camera, Encoding};
use reception::colour::Channel;
use reception::deep::{self, Compander};
use reception::still::StillDecoder;
use reception::{learnt, picture};
use rx_pipeline::detect::Method;
use rx_pipeline::frame::Frame;
use serde_json::{Value, json};
use sim::input;

use crate::fault::Fault;

/// A picture in 8-bit grey.
struct Picture {
    width: usize,
    height: usize,
    grey: Vec<u8>,
    /// Whether the samples were proportional to light and have been encoded for the receiver.
    is_encoded: bool,
}

/// The reading of a PNG, JPEG or PGM file, as `vocc decode` reads it; `out` is the picture in grey.
pub fn file(bytes: &[u8], out: &mut Vec<u8>) -> Result<Value, Fault> {
    let image = input::picture_of(bytes)?.image;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut deep = Compander::new(None, Encoding::LINEAR);
    let grey = picture::grey(image, Channel::Brightest, &mut deep)?;
    let picture = Picture {
        width,
        height,
        grey,
        is_encoded: deep.white() > 0 && deep::encodes(None),
    };
    told(picture, out)
}

/// The reading of a picture that the browser has decoded: red, green, blue and opacity of each pixel.
pub fn rgba(bytes: &[u8], size: (usize, usize), out: &mut Vec<u8>) -> Result<Value, Fault> {
    let mut grey = Vec::new();
    brightest(bytes, size, &mut grey)?;
    let (width, height) = size;
    let picture = Picture {
        width,
        height,
        grey,
        is_encoded: false,
    };
    told(picture, out)
}

/// The maximum of red, green and blue for each pixel.
pub fn brightest(rgba: &[u8], (width, height): (usize, usize), grey: &mut Vec<u8>) -> Result<(), Fault> {
    let wanted = 4 * width * height;
    if rgba.len() != wanted {
        let bytes = rgba.len();
        return Err(Fault::Pixels {
            bytes,
            wanted,
            width,
            height,
        });
    }
    let (pixels, _) = rgba.as_chunks::<4>();
    grey.clear();
    grey.extend(
        pixels
            .iter()
            .map(|&[red, green, blue, _]| Channel::Brightest.of([red, green, blue])),
    );
    Ok(())
}

fn told(picture: Picture, out: &mut Vec<u8>) -> Result<Value, Fault> {
    let Picture { width, height, .. } = picture;
    let frame = Frame::new(&picture.grey, width, height)?;
    let (read, learnt) = StillDecoder::new(Method::default()).decode(&frame, Camera::default(), None)?;
    let camera = learnt.map(|mut learnt| {
        if picture.is_encoded {
            learnt.camera.encoding = deep::of_samples(learnt.camera.encoding);
        }
        learnt::as_json(&learnt)
    });
    let reading = read.as_ref().ok().map(|still| &still.reading);
    let corners = reading.map(|reading| &reading.corners);
    let detection = reading.map(|reading| &reading.detection);
    let told = json!({
        "width": width, "height": height, "found": read.is_ok(), "why": read.as_ref().err(), "camera": camera,
        "bits": detection.map(|detection| detection.bits.to_string()), "confidence": detection.map(|detection| detection.confidence),
        "corners_px": corners.map(|corners| corners.points()), "pitch_px": corners.map(|corners| corners.pitch_px()),
    });
    *out = picture.grey;
    Ok(told)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explore::Explore;
    use sim::accuracy::Level;
    use sim::scene::Scene;

    #[test]
    fn a_picture_is_read_from_a_file_and_from_the_browser_alike() {
        let scene = Scene::load("day", &[]).unwrap();
        let mut explore = Explore::new(&scene, Level::Fine, 1).unwrap();
        explore.frame(0);
        let (width, height) = (explore.region.width, explore.region.height);
        let image = image::GrayImage::from_raw(width as u32, height as u32, explore.grey.clone()).unwrap();
        let mut png = std::io::Cursor::new(Vec::new());
        image.write_to(&mut png, image::ImageFormat::Png).unwrap();
        let mut out = Vec::new();
        let by_file = file(png.get_ref(), &mut out).unwrap();
        assert_eq!(by_file["bits"], explore.sight.sent.to_string());
        assert_eq!(out, explore.grey);
        let pixels: Vec<u8> = out.iter().flat_map(|&grey| [grey, grey, grey, 255]).collect();
        assert_eq!(rgba(&pixels, (width, height), &mut out).unwrap(), by_file);
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let mut out = Vec::new();
        let is_no_picture = |fault| matches!(fault, Fault::Library(error) if error.is::<sim::input::PictureError>());
        assert!(file(b"no picture", &mut out).is_err_and(is_no_picture));
        assert!(matches!(rgba(&[0; 7], (2, 1), &mut out), Err(Fault::Pixels { .. })));
        let grey = file(b"P5 4 4 255 0123456789abcdef", &mut out).unwrap();
        assert_eq!(grey["found"], false);
        assert!(grey["why"].is_string());
    }
}
