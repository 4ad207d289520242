use std::collections::VecDeque;

use probepath_frames::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Point};

use super::*;
use crate::{CalibrationError, PixelSpacing, Setting};

const SETTING: Setting = Setting {
    depth_m: 0.07,
    focus_m: 0.045,
    window_top_m: 0.0,
    window_height_m: 0.07,
    window_width_m: 0.04,
    spacing: PixelSpacing { x_m: 0.01, y_m: 0.01 },
};

/// A machine that has made its images already and gives each when it has arrived.
struct Machine(VecDeque<BScan>);

impl BScanSource for Machine {
    fn poll(&mut self, now: Stamp) -> Result<Option<BScan>, SourceFault> {
        Ok(self.0.pop_front_if(|bscan| bscan.arrived <= now))
    }
}

fn ms(milliseconds: f64) -> Stamp {
    Stamp::from_nanoseconds((milliseconds * 1e6).round() as i64)
}

fn bscan(number: u64, formed_ms: f64, latency_ms: f64) -> BScan {
    BScan::new(number, (ms(formed_ms), ms(formed_ms + latency_ms)), SETTING, (4, 7), vec![0; 28]).unwrap()
}

fn calibration(lag_ms: i64) -> Calibration {
    Calibration {
        id: "test".into(),
        date: "2026-11-22".into(),
        phantom: "none".into(),
        // FRAMES: made up for the test.
        probe_from_image: Pose::<Probe, Image>::assume(Isometry3::translation(-0.02, 0.0, 0.0)),
        setting: SETTING,
        image_lag: Span::from_milliseconds(lag_ms),
        error: CalibrationError { rms_mm: 0.5, sd_mm: 0.3, held_out: true },
        quality: None,
    }
}

/// The true motion: a curve that turns, at about 10 mm/s.
fn truth(stamp: Stamp) -> Pose<World, Probe> {
    let t = stamp.seconds();
    let position = Translation3::new(0.002 * (2.0 * t).sin(), 0.0, 0.01 * t);
    let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.1 * t, 0.05 * t.sin(), 0.0));
    // FRAMES: made up for the test.
    Pose::assume(Isometry3::from_parts(position, turned))
}

fn straight(stamp: Stamp, speed: f64) -> Pose<World, Probe> {
    // FRAMES: made up for the test.
    Pose::assume(Isometry3::translation(0.0, 0.0, speed * stamp.seconds()))
}

fn push(stamp: Stamp) -> Wrench<Probe> {
    Wrench::new(Vector3::new(0.0, 0.0, -5.0 - stamp.seconds()), Vector3::zeros())
}

/// Ticks every 2 ms until `until_ms`, the machine polled at each.
fn run(
    capture: &mut Capture,
    machine: &mut Machine,
    until_ms: i64,
    pose: impl Fn(Stamp) -> Pose<World, Probe>,
) -> Vec<PlacedBScan> {
    for k in 0..=until_ms / 2 {
        let now = ms(2.0 * k as f64);
        capture.tick(now, pose(now), Some(push(now))).unwrap();
        capture.poll(machine, now).unwrap();
    }
    std::iter::from_fn(|| capture.take()).collect()
}

#[test]
fn every_bscan_gets_the_pose_and_wrench_of_the_instant_it_was_formed() {
    for lag_ms in [-65, 0, 12] {
        let mut capture = Capture::new(calibration(lag_ms), Keeping::All).unwrap();
        // 31 ms apart and off the ticks; the first is formed late enough for a negative lag.
        let images = (0..60u32).map(|n| bscan(u64::from(n) + 5, 70.3 + 31.0 * f64::from(n), 80.0));
        let placed = run(&mut capture, &mut Machine(images.collect()), 2200, truth);
        assert_eq!(placed.len(), 60);
        for scan in &placed {
            let instant = scan.bscan.formed + Span::from_milliseconds(lag_ms);
            let (metres, radians) = scan.world_from_probe.distance(&truth(instant));
            assert!(metres < 1e-8 && radians < 1e-7, "{metres} {radians}");
            let force = scan.wrench.unwrap().force.z;
            assert!((force - push(instant).force.z).abs() < 1e-9, "{force}");
            let corner: Point<World> = scan.world_from_image.origin();
            assert!(corner.distance(&(scan.world_from_probe * Point::new(-0.02, 0.0, 0.0))) < 1e-12);
        }
        assert_eq!(capture.counts(), Counts { arrived: 60, kept: 60, ..Counts::default() });
    }
}

