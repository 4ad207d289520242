//! Volumes of the real spine phantom, against those that PLUS built from the same images and settings.

#![allow(clippy::expect_used, reason = "a test may stop at the first surprise")]

use std::path::PathBuf;

use nalgebra::Vector3;
use probepath_frames::Point;
use probepath_recon::volume::{Correlation, Grid, Mark, Slice, Volume, VolumeSettings};
use probepath_us_capture::PixelMap;
use probepath_us_capture::plus::PlusConfig;
use probepath_us_capture::sequence::{PlacedSequence, Placing, ReadOptions, Sequence};

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

/// The images in their places, the settings of the config, and PLUS's volume.
fn spine(config: &str, reference: &str) -> Option<(PlacedSequence, VolumeSettings, Volume)> {
    let folder = plus()?;
    let config = PlusConfig::read(&folder.join(config)).expect("config");
    let sequence = folder.join("SpinePhantomFreehand.igs.mha");
    let sequence = Sequence::read(&sequence, &ReadOptions::default()).expect("sequence");
    let placed = sequence.place(&Placing::from_plus(&config).expect("placing")).expect("placed");
    let reference = Volume::read(&folder.join(reference), 1 << 30).expect("reference");
    let settings = VolumeSettings::from(config.volume.as_ref().expect("volume settings"));
    Some((placed, settings, reference))
}

const NEAREST_LATEST: (&str, &str) = (
    "PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_NN_LATE.xml",
    "vtkVolumeReconstructorTestNNLATEvolumeRef.mha",
);
const LINEAR_MEAN: (&str, &str) = (
    "PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_LN_MEAN.xml",
    "vtkVolumeReconstructorTestLNMEANvolumeRef.mha",
);

fn build(placed: &PlacedSequence, settings: &VolumeSettings) -> Volume {
    let slices: Vec<Slice<'_>> = placed.images.iter().map(Slice::from).collect();
    Volume::build(&slices, settings).expect("a volume")
}

fn compare(files: (&str, &str)) -> Option<(Correlation, Volume, Volume)> {
    let (placed, mut settings, reference) = spine(files.0, files.1)?;
    settings.grid = Some(reference.grid().clone());
    let ours = build(&placed, &settings);
    Some((ours.correlation(&reference).expect("one grid"), ours, reference))
}

#[test]
fn nearest_and_latest_agree_with_plus() {
    let Some((found, _, _)) = compare(NEAREST_LATEST) else { return };
    assert!(found.pearson.expect("varied") >= 0.985, "{found:?}");
}

#[test]
fn linear_mean_with_filled_holes_agrees_with_plus() {
    let Some((found, ours, _)) = compare(LINEAR_MEAN) else { return };
    assert!(ours.count(Mark::Filled) > 10_000 && ours.count(Mark::Seen) > 100_000);
    assert!(found.pearson.expect("varied") >= 0.98, "{found:?}");
}

#[test]
fn the_grid_found_from_the_images_is_that_of_plus() {
    let Some((placed, settings, reference)) = spine(NEAREST_LATEST.0, NEAREST_LATEST.1) else { return };
    let slices: Vec<Slice<'_>> = placed.images.iter().map(Slice::from).collect();
    let grid = Grid::around(&slices, &settings).expect("a grid");
    assert!(grid.origin.distance(&reference.grid().origin) < 1e-6, "{:?}", grid.origin);
    assert_eq!(grid.size, reference.grid().size);
}

#[test]
fn half_a_voxel_and_a_rigid_calibration_are_noticed() {
    let Some((placed, mut settings, reference)) = spine(NEAREST_LATEST.0, NEAREST_LATEST.1) else { return };
    let mut shifted = reference.grid().clone();
    settings.grid = Some(shifted.clone());
    let rigid: Vec<Slice<'_>> = placed.images.iter().map(|p| Slice::from(&p.bscan)).collect();
    let rigid =
        Volume::build(&rigid, &settings).expect("a volume").correlation(&reference).expect("one grid");
    shifted.origin = shifted.centre([1, 1, 1]);
    let half = shifted.origin.vector() - Vector3::from(shifted.spacing_m) / 2.0;
    let mut half_off = placed.clone();
    let by = reference.grid().origin.vector() - half;
    for image in &mut half_off.images {
        let map = image.world_from_pixel;
        let origin = Point::from_vector(map.at(0.0, 0.0).vector() + by);
        image.world_from_pixel = PixelMap::new(origin, map.column_step(), map.row_step());
    }
    let half = build(&half_off, &settings).correlation(&reference).expect("one grid");
    assert!(half.pearson.expect("varied") < 0.9, "{half:?}");
    assert!(rigid.pearson.expect("varied") < 0.9, "{rigid:?}");
}
