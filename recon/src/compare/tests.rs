use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::closest::on_triangle;
use super::*;
use crate::phantom_images::Dice;

/// A closed tube along x with a narrowing, slightly bent and oval, so that it can lie in one way only.
fn tube(rows: usize, around: usize, wider: f64) -> Mesh {
    let length = 0.1;
    let point = |row: usize, k: usize| {
        let x = length * row as f64 / (rows - 1) as f64;
        let angle = std::f64::consts::TAU * k as f64 / around as f64;
        let r = 0.004 - 0.002 * (-((x - 0.03) / 0.006_f64).powi(2)).exp() + wider;
        let bend = 0.004 * (x / 0.05).powi(2);
        Vector3::new(x, bend + r * angle.cos(), 1.2 * r * angle.sin())
    };
    let points = (0..rows).flat_map(|row| (0..around).map(move |k| (row, k))).map(|(r, k)| point(r, k));
    let points: Vec<_> = points.map(probepath_frames::Point::from_vector).collect();
    let surface = crate::LumenSurface {
        along: rows,
        around,
        points,
        at_m: vec![0.0; rows],
        centres: Vec::new(),
        measured: vec![true; rows],
    };
    surface.mesh()
}

fn vector(dice: &mut Dice) -> Vector3<f64> {
    Vector3::new(dice.uniform() - 0.5, dice.uniform() - 0.5, dice.uniform() - 0.5)
}

#[test]
fn the_closest_point_is_the_one_that_trying_every_triangle_finds() {
    let mut dice = Dice(5);
    for case in 0..30 {
        let points: Vec<_> = (0..60).map(|_| vector(&mut dice)).collect();
        let corner = |dice: &mut Dice| (dice.uniform() * 60.0) as u32;
        let mut triangles: Vec<[u32; 3]> =
            (0..1 + case * 7).map(|_| [corner(&mut dice), corner(&mut dice), corner(&mut dice)]).collect();
        triangles.push([0, 0, 1]);
        let mesh = Mesh { points, triangles, ..Mesh::default() };
        let tree = Nearest::new(&mesh);
        for _ in 0..100 {
            let place = vector(&mut dice) * 2.0;
            let all = mesh.triangles.iter().map(|t| (on_triangle(&place, &mesh.corners(t)) - place).norm());
            let brute = all.fold(f64::INFINITY, f64::min);
            let found = tree.to(&place);
            assert!((found.distance - brute).abs() < 1e-12, "{} {brute}", found.distance);
            assert!(((found.point - place).norm() - brute).abs() < 1e-12);
        }
    }
}

#[test]
fn the_closest_point_of_a_triangle_is_nearer_than_any_sampled_one() {
    let mut dice = Dice(6);
    for _ in 0..1000 {
        let corners = [vector(&mut dice), vector(&mut dice), vector(&mut dice)];
        let place = vector(&mut dice) * 2.0;
        let found = (on_triangle(&place, &corners) - place).norm();
        let n = 60;
        let mut sampled = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                sampled = sampled.min((p - place).norm());
            }
        }
        assert!(found <= sampled + 1e-12 && sampled - found < 0.04, "{found} {sampled}");
    }
}

#[test]
fn a_surface_moved_away_is_laid_back_on_itself() {
    let gold = tube(80, 30, 0.0);
    let mut dice = Dice(7);
    for case in 0..6 {
        let size = if case < 3 { 0.2 } else { 3.0 };
        let turn = UnitQuaternion::from_scaled_axis(vector(&mut dice) * size);
        let moved = Isometry3::from_parts((vector(&mut dice) * 0.5).into(), turn);
        let mut surface = tube(90, 28, 0.0);
        surface.points.iter_mut().for_each(|p| *p = moved.transform_point(&(*p).into()).coords);
        let found = compare(&surface, &gold, Fit::Rigid).expect("surfaces");
        assert!(found.error.mean_mm < 0.02 && found.hausdorff_mm < 0.12, "{case}: {:?}", found.error);
        assert!(found.area_error_percent.abs() < 1.0, "{}", found.area_error_percent);
        let back = found.gold_from_surface * moved;
        assert!(back.translation.vector.norm() < 2e-4 && back.rotation.angle() < 5e-3, "{case}: {back}");
    }
}

#[test]
fn a_surface_that_is_too_small_everywhere_says_by_how_much() {
    let (gold, surface) = (tube(200, 60, 0.0), tube(200, 60, -0.0003));
    let found = compare(&surface, &gold, Fit::None).expect("surfaces");
    assert!((found.error.mean_mm - 0.3).abs() < 0.03, "{:?}", found.error);
    assert!(found.error.rms_mm >= found.error.mean_mm && found.error.max_mm >= found.error.p95_mm);
    // Both axes of the section lose 0.3 (1.2 times 0.3) of 4 (4.8) mm, more where it is narrow.
    assert!((-17.5..-14.0).contains(&found.area_error_percent), "{}", found.area_error_percent);
    // Seven tenths along, away from the narrowing and the leaning ends.
    let pair = found.areas[70];
    assert!((pair.gold_mm2 / (std::f64::consts::PI * 4.0 * 4.8) - 1.0).abs() < 0.05, "{pair:?}");
}

#[test]
fn a_part_of_the_vessel_is_not_blamed_for_the_rest() {
    let gold = tube(200, 40, 0.0);
    let mut surface = gold.clone();
    surface.triangles.retain(|t| t.iter().all(|&k| (40 * 60..40 * 140).contains(&(k as usize))));
    let used = 40 * 60..40 * 140;
    let shift = used.start as u32;
    surface.points = surface.points[used].to_vec();
    surface.triangles.iter_mut().flatten().for_each(|k| *k -= shift);
    let found = compare(&surface, &gold, Fit::Near).expect("surfaces");
    // The ends of a bent tube lean: a millimetre, where the rest of the vessel is 30 mm away.
    assert!(found.hausdorff_mm < 1.5, "{}", found.hausdorff_mm);
}

#[test]
fn what_is_no_surface_is_refused() {
    let gold = tube(20, 10, 0.0);
    assert!(matches!(compare(&Mesh::default(), &gold, Fit::Rigid), Err(CompareError::Empty { .. })));
    let mut broken = gold.clone();
    broken.points[3].x = f64::NAN;
    assert!(matches!(
        compare(&gold, &broken, Fit::Rigid),
        Err(CompareError::Broken { which: "gold standard" })
    ));
}
