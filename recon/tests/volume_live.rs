//! A volume that grows image by image is at any time the one that is built of the same images at once.

use nalgebra::{Rotation3, Vector3};
use probepath_frames::{Point, World};
use probepath_recon::volume::{
    Compounding, Grid, Holes, Importance, LiveVolume, Slice, Sticks, Swept, Volume, VolumeError,
    VolumeSettings, Weights,
};
use probepath_us_capture::PixelMap;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

const WIDTH: usize = 24;
const HEIGHT: usize = 18;

fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// Images anywhere within a few centimetres, at any turn, with pixels of 0.2 to 0.6 mm.
fn image() -> impl Strategy<Value = (Vec<u8>, PixelMap<World>)> {
    let place = [-0.02..0.02_f64, -0.02..0.02_f64, -0.03..0.03_f64].prop_map(Vector3::from);
    let turn = [-3.0..3.0_f64, -3.0..3.0_f64, -3.0..3.0_f64].prop_map(Vector3::from);
    (proptest::collection::vec(any::<u8>(), WIDTH * HEIGHT), place, turn, 2e-4..6e-4_f64).prop_map(
        |(pixels, place, turn, pixel)| {
            let turn = Rotation3::new(turn);
            let (column, row) = (turn * Vector3::x() * pixel, turn * Vector3::y() * pixel);
            (pixels, PixelMap::new(Point::from_vector(place), column, row))
        },
    )
}

fn settings() -> impl Strategy<Value = VolumeSettings> {
    let weights = prop_oneof![Just(Weights::Nearest), Just(Weights::Linear)];
    let compounding =
        prop_oneof![Just(Compounding::Mean), Just(Compounding::Maximum), Just(Compounding::Latest)];
    let holes = prop_oneof![
        Just(None),
        Just(Some(Holes::Swept(Swept { longest_m: 0.03 }))),
        Just(Some(Holes::Sticks(Sticks { longest: 5, at_least: 2 })))
    ];
    let importance =
        proptest::option::of(Just(Importance { columns: 3, rows: 1, weights: vec![0, 100, 255] }));
    // A grid that holds some of the images and cuts others.
    let grid =
        Grid { origin: Point::new(-0.01, -0.012, -0.02), spacing_m: [7e-4, 8e-4, 9e-4], size: [30, 25, 40] };
    let grid = proptest::option::of(Just(grid));
    (weights, compounding, holes, importance, grid).prop_map(
        |(weights, compounding, holes, importance, grid)| VolumeSettings {
            weights,
            compounding,
            holes,
            importance,
            grid,
            ..VolumeSettings::every_mm(0.7)
        },
    )
}

proptest! {
    #![proptest_config(seeded(150))]

    #[test]
    fn a_live_volume_is_the_volume_of_the_images_so_far(
        images in proptest::collection::vec(image(), 1..6),
        settings in settings(),
    ) {
        let slices: Vec<Slice<'_>> =
            images.iter().map(|(pixels, map)| Slice::new(pixels, WIDTH, *map)).collect();
        let mut live = LiveVolume::new(&settings).expect("a volume");
        for (number, slice) in slices.iter().enumerate() {
            live.insert(slice).expect("inserted");
            let view = live.view().expect("a view");
            let grid = Some(live.grid().expect("a grid"));
            let batch = Volume::build(&slices[..=number], &VolumeSettings { grid, ..settings.clone() });
            let batch = batch.expect("a volume");
            prop_assert_eq!(view.grid(), batch.grid());
            let voxels = view.marks().iter().zip(batch.marks()).zip(view.grey().iter().zip(batch.grey()));
            let differ = voxels.enumerate().find(|(_, (marks, grey))| marks.0 != marks.1 || grey.0 != grey.1);
            prop_assert_eq!(differ, None, "after image {}", number);
        }
    }
}

#[test]
fn what_would_not_fit_is_refused_and_leaves_the_volume_as_it_was() {
    let pixels = vec![90; WIDTH * HEIGHT];
    let at = |x: f64| {
        let map = PixelMap::<World>::new(Point::new(x, 0.0, 0.0), Vector3::x() * 5e-4, Vector3::y() * 5e-4);
        Slice::new(&pixels, WIDTH, map)
    };
    let settings = VolumeSettings { most_bytes: 2 << 20, ..VolumeSettings::every_mm(0.5) };
    let mut live = LiveVolume::new(&settings).expect("a volume");
    assert!(matches!(live.view(), Err(VolumeError::NoImages)));
    live.insert(&at(0.0)).expect("fits");
    let before = live.view().expect("a view");
    assert!(matches!(live.insert(&at(30.0)), Err(VolumeError::TooLarge { .. })));
    assert!(matches!(live.insert(&at(f64::NAN)), Err(VolumeError::BadSlice { image: 1, .. })));
    assert!(matches!(live.insert(&at(1e9)), Err(VolumeError::OffGrid { image: 1 })));
    assert!(live.view().expect("a view") == before && live.images() == 1);
    let median = VolumeSettings { compounding: Compounding::Median, ..settings };
    assert!(matches!(LiveVolume::new(&median), Err(VolumeError::NotLive)));
}
