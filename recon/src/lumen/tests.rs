//! Lumens on images that nothing here was tuned on: other seeds, other walls, other disturbances.

use super::*;
use crate::phantom_images::{Branch, Phantom, Shadow, Vein};

fn straight(seed: u64) -> Phantom {
    Phantom { stenoses: Vec::new(), pixels: (320, 240), seed, ..Phantom::default() }
}

fn sweep(phantom: &Phantom, count: u32, step_mm: f64) -> Vec<PlacedBScan> {
    (0..count).map(|i| phantom.bscan(u64::from(i), f64::from(i) * step_mm)).collect()
}

/// The area in the image's plane (mm2).
fn true_area(phantom: &Phantom, image: &PlacedBScan) -> f64 {
    let r = phantom.radius_at(image.world_from_image.origin().vector().x * 1e3);
    let oblique = (1.0 + phantom.slope.0.powi(2) + phantom.slope.1.powi(2)).sqrt();
    std::f64::consts::PI * r * r * phantom.oval.0 * phantom.oval.1 * oblique
}

/// Relative errors of the area, image by image, where there is a lumen.
fn area_errors(phantom: &Phantom, images: &[PlacedBScan], found: &[ImageLumen]) -> Vec<f64> {
    let error = |(image, found): (&PlacedBScan, &ImageLumen)| {
        Some(found.lumen.as_ref().ok()?.area_mm2 / true_area(phantom, image) - 1.0)
    };
    images.iter().zip(found).filter_map(error).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn no_third_of_the_area_is_lost_on_other_walls_contrasts_and_disturbances() {
    let vein =
        |off, seed| Phantom { vein: Some(Vein { off, radius: 4.2, wall: (0.4, 0.6) }), ..straight(seed) };
    let cases = [
        ("a thin wall", Phantom { wall: 0.5, ..straight(101) }),
        ("a thick wall", Phantom { wall: 1.3, ..straight(102) }),
        ("a wall as dim as the tissue", Phantom { echoes: (0.02, 0.55, 0.5), ..straight(103) }),
        ("a grey lumen", Phantom { echoes: (0.07, 1.0, 0.4), ..straight(104) }),
        ("a bright wall in dark tissue", Phantom { echoes: (0.03, 1.8, 0.2), ..straight(105) }),
        ("a dim picture", Phantom { gain_db: -16.0, ..straight(106) }),
        ("a bright picture", Phantom { gain_db: 8.0, ..straight(107) }),
        (
            "a narrow shadow",
            Phantom {
                shadow: Some(Shadow { across: (-2.5, -1.0), below: 15.0, loss_db: 20.0 }),
                ..straight(108)
            },
        ),
        ("reverberations", Phantom { bands: vec![(32.0, 0.4, 0.15), (33.6, 0.4, 0.1)], ..straight(109) }),
        ("a vessel off the middle", Phantom { across: -10.0, ..straight(110) }),
        ("an oblique vessel", Phantom { slope: (-0.25, 0.2), ..straight(111) }),
        ("an oval vessel", Phantom { oval: (1.2, 0.8), ..straight(112) }),
        ("a vein beside it", vein((-9.0, 0.5), 113)),
        ("a vein below it", vein((1.0, 8.8), 114)),
    ];
    for (name, phantom) in &cases {
        let images = sweep(phantom, 10, 0.7);
        let settings = LumenSettings::default();
        let errors = area_errors(phantom, &images, &segment(&images, &settings));
        assert!(errors.len() >= 9, "{name}: {} of 10 found", errors.len());
        assert!(mean(&errors).abs() < 0.06, "{name}: {:+.1} %", 100.0 * mean(&errors));
        let worst = errors.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        assert!(worst < 0.2, "{name}: {:+.1} %", 100.0 * worst);
    }
}

#[test]
fn what_a_shadow_hides_is_refused_with_a_reason_or_right() {
    for (seed, across) in [(121, (-1.0, 12.0)), (122, (2.0, 12.0)), (123, (-12.0, 0.5)), (124, (-6.0, 6.0))] {
        let shadow = Some(Shadow { across, below: 20.0, loss_db: 30.0 });
        let phantom = Phantom { shadow, ..straight(seed) };
        let images = sweep(&phantom, 12, 0.7);
        let found = segment(&images, &LumenSettings::default());
        let errors = area_errors(&phantom, &images, &found);
        let wrong = errors.iter().filter(|error| error.abs() > 0.33).count();
        assert!(wrong <= 1, "{across:?}: {errors:.2?}");
        for refused in found.iter().filter_map(|found| found.lumen.as_ref().err()) {
            assert!(!refused.to_string().is_empty() && !refused.kind().is_empty());
        }
    }
}

#[test]
fn a_lumen_a_third_of_which_lies_in_a_shadow_has_its_whole_area() {
    for (seed, across, loss_db) in
        [(131, (1.5, 4.5), 20.0), (133, (1.0, 4.0), 20.0), (134, (-4.5, -1.5), 15.0)]
    {
        let shadow = Some(Shadow { across, below: 10.0, loss_db });
        let phantom = Phantom { shadow, ..straight(seed) };
        let images = sweep(&phantom, 12, 0.7);
        let errors = area_errors(&phantom, &images, &segment(&images, &LumenSettings::default()));
        assert!(errors.len() >= 11 && mean(&errors).abs() < 0.05, "{across:?}: {errors:.2?}");
    }
}

#[test]
fn a_vessel_nearly_closed_is_right_or_refused_and_found_again_behind_it() {
    let phantom = Phantom { stenoses: vec![(16.0, 16.0, 0.96)], ..straight(131) };
    let images = sweep(&phantom, 33, 1.0);
    let found = segment(&images, &LumenSettings::default());
    for number in (0..6).chain(27..33) {
        let contour = found[number].lumen.as_ref().expect("the lumen is wide there");
        let error = contour.area_mm2 / true_area(&phantom, &images[number]) - 1.0;
        assert!(error.abs() < 0.25, "image {number}: {:+.1} %", 100.0 * error);
    }
    let narrow = area_errors(&phantom, &images[13..20], &found[13..20]);
    assert!(narrow.iter().all(|error| *error < 1.0), "{narrow:.2?}");
}

#[test]
fn coarse_speckle_leads_no_sweep_astray() {
    // Half as coarse again as the model of the setting, and a narrowing in which speckle's holes are as wide as the lumen.
    let spread = (0.5, 2.37, 3.0);
    let mut settings = LumenSettings::default();
    let own = &mut settings.point_spread;
    (own.axial_fwhm_m, own.line_spacing_per_m2) = (0.5e-3, 0.0);
    (own.lateral_fwhm_m, own.lateral_depth_of_field_m) = (2.37e-3, 1.0);
    let mut refused = 0;
    for seed in 171..175 {
        let phantom = Phantom { spread, stenoses: vec![(12.0, 19.7, 0.8)], ..straight(seed) };
        let images = sweep(&phantom, 60, 0.5);
        for (number, found) in segment(&images, &settings).iter().enumerate() {
            let Ok(contour) = &found.lumen else {
                refused += 1;
                continue;
            };
            let at = contour.centre.vector() * 1e3;
            let off = (at.y - phantom.across).hypot(at.z - phantom.depth);
            assert!(off < 1.5, "seed {seed}, image {number}: {off:.1} mm off");
        }
    }
    assert!(refused <= 5, "{refused} of 240");
}

#[test]
fn what_a_sweep_begins_with_gives_way_to_the_longer_vessel_that_contradicts_it() {
    let (phantom, elsewhere) = (straight(181), Phantom { across: 9.0, ..straight(182) });
    let mut images = sweep(&phantom, 40, 0.6);
    (0..3_u32).for_each(|i| images[i as usize] = elsewhere.bscan(u64::from(i), f64::from(i) * 0.6));
    let found = segment(&images, &LumenSettings::default());
    for image in &found[..3] {
        let why = image.lumen.as_ref().expect_err("the vessel runs elsewhere");
        assert_eq!(why.kind(), "away from its neighbours");
    }
    assert_eq!(found[3..].iter().filter(|found| found.lumen.is_ok()).count(), 37);
}

#[test]
fn the_standard_deviation_of_a_point_is_what_it_is_off() {
    let cases =
        [straight(141), Phantom { echoes: (0.05, 0.8, 0.5), wall: 1.0, radius: 2.6, ..straight(142) }];
    for phantom in &cases {
        let images = sweep(phantom, 40, 0.8);
        let (mut squares, mut count) = (0.0, 0.0);
        for found in segment(&images, &LumenSettings::default()) {
            let contour = found.lumen.expect("a lumen");
            for (place, sd) in contour.world.iter().zip(&contour.points_sd_mm) {
                let at = place.vector() * 1e3;
                squares += (phantom.distance(at.x, at.y, at.z) / sd).powi(2);
                count += 1.0;
            }
        }
        let normalised = f64::sqrt(squares / count);
        assert!((0.7..1.25).contains(&normalised), "{normalised:.2} standard deviations");
    }
}

#[test]
fn the_standard_deviation_of_a_size_is_what_it_scatters_by_and_what_is_shared_covers_its_mean() {
    let (mut scatter, mut stated, mut sweeps) = (0.0, 0.0, 0.0);
    for seed in 0..4 {
        let phantom = straight(900 + seed);
        let found = segment(&sweep(&phantom, 40, 3.0), &LumenSettings::default());
        let contours: Vec<_> = found.iter().map(|found| found.lumen.as_ref().expect("a lumen")).collect();
        let off: Vec<f64> = contours.iter().map(|contour| contour.radius_mm() - phantom.radius).collect();
        let middle = mean(&off);
        let shared = contours[0].common_size_sd_mm;
        assert!(
            middle.abs() < 1.96 * shared.hypot(contours[0].sd_mm / 40_f64.sqrt()),
            "{middle} mm, {shared}"
        );
        scatter += off.iter().map(|off| (off - middle).powi(2)).sum::<f64>() / 39.0;
        stated += contours.iter().map(|contour| contour.sd_mm.powi(2)).sum::<f64>() / 40.0;
        sweeps += 1.0;
    }
    let [scatter, stated] = [scatter, stated].map(|sum| f64::sqrt(sum / sweeps));
    assert!((0.75..1.1).contains(&(scatter / stated)), "{scatter} mm, {stated} stated");
}

#[test]
fn lateral_walls_are_less_sure_than_axial_ones() {
    let image = straight(151).bscan(0, 0.0);
    let found = segment(std::slice::from_ref(&image), &LumenSettings::default());
    let sure = found[0].lumen.as_ref().expect("a lumen");
    // Ray 0 is lateral, a quarter of a turn on it is axial.
    let quarter = sure.points_sd_mm.len() / 4;
    assert!(sure.points_sd_mm[0] > 1.3 * sure.points_sd_mm[quarter], "{:?}", sure.points_sd_mm);
}

#[test]
fn a_branch_is_followed_under_its_own_number_and_a_vein_is_no_branch() {
    let branch = Branch { at: 6.0, slope: (0.55, 0.15), radius: 2.6 };
    let phantom = Phantom { branch: Some(branch), radius: 3.4, across: -3.0, ..straight(161) };
    let images = sweep(&phantom, 30, 0.8);
    let settings = LumenSettings::default();
    let mut tracker = Tracker::new(settings.clone());
    let live: Vec<ImageLumen> = images.iter().map(|image| tracker.find(image)).collect();
    for found in [segment(&images, &settings), live] {
        let seen = found[20..].iter().filter(|found| found.others.len() == 1).count();
        assert!(seen >= 8, "{seen} of 10");
        assert!(found[..5].iter().all(|found| found.others.is_empty()), "before it leaves");
        for (image, found) in images.iter().zip(&found).skip(20) {
            let Some(other) = found.others.first() else { continue };
            assert_eq!(other.vessel, found.others[0].vessel);
            let x = image.world_from_image.origin().vector().x * 1e3;
            let truth = (
                phantom.across + branch.slope.0 * (x - branch.at),
                phantom.depth + branch.slope.1 * (x - branch.at),
            );
            let at = other.centre.vector() * 1e3;
            assert!((at.y - truth.0).hypot(at.z - truth.1) < 0.6, "{at:?} {truth:?}");
        }
    }
    let vein = Vein { off: (8.6, 0.0), radius: 4.0, wall: (0.4, 0.6) };
    let stenoses = vec![(14.0, 14.0, 0.6)];
    let beside = Phantom { vein: Some(vein), stenoses, ..straight(162) };
    let found = segment(&sweep(&beside, 24, 1.0), &settings);
    assert!(found.iter().all(|found| found.others.is_empty()));
}
