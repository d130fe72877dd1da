//! A scene with all that effects need to know of it worked out once.

use std::path::Path;

use glam::DVec2;
use link::panel::{LEDS, SIDE};

use crate::air::Air;
use crate::effects;
use crate::exposure::{self, Exposure, LedLight};
use crate::grey;
use crate::l2a::{self, L2aError};
use crate::layout;
use crate::projection::{Ellipse, Projection};
use crate::recipe::Recipe;
use crate::scene::{Mode, Panel, Pose, Scene};

/// Why a valid scene cannot be seen.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// An LED is behind the camera, or as good as beside it.
    #[error(
        "panel {panel} reaches to {depth_m} m before the camera: all of it must be at least {DEPTH_MIN_M} m in front; raise pose.distance_m or turn it less"
    )]
    Behind {
        /// Index of the panel.
        panel: usize,
        /// Depth of its nearest corner.
        depth_m: f64,
    },
    /// The panel's image is not whole on the sensor.
    #[error(
        "panel {panel} spans columns {left:.1} to {right:.1} and rows {top:.1} to {bottom:.1} px: the sensor has {width} × {height}; move it nearer to the axis or farther away"
    )]
    OffSensor {
        /// Index of the panel.
        panel: usize,
        /// Its leftmost point.
        left: f64,
        /// Its rightmost point.
        right: f64,
        /// Its topmost point.
        top: f64,
        /// Its lowest point.
        bottom: f64,
        /// Columns of the sensor.
        width: usize,
        /// Rows of the sensor.
        height: usize,
    },
    /// The lens formula does not hold where the panel is.
    #[error(
        "panel {panel} reaches {radius:.3} focal lengths from the axis, where camera.distortion_k1 = {k1} folds the image over: with it, up to {most:.3} make sense; bring k1 nearer to 0, or the panel to the axis"
    )]
    Folded {
        /// Index of the panel.
        panel: usize,
        /// The radius its farthest point is imaged at without distortion, in focal lengths.
        radius: f64,
        /// The distortion.
        k1: f64,
        /// The radius from which on the formula does not hold.
        most: f64,
    },
    /// The panel's LEDs are too close together in the image.
    #[error(
        "panel {panel}: its LEDs are {pitch_px:.2} px apart in the image, at least {PITCH_MIN_PX} px are needed; lower pose.distance_m or raise panel.interval"
    )]
    TooSmall {
        /// Index of the panel.
        panel: usize,
        /// Distance of neighbouring LEDs in the image.
        pitch_px: f64,
    },
    /// The L2A table cannot be used.
    #[error(transparent)]
    Table(#[from] L2aError),
    /// The background photograph cannot be used.
    #[error("ambient.background_image {path:?}: {why}; give a PNG, JPEG or PGM file")]
    Background {
        /// The file.
        path: String,
        /// What is wrong.
        why: String,
    },
}

/// Rows and columns, in LEDs, of the corners of a panel's 8 × 8 cells.
pub const BOARD_CORNERS: [(f64, f64); 4] = [(-0.5, -0.5), (-0.5, 7.5), (7.5, 7.5), (7.5, -0.5)];

/// The least depth of any part of a panel.
pub const DEPTH_MIN_M: f64 = 0.1;
/// The least distance of neighbouring LEDs in the image.
pub const PITCH_MIN_PX: f64 = 1.0;

/// One panel as the camera sees it.
#[derive(Clone, Debug)]
pub struct PanelView {
    /// The panel.
    pub panel: Panel,
    /// Its pose.
    pub pose: Pose,
    /// Its projection.
    pub projection: Projection,
    /// The LED-to-ambient ratio it is driven to.
    pub l2a: f64,
    /// Its LEDs, at the panel's own reflectance, without the air between.
    pub light: LedLight,
    /// The exact images of its LEDs.
    pub ellipses: [Ellipse; LEDS],
}

