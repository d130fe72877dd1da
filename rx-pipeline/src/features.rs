//! The features of a cell: greyscale ratios and the gradient towards the centre.
//!
//! - **AGR**, average greyscale ratio: the cell's mean grey over the panel's.
//! - **GRI**, gradient radial inwards: (1/n)·Σ ∇G·ρ̂ over the cell's n pixels, with ∇G = (G(x+1) − G(x−1), G(y+1) − G(y−1))
//!   in grey levels, taken across the cells' borders too, and ρ̂ the unit vector to the LED's centre (Do & Yoo 2020, Sensors 20, 292).
//! - **NGR**, neighbour greyscale ratio: the cell's mean grey over that of its up to eight neighbours (Do & Yoo 2019,
//!   IEEE Access).

use crate::cells::{CellMap, MAX_WIDTH_PX, MapRow, NO_CELL};
use crate::frame::Frame;
use core::array;
use link::panel::{LEDS, SIDE};

/// The least mean in a ratio (grey): half a level, the error of rounding.
const DARKEST_GREY: f32 = 0.5;

/// The features of the 64 cells of one panel, cell 8·row + column.
///
/// ```
/// use rx_pipeline::{cells::CellMap, corners::Corners, features::Features, frame::Frame};
/// let corners = Corners::new([[5.0, 5.0], [33.0, 5.0], [33.0, 33.0], [5.0, 33.0]])?;
/// let map = CellMap::<2048>::new(&corners, 40, 40)?;
/// let features = Features::measure(&Frame::new(&[118; 1600], 40, 40)?, &map)?;
/// assert_eq!(features.mean_grey[0], 118.0);
/// assert_eq!(features.agr[63], 1.0);
/// assert_eq!(features.gri[63], 0.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Mean grey level of each cell, 0 to 255.
    pub mean_grey: [f32; LEDS],
    /// Mean grey of each cell over [`Features::panel_grey`]; 1 in a panel that is wholly black.
    pub agr: [f32; LEDS],
    /// Gradient radial inwards of each cell, in grey levels; positive if the cell is brightest in its middle.
    pub gri: [f32; LEDS],
    /// Pixels of each cell at grey level 255.
    pub saturated: [u16; LEDS],
    /// Pixels of each cell.
    pub pixels: [u16; LEDS],
    /// Mean grey level over the pixels of all cells, 0 to 255.
    pub panel_grey: f32,
}

/// Why a frame has no features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FeaturesError {
    /// The map holds no cells.
    #[error("the cell map is empty: build it for the panel's pose first")]
    EmptyMap,
    /// The map was made for larger frames.
    #[error(
        "the cells need a frame of at least {needed_width} × {needed_height} pixels, this one has {width} × {height}: \
         build the map for frames of this size"
    )]
    FrameTooSmall {
        /// Columns up to the cells' right rim.
        needed_width: usize,
        /// Rows up to the cells' lower rim.
        needed_height: usize,
        /// The frame's columns.
        width: usize,
        /// The frame's rows.
        height: usize,
    },
}

impl Features {
    /// The features of the panel that `map` describes in `frame`.
    ///
    /// # Errors
    /// [`FeaturesError::EmptyMap`], and [`FeaturesError::FrameTooSmall`] if the map was built for larger frames.
    #[inline(always)]
    pub fn measure<const PIXELS: usize>(frame: &Frame<'_>, map: &CellMap<PIXELS>) -> Result<Self, FeaturesError> {
        let sums = Sums::of(frame, map)?;
        let pixels = *map.pixels();
        let total: u32 = sums.grey.iter().sum();
        let panel_pixels: u32 = pixels.iter().map(|&n| u32::from(n)).sum();
        let panel_grey = total as f32 / panel_pixels as f32;
        let per_pixel = pixels.map(|n| 1.0 / f32::from(n));
        let mean_grey = array::from_fn(|cell| sums.grey[cell] as f32 * per_pixel[cell]);
        let gri = array::from_fn(|cell| sums.radial[cell] * per_pixel[cell]);
        let agr = if total == 0 {
            [1.0; LEDS]
        } else {
            mean_grey.map(|grey| grey / panel_grey)
        };
        Ok(Self {
            mean_grey,
            agr,
            gri,
            saturated: sums.saturated,
            pixels,
            panel_grey,
        })
    }

