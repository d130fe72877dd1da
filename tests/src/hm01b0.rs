//! A Himax HM01B0's view of a transmitter's LEDs: the simulator's camera with the register values that a receiver wrote.
//!
//! Lens and sensor are the scene's, usually [`hm01b0`](sim::scene::PRESETS); the registers set exposure, gain and readout window. The
//! shutter is rolling.

use link::panel::PanelFrame;
use serde::Deserialize;
use sim::accuracy::Level;
use sim::camera::clock::{Moment, WINDOW};
use sim::renderer::canvas::{Canvas, Region};
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::{L2a, Scene, SceneError};
use sim::view::ViewError;

use crate::driven_panel::{Cycles, FULL_CD_M2, Pulses};

/// ISO speed at a gain of 1. Assumed, as the datasheet omits it: a pixel of 3.6 µm with a quantum efficiency of 50 % for white light
/// saturates at 6000 electrons after 0.09 lx·s.
pub const ISO_AT_GAIN_1: f64 = 200.0;

/// Maximum relative difference in length between symbols within one frame.
const LENGTH_ERROR_MAX: f64 = 0.01;

/// Requests to the camera, one per line.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Changes the scene permanently by `key=value`.
    Scene(Vec<String>),
    /// Renders a frame; the answer is its pixels.
    Frame(Box<FrameRequest>),
}

/// A frame, and the LEDs' state during it.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct FrameRequest {
    /// The frame number.
    pub number: u64,
    /// Readout time of its first line, ns.
    pub ns: f64,
    /// Output columns.
    pub width: usize,
    /// Output lines.
    pub height: usize,
    /// Whether a pixel is the mean of 2 × 2 sensor pixels.
    pub binned: bool,
    /// Line period, ns.
    pub line_nanos: f64,
    /// Frame period, ns.
    pub frame_nanos: f64,
    /// Exposure before the readout, in lines.
    pub exposure_lines: f64,
    /// The gain, at least 1.
    pub gain: f64,
    /// The black level in grey levels.
    pub black: f64,
    /// Start time in ns of each symbol, and the LEDs that are On: 16 hexadecimal digits.
    pub symbols: Vec<(f64, String)>,
    /// The dimming pulses.
    pub pulse: Cycles,
}

/// Why a frame cannot be rendered.
#[derive(Debug)]
pub enum EyeError {
    /// The scene is invalid.
    Scene(SceneError),
    /// The request results in an invalid scene.
    Range(sim::scene::RangeError),
    /// The panel is not in view.
    View(ViewError),
    /// The digits are no LED states.
    Digits(String),
    /// The frame spans more symbols than one exposure can simulate, or symbols of unequal length.
    Symbols(Vec<f64>),
}

impl std::fmt::Display for EyeError {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scene(error) => write!(to, "{error}"),
            Self::Range(error) => write!(to, "{error}"),
            Self::View(error) => write!(to, "{error}"),
            Self::Digits(digits) => write!(to, "{digits}: a panel is 16 hexadecimal digits"),
            Self::Symbols(changes_s) => write!(
                to,
                "a frame sees changes after {changes_s:?} s: at most {} evenly spaced ones can be drawn; show fewer symbols a second",
                WINDOW - 1
            ),
        }
    }
}

impl std::error::Error for EyeError {}

/// The camera and its scene.
pub struct Eye {
    name: String,
    changes: Vec<String>,
    scene: Scene,
    renderer: Option<(Scene, Box<Renderer>)>,
    sensor: Vec<u8>,
}

impl Eye {
    /// A camera in a scene, by name or file, with these changes.
    pub fn new(name: &str, changes: &[String]) -> Result<Self, EyeError> {
        Ok(Self {
            name: name.into(),
            changes: changes.to_vec(),
            scene: Scene::load(name, changes).map_err(EyeError::Scene)?,
            renderer: None,
            sensor: Vec::new(),
        })
    }

    /// Changes the scene permanently.
    pub fn change(&mut self, changes: &[String]) -> Result<(), EyeError> {
        let all = [&self.changes, changes].concat();
        self.scene = Scene::load(&self.name, &all).map_err(EyeError::Scene)?;
        self.changes = all;
        Ok(())
    }

