//! [`SimulatedMachine`]: the ultrasound machine of the simulated cell.

use std::collections::VecDeque;
use std::sync::Arc;

use probepath_frames::{Image, Pose, Span, Stamp, World};
use probepath_us_capture::{BScan, BScanSource, Setting, SourceFault};
use rayon::prelude::*;

use crate::cell::{CellConfig, Shared, Truth};
use crate::knobs::{Interval, MachineKnobs};
use crate::random::Stream;
use crate::ultrasound::settings::{COLUMNS, ROWS};
use crate::ultrasound::{Contact, ImagingError, Renderer};

/// B-scans that are drawn at once when one is asked for: those behind it are wanted next.
const AHEAD: usize = 4;

/// One connection to the simulated ultrasound machine: B-scans of where the probe truly is, evenly in time, numbered,
/// each arriving a constant latency after its echoes.
///
/// `formed` is the stamp that a machine can give: the arrival less the latency in the cell file. Nothing is drawn
/// before it is asked for, so B-scans that nobody polls cost nothing; see [`Self::drop_until`].
pub struct SimulatedMachine {
    renderer: Arc<Renderer>,
    scene: Shared,
    truth: Truth,
    setting: Setting,
    knobs: MachineKnobs,
    seed: u64,
    period: Span,
    first: Stamp,
    stated_latency: Span,
    next: u64,
    drawn: VecDeque<BScan>,
}

/// A B-scan that was formed and not drawn yet.
#[derive(Clone, Copy, Debug)]
struct Formed {
    number: u64,
    arrived: Stamp,
    /// The number whose picture it shows: its own, unless the machine is frozen.
    shows: u64,
    world_from_image: Pose<World, Image>,
    contact: Contact,
}

impl SimulatedMachine {
    pub(crate) fn new(
        scene: Shared,
        truth: Truth,
        renderer: Arc<Renderer>,
        config: &CellConfig,
        seed: u64,
    ) -> Self {
        let period = Span::from_seconds(1.0 / config.machine.rate_hz);
        // Its clock runs on its own: B-scans fall between ticks.
        let phase = Stream::new(seed, "machine phase").uniform(0.0, period.seconds());
        let mut machine = Self {
            setting: config.machine.setting(),
            knobs: config.knobs.machine.clone(),
            stated_latency: Span::from_seconds(config.machine.latency_ms * 1e-3),
            seed,
            period,
            first: Stamp::ZERO + Span::from_seconds(phase),
            next: 0,
            drawn: VecDeque::new(),
            scene,
            truth,
            renderer,
        };
        let now = machine.scene.lock().now();
        while machine.formed_at(machine.next) < now {
            machine.next += 1;
        }
        machine
    }

    /// How it is set.
    pub const fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Lets go of the B-scans that have arrived by `now` without drawing them; gives how many there were.
    pub fn drop_until(&mut self, now: Stamp) -> usize {
        let before = self.drawn.len();
        self.drawn.retain(|bscan| bscan.arrived > now);
        let mut dropped = before - self.drawn.len();
        while self.arrival(self.next) <= now && self.formed_at(self.next) <= self.scene.lock().now() {
            dropped += usize::from(self.arrives(self.next));
            self.next += 1;
        }
        dropped
    }

    /// How many B-scans have arrived by `now` and were not polled.
    pub fn waiting(&self, now: Stamp) -> usize {
        let drawn = self.drawn.iter().filter(|bscan| bscan.arrived <= now).count();
        let latest = now.min(self.scene.lock().now() + self.truth.image_latency());
        let undrawn =
            (self.next..).take_while(|n| self.arrival(*n) <= latest).filter(|n| self.arrives(*n)).count();
        drawn + undrawn
    }

    fn formed_at(&self, number: u64) -> Stamp {
        let nanoseconds = i64::try_from(number).unwrap_or(i64::MAX).saturating_mul(self.period.nanoseconds());
        self.first + Span::from_nanoseconds(nanoseconds)
    }

    fn arrival(&self, number: u64) -> Stamp {
        self.formed_at(number) + self.truth.image_latency()
    }

