//! Over sockets, as a client meets it. What is judged is what the client reads, by the controller's clock.

#![allow(
    clippy::disallowed_methods,
    reason = "a client in wall time, with deadlines that a loaded machine keeps"
)]

use std::io::{Read, Write};
use std::net::{IpAddr, Ipv4Addr, TcpStream};
use std::time::{Duration, Instant};

use probepath_robot::drivers::ur::registers::{self, command};
use probepath_robot::drivers::ur::rtde::{Decoder, Reply, Version};

use super::own::GIVEN;
use super::*;
use crate::controller::session::package;
use crate::controller::{ControllerServer, Ports, Running, Time};
use crate::knobs::Ticks;

/// A loopback address of this test alone.
fn host(test: u8) -> IpAddr {
    let pid = std::process::id();
    IpAddr::V4(Ipv4Addr::new(127, 40 + test, (pid / 250 % 250 + 1) as u8, (pid % 250 + 1) as u8))
}

fn serve(test: u8, time: Time, knobs: WireKnobs) -> Running {
    let cell = SimulatedCell::new(&CellConfig::default(), 1).unwrap();
    let config = ControllerConfig { host: host(test), time, knobs, ..ControllerConfig::default() };
    ControllerServer::start(cell, config).unwrap()
}

/// A client that reads `timestamp`, `control_step`, `actual_q` and the script's state.
struct Client {
    socket: TcpStream,
    decoder: Decoder,
}

/// What it read of one package.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    seconds: f64,
    step: u64,
    state: i32,
    q: Vec<f64>,
}

impl Client {
    fn connect(running: &Running) -> Self {
        let socket = TcpStream::connect((running.host(), Ports::RTDE)).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut client = Self { socket, decoder: Decoder::new() };
        client.send(b'V', &[0, 2]);
        assert_eq!(client.reply(b'V'), [1]);
        let names = b"timestamp,control_step,output_int_register_26,actual_q";
        client.send(b'O', &[&500.0_f64.to_be_bytes()[..], names].concat());
        assert_eq!(client.reply(b'O')[0], 1);
        client
    }

    fn start(running: &Running) -> Self {
        let mut client = Self::connect(running);
        client.send(b'S', &[]);
        client
    }

    fn send(&mut self, kind: u8, payload: &[u8]) {
        self.socket.write_all(&package(kind, payload)).unwrap();
    }

    /// The next frame, if the connection gives one.
    fn frame(&mut self) -> Option<(u8, Vec<u8>)> {
        loop {
            if let Some(frame) = self.decoder.next().unwrap() {
                return Some((frame.kind, frame.payload.to_vec()));
            }
            let count = self.socket.read(self.decoder.room()).ok().filter(|count| *count > 0)?;
            self.decoder.filled(count);
        }
    }

    fn reply(&mut self, kind: u8) -> Vec<u8> {
        loop {
            let (found, payload) = self.frame().expect("it is connected");
            if found == kind {
                return payload;
            }
        }
    }

    fn row(&mut self) -> Option<Row> {
        loop {
            let (kind, payload) = self.frame()?;
            if kind == b'U' {
                let double = |at: usize| f64::from_be_bytes(payload[at..at + 8].try_into().unwrap());
                return Some(Row {
                    seconds: double(1),
                    step: u64::from_be_bytes(payload[9..17].try_into().unwrap()),
                    state: i32::from_be_bytes(payload[17..21].try_into().unwrap()),
                    q: (0..6).map(|i| double(21 + 8 * i)).collect(),
                });
            }
        }
    }

    fn rows(&mut self, count: usize) -> Vec<Row> {
        (0..count).map(|_| self.row().expect("it is connected")).collect()
    }
}

#[test]
fn the_clock_goes_at_500_hz_and_several_clients_hear_it() {
    let running = serve(0, Time::Wall, WireKnobs::default());
    let (mut first, mut second) = (Client::start(&running), Client::start(&running));
    let (a, b) = (first.rows(200), second.rows(200));
    for rows in [&a, &b] {
        for pair in rows.windows(2) {
            let (steps, seconds) = (pair[1].step - pair[0].step, pair[1].seconds - pair[0].seconds);
            assert!(
                steps >= 1 && (seconds - 0.002 * steps as f64).abs() < 1e-9,
                "the clock and its steps agree"
            );
        }
    }
    assert!(a[0].seconds >= 60.0);
    assert_eq!(running.counters().rtde_clients, 2);
}

