use nalgebra::Isometry3;

use super::*;
use crate::tissue::Homogeneous;
use crate::{PhantomConfig, VascularPhantom};

/// A plane whose first pixel is at `x`, `y`, `z` (m), its axes the World's.
fn plane(x: f64, y: f64, z: f64) -> Pose<World, Image> {
    // FRAMES: a test's own plane.
    Pose::assume(Isometry3::translation(x, y, z))
}

fn render(tissue: &dyn Tissue, at: &Pose<World, Image>, setting: &Setting, config: ImagingConfig) -> Vec<u8> {
    let renderer = Renderer::new(config, 7).unwrap();
    renderer.render(tissue, at, setting, Contact::Full, 0).unwrap()
}

/// Linear amplitudes of the default display (white is one).
fn amplitude(grey: u8) -> f64 {
    10_f64.powf((f64::from(grey) / 255.0 - 1.0) * 60.0 / 20.0)
}

/// A machine without attenuation, noise or mottle, far from white.
fn plain() -> ImagingConfig {
    ImagingConfig {
        attenuation_db_cm_mhz: 0.0,
        noise_db: -200.0,
        mottle_db: 0.0,
        white_db: 24.0,
        ..ImagingConfig::default()
    }
}

#[test]
fn the_same_pose_seed_and_number_give_the_same_bytes_on_any_number_of_threads() {
    let phantom = VascularPhantom::new(&PhantomConfig::default());
    let setting = settings::zoomed(0.07, 0.045, 0.03, 0.034);
    let at = plane(-0.02, phantom.top_y() + setting.window_top_m, 0.01);
    let render = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&phantom, &at, &setting, ImagingConfig::default()))
    };
    assert_eq!(render(1), render(3));
}

#[test]
fn speckle_moves_with_the_tissue() {
    let setting = settings::zoomed(0.07, 0.045, 0.03, 0.034);
    let (columns, rows) = (32, 16);
    let here = plane(-0.02, -0.05, 0.0);
    let moved =
        plane(-0.02 + columns as f64 * setting.spacing.x_m, -0.05 + rows as f64 * setting.spacing.y_m, 0.0);
    let tissue = Homogeneous::default();
    let (a, b) = (render(&tissue, &here, &setting, plain()), render(&tissue, &moved, &setting, plain()));
    let pairs = (40..400).flat_map(|row| (40..560).map(move |column| (row, column)));
    let shifted = pairs.clone().map(|(row, column)| {
        (f64::from(a[(row + rows) * 640 + column + columns]), f64::from(b[row * 640 + column]))
    });
    let still =
        pairs.map(|(row, column)| (f64::from(a[row * 640 + column]), f64::from(b[row * 640 + column])));
    let (moved, still) = (correlation(shifted), correlation(still));
    // The depth under the face changed by 1 mm too, so the widths are not quite the same.
    assert!(moved > 0.97 && still.abs() < 0.15, "{moved}, and {still} where it was");
}

fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut n, mut sums) = (0.0, [0.0; 5]);
    for (a, b) in pairs {
        n += 1.0;
        for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
            *sum += value;
        }
    }
    let [a, b, aa, bb, ab] = sums.map(|sum| sum / n);
    (ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt()
}
