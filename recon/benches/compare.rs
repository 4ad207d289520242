//! Exact distances: 100,000 points to a surface of 100,000 triangles, the tree built each time, on one thread.
//!
//! `PROBEPATH_BENCH_FILES=DIR cargo bench -p probepath-recon --bench compare -- --test` also writes the points and the
//! surface, which `benches/peers/compare.py` gives to other programs.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::{Fit, Mesh, Nearest, compare};

/// A narrowing, bending tube of 2 `rows` `around` triangles; `wider` by so much (m), its points off by `noise` (m).
fn tube(rows: usize, around: usize, wider: f64, noise: f64) -> Mesh {
    let mut state = 7_u64;
    let mut dice = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut point = |row: usize, k: usize| -> Point<World> {
        let z = 0.3 * row as f64 / (rows - 1) as f64;
        let angle = std::f64::consts::TAU * k as f64 / around as f64;
        let r = 0.004 - 0.002 * (-((z - 0.1) / 0.006_f64).powi(2)).exp() + wider + noise * dice();
        Point::from_vector(Vector3::new(r * angle.cos() + 0.01 * (z / 0.1).sin(), r * angle.sin(), -z))
    };
    let grid = (0..rows).flat_map(|row| (0..around).map(move |k| (row, k)));
    let points: Vec<Point<World>> = grid.map(|(row, k)| point(row, k)).collect();
    Mesh::tube(&points, (rows, around))
}

fn distances(criterion: &mut Criterion) {
    let gold = tube(500, 100, 0.0, 0.0);
    let points = tube(1000, 100, 0.0, 1e-3).points;
    if let Some(folder) = std::env::var_os("PROBEPATH_BENCH_FILES") {
        save(&gold, &points, folder.as_ref());
    }
    // Points as a stranger may bring them: in no order.
    let mut shuffled = points.clone();
    shuffled.sort_by_key(|p| {
        (p * 1e9).map(|x| x as i64).fold(0_i64, |a, x| a.wrapping_mul(31).wrapping_add(x)) % 9973
    });
    let mut group = criterion.benchmark_group("100k points to 100k triangles");
    group.sample_size(10).throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("tree alone", |b| b.iter(|| Nearest::new(black_box(&gold))));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for (name, points) in [("points in the order of a grid", &points), ("in no order", &shuffled)] {
        let ask = || pool.install(|| Nearest::new(black_box(&gold)).to_each(black_box(points)));
        group.bench_function(name, |b| b.iter(ask));
    }
    group.bench_function("in no order, one by one", |b| {
        b.iter(|| {
            let tree = Nearest::new(black_box(&gold));
            shuffled.iter().map(|p| tree.to(p).distance).sum::<f64>()
        })
    });
    group.finish();
    let surface = tube(300, 20, 1e-4, 1e-4);
    let mut group = criterion.benchmark_group("a lumen of 300 x 20 beside a gold standard of 100k triangles");
    group.sample_size(10);
    for (name, fit) in [("in place", Fit::None), ("rigid", Fit::Rigid), ("icp", Fit::Icp)] {
        group
            .bench_function(name, |b| b.iter(|| compare(black_box(&surface), &gold, fit).expect("surfaces")));
    }
    group.finish();
}

fn save(gold: &Mesh, points: &[Vector3<f64>], folder: &std::path::Path) {
    std::fs::create_dir_all(folder).expect("a folder");
    gold.write(&folder.join("gold.ply")).expect("written");
    let mesh = Mesh { points: points.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
    let nearest = Nearest::new(gold).to_each(points);
    let mesh =
        mesh.with_scalars("distance_mm", nearest.iter().map(|closest| closest.distance * 1e3).collect());
    mesh.write(&folder.join("points.ply")).expect("written");
}

criterion_group!(benches, distances);
criterion_main!(benches);
