//! RTDE connections, and what every tick sends them.

#![allow(
    clippy::disallowed_methods,
    reason = "a server in wall time is what the wall's clock is for; simulated time asks none"
)]

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::lines::error_message;
use super::outbox::{Letter, Outbox};
use super::pace::since;
use super::{Client, Server, World, spawn};
use crate::controller::session::{Heard, Session};

/// Serves one connection until it ends.
pub(super) fn serve(server: &Arc<Server>, mut socket: TcpStream) {
    let (id, outbox) = (server.keep(&socket), Arc::new(Outbox::default()));
    server.world().join(id, &outbox);
    let Ok(writing) = socket.try_clone() else { return server.leave(id) };
    let (writing_for, letters) = (server.clone(), outbox.clone());
    let writer = spawn("rtde-out", move || write(&writing_for, writing, &letters));
    let mut bytes = [0; 8192];
    while let Ok(count @ 1..) = socket.read(&mut bytes) {
        let Some(bytes) = bytes.get(..count) else { break };
        let heard = server.world().hear(id, bytes);
        if !heard.replies.is_empty() {
            outbox.put(Letter::answer(heard.replies, heard.close));
        }
        server.came.notify_all();
        if heard.close {
            break;
        }
    }
    server.leave(id);
    if let Ok(writer) = writer {
        let _ = writer.join();
    }
}

fn write(server: &Server, mut socket: TcpStream, outbox: &Outbox) {
    while let Some(letter) = outbox.take() {
        let sent = socket.write_all(&letter.bytes).is_ok();
        if let Some(due) = letter.of_tick.filter(|_| sent) {
            server.punctuality().left.record(since(due));
        }
        if !sent || letter.last {
            break;
        }
    }
    let _ = socket.shutdown(Shutdown::Both);
}

impl Server {
    /// A connection ended: what it held is free again.
    fn leave(&self, id: u64) {
        let mut world = self.world();
        world.owners.retain(|_, owner| *owner != id);
        if let Some(client) = world.clients.remove(&id) {
            // What is under way may still leave: the answer that says why it was closed, above all.
            client.outbox.put(Letter::answer(Vec::new(), true));
        }
        drop(world);
        self.forget(id);
        self.came.notify_all();
    }
}

impl World {
    fn join(&mut self, id: u64, outbox: &Arc<Outbox>) {
        let session = Session::new(id, self.controller.config.knobs.data_races_start);
        self.clients.insert(id, Client { session, outbox: outbox.clone() });
        self.controller.counters.rtde_clients += 1;
    }

    fn hear(&mut self, id: u64, bytes: &[u8]) -> Heard {
        let Some(client) = self.clients.get_mut(&id) else {
            return Heard { close: true, ..Heard::default() };
        };
        let heard = client.session.hear(bytes, &mut self.controller, &mut self.owners);
        for index in &heard.written {
            if let Some(pulses) = self.pulses.get_mut(*index) {
                *pulses += 1;
            }
        }
        heard
    }

    /// How often the input that paces the program was written, while its client is there and listens: one that has
    /// not said START yet would miss the package that it has to answer.
    pub(super) fn pulses(&self) -> Option<u64> {
        let index = self.controller.pulse()?;
        let owner = self.owners.get(&format!("input_int_register_{index}"))?;
        self.clients.get(owner).filter(|client| client.session.is_started())?;
        self.pulses.get(index).copied()
    }

    /// Sends everyone the package of this tick, which was due then in wall time.
    pub(super) fn send(&mut self, of_tick: Instant) {
        self.post(false, Some(of_tick));
    }

    /// The same in simulated time; with `anyway`, whether it is due or not.
    pub(super) fn send_in_step(&mut self, anyway: bool) {
        self.post(anyway, None);
    }

    fn post(&mut self, anyway: bool, of_tick: Option<Instant>) {
        let tick = self.controller.counters.ticks;
        let knobs = &self.controller.config.knobs;
        let has = |ticks: Option<crate::knobs::Ticks>| ticks.is_some_and(|ticks| ticks.has(tick));
        let lost = has(knobs.stalled) || has(knobs.skipped);
        let cut = knobs.cut_at_tick == Some(tick) && !anyway;
        let due = self.due();
        for client in self.clients.values() {
            let session = &client.session;
            let package =
                if anyway { session.anyway(&self.controller) } else { session.due(&self.controller) };
            let Some(mut bytes) = package else { continue };
            if lost && !cut {
                self.controller.counters.skipped += 1;
                continue;
            }
            if cut {
                bytes.truncate(bytes.len() / 2);
            }
            self.controller.counters.packages += 1;
            let fleeting = of_tick.is_some() && !cut;
            let letter = Letter { bytes, due, of_tick, fleeting, last: cut };
            self.controller.counters.skipped += client.outbox.put(letter);
        }
    }

    /// When this tick's packages leave: late by the knobs' latency and jitter.
    fn due(&mut self) -> Option<Instant> {
        let knobs = &self.controller.config.knobs;
        let most = knobs.jitter_ms;
        let late_ms = knobs.latency_ms + if most > 0.0 { self.jitter.uniform(0.0, most) } else { 0.0 };
        (late_ms > 0.0).then(|| Instant::now() + Duration::from_secs_f64(late_ms * 1e-3))
    }

    /// Tells every client something in words.
    pub(super) fn tell(&mut self, message: &str, level: u8) {
        // What is an error there is a violation here.
        let bytes = error_message(&self.controller, message, if level <= 1 { 3 } else { 1 });
        self.listeners.retain(|_, listener| listener.write_all(&bytes).is_ok());
        for client in self.clients.values() {
            let bytes = client.session.text(message, level);
            client.outbox.put(Letter::answer(bytes, false));
        }
    }
}
