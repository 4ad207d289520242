//! The connections that carry text: dashboard, scripts, and the primary interface's first message.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;

use super::Server;
use crate::controller::core::Controller;
use crate::controller::dashboard;
use crate::controller::scripts::Scripts;

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
        scripts(server, socket);
    }
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
    let microseconds = (controller.now().seconds() * 1e6) as u64;
    let mut body = vec![20];
    body.extend(microseconds.to_be_bytes());
    body.extend([0xff, 3, 9]);
    body.extend(b"URControl");
    body.extend([u8::try_from(version.major).unwrap_or(0), u8::try_from(version.minor).unwrap_or(0)]);
    body.extend(version.bugfix.to_be_bytes());
    body.extend(version.build.to_be_bytes());
    body.extend(b"01-01-2024, 00:00:00");
    let size = u32::try_from(body.len() + 4).unwrap_or(0);
    [&size.to_be_bytes()[..], &body[..]].concat()
}
