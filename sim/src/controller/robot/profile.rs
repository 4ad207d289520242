//! A trapezoid in speed: how `movej` and `movel` go.

/// From rest to rest over a length, never faster than its speed, never harder than its acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::controller) struct Profile {
    length: f64,
    speed: f64,
    acceleration: f64,
}

impl Profile {
    /// Over `length` (not negative); a speed or an acceleration that is no positive number is replaced by a slow one, as
    /// the controller does with nonsense.
    pub(super) fn new(length: f64, speed: f64, acceleration: f64) -> Self {
        let sane = |x: f64| if x.is_finite() && x > 1e-4 { x } else { 1e-4 };
        let acceleration = sane(acceleration);
        let speed = sane(speed).min((length * acceleration).sqrt().max(1e-12));
        Self { length, speed, acceleration }
    }

    /// How long it takes (s).
    pub(super) fn duration(&self) -> f64 {
        if self.length <= 0.0 {
            return 0.0;
        }
        self.length / self.speed + self.speed / self.acceleration
    }

    /// How far it is at `t` seconds.
    pub(super) fn at(&self, t: f64) -> f64 {
        let (ramp, all) = (self.speed / self.acceleration, self.duration());
        if self.length <= 0.0 || t >= all {
            return self.length;
        }
        let half = |t: f64| {
            if t < ramp { 0.5 * self.acceleration * t * t } else { self.speed * (t - 0.5 * ramp) }
        };
        if t < all - ramp { half(t.max(0.0)) } else { self.length - half(all - t) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_starts_and_ends_at_rest_and_keeps_speed_and_acceleration() {
        for (length, speed, acceleration) in
            [(1.0, 0.5, 1.0), (0.1, 2.0, 1.4), (0.0, 1.0, 1.0), (3.0, 1.05, 1.4)]
        {
            let profile = Profile::new(length, speed, acceleration);
            let dt = 1e-3;
            let steps = (profile.duration() / dt) as usize + 3;
            let places: Vec<f64> = (0..steps).map(|i| profile.at(i as f64 * dt)).collect();
            let speeds: Vec<f64> = places.windows(2).map(|w| (w[1] - w[0]) / dt).collect();
            assert!(places[0].abs() < 1e-12 && (places[steps - 1] - length).abs() < 1e-12);
            assert!(speeds.iter().all(|v| *v >= -1e-9 && *v <= speed + 1e-9));
            assert!(speeds.windows(2).all(|w| (w[1] - w[0]).abs() <= acceleration * dt + 1e-9));
        }
    }
}