    /// Whether it ever arrives: each number's fate is its own, whoever polls and when.
    fn arrives(&self, number: u64) -> bool {
        let formed_s = self.formed_at(number).seconds();
        let stalled = self.knobs.stall.is_some_and(|stall| stall.has(formed_s));
        let lost = self.lost_at().is_some_and(|lost| self.arrival(number) >= lost);
        let fate =
            Stream::new(self.seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15), "dropped").uniform(0.0, 1.0);
        !stalled && !lost && fate >= self.knobs.dropped
    }

    fn lost_at(&self) -> Option<Stamp> {
        self.knobs.connection_lost_at_s.map(|s| Stamp::ZERO + Span::from_seconds(s))
    }

    /// The number whose picture `number` shows.
    fn shows(&self, number: u64) -> u64 {
        let within = |frozen: Interval, n: u64| frozen.has(self.formed_at(n).seconds());
        let Some(frozen) = self.knobs.frozen.filter(|frozen| within(*frozen, number)) else { return number };
        (0..=number).rev().find(|n| !within(frozen, *n)).unwrap_or(0)
    }

    /// The next B-scans that were formed by now, at most `count`, of which the first has arrived by `now`.
    fn formed(&mut self, now: Stamp, count: usize) -> Vec<Formed> {
        let mut formed = Vec::new();
        while formed.len() < count && (!formed.is_empty() || self.arrival(self.next) <= now) {
            let number = self.next;
            let shows = self.shows(number);
            let scene = self.scene.lock();
            if self.formed_at(number) > scene.now() {
                break;
            }
            let pose = scene.leg_from_probe(self.formed_at(shows)).filter(|_| self.arrives(number));
            let around = scene.surroundings();
            drop(scene);
            self.next += 1;
            let Some(world_from_probe) = pose else { continue };
            let contact = around.touched(&world_from_probe);
            let world_from_image = world_from_probe * self.truth.probe_from_image(&self.setting);
            let (arrived, contact) = (self.arrival(number), self.contact(contact));
            formed.push(Formed { number, arrived, shows, world_from_image, contact });
        }
        formed
    }

    /// What touches, as the picture's row counts it: from the first column.
    fn contact(&self, touched: Option<(f64, f64)>) -> Contact {
        let half = self.setting.window_width_m / 2.0;
        match touched {
            None => Contact::None,
            Some((from, to)) if from <= -half && to >= half => Contact::Full,
            Some((from, to)) => Contact::Between { from_m: from + half, to_m: to + half },
        }
    }

    fn draw(&self, formed: &Formed) -> Result<BScan, SourceFault> {
        let stamps = (formed.arrived - self.stated_latency, formed.arrived);
        let broken = |why: String| SourceFault::ConnectionLost { at: formed.arrived, why };
        let pixels = self.picture(formed).map_err(|error| broken(error.to_string()))?;
        BScan::new(formed.number, stamps, self.setting, (COLUMNS, ROWS), pixels)
            .map_err(|error| broken(error.to_string()))
    }

    fn picture(&self, formed: &Formed) -> Result<Vec<u8>, ImagingError> {
        let tissue = self.truth.subject();
        self.renderer.render(tissue, &formed.world_from_image, &self.setting, formed.contact, formed.shows)
    }
}

impl BScanSource for SimulatedMachine {
    fn skip(&mut self, now: Stamp) -> Result<(), SourceFault> {
        self.drop_until(now);
        Ok(())
    }

    fn poll(&mut self, now: Stamp) -> Result<Option<BScan>, SourceFault> {
        if self.drawn.is_empty() {
            let formed = self.formed(now, AHEAD);
            let drawn: Result<Vec<_>, _> = formed.par_iter().map(|formed| self.draw(formed)).collect();
            self.drawn = drawn?.into();
        }
        if self.drawn.front().is_some_and(|bscan| bscan.arrived <= now) {
            return Ok(self.drawn.pop_front());
        }
        match self.lost_at() {
            Some(at) if now >= at => {
                Err(SourceFault::ConnectionLost { at, why: "the machine was switched off (knob)".into() })
            }
            _ => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests;
