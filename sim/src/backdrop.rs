//! What the sensor sees where no panel lights it: worked out once, read out frame after frame.

use std::sync::Arc;

use rand::Rng;

use crate::grey::Encoder;
use crate::noise::{FlatNoise, Noise, PixelNoise, Site};

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
    /// One linear value everywhere.
    pub fn even(linear: f64, encoder: &Encoder, noise: Option<&Noise>) -> Self {
        match noise {
            None => Self::Even(encoder.grey(linear as f32)),
            Some(noise) => Self::EvenNoisy(Box::new(FlatNoise::new(noise, linear))),
        }
    }

    /// The linear values of the whole sensor.
    pub fn picture(linear: &[f32], encoder: &Encoder, noise: Option<Arc<PixelNoise>>) -> Self {
        match noise {
            None => {
                let mut grey = vec![0; linear.len()];
                encoder.encode(linear, &mut grey);
                Self::Picture(grey)
            }
            Some(noise) => {
                let mut sites = vec![Site::default(); linear.len()];
                noise.sites(linear, &mut sites);
                Self::PictureNoisy(sites, noise)
            }
        }
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
