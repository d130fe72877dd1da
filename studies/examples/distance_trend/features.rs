//! AGR and GRI of each cell by their definitions.

use super::drawing::Scene;
use super::reading::{Cells, Interpretation};

/// (AGR, GRI) of the 64 cells.
pub fn measure(reading: &Interpretation, scene: &Scene, grey: &[f64]) -> [[f64; 2]; 64] {
    let (start, width) = cells(reading.cells, scene);
    let cell_of = |x: usize, y: usize| {
        let place = [x as f64 - start[0], y as f64 - start[1]].map(|place| (place / width).floor());
        let inside = place.iter().all(|place| (0.0..8.0).contains(place));
        inside.then(|| (place[1] * 8.0 + place[0]) as usize)
    };
    let (mut pixels, mut sums, mut radial) = ([0.0; 64], [0.0; 64], [0.0; 64]);
    let side = scene.side;
    for y in 1..side - 1 {
        for x in 1..side - 1 {
            let Some(cell) = cell_of(x, y) else { continue };
            // If the gradient stops at the cell's border, a pixel outside counts as equal to the pixel itself.
            let at = |nx: usize, ny: usize| {
                let own = reading.gradient_within_cell && cell_of(nx, ny) != Some(cell);
                if own { grey[y * side + x] } else { grey[ny * side + nx] }
            };
            let gradient = [at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1)];
            let centre = [
                start[0] + ((cell % 8) as f64 + 0.5) * width,
                start[1] + ((cell / 8) as f64 + 0.5) * width,
            ];
            let inward = [centre[0] - x as f64, centre[1] - y as f64];
            let length = inward[0].hypot(inward[1]);
            pixels[cell] += 1.0;
            sums[cell] += grey[y * side + x];
            if length > 0.0 {
                radial[cell] += (gradient[0] * inward[0] + gradient[1] * inward[1]) / length;
            }
        }
    }
    let panel = sums.iter().sum::<f64>() / pixels.iter().sum::<f64>();
    std::array::from_fn(|cell| {
        let n = f64::max(pixels[cell], 1.0);
        [sums[cell] / n / panel, radial[cell] / n]
    })
}

/// The corner and the width of the first cell.
fn cells(cells: Cells, scene: &Scene) -> ([f64; 2], f64) {
    let pitch = scene.pitch_px;
    let whole = match cells {
        Cells::Pitches => 8.0 * pitch,
        Cells::Discs => 7.0 * pitch + 2.0 * scene.radius_px,
        Cells::Border => 9.0 * pitch,
    };
    let corner = scene.first_px.map(|first| first + 3.5 * pitch - whole / 2.0);
    (corner, whole / 8.0)
}
