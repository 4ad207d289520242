//! Areas of closed meshes in planes across.

use nalgebra::Vector3;

use super::AreaPair;
use super::fit::Axis;
use crate::Mesh;

/// Both areas in planes between the ends of the surface; planes that miss one of them are left out.
pub(super) fn areas(surface: &Mesh, gold: &Mesh, axis: &Axis, count: usize) -> Vec<AreaPair> {
    let (from, to) = axis.ends;
    // Not at the very ends, where a cap that leans is cut.
    let places = (0..count).map(|i| from + (to - from) * (0.03 + 0.94 * (i as f64 + 0.5) / count as f64));
    let pair = |at: f64| {
        let cut = |mesh: &Mesh| area(mesh, &(axis.centre + axis.along * at), &axis.along) * 1e6;
        AreaPair { at_mm: (at - from) * 1e3, surface_mm2: cut(surface), gold_mm2: cut(gold) }
    };
    places.map(pair).filter(|pair| pair.surface_mm2 > 0.0 && pair.gold_mm2 > 0.0).collect()
}

/// The area in which a plane cuts a closed mesh (m2): Green's theorem over the pieces of the outline, each turned as
/// its triangle faces, in whatever order they come. Zero when it cuts nothing.
pub(super) fn area(mesh: &Mesh, origin: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    let height = |p: &Vector3<f64>| normal.dot(&(p - origin));
    let mut twice = 0.0;
    for triangle in &mesh.triangles {
        let corners = mesh.corners(triangle);
        let heights = corners.map(|corner| height(&corner));
        let above = heights.map(|h| h >= 0.0);
        if above[0] == above[1] && above[1] == above[2] {
            continue;
        }
        let cut = |i: usize, j: usize| {
            corners[i] + (corners[j] - corners[i]) * (heights[i] / (heights[i] - heights[j]))
        };
        // Corner k is alone on its side; the outline runs from the edge after it to the edge before it.
        let k =
            (0..3).find(|&k| above[k] != above[(k + 1) % 3] && above[k] != above[(k + 2) % 3]).unwrap_or(0);
        let (a, b) = (cut(k, (k + 1) % 3) - origin, cut(k, (k + 2) % 3) - origin);
        twice += if above[k] { 1.0 } else { -1.0 } * a.cross(&b).dot(normal);
    }
    twice.abs() / 2.0
}
