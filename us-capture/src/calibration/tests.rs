use probepath_frames::nalgebra::{Isometry3, Vector3};
use probepath_frames::{Phantom, World};
use proptest::prelude::*;

use super::*;
use crate::PixelSpacing;
use crate::point_spread::PointSpreadMm;

fn calibration() -> Calibration {
    Calibration {
        id: "z-7cm-2026-11-22".into(),
        date: "2026-11-22".into(),
        phantom: "Z, 19 wires".into(),
        // FRAMES: made up for the test.
        probe_from_image: Pose::assume(Isometry3::new(
            Vector3::new(-0.02, 0.001, 0.0),
            Vector3::new(1.57, 0.02, -0.01),
        )),
        setting: Setting {
            depth_m: 0.07,
            focus_m: 0.045,
            window_top_m: 0.02,
            window_height_m: 0.03,
            window_width_m: 0.04,
            spacing: PixelSpacing { x_m: 0.04 / 640.0, y_m: 0.03 / 480.0 },
        },
        image_lag: Span::from_nanoseconds(-64_800_000),
        error: CalibrationError { rms_mm: 0.6, sd_mm: 0.38, held_out: true },
        quality: None,
    }
}

#[test]
fn what_is_written_is_what_is_read() {
    let text = calibration().to_toml().unwrap();
    assert_eq!(Calibration::from_toml(&text).unwrap(), calibration(), "{text}");
    assert!(text.contains("depth_mm = 70.0") && text.contains("image_lag_ms = -64.8"), "{text}");
}

fn place() -> Pose<World, Phantom> {
    // FRAMES: made up for the test.
    Pose::assume(Isometry3::new(Vector3::new(0.25, -0.125, 0.0), Vector3::new(0.0, 0.5, 0.0)))
}

fn spread() -> PointSpreadMm {
    PointSpreadMm {
        dots: 1500,
        dynamic_range_db: 50.0,
        axial_fwhm_mm: 0.5,
        axial_sd_mm: 0.0125,
        lateral_fwhm_mm: 1.75,
        lateral_sd_mm: 0.03,
        lateral_waist_depth_mm: 35.0,
        lateral_depth_of_field_mm: 14.0,
        elevational_fwhm_mm: 3.25,
        elevational_sd_mm: 0.2,
        elevational_waist_depth_mm: -3.5,
        elevational_depth_of_field_mm: 28.0,
    }
}

fn quality() -> Quality {
    let errors = ErrorsMm {
        mids: 300,
        mid_mean95_mm: Some(0.5),
        mid_sd95_mm: Some(0.2),
        mid_rms_mm: Some(0.61),
        lines: 900,
        line_rms_mm: 0.3,
    };
    Quality {
        software: "probepath 0.1.0".into(),
        images: 188,
        dots: 1692,
        standard_error: PromisedMm { mean_mm: 0.1, p95_mm: 0.2 },
        found: Some(FoundMm {
            held_out: true,
            all: errors,
            depths: vec![DepthMm {
                from_mm: 20.0,
                to_mm: 30.0,
                errors: ErrorsMm { mid_rms_mm: None, ..errors },
            }],
        }),
        repeatability: Some(RepeatabilityMm { calibrations: 10, points: 600, c_rms_mm: 0.4, mean_mm: 0.35 }),
        water: Some(Water { temperature_celsius: 20.0, speed_of_sound_m_s: 1482.3, assumed_m_s: 1540.0 }),
        world_from_phantom: Some(NamedPose::from(&place())),
        point_spread: Some(spread()),
        covariance: Some(Covariance {
            parameters: vec!["image_turn_x".into(), "lag".into()],
            units: vec!["rad".into(), "s".into()],
            rows: vec![vec![1e-6, -3e-7], vec![-3e-7, 4e-6]],
        }),
    }
}

fn known_well() -> Calibration {
    Calibration { quality: Some(quality()), ..calibration() }
}

#[test]
fn all_that_is_known_of_it_is_written_and_read() {
    let text = known_well().to_toml().unwrap();
    assert_eq!(Calibration::from_toml(&text).unwrap(), known_well(), "{text}");
    assert_eq!(quality().place().unwrap(), Some(place()));
    let covariance = quality().covariance.unwrap();
    assert_eq!(covariance.about(&["lag", "image_turn_y"]), nalgebra::dmatrix![4e-6, 0.0; 0.0, 0.0]);
}

