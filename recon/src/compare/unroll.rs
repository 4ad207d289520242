//! A tube cut open and laid flat: where each of its points lies along it and around it, for pictures.

use nalgebra::Vector3;

use super::fit::Axis;
use crate::Mesh;

/// Length over which the middle of the tube is taken (m).
const BIN_M: f64 = 2e-3;
/// Bins at most, whatever the size.
const MOST_BINS: usize = 2000;

/// Where a point of a tube lies on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unrolled {
    /// Along the tube's longest extent, from the end that lies toward the head (m).
    pub along_m: f64,
    /// Around it, counter-clockwise as the first end sees it, from the patient's front (rad, 0 to 2 pi).
    pub angle: f64,
    /// From its middle there (m).
    pub radius_m: f64,
}

/// Lays a tube flat: every point of the mesh, in its order. Of a mesh that branches, the branches lie on one another.
pub fn unrolled(mesh: &Mesh) -> Vec<Unrolled> {
    let axis = Axis::of(mesh);
    // The World is LPS: from the head (+z) to the feet.
    let along = if axis.along.z > 0.0 { -axis.along } else { axis.along };
    let place = |p: &Vector3<f64>| along.dot(&(p - axis.centre));
    let start = mesh.points.iter().map(place).fold(f64::INFINITY, f64::min);
    let middles = Middles::of(mesh, |p| place(p) - start);
    let front = [-Vector3::y(), -Vector3::x()].map(|toward| toward - along * along.dot(&toward));
    let up = front.iter().find_map(|toward| toward.try_normalize(0.1)).unwrap_or_else(Vector3::x);
    let side = along.cross(&up);
    let flat = |p: &Vector3<f64>| {
        let along_m = place(p) - start;
        let off = p - middles.at(along_m);
        let (x, y) = (off.dot(&up), off.dot(&side));
        Unrolled { along_m, angle: y.atan2(x).rem_euclid(std::f64::consts::TAU), radius_m: x.hypot(y) }
    };
    mesh.points.iter().map(flat).collect()
}

/// The middle of the tube at even steps along it.
struct Middles {
    step: f64,
    middles: Vec<Vector3<f64>>,
}

impl Middles {
    fn of(mesh: &Mesh, along: impl Fn(&Vector3<f64>) -> f64) -> Self {
        let length = mesh.points.iter().map(&along).fold(0.0, f64::max);
        let step = BIN_M.max(length / MOST_BINS as f64);
        let mut sums = vec![(Vector3::zeros(), 0.0); (length / step) as usize + 1];
        for point in &mesh.points {
            if let Some((sum, count)) = sums.get_mut((along(point) / step) as usize) {
                *sum += point;
                *count += 1.0;
            }
        }
        // A bin without points has the middle of the one before it.
        let mut last = sums.iter().find(|(_, count)| *count > 0.0).map_or(Vector3::zeros(), |(s, n)| s / *n);
        let middle = |(sum, count): (Vector3<f64>, f64)| {
            last = if count > 0.0 { sum / count } else { last };
            last
        };
        Self { step, middles: sums.into_iter().map(middle).collect() }
    }

    /// Between the middles of two bins, straight.
    fn at(&self, along: f64) -> Vector3<f64> {
        let place = (along / self.step - 0.5).clamp(0.0, self.middles.len().saturating_sub(1) as f64);
        let first = place as usize;
        let pair = [first, first + 1].map(|i| self.middles.get(i).or(self.middles.last()).copied());
        let [a, b] = pair.map(Option::unwrap_or_default);
        a.lerp(&b, place.fract())
    }
}
