//! The two matrices of the method: `J`, with `Jᵀ H J = 1`, whose first columns span what the constraints taken in
//! hold; and `R`, upper triangular, with `Jᵀ (their rows)ᵀ = [R; 0]`.

/// See the [module](self).
pub(super) struct Factors<const N: usize> {
    n: usize,
    /// By columns: `j[k]` is column k.
    j: [[f64; N]; N],
    /// By columns: `r[k]` belongs to the k-th constraint taken in.
    r: [[f64; N]; N],
    taken: usize,
}

/// What happens while a constraint is taken in, for a unit of its multiplier.
pub(super) struct Way<const N: usize> {
    /// `Jᵀ row`.
    pub(super) turned: [f64; N],
    /// How the variables move.
    pub(super) primal: [f64; N],
    /// How the other multipliers fall.
    pub(super) dual: [f64; N],
    /// How much the constraint gains: `row · primal`.
    pub(super) curvature: f64,
    length: f64,
}

impl<const N: usize> Way<N> {
    /// Whether the constraint's row depends on those taken in: what is left of it is below this part.
    pub(super) fn depends(&self, part: f64) -> bool {
        // NaN depends on everything.
        let stands = self.curvature > part * part * self.length;
        !stands
    }
}

impl<const N: usize> Factors<N> {
    /// Nothing taken in. `None` when the Hessian (its lower triangle) is not positive definite.
    pub(super) fn of(n: usize, hessian: &[[f64; N]; N]) -> Option<Self> {
        let lower = cholesky(n, hessian)?;
        Some(Self { n, j: inverse_transposed(n, &lower), r: [[0.0; N]; N], taken: 0 })
    }

    /// How many constraints are taken in.
    pub(super) const fn taken(&self) -> usize {
        self.taken
    }

    /// Where the objective is least without constraints: `-J Jᵀ g`.
    pub(super) fn minimum(&self, gradient: &[f64; N]) -> [f64; N] {
        let mut x = [0.0; N];
        for column in &self.j[..self.n] {
            let part = dot(column, gradient);
            for (x, j) in x.iter_mut().zip(column) {
                *x -= part * j;
            }
        }
        x
    }

    pub(super) fn way(&self, row: &[f64; N]) -> Way<N> {
        let mut way = Way { turned: [0.0; N], primal: [0.0; N], dual: [0.0; N], curvature: 0.0, length: 0.0 };
        for k in 0..self.n {
            way.turned[k] = dot(&self.j[k], row);
            way.length += way.turned[k] * way.turned[k];
        }
        for k in self.taken..self.n {
            let part = way.turned[k];
            way.curvature += part * part;
            for (z, j) in way.primal.iter_mut().zip(&self.j[k]) {
                *z += part * j;
            }
        }
        self.solve_triangle(&way.turned, &mut way.dual);
        way
    }

    /// `R dual = turned`.
    fn solve_triangle(&self, turned: &[f64; N], dual: &mut [f64; N]) {
        dual[..self.taken].copy_from_slice(&turned[..self.taken]);
        for k in (0..self.taken).rev() {
            dual[k] /= self.r[k][k];
            let part = dual[k];
            for (d, r) in dual[..k].iter_mut().zip(&self.r[k]) {
                *d -= part * r;
            }
        }
    }

    /// Takes in the constraint with this `Jᵀ row`: columns of J are turned until only its first free one feels it.
    pub(super) fn add(&mut self, turned: &[f64; N]) {
        let mut turned = *turned;
        for k in (self.taken + 1..self.n).rev() {
            let (c, s, length) = rotation(turned[k - 1], turned[k]);
            (turned[k - 1], turned[k]) = (length, 0.0);
            let (before, after) = self.j.split_at_mut(k);
            rotate(&mut before[k - 1], &mut after[0], c, s);
        }
        self.r[self.taken] = turned;
        self.taken += 1;
    }

    /// Lets go of the constraint that was taken in as number `place`.
    pub(super) fn drop_at(&mut self, place: usize) {
        self.r.copy_within(place + 1..self.taken, place);
        self.taken -= 1;
        for k in place..self.taken {
            // Column k has a number below the diagonal now: it is turned away, in all columns from k on.
            let (c, s, length) = rotation(self.r[k][k], self.r[k][k + 1]);
            (self.r[k][k], self.r[k][k + 1]) = (length, 0.0);
            for column in &mut self.r[k + 1..self.taken] {
                let (a, b) = (column[k], column[k + 1]);
                (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
            }
            let (before, after) = self.j.split_at_mut(k + 1);
            rotate(&mut before[k], &mut after[0], c, s);
        }
    }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Cosine, sine and length with `(c a + s b, c b - s a) = (length, 0)`.
fn rotation(a: f64, b: f64) -> (f64, f64, f64) {
    let length = (a * a + b * b).sqrt();
    // Two zeros need no turn.
    if length > 0.0 { (a / length, b / length, length) } else { (1.0, 0.0, 0.0) }
}

fn rotate<const N: usize>(first: &mut [f64; N], second: &mut [f64; N], c: f64, s: f64) {
    for (a, b) in first.iter_mut().zip(second) {
        (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
    }
}

/// Lower triangle L with L Lᵀ = H, by rows.
fn cholesky<const N: usize>(n: usize, hessian: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut lower = [[0.0; N]; N];
    for i in 0..n {
        for k in 0..=i {
            let left = hessian[i][k] - (0..k).map(|m| lower[i][m] * lower[k][m]).sum::<f64>();
            if k < i {
                lower[i][k] = left / lower[k][k];
            } else if left > f64::EPSILON * hessian[i][i].abs() {
                lower[i][i] = left.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(lower)
}

/// `L⁻ᵀ` by columns: column k of it is row k of `L⁻¹`.
fn inverse_transposed<const N: usize>(n: usize, lower: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut inverse = [[0.0; N]; N];
    for i in 0..n {
        inverse[i][i] = 1.0 / lower[i][i];
        let (done, rest) = inverse.split_at_mut(i);
        for (k, entry) in rest[0].iter_mut().enumerate().take(i) {
            let sum: f64 = (k..i).map(|m| lower[i][m] * done[m][k]).sum();
            *entry = -sum / lower[i][i];
        }
    }
    inverse
}
