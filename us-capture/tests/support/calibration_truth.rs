//! Calibrations whose truth is known: a phantom of wires, a probe that moves, dots where the image's plane cuts them.
#![allow(dead_code, reason = "tests and benchmarks each use a part")]
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use nalgebra::{Isometry3, Matrix2, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Phantom, Point, Pose, Probe, Span, Stamp, Track, World};
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::fit::{SeenWire, Sighting};
use probepath_us_capture::phantom::{Wire, WirePhantom, ZFiducial};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Seeded numbers.
pub struct Dice(ChaCha8Rng);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Between these, all alike.
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * ((self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// Normal, of standard deviation one (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.between(1e-300, 1.0).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.between(0.0, 1.0)).cos()
    }

    pub fn vector(&mut self, sd: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sd * self.normal())
    }

    /// A small motion: `sd_m` along each axis, `sd_rad` about each.
    pub fn motion(&mut self, sd_m: f64, sd_rad: f64) -> Isometry3<f64> {
        let (shift, turn) = (self.vector(sd_m), self.vector(sd_rad));
        Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
    }

    /// Any pose within a metre.
    pub fn pose(&mut self) -> Isometry3<f64> {
        let turn = self.vector(1.0);
        self.motion(0.3, 0.0) * UnitQuaternion::from_scaled_axis(turn * 3.0)
    }
}

/// How a calibration is captured.
#[derive(Clone, Copy, Debug)]
pub struct Capture {
    pub images: usize,
    /// Time between images, and between poses (s).
    pub every_s: f64,
    pub poses_every_s: f64,
    /// The probe tilts so far to either side (rad).
    pub tilt_rad: f64,
    pub lag_s: f64,
    /// Errors of each pose (m, rad; standard deviation of each coordinate).
    pub tracker: (f64, f64),
    /// Error of a dot (px).
    pub dot_px: f64,
    /// A part of the dots that has a wrong place, anywhere in the image.
    pub wrong: f64,
}

impl Default for Capture {
    fn default() -> Self {
        Self {
            images: 60,
            every_s: 0.1,
            poses_every_s: 0.01,
            tilt_rad: 0.3,
            lag_s: 0.12,
            tracker: (0.0, 0.0),
            dot_px: 0.0,
            wrong: 0.0,
        }
    }
}

/// A calibration's truth, and what was seen of it.
pub struct Truth {
    pub phantom: WirePhantom,
    pub world_from_phantom: Pose<World, Phantom>,
    pub probe_from_image: Pose<Probe, Image>,
    pub spacing: PixelSpacing,
    pub lag_s: f64,
    pub sightings: Vec<Sighting>,
    pub track: Track<World, Probe>,
}

fn wire(name: String, front: Vector3<f64>, back: Vector3<f64>) -> Wire {
    Wire { name, front: Point::from_vector(front), back: Point::from_vector(back) }
}

/// Rows of Zs beside each other, 40 mm from plate to plate, at random distances; wires run along the phantom's y.
pub fn zs(dice: &mut Dice, rows: usize, beside: usize) -> WirePhantom {
    let (mut wires, mut zs) = (Vec::new(), Vec::new());
    for row in 0..rows {
        let mut x = 5e-3 + dice.between(-2e-3, 2e-3);
        let z = -6e-3 * row as f64 + dice.between(-1e-3, 1e-3);
        for _ in 0..beside {
            let wide = dice.between(12e-3, 25e-3);
            let (left, right) = (x, x + wide);
            let (from, to) = if dice.between(0.0, 1.0) < 0.5 { (left, right) } else { (right, left) };
            let first = wires.len();
            for (front, back) in [(left, left), (from, to), (right, right)] {
                let name = format!("{}", wires.len());
                wires.push(wire(name, Vector3::new(front, 0.0, z), Vector3::new(back, 40e-3, z)));
            }
            zs.push(ZFiducial { first, diagonal: first + 1, last: first + 2 });
            x = right + dice.between(2e-3, 6e-3);
        }
    }
    WirePhantom { name: "random".into(), wires, zs, landmarks: Vec::new() }
}

/// Single wires at random, from plate to plate.
pub fn single_wires(dice: &mut Dice, count: usize) -> WirePhantom {
    let mut end = |y: f64| Vector3::new(dice.between(0.0, 40e-3), y, dice.between(-30e-3, 0.0));
    let wires = (0..count).map(|k| wire(format!("{k}"), end(0.0), end(40e-3))).collect();
    WirePhantom { name: "single wires".into(), wires, zs: Vec::new(), landmarks: Vec::new() }
}

