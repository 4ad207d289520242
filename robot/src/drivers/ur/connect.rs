//! How a connection comes about, each step refused in words: the controller's version, its dashboard, the recipes, the
//! arm's readiness, the model against the controller, our script, the handshake, the payload.

use std::time::Duration;

use nalgebra::Vector3;

use super::dashboard::Dashboard;
use super::link::{Link, Order, PATIENCE};
use super::measured::Measured;
use super::registers::{PROTOCOL, command, state};
use super::rtde::ControllerVersion;
use super::socket::Socket;
use super::{UrError, UrSettings, clock, safety, signs};
use crate::Joints;

/// Scripts are taken here.
const SCRIPTS: u16 = 30002;

/// How long a controller may take for one step.
const STEP: Duration = Duration::from_secs(5);

/// How long the first package may take until we speak first.
const KICKED_AFTER: Duration = Duration::from_millis(300);

/// How long a person's unlocking may take to show: a real controller refuses it in the first 5 s.
const UNLOCKED_IN: Duration = Duration::from_secs(8);

/// What the payload may differ by: rounding on the way (kg, m).
const SAME_KG: f64 = 1e-3;
const SAME_M: f64 = 1e-4;

/// What was found out while connecting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connected {
    /// The controller's version.
    pub version: ControllerVersion,
    /// How far our model's flange is from where the controller says it is (m).
    pub model_off_m: f64,
    /// The same as an angle (rad).
    pub model_off_rad: f64,
    /// The speed slider on the pendant, 0 to 1: below 1 the arm cannot follow at full speed.
    pub speed_scaling: f64,
}

/// A connection whose script waits for its first command.
pub(super) struct Established {
    pub(super) link: Link,
    pub(super) dashboard: Dashboard,
    pub(super) last: Measured,
    pub(super) sequence: i32,
    pub(super) session: i32,
    pub(super) report: Connected,
}

/// Everything, from the first byte.
pub(super) fn establish(host: &str, settings: &UrSettings) -> Result<Established, UrError> {
    settings.check()?;
    let mut link = Link::open(host)?;
    let version = supported(link.version())?;
    let mut dashboard = Dashboard::connect(host)?;
    if !dashboard.is_in_remote_control()? {
        return Err(UrError::LocalControl);
    }
    link.agree()?;
    link.wait_at_most(KICKED_AFTER)?;
    let first = ready(&mut link)?;
    link.wait_at_most(PATIENCE)?;
    let (model_off_m, model_off_rad) = agrees(&first, settings)?;
    let sequence = first.sequence.wrapping_add(1).max(1);
    make_room(&mut link, &mut dashboard, &first, sequence)?;
    upload(&mut link, host, settings)?;
    // Whatever was served before, another number is a new handshake.
    let session = first.session.wrapping_add(1).max(1);
    let (last, sequence) = shake_hands(&mut link, sequence.wrapping_add(1).max(1), session)?;
    carries(&last, settings)?;
    link.wait_at_most(settings.patience())?;
    let report = Connected { version, model_off_m, model_off_rad, speed_scaling: last.speed_scaling };
    Ok(Established { link, dashboard, last, sequence, session, report })
}

/// The controllers that this was made for.
fn supported(found: ControllerVersion) -> Result<ControllerVersion, UrError> {
    let why = match (found.major, found.minor) {
        (5, 10..) => return Ok(found),
        (5, _) => "freedrive of single axes came with 5.10; update PolyScope",
        (0..=3, _) => "this is a CB3 or older; an e-series with PolyScope 5.10 or later is needed",
        (10, _) => {
            "this is PolyScope X, which this software was not tried with; 5.10 or later of PolyScope 5 is needed"
        }
        _ => "this software knows PolyScope 5, from 5.10",
    };
    Err(UrError::Version { found, why })
}

/// The first package of an arm that may move. Right after an unlocking it may take some packages to show.
fn ready(link: &mut Link) -> Result<Measured, UrError> {
    let began = clock::now();
    loop {
        let first = first_package(link)?;
        let why = match safety::fault(first.safety_bits, 0) {
            Some(fault) => fault.to_string(),
            None if first.mode != safety::RUNNING => {
                format!("it is {}; switch it on at the pendant", safety::mode_words(first.mode))
            }
            None if !is_finite(&first) => "it measures what is not finite".into(),
            None => return Ok(first),
        };
        if began.elapsed() > Duration::from_secs(2) {
            return Err(UrError::NotReady { why });
        }
    }
}

