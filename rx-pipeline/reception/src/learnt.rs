//! The learnt camera, in words.

use link::camera::{Camera, Encoding};
use link::panel::{LEDS, SIDE};
use rx_pipeline::camera::CameraEstimate;

/// The learnt camera as JSON: the keys of a camera's file, its reliability and the broken LEDs.
pub fn as_json(learnt: &CameraEstimate) -> serde_json::Value {
    let CameraEstimate {
        camera,
        blur_deviation_px,
        noise_grey,
        line_delay,
        broken,
        frames,
        ..
    } = learnt;
    serde_json::json!({
        "encoding": camera.encoding, "black_grey": camera.black_grey, "blur_sigma_px": camera.blur_sigma_px,
        "blur_aspect": camera.blur_aspect, "read_noise_e": camera.read_noise_e, "blur_deviation_px": blur_deviation_px,
        "noise_grey": noise_grey, "line_delay_exposures": line_delay, "broken_leds": leds(*broken), "frames": frames,
    })
}

/// The learnt camera as text.
pub fn as_text(learnt: &CameraEstimate) -> String {
    let Camera {
        encoding,
        black_grey,
        blur_sigma_px,
        blur_aspect,
        ..
    } = learnt.camera;
    let blur = match learnt.blur_deviation_px {
        Some(deviation) => format!("blur {blur_sigma_px:.2} ± {deviation:.2} px"),
        None => format!("blur not visible in the larger pixels of a near panel, {blur_sigma_px:.2} px as configured"),
    };
    let encoding = match encoding {
        Encoding::Gamma(gamma) => format!("gamma {gamma:.2}"),
        Encoding::Srgb => "sRGB".to_owned(),
        Encoding::Rec709 => "BT.709".to_owned(),
    };
    let broken = leds(learnt.broken);
    let broken = if broken.is_empty() {
        String::new()
    } else {
        let places: Vec<String> = broken
            .iter()
            .map(|led| format!("row {} column {}", led / SIDE + 1, led % SIDE + 1))
            .collect();
        format!("; broken LEDs: {}", places.join(", "))
    };
    let lines = match learnt.line_delay {
        None => String::new(),
        Some(0.0) => ", no delay between lines visible".to_owned(),
        Some(delay) => format!(", each line {delay:.4} exposures after the one above"),
    };
    format!(
        "camera as learnt from {} frames: {blur}, {blur_aspect:.2} times as wide as high, {encoding}, black at \
         {black_grey:.0}, noise {:.1} grey levels{lines}{broken}",
        learnt.frames, learnt.noise_grey
    )
}

/// The numbers of a mask's LEDs, 8·row + column.
pub fn leds(mask: u64) -> Vec<usize> {
    (0..LEDS).filter(|led| mask >> led & 1 == 1).collect()
}
