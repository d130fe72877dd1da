//! The range of pixels' linear values, and bounds of grey-level changes by changes of light in it.

use std::f64::consts::{PI, SQRT_2};

use super::View;
use crate::air::Air;
use crate::camera::curve::Curve;
use crate::camera::projection::Ellipse;
use crate::scene::{Camera, Psf};

/// The range of a view's linear values, with any effects, and bounds of changes within it.
///
/// It starts with the range of background and LEDs, and each effect widens it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearRange {
    /// The least linear value of a pixel, without noise.
    pub floor: f64,
    /// The greatest linear value of a pixel, without noise. It may be above that of grey 255.
    pub peak: f64,
    /// The greatest linear value that the light of a lamp adds to a pixel: see `effects::flare`.
    pub lamp: f64,
    /// The Gaussian with the steepest possible edges of the image: 0 if the lens blur is left out.
    pub sigma_px: f64,
    /// The greatest number of panels behind each other in a pixel.
    pub layers: usize,
    /// The greatest factor of a pixel on differences between linear values.
    pub pixel_gain: f64,
    /// The greatest negative offset of a pixel.
    pub pixel_offset: f64,
    /// The greatest factor on differences between grey levels after the encoding.
    pub grey_gain: f64,
    /// The curve to grey levels: gamma if the encoding is left out.
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
    /// The range of the plain background and LEDs; the own light of panel k's LEDs is up to `gain(k)` times as bright.
    pub(crate) fn of(view: &View, gain: impl Fn(usize) -> f64) -> Self {
        let radii = view
            .panels
            .iter()
            .flat_map(|panel| &panel.ellipses)
            .map(Ellipse::smaller_half_diameter);
        let mut range = Self {
            floor: f64::INFINITY,
            peak: 0.0,
            lamp: 0.0,
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

    /// Widens the range for the linear value `light`, with or without the air before it.
    pub(crate) fn widen(&mut self, light: f64, air: Air) {
        self.floor = self.floor.min(light * air.transmission);
        self.peak = self.peak.max(light + air.veil);
    }

    /// A bound of the change, in unrounded grey, from moving LEDs by `shift_px` and their rims by another `rim_px`.
    ///
    /// A blurred image between floor and peak changes by at most their difference over σ·√(2π) per pixel of shift, and through the four
    /// sides of a square pixel alone by √2 of it. Moving the rim of a disc of radius a also makes it larger, by at most (1 + rim/a)².
    /// Panels behind each other each contribute, as far as they are visible.
    pub(crate) fn change_by_geometry(&self, shift_px: f64, rim_px: f64) -> f64 {
        self.change_by_geometry_before(shift_px, rim_px, 0.0)
    }

    /// The same before a picture that changes by at most `behind` of the whole range.
    pub(crate) fn change_by_geometry_before(&self, shift_px: f64, rim_px: f64, behind: f64) -> f64 {
        let slope = (1.0 / (self.sigma_px * (2.0 * PI).sqrt())).min(SQRT_2);
        let larger = (1.0 + rim_px / self.smallest_radius_px).powi(2) - 1.0;
        self.change_by_layers(slope * (shift_px + rim_px) + larger + behind)
    }

    /// A bound of the change, in unrounded grey, if the image of a lone panel changes by at most `part` of the whole range.
    pub(crate) fn change_by_layers(&self, part: f64) -> f64 {
        self.change((self.peak - self.floor) * (part * self.layers as f64).min(1.0))
    }

    /// A bound of the change, in unrounded grey, if LEDs' own light deviates by at most the greatest of some relative deviations.
    pub(crate) fn change_by_strays(&self, strays: impl Iterator<Item = f64>) -> f64 {
        self.change((self.peak - self.floor) * strays.fold(0.0, f64::max))
    }

    /// A bound of the change of an unrounded grey level by a change of `linear_change`.
    pub fn change(&self, linear_change: f64) -> f64 {
        let seen = linear_change * self.pixel_gain;
        self.sharpened(self.curve.greatest_change(self.floor, seen))
    }

    /// A bound of the change, in unrounded grey, if all light is scaled by at least `factor` (at most 1).
    pub(crate) fn change_by_factor(&self, factor: f64) -> f64 {
        // A negative offset moves bright light towards the floor, where the curve is steeper.
        if self.pixel_offset > 0.0 {
            return self.change(self.peak * (1.0 - factor.max(0.0)));
        }
        self.sharpened(self.curve.greatest_loss(self.peak, factor))
    }

    /// A bound of the change of an encoded level after all further stages.
    pub fn sharpened(&self, change_grey: f64) -> f64 {
        (change_grey * self.grey_gain).min(255.0)
    }

    /// The whole range of unrounded grey levels.
    pub fn range_grey(&self) -> f64 {
        self.change(self.peak - self.floor)
    }
}
