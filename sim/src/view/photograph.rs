//! A photograph in the camera's view.

use std::path::Path;
use std::sync::Arc;

use glam::DVec2;
use image::GrayImage;
use image::imageops::{FilterType, resize};

use super::error::ViewError;
use crate::camera::curve::Curve;
use crate::input;
use crate::scene::Scene;

/// A photograph scaled to the sensor, its mean linear value 1. Copies share its memory.
#[derive(Clone, Debug)]
pub struct Photograph {
    relative: Arc<[f32]>,
    range: [f64; 2],
    path: String,
    size_px: [usize; 2],
    curve: Curve,
}

impl Photograph {
    /// The photograph of the scene, if it has one.
    ///
    /// # Errors
    /// If the file is not a picture, or is black.
    pub fn of(scene: &Scene) -> Result<Option<Self>, ViewError> {
        let Some(path) = &scene.ambient.background_image else {
            return Ok(None);
        };
        let fault = |why: String| ViewError::Background { path: path.clone(), why };
        let picture = input::picture(Path::new(path))
            .map_err(|error| fault(error.to_string()))?
            .image
            .into_luma8();
        Self::new(&picture, path, scene).map(Some)
    }

    /// A picture of any size, scaled to the scene's sensor; `path` names it in errors.
    ///
    /// # Errors
    /// If it has no pixels, or is black.
    pub fn new(picture: &GrayImage, path: &str, scene: &Scene) -> Result<Self, ViewError> {
        let fault = |why: &str| ViewError::Background {
            path: path.into(),
            why: why.into(),
        };
        if picture.width() == 0 || picture.height() == 0 {
            return Err(fault("it has no pixels"));
        }
        let size_px = [scene.camera.width_px, scene.camera.height_px];
        let [width, height] = size_px.map(|side| side as u32);
        let fitted = resize(picture, width, height, FilterType::Triangle).into_raw();
        let curve = Curve::of(&scene.camera);
        let table: Vec<f64> = (0..256).map(|level| curve.linear(f64::from(level))).collect();
        let linear = |&level: &u8| table[usize::from(level)];
        let mean = fitted.iter().map(linear).sum::<f64>() / fitted.len() as f64;
        if mean <= 0.0 {
            return Err(fault("it is black all over"));
        }
        let relative: Arc<[f32]> = fitted.iter().map(|level| (linear(level) / mean) as f32).collect();
        let range = [
            relative.iter().copied().fold(f32::INFINITY, f32::min),
            relative.iter().copied().fold(0.0, f32::max),
        ];
        Ok(Self {
            relative,
            range: range.map(f64::from),
            path: path.into(),
            size_px,
            curve,
        })
    }

    /// Whether a scene shows this photograph in the same way.
    pub fn is_of(&self, scene: &Scene) -> bool {
        let camera = &scene.camera;
        scene.ambient.background_image.as_ref() == Some(&self.path)
            && self.size_px == [camera.width_px, camera.height_px]
            && self.curve == Curve::of(camera)
    }

    /// Linear values over their mean, row by row.
    pub fn relative(&self) -> &[f32] {
        &self.relative
    }

    /// The value between pixels, by linear interpolation; beyond the edges the last pixels continue.
    pub fn at(&self, place: DVec2) -> f64 {
        let [width, height] = self.size_px;
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let place = place.clamp(DVec2::ZERO, last);
        let (first, part) = (place.floor(), place - place.floor());
        let [left, top] = [first.x as usize, first.y as usize];
        let [right, below] = [(left + 1).min(width - 1), (top + 1).min(height - 1)];
        let pixel = |x: usize, y: usize| f64::from(self.relative[y * width + x]);
        let row = |y: usize| pixel(left, y) + (pixel(right, y) - pixel(left, y)) * part.x;
        row(top) + (row(below) - row(top)) * part.y
    }

    /// The least and the greatest value.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }
}
