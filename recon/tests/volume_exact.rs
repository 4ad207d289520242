//! A volume is what going through every pixel and every voxel by hand gives, for every way of building it.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::volume::{
    Compounding, Grid, Holes, Importance, Mark, Region, Slice, Sticks, Swept, Tiles, Volume, VolumeSettings,
    Weights,
};
use probepath_us_capture::PixelMap;
use probepath_us_capture::plus::Rectangle;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// A spacing and steps that doubles hold exactly, so that both roads see the same places.
const SPACING_M: f64 = 1.0 / 1024.0;
/// Parts of a voxel that places are multiples of: what ten bits of fraction hold.
const PARTS: i64 = 1024;

fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// An image and its place in 1024ths of a voxel.
#[derive(Clone, Debug)]
struct Case {
    width: usize,
    pixels: Vec<u8>,
    first: [i64; 3],
    column: [i64; 3],
    row: [i64; 3],
}

impl Case {
    fn at(&self, column: usize, row: usize) -> [i64; 3] {
        [0, 1, 2].map(|a| self.first[a] + self.column[a] * column as i64 + self.row[a] * row as i64)
    }

    fn slice(&self) -> Slice<'_> {
        let metres = |parts: [i64; 3]| Vector3::from(parts.map(|p| p as f64 / PARTS as f64 * SPACING_M));
        let first = Point::<World>::from_vector(metres(self.first));
        Slice::new(&self.pixels, self.width, PixelMap::new(first, metres(self.column), metres(self.row)))
    }
}

fn case() -> impl Strategy<Value = Case> {
    let place = || [-2 * PARTS..8 * PARTS, -2 * PARTS..8 * PARTS, -2 * PARTS..8 * PARTS];
    // Steps from a hundredth of a voxel to three, of either sign, and none along some axes.
    let along = || prop_oneof![1 => Just(0), 3 => -PARTS..PARTS, 1 => -3 * PARTS..3 * PARTS];
    let step = move || [along(), along(), along()];
    (1_usize..9, 1_usize..7, place(), step(), step())
        .prop_flat_map(|(width, height, first, column, row)| {
            let pixels = proptest::collection::vec(any::<u8>(), width * height);
            (Just((width, first, column, row)), pixels)
        })
        .prop_map(|((width, first, column, row), pixels)| Case { width, pixels, first, column, row })
}

fn cases() -> impl Strategy<Value = (Vec<Case>, [usize; 3])> {
    (proptest::collection::vec(case(), 1..5), [1_usize..7, 1_usize..7, 1_usize..7])
}

fn settings(size: [usize; 3], weights: Weights, compounding: Compounding) -> VolumeSettings {
    let grid = Grid { origin: Point::from_vector(Vector3::zeros()), spacing_m: [SPACING_M; 3], size };
    VolumeSettings { grid: Some(grid), weights, compounding, ..VolumeSettings::every_mm(1.0) }
}

fn build(cases: &[Case], settings: &VolumeSettings) -> Volume {
    let slices: Vec<Slice<'_>> = cases.iter().map(Case::slice).collect();
    Volume::build(&slices, settings).expect("a volume")
}

/// How much a voxel gets of a pixel: nearest 0 or 1, linear in 2^30ths.
fn weight(weights: Weights, voxel: [usize; 3], at: [i64; 3]) -> u64 {
    let off = [0, 1, 2].map(|axis| at[axis] - voxel[axis] as i64 * PARTS);
    match weights {
        Weights::Nearest => u64::from(off.iter().all(|d| (-PARTS / 2..PARTS / 2).contains(d))),
        Weights::Linear => off.iter().map(|d| (PARTS - d.abs()).max(0) as u64).product(),
    }
}

/// The pixels a voxel gets, in order, with their weights.
fn hits(
    cases: &[Case],
    weights: Weights,
    voxel: [usize; 3],
    importance: impl Fn(&Case, usize, usize) -> u64,
) -> Vec<(u64, u8)> {
    let mut hits = Vec::new();
    for case in cases {
        for (index, grey) in case.pixels.iter().enumerate() {
            let (column, row) = (index % case.width, index / case.width);
            let weight = weight(weights, voxel, case.at(column, row)) * importance(case, column, row);
            if weight > 0 {
                hits.push((weight, *grey));
            }
        }
    }
    hits
}

fn compounded(hits: &[(u64, u8)], compounding: Compounding) -> Option<u8> {
    let last = hits.last()?;
    match compounding {
        Compounding::Latest => Some(last.1),
        Compounding::Maximum => hits.iter().map(|h| h.1).max(),
        Compounding::Mean => {
            let total: u128 = hits.iter().map(|h| u128::from(h.0)).sum();
            let sum: u128 = hits.iter().map(|h| u128::from(h.0) * u128::from(h.1)).sum();
            // Rounded to the nearest, a half up.
            Some(((2 * sum + total) / (2 * total)) as u8)
        }
        Compounding::Median => {
            let total: u128 = hits.iter().map(|h| u128::from(h.0)).sum();
            let up_to = |grey: u8| hits.iter().filter(|h| h.1 <= grey).map(|h| u128::from(h.0)).sum::<u128>();
            (0..=255).find(|grey| 2 * up_to(*grey) >= total)
        }
    }
}

