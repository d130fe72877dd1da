//! The linear values that pixels can take, and how far changes of light move grey levels among them.

use std::f64::consts::{PI, SQRT_2};

use super::View;
use crate::air::Air;
use crate::camera::curve::Curve;
use crate::camera::projection::Ellipse;
use crate::scene::{Camera, Psf};

/// The range of a view's linear values, whichever effects are simulated, and what changes within it come to.
///
/// It starts with that of background and LEDs, and each effect widens it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearRange {
    /// No pixel is darker than this linear value, noise apart.
    pub floor: f64,
    /// No pixel is brighter than this linear value, noise apart. It may be above what is encoded as 255.
    pub peak: f64,
    /// The Gaussian whose edges are as steep as any of the image can be: 0 where the lens blur is left out.
    pub sigma_px: f64,
    /// How many panels may lie one behind the other in a pixel.
    pub layers: usize,
    /// How many times as large a pixel may make a difference between linear values.
    pub pixel_gain: f64,
    /// How much darker than it should a pixel may read.
    pub pixel_offset: f64,
    /// How many times as large what follows the encoding may make a difference between grey levels.
    pub grey_gain: f64,
    /// The curve that makes grey levels: gamma where the encoding is left out.
    pub curve: Curve,
    smallest_radius_px: f64,
}

/// The standard deviation of a Gaussian blur whose edges are at least as steep as those of the camera's, along any direction.
///
/// The steepest edge of a disc of deviation s is 1/(π·s), that of a Gaussian 1/(√(2π)·σ). A core of at most 0.8 of the whole
/// deviation leaves 0.6 of it to the disc.
fn sharpest_sigma_px(camera: &Camera) -> f64 {
    let [x, y] = camera.blur_sigmas_px();
    match camera.psf {
        Psf::Gauss => x.min(y),
        Psf::Disc => x.min(y) * 0.6 * (PI / 2.0).sqrt(),
    }
}

impl LinearRange {
    /// The range that the plain background and LEDs span; the own light of panel k's LEDs is `gain(k)` times as bright at most.
    pub(crate) fn of(view: &View, gain: impl Fn(usize) -> f64) -> Self {
        let radii = view
            .panels
            .iter()
            .flat_map(|panel| &panel.ellipses)
            .map(Ellipse::smaller_half_diameter);
        let mut range = Self {
            floor: f64::INFINITY,
            peak: 0.0,
            sigma_px: sharpest_sigma_px(&view.scene.camera),
            layers: view.layers,
            pixel_gain: 1.0,
            pixel_offset: 0.0,
            grey_gain: 1.0,
            curve: Curve::of(&view.scene.camera),
            smallest_radius_px: radii.fold(f64::INFINITY, f64::min),
        };
        range.widen(view.background, view.background_air);
        for (index, (panel, &air)) in view.panels.iter().zip(&view.air).enumerate() {
            let gain = gain(index);
            let first = view.reflectances.filter(|_| index == 0);
            for reflectance in first.into_iter().flatten().chain([panel.panel.reflectance]) {
                let light = view.exposure.led_light(&view.scene, &panel.panel, reflectance, panel.l2a);
                range.widen(light.off, air);
                range.widen(light.off + (light.on - light.off) * gain, air);
            }
        }
        range
    }

    /// Makes room for something of the linear value `light`, with or without the air before it.
    pub(crate) fn widen(&mut self, light: f64, air: Air) {
        self.floor = self.floor.min(light * air.transmission);
        self.peak = self.peak.max(light + air.veil);
    }

    /// The most, in unrounded grey, that moving LEDs by `shift_px` and their rims by another `rim_px` can change.
    ///
    /// An image between floor and peak that has been blurred changes by at most their difference over σ·√(2π) a pixel of
    /// shift, and through the four sides of a square pixel alone by √2 of it. Moving the rim of a disc of radius a also makes
    /// it larger, by at most (1 + rim/a)². Panels one behind the other each do so, as far as they are not hidden.
    pub(crate) fn change_by_geometry(&self, shift_px: f64, rim_px: f64) -> f64 {
        self.change_by_geometry_before(shift_px, rim_px, 0.0)
    }

    /// The same before a picture that changes by at most `behind` of the whole range.
    pub(crate) fn change_by_geometry_before(&self, shift_px: f64, rim_px: f64, behind: f64) -> f64 {
        let slope = (1.0 / (self.sigma_px * (2.0 * PI).sqrt())).min(SQRT_2);
        let larger = (1.0 + rim_px / self.smallest_radius_px).powi(2) - 1.0;
        self.change_by_layers(slope * (shift_px + rim_px) + larger + behind)
    }

    /// The most, in unrounded grey, that can change where the image of a lone panel changes by at most `part` of the whole range.
    pub(crate) fn change_by_layers(&self, part: f64) -> f64 {
        self.change((self.peak - self.floor) * (part * self.layers as f64).min(1.0))
    }

    /// The most, in unrounded grey, that can change where LEDs' own light strays by at most the greatest of some parts of itself.
    pub(crate) fn change_by_strays(&self, strays: impl Iterator<Item = f64>) -> f64 {
        self.change((self.peak - self.floor) * strays.fold(0.0, f64::max))
    }

    /// The most that a change of `linear_change` can move an unrounded grey level.
    pub fn change(&self, linear_change: f64) -> f64 {
        let seen = linear_change * self.pixel_gain;
        self.sharpened(self.curve.greatest_change(self.floor, seen))
    }

    /// The most, in unrounded grey, that scaling all light by a factor of at least `factor` (at most 1) can change.
    pub(crate) fn change_by_factor(&self, factor: f64) -> f64 {
        // Pixels that read too little bring a loss of bright light to the floor, where the curve is steeper.
        if self.pixel_offset > 0.0 {
            return self.change(self.peak * (1.0 - factor.max(0.0)));
        }
        self.sharpened(self.curve.greatest_loss(self.peak, factor))
    }

    /// The most that a change of an encoded level can be after all that follows.
    pub fn sharpened(&self, change_grey: f64) -> f64 {
        (change_grey * self.grey_gain).min(255.0)
    }

    /// The whole range of unrounded grey levels.
    pub fn range_grey(&self) -> f64 {
        self.change(self.peak - self.floor)
    }
}
