//! Converts drawn linear values to a camera's grey levels.

use std::sync::Arc;

use fearless_simd::dispatch;
use rand::Rng;

use super::PanelExposure;
use super::Renderer;
use super::backdrop::Backdrop;
use super::canvas::{Canvas, Region};
use crate::camera::clock::Moment;
use crate::camera::noise::{FlatNoise, PixelNoise};
use crate::random::{Purpose, stream};

impl Renderer {
    /// Reads a drawn canvas out as grey levels, row by row, with the sensor's noise for that seed and frame.
    pub fn read_out(&self, seed: u64, frame: u64, canvas: &Canvas<f32>, grey: &mut [u8]) {
        let mut random = stream(seed, frame, Purpose::Noise);
        self.read_pixels(canvas.values(), &mut random, grey);
        self.process(canvas.region().width, grey);
    }

    /// As [`Self::read_out`], for a canvas in double precision, by the exact formula.
    pub fn read_out_exact(&self, seed: u64, frame: u64, canvas: &Canvas<f64>, grey: &mut [u8]) {
        if self.formation.noise.is_none() {
            for (grey, &linear) in grey.iter_mut().zip(canvas.values()) {
                *grey = self.formation.curve.unrounded(linear).round() as u8;
            }
            self.process(canvas.region().width, grey);
            return;
        }
        let linear: Vec<f32> = canvas.values().iter().map(|&linear| linear as f32).collect();
        self.read_pixels(&linear, &mut stream(seed, frame, Purpose::Noise), grey);
        self.process(canvas.region().width, grey);
    }

    /// Applies the camera's processing of encoded levels, row by row: sharpening, compression.
    pub fn process(&self, width: usize, grey: &mut [u8]) {
        for stage in &self.formation.grey_stages {
            stage.apply(width, grey);
        }
    }

    /// Renders the whole sensor into `grey` (one byte a pixel, row by row), with `canvas`, which covers [`Renderer::lit_region`], for the
    /// drawn part.
    pub fn frame(&self, seed: u64, moment: &Moment, shown: &[PanelExposure], canvas: &mut Canvas<f32>, grey: &mut [u8]) {
        self.draw(moment, shown, canvas);
        let Region { x, y, width, height } = canvas.region();
        let sensor = self.sensor();
        if width < sensor.width || height < sensor.height {
            let mut random = stream(seed, moment.frame, Purpose::Background);
            self.backdrop.get_or_init(|| Arc::new(self.backdrop())).read_out(&mut random, grey);
        }
        let mut random = stream(seed, moment.frame, Purpose::Noise);
        for (values, row) in canvas.values().chunks_exact(width).zip(grey.chunks_exact_mut(sensor.width).skip(y)) {
            self.read_pixels(values, &mut random, &mut row[x..x + width]);
        }
        self.process(sensor.width, grey);
    }

    /// Reads pixels out one after another.
    fn read_pixels(&self, linear: &[f32], random: &mut impl Rng, grey: &mut [u8]) {
        match self.pixel_noise() {
            None => {
                dispatch!(fearless_simd::Level::new(), _simd => self.encoder.encode(linear, grey));
            }
            Some(noise) => noise.read(linear, random, grey),
        }
    }

    /// The noise of the drawn pixels, if noise is simulated.
    pub fn pixel_noise(&self) -> Option<&Arc<PixelNoise>> {
        let noise = self.formation.noise.as_ref()?;
        Some(self.pixel_noise.get_or_init(|| Arc::new(PixelNoise::new(noise))))
    }

    /// The sensor without panels.
    fn backdrop(&self) -> Backdrop {
        if self.photograph().is_none() && self.formation.row_stages.is_empty() {
            let plain = self.plain_background();
            return match &self.formation.noise {
                None => Backdrop::Even(self.encoded(&[plain as f32])[0]),
                Some(noise) => Backdrop::EvenNoisy(Box::new(FlatNoise::new(noise, plain))),
            };
        }
        let mut canvas = Canvas::new(self.sensor());
        self.draw_background(&self.still, &mut canvas);
        self.change_rows(&mut canvas);
        match self.pixel_noise() {
            None => Backdrop::Picture(self.encoded(canvas.values())),
            Some(noise) => Backdrop::noisy(canvas.values(), noise.clone()),
        }
    }

    /// Grey levels without noise.
    fn encoded(&self, linear: &[f32]) -> Vec<u8> {
        let mut grey = vec![0; linear.len()];
        self.encoder.encode(linear, &mut grey);
        grey
    }
}
