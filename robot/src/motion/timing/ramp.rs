//! The quickest jerk-limited change of speed of one coordinate, in closed form.

/// Speed and acceleration of one coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rate {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

/// What a change of speed may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

/// Up to three parts of constant jerk: `(jerk, seconds)`.
type Parts = [(f64, f64); 3];

/// The parts of the quickest change to `target` at acceleration zero. The sign is that of the change that is left
/// once the acceleration is taken to zero, so the speed passes `target` only where it cannot help it.
fn parts(rate: &Rate, target: f64, bounds: &Bounds) -> Parts {
    let Rate { speed, acceleration } = *rate;
    let Bounds { acceleration: most, jerk } = *bounds;
    let at_rest = speed + acceleration * acceleration.abs() / (2.0 * jerk);
    let sign = if target >= at_rest { 1.0 } else { -1.0 };
    let (from, change) = (sign * acceleration, sign * (target - speed));
    // Up to the peak at full jerk, held there, and down: change = (2 peak^2 - from^2) / (2 jerk) + peak hold.
    let free = (jerk * change + from * from / 2.0).max(0.0).sqrt();
    let peak = free.min(most).max(from);
    let ramps = (2.0 * peak * peak - from * from) / (2.0 * jerk);
    let hold = if free > peak { ((change - ramps) / peak).max(0.0) } else { 0.0 };
    [(sign * jerk, (peak - from) / jerk), (0.0, hold), (-sign * jerk, peak.max(0.0) / jerk)]
}

/// The coordinate's way, and its rate, after `seconds` of the quickest change to `target`.
pub(super) fn after(rate: &Rate, target: f64, bounds: &Bounds, seconds: f64) -> (f64, Rate) {
    let (mut way, mut now, mut left) = (0.0, *rate, seconds);
    for (jerk, lasts) in parts(rate, target, bounds) {
        let t = lasts.min(left);
        way += t * (now.speed + t * (now.acceleration / 2.0 + t * jerk / 6.0));
        now.speed += t * (now.acceleration + t * jerk / 2.0);
        now.acceleration += t * jerk;
        left -= t;
        if left <= 0.0 {
            return (way, now);
        }
    }
    // Exactly there: what rounding left is dropped, so that a stop is a stop.
    (way + target * left, Rate { speed: target, acceleration: 0.0 })
}

/// How long it takes to change to `target` (s).
pub(super) fn lasts(rate: &Rate, target: f64, bounds: &Bounds) -> f64 {
    parts(rate, target, bounds).iter().map(|(_, seconds)| seconds).sum()
}

/// How far a change from rest to rest gets in so many seconds.
pub(super) fn reach(bounds: &Bounds, seconds: f64) -> f64 {
    let peak = bounds.acceleration.min(0.5 * bounds.jerk * seconds);
    peak * (seconds - peak / bounds.jerk)
}

/// The jerk so many seconds into the change.
pub(super) fn jerk_at(rate: &Rate, target: f64, bounds: &Bounds, seconds: f64) -> f64 {
    let mut left = seconds;
    for (jerk, lasts) in parts(rate, target, bounds) {
        if left < lasts {
            return jerk;
        }
        left -= lasts;
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The way it takes to change to `target`.
    fn distance(rate: &Rate, target: f64, bounds: &Bounds) -> f64 {
        after(rate, target, bounds, lasts(rate, target, bounds)).0
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 5000, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn it_ends_at_the_target_within_its_bounds_however_it_is_cut_into_ticks(
            speed in 0.0..0.2f64, part in -1.0..1.0f64, target in 0.0..0.2f64, tick in 0.0005..0.02f64,
        ) {
            let bounds = Bounds { acceleration: 0.3, jerk: 4.0 };
            let mut rate = Rate { speed, acceleration: part * bounds.acceleration };
            let wanted = distance(&rate, target, &bounds);
            let (mut way, mut ticks) = (0.0, 0);
            while rate != (Rate { speed: target, acceleration: 0.0 }) && ticks < 10_000 {
                let (step, next) = after(&rate, target, &bounds, tick);
                prop_assert!((next.acceleration - rate.acceleration).abs() <= bounds.jerk * tick * (1.0 + 1e-9) + 1e-12);
                prop_assert!(next.acceleration.abs() <= bounds.acceleration + 1e-12);
                way += step;
                rate = next;
                ticks += 1;
            }
            prop_assert!(ticks < 10_000);
            // The last tick goes on at the target's speed.
            let over = way - wanted;
            prop_assert!(over > -1e-9 && over <= target * tick + 1e-9, "{way} {wanted}");
        }
    }
}
