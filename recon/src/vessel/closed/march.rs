//! The border of a solid as a closed mesh: marching tetrahedra (Doi and Koide 1991) on a grid, followed along the
//! border from cell to cell.
//!
//! Every cell is cut into six tetrahedra round the same diagonal, so that neighbours agree on their common faces: the
//! mesh is closed and every edge has two triangles, whatever the solid is. Points are found on the grid's edges by
//! regula falsi.

use std::collections::{HashMap, HashSet, VecDeque};

use nalgebra::Vector3;

use crate::Mesh;

/// Distance of the grid's nodes (m).
const GRID_M: f64 = 0.5e-3;
/// No point lies nearer to a node than this part of an edge: no triangle loses its area.
const LEAST_PART: f64 = 0.02;
/// Steps of regula falsi along an edge at most, and how near to the border is near enough (m).
const STEPS: usize = 10;
const NEAR_M: f64 = 1e-6;
/// A way out of the solid is not longer than this (m).
const FARTHEST_M: f64 = 30e-3;
/// Cells of a mesh at most: 5 m of vessel.
const MOST_CELLS: usize = 2_000_000;

/// Numbers of a node, or of a cell by its least corner.
type Node = [i32; 3];

/// The corners of the six tetrahedra of a cell, as bits x, y, z: ways from 0 to 7 along its edges.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// The border of where `outside` is negative, as far as it hangs together with the ways out from the seeds (a place
/// inside, and a direction).
pub(super) fn border(
    seeds: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>,
    outside: &dyn Fn(&Vector3<f64>) -> f64,
) -> Mesh {
    let mut march = March { outside, values: HashMap::new(), points: HashMap::new(), mesh: Mesh::default() };
    let mut done = HashSet::new();
    let mut open: VecDeque<Node> = VecDeque::new();
    for cell in seeds.flat_map(|(place, way)| march.crossing(place, way)) {
        if done.insert(cell) {
            open.push_back(cell);
        }
    }
    while let Some(cell) = open.pop_front().filter(|_| done.len() < MOST_CELLS) {
        let inside = march.cell(cell);
        for next in neighbours(cell, inside) {
            if done.insert(next) {
                open.push_back(next);
            }
        }
    }
    march.mesh
}

/// A node of a cell.
fn corner(cell: Node, bits: usize) -> Node {
    std::array::from_fn(|axis| cell[axis] + (bits >> axis & 1) as i32)
}

/// The cells beyond those faces that the border goes through.
fn neighbours(cell: Node, inside: [bool; 8]) -> impl Iterator<Item = Node> {
    (0..6).filter_map(move |face| {
        let (axis, side) = (face / 2, face % 2);
        let mut of_face = (0..8).filter(|bits| bits >> axis & 1 == side).map(|bits| inside[bits]);
        let first = of_face.next();
        let crossed = of_face.any(|other| Some(other) != first);
        let mut next = cell;
        next[axis] += if side == 1 { 1 } else { -1 };
        crossed.then_some(next)
    })
}

struct March<'a> {
    outside: &'a dyn Fn(&Vector3<f64>) -> f64,
    values: HashMap<Node, f64>,
    /// The mesh's point on each edge of the grid that has one.
    points: HashMap<(Node, Node), u32>,
    mesh: Mesh,
}

