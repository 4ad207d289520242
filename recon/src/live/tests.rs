use probepath_us_capture::PlacedBScan;

use super::*;
use crate::phantom_contours::{BentVessel, Cut};
use crate::phantom_images::{Dice, Phantom};
use crate::{Fit, compare, reconstruct_from, reconstruct_lumen};

/// Gives what it was told to.
struct Told(std::vec::IntoIter<ImageLumen>);

impl LumenFinder for Told {
    fn find(&mut self, _: &PlacedBScan) -> ImageLumen {
        self.0.next().expect("as many as images")
    }
}

fn phantom() -> Phantom {
    let stenoses = vec![(16.0, 16.0, 0.7)];
    Phantom { stenoses, pixels: (160, 160), window: (20.0, 25.0), ..Phantom::default() }
}

/// Numbered contours of a bent vessel, `apart` (m) from each other.
fn contours(apart: f64) -> Vec<ImageLumen> {
    let vessel = BentVessel::new(0.06, 3.5e-3, 1.0, &mut Dice(8));
    let count = (0.06 / apart) as u32;
    let cut = |i: u32| Cut { at: f64::from(i) * apart, tilt: 0.0, way: 0.0, off: nalgebra::Vector3::zeros() };
    crate::phantom_contours::numbered((0..=count).map(|i| vessel.contour(cut(i), 32, |_| 0.0)))
}

fn live_with(lumens: Vec<ImageLumen>) -> LiveLumen {
    let image = Phantom { pixels: (8, 8), ..phantom() }.bscan(0, 0.0);
    let count = lumens.len();
    let told = Box::new(Told(lumens.into_iter()));
    let mut live = LiveLumen::with_finder(LumenSettings::default(), told).expect("good settings");
    (0..count).for_each(|_| assert!(live.push(&image).is_ok()));
    live
}

#[test]
fn the_last_view_of_contours_is_what_they_give_together() {
    let lumens = contours(0.6e-3);
    let live = live_with(lumens.clone());
    let view = live.view().vessel.expect("a vessel");
    let whole = reconstruct_from(&[], lumens, &LumenSettings::default()).expect("a vessel");
    assert_eq!(view.surface, whole.surface);
    assert_eq!(view.centreline, whole.centreline);
    assert!((view.covered_percent - 100.0).abs() < 1.0 && view.sparse_mm.is_empty(), "{view:?}");
    assert!(
        view.areas.iter().all(|area| (area.area_mm2 / 38.48 - 1.0).abs() < 0.01 && area.area_sd_mm2 > 0.0)
    );
}

#[test]
fn a_view_of_many_images_takes_part_of_them_and_shows_the_same_vessel() {
    let live = live_with(contours(0.05e-3));
    assert!(live.viewed.len() < 500 && live.lumens.len() == 1201, "{}", live.viewed.len());
    let view = live.view().vessel.expect("a vessel");
    let whole = reconstruct_from(&[], live.into_lumens(), &LumenSettings::default()).expect("a vessel");
    let apart = compare(&view.surface.mesh(), &whole.surface.mesh(), Fit::None).expect("surfaces");
    assert!(apart.hausdorff_mm < 0.05, "{}", apart.hausdorff_mm);
}

#[test]
fn images_pushed_one_by_one_give_nearly_what_they_give_together() {
    let images: Vec<PlacedBScan> = (0..32).map(|i| phantom().bscan(i, i as f64)).collect();
    let mut live = LiveLumen::new(LumenSettings::default()).expect("good settings");
    assert_eq!(live.view().vessel.err().map(|why| why.to_string().contains("0 of 0")), Some(true));
    for (i, image) in images.iter().enumerate() {
        let seen = live.push(image).expect("an image");
        assert_eq!(seen.number, i as u64);
        if i == 20 {
            let half = live.view().vessel.expect("half a vessel");
            assert!((half.centreline.length_m() - 0.02).abs() < 1e-3, "{}", half.centreline.length_m());
        }
    }
    let view = live.view();
    assert_eq!(view.counts.images, 32);
    let vessel = view.vessel.expect("a vessel");
    let whole = reconstruct_lumen(&images, &LumenSettings::default()).expect("a vessel");
    let apart = compare(&vessel.surface.mesh(), &whole.surface.mesh(), Fit::None).expect("surfaces");
    assert!(apart.error.mean_mm < 0.15, "{}", apart.error.mean_mm);
}

#[test]
fn gaps_and_a_sweep_that_is_too_fast_are_shown() {
    let sparse: Vec<ImageLumen> = contours(2.5e-3);
    let view = live_with(sparse).view();
    assert!(view.too_fast && view.speed_mm_s.is_none());
    let vessel = view.vessel.expect("a vessel");
    assert_eq!(vessel.sparse_mm.len(), 1, "{:?}", vessel.sparse_mm);
    let mut torn = contours(0.6e-3);
    torn.drain(30..50);
    let vessel = live_with(torn).view().vessel.expect("a vessel");
    assert_eq!(vessel.covered_mm.len(), 2, "{:?}", vessel.covered_mm);
    assert!((vessel.covered_percent - 79.0).abs() < 3.0, "{}", vessel.covered_percent);
    assert!(matches!(vessel.warnings[..], [ReconWarning::Gap { .. }]));
}

#[test]
fn an_image_without_a_place_is_refused_and_forgotten() {
    let mut image = Phantom { pixels: (8, 8), ..phantom() }.bscan(3, 0.0);
    image.bscan.setting.spacing.x_m = f64::NAN;
    let mut live = LiveLumen::new(LumenSettings::default()).expect("good settings");
    assert!(matches!(live.push(&image), Err(ReconError::Image { number: 3, .. })));
    assert!(live.lumens().is_empty());
}