    /// Renders a frame of `width` × `height` pixels, row by row.
    pub fn see(&mut self, request: &FrameRequest) -> Result<Vec<u8>, EyeError> {
        let (moment, symbols) = moment(request)?;
        let pulses = Pulses::from(request.pulse);
        let scene = self.set_up(request, &pulses);
        let renderer = match self.renderer.take() {
            Some((of, renderer)) if of == scene => renderer,
            _ => {
                scene.validate().map_err(EyeError::Range)?;
                Box::new(Renderer::new(&scene, Level::Fast).map_err(EyeError::View)?)
            }
        };
        let shown = PanelExposure {
            symbols,
            light: renderer.lit(0, pulses.luminance_cd_m2()),
            shift_px: [0.0; 2],
        };
        let Region { width, height, .. } = renderer.sensor();
        self.sensor.resize(width * height, 0);
        let mut canvas = Canvas::new(renderer.lit_region());
        let seed = u64::from(scene.camera.seed);
        renderer.frame(seed, &moment, &[shown], &mut canvas, &mut self.sensor);
        self.renderer = Some((scene, renderer));
        Ok(if request.binned {
            binned(&self.sensor, width)
        } else {
            self.sensor.clone()
        })
    }

    /// The scene with the registers' camera settings and the dimmed light.
    fn set_up(&self, request: &FrameRequest, pulses: &Pulses) -> Scene {
        let mut scene = self.scene.clone();
        let lines_a_row = if request.binned { 2 } else { 1 };
        let rows = request.height * lines_a_row;
        let camera = &mut scene.camera;
        (camera.width_px, camera.height_px) = (request.width * lines_a_row, rows);
        camera.frame_rate_hz = 1e9 / request.frame_nanos;
        camera.black_grey = request.black;
        camera.exposure_max_s = exposure_ns(request) / 1e9;
        // A large bias keeps time and gain at their set limits.
        camera.exposure_bias_ev = 8.0;
        camera.iso_min = ISO_AT_GAIN_1 * request.gain;
        camera.iso_max = camera.iso_min;
        camera.readout_s = (rows - 1) as f64 / lines_a_row as f64 * request.line_nanos / 1e9;
        if let (Some(panel), true) = (scene.panels.first_mut(), pulses.duty() > 0.0) {
            panel.pwm_hz = 1.0 / pulses.period_s;
            panel.luminance_max_cd_m2 = Some(FULL_CD_M2);
            let reflected = scene.ambient.illuminance_lx * panel.reflectance;
            scene.link.l2a = L2a::Ratio((pulses.luminance_cd_m2() / reflected).clamp(0.01, 10.0));
        }
        scene
    }
}

fn exposure_ns(request: &FrameRequest) -> f64 {
    request.exposure_lines * request.line_nanos
}

/// When the first line's exposure starts, in symbols of equal length, and the symbols from there on.
fn moment(request: &FrameRequest) -> Result<(Moment, [PanelFrame; WINDOW]), EyeError> {
    let start_ns = request.ns - exposure_ns(request);
    let end_ns = request.ns + request.height as f64 * request.line_nanos;
    let mut shown = PanelFrame::default();
    let mut changes: Vec<(f64, PanelFrame)> = Vec::new();
    for (ns, digits) in &request.symbols {
        let bits = u64::from_str_radix(digits, 16).map_err(|_| EyeError::Digits(digits.clone()))?;
        let panel = PanelFrame::from_bits(bits);
        if *ns <= start_ns {
            shown = panel;
        } else if *ns < end_ns {
            changes.push(((ns - start_ns) / 1e9, panel));
        }
    }
    let spaced = changes.windows(2).map(|pair| pair[1].0 - pair[0].0);
    let symbol_s = spaced.clone().reduce(f64::max).unwrap_or((end_ns - start_ns) / 1e9);
    let uneven = spaced.clone().any(|length_s| length_s < symbol_s * (1.0 - LENGTH_ERROR_MAX));
    let first_s = changes.first().map_or(symbol_s, |&(after_s, _)| after_s);
    // The first symbol may have been shown for longer than one period.
    let repeats = (first_s / symbol_s).ceil().max(1.0);
    if uneven || repeats as usize + changes.len() > WINDOW {
        return Err(EyeError::Symbols(changes.iter().map(|change| change.0).collect()));
    }
    let mut symbols = [changes.last().map_or(shown, |change| change.1); WINDOW];
    symbols[..repeats as usize].fill(shown);
    for (slot, change) in symbols[repeats as usize..].iter_mut().zip(&changes) {
        *slot = change.1;
    }
    let moment = Moment {
        seed: 0,
        frame: request.number,
        start_s: start_ns / 1e9,
        exposure_s: exposure_ns(request) / 1e9,
        symbol: 0,
        since_change_s: repeats * symbol_s - first_s,
        symbol_s,
        transmitter_rate: 1.0,
    };
    Ok((moment, symbols))
}

