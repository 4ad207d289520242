use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::closest::on_triangle;
use super::sides::{Closure, Sides};
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
            let all = mesh.triangles.iter().map(|t| (on_triangle(&place, &mesh.corners(t)).0 - place).norm());
            let brute = all.fold(f64::INFINITY, f64::min);
            let found = tree.to(&place);
            assert!((found.distance - brute).abs() < 1e-12, "{} {brute}", found.distance);
            assert!(((found.point - place).norm() - brute).abs() < 1e-12);
        }
    }
}

#[test]
fn thousands_of_places_asked_together_get_the_answers_they_get_alone() {
    let gold = tube(60, 40, 0.0);
    let mut dice = Dice(15);
    // Near, on, and far from the surface, in no order; and some so far that single precision says nothing.
    let place = |dice: &mut Dice| {
        let k = (dice.uniform() * gold.points.len() as f64) as usize;
        let off = 10.0_f64.powf(dice.uniform() * 12.0 - 7.0);
        gold.points[k.min(gold.points.len() - 1)] + vector(dice) * if k.is_multiple_of(9) { 0.0 } else { off }
    };
    let places: Vec<_> = (0..3000).map(|_| place(&mut dice)).collect();
    let tree = Nearest::new(&gold);
    for (place, found) in places.iter().zip(tree.to_each(&places)) {
        assert_eq!(found, tree.to(place));
        let all = gold.triangles.iter().map(|t| (on_triangle(place, &gold.corners(t)).0 - place).norm());
        let brute = all.fold(f64::INFINITY, f64::min);
        assert!((found.distance - brute).abs() <= 1e-14 + 1e-12 * brute, "{} {brute}", found.distance);
    }
}

/// How often a closed mesh winds round a place (van Oosterom and Strackee 1983): one inside, nothing outside.
fn winding(mesh: &Mesh, place: &Vector3<f64>) -> f64 {
    let solid = |triangle: &[u32; 3]| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner - place);
        let (x, y, z) = (a.norm(), b.norm(), c.norm());
        let down = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
        2.0 * a.dot(&b.cross(&c)).atan2(down)
    };
    mesh.triangles.iter().map(solid).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

#[test]
fn a_sign_says_on_which_side_a_place_lies_as_the_winding_number_does() {
    let mut dice = Dice(16);
    // A thin star: the nearest triangle's own normal is wrong at its tips and notches.
    let ring = |k: usize, x: f64| {
        let (angle, r) =
            (k as f64 * std::f64::consts::TAU / 10.0, if k.is_multiple_of(2) { 0.02 } else { 0.003 });
        probepath_frames::Point::new(x, r * angle.cos(), r * angle.sin())
    };
    let points: Vec<_> = [0.0, 0.004].iter().flat_map(|&x| (0..10).map(move |k| ring(k, x))).collect();
    for mesh in [Mesh::tube(&points, (2, 10)), tube(30, 12, 0.0)] {
        assert!(Closure::of(&mesh).is_closed() && mesh.volume_m3() > 0.0);
        let (tree, sides) = (Nearest::new(&mesh), Sides::of(&mesh));
        let mut inside = 0;
        for _ in 0..3000 {
            let middle = mesh.points[(dice.uniform() * 20.0) as usize];
            let place = middle + vector(&mut dice) * 0.012;
            let closest = tree.to(&place);
            let winds = winding(&mesh, &place);
            assert!((winds - winds.round()).abs() < 1e-6, "{winds}");
            assert_eq!(sides.signed(&tree, &place, &closest) < 0.0, winds > 0.5, "{place} {closest:?}");
            inside += usize::from(winds > 0.5);
        }
        assert!((200..2800).contains(&inside), "{inside}");
    }
}

