use probepath_frames::nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use super::*;

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
    }
}

#[test]
fn what_is_written_is_what_is_read() {
    let text = calibration().to_toml().unwrap();
    assert_eq!(Calibration::from_toml(&text).unwrap(), calibration(), "{text}");
    assert!(text.contains("depth_mm = 70.0") && text.contains("image_lag_ms = -64.8"), "{text}");
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
    let good = calibration().to_toml().unwrap();
    for end in 0..good.len() {
        if let Ok(read) = Calibration::from_toml(&good[..end]) {
            assert_eq!(read, calibration(), "cut at {end}");
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