/// The image's place in the phantom over time, the image across the wires: to and fro along them and aside, tilting.
struct Way {
    turns: [(f64, f64); 6],
    tilt_rad: f64,
    across: Isometry3<f64>,
}

impl Way {
    fn new(dice: &mut Dice, phantom: &WirePhantom, tilt_rad: f64) -> Self {
        let middle: Vector3<f64> =
            phantom.wires.iter().map(|w| (w.front.vector() + w.back.vector()) / 2.0).sum::<Vector3<f64>>()
                / phantom.wires.len() as f64;
        // Columns run against the phantom's x, rows down against its z, and the plane is across its y.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
        let turns = std::array::from_fn(|k| {
            (dice.between(0.15, 0.5) * (1.0 + 0.2 * k as f64), dice.between(0.0, 6.3))
        });
        Self { turns, tilt_rad, across: Isometry3::from_parts(Translation3::from(middle), turn) }
    }

    fn phantom_from_image(&self, at_s: f64, middle_of_image: &Vector3<f64>) -> Isometry3<f64> {
        let wave = |k: usize| {
            let (frequency, phase) = self.turns[k];
            (std::f64::consts::TAU * frequency * at_s + phase).sin()
        };
        let tilt = Vector3::new(wave(0), wave(1), wave(2) * 0.5) * self.tilt_rad;
        let shift = Vector3::new(wave(3) * 3e-3, wave(4) * 3e-3, wave(5) * 10e-3);
        let moved = Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(tilt));
        self.across * moved * Translation3::from(-middle_of_image)
    }
}

/// A captured calibration.
pub fn captured(dice: &mut Dice, phantom: WirePhantom, capture: &Capture) -> Truth {
    let spacing = PixelSpacing { x_m: dice.between(6e-5, 1.5e-4), y_m: dice.between(6e-5, 1.5e-4) };
    let probe_from_image = dice.motion(0.03, 0.0) * UnitQuaternion::from_scaled_axis(dice.vector(1.5));
    let world_from_phantom = dice.pose();
    let middle = spacing.point(400.0, 300.0).vector();
    let way = Way::new(dice, &phantom, capture.tilt_rad);
    let probe =
        |at_s: f64| world_from_phantom * way.phantom_from_image(at_s, &middle) * probe_from_image.inverse();
    let begin = -1.5;
    let end = capture.images as f64 * capture.every_s + 1.5;
    let mut track = Track::new(Span::from_seconds(1.0));
    let mut at_s = begin;
    while at_s < end {
        let noisy = probe(at_s) * dice.motion(capture.tracker.0, capture.tracker.1);
        track.push(stamp(at_s), Pose::assume(noisy)).unwrap();
        at_s += capture.poses_every_s;
    }
    let sightings = (0..capture.images)
        .map(|image| {
            let stamp_s = image as f64 * capture.every_s + dice.between(0.0, 0.01);
            let plane = way.phantom_from_image(stamp_s + capture.lag_s, &middle);
            Sighting { image, stamp: stamp(stamp_s), dots: cut(dice, &phantom, &plane, spacing, capture) }
        })
        .collect();
    Truth {
        world_from_phantom: Pose::assume(world_from_phantom),
        probe_from_image: Pose::assume(probe_from_image),
        spacing,
        lag_s: capture.lag_s,
        sightings,
        track,
        phantom,
    }
}

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_nanoseconds((seconds * 1e9).round() as i64)
}

/// The dots where the plane cuts the wires, with their errors.
fn cut(
    dice: &mut Dice,
    phantom: &WirePhantom,
    plane: &Isometry3<f64>,
    spacing: PixelSpacing,
    capture: &Capture,
) -> Vec<SeenWire> {
    let mut seen = Vec::new();
    for (wire, line) in phantom.wires.iter().enumerate() {
        let from = plane.inverse() * nalgebra::Point3::from(line.front.vector());
        let run = plane.inverse() * line.run();
        let part = -from.z / run.z;
        if !(0.0..=1.0).contains(&part) {
            continue;
        }
        let at = from.coords + run * part;
        let mut at_px = [at.x / spacing.x_m, at.y / spacing.y_m].map(|x| x + capture.dot_px * dice.normal());
        if dice.between(0.0, 1.0) < capture.wrong {
            at_px = [dice.between(0.0, 800.0), dice.between(0.0, 600.0)];
        }
        let variance = capture.dot_px.max(0.1).powi(2);
        seen.push(SeenWire { wire, at_px, covariance_px2: Matrix2::identity() * variance });
    }
    seen
}
