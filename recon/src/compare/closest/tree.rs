//! The tree of boxes: eight children a node, in single precision, each box a little larger than what is in it.

use nalgebra::Vector3;

use crate::Mesh;

/// Children of a node.
const WIDE: usize = 8;
/// Triangles in a leaf, at most.
const LEAF: usize = 4;
/// What single precision may be off by, as a part of a coordinate: half a unit in the last place, three times over.
const ROUNDING: f32 = 2e-7;

/// Boxes of a mesh, in coordinates of its own: the middle of the mesh is zero, its largest extent two.
pub(super) struct Tree {
    middle: Vector3<f64>,
    per_metre: f64,
    /// What turns square metres into squares of the tree's coordinates, rounded up.
    pub(super) per_square_metre: f64,
    nodes: Vec<Node>,
}

/// The boxes of eight children, axis by axis, and what they are.
#[repr(align(64))]
struct Node {
    low: [[f32; WIDE]; 3],
    high: [[f32; WIDE]; 3],
    child: [Child; WIDE],
}

/// A node, or a leaf's range of triangles.
#[derive(Clone, Copy, Default)]
struct Child {
    first: u32,
    /// Triangles of a leaf; zero for a node or for no child.
    count: u32,
}

/// A place in the tree's coordinates, and how far it may be off there.
pub(super) struct Asked {
    place: [f32; 3],
    room: f32,
}

/// Nodes that still have to be looked at, the nearest last.
#[derive(Default)]
pub(super) struct Waiting(Vec<(u32, f32)>);

impl Waiting {
    pub(super) fn begin(&mut self) {
        self.0.clear();
        self.0.push((0, 0.0));
    }

    pub(super) fn next(&mut self) -> Option<(u32, f32)> {
        self.0.pop()
    }

    /// Puts a node behind those that are farther.
    fn insert(&mut self, above: usize, node: u32, bound: f32) {
        let mut at = self.0.len();
        self.0.push((node, bound));
        while at > above && self.0[at - 1].1 < bound {
            self.0.swap(at, at - 1);
            at -= 1;
        }
    }
}

impl Tree {
    /// The tree over a mesh, and the order in which its leaves name the triangles.
    pub(super) fn over(mesh: &Mesh) -> (Self, Vec<u32>) {
        let empty = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let all = mesh.triangles.iter().flat_map(|triangle| mesh.corners(triangle));
        let (low, high) = all.fold(empty, |(low, high), p| (low.inf(&p), high.sup(&p)));
        let middle = (low + high) / 2.0;
        let extent = (high - low).max() / 2.0;
        let per_metre = if extent.is_finite() && extent > 0.0 { 1.0 / extent } else { 1.0 };
        let per_square_metre = per_metre * per_metre * (1.0 + 1e-9);
        let mut tree = Self { middle, per_metre, per_square_metre, nodes: Vec::new() };
        let mut pieces: Vec<Piece> =
            (0..).zip(&mesh.triangles).map(|(i, t)| tree.piece(mesh, t, i)).collect();
        tree.node(&mut pieces, 0);
        (tree, pieces.iter().map(|piece| piece.triangle).collect())
    }

    fn own(&self, place: &Vector3<f64>) -> [f32; 3] {
        ((place - self.middle) * self.per_metre).map(|x| x as f32).into()
    }

    fn piece(&self, mesh: &Mesh, triangle: &[u32; 3], index: u32) -> Piece {
        let corners = mesh.corners(triangle).map(|corner| self.own(&corner));
        let over = |axis: usize, pick: fn(f32, f32) -> f32| {
            corners.iter().map(|corner| corner[axis]).reduce(pick).unwrap_or_default()
        };
        let low = std::array::from_fn(|axis| over(axis, f32::min));
        let high = std::array::from_fn(|axis| over(axis, f32::max));
        Piece { low, high, triangle: index }
    }

