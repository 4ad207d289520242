//! The quadratic program of one tick: the joints' steps, and the part of the way that is gone.
//!
//! A joint's variable is its step as a part of what its speed allows in a tick; the last variable is the part of the
//! way along the path, between 0 and 1. All rows are rates, m/s and rad/s, so that the numbers are of one size.

use super::{Binding, Look, Plane, Vector6};
use crate::qp::{Qp, QpError};
use crate::{Joints, MAX_JOINTS};

/// Joints and the part of the way.
const N: usize = MAX_JOINTS + 1;
/// Planes that are looked at in one tick: the nearest ones.
pub(super) const PLANES: usize = 8;
/// Six directions, the part's two ends, each joint's two ends, planes, the singularity.
const M: usize = 6 + 2 + 2 * MAX_JOINTS + PLANES + 1;
/// What a step of the joints costs beside the part of the way: so little that the part is one wherever it can be.
const STILL: f64 = 1e-2;
/// The same where the probe has to leave its way: leaving it least comes first, then the part, then the joints.
const SOFT_PART: f64 = 1e-7;
const SOFT_STILL: f64 = 1e-8;
/// A turn of 1 rad is as far off as so many metres: the length of a probe's face and its depth.
const LEVER: f64 = 0.1;

/// What is asked of a tick, as steps of the probe in Base's axes: linear (m), then angular (rad).
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Along the path, for the whole part.
    pub(super) way: Vector6,
    /// Whatever the part.
    pub(super) move_on: Vector6,
    /// Where the joints would go by themselves (rad/s, m/s).
    pub(super) posture: Joints,
}

/// The answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    /// The joints' steps (rad, m).
    pub(super) step: Joints,
    /// The part of the way.
    pub(super) part: f64,
    /// The limit that weighs most.
    pub(super) binding: Option<Binding>,
}

/// The joints that keep the way exactly, as far along it as can be.
pub(super) fn on_the_way(look: &Look, wanted: &Wanted) -> Result<Answer, QpError> {
    let mut program = Program::new(look, STILL, wanted, |_, _| {})?;
    for direction in 0..6 {
        let row = program.row(look, |column| column[direction], -wanted.way[direction] / look.dt);
        program.qp.equal(row, wanted.move_on[direction] / look.dt)?;
    }
    program.limits(look)?;
    program.answer(look)
}

/// The joints that leave the way least.
pub(super) fn off_the_way(look: &Look, wanted: &Wanted) -> Result<Answer, QpError> {
    let mut program = Program::new(look, SOFT_STILL, wanted, |hessian, gradient| {
        hessian[N - 1][N - 1] = SOFT_PART;
        gradient[N - 1] = -2.0 * SOFT_PART;
        for direction in 0..6 {
            let weight = if direction < 3 { 1.0 } else { LEVER * LEVER };
            let row = row_of(look, |column| column[direction], -wanted.way[direction] / look.dt);
            for i in 0..N {
                gradient[i] -= weight * row[i] * wanted.move_on[direction] / look.dt;
                for k in 0..=i {
                    hessian[i][k] += weight * row[i] * row[k];
                }
            }
        }
    })?;
    program.limits(look)?;
    program.answer(look)
}

/// A row over all variables: of each joint's column of the Jacobian, for its whole speed; and of the part.
fn row_of(look: &Look, pick: impl Fn(&Vector6) -> f64, part: f64) -> [f64; N] {
    let mut row = [0.0; N];
    for (joint, (entry, speed)) in row.iter_mut().zip(look.speeds.iter()).enumerate() {
        *entry = pick(&look.reach.jacobian.column(joint)) * speed;
    }
    row[N - 1] = part;
    row
}

/// The program being put together, and what each constraint stands for.
struct Program {
    qp: Qp<N, M>,
    names: [Option<Binding>; M],
}

