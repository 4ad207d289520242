//! Tracked sequences of a wire phantom with a known truth, drawn for tests: a spot wherever a wire crosses the image's
//! plane. No physics: what is tested is the road around the dots, and that bad input is said.

#![allow(dead_code, reason = "every test uses some of it")]

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Phantom, Pose, Probe, Stamp, World};
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::sequence::{Sequence, SequenceImage, Status, Tracked, TransformName};

/// A phantom, a probe that moves over it, and the truth that a calibration has to find.
#[derive(Clone, Debug)]
pub struct Drawn {
    pub phantom: WirePhantom,
    pub size: (usize, usize),
    pub spacing: PixelSpacing,
    pub probe_from_image: Pose<Probe, Image>,
    pub world_from_phantom: Pose<World, Phantom>,
    /// An image stamped t shows the pose at t + lag.
    pub lag_s: f64,
    /// How far the probe moves (m) and tilts (rad); zero for a probe that stands still.
    pub travel_m: f64,
    pub tilt_rad: f64,
}

impl Drawn {
    pub fn over(phantom: WirePhantom) -> Self {
        let turn = UnitQuaternion::from_euler_angles(0.4, -0.2, 1.1);
        let placed = UnitQuaternion::from_euler_angles(-0.1, 0.2, 0.5);
        Self {
            phantom,
            size: (480, 400),
            spacing: PixelSpacing { x_m: 1.3e-4, y_m: 1.2e-4 },
            // FRAMES: the truth of the drawing; nothing under test sees it.
            probe_from_image: Pose::assume(Isometry3::from_parts(Translation3::new(0.02, -0.01, 0.05), turn)),
            // FRAMES: as above.
            world_from_phantom: Pose::assume(Isometry3::from_parts(
                Translation3::new(0.1, 0.2, -0.3),
                placed,
            )),
            lag_s: 0.12,
            travel_m: 0.008,
            tilt_rad: 0.3,
        }
    }

    /// So many images, ten a second, and the poses at their stamps; `from_s` is where on the probe's way it begins.
    pub fn sequence(&self, images: usize, from_s: f64) -> Sequence {
        let mut sequence = Sequence::new(self.size.0, self.size.1);
        for nth in 0..images {
            let at_s = from_s + nth as f64 * 0.1;
            let picture = self.picture(&self.phantom_from_image(at_s + self.lag_s), nth as u64);
            sequence.push(self.image(nth as u64, at_s, picture)).unwrap();
        }
        sequence
    }

