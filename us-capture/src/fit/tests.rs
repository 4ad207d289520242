//! Derivatives against differences, and what is refused.

#[path = "../../tests/support/calibration_truth.rs"]
mod calibration_truth;

use calibration_truth::{Capture, Dice, Truth, captured, zs};
use probepath_frames::{Point, Pose, Span, Track};

use super::motion::Moment;
use super::parameters::{COUNT, LAG, PLACE_TURN, SHIFT, Step, Values};
use super::problem::Problem;
use super::*;

fn truth(seed: u64) -> Truth {
    let mut dice = Dice::new(seed);
    let phantom = zs(&mut dice, 3, 1);
    captured(&mut dice, phantom, &Capture { images: 12, dot_px: 0.5, wrong: 0.1, ..Capture::default() })
}

fn options(truth: &Truth) -> FitOptions {
    FitOptions::new(truth.spacing, PhantomPlace::prior(truth.world_from_phantom))
}

/// Every parameter, the shear too, at random places: the slope of the cost, robust and with its priors, is its
/// derivative.
#[test]
fn the_slope_is_the_derivative_of_the_cost_by_every_parameter() {
    for seed in 0..300 {
        let (truth, mut dice) = (truth(seed), Dice::new(seed + 10_000));
        let robust = [Robust::None, Robust::Huber(1.5), Robust::Cauchy(2.0)][seed as usize % 3];
        let water = Scale::SpeedOfSound { water_celsius: 20.0, sd_celsius: 5.0, assumed_m_s: 1540.0 };
        let scale = if seed % 2 == 0 { Scale::Estimated } else { water };
        let options = FitOptions { robust, scale, ..options(&truth) };
        let mut problem = Problem::new(&truth.phantom, &truth.sightings, &truth.track, &options).unwrap();
        let start = Values::start(&truth.probe_from_image, Span::from_milliseconds(100), &options);
        problem.weigh(&start).unwrap();
        let sizes =
            |k: usize| if (SHIFT..SHIFT + 3).contains(&k) || k > PLACE_TURN + 2 { 1e-3 } else { 1e-2 };
        let values = start.moved(&Step::from_fn(|k, _| sizes(k) * dice.normal()));
        let slope = solve::normal(&problem, &values).unwrap().slope;
        for k in 0..COUNT {
            let step = 1e-4 * sizes(k);
            let at = |by: f64| {
                problem.cost(&values.moved(&Step::from_fn(|i, _| if i == k { by } else { 0.0 }))).unwrap()
            };
            let rise = (at(step) - at(-step)) / (2.0 * step);
            let name = Parameter::ALL[k].name;
            let size = slope[k].abs().max(1e-3 / sizes(k));
            assert!((rise - slope[k]).abs() < 1e-4 * size, "seed {seed}, {name}: {rise}, not {}", slope[k]);
        }
    }
}

#[test]
fn a_moment_goes_on_as_the_track_does() {
    let truth = truth(1);
    for sighting in &truth.sightings {
        let moment = Moment::at(&truth.track, sighting.stamp, 0.1).unwrap();
        let later = truth.track.at(sighting.stamp + Span::from_seconds(0.105)).unwrap();
        // FRAMES: the moment's own pose, five milliseconds on.
        let (metres, angle) = Pose::assume(moment.after(5e-3)).distance(&later);
        assert!(metres < 2e-5 && angle < 5e-4, "{metres} m, {angle} rad");
    }
}

fn refused(truth: &Truth, options: &FitOptions) -> FitError {
    fit(&truth.phantom, &truth.sightings, &truth.track, options, None).unwrap_err()
}

#[test]
fn options_that_make_no_sense_are_refused_by_name() {
    let truth = truth(2);
    let good = options(&truth);
    let spacing = PixelSpacing { x_m: f64::NAN, y_m: 1e-4 };
    let celsius = |water_celsius| Scale::SpeedOfSound { water_celsius, sd_celsius: 1.0, assumed_m_s: 1540.0 };
    let swapped = Lag::Estimated { from: Span::from_seconds(1.0), to: Span::from_seconds(-1.0) };
    let cases = [
        (FitOptions { spacing, ..good }, "spacing.x_m"),
        (FitOptions { floor_m: 0.0, ..good }, "floor_m"),
        (FitOptions { scale: celsius(293.0), ..good }, "water_celsius"),
        (FitOptions { lag: swapped, ..good }, "lag.to_s"),
        (FitOptions { lag: Lag::Known(Span::from_seconds(440.0)), ..good }, "lag_s"),
        (FitOptions { robust: Robust::Huber(0.0), ..good }, "robust limit"),
    ];
    for (options, name) in cases {
        let error = refused(&truth, &options);
        assert!(matches!(error, FitError::Option { field, .. } if field == name), "{error}");
    }
}

