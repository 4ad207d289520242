//! A small dense quadratic program, solved within a tick: [`Qp`].
//!
//! The dual active-set method of Goldfarb and Idnani (1983, doi:10.1007/BF02591962): it begins at the minimum without
//! constraints and takes the violated ones in one by one, so that a problem with few binding limits costs few steps,
//! and one that nothing satisfies is recognised as such. Sizes are constants: no heap, no panic, a bounded number of
//! steps, and numbers that are not finite are refused.

mod factors;

use thiserror::Error;

use factors::Factors;

/// Smaller than this part of a constraint's normal, what the others leave of it is rounding: it depends on them.
const DEPENDENT: f64 = 1e-9;
/// A constraint violated by less than this part of its own terms holds.
const HOLDS: f64 = 1e-11;
/// Steps for each variable and constraint: a problem without a ring takes fewer than two.
const STEPS_EACH: usize = 6;

/// Minimise `½ xᵀ H x + gᵀ x` where each constraint's `row · x` is equal to its bound (equalities), or at least its
/// bound. At most `N` variables and `M` constraints.
#[derive(Clone, Debug)]
pub struct Qp<const N: usize, const M: usize> {
    variables: usize,
    hessian: [[f64; N]; N],
    gradient: [f64; N],
    rows: [[f64; N]; M],
    bounds: [f64; M],
    equalities: usize,
    len: usize,
}

/// The minimum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QpSolution<const N: usize, const M: usize> {
    /// Where it is.
    pub x: [f64; N],
    /// How much the objective would fall if the constraint's bound were lowered by one: above zero only where an
    /// inequality binds; of either sign for an equality.
    pub multipliers: [f64; M],
    /// How many constraints were taken in or let go.
    pub steps: usize,
}

/// Why there is no minimum.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum QpError {
    /// A number is not finite.
    #[error("the quadratic program has a number that is not finite")]
    NotFinite,
    /// More variables or constraints than there is room for.
    #[error("no room for {found} {what} in a quadratic program of at most {most}")]
    TooMany {
        /// Variables or constraints.
        what: &'static str,
        /// How many were given.
        found: usize,
        /// How many there is room for.
        most: usize,
    },
    /// The Hessian is not positive definite.
    #[error("the quadratic program's Hessian is not positive definite")]
    NotConvex,
    /// No `x` keeps every constraint.
    #[error("no x keeps constraint {constraint} together with those before it")]
    Infeasible {
        /// The one that could not be kept together with others, in the order given.
        constraint: usize,
    },
    /// Rounding led it in a ring; its answer would be a guess.
    #[error("the quadratic program did not end after {steps} steps")]
    Stalled {
        /// How many it took.
        steps: usize,
    },
}

impl<const N: usize, const M: usize> Qp<N, M> {
    /// Over `variables` numbers with the Hessian's lower triangle and the gradient at zero; no constraint yet.
    ///
    /// # Errors
    /// When there is no room for so many.
    pub const fn new(variables: usize, hessian: [[f64; N]; N], gradient: [f64; N]) -> Result<Self, QpError> {
        if variables > N {
            return Err(QpError::TooMany { what: "variables", found: variables, most: N });
        }
        let (rows, bounds) = ([[0.0; N]; M], [0.0; M]);
        Ok(Self { variables, hessian, gradient, rows, bounds, equalities: 0, len: 0 })
    }

    /// Also `row · x = bound`. Equalities come before inequalities, in whatever order they are given.
    ///
    /// # Errors
    /// When there is no room.
    pub fn equal(&mut self, row: [f64; N], bound: f64) -> Result<(), QpError> {
        // The first inequality makes room.
        let first = self.equalities;
        self.push(row, bound)?;
        self.rows.swap(first, self.len - 1);
        self.bounds.swap(first, self.len - 1);
        self.equalities += 1;
        Ok(())
    }

    /// Also `row · x >= bound`.
    ///
    /// # Errors
    /// When there is no room.
    pub fn at_least(&mut self, row: [f64; N], bound: f64) -> Result<(), QpError> {
        self.push(row, bound)
    }

    /// How many constraints.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no constraint.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// How many of the constraints, the first ones, are equalities.
    pub const fn equalities(&self) -> usize {
        self.equalities
    }

    fn push(&mut self, row: [f64; N], bound: f64) -> Result<(), QpError> {
        let most = M;
        let (Some(place), Some(end)) = (self.rows.get_mut(self.len), self.bounds.get_mut(self.len)) else {
            return Err(QpError::TooMany { what: "constraints", found: self.len + 1, most });
        };
        (*place, *end) = (row, bound);
        self.len += 1;
        Ok(())
    }

    /// The minimum; the same problem gives the same bits.
    ///
    /// # Errors
    /// When a number is not finite, the Hessian is not positive definite, nothing keeps every constraint, or rounding
    /// leads it in a ring.
    pub fn solve(&self) -> Result<QpSolution<N, M>, QpError> {
        if !self.is_finite() {
            return Err(QpError::NotFinite);
        }
        let mut search = Search::begin(self)?;
        for constraint in 0..self.equalities {
            search.take_equality(constraint)?;
        }
        while let Some(constraint) = search.most_violated() {
            search.take(constraint)?;
        }
        search.answer()
    }

    fn is_finite(&self) -> bool {
        let n = self.variables;
        let finite = |row: &[f64; N]| row[..n].iter().all(|x| x.is_finite());
        let triangle =
            self.hessian[..n].iter().enumerate().all(|(i, row)| row[..=i].iter().all(|x| x.is_finite()));
        triangle
            && finite(&self.gradient)
            && self.rows[..self.len].iter().all(finite)
            && self.bounds[..self.len].iter().all(|x| x.is_finite())
    }
}

