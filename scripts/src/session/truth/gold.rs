//! The lumen that is truly there, as one mesh: the vessels joined, without what lies inside another.

use std::ops::Range;

use probepath_frames::Point;
use probepath_recon::Mesh;
use probepath_sim::Vessel;

/// Distance of the true surface's rings (m), and points in each.
const RING_M: f64 = 0.0005;
const AROUND: usize = 72;
/// A triangle with a corner deeper than this inside another vessel is no wall (m): less than the rings are apart.
const INSIDE_M: f64 = 0.05e-3;

/// The wall of the first vessel within `main`, and of the others whole, where no other vessel opens into them.
pub(super) fn gold(vessels: &[Vessel], main: Range<f64>) -> Mesh {
    let mut joined = Mesh::default();
    for (number, vessel) in vessels.iter().enumerate() {
        let range = if number == 0 { main.clone() } else { 0.0..vessel.length_m() };
        let rings = (((range.end - range.start) / RING_M).ceil() as usize).max(2);
        let grid = vessel.surface(range, rings, AROUND);
        let tube = Mesh::tube(&grid.points, (grid.along, grid.around));
        let others: Vec<&Vessel> =
            vessels.iter().enumerate().filter(|(other, _)| *other != number).map(|(_, v)| v).collect();
        append(&mut joined, (&tube, grid.points.len()), &others);
    }
    joined
}

/// The triangles of a tube that no other vessel swallows, without its ends: points from `walls` on close those.
fn append(joined: &mut Mesh, (tube, walls): (&Mesh, usize), others: &[&Vessel]) {
    let swallowed: Vec<bool> = tube
        .points
        .iter()
        .map(|point| {
            let point = Point::from_vector(*point);
            others.iter().any(|other| other.wall_distance(point) < -INSIDE_M)
        })
        .collect();
    let first = joined.points.len() as u32;
    joined.points.extend(&tube.points);
    let is_wall = |corner: &u32| {
        let corner = *corner as usize;
        corner < walls && !swallowed.get(corner).copied().unwrap_or(true)
    };
    let open = tube.triangles.iter().filter(|corners| corners.iter().all(is_wall));
    joined.triangles.extend(open.map(|corners| corners.map(|corner| first + corner)));
}

#[cfg(test)]
mod tests {
    use probepath_sim::{Leg, LegConfig};

    use super::*;

    #[test]
    fn the_joined_lumen_of_a_leg_has_no_wall_inside_a_vessel() {
        let leg = Leg::new(&LegConfig::default(), 3);
        let main = leg.bifurcation_m() - 0.02..leg.bifurcation_m() + 0.06;
        let both = gold(leg.arteries(), main.clone());
        let alone = gold(&leg.arteries()[..1], main);
        assert!(both.triangles.len() > alone.triangles.len());
        let used = both.triangles.iter().flatten().map(|corner| both.points[*corner as usize]);
        for point in used {
            let point = Point::from_vector(point);
            let deepest = leg.arteries().iter().map(|v| v.wall_distance(point)).fold(f64::INFINITY, f64::min);
            assert!(deepest > -1e-4, "{deepest}");
        }
        // The mouth of the branch is open: some of the main vessel's wall is missing there.
        let of_main = both.triangles.iter().filter(|t| (t[0] as usize) < alone.points.len()).count();
        assert!(of_main < alone.triangles.len());
    }
}
