mod wires;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Direction, Point};

use super::*;
use crate::tissue::{Homogeneous, Reflector};
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

/// A machine without attenuation, noise, mottle or a line at its face, far from white.
fn plain() -> ImagingConfig {
    ImagingConfig {
        attenuation_db_cm_mhz: 0.0,
        noise_db: -200.0,
        mottle_db: 0.0,
        white_db: 24.0,
        ..ImagingConfig::default()
    }
}

/// Amplitude re an echogenicity of one, on a `plain` machine.
fn amplitude(grey: u8) -> f64 {
    10_f64.powf(((f64::from(grey) / 255.0 - 1.0) * 60.0 + 24.0) / 20.0)
}

fn zoom() -> Setting {
    settings::zoomed(0.07, 0.045, 0.03, 0.034)
}

/// Everything with a positive way along the direction from the point is blood, without a wall.
struct HalfSpace {
    from: Point<World>,
    toward: Direction<World>,
}

impl Tissue for HalfSpace {
    fn artery(&self, point: Point<World>) -> f64 {
        -(point.vector() - self.from.vector()).dot(&self.toward.vector())
    }
}

#[test]
fn the_same_pose_seed_and_number_give_the_same_bytes_on_any_number_of_threads() {
    let phantom = VascularPhantom::new(&PhantomConfig::default());
    let at = plane(-0.02, phantom.top_y() + zoom().window_top_m, 0.01);
    let render = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&phantom, &at, &zoom(), ImagingConfig::default()))
    };
    assert_eq!(render(1), render(3));
}

#[test]
fn noise_is_new_in_every_picture_and_speckle_is_not() {
    let renderer = Renderer::new(ImagingConfig::default(), 7).unwrap();
    let picture = |number| {
        renderer
            .render(&Homogeneous::default(), &plane(0.0, 0.0, 0.0), &zoom(), Contact::Full, number)
            .unwrap()
    };
    let (a, b) = (picture(0), picture(1));
    assert_ne!(a, b);
    let pairs = a.iter().zip(&b).map(|(&a, &b)| (f64::from(a), f64::from(b)));
    assert!(correlation(pairs) > 0.99);
}

#[test]
fn a_point_is_as_wide_as_the_model_says() {
    let setting = settings::zoomed(0.05, 0.030, 0.012, 0.78 * 0.030);
    // In the middle of a narrow window, at the depth where the beam is narrowest.
    let at = Point::new(0.008, 0.006, 0.0);
    let tissue = Homogeneous { reflectors: vec![Reflector { at, amplitude: 10.0 }] };
    let pixels = render(&tissue, &plane(0.0, 0.0, 0.0), &setting, ImagingConfig { tissue: 0.0, ..plain() });
    let (column, row) = setting.spacing.pixel(Point::new(at.vector().x, at.vector().y, 0.0));
    let (column, row) = (column.round() as usize, row.round() as usize);
    let down: Vec<u8> = (0..480).map(|row| pixels[row * 640 + column]).collect();
    let along = &pixels[row * 640..(row + 1) * 640];
    let axial = width(&down) * setting.spacing.y_m;
    let lateral = width(along) * setting.spacing.x_m;
    // FIELD.md 8: 0.95 mm at the waist; scan lines 0.1 mm x 5 x 16 / 40 apart, twice that in quadrature.
    let expected = 0.95_f64.hypot(0.4) * 1e-3;
    assert!((axial / 0.35e-3 - 1.0).abs() < 0.02, "axial FWHM {axial}");
    assert!((lateral / expected - 1.0).abs() < 0.02, "lateral FWHM {lateral} instead of {expected}");
    let peak = amplitude(*along.iter().max().unwrap());
    assert!((peak / 10.0 - 1.0).abs() < 0.08, "peak {peak}");
}

/// Full width at half maximum of a curve of grey levels, in pixels.
fn width(greys: &[u8]) -> f64 {
    let curve: Vec<f64> = greys.iter().map(|&grey| amplitude(grey)).collect();
    let peak = curve.iter().copied().fold(0.0, f64::max);
    let first = curve.iter().position(|&a| a >= peak / 2.0).unwrap();
    let last = curve.iter().rposition(|&a| a >= peak / 2.0).unwrap();
    let crossing =
        |inside: usize, outside: usize| (curve[inside] - peak / 2.0) / (curve[inside] - curve[outside]);
    (last - first) as f64 + crossing(first, first - 1) + crossing(last, last + 1)
}

#[test]
fn a_point_off_the_plane_fades_as_the_beam_is_thick() {
    let setting = settings::whole_depth(0.05, 0.030);
    let peak = |off: f64| {
        let at = Point::new(0.02, 0.030, off);
        let tissue = Homogeneous { reflectors: vec![Reflector { at, amplitude: 10.0 }] };
        let config = ImagingConfig { tissue: 0.0, ..plain() };
        let pixels = render(&tissue, &plane(0.0, 0.0, 0.0), &setting, config);
        amplitude(*pixels.iter().max().unwrap())
    };
    // 3.0 mm at 30 mm: half of it at 1.5 mm off the plane.
    assert!((peak(1.5e-3) / peak(0.0) - 0.5).abs() < 0.02);
    assert!((peak(-1.5e-3) / peak(0.0) - 0.5).abs() < 0.02);
}

