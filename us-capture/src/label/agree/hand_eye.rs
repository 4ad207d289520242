//! Without a known place: image on the probe and phantom in the world together, P X = Y F (robot-world and hand-eye:
//! Shah 2013), robustly, over the choices of candidates that turn as the probe turns.

use nalgebra::{Isometry3, Matrix3, Rotation3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

use super::Verdict;
use super::views::{View, Views, mean_rotation};

type Pair = (Isometry3<f64>, Isometry3<f64>);
type Both = (Isometry3<f64>, Isometry3<f64>);

/// An image turned against another as the probe did, within this (rad): twins of a phantom are half turns apart.
const TURNED_ALIKE_RAD: f64 = 0.35;
/// Images that are tried as the one the others are compared with, and how many of their candidates.
const REFERENCES: usize = 6;
const OF_EACH: usize = 4;
/// No more images than this are solved with.
const SOLVED: usize = 80;
/// How many solutions are looked at closely.
const CLOSELY: usize = 4;
/// Distances beyond this (m) count less.
const HUBER_M: f64 = 3e-3;

pub(super) fn verdicts(views: &Views<'_>) -> Vec<Verdict> {
    let mut first: Vec<(f64, Both)> = Vec::new();
    let step = views.views.len().div_ceil(REFERENCES).max(1);
    for reference in views.views.iter().skip(step / 2).step_by(step) {
        for candidate in 0..reference.candidates.len().min(OF_EACH) {
            let pairs = alike(views, reference, candidate);
            if let Some(both) = solved(&pairs, views) {
                first.push((misfit(&pairs, &both, views) / pairs.len() as f64, both));
            }
        }
    }
    first.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<Both> = Vec::new();
    for (_, both) in first {
        let same = |k: &Both| {
            k.0.rotation.angle_to(&both.0.rotation) < 0.2 && k.1.rotation.angle_to(&both.1.rotation) < 0.2
        };
        if kept.len() < CLOSELY && !kept.iter().any(same) {
            kept.push(both);
        }
    }
    kept.into_iter().map(|both| closely(views, both)).collect()
}

/// Of every image (of some), the candidate that is turned against the reference as the probe was.
fn alike(views: &Views<'_>, reference: &View, candidate: usize) -> Vec<Pair> {
    let f0 = reference.candidates[candidate].phantom_from_image.rotation;
    let Some(p0) = reference.poses[0] else { return Vec::new() };
    let pair = |v: &View| {
        let pose = v.poses[0]?;
        let turned = p0.rotation.angle_to(&pose.rotation);
        let off = |f: &Isometry3<f64>| (f0.angle_to(&f.rotation) - turned).abs();
        let alike = v.candidates.iter().map(|c| (off(&c.phantom_from_image) + 0.2 * (1.0 - c.weight), c));
        let (off, best) = alike.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (off < TURNED_ALIKE_RAD + 0.2).then_some((pose, best.phantom_from_image))
    };
    let step = views.views.len().div_ceil(SOLVED).max(1);
    views.views.iter().step_by(step).filter_map(pair).collect()
}

/// The better of what translations and what rotations say, refined.
fn solved(pairs: &[Pair], views: &Views<'_>) -> Option<Both> {
    if pairs.len() < 3 {
        return None;
    }
    let starts = [by_translations(pairs, views), by_rotations(pairs)];
    let refined = starts.into_iter().flatten().map(|start| {
        let mut both = start;
        for _ in 0..8 {
            both = stepped(pairs, &both, views);
        }
        both
    });
    refined.min_by(|a, b| misfit(pairs, a, views).total_cmp(&misfit(pairs, b, views)))
}

/// The phantom's turn from how the image's middle and the probe's marker moved.
fn by_translations(pairs: &[Pair], views: &Views<'_>) -> Option<Both> {
    let seen: Vec<_> = pairs.iter().map(|(_, f)| (f * views.probes[0]).coords).collect();
    let moved: Vec<_> = pairs.iter().map(|(p, _)| p.translation.vector).collect();
    let y = turn_between(&centred(&seen), &centred(&moved))?;
    let x: Vec<_> = pairs.iter().map(|(p, f)| p.rotation.inverse() * y * f.rotation).collect();
    translated(pairs, mean_rotation(&x), y)
}

/// The image's turn on the probe from how both turned.
fn by_rotations(pairs: &[Pair]) -> Option<Both> {
    let (p0, f0) = pairs.get(pairs.len() / 2)?;
    let seen: Vec<_> =
        pairs.iter().map(|(_, f)| (f0.rotation.inverse() * f.rotation).scaled_axis()).collect();
    let turned: Vec<_> =
        pairs.iter().map(|(p, _)| (p0.rotation.inverse() * p.rotation).scaled_axis()).collect();
    let x = turn_between(&seen, &turned)?;
    let y: Vec<_> = pairs.iter().map(|(p, f)| p.rotation * x * f.rotation.inverse()).collect();
    translated(pairs, x, mean_rotation(&y))
}

fn centred(of: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mean = of.iter().sum::<Vector3<f64>>() / of.len().max(1) as f64;
    of.iter().map(|v| v - mean).collect()
}

/// The proper rotation that takes one set of vectors to the other best (Wahba; Markley 1988).
fn turn_between(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<UnitQuaternion<f64>> {
    let sum: Matrix3<f64> = from.iter().zip(to).map(|(a, b)| b * a.transpose()).sum();
    let svd = sum.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    let proper = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * vt).determinant()));
    let turn = Rotation3::from_matrix_unchecked(u * proper * vt);
    turn.matrix().iter().all(|x| x.is_finite()).then(|| UnitQuaternion::from_rotation_matrix(&turn))
}

