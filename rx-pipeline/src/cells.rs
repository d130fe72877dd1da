//! Which pixel belongs to which LED, worked out once for a pose and laid out for [`crate::features`].

use crate::approximate::inverse_sqrt;
use crate::corners::Corners;
use link::panel::{LEDS, SIDE};

/// The widest bounding box of a panel, in pixels: rows are worked on in buffers of this length.
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
/// `PIXELS` is the largest bounding box, width times height. A map takes about 10 bytes a pixel: 13 kB for
/// 36×36, 164 kB for 128×128. Where that is too much for the stack put an [`CellMap::empty`] map in a `static`
/// and [`CellMap::build`] it in place.
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
pub enum CellsError {
    /// The panel, with one pixel around it for the gradient, is not wholly in the frame.
    #[error(
        "the panel covers x {left:.1} to {right:.1} and y {top:.1} to {bottom:.1}, which with a rim of 1 px is not \
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
        "the panel's bounding box of {width} × {height} pixels exceeds the map's {capacity} pixels or \
         {MAX_WIDTH_PX} columns: use a larger CellMap, or shrink the frame"
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
    #[error("cell {cell} holds more than {} pixels: shrink the frame", u16::MAX)]
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
    pub fn new(
        corners: &Corners,
        frame_width: usize,
        frame_height: usize,
    ) -> Result<Self, CellsError> {
        let mut map = Self::empty();
        map.build(corners, frame_width, frame_height)?;
        Ok(map)
    }

    /// As [`CellMap::new`], in the memory of this map. After an error the map is empty.
    ///
    /// # Errors
    /// As [`CellMap::new`].
    #[inline(always)]
    pub fn build(
        &mut self,
        corners: &Corners,
        frame_width: usize,
        frame_height: usize,
    ) -> Result<(), CellsError> {
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

    /// Moves the cells by whole pixels, for a frame that begins elsewhere and is `width` × `height` px; empties the map, and is false,
    /// where they do not lie within it.
    pub(crate) fn shift(&mut self, [dx, dy]: [i32; 2], width: usize, height: usize) -> bool {
        let moved = |start: usize, by: i32, length: usize, limit: usize| {
            let start = start.checked_add_signed(by as isize)?;
            (start >= 1 && start.checked_add(length)? < limit).then_some(start)
        };
        let Bounds { x, y, .. } = self.bounds;
        let place =
            moved(x, dx, self.bounds.width, width).zip(moved(y, dy, self.bounds.height, height));
        self.bounds = place.map_or(Bounds::default(), |(x, y)| Bounds {
            x,
            y,
            ..self.bounds
        });
        place.is_some()
    }

    /// The panel's bounding box; of no pixels while the map is empty.
    pub const fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The cell (0 to 63) of the pixel (`x`, `y`) of the frame; `None` if it belongs to none.
    pub fn cell(&self, x: usize, y: usize) -> Option<usize> {
        let cell = self.cell[self.index(x, y)?];
        (cell != NO_CELL).then_some(cell.into())
    }

    /// The unit vector from the pixel (`x`, `y`) of the frame towards the centre of its cell's LED. Zero at the centre
    /// itself and where there is no cell.
    pub fn rho(&self, x: usize, y: usize) -> [f32; 2] {
        self.index(x, y)
            .map_or([0.0; 2], |i| [self.rho_x[i], self.rho_y[i]])
    }

    /// How many pixels belong to cell `cell` (0 to 63); 0 for numbers beyond. At least 1 in a built map.
    pub fn pixels_of_cell(&self, cell: usize) -> usize {
        self.pixels().get(cell).copied().map_or(0, usize::from)
    }

    pub(crate) fn pixels(&self) -> &[u16; LEDS] {
        &self.pixels
    }

    pub(crate) fn rows(&self) -> impl Iterator<Item = MapRow<'_>> {
        let width = self.bounds.width.max(1);
        let area = self.bounds.width * self.bounds.height;
        let rho = self.rho_x[..area]
            .chunks_exact(width)
            .zip(self.rho_y[..area].chunks_exact(width));
        let runs = self.cell[..area]
            .chunks_exact(width)
            .zip(self.run[..area].chunks_exact(width));
        rho.zip(runs).map(|((rho_x, rho_y), (cell, run))| MapRow {
            rho_x,
            rho_y,
            cell,
            run,
        })
    }