/// The state of the method: the minimum over the constraints taken in so far, as equalities.
struct Search<'a, const N: usize, const M: usize> {
    qp: &'a Qp<N, M>,
    factors: Factors<N>,
    x: [f64; N],
    /// The constraints taken in, their multipliers beside them.
    active: [usize; N],
    dual: [f64; N],
    is_active: [bool; M],
    steps: usize,
}

impl<'a, const N: usize, const M: usize> Search<'a, N, M> {
    fn begin(qp: &'a Qp<N, M>) -> Result<Self, QpError> {
        let factors = Factors::of(qp.variables, &qp.hessian).ok_or(QpError::NotConvex)?;
        let x = factors.minimum(&qp.gradient);
        Ok(Self { qp, factors, x, active: [0; N], dual: [0.0; N], is_active: [false; M], steps: 0 })
    }

    /// By how much a constraint is kept, and the size of the terms that this is the difference of.
    fn slack(&self, constraint: usize) -> (f64, f64) {
        let (row, bound) = (&self.qp.rows[constraint], self.qp.bounds[constraint]);
        let n = self.qp.variables;
        let terms = row[..n].iter().zip(&self.x[..n]).map(|(a, x)| a * x);
        terms.fold((-bound, bound.abs()), |(sum, size), term| (sum + term, size + term.abs()))
    }

    /// The constraint that is violated most, for the length of its row.
    fn most_violated(&self) -> Option<usize> {
        let mut found = (None, 0.0);
        for constraint in self.qp.equalities..self.qp.len {
            let (slack, size) = self.slack(constraint);
            if slack < found.1 && !self.is_active[constraint] && slack < -HOLDS * size {
                found = (Some(constraint), slack);
            }
        }
        found.0
    }

    fn count(&mut self) -> Result<(), QpError> {
        self.steps += 1;
        if self.steps > STEPS_EACH * (N + M) { Err(QpError::Stalled { steps: self.steps }) } else { Ok(()) }
    }

    /// Takes an equality in: one full step, whatever its direction.
    fn take_equality(&mut self, constraint: usize) -> Result<(), QpError> {
        self.count()?;
        let way = self.factors.way(&self.qp.rows[constraint]);
        let (slack, size) = self.slack(constraint);
        if way.depends(DEPENDENT) {
            // It says again what others said, or the contrary.
            let same = slack.abs() <= 1e-9 * size.max(f64::MIN_POSITIVE);
            return if same { Ok(()) } else { Err(QpError::Infeasible { constraint }) };
        }
        let step = -slack / way.curvature;
        self.go(&way.primal, step, &way.dual, step);
        self.add(constraint, step, &way.turned);
        Ok(())
    }

    /// Takes a violated inequality in, letting go of those whose multiplier would turn negative on the way.
    fn take(&mut self, constraint: usize) -> Result<(), QpError> {
        let mut multiplier = 0.0;
        loop {
            self.count()?;
            let way = self.factors.way(&self.qp.rows[constraint]);
            let blocked = self.first_to_let_go(&way.dual);
            let full = if way.depends(DEPENDENT) {
                f64::INFINITY
            } else {
                -self.slack(constraint).0 / way.curvature
            };
            let step = blocked.map_or(full, |(_, step)| full.min(step));
            if !step.is_finite() {
                return Err(QpError::Infeasible { constraint });
            }
            let moved = if full.is_finite() { step } else { 0.0 };
            self.go(&way.primal, moved, &way.dual, step);
            multiplier += step;
            match blocked {
                Some((place, least)) if least < full => self.drop_at(place),
                _ => {
                    self.add(constraint, multiplier, &way.turned);
                    return Ok(());
                }
            }
        }
    }

    /// The inequality whose multiplier reaches zero first, and after which step.
    fn first_to_let_go(&self, dual: &[f64; N]) -> Option<(usize, f64)> {
        let mut first: Option<(usize, f64)> = None;
        for (place, falls) in dual.iter().enumerate().take(self.factors.taken()) {
            let inequality = self.active[place] >= self.qp.equalities;
            if inequality && *falls > 0.0 {
                let step = self.dual[place] / falls;
                if first.is_none_or(|(_, least)| step < least) {
                    first = Some((place, step));
                }
            }
        }
        first
    }

    fn go(&mut self, primal: &[f64; N], moved: f64, dual: &[f64; N], step: f64) {
        for (x, z) in self.x.iter_mut().zip(primal) {
            *x += moved * z;
        }
        for (u, r) in self.dual.iter_mut().zip(dual).take(self.factors.taken()) {
            *u -= step * r;
        }
    }

    fn add(&mut self, constraint: usize, multiplier: f64, turned: &[f64; N]) {
        let place = self.factors.taken();
        (self.active[place], self.dual[place]) = (constraint, multiplier);
        self.is_active[constraint] = true;
        self.factors.add(turned);
    }

    fn drop_at(&mut self, place: usize) {
        self.is_active[self.active[place]] = false;
        let taken = self.factors.taken();
        self.active.copy_within(place + 1..taken, place);
        self.dual.copy_within(place + 1..taken, place);
        self.factors.drop_at(place);
    }

    fn answer(self) -> Result<QpSolution<N, M>, QpError> {
        let mut multipliers = [0.0; M];
        for (constraint, dual) in self.active.iter().zip(&self.dual).take(self.factors.taken()) {
            multipliers[*constraint] = *dual;
        }
        let finite = self.x.iter().chain(&multipliers).all(|x| x.is_finite());
        let answer = QpSolution { x: self.x, multipliers, steps: self.steps };
        if finite { Ok(answer) } else { Err(QpError::NotFinite) }
    }
}

#[cfg(test)]
mod tests;