    /// Neighbour greyscale ratio of each cell: its mean grey over the mean of its up to eight neighbours' means.
    ///
    /// Means below half a grey level count as half a level, so that the ratio is finite in the dark.
    pub fn ngr(&self) -> [f32; LEDS] {
        array::from_fn(|cell| {
            let around = |centre: usize| centre.saturating_sub(1)..(centre + 2).min(SIDE);
            let (row, column) = (cell / SIDE, cell % SIDE);
            let block: f32 = around(row)
                .map(|row| self.mean_grey[SIDE * row..][around(column)].iter().sum::<f32>())
                .sum();
            let neighbours = around(row).len() * around(column).len() - 1;
            let own = self.mean_grey[cell];
            let others = (block - own) / neighbours as f32;
            own.max(DARKEST_GREY) / others.max(DARKEST_GREY)
        })
    }
}

/// Sums over the pixels of each cell.
struct Sums {
    grey: [u32; LEDS],
    saturated: [u16; LEDS],
    radial: [f32; LEDS],
}

impl Sums {
    #[inline(always)]
    fn of<const PIXELS: usize>(frame: &Frame<'_>, map: &CellMap<PIXELS>) -> Result<Self, FeaturesError> {
        let bounds = map.bounds();
        if bounds.width == 0 {
            return Err(FeaturesError::EmptyMap);
        }
        let (width, height) = (frame.width(), frame.height());
        let (needed_width, needed_height) = (bounds.x + bounds.width + 1, bounds.y + bounds.height + 1);
        let too_small = FeaturesError::FrameTooSmall {
            needed_width,
            needed_height,
            width,
            height,
        };
        if width < needed_width || height < needed_height {
            return Err(too_small);
        }
        let mut sums = Self {
            grey: [0; LEDS],
            saturated: [0; LEDS],
            radial: [0.0; LEDS],
        };
        let columns = bounds.x - 1..needed_width;
        let row = |y: usize| frame.row(y).and_then(|row| row.get(columns.clone())).ok_or(too_small);
        let (mut above, mut here) = (row(bounds.y - 1)?, row(bounds.y)?);
        let mut band = Band::new(bounds.width);
        for (y, map_row) in (bounds.y + 1..).zip(map.rows()) {
            let below = row(y)?;
            if !band.continues(&map_row) {
                sums.add(&band);
                band.begin(map_row);
            }
            band.add(above, here, below, &map_row);
            (above, here) = (here, below);
        }
        sums.add(&band);
        Ok(sums)
    }

    /// Adds a band's columns to their cells.
    fn add(&mut self, band: &Band<'_>) {
        let mut start = 0;
        while let (Some(&cell), Some(&length)) = (band.cell.get(start), band.run.get(start)) {
            let end = start + usize::from(length.max(1));
            let (radial, packed) = (&band.radial[start..end], &band.packed[start..end]);
            start = end;
            if cell >= NO_CELL {
                continue;
            }
            let cell = usize::from(cell);
            for (radial, packed) in radial.iter().zip(packed) {
                self.grey[cell] += packed & 0xffff;
                self.saturated[cell] += (packed >> 16) as u16;
                self.radial[cell] += radial;
            }
        }
    }
}

/// The most rows whose greys add up in 16 bits.
const MAX_ROWS: u32 = 255;

/// Successive pixel rows of the same runs of cells, summed column by column: whole rows at a time, independent of the cells' size. In an
/// upright panel that is a row of cells, otherwise a single row of pixels.
struct Band<'a> {
    cell: &'a [u8],
    run: &'a [u8],
    rows: u32,
    width: usize,
    packed: [u32; MAX_WIDTH_PX],
    radial: [f32; MAX_WIDTH_PX],
}

