//! The control thread on the road of hardware touches no heap: the driver's exchange, its timing, the controller, the
//! limits, the guard, and the tape that carries every tick out of it, while another thread reads it.

mod support;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use probepath_robot::drivers::ur::UrArm;
use probepath_robot::realtime::tape::tape;
use probepath_robot::realtime::{Monotonic, Timed, Timings};
use probepath_robot::*;
use support::{Controller, Lies, settings};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn a_motion_on_the_wire_with_its_tape_touches_no_heap() {
    let controller = Controller::start(Lies::default());
    let mut arm = UrArm::connect(&controller.host, settings()).unwrap();
    let start = arm.exchange(&Command::Stay).unwrap().commanded;
    let model = Model::ur5e();
    let limits = MotionLimits::of_model(&model, Joints::splat(6, 5.0), Joints::splat(6, 100.0)).unwrap();
    let target = start.map(|q| q + 0.05);
    let mut there = PointToPoint::plan(&start, &target, &limits, arm.period()).unwrap();
    // What the small controller's stream does between two looks is not what is tested here.
    let lenient =
        GuardLimits { heartbeat: probepath_frames::Span::from_milliseconds(80), ..GuardLimits::default() };
    let mut guard = Guard::new(lenient, limits).unwrap();
    let mut timings = Timings::default();
    let (mut writer, mut reader) = tape(4096, || "replay");
    let read = std::thread::scope(|scope| {
        let reading = scope.spawn(move || {
            let mut read = 0;
            while !reader.has_ended() {
                read += std::iter::from_fn(|| reader.take()).filter(|(_, phase)| *phase == "replay").count();
                std::thread::yield_now();
            }
            read as u64 + reader.lost()
        });
        let finished = assert_no_alloc(|| {
            let mut timed = Timed::new(&mut arm, Monotonic::new(), &mut timings);
            run(&mut timed, &mut there, &mut guard, &mut writer)
        });
        drop(writer);
        assert_eq!(finished.unwrap().ending, Ending::Done);
        reading.join().unwrap()
    });
    assert_eq!(read, timings.ticks);
    assert!(timings.ticks > 100 && timings.round_trip.count() == timings.ticks, "{}", timings.figures());
}