/// The rounded means of 2 × 2 pixels.
fn binned(sensor: &[u8], width: usize) -> Vec<u8> {
    let pairs = sensor.chunks_exact(2 * width).flat_map(|two| {
        let (upper, lower) = two.split_at(width);
        upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0)
    });
    let mean = |(upper, lower): (&[u8; 2], &[u8; 2])| {
        let sum: u16 = upper.iter().chain(lower).copied().map(u16::from).sum();
        ((sum + 2) / 4) as u8
    };
    pairs.map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(symbols: &[(f64, &str)], exposure_lines: f64) -> FrameRequest {
        FrameRequest {
            number: 3,
            ns: 1e9,
            width: 162,
            height: 122,
            binned: true,
            line_nanos: 125_333.0,
            frame_nanos: 1e8,
            exposure_lines,
            gain: 1.0,
            black: 8.0,
            symbols: symbols.iter().map(|&(ns, digits)| (ns, digits.to_owned())).collect(),
            pulse: Cycles {
                lit_cycles: 500,
                period_cycles: 2_000,
                low_current: false,
            },
        }
    }

    fn grey_means(exposure_lines: f64, gain: f64) -> (f64, f64) {
        let changes = ["pose.distance_m=1.5".to_owned(), "ambient.illuminance_lx=500".into()];
        let mut eye = Eye::new("hm01b0", &changes).unwrap();
        let lit = [(0.0, "ffffffffffffffff")];
        let mut asked = request(&lit, exposure_lines);
        asked.gain = gain;
        let pixels = eye.see(&asked).unwrap();
        assert_eq!(pixels.len(), 162 * 122);
        let mean = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| {
            let mut sum = 0.0;
            for row in rows.clone() {
                for column in columns.clone() {
                    sum += f64::from(pixels[row * 162 + column]);
                }
            }
            sum / (rows.len() * columns.len()) as f64
        };
        (mean(0..10, 0..162) - 8.0, mean(45..77, 65..97) - 8.0)
    }

    #[test]
    fn light_goes_by_exposure_and_gain() {
        let (dark, panel) = grey_means(10.0, 1.0);
        assert!(dark > 3.0 && panel > 2.0 * dark, "{dark}, {panel}");
        let (twice, _) = grey_means(20.0, 1.0);
        assert!((twice / dark - 2.0).abs() < 0.1, "{dark} {twice}");
        let (gained, _) = grey_means(10.0, 4.0);
        assert!((gained / dark - 4.0).abs() < 0.2, "{dark} {gained}");
    }

    #[test]
    fn lines_see_the_symbol_of_their_own_time() {
        // Half the frame is read before the change, half after it.
        let half_ns = 1e9 + 61.0 * 125_333.0;
        let asked = request(&[(0.0, "ffffffffffffffff"), (half_ns, "0000000000000000")], 2.0);
        let (moment, symbols) = moment(&asked).unwrap();
        let seen = |line: f64| symbols[moment.middle_symbol(line * 125_333e-9)].bits();
        assert_eq!([seen(0.0), seen(60.0), seen(63.0), seen(121.0)], [u64::MAX, u64::MAX, 0, 0]);
    }

    #[test]
    fn symbols_keep_their_times() {
        let lit = |digit: &str| digit.repeat(16);
        let [a, b, c] = ["1", "2", "3"].map(lit);
        // The first has been shown for long, the others follow every 5 ms.
        let asked = request(&[(0.0, &a), (1.007e9, &b), (1.012e9, &c)], 8.0);
        let (moment, symbols) = moment(&asked).unwrap();
        let at = |ns: f64| {
            let from_first_change = (ns - 1e9) / 1e9 + 8.0 * 125_333e-9 + moment.since_change_s;
            symbols[(from_first_change / moment.symbol_s) as usize].bits() & 15
        };
        assert_eq!([at(1.0069e9), at(1.0071e9), at(1.0119e9), at(1.0121e9)], [1, 2, 2, 3]);
    }

    #[test]
    fn more_than_can_be_drawn_is_an_error() {
        let symbols: Vec<(f64, String)> = (0..20).map(|n| (0.98e9 + 2e6 * f64::from(n), "0".repeat(16))).collect();
        let mut asked = request(&[], 8.0);
        asked.symbols = symbols;
        assert!(matches!(moment(&asked), Err(EyeError::Symbols(_))));
        asked.symbols = vec![(0.0, "nothing".into())];
        assert!(matches!(moment(&asked), Err(EyeError::Digits(_))));
    }

    #[test]
    fn a_binned_pixel_is_the_mean_of_four() {
        assert_eq!(binned(&[0, 1, 10, 20, 2, 3, 30, 41], 4), [2, 25]);
    }
}
