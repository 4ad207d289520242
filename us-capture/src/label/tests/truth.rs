//! Random phantoms, random planes, dots with noise, false ones, missing ones: how often the wires are named right.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Phantom, Point, Pose};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::{LabelOptions, Labeller, Labels};
use super::{named_dot, wrong_wires};
use crate::PixelSpacing;
use crate::dots::Dot;
use crate::phantom::WirePhantom;

/// The pixel size that the labeller is told; the true one is up to 5 % smaller down the rows.
const SPACING: PixelSpacing = PixelSpacing { x_m: 80e-6, y_m: 80e-6 };
const WIDTH: f64 = 500.0;
const HEIGHT: f64 = 550.0;

/// Rows of Zs side by side at several depths, their planes not quite parallel, and now and then a single wire.
fn some_phantom(rng: &mut ChaCha8Rng) -> WirePhantom {
    let (mut wires, gap, length) = (Vec::new(), rng.random_range(4.0..9.0), rng.random_range(35.0..60.0));
    let rows = rng.random_range(2..=4);
    for row in 0..rows {
        let (rise, zs) = (rng.random_range(-0.12..0.12), rng.random_range(1..=2));
        let mut x = rng.random_range(0.0..6.0);
        let height = |x: f64, row: usize| row as f64 * gap + rise * (x - 15.0);
        let mut straight = |x: f64| wires.push([x, 0.0, height(x, row), x, length, height(x, row)]);
        straight(x);
        let mut slanted = Vec::new();
        for _ in 0..zs {
            let width = rng.random_range(12.0..26.0);
            let (a, b) = (rng.random_range(2.0..4.0), width - rng.random_range(2.0..4.0));
            let (a, b) = if rng.random_bool(0.5) { (a, b) } else { (b, a) };
            slanted.push([x + a, 0.0, height(x + a, row), x + b, length, height(x + b, row)]);
            x += width;
            straight(x);
        }
        wires.extend(slanted);
    }
    if rng.random_bool(0.3) {
        let x = rng.random_range(5.0..25.0);
        wires.push([x, 0.0, -6.0, x + rng.random_range(-8.0..8.0), length, -4.0]);
    }
    super::phantom("random", &wires)
}

/// A plane that looks at the phantom's middle, from either side, turned any way, tilted by up to `tilt`.
fn some_plane(phantom: &WirePhantom, tilt: f64, rng: &mut ChaCha8Rng) -> Pose<Phantom, Image> {
    let ends: Vec<_> = phantom.wires.iter().flat_map(|w| [w.front.vector(), w.back.vector()]).collect();
    let low = ends.iter().fold(Vector3::repeat(f64::INFINITY), |a, b| a.inf(b));
    let high = ends.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |a, b| a.sup(b));
    let mut middle = (low + high) / 2.0;
    middle.y = low.y + (high.y - low.y) * rng.random_range(0.25..0.75);
    let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    // Image x along the phantom's x, image z along its y, from the front or from behind.
    let square = Matrix3::from_columns(&[Vector3::x(), Vector3::z() * -side, Vector3::y() * side]);
    let spin = Rotation3::from_axis_angle(&Vector3::z_axis(), rng.random_range(0.0..std::f64::consts::TAU));
    let lean =
        Rotation3::new(Vector3::new(rng.random_range(-tilt..tilt), rng.random_range(-tilt..tilt), 0.0));
    let turn = Rotation3::from_matrix_unchecked(square) * spin * lean;
    let centre = Vector3::new(WIDTH / 2.0 * SPACING.x_m, HEIGHT / 2.0 * SPACING.y_m, 0.0);
    let offset = Vector3::from_fn(|_, _| rng.random_range(-3e-3..3e-3));
    let to = Translation3::from(middle + offset - turn * centre);
    // FRAMES: made here: the image's axes in the phantom's.
    Pose::assume(Isometry3::from_parts(to, UnitQuaternion::from_rotation_matrix(&turn)))
}

/// The dots of the wires that cross the image, where a wire is up to a tenth of a millimetre from where its file has
/// it, with half a pixel of noise.
fn dots(phantom: &WirePhantom, plane: &Pose<Phantom, Image>, rng: &mut ChaCha8Rng) -> Vec<Dot> {
    let slow = rng.random_range(0.95..1.0);
    let image_from_phantom = plane.inverse();
    let mut dots = Vec::new();
    for (wire, w) in phantom.wires.iter().enumerate() {
        let mut end = |p: Point<Phantom>| {
            (image_from_phantom * p).vector() + Vector3::from_fn(|_, _| rng.random_range(-1e-4..1e-4))
        };
        let (a, b) = (end(w.front), end(w.back));
        if a.z * b.z < 0.0 {
            let at = a + (b - a) * (a.z / (a.z - b.z));
            let noise = [rng.random_range(-0.8..0.8), rng.random_range(-0.8..0.8)];
            let at = [at.x / SPACING.x_m + noise[0], at.y / (SPACING.y_m * slow) + noise[1]];
            if at[0] > 0.0 && at[0] < WIDTH && at[1] > 0.0 && at[1] < HEIGHT {
                dots.push(named_dot(at, 0.5, Some(wire)));
            }
        }
    }
    dots
}

