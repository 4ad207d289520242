//! Which centre follows which along the vessel, when neither the order of the images nor a main direction says so.
//!
//! Centres close together are one node; the nodes are joined to the tree of the least length (Prim); the longest way
//! through the tree is the vessel, and what hangs on it sideways is not.

use nalgebra::{Matrix3, Vector3};

/// Centres this close together are one node (m).
const NODE_M: f64 = 2.5e-3;
/// Nodes farther apart than this many times the usual distance are not neighbours.
const APART: f64 = 4.0;
/// Fewer centres than this, apart from all others, are strays.
const LEAST: usize = 4;

/// Where each centre lies along the vessel (m, from anywhere, in either direction); nothing for a stray.
pub(super) fn places(centres: &[Vector3<f64>]) -> Vec<Option<f64>> {
    let nodes = nodes(centres);
    let kept = kept(&nodes);
    let middles: Vec<Vector3<f64>> = kept.iter().map(|&node| nodes[node].middle).collect();
    let way = longest_way(&tree(&middles));
    let corners: Vec<Vector3<f64>> = match way[..] {
        [_] | [] => straight(centres),
        _ => way.iter().map(|&node| middles[node]).collect(),
    };
    let mut places = vec![None; centres.len()];
    for &member in kept.iter().flat_map(|&node| &nodes[node].members) {
        places[member] = along(&corners, &centres[member]);
    }
    places
}

/// Some centres close together.
struct Node {
    seed: Vector3<f64>,
    middle: Vector3<f64>,
    members: Vec<usize>,
}

/// Every centre goes to the nearest seed; the seeds are taken in an order that only the places decide.
fn nodes(centres: &[Vector3<f64>]) -> Vec<Node> {
    let mut sorted: Vec<usize> =
        (0..centres.len()).filter(|&i| centres[i].iter().all(|x| x.is_finite())).collect();
    sorted.sort_by(|&a, &b| by_place(&centres[a], &centres[b]));
    let mut nodes: Vec<Node> = Vec::new();
    for &i in &sorted {
        if nodes.iter().all(|node| (node.seed - centres[i]).norm() > NODE_M) {
            nodes.push(Node { seed: centres[i], middle: Vector3::zeros(), members: Vec::new() });
        }
    }
    for &i in &sorted {
        let distance = |node: &Node| (node.seed - centres[i]).norm_squared();
        if let Some(node) = nodes.iter_mut().min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            node.members.push(i);
            node.middle += centres[i];
        }
    }
    nodes.iter_mut().for_each(|node| node.middle /= node.members.len().max(1) as f64);
    nodes
}

/// An order of places that has nothing to do with when they were seen.
pub(super) fn by_place(a: &Vector3<f64>, b: &Vector3<f64>) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
}

/// The nodes that are not strays.
fn kept(nodes: &[Node]) -> Vec<usize> {
    let all: Vec<Vector3<f64>> = nodes.iter().map(|node| node.middle).collect();
    let edges = tree(&all);
    let mut lengths: Vec<f64> = edges.iter().map(|edge| edge.length).collect();
    lengths.sort_by(f64::total_cmp);
    let limit = APART * lengths.get(lengths.len() / 2).copied().unwrap_or(0.0).max(NODE_M);
    let groups = groups(nodes.len(), edges.iter().filter(|edge| edge.length <= limit));
    let size = |group: usize| -> usize {
        (0..nodes.len()).filter(|&i| groups[i] == group).map(|i| nodes[i].members.len()).sum()
    };
    let sizes: Vec<usize> = (0..nodes.len()).map(|i| size(groups[i])).collect();
    let largest = sizes.iter().copied().max().unwrap_or(0);
    (0..nodes.len()).filter(|&i| sizes[i] >= LEAST.min(largest)).collect()
}

/// A branch of the tree.
#[derive(Clone, Copy)]
struct Edge {
    ends: (usize, usize),
    length: f64,
}