/// The translations that belong to given turns: least squares, hardly held where the poses leave them open.
fn translated(pairs: &[Pair], x: UnitQuaternion<f64>, y: UnitQuaternion<f64>) -> Option<Both> {
    let mut square = SMatrix::<f64, 6, 6>::identity() * 1e-6;
    let mut column = SVector::<f64, 6>::zeros();
    for (p, f) in pairs {
        let mut j = SMatrix::<f64, 3, 6>::zeros();
        j.fixed_columns_mut::<3>(0).copy_from(p.rotation.to_rotation_matrix().matrix());
        j.fixed_columns_mut::<3>(3).copy_from(&-Matrix3::identity());
        square += j.transpose() * j;
        column += j.transpose() * (y * f.translation.vector - p.translation.vector);
    }
    let at = square.cholesky()?.solve(&column);
    let part = |i: usize| Translation3::new(at[i], at[i + 1], at[i + 2]);
    Some((Isometry3::from_parts(part(0), x), Isometry3::from_parts(part(3), y)))
}

fn misfit(pairs: &[Pair], (x, y): &Both, views: &Views<'_>) -> f64 {
    let off = |(p, f): &Pair| {
        let square: f64 = views.probes.iter().map(|q| (p * (x * q) - y * (f * q)).norm_squared()).sum();
        let off = (square / 3.0).sqrt();
        if off < HUBER_M { off * off } else { HUBER_M * (2.0 * off - HUBER_M) }
    };
    pairs.iter().map(off).sum()
}

/// One step of Gauss-Newton on the distances between where the probe's pose and where the phantom puts the image.
fn stepped(pairs: &[Pair], (x, y): &Both, views: &Views<'_>) -> Both {
    let mut square = SMatrix::<f64, 12, 12>::zeros();
    let mut column = SVector::<f64, 12>::zeros();
    for (p, f) in pairs {
        let turn = *p.rotation.to_rotation_matrix().matrix();
        for q in &views.probes {
            let (on_probe, in_phantom) = (x.rotation * q, y.rotation * (f * q));
            let off = p * (x * q) - y * (f * q);
            let mut j = SMatrix::<f64, 3, 12>::zeros();
            j.fixed_columns_mut::<3>(0).copy_from(&(-turn * on_probe.coords.cross_matrix()));
            j.fixed_columns_mut::<3>(3).copy_from(&turn);
            j.fixed_columns_mut::<3>(6).copy_from(&in_phantom.coords.cross_matrix());
            j.fixed_columns_mut::<3>(9).copy_from(&-Matrix3::identity());
            let weight = (HUBER_M / off.norm().max(HUBER_M)).min(1.0);
            square += j.transpose() * j * weight;
            column -= j.transpose() * off * weight;
        }
    }
    for i in 0..12 {
        square[(i, i)] = square[(i, i)] * (1.0 + 1e-6) + 1e-9;
    }
    let Some(by) = square.cholesky().map(|c| c.solve(&column)) else { return (*x, *y) };
    let part = |i: usize| Vector3::new(by[i], by[i + 1], by[i + 2]);
    let moved = |pose: &Isometry3<f64>, i: usize| {
        let turn = part(i) * (0.5 / part(i).norm().max(1e-12)).min(1.0);
        let to = Translation3::from(pose.translation.vector + part(i + 3));
        Isometry3::from_parts(to, UnitQuaternion::from_scaled_axis(turn) * pose.rotation)
    };
    (moved(x, 0), moved(y, 6))
}

/// The lag that the images agree on best, and both places with it.
fn closely(views: &Views<'_>, start: Both) -> Verdict {
    let mut best = views.judge(start.0, start.1, 0);
    for lag in 0..views.lags.len() {
        let mut both = start;
        for gate in [8.0 * views.gate_m, 4.0 * views.gate_m, 2.0 * views.gate_m, views.gate_m] {
            let pairs = chosen(views, &both, lag, gate);
            if pairs.len() >= 3 {
                both = stepped(&pairs, &stepped(&pairs, &both, views), views);
            }
        }
        let verdict = views.judge(both.0, both.1, lag);
        if verdict.worth > best.worth {
            best = verdict;
        }
    }
    best
}

fn chosen(views: &Views<'_>, both: &Both, lag: usize, gate: f64) -> Vec<Pair> {
    let step = views.views.len().div_ceil(SOLVED).max(1);
    let pair = |v: &View| {
        let best = views.best(v, lag, (&both.0, &both.1), gate)?;
        Some((v.poses[lag]?, v.candidates[best.0].phantom_from_image))
    };
    views.views.iter().step_by(step).filter_map(pair).collect()
}
