//! The map from pixels to LEDs, computed once per pose and laid out for [`crate::features`].

#[cfg(test)]
mod tests;

use crate::approximate::inverse_sqrt;
use crate::corners::Corners;
use link::panel::{LEDS, SIDE};

/// The widest bounding box of a panel, in pixels: the length of row buffers.
pub const MAX_WIDTH_PX: usize = 255;

/// The cell number of pixels of the bounding box that belong to no cell.
pub(crate) const NO_CELL: u8 = LEDS as u8;

/// The cells of a panel in one pose: for each pixel of the panel's bounding box its cell and the unit vector towards
/// the centre of that cell's LED.
///
/// A pixel belongs to the cell that holds its centre. Cells are 8×8 equal squares of one pitch in the panel's plane, each
/// centred on its LED and open at its right and lower sides, so that each pixel belongs to at most one. Cell 8·row + column is
/// that of the LED of the same number.
///
/// `PIXELS` is the largest bounding box, width times height. A map takes about 10 bytes a pixel: 13 kB for 36×36, 164 kB for 128×128. If
/// that is too much for the stack, put an [`CellMap::empty`] map into a `static` and [`CellMap::build`] it in place.
///
/// ```
/// use rx_pipeline::{cells::CellMap, corners::Corners};
/// let corners = Corners::new([[5.0, 5.0], [33.0, 5.0], [33.0, 33.0], [5.0, 33.0]])?;
/// let map = CellMap::<2048>::new(&corners, 40, 40)?;
/// assert_eq!(map.cell(9, 5), Some(1));
/// assert_eq!(map.pixels_of_cell(1), 16);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct CellMap<const PIXELS: usize> {
    bounds: Bounds,
    rho_x: [f32; PIXELS],
    rho_y: [f32; PIXELS],
    cell: [u8; PIXELS],
    /// At the first pixel of each run of one cell within a row: the run's length. Elsewhere unused.
    run: [u8; PIXELS],
    pixels: [u16; LEDS],
}

/// The pixels of a panel's bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bounds {
    /// The first column.
    pub x: usize,
    /// The first row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Why a pose has no cells in a frame.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CellsError {
    /// The panel, with one pixel around it for the gradient, is not wholly in the frame.
    #[error(
        "the panel covers x {left:.1} to {right:.1} and y {top:.1} to {bottom:.1}, and with a rim of 1 px this is not \
         within the frame of {width} × {height}: aim the camera, or use a larger region"
    )]
    OutsideFrame {
        /// The outermost cells' left end.
        left: f64,
        /// The outermost cells' right end.
        right: f64,
        /// The outermost cells' upper end.
        top: f64,
        /// The outermost cells' lower end.
        bottom: f64,
        /// The frame's columns.
        width: usize,
        /// The frame's rows.
        height: usize,
    },
    /// The bounding box needs more memory than the map has.
    #[error(
        "the panel's image has {width} × {height} pixels, and there is memory for {capacity} pixels and {MAX_WIDTH_PX} columns: \
         check the corners, or shrink the frame"
    )]
    TooLarge {
        /// The box's columns.
        width: usize,
        /// The box's rows.
        height: usize,
        /// The map's `PIXELS`.
        capacity: usize,
    },
    /// A cell so slanted that no pixel's centre lies in it.
    #[error("no pixel lies in cell {cell}: the panel is seen too obliquely for its size")]
    EmptyCell {
        /// 8·row + column.
        cell: usize,
    },
    /// A cell of more pixels than its sums can hold.
    #[error("cell {cell} has more than {} pixels: shrink the frame", u16::MAX)]
    CellTooLarge {
        /// 8·row + column.
        cell: usize,
    },
}

/// One row of a panel's bounding box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapRow<'a> {
    pub rho_x: &'a [f32],
    pub rho_y: &'a [f32],
    pub cell: &'a [u8],
    pub run: &'a [u8],
}

impl<const PIXELS: usize> CellMap<PIXELS> {
    /// A map without cells, to be built in place: all zeros, so that a `static` takes no room in flash.
    pub const fn empty() -> Self {
        Self {
            bounds: Bounds {
                x: 0,
                y: 0,
                width: 0,
                height: 0,
            },
            rho_x: [0.0; PIXELS],
            rho_y: [0.0; PIXELS],
            cell: [0; PIXELS],
            run: [0; PIXELS],
            pixels: [0; LEDS],
        }
    }