fn voxels(size: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let [nx, ny, nz] = size;
    (0..nx * ny * nz).map(move |i| [i % nx, i / nx % ny, i / (nx * ny)])
}

const WAYS: [(Weights, Compounding); 8] = [
    (Weights::Nearest, Compounding::Mean),
    (Weights::Nearest, Compounding::Maximum),
    (Weights::Nearest, Compounding::Latest),
    (Weights::Nearest, Compounding::Median),
    (Weights::Linear, Compounding::Mean),
    (Weights::Linear, Compounding::Maximum),
    (Weights::Linear, Compounding::Latest),
    (Weights::Linear, Compounding::Median),
];

const HOLES: [Holes; 2] =
    [Holes::Swept(Swept { longest_m: 6.0 * SPACING_M }), Holes::Sticks(Sticks { longest: 6, at_least: 2 })];

/// The volume in parts put together; `None` when not even a layer fits.
fn parts(cases: &[Case], settings: &VolumeSettings) -> Option<(Vec<u8>, Vec<Mark>)> {
    let slices: Vec<Slice<'_>> = cases.iter().map(Case::slice).collect();
    let tiles = Tiles::new(&slices, settings).ok()?;
    assert!(tiles.memory_bytes() <= settings.most_bytes);
    let (mut grey, mut marks) = (Vec::new(), Vec::new());
    for tile in tiles {
        grey.extend(tile.grey());
        marks.extend(tile.marks());
    }
    Some((grey, marks))
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(work)
}

proptest! {
    #![proptest_config(seeded(1500))]

    #[test]
    fn every_voxel_is_exactly_what_its_pixels_make_of_it((cases, size) in cases()) {
        for (weights, compounding) in WAYS {
            let volume = build(&cases, &settings(size, weights, compounding));
            for voxel in voxels(size) {
                let wanted = compounded(&hits(&cases, weights, voxel, |_, _, _| 1), compounding);
                prop_assert_eq!(volume.at(voxel), wanted, "{:?} {:?} {:?}", weights, compounding, voxel);
            }
        }
    }

    #[test]
    fn a_rectangle_leaves_only_its_pixels(
        (cases, size) in cases(),
        origin in [0_usize..6, 0_usize..5],
        clip in [1_usize..9, 1_usize..7],
    ) {
        let region = Region { rectangle: Some(Rectangle { origin, size: clip }), fan: None };
        let used = |_: &Case, column: usize, row: usize| {
            let across = (origin[0]..origin[0] + clip[0]).contains(&column);
            u64::from(across && (origin[1]..origin[1] + clip[1]).contains(&row))
        };
        let settings = VolumeSettings { region, ..settings(size, Weights::Linear, Compounding::Mean) };
        let volume = build(&cases, &settings);
        for voxel in voxels(size) {
            let wanted = compounded(&hits(&cases, Weights::Linear, voxel, used), Compounding::Mean);
            prop_assert_eq!(volume.at(voxel), wanted, "{:?}", voxel);
        }
    }
}

/// Tables of weights, some of them zero.
fn importance() -> impl Strategy<Value = Importance> {
    (1_usize..5, 1_usize..4).prop_flat_map(|(columns, rows)| {
        let weight = prop_oneof![1 => Just(0), 1 => Just(255), 3 => any::<u8>()];
        proptest::collection::vec(weight, columns * rows).prop_map(move |mut weights| {
            weights[0] = weights[0].max(1);
            Importance { columns, rows, weights }
        })
    })
}

proptest! {
    #![proptest_config(seeded(400))]

    #[test]
    fn a_pixel_counts_what_its_place_in_the_image_and_its_own_weight_say(
        (cases, size) in cases(),
        table in importance(),
        with_table in any::<bool>(),
    ) {
        // Any weights will do as an image's own; the grey levels are some. Wide images have none.
        let own = |case: &Case| case.width < 5;
        let slices: Vec<Slice<'_>> = cases
            .iter()
            .map(|case| if own(case) { case.slice().weighted(&case.pixels) } else { case.slice() })
            .collect();
        let counts = |case: &Case, column: usize, row: usize| {
            let height = case.pixels.len() / case.width;
            let cell = (row * table.rows / height) * table.columns + column * table.columns / case.width;
            let (place, grey) = (u64::from(table.weights[cell]), u64::from(case.pixels[row * case.width + column]));
            match (with_table, own(case)) {
                (true, true) => (place * grey + 127) / 255,
                (true, false) => place,
                (false, true) => grey,
                (false, false) => 255,
            }
        };
        for (weights, compounding) in WAYS {
            let settings = settings(size, weights, compounding);
            let settings = VolumeSettings { importance: with_table.then(|| table.clone()), ..settings };
            let volume = Volume::build(&slices, &settings).expect("a volume");
            for voxel in voxels(size) {
                let wanted = compounded(&hits(&cases, weights, voxel, counts), compounding);
                prop_assert_eq!(volume.at(voxel), wanted, "{:?} {:?} {:?}", weights, compounding, voxel);
            }
        }
    }
}

