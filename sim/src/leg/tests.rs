use super::*;
use nalgebra::Vector3;

fn legs() -> impl Iterator<Item = Leg> {
    (0..20).map(|seed| {
        let side = if seed % 2 == 0 { Side::Left } else { Side::Right };
        Leg::new(&LegConfig { side, ..LegConfig::default() }, seed)
    })
}

#[test]
fn two_hundred_millimetres_can_be_scanned_from_above() {
    for leg in legs() {
        let main = leg.main();
        let from = main.segments()[1].range_m.start;
        for i in 0..=220 {
            let s = from + 1e-3 * f64::from(i);
            let (over, normal) = leg.skin_over(s);
            let depth = over.distance(&main.centre(s));
            assert!((0.018..0.042).contains(&depth), "depth {depth} at {s}");
            let tilt = normal.angle(&Direction::y().reversed()).to_degrees();
            assert!(tilt < 45.0, "the probe would tilt by {tilt} degrees at {s}");
        }
    }
}

#[test]
fn the_skin_grows_by_the_distance_along_its_normal() {
    let leg = Leg::new(&LegConfig::default(), 3);
    for i in 0..2000_u32 {
        let (z, turn) = (-0.5 + 6e-4 * f64::from(i % 1000), 0.01 * f64::from(i));
        let (on, normal) = leg.skin_at(z, turn);
        let (zero, same) = leg.surface(on);
        assert!(zero.abs() < 1e-9, "{zero}");
        assert!(same.angle(&normal) < 1e-6);
        for off in [-0.01, 0.002, 0.03] {
            let (distance, there) = leg.surface(on.moved(normal, off));
            assert!((distance - off).abs() < 1e-6, "{distance} instead of {off} at {z}, {turn}");
            assert!(there.angle(&normal) < 1e-4);
        }
    }
}

#[test]
fn the_skin_is_smooth() {
    let leg = Leg::new(&LegConfig::default(), 4);
    let mut last = leg.skin_at(0.2, 0.2).1;
    for i in 0..8000 {
        let normal = leg.skin_at(0.2 - 1e-4 * f64::from(i), 0.2).1;
        assert!(normal.angle(&last) < 1e-3, "the skin has an edge at step {i}");
        last = normal;
    }
}

#[test]
fn the_right_leg_is_the_mirror_image_of_the_left() {
    let left = Leg::new(&LegConfig::default(), 7);
    let right = Leg::new(&LegConfig { side: Side::Right, ..LegConfig::default() }, 7);
    let length = left.main().length_m();
    assert!((length - right.main().length_m()).abs() < 1e-6);
    for i in 0..200 {
        let point = Vector3::new(0.1, -0.12 + 5e-4 * f64::from(i), -0.002 * f64::from(i));
        let mirrored = Vector3::new(-point.x, point.y, point.z);
        let (a, b) = (Point::from_vector(point), Point::from_vector(mirrored));
        assert!((left.surface(a).0 - right.surface(b).0).abs() < 1e-9);
        assert!((left.artery(a) - right.artery(b)).abs() < 1e-9);
    }
}

#[test]
fn the_same_seed_gives_the_same_leg_and_another_one_another() {
    let config = LegConfig::default();
    let centre = |seed| Leg::new(&config, seed).main().centre(0.15);
    assert_eq!(centre(5), centre(5));
    assert!(centre(5).distance(&centre(6)) > 1e-4);
}

#[test]
fn every_stenosis_leaves_the_area_that_it_says() {
    for leg in legs() {
        let main = leg.main();
        for stenosis in main.stenoses() {
            let before = main.area(stenosis.at_m - stenosis.length_m);
            let left = main.area(stenosis.at_m) / before;
            assert!((1.0 - left - stenosis.area_fraction).abs() < 1e-9);
        }
    }
}

#[test]
fn the_deep_femoral_begins_inside_the_common_femoral_and_leaves_it() {
    for leg in legs() {
        let (main, deep) = (leg.main(), leg.deep());
        assert!(deep.centre(0.0).distance(&main.centre(leg.bifurcation_m())) < 1e-9);
        assert!(main.wall_distance(deep.centre(0.060)) > 4e-3);
        assert_eq!(leg.segment(deep.centre(0.08)), Some(SegmentName::Dfa));
        assert_eq!(leg.segment(main.centre(leg.bifurcation_m() - 0.02)), Some(SegmentName::Cfa));
    }
}

#[test]
fn arteries_bend_no_sharper_than_they_can() {
    for leg in legs() {
        for vessel in leg.arteries() {
            let sharpest = (0..500)
                .map(|i| vessel.curvature(vessel.length_m() * f64::from(i) / 500.0))
                .fold(0.0, f64::max);
            assert!(sharpest < 45.0, "a bend of radius {} mm", 1e3 / sharpest);
        }
    }
}
