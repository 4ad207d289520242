//! The closest point of a mesh: exact, through a tree of boxes.
//!
//! A node has eight children, whose boxes lie side by side in single precision, so that one pass of vector
//! instructions tests all of them. The boxes only say what need not be looked at, with room for their rounding; the
//! triangles themselves are asked in double precision, so the answer is that of trying every one.

mod tree;
mod triangle;

use nalgebra::Vector3;
use rayon::prelude::*;

pub(crate) use triangle::{Feature, on_triangle};

use crate::Mesh;
use tree::{Tree, Waiting};

/// Places that are asked one after the other on one thread, each beginning from the answer of the one before.
const RUN: usize = 1024;

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
    tree: Tree,
    /// The triangles' corners in the tree's order, and which triangle each was.
    corners: Vec<[Vector3<f64>; 3]>,
    order: Vec<u32>,
}

/// The closest so far: square of the distance, where, and the place of the triangle in the tree's order.
#[derive(Clone, Copy)]
struct Found {
    square: f64,
    point: Vector3<f64>,
    slot: usize,
}

impl<'a> Nearest<'a> {
    /// Orders the triangles of a mesh, which must have some.
    pub fn new(mesh: &'a Mesh) -> Self {
        let (tree, order) = Tree::over(mesh);
        let corners = order.iter().filter_map(|&t| mesh.triangles.get(t as usize)).map(|t| mesh.corners(t));
        Self { mesh, tree, corners: corners.collect(), order }
    }

    /// The mesh that is asked.
    pub fn mesh(&self) -> &'a Mesh {
        self.mesh
    }

    /// What of the mesh is closest to a place.
    pub fn to(&self, place: &Vector3<f64>) -> Closest {
        self.answer(self.search(place, None, &mut Waiting::default()))
    }

    /// What is closest to each of many places, in any order. They are asked along a curve that keeps neighbours
    /// together (Morton 1966), so that each begins from its neighbour's answer: a third of the time that asking in no
    /// order takes. The answers depend neither on that nor on threads.
    pub fn to_each(&self, places: &[Vector3<f64>]) -> Vec<Closest> {
        let mut along: Vec<(u64, u32)> =
            places.iter().zip(0..).map(|(place, i)| (self.tree.along_curve(place), i)).collect();
        along.sort_unstable();
        let run = |part: &[(u64, u32)]| {
            let (mut last, mut waiting) = (None, Waiting::default());
            let ask = |&(_, i): &(u64, u32)| {
                let found = self.search(&places[i as usize], last, &mut waiting);
                last = Some(found.slot);
                (i, found)
            };
            part.iter().map(ask).collect::<Vec<_>>()
        };
        let found: Vec<(u32, Found)> = along.par_chunks(RUN).flat_map_iter(run).collect();
        let nowhere = Closest { distance: f64::INFINITY, point: Vector3::zeros(), triangle: 0 };
        let mut answers = vec![nowhere; places.len()];
        found.into_iter().for_each(|(i, found)| answers[i as usize] = self.answer(found));
        answers
    }

    fn answer(&self, found: Found) -> Closest {
        let triangle = self.order.get(found.slot).map_or(0, |&t| t as usize);
        Closest { distance: found.square.sqrt(), point: found.point, triangle }
    }

    /// `hint` is a triangle that may be near: it bounds the search and changes nothing else.
    fn search(&self, place: &Vector3<f64>, hint: Option<usize>, waiting: &mut Waiting) -> Found {
        let mut best = Found { square: f64::INFINITY, point: *place, slot: hint.unwrap_or(0) };
        if let Some(corners) = hint.and_then(|slot| self.corners.get(slot)) {
            best.point = on_triangle(place, corners).0;
            best.square = (best.point - place).norm_squared();
        }
        let asked = self.tree.asked(place);
        waiting.begin();
        while let Some((node, bound)) = waiting.next() {
            if f64::from(bound) > best.square * self.tree.per_square_metre {
                continue;
            }
            let limit = best.square * self.tree.per_square_metre;
            self.tree.children(node, &asked, limit, waiting, |first, count| {
                let leaf = self.corners.get(first..first + count).unwrap_or_default();
                for (slot, corners) in (first..).zip(leaf) {
                    let point = on_triangle(place, corners).0;
                    let square = (point - place).norm_squared();
                    // Of equally near triangles the one that comes first: the answer is the same from any hint.
                    if square < best.square || (square <= best.square && slot < best.slot) {
                        best = Found { square, point, slot };
                    }
                }
            });
        }
        best
    }
}
