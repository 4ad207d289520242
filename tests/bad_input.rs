//! Bad input of every kind gets a clear error that says what to do, leaves the arm at rest and what was recorded
//! readable.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use probepath_robot::Operator;
use probepath_scripts::{ScanRequest, offline};
use probepath_us_capture::exam::{Ending, Exam};

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
        match offline::reconstruct(&cut, None, false, &out.join("made"), &()) {
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
