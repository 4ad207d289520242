//! A whole leg at 0.2 mm: 600 x 600 x 3000 voxels, 1.08 thousand million, from 2,000 images, built and written in parts
//! within 2 GB, holes filled. Says what it took.
//!
//! `cargo run --release -p probepath-recon --example whole_leg [FOLDER]`
#![allow(clippy::print_stdout, reason = "an example speaks to people")]
#![allow(clippy::disallowed_methods, reason = "it measures")]

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::volume::{Grid, Holes, Slice, Swept, Tiles, VolumeSettings};
use probepath_us_capture::PixelMap;

const IMAGES: usize = 2000;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(std::env::temp_dir, PathBuf::from);
    let pixels: Vec<u8> = (0..640 * 480_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 26) as u8).collect();
    // 120 x 120 mm every 0.3 mm, rocking a little.
    let map = |image: usize| {
        let turn = 0.05 * (image as f64 / 40.0).sin();
        let first = Point::<World>::new(0.0, 0.0, 3e-4 * image as f64);
        PixelMap::new(first, Vector3::new(turn.cos(), 0.0, turn.sin()) * 1.875e-4, Vector3::y() * 2.5e-4)
    };
    let slices: Vec<Slice<'_>> = (0..IMAGES).map(|image| Slice::new(&pixels, 640, map(image))).collect();
    let grid = Grid { origin: Point::new(0.0, 0.0, 0.0), spacing_m: [2e-4; 3], size: [600, 600, 3000] };
    let settings = VolumeSettings {
        grid: Some(grid),
        holes: Some(Holes::Swept(Swept { longest_m: 2e-3 })),
        most_bytes: 1_500_000_000,
        ..VolumeSettings::every_mm(0.2)
    };
    let begun = Instant::now();
    let tiles = Tiles::new(&slices, &settings)?;
    println!("{} parts of {:.0} MB", tiles.parts(), tiles.memory_bytes() as f64 / 1e6);
    let (grey, marks) = (folder.join("whole-leg.mha"), folder.join("whole-leg-marks.mha"));
    let written = tiles.write(&grey, &marks, |_| ())?;
    println!(
        "{} voxels seen, {} filled, {:.1} s",
        written.seen,
        written.filled,
        begun.elapsed().as_secs_f64()
    );
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    println!(
        "{}",
        status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("peak memory: not known here")
    );
    for file in [grey, marks] {
        println!("{}: {} MB", file.display(), std::fs::metadata(&file)?.len() / 1_000_000);
        std::fs::remove_file(file)?;
    }
    Ok(())
}
