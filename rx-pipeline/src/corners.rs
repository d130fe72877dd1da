//! The panel's position in the frame: its four corner LEDs, and the homography that they define.

use link::panel::SIDE;

/// The least pitch that the receiver reads (px).
///
/// A square cell holds a pixel centre at any position and rotation if its inscribed circle has at least the radius √2/2, that is, from a
/// side of √2 px on. 1.5 px leaves a margin.
pub(crate) const MIN_PITCH_PX: f32 = 1.5;

/// The position of the last LED of a row or column in panel coordinates.
const LAST: f64 = (SIDE - 1) as f64;

/// The centres of the four corner LEDs in the frame: a panel's pose as the camera sees it.
///
/// Always finite, convex, and in the order top left, top right, bottom right, bottom left, which runs clockwise
/// on the screen, since y points downwards.
///
/// ```
/// use rx_pipeline::corners::Corners;
/// let corners = Corners::new([[10.0, 10.0], [38.0, 10.0], [38.0, 38.0], [10.0, 38.0]])?;
/// assert_eq!(corners.pitch_px(), 4.0);
/// let homography = corners.homography();
/// assert_eq!(homography.to_image([1.0, 2.0]), [14.0, 18.0]);
/// # Ok::<(), rx_pipeline::corners::CornersError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners([[f32; 2]; 4]);

/// Why four points are not the corner LEDs of a readable panel.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CornersError {
    /// A coordinate is not a number.
    #[error("corner {corner} is at ({x}, {y}): coordinates are finite and within ±1 000 000 px")]
    NotFinite {
        /// 0 to 3: top left, top right, bottom right, bottom left.
        corner: usize,
        /// Its x in pixels.
        x: f32,
        /// Its y in pixels.
        y: f32,
    },
    /// The points run the other way around.
    #[error("the corners run anticlockwise, as in a mirror image: give them as top left, top right, bottom right, bottom left")]
    Mirrored,
    /// The outline crosses itself, is dented, or three corners lie on a line.
    #[error(
        "the outline crosses itself or is not convex at corner {corner}: give the corners as top left, top right, \
         bottom right, bottom left"
    )]
    NotConvex {
        /// 0 to 3: top left, top right, bottom right, bottom left.
        corner: usize,
    },
    /// The LEDs are too close to each other to be resolved.
    #[error(
        "the LEDs are {pitch_px:.2} px apart: at least {MIN_PITCH_PX} px is needed; check the corners, or show the panel larger: \
         from nearer, by a longer focal length, or in more pixels"
    )]
    PitchTooSmall {
        /// A seventh of the panel's shortest side, in pixels.
        pitch_px: f32,
    },
    /// The panel is seen so obliquely that its outer cells reach the horizon.
    #[error("the perspective is too strong: the panel's outer cells reach the vanishing line; check the corners")]
    TooOblique,
}

impl Corners {
    /// The panel whose corner LEDs' centres are `points`: top left, top right, bottom right, bottom left, each (x, y)
    /// in pixels.
    ///
    /// # Errors
    /// One variant of [`CornersError`] for each property the points lack.
    pub fn new(points: [[f32; 2]; 4]) -> Result<Self, CornersError> {
        let usable = |c: f32| c.abs() <= 1e6;
        if let Some(corner) = points.iter().position(|&[x, y]| !usable(x) || !usable(y)) {
            let [x, y] = points[corner];
            return Err(CornersError::NotFinite { corner, x, y });
        }
        let turns = core::array::from_fn::<f64, 4, _>(|i| turn(points[(i + 3) % 4], points[i], points[(i + 1) % 4]));
        if turns.iter().all(|&turn| turn < 0.0) {
            return Err(CornersError::Mirrored);
        }
        if let Some(corner) = turns.iter().position(|&turn| turn <= 0.0) {
            return Err(CornersError::NotConvex { corner });
        }
        let corners = Self(points);
        let pitch_px = corners.sides_px().into_iter().fold(f32::INFINITY, f32::min) / LAST as f32;
        if pitch_px < MIN_PITCH_PX {
            return Err(CornersError::PitchTooSmall { pitch_px });
        }
        if !corners.homography().is_before_the_horizon() {
            return Err(CornersError::TooOblique);
        }
        Ok(corners)
    }

    /// The four points: top left, top right, bottom right, bottom left.
    pub const fn points(&self) -> [[f32; 2]; 4] {
        self.0
    }

    /// The corners in the order of the panel's own rows, if these belong to a picture that shows it `quarter_turns` right angles clockwise.
    pub(crate) fn upright(&self, quarter_turns: u8) -> Self {
        let mut points = self.0;
        points.rotate_left(usize::from(quarter_turns % 4));
        Self(points)
    }