/// A scene worked out: exposure, panels, and the range of linear values that its pixels can take.
#[derive(Clone, Debug)]
pub struct View {
    /// The scene.
    pub scene: Scene,
    /// What the automatic exposure set.
    pub exposure: Exposure,
    /// The panels.
    pub panels: Vec<PanelView>,
    /// The air before each panel, its veil as a linear value.
    pub air: Vec<Air>,
    /// The air before the background, likewise.
    pub background_air: Air,
    /// Linear value of the plain background, without the air before it.
    pub background: f64,
    /// Linear values of the photograph behind the panels, without the air before it, the whole sensor row by row; empty for a
    /// plain background.
    pub photograph: Vec<f32>,
    /// No pixel is darker than this linear value, noise apart.
    pub floor: f64,
    /// No pixel is brighter than this linear value, noise apart. It may be above what is encoded as 255.
    pub peak: f64,
    /// The blur that the image has: 0 where the lens blur is left out.
    pub sigma_px: f64,
}

impl View {
    /// Works a valid scene out.
    ///
    /// # Errors
    /// When a panel is behind the camera, off the sensor or too small, or a file the scene names cannot be used.
    pub fn new(scene: &Scene) -> Result<Self, ViewError> {
        Self::with_reflectances(scene, None)
    }

    /// The same where the first panel's reflectance will be anything in a range: its linear range then holds for all of them.
    ///
    /// # Errors
    /// As [`View::new`].
    pub fn with_reflectances(scene: &Scene, range: Option<[f64; 2]>) -> Result<Self, ViewError> {
        let exposure = Exposure::of(scene);
        let panels = (0..scene.panels.len())
            .map(|index| panel_view(scene, &exposure, index))
            .collect::<Result<Vec<_>, _>>()?;
        let background = exposure.linear(exposure::background_cd_m2(scene));
        let photograph = match &scene.ambient.background_image {
            Some(path) => photograph(scene, Path::new(path), background)?,
            None => Vec::new(),
        };
        let air = |panel: &PanelView| exposure.linear_air(Air::over(scene, panel.pose.distance_m));
        let mut view = Self {
            scene: scene.clone(),
            exposure,
            air: panels.iter().map(air).collect(),
            background_air: exposure.linear_air(Air::before_background(scene)),
            background,
            panels,
            photograph,
            floor: 0.0,
            peak: 0.0,
            sigma_px: scene.camera.blur_sigma_px,
        };
        (view.floor, view.peak) = linear_range(&view, range);
        if !effects::is_included(&effects::blur::LensBlur, &view) {
            view.sigma_px = 0.0;
        }
        Ok(view)
    }

    /// The most, in unrounded grey, that moving LEDs by `shift_px` and their rims by another `rim_px` can change.
    ///
    /// An image between floor and peak that has been blurred changes by at most their difference over σ·√(2π) a pixel of
    /// shift, and through the four sides of a square pixel alone by √2 of it. Moving the rim of a disc of radius a also makes
    /// it larger, by at most (1 + rim/a)².
    pub fn change_by_geometry(&self, shift_px: f64, rim_px: f64) -> f64 {
        let slope = (1.0 / (self.sigma_px * (2.0 * std::f64::consts::PI).sqrt()))
            .min(std::f64::consts::SQRT_2);
        let larger = (1.0 + rim_px / self.smallest_radius_px()).powi(2) - 1.0;
        self.change((self.peak - self.floor) * (slope * (shift_px + rim_px) + larger))
    }

    /// The smallest half-diameter of any LED's image.
    fn smallest_radius_px(&self) -> f64 {
        let radii = self
            .panels
            .iter()
            .flat_map(|panel| &panel.ellipses)
            .map(Ellipse::smaller_half_diameter);
        radii.fold(f64::INFINITY, f64::min)
    }

    /// The most that a change of `linear_change` can move an unrounded grey level of this scene.
    pub fn change(&self, linear_change: f64) -> f64 {
        grey::greatest_change(self.floor, linear_change, self.scene.camera.gamma)
    }

    /// The most, in unrounded grey, that scaling all light by a factor of at least `factor` (at most 1) can change.
    pub fn change_by_factor(&self, factor: f64) -> f64 {
        grey::unrounded(self.peak, self.scene.camera.gamma)
            * (1.0 - factor.max(0.0).powf(1.0 / self.scene.camera.gamma))
    }

