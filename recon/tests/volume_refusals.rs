//! Places, sizes and settings that make no sense: an error or a volume of the grid's size, never a panic.

use std::sync::atomic::{AtomicU32, Ordering};

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::volume::{
    Compounding, Grid, Holes, Importance, Mark, Region, Slice, Sticks, Swept, Volume, VolumeError,
    VolumeSettings, Weights,
};
use probepath_us_capture::PixelMap;
use probepath_us_capture::plus::{Fan, FanArc, Rectangle};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

const WILD: [f64; 12] = [
    0.0,
    -0.0,
    1e-3,
    -2e-3,
    1.0,
    -1e6,
    1e300,
    1e-300,
    f64::MIN_POSITIVE,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];
const COUNTS: [usize; 8] = [0, 1, 2, 5, 100, 1 << 31, usize::MAX / 2, usize::MAX];

/// Mostly a sensible length (m), now and then none.
fn length() -> impl Strategy<Value = f64> {
    prop_oneof![12 => -3e-3..3e-3_f64, 1 => prop::sample::select(&WILD[..])]
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    [length(), length(), length()].prop_map(Vector3::from)
}

fn count() -> impl Strategy<Value = usize> {
    prop_oneof![5 => 0_usize..8, 1 => prop::sample::select(&COUNTS[..])]
}

fn region() -> impl Strategy<Value = Region> {
    let rectangle =
        ([count(), count()], [count(), count()]).prop_map(|(origin, size)| Rectangle { origin, size });
    let number = || prop_oneof![4 => -10.0..10.0_f64, 1 => prop::sample::select(&WILD[..])];
    let arc = (number(), number()).prop_map(|(start, stop)| FanArc { start, stop });
    let fan = ([number(), number()], [number(), number()], prop::option::of(arc))
        .prop_map(|(origin_px, angles_rad, radius_px)| Fan { origin_px, angles_rad, radius_px });
    (prop::option::of(rectangle), prop::option::weighted(0.3, fan))
        .prop_map(|(rectangle, fan)| Region { rectangle, fan })
}

fn settings() -> impl Strategy<Value = VolumeSettings> {
    let spacing = || prop_oneof![8 => 2e-4..3e-3_f64, 1 => prop::sample::select(&WILD[..])];
    let spacing = move || [spacing(), spacing(), spacing()];
    let grid = (vector(), spacing(), [count(), count(), count()])
        .prop_map(|(origin, spacing_m, size)| Grid { origin: Point::from_vector(origin), spacing_m, size });
    let sticks =
        (count(), count()).prop_map(|(longest, at_least)| Holes::Sticks(Sticks { longest, at_least }));
    let swept = length().prop_map(|longest_m| Holes::Swept(Swept { longest_m: 3.0 * longest_m }));
    let holes = prop_oneof![sticks, swept];
    let importance = (count(), count(), prop::collection::vec(any::<u8>(), 0..9))
        .prop_map(|(columns, rows, weights)| Importance { columns, rows, weights });
    let weights = prop_oneof![Just(Weights::Nearest), Just(Weights::Linear)];
    let compounding = prop_oneof![
        Just(Compounding::Mean),
        Just(Compounding::Maximum),
        Just(Compounding::Latest),
        Just(Compounding::Median),
    ];
    let options = (prop::option::of(grid), prop::option::of(holes), prop::option::weighted(0.05, importance));
    (spacing(), options, weights, compounding, region()).prop_map(
        |(spacing_m, (grid, holes, importance), weights, compounding, region)| VolumeSettings {
            spacing_m,
            grid,
            weights,
            compounding,
            region,
            importance,
            holes,
            most_bytes: 1 << 20,
        },
    )
}

const CASES: u32 = 8000;
static CALLS: AtomicU32 = AtomicU32::new(0);
static BUILT: AtomicU32 = AtomicU32::new(0);

type Image = (Vec<u8>, usize, [Vector3<f64>; 3]);

