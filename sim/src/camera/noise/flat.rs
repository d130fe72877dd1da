//! Grey levels of pixels with one linear value: the plain background.

use rand::Rng;

use super::Noise;
use super::alias::{Builder, Column, Fine};

/// Draws grey levels of pixels of one linear value: 16 random bits a pixel, by Walker's alias method.
#[derive(Clone, Debug)]
pub struct FlatNoise {
    columns: [Column; 256],
    fine: [Fine; 256],
}

/// Pixels per block of random bits.
const BLOCK: usize = 512;

impl FlatNoise {
    /// For pixels of the linear value `linear` under `noise`.
    pub fn new(noise: &Noise, linear: f64) -> Self {
        let (mut columns, mut fine) = ([Column::default(); 256], [0; 256]);
        Builder::default().build(0, &noise.distribution(linear), &mut columns, &mut fine);
        Self { columns, fine }
    }

    /// Fills pixels with grey levels.
    pub fn fill(&self, grey: &mut [u8], random: &mut impl Rng) {
        let mut bytes = [0; 2 * BLOCK];
        for block in grey.chunks_mut(BLOCK) {
            let bytes = &mut bytes[..2 * block.len()];
            random.fill_bytes(bytes);
            for (pixel, bits) in block.iter_mut().zip(bytes.chunks_exact(2)) {
                let index = usize::from(bits[0]);
                let column = self.columns[index];
                *pixel = match column.level(bits[1]) {
                    Some(level) => level,
                    None => column.settle(self.fine[index], random),
                };
            }
        }
    }
}
