//! The pose of a square lattice with a known image: six numbers, and the two poses that fit best.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};

use super::plane::{Matrix8, PlaneImage, Vector8};

/// A pose in parameters in which the image of a plane is nearly linear.
///
/// The panel's normal leans from the line of sight by an angle θ towards a direction d across that line. `lean` is 2·sin(θ/2)·d, so that
/// equal areas of it are equal parts of all directions (Lambert 1772). The image of a panel that leans by −d is nearly the same, and more
/// nearly the farther it is: the two-fold ambiguity (Schweighofer & Pinz 2006; Collins & Bartoli 2014).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// The direction (x, y, 1) of the panel's middle.
    pub centre: [f64; 2],
    /// Its half side over its range, turned by the spin in its own plane: m·(cos, sin).
    pub size: [f64; 2],
    /// Its lean.
    pub lean: [f64; 2],
}

/// The limit of [`View::lean`]: a panel seen edge on.
pub(super) const EDGE_ON: f64 = core::f64::consts::SQRT_2;

/// Numbers of a [`View`] for a given lean: centre and size.
pub(super) type Matrix4 = SMatrix<f64, 4, 4>;

impl View {
    /// The rotation from the panel's axes to the camera's.
    pub fn rotation(&self) -> Matrix3<f64> {
        let [cos, sin] = {
            let size = self.nearness();
            self.size.map(|c| c / size)
        };
        let spin = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        sight(self.centre) * leaning(self.lean) * spin
    }

    /// The panel's half side over its range.
    pub fn nearness(&self) -> f64 {
        libm::hypot(self.size[0], self.size[1])
    }

    /// The position of the panel's middle, for a half side of `half_side_m`.
    pub fn translation_m(&self, half_side_m: f64) -> Vector3<f64> {
        let direction = Vector3::new(self.centre[0], self.centre[1], 1.0).normalize();
        direction * (half_side_m / self.nearness())
    }

    /// The image of the panel's plane.
    pub fn image(&self) -> Vector8 {
        let turn = sight(self.centre) * leaning(self.lean);
        self.image_turned(&turn)
    }

    /// The same, given the panel's axes except for its spin.
    fn image_turned(&self, turn: &Matrix3<f64>) -> Vector8 {
        let [x, y] = self.centre;
        let [cos, sin] = self.size;
        // The range of the middle over its depth.
        let stretch = libm::sqrt(1.0 + x * x + y * y);
        let column = (turn.column(0) * cos + turn.column(1) * sin) * stretch;
        let row = (turn.column(1) * cos - turn.column(0) * sin) * stretch;
        Vector8::from([
            x,
            y,
            column.x - column.z * x,
            column.y - column.z * y,
            row.x - row.z * x,
            row.y - row.z * y,
            column.z,
            row.z,
        ])
    }

    /// The derivatives of the image by centre, size and lean.
    fn slopes(&self) -> SMatrix<f64, 8, 6> {
        const STEP: f64 = 1e-5;
        let step = [STEP, STEP, STEP * self.nearness(), STEP * self.nearness(), STEP, STEP];
        SMatrix::from_columns(&core::array::from_fn::<Vector8, 6, _>(|number| {
            let moved = |by: f64| {
                let mut numbers = self.numbers();
                numbers[number] += by;
                Self::of_numbers(&numbers).image()
            };
            (moved(step[number]) - moved(-step[number])) / (2.0 * step[number])
        }))
    }

    fn numbers(&self) -> [f64; 6] {
        let ([a, b], [c, d], [e, f]) = (self.centre, self.size, self.lean);
        [a, b, c, d, e, f]
    }

    fn of_numbers(&[a, b, c, d, e, f]: &[f64; 6]) -> Self {
        Self {
            centre: [a, b],
            size: [c, d],
            lean: [e, f],
        }
    }

    /// The loss: half the squared distance of its image from the measured one, in standard deviations.
    pub fn cost(&self, seen: &Vector8, information: &Matrix8) -> f64 {
        let off = seen - self.image();
        0.5 * (off.transpose() * information * off).x
    }