#[test]
fn a_quality_that_cannot_be_is_refused_with_the_reason() {
    let good = known_well().to_toml().unwrap();
    let cases = [
        ("p95_mm = 0.2", "p95_mm = nan", "quality.standard_error.p95_mm"),
        ("p95_mm = 0.2", "p95_m = 0.0002", "p95_m"),
        ("line_rms_mm = 0.3", "line_rms_mm = -0.3", "quality.found"),
        ("temperature_celsius = 20.0", "temperature_celsius = 293.0", "temperature_celsius"),
        ("speed_of_sound_m_s = 1482.3", "speed_of_sound_m_s = 1.48", "speed_of_sound_m_s"),
        ("axial_fwhm_mm = 0.5", "axial_fwhm_mm = 0.0", "quality.point_spread.axial_fwhm_mm"),
        ("lateral_sd_mm = 0.03", "lateral_sd_mm = -0.03", "quality.point_spread.lateral_sd_mm"),
        ("waist_depth_mm = -3.5", "waist_depth_mm = nan", "quality.point_spread.elevational_waist_depth_mm"),
        ("dots = 1500", "dots = -1", "dots"),
        ("of = \"Phantom\"", "of = \"Image\"", "World_T_Phantom"),
        ("[0.25, -0.125, 0.0]", "[0.25, nan, 0.0]", "world_from_phantom"),
        ("\"lag\"", "\"image_turn_x\"", "twice"),
        ("\"s\"", "\"ms\"", "\"ms\""),
        ("[0.000001, -0.0000003]", "[0.000001]", "square"),
        ("[0.000001, -0.0000003]", "[0.000001, 0.0000003]", "the other way round"),
        ("[0.000001, -0.0000003]", "[nan, -0.0000003]", "variance of image_turn_x"),
        ("0.0000003", "0.000003", "eigenvalue"),
    ];
    for (from, to, named) in cases {
        let text = good.replace(from, to);
        assert_ne!(text, good, "{from} in {good}");
        let message = Calibration::from_toml(&text).unwrap_err().to_string();
        assert!(message.contains(named), "{to}: {message}");
    }
}

#[test]
fn every_setting_but_its_own_is_refused_with_what_differs() {
    let ours = calibration();
    ours.check_setting(&ours.setting).unwrap();
    let mut theirs = ours.setting;
    theirs.depth_m = 0.05;
    theirs.window_top_m = 0.0;
    let message = ours.check_setting(&theirs).unwrap_err().to_string();
    assert!(message.contains("depth_mm 50 instead of 70, window_top_mm 0 instead of 20"), "{message}");
    assert!(!message.contains("focus"), "{message}");
    theirs = ours.setting;
    theirs.spacing.x_m *= 1.002;
    assert!(ours.check_setting(&theirs).is_err());
    theirs.spacing.x_m = f64::NAN;
    assert!(ours.check_setting(&theirs).is_err());
}

#[test]
fn a_bad_calibration_is_refused_with_the_field() {
    let good = calibration().to_toml().unwrap();
    let cases = [
        ("of = \"Image\"", "of = \"World\"", "Probe_T_World"),
        ("depth_mm = 70.0", "depth_mm = -70.0", "depth_mm"),
        ("depth_mm = 70.0", "depth_mm = nan", "depth_mm"),
        ("depth_mm = 70.0", "depth_m = 0.07", "depth_m"),
        ("image_lag_ms = -64.8", "image_lag_ms = inf", "image_lag_ms"),
        ("rms_mm = 0.6", "rms_mm = -0.6", "rms_mm"),
        ("rms_mm = 0.6", "rms_mm = \"0.6\"", "rms_mm"),
    ];
    for (from, to, named) in cases {
        let text = good.replace(from, to);
        assert_ne!(text, good, "{from}");
        let message = Calibration::from_toml(&text).unwrap_err().to_string();
        assert!(message.contains(named), "{to}: {message}");
    }
}

#[test]
fn a_file_cut_anywhere_is_refused_or_whole() {
    for whole in [calibration(), known_well()] {
        let good = whole.to_toml().unwrap();
        for end in 0..good.len() {
            if let Ok(read) = Calibration::from_toml(&good[..end]) {
                assert_eq!(read, whole, "cut at {end}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn lengths_go_through_millimetres_to_the_last_bit_but_one(metres in 1e-6..1.0f64) {
        // Some doubles are no double's thousandth.
        prop_assert!((mm(metres) / 1e3 - metres).abs() <= metres * f64::EPSILON);
    }
}
