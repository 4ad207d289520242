//! The dashboard server's lines: power, brakes, protective stops, popups, programs.

use super::core::{Controller, Runtime};
use super::robot::safety::{Power, Safety};

/// What it says to a client that connects.
pub(super) const BANNER: &str = "Connected: Universal Robots Dashboard Server";
/// The robot's serial number: digits, as clients insist.
const SERIAL: &str = "20265500001";

/// The answer to a line, without its end; `None` says goodbye.
pub(super) fn answer(controller: &mut Controller, line: &str) -> Option<String> {
    controller.wait_out();
    let line = line.trim();
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    Some(match (word, rest.trim()) {
        ("quit" | "exit", _) => return None,
        ("popup", text) => {
            controller.show(text);
            "showing popup".into()
        }
        ("load", file) => load(controller, file),
        ("addToLog", _) => "Added log message".into(),
        ("setUserRole", role) => format!("Setting user role: {role}"),
        ("set", rest) if rest.starts_with("operational mode") => "Setting operational mode".into(),
        ("clear", "operational mode") => "No longer controlling the operational mode".into(),
        _ => says(controller, line)
            .or_else(|| power(controller, line))
            .or_else(|| program(controller, line))
            .unwrap_or_else(|| {
                format!("could not understand: '{}'", line.chars().take(100).collect::<String>())
            }),
    })
}

/// What is asked and changes nothing.
fn says(c: &Controller, line: &str) -> Option<String> {
    let v = c.config.version;
    Some(match line {
        "PolyscopeVersion" => {
            format!("URSoftware {}.{}.{}.{} (simulated)", v.major, v.minor, v.bugfix, v.build)
        }
        "version" => format!("{}.{}.{}.{}", v.major, v.minor, v.bugfix, v.build),
        "get serial number" => SERIAL.into(),
        "get robot model" => "UR5".into(),
        "is in remote control" => "true".into(),
        "get operational mode" => "NONE".into(),
        "getUserRole" => "PROGRAMMER".into(),
        "robotmode" => format!("Robotmode: {}", c.robot.power.name()),
        "safetymode" => format!("Safetymode: {}", c.robot.safety.name()),
        "safetystatus" => format!("Safetystatus: {}", c.robot.safety.name()),
        "running" => format!("Program running: {}", c.runtime == Runtime::Playing),
        "programState" => {
            let name = c.program_name().or(c.loaded.as_deref()).unwrap_or("<unnamed>");
            let state = match c.runtime {
                Runtime::Stopped => "STOPPED",
                Runtime::Playing => "PLAYING",
                Runtime::Paused => "PAUSED",
            };
            format!("{state} {name}")
        }
        "get loaded program" => {
            c.loaded.as_ref().map_or("No program loaded".into(), |name| format!("Loaded program: {name}"))
        }
        "isProgramSaved" => "true <unnamed>".into(),
        _ => return None,
    })
}

/// Power, brakes, stops.
fn power(c: &mut Controller, line: &str) -> Option<String> {
    Some(match line {
        "power on" => {
            if c.robot.safety == Safety::EmergencyStop {
                return Some("Emergency stop is pressed: power on is not possible".into());
            }
            if c.robot.power == Power::Off {
                c.robot.power = Power::Idle;
            }
            "Powering on".into()
        }
        "power off" => {
            c.stop("power off");
            c.robot.power = Power::Off;
            "Powering off".into()
        }
        "brake release" => {
            if c.robot.safety == Safety::EmergencyStop {
                return Some("Emergency stop is pressed: the brakes stay closed".into());
            }
            c.robot.power = Power::Running;
            "Brake releasing".into()
        }
        "unlock protective stop" => {
            if c.unlock() {
                "Protective stop releasing".into()
            } else {
                "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop \
                 before unlocking"
                    .into()
            }
        }
        "close safety popup" => "closing safety popup".into(),
        "close popup" => {
            c.popup = None;
            "closing popup".into()
        }
        "restart safety" => {
            c.stop("safety restarted");
            c.robot.power = Power::Off;
            "Restarting safety".into()
        }
        "shutdown" => "Shutting down".into(),
        _ => return None,
    })
}

/// Programs. None on the pendant can be run: there is no interpreter.
fn program(c: &mut Controller, line: &str) -> Option<String> {
    Some(match line {
        "play" if c.play() => "Starting program".into(),
        "play" => "Failed to execute: play".into(),
        "stop" => {
            c.stop("stopped at the dashboard");
            "Stopped".into()
        }
        "pause" if c.runtime == Runtime::Playing => {
            c.pause();
            "Pausing program".into()
        }
        "pause" => "Failed to execute: pause".into(),
        _ => return None,
    })
}

fn load(c: &mut Controller, file: &str) -> String {
    let name: String = file.chars().take(200).collect();
    if !name.ends_with(".urp") {
        return format!("File not found: {name}");
    }
    c.loaded = Some(name.clone());
    format!("Loading program: {name}")
}