    fn index(&self, x: usize, y: usize) -> Option<usize> {
        let (column, row) = (x.checked_sub(self.bounds.x)?, y.checked_sub(self.bounds.y)?);
        (column < self.bounds.width && row < self.bounds.height)
            .then(|| row * self.bounds.width + column)
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

    /// Fills the map of a panel whose rows are rows of the frame: what lies to the right of what, and in which cell, is the
    /// same in all pixel rows of one row of cells, so only the vectors' lengths are worked out for each pixel.
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
            // By the very operations of `cells_of_row`, so that both change at the same row.
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
            for ((rho_x, rho_y), ((&right, &down), &cell)) in
                rho_x.iter_mut().zip(rho_y).zip(offsets)
            {
                let down = if cell == NO_CELL {
                    0.0
                } else {
                    down - since_first
                };
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

/// The pixels whose centres lie within the box around all cells, if they and their neighbours are in the frame.
fn bounds(corners: &Corners, width: usize, height: usize) -> Result<Bounds, CellsError> {
    let outline = corners.homography().outline();
    let ends = |axis: usize| {
        let values = outline.map(|corner| corner[axis]);
        (
            values.into_iter().fold(f64::INFINITY, f64::min),
            values.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let ((left, right), (top, bottom)) = (ends(0), ends(1));
    let (x, y) = (libm::ceil(left), libm::ceil(top));
    let (last_x, last_y) = (libm::floor(right), libm::floor(bottom));
    if !(x >= 1.0 && y >= 1.0 && last_x + 2.0 <= width as f64 && last_y + 2.0 <= height as f64) {
        return Err(CellsError::OutsideFrame {
            left,
            right,
            top,
            bottom,
            width,
            height,
        });
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
    let [[ux, u], [vx, v], [wx, w]] =
        matrix.map(|[x_factor, y_factor, offset]| [x_factor, y_factor * y + offset]);
    for (x, cell) in cell.iter_mut().enumerate() {
        let x = x as i32 as f32;
        let scale = 1.0 / (wx * x + w);
        let (column, row) = (
            from_border((ux * x + u) * scale),
            from_border((vx * x + v) * scale),
        );
        // The last bits of a float just above 2²³ are an integer: unlike a cast, this is vectorised.
        let index = (SIDE as f32 * floor(row) + floor(column) + INTEGERS).to_bits() as u8;
        *cell = if is_within(column) & is_within(row) {
            index
        } else {
            NO_CELL
        };
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

/// The runs of one cell, and the vectors from their pixels to the cell's centre; zero where there is no cell.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(x: f32, y: f32, pitch: f32) -> Corners {
        let far = 7.0 * pitch;
        Corners::new([[x, y], [x + far, y], [x + far, y + far], [x, y + far]]).unwrap()
    }

    #[test]
    fn each_pixel_belongs_to_the_cell_that_holds_its_centre() {
        let map = CellMap::<1200>::new(&square(4.0, 6.0, 4.0), 40, 40).unwrap();
        assert_eq!(
            map.bounds(),
            Bounds {
                x: 2,
                y: 4,
                width: 33,
                height: 33
            }
        );
        // Borders lie at x = 2, 6, 10…: a pixel on one belongs to the cell on the right.
        assert_eq!(
            [1, 2, 5, 6, 33, 34].map(|x| map.cell(x, 6)),
            [None, Some(0), Some(0), Some(1), Some(7), None]
        );
        assert_eq!(
            [4, 7, 8, 35, 36].map(|y| map.cell(4, y)),
            [Some(0), Some(0), Some(8), Some(56), None]
        );
        assert!((0..64).all(|cell| map.pixels_of_cell(cell) == 16));
        assert_eq!(map.pixels_of_cell(64), 0);
    }

    #[test]
    fn rho_points_to_the_led() {
        let map = CellMap::<1200>::new(&square(4.0, 6.0, 4.0), 40, 40).unwrap();
        assert_eq!(map.rho(8, 6), [0.0, 0.0]);
        approx::assert_abs_diff_eq!(map.rho(7, 6)[..], [1.0, 0.0][..], epsilon = 1e-6);
        let diagonal = core::f32::consts::FRAC_1_SQRT_2;
        approx::assert_abs_diff_eq!(
            map.rho(9, 7)[..],
            [-diagonal, -diagonal][..],
            epsilon = 1e-6
        );
        assert_eq!(map.rho(0, 0), [0.0, 0.0]);
    }

    #[test]
    fn a_rim_of_one_pixel_is_needed() {
        // The first pixel of the cells is x = ceil(3 − 2) = 1, the last 31.5 floored.
        assert!(CellMap::<2000>::new(&square(3.0, 3.0, 4.0), 35, 35).is_ok());
        let outside = CellMap::<2000>::new(&square(2.0, 3.0, 4.0), 35, 35).unwrap_err();
        assert!(matches!(
            outside,
            CellsError::OutsideFrame {
                left: 0.0,
                width: 35,
                ..
            }
        ));
        assert!(CellMap::<2000>::new(&square(3.0, 3.0, 4.0), 34, 35).is_err());
    }

    #[test]
    fn maps_do_not_overflow() {
        let corners = square(10.0, 10.0, 4.0);
        let mut map = CellMap::<1000>::empty();
        let error = map.build(&corners, 100, 100).unwrap_err();
        assert_eq!(
            error,
            CellsError::TooLarge {
                width: 33,
                height: 33,
                capacity: 1000
            }
        );
        assert_eq!(map.bounds(), Bounds::default());
        assert!(matches!(
            CellMap::<4>::new(&square(200.0, 200.0, 50.0), 900, 900),
            Err(CellsError::TooLarge { .. })
        ));
    }

    #[test]
    fn a_panel_seen_edge_on_has_empty_cells() {
        let flat = Corners::new([[10.0, 20.0], [24.0, 30.0], [38.0, 40.3], [24.0, 30.2]]).unwrap();
        assert!(matches!(
            CellMap::<2000>::new(&flat, 100, 100),
            Err(CellsError::EmptyCell { .. })
        ));
    }

    proptest! {
        #[test]
        fn the_map_agrees_with_the_homography(jitter in prop::array::uniform8(-6.0f32..6.0)) {
            let square = [[20.0, 20.0], [62.0, 20.0], [62.0, 62.0], [20.0, 62.0]];
            let points = core::array::from_fn(|i| {
                let [x, y]: [f32; 2] = square[i];
                [x + jitter[2 * i], y + jitter[2 * i + 1]]
            });
            let corners = Corners::new(points).unwrap();
            let map = CellMap::<9000>::new(&corners, 90, 90).unwrap();
            let homography = corners.homography();
            for y in 0..90 {
                for x in 0..90 {
                    let position = homography.to_panel([x as f64, y as f64]);
                    let on_border = position.iter().any(|c| (c + 0.5 - libm::round(c + 0.5)).abs() < 1e-4);
                    if on_border {
                        continue;
                    }
                    let [column, row] = position.map(|c| libm::floor(c + 0.5));
                    let within = (0.0..8.0).contains(&column) && (0.0..8.0).contains(&row);
                    prop_assert_eq!(map.cell(x, y), within.then_some((8.0 * row + column) as usize));
                    if within {
                        let [cx, cy] = homography.to_image([column, row]);
                        let (dx, dy) = (cx - x as f64, cy - y as f64);
                        let distance = libm::hypot(dx, dy);
                        let [rx, ry] = map.rho(x, y).map(f64::from);
                        prop_assert!((rx * distance - dx).abs() < 1e-4 && (ry * distance - dy).abs() < 1e-4);
                    }
                }
            }
        }

        #[test]
        fn upright_panels_need_no_way_of_their_own(
            x in 9.0f32..11.0, y in 9.0f32..11.0, across in 2.0f32..4.2, down in 2.0f32..4.2,
        ) {
            let (right, bottom) = (x + 7.0 * across, y + 7.0 * down);
            let corners = Corners::new([[x, y], [right, y], [right, bottom], [x, bottom]]).unwrap();
            let map = CellMap::<2304>::new(&corners, 48, 48).unwrap();
            let homography = corners.homography();
            let Bounds { x: left, y: top, width, height } = map.bounds();
            let matrix = homography.inverse_from(left as f64, top as f64);
            prop_assert!(is_upright(&matrix));
            let centres = core::array::from_fn(|led| {
                let [x, y] = homography.to_image([(led % SIDE) as f64, (led / SIDE) as f64]);
                [(x - left as f64) as f32, (y - top as f64) as f32]
            });
            let mut slanted = CellMap::<2304>::empty();
            let mut pixels = [0; LEDS];
            slanted.fill_slanted(&matrix, &centres, map.bounds(), &mut pixels);
            let area = width * height;
            prop_assert_eq!(&map.cell[..area], &slanted.cell[..area]);
            prop_assert_eq!(map.pixels.map(u32::from), pixels);
            for (one, other) in [(&map.rho_x, &slanted.rho_x), (&map.rho_y, &slanted.rho_y)] {
                let apart = one[..area].iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                prop_assert!(apart < 1e-5, "{}", apart);
            }
        }

        #[test]
        fn no_pose_panics(
            points in prop::array::uniform4(prop::array::uniform2(-50.0f32..300.0)),
            width in 0usize..300,
            height in 0usize..300,
        ) {
            if let Ok(corners) = Corners::new(points)
                && let Ok(map) = CellMap::<16384>::new(&corners, width, height)
            {
                prop_assert!((0..64).all(|cell| map.pixels_of_cell(cell) > 0));
            }
        }
    }
}