    /// The right angles, clockwise, by which the first row is turned in the picture, to the nearest (0 to 3).
    ///
    /// ```
    /// # use rx_pipeline::corners::Corners;
    /// let corners = [[10.0, 10.0], [80.0, 12.0], [78.0, 82.0], [8.0, 80.0]];
    /// assert_eq!(Corners::new(corners)?.quarter_turns(), 0);
    /// let [a, b, c, d] = corners;
    /// assert_eq!(Corners::new([b, c, d, a])?.quarter_turns(), 1);
    /// # Ok::<(), rx_pipeline::corners::CornersError>(())
    /// ```
    pub fn quarter_turns(&self) -> u8 {
        let [from, to, ..] = self.0;
        let turned = libm::atan2f(to[1] - from[1], to[0] - from[0]);
        (libm::roundf(turned / core::f32::consts::FRAC_PI_2) as i32).rem_euclid(4) as u8
    }

    /// The angle of [`quarter_turns`](Self::quarter_turns) in degrees: 0, 90, 180 or 270.
    pub fn turned_deg(&self) -> u32 {
        90 * u32::from(self.quarter_turns())
    }

    /// The distance of neighbouring LEDs in pixels, averaged over the four sides.
    pub fn pitch_px(&self) -> f32 {
        self.sides_px().into_iter().sum::<f32>() / (4.0 * LAST as f32)
    }

    /// The intersection of the panel's diagonals: the image of its centre.
    pub fn centre_px(&self) -> [f32; 2] {
        let [x, y] = self.homography().to_image([LAST / 2.0; 2]);
        [x as f32, y as f32]
    }

    /// The same panel `dx` px further right and `dy` px further down, as in the frame around a region.
    ///
    /// # Errors
    /// As [`Corners::new`], if the coordinates leave their range.
    pub fn shifted(&self, dx: f32, dy: f32) -> Result<Self, CornersError> {
        Self::new(self.0.map(|[x, y]| [x + dx, y + dy]))
    }

    /// The map between panel coordinates and the frame.
    pub fn homography(&self) -> Homography {
        Homography::new(self.0.map(|[x, y]| [f64::from(x), f64::from(y)]))
    }

    fn sides_px(&self) -> [f32; 4] {
        core::array::from_fn(|i| {
            let ([ax, ay], [bx, by]) = (self.0[i], self.0[(i + 1) % 4]);
            libm::hypotf(bx - ax, by - ay)
        })
    }
}

/// Twice the area of the triangle a, b, c: positive if the way turns right at b on the screen.
fn turn(a: [f32; 2], b: [f32; 2], c: [f32; 2]) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| [f64::from(x), f64::from(y)]);
    (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
}

/// The projective map from panel coordinates (u: LED column, v: LED row, both 0 to 7 at the LEDs) to pixels.
///
/// In f64: it is computed a few times per pose, and its inverse subtracts nearly equal products. In f32 that would cost the tenth of a
/// thousandth of a pixel which decides the cell of a pixel on a border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography {
    forward: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
}

impl Homography {
    /// The exact map of the square of corner LEDs to a convex quadrilateral (Heckbert 1989, section 2.2.3).
    fn new(quad: [[f64; 2]; 4]) -> Self {
        let [[x0, y0], [x1, y1], [x2, y2], [x3, y3]] = quad;
        let (dx1, dx2, sx) = (x1 - x2, x3 - x2, x0 - x1 + x2 - x3);
        let (dy1, dy2, sy) = (y1 - y2, y3 - y2, y0 - y1 + y2 - y3);
        let determinant = dx1 * dy2 - dx2 * dy1;
        let g = (sx * dy2 - dx2 * sy) / determinant;
        let h = (dx1 * sy - sx * dy1) / determinant;
        let forward = [
            [(x1 - x0 + g * x1) / LAST, (x3 - x0 + h * x3) / LAST, x0],
            [(y1 - y0 + g * y1) / LAST, (y3 - y0 + h * y3) / LAST, y0],
            [g / LAST, h / LAST, 1.0],
        ];
        Self {
            forward,
            inverse: inverse(&forward),
        }
    }

    /// The pixel position of a point in panel coordinates, for instance `[2.0, 0.0]` for the third LED of the top row.
    #[inline]
    pub fn to_image(&self, panel: [f64; 2]) -> [f64; 2] {
        project(&self.forward, panel)
    }

    /// The panel coordinates of a pixel position.
    pub fn to_panel(&self, pixel: [f64; 2]) -> [f64; 2] {
        project(&self.inverse, pixel)
    }

    /// The rows of the matrix from (x, y, 1) to panel coordinates, with (`x`, `y`) as the new origin of pixels.
    pub(crate) fn inverse_from(&self, x: f64, y: f64) -> [[f32; 3]; 3] {
        let centre = project(&self.forward, [LAST / 2.0; 2]);
        let scale = 1.0 / (self.inverse[2][0] * centre[0] + self.inverse[2][1] * centre[1] + self.inverse[2][2]);
        self.inverse
            .map(|[a, b, c]| [a, b, a * x + b * y + c].map(|value| (value * scale) as f32))
    }

