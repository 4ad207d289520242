use std::collections::HashMap;

use super::*;
use crate::phantom_contours::{BentVessel, Cut, numbered};
use crate::phantom_images::Dice;
use crate::{Contour, ImageLumen, LumenReconstruction, LumenSettings, reconstruct_from};

/// Asserts that the mesh is closed, of two-sided edges, facing outward, and without handles; gives its parts.
fn closed(mesh: &Mesh, name: &str) -> usize {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    let mut part: Vec<usize> = (0..mesh.points.len()).collect();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            assert_ne!(a, b, "{name}");
            assert!(edges.insert((a, b), 1).is_none(), "{name}: two triangles on one side of an edge");
            let (x, y) = (root(&mut part, a as usize), root(&mut part, b as usize));
            part[x.max(y)] = x.min(y);
        }
    }
    assert!(edges.keys().all(|(a, b)| edges.contains_key(&(*b, *a))), "{name}: an open edge");
    let parts = (0..part.len()).filter(|&i| part[i] == i).count();
    let euler = mesh.points.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64;
    assert_eq!(euler, 2 * parts as i64, "{name}");
    assert!(mesh.volume_m3() > 0.0, "{name}");
    assert!(mesh.scalars.iter().all(|scalars| scalars.values.len() == mesh.points.len()));
    parts
}

fn root(part: &mut [usize], mut i: usize) -> usize {
    while part[i] != i {
        part[i] = part[part[i]];
        i = part[i];
    }
    i
}

fn across(at: f64) -> Cut {
    Cut { at, tilt: 0.0, way: 0.0, off: Vector3::zeros() }
}

fn sweep(vessel: &BentVessel, from: f64, number: usize) -> Vec<Contour> {
    let count = ((vessel.length - from) / 0.7e-3) as usize;
    let each = (0..=count).map(|i| vessel.contour(across(from + i as f64 * 0.7e-3), 48, |_| 0.0));
    each.map(|contour| Contour { vessel: number, ..contour }).collect()
}

/// The branch's contours stand in the images of the first vessel, as far as there are any.
fn both(first: Vec<Contour>, branch: Vec<Contour>) -> Vec<ImageLumen> {
    let mut lumens = numbered(first);
    lumens.iter_mut().skip(20).zip(branch).for_each(|(image, contour)| image.others.push(contour));
    lumens
}

fn made(lumens: Vec<ImageLumen>) -> LumenReconstruction {
    reconstruct_from(&[], lumens, &LumenSettings::default()).expect("vessels")
}

#[test]
fn one_vessel_has_a_closed_surface_of_its_true_volume_with_its_numbers() {
    let mut dice = Dice(31);
    for case in 0..20 {
        let mut vessel =
            BentVessel::new(0.08, 2.5e-3 + 1.5e-3 * dice.uniform(), 2.0 * dice.uniform(), &mut dice);
        vessel.stenoses.push((0.04, 0.02, 0.75));
        let mesh = made(numbered(sweep(&vessel, 0.0, 0))).closed_surface();
        assert_eq!(closed(&mesh, &format!("case {case}")), 1);
        let slices = (0..800).map(|i| vessel.radius_at((f64::from(i) + 0.5) * 1e-4).powi(2) * 1e-4);
        let volume = slices.sum::<f64>() * std::f64::consts::PI;
        // The last image lies up to 0.7 mm before the end.
        assert!((mesh.volume_m3() / volume - 1.0).abs() < 0.015, "{case}: {} {volume}", mesh.volume_m3());
        let areas = mesh.scalars("area_mm2").expect("areas");
        let least = areas.iter().copied().fold(f64::INFINITY, f64::min);
        let exact = std::f64::consts::PI * (vessel.radius_at(0.04) * 1e3).powi(2);
        assert!((least / exact - 1.0).abs() < 0.05, "{case}: {least} {exact}");
        let sds = mesh.scalars("error_sd_mm").expect("deviations");
        assert!(sds.iter().all(|sd| (0.04..0.2).contains(sd)), "{case}");
    }
}

