//! Lens flare: light of the sun or of a head lamp where it does not belong, as veiling glare over the whole image and as ghosts.
//!
//! The lens forms an image of the lamp from most of its light. It scatters a share s by r with the density s·exp(−r/k)/(2π·k·r), the
//! veiling glare of Seibert, Nalcioglu & Roeck 1984 (Med. Phys. 11:172): k is the mean distance, and the whole plane receives s. Each
//! ghost is light that two surfaces of reflectance R reflect: R² of the lamp's, as an even image of the aperture. In the paraxial
//! approximation its place is proportional to the lamp's offset from the centre, and its size is constant (Lee & Eisemann 2013, Comput.
//! Graph. Forum 32(4):1).
//!
//! The lens scatters a plain background's light, too, but each pixel receives as much as it loses. The panels' own scattered light is
//! left out.

use std::f64::consts::PI;

use glam::DVec2;

use super::{About, Effect};
use crate::formation::{Formation, RowStage};
use crate::view::{LinearRange, View};

/// The ghosts: offset from the centre on the other side, over the lamp's offset; radius, over half the sensor's diagonal.
const GHOSTS: [[f64; 2]; 4] = [[0.3, 0.03], [0.6, 0.1], [1.0, 0.05], [1.4, 0.15]];

/// See the [module](self).
pub(super) struct Flare;

impl Effect for Flare {
    fn about(&self) -> About {
        About {
            name: "flare",
            model: "the sun or a lamp: its image, veiling glare exp(-r/k)/r (Seibert et al. 1984), and ghosts opposite to it \
                    (Lee & Eisemann 2013)",
            keys: &[
                "ambient.lamp_lx",
                "ambient.lamp_x_deg",
                "ambient.lamp_y_deg",
                "ambient.lamp_diameter_deg",
                "camera.glare_percent",
                "camera.glare_deg",
                "camera.coating_percent",
            ],
            cost: "an exponential a pixel",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        range.change(LampLight::of(view).greatest(view))
    }

    fn widen(&self, view: &View, range: &mut LinearRange) {
        range.lamp += LampLight::of(view).greatest(view);
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        if view.scene.ambient.lamp_lx > 0.0 {
            formation.row_stages.push(Box::new(LampLight::of(view)));
        }
    }
}

/// The light of a lamp on the sensor, as linear values.
struct LampLight {
    veil: Veil,
    /// The lamp's image, and its ghosts.
    discs: Vec<Disc>,
}

impl LampLight {
    fn of(view: &View) -> Self {
        let (camera, ambient) = (&view.scene.camera, &view.scene.ambient);
        let (focal_px, centre) = (camera.focal_px(), DVec2::from_array(camera.principal_px()));
        let tangent = |degrees: f64| degrees.to_radians().tan();
        let offset = DVec2::new(tangent(ambient.lamp_x_deg), tangent(ambient.lamp_y_deg)) * focal_px;
        // A steradian has focal_px² pixels.
        let light = view.exposure.linear(ambient.lamp_lx) * focal_px * focal_px;
        // The standard deviation of a disc along an axis is half its radius; the lens blurs the lamp, and a pixel averages over its square.
        let radius_px = tangent(ambient.lamp_diameter_deg / 2.0) * focal_px;
        let lamp_px = (radius_px.powi(2) + 4.0 * (camera.blur_sigma_px.powi(2) + 1.0 / 12.0)).sqrt();
        let (scattered, ghost) = (camera.glare_percent / 100.0, (camera.coating_percent / 100.0).powi(2));
        let direct = 1.0 - scattered - ghost * GHOSTS.len() as f64;
        let ghosts = GHOSTS.map(|[opposite, radius]| {
            let rim_px = 1.0 + 2.0 * opposite * lamp_px;
            Disc::new(centre - offset * opposite, radius * centre.length(), rim_px, light * ghost)
        });
        Self {
            veil: Veil::new(centre + offset, lamp_px, tangent(camera.glare_deg) * focal_px, light * scattered),
            discs: [Disc::new(centre + offset, lamp_px, 1.0, light * direct)]
                .into_iter()
                .chain(ghosts)
                .collect(),
        }
    }

    /// A bound of the lamp's light at any pixel: glare falls with the distance, so that it is greatest at the sensor's pixel next to the
    /// lamp, and a disc is brightest in its middle.
    fn greatest(&self, view: &View) -> f64 {
        let [width, height] = [view.scene.camera.width_px, view.scene.camera.height_px].map(|pixels| (pixels - 1) as f64);
        let nearest = |place: DVec2| place.clamp(DVec2::ZERO, DVec2::new(width, height));
        let veil = self.veil.at(nearest(self.veil.lamp));
        let seen = self.discs.iter().filter(|disc| disc.at(nearest(disc.centre)) > 0.0);
        veil + seen.map(|disc| disc.value).sum::<f64>()
    }