/// Mostly pixels that fill their rows.
fn image() -> impl Strategy<Value = Image> {
    let whole = (1_usize..8, 1_usize..6)
        .prop_flat_map(|(width, height)| (prop::collection::vec(any::<u8>(), width * height), Just(width)));
    let torn = (prop::collection::vec(any::<u8>(), 0..30), count());
    let place = [vector(), vector(), vector()];
    (prop_oneof![5 => whole, 1 => torn], place).prop_map(|((pixels, width), place)| (pixels, width, place))
}

proptest! {
    #![proptest_config(seeded(CASES))]

    #[test]
    fn nonsense_is_an_error_or_a_volume_of_its_grid(
        images in prop::collection::vec(image(), 0..3),
        settings in settings(),
    ) {
        let map = |[first, column, row]: [Vector3<f64>; 3]| {
            PixelMap::<World>::new(Point::from_vector(first), column, row)
        };
        let slices: Vec<Slice<'_>> =
            images.iter().map(|(pixels, width, place)| Slice::new(pixels, *width, map(*place))).collect();
        match Volume::build(&slices, &settings) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(volume) => {
                BUILT.fetch_add(1, Ordering::Relaxed);
                prop_assert_eq!(Some(volume.grey().len()), volume.grid().voxels());
                prop_assert_eq!(volume.marks().len(), volume.grey().len());
                let unseen = volume.marks().iter().zip(volume.grey()).filter(|(m, _)| **m == Mark::Unseen);
                prop_assert!(unseen.into_iter().all(|(_, grey)| *grey == 0));
                prop_assert!(settings.memory_bytes(volume.grid()) <= settings.most_bytes);
            }
        }
        // The proptest runner calls this body case after case; the last one knows how many came through.
        let calls = CALLS.fetch_add(1, Ordering::Relaxed) + 1;
        prop_assert!(calls < CASES || BUILT.load(Ordering::Relaxed) > CASES / 10, "hardly any volume was built");
    }
}

/// Four by three pixels of a millimetre at `place`.
fn build(place: Vector3<f64>, settings: &VolumeSettings) -> Result<Volume, VolumeError> {
    let map = PixelMap::<World>::new(Point::from_vector(place), Vector3::x() * 1e-3, Vector3::y() * 1e-3);
    Volume::build(&[Slice::new(&[9; 12], 4, map)], settings)
}

#[test]
fn every_refusal_has_its_reason() {
    let plain = VolumeSettings::every_mm(1.0);
    let small = Grid { origin: Point::from_vector(Vector3::zeros()), spacing_m: [1e-3; 3], size: [2, 2, 2] };
    let on = |grid: Grid| VolumeSettings { grid: Some(grid), ..plain.clone() };
    let huge = on(Grid { size: [10_000, 10_000, 10_000], ..small.clone() });
    assert!(matches!(build(Vector3::zeros(), &huge), Err(VolumeError::TooLarge { .. })));
    let empty = on(Grid { size: [2, 0, 2], ..small.clone() });
    assert!(matches!(build(Vector3::zeros(), &empty), Err(VolumeError::BadGrid { .. })));
    let flat = VolumeSettings { spacing_m: [1e-3, 0.0, 1e-3], ..plain.clone() };
    assert!(matches!(build(Vector3::zeros(), &flat), Err(VolumeError::BadGrid { .. })));
    let far = build(Vector3::x() * 1e9, &on(small.clone()));
    assert!(matches!(far, Err(VolumeError::OffGrid { image: 0 })));
    let lost = build(Vector3::repeat(f64::NAN), &on(small));
    assert!(matches!(lost, Err(VolumeError::BadSlice { image: 0, .. })));
    let beside = Region { rectangle: Some(Rectangle { origin: [4, 0], size: [2, 2] }), fan: None };
    let beside = VolumeSettings { region: beside, ..plain.clone() };
    assert!(matches!(build(Vector3::zeros(), &beside), Err(VolumeError::NothingLeft { image: 0, .. })));
    assert!(matches!(Volume::build(&[], &plain), Err(VolumeError::NoImages)));
}