    /// The cells of the panel at `corners` in frames of `frame_width` × `frame_height` pixels.
    ///
    /// # Errors
    /// One variant of [`CellsError`] for each way in which the panel may not fit into the frame or the map.
    pub fn new(corners: &Corners, frame_width: usize, frame_height: usize) -> Result<Self, CellsError> {
        let mut map = Self::empty();
        map.build(corners, frame_width, frame_height)?;
        Ok(map)
    }

    /// As [`CellMap::new`], in the memory of this map. After an error the map is empty.
    ///
    /// # Errors
    /// As [`CellMap::new`].
    #[inline(always)]
    pub fn build(&mut self, corners: &Corners, frame_width: usize, frame_height: usize) -> Result<(), CellsError> {
        self.bounds = Bounds::default();
        let bounds = bounds(corners, frame_width, frame_height)?;
        let Bounds { width, height, .. } = bounds;
        let area = width.checked_mul(height);
        if width > MAX_WIDTH_PX || area.is_none_or(|area| area > PIXELS) {
            return Err(CellsError::TooLarge {
                width,
                height,
                capacity: PIXELS,
            });
        }
        self.fill(corners, bounds)?;
        self.bounds = bounds;
        Ok(())
    }

    /// Moves the cells by whole pixels, for a frame of `width` × `height` px with another origin. If they do not lie within that frame,
    /// empties the map and returns false.
    pub(crate) fn shift(&mut self, [dx, dy]: [i32; 2], width: usize, height: usize) -> bool {
        let moved = |start: usize, by: i32, length: usize, limit: usize| {
            let start = start.checked_add_signed(by as isize)?;
            (start >= 1 && start.checked_add(length)? < limit).then_some(start)
        };
        let Bounds { x, y, .. } = self.bounds;
        let place = moved(x, dx, self.bounds.width, width).zip(moved(y, dy, self.bounds.height, height));
        self.bounds = place.map_or(Bounds::default(), |(x, y)| Bounds { x, y, ..self.bounds });
        place.is_some()
    }

    /// The panel's bounding box; it has no pixels while the map is empty.
    pub const fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The cell (0 to 63) of the pixel (`x`, `y`) of the frame; `None` outside the cells.
    pub fn cell(&self, x: usize, y: usize) -> Option<usize> {
        let cell = self.cell[self.index(x, y)?];
        (cell != NO_CELL).then_some(cell.into())
    }

    /// The unit vector from the pixel (`x`, `y`) of the frame towards the centre of its cell's LED. Zero at the centre itself and outside
    /// the cells.
    pub fn rho(&self, x: usize, y: usize) -> [f32; 2] {
        self.index(x, y).map_or([0.0; 2], |i| [self.rho_x[i], self.rho_y[i]])
    }

    /// The number of pixels of cell `cell` (0 to 63); 0 for numbers beyond. At least 1 in a built map.
    pub fn pixels_of_cell(&self, cell: usize) -> usize {
        self.pixels().get(cell).copied().map_or(0, usize::from)
    }

    pub(crate) fn pixels(&self) -> &[u16; LEDS] {
        &self.pixels
    }

