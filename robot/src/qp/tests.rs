//! Thousands of seeded random problems: the conditions of Karush, Kuhn and Tucker, which a convex problem's minimum
//! alone satisfies, and Clarabel, an interior-point solver, as the independent road.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;

const N: usize = 9;
const M: usize = 33;

fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn row(rng: &mut ChaCha8Rng, n: usize) -> [f64; N] {
    let mut row = [0.0; N];
    row[..n].fill_with(|| between(rng, -1.0, 1.0));
    row
}

/// How the bounds of a random problem come about.
#[derive(Clone, Copy, PartialEq)]
enum Bounds {
    /// Some point keeps every constraint.
    Kept,
    /// As they come: often nothing keeps them all.
    Any,
}

/// A strictly convex problem: `H = A Aᵀ + small`, equalities, a box, and rows in general; some rows twice.
fn problem(rng: &mut ChaCha8Rng, kind: Bounds) -> Qp<N, M> {
    let n = 1 + rng.next_u32() as usize % N;
    let a: Vec<[f64; N]> = (0..N).map(|_| row(rng, n)).collect();
    let small = 10f64.powf(between(rng, -4.0, 0.0));
    let mut hessian = [[0.0; N]; N];
    for i in 0..n {
        for k in 0..n {
            hessian[i][k] = (0..n).map(|m| a[i][m] * a[k][m]).sum::<f64>();
        }
        hessian[i][i] += small;
    }
    let gradient = row(rng, n).map(|x| 3.0 * x);
    let mut qp = Qp::new(n, hessian, gradient).unwrap();
    let inside = row(rng, n);
    let bound = |rng: &mut ChaCha8Rng, row: &[f64; N], room: f64| match kind {
        Bounds::Kept => row.iter().zip(&inside).map(|(a, x)| a * x).sum::<f64>() - between(rng, 0.0, room),
        Bounds::Any => between(rng, -1.0, 0.3),
    };
    for _ in 0..rng.next_u32() as usize % (n + 1) {
        let row = row(rng, n);
        qp.equal(row, bound(rng, &row, 0.0)).unwrap();
    }
    for _ in 0..rng.next_u32() as usize % (M - N) {
        let mut row = match rng.next_u32() % 3 {
            0 => row(rng, n),
            1 if qp.len > 0 => qp.rows[rng.next_u32() as usize % qp.len],
            _ => [0.0; N],
        };
        if row.iter().all(|a| a.abs() <= 0.0) {
            row[rng.next_u32() as usize % n] = if rng.next_u32().is_multiple_of(2) { 1.0 } else { -1.0 };
        }
        qp.at_least(row, bound(rng, &row, 0.2)).unwrap();
    }
    qp
}

/// The largest of what should be zero: the gradient of the Lagrangian, violations, negative multipliers, and
/// multipliers of constraints that do not bind.
fn off_conditions(qp: &Qp<N, M>, solution: &QpSolution<N, M>) -> f64 {
    let (n, x) = (qp.variables, &solution.x);
    let mut worst = 0.0_f64;
    for i in 0..n {
        let symmetric = |k: usize| if k <= i { qp.hessian[i][k] } else { qp.hessian[k][i] };
        let slope: f64 = qp.gradient[i] + (0..n).map(|k| symmetric(k) * x[k]).sum::<f64>();
        let held: f64 = (0..qp.len).map(|c| solution.multipliers[c] * qp.rows[c][i]).sum();
        worst = worst.max((slope - held).abs());
    }
    for c in 0..qp.len {
        let slack: f64 = (0..n).map(|i| qp.rows[c][i] * x[i]).sum::<f64>() - qp.bounds[c];
        let multiplier = solution.multipliers[c];
        let off = if c < qp.equalities {
            slack.abs()
        } else {
            (-slack).max(-multiplier).max((multiplier * slack).abs())
        };
        worst = worst.max(off);
    }
    worst
}

fn usual() -> DefaultSettings<f64> {
    DefaultSettingsBuilder::default().verbose(false).build().unwrap()
}

/// As near as rounding lets it come. With its usual 1e-8 of the objective, a minimum as flat as a step's (the joints'
/// weight is 1e-2 of the part's) is known to some 1e-3 only: that is how far the two were apart.
fn tight() -> DefaultSettings<f64> {
    let mut settings = usual();
    (settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas) = (1e-15, 1e-15, 1e-15);
    settings
}

