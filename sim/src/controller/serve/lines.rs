//! The connections that carry text: dashboard, scripts, and the primary interface's first message.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use super::Server;
use crate::controller::core::Controller;
use crate::controller::dashboard;
use crate::controller::scripts::Scripts;

/// Whoever listens reads within this.
const READS_WITHIN: Duration = Duration::from_millis(20);

/// The longest line of a client that is read.
const LONGEST_LINE: usize = 4096;

/// A dashboard connection.
pub(super) fn dashboard(server: &Arc<Server>, mut socket: TcpStream) {
    let id = server.keep(&socket);
    let mut unread = Vec::new();
    let mut bytes = [0; 2048];
    let mut open = writeln!(socket, "{}", dashboard::BANNER).is_ok();
    while open {
        let Ok(count @ 1..) = socket.read(&mut bytes) else { break };
        unread.extend(bytes.iter().take(count));
        while let Some(end) = unread.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = unread.drain(..=end).collect();
            let answer = dashboard::answer(&mut server.world().controller, &String::from_utf8_lossy(&line));
            server.came.notify_all();
            open = answer.is_some();
            let text = answer.unwrap_or_else(|| "Disconnected".into());
            if writeln!(socket, "{text}").is_err() || !open {
                open = false;
                break;
            }
        }
        if unread.len() > LONGEST_LINE {
            let _ = writeln!(socket, "could not understand: a line of more than {LONGEST_LINE} bytes");
            break;
        }
    }
    server.forget(id);
}

/// A connection to the primary or the secondary interface: it says its version first, and takes scripts.
pub(super) fn primary(server: &Arc<Server>, mut socket: TcpStream) {
    let message = version_message(&server.world().controller);
    if socket.write_all(&message).is_ok() {
        let number = listens(server, &socket);
        scripts(server, socket);
        server.world().listeners.remove(&number);
    }
}

/// From now on this connection hears what is said; one that does not read is dropped.
fn listens(server: &Arc<Server>, socket: &TcpStream) -> u64 {
    let mut world = server.world();
    world.next_client += 1;
    let number = world.next_client;
    if let Ok(listener) = socket.try_clone()
        && listener.set_write_timeout(Some(READS_WITHIN)).is_ok()
    {
        world.listeners.insert(number, listener);
    }
    number
}

/// An error message of the primary interface, as the official client library reads it.
pub(super) fn error_message(controller: &Controller, words: &str, level: i32) -> Vec<u8> {
    let fields: [i32; 5] = [0, 0, level, 0, 0];
    let fields: Vec<u8> = fields.iter().flat_map(|field| field.to_be_bytes()).collect();
    robot_message(controller, 0xfe, 6, &[&fields[..], words.as_bytes()].concat())
}

/// A message of the primary interface.
fn robot_message(controller: &Controller, source: u8, kind: u8, fields: &[u8]) -> Vec<u8> {
    let microseconds = (controller.now().seconds() * 1e6) as u64;
    let body = [&[20][..], &microseconds.to_be_bytes(), &[source, kind], fields].concat();
    let size = u32::try_from(body.len() + 4).unwrap_or(0);
    [&size.to_be_bytes()[..], &body[..]].concat()
}

/// A connection that takes scripts.
pub(super) fn scripts(server: &Arc<Server>, mut socket: TcpStream) {
    let id = server.keep(&socket);
    let mut scripts = Scripts::default();
    let mut bytes = [0; 8192];
    while let Ok(count @ 1..) = socket.read(&mut bytes) {
        let Some(bytes) = bytes.get(..count) else { break };
        scripts.hear(bytes).iter().for_each(|script| run(server, script));
    }
    if let Some(script) = scripts.end() {
        run(server, &script);
    }
    server.forget(id);
}

fn run(server: &Server, script: &[u8]) {
    let mut world = server.world();
    if !world.controller.upload(script) {
        let why = format!(
            "the script was not started: the simulated controller runs probepath's and ur_rtde's, powered and not \
             stopped; its safety mode is {}, its power {}",
            world.controller.robot.safety.name(),
            world.controller.robot.power.name()
        );
        world.tell(&why, 0);
    }
    drop(world);
    server.came.notify_all();
}

/// The primary interface's version message, which the official library waits for.
fn version_message(controller: &Controller) -> Vec<u8> {
    let version = controller.config.version;
    let mut body = vec![9];
    body.extend(b"URControl");
    body.extend([u8::try_from(version.major).unwrap_or(0), u8::try_from(version.minor).unwrap_or(0)]);
    body.extend(version.bugfix.to_be_bytes());
    body.extend(version.build.to_be_bytes());
    body.extend(b"01-01-2024, 00:00:00");
    robot_message(controller, 0xff, 3, &body)
}