    pub(crate) fn rows(&self) -> impl Iterator<Item = MapRow<'_>> {
        let width = self.bounds.width.max(1);
        let area = self.bounds.width * self.bounds.height;
        let rho = self.rho_x[..area].chunks_exact(width).zip(self.rho_y[..area].chunks_exact(width));
        let runs = self.cell[..area].chunks_exact(width).zip(self.run[..area].chunks_exact(width));
        rho.zip(runs)
            .map(|((rho_x, rho_y), (cell, run))| MapRow { rho_x, rho_y, cell, run })
    }

    fn index(&self, x: usize, y: usize) -> Option<usize> {
        let (column, row) = (x.checked_sub(self.bounds.x)?, y.checked_sub(self.bounds.y)?);
        (column < self.bounds.width && row < self.bounds.height).then(|| row * self.bounds.width + column)
    }

    #[inline(always)]
    fn fill(&mut self, corners: &Corners, bounds: Bounds) -> Result<(), CellsError> {
        let homography = corners.homography();
        let (origin_x, origin_y) = (bounds.x as f64, bounds.y as f64);
        let matrix = homography.inverse_from(origin_x, origin_y);
        let centres: [[f32; 2]; LEDS] = core::array::from_fn(|led| {
            let [x, y] = homography.to_image([(led % SIDE) as f64, (led / SIDE) as f64]);
            [(x - origin_x) as f32, (y - origin_y) as f32]
        });
        let mut pixels = [0u32; LEDS];
        if is_upright(&matrix) {
            self.fill_upright(&matrix, &centres, bounds, &mut pixels);
        } else {
            self.fill_slanted(&matrix, &centres, bounds, &mut pixels);
        }
        for (cell, (to, &from)) in self.pixels.iter_mut().zip(&pixels).enumerate() {
            *to = u16::try_from(from).map_err(|_| CellsError::CellTooLarge { cell })?;
            if from == 0 {
                return Err(CellsError::EmptyCell { cell });
            }
        }
        Ok(())
    }

    /// Fills the map of a panel in any pose, pixel by pixel.
    #[inline(always)]
    fn fill_slanted(
        &mut self,
        matrix: &[[f32; 3]; 3],
        centres: &[[f32; 2]; LEDS],
        Bounds { width, height, .. }: Bounds,
        pixels: &mut [u32; LEDS],
    ) {
        for y in 0..height {
            let row = width * y..width * (y + 1);
            let (rho_x, rho_y) = (&mut self.rho_x[row.clone()], &mut self.rho_y[row.clone()]);
            let (cell, run) = (&mut self.cell[row.clone()], &mut self.run[row]);
            cells_of_row(matrix, y as f32, cell);
            runs_of_row(centres, y as f32, cell, run, rho_x, rho_y, pixels);
            to_unit_length(rho_x, rho_y);
        }
    }

    /// Fills the map of a panel whose rows are rows of the frame: columns and cells are the same in all pixel rows of one row of cells, so
    /// only the vectors' lengths are computed for each pixel.
    #[inline(always)]
    fn fill_upright(
        &mut self,
        matrix: &[[f32; 3]; 3],
        centres: &[[f32; 2]; LEDS],
        Bounds { width, height, .. }: Bounds,
        pixels: &mut [u32; LEDS],
    ) {
        let [_, [_, row_factor, row_offset], [_, _, scale]] = *matrix;
        let (mut to_right, mut down) = ([0.0; MAX_WIDTH_PX], [0.0; MAX_WIDTH_PX]);
        let (to_right, down) = (&mut to_right[..width], &mut down[..width]);
        let mut above = None;
        let (mut in_row, mut first) = ([0; LEDS], 0);
        for y in 0..height {
            let row = width * y..width * (y + 1);
            // The same operations as in `cells_of_row`, so that both change at the same row.
            let from_top = from_border((row_factor * y as f32 + row_offset) * (1.0 / scale));
            let led_row = is_within(from_top).then(|| floor(from_top));
            if above == Some(led_row) {
                let from = row.start - width..row.start;
                self.cell.copy_within(from.clone(), row.start);
                self.run.copy_within(from, row.start);
            } else {
                let (cell, run) = (&mut self.cell[row.clone()], &mut self.run[row.clone()]);
                cells_of_row(matrix, y as f32, cell);
                in_row = [0; LEDS];
                runs_of_row(centres, y as f32, cell, run, to_right, down, &mut in_row);
                (above, first) = (Some(led_row), y);
            }
            for (pixels, in_row) in pixels.iter_mut().zip(in_row) {
                *pixels += in_row;
            }
            let since_first = (y - first) as f32;
            let (rho_x, rho_y) = (&mut self.rho_x[row.clone()], &mut self.rho_y[row.clone()]);
            let offsets = to_right.iter().zip(&*down).zip(&self.cell[row]);
            for ((rho_x, rho_y), ((&right, &down), &cell)) in rho_x.iter_mut().zip(rho_y).zip(offsets) {
                let down = if cell == NO_CELL { 0.0 } else { down - since_first };
                let scale = inverse_sqrt(right * right + down * down);
                *rho_x = right * scale;
                *rho_y = down * scale;
            }
        }
    }
}

/// Whether pixel rows run along rows of LEDs.
fn is_upright(matrix: &[[f32; 3]; 3]) -> bool {
    let [[_, column_down, _], [row_across, _, _], [across, down, _]] = *matrix;
    [column_down, row_across, across, down] == [0.0; 4]
}

