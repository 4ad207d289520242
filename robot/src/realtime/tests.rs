#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at the first surprise")]

use std::cell::RefCell;
use std::collections::VecDeque;

use probepath_frames::{HostClock, Span, Stamp, Wrench};

use super::tape::tape;
use super::*;
use crate::*;

const PERIOD: Span = Span::from_milliseconds(2);

/// Does what it is told at once; skips a tick now and then, or says two at once.
struct Ideal {
    state: State,
    skips: Vec<u64>,
    bursts: Vec<u64>,
    older: Vec<State>,
}

fn ideal() -> Ideal {
    let zeros = Joints::zeros(6);
    let state = State {
        tick: 0,
        stamp: Stamp::ZERO,
        position: zeros,
        velocity: zeros,
        commanded: zeros,
        wrench: Wrench::zero(),
        guiding: false,
        safety: Default::default(),
        age: Span::ZERO,
    };
    Ideal { state, skips: Vec::new(), bursts: Vec::new(), older: Vec::new() }
}

impl Arm for Ideal {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        if let Command::Position(q) = command {
            (self.state.position, self.state.commanded) = (*q, *q);
        }
        self.older.clear();
        if self.bursts.contains(&self.state.tick) {
            self.state.tick += 1;
            self.state.stamp = self.state.stamp + PERIOD;
            self.older.push(self.state);
        }
        let ticks = 1 + u64::from(self.skips.contains(&self.state.tick));
        self.state.tick += ticks;
        for _ in 0..ticks {
            self.state.stamp = self.state.stamp + PERIOD;
        }
        Ok(self.state)
    }

    fn overtaken(&self) -> &[State] {
        &self.older
    }

    fn period(&self) -> Span {
        PERIOD
    }

    fn joints(&self) -> usize {
        6
    }
}

fn guard() -> Guard {
    let limits = MotionLimits {
        lower: Joints::splat(6, -3.0),
        upper: Joints::splat(6, 3.0),
        velocity: Joints::splat(6, 1.0),
        acceleration: Joints::splat(6, 5.0),
        jerk: Joints::splat(6, 100.0),
    };
    Guard::new(GuardLimits::default(), limits).unwrap()
}

fn there() -> PointToPoint {
    PointToPoint::plan(&Joints::zeros(6), &Joints::splat(6, 0.3), guard().motion_limits(), PERIOD).unwrap()
}

#[test]
fn a_motion_apart_is_the_same_motion_tick_for_tick() {
    let (mut here, mut apart) = (Vec::new(), Vec::new());
    let mut watch = |tick: &Tick| {
        here.push(*tick);
        Wish::GoOn
    };
    let alone = run(&mut ideal(), &mut there(), &mut guard(), &mut watch).unwrap();
    let mut timings = Timings::default();
    let mut marks = 0..;
    let mut marked = Vec::new();
    let mut watch = |tick: &Tick, mark: Option<i32>| {
        apart.push(*tick);
        marked.extend(mark);
        Wish::GoOn
    };
    let road =
        run_apart(&mut ideal(), &mut there(), &mut guard(), &mut timings, move || marks.next(), &mut watch);
    assert_eq!(road.done.unwrap(), alone);
    assert_eq!(road.lost + apart.len() as u64, alone.ticks);
    if road.lost == 0 {
        assert_eq!(apart, here);
        assert!(marked.windows(2).all(|pair| pair[1] == pair[0] + 1));
    }
    assert_eq!(timings.ticks, alone.ticks);
    assert_eq!(timings.step.count(), alone.ticks - 1);
}

#[test]
fn the_watchers_stop_reaches_the_loop_with_its_reason() {
    let mut watch = |_: &Tick, (): ()| Wish::Stop("enough".into());
    let mut endless = Hold::ticks(u64::MAX);
    let road =
        run_apart(&mut ideal(), &mut endless, &mut guard(), &mut Timings::default(), || (), &mut watch);
    assert_eq!(road.done.unwrap().ending, Ending::Observer("enough".into()));
}

/// An arm that panics in motion.
struct Broken(Ideal);

impl Arm for Broken {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        assert!(self.0.state.tick < 20, "out of gears");
        self.0.exchange(command)
    }

    fn period(&self) -> Span {
        PERIOD
    }

    fn joints(&self) -> usize {
        6
    }
}

