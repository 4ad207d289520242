//! One joint, in units of one tick: velocity is the last step, acceleration the change of step, jerk the change of
//! that. In these units the finite differences are sums, so the look-ahead is exact and not a sampled integral.
//!
//! A tick chooses the next acceleration `a'`; then `v' = v + a'` and `q' = q + v'`. With jerk `j`, the acceleration
//! `a` runs out over the ticks `a, a-j, a-2j, …` and adds their sum to the velocity ([`run_out`]); the largest
//! acceleration that may be chosen with `room` left in velocity is the inverse of that sum ([`ramp`]). A choice at or
//! below it leaves, at the next tick, a choice at or below it again: the velocity limit is never crossed, and the
//! same rule with zero as the limit brakes to rest without overshoot ([`brake`]). Positions are kept by asking where
//! that brake would end.

/// Limits in units of one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

/// The motion after the last command, in units of one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
}

/// Where a braking joint comes to rest, and the extremes on the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rest {
    pub(crate) at: f64,
    pub(crate) lowest: f64,
    pub(crate) highest: f64,
}

/// How often the search for the nearest safe acceleration halves: to 1/4096 of the acceleration limit.
const HALVINGS: usize = 12;

/// The longest brake that is looked ahead: two minutes at 1 kHz, far more than an arm takes.
pub(crate) const LONGEST_BRAKE: usize = 120_000;

impl Bounds {
    /// How many ticks a brake takes at most: the acceleration runs out, then comes the trapezoid of the brake.
    pub(crate) fn ticks_to_brake(&self) -> f64 {
        self.velocity / self.acceleration + 2.0 * self.acceleration / self.jerk + 5.0
    }
}

impl Motion {
    /// The motion after a tick with this acceleration.
    pub(crate) fn after(&self, acceleration: f64) -> Self {
        let velocity = self.velocity + acceleration;
        Self { position: self.position + velocity, velocity, acceleration }
    }
}

/// `a + (a-j) + (a-2j) + …` while positive.
fn run_out(a: f64, j: f64) -> f64 {
    if a <= 0.0 {
        return 0.0;
    }
    let n = (a / j).floor();
    (n + 1.0) * a - j * n * (n + 1.0) / 2.0
}

/// The inverse of [`run_out`], continued as an odd function: the acceleration that uses up `room` exactly.
fn ramp(room: f64, j: f64) -> f64 {
    let size = room.abs();
    let n = (((8.0 * size / j + 1.0).sqrt() - 1.0) / 2.0).floor();
    ((size + j * n * (n + 1.0) / 2.0) / (n + 1.0)).copysign(room)
}

/// The accelerations from which velocity and acceleration stay within their limits for ever.
pub(super) fn choices(m: &Motion, b: &Bounds) -> (f64, f64) {
    let (least, most) = (m.acceleration - b.jerk, m.acceleration + b.jerk);
    let low = (-b.acceleration).max(-ramp(b.velocity + m.velocity, b.jerk));
    let high = b.acceleration.min(ramp(b.velocity - m.velocity, b.jerk));
    // From a state within the limits the three ranges meet; rounding may part them by an ulp: the jerk then wins.
    let (low, high) = (low.clamp(least, most), high.clamp(least, most));
    if low <= high { (low, high) } else { ((low + high) / 2.0, (low + high) / 2.0) }
}

/// The next acceleration on the way to rest: as much against the motion as leaves it time to run out at zero.
pub(crate) fn brake(m: &Motion, b: &Bounds) -> f64 {
    let (v, a, j) = (m.velocity, m.acceleration, b.jerk);
    // Where the velocity would end if the acceleration ran out from here on.
    let end = v + if a > 0.0 { run_out(a - j, j) } else { -run_out(-a - j, j) };
    if end > 0.0 {
        (a - j).max(-b.acceleration).max(-ramp(v, j)).min(a + j)
    } else if end < 0.0 {
        (a + j).min(b.acceleration).min(-ramp(v, j)).max(a - j)
    } else {
        a - a.clamp(-j, j)
    }
}

/// Brakes to the end.
pub(crate) fn rest(m: &Motion, b: &Bounds) -> Rest {
    let mut m = *m;
    let mut rest = Rest { at: m.position, lowest: m.position, highest: m.position };
    // A thousandth of a jerk is far below what a position of some radians can hold.
    let still = b.jerk * 1e-3;
    for _ in 0..LONGEST_BRAKE {
        if m.velocity.abs() <= still && m.acceleration.abs() <= still {
            break;
        }
        m = m.after(brake(&m, b));
        rest.at = m.position;
        rest.lowest = rest.lowest.min(m.position);
        rest.highest = rest.highest.max(m.position);
    }
    rest
}

/// Whether even a generous estimate of the brake's way stays inside: spares the exact look-ahead far from a limit.
fn is_far_inside(m: &Motion, b: &Bounds) -> bool {
    let speed = m.velocity.abs() + run_out(m.acceleration.abs(), b.jerk);
    // Ramping the acceleration out, then v/a + a/j for the brake itself (2 sqrt(v/j) at most that), and rounding up.
    let ticks = m.acceleration.abs() / b.jerk + speed / b.acceleration + b.acceleration / b.jerk + 5.0;
    let way = speed * ticks;
    m.position - way >= b.lower && m.position + way <= b.upper
}

/// Whether the joint can still come to rest inside its range after choosing `a`. A joint found outside its range may
/// move back in, but no further out (`now`: where it would come to rest anyway).
fn is_safe(m: &Motion, b: &Bounds, a: f64, now: &Rest) -> bool {
    let next = m.after(a);
    if is_far_inside(&next, b) {
        return true;
    }
    let rest = rest(&next, b);
    rest.highest <= b.upper.max(now.highest) && rest.lowest >= b.lower.min(now.lowest)
}

/// The nearest position to `wanted` that may be commanded next: `wanted` itself, to the bit, where it is within.
pub(crate) fn limit(m: &Motion, b: &Bounds, wanted: f64) -> f64 {
    let (low, high) = choices(m, b);
    let asked = (wanted - m.position) - m.velocity;
    let chosen = asked.clamp(low, high);
    let safe = safe(m, b, chosen);
    // Compared as it was copied: nothing was changed on the way.
    let unchanged = safe.to_bits() == asked.to_bits();
    if unchanged { wanted } else { m.after(safe).position }
}

/// The choice nearest to `chosen` (one of the [`choices`]) from which the joint can still come to rest in its range.
pub(super) fn safe(m: &Motion, b: &Bounds, chosen: f64) -> f64 {
    if is_far_inside(&m.after(chosen), b) {
        return chosen;
    }
    let now = rest(m, b);
    if is_safe(m, b, chosen, &now) {
        return chosen;
    }
    let (low, high) = choices(m, b);
    let (mut safe, mut unsafe_) = (brake(m, b).clamp(low, high), chosen);
    for _ in 0..HALVINGS {
        let middle = (safe + unsafe_) / 2.0;
        if is_safe(m, b, middle, &now) {
            safe = middle;
        } else {
            unsafe_ = middle;
        }
    }
    safe
}
