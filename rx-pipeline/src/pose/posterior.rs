//! The mean and covariance of all poses that explain the image of a plane, weighted by their likelihood.
//!
//! The image of a panel that is far away, or nearly faces the camera, hardly depends on its lean: it changes by the cosine, and hardly at
//! all between one lean and its opposite. A covariance from derivatives at one best pose can be wrong there by any factor. So the
//! likelihood of the lean is integrated over the sphere of directions, on a grid as fine as the likelihood is narrow. The other four
//! numbers are linear to the precision of the measurement, and are integrated in closed form (Laplace). The covariance is that of the
//! whole: if both leans are possible, it covers both. With a uniform prior of the normal's direction, mean errors agree with the covariance
//! at any range (a property of the posterior).

use nalgebra::{ArrayStorage, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::planar::{EDGE_ON, Matrix4, View, rotation_by, rotation_vector};
use super::plane::{Matrix8, Vector8};
use super::{PlaneFit, Pose, PoseError, Solution};

/// The most nodes of a grid from its middle along one side.
const HALF: usize = 16;
const SIDE: usize = 2 * HALF + 1;
/// Nodes across a grid that spans both solutions, from its middle.
const ACROSS: usize = 8;
/// The distance of nodes about one solution, in standard deviations: sums over a normal are exact to 10⁻⁸ up to 1.2.
const APART: f64 = 0.8;
/// Nodes of both grids.
const NODES: usize = 2 * SIDE * SIDE;
/// The loss of log-likelihood, relative to the best node, at which a node is left out: five standard deviations.
const NEGLIGIBLE: f64 = 12.5;
/// Half the squared misfit of a square lattice to a plane's image: 1 of 1000 exceed it by chance.
const MISFIT: f64 = 6.9;

/// A node of the grid.
#[derive(Clone, Copy)]
struct Node {
    view: View,
    /// Covariance of centre and size for this lean.
    spread: Matrix4,
    /// Logarithm of the weight.
    weight: f64,
}

impl Node {
    const NONE: Self = Self {
        view: View {
            centre: [0.0; 2],
            size: [0.0; 2],
            lean: [0.0; 2],
        },
        spread: Matrix4::from_array_storage(ArrayStorage([[0.0; 4]; 4])),
        weight: 0.0,
    };
}

/// Memory for the poses on the grid: 0.5 MB.
pub(super) struct Posterior {
    nodes: [Node; NODES],
    count: usize,
}

/// A parallelogram of leans.
struct Area {
    middle: Vector2<f64>,
    /// Half its sides, and the nodes along them.
    sides: [Vector2<f64>; 2],
    steps: [usize; 2],
    view: View,
}

impl Posterior {
    pub const EMPTY: Self = Self {
        nodes: [Node::NONE; NODES],
        count: 0,
    };

    /// The pose of a square of `half_side_m`, from the measured image and its information.
    pub fn pose(&mut self, fit: &PlaneFit, half_side_m: f64) -> Result<Pose, PoseError> {
        let seen = fit.image.vector();
        let information = Matrix8::from_fn(|i, j| fit.information[i][j]);
        let modes = View::both(&fit.image).map(|start| start.settled(&seen, &information));
        let least = modes[0].1.min(modes[1].1);
        if !least.is_finite() {
            return Err(PoseError::Singular);
        }
        // A misfit beyond chance has another cause than noise. That cause is assumed to have the same part in all numbers.
        let misfit = (least / MISFIT).max(1.0);
        let inflation = if misfit > 1.0 { least } else { 1.0 };
        let information = information / inflation;
        self.count = 0;
        let face_on = View {
            lean: [0.0; 2],
            ..modes[0].0
        }
        .for_lean(&seen, &information)
        .0;
        let apart = face_on.cost(&seen, &information) - least / inflation;
        let look = Measurement {
            seen: &seen,
            information: &information,
            least: least / inflation,
        };
        if apart < NEGLIGIBLE {
            let area = look.around_both(&modes.map(|(view, ..)| view), face_on);
            self.fill(&look, &area);
        } else {
            for (view, cost, spread) in &modes {
                if (cost - least) / inflation < NEGLIGIBLE {
                    let area = look.around(*view, spread * inflation);
                    self.fill(&look, &area);
                }
            }
        }
        self.summary(half_side_m, modes.map(|(view, ..)| view), inflation)
    }

    fn fill(&mut self, look: &Measurement<'_>, area: &Area) {
        let half = area.steps.map(|count| count as f64);
        let covered = area.sides[0].perp(&area.sides[1]).abs();
        let cell = (covered / (half[0] * half[1])).max(f64::MIN_POSITIVE);
        let columns = 2 * area.steps[0] + 1;
        for place in 0..columns * (2 * area.steps[1] + 1) {
            let [along, across] = [place % columns, place / columns].map(|i| i as f64);
            let lean = area.middle + area.sides[0] * (along / half[0] - 1.0) + area.sides[1] * (across / half[1] - 1.0);
            if lean.norm() >= EDGE_ON {
                continue;
            }
            let start = View {
                lean: [lean.x, lean.y],
                ..area.view
            };
            let (view, curvature) = start.for_lean(look.seen, look.information);
            let worse = view.cost(look.seen, look.information) - look.least;
            let Some(spread) = curvature.cholesky() else {
                continue;
            };
            if worse.is_nan() || worse > NEGLIGIBLE || self.count == NODES {
                continue;
            }
            let weight = libm::log(cell) - worse - 0.5 * libm::log(spread.determinant());
            self.nodes[self.count] = Node {
                view,
                spread: spread.inverse(),
                weight,
            };
            self.count += 1;
        }
    }

    /// Mean and covariance of all nodes, and the share of each of the two solutions.
    fn summary(&mut self, half_side_m: f64, modes: [View; 2], inflation: f64) -> Result<Pose, PoseError> {
        let nodes = &mut self.nodes[..self.count];
        let most = nodes.iter().fold(f64::NEG_INFINITY, |most, node| most.max(node.weight));
        if !most.is_finite() {
            return Err(PoseError::Singular);
        }
        let (mut total, mut shares, mut mean) = (0.0, [0.0; 2], Vector3::zeros());
        for node in nodes.iter_mut() {
            node.weight = libm::exp(node.weight - most);
            let off = modes.map(|mode| libm::hypot(node.view.lean[0] - mode.lean[0], node.view.lean[1] - mode.lean[1]));
            total += node.weight;
            shares[usize::from(off[1] < off[0])] += node.weight;
            mean += node.view.translation_m(half_side_m) * node.weight;
        }
        let translation = mean / total;
        let best = usize::from(shares[1] > shares[0]);
        let rotation = mean_rotation(nodes, modes[best].rotation(), total);
        let mut covariance = SMatrix::<f64, 6, 6>::zeros();
        for node in nodes.iter() {
            let shift = node.view.translation_m(half_side_m) - translation;
            let turn = rotation_vector(&(node.view.rotation() * rotation.transpose()));
            let off = SVector::<f64, 6>::from([shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]);
            let moves = node.view.moves(half_side_m);
            let within = moves * node.spread * moves.transpose();
            covariance += (off * off.transpose() + within) * (node.weight / total);
        }
        if covariance.iter().any(|c| !c.is_finite()) {
            return Err(PoseError::Singular);
        }
        let solutions = [best, 1 - best].map(|i| Solution {
            rotation: rows(&modes[i].rotation()),
            range_m: half_side_m / modes[i].nearness(),
            probability: shares[i] / total,
        });
        Ok(Pose {
            translation_m: translation.data.0[0],
            rotation: rows(&rotation),
            covariance: covariance.transpose().data.0,
            solutions,
            inflation,
        })
    }
}

/// The measurement to compare poses with.
struct Measurement<'a> {
    seen: &'a Vector8,
    information: &'a Matrix8,
    /// Cost of the best.
    least: f64,
}