#[test]
fn the_closest_point_of_a_triangle_is_nearer_than_any_sampled_one() {
    let mut dice = Dice(6);
    for _ in 0..1000 {
        let corners = [vector(&mut dice), vector(&mut dice), vector(&mut dice)];
        let place = vector(&mut dice) * 2.0;
        let found = (on_triangle(&place, &corners).0 - place).norm();
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
fn a_surface_that_is_too_small_is_so_with_a_sign() {
    let (gold, small, large) = (tube(200, 60, 0.0), tube(200, 60, -0.0003), tube(200, 60, 0.0003));
    let bias =
        |surface: &Mesh| compare(surface, &gold, Fit::None).expect("surfaces").bias_mm.expect("closed");
    assert!((bias(&small) + 0.3).abs() < 0.04 && (bias(&large) - 0.3).abs() < 0.04);
    let found = compare(&small, &gold, Fit::None).expect("surfaces");
    let signed = found.signed_mm.expect("closed");
    assert!(signed.iter().zip(&found.error_mm).all(|(a, b)| (a.abs() - b).abs() < 1e-12));
    assert!(found.warnings.is_empty());
}

#[test]
fn an_open_gold_standard_gives_distances_without_a_sign_and_says_so() {
    let (mut gold, surface) = (tube(80, 30, 0.0), tube(80, 30, -0.0003));
    // Without the caps.
    gold.triangles.truncate(79 * 30 * 2);
    let found = compare(&surface, &gold, Fit::None).expect("surfaces");
    assert_eq!(found.warnings, [CompareWarning::Open { edges: 60 }]);
    assert!(found.signed_mm.is_none() && found.bias_mm.is_none() && found.error.mean_mm > 0.2);
    assert!(found.warnings[0].to_string().contains("open"));
}

#[test]
fn a_gold_standard_inside_out_is_turned_and_says_so() {
    let (mut gold, surface) = (tube(80, 30, 0.0), tube(80, 30, -0.0003));
    let right = compare(&surface, &gold, Fit::None).expect("surfaces");
    gold.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let found = compare(&surface, &gold, Fit::None).expect("surfaces");
    assert_eq!(found.warnings, [CompareWarning::InsideOut]);
    assert!((found.bias_mm.expect("closed") - right.bias_mm.expect("closed")).abs() < 1e-12);
    // Some of its triangles only: nobody can say which.
    gold.triangles[7].swap(0, 1);
    let found = compare(&surface, &gold, Fit::None).expect("surfaces");
    assert!(matches!(found.warnings[..], [CompareWarning::Folded { edges: 3 }]) && found.bias_mm.is_none());
}

#[test]
fn a_gold_standard_in_metres_or_of_another_size_is_refused() {
    let surface = tube(80, 30, 0.0);
    let scaled = |by: f64| {
        let mut gold = surface.clone();
        gold.points.iter_mut().for_each(|p| *p *= by);
        gold
    };
    let refused = |by: f64| compare(&surface, &scaled(by), Fit::Rigid).expect_err("another unit");
    assert!(matches!(refused(1e-3), CompareError::Metres { which: "gold standard", .. }));
    assert!(matches!(refused(1e3), CompareError::Metres { which: "surface", .. }));
    assert!(matches!(refused(50.0), CompareError::Sizes { .. }));
    assert!(refused(1e-3).to_string().contains("in metres"));
    assert!(compare(&surface, &scaled(2.0), Fit::Rigid).is_ok());
}

#[test]
fn the_robust_fit_is_not_pulled_by_what_the_gold_standard_has_not() {
    let gold = tube(200, 40, 0.0);
    let mut dice = Dice(17);
    for _ in 0..3 {
        let turn = UnitQuaternion::from_scaled_axis(vector(&mut dice) * 0.5);
        let moved = Isometry3::from_parts((vector(&mut dice) * 0.1).into(), turn);
        // A part of the vessel, a seventh of whose points stand 6 mm off to one side: a branch.
        let mut surface = gold.clone();
        surface.points.truncate(40 * 130);
        surface.triangles.retain(|t| t.iter().all(|&k| k < 40 * 130));
        let branch = surface.points.iter_mut().skip(40 * 100).take(40 * 18);
        branch.for_each(|p| p.z += 0.006);
        let laid = surface.moved(&moved);
        let found = compare(&laid, &gold, Fit::Icp).expect("surfaces");
        let back = found.gold_from_surface * moved;
        assert!(back.translation.vector.norm() < 1e-4 && back.rotation.angle() < 2e-3, "{back}");
        let plain = compare(&laid, &gold, Fit::Rigid).expect("surfaces").gold_from_surface * moved;
        assert!(plain.translation.vector.norm() > back.translation.vector.norm());
    }
}

#[test]
fn a_tube_laid_flat_has_its_length_radius_and_turns() {
    let gold = tube(101, 40, 0.0);
    let flat = unrolled(&gold);
    assert_eq!(flat.len(), gold.points.len());
    // The tube's grid: rows of 40 around, a millimetre apart, oval (1 to 1.2).
    let row = &flat[40 * 70..40 * 71];
    assert!(row.iter().all(|p| (0.0035..0.0053).contains(&p.radius_m)), "{row:?}");
    let mut turned: Vec<f64> =
        row.windows(2).map(|p| (p[1].angle - p[0].angle).rem_euclid(std::f64::consts::TAU)).collect();
    turned.sort_by(f64::total_cmp);
    let step = turned[turned.len() / 2];
    assert!((step - 0.157).abs() < 0.04 || (step - (std::f64::consts::TAU - 0.157)).abs() < 0.04, "{step}");
    let length = flat.iter().map(|p| p.along_m).fold(0.0, f64::max);
    assert!((length - 0.1).abs() < 4e-3, "{length}");
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