    /// The two views that the image of a plane allows (Collins & Bartoli 2014): by the parallel projection along the line of sight.
    pub fn both(plane: &PlaneImage) -> [Self; 2] {
        let to_sight = sight(plane.centre).transpose();
        let [x, y] = plane.centre;
        let stretch = libm::sqrt(1.0 + x * x + y * y);
        let along = |step: [f64; 2], tilt: f64| {
            let axis = Vector3::new(step[0] + tilt * x, step[1] + tilt * y, tilt);
            let seen = to_sight * axis / stretch;
            [seen.x, seen.y]
        };
        let (column, row) = (along(plane.column, plane.tilt[0]), along(plane.row, plane.tilt[1]));
        let seen = Matrix2::new(column[0], row[0], column[1], row[1]);
        // seen = m·lean·spin, and the lean shortens one direction by cos θ: its square determines both.
        let square = seen * seen.transpose();
        let (half, product) = (square.trace() / 2.0, square.determinant());
        let root = libm::sqrt((half * half - product).max(0.0));
        let (long, short) = (libm::sqrt(half + root), libm::sqrt((half - root).max(0.0)));
        let cos = (short / long).clamp(0.0, 1.0);
        let towards = 0.5 * libm::atan2(2.0 * square.m12, square.m11 - square.m22) + core::f64::consts::FRAC_PI_2;
        let length = libm::sqrt(2.0 * (1.0 - cos));
        let lean = [length * libm::cos(towards), length * libm::sin(towards)];
        [lean, lean.map(|c| -c)].map(|lean| {
            let straight = leaning(lean);
            // The spin that remains without the lean, by least squares.
            let flat = straight.fixed_view::<2, 2>(0, 0).transpose() * seen;
            let spin = libm::atan2(flat.m21 - flat.m12, flat.m11 + flat.m22);
            Self {
                centre: plane.centre,
                size: [long * libm::cos(spin), long * libm::sin(spin)],
                lean,
            }
        })
    }

    /// The best view nearby (Levenberg 1944; Marquardt 1963), its cost, and the covariance of its lean.
    pub fn settled(mut self, seen: &Vector8, information: &Matrix8) -> (Self, f64, Matrix2<f64>) {
        const STEPS: usize = 40;
        const SETTLED: f64 = 1e-9;
        const STUCK: f64 = 1e8;
        let mut cost = self.cost(seen, information);
        let mut damping = 1e-4;
        let mut curvature = SMatrix::<f64, 6, 6>::identity();
        for _ in 0..STEPS {
            let slopes = self.slopes();
            let weighted = slopes.transpose() * information;
            curvature = weighted * slopes;
            let downhill = weighted * (seen - self.image());
            let mut settled = false;
            while damping < STUCK {
                let mut damped = curvature;
                for i in 0..6 {
                    damped[(i, i)] *= 1.0 + damping;
                }
                let Some(step) = damped.cholesky().map(|c| c.solve(&downhill)) else {
                    damping *= 10.0;
                    continue;
                };
                let numbers = self.numbers();
                let next = Self::of_numbers(&core::array::from_fn(|i| numbers[i] + step[i]));
                let after = next.cost(seen, information);
                if libm::hypot(next.lean[0], next.lean[1]) < EDGE_ON && after <= cost {
                    settled = cost - after < SETTLED;
                    (self, cost) = (next, after);
                    damping = (damping * 0.1).max(1e-12);
                    break;
                }
                damping *= 10.0;
            }
            if settled || damping >= STUCK {
                break;
            }
        }
        let spread = curvature.try_inverse().unwrap_or_default();
        (self, cost, spread.fixed_view::<2, 2>(4, 4).into_owned())
    }

