//! An exam file as strangers read it: PyPI's `mcap` with `mcap-protobuf-support`, and Rerun.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use probepath_frames::nalgebra::{Isometry3, Vector3};
use probepath_frames::{Frame, Point, Pose, Span, Stamp, Wrench};
use probepath_us_capture::exam::{
    Attachment, Event, ExamHeader, ExamWriter, Level, Pace, Row, Surface, TickRecord, Written,
};
use probepath_us_capture::{BScan, PixelSpacing, PlacedBScan, Setting};
use serde_json::{Value, json};

const TICKS: u64 = 2000;
const BSCANS: u64 = 60;

fn numbers(n: u64, phase: f64) -> [f64; 6] {
    std::array::from_fn(|joint| (n as f64 * 0.003 + phase + joint as f64).sin())
}

fn pose<A: Frame, B: Frame>(n: u64) -> Pose<A, B> {
    let t = n as f64 * 1e-4;
    // FRAMES: made up for the test.
    Pose::assume(Isometry3::new(Vector3::new(0.1, -0.05, t), Vector3::new(1.5, 0.1 * t, -0.2)))
}

fn tick(n: u64) -> TickRecord {
    let row = |phase| Row::from_slice(&numbers(n, phase)).unwrap();
    TickRecord {
        tick: n,
        stamp: Stamp::from_nanoseconds(2_000_000 * n as i64),
        command: Some(row(0.3)),
        position: row(0.0),
        velocity: row(0.1),
        commanded: row(0.2),
        wrench: Wrench::new(Vector3::new(0.25, -0.5, -5.0), Vector3::zeros()),
        guiding: n < 500,
        phase: "teach".into(),
        safety: "reduced".into(),
        overtaken: false,
        freedrive: false,
        age: Span::from_nanoseconds(7),
        world_from_probe: Some(pose(n)),
    }
}

fn bscan(n: u64) -> PlacedBScan {
    let setting = Setting {
        depth_m: 0.07,
        focus_m: 0.045,
        window_top_m: 0.02,
        window_height_m: 0.03,
        window_width_m: 0.04,
        spacing: PixelSpacing { x_m: 0.04 / 160.0, y_m: 0.03 / 120.0 },
    };
    let pixels: Vec<u8> = (0..160 * 120u64).map(|i| ((i * i + 7 * n * i) >> 6) as u8).collect();
    let formed = Stamp::from_nanoseconds(60_000_000 * n as i64 + 1);
    let stamps = (formed, formed + Span::from_milliseconds(80));
    PlacedBScan {
        bscan: BScan::new(n, stamps, setting, (160, 120), pixels).unwrap(),
        world_from_probe: pose(n),
        world_from_image: pose(n + 1),
        wrench: None,
    }
}

fn attachments() -> [Attachment; 3] {
    [
        Attachment::urdf("<robot name=\"six\"/>"),
        Attachment::protocol("scan(mm(120), newton(5));"),
        Attachment::report("<html>é</html>"),
    ]
}

fn header() -> ExamHeader {
    ExamHeader {
        software: "probepath 0.1.0".into(),
        study_code: "INTEROP-1".into(),
        protocol: "femoral".into(),
        protocol_sha256: ExamHeader::sha256("scan(mm(120), newton(5));"),
        calibration_id: "none".into(),
        seed: Some(1),
        joint_names: (1..=6).map(|joint| format!("joint_{joint}")).collect(),
        period: Span::from_milliseconds(2),
    }
}

fn write(path: &Path) -> Written {
    let writer = ExamWriter::create(path, &header(), Pace::Simulated).unwrap();
    let [urdf, protocol, report] = attachments();
    writer.attach(urdf);
    writer.attach(protocol);
    let begun =
        Event { stamp: Stamp::ZERO, level: Level::Info, source: "session".into(), text: "begun".into() };
    writer.event(begun);
    for n in 0..TICKS {
        writer.tick(tick(n));
        if n % 33 == 32 {
            writer.bscan(bscan(n / 33));
        }
    }
    let corners = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]];
    writer.surface(Surface {
        stamp: Stamp::from_nanoseconds(2_000_000 * TICKS as i64),
        name: "lumen".into(),
        vertices: corners.map(|[x, y, z]| Point::new(x, y, z)).into(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    });
    writer.attach(report);
    writer.finish().unwrap()
}

fn numbers_of<A: Frame, B: Frame>(pose: &Pose<A, B>) -> Vec<f64> {
    let (t, q) = (pose.isometry().translation.vector, pose.isometry().rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w].into()
}

/// What the file has to say, from the values that went in.
fn expected() -> Value {
    let sha256 = |bytes: &[u8]| ExamHeader::sha256(std::str::from_utf8(bytes).unwrap());
    let hashes: BTreeMap<String, String> = attachments()
        .into_iter()
        .map(|attachment| (attachment.name.clone(), sha256(&attachment.bytes)))
        .collect();
    let (tick, scan) = (tick(0), bscan(0));
    json!({
        "counts": {
            "/tick": TICKS, "/bscan": BSCANS, "/bscan/image": BSCANS, "/events": 1, "/tf": 200, "/bscan/tf": BSCANS,
            "/joint_states": 200, "/joint_commands": 200, "/wrench": 200, "/surface": 1,
        },
        "schemas": {
            "/tick": "probepath.Tick", "/bscan": "probepath.BScan", "/bscan/image": "foxglove.RawImage",
            "/events": "foxglove.Log", "/tf": "foxglove.FrameTransform", "/bscan/tf": "foxglove.FrameTransform", "/joint_states": "foxglove.JointStates",
            "/joint_commands": "foxglove.JointStates", "/wrench": "probepath.Wrench",
            "/surface": "foxglove.SceneUpdate",
        },
        "attachments": hashes,
        "study_code": "INTEROP-1",
        "joint_names": header().joint_names,
        "tick": {
            "tick": 0, "stamp_ns": 0, "stay": false, "guiding": true, "phase": "teach",
            "safety": "reduced", "freedrive": false, "age_ns": 7,
            "command": numbers(0, 0.3), "position": numbers(0, 0.0), "velocity": numbers(0, 0.1),
            "commanded": numbers(0, 0.2), "force_n": [0.25, -0.5, -5.0],
            "world_from_probe": numbers_of(tick.world_from_probe.as_ref().unwrap()),
        },
        "bscan": {
            "number": 0, "formed_ns": 1, "arrived_ns": 80_000_001, "width": 160, "height": 120,
            "depth_m": 0.07, "spacing_x_m": 0.04 / 160.0, "spacing_y_m": 0.03 / 120.0,
            "world_from_image": numbers_of(&scan.world_from_image),
            "pixels_sha256": sha256_of(scan.bscan.pixels()),
        },
    })
}

fn sha256_of(bytes: &[u8]) -> String {
    use sha2::{Digest, Sha256};
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn python_and_rerun_read_an_exam_by_its_own_schemas() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (exam, wanted) = (folder.join("interop.mcap"), folder.join("interop.json"));
    let written = write(&exam);
    assert_eq!((written.ticks, written.bscans, written.attachments), (TICKS, BSCANS, 3));
    std::fs::write(&wanted, expected().to_string()).unwrap();
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!(
            "skipped: PROBEPATH_PYTHON names no Python with mcap-protobuf-support (tests/run installs one)"
        );
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/interop/exam_mcap.py");
    let done = Command::new(python).arg(script).arg(&exam).arg(&wanted).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    eprintln!("{said}");
}
