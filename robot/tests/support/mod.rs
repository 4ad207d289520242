//! A small UR controller of bytes for the driver's tests: it follows setpoints at once, and lies as it is told to.
//! (The one with physics behind it is the simulated cell's, two floors up.)

#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "it belongs to tests, which may stop at the first surprise, and a stall takes time"
)]

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use probepath_frames::{Flange, Pose, Probe};
use probepath_robot::drivers::ur::UrSettings;
use probepath_robot::drivers::ur::registers::{PROTOCOL, command, state};
use probepath_robot::drivers::ur::rtde::{
    ControllerVersion, Decoder, Level, Recipe, Reply, Request, Text, Value, Version, input_type, names,
    output_type,
};
use probepath_robot::drivers::ur::script::Parameters;
use probepath_robot::{Joints, Model};

/// Where the small controller lies, and what it does.
#[derive(Clone)]
pub struct Lies {
    pub version: [u32; 4],
    pub remote: bool,
    pub banner: &'static str,
    pub mode: i32,
    /// Replaces the types of a recipe's answer.
    pub outputs: Option<String>,
    pub inputs: Option<String>,
    /// What is sent in place of all RTDE.
    pub raw: Option<Vec<u8>>,
    /// The controller's base is not turned against the model's.
    pub unturned: bool,
    pub payload_factor: f64,
    pub protocol: i32,
    pub starts_scripts: bool,
    pub other_program: bool,
    pub force: [f64; 6],
    pub status_bits: u32,
    /// From this package of the script on: these safety bits.
    pub safety: Option<(u64, u32)>,
    /// At this package of the script, half of it is sent and the connection closed.
    pub cut_at: Option<u64>,
    /// At this package the stream stalls.
    pub stall_at: Option<u64>,
    /// These packages are not sent, and the clock goes on.
    pub skip: std::ops::Range<u64>,
    /// At these packages three more came late, and come together with them.
    pub burst: std::ops::Range<u64>,
    /// From this package on, no echo.
    pub deaf_at: Option<u64>,
    /// At this package the clock goes back.
    pub back_at: Option<u64>,
    /// At this package a joint is not a number.
    pub nan_at: Option<u64>,
    /// At this package, one of another length.
    pub short_at: Option<u64>,
    /// At this package the program ends.
    pub ends_at: Option<u64>,
    /// At this package the script says this of itself.
    pub says: Option<(u64, i32)>,
}

impl Default for Lies {
    fn default() -> Self {
        Self {
            version: [5, 12, 0, 1],
            remote: true,
            banner: "Connected: Universal Robots Dashboard Server",
            mode: 7,
            outputs: None,
            inputs: None,
            raw: None,
            unturned: false,
            payload_factor: 1.0,
            protocol: PROTOCOL,
            starts_scripts: true,
            other_program: false,
            force: [0.0; 6],
            status_bits: 3,
            safety: None,
            cut_at: None,
            stall_at: None,
            skip: 0..0,
            burst: 0..0,
            deaf_at: None,
            back_at: None,
            nan_at: None,
            short_at: None,
            ends_at: None,
            says: None,
        }
    }
}

/// What the controller is and was told.
#[derive(Clone, Debug, Default)]
pub struct Inside {
    pub script: Option<Parameters>,
    pub scripts: usize,
    pub asked: Vec<String>,
    pub orders: Vec<(i32, i32, [f64; 6])>,
    pub unlocked: bool,
    fresh: bool,
    runs: bool,
    packages: u64,
    tick: u64,
    at: [f64; 6],
    session: i32,
    state: i32,
    sequence: i32,
    zeroed: i32,
}

pub const START: [f64; 6] = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0];