impl Measurement<'_> {
    fn worse(&self, near: &View, lean: Vector2<f64>) -> f64 {
        let start = View {
            lean: [lean.x, lean.y],
            ..*near
        };
        let (view, _) = start.for_lean(self.seen, self.information);
        let cost = view.cost(self.seen, self.information);
        if cost.is_nan() { f64::INFINITY } else { cost - self.least }
    }

    /// The reach of significant poses along `side`, in its lengths, at most to edge on.
    fn reach(&self, near: &View, from: Vector2<f64>, side: Vector2<f64>) -> f64 {
        const GROWTH: f64 = 1.25;
        let mut reach = 1.0;
        // A hundred steps reach beyond edge on from anywhere.
        for _ in 0..100 {
            let there = from + side * reach;
            if there.norm() >= EDGE_ON || self.worse(near, there) > NEGLIGIBLE {
                break;
            }
            reach *= GROWTH;
        }
        reach
    }

    /// The area of significant leans near one solution.
    fn around(&self, view: View, spread: Matrix2<f64>) -> Area {
        let from = Vector2::from(view.lean);
        let own = spread.symmetric_eigen();
        let (mut middle, mut steps) = (from, [0; 2]);
        let sides = [0, 1].map(|i| {
            let deviation = libm::sqrt(own.eigenvalues[i].max(1e-30)).min(EDGE_ON);
            let side = own.eigenvectors.column(i) * deviation;
            let (ahead, behind) = (self.reach(&view, from, side), self.reach(&view, from, -side));
            middle += side * ((ahead - behind) / 2.0);
            let half = (ahead + behind) / 2.0;
            steps[i] = (libm::ceil(half / APART) as usize).clamp(1, HALF);
            side * half
        });
        Area {
            middle,
            sides,
            steps,
            view,
        }
    }

    /// The area of significant leans that spans both solutions.
    fn around_both(&self, modes: &[View; 2], face_on: View) -> Area {
        const SMALL: f64 = 1e-4;
        let between = (Vector2::from(modes[0].lean) - Vector2::from(modes[1].lean)) / 2.0;
        let along = if between.norm() > SMALL {
            between.normalize()
        } else {
            Vector2::x()
        };
        let across = Vector2::new(-along.y, along.x);
        let mut middle = Vector2::zeros();
        let sides = [along, across].map(|direction| {
            let side = direction * SMALL;
            let ends = [1.0, -1.0].map(|sign| {
                let starts = modes.iter().chain([&face_on]).map(|view| Vector2::from(view.lean));
                let end = |from: Vector2<f64>| sign * from.dot(&direction) + SMALL * self.reach(&face_on, from, side * sign);
                starts.map(end).fold(0.0, f64::max)
            });
            middle += direction * ((ends[0] - ends[1]) / 2.0);
            direction * ((ends[0] + ends[1]) / 2.0)
        });
        Area {
            middle,
            sides,
            steps: [HALF, ACROSS],
            view: face_on,
        }
    }
}

/// The rotation from which the average deviation of the others is 0.
fn mean_rotation(nodes: &[Node], start: Matrix3<f64>, total: f64) -> Matrix3<f64> {
    const ROUNDS: usize = 4;
    /// In radians.
    const SETTLED: f64 = 1e-4;
    let mut mean = start;
    for _ in 0..ROUNDS {
        let turns = nodes
            .iter()
            .map(|node| rotation_vector(&(node.view.rotation() * mean.transpose())) * node.weight);
        let turn = turns.sum::<Vector3<f64>>() / total;
        mean = rotation_by(&turn) * mean;
        if turn.norm() < SETTLED {
            break;
        }
    }
    mean
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    matrix.transpose().data.0
}
