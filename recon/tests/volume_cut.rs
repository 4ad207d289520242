//! Images cut out of a volume are what SimpleITK resamples, and say what of them was seen.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::path::Path;
use std::process::Command;

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Image, Point, Pose, World};
use probepath_recon::volume::{
    Cut, Grid, Holes, Interpolation, Layer, Mark, Slice, Swept, Volume, VolumeError, VolumeSettings, Weights,
};
use probepath_us_capture::{PixelMap, PixelSpacing};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use serde_json::json;

const SIZE: [usize; 3] = [23, 19, 17];
const SPACING_M: [f64; 3] = [7e-4, 8e-4, 9e-4];

fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// A layer of the volume as an image whose pixels are its voxels.
fn layer(z: usize) -> PixelMap<World> {
    let first = Point::new(-5e-3, -4e-3, -3e-3 + z as f64 * SPACING_M[2]);
    PixelMap::new(first, Vector3::x() * SPACING_M[0], Vector3::y() * SPACING_M[1])
}

/// A volume whose layers `z` are images of noise.
fn volume(seed: u32, layers: impl Iterator<Item = usize>, holes: Option<Holes>) -> Volume {
    let grid = Grid { origin: layer(0).at(0.0, 0.0), spacing_m: SPACING_M, size: SIZE };
    let grey = |z: usize, i: usize| ((seed + (z * 1000 + i) as u32).wrapping_mul(2_654_435_761) >> 24) as u8;
    let pictures: Vec<(usize, Vec<u8>)> =
        layers.map(|z| (z, (0..SIZE[0] * SIZE[1]).map(|i| grey(z, i)).collect())).collect();
    let slices: Vec<Slice<'_>> =
        pictures.iter().map(|(z, pixels)| Slice::new(pixels, SIZE[0], layer(*z))).collect();
    let settings = VolumeSettings {
        grid: Some(grid),
        weights: Weights::Nearest,
        holes,
        ..VolumeSettings::every_mm(1.0)
    };
    Volume::build(&slices, &settings).unwrap()
}

fn pose() -> impl Strategy<Value = Pose<World, Image>> {
    let place = [-6e-3..6e-3_f64, -6e-3..6e-3_f64, -4e-3..8e-3_f64].prop_map(Vector3::from);
    let turn = [-3.0..3.0_f64, -3.0..3.0_f64, -3.0..3.0_f64].prop_map(Vector3::from);
    // FRAMES: any plane near the volume will do.
    (place, turn).prop_map(|(place, turn)| Pose::assume(Isometry3::new(place, turn)))
}

fn cut(volume: &Volume, pose: &Pose<World, Image>, way: Interpolation) -> Cut {
    volume.cut(pose, PixelSpacing { x_m: 4e-4, y_m: 3e-4 }, (30, 25), way).unwrap()
}

/// The volume at a place: the eight voxels around it, one axis after the other.
fn by_hand(volume: &Volume, at: &Point<World>) -> Option<(f64, Mark)> {
    let off = (at.vector() - volume.grid().origin.vector()).component_div(&Vector3::from(SPACING_M));
    if (0..3).any(|axis| off[axis] < -0.5 || off[axis] >= SIZE[axis] as f64 - 0.5) {
        return None;
    }
    let (mut sum, mut worst) = (0.0, Mark::Seen);
    for z in 0..SIZE[2] {
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let weight: f64 = [x, y, z]
                    .iter()
                    .enumerate()
                    .map(|(axis, v)| {
                        (1.0 - (off[axis].clamp(0.0, SIZE[axis] as f64 - 1.0) - *v as f64).abs()).max(0.0)
                    })
                    .product();
                if weight > 0.0 {
                    let index = volume.grid().index([x, y, z]).unwrap();
                    sum += weight * f64::from(volume.grey()[index]);
                    match volume.marks()[index] {
                        Mark::Unseen => return None,
                        Mark::Filled => worst = Mark::Filled,
                        Mark::Seen => {}
                    }
                }
            }
        }
    }
    Some((sum, worst))
}

