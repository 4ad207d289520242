//! What makes the clock go: the machine's clock, or the client's packages.

#![allow(
    clippy::disallowed_methods,
    reason = "a server in wall time is what the wall's clock is for; simulated time asks none"
)]

use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use probepath_frames::Span;
use probepath_robot::realtime::{Rank, take_rank};

use super::{Server, World};
use crate::controller::Time;

/// A tick in wall time.
const TICK: Duration = Duration::from_millis(2);
/// While simulated time stands still, what is known is said again this often, so that nobody who listens waits for ever.
const AGAIN: Duration = Duration::from_millis(5);

/// How late it is.
pub(super) fn since(due: Instant) -> Span {
    let late = Instant::now().saturating_duration_since(due);
    Span::from_nanoseconds(i64::try_from(late.as_nanos()).unwrap_or(i64::MAX))
}

/// Ticks until everything stops.
pub(super) fn run(server: &Arc<Server>) {
    let time = server.world().controller.config.time;
    match time {
        Time::Wall => wall(server),
        Time::Simulated => simulated(server),
    }
}

/// 500 Hz, and never a burst: a tick that comes late moves all later ones.
fn wall(server: &Server) {
    server.ranked(take_rank(Rank::Controller));
    let mut next = Instant::now();
    while !server.is_stopping() {
        server.punctuality().begun.record(since(next));
        {
            let mut world = server.world();
            world.tick();
            world.send(next);
        }
        next += TICK;
        let now = Instant::now();
        if next > now {
            std::thread::sleep(next - now);
        } else if now - next > TICK {
            server.world().controller.counters.slips += 1;
            next = now;
        }
    }
}

/// A tick for each package of the client whose program runs. Without one, ticks go on while something moves.
fn simulated(server: &Server) {
    let mut seen = None;
    while !server.is_stopping() {
        let mut world = server.world();
        match world.pulses() {
            // A program that its client has not been shown yet goes ahead once.
            Some(pulses) if seen.is_none_or(|seen| pulses != seen) => {
                world.tick();
                seen = Some(world.pulses().unwrap_or(pulses));
                world.send_in_step(false);
            }
            Some(_) => {
                let waited = server.came.wait_timeout(world, AGAIN);
                drop(waited.unwrap_or_else(PoisonError::into_inner));
            }
            // The client is gone: time goes on by itself until the arm rests and no watchdog is waited for.
            None if world.controller.is_unsettled() => {
                seen = None;
                world.tick();
                world.send_in_step(false);
            }
            None => {
                seen = None;
                world.send_in_step(true);
                let waited = server.came.wait_timeout(world, AGAIN);
                drop(waited.unwrap_or_else(PoisonError::into_inner));
            }
        }
    }
}

impl World {
    /// One tick, and what it has to say.
    fn tick(&mut self) {
        let before = (self.controller.robot.safety, self.controller.program_name());
        self.controller.tick();
        let now = (self.controller.robot.safety, self.controller.program_name());
        if now.0 != before.0 && !now.0.moves() {
            let why = format!("{}: {}", now.0.name(), self.controller.robot.why);
            self.tell(&why, 1);
        } else if before.1.is_some() && now.1.is_none() {
            let why = format!("the program ended: {}", self.controller.ended);
            self.tell(&why, 3);
        }
    }
}