impl Program {
    fn new(
        look: &Look,
        still: f64,
        wanted: &Wanted,
        more: impl FnOnce(&mut [[f64; N]; N], &mut [f64; N]),
    ) -> Result<Self, QpError> {
        let (mut hessian, mut gradient) = ([[0.0; N]; N], [0.0; N]);
        for (i, row) in hessian.iter_mut().enumerate() {
            row[i] = if i < look.speeds.len() { still } else { 1.0 };
        }
        // The part's minimum is beyond its end, so that the end is reached to the bit.
        gradient[N - 1] = -2.0;
        let pull = wanted.posture.zip(&look.speeds, |pull, speed| pull / speed);
        for (entry, pull) in gradient.iter_mut().zip(pull.iter()) {
            *entry = -still * pull;
        }
        more(&mut hessian, &mut gradient);
        Ok(Self { qp: Qp::new(N, hessian, gradient)?, names: [None; M] })
    }

    fn row(&self, look: &Look, pick: impl Fn(&Vector6) -> f64, part: f64) -> [f64; N] {
        row_of(look, pick, part)
    }

    fn name(&mut self, row: [f64; N], bound: f64, name: Option<Binding>) -> Result<(), QpError> {
        let place = self.qp.len();
        self.qp.at_least(row, bound)?;
        if let Some(entry) = self.names.get_mut(place) {
            *entry = name;
        }
        Ok(())
    }

    fn limits(&mut self, look: &Look) -> Result<(), QpError> {
        self.name(unit(N - 1, -1.0), -1.0, None)?;
        self.name(unit(N - 1, 1.0), 0.0, None)?;
        for joint in 0..look.speeds.len() {
            let (ends, full) = (look.ends[joint], look.speeds[joint] * look.dt);
            self.name(unit(joint, 1.0), ends.low / full, Some(ends.low_by))?;
            self.name(unit(joint, -1.0), -ends.high / full, Some(ends.high_by))?;
        }
        for near in look.planes.iter().flatten() {
            let inward = near.inward;
            let row = row_of(look, |column| column.fixed_rows::<3>(0).dot(&inward), 0.0);
            self.name(row, near.least / look.dt, Some(Binding::Plane { number: near.number }))?;
        }
        if let Some((grows, least)) = &look.singular {
            let mut row = [0.0; N];
            for (entry, grows) in row.iter_mut().zip(grows.zip(&look.speeds, |g, v| g * v).iter()) {
                *entry = grows;
            }
            self.name(row, least / look.dt, Some(Binding::Singularity))?;
        }
        Ok(())
    }

    fn answer(&self, look: &Look) -> Result<Answer, QpError> {
        let solution = self.qp.solve()?;
        let mut step = Joints::zeros(look.speeds.len());
        for joint in 0..step.len() {
            // The solver keeps its constraints to rounding; the room is kept to the bit.
            let ends = &look.ends[joint];
            step[joint] = (solution.x[joint] * look.speeds[joint] * look.dt).clamp(ends.low, ends.high);
        }
        let weighty = self.names.iter().zip(&solution.multipliers).filter(|(name, _)| name.is_some());
        let most = weighty.max_by(|a, b| a.1.total_cmp(b.1)).filter(|(_, weight)| **weight > 0.0);
        let part = solution.x[N - 1].clamp(0.0, 1.0);
        Ok(Answer { step, part, binding: most.and_then(|(name, _)| *name) })
    }
}

fn unit(variable: usize, value: f64) -> [f64; N] {
    let mut row = [0.0; N];
    row[variable] = value;
    row
}

/// A plane, and how far the probe may go toward it in this tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub(super) number: usize,
    pub(super) inward: nalgebra::Vector3<f64>,
    /// The least step along `inward` (m).
    pub(super) least: f64,
}

impl Near {
    /// The planes nearest to being crossed, at most [`PLANES`].
    pub(super) fn keep(nearest: &mut [Option<Self>; PLANES], plane: Self) {
        let mut plane = Some(plane);
        for place in nearest {
            let nearer = match (&plane, &*place) {
                (Some(new), Some(old)) => new.least > old.least,
                (new, old) => new.is_some() && old.is_none(),
            };
            if nearer {
                std::mem::swap(place, &mut plane);
            }
        }
    }

    /// How far `point` is from a plane (m), inward.
    pub(super) fn distance(plane: &Plane, point: &nalgebra::Vector3<f64>) -> f64 {
        (point - plane.through.vector()).dot(&plane.inward.vector())
    }
}
