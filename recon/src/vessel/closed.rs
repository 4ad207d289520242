//! The closed surface: of one vessel, a tube with two caps; of several, the border of all of them together.

mod march;
mod solid;

use nalgebra::Vector3;

use super::Vessel;
use crate::Mesh;
use crate::centreline::CentrelinePoint;
use crate::surface::{Way, round};
use solid::Solid;

/// Distance of the rings (m), and points in each.
const RING_M: f64 = 0.4e-3;
const RING: usize = 64;

/// Numbers of the points.
#[derive(Default)]
struct Scalars {
    area_mm2: Vec<f64>,
    radius_mm: Vec<f64>,
    error_sd_mm: Vec<f64>,
}

impl Scalars {
    fn push(&mut self, area_m2: f64, radius_m: f64, sd_m: f64) {
        self.area_mm2.push(area_m2 * 1e6);
        self.radius_mm.push(radius_m * 1e3);
        self.error_sd_mm.push(sd_m * 1e3);
    }

    fn on(self, mesh: Mesh) -> Mesh {
        mesh.with_scalars("area_mm2", self.area_mm2)
            .with_scalars("radius_mm", self.radius_mm)
            .with_scalars("error_sd_mm", self.error_sd_mm)
    }
}

/// The surface of all vessels together: closed, its triangles counter-clockwise seen from outside.
pub(crate) fn surface(vessels: &[Vessel]) -> Mesh {
    match vessels {
        [one] => tube(one),
        all => joined(all),
    }
}

/// One vessel: rings, and a cap at either end.
fn tube(vessel: &Vessel) -> Mesh {
    let (line, tube) = (&vessel.centreline, &vessel.tube);
    let rows = (line.length_m() / RING_M).ceil().max(1.0) as usize + 1;
    let at = |row: usize| line.length_m() * row as f64 / (rows - 1) as f64;
    let centres: Vec<CentrelinePoint> = (0..rows).filter_map(|row| line.at(at(row))).collect();
    let round = round(RING);
    let mut points = Vec::with_capacity(rows * RING);
    let mut scalars = Scalars::default();
    let mut caps = [(0.0, 0.0, 0.0); 2];
    for (row, centre) in centres.iter().enumerate() {
        let area = tube.shape().area(centre.at_m);
        let seen = vessel.is_measured(centre.at_m);
        let ring = tube.ring(centre, &round);
        let covariance = tube.covariance(centre.at_m);
        for (point, way) in ring.iter().zip(&round) {
            let r = point.distance(&centre.point);
            let sd = tube.sd(&covariance, way);
            if seen { scalars.push(area, r, sd) } else { scalars.push(f64::NAN, r, f64::NAN) }
        }
        let mean_sd = tube.sd(&covariance, &Way::of((0.0, 0.0)));
        caps[usize::from(row > 0)] = (area, (area / std::f64::consts::PI).sqrt(), mean_sd);
        points.extend(ring);
    }
    caps.into_iter().for_each(|(area, r, sd)| scalars.push(area, r, sd));
    scalars.on(Mesh::tube(&points, (centres.len(), RING)))
}

/// Several vessels: the border of what lies inside any of them.
fn joined(vessels: &[Vessel]) -> Mesh {
    let solids: Vec<Solid<'_>> = vessels.iter().map(Solid::of).collect();
    let seeds = solids.iter().flat_map(Solid::seeds);
    let outside =
        |place: &Vector3<f64>| solids.iter().map(|s| s.outside(place)).fold(f64::INFINITY, f64::min);
    let mesh = march::border(seeds, &outside);
    let mut scalars = Scalars::default();
    for point in &mesh.points {
        let nearest = solids.iter().min_by(|a, b| a.outside(point).total_cmp(&b.outside(point)));
        let (area, radius, sd) = nearest.map_or((f64::NAN, f64::NAN, f64::NAN), |solid| solid.numbers(point));
        scalars.push(area, radius, sd);
    }
    scalars.on(mesh)
}

#[cfg(test)]
mod tests;