    fn image(&self, number: u64, at_s: f64, pixels: Vec<u8>) -> SequenceImage {
        let world_from_probe =
            self.world_from_phantom * self.phantom_from_image(at_s) * self.probe_from_image.inverse();
        let mut matrix_mm = world_from_probe.isometry().to_homogeneous();
        matrix_mm.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e3);
        let pose = Tracked { matrix_mm, status: Status::Ok };
        SequenceImage {
            number,
            pixels: Some(pixels.into()),
            status: Status::Ok,
            stamp: Some(Stamp::from_nanoseconds((at_s * 1e9).round() as i64)),
            transforms: BTreeMap::from([(TransformName::new("Probe", "Reference"), pose)]),
            fields: BTreeMap::new(),
        }
    }

    /// Where the image's plane is at an instant: across the wires, in the middle of the phantom, slowly moved and
    /// tilted about every axis.
    fn phantom_from_image(&self, at_s: f64) -> Pose<Phantom, Image> {
        let (low, high) = self.box_of_wires();
        let middle = (low + high) / 2.0;
        let run = self.phantom.wires[0].run().normalize();
        // Columns along the longer of the two directions across the wires, rows along the other.
        let across = Vector3::new(high.x - low.x, high.y - low.y, high.z - low.z);
        let across = (across - run * across.dot(&run)).map(f64::abs);
        let x = if across.x > 1e-3 { Vector3::x() } else { Vector3::y() };
        let x = (x - run * x.dot(&run)).normalize();
        let y = -run.cross(&x);
        let upright = UnitQuaternion::from_basis_unchecked(&[x, y, -run]);
        let wave = |period_s: f64, phase: f64| (TAU * (at_s / period_s + phase)).sin();
        let tilt = Vector3::new(wave(7.3, 0.1), wave(5.1, 0.4), 0.4 * wave(6.1, 0.7)) * self.tilt_rad;
        let travel = Vector3::new(wave(8.7, 0.2), 0.5 * wave(4.3, 0.5), 0.8 * wave(9.9, 0.9)) * self.travel_m;
        let turn = upright * UnitQuaternion::from_scaled_axis(tilt);
        let centre = Vector3::new(
            self.size.0 as f64 / 2.0 * self.spacing.x_m,
            self.size.1 as f64 / 2.0 * self.spacing.y_m,
            0.0,
        );
        let origin = middle + upright * travel - turn * centre;
        // FRAMES: the truth of the drawing.
        Pose::assume(Isometry3::from_parts(Translation3::from(origin), turn))
    }

    /// Where the phantom is, as PLUS writes it (mm).
    pub fn phantom_to_reference(&self) -> Matrix4<f64> {
        let mut matrix = self.world_from_phantom.isometry().to_homogeneous();
        matrix.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e3);
        matrix
    }

    /// Where the image is on the probe, as PLUS writes it (pixels to mm).
    pub fn image_to_probe(&self) -> Matrix4<f64> {
        let PixelSpacing { x_m, y_m } = self.spacing;
        let pixels = Matrix4::new_nonuniform_scaling(&Vector3::new(x_m, y_m, x_m));
        let mut matrix = self.probe_from_image.isometry().to_homogeneous() * pixels;
        matrix.fixed_view_mut::<3, 4>(0, 0).scale_mut(1e3);
        matrix
    }

    fn box_of_wires(&self) -> (Vector3<f64>, Vector3<f64>) {
        let ends = || self.phantom.wires.iter().flat_map(|wire| [wire.front.vector(), wire.back.vector()]);
        let low = ends().reduce(|a, b| a.inf(&b)).unwrap();
        (low, ends().reduce(|a, b| a.sup(&b)).unwrap())
    }

    /// Where every wire crosses the image (column, row), if it does.
    pub fn crossings(&self, phantom_from_image: &Pose<Phantom, Image>) -> Vec<Option<[f64; 2]>> {
        let image_from_phantom = phantom_from_image.inverse();
        let crossing = |front: Vector3<f64>, back: Vector3<f64>| {
            let part = front.z / (front.z - back.z);
            let at = front + (back - front) * part;
            (0.0..=1.0).contains(&part).then(|| [at.x / self.spacing.x_m, at.y / self.spacing.y_m])
        };
        let ends = self.phantom.wires.iter().map(|wire| [wire.front, wire.back]);
        ends.map(|[a, b]| crossing((image_from_phantom * a).vector(), (image_from_phantom * b).vector()))
            .collect()
    }

    fn picture(&self, phantom_from_image: &Pose<Phantom, Image>, seed: u64) -> Vec<u8> {
        let (width, height) = self.size;
        let mut grey = speckle(width * height, seed);
        for [u, v] in self.crossings(phantom_from_image).into_iter().flatten() {
            for row in (v as i64 - 12).max(0)..(v as i64 + 12).min(height as i64) {
                for column in (u as i64 - 16).max(0)..(u as i64 + 16).min(width as i64) {
                    let (x, y) = ((column as f64 - u) / 3.5, (row as f64 - v) / 2.0);
                    grey[row as usize * width + column as usize] += 190.0 * (-(x * x + y * y) / 2.0).exp();
                }
            }
        }
        grey.into_iter().map(|grey| grey.clamp(0.0, 255.0) as u8).collect()
    }
}

/// A dim, even background (a linear congruential generator: the same seed, the same picture).
fn speckle(pixels: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    };
    (0..pixels).map(|_| 8.0 + 14.0 * next() * next()).collect()
}
