//! Single frames: the pictures of figures 8, 12, 15 and 18, and the features of the scatter plots in figures 13, 16 and 19.

use link::panel::{LEDS, PanelFrame};
use serde::{Deserialize, Serialize};

use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, Evaluator, Settings};
use rand::Rng;
use sim::accuracy::Level;
use sim::random::{Purpose, stream};
use sim::renderer::Renderer;
use sim::renderer::canvas::{Canvas, Region};
use sim::scene::Scene;
use sim::view::ViewError;

/// A grey picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Grey levels, row by row.
    pub grey: Vec<u8>,
}

/// The cells of the scene's first panel, with the bits of that seed.
///
/// # Errors
/// If the scene cannot be seen.
pub fn panel_picture(scene: &Scene, seed: u64) -> Result<Picture, ViewError> {
    let renderer = Renderer::new(scene, Level::Fine)?;
    let bits = PanelFrame::from_bits(stream(seed, 0, Purpose::Bits).next_u64());
    Ok(picture(&renderer, bits, seed, renderer.cells_region(0)))
}

/// The luminance of the LED of figure 8: the highest of Table 1.
pub const PAIR_LUMINANCE_CD_M2: f64 = 8000.0;
/// The conditions of figure 8 with a typical illuminance for each.
pub const DAYLIGHT: [(&str, f64); 5] = [
    ("direct strong sunlight", 100_000.0),
    ("direct mild sunlight", 40_000.0),
    ("indirect sunlight", 12_000.0),
    ("overcast day", 2_000.0),
    ("twilight", 10.0),
];
/// The distance of the two LEDs in figure 8.
const PAIR_DISTANCE_M: f64 = 50.0;
/// The On LED of figure 8; its left neighbour is Off.
const PAIR_ON: usize = 8 * 3 + 4;

/// Two LEDs, the left one Off, the right one On at [`PAIR_LUMINANCE_CD_M2`], in the given ambient light; with the resulting ratio.
///
/// # Errors
/// If the scene cannot be seen.
pub fn pair_picture(scene: &Scene, illuminance_lx: f64) -> Result<(Picture, f64), ViewError> {
    let mut scene = scene.clone();
    scene.ambient.illuminance_lx = illuminance_lx;
    scene.pose.distance_m = PAIR_DISTANCE_M;
    let mut reflectance = 1.0;
    for panel in &mut scene.panels {
        panel.luminance_min_cd_m2 = Some(PAIR_LUMINANCE_CD_M2);
        panel.luminance_max_cd_m2 = Some(PAIR_LUMINANCE_CD_M2);
        reflectance = panel.reflectance;
    }
    let renderer = Renderer::new(&scene, Level::Fine)?;
    let [[left, top], [right, _], ..] = renderer.corner_leds_px(0);
    let pitch = (right - left) / 7.0;
    let (row, column) = ((PAIR_ON / 8) as f64, (PAIR_ON % 8) as f64);
    // The two cells and half a cell around them.
    let region = Region {
        x: (left + (column - 2.0) * pitch).round() as usize,
        y: (top + (row - 1.0) * pitch).round() as usize,
        width: (3.0 * pitch).round() as usize,
        height: (2.0 * pitch).round() as usize,
    };
    let picture = picture(&renderer, PanelFrame::from_bits(1 << PAIR_ON), 0, region);
    Ok((picture, PAIR_LUMINANCE_CD_M2 / (illuminance_lx * reflectance)))
}

fn picture(renderer: &Renderer, bits: PanelFrame, seed: u64, region: Region) -> Picture {
    let shown: Vec<_> = (0..renderer.view().panels.len())
        .map(|panel| renderer.steady(panel, bits))
        .collect();
    let mut canvas = Canvas::<f32>::new(region);
    let mut grey = vec![0; region.width * region.height];
    renderer.draw(&renderer.moment(seed, 0), &shown, &mut canvas);
    renderer.read_out(seed, 0, &canvas, &mut grey);
    Picture {
        width: region.width,
        height: region.height,
        grey,
    }
}

/// The features of one LED in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Feature {
    /// The frame.
    pub frame: u64,
    /// The LED, 8·row + column.
    pub led: usize,
    /// Whether it was On.
    pub on: bool,
    /// Its average greyscale ratio.
    pub agr: f32,
    /// Its gradient radial inwards, in grey levels.
    pub gri: f32,
}

/// The features of all LEDs in the first `frames` random frames of a scene.
///
/// # Errors
/// If the scene cannot be seen or measured.
pub fn scatter(scene: &Scene, frames: u64, seed: u64) -> Result<Vec<Feature>, EvaluateError> {
    let settings = Settings::fast(frames, seed, DetectorChoice::KMeans);
    let evaluator = Evaluator::new(scene, settings)?;
    let mut workspace = evaluator.workspace();
    let mut found = Vec::with_capacity(frames as usize * LEDS);
    for frame in 0..frames {
        let reading = evaluator.observe(frame, &mut workspace)?;
        found.extend((0..LEDS).map(|led| Feature {
            frame,
            led,
            on: reading.bits.led(led),
            agr: reading.features.agr[led],
            gri: reading.features.gri[led],
        }));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_the_light_fades_the_on_led_brightens_and_reaches_over_its_neighbour() {
        let scene = Scene::load("paper", &[]).unwrap();
        let half = |illuminance: f64, right: bool| -> Vec<f64> {
            let (picture, _) = pair_picture(&scene, illuminance).unwrap();
            let is_wanted = |i: &usize| (i % picture.width >= picture.width / 2) == right;
            let pixels = (0..picture.grey.len()).filter(is_wanted);
            pixels.map(|i| f64::from(picture.grey[i])).collect()
        };
        let mean = |levels: Vec<f64>| levels.iter().sum::<f64>() / levels.len() as f64;
        let ratios = DAYLIGHT.map(|(_, lx)| mean(half(lx, true)) / mean(half(lx, false)));
        assert!(ratios.is_sorted(), "{ratios:?}");
        let white = |lx: f64| half(lx, false).iter().filter(|&&grey| grey == 255.0).count();
        assert_eq!(white(DAYLIGHT[0].1), 0);
        assert!(white(DAYLIGHT[4].1) > 0);
    }

    #[test]
    fn a_picture_shows_the_panel_and_a_scatter_all_its_leds() {
        let scene = Scene::load("paper", &[]).unwrap();
        let picture = panel_picture(&scene, 1).unwrap();
        assert_eq!(picture.grey.len(), picture.width * picture.height);
        assert!(picture.grey.iter().max() > Some(&200));
        let features = scatter(&scene, 3, 1).unwrap();
        assert_eq!(features.len(), 3 * LEDS);
        let mean = |on: bool| {
            let of: Vec<f32> = features.iter().filter(|f| f.on == on).map(|f| f.gri).collect();
            of.iter().sum::<f32>() / of.len() as f32
        };
        assert!(mean(true) > mean(false) + 10.0);
    }
}