/// Steps to the first seen voxel in a direction, and its grey level.
fn look(volume: &Volume, from: [usize; 3], direction: [i64; 3], most: i64) -> Option<(i64, u8)> {
    (1..=most).find_map(|steps| {
        let at = [0, 1, 2].map(|a| from[a] as i64 + direction[a] * steps);
        let index = volume.grid().index([
            usize::try_from(at[0]).ok()?,
            usize::try_from(at[1]).ok()?,
            usize::try_from(at[2]).ok()?,
        ])?;
        (volume.marks()[index] == Mark::Seen).then(|| (steps, volume.grey()[index]))
    })
}

/// The hole's value by asking all 26 directions, each stick twice.
fn by_hand(volume: &Volume, hole: [usize; 3], sticks: Sticks) -> Option<f64> {
    let steps = -1..=1_i64;
    let all = steps.clone().flat_map(|z| (-1..=1).flat_map(move |y| (-1..=1).map(move |x| [x, y, z])));
    let mut found: Vec<(i64, f64)> = Vec::new();
    for direction in all.filter(|d| *d != [0; 3]) {
        let most = sticks.longest as i64;
        let (Some(front), Some(rear)) =
            (look(volume, hole, direction, most), look(volume, hole, direction.map(|d| -d), most))
        else {
            continue;
        };
        let voxels = front.0 + rear.0 + 1;
        if voxels <= most {
            let value = (f64::from(front.1) * rear.0 as f64 + f64::from(rear.1) * front.0 as f64)
                / (front.0 + rear.0) as f64;
            found.push((voxels * voxels * direction.iter().map(|d| d * d).sum::<i64>(), value));
        }
    }
    found.sort_by_key(|stick| stick.0);
    // Every stick is there from both of its ends.
    let last = found.get(2 * sticks.at_least.min(found.len() / 2).checked_sub(1)?)?.0;
    let taken = found.iter().filter(|stick| stick.0 <= last);
    let (sum, weights) = taken.fold((0.0, 0.0), |(sum, weights), (squared, value)| {
        let weight = 1.0 / (*squared as f64).sqrt();
        (sum + weight * value, weights + weight)
    });
    Some(sum / weights)
}

proptest! {
    #![proptest_config(seeded(600))]

    #[test]
    fn holes_are_filled_between_seen_voxels_only_and_marked(
        (cases, size) in cases(),
        longest in 1_usize..7,
        at_least in 1_usize..4,
    ) {
        let sticks = Sticks { longest, at_least };
        let open = settings(size, Weights::Nearest, Compounding::Mean);
        let bare = build(&cases, &open);
        let filled = build(&cases, &VolumeSettings { holes: Some(Holes::Sticks(sticks)), ..open });
        for voxel in voxels(size) {
            let index = bare.grid().index(voxel).expect("inside");
            let (before, after) = (bare.marks()[index], filled.marks()[index]);
            if before == Mark::Seen {
                prop_assert_eq!((after, filled.grey()[index]), (Mark::Seen, bare.grey()[index]));
                continue;
            }
            match by_hand(&bare, voxel, sticks) {
                None => prop_assert_eq!((after, filled.grey()[index]), (Mark::Unseen, 0)),
                Some(value) => {
                    prop_assert_eq!(after, Mark::Filled);
                    prop_assert!((f64::from(filled.grey()[index]) - value).abs() <= 0.5 + 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_volume_depends_neither_on_the_number_of_threads_nor_on_being_built_in_parts(
        (cases, size) in cases(),
        swept in any::<bool>(),
        share in 0.1..1.0_f64,
    ) {
        let size = [size[0], size[1], 8 * size[2]];
        let holes = if swept { HOLES[0] } else { HOLES[1] };
        for (weights, compounding) in WAYS {
            let settings = VolumeSettings { holes: Some(holes), ..settings(size, weights, compounding) };
            let [one, three] = [1, 3].map(|threads| on_threads(threads, || build(&cases, &settings)));
            prop_assert!(one == three, "{:?} {:?}", weights, compounding);
            let most_bytes = (settings.memory_bytes(one.grid()) as f64 * share) as u64;
            let parts = on_threads(2, || parts(&cases, &VolumeSettings { most_bytes, ..settings }));
            if let Some((grey, marks)) = parts {
                prop_assert!(grey == one.grey() && marks == one.marks(), "{:?} {:?}", weights, compounding);
            }
        }
    }
}
