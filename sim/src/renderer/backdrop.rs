//! The parts of the sensor that no panel lights: computed once, read out frame after frame.

use std::sync::Arc;

use rand::Rng;

use crate::camera::noise::{FlatNoise, PixelNoise, Site};

/// The whole sensor without panels, ready to be read out.
#[derive(Clone, Debug)]
pub enum Backdrop {
    /// One grey level.
    Even(u8),
    /// One linear value under noise.
    EvenNoisy(Box<FlatNoise>),
    /// Grey levels, row by row.
    Picture(Vec<u8>),
    /// Linear values under noise, row by row.
    PictureNoisy(Vec<Site>, Arc<PixelNoise>),
}

impl Backdrop {
    /// The linear values of the whole sensor under noise.
    pub fn noisy(linear: &[f32], noise: Arc<PixelNoise>) -> Self {
        let mut sites = vec![Site::default(); linear.len()];
        noise.sites(linear, &mut sites);
        Self::PictureNoisy(sites, noise)
    }

    /// Reads the whole sensor out.
    pub fn read_out(&self, random: &mut impl Rng, grey: &mut [u8]) {
        match self {
            Self::Even(level) => grey.fill(*level),
            Self::EvenNoisy(noise) => noise.fill(grey, random),
            Self::Picture(picture) => {
                for (grey, &level) in grey.iter_mut().zip(picture) {
                    *grey = level;
                }
            }
            Self::PictureNoisy(sites, noise) => noise.read_sites(sites, random, grey),
        }
    }
}
