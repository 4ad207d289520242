//! The check on real data: PLUS's fCal 1.2, freehand, whose two recordings differ by errors that each shares within
//! itself (`../shared/data/plus`).

#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]
#![allow(clippy::print_stderr, reason = "a skipped test is seen, and so is what was found")]

use std::path::{Path, PathBuf};

use nalgebra::{Translation3, Vector3};
use probepath_frames::{NamedPose, Pose};
use probepath_us_capture::check::{Check, CheckOptions, Verdict, check_shots};
use probepath_us_capture::fit::PhantomPlace;
use probepath_us_capture::label::Expect;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::plus::PlusConfig;
use probepath_us_capture::sequence::{ChainNames, ReadOptions, Sequence};
use probepath_us_capture::shots::Shots;
use probepath_us_capture::spatial::{Spatial, SpatialOptions};
use probepath_us_capture::{Calibration, CalibrationError, PixelSpacing, Quality, Setting};

/// The folder with the real files; `None`, said aloud, where it is absent.
fn plus() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/plus"));
    if !folder.is_dir() {
        eprintln!("skipped: no folder ../shared/data/plus");
        return None;
    }
    Some(folder)
}

fn shots(folder: &Path, name: &str) -> Shots {
    let sequence = Sequence::read(&folder.join(name), &ReadOptions::default()).unwrap();
    let names = ChainNames { probe: "Probe".into(), reference: "Reference".into(), ..ChainNames::default() };
    Shots::from_sequence(&sequence, &names).unwrap()
}

fn stored(found: &Spatial, (width, height): (usize, usize), phantom: &WirePhantom) -> Calibration {
    let (fit, spacing) = (&found.fit, found.fit.spacing);
    let depth_m = spacing.y_m * height as f64;
    let setting = Setting {
        depth_m,
        focus_m: depth_m / 2.0,
        window_top_m: 0.0,
        window_height_m: depth_m,
        window_width_m: spacing.x_m * width as f64,
        spacing,
    };
    let calibration = Calibration {
        id: "fCal".into(),
        date: "2026-11-23".into(),
        phantom: phantom.name.clone(),
        probe_from_image: fit.probe_from_image,
        setting,
        image_lag: fit.lag,
        error: CalibrationError { rms_mm: 0.5, sd_mm: 0.3, held_out: false },
        quality: Some(Quality::of(fit, (width, height))),
    };
    Calibration::from_toml(&calibration.to_toml().unwrap()).unwrap()
}

/// What a slip does to the dots tells it from errors that only the recordings' own fits make much of.
#[test]
fn the_real_calibration_holds_on_its_held_out_half_and_a_slip_of_2_mm_is_found_out() {
    let Some(folder) = plus() else { return };
    let path = folder.join("PlusDeviceSet_fCal_Sim_SpatialCalibration_1.2.xml");
    let config = PlusConfig::read(&path).unwrap();
    let phantom = WirePhantom::read(&path).unwrap();
    let place = PhantomPlace::prior(config.world_from_phantom().unwrap().unwrap());
    let about = config.segmentation.and_then(|s| s.approximate_spacing_mm).unwrap() / 1e3;
    let spacing = Some(PixelSpacing { x_m: about, y_m: about });
    let expect = Expect::FirstWireRight;
    let options = SpatialOptions { spacing, expect, ..SpatialOptions::new(place) };
    let images = shots(&folder, "fCal_Test_Calibration_3NWires.igs.mha");
    let found = Spatial::calibrate(&images, &phantom, &options, &|_| {}).unwrap();
    let calibration = stored(&found, images.size(), &phantom);
    let held_out = shots(&folder, "fCal_Test_Validation_3NWires.igs.mha");
    let place = calibration.quality.as_ref().unwrap().place().unwrap().unwrap();
    assert_eq!(NamedPose::from(&place), NamedPose::from(&found.fit.world_from_phantom));
    let check = |calibration: &Calibration| -> Check {
        let options = CheckOptions::default();
        let place = PhantomPlace::prior(place);
        let found = check_shots(&held_out, calibration, &phantom, place, &options, &|_| {}).unwrap();
        eprintln!("{}\n{:?}", found.words, found.report().misfit);
        found
    };
    let same = check(&calibration);
    assert!(same.verdict != Verdict::Moved && same.labelled == 94, "{}", same.words);
    let misfit = same.misfit.unwrap();
    assert!(misfit.line.rms_m <= 0.32e-3 && misfit.mid.rms_m <= 0.7e-3, "{misfit:?}");
    for by in [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()] {
        let slip = Translation3::from(by * 2e-3);
        // FRAMES: the stored image, 2 mm from where it is.
        let probe_from_image = Pose::assume(calibration.probe_from_image.isometry() * slip);
        let found = check(&Calibration { probe_from_image, ..calibration.clone() });
        assert_eq!(found.verdict, Verdict::Moved, "{by}: {}", found.words);
    }
}