#[test]
fn bscans_outside_the_track_are_dropped_and_counted_never_extrapolated() {
    let mut capture = Capture::new(calibration(0), Keeping::All).unwrap();
    for now in (100..=200).step_by(2).chain((300..=400).step_by(2)) {
        capture.tick(ms(f64::from(now)), truth(ms(f64::from(now))), None).unwrap();
    }
    let images = [50.0, 150.0, 250.0, 350.0, 450.0].into_iter().zip(0..).map(|(t, n)| bscan(n, t, 1.0));
    capture.poll(&mut Machine(images.collect()), ms(500.0)).unwrap();
    capture.finish();
    let stamps: Vec<Stamp> = std::iter::from_fn(|| capture.take()).map(|scan| scan.bscan.formed).collect();
    assert_eq!(stamps, [ms(150.0), ms(350.0)]);
    let wanted =
        Counts { arrived: 5, kept: 2, before_track: 1, in_gap: 1, after_track: 1, ..Counts::default() };
    assert_eq!(capture.counts(), wanted);
    assert_eq!(capture.counts().dropped() + capture.counts().kept, capture.counts().arrived);
}

#[test]
fn uniform_spacing_keeps_the_nearest_to_each_mark() {
    // 10 mm/s and 50 images a second: one every 0.2 mm; marks every 0.5 mm at 0, 0.5, 1.0, ...
    let mut capture = Capture::new(calibration(0), Keeping::Spaced { every_m: 0.5e-3 }).unwrap();
    let images = (0..500u32).map(|n| bscan(u64::from(n), 20.0 * f64::from(n), 5.0));
    let mut kept = run(&mut capture, &mut Machine(images.collect()), 10_100, |t| straight(t, 0.01));
    capture.finish();
    kept.extend(std::iter::from_fn(|| capture.take()));
    assert_eq!(kept.len(), 201, "99.8 mm at 0.5 mm, with both ends");
    // The last image, at 99.8 mm, is the nearest that came to the mark at 100 mm.
    for (mark, scan) in kept.iter().enumerate().take(200) {
        let z = scan.world_from_probe.origin().vector().z;
        assert!((z - 0.5e-3 * mark as f64).abs() <= 0.1e-3 + 1e-9, "mark {mark} at {z}");
    }
    let counts = capture.counts();
    assert_eq!((counts.kept, counts.between_marks, counts.marks_without), (201, 299, 0));
}

#[test]
fn a_probe_too_fast_for_the_machine_leaves_marks_without_and_says_so() {
    let mut capture = Capture::new(calibration(0), Keeping::Spaced { every_m: 0.5e-3 }).unwrap();
    let images = (0..50u32).map(|n| bscan(u64::from(n), 40.0 * f64::from(n), 5.0));
    let mut kept = run(&mut capture, &mut Machine(images.collect()), 2100, |t| straight(t, 0.03));
    capture.finish();
    kept.extend(std::iter::from_fn(|| capture.take()));
    assert_eq!(kept.len(), 50, "1.2 mm apart: all are kept");
    // 49 steps of 2.4 marks end at mark 117.6, which rounds to 118: 119 marks, 50 with an image.
    assert_eq!(capture.counts().marks_without, 69);
}

