//! The rigid motion that lays one surface on another.

use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

use super::{Fit, Nearest};
use crate::Mesh;

/// Points that take part: more make it no better.
const MOST_POINTS: usize = 4000;
const STEPS: usize = 60;
/// The first look from many starts: points, steps, and how many of them are looked at again.
const FEW_POINTS: usize = 400;
const FEW_STEPS: usize = 12;
const FINALISTS: usize = 3;
/// Rounds of the robust fit, each with the spread that the last one left.
const ROBUST_ROUNDS: usize = 5;
/// Where Tukey's biweight ends, in standard deviations; and the median magnitude of a normal variable of deviation one.
const TUKEY: f64 = 4.685;
const NORMAL_MEDIAN: f64 = 0.6745;

/// The direction in which a surface extends most, and its ends.
pub(super) struct Axis {
    pub(super) centre: Vector3<f64>,
    pub(super) along: Vector3<f64>,
    pub(super) ends: (f64, f64),
}

impl Axis {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let centre = centre(mesh);
        let along = principal(mesh, &centre).column(0).into_owned();
        let places = mesh.points.iter().map(|p| along.dot(&(p - centre)));
        let ends = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        Self { centre, along, ends }
    }

    /// Whether a point lies between the ends.
    pub(super) fn is_beside(&self, point: &Vector3<f64>) -> bool {
        (self.ends.0..=self.ends.1).contains(&self.along.dot(&(point - self.centre)))
    }
}

/// Centre of gravity of the surface: of its area, so that unequal triangles do not move it.
fn centre(mesh: &Mesh) -> Vector3<f64> {
    let (mut sum, mut total) = (Vector3::zeros(), 1e-30);
    for triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(triangle);
        let area = (b - a).cross(&(c - a)).norm();
        sum += (a + b + c) / 3.0 * area;
        total += area;
    }
    sum / total
}

/// Its principal axes, the longest first, right-handed.
fn principal(mesh: &Mesh, centre: &Vector3<f64>) -> Matrix3<f64> {
    let mut scatter = Matrix3::zeros();
    for triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(triangle);
        let (area, off) = ((b - a).cross(&(c - a)).norm(), (a + b + c) / 3.0 - centre);
        scatter += off * off.transpose() * area;
    }
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let (x, y) = (eigen.eigenvectors.column(order[0]), eigen.eigenvectors.column(order[1]));
    Matrix3::from_columns(&[x.into_owned(), y.into_owned(), x.cross(&y)])
}

/// The motion of `surface` that makes its distances from `gold` smallest.
pub(super) fn rigid(surface: &Mesh, gold: &Mesh, on_gold: &Nearest<'_>, fit: Fit) -> Isometry3<f64> {
    let problem = |most: usize| {
        let every = surface.points.len().div_ceil(most);
        Problem { points: surface.points.iter().copied().step_by(every).collect(), gold, on_gold }
    };
    let starts = match fit {
        Fit::None => return Isometry3::identity(),
        Fit::Near => vec![Isometry3::identity()],
        Fit::Rigid => starts(surface, gold),
        Fit::Icp => return icp(&problem(MOST_POINTS), &problem(FEW_POINTS), shifted(surface, gold)),
    };
    let problem = problem(MOST_POINTS);
    let fitted = starts.into_iter().map(|start| problem.refine(start, Loss::Square, STEPS));
    let best = fitted.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Isometry3::identity, |(pose, _)| pose)
}

/// The best of many starts with few points, then with all of them and robustly: what lies farther off than speckle
/// and poses explain loses its weight.
fn icp(all: &Problem<'_>, few: &Problem<'_>, starts: Vec<Isometry3<f64>>) -> Isometry3<f64> {
    let coarse = starts.into_iter().map(|start| {
        let (pose, _) = few.refine(start, Loss::Square, FEW_STEPS);
        (pose, few.median(&pose))
    });
    let mut coarse: Vec<_> = coarse.collect();
    coarse.sort_by(|a, b| a.1.total_cmp(&b.1));
    let fine = coarse.into_iter().take(FINALISTS).map(|(pose, _)| {
        let mut pose = all.refine(pose, Loss::Square, STEPS).0;
        for _ in 0..ROBUST_ROUNDS {
            let loss = Loss::Tukey(TUKEY * (all.median(&pose) / NORMAL_MEDIAN).max(1e-7));
            pose = all.refine(pose, loss, STEPS).0;
        }
        (pose, all.median(&pose))
    });
    fine.min_by(|a, b| a.1.total_cmp(&b.1)).map_or_else(Isometry3::identity, |(pose, _)| pose)
}

/// Centre on centre: as turned as it is, and axes on axes in the four ways that a body can lie.
fn starts(surface: &Mesh, gold: &Mesh) -> Vec<Isometry3<f64>> {
    let (from, to) = (centre(surface), centre(gold));
    let (a, b) = (principal(surface, &from), principal(gold, &to));
    let turns = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[x, y]| {
        let turn = b * Matrix3::from_diagonal(&Vector3::new(x, y, x * y)) * a.transpose();
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn))
    });
    let turns = std::iter::once(UnitQuaternion::identity()).chain(turns);
    turns.map(|turn| Isometry3::from_parts(Translation3::from(to - turn * from), turn)).collect()
}