    /// The whole range of unrounded grey levels.
    pub fn range_grey(&self) -> f64 {
        self.change(self.peak - self.floor)
    }
}

fn panel_view(scene: &Scene, exposure: &Exposure, index: usize) -> Result<PanelView, ViewError> {
    let (panel, pose) = (scene.panels[index].clone(), scene.pose_of(index).clone());
    let projection = Projection::new(&scene.camera, &panel, &pose);
    let corners = BOARD_CORNERS.map(|(row, column)| projection.led_m(row, column));
    let depth_m = corners
        .iter()
        .map(|&c| projection.depth_m(c))
        .fold(f64::INFINITY, f64::min);
    if depth_m < DEPTH_MIN_M {
        return Err(ViewError::Behind {
            panel: index,
            depth_m,
        });
    }
    let l2a = l2a::of_panel(scene, &panel)?;
    let light = exposure.led_light(scene, &panel, panel.reflectance, l2a);
    let ellipses = std::array::from_fn(|led| {
        projection.ellipse(projection.led_m((led / SIDE) as f64, (led % SIDE) as f64))
    });
    let view = PanelView {
        panel,
        pose,
        projection,
        l2a,
        light,
        ellipses,
    };
    check_place(scene, index, &view)?;
    Ok(view)
}

/// That the panel is whole on the sensor and large enough, as the lens images it.
fn check_place(scene: &Scene, index: usize, panel: &PanelView) -> Result<(), ViewError> {
    let camera = &scene.camera;
    let mut lens = Recipe::plain(scene.panels.len());
    lens.exact_perspective = true;
    if scene.effects.mode(effects::distortion::NAME) != Mode::Off {
        lens.distortion_k1 = camera.distortion_k1;
    }
    let place = |(row, column)| {
        layout::place(
            camera,
            panel,
            &lens,
            0.0,
            panel.projection.led_m(row, column),
        )
    };
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for at in rim() {
        let radius = panel.projection.pixel(panel.projection.led_m(at.0, at.1));
        let radius = (radius - DVec2::from_array(camera.principal_px())).length();
        let radius = radius / camera.focal_px();
        // Where ρ·(1 + k₁·ρ²) no longer rises, the formula folds the image over: no lens does.
        if 1.0 + 3.0 * lens.distortion_k1 * radius * radius <= 0.0 {
            return Err(ViewError::Folded {
                panel: index,
                radius,
                k1: lens.distortion_k1,
                most: (-3.0 * lens.distortion_k1).sqrt().recip(),
            });
        }
        let pixel = place(at);
        (low, high) = (low.min(pixel), high.max(pixel));
    }
    let (width, height) = (camera.width_px, camera.height_px);
    // A rim of two pixels is left for the gradient and for a shift of less than one pixel.
    if low.min_element() < 2.0 || high.x > width as f64 - 3.0 || high.y > height as f64 - 3.0 {
        return Err(ViewError::OffSensor {
            panel: index,
            left: low.x,
            right: high.x,
            top: low.y,
            bottom: high.y,
            width,
            height,
        });
    }
    let corners = BOARD_CORNERS.map(place);
    let pitch_px = (corners[1] - corners[0])
        .length()
        .min((corners[3] - corners[0]).length())
        / SIDE as f64;
    if pitch_px < PITCH_MIN_PX {
        return Err(ViewError::TooSmall {
            panel: index,
            pitch_px,
        });
    }
    Ok(())
}

/// Rows and columns, in LEDs, of points around a panel's 8 × 8 cells: a lens bends its edges outwards or inwards.
fn rim() -> impl Iterator<Item = (f64, f64)> {
    let (first, last) = (BOARD_CORNERS[0].0, BOARD_CORNERS[2].0);
    (0..=SIDE).flat_map(move |step| {
        let at = first + step as f64;
        [(first, at), (last, at), (at, first), (at, last)]
    })
}

