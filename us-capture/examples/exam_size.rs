//! How large an exam is and what recording costs: a minute of ticks at 500 Hz and B-scans of 640 x 480 at 20 a second.
//!
//! `cargo run --release -p probepath-us-capture --example exam_size [OUT.mcap]`
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement prints, and asks the clock"
)]

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use probepath_frames::nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Span, Stamp, Wrench};
use probepath_us_capture::exam::{Exam, ExamHeader, ExamReader, ExamWriter, Pace, Row, TickRecord};
use probepath_us_capture::{BScan, PixelSpacing, PlacedBScan, Setting};

const TICKS: u64 = 30_000;
const TICKS_PER_BSCAN: u64 = 25;

struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    /// Nearly normal, of the given spread.
    fn normal(&mut self, spread: f64) -> f64 {
        (0..12).map(|_| self.next() as f64 / (1u64 << 31) as f64 - 0.5).sum::<f64>() * spread
    }

    fn row(&mut self, n: u64, spread: f64) -> [f64; 6] {
        std::array::from_fn(|joint| (n as f64 * 0.002 * 0.1 + joint as f64).sin() + self.normal(spread))
    }
}

fn tick(n: u64, noise: &mut Noise) -> Result<TickRecord, Box<dyn Error>> {
    let (sent, before) = (Noise(1).row(n, 0.0), Noise(1).row(n.saturating_sub(1), 0.0));
    Ok(TickRecord {
        tick: n,
        stamp: Stamp::from_nanoseconds(i64::try_from(n)? * 2_000_000),
        command: Some(Row::from_slice(&sent)?),
        position: Row::from_slice(&noise.row(n, 1e-5))?,
        velocity: Row::from_slice(&noise.row(n, 1e-3))?,
        commanded: Row::from_slice(&before)?,
        wrench: Wrench::new(
            Vector3::new(0.0, 0.0, -5.0).map(|f: f64| f + noise.normal(0.05)),
            Vector3::zeros(),
        ),
        guiding: false,
        phase: "replay".into(),
        safety: "".into(),
        overtaken: false,
        freedrive: false,
        age: Span::ZERO,
        // FRAMES: made up, as large as a real one.
        world_from_probe: Some(Pose::assume(Isometry3::translation(
            0.0,
            noise.normal(1e-5),
            n as f64 * 2e-5,
        ))),
    })
}

/// Log-compressed speckle, correlated over a few pixels as a scanner's is; the rows above the skin are black.
fn bscan(n: u64, noise: &mut Noise) -> Result<PlacedBScan, Box<dyn Error>> {
    let (width, height) = (640usize, 480usize);
    let mut grey = 0.0;
    let speckle = (0..width * height).map(|i| {
        grey = 0.8 * grey + noise.normal(12.0);
        if i < width * 20 { 0 } else { (90.0 + grey) as u8 }
    });
    let setting = Setting {
        depth_m: 0.07,
        focus_m: 0.045,
        window_top_m: 0.0,
        window_height_m: 0.07,
        window_width_m: 0.04,
        spacing: PixelSpacing { x_m: 0.04 / 640.0, y_m: 0.07 / 480.0 },
    };
    let formed = Stamp::from_nanoseconds(i64::try_from(n)? * 50_000_000);
    let pixels: Vec<u8> = speckle.collect();
    Ok(PlacedBScan {
        bscan: BScan::new(
            n,
            (formed, formed + Span::from_milliseconds(80)),
            setting,
            (width, height),
            pixels,
        )?,
        // FRAMES: made up, as large as a real one.
        world_from_probe: Pose::assume(Isometry3::translation(0.0, 0.0, n as f64 * 5e-4)),
        // FRAMES: made up, as large as a real one.
        world_from_image: Pose::assume(Isometry3::translation(-0.02, 0.0, n as f64 * 5e-4)),
        wrench: None,
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let given = std::env::args_os().nth(1).map(PathBuf::from);
    let path = given.clone().unwrap_or_else(|| std::env::temp_dir().join("probepath_exam_size.mcap"));
    for with_bscans in [false, true] {
        measure(&path, with_bscans)?;
    }
    cost_of_offering()?;
    if given.is_none() {
        std::fs::remove_file(&path)?;
    }
    Ok(())
}

/// What the control loop pays for a tick when the queue has room: bursts that fit into it.
fn cost_of_offering() -> Result<(), Box<dyn Error>> {
    let mut costs = Vec::new();
    for _ in 0..20 {
        let writer = ExamWriter::new(std::io::sink(), &header(), Pace::RealTime)?;
        let mut noise = Noise(1);
        let ticks: Vec<TickRecord> = (0..2000).map(|n| tick(n, &mut noise)).collect::<Result<_, _>>()?;
        for tick in ticks {
            let begun = Instant::now();
            writer.tick(tick);
            costs.push(begun.elapsed().as_secs_f64() * 1e6);
        }
        writer.finish()?;
    }
    costs.sort_by(f64::total_cmp);
    let at = |part: f64| costs[(part * (costs.len() - 1) as f64) as usize];
    println!("offering one tick: median {:.2} us, p99 {:.2} us, most {:.2} us", at(0.5), at(0.99), at(1.0));
    Ok(())
}

fn header() -> ExamHeader {
    ExamHeader {
        software: "probepath".into(),
        study_code: "SIZE".into(),
        protocol: "none".into(),
        protocol_sha256: ExamHeader::sha256(""),
        calibration_id: "none".into(),
        seed: Some(1),
        joint_names: (1..=6).map(|joint| format!("joint_{joint}")).collect(),
        period: Span::from_milliseconds(2),
    }
}

fn measure(path: &std::path::Path, with_bscans: bool) -> Result<(), Box<dyn Error>> {
    let mut noise = Noise(1);
    let scans = if with_bscans { TICKS / TICKS_PER_BSCAN } else { 0 };
    let images: Vec<PlacedBScan> =
        (0..40.min(scans)).map(|n| bscan(n, &mut noise)).collect::<Result<_, _>>()?;
    let ticks: Vec<TickRecord> = (0..TICKS).map(|n| tick(n, &mut noise)).collect::<Result<_, _>>()?;
    let begun = Instant::now();
    let writer = ExamWriter::create(path, &header(), Pace::Simulated)?;
    for tick in ticks {
        if with_bscans && tick.tick % TICKS_PER_BSCAN == 0 {
            let n = tick.tick / TICKS_PER_BSCAN;
            let mut placed = images[(n % 40) as usize].clone();
            placed.bscan.number = n;
            (placed.bscan.formed, placed.bscan.arrived) =
                (tick.stamp, tick.stamp + Span::from_milliseconds(80));
            writer.bscan(placed);
        }
        writer.tick(tick);
    }
    let offered = begun.elapsed().as_secs_f64();
    let written = writer.finish()?;
    let all = begun.elapsed().as_secs_f64();
    let megabytes = std::fs::metadata(path)?.len() as f64 / 1e6;
    let begun = Instant::now();
    let exam = Exam::collect(ExamReader::open(path)?)?;
    let reading = begun.elapsed().as_secs_f64();
    println!(
        "{} ticks, {} B-scans (a minute): {megabytes:.1} MB; offered in {:.2} us a tick, written in {all:.2} s \
         ({:.2} us a tick), read in {reading:.2} s ({:?})",
        written.ticks,
        written.bscans,
        offered * 1e6 / TICKS as f64,
        all * 1e6 / TICKS as f64,
        exam.ending,
    );
    Ok(())
}