/// The same problem by Clarabel: the minimum, or none where it finds a certificate that there is none.
fn by_clarabel(qp: &Qp<N, M>, settings: DefaultSettings<f64>) -> Option<Vec<f64>> {
    let n = qp.variables;
    let upper: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|k| if k >= i { qp.hessian[k][i] } else { 0.0 }).collect()).collect();
    let rows: Vec<Vec<f64>> =
        qp.rows[..qp.len].iter().map(|row| row[..n].iter().map(|a| -a).collect()).collect();
    let bounds: Vec<f64> = qp.bounds[..qp.len].iter().map(|b| -b).collect();
    let a = if rows.is_empty() { CscMatrix::zeros((0, n)) } else { CscMatrix::from(&rows) };
    let cones =
        [SupportedConeT::ZeroConeT(qp.equalities), SupportedConeT::NonnegativeConeT(qp.len - qp.equalities)];
    let mut solver =
        DefaultSolver::new(&CscMatrix::from(&upper), &qp.gradient[..n], &a, &bounds, &cones, settings)
            .unwrap();
    solver.solve();
    match solver.solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress => {
            Some(solver.solution.x)
        }
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => None,
        other => panic!("clarabel: {other:?}"),
    }
}

#[test]
fn twenty_thousand_random_problems_end_at_the_minimum() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut worst, mut steps) = (0.0_f64, 0);
    for case in 0..20_000 {
        let qp = problem(&mut rng, Bounds::Kept);
        let solution = qp.solve().unwrap_or_else(|error| panic!("case {case}: {error}"));
        let scale = 1.0 + solution.multipliers.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        let off = off_conditions(&qp, &solution) / scale;
        assert!(off < 1e-8, "case {case}: {off:e} off the conditions of a minimum");
        (worst, steps) = (worst.max(off), steps.max(solution.steps));
    }
    eprintln!("at most {worst:e} off the conditions, at most {steps} steps");
}

#[test]
fn clarabel_finds_the_same_minimum_or_the_same_lack_of_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut solved, mut none, mut worst) = (0, 0, 0.0_f64);
    for case in 0..3000 {
        let qp = problem(&mut rng, if case % 2 == 0 { Bounds::Kept } else { Bounds::Any });
        match (qp.solve(), by_clarabel(&qp, usual())) {
            (Ok(ours), Some(theirs)) => {
                let off = ours.x.iter().zip(&theirs).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
                let size = theirs.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
                assert!(off < 1e-3 * size, "case {case}: {off:e} from clarabel's minimum");
                (solved, worst) = (solved + 1, worst.max(off / size));
            }
            (Err(QpError::Infeasible { .. }), None) => none += 1,
            (ours, theirs) => panic!("case {case}: {ours:?} against {theirs:?}"),
        }
    }
    eprintln!("{solved} solved, at most {worst:e} apart; {none} that nothing satisfies");
    assert!(solved > 1500 && none > 300, "{solved} {none}");
}

fn objective(qp: &Qp<N, M>, x: &[f64]) -> f64 {
    let symmetric = |i: usize, k: usize| if k <= i { qp.hessian[i][k] } else { qp.hessian[k][i] };
    let bent = |i: usize| (0..qp.variables).map(|k| symmetric(i, k) * x[k]).sum::<f64>();
    (0..qp.variables).map(|i| x[i] * (qp.gradient[i] + 0.5 * bent(i))).sum()
}

/// A problem as a step has it: the probe's six directions are kept exactly, as far along the way as the joints' ends and
/// a plane allow.
fn of_a_step(rng: &mut ChaCha8Rng, joints: usize) -> Qp<N, M> {
    let n = joints + 1;
    let (mut hessian, mut gradient) = ([[0.0; N]; N], [0.0; N]);
    for (i, row) in hessian.iter_mut().enumerate().take(n) {
        row[i] = if i == joints { 1.0 } else { 1e-2 };
    }
    gradient[joints] = -2.0;
    let mut qp = Qp::new(n, hessian, gradient).unwrap();
    let goal = row(rng, joints).map(|x| 0.3 * x);
    for _ in 0..6 {
        let mut row = row(rng, joints);
        row[joints] = -row.iter().zip(&goal).map(|(a, x)| a * x).sum::<f64>();
        qp.equal(row, 0.0).unwrap();
    }
    for variable in 0..n {
        let part = variable == joints;
        for (sign, end) in [(1.0, if part { 0.0 } else { -0.4 }), (-1.0, if part { -1.0 } else { -0.4 })] {
            let mut row = [0.0; N];
            row[variable] = sign;
            qp.at_least(row, if part { end } else { end * between(rng, 0.05, 1.0) }).unwrap();
        }
    }
    qp.at_least(row(rng, joints), -0.2).unwrap();
    qp
}

