//! Volumes of the real spine phantom, against those that PLUS built from the same images and settings.

use std::path::PathBuf;

use probepath_recon::volume::{Correlation, Grid, Mark, Slice, Volume, VolumeSettings};
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
    let Some((found, ours, reference)) = compare(NEAREST_LATEST) else { return };
    let lit = reference.grey().iter().filter(|g| **g > 0).count();
    eprintln!("{found:?}, seen {} of {}, lit there {lit}", ours.count(Mark::Seen), ours.grey().len());
    assert!(found.pearson.expect("varied") >= 0.985, "{found:?}");
}

#[test]
fn linear_mean_with_filled_holes_agrees_with_plus() {
    let Some((found, ours, _)) = compare(LINEAR_MEAN) else { return };
    eprintln!("{found:?}, seen {}, filled {}", ours.count(Mark::Seen), ours.count(Mark::Filled));
    assert!(found.pearson.expect("varied") >= 0.98, "{found:?}");
}

#[test]
fn the_grid_found_from_the_images_is_that_of_plus() {
    let Some((placed, settings, reference)) = spine(NEAREST_LATEST.0, NEAREST_LATEST.1) else { return };
    let slices: Vec<Slice<'_>> = placed.images.iter().map(Slice::from).collect();
    let mut settings = settings; settings.region.fan = None;
    let grid = Grid::around(&slices, &settings).expect("a grid");
    eprintln!("{grid:?} {:?}", reference.grid());
}
