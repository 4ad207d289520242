//! Every trip trips, in the middle of a scan, and the arm comes to rest.

use probepath_frames::Span;
use probepath_robot::{Safety, State, StopReason, Trip};

use super::here::{Scene, Spoil};
use crate::validate::bench::Folder;
use crate::validate::{Goal, ValidateError};

/// A fault, and what the guard has to call it.
struct Fault {
    name: &'static str,
    spoil: Spoil,
    is: fn(&Trip) -> bool,
    /// To rest within (ms): the brake, and how long it takes to be sure.
    within_ms: f64,
}

const FAULTS: [Fault; 13] = [
    Fault {
        name: "a wrench of NaN",
        spoil: |s, _| s.wrench.force.x = f64::NAN,
        is: |t| matches!(t, Trip::ImplausibleWrench { .. }),
        within_ms: 100.0,
    },
    Fault {
        name: "a wrench beyond any sensor",
        spoil: |s, _| s.wrench.torque.y = 50.0,
        is: |t| matches!(t, Trip::ImplausibleWrench { .. }),
        within_ms: 100.0,
    },
    Fault {
        name: "a state of NaN",
        spoil: |s, _| s.position[2] = f64::NAN,
        is: |t| matches!(t, Trip::ImplausibleState),
        within_ms: 100.0,
    },
    Fault {
        name: "a joint's measured position jumps",
        spoil: |s, _| s.position[1] += 0.1,
        is: |t| matches!(t, Trip::Jump { joint: 1, .. } | Trip::Following { joint: 1, .. }),
        within_ms: 100.0,
    },
    Fault {
        name: "a joint far from its command",
        spoil: |s, n| s.position[3] += 0.01 * (n as f64).min(30.0),
        is: |t| matches!(t, Trip::Following { joint: 3, .. }),
        within_ms: 150.0,
    },
    Fault {
        name: "a joint too fast",
        spoil: |s, _| s.velocity[0] = 9.0,
        is: |t| matches!(t, Trip::JointVelocity { joint: 0, .. }),
        within_ms: 100.0,
    },
    Fault {
        name: "a joint outside its range",
        spoil: |s, n| s.position[4] += 0.018 * n as f64,
        is: |t| matches!(t, Trip::JointPosition { joint: 4, .. } | Trip::Following { joint: 4, .. }),
        within_ms: 150.0,
    },
    Fault {
        name: "ticks missed",
        spoil: missed,
        is: |t| matches!(t, Trip::LateTick { .. }),
        within_ms: 150.0,
    },
    Fault {
        name: "data 15 ms old",
        spoil: |s, _| s.age = Span::from_milliseconds(15),
        is: |t| matches!(t, Trip::OldData { .. }),
        within_ms: 100.0,
    },
    Fault {
        name: "a sensor that hangs",
        spoil: |s, _| {
            s.wrench.force.x = 0.1;
            s.wrench.force.y = 0.2;
            s.wrench.force.z = -5.0;
            s.wrench.torque *= 0.0;
        },
        is: |t| matches!(t, Trip::FrozenSensor { .. }),
        within_ms: 250.0,
    },
    Fault {
        name: "12 N along the skin",
        spoil: |s, _| s.wrench.force.x += 12.0,
        is: |t| matches!(t, Trip::Sideways { .. } | Trip::Force { .. }),
        within_ms: 250.0,
    },
    Fault {
        name: "pressure on the face's edge",
        spoil: |s, _| s.wrench.torque.y += 0.11,
        is: |t| matches!(t, Trip::Pressure { .. }),
        within_ms: 300.0,
    },
    Fault {
        name: "a protective stop",
        spoil: |s, _| s.safety = Safety::ProtectiveStop,
        is: |t| matches!(t, Trip::StoppedItself { .. }),
        within_ms: 100.0,
    },
];

/// Twenty ticks whose states never came.
fn missed(state: &mut State, _: u64) {
    state.tick += 20;
    state.stamp = state.stamp + Span::from_milliseconds(40);
}

/// One row a fault; one that trips otherwise, or not at all, is no number and meets no bound.
pub(super) fn rows(seeds: u64) -> Result<Vec<Goal>, ValidateError> {
    let folder = Folder::new("safety-faults")?;
    let mut rows = Vec::new();
    for fault in &FAULTS {
        let mut rest = Vec::new();
        for seed in 1..=seeds {
            let wrong = |source| ValidateError::Session { seed, source };
            let ended = Scene::new(seed, folder.path())
                .and_then(|scene| scene.until(Some(fault.spoil)))
                .map_err(wrong)?;
            let tripped = ended.fault.as_ref().is_some_and(|error| match &error.reason {
                StopReason::Guard(trip) => (fault.is)(trip),
                _ => false,
            });
            rest.push(if tripped { ended.rest_ms } else { f64::NAN });
        }
        rows.push(Goal::of(
            format!("{}: trips, to rest, ms", fault.name),
            &rest,
            Some(fault.within_ms),
            None,
        ));
    }
    Ok(rows)
}