/// The next package. A controller whose clock our packages move, and on which a script of ours still runs, waits for
/// us.
fn first_package(link: &mut Link) -> Result<Measured, UrError> {
    match link.receive(KICKED_AFTER) {
        Err(UrError::Silent { .. }) => {
            link.wait_at_most(PATIENCE)?;
            link.send(&order(0, command::STAY, 0))?;
            Ok(link.receive(PATIENCE)?.newest)
        }
        received => Ok(received?.newest),
    }
}

fn is_finite(measured: &Measured) -> bool {
    let pose = measured.position.iter().chain(&measured.target).chain(&measured.tcp_pose);
    pose.chain(&measured.tcp_offset).chain([&measured.timestamp_s]).all(|x| x.is_finite())
}

/// Our model's flange against the controller's: how far apart (m, rad).
fn agrees(measured: &Measured, settings: &UrSettings) -> Result<(f64, f64), UrError> {
    let joints = Joints::from_slice(&measured.position).unwrap_or(Joints::zeros(6));
    let ours = settings.model.forward(&joints);
    let theirs = signs::base_from_flange(&measured.tcp_pose, &measured.tcp_offset);
    let (off_m, off_rad) = theirs.distance(&ours);
    // Written so that NaN is refused too.
    if off_m <= settings.model_within_m && off_rad <= settings.model_within_rad {
        return Ok((off_m, off_rad));
    }
    let turned = |place: Vector3<f64>| [-place.x * 1e3, -place.y * 1e3, place.z * 1e3];
    let (ours_at, theirs_at) = (ours.origin().vector(), theirs.origin().vector());
    let mirrored = Vector3::new(-theirs_at.x, -theirs_at.y, theirs_at.z);
    let hint = if (mirrored - ours_at).norm() <= settings.model_within_m {
        "the model's base is the controller's; it has to be the URDF's base_link, turned by 180 degrees about z"
    } else if off_m <= settings.model_within_m {
        "the place is right and the orientation is not: does the model end at tool0?"
    } else {
        "is it the model of this arm, with a tip at its flange?"
    };
    Err(UrError::ModelDisagrees {
        theirs_mm: turned(theirs_at),
        ours_mm: turned(ours_at),
        off_mm: off_m * 1e3,
        off_degrees: off_rad.to_degrees(),
        tolerated_mm: settings.model_within_m * 1e3,
        tolerated_degrees: settings.model_within_rad.to_degrees(),
        hint,
    })
}

/// Ends a script of ours that a lost host left behind; another's program is not ours to end.
fn make_room(
    link: &mut Link,
    dashboard: &mut Dashboard,
    first: &Measured,
    sequence: i32,
) -> Result<(), UrError> {
    // Stopped, or stopping.
    if first.runtime <= 1 {
        return Ok(());
    }
    if first.runtime == safety::PLAYING && !echoes(link, sequence)? {
        return Err(UrError::OtherProgram);
    }
    dashboard.wants("stop", "stopped")?;
    let began = clock::now();
    while link.receive(PATIENCE)?.newest.runtime != 1 {
        if began.elapsed() > STEP {
            return Err(UrError::NotReady { why: "the program that runs does not stop".into() });
        }
    }
    Ok(())
}

/// Whether what runs echoes our sequence numbers, as our script does.
fn echoes(link: &mut Link, sequence: i32) -> Result<bool, UrError> {
    link.send(&order(sequence, command::STAY, 0))?;
    for _ in 0..50 {
        let measured = link.receive(PATIENCE)?.newest;
        if measured.sequence == sequence && measured.protocol != 0 {
            return Ok(true);
        }
        if measured.runtime != safety::PLAYING {
            return Ok(true);
        }
    }
    Ok(false)
}

const fn order(sequence: i32, command: i32, session: i32) -> Order {
    Order { sequence, command, session, setpoint: [0.0; 6] }
}