impl<'a> Band<'a> {
    /// A band of no rows.
    fn new(width: usize) -> Self {
        Self {
            cell: &[],
            run: &[],
            rows: 0,
            width,
            packed: [0; MAX_WIDTH_PX],
            radial: [0.0; MAX_WIDTH_PX],
        }
    }

    fn continues(&self, row: &MapRow<'_>) -> bool {
        self.cell == row.cell && self.rows < MAX_ROWS
    }

    fn begin(&mut self, row: MapRow<'a>) {
        (self.cell, self.run, self.rows) = (row.cell, row.run, 0);
        self.packed[..self.width].fill(0);
        self.radial[..self.width].fill(0.0);
    }

    /// Adds a row; the grey rows hold one pixel more on either side.
    #[inline(always)]
    fn add(&mut self, above: &[u8], here: &[u8], below: &[u8], row: &MapRow<'_>) {
        self.rows += 1;
        let radial = &mut self.radial[..self.width];
        add_radial_gradient(above, here, below, row.rho_x, row.rho_y, radial);
        for (packed, &grey) in self.packed[..self.width].iter_mut().zip(&here[1..]) {
            *packed += u32::from(grey) | u32::from(grey == u8::MAX) << 16;
        }
    }
}

/// Adds ∇G·ρ̂ of one row; the grey rows hold one pixel more on either side.
#[inline(always)]
fn add_radial_gradient(above: &[u8], here: &[u8], below: &[u8], rho_x: &[f32], rho_y: &[f32], radial: &mut [f32]) {
    let width = radial.len();
    let (left, right) = (&here[..width], &here[2..][..width]);
    let (above, below) = (&above[1..][..width], &below[1..][..width]);
    let (rho_x, rho_y) = (&rho_x[..width], &rho_y[..width]);
    for x in 0..width {
        let across = i32::from(right[x]) - i32::from(left[x]);
        let down = i32::from(below[x]) - i32::from(above[x]);
        radial[x] += across as f32 * rho_x[x] + down as f32 * rho_y[x];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corners::Corners;
    use properties::prelude::*;

    const WIDTH: usize = 48;
    type Pixels = [u8; WIDTH * WIDTH];

    fn map(x: f32, y: f32, pitch: f32, slant: f32) -> CellMap<2304> {
        let far = 7.0 * pitch;
        let corners = Corners::new([
            [x, y],
            [x + far, y + slant],
            [x + far - slant, y + far],
            [x - slant, y + far - slant],
        ]);
        CellMap::new(&corners.unwrap(), WIDTH, WIDTH).unwrap()
    }

    fn measure(pixels: &Pixels, map: &CellMap<2304>) -> Features {
        Features::measure(&Frame::new(pixels, WIDTH, WIDTH).unwrap(), map).unwrap()
    }

    /// The definitions, word for word, in f64.
    fn by_definition(pixels: &Pixels, map: &CellMap<2304>) -> ([f64; 64], [f64; 64], [u16; 64]) {
        let grey = |x: usize, y: usize| f64::from(pixels[WIDTH * y + x]);
        let (mut means, mut gri, mut saturated) = ([0.0; 64], [0.0; 64], [0; 64]);
        for y in 1..WIDTH - 1 {
            for x in 1..WIDTH - 1 {
                let Some(cell) = map.cell(x, y) else { continue };
                let n = map.pixels_of_cell(cell) as f64;
                let [rx, ry] = map.rho(x, y).map(f64::from);
                means[cell] += grey(x, y) / n;
                gri[cell] += ((grey(x + 1, y) - grey(x - 1, y)) * rx + (grey(x, y + 1) - grey(x, y - 1)) * ry) / n;
                saturated[cell] += u16::from(grey(x, y) == 255.0);
            }
        }
        (means, gri, saturated)
    }

    #[test]
    fn a_bright_middle_gives_a_positive_gradient() {
        let map = map(8.0, 8.0, 4.0, 0.0);
        let mut pixels = [100; WIDTH * WIDTH];
        pixels[WIDTH * 12 + 12] = 200;
        let features = measure(&pixels, &map);
        // The four neighbours of LED 9's centre each see a rise of 100 towards it.
        approx::assert_abs_diff_eq!(features.gri[9], 400.0 / 16.0, epsilon = 1e-4);
        approx::assert_abs_diff_eq!(features.mean_grey[9], 100.0 + 100.0 / 16.0, epsilon = 1e-4);
        assert_eq!(features.gri[0], 0.0);
        let ngr = features.ngr();
        approx::assert_abs_diff_eq!(ngr[9], 1.0625, epsilon = 1e-5);
        approx::assert_abs_diff_eq!(ngr[0], 300.0 / 306.25, epsilon = 1e-5);
        assert_eq!(ngr[63], 1.0);
    }

    #[test]
    fn black_and_white_panels_have_features() {
        let map = map(8.0, 8.0, 4.0, 0.0);
        let black = measure(&[0; WIDTH * WIDTH], &map);
        assert_eq!((black.agr, black.ngr(), black.panel_grey), ([1.0; 64], [1.0; 64], 0.0));
        let white = measure(&[255; WIDTH * WIDTH], &map);
        assert_eq!((white.saturated, white.pixels), ([16; 64], [16; 64]));
    }

    #[test]
    fn frames_the_map_was_not_built_for_are_refused() {
        let empty = CellMap::<16>::empty();
        let frame = Frame::new(&[0; 100], 10, 10).unwrap();
        assert_eq!(Features::measure(&frame, &empty), Err(FeaturesError::EmptyMap));
        let error = Features::measure(&frame, &map(8.0, 8.0, 4.0, 0.0)).unwrap_err();
        let needed = FeaturesError::FrameTooSmall {
            needed_width: 40,
            needed_height: 40,
            width: 10,
            height: 10,
        };
        assert_eq!(error, needed);
    }

    fn pixels() -> impl Strategy<Value = Pixels> {
        let level = prop_oneof![3 => any::<u8>(), 1 => Just(255u8)];
        prop::collection::vec(level, WIDTH * WIDTH).prop_map(|levels| levels.try_into().unwrap())
    }

    properties! {
        #[test]
        fn features_follow_their_definitions(
            pixels in pixels(), x in 9.0f32..11.0, y in 9.0f32..11.0, pitch in 2.0f32..4.2, slant in 0.0f32..2.0,
        ) {
            let map = map(x, y, pitch, slant);
            let features = measure(&pixels, &map);
            let (means, gri, saturated) = by_definition(&pixels, &map);
            prop_assert_eq!(features.saturated, saturated);
            for cell in 0..64 {
                prop_assert!((f64::from(features.mean_grey[cell]) - means[cell]).abs() < 1e-4);
                prop_assert!((f64::from(features.gri[cell]) - gri[cell]).abs() < 1e-3);
            }
            let weighted = (0..64).map(|cell| f64::from(features.agr[cell]) * f64::from(features.pixels[cell]));
            let pixels: f64 = features.pixels.iter().map(|&n| f64::from(n)).sum();
            prop_assert!((weighted.sum::<f64>() / pixels - 1.0).abs() < 1e-5);
        }

        #[test]
        fn a_flat_frame_has_no_gradient(level: u8, x in 9.0f32..11.0, pitch in 2.0f32..4.2, slant in 0.0f32..2.0) {
            let features = measure(&[level; WIDTH * WIDTH], &map(x, x, pitch, slant));
            prop_assert_eq!(features.gri, [0.0; 64]);
            prop_assert!(features.agr.iter().all(|agr| (agr - 1.0).abs() < 1e-6));
        }
    }
}