impl CellsError {
    /// The error for cells that end there, outside a frame of that size.
    pub(crate) fn outside_frame([[left, right], [top, bottom]]: [[f64; 2]; 2], [width, height]: [usize; 2]) -> Self {
        Self::OutsideFrame {
            left,
            right,
            top,
            bottom,
            width,
            height,
        }
    }
}

/// The ends of the outermost cells along x and along y.
pub(crate) fn ends(corners: &Corners) -> [[f64; 2]; 2] {
    let outline = corners.homography().outline();
    [0, 1].map(|axis| {
        let values = outline.map(|corner| corner[axis]);
        [
            values.into_iter().fold(f64::INFINITY, f64::min),
            values.into_iter().fold(f64::NEG_INFINITY, f64::max),
        ]
    })
}

/// The pixels whose centres lie within the box around all cells, if they and their neighbours are in the frame.
fn bounds(corners: &Corners, width: usize, height: usize) -> Result<Bounds, CellsError> {
    let ends = ends(corners);
    let [[left, right], [top, bottom]] = ends;
    let (x, y) = (libm::ceil(left), libm::ceil(top));
    let (last_x, last_y) = (libm::floor(right), libm::floor(bottom));
    if !(x >= 1.0 && y >= 1.0 && last_x + 2.0 <= width as f64 && last_y + 2.0 <= height as f64) {
        return Err(CellsError::outside_frame(ends, [width, height]));
    }
    Ok(Bounds {
        x: x as usize,
        y: y as usize,
        width: (last_x - x) as usize + 1,
        height: (last_y - y) as usize + 1,
    })
}

/// Each pixel's cell.
#[inline(always)]
fn cells_of_row(matrix: &[[f32; 3]; 3], y: f32, cell: &mut [u8]) {
    let [[ux, u], [vx, v], [wx, w]] = matrix.map(|[x_factor, y_factor, offset]| [x_factor, y_factor * y + offset]);
    for (x, cell) in cell.iter_mut().enumerate() {
        let x = x as i32 as f32;
        let scale = 1.0 / (wx * x + w);
        let (column, row) = (from_border((ux * x + u) * scale), from_border((vx * x + v) * scale));
        // The last bits of a float just above 2²³ are an integer: unlike a cast, this is vectorised.
        let index = (SIDE as f32 * floor(row) + floor(column) + INTEGERS).to_bits() as u8;
        *cell = if is_within(column) & is_within(row) { index } else { NO_CELL };
    }
}

/// A position in pitches from the first LED, counted from the first cell's border: the half moves borders to whole numbers.
#[inline(always)]
fn from_border(position: f32) -> f32 {
    position + 0.5
}

#[inline(always)]
fn is_within(from_border: f32) -> bool {
    (from_border >= 0.0) & (from_border < SIDE as f32)
}

/// From here on neighbouring floats are integers.
const INTEGERS: f32 = 8_388_608.0;

/// The largest integer that is no larger, for numbers from 0 to 2²².
#[inline(always)]
fn floor(x: f32) -> f32 {
    let rounded = (x + INTEGERS) - INTEGERS;
    if rounded > x { rounded - 1.0 } else { rounded }
}

/// The runs of one cell, and the vectors from their pixels to the cell's centre; zero outside the cells.
fn runs_of_row(
    centres: &[[f32; 2]; LEDS],
    y: f32,
    cell: &[u8],
    run: &mut [u8],
    to_right: &mut [f32],
    down: &mut [f32],
    pixels: &mut [u32; LEDS],
) {
    let mut start = 0;
    for cells in cell.chunk_by(|a, b| a == b) {
        let end = start + cells.len();
        run[start] = cells.len() as u8;
        let (xs, ys) = (&mut to_right[start..end], &mut down[start..end]);
        if let Some(&[centre_x, centre_y]) = centres.get(usize::from(cells[0])) {
            pixels[usize::from(cells[0])] += cells.len() as u32;
            ys.fill(centre_y - y);
            for (x, to) in (start..end).zip(xs) {
                *to = centre_x - x as i32 as f32;
            }
        } else {
            xs.fill(0.0);
            ys.fill(0.0);
        }
        start = end;
    }
}

/// Scales vectors to length 1; zero stays zero.
#[inline(always)]
fn to_unit_length(xs: &mut [f32], ys: &mut [f32]) {
    for (x, y) in xs.iter_mut().zip(ys) {
        let scale = inverse_sqrt(*x * *x + *y * *y);
        *x *= scale;
        *y *= scale;
    }
}