/// Sends the script, and waits until it says that it waits. Nothing is sent meanwhile: a controller whose clock our
/// packages move would otherwise be some ticks ahead, at random.
fn upload(link: &mut Link, host: &str, settings: &UrSettings) -> Result<(), UrError> {
    let mut socket = Socket::open(host, SCRIPTS, "script port", PATIENCE)?;
    socket.write(settings.parameters().text().as_bytes(), "sending our script")?;
    let began = clock::now();
    loop {
        let measured = link.receive(PATIENCE)?.newest;
        let plays = measured.runtime == safety::PLAYING;
        if plays && (measured.state, measured.session) == (state::WAITING, 0) {
            return match measured.protocol {
                PROTOCOL => Ok(()),
                found => Err(UrError::Protocol { found, expected: PROTOCOL }),
            };
        }
        if let Some(fault) = safety::fault(measured.safety_bits, 0) {
            return Err(UrError::Arm(fault));
        }
        if began.elapsed() > STEP {
            return Err(did_not_start(link, &measured, began.elapsed()));
        }
    }
}

fn did_not_start(link: &Link, measured: &Measured, waited: Duration) -> UrError {
    let said = match link.said() {
        words if words.is_empty() => String::new(),
        words => format!("; it said: {words}"),
    };
    UrError::ScriptDidNotStart {
        waited,
        runtime: safety::runtime_words(measured.runtime),
        script: state::words(measured.state),
        said,
    }
}

/// Says hello until the script serves us; the last package, and the sequence number that was sent last.
fn shake_hands(link: &mut Link, first: i32, session: i32) -> Result<(Measured, i32), UrError> {
    let (mut sequence, began) = (first, clock::now());
    loop {
        link.send(&order(sequence, command::HELLO, session))?;
        let measured = link.receive(PATIENCE)?.newest;
        if measured.session == session && measured.state == state::HOLDING {
            return Ok((measured, sequence));
        }
        if let Some(fault) = safety::fault(measured.safety_bits, 0) {
            return Err(UrError::Arm(fault));
        }
        if began.elapsed() > STEP {
            return Err(did_not_start(link, &measured, began.elapsed()));
        }
        sequence = sequence.wrapping_add(1).max(1);
    }
}

/// That the controller has the payload that our script told it, and its TCP at the flange.
fn carries(measured: &Measured, settings: &UrSettings) -> Result<(), UrError> {
    let told = settings.centre_of_gravity_m;
    let found = Vector3::from(measured.centre_m);
    let kg_off = (measured.payload_kg - settings.payload_kg).abs();
    if !(kg_off <= SAME_KG && (found - told).norm() <= SAME_M) {
        return Err(UrError::Payload {
            told_kg: settings.payload_kg,
            told_mm: (told * 1e3).into(),
            found_kg: measured.payload_kg,
            found_mm: (found * 1e3).into(),
        });
    }
    if measured.tcp_offset.iter().any(|x| x.abs() > SAME_M) {
        let why =
            format!("the controller's TCP is not at the flange but at {:?} (m, rad)", measured.tcp_offset);
        return Err(UrError::NotReady { why });
    }
    Ok(())
}

/// Unlocks a protective stop on a person's word. What a person has to do at the arm itself is said, not done.
pub(super) fn release(host: &str) -> Result<(), UrError> {
    let mut dashboard = Dashboard::connect(host)?;
    let began = clock::now();
    loop {
        let status = dashboard.safety_status()?;
        let why = match status.as_str() {
            "NORMAL" | "REDUCED" => break,
            "PROTECTIVE_STOP" => format!("it does not unlock: {}", dashboard.ask("unlock protective stop")?),
            "SAFEGUARD_STOP" | "AUTOMATIC_MODE_SAFEGUARD_STOP" | "SYSTEM_THREE_POSITION_ENABLING_STOP" => {
                "a safeguard holds it: close the gate, or hold the enabling switch".into()
            }
            "ROBOT_EMERGENCY_STOP" | "SYSTEM_EMERGENCY_STOP" => {
                "an emergency stop is pressed: release it, and switch the arm on at the pendant".into()
            }
            other => format!("its safety system says {other}: clear it at the pendant"),
        };
        if status != "PROTECTIVE_STOP" || began.elapsed() > UNLOCKED_IN {
            return Err(UrError::NotReady { why });
        }
        clock::wait(Duration::from_millis(100));
    }
    dashboard.wants("close safety popup", "closing safety popup")
}
