//! Two clusters in the plane of two features (Lloyd's algorithm).

use super::{DetectError, bits_where, two_classes};
use link::panel::{LEDS, PanelFrame};

/// Lloyd's algorithm ends when no cell changes sides; 64 cells in two groups have always done so in far fewer rounds.
const MAX_ROUNDS: usize = 32;

/// The cells of the cluster of higher features. `samples` are (AGR, GRI); the clusters start from the cells of lowest and
/// highest GRI, and among equals of lowest and highest AGR.
pub(super) fn split(samples: &[[f32; 2]; LEDS]) -> Result<PanelFrame, DetectError> {
    let by_gri = |a: &usize, b: &usize| {
        let ([agr_a, gri_a], [agr_b, gri_b]) = (samples[*a], samples[*b]);
        gri_a.total_cmp(&gri_b).then(agr_a.total_cmp(&agr_b))
    };
    let (lowest, highest) = (
        (0..LEDS).min_by(by_gri).unwrap_or(0),
        (0..LEDS).max_by(by_gri).unwrap_or(0),
    );
    let (mut off, mut on) = (samples[lowest], samples[highest]);
    let mut bits = two_classes(nearer_to(samples, on, off))?;
    for _ in 0..MAX_ROUNDS {
        (on, off) = centroids(samples, bits);
        let next = two_classes(nearer_to(samples, on, off))?;
        if next == bits {
            break;
        }
        bits = next;
    }
    let brightness = |[agr, gri]: [f32; 2]| agr + gri;
    Ok(if brightness(on) >= brightness(off) {
        bits
    } else {
        PanelFrame::from_bits(!bits.bits())
    })
}

fn nearer_to(samples: &[[f32; 2]; LEDS], on: [f32; 2], off: [f32; 2]) -> PanelFrame {
    let distance =
        |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
    bits_where(|cell| distance(samples[cell], on) < distance(samples[cell], off))
}

/// The means of the cells that are On and Off; both kinds are there.
fn centroids(samples: &[[f32; 2]; LEDS], bits: PanelFrame) -> ([f32; 2], [f32; 2]) {
    let (mut on, mut off) = ([0.0; 2], [0.0; 2]);
    for (cell, sample) in samples.iter().enumerate() {
        let sum = if bits.led(cell) { &mut on } else { &mut off };
        sum[0] += sample[0];
        sum[1] += sample[1];
    }
    let (count_on, count_off) = (
        bits.count_on() as f32,
        (LEDS as u32 - bits.count_on()) as f32,
    );
    (on.map(|sum| sum / count_on), off.map(|sum| sum / count_off))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_settle_where_no_cell_changes_sides() {
        // One outlier as the first centre: the bright group must still be found whole.
        let gri = core::array::from_fn(|cell| match cell {
            0 => 90.0,
            1..20 => 50.0,
            _ => 0.0,
        });
        let samples = gri.map(|gri| [1.0, gri]);
        assert_eq!(split(&samples).unwrap().bits(), (1 << 20) - 1);
    }

    #[test]
    fn equal_cells_are_no_clusters() {
        assert_eq!(
            split(&[[1.0, 2.0]; LEDS]),
            Err(DetectError::OneClass { on: 0 })
        );
    }
}
