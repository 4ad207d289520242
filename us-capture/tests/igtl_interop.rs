//! OpenIGTLink with a stranger: PyPI's `pyigtl` sends pictures to our source, and takes pictures of ours.
#![expect(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use probepath_frames::Stamp;
use probepath_us_capture::igtl::{IgtlSettings, IgtlSource, Image, MachineClock, Wait, encode_image};
use probepath_us_capture::{BScan, BScanSource, PixelSpacing, Setting};
use serde_json::{Value, json};

#[expect(clippy::print_stderr, reason = "a test that does nothing says so")]
fn python(arguments: &[&str]) -> Option<(Child, BufReader<ChildStdout>)> {
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!("skipped: PROBEPATH_PYTHON names no Python with pyigtl (tests/run installs one)");
        return None;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/interop/igtl.py");
    let mut command = Command::new(python);
    command.arg(script).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let said = BufReader::new(child.stdout.take().unwrap());
    Some((child, said))
}

fn line(said: &mut impl BufRead) -> String {
    let mut line = String::new();
    assert!(said.read_line(&mut line).unwrap() > 0, "the Python side ended; its error is above");
    line
}

fn sha256_of(bytes: &[u8]) -> String {
    use sha2::{Digest, Sha256};
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn setting() -> Setting {
    Setting {
        depth_m: 0.07,
        focus_m: 0.045,
        window_top_m: 0.0,
        window_height_m: 0.06,
        window_width_m: 0.04,
        spacing: PixelSpacing { x_m: 0.0625e-3, y_m: 0.125e-3 },
    }
}

/// The next picture; patient, because a stranger sends it.
#[expect(clippy::disallowed_methods, reason = "a stranger on another process has its own time")]
fn next(source: &mut IgtlSource) -> BScan {
    let began = Instant::now();
    loop {
        if let Some(bscan) = source.poll(Stamp::from_nanoseconds(101_000_000_000)).unwrap() {
            return bscan;
        }
        assert!(began.elapsed() < Duration::from_secs(60), "no picture came: {:?}", source.counts());
        std::thread::park_timeout(Duration::from_millis(5));
    }
}

#[test]
fn pictures_of_pyigtl_arrive_as_they_were_sent() {
    let Some((mut child, mut said)) = python(&["send"]) else { return };
    let port = line(&mut said).trim().parse().unwrap();
    let settings = IgtlSettings {
        host: "127.0.0.1".into(),
        port,
        device: Some("Probe".into()),
        setting: setting(),
        clock: MachineClock::OfArm,
        wait: Wait::Never,
    };
    let mut source = IgtlSource::connect(settings).unwrap();
    for number in 1..7 {
        let sent: Value = serde_json::from_str(&line(&mut said)).unwrap();
        let bscan = next(&mut source);
        let came = json!({
            "device": "Probe",
            "number": if number % 2 == 1 { number } else { 0 },
            "stamp_s": bscan.formed.seconds(),
            "size": [bscan.width(), bscan.height(), 1],
            "spacing_mm": [bscan.setting.spacing.x_m * 1e3, bscan.setting.spacing.y_m * 1e3],
            "origin_mm": [0.0, 0.0, 0.0],
            "pixels_sha256": sha256_of(bscan.pixels()),
        });
        assert_eq!((bscan.number, came), (number, sent));
        // Another size is another setting, which no calibration of this one takes.
        assert_ne!(bscan.setting, setting());
    }
    assert_eq!((source.counts().received, source.counts().skipped), (6, 12));
    drop(child.stdin.take());
    child.wait().unwrap();
}

#[test]
fn pyigtl_takes_our_pictures_as_they_were_sent() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port().to_string();
    let Some((mut child, mut said)) = python(&["receive", &port]) else { return };
    let (mut socket, _) = listener.accept().unwrap();
    for n in 1..5_u32 {
        let (columns, rows) = (640 - n as u16, 480);
        let pixels: Vec<u8> =
            (0..u32::from(columns) * rows).map(|i| (i.wrapping_mul(i).wrapping_mul(n) >> 7) as u8).collect();
        let image = Image { columns, rows: rows as u16, spacing_mm: [0.0625, 0.125], pixels };
        let stamp_ns = 60_000_000_000 + 33_333_333 * i64::from(n);
        socket.write_all(&encode_image(&format!("P{n}"), n, stamp_ns, &image).unwrap()).unwrap();
        let mut came: Value = serde_json::from_str(&line(&mut said)).unwrap();
        let stamp_s = came["stamp_s"].take().as_f64().unwrap();
        // pyigtl sums its fractions bit by bit, each rounded to a nanosecond.
        assert!((stamp_s - stamp_ns as f64 * 1e-9).abs() < 32e-9, "{stamp_s}");
        let sent = json!({
            "device": format!("P{n}"), "number": n, "stamp_s": null, "size": [columns, rows, 1],
            "spacing_mm": [0.0625, 0.125], "origin_mm": [0.0, 0.0, 0.0], "pixels_sha256": sha256_of(&image.pixels),
        });
        assert_eq!(came, sent);
    }
    drop(child.stdin.take());
    assert!(child.wait().unwrap().success());
}
