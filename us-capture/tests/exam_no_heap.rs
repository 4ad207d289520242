//! Recording a tick touches no heap on the caller's thread.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use probepath_frames::nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Span, Stamp, Wrench};
use probepath_us_capture::exam::{ExamHeader, ExamWriter, Pace, Row, TickRecord};

#[global_allocator]
static HEAP: AllocDisabler = AllocDisabler;

fn tick(n: i64) -> TickRecord {
    let row = Row::from_slice(&[0.1; 6]).unwrap();
    TickRecord {
        tick: n.unsigned_abs(),
        stamp: Stamp::from_nanoseconds(2_000_000 * n),
        command: Some(row),
        position: row,
        velocity: row,
        commanded: row,
        wrench: Wrench::new(Vector3::new(0.0, 0.0, -5.0), Vector3::zeros()),
        guiding: false,
        phase: "replay".into(),
        safety: "".into(),
        overtaken: false,
        freedrive: false,
        age: Span::ZERO,
        // FRAMES: made up for the test.
        world_from_probe: Some(Pose::assume(Isometry3::identity())),
    }
}

#[test]
fn recording_a_tick_touches_no_heap() {
    let header = ExamHeader {
        software: "test".into(),
        study_code: "HEAP".into(),
        protocol: "none".into(),
        protocol_sha256: ExamHeader::sha256(""),
        calibration_id: "none".into(),
        seed: None,
        joint_names: Vec::new(),
        period: Span::from_milliseconds(2),
    };
    let writer = ExamWriter::new(std::io::sink(), &header, Pace::RealTime).unwrap();
    for n in 0..3000 {
        assert_no_alloc(|| {
            writer.tick(tick(n));
            assert!(writer.fault().is_none() && writer.lost().bscans == 0);
        });
    }
    let lost = writer.lost();
    assert_eq!(writer.finish().unwrap().ticks + lost.ticks, 3000);
}
