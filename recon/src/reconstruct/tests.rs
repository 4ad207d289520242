use std::sync::OnceLock;

use probepath_frames::Stamp;
use probepath_us_capture::BScan;

use super::*;
use crate::phantom_images::Phantom;
use crate::{Fit, ReferenceSide, SeedPoint, compare};

/// A vessel with one stenosis of 75 %, an image each millimetre.
fn phantom() -> Phantom {
    Phantom {
        stenoses: vec![(22.0, 18.0, 0.75)],
        pixels: (200, 200),
        window: (20.0, 25.0),
        ..Phantom::default()
    }
}

fn sweep(phantom: &Phantom, count: u64) -> Vec<PlacedBScan> {
    (0..count).map(|i| phantom.bscan(i, i as f64)).collect()
}

/// The images are the slow part: they are made once.
fn images() -> &'static [PlacedBScan] {
    static IMAGES: OnceLock<Vec<PlacedBScan>> = OnceLock::new();
    IMAGES.get_or_init(|| sweep(&phantom(), 44))
}

/// The same place, another picture.
fn repainted(image: &PlacedBScan, grey: impl Fn(usize) -> u8) -> PlacedBScan {
    let bscan = &image.bscan;
    let size = (bscan.width(), bscan.height());
    let pixels: Vec<u8> = (0..size.0 * size.1).map(grey).collect();
    let painted = BScan::new(bscan.number, (Stamp::ZERO, Stamp::ZERO), bscan.setting, size, pixels);
    PlacedBScan { bscan: painted.expect("sizes agree"), ..image.clone() }
}

#[test]
fn the_lumen_of_a_phantom_and_its_stenosis_are_found() {
    let phantom = phantom();
    let found = reconstruct_lumen(images(), &LumenSettings::default()).expect("a lumen");
    assert_eq!(found.counts.without_lumen, 0, "{:?}", found.counts);
    assert_eq!((found.surface.along, found.surface.around), (300, 20));
    let off = |p: &nalgebra::Vector3<f64>| (p.y.hypot(p.z - 34.0) - phantom.radius_at(p.x)).abs();
    let mean = found.surface.points.iter().map(|p| off(&(p.vector() * 1e3))).sum::<f64>() / 6000.0;
    assert!(mean < 0.2, "{mean} mm");
    let [stenosis] = found.stenoses[..] else { panic!("{:?}", found.stenoses) };
    assert!((stenosis.percent_area - 75.0).abs() < 5.0, "{stenosis:?}");
    assert!(
        (stenosis.at_mm - 22.0).abs() < 1.5 && (12.0..21.0).contains(&stenosis.length_mm),
        "{stenosis:?}"
    );
    assert!(stenosis.reference.side == ReferenceSide::Proximal && stenosis.percent_area_sd < 4.0);
    let line = &found.centreline;
    assert!((line.length_m() - 0.043).abs() < 0.3e-3, "{}", line.length_m());
}

#[test]
fn what_shows_no_lumen_is_refused_with_its_reason_and_counted() {
    let mut sweep = images().to_vec();
    sweep[5] = repainted(&sweep[5], |_| 0);
    sweep[6] = repainted(&sweep[6], |i| 120 + (i.wrapping_mul(2_654_435_761) >> 7) as u8 % 60);
    let found = reconstruct_lumen(&sweep, &LumenSettings::default()).expect("a lumen elsewhere");
    assert!(matches!(found.images[5].lumen, Err(NoLumen::Dark { .. })), "{:?}", found.images[5].lumen);
    assert!(found.images[6].lumen.is_err());
    assert_eq!((found.counts.images, found.counts.without_lumen), (44, 2));
    assert!(found.sections.iter().all(|section| section.measure.is_some()), "3 mm are bridged");
}

#[test]
fn a_long_stretch_without_contact_is_said_and_not_measured() {
    let mut sweep = images().to_vec();
    for image in &mut sweep[2..9] {
        *image = repainted(image, |_| 3);
    }
    let found = reconstruct_lumen(&sweep, &LumenSettings::default()).expect("a lumen elsewhere");
    let section = found.sections.iter().find(|section| (section.at_mm - 5.0).abs() < 0.3).expect("a section");
    assert!(section.measure.is_none());
    assert!(found.warnings.iter().any(|warning| matches!(warning, ReconWarning::Gap { .. })));
    assert!(found.surface.measured.iter().any(|measured| !measured));
}

#[test]
fn the_same_images_give_the_same_surface_and_a_given_seed_the_same_lumen() {
    let sweep = &images()[..12];
    let settings = LumenSettings::default();
    let once = reconstruct_lumen(sweep, &settings).expect("a lumen");
    let again = reconstruct_lumen(sweep, &settings).expect("a lumen");
    assert_eq!(once, again);
    let seed = Some(SeedPoint::Millimetres { x_mm: 12.0, y_mm: 10.5 });
    let seeded = reconstruct_lumen(sweep, &LumenSettings { seed, ..settings }).expect("a lumen");
    let apart = compare(&seeded.surface.mesh(), &once.surface.mesh(), Fit::None).expect("surfaces");
    assert!(apart.hausdorff_mm < 0.05, "{}", apart.hausdorff_mm);
}

#[test]
fn what_cannot_be_worked_with_is_an_error_that_says_why() {
    let settings = LumenSettings::default();
    assert_eq!(reconstruct_lumen(&[], &settings), Err(ReconError::NoImages));
    let bad = LumenSettings { dynamic_range_db: f64::NAN, ..settings.clone() };
    assert!(matches!(
        reconstruct_lumen(images(), &bad),
        Err(ReconError::Setting { name: "dynamic_range_db", .. })
    ));
    let mut sweep = images()[..6].to_vec();
    sweep[3].bscan.setting.spacing.x_m = 0.0;
    assert!(matches!(reconstruct_lumen(&sweep, &settings), Err(ReconError::Image { number: 3, .. })));
    let dark: Vec<PlacedBScan> = images()[..6].iter().map(|image| repainted(image, |_| 0)).collect();
    let error = reconstruct_lumen(&dark, &settings).expect_err("nothing to see");
    assert!(error.to_string().contains("no contact"), "{error}");
    let still: Vec<PlacedBScan> = (0..6).map(|_| images()[0].clone()).collect();
    assert!(matches!(reconstruct_lumen(&still, &settings), Err(ReconError::NoLength { .. })));
}

#[test]
fn images_before_the_lumen_was_first_found_are_won_back_from_those_after() {
    // A seed in the tissue: the first images show nothing there, and the lumen is found only later.
    let seed = Some(SeedPoint::Millimetres { x_mm: 3.0, y_mm: 3.0 });
    let settings = LumenSettings { seed, ..LumenSettings::default() };
    let found = reconstruct_lumen(&images()[..16], &settings).expect("a lumen later on");
    assert_eq!(found.counts.without_lumen, 0, "{:?}", found.counts);
    let truth = std::f64::consts::PI * 3.935 * 3.935;
    let first = found.images[0].lumen.as_ref().expect("won back");
    assert!((first.area_mm2 / truth - 1.0).abs() < 0.15, "{} mm2", first.area_mm2);
}