#[test]
fn dots_that_are_none_are_refused_by_image_and_wire() {
    let broken = |breaking: &dyn Fn(&mut SeenWire)| {
        let mut truth = truth(3);
        breaking(&mut truth.sightings[4].dots[2]);
        refused(&truth, &options(&truth))
    };
    assert!(matches!(broken(&|dot| dot.wire = 40), FitError::NoSuchWire { image: 4, wire: 40, wires: 9 }));
    assert!(matches!(broken(&|dot| dot.at_px[1] = f64::NAN), FitError::Dot { image: 4, wire: 2, .. }));
    let negative = |dot: &mut SeenWire| dot.covariance_px2 = -Matrix2::identity();
    assert!(matches!(broken(&negative), FitError::Dot { image: 4, wire: 2, .. }));
}

#[test]
fn too_little_is_refused_with_what_would_do() {
    let mut truth = truth(4);
    truth.sightings.truncate(2);
    assert!(matches!(refused(&truth, &options(&truth)), FitError::TooFew { images: 2, .. }));
    truth.sightings.clear();
    assert!(matches!(refused(&truth, &options(&truth)), FitError::TooFew { images: 0, dots: 0, .. }));
}

#[test]
fn images_and_poses_of_other_times_are_refused() {
    let mut truth = truth(5);
    for sighting in &mut truth.sightings {
        sighting.stamp = sighting.stamp + Span::from_seconds(1e6);
    }
    assert!(matches!(refused(&truth, &options(&truth)), FitError::OutsideTrack { inside: 0, .. }));
    truth.track = Track::new(Span::from_seconds(1.0));
    assert!(matches!(refused(&truth, &options(&truth)), FitError::OutsideTrack { inside: 0, .. }));
}

#[test]
fn a_probe_at_rest_has_no_lag() {
    let mut truth = truth(6);
    let still = truth.track.samples()[0].1;
    let mut track = Track::new(Span::from_seconds(1.0));
    for (stamp, _) in truth.track.samples() {
        track.push(*stamp, still).unwrap();
    }
    truth.track = track;
    let first = truth.sightings[0].dots.clone();
    truth.sightings.iter_mut().for_each(|s| s.dots.clone_from(&first));
    let start = Some(truth.probe_from_image);
    let error = fit(&truth.phantom, &truth.sightings, &truth.track, &options(&truth), start).unwrap_err();
    assert!(matches!(error, FitError::Undetermined { parameter: "lag", .. }), "{error}");
}

#[test]
fn a_wrong_phantom_is_no_rigid_image_or_says_its_shear() {
    let mut truth = truth(7);
    // Read in the wrong order: the middle wire crosses the other way.
    for z in truth.phantom.zs.clone() {
        let (a, b) = (truth.phantom.wires[z.diagonal].front, truth.phantom.wires[z.diagonal].back);
        let x = |at: Point<Phantom>, other: Point<Phantom>| {
            Point::new(other.vector().x, at.vector().y, at.vector().z)
        };
        truth.phantom.wires[z.diagonal].front = x(a, b);
        truth.phantom.wires[z.diagonal].back = x(b, a);
    }
    match fit(&truth.phantom, &truth.sightings, &truth.track, &options(&truth), None) {
        Err(FitError::NotRigid { .. }) => {}
        Err(other) => panic!("{other}"),
        Ok(found) => assert!(found.line_rms_m > 1e-3, "{} m", found.line_rms_m),
    }
}

#[test]
fn a_lag_beyond_what_is_allowed_is_refused() {
    let mut dice = Dice::new(8);
    let phantom = zs(&mut dice, 3, 1);
    let truth = captured(&mut dice, phantom, &Capture { lag_s: 0.5, ..Capture::default() });
    let lag = Lag::Estimated { from: Span::from_seconds(-0.3), to: Span::from_seconds(0.3) };
    let error = refused(&truth, &FitOptions { lag, ..options(&truth) });
    assert!(matches!(error, FitError::LagBeyond { .. } | FitError::NotRigid { .. }), "{error}");
}

#[test]
fn weak_directions_are_named_with_what_to_do() {
    let mut dice = Dice::new(9);
    let phantom = zs(&mut dice, 3, 1);
    let capture = Capture { tilt_rad: 0.01, dot_px: 0.5, ..Capture::default() };
    let truth = captured(&mut dice, phantom, &capture);
    let found = fit(&truth.phantom, &truth.sightings, &truth.track, &options(&truth), None).unwrap();
    let words: Vec<String> = found.weak.iter().map(ToString::to_string).collect();
    assert!(
        words.iter().any(|w| w.contains("turned only") && w.contains("tilt it by 15 degrees")),
        "{words:?}"
    );
    let index = found.uncertainty.parameters.iter().position(|p| *p == Parameter::LAG);
    assert_eq!(index, Some(LAG - 1), "the shear is never fitted, so the lag comes one earlier");
}