#[test]
fn a_branch_and_its_parent_are_one_closed_surface() {
    let mut dice = Dice(32);
    for case in 0..12 {
        let first = BentVessel::new(0.07, 3.9e-3, 0.5 * dice.uniform(), &mut dice);
        let along = (first.axis(0.021) - first.axis(0.019)).normalize();
        let aside = along.cross(&Vector3::new(dice.uniform() - 0.5, 0.3, dice.uniform() - 0.5)).normalize();
        let angle = 0.5 + 0.5 * dice.uniform();
        let way = along * angle.cos() + aside * angle.sin();
        let branch = BentVessel::straight(0.05, 2.2e-3 + 1.2e-3 * dice.uniform(), first.axis(0.02), way);
        // It is seen by itself only once it is out of its parent.
        let from = (3.9e-3 + branch.radius * angle.cos()) / angle.sin() + 0.5e-3;
        let found = made(both(sweep(&first, 0.0, 0), sweep(&branch, from, 1)));
        assert_eq!(found.vessels.len(), 2, "{case}: {:?}", found.warnings);
        let leaves = found.vessels[1].leaves.expect("seen to leave");
        assert_eq!(leaves.parent, 0);
        let exit = 20.0 + 3.9 / angle.tan();
        assert!((leaves.at_mm - exit).abs() < 4.0, "{case}: {leaves:?} {exit}");
        assert!((leaves.angle_deg - angle.to_degrees()).abs() < 12.0, "{case}: {leaves:?} {angle}");
        let mesh = found.closed_surface();
        assert_eq!(closed(&mesh, &format!("case {case}")), 1);
        // Every point lies on one of the two, or bridges from the branch to its parent.
        let sds = mesh.scalars("error_sd_mm").expect("deviations");
        let known = mesh.points.iter().zip(sds).filter(|(_, sd)| sd.is_finite());
        let capped = |p: &&Vector3<f64>| {
            [&first, &branch]
                .iter()
                .any(|v| [0.0, v.length].iter().any(|end| (v.axis(*end) - **p).norm() < 6e-3))
        };
        for (point, _) in known.filter(|(p, _)| !capped(p)) {
            let off = |vessel: &BentVessel, near: f64| {
                let (at, r) = vessel.seen_from(point, near);
                (r - vessel.radius_at(at)).abs()
            };
            let near = |v: &BentVessel| {
                let distance = |i: &i32| (v.axis(f64::from(*i) * 1e-3) - point).norm();
                let all = 0..(v.length * 1e3) as i32;
                all.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(0.0, |i| f64::from(i) * 1e-3)
            };
            let apart = off(&first, near(&first)).min(off(&branch, near(&branch)));
            assert!(apart < 0.1e-3, "{case}: {:.3} mm", apart * 1e3);
        }
    }
}

#[test]
fn a_branch_far_from_every_vessel_stands_by_itself_and_that_is_said() {
    let mut dice = Dice(33);
    let first = BentVessel::new(0.06, 3.5e-3, 0.0, &mut dice);
    let away =
        BentVessel::straight(0.03, 2.5e-3, first.axis(0.03) + Vector3::new(0.0, 0.2, 0.0), Vector3::x());
    let found = made(both(sweep(&first, 0.0, 0), sweep(&away, 0.0, 1)));
    assert!(found.warnings.contains(&crate::ReconWarning::NotJoined { vessel: 1 }));
    assert_eq!(found.vessels[1].leaves, None);
    assert_eq!(closed(&found.closed_surface(), "apart"), 2);
}

#[test]
fn a_branch_of_two_contours_is_left_out_and_that_is_said() {
    let first = BentVessel::new(0.06, 3.5e-3, 0.3, &mut Dice(34));
    let branch =
        BentVessel::straight(0.03, 2.0e-3, first.axis(0.03) + Vector3::new(0.0, 7e-3, 0.0), Vector3::x());
    let two: Vec<Contour> = sweep(&branch, 0.0, 1).into_iter().take(2).collect();
    let found = made(both(sweep(&first, 0.0, 0), two));
    assert_eq!(found.vessels.len(), 1);
    assert!(found.warnings.iter().any(|w| matches!(w, crate::ReconWarning::NoBranch { vessel: 1, .. })));
}