pub struct Controller {
    pub host: String,
    pub inside: Arc<Mutex<Inside>>,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        for port in [30004, 30002, 29999] {
            let _ = TcpStream::connect((self.host.as_str(), port));
        }
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// An address of our own, so that tests run side by side.
pub fn host() -> String {
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    let (id, pid) = (NEXT.fetch_add(1, Ordering::SeqCst), std::process::id() as usize);
    format!("127.{}.{}.{}", 30 + id, pid / 250 % 250 + 1, pid % 250 + 1)
}

/// A probe straight on the flange, 180 mm long.
pub fn flange_from_probe() -> Pose<Flange, Probe> {
    // FRAMES: made up for the tests.
    Pose::assume(Isometry3::translation(0.0, 0.0, 0.18))
}

pub fn settings() -> UrSettings {
    let settings = UrSettings::new(Model::ur5e(), flange_from_probe(), 0.62, Vector3::new(0.001, 0.0, 0.07));
    // The tests share two cores with everything else.
    UrSettings { silence: probepath_frames::Span::from_milliseconds(1500), ..settings }
}

impl Controller {
    pub fn start(lies: Lies) -> Self {
        let (host, stop) = (host(), Arc::new(AtomicBool::new(false)));
        let inside = Arc::new(Mutex::new(Inside { tick: 21_000, at: START, ..Inside::default() }));
        let mut threads = Vec::new();
        for port in [30004_u16, 30002, 29999] {
            let listener = TcpListener::bind((host.as_str(), port)).unwrap();
            let (inside, stop, lies) = (inside.clone(), stop.clone(), lies.clone());
            threads.push(std::thread::spawn(move || {
                for stream in listener.incoming() {
                    if stop.load(Ordering::SeqCst) {
                        return;
                    }
                    let stream = stream.unwrap();
                    stream.set_nodelay(true).unwrap();
                    // A peer that goes away in the middle ends the connection, not the test.
                    let _ = match port {
                        30004 => rtde(stream, &inside, &lies, &stop),
                        30002 => script(stream, &inside, &lies),
                        _ => {
                            let (inside, lies) = (inside.clone(), lies.clone());
                            std::thread::spawn(move || dashboard(stream, &inside, &lies));
                            Ok(())
                        }
                    };
                }
            }));
        }
        Self { host, inside, stop, threads }
    }
}

fn script(mut stream: TcpStream, inside: &Mutex<Inside>, lies: &Lies) -> std::io::Result<()> {
    let (mut text, mut bytes) = (String::new(), [0; 4096]);
    while !text.ends_with("\nend\n") {
        match stream.read(&mut bytes)? {
            0 => return Ok(()),
            count => text += &String::from_utf8_lossy(&bytes[..count]),
        }
    }
    let mut inside = inside.lock().unwrap();
    inside.script = Parameters::read(&text);
    inside.scripts += 1;
    if lies.starts_scripts {
        (inside.runs, inside.fresh, inside.session, inside.state, inside.packages) =
            (true, true, 0, state::WAITING, 0);
    }
    Ok(())
}

fn dashboard(mut stream: TcpStream, inside: &Mutex<Inside>, lies: &Lies) -> std::io::Result<()> {
    stream.write_all(format!("{}\n", lies.banner).as_bytes())?;
    let (mut line, mut byte) = (String::new(), [0]);
    while stream.read(&mut byte)? == 1 {
        if byte != [b'\n'] {
            line.push(char::from(byte[0]));
            continue;
        }
        let mut inside = inside.lock().unwrap();
        inside.asked.push(line.clone());
        let stopped =
            lies.safety.is_some_and(|(_, bits)| bits & 4 != 0) && inside.packages > 0 && !inside.unlocked;
        let pressed = lies.safety.is_some_and(|(_, bits)| bits & (1 << 6) != 0) && inside.packages > 0;
        let answer = match line.as_str() {
            "is in remote control" => lies.remote.to_string(),
            "safetystatus" if stopped => "Safetystatus: PROTECTIVE_STOP".into(),
            "safetystatus" if pressed => "Safetystatus: ROBOT_EMERGENCY_STOP".into(),
            "safetystatus" => "Safetystatus: NORMAL".into(),
            // The first time it is too early, as on the real arm.
            "unlock protective stop" if inside.asked.iter().filter(|asked| **asked == line).count() < 2 => {
                "Cannot unlock protective stop until 5s after occurrence".into()
            }
            "unlock protective stop" => {
                // A protective stop has ended the program.
                (inside.unlocked, inside.runs) = (true, false);
                "Protective stop releasing".into()
            }
            "close safety popup" => "closing safety popup".into(),
            "stop" => {
                inside.runs = false;
                "Stopped".into()
            }
            "close popup" => "closing popup".into(),
            other if other.starts_with("popup ") => "showing popup".into(),
            other => format!("could not understand: '{other}'"),
        };
        stream.write_all(format!("{answer}\n").as_bytes())?;
        line.clear();
    }
    Ok(())
}

struct Session {
    outputs: Vec<String>,
    inputs: Option<Recipe>,
    started: bool,
    version: Version,
}

fn rtde(
    mut stream: TcpStream,
    inside: &Mutex<Inside>,
    lies: &Lies,
    stop: &AtomicBool,
) -> std::io::Result<()> {
    if let Some(raw) = &lies.raw {
        let mut bytes = [0; 64];
        let _ = stream.read(&mut bytes)?;
        return stream.write_all(raw);
    }
    stream.set_read_timeout(Some(Duration::from_millis(2)))?;
    let mut session = Session { outputs: Vec::new(), inputs: None, started: false, version: Version::V1 };
    let mut decoder = Decoder::new();
    while !stop.load(Ordering::SeqCst) {
        let mut data = 0;
        match stream.read(decoder.room()) {
            Ok(0) => return Ok(()),
            Ok(count) => decoder.filled(count),
            Err(error)
                if matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
        while let Some(frame) = decoder.next().unwrap() {
            let request = Request::read(frame, session.version).unwrap();
            data += u64::from(matches!(request, Request::Data { .. }));
            let reply = answer(&mut session, request, &mut inside.lock().unwrap(), lies);
            stream.write_all(&reply)?;
        }
        if !session.started {
            continue;
        }
        let (runs, fresh) = {
            let mut inside = inside.lock().unwrap();
            (inside.runs, std::mem::take(&mut inside.fresh))
        };
        // Our packages move its clock while a script runs; otherwise it repeats itself.
        for _ in 0..if runs { data + u64::from(fresh) } else { 1 } {
            if !package(&mut stream, &session, &mut inside.lock().unwrap(), lies)? {
                return Ok(());
            }
        }
    }
    Ok(())
}

fn answer(session: &mut Session, request: Request<'_>, inside: &mut Inside, lies: &Lies) -> Vec<u8> {
    let mut bytes = Vec::new();
    let (version, mut after) = (session.version, session.version);
    let types: String;
    let reply = match request {
        Request::ProtocolVersion(wanted) => {
            after = Version::V2;
            Reply::ProtocolVersion { accepted: wanted == 2 }
        }
        Request::ControllerVersion => {
            let [major, minor, bugfix, build] = lies.version;
            Reply::ControllerVersion(ControllerVersion { major, minor, bugfix, build })
        }
        Request::Outputs { names: asked, .. } => {
            // Words may come at any time.
            let text = Text { level: Level::Info, source: b"RTDE", message: b"hello" };
            Reply::Text(text).write(version, &mut bytes).unwrap();
            session.outputs = names(asked).map(str::to_owned).collect();
            types = lies.outputs.clone().unwrap_or_else(|| typed(asked, output_type));
            Reply::Outputs { recipe: 1, types: &types }
        }
        Request::Inputs { names: asked } => {
            session.inputs = Some(Recipe::new(1, names(asked).filter_map(input_type)));
            types = lies.inputs.clone().unwrap_or_else(|| typed(asked, input_type));
            Reply::Inputs { recipe: 1, types: &types }
        }
        Request::Data { fields, .. } => {
            told(session.inputs.as_ref().unwrap(), fields, inside);
            return bytes;
        }
        Request::Start => {
            session.started = true;
            Reply::Start { accepted: true }
        }
        Request::Pause => Reply::Pause { accepted: true },
        Request::Text(_) => return bytes,
    };
    reply.write(version, &mut bytes).unwrap();
    session.version = after;
    bytes
}

fn typed(asked: &str, type_of: impl Fn(&str) -> Option<probepath_robot::drivers::ur::rtde::Type>) -> String {
    let types: Vec<_> =
        names(asked).map(|name| type_of(name).map_or("NOT_FOUND", |kind| kind.name())).collect();
    types.join(",")
}

/// The script's tick.
fn told(inputs: &Recipe, fields: &[u8], inside: &mut Inside) {
    let values: Vec<Value> = inputs.values(fields).collect();
    let int = |i: usize| values[i].int32().unwrap();
    let setpoint = std::array::from_fn(|i| values[3 + i].double().unwrap());
    let (sequence, order, session) = (int(0), int(1), int(2));
    inside.orders.push((sequence, order, setpoint));
    if !inside.runs {
        return;
    }
    inside.sequence = sequence;
    match order {
        command::HELLO => (inside.session, inside.state) = (session, state::HOLDING),
        command::SERVO => (inside.at, inside.state) = (setpoint, state::SERVOING),
        command::FREEDRIVE => {
            inside.at[0] += 0.001;
            inside.state = state::FREEDRIVE;
        }
        command::ZERO => (inside.zeroed, inside.state) = (inside.zeroed + 1, state::HOLDING),
        _ => inside.state = state::HOLDING,
    }
}

/// Sends the package of the next tick; whether the connection goes on.
fn package(
    stream: &mut TcpStream,
    session: &Session,
    inside: &mut Inside,
    lies: &Lies,
) -> std::io::Result<bool> {
    let served = inside.runs && inside.session != 0;
    if served {
        inside.packages += 1;
    }
    let n = if served { inside.packages } else { 0 };
    inside.tick += 1;
    if lies.skip.contains(&n) {
        // As many again as were asked for, so that the clock goes on without a word.
        inside.tick += lies.skip.end - lies.skip.start;
        inside.packages += lies.skip.end - lies.skip.start;
    }
    let mut bytes = Vec::new();
    if lies.burst.contains(&n) {
        // What comes late comes together.
        for _ in 0..3 {
            put(&mut bytes, session, n, inside, lies);
            inside.tick += 1;
        }
    }
    let is = |at: Option<u64>| served && inside.scripts < 2 && at == Some(n);
    if is(lies.stall_at) {
        std::thread::sleep(Duration::from_millis(2500));
        return Ok(false);
    }
    if is(lies.ends_at) {
        inside.runs = false;
    }
    let mut fields = Vec::new();
    for name in &session.outputs {
        value(name, n, inside, lies).write(&mut fields);
    }
    if is(lies.short_at) {
        fields.pop();
    }
    Reply::Data { recipe: 1, fields: &fields }.write(Version::V2, &mut bytes).unwrap();
    if is(lies.cut_at) {
        stream.write_all(&bytes[..bytes.len() / 2])?;
        return Ok(false);
    }
    stream.write_all(&bytes)?;
    Ok(true)
}

fn put(bytes: &mut Vec<u8>, session: &Session, n: u64, inside: &Inside, lies: &Lies) {
    let mut fields = Vec::new();
    for name in &session.outputs {
        value(name, n, inside, lies).write(&mut fields);
    }
    Reply::Data { recipe: 1, fields: &fields }.write(Version::V2, bytes).unwrap();
}

fn value(name: &str, n: u64, inside: &Inside, lies: &Lies) -> Value {
    let since = |at: Option<u64>| inside.scripts < 2 && n > 0 && at.is_some_and(|at| n >= at);
    let mut at = inside.at;
    if since(lies.nan_at) {
        at[3] = f64::NAN;
    }
    let flange = *Model::ur5e().forward(&Joints::from_slice(&inside.at).unwrap()).isometry();
    let turn = if lies.unturned { 0.0 } else { std::f64::consts::PI };
    let flange = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, turn)) * flange;
    let (place, axis) = (flange.translation.vector, flange.rotation.scaled_axis());
    let payload =
        inside.script.map_or((0.0, Vector3::zeros()), |told| (told.mass_kg, told.centre_of_gravity_m));
    match name {
        "timestamp" => {
            let ticks = inside.tick as f64 - if since(lies.back_at) { 5000.0 } else { 0.0 };
            Value::Double(ticks * 0.002)
        }
        "actual_q" | "target_q" => Value::Vector6D(at),
        "actual_TCP_force" => Value::Vector6D(lies.force),
        "actual_TCP_pose" => Value::Vector6D([place.x, place.y, place.z, axis.x, axis.y, axis.z]),
        "payload" => Value::Double(payload.0 * lies.payload_factor),
        "payload_cog" => Value::Vector3D(payload.1.into()),
        "runtime_state" => Value::Uint32(if inside.runs || lies.other_program { 2 } else { 1 }),
        "robot_mode" => Value::Int32(lies.mode),
        "robot_status_bits" => Value::Uint32(lies.status_bits),
        "safety_status_bits" => Value::Uint32(match lies.safety {
            Some((from, bits)) if since(Some(from)) => bits,
            _ => 1,
        }),
        "speed_scaling" => Value::Double(1.0),
        "output_int_register_24" => Value::Int32(if inside.runs { lies.protocol } else { 0 }),
        "output_int_register_25" => Value::Int32(if since(lies.deaf_at) { 1 } else { inside.sequence }),
        "output_int_register_26" => Value::Int32(match lies.says {
            Some((from, says)) if since(Some(from)) => says,
            _ => inside.state,
        }),
        "output_int_register_27" => Value::Int32(inside.session),
        "output_int_register_28" => Value::Int32(inside.zeroed),
        other => output_type(other).unwrap().zero(),
    }
}