#[test]
fn a_panic_on_the_control_thread_is_an_error_in_words() {
    let mut watch = |_: &Tick, (): ()| Wish::GoOn;
    let mut broken = Broken(ideal());
    let road = run_apart(&mut broken, &mut there(), &mut guard(), &mut Timings::default(), || (), &mut watch);
    let error = road.done.unwrap_err();
    assert!(error.to_string().contains("out of gears"), "{error}");
    assert!(!error.at_rest);
}

#[test]
fn a_reader_that_is_gone_stops_the_arm() {
    let (mut writer, reader) = tape(8, || ());
    let tick = Tick::staying(0, ideal().state);
    assert_eq!(writer.tick(&tick), Wish::GoOn);
    drop(reader);
    assert_eq!(writer.tick(&tick), Wish::Stop(String::new()));
}

#[test]
fn what_finds_no_room_on_the_tape_is_counted() {
    let (mut writer, mut reader) = tape(8, || ());
    for index in 0..20 {
        writer.tick(&Tick::staying(index, ideal().state));
    }
    let taken: Vec<u64> = std::iter::from_fn(|| reader.take()).map(|(tick, ())| tick.index).collect();
    assert_eq!(taken, (0..8).collect::<Vec<_>>());
    assert_eq!(reader.lost(), 12);
    assert!(!reader.has_ended());
    drop(writer);
    assert!(reader.has_ended());
}

#[test]
fn what_comes_together_is_watched_in_order_and_plays_back() {
    let bursts = vec![40, 41, 90];
    let (mut rows, mut timings) = (Vec::new(), Timings::default());
    let mut watch = |tick: &Tick, (): ()| {
        rows.push(Row { command: tick.command, state: tick.state, overtaken: tick.overtaken });
        Wish::GoOn
    };
    let mut arm = Ideal { bursts, ..ideal() };
    let road = run_apart(&mut arm, &mut there(), &mut guard(), &mut timings, || (), &mut watch);
    let live = road.done.unwrap();
    // The tick of 41 was overtaken itself.
    assert_eq!((timings.overtaken, timings.skipped, road.lost), (2, 0, 0));
    assert_eq!(timings.lateness.count(), timings.ticks + timings.overtaken - 1);
    assert!(rows.windows(2).all(|pair| pair[1].state.tick == pair[0].state.tick + 1), "none is missing");
    assert_eq!(rows.iter().filter(|row| row.overtaken).count(), 2);
    let mut again = Vec::new();
    let mut watch = |tick: &Tick| {
        again.push(tick.state);
        Wish::GoOn
    };
    let mut recorded = RecordedArm::new(rows.iter().copied(), PERIOD, 6);
    assert_eq!(run(&mut recorded, &mut there(), &mut guard(), &mut watch).unwrap(), live);
    assert_eq!(again, rows.iter().map(|row| row.state).collect::<Vec<_>>());
}

/// Instants one after another, as a test says.
struct Given(RefCell<VecDeque<i64>>);

impl Clock for Given {
    fn now(&self) -> Stamp<HostClock> {
        Stamp::from_nanoseconds(1000 * self.0.borrow_mut().pop_front().unwrap())
    }
}

#[test]
fn lateness_step_and_round_trip_are_what_the_clock_says() {
    let mut timings = Timings::default();
    // Sent and here (us), exchange by exchange. The third state is 300 us late, the fourth one of the arm's is skipped.
    let instants = [0, 1900, 1950, 3900, 4000, 6200, 6210, 9900, 9930, 11900];
    let mut arm = Ideal { skips: vec![3], ..ideal() };
    let mut timed = Timed::new(&mut arm, Given(RefCell::new(instants.into())), &mut timings);
    for _ in 0..5 {
        timed.exchange(&Command::Stay).unwrap();
    }
    let us = |histogram: &Histogram, share| histogram.within(share).unwrap().nanoseconds() / 1000;
    assert_eq!((timings.ticks, timings.skipped), (5, 1));
    assert_eq!(us(&timings.lateness, 1.0), 299, "300, less what the clocks may have drifted");
    assert_eq!(us(&timings.lateness, 0.5), 0);
    assert_eq!(us(&timings.step, 1.0), 100);
    assert_eq!(us(&timings.round_trip, 1.0), 3690);
    assert_eq!(timings.step.count() + 1, timings.round_trip.count());
}