#[test]
fn speckle_is_fully_developed_and_as_strong_as_the_tissue() {
    let setting = settings::whole_depth(0.05, 0.030);
    for (seed, at) in [plane(0.0, 0.0, 0.0), plane(-0.3, 0.1, 0.2)].iter().enumerate() {
        let renderer = Renderer::new(plain(), seed as u64).unwrap();
        let pixels = renderer.render(&Homogeneous::default(), at, &setting, Contact::Full, 0).unwrap();
        let echoes: Vec<f64> = pixels[20 * 640..].iter().map(|&grey| amplitude(grey)).collect();
        let mean = echoes.iter().sum::<f64>() / echoes.len() as f64;
        let power = echoes.iter().map(|a| a * a).sum::<f64>() / echoes.len() as f64;
        let signal_to_noise = mean / (power - mean * mean).sqrt();
        // A Rayleigh amplitude: sqrt(pi / (4 - pi)) = 1.913. Some 3000 independent cells.
        assert!((signal_to_noise - 1.913).abs() < 0.08, "{signal_to_noise}");
        assert!((power.sqrt() / 0.45 - 1.0).abs() < 0.04, "{}", power.sqrt());
    }
}

#[test]
fn speckle_moves_with_the_tissue() {
    let setting = zoom();
    let (columns, rows) = (32, 16);
    let here = plane(-0.02, -0.05, 0.0);
    let moved =
        plane(-0.02 + columns as f64 * setting.spacing.x_m, -0.05 + rows as f64 * setting.spacing.y_m, 0.0);
    let tissue = Homogeneous::default();
    let (a, b) = (render(&tissue, &here, &setting, plain()), render(&tissue, &moved, &setting, plain()));
    let pairs = (40..400).flat_map(|row| (40..560).map(move |column| (row, column)));
    let grey = |pixels: &[u8], row: usize, column: usize| f64::from(pixels[row * 640 + column]);
    let shifted =
        pairs.clone().map(|(row, column)| (grey(&a, row + rows, column + columns), grey(&b, row, column)));
    let still = pairs.map(|(row, column)| (grey(&a, row, column), grey(&b, row, column)));
    let (moved, still) = (correlation(shifted), correlation(still));
    // The depth under the face changed by 1 mm too, so the widths are not quite the same.
    assert!(moved > 0.97 && still.abs() < 0.15, "{moved}, and {still} where it was");
}

#[test]
fn speckle_changes_over_the_thickness_of_the_beam() {
    let picture = |z| render(&Homogeneous::default(), &plane(0.0, 0.0, z), &zoom(), plain());
    let here = picture(0.0);
    let alike = |z| {
        let there = picture(z);
        correlation(here.iter().zip(&there).map(|(&a, &b)| (amplitude(a), amplitude(b))))
    };
    let (near, far) = (alike(0.3e-3), alike(6e-3));
    assert!(near > 0.9 && far.abs() < 0.1, "{near} at 0.3 mm, {far} at 6 mm");
}

#[test]
fn speckle_does_not_depend_on_how_the_lattice_is_walked() {
    let turned = |degrees: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), degrees.to_radians());
        // FRAMES: a test's own plane, turned about the beam.
        let at = Pose::assume(Isometry3::from_parts(Translation3::new(0.01, -0.06, 0.03), turn));
        render(&Homogeneous::default(), &at, &zoom(), plain())
    };
    // At 45 degrees the walk goes over from one of the World's axes to another.
    let (before, after) = (turned(44.999), turned(45.001));
    assert!(correlation(before.iter().zip(&after).map(|(&a, &b)| (f64::from(a), f64::from(b)))) > 0.999);
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

/// Mean power of each row, and of each column.
fn powers(pixels: &[u8]) -> [Vec<f64>; 2] {
    let mut sums = [vec![0.0; 480], vec![0.0; 640]];
    for (i, &grey) in pixels.iter().enumerate() {
        let power = amplitude(grey).powi(2);
        sums[0][i / 640] += power / 640.0;
        sums[1][i % 640] += power / 480.0;
    }
    sums
}

#[test]
fn an_edge_is_where_the_power_falls_to_half() {
    let setting = zoom();
    let config = ImagingConfig { wall_thickness_m: 0.0, lumen: 0.0, ..plain() };
    let edge = |toward, axis: usize, spacing: f64| {
        let tissue = HalfSpace { from: Point::new(0.02, 0.015, 0.0), toward };
        let mut sum = [vec![0.0; 480], vec![0.0; 640]];
        for seed in 0..6 {
            let renderer = Renderer::new(config.clone(), seed).unwrap();
            let pixels = renderer.render(&tissue, &plane(0.0, 0.0, 0.0), &setting, Contact::Full, 0).unwrap();
            for (sum, power) in sum.iter_mut().zip(powers(&pixels)) {
                sum.iter_mut().zip(power).for_each(|(sum, power)| *sum += power / 6.0);
            }
        }
        let half = 0.5 * 0.45_f64.powi(2);
        sum[axis].iter().rposition(|&power| power > half).unwrap() as f64 * spacing
    };
    let down = edge(Direction::y(), 0, setting.spacing.y_m);
    let right = edge(Direction::x(), 1, setting.spacing.x_m);
    // Speckle is averaged over some 100 independent cells a row, 400 a column.
    assert!((down - 0.015).abs() < 0.08e-3, "{down}");
    assert!((right - 0.02).abs() < 0.25e-3, "{right}");
}