proptest! {
    #![proptest_config(seeded(12))]

    #[test]
    fn a_pixel_is_made_of_the_voxels_around_it_and_as_good_as_the_worst(pose in pose(), gap in 1_usize..4) {
        // Layers with holes between them: some filled, those that are wider left open.
        let holes = Some(Holes::Swept(Swept { longest_m: 2.0e-3 }));
        let volume = volume(7, (0..SIZE[2]).filter(|z| z % (gap + 1) == 0), holes);
        let cut = cut(&volume, &pose, Interpolation::Linear);
        let map = PixelMap::of(&pose, cut.spacing);
        for (i, (grey, mark)) in cut.pixels().iter().zip(cut.marks()).enumerate() {
            let at = map.at((i % cut.width()) as f64, (i / cut.width()) as f64);
            match by_hand(&volume, &at) {
                None => prop_assert_eq!((*grey, *mark), (0, Mark::Unseen)),
                Some((value, worst)) => {
                    prop_assert_eq!(*mark, worst);
                    prop_assert!((f64::from(*grey) - value).abs() < 0.5 + 1e-6);
                }
            }
        }
    }
}

#[test]
fn the_layer_an_image_was_put_into_is_cut_out_as_it_was() {
    let volume = volume(3, 0..SIZE[2], None);
    let (pose, spacing) = layer(5).nearest_rigid();
    for way in [Interpolation::Nearest, Interpolation::Linear] {
        let cut = volume.cut(&pose, spacing, (SIZE[0], SIZE[1]), way).unwrap();
        let own = 5 * SIZE[0] * SIZE[1];
        assert_eq!(cut.pixels(), &volume.grey()[own..own + SIZE[0] * SIZE[1]]);
        assert!(cut.marks().iter().all(|mark| *mark == Mark::Seen) && cut.height() == SIZE[1]);
    }
}

#[test]
fn a_cut_that_is_none_is_refused() {
    let volume = volume(3, 0..SIZE[2], None);
    let (pose, spacing) = layer(5).nearest_rigid();
    let lost = PixelSpacing { x_m: f64::NAN, ..spacing };
    for (spacing, size) in
        [(spacing, (0, 5)), (spacing, (usize::MAX, 2)), (spacing, (1 << 20, 1 << 20)), (lost, (4, 4))]
    {
        let refused = volume.cut(&pose, spacing, size, Interpolation::Linear);
        assert!(matches!(refused, Err(VolumeError::BadCut { .. })), "{size:?}");
    }
}

#[test]
fn simpleitk_resamples_the_same_images() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("volume-cuts");
    std::fs::create_dir_all(&folder).unwrap();
    let volume = volume(11, 0..SIZE[2], None);
    volume.write(&folder.join("volume.mha"), Layer::Grey).unwrap();
    let mut runner = TestRunner::new(seeded(1));
    let mut cuts = Vec::new();
    for number in 0..40 {
        let pose = pose().new_tree(&mut runner).unwrap().current();
        for (name, way) in [("nearest", Interpolation::Nearest), ("linear", Interpolation::Linear)] {
            let cut = cut(&volume, &pose, way);
            let file = format!("{number:02}-{name}.raw");
            let marks: Vec<u8> = cut.marks().iter().map(|mark| *mark as u8).collect();
            std::fs::write(folder.join(&file), [cut.pixels(), &marks].concat()).unwrap();
            let matrix = pose.isometry().rotation.to_rotation_matrix();
            let rows: Vec<f64> = matrix.matrix().transpose().iter().copied().collect();
            let origin_mm: Vec<f64> = pose.origin().vector().iter().map(|x| x * 1e3).collect();
            cuts.push(json!({
                "file": file, "interpolation": name, "size": [cut.width(), cut.height()], "origin_mm": origin_mm,
                "spacing_mm": [cut.spacing.x_m * 1e3, cut.spacing.y_m * 1e3], "rotation": rows,
            }));
        }
    }
    let wanted = folder.join("expected.json");
    std::fs::write(&wanted, json!({ "volume": "volume.mha", "cuts": cuts }).to_string()).unwrap();
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!("skipped: PROBEPATH_PYTHON names no Python with SimpleITK (tests/run installs one)");
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/interop/cuts.py");
    let done = Command::new(python).arg(script).arg(&wanted).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    eprintln!("{said}");
}
