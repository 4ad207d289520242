//! The calibration bench: wires in water.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use probepath_frames::{Image, Point, Span};
use probepath_us_capture::{BScan, BScanSource, PixelSpacing};

use super::*;

/// The bench without errors of the arm, with PLUS's nine wires, which stand far apart.
fn bench() -> CellConfig {
    let arm = ArmConfig { stops_above_n: 1e4, ..exact().arm };
    let wires = WirePhantomConfig { phantom: "fcal-1.2".into(), ..WirePhantomConfig::default() };
    let mut config =
        CellConfig { subject: SubjectConfig::WirePhantom(wires), arm, ..CellConfig::wire_phantom() };
    config.machine.imaging.wire_uneven_db = 0.0;
    config.machine.imaging.noise_db = -100.0;
    config
}

/// A probe `over_m` over the highest wire's middle, aside by `aside_m` (World x and z), that looks down, tilted about
/// its own x and y.
fn above(cell: &SimulatedCell, over_m: f64, aside_m: [f64; 2], tilt_deg: [f64; 2]) -> Pose<World, Probe> {
    let bench = cell.nominal().bench.as_ref().unwrap();
    let ends = bench.phantom.wires.iter().flat_map(|wire| [wire.front, wire.back]);
    let top = ends.map(|end| (bench.world_from_phantom * end).vector().y).fold(f64::INFINITY, f64::min);
    let down = Matrix3::from_columns(&[Vector3::x(), -Vector3::z(), Vector3::y()]);
    let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down));
    let [a, b] = tilt_deg.map(f64::to_radians);
    let place = Translation3::new(aside_m[0], top - over_m, aside_m[1]);
    // FRAMES: Probe z on World y (down), Probe x on World x, then tilted.
    Pose::assume(Isometry3::from_parts(place, down * UnitQuaternion::from_euler_angles(a, b, 0.0)))
}

fn joints(cell: &SimulatedCell, probe: &Pose<World, Probe>, near: &Joints) -> Joints {
    let nominal = cell.nominal();
    let base = nominal.world_from_base.inverse() * *probe;
    nominal.model().inverse(&base, &nominal.flange_from_probe, near, &InverseOptions::default()).unwrap()
}

#[test]
fn every_pose_over_the_wires_is_reached_far_from_singularities() {
    for kind in [ArmKind::Ur5e, ArmKind::SevenJoint] {
        let mut config = CellConfig::wire_phantom();
        config.arm.kind = kind;
        let cell = SimulatedCell::new(&config, 1).unwrap();
        let nominal = cell.nominal();
        let mut worst = f64::INFINITY;
        for over_m in [0.008, 0.025, 0.045] {
            for aside_m in [[0.0, 0.0], [-0.03, -0.02], [0.03, -0.02], [0.03, 0.02], [-0.03, 0.02]] {
                for tilt in [[0.0, 0.0], [-20.0, -20.0], [20.0, -20.0], [-20.0, 20.0], [20.0, 20.0]] {
                    let probe = above(&cell, over_m, aside_m, tilt);
                    let found = joints(&cell, &probe, &nominal.start);
                    let jump = found.zip(&nominal.start, |a, b| a - b).largest();
                    assert!(jump < 1.6, "{kind:?} {over_m} {aside_m:?} {tilt:?}: {jump}");
                    let jacobian = nominal.model().jacobian(&found, &nominal.flange_from_probe);
                    worst = worst.min(jacobian.smallest_singular_value());
                }
            }
        }
        println!("{kind:?}: smallest singular value {worst:.3}");
        assert!(worst > 0.08, "{kind:?} {worst}");
    }
}

/// Where each wire shows (px), by the truth; `None` where it misses the picture.
fn expected(cell: &SimulatedCell, stamp: probepath_frames::Stamp) -> Vec<Option<[f64; 2]>> {
    let truth = cell.truth();
    let tank = truth.subject().tank().unwrap();
    let world_from_probe = truth.world_from_probe(stamp + truth.lag()).unwrap();
    let (probe_from_image, spacing) = truth.seen_from_image(&cell.nominal().setting);
    let image_from_phantom =
        (world_from_probe * probe_from_image).inverse() * truth.world_from_phantom().unwrap();
    let wires = tank.phantom().wires.iter();
    wires.map(|wire| crossing(&image_from_phantom, [wire.front, wire.back], &spacing)).collect()
}

fn crossing(
    image_from_phantom: &Pose<Image, probepath_frames::Phantom>,
    ends: [Point<probepath_frames::Phantom>; 2],
    spacing: &PixelSpacing,
) -> Option<[f64; 2]> {
    let [a, b] = ends.map(|end| (*image_from_phantom * end).vector());
    let p = a + (b - a) * (a.z / (a.z - b.z));
    let (column, row) = spacing.pixel(Point::from_vector(p));
    let inside = (40.0..600.0).contains(&column) && (30.0..460.0).contains(&row) && a.z * b.z < 0.0;
    inside.then_some([column, row])
}