impl March<'_> {
    fn place(node: Node) -> Vector3<f64> {
        Vector3::from(node.map(f64::from)) * GRID_M
    }

    fn value(&mut self, node: Node) -> f64 {
        let outside = self.outside;
        *self.values.entry(node).or_insert_with(|| outside(&Self::place(node)))
    }

    /// The cells round the place where a way out crosses the border; none when the place is not inside.
    fn crossing(&self, place: Vector3<f64>, way: Vector3<f64>) -> Vec<Node> {
        let step = GRID_M / 2.0;
        let places = (0..(FARTHEST_M / step) as usize).map(|i| place + way * (i as f64 * step));
        let mut signs = places.map(|place| (place, (self.outside)(&place) < 0.0));
        if !signs.next().is_some_and(|(_, inside)| inside) {
            return Vec::new();
        }
        let Some((out, _)) = signs.find(|(_, inside)| !inside) else { return Vec::new() };
        let middle: Node = (out / GRID_M).map(|x| x.floor() as i32).into();
        let shift = |i: usize| [i % 3, i / 3 % 3, i / 9].map(|k| k as i32 - 1);
        (0..27).map(|i| std::array::from_fn(|axis| middle[axis] + shift(i)[axis])).collect()
    }

    /// Adds the triangles of a cell; tells which of its corners lie inside.
    fn cell(&mut self, cell: Node) -> [bool; 8] {
        let nodes: [Node; 8] = std::array::from_fn(|bits| corner(cell, bits));
        let inside = nodes.map(|node| self.value(node) < 0.0);
        if inside.iter().any(|corner| *corner != inside[0]) {
            for tetrahedron in TETRAHEDRA {
                self.tetrahedron(tetrahedron.map(|bits| nodes[bits]), tetrahedron.map(|bits| inside[bits]));
            }
        }
        inside
    }

    fn tetrahedron(&mut self, nodes: [Node; 4], inside: [bool; 4]) {
        let of =
            |which: bool| (0..4).filter(move |&i| inside[i] == which).map(|i| nodes[i]).collect::<Vec<_>>();
        let (within, without) = (of(true), of(false));
        match (&within[..], &without[..]) {
            (&[a], &[b, c, d]) | (&[b, c, d], &[a]) => {
                self.triangle([(a, b), (a, c), (a, d)], &within, &without)
            }
            (&[a, b], &[c, d]) => {
                self.triangle([(a, c), (a, d), (b, d)], &within, &without);
                self.triangle([(a, c), (b, d), (b, c)], &within, &without);
            }
            _ => {}
        }
    }

    /// A triangle between points of three edges, turned so that it faces away from the nodes within. The middles of
    /// the edges tell which way that is: they are never on one line.
    fn triangle(&mut self, edges: [(Node, Node); 3], within: &[Node], without: &[Node]) {
        let middle = |nodes: &[Node]| {
            nodes.iter().map(|node| Vector3::from(node.map(f64::from))).sum::<Vector3<f64>>()
                / nodes.len() as f64
        };
        let [a, b, c] = edges.map(|(from, to)| middle(&[from, to]));
        let faces_out = (b - a).cross(&(c - a)).dot(&(middle(without) - middle(within))) > 0.0;
        let [a, b, c] = edges.map(|(from, to)| self.point(from, to));
        self.mesh.triangles.push(if faces_out { [a, b, c] } else { [a, c, b] });
    }

    /// The mesh's point on an edge of the grid.
    fn point(&mut self, from: Node, to: Node) -> u32 {
        let edge = if from < to { (from, to) } else { (to, from) };
        if let Some(&point) = self.points.get(&edge) {
            return point;
        }
        let (a, b) = (Self::place(edge.0), Self::place(edge.1));
        let (left, right) = (self.value(edge.0), self.value(edge.1));
        let place = a.lerp(&b, self.crossed(&a, &b, (left, right)));
        let point = self.mesh.points.len() as u32;
        self.mesh.points.push(place);
        self.points.insert(edge, point);
        point
    }

    /// Where between two places the border is, as a part of the way (regula falsi, Illinois).
    fn crossed(&self, a: &Vector3<f64>, b: &Vector3<f64>, values: (f64, f64)) -> f64 {
        let (mut low, mut high) = ((0.0, values.0), (1.0, values.1));
        let mut t = 0.5;
        for _ in 0..STEPS {
            t = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let value = (self.outside)(&a.lerp(b, t));
            if value.abs() < NEAR_M {
                break;
            }
            if (value < 0.0) == (low.1 < 0.0) {
                low = (t, value);
                high.1 /= 2.0;
            } else {
                high = (t, value);
                low.1 /= 2.0;
            }
        }
        if t.is_finite() { t.clamp(LEAST_PART, 1.0 - LEAST_PART) } else { 0.5 }
    }
}