    /// Calls `add` with each part of the light in the row of `length` pixels from (`x`, `y`) on, and the pixel's number in the row.
    fn for_each(&self, x: usize, y: usize, length: usize, mut add: impl FnMut(usize, f64)) {
        let place = |i: usize| DVec2::new((x + i) as f64, y as f64);
        for i in 0..length {
            add(i, self.veil.at(place(i)));
        }
        for disc in &self.discs {
            let [first, end] = disc.columns(y as f64).map(|column| (column - x as f64).max(0.0) as usize);
            for i in first..end.min(length) {
                add(i, disc.at(place(i)));
            }
        }
    }
}

/// Veiling glare.
///
/// The glare of a point would be infinite at its own pixel. That of a lamp of radius a is computed as if seen from a before the image, at
/// the distance q = √(r² + a²): exp(−(q − a)/k)/(2π·k·q), whose integral over the plane is also 1.
struct Veil {
    lamp: DVec2,
    softness_px: f64,
    per_px: f64,
    /// The share of the lamp's light over 2π·k.
    strength: f64,
}

impl Veil {
    fn new(lamp: DVec2, softness_px: f64, mean_px: f64, light: f64) -> Self {
        Self {
            lamp,
            softness_px,
            per_px: 1.0 / mean_px,
            strength: light / (2.0 * PI * mean_px),
        }
    }

    fn at(&self, place: DVec2) -> f64 {
        let distance = (place.distance_squared(self.lamp) + self.softness_px * self.softness_px).sqrt();
        self.strength * ((self.softness_px - distance) * self.per_px).exp() / distance
    }
}

/// An evenly lit disc, which becomes dark over its rim.
struct Disc {
    centre: DVec2,
    radius_px: f64,
    rim_px: f64,
    /// Its linear value.
    value: f64,
}

impl Disc {
    /// A disc with `light` in all, at least as large as half of its rim.
    fn new(centre: DVec2, radius_px: f64, rim_px: f64, light: f64) -> Self {
        let radius_px = radius_px.max(rim_px / 2.0);
        // The integral of the rim's slope over the plane adds π·rim²/12.
        let area = PI * (radius_px * radius_px + rim_px * rim_px / 12.0);
        Self {
            centre,
            radius_px,
            rim_px,
            value: light / area,
        }
    }

    fn at(&self, place: DVec2) -> f64 {
        let inside_px = self.radius_px - place.distance(self.centre);
        self.value * (inside_px / self.rim_px + 0.5).clamp(0.0, 1.0)
    }

    /// Its first column in a row, and the one after its last.
    fn columns(&self, row: f64) -> [f64; 2] {
        let reach = self.radius_px + self.rim_px / 2.0;
        let half = (reach * reach - (row - self.centre.y).powi(2)).max(0.0).sqrt();
        [(self.centre.x - half).floor(), (self.centre.x + half).floor() + 1.0]
    }
}

impl RowStage for LampLight {
    fn apply(&self, x: usize, y: usize, row: &mut [f32]) {
        self.for_each(x, y, row.len(), |i, light| row[i] += light as f32);
    }