/// Centroid of the amplitude around a place; grey levels are logarithms.
fn centroid(bscan: &BScan, [column, row]: [f64; 2]) -> [f64; 2] {
    let (mut mass, mut sum) = (0.0, [0.0; 2]);
    for y in row as usize - 15..=row as usize + 16 {
        for x in column as usize - 38..=column as usize + 39 {
            let grey = bscan.pixels()[y * bscan.width() + x];
            let weight = if grey == 0 { 0.0 } else { 10_f64.powf(f64::from(grey) / 255.0 * 50.0 / 20.0) };
            mass += weight;
            sum = [sum[0] + weight * x as f64, sum[1] + weight * y as f64];
        }
    }
    sum.map(|s| s / mass)
}

#[test]
fn every_wire_shows_where_the_truth_says_whatever_moves_and_lags() {
    let mut config = bench();
    config.knobs.machine.unknown_latency_ms = 35.0;
    let cell = SimulatedCell::new(&config, 4).unwrap();
    assert_eq!(cell.truth().lag(), Span::from_milliseconds(-35));
    let (mut arm, start) = (cell.arm(), cell.nominal().start);
    let from = joints(&cell, &above(&cell, 0.016, [-0.004, 0.0], [8.0, -4.0]), &start);
    let to = joints(&cell, &above(&cell, 0.022, [0.004, 0.006], [-6.0, 5.0]), &start);
    go(&mut arm, &start, &from, 1200);
    let mut machine = cell.machine();
    go(&mut arm, &from, &to, 500);
    let (mut seen, mut worst) = (0, 0.0_f64);
    while let Ok(Some(bscan)) = machine.poll(cell.now()) {
        for at in expected(&cell, bscan.formed).into_iter().flatten() {
            let found = centroid(&bscan, at);
            let error = (found[0] - at[0]).hypot(found[1] - at[1]);
            worst = worst.max(error);
            seen += 1;
        }
    }
    println!("{seen} dots, the worst {worst:.2} px off");
    assert!(seen > 100 && worst < 1.0, "{seen} {worst}");
}

#[test]
fn water_bears_the_probe_freely_and_plates_do_not() {
    let cell = SimulatedCell::new(&bench(), 4).unwrap();
    let (mut arm, start) = (cell.arm(), cell.nominal().start);
    let mut machine = cell.machine();
    let free = joints(&cell, &above(&cell, 0.016, [0.0, 0.0], [0.0, 0.0]), &start);
    go(&mut arm, &start, &free, 1200);
    let moments = cell.truth().moments();
    assert!(moments.iter().all(|moment| moment.skin.force.norm() == 0.0));
    let air = machine.poll(cell.now()).unwrap().unwrap();
    assert!(air.pixels()[..640 * 20].iter().map(|&g| u64::from(g)).sum::<u64>() > 640 * 20 * 60, "it rings");
    machine.drop_until(cell.now());
    go(&mut arm, &free, &free, 50);
    let wet = machine.poll(cell.now()).unwrap().unwrap();
    assert_eq!(wet.pixels()[640 * 30..640 * 70].iter().max(), Some(&0), "dark water");
    // The back plate begins 20 mm from the middle; the face is 10 mm thick.
    let plate = joints(&cell, &above(&cell, 0.004, [0.0, 0.019], [0.0, 0.0]), &start);
    go(&mut arm, &free, &plate, 400);
    assert!(cell.truth().now().skin.force.norm() > 3.0, "{}", cell.truth().now().skin.force);
}

#[test]
fn a_pointer_in_the_landmarks_is_recorded_as_well_as_the_arm_knows_where_it_is() {
    for (error, accuracy_m) in [(KinematicError::Off, 0.0), (KinematicError::Paper, 0.75e-3)] {
        let mut config = CellConfig::wire_phantom();
        config.arm.kinematic_error = error;
        let cell = SimulatedCell::new(&config, 6).unwrap();
        let tank = cell.subject().tank().unwrap();
        let touches = cell.touches(10).unwrap();
        assert_eq!(touches.len(), 40);
        assert_eq!(touches, cell.touches(10).unwrap(), "the same seed gives the same");
        let off: Vec<f64> = touches
            .iter()
            .map(|touch| {
                let landmark = tank.phantom().landmarks[touch.landmark].at;
                let tip = touch.world_from_flange * tank.pointer_tip();
                tip.distance(&(*tank.world_from_phantom() * landmark))
            })
            .collect();
        let (mean, _) = mean_and_deviation(&off);
        println!("{error:?}: {:.3} mm from the landmark", mean * 1e3);
        // Three axes of 0.1 mm: 0.16 mm in the mean.
        assert!((0.1e-3..0.25e-3 + 1.3 * accuracy_m).contains(&mean), "{mean}");
        let tilts = touches
            .iter()
            .map(|touch| touch.world_from_flange.z_axis().angle(&touches[0].world_from_flange.z_axis()));
        assert!(tilts.fold(0.0, f64::max) > 0.3, "postures that differ");
    }
    assert_eq!(SimulatedCell::new(&CellConfig::phantom(), 1).unwrap().touches(3).unwrap(), Vec::new());
}

#[test]
fn nobody_guides_where_there_is_no_vessel() {
    let cell = SimulatedCell::new(&CellConfig::wire_phantom(), 1).unwrap();
    cell.hand().guide();
    assert!(!cell.hand().guides());
}