/// The tree of the least length that joins all places (Prim).
fn tree(places: &[Vector3<f64>]) -> Vec<Edge> {
    let mut edges = Vec::with_capacity(places.len());
    // For every place not yet joined, the nearest that is.
    let mut nearest: Vec<Option<(usize, f64)>> =
        places.iter().map(|place| Some((0, (place - places[0]).norm()))).collect();
    if let Some(first) = nearest.first_mut() {
        *first = None;
    }
    let next = |nearest: &[Option<(usize, f64)>]| {
        let open = nearest.iter().enumerate().filter_map(|(i, near)| Some((i, (*near)?)));
        open.min_by(|a, b| a.1.1.total_cmp(&b.1.1))
    };
    while let Some((joined, (other, length))) = next(&nearest) {
        edges.push(Edge { ends: (other, joined), length });
        nearest[joined] = None;
        for (near, place) in nearest.iter_mut().zip(places) {
            let distance = (place - places[joined]).norm();
            if let Some(near) = near.as_mut().filter(|near| distance < near.1) {
                *near = (joined, distance);
            }
        }
    }
    edges
}

/// For every node the least node that edges join it to.
fn groups<'a>(count: usize, edges: impl Iterator<Item = &'a Edge>) -> Vec<usize> {
    let mut groups: Vec<usize> = (0..count).collect();
    for edge in edges {
        let (a, b) = (groups[edge.ends.0], groups[edge.ends.1]);
        groups.iter_mut().filter(|group| **group == a.max(b)).for_each(|group| *group = a.min(b));
    }
    groups
}

/// The nodes along the longest way through a tree: from the node farthest from any to the one farthest from that.
fn longest_way(edges: &[Edge]) -> Vec<usize> {
    let mut neighbours: Vec<Vec<(usize, f64)>> = vec![Vec::new(); edges.len() + 1];
    for edge in edges {
        neighbours[edge.ends.0].push((edge.ends.1, edge.length));
        neighbours[edge.ends.1].push((edge.ends.0, edge.length));
    }
    let (end, _) = farthest(&neighbours, 0);
    let (mut node, before) = farthest(&neighbours, end);
    let mut way = vec![node];
    while let Some(last) = before[node] {
        way.push(last);
        node = last;
    }
    way
}

/// The node farthest from one, and for every node the one before it on the way there.
fn farthest(neighbours: &[Vec<(usize, f64)>], from: usize) -> (usize, Vec<Option<usize>>) {
    let mut before = vec![None; neighbours.len()];
    let (mut far, mut open) = ((from, 0.0), vec![(from, 0.0)]);
    while let Some((node, length)) = open.pop() {
        if length > far.1 {
            far = (node, length);
        }
        let back = before[node];
        for &(next, step) in neighbours[node].iter().filter(|(next, _)| back != Some(*next)) {
            before[next] = Some(node);
            open.push((next, length + step));
        }
    }
    (far.0, before)
}

/// Length along a line of corners of the point nearest to a place; the line goes on straight beyond its ends.
fn along(corners: &[Vector3<f64>], place: &Vector3<f64>) -> Option<f64> {
    let (mut best, mut start) = (None, 0.0);
    for (i, pair) in corners.windows(2).enumerate() {
        let (edge, length) = (pair[1] - pair[0], (pair[1] - pair[0]).norm());
        let t = (place - pair[0]).dot(&edge) / (length * length).max(1e-18);
        let low = if i == 0 { f64::NEG_INFINITY } else { 0.0 };
        let high = if i + 2 == corners.len() { f64::INFINITY } else { 1.0 };
        let t = t.clamp(low, high);
        let distance = (place - pair[0] - edge * t).norm();
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, start + t * length));
        }
        start += length;
    }
    best.map(|(_, at)| at)
}

/// Two corners along the direction in which the centres extend most.
fn straight(centres: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut sorted: Vec<&Vector3<f64>> = centres.iter().filter(|c| c.iter().all(|x| x.is_finite())).collect();
    sorted.sort_by(|a, b| by_place(a, b));
    let mean = sorted.iter().copied().sum::<Vector3<f64>>() / sorted.len().max(1) as f64;
    let scatter: Matrix3<f64> = sorted.iter().map(|c| (*c - mean) * (*c - mean).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let along: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    vec![mean - along * NODE_M, mean + along * NODE_M]
}
