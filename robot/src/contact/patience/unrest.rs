//! [`Unrest`]: how far the force was off lately, for how fast the path was followed.
//!
//! Along a given skin, with a given knowledge of it, the error of the force grows with the square of the path's speed. So
//! the error over the square of the speed belongs to the skin and to the law on it, whatever makes it: bumps, stiffness
//! that changes, an estimate of it that is far off. From it follows the speed at which the error would be the one aimed
//! at. The sensor's noise is told from its second differences, and is no error.

/// The error aimed at (N, RMS).
const AIM_N: f64 = 0.06;
/// The speed (m/s) at which that error is expected before anything was seen.
const AT_FIRST_M_S: f64 = 0.012;
/// Over how long it looks back (s).
const MEMORY_S: f64 = 1.0;
/// Over how long the force is smoothed (s).
const SMOOTH_S: f64 = 0.03;
/// Over how long the noise is averaged (s).
const NOISE_S: f64 = 0.3;
/// Larger errors (N) count as this one: one push is not remembered for long.
const MOST_N: f64 = 0.3;
/// Slower (m/s) counts as this: what is off at rest is not the path's doing.
const LEAST_M_S: f64 = 0.005;

/// Averages of what was off and of how fast it went.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unrest {
    dt: f64,
    /// The force's error, smoothed (N).
    off_n: f64,
    /// The last two errors, and the sensor's variance (N²).
    last: Option<(f64, f64)>,
    noise: f64,
    /// Averages of the error's square (N²) and of the speed's fourth power.
    squares: f64,
    fourths: f64,
}

impl Unrest {
    pub(super) const fn new(dt: f64) -> Self {
        let speed2 = AT_FIRST_M_S * AT_FIRST_M_S;
        Self { dt, off_n: 0.0, last: None, noise: 0.0, squares: AIM_N * AIM_N, fourths: speed2 * speed2 }
    }

    /// One tick: the force's error (N) at a speed along the path (m/s). What is no number is not seen.
    pub(super) fn see(&mut self, error_n: f64, speed_m_s: f64) {
        if !error_n.is_finite() {
            return;
        }
        let last = self.last.unwrap_or((error_n, error_n));
        let bend = error_n - 2.0 * last.0 + last.1;
        self.last = Some((error_n, last.0));
        let share = |over: f64| self.dt / (over + self.dt);
        let (new, memory, noise) = (share(SMOOTH_S), share(MEMORY_S), share(NOISE_S));
        // White noise of variance v bends by 6 v; the smoothing leaves new / (2 - new) of it.
        self.noise += noise * (bend * bend / 6.0 - self.noise);
        self.off_n += new * (error_n - self.off_n);
        let off = self.off_n.clamp(-MOST_N, MOST_N);
        self.squares += memory * (off * off - self.noise * new / (2.0 - new) - self.squares);
        self.fourths += memory * (speed_m_s.max(LEAST_M_S).powi(4) - self.fourths);
    }

    /// The speed (m/s) at which the error would be the one aimed at.
    pub(super) fn speed_m_s(&self) -> f64 {
        // Noise that is taken off may leave less than nothing.
        let squares = self.squares.max(1e-4 * AIM_N * AIM_N);
        (AIM_N * AIM_N / squares * self.fourths).powf(0.25)
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;

    const DT: f64 = 0.002;

    /// A normal number, as the sum of twelve even ones.
    fn normal(rng: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64).sum::<f64>() - 6.0
    }

    /// What it says after ten seconds at `speed` (m/s) of an error of `off` (N RMS at that speed, 1 Hz) and noise (N).
    fn told(speed: f64, off: f64, noise: f64) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (mut unrest, mut sum) = (Unrest::new(DT), 0.0);
        for tick in 0..10_000 {
            let phase = std::f64::consts::TAU * f64::from(tick) * DT;
            unrest.see(off * 2f64.sqrt() * phase.sin() + noise * normal(&mut rng), speed);
            sum += if tick >= 5000 { unrest.speed_m_s() / 5000.0 } else { 0.0 };
        }
        sum
    }

    #[test]
    fn an_error_of_four_times_the_aim_is_followed_at_half_the_speed_however_fast_it_was_seen() {
        for speed in [0.01, 0.02, 0.04] {
            let told = told(speed, 4.0 * AIM_N, 0.0);
            assert!((told / speed - 0.5).abs() < 0.03, "{told} at {speed}");
        }
    }

    #[test]
    fn the_sensors_noise_is_no_error() {
        let (quiet, noisy) = (told(0.02, AIM_N, 0.0), told(0.02, AIM_N, 0.2));
        assert!((noisy / quiet - 1.0).abs() < 0.15, "{noisy} and {quiet}");
        assert!(told(0.02, 0.0, 0.2) > 0.03, "noise alone slows nothing");
    }

    #[test]
    fn what_is_no_number_is_not_seen() {
        let mut unrest = Unrest::new(DT);
        for (error, speed) in [(f64::NAN, 0.01), (f64::INFINITY, 0.01), (0.01, f64::NAN)] {
            unrest.see(error, speed);
            assert!(unrest.speed_m_s().is_finite());
        }
    }
}