#[test]
fn the_programs_of_steps_with_six_and_seven_joints_have_clarabels_minimum_at_the_tightest_tolerance() {
    for joints in [6, 7] {
        let mut rng = ChaCha8Rng::seed_from_u64(joints as u64);
        let (mut worst, mut conditions, mut better) = (0.0_f64, 0.0_f64, 0.0_f64);
        for case in 0..2000 {
            let qp = of_a_step(&mut rng, joints);
            let ours = qp.solve().unwrap_or_else(|error| panic!("case {case}: {error}"));
            let theirs =
                by_clarabel(&qp, tight()).unwrap_or_else(|| panic!("case {case}: clarabel has none"));
            worst = ours.x.iter().zip(&theirs).fold(worst, |most, (a, b)| most.max((a - b).abs()));
            let scale = 1.0 + ours.multipliers.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
            conditions = conditions.max(off_conditions(&qp, &ours) / scale);
            better = better.max(objective(&qp, &ours.x) - objective(&qp, &theirs));
        }
        eprintln!(
            "{joints} joints: at most {worst:e} from clarabel's, whose objective is at most {better:e} lower; \
             {conditions:e} off the conditions"
        );
        // The conditions say that ours is the minimum. An interior-point method stays inside of limits that bind with
        // next to no multiplier, by the root of what its objective still lacks: six joints leave no choice, seven do.
        assert!(conditions < 1e-13 && better < 1e-9, "{joints} joints: {conditions:e}, {better:e}");
        assert!(worst < if joints == 6 { 1e-10 } else { 2e-5 }, "{joints} joints: {worst:e}");
    }
}

#[test]
fn the_multipliers_say_what_a_constraint_costs() {
    // min ½(x² + y²) with x + y = 2 and x >= 1.5: x = 1.5, y = 0.5.
    let mut qp = Qp::<2, 4>::new(2, [[1.0, 0.0], [0.0, 1.0]], [0.0; 2]).unwrap();
    qp.at_least([1.0, 0.0], 1.5).unwrap();
    qp.at_least([0.0, 1.0], -7.0).unwrap();
    qp.equal([1.0, 1.0], 2.0).unwrap();
    let solution = qp.solve().unwrap();
    assert!((solution.x[0] - 1.5).abs() < 1e-12 && (solution.x[1] - 0.5).abs() < 1e-12);
    // The equality came first by itself; the others changed places for it.
    let mut inequalities = [solution.multipliers[1], solution.multipliers[2]];
    inequalities.sort_by(f64::total_cmp);
    assert!((solution.multipliers[0] - 0.5).abs() < 1e-12, "{:?}", solution.multipliers);
    assert!(inequalities[0] == 0.0 && (inequalities[1] - 1.0).abs() < 1e-12, "{:?}", solution.multipliers);
}

#[test]
fn what_no_number_is_or_does_not_fit_is_refused() {
    let one = [[1.0, 0.0], [0.0, 1.0]];
    let qp = |hessian, gradient, row, bound| {
        let mut qp = Qp::<2, 1>::new(2, hessian, gradient).unwrap();
        qp.at_least(row, bound).unwrap();
        qp.solve().unwrap_err()
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(qp([[bad, 0.0], [0.0, 1.0]], [0.0; 2], [1.0, 0.0], 0.0), QpError::NotFinite);
        assert_eq!(qp(one, [bad, 0.0], [1.0, 0.0], 0.0), QpError::NotFinite);
        assert_eq!(qp(one, [0.0; 2], [bad, 0.0], 0.0), QpError::NotFinite);
        assert_eq!(qp(one, [0.0; 2], [1.0, 0.0], bad), QpError::NotFinite);
    }
    assert_eq!(qp([[1.0, 0.0], [1.0, 1.0]], [0.0; 2], [1.0, 0.0], 0.0), QpError::NotConvex);
    assert_eq!(qp(one, [0.0; 2], [0.0; 2], 1.0), QpError::Infeasible { constraint: 0 });
    assert!(matches!(Qp::<2, 1>::new(3, one, [0.0; 2]), Err(QpError::TooMany { what: "variables", .. })));
    let mut full = Qp::<2, 1>::new(2, one, [0.0; 2]).unwrap();
    full.equal([1.0, 0.0], 0.0).unwrap();
    assert!(matches!(full.at_least([1.0, 0.0], 0.0), Err(QpError::TooMany { found: 2, most: 1, .. })));
}

#[test]
fn numbers_of_any_size_end_in_an_answer_or_an_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..20_000 {
        let wild = |rng: &mut ChaCha8Rng| between(rng, -1.0, 1.0) * 10f64.powf(between(rng, -200.0, 200.0));
        let mut hessian = [[0.0; 4]; 4];
        for row in &mut hessian {
            row.fill_with(|| wild(&mut rng));
        }
        let mut gradient = [0.0; 4];
        gradient.fill_with(|| wild(&mut rng));
        let mut qp = Qp::<4, 8>::new(4, hessian, gradient).unwrap();
        for _ in 0..8 {
            let mut row = [0.0; 4];
            row.fill_with(|| wild(&mut rng));
            qp.at_least(row, wild(&mut rng)).unwrap();
        }
        if let Ok(solution) = qp.solve() {
            assert!(solution.x.iter().all(|x| x.is_finite()));
        }
    }
}
