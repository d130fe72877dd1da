//! The image formation of a plan: the parts of the included effects, for the renderer.
//!
//! Every included effect writes its part here once, before the first frame. An effect that is left out writes nothing and costs nothing.

use link::panel::LEDS;
use link::waveform::Waveform;

use crate::air::Air;
use crate::camera::clock::Moment;
use crate::camera::curve::Curve;
use crate::camera::noise::Noise;
use crate::camera::shake::Shake;
use crate::disc::spread::Shape;

/// A change of the light of each LED, frame by frame.
pub trait LedStage: Send + Sync {
    /// Changes each LED's own light over its exposure, which starts `delay_s` after the moment: 1 for an On LED.
    fn apply(&self, panel: usize, moment: &Moment, delay_s: &[f64; LEDS], own_light: &mut [f64; LEDS]);
}

/// A change of the linear values of a row of pixels. It depends on the camera alone, so that it is computed once for pixels that no panel
/// lights.
pub trait RowStage: Send + Sync {
    /// Changes the `row` whose first pixel is (`x`, `y`) of the sensor.
    fn apply(&self, x: usize, y: usize, row: &mut [f32]);
    /// The same in double precision.
    fn apply_exact(&self, x: usize, y: usize, row: &mut [f64]);
}

/// A change of the encoded frame, after noise and rounding.
pub trait GreyStage: Send + Sync {
    /// The reach of its effect, in pixels.
    fn reach_px(&self) -> usize;
    /// The side of its independent blocks, which start at the frame's first pixel.
    fn block_px(&self) -> usize {
        1
    }
    /// Changes a frame of that width, row by row.
    fn apply(&self, width: usize, grey: &mut [u8]);
}

/// The formation of an image from light: the sum of the included effects' parts.
pub struct Formation {
    /// Lens blur in px, the core if there is a spread beyond it; 0: none.
    pub sigma_px: f64,
    /// The blur beyond its core.
    pub spread: Shape,
    /// Whether each LED is projected individually; otherwise the whole panel is one affine image.
    pub exact_perspective: bool,
    /// Radial distortion k₁; 0: none.
    pub distortion_k1: f64,
    /// The air before each panel, its veil as a linear value.
    pub air: Vec<Air>,
    /// The air before the background, its veil as a linear value.
    pub background_air: Air,
    /// The linear value of each panel's board, without the air before it; `None`: no board is drawn.
    pub boards: Vec<Option<f64>>,
    /// Whether the photograph is drawn.
    pub photograph: bool,
    /// Whether panels other than the first are drawn.
    pub other_panels: bool,
    /// Samples of the exposure to average for moving panels: (time from the exposure's middle in seconds, weight). A single one without
    /// motion.
    pub motion_samples: Vec<(f64, f64)>,
    /// Whether panels move during the exposure; otherwise they move only from row to row.
    pub moves: bool,
    /// The camera's vibration.
    pub shake: Option<Shake>,
    /// The delay between the exposures of neighbouring rows, in seconds; 0 is a global shutter.
    pub row_delay_s: f64,
    /// Whether the symbols of one exposure are mixed by their shares of its time; otherwise only the one in its middle shows.
    pub mix_symbols: bool,
    /// The waveform of symbols.
    pub waveform: Waveform,
    /// Changes of the LEDs' light.
    pub led_stages: Vec<Box<dyn LedStage>>,
    /// Whether pixels form a mosaic of red, green, green and blue.
    pub mosaic: bool,
    /// Changes of the linear image.
    pub row_stages: Vec<Box<dyn RowStage>>,
    /// The curve from linear values to grey levels.
    pub curve: Curve,
    /// The sensor's noise.
    pub noise: Option<Noise>,
    /// Changes of the encoded frame.
    pub grey_stages: Vec<Box<dyn GreyStage>>,
}

impl Formation {
    /// The formation without any effect, for a number of panels and a gamma curve.
    pub fn plain(panels: usize, curve: Curve) -> Self {
        Self {
            sigma_px: 0.0,
            spread: Shape::Point,
            exact_perspective: false,
            distortion_k1: 0.0,
            air: vec![Air::NONE; panels],
            background_air: Air::NONE,
            boards: vec![None; panels],
            photograph: false,
            other_panels: false,
            motion_samples: vec![(0.0, 1.0)],
            moves: false,
            shake: None,
            row_delay_s: 0.0,
            mix_symbols: false,
            waveform: Waveform::STILL,
            led_stages: Vec::new(),
            mosaic: false,
            row_stages: Vec::new(),
            curve,
            noise: None,
            grey_stages: Vec::new(),
        }
    }
}