#[test]
fn a_wall_clock_never_goes_faster_than_the_walls() {
    let running = serve(1, Time::Wall, WireKnobs::default());
    let mut client = Client::start(&running);
    let (began, first) = (Instant::now(), client.row().unwrap());
    let last = client.rows(150).pop().unwrap();
    // A package may have waited before the first was read: 30 ms of slack.
    assert!(last.seconds - first.seconds <= began.elapsed().as_secs_f64() + 0.03);
}

#[test]
fn latency_and_jitter_keep_the_order_and_lose_nothing() {
    let knobs = WireKnobs { latency_ms: 20.0, jitter_ms: 15.0, ..WireKnobs::default() };
    let running = serve(2, Time::Wall, knobs);
    let mut client = Client::start(&running);
    let rows = client.rows(100);
    assert!(rows.windows(2).all(|pair| pair[1].step > pair[0].step));
    let now = running.cell().now().seconds();
    assert!(now - rows[99].seconds > 0.015, "it is late: {}", now - rows[99].seconds);
}

#[test]
fn a_connection_is_cut_in_the_middle_of_a_package_and_the_next_is_served() {
    let running = serve(3, Time::Wall, WireKnobs::default());
    let mut client = Client::start(&running);
    client.rows(5);
    running.set_knobs(WireKnobs { cut_at_tick: Some(running.counters().ticks + 50), ..WireKnobs::default() });
    while client.row().is_some() {}
    assert!(client.decoder.waiting() > 3, "half a package is left");
    Client::start(&running).rows(5);
}

#[test]
fn a_stalled_stream_goes_on_with_the_newest_and_skipped_packages_leave_a_gap() {
    let running = serve(4, Time::Wall, WireKnobs::default());
    let mut client = Client::start(&running);
    client.rows(5);
    let from_tick = running.counters().ticks + 100;
    let some = Some(Ticks { from_tick, count: 30 });
    running.set_knobs(WireKnobs { skipped: some, ..WireKnobs::default() });
    let rows = client.rows(400);
    let gap = rows.windows(2).map(|pair| pair[1].step - pair[0].step).max().unwrap();
    assert!(gap >= 31, "{gap}");
    let stalled = Some(Ticks { from_tick: running.counters().ticks + 100, count: 40 });
    running.set_knobs(WireKnobs { stalled, ..WireKnobs::default() });
    let gap = client.rows(400).windows(2).map(|pair| pair[1].step - pair[0].step).max().unwrap();
    assert!(gap >= 41, "{gap}");
}

#[test]
fn a_version_that_is_refused_and_data_that_races_the_start_are_both_heard() {
    let running = serve(5, Time::Wall, WireKnobs { data_races_start: true, ..WireKnobs::default() });
    let mut client = Client::start(&running);
    assert_eq!(client.frame().unwrap().0, b'U', "data first");
    assert_eq!(client.reply(b'S'), [1]);
    running.set_knobs(WireKnobs { refuses_protocol: true, ..WireKnobs::default() });
    let mut socket = TcpStream::connect((running.host(), Ports::RTDE)).unwrap();
    socket.write_all(&package(b'V', &[0, 2])).unwrap();
    let mut reply = [9; 4];
    socket.read_exact(&mut reply).unwrap();
    assert_eq!(reply, [0, 4, b'V', 0]);
}

#[test]
fn a_taken_port_is_said_with_its_number() {
    let running = serve(6, Time::Wall, WireKnobs::default());
    let cell = SimulatedCell::new(&CellConfig::default(), 1).unwrap();
    let config = ControllerConfig { host: running.host(), ..ControllerConfig::default() };
    let error = ControllerServer::start(cell, config).unwrap_err().to_string();
    assert!(error.contains("30004") && error.contains("127."), "{error}");
}

