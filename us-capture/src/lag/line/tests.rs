use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

const SIZE: (usize, usize) = (320, 240);

/// A plane with its reverberation, speckle, noise and clutter.
#[derive(Clone, Copy, Debug)]
struct Scene {
    row: f64,
    slope: f64,
    bright: f64,
    thick: f64,
    reverberation: f64,
    noise: f64,
    /// How far a column's echo lies off the plane (px, standard deviation); neighbours go together.
    rough: f64,
    blobs: usize,
    /// Columns that show it.
    seen: (usize, usize),
}

fn draw(rng: &mut ChaCha8Rng, scene: &Scene) -> Vec<u8> {
    let (width, height) = SIZE;
    let mut grey = vec![0.0_f64; width * height];
    let speckle: Vec<f64> = (0..width / 8 + 2).map(|_| rng.random_range(0.4..1.0)).collect();
    let mut off = 0.0;
    for column in scene.seen.0..scene.seen.1 {
        let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        off = 0.7 * off + 0.51_f64.sqrt() * scene.rough * normal;
        let row = off + scene.row + scene.slope * (column as f64 - 160.0);
        let bright = scene.bright * speckle[column / 8];
        for (at, bright) in [(row, bright), (1.6 * row, bright * scene.reverberation)] {
            for y in 0..height {
                let off = (y as f64 - at) / scene.thick;
                grey[y * width + column] += bright * (-0.5 * off * off).exp();
            }
        }
    }
    for _ in 0..scene.blobs {
        let (x, y) = (rng.random_range(10..width - 10), rng.random_range(10..height - 10));
        for (dx, dy) in (0..9).flat_map(|dx| (0..5).map(move |dy| (dx, dy))) {
            grey[(y + dy - 2) * width + x + dx - 4] += 200.0;
        }
    }
    grey.iter().map(|g| (g + scene.noise * rng.random::<f64>()).round().clamp(0.0, 255.0) as u8).collect()
}

fn scene(rng: &mut ChaCha8Rng) -> Scene {
    let from = rng.random_range(0..150);
    Scene {
        row: rng.random_range(60.0..140.0),
        slope: rng.random_range(-0.25..0.25),
        bright: rng.random_range(40.0..400.0),
        thick: rng.random_range(1.0..4.0),
        reverberation: rng.random_range(0.0..0.5),
        noise: rng.random_range(0.0..6.0),
        rough: rng.random_range(0.2..1.5),
        blobs: rng.random_range(0..6),
        seen: (from, rng.random_range(from + 120..321)),
    }
}

#[test]
fn the_line_is_found_to_its_stated_error() {
    let (mut worst, mut squares, mut slopes, mut n): (f64, f64, f64, f64) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..1000 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let scene = scene(&mut rng);
        let found = find_line(&draw(&mut rng, &scene), SIZE, &|_, _| true, &LineOptions::default());
        let line = match found {
            Ok(line) => line,
            // A bright spot on a bright reverberation.
            Err(NoLine::TwoLines { .. }) if scene.reverberation > 0.3 && scene.blobs > 0 => continue,
            Err(no) => panic!("{seed} {scene:?}: {no}"),
        };
        let truth = scene.row + scene.slope * (line.column_px - 160.0);
        let error = line.row_px - truth;
        // Echoes of a rough plane lie off it, and together: its line is that of the columns that were seen.
        let slope_error = line.slope - scene.slope;
        assert!(error.abs() < 5.0 * line.row_sd_px, "{seed} {scene:?} {line:?}");
        assert!(slope_error.abs() < 5.0 * line.slope_sd, "{seed} {scene:?} {line:?}");
        worst = worst.max(error.abs());
        squares += (error / line.row_sd_px).powi(2);
        slopes += (slope_error / line.slope_sd).powi(2);
        n += 1.0;
    }
    assert!(n > 970.0, "{n} of 1000 found");
    let (row, slope) = (squares / n, slopes / n);
    eprintln!("{n} found, worst {worst:.3} px, normalised error variance {row:.2}, of the slope {slope:.2}");
    assert!((0.8..1.3).contains(&row) && (0.8..1.4).contains(&slope), "{row} {slope}");
    assert!(worst < 1.2, "{worst} px");
}

fn plain() -> Scene {
    Scene {
        row: 80.0,
        slope: 0.1,
        bright: 200.0,
        thick: 2.0,
        reverberation: 0.0,
        noise: 2.0,
        rough: 0.0,
        blobs: 0,
        seen: (0, 320),
    }
}

#[test]
fn what_shows_no_plane_is_refused_with_the_reason() {
    let options = LineOptions::default();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut find =
        |scene: &Scene| find_line(&draw(&mut rng, scene), SIZE, &|_, _| true, &options).unwrap_err();
    assert_eq!(find(&Scene { bright: 3.0, ..plain() }).code(), "no_echo");
    assert_eq!(find(&Scene { seen: (100, 110), ..plain() }).code(), "no_echo");
    assert_eq!(find(&Scene { bright: 0.0, noise: 255.0, ..plain() }).code(), "no_line");
    assert_eq!(find(&Scene { reverberation: 1.0, ..plain() }).code(), "two_lines");
    assert_eq!(find_line(&[0; 10], SIZE, &|_, _| true, &options).unwrap_err().code(), "wrong_size");
    assert_eq!(find_line(&[], (0, 0), &|_, _| true, &options).unwrap_err().code(), "wrong_size");
    let nothing = find_line(&[200; 320 * 240], SIZE, &|_, _| false, &options);
    assert_eq!(nothing.unwrap_err().code(), "no_echo");
}

#[test]
fn a_mask_chooses_between_two_lines() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let pixels = draw(&mut rng, &Scene { reverberation: 1.0, slope: 0.0, ..plain() });
    let line = find_line(&pixels, SIZE, &|_, row| row > 100, &LineOptions::default()).unwrap();
    assert!((line.row_px - 128.0).abs() < 0.2, "{line:?}");
}