    /// The best centre and size for this lean, and their information.
    pub fn for_lean(mut self, seen: &Vector8, information: &Matrix8) -> (Self, Matrix4) {
        const ROUNDS: usize = 2;
        const STEP: f64 = 1e-5;
        let lean = leaning(self.lean);
        let mut curvature = Matrix4::identity();
        for _ in 0..ROUNDS {
            let turn = sight(self.centre) * lean;
            let of = |view: &Self, turn: &Matrix3<f64>| view.image_turned(turn);
            let moved = |axis: usize, by: f64| {
                let mut view = self;
                view.centre[axis] += by;
                of(&view, &(sight(view.centre) * lean))
            };
            let along = |axis: usize| (moved(axis, STEP) - moved(axis, -STEP)) / (2.0 * STEP);
            let here = of(&self, &turn);
            // The image is linear in the size.
            let sized = |size: [f64; 2]| {
                let mut slope = of(&Self { size, ..self }, &turn);
                (slope[0], slope[1]) = (0.0, 0.0);
                slope
            };
            let slopes = SMatrix::<f64, 8, 4>::from_columns(&[along(0), along(1), sized([1.0, 0.0]), sized([0.0, 1.0])]);
            let weighted = slopes.transpose() * information;
            curvature = weighted * slopes;
            let step = curvature.cholesky().map(|c| c.solve(&(weighted * (seen - here))));
            let Some(step) = step else { break };
            for axis in 0..2 {
                self.centre[axis] += step[axis];
                self.size[axis] += step[2 + axis];
            }
        }
        (self, curvature)
    }

    /// The derivatives of translation and rotation vector by centre and size, for a given lean.
    pub fn moves(&self, half_side_m: f64) -> SMatrix<f64, 6, 4> {
        const STEP: f64 = 1e-5;
        let [cos, sin] = self.size.map(|c| c / self.nearness());
        let of_centre = |axis: usize| {
            let moved = |by: f64| {
                let mut view = *self;
                view.centre[axis] += by;
                (view.translation_m(half_side_m), sight(view.centre))
            };
            let ((ahead, to), (behind, from)) = (moved(STEP), moved(-STEP));
            let turn = rotation_vector(&(to * from.transpose()));
            ((ahead - behind) / (2.0 * STEP), turn / (2.0 * STEP))
        };
        // A larger panel is nearer, and spin rotates it about its own normal.
        let translation = self.translation_m(half_side_m) / self.nearness();
        let normal = (sight(self.centre) * leaning(self.lean)).column(2) / self.nearness();
        let columns = [
            of_centre(0),
            of_centre(1),
            (-translation * cos, -normal * sin),
            (-translation * sin, normal * cos),
        ];
        SMatrix::from_columns(&columns.map(|(shift, turn)| SVector::<f64, 6>::from([shift.x, shift.y, shift.z, turn.x, turn.y, turn.z])))
    }
}

/// The shortest rotation from the optical axis to the direction (x, y, 1).
fn sight([x, y]: [f64; 2]) -> Matrix3<f64> {
    let length = libm::sqrt(1.0 + x * x + y * y);
    let [x, y, z] = [x / length, y / length, 1.0 / length];
    let share = 1.0 / (1.0 + z);
    Matrix3::new(
        1.0 - x * x * share,
        -x * y * share,
        x,
        -x * y * share,
        1.0 - y * y * share,
        y,
        -x,
        -y,
        z,
    )
}