    /// Adds the node over some pieces, the first of which is `first` of all.
    fn node(&mut self, pieces: &mut [Piece], first: u32) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(Node::empty());
        for (i, (from, to)) in eighths(pieces).into_iter().enumerate() {
            let part = &mut pieces[from..to];
            let (low, high) = bounds(part);
            let start = first + from as u32;
            let child = if part.len() <= LEAF {
                Child { first: start, count: part.len() as u32 }
            } else {
                Child { first: self.node(part, start), count: 0 }
            };
            let node = &mut self.nodes[index as usize];
            node.child[i] = child;
            for axis in 0..3 {
                node.low[axis][i] = low[axis];
                node.high[axis][i] = high[axis];
            }
        }
        index
    }

    /// Where a place lies along a curve that runs through the mesh's box and keeps neighbours together: the bits of its
    /// coordinates in turn.
    pub(super) fn along_curve(&self, place: &Vector3<f64>) -> u64 {
        let spread = |x: f32| {
            // Twenty bits, two zeros after each.
            let mut bits = ((x.clamp(-1.0, 1.0) + 1.0) * 524_287.5) as u64;
            for (shift, mask) in [
                (32, 0x1f_0000_0000_ffff),
                (16, 0x1f_0000_ff00_00ff),
                (8, 0x100f_00f0_0f00_f00f),
                (4, 0x10c3_0c30_c30c_30c3),
                (2, 0x1249_2492_4924_9249),
            ] {
                bits = (bits | (bits << shift)) & mask;
            }
            bits
        };
        let [x, y, z] = self.own(place).map(spread);
        x | (y << 1) | (z << 2)
    }

    /// A place as the tree sees it.
    pub(super) fn asked(&self, place: &Vector3<f64>) -> Asked {
        let own = self.own(place);
        let room = ROUNDING * (1.0 + own.iter().fold(0.0, |most: f32, x| most.max(x.abs())));
        Asked { place: own, room }
    }

    /// Looks at the children of a node that may hold something nearer than `limit`: nodes are put on the stack, leaves
    /// are given to `leaf` as first place and count, the nearest first.
    pub(super) fn children(
        &self,
        node: u32,
        asked: &Asked,
        limit: f64,
        waiting: &mut Waiting,
        mut leaf: impl FnMut(usize, usize),
    ) {
        let Some(node) = self.nodes.get(node as usize) else { return };
        let bounds = node.squares(asked);
        let above = waiting.0.len();
        let mut leaves = [(0.0, 0); WIDE];
        let mut count = 0;
        for (i, &bound) in bounds.iter().enumerate() {
            if f64::from(bound) > limit {
                continue;
            }
            let child = node.child[i];
            // The first node is nobody's child: this place is empty.
            if child.count == 0 && child.first == 0 {
                continue;
            }
            if child.count == 0 {
                waiting.insert(above, child.first, bound);
                continue;
            }
            let mut at = count;
            while at > 0 && leaves[at - 1].0 > bound {
                leaves[at] = leaves[at - 1];
                at -= 1;
            }
            leaves[at] = (bound, i);
            count += 1;
        }
        for &(_, i) in &leaves[..count] {
            leaf(node.child[i].first as usize, node.child[i].count as usize);
        }
    }
}

impl Node {
    /// Boxes that nothing is in: infinitely far from everywhere.
    fn empty() -> Self {
        let (low, high) = ([[f32::INFINITY; WIDE]; 3], [[f32::NEG_INFINITY; WIDE]; 3]);
        Self { low, high, child: [Child::default(); WIDE] }
    }

    /// At most the squares of the distances to the eight boxes; eight at a time is what the processor is good at.
    fn squares(&self, asked: &Asked) -> [f32; WIDE] {
        let mut sums = [0.0_f32; WIDE];
        for axis in 0..3 {
            let (place, low, high) = (asked.place[axis], &self.low[axis], &self.high[axis]);
            for i in 0..WIDE {
                let off = (low[i] - place).max(place - high[i]) - asked.room;
                let off = off.max(0.0);
                sums[i] += off * off;
            }
        }
        // The sum of three squares is off by less than this in single precision.
        sums.map(|sum| sum * (1.0 - 1e-6))
    }
}

/// A triangle's box while the tree is built.
#[derive(Clone, Copy)]
struct Piece {
    low: [f32; 3],
    high: [f32; 3],
    triangle: u32,
}

impl Piece {
    fn middle(&self, axis: usize) -> f32 {
        self.low[axis] + self.high[axis]
    }
}

fn bounds(pieces: &[Piece]) -> ([f32; 3], [f32; 3]) {
    pieces.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(low, high), piece| {
        let axis = |pick: fn(f32, f32) -> f32, a: &[f32; 3], b: &[f32; 3]| -> [f32; 3] {
            std::array::from_fn(|i| pick(a[i], b[i]))
        };
        (axis(f32::min, &low, &piece.low), axis(f32::max, &high, &piece.high))
    })
}

/// Halved three times across the widest side: at most eight ranges, none empty; few pieces are not halved further.
fn eighths(pieces: &mut [Piece]) -> Vec<(usize, usize)> {
    let mut ranges = vec![(0, pieces.len())];
    for _ in 0..3 {
        let halved = |(from, to): (usize, usize)| {
            let part = &mut pieces[from..to];
            if part.len() <= LEAF {
                return vec![(from, to)];
            }
            let half = from + halve(part);
            vec![(from, half), (half, to)]
        };
        ranges = ranges.into_iter().flat_map(halved).collect();
    }
    ranges.retain(|(from, to)| from < to);
    ranges
}

/// Orders pieces so that the lower half, along the side where their middles spread most, comes first.
fn halve(pieces: &mut [Piece]) -> usize {
    let half = pieces.len() / 2;
    let spread = |axis: usize| {
        let middles = pieces.iter().map(|piece| piece.middle(axis));
        let (low, high) = middles.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low
    };
    let spreads = [spread(0), spread(1), spread(2)];
    let axis = (0..3).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0);
    pieces.select_nth_unstable_by(half, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
    half
}
