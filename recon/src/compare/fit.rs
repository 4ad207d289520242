//! The rigid motion that lays one surface on another.

use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;

use super::{Fit, Nearest};
use crate::Mesh;

/// Points that take part: more make it no better.
const MOST_POINTS: usize = 4000;
const STEPS: usize = 60;

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
    let every = surface.points.len().div_ceil(MOST_POINTS);
    let points: Vec<Vector3<f64>> = surface.points.iter().copied().step_by(every).collect();
    let starts = match fit {
        Fit::None => return Isometry3::identity(),
        Fit::Near => vec![Isometry3::identity()],
        Fit::Rigid => starts(surface, gold),
    };
    let fitted = starts.into_iter().map(|start| refine(&points, gold, on_gold, start));
    let best = fitted.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Isometry3::identity, |(pose, _)| pose)
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

/// Gauss-Newton on the distances to the planes of the closest triangles (Chen and Medioni 1992), damped; and the mean
/// square distance it ends with.
fn refine(
    points: &[Vector3<f64>],
    gold: &Mesh,
    on_gold: &Nearest<'_>,
    start: Isometry3<f64>,
) -> (Isometry3<f64>, f64) {
    let (mut pose, mut damping) = (start, 1e-6);
    let (mut square, mut equations) = linearised(points, gold, on_gold, &pose);
    for _ in 0..STEPS {
        let (matrix, right, centre) = &equations;
        let damped =
            matrix + Matrix6::from_diagonal(&matrix.diagonal()) * damping + Matrix6::identity() * 1e-12;
        let Some(solved) = damped.cholesky() else { break };
        let step = solved.solve(right);
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(3).into_owned());
        let shift = centre - turn * centre + step.fixed_rows::<3>(0);
        let next = Isometry3::from_parts(Translation3::from(shift), turn) * pose;
        let (next_square, next_equations) = linearised(points, gold, on_gold, &next);
        if next_square < square {
            let small = square - next_square < 1e-9 * square;
            (pose, square, equations, damping) = (next, next_square, next_equations, damping * 0.3);
            if small {
                break;
            }
        } else if damping > 1e3 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    (pose, square)
}

/// Matrix, right-hand side, and the centre that the rotation is about.
type Equations = (Matrix6<f64>, Vector6<f64>, Vector3<f64>);

fn linearised(
    points: &[Vector3<f64>],
    gold: &Mesh,
    on_gold: &Nearest<'_>,
    pose: &Isometry3<f64>,
) -> (f64, Equations) {
    let n = points.len().max(1) as f64;
    let moved: Vec<Vector3<f64>> = points.iter().map(|p| pose.transform_point(&(*p).into()).coords).collect();
    let centre = moved.iter().sum::<Vector3<f64>>() / n;
    // Collected in order, so that sums are the same on any number of threads.
    let near: Vec<_> = moved.par_iter().map(|p| on_gold.to(p)).collect();
    let (mut matrix, mut right, mut square) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
    for (place, closest) in moved.iter().zip(near) {
        square += closest.distance * closest.distance / n;
        let [a, b, c] = gold.corners(&gold.triangles[closest.triangle]);
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-30) else { continue };
        let moment = (place - centre).cross(&normal);
        let row = Vector6::new(normal.x, normal.y, normal.z, moment.x, moment.y, moment.z);
        matrix += row * row.transpose();
        right -= row * normal.dot(&(place - closest.point));
    }
    (square, (matrix, right, centre))
}
