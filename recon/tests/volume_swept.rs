//! Holes between one image and the next: filled where the images swept, with what they show, and nowhere else.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use nalgebra::{Rotation3, Vector3};
use probepath_frames::{Point, World};
use probepath_recon::volume::{Grid, Holes, Mark, Region, Slice, Swept, Volume, VolumeSettings, Weights};
use probepath_us_capture::PixelMap;
use probepath_us_capture::plus::Rectangle;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

const SPACING_M: f64 = 5e-4;
const WIDTH: usize = 40;
const HEIGHT: usize = 30;
const PIXEL_M: f64 = 2.5e-4;

fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// A place of an image: where its first pixel is, and how it is turned.
#[derive(Clone, Debug)]
struct Place {
    first: Vector3<f64>,
    turn: Rotation3<f64>,
}

impl Place {
    fn map(&self) -> PixelMap<World> {
        let step = |axis: Vector3<f64>| self.turn * axis * PIXEL_M;
        PixelMap::new(Point::from_vector(self.first), step(Vector3::x()), step(Vector3::y()))
    }

    fn at(&self, u: f64, v: f64) -> Vector3<f64> {
        self.first + self.turn * Vector3::new(u, v, 0.0) * PIXEL_M
    }
}

/// A sweep of some images in any direction: each a step on, a little turned.
fn sweep() -> impl Strategy<Value = Vec<Place>> {
    let start = [-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64].prop_map(Vector3::from);
    let step = [-4e-4..4e-4_f64, -4e-4..4e-4_f64, 6e-4..2.5e-3_f64].prop_map(Vector3::from);
    let turn = [-0.06..0.06_f64, -0.06..0.06_f64, -0.06..0.06_f64].prop_map(Vector3::from);
    (start, step, turn, 2_usize..6).prop_map(|(start, step, turn, images)| {
        let begin = Rotation3::new(start);
        let place = |image: usize| Place {
            first: begin * (step * image as f64),
            turn: begin * Rotation3::new(turn * image as f64),
        };
        (0..images).map(place).collect()
    })
}

/// What there is to see: a ramp.
fn truth(at: &Vector3<f64>, slope: &Vector3<f64>) -> f64 {
    120.0 + slope.dot(at)
}

fn pictures(sweep: &[Place], slope: &Vector3<f64>) -> Vec<Vec<u8>> {
    let pixel = |place: &Place, i: usize| truth(&place.at((i % WIDTH) as f64, (i / WIDTH) as f64), slope);
    let picture = |place: &Place| {
        (0..WIDTH * HEIGHT).map(|i| pixel(place, i).round().clamp(0.0, 255.0) as u8).collect()
    };
    sweep.iter().map(picture).collect()
}

fn build(sweep: &[Place], pictures: &[Vec<u8>], settings: &VolumeSettings) -> Volume {
    let slices: Vec<Slice<'_>> =
        sweep.iter().zip(pictures).map(|(place, pixels)| Slice::new(pixels, WIDTH, place.map())).collect();
    Volume::build(&slices, settings).expect("a volume")
}

fn settings() -> VolumeSettings {
    let holes = Some(Holes::Swept(Swept { longest_m: 8e-3 }));
    VolumeSettings { weights: Weights::Nearest, holes, ..VolumeSettings::every_mm(SPACING_M * 1e3) }
}

/// How far (in pixels) a point is inside of what two neighbours swept, by trying many instants: positive inside,
/// negative outside, `None` where it is passed more than once or never.
fn inside(pair: &[Place], point: &Vector3<f64>) -> Option<f64> {
    const STEPS: usize = 200;
    let at = |step: usize| {
        let t = step as f64 / STEPS as f64;
        let way = |u: f64, v: f64| pair[0].at(u, v) * (1.0 - t) + pair[1].at(u, v) * t;
        let (origin, column, row) =
            (way(0.0, 0.0), way(1.0, 0.0) - way(0.0, 0.0), way(0.0, 1.0) - way(0.0, 0.0));
        (column.cross(&row).dot(&(point - origin)), origin, column, row)
    };
    let sides: Vec<f64> = (0..=STEPS).map(|step| at(step).0).collect();
    let crossings: Vec<usize> = (0..STEPS).filter(|i| sides[*i] * sides[i + 1] <= 0.0).collect();
    let &[crossing] = crossings.as_slice() else { return None };
    let (_, origin, column, row) = at(crossing);
    let off = point - origin;
    // Pixels are square and the turns are small.
    let (u, v) = (off.dot(&column) / column.norm_squared(), off.dot(&row) / row.norm_squared());
    let margin = |at: f64, size: usize| (at + 0.5).min(size as f64 - 0.5 - at);
    Some(margin(u, WIDTH).min(margin(v, HEIGHT)))
}