/// The same, and moved along the gold standard by what it is longer: a scan may be of any part of it.
fn shifted(surface: &Mesh, gold: &Mesh) -> Vec<Isometry3<f64>> {
    let length = |mesh: &Mesh| {
        let axis = Axis::of(mesh);
        (axis.along, axis.ends.1 - axis.ends.0)
    };
    let ((_, own), (along, whole)) = (length(surface), length(gold));
    let spare = (whole - own).max(0.0);
    let parts: &[f64] = if spare > 0.1 * whole { &[-0.5, -0.25, 0.0, 0.25, 0.5] } else { &[0.0] };
    let moved = |start: Isometry3<f64>| {
        parts.iter().map(move |part| Translation3::from(along * (part * spare)) * start)
    };
    starts(surface, gold).into_iter().flat_map(moved).collect()
}

/// What a distance costs.
#[derive(Clone, Copy)]
enum Loss {
    /// Its square.
    Square,
    /// Tukey's biweight: nothing more beyond this distance (m).
    Tukey(f64),
}

impl Loss {
    /// The cost of a distance, and the weight that makes least squares of it.
    fn of(self, distance: f64) -> (f64, f64) {
        match self {
            Self::Square => (distance * distance, 1.0),
            Self::Tukey(reach) => {
                let rest = (1.0 - (distance / reach).powi(2)).max(0.0);
                (reach * reach / 3.0 * (1.0 - rest.powi(3)), rest * rest)
            }
        }
    }
}

/// Points that are to be laid on a surface.
struct Problem<'a> {
    points: Vec<Vector3<f64>>,
    gold: &'a Mesh,
    on_gold: &'a Nearest<'a>,
}

/// Matrix, right-hand side, and the centre that the rotation is about.
type Equations = (Matrix6<f64>, Vector6<f64>, Vector3<f64>);

impl Problem<'_> {
    fn moved(&self, pose: &Isometry3<f64>) -> Vec<Vector3<f64>> {
        self.points.iter().map(|p| pose.transform_point(&(*p).into()).coords).collect()
    }

    /// The median distance (m).
    fn median(&self, pose: &Isometry3<f64>) -> f64 {
        let near = self.on_gold.to_each(&self.moved(pose));
        let mut distances: Vec<f64> = near.iter().map(|closest| closest.distance).collect();
        let half = distances.len() / 2;
        distances.sort_by(f64::total_cmp);
        distances.get(half).copied().unwrap_or(0.0)
    }

    /// Gauss-Newton on the distances to the planes of the closest triangles (Chen and Medioni 1992), damped; and the
    /// mean cost it ends with.
    fn refine(&self, start: Isometry3<f64>, loss: Loss, steps: usize) -> (Isometry3<f64>, f64) {
        let (mut pose, mut damping) = (start, 1e-6);
        let (mut cost, mut equations) = self.linearised(&pose, loss);
        for _ in 0..steps {
            let (matrix, right, centre) = &equations;
            let damped =
                matrix + Matrix6::from_diagonal(&matrix.diagonal()) * damping + Matrix6::identity() * 1e-12;
            let Some(solved) = damped.cholesky() else { break };
            let step = solved.solve(right);
            let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(3).into_owned());
            let shift = centre - turn * centre + step.fixed_rows::<3>(0);
            let next = Isometry3::from_parts(Translation3::from(shift), turn) * pose;
            let (next_cost, next_equations) = self.linearised(&next, loss);
            if next_cost < cost {
                let small = cost - next_cost < 1e-9 * cost;
                (pose, cost, equations, damping) = (next, next_cost, next_equations, damping * 0.3);
                if small {
                    break;
                }
            } else if damping > 1e3 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        (pose, cost)
    }

    fn linearised(&self, pose: &Isometry3<f64>, loss: Loss) -> (f64, Equations) {
        let n = self.points.len().max(1) as f64;
        let moved = self.moved(pose);
        let centre = moved.iter().sum::<Vector3<f64>>() / n;
        let (mut matrix, mut right, mut total) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        for (place, closest) in moved.iter().zip(self.on_gold.to_each(&moved)) {
            let (cost, weight) = loss.of(closest.distance);
            total += cost / n;
            let Some(triangle) = self.gold.triangles.get(closest.triangle) else { continue };
            let [a, b, c] = self.gold.corners(triangle);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-30) else { continue };
            let moment = (place - centre).cross(&normal);
            let row = Vector6::new(normal.x, normal.y, normal.z, moment.x, moment.y, moment.z);
            matrix += row * row.transpose() * weight;
            right -= row * (normal.dot(&(place - closest.point)) * weight);
        }
        (total, (matrix, right, centre))
    }
}
