//! Bad input of every kind gets a clear error that says what to do, leaves the arm at rest and what was recorded
//! readable.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

#[path = "common/drawn.rs"]
mod drawn;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drawn::Drawn;
use probepath_robot::Operator;
use probepath_scripts::offline::calibrate::{PhantomToReference, PixelMm, SpatialRequest, SubjectRequest};
use probepath_scripts::{ScanRequest, offline};
use probepath_us_capture::exam::{Ending, Exam};
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::sequence::{Sequence, SequenceImage};

const TEACH: &str = "let path = teach(#{ study: \"BAD-1\", side: \"left\" });\n";

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-bad-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// Runs a protocol in a cell; what went wrong, in words.
fn failed(out: &Path, cell: &str, protocol: &str) -> String {
    let files = [("bad.rhai", protocol), ("cell.toml", cell)].map(|(name, text)| {
        fs::write(out.join(name), text).unwrap();
        Some(out.join(name))
    });
    let [protocol, cell] = files;
    let request = ScanRequest { protocol, cell, seed: 5, out: out.to_owned(), date: None };
    request.run(&Operator::new(), Arc::new(())).map(|report| report.to_string()).unwrap_err().to_string()
}

const SHORT_HAND: &str = "[simulated.hand]\nlength_mm = 40.0\n";