#[test]
fn a_known_temperature_gives_the_rows_their_size() {
    let mut dice = Dice::new(10);
    let phantom = zs(&mut dice, 3, 1);
    let mut truth = captured(&mut dice, phantom, &Capture { poses_every_s: 2e-3, ..Capture::default() });
    // What the scanner says, that took the water for tissue.
    let said = speed_of_sound_in_water(20.0) / 1540.0;
    truth.spacing.y_m /= said;
    for sd_celsius in [0.0, 0.5, f64::INFINITY] {
        let scale = Scale::SpeedOfSound { water_celsius: 20.0, sd_celsius, assumed_m_s: 1540.0 };
        let options = FitOptions { scale, ..options(&truth) };
        let found = fit(&truth.phantom, &truth.sightings, &truth.track, &options, None).unwrap();
        assert!((found.spacing.y_m / truth.spacing.y_m - said).abs() < 1e-5);
        let fitted = found.uncertainty.parameters.iter().any(|p| p.name == "row_scale");
        assert_eq!(fitted, sd_celsius > 0.0);
    }
}

#[test]
fn a_plan_expects_what_its_capture_states() {
    let mut dice = Dice::new(11);
    let phantom = zs(&mut dice, 3, 1);
    let capture = Capture { dot_px: 1.0, poses_every_s: 2e-3, ..Capture::default() };
    let truth = captured(&mut dice, phantom, &capture);
    let options = FitOptions { floor_m: 1e-6, ..options(&truth) };
    let found = fit(&truth.phantom, &truth.sightings, &truth.track, &options, None).unwrap();
    let planned =
        FitOptions { lag: Lag::Estimated { from: Span::ZERO, to: Span::from_seconds(0.3) }, ..options };
    let start = truth.probe_from_image;
    let plan = Information::of(&truth.phantom, &truth.sightings, &truth.track, &planned, start).unwrap();
    let expected = plan.expected().unwrap().standard_error_map(800, 600).mean_m();
    let stated = found.uncertainty.standard_error_map(800, 600).mean_m();
    assert!((0.8..1.3).contains(&(stated / expected)), "expected {expected}, stated {stated}");
    let twice = plan.clone().and(&plan).expected().unwrap().standard_error_map(800, 600).mean_m();
    assert!(twice < expected && twice > 0.6 * expected);
    assert_eq!(plan.parameters(), found.uncertainty.parameters);
}

#[test]
fn planes_that_labels_gave_alone_are_a_start() {
    let mut dice = Dice::new(12);
    let phantom = zs(&mut dice, 3, 1);
    let truth = captured(&mut dice, phantom, &Capture { lag_s: 0.0, ..Capture::default() });
    let mut planes = Vec::new();
    for sighting in &truth.sightings {
        let world_from_probe = truth.track.at(sighting.stamp).unwrap();
        let exact = truth.world_from_phantom.inverse() * world_from_probe * truth.probe_from_image;
        // Every third label is wrong by far.
        let off = if sighting.image % 3 == 0 { (0.1, 1.0) } else { (1e-4, 1e-3) };
        planes.push((sighting.stamp, Pose::assume(exact.isometry() * dice.motion(off.0, off.1))));
    }
    let found = start_from_planes(&planes, &truth.track, &options(&truth)).unwrap();
    let (metres, angle) = found.distance(&truth.probe_from_image);
    assert!(metres < 2e-3 && angle < 0.02, "{metres} m, {angle} rad");
    assert!(start_from_planes(&planes[..2], &truth.track, &options(&truth)).is_err());
}

#[test]
fn an_uncertainty_that_a_file_kept_is_the_same() {
    let truth = truth(13);
    let found = fit(&truth.phantom, &truth.sightings, &truth.track, &options(&truth), None).unwrap();
    let told = &found.uncertainty;
    let names: Vec<Parameter> = told.parameters.iter().filter_map(|p| Parameter::named(p.name)).collect();
    let spacings = (found.spacing, told.nominal());
    let again = |names: Vec<Parameter>, covariance| {
        Uncertainty::restored(&found.probe_from_image, spacings, names, covariance)
    };
    let restored = again(names.clone(), told.covariance.clone()).unwrap();
    assert!((restored.standard_error(300.0, 200.0) - told.standard_error(300.0, 200.0)).abs() < 1e-15);
    assert!(again(names[1..].to_vec(), told.covariance.clone()).is_none());
    assert!(again(names, told.covariance.clone() * f64::NAN).is_none());
}