#[test]
fn an_unknown_script_is_refused_in_words_that_reach_the_client() {
    let running = serve(7, Time::Wall, WireKnobs::default());
    let mut client = Client::start(&running);
    client.rows(2);
    let mut socket = TcpStream::connect((running.host(), Ports::SECONDARY)).unwrap();
    socket.write_all(b"def another():\n  movej([0,0,0,0,0,0])\nend\n").unwrap();
    let mut length = [0; 5];
    socket.read_exact(&mut length).unwrap();
    assert_eq!(length[4], 20, "the version message comes first");
    let bytes = client.reply(b'M');
    let frame = probepath_robot::drivers::ur::rtde::Frame { kind: b'M', payload: &bytes };
    let Reply::Text(text) = Reply::read(frame, Version::V2).unwrap() else { panic!("a text") };
    assert!(text.words().contains("was not started"), "{}", text.words());
    assert_eq!(running.counters().refused_scripts, 1);
}

/// The states of a short motion under our own script, in simulated time; and the client, still connected.
fn lockstep(running: &Running) -> (Vec<Row>, Client) {
    let mut client = Client::connect(running);
    client.send(b'I', registers::INPUTS.as_bytes());
    assert_eq!(client.reply(b'I')[0], 1);
    client.send(b'S', &[]);
    let mut scripts = TcpStream::connect((running.host(), Ports::SECONDARY)).unwrap();
    scripts.write_all(GIVEN.text().as_bytes()).unwrap();
    let mut row = client.row().unwrap();
    while row.state == 0 {
        row = client.row().unwrap();
    }
    let (began, from) = (row.seconds, row.q.clone());
    let mut rows = vec![row];
    for sequence in 1..=600_i32 {
        let (asked, moved) =
            if sequence < 10 { (command::HELLO, 0) } else { (command::SERVO, sequence - 10) };
        let mut fields = vec![1];
        [sequence, asked, 1].iter().for_each(|int| fields.extend(int.to_be_bytes()));
        for (joint, q) in from.iter().enumerate() {
            let away = if joint == 0 { 0.0002 * f64::from(moved) } else { 0.0 };
            fields.extend((q + away).to_be_bytes());
        }
        client.send(b'U', &fields);
        rows.push(client.row().unwrap());
    }
    let last = rows.last().unwrap();
    assert!((last.seconds - began - 600.0 * 0.002).abs() < 1e-9, "a tick for each package");
    assert!((last.q[0] - from[0] - 0.0002 * 590.0).abs() < 0.005, "it moved");
    (rows, client)
}

#[test]
fn in_simulated_time_the_same_packages_give_the_same_states() {
    let rows = |test| lockstep(&serve(test, Time::Simulated, WireKnobs::default())).0;
    assert_eq!(rows(8), rows(9));
}

#[test]
fn in_simulated_time_a_client_that_starts_late_misses_nothing() {
    let running = serve(11, Time::Simulated, WireKnobs::default());
    let mut client = Client::connect(&running);
    client.send(b'I', registers::INPUTS.as_bytes());
    assert_eq!(client.reply(b'I')[0], 1);
    let mut scripts = TcpStream::connect((running.host(), Ports::SECONDARY)).unwrap();
    scripts.write_all(GIVEN.text().as_bytes()).unwrap();
    until(|| running.counters().scripts == 1);
    client.send(b'S', &[]);
    assert_eq!(client.row().unwrap().step, 1);
    let fields: Vec<u8> = [&[1][..], &1_i32.to_be_bytes(), &[0; 8 + 48]].concat();
    client.send(b'U', &fields);
    assert_eq!(client.row().unwrap().step, 2, "a tick for the package, and no other");
}

/// Until something is so; generous, as the machine may be loaded.
fn until(is_so: impl Fn() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < Duration::from_secs(60), "it never came");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn in_simulated_time_a_client_that_goes_away_leaves_the_arm_at_rest_and_the_clock_standing() {
    let running = serve(10, Time::Simulated, WireKnobs::default());
    let before = running.cell().now();
    let mut listener = Client::start(&running);
    listener.rows(20);
    assert_eq!(running.cell().now(), before, "while nobody commands, the cell's time stands still");
    let (_, client) = lockstep(&running);
    assert!(!running.is_at_rest());
    let cut = running.cell().now();
    drop(client);
    until(|| running.is_at_rest());
    let rested = (running.cell().now() - cut).seconds();
    assert!(rested < 0.1, "at rest {rested} s after the cut");
    std::thread::sleep(Duration::from_millis(50));
    let quiet = running.cell().now();
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(running.cell().now(), quiet);
}
