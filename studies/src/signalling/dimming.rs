//! Beats between the dimming of LEDs and a camera's exposures.
//!
//! An exposure without a whole number of pulses receives more or less light depending on its phase in a period, and the phase changes from
//! frame to frame: the LEDs' brightness oscillates at the difference between the pulses' frequency and the nearest multiple of the frame
//! rate.

use sim::accuracy::Level;
use sim::effects::Pulses;
use sim::renderer::Renderer;
use sim::scene::Scene;
use sim::view::ViewError;

/// The greatest relative deviation of light that does not count as a beat; a receiver reads LEDs that differ by four times as much.
const SEEN: f64 = 0.05;

/// The relation of a panel's pulses to the camera's exposures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DimmingBeat {
    /// Pulses, or whole scans of a row-scanned panel, a second.
    pub pulses_hz: f64,
    /// Pulses in an exposure.
    pub pulses_an_exposure: f64,
    /// The frequency of the brightness, Hz; 0 if all frames are alike.
    pub beat_hz: f64,
    /// The greatest relative deviation of a frame's light from the mean.
    pub stray: f64,
}

impl DimmingBeat {
    /// Whether the deviation is more than 1/20.
    pub fn is_seen(&self) -> bool {
        self.stray > SEEN
    }
}

/// For each panel with PWM dimming or row scanning.
pub(super) fn beats(scene: &Scene) -> Result<Vec<DimmingBeat>, ViewError> {
    let renderer = Renderer::new(scene, Level::Fast)?;
    let view = renderer.view();
    let exposure_s = view.exposure.time_s;
    let frames_hz = scene.camera.frame_rate_hz;
    let pulses = view.panels.iter().filter_map(|panel| Pulses::of(view, panel));
    Ok(pulses
        .map(|pulses| DimmingBeat {
            pulses_hz: pulses.hz,
            pulses_an_exposure: pulses.hz * exposure_s,
            beat_hz: (pulses.hz - (pulses.hz / frames_hz).round() * frames_hz).abs(),
            stray: pulses.stray(exposure_s),
        })
        .collect())
}

/// The time from the first of the camera's lines that show the first panel's LEDs to the last, s.
pub(super) fn panel_readout_s(scene: &Scene) -> Result<f64, ViewError> {
    let rows = Renderer::new(scene, Level::Fast)?.corner_leds_px(0).map(|[_, row]| row);
    let first = rows.iter().copied().fold(f64::INFINITY, f64::min);
    let last = rows.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let share = (last - first) / scene.camera.height_px as f64;
    Ok(scene.camera.readout_s * share.clamp(0.0, 1.0))
}
