//! `probepath simulate`, as typed: says what it serves where, serves it, and ends at Ctrl-C.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test stops at the first surprise")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

/// A loopback address of this test alone.
fn host(test: u8) -> String {
    let pid = std::process::id();
    format!("127.{}.{}.{}", 70 + test, pid / 250 % 250 + 1, pid % 250 + 1)
}

fn probepath(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_probepath"));
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The document that it prints when it is ready: up to the brace that closes it.
fn document(child: &mut Child) -> Value {
    let mut text = String::new();
    for line in BufReader::new(child.stdout.as_mut().unwrap()).lines() {
        let line = line.unwrap();
        text += &line;
        if line == "}" {
            break;
        }
    }
    serde_json::from_str(&text).unwrap()
}

fn interrupt(child: Child) -> Output {
    let done = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(done.success());
    child.wait_with_output().unwrap()
}

/// Waits for a package of the controller's state, which every tick sends to those who asked for it.
fn wait_for_a_tick(host: &str) {
    let mut rtde = TcpStream::connect((host, 30004)).unwrap();
    // The protocol's version, the outputs that are wanted and how often, and the start (`UR_WIRE.md`).
    rtde.write_all(&[0, 5, b'V', 0, 2]).unwrap();
    rtde.write_all(&[&[0, 20, b'O'][..], &500_f64.to_be_bytes(), b"timestamp"].concat()).unwrap();
    rtde.write_all(&[0, 3, b'S']).unwrap();
    let mut kind = 0;
    while kind != b'U' {
        let mut header = [0; 3];
        rtde.read_exact(&mut header).unwrap();
        kind = header[2];
        let mut rest = vec![0; usize::from(u16::from_be_bytes([header[0], header[1]])) - 3];
        rtde.read_exact(&mut rest).unwrap();
    }
}

#[test]
fn it_says_what_it_serves_and_serves_it_until_ctrl_c() {
    let host = host(0);
    let mut child = probepath(&["simulate", "--json", "--host", &host, "--seed", "3"]).spawn().unwrap();
    let said = document(&mut child);
    assert_eq!((said["host"].as_str(), said["seed"].as_u64()), (Some(host.as_str()), Some(3)));
    let ports: Vec<u64> =
        said["ports"].as_array().unwrap().iter().filter_map(|p| p["port"].as_u64()).collect();
    assert_eq!(ports, [30004, 29999, 30001, 30002, 30003, 18944]);
    assert!(said["arm"]["payload_kg"].as_f64().unwrap() > 0.0);
    let mut rtde = TcpStream::connect((host.as_str(), 30004)).unwrap();
    rtde.write_all(&[0, 5, b'V', 0, 2]).unwrap();
    let mut reply = [0; 4];
    rtde.read_exact(&mut reply).unwrap();
    assert_eq!(reply, [0, 4, b'V', 1]);
    let mut dashboard = BufReader::new(TcpStream::connect((host.as_str(), 29999)).unwrap());
    let mut banner = String::new();
    dashboard.read_line(&mut banner).unwrap();
    assert_eq!(banner.trim(), "Connected: Universal Robots Dashboard Server");
    let out = interrupt(child);
    assert_eq!(out.status.code(), Some(0));
    let farewell = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(farewell.contains("1 RTDE clients") || farewell.contains("1 RTDE client"), "{farewell}");
    assert!(out.stdout.iter().all(u8::is_ascii_whitespace), "one document, no more");
}

#[test]
fn a_host_that_is_taken_is_said_with_its_port() {
    let host = host(1);
    let mut child = probepath(&["simulate", "--json", "--host", &host]).spawn().unwrap();
    document(&mut child);
    let out = probepath(&["simulate", "--host", &host]).output().unwrap();
    assert_eq!(out.status.code(), Some(1));
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.contains(&host) && said.contains("30004"), "{said}");
    assert_eq!(interrupt(child).status.code(), Some(0));
}

#[test]
fn it_ends_with_its_standard_input_and_leaves_what_happened() {
    let host = host(2);
    let report = std::env::temp_dir().join(format!("probepath-served-{}.json", std::process::id()));
    let arguments = ["simulate", "--json", "--host", &host, "--until-input-ends", "--report"];
    let mut child = probepath(&arguments).arg(&report).stdin(Stdio::piped()).spawn().unwrap();
    document(&mut child);
    wait_for_a_tick(&host);
    drop(child.stdin.take());
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(0));
    let said: Value = serde_json::from_str(&std::fs::read_to_string(&report).unwrap()).unwrap();
    std::fs::remove_file(&report).unwrap();
    assert!(said["controller"]["ticks"].as_u64().unwrap() > 0, "{said}");
    assert_eq!(said["machine"]["pictures"].as_u64(), Some(0));
    assert!(said["ticks_begun"]["count"].as_u64().unwrap() > 0, "{said}");
    assert!(said["scheduling"]["granted"].is_string() || said["scheduling"]["refused"].is_object(), "{said}");
}
