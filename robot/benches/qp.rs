//! The small quadratic program of a step, ours beside Clarabel, each solve timed by itself:
//! `cargo bench -p probepath-robot --bench qp`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench prints, and may stop at the first surprise"
)]
#![allow(clippy::disallowed_methods, reason = "a bench asks the wall clock how long a solve takes")]

use std::time::Instant;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SupportedConeT};
use probepath_robot::qp::Qp;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Six or seven joints and the part of the way; six directions; every variable's two ends; a plane.
const N: usize = 8;
const M: usize = 6 + 2 * N + 1;

fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A problem as a step has it, as dense rows: `row · x` equal to (the first six) or at least its bound.
struct Problem {
    n: usize,
    rows: Vec<([f64; N], f64)>,
}

fn problem(rng: &mut ChaCha8Rng, joints: usize) -> Problem {
    let n = joints + 1;
    let goal: Vec<f64> = (0..joints).map(|_| between(rng, -0.3, 0.3)).collect();
    let mut rows = Vec::new();
    for _ in 0..6 {
        let mut row = [0.0; N];
        row[..joints].fill_with(|| between(rng, -1.0, 1.0));
        // At the end of the way the joints reach their goal.
        row[n - 1] = -row.iter().zip(&goal).map(|(a, x)| a * x).sum::<f64>();
        rows.push((row, 0.0));
    }
    for variable in 0..n {
        for (sign, bound) in [(1.0, between(rng, 0.02, 0.4)), (-1.0, between(rng, 0.02, 0.4))] {
            let mut row = [0.0; N];
            row[variable] = sign;
            let last = variable == n - 1;
            rows.push((row, if last { if sign > 0.0 { 0.0 } else { -1.0 } } else { -bound }));
        }
    }
    let mut row = [0.0; N];
    row[..joints].fill_with(|| between(rng, -1.0, 1.0));
    rows.push((row, -0.2));
    Problem { n, rows }
}

fn ours(problem: &Problem) -> [f64; N] {
    let (mut hessian, mut gradient) = ([[0.0; N]; N], [0.0; N]);
    for (i, row) in hessian.iter_mut().enumerate() {
        row[i] = if i == problem.n - 1 { 1.0 } else { 1e-2 };
    }
    gradient[problem.n - 1] = -2.0;
    let mut qp = Qp::<N, M>::new(problem.n, hessian, gradient).unwrap();
    for (i, (row, bound)) in problem.rows.iter().enumerate() {
        if i < 6 { qp.equal(*row, *bound).unwrap() } else { qp.at_least(*row, *bound).unwrap() }
    }
    qp.solve().unwrap().x
}

fn clarabels(problem: &Problem, tight: bool) -> Vec<f64> {
    let n = problem.n;
    let diagonal: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            (0..n)
                .map(|k| {
                    if i != k {
                        0.0
                    } else if i == n - 1 {
                        1.0
                    } else {
                        1e-2
                    }
                })
                .collect()
        })
        .collect();
    let mut gradient = vec![0.0; n];
    gradient[n - 1] = -2.0;
    let rows: Vec<Vec<f64>> =
        problem.rows.iter().map(|(row, _)| row[..n].iter().map(|a| -a).collect()).collect();
    let bounds: Vec<f64> = problem.rows.iter().map(|(_, bound)| -bound).collect();
    let cones = [SupportedConeT::ZeroConeT(6), SupportedConeT::NonnegativeConeT(problem.rows.len() - 6)];
    let mut settings = DefaultSettingsBuilder::default().verbose(false).build().unwrap();
    if tight {
        (settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas) = (1e-15, 1e-15, 1e-15);
    }
    let (hessian, rows) = (CscMatrix::from(&diagonal), CscMatrix::from(&rows));
    let mut solver = DefaultSolver::new(&hessian, &gradient, &rows, &bounds, &cones, settings).unwrap();
    solver.solve();
    solver.solution.x
}

fn timed<T>(problems: &[Problem], solve: impl Fn(&Problem) -> T) -> (Vec<T>, Vec<u64>) {
    let each = problems.iter().map(|problem| {
        let began = Instant::now();
        let solved = solve(problem);
        (solved, began.elapsed().as_nanos() as u64)
    });
    each.unzip()
}

fn report(name: &str, mut took: Vec<u64>) {
    took.sort_unstable();
    let at = |part: f64| took[((took.len() - 1) as f64 * part) as usize] as f64 * 1e-3;
    println!(
        "{name}: {} solves; p50 {:.2} us, p99 {:.2}, p99.9 {:.2}",
        took.len(),
        at(0.5),
        at(0.99),
        at(0.999)
    );
}

fn main() {
    for joints in [6, 7] {
        let mut rng = ChaCha8Rng::seed_from_u64(joints as u64);
        let problems: Vec<_> = (0..20_000).map(|_| problem(&mut rng, joints)).collect();
        let (mine, took) = timed(&problems, ours);
        report(&format!("{joints} joints, ours"), took);
        // With its usual tolerance it stops up to 1e-3 before a minimum as flat as this one.
        for (name, tight) in [("clarabel", false), ("clarabel, as near as it comes", true)] {
            let (theirs, took) = timed(&problems, |problem| clarabels(problem, tight));
            report(&format!("{joints} joints, {name}"), took);
            let apart = |(a, b): (&[f64; N], &Vec<f64>)| {
                a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let most = mine.iter().zip(&theirs).map(apart).fold(0.0, f64::max);
            println!("{joints} joints, {name}: at most {most:.1e} apart");
        }
    }
}
