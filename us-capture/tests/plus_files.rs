//! Every real file of `../shared/data/plus` is read, or refused with the right reason.

use std::path::PathBuf;

use probepath_us_capture::plus::{PlusCompounding, PlusConfig};
use probepath_us_capture::sequence::{
    Claim, Note, Orientation, Packing, Placing, ReadOptions, Sequence, SequenceError, SkipReason, read_parts,
    unpack,
};

/// The folder with the real files; `None`, said aloud, where it is absent.
fn plus() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/plus"));
    if !folder.is_dir() {
        #[allow(clippy::print_stderr, reason = "a skipped test is seen")]
        {
            eprintln!("skipped: no folder ../shared/data/plus");
        }
        return None;
    }
    Some(folder)
}

fn read(name: &str) -> Option<Result<Sequence, SequenceError>> {
    Some(Sequence::read(&plus()?.join(name), &ReadOptions::default()))
}

/// File, columns, rows, images, transforms of the first image, what is noted.
type Expected = (&'static str, usize, usize, usize, usize, &'static [&'static str]);

const EXPECTED: [Expected; 17] = [
    ("ColorNrrdSample.igs.nrrd", 1152, 648, 1, 0, &["3 colour channels converted to grey"]),
    ("NwirePhantomFreehand.igs.mha", 820, 616, 97, 3, &[]),
    ("NwirePhantomFreehand.igs.nrrd", 820, 616, 97, 3, &[]),
    ("NwirePhantomFreehandCropped.igs.mha", 200, 150, 20, 4, &[]),
    ("Prostate10_tracker.igs.mha", 0, 0, 10, 1, &["poses without images"]),
    ("ReferenceToRASCalibration.igs.mha", 0, 0, 93, 2, &["poses without images"]),
    ("SpinePhantomFreehand.igs.mha", 820, 616, 21, 3, &[]),
    (
        "TransformInterpolationTest.igs.mha",
        0,
        0,
        500,
        2,
        &[
            "poses without images",
            "500 ReferenceToTracker poses without a status, used",
            "FrameNumber skips 508, first before image 1",
        ],
    ),
    ("USTC_3NWires_ProbeRotation.igs.mha", 820, 616, 142, 3, &[]),
    ("USTC_3NWires_RandomStepperMotionCalibration.igs.mha", 820, 616, 212, 3, &[]),
    ("USTC_3NWires_RandomStepperMotionValidation.igs.mha", 820, 616, 106, 3, &[]),
    (
        "USTC_FrameGrabber_TemplateTranslationData.igs.mha",
        640,
        480,
        100,
        1,
        &["images turned from MN to MF", "100 images without a status, used"],
    ),
    (
        "UsSimulatorOutputSpinePhantom2CurvilinearBaselineNoUSCompressed.igs.mha",
        0,
        0,
        15,
        3,
        &["poses without images"],
    ),
    (
        "WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha",
        0,
        0,
        801,
        3,
        &["poses without images", "FrameNumber skips 149, first before image 4"],
    ),
    (
        "WaterTankBottomTranslationVideoBuffer.igs.mha",
        820,
        616,
        201,
        0,
        &["FrameNumber skips 2, first before image 6"],
    ),
    ("fCal_Test_Calibration_3NWires.igs.mha", 820, 616, 188, 3, &[]),
    ("fCal_Test_Validation_3NWires.igs.mha", 820, 616, 94, 3, &[]),
];

#[test]
fn every_sequence_of_plus_is_read_as_it_is() {
    let Some(folder) = plus() else { return };
    for (name, width, height, images, transforms, notes) in EXPECTED {
        let sequence = Sequence::read(&folder.join(name), &ReadOptions::default()).expect(name);
        assert_eq!(
            (sequence.width(), sequence.height(), sequence.images().len()),
            (width, height, images),
            "{name}"
        );
        assert_eq!(sequence.images()[0].transforms.len(), transforms, "{name}");
        let said: Vec<String> = sequence.notes().iter().map(Note::to_string).collect();
        assert_eq!(said, notes, "{name}");
        assert!(sequence.images().iter().all(|i| i.pixels.is_some() == (width > 0)), "{name}");
    }
}

#[test]
fn every_other_image_file_is_refused_as_a_volume() {
    let Some(folder) = plus() else { return };
    for entry in std::fs::read_dir(&folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_owned();
        let image = name.ends_with(".mha") || name.ends_with(".nrrd");
        if image && !EXPECTED.iter().any(|expected| expected.0 == name) {
            let refused = Sequence::read(&path, &ReadOptions::default());
            assert!(
                matches!(refused, Err(SequenceError::NotASequence { kind }) if kind == "domain"),
                "{name}"
            );
        } else if !image {
            let refused = Sequence::read(&path, &ReadOptions::default());
            assert!(matches!(refused, Err(SequenceError::NotAHeader { .. })), "{name}");
        }
    }
}

#[test]
fn mha_and_nrrd_of_the_same_scan_are_the_same() {
    let (Some(mha), Some(nrrd)) =
        (read("NwirePhantomFreehand.igs.mha"), read("NwirePhantomFreehand.igs.nrrd"))
    else {
        return;
    };
    assert_eq!(mha.expect("mha").images(), nrrd.expect("nrrd").images());
}

#[test]
fn a_file_stored_mn_comes_with_its_last_row_first() {
    let name = "USTC_FrameGrabber_TemplateTranslationData.igs.mha";
    let Some(sequence) = read(name) else { return };
    let sequence = sequence.expect(name);
    assert!(sequence.notes().contains(&Note::Turned { from: Orientation::Mn }));
    let (header, bytes) = read_parts(&plus().expect("folder").join(name)).expect("header");
    let claim = Claim { block: 640 * 480, count: 100 };
    unpack(&bytes[header.payload_at..], Packing::Zlib(None), claim, u64::MAX, |image, stored| {
        let turned = sequence.images()[image as usize].pixels.as_ref().expect("pixels");
        assert!(turned.chunks(640).eq(stored.chunks(640).rev()), "image {image}");
    })
    .expect("a whole stream");
}

#[test]
fn invalid_poses_are_skipped_and_counted() {
    let Some(sequence) = read("TransformInterpolationTest.igs.mha") else { return };
    let sequence = sequence.expect("a sequence");
    let unusable =
        sequence.images().iter().flat_map(|i| i.transforms.values()).filter(|t| !t.status.is_usable());
    assert_eq!(unusable.count(), 1);
    let config =
        PlusConfig::read(&plus().expect("folder").join("NwirePhantomFreehand_phantom.xml")).expect("config");
    let placed = sequence.place(&Placing::from_plus(&config).expect("placing")).expect("placed");
    assert_eq!(placed.skipped.get(&SkipReason::NoPicture), Some(&500));
}

#[test]
fn the_spine_phantom_is_placed_by_its_config() {
    let Some(sequence) = read("SpinePhantomFreehand.igs.mha") else { return };
    let name = "PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_NN_LATE.xml";
    let config = PlusConfig::read(&plus().expect("folder").join(name)).expect("config");
    let volume = config.volume.as_ref().expect("volume settings");
    assert_eq!((volume.linear, volume.compounding), (false, PlusCompounding::Latest));
    assert!(volume.holes.is_none());
    let placed =
        sequence.expect("a sequence").place(&Placing::from_plus(&config).expect("placing")).expect("placed");
    assert_eq!((placed.images.len(), placed.skipped.len(), placed.unstamped), (21, 0, 0));
    // The first image by hand: reference_from_tracker * tracker_from_probe * probe_from_pixel of pixel (100, 50),
    // computed from the printed numbers with numpy.
    let at = placed.images[0].world_from_pixel.at(100.0, 50.0).vector() * 1e3;
    let by_numpy = nalgebra::Vector3::new(-14.03773193, 199.53481677, 36.69452761);
    // The tracker's matrices are printed to six digits; making them rotations moves the pixel by that.
    assert!((at - by_numpy).norm() < 2e-4, "{at:?}");
    // This calibration is sheared by 2.7 degrees, which no rigid pose holds: 2 mm at the worst corner.
    assert!((placed.off_rigid_m * 1e3 - 2.04).abs() < 0.01, "{}", placed.off_rigid_m);
}

#[test]
fn every_config_of_plus_gives_its_transforms() {
    let Some(folder) = plus() else { return };
    let read = |name: &str| PlusConfig::read(&folder.join(name));
    let fcal = read("FreehandCalibration3NWires.results.xml").expect("results");
    assert!(fcal.pixels_in_probe("Image", "Probe").is_ok());
    let stepper = read("UsTemplateCalibration_3NWires.results.xml").expect("results");
    let shear = stepper.pixels_in_probe("Image", "Probe").expect("pixels").shear_rad().to_degrees();
    assert!((shear + 1.5).abs() < 0.2, "{shear}");
    let linear =
        read("PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_LN_MEAN.xml").expect("config");
    let volume = linear.volume.expect("volume settings");
    assert!(volume.linear && volume.fan.is_some());
    assert_eq!(volume.holes.map(|h| (h.longest, h.sticks)), Some((9, 1)));
    for name in [
        "PlusDeviceSet_fCal_Sim_SpatialCalibration_1.2.xml",
        "PlusDeviceSet_iCal_SonixTouch_BlackTargetGuideStepper_1.1.xml",
    ] {
        let config = read(name).expect(name);
        assert!(config.pixels_in_probe("Image", "Probe").is_err(), "{name} holds no ImageToProbe");
    }
    assert!(read("TemporalCalibrationResultsBaseline.xml").is_err());
}