proptest! {
    #![proptest_config(seeded(60))]

    #[test]
    fn what_was_swept_is_filled_with_what_is_there_and_nothing_else(
        sweep in sweep(),
        slope in [-8e3..8e3_f64, -8e3..8e3_f64, -8e3..8e3_f64].prop_map(Vector3::from),
    ) {
        let pictures = pictures(&sweep, &slope);
        let volume = build(&sweep, &pictures, &settings());
        let grid = volume.grid();
        for index in 0..volume.grey().len() {
            let [nx, ny, _] = grid.size;
            let at = grid.centre([index % nx, index / nx % ny, index / (nx * ny)]).vector();
            let pairs: Vec<f64> = sweep.windows(2).filter_map(|pair| inside(pair, &at)).collect();
            let deepest = pairs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            match volume.marks()[index] {
                Mark::Seen => {}
                Mark::Unseen => prop_assert!(deepest < 0.3, "{at:?} lies {deepest} pixels inside the sweep"),
                Mark::Filled => {
                    prop_assert!(deepest > -0.3, "{at:?} lies {deepest} pixels outside of the sweep");
                    let (found, wanted) = (f64::from(volume.grey()[index]), truth(&at, &slope));
                    // At the rim a mean of two pixels stands for one; a ramp of 8 levels a millimetre moves by one.
                    let slack = if deepest < 2.0 { 4.0 } else { 1.6 };
                    let there = (0.0..=255.0).contains(&wanted);
                    prop_assert!(!there || (found - wanted).abs() < slack, "{found} for {wanted} at {deepest}");
                }
            }
        }
    }
}

/// Three images along z.
fn stack(z_mm: &[f64]) -> Vec<Place> {
    z_mm.iter()
        .map(|z| Place { first: Vector3::new(0.0, 0.0, z * 1e-3), turn: Rotation3::identity() })
        .collect()
}

#[test]
fn nothing_is_swept_across_a_jump() {
    let sweep = stack(&[0.0, 3.0, 30.0, 32.0]);
    let pictures = vec![vec![50; WIDTH * HEIGHT]; 4];
    let volume = build(&sweep, &pictures, &settings());
    let layer = |z: usize| volume.at([5, 5, z]);
    assert!((0..=6).chain(60..=64).all(|z| layer(z) == Some(50)), "between neighbours");
    assert!((7..60).all(|z| layer(z).is_none()), "between sweeps");
}

#[test]
fn the_nearer_image_counts_more_and_the_region_ends_the_sweep() {
    let sweep = stack(&[0.0, 2.0]);
    let pictures = [vec![40; WIDTH * HEIGHT], vec![200; WIDTH * HEIGHT]];
    let rectangle = Some(Rectangle { origin: [4, 6], size: [20, 10] });
    let grid =
        Grid { origin: Point::from_vector(Vector3::zeros()), spacing_m: [SPACING_M; 3], size: [20, 15, 5] };
    let region = Region { rectangle, fan: None };
    let volume = build(&sweep, &pictures, &VolumeSettings { grid: Some(grid), region, ..settings() });
    assert_eq!([0, 1, 2, 3, 4].map(|z| volume.at([5, 5, z])), [40, 80, 120, 160, 200].map(Some));
    for x in 0..20 {
        for y in 0..15 {
            let used = (2..12).contains(&x) && (3..8).contains(&y);
            assert_eq!(volume.at([x, y, 2]).is_some(), used, "{x} {y}");
        }
    }
}