#[test]
fn a_trembling_probe_at_rest_makes_no_way() {
    let mut capture = Capture::new(calibration(0), Keeping::Spaced { every_m: 0.5e-3 }).unwrap();
    let images = (0..500u32).map(|n| bscan(u64::from(n), 20.0 * f64::from(n), 5.0));
    let trembling = |t: Stamp| {
        let phase = t.nanoseconds() as f64;
        // FRAMES: made up for the test. 20 um each way, another at each image.
        Pose::assume(Isometry3::translation(
            2e-5 * (phase * 1.7e-7).sin(),
            2e-5 * (phase * 2.9e-7).cos(),
            0.0,
        ))
    };
    run(&mut capture, &mut Machine(images.collect()), 10_100, trembling);
    capture.finish();
    assert_eq!(std::iter::from_fn(|| capture.take()).count(), 1);
}

#[test]
fn lost_and_repeated_numbers_are_counted() {
    let mut capture = Capture::new(calibration(0), Keeping::All).unwrap();
    let numbers = [3, 4, 8, 8, 7, 9];
    let images = numbers.into_iter().zip(1..).map(|(n, k)| bscan(n, 10.0 * f64::from(k), 1.0));
    let kept = run(&mut capture, &mut Machine(images.collect()), 100, truth);
    assert_eq!(kept.iter().map(|scan| scan.bscan.number).collect::<Vec<_>>(), [3, 4, 8, 9]);
    assert_eq!((capture.counts().lost, capture.counts().out_of_order), (3, 2));
}

#[test]
fn a_silent_machine_is_noticed_after_200_ms() {
    let mut capture = Capture::new(calibration(0), Keeping::All).unwrap();
    let mut machine = Machine([bscan(0, 10.0, 5.0)].into());
    assert_eq!(capture.stalled(ms(900.0)), None, "nobody has listened yet");
    run(&mut capture, &mut machine, 216, truth);
    assert_eq!(capture.stalled(ms(216.0)), None);
    run_silently(&mut capture, &mut machine, 218);
    assert_eq!(capture.stalled(ms(218.0)), Some(Span::from_milliseconds(202)));
}

fn run_silently(capture: &mut Capture, machine: &mut Machine, at_ms: i32) {
    capture.poll(machine, ms(f64::from(at_ms))).unwrap();
}

#[test]
fn another_setting_is_refused_and_names_what_differs() {
    let mut capture = Capture::new(calibration(0), Keeping::All).unwrap();
    let mut other = bscan(7, 10.0, 1.0);
    other.setting.depth_m = 0.05;
    let error = capture.poll(&mut Machine([other].into()), ms(20.0)).unwrap_err().to_string();
    assert!(error.contains("B-scan 7") && error.contains("depth_mm 50 instead of 70"), "{error}");
}

#[test]
fn a_broken_stream_is_an_error_and_a_bad_spacing_too() {
    struct Broken;
    impl BScanSource for Broken {
        fn poll(&mut self, _: Stamp) -> Result<Option<BScan>, SourceFault> {
            Err(SourceFault::Ended { count: 3 })
        }
    }
    let mut capture = Capture::new(calibration(0), Keeping::All).unwrap();
    assert!(matches!(capture.poll(&mut Broken, Stamp::ZERO), Err(CaptureError::Source(_))));
    for every_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Capture::new(calibration(0), Keeping::Spaced { every_m }).is_err());
    }
}

#[test]
fn a_long_scan_remembers_only_its_last_seconds() {
    let mut capture = Capture::new(calibration(0), Keeping::All).unwrap();
    let images = (0..1500u32).map(|n| bscan(u64::from(n), 40.0 * f64::from(n), 500.0));
    let kept = run(&mut capture, &mut Machine(images.collect()), 60_600, truth);
    assert_eq!(kept.len(), 1500, "half a second late, and every one found its pose");
    assert!(capture.track.samples().len() <= 2002 && capture.wrenches.len() <= 2002);
}
