//! Writes a tracked sequence of a wire phantom in water, as the simulated ultrasound machine sees it: something to try
//! `probepath calibrate` on, and what the pictures of `docs/calibration.md` were made from.
//!
//! ```sh
//! cargo run --release -p probepath-scripts --example phantom_sweep -- fcal-1.2 target/sweep.igs.mha [IMAGES] [SEED]
//! ```

#![allow(clippy::print_stdout, reason = "an example talks to whoever runs it")]

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Pose, Probe, Stamp, World};
use probepath_sim::{Contact, ImagingConfig, Medium, Renderer, Strand, Tissue, settings};
use probepath_us_capture::Setting;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::sequence::{Sequence, SequenceImage, Status, Tracked, TransformName};

/// An image stamped t shows the pose at t + lag.
const LAG_S: f64 = 0.08;
const EVERY_S: f64 = 0.1;

/// A phantom of wires in a tank, at the World's origin.
struct Tank(Vec<Strand>);

impl Tissue for Tank {
    fn artery(&self, _point: probepath_frames::Point<World>) -> f64 {
        f64::INFINITY
    }

    fn strands(&self) -> &[Strand] {
        &self.0
    }

    fn medium(&self) -> Medium {
        Medium::Water { celsius: 20.0 }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "fcal-1.2".into());
    let path = arguments.next().unwrap_or_else(|| "target/sweep.igs.mha".into());
    let images = arguments.next().map_or(Ok(60), |text| text.parse::<u32>())?;
    let seed = arguments.next().map_or(Ok(1), |text| text.parse::<u64>())?;
    let phantom = WirePhantom::shipped(&name).ok_or_else(|| format!("no phantom {name} comes along"))?;
    let setting = settings::whole_depth(0.07, 0.045);
    let renderer = Renderer::new(ImagingConfig::default(), seed)?;
    let tank = Tank(phantom.wires.iter().map(strand).collect());
    let mut sequence = Sequence::new(settings::COLUMNS, settings::ROWS);
    for nth in 0..images {
        let at_s = f64::from(nth) * EVERY_S + seed as f64;
        let shown = plane(&phantom, &setting, at_s + LAG_S);
        let pixels = renderer.render(&tank, &shown, &setting, Contact::Full, u64::from(nth))?;
        sequence.push(image(u64::from(nth), at_s, &plane(&phantom, &setting, at_s), pixels))?;
    }
    sequence.write(path.as_ref())?;
    println!(
        "{images} images of {name} in {path}: pixels of {:.4} x {:.4} mm before the water, a lag of {LAG_S} s",
        setting.spacing.x_m * 1e3,
        setting.spacing.y_m * 1e3
    );
    Ok(())
}

fn strand(wire: &probepath_us_capture::phantom::Wire) -> Strand {
    // FRAMES: the phantom's axes are the World's here.
    let ends = [wire.front, wire.back].map(|end| probepath_frames::Point::from_vector(end.vector()));
    Strand { ends, amplitude: 10.0 }
}

/// Where the image is on the probe: what a calibration of the sequence has to find.
fn probe_from_image() -> Pose<Probe, Image> {
    // FRAMES: made up, as a marker clamped somewhere on a probe.
    Pose::assume(Isometry3::new(Vector3::new(-0.02, 0.013, 0.06), Vector3::new(1.4, 0.2, -0.1)))
}

fn image(number: u64, at_s: f64, world_from_image: &Pose<World, Image>, pixels: Vec<u8>) -> SequenceImage {
    let world_from_probe = *world_from_image * probe_from_image().inverse();
    let mut matrix_mm: Matrix4<f64> = world_from_probe.isometry().to_homogeneous();
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

/// Where the image's plane is at an instant: across the wires, the wires in its middle, moved and tilted slowly about every
/// axis.
fn plane(phantom: &WirePhantom, setting: &Setting, at_s: f64) -> Pose<World, Image> {
    let ends = || phantom.wires.iter().flat_map(|wire| [wire.front.vector(), wire.back.vector()]);
    let low = ends().fold(Vector3::repeat(f64::INFINITY), |low, end| low.inf(&end));
    let high = ends().fold(Vector3::repeat(f64::NEG_INFINITY), |high, end| high.sup(&end));
    let along = phantom.wires.first().map_or_else(Vector3::z, |wire| wire.run().normalize());
    // Columns along the longer of the two directions across the wires.
    let across = (high - low) - along * (high - low).dot(&along);
    let mut x = Vector3::zeros();
    x[across.iamax()] = 1.0;
    let x = (x - along * x.dot(&along)).normalize();
    let upright = UnitQuaternion::from_basis_unchecked(&[x, -along.cross(&x), -along]);
    let wave = |period_s: f64, phase: f64| (TAU * (at_s / period_s + phase)).sin();
    let tilt = Vector3::new(wave(7.3, 0.1), wave(5.1, 0.4), 0.4 * wave(6.1, 0.7)) * 15f64.to_radians();
    let travel = Vector3::new(0.5 * wave(8.7, 0.2), 0.5 * wave(4.3, 0.5), wave(9.9, 0.9)) * 8e-3;
    let turn = upright * UnitQuaternion::from_scaled_axis(tilt);
    let middle = Vector3::new(setting.window_width_m, setting.window_height_m, 0.0) / 2.0;
    let origin = (low + high) / 2.0 + upright * travel - turn * middle;
    // FRAMES: the plane that the probe is driven to, made up above.
    Pose::assume(Isometry3::from_parts(Translation3::from(origin), turn))
}