    fn apply_exact(&self, x: usize, y: usize, row: &mut [f64]) {
        self.for_each(x, y, row.len(), |i, light| row[i] += light);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// A camera of few pixels, 250 px in the focal length, whose middle is between four of them.
    const SMALL: [&str; 8] = [
        "camera.width_px=324",
        "camera.height_px=244",
        "camera.focal_length_mm=5",
        "camera.pixel_pitch_um=20",
        "pose.distance_m=3",
        "camera.glare_deg=1",
        "ambient.lamp_lx=1000",
        "ambient.lamp_diameter_deg=1",
    ];

    fn view(settings: &[&str]) -> View {
        let settings = SMALL.iter().chain(settings).map(|set| set.to_string());
        View::new(&Scene::load("paper", &settings.collect::<Vec<_>>()).unwrap()).unwrap()
    }

    /// The lamp's light on the whole sensor, row by row.
    fn image(settings: &[&str]) -> Vec<f64> {
        let light = LampLight::of(&view(settings));
        let mut image = vec![0.0; 324 * 244];
        for (y, row) in image.chunks_exact_mut(324).enumerate() {
            light.apply_exact(0, y, row);
        }
        image
    }

    fn sum(values: &[f64]) -> f64 {
        values.iter().sum()
    }

    /// Places from the middle, and their values.
    fn places(image: &[f64]) -> impl Iterator<Item = (DVec2, f64)> {
        let place = |i: usize| DVec2::new((i % 324) as f64 - 161.5, (i / 324) as f64 - 121.5);
        image.iter().enumerate().map(move |(i, &value)| (place(i), value))
    }

    #[test]
    fn the_lamp_s_light_is_divided_into_image_glare_and_ghosts() {
        let view = view(&[]);
        let whole = view.exposure.linear(1000.0) * 250.0 * 250.0;
        // Its place is between pixels, and on one of them.
        for [x, y] in [[0.0, 0.0], [2.5, 0.5]].map(|px: [f64; 2]| px.map(|px| (px / 250.0).atan().to_degrees())) {
            let [x, y] = [format!("ambient.lamp_x_deg={x}"), format!("ambient.lamp_y_deg={y}")];
            let of = |glare: &str, coating: &str| image(&[&x, &y, glare, coating]);
            let parts = [
                ("camera.glare_percent=0", "camera.coating_percent=0"),
                ("camera.glare_percent=20", "camera.coating_percent=5"),
            ];
            let [bare, all] = parts.map(|(glare, coating)| sum(&of(glare, coating)) / whole);
            assert!((bare - 1.0).abs() < 0.01 && (all / bare - 1.0).abs() < 0.003, "{bare} {all}");
            let veil = LampLight::of(&self::view(&[&x, &y, "camera.glare_percent=20"])).veil;
            let veil = (0..324 * 244).map(|i| veil.at(DVec2::new((i % 324) as f64, (i / 324) as f64)));
            let share = veil.sum::<f64>() / whole;
            assert!((share / 0.2 - 1.0).abs() < 1e-3, "{share}");
        }
    }

    #[test]
    fn glare_of_a_point_at_pixels_centres_loses_or_diverges() {
        // The sum of exp(−r/k)/(2π·k·r) over pixels, whose integral is 1.
        let share = |offset: f64| {
            let k = 1f64.to_radians().tan() * 250.0;
            let pixels = (-200..200).flat_map(|y| (-200..200).map(move |x| DVec2::new(x.into(), y.into()) + offset));
            let glare = pixels.map(|place| (-place.length() / k).exp() / (2.0 * PI * k * place.length()));
            glare.sum::<f64>()
        };
        assert!(share(0.0).is_infinite());
        assert!(share(0.5) < 0.96, "{}", share(0.5));
    }

    #[test]
    fn the_image_is_linear_in_the_lamp_s_light_and_mirrored_with_its_place() {
        let right = image(&["ambient.lamp_x_deg=12", "ambient.lamp_y_deg=5"]);
        let twice = image(&["ambient.lamp_x_deg=12", "ambient.lamp_y_deg=5", "ambient.lamp_lx=2000"]);
        let left = image(&["ambient.lamp_x_deg=-12", "ambient.lamp_y_deg=5"]);
        assert!(right.iter().zip(&twice).all(|(one, two)| (two / one - 2.0).abs() < 1e-9));
        let mirrored = left.chunks_exact(324).flat_map(|row| row.iter().rev());
        assert!(right.iter().zip(mirrored).all(|(right, left)| (left / right - 1.0).abs() < 1e-9));
    }

    #[test]
    fn ghosts_are_opposite_to_the_lamp_with_the_square_of_the_reflectance() {
        let lamp = DVec2::new(60.0, 30.0);
        let [x, y] = lamp.to_array().map(|px: f64| (px / 250.0).atan().to_degrees());
        let [x, y] = [format!("ambient.lamp_x_deg={x}"), format!("ambient.lamp_y_deg={y}")];
        let image = image(&[&x, &y, "camera.glare_percent=0", "camera.coating_percent=2"]);
        let across: Vec<_> = places(&image).filter(|(place, _)| place.dot(lamp) < 0.0).collect();
        let light: f64 = across.iter().map(|(_, value)| value).sum();
        assert!((light / sum(&image) / (4.0 * 0.02f64.powi(2)) - 1.0).abs() < 0.01, "{light}");
        // All have the same light, so that their centre is at the mean of 0.3, 0.6, 1 and 1.4 of the lamp's offset.
        let centre = across.iter().map(|&(place, value)| place * value).sum::<DVec2>() / light;
        assert!((centre + lamp * 0.825).length() < 0.1, "{centre}");
    }

    #[test]
    fn a_part_of_a_row_is_that_part_of_the_whole_row() {
        let light = LampLight::of(&view(&["ambient.lamp_x_deg=12", "ambient.lamp_y_deg=0"]));
        let (mut whole, mut part) = ([0f64; 324], [0f32; 40]);
        light.apply_exact(0, 122, &mut whole);
        light.apply(90, 122, &mut part);
        for (part, whole) in part.iter().zip(&whole[90..]) {
            assert!((f64::from(*part) / whole - 1.0).abs() < 1e-6);
        }
    }
}
