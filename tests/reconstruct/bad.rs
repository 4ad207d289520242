//! Input that is no sweep over a vessel: a clear error or a marked result, never an invented surface.

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use probepath_frames::nalgebra::{Isometry3, UnitQuaternion};
use probepath_frames::{Image, Pose, World};
use probepath_scripts::offline::{ReconstructError, ReconstructWish, Reconstructed, reconstruct};
use probepath_sim::settings;
use probepath_us_capture::sequence::{Sequence, SequenceImage};
use probepath_us_capture::{Calibration, PixelSpacing, Setting};

use crate::folder;
use crate::sweep::Sweep;

pub const FROM_M: f64 = 0.020;
pub const STEP_M: f64 = 0.8e-3;
pub const IMAGES: u64 = 18;

/// A short sweep over open lumen, drawn once: its images are put together as a test wants them.
pub fn drawn() -> &'static (Sweep, Vec<Vec<u8>>) {
    static DRAWN: OnceLock<(Sweep, Vec<Vec<u8>>)> = OnceLock::new();
    DRAWN.get_or_init(|| {
        let sweep = Sweep::new(settings::zoomed(0.07, 0.045, 0.03, 0.034), 5);
        let picture = |number: u64| sweep.picture(&place(&sweep, number), number);
        let pictures = (0..IMAGES).map(picture).collect();
        (sweep, pictures)
    })
}

fn place(sweep: &Sweep, number: u64) -> Pose<World, Image> {
    sweep.world_from_image(FROM_M + number as f64 * STEP_M)
}

/// The drawn images, each as the test says: at another pose, with other pixels, or not at all.
pub fn sequence(
    make: impl Fn(u64, Pose<World, Image>, Vec<u8>) -> Option<(Pose<World, Image>, Vec<u8>)>,
) -> Sequence {
    let (sweep, pictures) = drawn();
    let mut sequence = Sequence::new(settings::COLUMNS, settings::ROWS);
    for (number, pixels) in (0..).zip(pictures) {
        if let Some((pose, pixels)) = make(number, place(sweep, number), pixels.clone()) {
            let image: SequenceImage = sweep.image(&pose, number, pixels);
            sequence.push(image).unwrap();
        }
    }
    sequence
}

/// A folder with the sequence and its true calibration in it, and the wish to reconstruct them.
pub fn wish(name: &str, sequence: &Sequence) -> (PathBuf, ReconstructWish) {
    let out = folder(name);
    sequence.write(&out.join("sweep.igs.mha")).unwrap();
    drawn().0.calibration().write(&out.join("calibration.toml")).unwrap();
    let wish = ReconstructWish {
        input: out.join("sweep.igs.mha"),
        calibration: Some(out.join("calibration.toml")),
        out: out.join("made"),
        ..ReconstructWish::default()
    };
    (out, wish)
}

fn made(name: &str, sequence: &Sequence) -> Result<Reconstructed, ReconstructError> {
    let (out, wish) = wish(name, sequence);
    let made = reconstruct(&wish, &());
    fs::remove_dir_all(out).unwrap();
    made
}

/// What is said where nothing can be made; and nothing was.
fn refused(name: &str, sequence: &Sequence) -> String {
    let (out, wish) = wish(name, sequence);
    let error = reconstruct(&wish, &()).expect_err("nothing to reconstruct").to_string();
    let left: Vec<_> = fs::read_dir(out.join("made")).unwrap().collect();
    assert!(left.is_empty(), "{left:?}");
    fs::remove_dir_all(out).unwrap();
    error
}

#[test]
fn the_drawn_sweep_itself_is_reconstructed() {
    let made = made("itself", &sequence(|_, pose, pixels| Some((pose, pixels)))).unwrap();
    assert!(made.images.used >= IMAGES as usize - 2 && made.stenoses.is_empty(), "{made}");
}

#[test]
fn without_a_lumen_in_any_image_there_is_no_surface_and_the_reason_is_said() {
    let even = sequence(|_, pose, pixels| Some((pose, vec![90; pixels.len()])));
    let error = refused("even", &even);
    assert!(error.contains("0 of 18 images") && error.contains("sweep.igs.mha"), "{error}");
    let dark = sequence(|_, pose, pixels| Some((pose, vec![0; pixels.len()])));
    let error = refused("dark", &dark);
    assert!(error.contains("no contact"), "{error}");
    // Speckle of muscle, beside the vessel.
    let (sweep, _) = drawn();
    let beside = sequence(|number, pose, _| {
        // FRAMES: 3 cm to the side, in the picture's own axes.
        let aside = pose * Pose::<Image, Image>::assume(Isometry3::translation(0.030, 0.0, 0.0));
        (number < 8).then(|| (aside, sweep.picture(&aside, number)))
    });
    let error = refused("beside", &beside);
    assert!(error.contains("of 8 images"), "{error}");
}

