//! How long the wires of an image take to be named: nine wires and 25 dots, the paper's 43 wires, and near a prediction.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Matrix2;
use probepath_frames::{Image, Phantom, Pose, nalgebra::Isometry3};
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::dots::Dot;
use probepath_us_capture::label::{LabelOptions, Labeller};
use probepath_us_capture::phantom::WirePhantom;

const SPACING: PixelSpacing = PixelSpacing { x_m: 80e-6, y_m: 80e-6 };

fn dot(at_px: [f64; 2]) -> Dot {
    let covariance_px2 = Matrix2::identity() * 0.25;
    Dot { at_px, covariance_px2, spread_px2: covariance_px2 * 16.0, peak: 200.0, mass: 2e3, cut: false }
}

/// A plane through the middle of the phantom, 40 mm wide, tilted a little.
fn plane(phantom: &WirePhantom) -> Pose<Phantom, Image> {
    let ends: Vec<_> = phantom.wires.iter().flat_map(|w| [w.front.vector(), w.back.vector()]).collect();
    let middle = ends.iter().sum::<nalgebra::Vector3<f64>>() / ends.len() as f64;
    let along = phantom.wires[0].run().normalize();
    let turn =
        nalgebra::UnitQuaternion::rotation_between(&nalgebra::Vector3::z(), &along).unwrap_or_default();
    let turn = turn * nalgebra::UnitQuaternion::from_euler_angles(0.15, -0.1, 0.3);
    let to = middle + along * 4e-3 - turn * nalgebra::Vector3::new(20e-3, 20e-3, 0.0);
    // FRAMES: made here: the image's axes in the phantom's.
    Pose::assume(Isometry3::from_parts(to.into(), turn))
}

/// The wires' dots in a window of 500 x 500 pixels, and clutter from a fixed sequence up to `count`.
fn dots(phantom: &WirePhantom, plane: &Pose<Phantom, Image>, count: usize) -> Vec<Dot> {
    let image_from_phantom = plane.inverse();
    let crossing = |w: &probepath_us_capture::phantom::Wire| {
        let (a, b) = ((image_from_phantom * w.front).vector(), (image_from_phantom * w.back).vector());
        let at = (a + (b - a) * (a.z / (a.z - b.z))) / SPACING.x_m;
        let inside = a.z * b.z < 0.0 && at.x > 0.0 && at.y > 0.0 && at.x < 500.0 && at.y < 500.0;
        inside.then(|| dot([at.x, at.y]))
    };
    let mut dots: Vec<Dot> = phantom.wires.iter().filter_map(crossing).collect();
    for k in dots.len()..count {
        let part = |prime: f64| (k as f64 * prime).fract() * 500.0;
        dots.push(dot([part(0.618_034), part(0.754_878)]));
    }
    dots
}

fn label(c: &mut Criterion) {
    for (name, title) in [("fcal-1.2", "9 wires"), ("z-19", "43 wires")] {
        let Some(phantom) = WirePhantom::shipped(name) else { continue };
        let labeller = Labeller::new(&phantom, LabelOptions::default());
        let plane = plane(&phantom);
        let dots = dots(&phantom, &plane, 25);
        c.bench_function(&format!("candidates, {title}, {} dots", dots.len()), |b| {
            b.iter(|| labeller.candidates(&dots, SPACING));
        });
        c.bench_function(&format!("near, {title}, {} dots", dots.len()), |b| {
            b.iter(|| labeller.near(&dots, &plane, SPACING, 3e-3));
        });
    }
}

criterion_group!(benches, label);
criterion_main!(benches);