#[test]
fn blood_is_darker_than_tissue_by_what_their_echogenicities_say() {
    let tissue = HalfSpace { from: Point::new(0.02, 0.015, 0.0), toward: Direction::x() };
    let config = ImagingConfig { wall_thickness_m: 0.0, ..plain() };
    let pixels = render(&tissue, &plane(0.0, 0.0, 0.0), &zoom(), config);
    let [_, columns] = powers(&pixels);
    let decibel =
        |from: usize, to: usize| 10.0 * (columns[from..to].iter().sum::<f64>() / (to - from) as f64).log10();
    let contrast = decibel(400, 640) - decibel(0, 240);
    assert!((contrast - 20.0 * (0.02_f64 / 0.45).log10()).abs() < 1.0, "{contrast} dB");
}

#[test]
fn the_beam_is_lost_and_made_up_for_as_the_machine_can() {
    let setting = settings::whole_depth(0.07, 0.045);
    let config = ImagingConfig { attenuation_db_cm_mhz: 0.5, ..plain() };
    let pixels = render(&Homogeneous::default(), &plane(0.0, 0.0, 0.0), &setting, config);
    let [rows, _] = powers(&pixels);
    let level = |depth_mm: usize| {
        let middle = depth_mm * 480 / 70;
        10.0 * (rows[middle - 10..middle + 10].iter().sum::<f64>() / 20.0).log10()
    };
    // 10 dB a centimetre, made up for down to 42 mm.
    assert!((level(30) - 20.0 * 0.45_f64.log10()).abs() < 1.5);
    assert!((level(30) - level(52) - 10.0).abs() < 2.0, "{} dB", level(30) - level(52));
}

#[test]
fn without_contact_there_is_no_picture() {
    let phantom = VascularPhantom::new(&PhantomConfig::default());
    let renderer = Renderer::new(ImagingConfig::default(), 7).unwrap();
    let setting = settings::whole_depth(0.05, 0.030);
    let at = plane(-0.02, phantom.top_y(), 0.0);
    let picture = |contact| renderer.render(&phantom, &at, &setting, contact, 0).unwrap();
    let mean = |pixels: &[u8]| pixels.iter().map(|&g| f64::from(g)).sum::<f64>() / pixels.len() as f64;
    let (air, full) = (picture(Contact::None), picture(Contact::Full));
    assert!(mean(&air[..640 * 20]) > 100.0, "the face rings in air");
    assert!(mean(&air[640 * 150..]) < 20.0 && mean(&full[640 * 150..]) > 100.0);
    let half = picture(Contact::Between { from_m: 0.02, to_m: 1.0 });
    let row = 300 * 640;
    assert!(mean(&half[row..row + 280]) < 20.0);
    assert_eq!(half[row + 360..row + 640], full[row + 360..row + 640]);
}

#[test]
fn a_shadow_falls_where_it_is_put() {
    let shadow = Shadow { across_m: [0.01, 0.02], below_m: 0.03, loss_db: 40.0 };
    let config = ImagingConfig { shadows: vec![shadow], ..plain() };
    let setting = settings::whole_depth(0.05, 0.030);
    let at = plane(0.0, 0.0, 0.0);
    let (with, without) = (
        render(&Homogeneous::default(), &at, &setting, config),
        render(&Homogeneous::default(), &at, &setting, plain()),
    );
    let changed = |row: usize, column: usize| with[row * 640 + column] != without[row * 640 + column];
    assert!(changed(400, 240) && !changed(200, 240) && !changed(400, 100) && !changed(400, 400));
}

#[test]
fn a_machine_that_cannot_be_is_refused_by_name() {
    let refused = |config: ImagingConfig| Renderer::new(config, 0).err().unwrap().to_string();
    let nan = refused(ImagingConfig { wall: f64::NAN, ..ImagingConfig::default() });
    assert!(nan.contains("wall is NaN"), "{nan}");
    assert!(refused(ImagingConfig { lattice_m: 0.0, ..ImagingConfig::default() }).contains("lattice_m"));
    let renderer = Renderer::new(ImagingConfig::default(), 0).unwrap();
    let tissue = Homogeneous::default();
    let endless = Setting { window_height_m: f64::INFINITY, ..zoom() };
    let at = plane(0.0, 0.0, 0.0);
    assert!(renderer.render(&tissue, &at, &endless, Contact::Full, 0).is_err());
    let nowhere = plane(f64::NAN, 0.0, 0.0);
    assert_eq!(renderer.render(&tissue, &nowhere, &zoom(), Contact::Full, 0), Err(ImagingError::Pose));
}