/// The photograph on the whole sensor, its mean linear value that of the plain background.
fn photograph(scene: &Scene, path: &Path, mean: f64) -> Result<Vec<f32>, ViewError> {
    let fault = |why: String| ViewError::Background {
        path: path.display().to_string(),
        why,
    };
    let picture = image::open(path)
        .map_err(|error| fault(error.to_string()))?
        .into_luma8();
    if picture.width() == 0 || picture.height() == 0 {
        return Err(fault("it has no pixels".into()));
    }
    let (width, height) = (scene.camera.width_px as u32, scene.camera.height_px as u32);
    let fitted = image::imageops::resize(
        &picture,
        width,
        height,
        image::imageops::FilterType::Triangle,
    );
    let table: Vec<f64> = (0..256)
        .map(|level| grey::linear(f64::from(level), scene.camera.gamma))
        .collect();
    let sum: f64 = fitted
        .as_raw()
        .iter()
        .map(|&level| table[usize::from(level)])
        .sum();
    let pixels = fitted.as_raw().len() as f64;
    if sum <= 0.0 {
        return Err(fault("it is black all over".into()));
    }
    let scale = mean * pixels / sum;
    Ok(fitted
        .as_raw()
        .iter()
        .map(|&level| (table[usize::from(level)] * scale) as f32)
        .collect())
}

/// The darkest and the brightest linear value of any pixel, whichever effects are simulated.
fn linear_range(view: &View, reflectances: Option<[f64; 2]>) -> (f64, f64) {
    let (scene, exposure) = (&view.scene, &view.exposure);
    let (mut floor, mut peak) = (f64::INFINITY, 0.0f64);
    let mut seen = |light: f64, air: Air| {
        floor = floor.min(light * air.transmission);
        peak = peak.max(light + air.veil);
    };
    seen(view.background, view.background_air);
    for &value in &view.photograph {
        seen(value.into(), view.background_air);
    }
    for (index, (panel, &air)) in view.panels.iter().zip(&view.air).enumerate() {
        let stray = effects::pwm::stray(scene, exposure, panel)
            .max(effects::scanning::stray(exposure, panel));
        let gain = (1.0 + stray) * effects::led_spread::greatest_gain(&panel.panel, index);
        let range = reflectances.filter(|_| index == 0).into_iter().flatten();
        for reflectance in range.chain([panel.panel.reflectance]) {
            let light = exposure.led_light(scene, &panel.panel, reflectance, panel.l2a);
            seen(light.off, air);
            seen(light.off + (light.on - light.off) * gain, air);
        }
        if let Some(reflectance) = panel.panel.board_reflectance {
            seen(effects::board::linear(view, reflectance), air);
        }
    }
    if scene.camera.vignetting {
        floor *= effects::vignetting::corner_gain(scene);
    }
    (floor, peak)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(overrides: &[&str]) -> Result<View, ViewError> {
        let overrides: Vec<String> = overrides.iter().map(|set| set.to_string()).collect();
        View::new(&Scene::load("paper", &overrides).unwrap())
    }

    #[test]
    fn a_panel_must_be_on_the_sensor_as_the_lens_images_it() {
        let near_the_edge = ["pose.x_m=12.6", "camera.focal_length_mm=25"];
        let with = |extra: &[&str]| view(&[&near_the_edge[..], extra].concat());
        assert!(with(&[]).is_ok());
        // A pincushion moves it outwards, a barrel inwards.
        let outwards = with(&["camera.distortion_k1=0.4"]);
        assert!(
            matches!(outwards, Err(ViewError::OffSensor { .. })),
            "{outwards:?}"
        );
        assert!(with(&["camera.distortion_k1=-0.4"]).is_ok());
        assert!(with(&["camera.distortion_k1=0.4", "effects.distortion=off"]).is_ok());
        assert!(view(&["pose.x_m=13.3"]).is_err());
        assert!(view(&["pose.x_m=13.3", "camera.distortion_k1=-0.4"]).is_ok());
    }

    #[test]
    fn a_lens_does_not_fold_the_image() {
        // 8 mm from the axis at a focal length of 4 mm: the formula would bring the panel back to the middle.
        let folded = view(&[
            "camera.focal_length_mm=4",
            "camera.distortion_k1=-0.5",
            "pose.distance_m=8",
            "pose.x_m=11",
        ]);
        assert!(
            matches!(folded, Err(ViewError::Folded { .. })),
            "{folded:?}"
        );
    }
}
