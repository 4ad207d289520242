//! The closest point of a mesh: exact, through a tree of boxes.

use nalgebra::Vector3;

use crate::Mesh;

/// Triangles in a leaf.
const LEAF: usize = 4;

/// What is closest to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// How far it is (m).
    pub distance: f64,
    /// Where it is.
    pub point: Vector3<f64>,
    /// Which triangle it is on.
    pub triangle: usize,
}

/// A mesh, ordered for questions about what is nearest.
pub struct Nearest<'a> {
    mesh: &'a Mesh,
    order: Vec<usize>,
    nodes: Vec<Node>,
}

struct Node {
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Range of `order`; of a branch, the left child is the next node and the right one is here.
    first: usize,
    last: usize,
    right: Option<usize>,
}

impl<'a> Nearest<'a> {
    /// Orders the triangles of a mesh, which must have some.
    pub fn new(mesh: &'a Mesh) -> Self {
        let middles: Vec<Vector3<f64>> =
            mesh.triangles.iter().map(|t| mesh.corners(t).iter().sum::<Vector3<f64>>() / 3.0).collect();
        let mut tree = Self { mesh, order: (0..mesh.triangles.len()).collect(), nodes: Vec::new() };
        tree.split(&middles, 0, mesh.triangles.len());
        tree
    }

    fn split(&mut self, middles: &[Vector3<f64>], first: usize, last: usize) {
        let node = self.nodes.len();
        let corners =
            self.order[first..last].iter().flat_map(|&t| self.mesh.corners(&self.mesh.triangles[t]));
        let empty = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (low, high) = corners.fold(empty, |(low, high), c| (low.inf(&c), high.sup(&c)));
        self.nodes.push(Node { low, high, first, last, right: None });
        if last - first <= LEAF {
            return;
        }
        let axis = (high - low).imax();
        let half = (last - first) / 2;
        self.order[first..last]
            .select_nth_unstable_by(half, |&a, &b| middles[a][axis].total_cmp(&middles[b][axis]));
        self.split(middles, first, first + half);
        self.nodes[node].right = Some(self.nodes.len());
        self.split(middles, first + half, last);
    }

    /// What of the mesh is closest to a place.
    pub fn to(&self, place: &Vector3<f64>) -> Closest {
        let mut best = Closest { distance: f64::INFINITY, point: *place, triangle: 0 };
        let mut waiting = vec![(0_usize, 0.0)];
        while let Some((index, square)) = waiting.pop() {
            if square >= best.distance {
                continue;
            }
            let node = &self.nodes[index];
            let Some(right) = node.right else {
                for &triangle in &self.order[node.first..node.last] {
                    let point = on_triangle(place, &self.mesh.corners(&self.mesh.triangles[triangle]));
                    let distance = (point - place).norm_squared();
                    if distance < best.distance {
                        best = Closest { distance, point, triangle };
                    }
                }
                continue;
            };
            let (a, b) = (self.square(index + 1, place), self.square(right, place));
            // The nearer child comes off the stack first.
            let children = if a < b { [(right, b), (index + 1, a)] } else { [(index + 1, a), (right, b)] };
            waiting.extend(children);
        }
        Closest { distance: best.distance.sqrt(), ..best }
    }

    /// Square of the distance to a node's box.
    fn square(&self, node: usize, place: &Vector3<f64>) -> f64 {
        let node = &self.nodes[node];
        (place.sup(&node.low).inf(&node.high) - place).norm_squared()
    }
}

/// The closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
pub(crate) fn on_triangle(p: &Vector3<f64>, [a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(&(p - a)), ac.dot(&(p - a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let (d3, d4) = (ab.dot(&(p - b)), ac.dot(&(p - b)));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3).max(f64::MIN_POSITIVE));
    }
    let (d5, d6) = (ab.dot(&(p - c)), ac.dot(&(p - c)));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6).max(f64::MIN_POSITIVE));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)).max(f64::MIN_POSITIVE));
    }
    let sum = (va + vb + vc).max(f64::MIN_POSITIVE);
    a + ab * (vb / sum) + ac * (vc / sum)
}
