//! Which side of a closed surface a place lies on: the sign of its distance, by pseudo-normals.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::closest::{Feature, on_triangle};
use super::{Closest, Nearest};
use crate::Mesh;

/// What a surface has to be for distances to have a sign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Closure {
    /// Edges that only one triangle has.
    pub(super) open_edges: usize,
    /// Edges whose triangles do not face the same way, or of more than two triangles.
    pub(super) folded_edges: usize,
}

/// A mesh with the normals that decide on which side of it a place lies.
///
/// At a corner it is the mean of the triangles' normals weighted by their angles there, at an edge that of both
/// triangles, and inside a triangle its own: with these, and not with the nearest triangle's alone, the sign is right
/// everywhere (Baerentzen and Aanaes 2005, "Signed distance computation using the angle weighted pseudonormal").
pub(super) struct Sides {
    /// Points at one place are one point, whatever the file says.
    same: Vec<u32>,
    corners: Vec<Vector3<f64>>,
    edges: HashMap<(u32, u32), Vector3<f64>>,
}

impl Sides {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let same = welded(mesh);
        let mut sides =
            Self { corners: vec![Vector3::zeros(); mesh.points.len()], edges: HashMap::new(), same };
        for triangle in &mesh.triangles {
            let Some(normal) = normal(&mesh.corners(triangle)) else { continue };
            let places = mesh.corners(triangle);
            for i in 0..3 {
                let (here, next, last) = (places[i], places[(i + 1) % 3], places[(i + 2) % 3]);
                let angle = (next - here).angle(&(last - here));
                let corner = sides.name(triangle[i]);
                if let Some(sum) = sides.corners.get_mut(corner as usize) {
                    *sum += normal * angle;
                }
                let edge = sides.edge(triangle, i);
                *sides.edges.entry(edge).or_default() += normal;
            }
        }
        sides
    }

    fn name(&self, point: u32) -> u32 {
        self.same.get(point as usize).copied().unwrap_or(point)
    }

    fn edge(&self, triangle: &[u32; 3], from: usize) -> (u32, u32) {
        let (a, b) = (self.name(triangle[from]), self.name(triangle[(from + 1) % 3]));
        (a.min(b), a.max(b))
    }

    /// The distance with its sign: negative inside.
    pub(super) fn signed(&self, nearest: &Nearest<'_>, place: &Vector3<f64>, closest: &Closest) -> f64 {
        let mesh = nearest.mesh();
        let Some(triangle) = mesh.triangles.get(closest.triangle) else { return closest.distance };
        let corners = mesh.corners(triangle);
        let outward = match on_triangle(place, &corners).1 {
            Feature::Face => normal(&corners).unwrap_or_default(),
            Feature::Corner(i) => self.corner(triangle[i]),
            Feature::Edge(i) => self.edges.get(&self.edge(triangle, i)).copied().unwrap_or_default(),
        };
        let side = outward.dot(&(place - closest.point));
        if side < 0.0 { -closest.distance } else { closest.distance }
    }

    fn corner(&self, point: u32) -> Vector3<f64> {
        self.corners.get(self.name(point) as usize).copied().unwrap_or_default()
    }
}

fn normal([a, b, c]: &[Vector3<f64>; 3]) -> Option<Vector3<f64>> {
    (b - a).cross(&(c - a)).try_normalize(1e-30)
}

/// For every point the first one at the same place.
fn welded(mesh: &Mesh) -> Vec<u32> {
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    let key = |p: &Vector3<f64>| [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
    (0..).zip(&mesh.points).map(|(i, p)| *known.entry(key(p)).or_insert(i)).collect()
}

impl Closure {
    /// Counts the edges at which a mesh is not closed, points at one place taken as one.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let same = welded(mesh);
        let name = |point: u32| same.get(point as usize).copied().unwrap_or(point);
        // How often an edge is run along from its smaller point to its larger one, and back.
        let mut edges: HashMap<(u32, u32), (u32, u32)> = HashMap::new();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(name);
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let runs = edges.entry((from.min(to), from.max(to))).or_default();
                if from < to { runs.0 += 1 } else { runs.1 += 1 }
            }
        }
        let count = |wrong: fn(u32, u32) -> bool| edges.values().filter(|(a, b)| wrong(*a, *b)).count();
        Self { open_edges: count(|a, b| a + b == 1), folded_edges: count(|a, b| a + b > 1 && a != b) }
    }

    pub(super) fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.folded_edges == 0
    }
}