/// Takes `gone` dots away, puts `clutter` false ones in, and beside some an echo a millimetre deeper.
fn spoil(dots: &mut Vec<Dot>, gone: usize, clutter: usize, rng: &mut ChaCha8Rng) {
    dots.shuffle(rng);
    dots.truncate(dots.len().saturating_sub(gone));
    for i in 0..dots.len() {
        if rng.random_bool(0.1) {
            let [x, y] = dots[i].at_px;
            dots.push(named_dot([x + rng.random_range(-2.0..2.0), y + 13.0], 0.6, None));
        }
    }
    for _ in 0..clutter {
        dots.push(named_dot([rng.random_range(0.0..WIDTH), rng.random_range(0.0..HEIGHT)], 0.6, None));
    }
    dots.shuffle(rng);
}

#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    cases: usize,
    first: usize,
    among: usize,
    missed: usize,
    refused: usize,
    sure: usize,
    sure_and_wrong: usize,
}

impl Tally {
    fn count(&mut self, labeller: &Labeller, dots: &[Dot], true_dots: usize) {
        self.cases += 1;
        let right = |l: &Labels| wrong_wires(l) == 0 && l.count() + 1 >= true_dots;
        match labeller.candidates(dots, SPACING) {
            Err(_) => self.refused += 1,
            Ok(found) => {
                self.first += usize::from(right(&found[0]));
                self.among += usize::from(found.iter().any(right));
                self.missed += usize::from(!found.iter().any(right));
            }
        }
        if let Ok(only) = labeller.only(dots, SPACING) {
            self.sure += 1;
            self.sure_and_wrong += usize::from(wrong_wires(&only) > 0);
        }
    }
}

fn options() -> LabelOptions {
    LabelOptions { field_px: Some([[0.0, 0.0], [WIDTH, HEIGHT]]), ..LabelOptions::default() }
}

fn tally(
    cases: usize,
    (gone, clutter): (usize, usize),
    tilt: f64,
    seed: u64,
    fixed: Option<&WirePhantom>,
) -> Tally {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut tally = Tally::default();
    while tally.cases < cases {
        let phantom = fixed.cloned().unwrap_or_else(|| some_phantom(&mut rng));
        let labeller = Labeller::new(&phantom, options());
        for _ in 0..5 {
            let plane = some_plane(&phantom, tilt, &mut rng);
            let mut seen = dots(&phantom, &plane, &mut rng);
            if seen.len() < 6 + gone {
                continue;
            }
            let true_dots = seen.len() - gone;
            spoil(&mut seen, gone, clutter, &mut rng);
            tally.count(&labeller, &seen, true_dots);
        }
    }
    tally
}

/// Nearly always the right wires come first; a choice that `only` is sure of is never wrong.
fn hold(what: &str, t: Tally, first: f64) {
    eprintln!("{what}: {t:?}");
    assert!(t.first as f64 >= first * t.cases as f64, "{what}: {t:?}");
    assert!(t.sure_and_wrong == 0 && t.missed * 20 <= t.cases, "{what}: {t:?}");
    assert!(t.sure * 2 > t.cases, "{what}: {t:?}");
}

#[test]
fn the_wires_of_random_phantoms_are_named_right() {
    for (gone, clutter, tilt, first) in
        [(0, 0, 0.1, 0.98), (0, 0, 0.35, 0.98), (0, 10, 0.2, 0.96), (1, 5, 0.2, 0.98), (2, 15, 0.35, 0.88)]
    {
        let what = format!("random phantoms without {gone}, with {clutter} more, tilted {tilt}");
        hold(&what, tally(200, (gone, clutter), tilt, 5, None), first);
    }
}

#[test]
fn the_paper_s_43_wires_are_named_right() {
    let paper = super::shipped("z-19");
    for (gone, clutter, tilt, first) in [(0, 0, 0.2, 0.98), (2, 15, 0.3, 0.9)] {
        let what = format!("z-19 without {gone}, with {clutter} more, tilted {tilt}");
        hold(&what, tally(40, (gone, clutter), tilt, 6, Some(&paper)), first);
    }
}

#[test]
fn near_a_prediction_the_same_wires_are_named() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let (mut cases, mut right, mut wrong) = (0, 0, 0);
    while cases < 600 {
        let phantom = some_phantom(&mut rng);
        let labeller = Labeller::new(&phantom, options());
        let plane = some_plane(&phantom, 0.3, &mut rng);
        let mut seen = dots(&phantom, &plane, &mut rng);
        if seen.len() < 7 {
            continue;
        }
        let true_dots = seen.len() - 1;
        spoil(&mut seen, 1, 10, &mut rng);
        let predicted = shaken(&plane, &mut rng);
        cases += 1;
        if let Ok(found) = labeller.near(&seen, &predicted, SPACING, 3e-3) {
            right += usize::from(wrong_wires(&found) == 0 && found.count() + 1 >= true_dots);
            wrong += usize::from(wrong_wires(&found) > 0);
        }
    }
    eprintln!("near: {right} of {cases} right, {wrong} wrong");
    assert!(right * 100 >= cases * 97 && wrong * 100 <= cases, "{right} of {cases} right, {wrong} wrong");
}

/// A plane about a millimetre and two degrees from another.
fn shaken(plane: &Pose<Phantom, Image>, rng: &mut ChaCha8Rng) -> Pose<Phantom, Image> {
    let by = Vector3::from_fn(|_, _| rng.random_range(-1e-3..1e-3));
    let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| rng.random_range(-0.03..0.03)));
    let middle = plane.isometry() * SPACING.point(WIDTH / 2.0, HEIGHT / 2.0).vector();
    let turned = plane.isometry().translation.vector - middle;
    let to = Translation3::from(middle + turn * turned + by);
    // FRAMES: the same plane, moved a little.
    Pose::assume(Isometry3::from_parts(to, turn * plane.isometry().rotation))
}