#[test]
fn a_seed_outside_of_the_pictures_is_refused() {
    let (out, wish) = wish("seed", &sequence(|number, pose, pixels| (number < 4).then_some((pose, pixels))));
    for place in [(1000.0, 3.0), (-1.0, 3.0), (3.0, 500.0)] {
        let wish = ReconstructWish { seed_mm: Some(place), ..wish.clone() };
        let error = reconstruct(&wish, &()).unwrap_err().to_string();
        assert!(error.contains("--seed-mm") && error.contains("outside"), "{error}");
    }
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn one_image_is_not_enough() {
    let error = refused("one", &sequence(|number, pose, pixels| (number == 3).then_some((pose, pixels))));
    assert!(error.contains("1 images") && error.contains("at least"), "{error}");
}

#[test]
fn images_all_at_one_pose_have_no_length_of_vessel() {
    let (sweep, _) = drawn();
    let error = refused("pose", &sequence(|_, _, pixels| Some((place(sweep, 0), pixels))));
    assert!(error.contains("span") || error.contains("no smooth fit"), "{error}");
}

#[test]
fn images_whose_pose_jumps_are_left_out_and_counted() {
    let jumps = sequence(|number, pose, pixels| {
        // FRAMES: a tracker that saw a mirror image for three images: 25 mm to the side and turned.
        let turned = Isometry3::from_parts(
            nalgebra::Translation3::new(0.025, 0.0, 0.0),
            UnitQuaternion::from_euler_angles(0.0, 0.3, 0.0),
        );
        let pose = if (7..10).contains(&number) { pose * Pose::assume(turned) } else { pose };
        Some((pose, pixels))
    });
    match made("jumps", &jumps) {
        Ok(made) => {
            let refused: usize = made.images.refused.values().sum();
            assert!(refused >= 3 && made.images.used + refused == IMAGES as usize, "{made}");
            let report = made.report.unwrap();
            let areas: Vec<f64> = report.area_curve.iter().filter_map(|point| point.area_mm2).collect();
            assert!(areas.iter().all(|area| (40.0..58.0).contains(area)), "{areas:?}");
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_calibration_of_another_setting_is_named() {
    let whole = sequence(|_, pose, pixels| Some((pose, pixels)));
    let (out, wish) = wish("setting", &whole);
    let own = drawn().0.calibration();
    let spacing = PixelSpacing { x_m: 2.0 * own.setting.spacing.x_m, y_m: own.setting.spacing.y_m };
    let other = Calibration { id: "depth 9 cm".into(), setting: Setting { spacing, ..own.setting }, ..own };
    other.write(wish.calibration.as_ref().unwrap()).unwrap();
    let error = reconstruct(&wish, &()).unwrap_err().to_string();
    assert!(error.contains("depth 9 cm") && error.contains("320 x 480") && error.contains("640"), "{error}");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_volume_of_a_million_million_voxels_is_refused_before_it_is_begun() {
    let whole = sequence(|_, pose, pixels| Some((pose, pixels)));
    let (out, wish) = wish("volume", &whole);
    let plus = drawn().0.plus_configuration().replace(
        "</PlusConfiguration>",
        "<VolumeReconstruction OutputSpacing=\"0.0025 0.0025 0.0025\" ImageCoordinateFrame=\"Image\" \
         ReferenceCoordinateFrame=\"Reference\"/></PlusConfiguration>",
    );
    fs::write(out.join("plus.xml"), plus).unwrap();
    let wish = ReconstructWish { calibration: Some(out.join("plus.xml")), volume: true, ..wish };
    let error = reconstruct(&wish, &()).unwrap_err().to_string();
    assert!(error.contains("MB") && error.contains("limit"), "{error}");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_sequence_without_a_single_pose_says_what_each_image_lacks() {
    let whole = sequence(|_, pose, pixels| Some((pose, pixels)));
    let mut lost = Sequence::new(settings::COLUMNS, settings::ROWS);
    for image in whole.images() {
        let mut image = image.clone();
        for tracked in image.transforms.values_mut() {
            tracked.status = probepath_us_capture::sequence::Status::Invalid;
        }
        lost.push(image).unwrap();
    }
    let error = refused("lost", &lost);
    assert!(error.contains("none of its 18 images") && error.contains("ProbeToReference"), "{error}");
}

/// Real sweeps of PLUS, over a spine phantom and over wires: there is no vessel in them, and none is found.
#[test]
fn real_sweeps_without_a_vessel_give_no_surface() {
    const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/plus");
    for (sweep, calibration) in [
        (
            "SpinePhantomFreehand.igs.mha",
            "PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_NN_LATE.xml",
        ),
        (
            "NwirePhantomFreehand.igs.mha",
            "PlusDeviceSet_NwirePhantomFreehand_vtkVolumeReconstructorTest2.xml",
        ),
    ] {
        let [input, calibration] = [sweep, calibration].map(|name| PathBuf::from(format!("{DATA}/{name}")));
        if !input.is_file() {
            eprintln!("skipped: {} is not there", input.display());
            continue;
        }
        let out = folder("plus");
        let wish = ReconstructWish {
            input,
            calibration: Some(calibration),
            out: out.clone(),
            ..ReconstructWish::default()
        };
        let error = reconstruct(&wish, &()).unwrap_err().to_string();
        assert!(error.contains("a lumen was seen in 0 of"), "{error}");
        fs::remove_dir_all(out).unwrap();
    }
}