    /// The image of the panel's middle, the steps from there to the next LED in the row and in the column, and the growth of distance with
    /// these steps, as a share of the distance.
    pub(crate) fn about_middle(&self) -> [[f32; 2]; 4] {
        let middle = LAST / 2.0;
        let [x, y, [g, h, one]] = self.forward;
        let scale = 1.0 / (middle * (g + h) + one);
        let centre = self.to_image([middle; 2]);
        let step = |i: usize, tilt: f64| [x[i] - tilt * centre[0], y[i] - tilt * centre[1]];
        [
            centre,
            step(0, g).map(|c| c * scale),
            step(1, h).map(|c| c * scale),
            [g * scale, h * scale],
        ]
        .map(|pair| pair.map(|c| c as f32))
    }

    /// The outer corners of the cells at the panel's corners.
    pub(crate) fn outline(&self) -> [[f64; 2]; 4] {
        OUTLINE.map(|corner| self.to_image(corner))
    }

    fn is_before_the_horizon(&self) -> bool {
        let [g, h, one] = self.forward[2];
        OUTLINE.iter().all(|[u, v]| g * u + h * v + one > 0.0)
    }
}

/// The outer corners of the 8×8 cells in panel coordinates.
const OUTLINE: [[f64; 2]; 4] = [[-0.5, -0.5], [LAST + 0.5, -0.5], [LAST + 0.5, LAST + 0.5], [-0.5, LAST + 0.5]];

#[inline]
fn project(matrix: &[[f64; 3]; 3], [x, y]: [f64; 2]) -> [f64; 2] {
    let [px, py, w] = matrix.map(|[a, b, c]| a * x + b * y + c);
    [px / w, py / w]
}

/// The inverse up to a factor, by cofactors.
fn inverse([[a, b, c], [d, e, f], [g, h, i]]: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [
        [e * i - f * h, c * h - b * i, b * f - c * e],
        [f * g - d * i, a * i - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::orientation::Orientation;
    use properties::prelude::*;

    #[test]
    fn what_is_no_panel_is_refused() {
        let square = [[10.0, 10.0], [38.0, 10.0], [38.0, 38.0], [10.0, 38.0]];
        let [a, b, c, d] = square;
        assert_eq!(Corners::new([b, a, d, c]), Err(CornersError::Mirrored));
        assert!(matches!(Corners::new([a, c, b, d]), Err(CornersError::NotConvex { .. })));
        assert!(matches!(Corners::new([a, a, a, a]), Err(CornersError::NotConvex { .. })));
        assert!(matches!(
            Corners::new([a, b, [f32::NAN, 0.0], d]),
            Err(CornersError::NotFinite { corner: 2, .. })
        ));
        let tiny = square.map(|[x, y]| [x / 10.0, y / 10.0]);
        assert!(matches!(Corners::new(tiny), Err(CornersError::PitchTooSmall { .. })));
        let wedge = [[0.0, 0.0], [600.0, 294.0], [600.0, 306.0], [0.0, 600.0]];
        assert_eq!(Corners::new(wedge), Err(CornersError::TooOblique));
    }

    properties! {
        #[test]
        fn corners_and_leds_are_turned_alike(jitter in prop::array::uniform8(-4.0f32..4.0), quarter_turns in 0u8..4) {
            let square = [[10.0, 10.0], [52.0, 10.0], [52.0, 52.0], [10.0, 52.0]];
            let points = core::array::from_fn(|i| {
                let [x, y]: [f32; 2] = square[i];
                [x + jitter[2 * i], y + jitter[2 * i + 1]]
            });
            let seen = Corners::new(points).unwrap();
            let (orientation, upright) = (Orientation::new(quarter_turns, false), seen.upright(quarter_turns));
            for led in 0..64 {
                let at = |corners: &Corners, led: usize| corners.homography().to_image([(led % SIDE) as f64, (led / SIDE) as f64]);
                let (own, in_picture) = (at(&upright, led), at(&seen, orientation.place_of(led)));
                prop_assert!((own[0] - in_picture[0]).hypot(own[1] - in_picture[1]) < 1e-9);
            }
        }

        #[test]
        fn corners_go_where_they_were_said_to_be(jitter in prop::array::uniform8(-4.0f32..4.0)) {
            let square = [[10.0, 10.0], [52.0, 10.0], [52.0, 52.0], [10.0, 52.0]];
            let points = core::array::from_fn(|i| {
                let [x, y]: [f32; 2] = square[i];
                [x + jitter[2 * i], y + jitter[2 * i + 1]]
            });
            let homography = Corners::new(points).unwrap().homography();
            for (led, point) in [[0.0, 0.0], [7.0, 0.0], [7.0, 7.0], [0.0, 7.0]].into_iter().zip(points) {
                let there = homography.to_image(led);
                let back = homography.to_panel(there);
                for axis in 0..2 {
                    prop_assert!((there[axis] - f64::from(point[axis])).abs() < 1e-9);
                    prop_assert!((back[axis] - led[axis]).abs() < 1e-9);
                }
            }
        }

        #[test]
        fn no_four_points_panic(points in prop::array::uniform4(prop::array::uniform2(prop::num::f32::ANY))) {
            if let Ok(corners) = Corners::new(points) {
                prop_assert!(corners.pitch_px() >= MIN_PITCH_PX);
            }
        }
    }
}