#[test]
fn a_force_above_the_limit_is_refused_at_its_line_and_nothing_is_scanned() {
    let out = folder("force");
    let text = failed(&out, SHORT_HAND, &format!("{TEACH}scan(path, #{{ force: newton(40) }});"));
    assert!(
        text.contains("bad.rhai:2:1") && text.contains("force is 40 N") && text.contains("between 1 and 8 N"),
        "{text}"
    );
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    assert!(exam.ticks.iter().all(|tick| tick.phase == "teach"));
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_path_through_the_table_is_refused_before_anything_moves() {
    let out = folder("table");
    // A table as high as the leg: the taught path lies below it, less the guard of the taught hand.
    let teach = out.join("teach");
    fs::create_dir_all(&teach).unwrap();
    let saved = "path.save(\"taught.path.toml\");";
    let text = failed(&teach, SHORT_HAND, &format!("{TEACH}{saved} throw \"taught\";"));
    assert!(text.contains("taught"), "{text}");
    let path = teach.join("taught.path.toml");
    let load = format!("let path = load_path({:?});\nscan(path);", path.display().to_string());
    let text = failed(&out, "above_table_mm = 250.0\n", &load);
    assert!(text.contains("bad.rhai:2:1") && text.contains("nothing was moved"), "{text}");
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    let first = exam.ticks.first().unwrap().commanded;
    assert!(exam.ticks.iter().all(|tick| tick.commanded == first));
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_cell_file_with_a_wrong_field_is_refused_with_its_line() {
    let out = folder("cell");
    let text = failed(&out, "name = \"x\"\n[force]\nsoft = 3\n", TEACH);
    assert!(text.contains("cell.toml") && text.contains("soft") && text.contains("line 3"), "{text}");
    let text = failed(&out, "[limits]\njerk_rad_s3 = nan\n", TEACH);
    assert!(text.contains("jerk_rad_s3") && text.contains("positive"), "{text}");
    let text = failed(&out, "[simulated.skin]\nsoftest_n_mm = -1.0\n", TEACH);
    assert!(text.contains("softest_n_mm"), "{text}");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn whatever_fails_on_the_way_the_exam_ends_readable_and_the_reason_is_said() {
    let faults = [
        ("[simulated.knobs.arm]\nprotective_stop_at_tick = 3000\n", "arm"),
        ("[simulated.knobs.arm]\nconnection_lost_at_tick = 3000\n", "connection"),
        ("[simulated.knobs.arm]\nwrench_not_a_number = { from_tick = 3000, count = 5 }\n", "wrench"),
        ("[simulated.knobs.machine]\nconnection_lost_at_s = 12.0\n", "machine"),
    ];
    for (knob, word) in faults {
        let out = folder(&format!("fault-{word}"));
        let text = failed(&out, &format!("{SHORT_HAND}{knob}"), &format!("{TEACH}scan(path);"));
        assert!(text.to_lowercase().contains(word), "{knob}: {text}");
        assert!(text.contains("are kept in"), "{text}");
        let exam = Exam::open(&out.join("exam.mcap")).unwrap();
        assert_eq!(exam.ending, Ending::Complete);
        assert!(exam.ticks.len() > 1000, "{knob}: {} ticks", exam.ticks.len());
        fs::remove_dir_all(out).unwrap();
    }
}

#[test]
fn too_much_force_stops_the_scan_and_lifts_the_probe_off() {
    let out = folder("force-hard");
    // Hard limit a hair above the soft one, on skin so stiff and bumpy that no law holds it.
    let cell = format!(
        "{SHORT_HAND}[simulated.skin]\nsoftest_n_mm = 9.0\nhardest_n_mm = 12.0\n[force]\nsoft_n = 6.0\nhard_n = 6.5\n"
    );
    let text = failed(&out, &cell, &format!("{TEACH}scan(path);"));
    assert!(text.contains("N") && text.contains("force"), "{text}");
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    let last = exam.ticks.last().unwrap();
    assert_eq!(last.phase, "lift", "{text}");
    assert!(last.wrench.force.z.abs() < 1.0, "{last:?}");
    fs::remove_dir_all(out).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_the_arm_and_is_named() {
    let out = folder("full");
    std::os::unix::fs::symlink("/dev/full", out.join("exam.mcap")).unwrap();
    let text = failed(&out, SHORT_HAND, TEACH);
    assert!(text.contains("exam"), "{text}");
    assert!(text.to_lowercase().contains("space"), "{text}");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn an_exam_cut_anywhere_is_reconstructed_as_far_as_it_goes_or_refused_in_words() {
    let out = folder("cut");
    let protocol = format!("{TEACH}report(reconstruct(scan(path.trim(mm(5), mm(20)))));");
    fs::write(out.join("short.rhai"), &protocol).unwrap();
    fs::write(out.join("cell.toml"), SHORT_HAND).unwrap();
    let request = ScanRequest {
        protocol: Some(out.join("short.rhai")),
        cell: Some(out.join("cell.toml")),
        seed: 5,
        out: out.clone(),
        date: None,
    };
    request.run(&Operator::new(), Arc::new(())).unwrap();
    let whole = fs::read(out.join("exam.mcap")).unwrap();
    let cut = out.join("cut.mcap");
    let (mut made, mut refused) = (0, 0);
    for eighth in 0..8 {
        fs::write(&cut, &whole[..whole.len() * eighth / 8]).unwrap();
        let wish =
            offline::ReconstructWish { input: cut.clone(), out: out.join("made"), ..Default::default() };
        match offline::reconstruct(&wish, &()) {
            Ok(found) => {
                assert!(found.notes.iter().any(|note| note.contains("does not end")), "{found}");
                made += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
    }
    assert!(made > 0 && refused > 0, "{made} made, {refused} refused");
    fs::remove_dir_all(out).unwrap();
}

/// What `calibrate spatial` says of a drawn sequence, after `spoil` had its way with it.
fn not_calibrated(name: &str, drawn: &Drawn, images: usize, spoil: impl Fn(&mut SequenceImage)) -> String {
    let out = folder(name);
    let mut sequence = Sequence::new(drawn.size.0, drawn.size.1);
    for image in drawn.sequence(images, 0.0).images() {
        let mut image = image.clone();
        spoil(&mut image);
        sequence.push(image).unwrap();
    }
    let path = out.join("images.igs.mha");
    sequence.write(&path).unwrap();
    let request = SpatialRequest {
        sequence: path,
        subject: SubjectRequest { phantom: "fcal-1.2".into(), ..SubjectRequest::default() },
        pixel_mm: Some(PixelMm { x: 0.13, y: 0.12 }),
        phantom_to_reference: Some(PhantomToReference(drawn.phantom_to_reference())),
        nominal: Some(nominal(&out, drawn)),
        ..SpatialRequest::default()
    };
    let said =
        offline::calibrate::spatial(&request, &()).map(|found| found.to_string()).unwrap_err().to_string();
    fs::remove_dir_all(out).unwrap();
    said
}

/// What is known of the probe: a configuration of PLUS with an earlier calibration.
fn nominal(out: &Path, drawn: &Drawn) -> PathBuf {
    let file = out.join("nominal.xml");
    let matrix: Vec<String> = drawn.image_to_probe().transpose().iter().map(f64::to_string).collect();
    let transform = format!("<Transform From=\"Image\" To=\"Probe\" Matrix=\"{}\"/>", matrix.join(" "));
    fs::write(&file, format!("<P><CoordinateDefinitions>{transform}</CoordinateDefinitions></P>")).unwrap();
    file
}

fn fcal() -> Drawn {
    Drawn::over(WirePhantom::shipped("fcal-1.2").unwrap())
}

#[test]
fn two_images_are_too_few_for_a_calibration() {
    let said = not_calibrated("few", &fcal(), 2, |_| {});
    assert!(said.contains("images") && said.contains("needed"), "{said}");
}

#[test]
fn images_that_are_all_refused_say_why() {
    let said = not_calibrated("black", &fcal(), 12, |image| {
        image.pixels = Some(vec![3; 480 * 400].into());
    });
    assert!(said.contains("dot was found") && said.contains("images.igs.mha"), "{said}");
}

#[test]
fn a_probe_that_does_not_move_is_no_calibration() {
    let still = Drawn { travel_m: 0.0, tilt_rad: 0.0, ..fcal() };
    let said = not_calibrated("still", &still, 12, |_| {});
    assert!(said.contains("move") || said.contains("turn") || said.contains("tilt"), "{said}");
}

#[test]
fn images_whose_poses_are_missing_are_said() {
    let said = not_calibrated("poses", &fcal(), 12, |image| image.transforms.clear());
    assert!(said.contains("no transform at all") && said.contains("--poses"), "{said}");
}

#[test]
fn a_mirrored_image_is_refused() {
    // Images alone cannot tell it from one that is seen from behind: what is known of the probe can.
    let said = not_calibrated("mirrored", &fcal(), 20, |image| {
        let mut pixels = image.pixels.clone().unwrap().to_vec();
        pixels.chunks_exact_mut(480).for_each(<[u8]>::reverse);
        image.pixels = Some(pixels.into());
    });
    assert!(said.contains("mirrored"), "{said}");
}

#[test]
fn another_phantom_is_not_taken_for_the_one_that_was_named() {
    let other = Drawn::over(WirePhantom::shipped("fcal-2.0").unwrap());
    let said = not_calibrated("other", &other, 20, |_| {});
    assert!(said.contains("phantom"), "{said}");
}

#[test]
fn a_phantom_that_cannot_be_one_is_refused_at_its_line() {
    let out = folder("phantom");
    let others = "  { name = \"b\", front_mm = [5.0, 0.0, 0.0], back_mm = [25.0, 40.0, 0.0] },\n  { name = \"c\", front_mm = \
                  [30.0, 0.0, 0.0], back_mm = [30.0, 40.0, 0.0] },\n";
    let wire = |line: &str| format!("name = \"x\"\nwire = [\n  {line}\n{others}]\n");
    let cases = [
        (wire("{ name = \"a\", front_mm = [0.0, 0.0, 0.0], back_mm = [0.0, 0.0, 0.0] },"), "long"),
        (
            wire("{ name = \"a\", front_mm = [0.0, 0.0, 0.0], back_mm = [0.0, 40.0, 0.0], gauge = 1 },"),
            "gauge",
        ),
        (wire("{ name = \"a\", front = [0.0, 0.0, 0.0], back_mm = [0.0, 40.0, 0.0] },"), "front"),
    ];
    for (text, word) in cases {
        let file = out.join("phantom.toml");
        fs::write(&file, &text).unwrap();
        let subject = SubjectRequest { phantom: file.display().to_string(), ..SubjectRequest::default() };
        let request = SpatialRequest { subject, ..SpatialRequest::default() };
        let said = offline::calibrate::spatial(&request, &()).unwrap_err().to_string();
        assert!(said.contains("phantom.toml") && said.contains(word) && said.contains("line"), "{said}");
    }
    let subject = SubjectRequest { phantom: "fcal-9".into(), ..SubjectRequest::default() };
    let request = SpatialRequest { subject, ..SpatialRequest::default() };
    let said = offline::calibrate::spatial(&request, &()).unwrap_err().to_string();
    assert!(said.contains("fcal-9") && said.contains("fcal-1.2"), "{said}");
    fs::remove_dir_all(out).unwrap();
}