/// The rotation that leans the axis z by `lean`, see [`View`].
fn leaning(lean: [f64; 2]) -> Matrix3<f64> {
    let [x, y] = lean.map(|c| c / 2.0);
    let cos = libm::sqrt((1.0 - x * x - y * y).max(0.0));
    Matrix3::new(
        1.0 - 2.0 * x * x,
        -2.0 * x * y,
        2.0 * x * cos,
        -2.0 * x * y,
        1.0 - 2.0 * y * y,
        2.0 * y * cos,
        -2.0 * x * cos,
        -2.0 * y * cos,
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// The rotation vector of a rotation: its axis, as long as its angle in radians.
pub(super) fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let twice = Vector3::new(
        rotation.m32 - rotation.m23,
        rotation.m13 - rotation.m31,
        rotation.m21 - rotation.m12,
    );
    let (sin, cos) = (twice.norm() / 2.0, (rotation.trace() - 1.0) / 2.0);
    let angle = libm::atan2(sin, cos);
    twice * if sin > 1e-9 { angle / (2.0 * sin) } else { 0.5 }
}

/// The rotation of a rotation vector (Rodrigues 1840).
pub(super) fn rotation_by(vector: &Vector3<f64>) -> Matrix3<f64> {
    let angle = vector.norm();
    let cross = vector.cross_matrix();
    let (first, second) = if angle > 1e-6 {
        (libm::sin(angle) / angle, (1.0 - libm::cos(angle)) / (angle * angle))
    } else {
        (1.0, 0.5)
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn views() -> impl Strategy<Value = View> {
        let centre = prop::array::uniform2(-0.4f64..0.4);
        let polar = |least: f64, most: f64| (least..most, -3.1f64..3.1);
        (centre, polar(0.001, 0.1), polar(0.05, 1.2)).prop_map(|(centre, size, lean)| {
            let pair = |(r, phi): (f64, f64)| [r * libm::cos(phi), r * libm::sin(phi)];
            View {
                centre,
                size: pair(size),
                lean: pair(lean),
            }
        })
    }

    properties! {
        #[test]
        fn its_own_image_gives_a_view_back(view in views()) {
            let seen = view.image();
            let information = Matrix8::identity() * 1e12;
            let plane = PlaneImage::of_vector(&seen);
            let settled = View::both(&plane).map(|start| start.settled(&seen, &information));
            let best = if settled[0].1 < settled[1].1 { settled[0].0 } else { settled[1].0 };
            let off = (best.rotation() - view.rotation()).norm();
            prop_assert!(off < 1e-4, "{best:?} {view:?} {settled:?}");
            prop_assert!((best.translation_m(1.0) - view.translation_m(1.0)).norm() < 1e-5 / view.nearness());
        }

        #[test]
        fn the_image_is_that_of_the_turned_square(view in views(), u in -1.0f64..1.0, v in -1.0f64..1.0) {
            let point = view.rotation() * Vector3::new(u, v, 0.0) + view.translation_m(1.0);
            let seen = PlaneImage::of_vector(&view.image()).direction([u, v]);
            prop_assert!((point.x / point.z - seen[0]).abs() < 1e-12 && (point.y / point.z - seen[1]).abs() < 1e-12);
        }

        #[test]
        fn moves_are_those_of_pose(view in views(), number in 0usize..4) {
            const STEP: f64 = 1e-6;
            let moved = |by: f64| {
                let mut numbers = view.numbers();
                numbers[number] += by * if number < 2 { 1.0 } else { view.nearness() };
                View::of_numbers(&numbers)
            };
            let (ahead, behind) = (moved(STEP), moved(-STEP));
            let step = 2.0 * STEP * if number < 2 { 1.0 } else { view.nearness() };
            let shift = (ahead.translation_m(1.0) - behind.translation_m(1.0)) / step;
            let turn = rotation_vector(&(ahead.rotation() * behind.rotation().transpose())) / step;
            let moves = view.moves(1.0);
            // Small numbers change the square hardly more than the step's rounding.
            let least_turn = 1e-3 * if number < 2 { 1.0 } else { 1.0 / view.nearness() };
            let least_shift = least_turn / view.nearness();
            let off = (moves.fixed_view::<3, 1>(0, number) - shift).norm() / shift.norm().max(least_shift)
                + (moves.fixed_view::<3, 1>(3, number) - turn).norm() / turn.norm().max(least_turn);
            prop_assert!(off < 1e-6, "{off}");
        }

        #[test]
        fn a_rotation_vector_is_its_rotation_s(vector in prop::array::uniform3(-1.7f64..1.7)) {
            let vector = Vector3::from(vector);
            prop_assert!((rotation_vector(&rotation_by(&vector)) - vector).norm() < 1e-9);
        }
    }
}
