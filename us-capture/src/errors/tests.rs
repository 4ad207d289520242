//! Errors whose size is known by construction.

use nalgebra::{Isometry3, Matrix2, Vector3};
use probepath_frames::{Phantom, Stamp, World};

use super::*;
use crate::phantom::ZFiducial;

/// A Z of 20 x 40 mm in the plane z = 0, wires along y.
fn z() -> WirePhantom {
    let wire = |name: &str, front: f64, back: f64| Wire {
        name: name.into(),
        front: Point::new(front, 0.0, 0.0),
        back: Point::new(back, 0.04, 0.0),
    };
    let wires = vec![wire("left", 0.0, 0.0), wire("middle", 0.0, 0.02), wire("right", 0.02, 0.02)];
    let zs = vec![ZFiducial { first: 0, diagonal: 1, last: 2 }];
    WirePhantom { name: "one Z".into(), wires, zs, landmarks: Vec::new() }
}

/// An image across the wires at y = 10 mm, 0.1 mm a pixel: the middle wire is a quarter of the way.
fn sighting() -> Sighting {
    let dot = |wire, column| SeenWire { wire, at_px: [column, 100.0], covariance_px2: Matrix2::identity() };
    Sighting { image: 7, stamp: Stamp::ZERO, dots: vec![dot(0, 0.0), dot(1, 50.0), dot(2, 200.0)] }
}

/// The errors when the image is `off` (m, phantom's axes) from where it was.
fn found(off: Vector3<f64>) -> Found {
    let phantom = z();
    let mut track = Track::new(Span::from_seconds(1.0));
    // FRAMES: the probe is in the phantom's place, and the phantom in the world's.
    track.push(Stamp::ZERO, Pose::<World, Probe>::assume(Isometry3::identity())).unwrap();
    let origin = Vector3::new(0.0, 0.01, 0.01) + off;
    let chain = Chain {
        phantom: &phantom,
        track: &track,
        // FRAMES: as above.
        world_from_phantom: Pose::<World, Phantom>::assume(Isometry3::identity()),
        lag: Span::ZERO,
        pixels: PixelMap::new(Point::from_vector(origin), Vector3::x() * 1e-4, Vector3::z() * -1e-4),
    };
    let late = Sighting { stamp: Stamp::from_nanoseconds(1), ..sighting() };
    chain.judge(&[sighting(), late])
}

#[test]
fn an_image_in_its_place_has_no_errors_and_one_without_a_pose_is_counted() {
    let found = found(Vector3::zeros());
    assert!(found.mid().worst_m < 1e-12 && found.line().worst_m < 1e-12);
    assert_eq!((found.mids.len(), found.lines.len(), found.outside), (1, 3, 1));
    assert_eq!((found.mids[0].image, found.mids[0].wire), (7, 1));
    assert!((found.mids[0].depth_m - 0.01).abs() < 1e-12);
}

/// Along the wires the sides see nothing, the middle one what its slant shows, and its own point all of it.
#[test]
fn a_shift_along_the_wires_shows_in_the_middle_only() {
    let found = found(Vector3::new(0.0, 1e-3, 0.0));
    assert!((found.mid().rms_m - 1e-3).abs() < 1e-9);
    let slant = 0.02 / f64::hypot(0.02, 0.04);
    let lines: Vec<f64> = found.lines.iter().map(|e| e.error_m).collect();
    assert!(lines[0] < 1e-12 && lines[2] < 1e-12 && (lines[1] - slant * 1e-3).abs() < 1e-9, "{lines:?}");
    assert!((found.of_wire(1).line().rms_m - slant * 1e-3).abs() < 1e-9);
}

#[test]
fn a_shift_in_depth_shows_everywhere() {
    let found = found(Vector3::new(0.0, 0.0, 3e-4));
    assert!(found.lines.iter().chain(&found.mids).all(|e| (e.error_m - 3e-4).abs() < 1e-9));
}

#[test]
fn bands_of_depth_hold_every_error_once() {
    let mut found = found(Vector3::new(1e-4, 0.0, 0.0));
    found.lines[0].depth_m = 0.004;
    let bands = found.by_depth(5e-3);
    assert_eq!(bands.iter().map(|(from, _)| (from * 1e3).round() as i64).collect::<Vec<_>>(), [0, 10]);
    assert_eq!(bands.iter().map(|(_, band)| band.lines.len()).collect::<Vec<_>>(), [1, 2]);
}

/// The largest twentieth is left out of the mean and the standard deviation, and nothing of the root mean square.
#[test]
fn a_summary_is_of_the_best_95_percent() {
    let errors = (1..=20).map(|k| if k == 20 { 1000.0 } else { f64::from(k) });
    let summary = Summary::of(errors);
    assert_eq!(summary.count, 20);
    assert!((summary.mean95_m - 10.0).abs() < 1e-12);
    assert!((summary.sd95_m - 30.0_f64.sqrt()).abs() < 1e-12);
    assert!((summary.rms_m - ((2470.0 + 1e6) / 20.0_f64).sqrt()).abs() < 1e-9);
    assert!((summary.worst_m - 1000.0).abs() < 1e-12);
    assert!(Summary::of([]).rms_m.is_nan());
}

/// Four corners of a square about its middle: every distance is half of the diagonal.
#[test]
fn c_rms_is_the_root_mean_square_about_each_targets_mean() {
    let square = |half: f64, at: f64| -> Vec<Point<Phantom>> {
        [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
            .map(|(x, y)| Point::new(at + half * x, half * y, 0.0))
            .to_vec()
    };
    let alone = vec![Point::new(9.0, 9.0, 9.0)];
    let found = c_rms(&[square(3.0, 100.0), square(4.0, -50.0), alone]).unwrap();
    assert_eq!(found.count, 8);
    assert!((found.rms_m - 25.0_f64.sqrt()).abs() < 1e-9);
    assert!((found.mean_m - 3.5 * 2.0_f64.sqrt()).abs() < 1e-9);
    assert!(c_rms::<Phantom>(&[]).is_none());
}
