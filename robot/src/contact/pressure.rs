//! [`Pressure`]: what a wrench says of how the probe's face lies on the skin.
//!
//! The face is a flat rectangle of 40 x 10 mm around the probe's origin, in its plane z = 0. A pressure `p(x, y)` on it
//! pushes along -z and turns by `(-∫y p, ∫x p)`; friction acts in the plane, and so turns about z alone: torque over
//! force is the centre of pressure, whatever drags. How high the pressure rises toward an edge follows from a pressure
//! that is linear over the face (a flat face on an even bed of springs, as a foundation's footing is reckoned).

use probepath_frames::{Probe, Span, Wrench};

/// The probe's face, which touches the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Length along the probe's x (m). 0.040.
    pub length_m: f64,
    /// Width along the probe's y (m). 0.010.
    pub width_m: f64,
}

impl Default for Face {
    /// A linear head of 40 x 10 mm (FIELD.md section 10).
    fn default() -> Self {
        Self { length_m: 0.040, width_m: 0.010 }
    }
}

/// A force below this (N) says nothing of where it acts: the torque is noise then.
const LEAST_N: f64 = 0.5;
/// No pressure acts outside the face; a centre that is found nearer to an edge than this part of the face's length is
/// counted as this far in, so that the peak stays finite: a strip of 6 % of the face bears all then.
const NEAREST_EDGE: f64 = 0.02;

/// How the face lies on the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressure {
    /// The pressing force (N), positive when skin pushes back.
    pub pressing_n: f64,
    /// The force along the skin (N): friction, or a probe that is caught.
    pub tangential_n: f64,
    /// Centre of pressure on the face, along the probe's x and y (m); none below half a newton.
    pub centre_m: Option<(f64, f64)>,
    /// The force over the whole face (N/cm²).
    pub mean_n_cm2: f64,
    /// The highest pressure, at an edge or a corner (N/cm²). Exact for a flat face on even springs that tilts about one
    /// axis, an upper bound when it tilts about both.
    pub edge_n_cm2: f64,
}

const CM2: f64 = 1e-4;

impl Pressure {
    /// What the skin's `wrench` on the probe (its bias and the tool's weight taken off) says of the face. A wrench that
    /// is not finite gives numbers that are not, which keep no limit.
    pub fn of(wrench: &Wrench<Probe>, face: &Face) -> Self {
        let pressing_n = -wrench.force.z;
        let centre_m =
            (pressing_n >= LEAST_N).then(|| (wrench.torque.y / pressing_n, -wrench.torque.x / pressing_n));
        let mean_n_cm2 = pressing_n * CM2 / (face.length_m * face.width_m);
        let rise = centre_m.map_or(1.0, |(x, y)| rise(x / face.length_m) * rise(y / face.width_m));
        Self {
            pressing_n,
            tangential_n: wrench.force.x.hypot(wrench.force.y),
            centre_m,
            mean_n_cm2,
            edge_n_cm2: mean_n_cm2 * rise,
        }
    }
}

/// Peak over mean of a linear pressure whose centre is `off` (as a part of the length) from the middle: a trapezium up
/// to a sixth, then a triangle on the part that still touches.
fn rise(off: f64) -> f64 {
    let off = off.abs();
    if off <= 1.0 / 6.0 { 1.0 + 6.0 * off } else { 2.0 / (3.0 * (0.5 - off).max(NEAREST_EDGE)) }
}

/// [`Pressure`] of a wrench that is smoothed first, tick by tick: a single tick's torque is too noisy to say where the
/// force acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactWatch {
    face: Face,
    share: f64,
    smooth: Option<Wrench<Probe>>,
}

impl ContactWatch {
    /// Smoothed over `over` (50 ms), a state every `period`.
    pub fn new(face: Face, over: Span, period: Span) -> Self {
        let (over, dt) = (over.seconds().max(0.0), period.seconds());
        Self { face, share: dt / (over + dt), smooth: None }
    }

    /// One tick. A wrench that is not finite is judged as it is, and forgotten.
    pub fn step(&mut self, wrench: &Wrench<Probe>) -> Pressure {
        if !wrench.is_finite() {
            return Pressure::of(wrench, &self.face);
        }
        let before = self.smooth.unwrap_or(*wrench);
        let toward = |a: nalgebra::Vector3<f64>, b: nalgebra::Vector3<f64>| a + (b - a) * self.share;
        let now = Wrench::new(toward(before.force, wrench.force), toward(before.torque, wrench.torque));
        self.smooth = Some(now);
        Pressure::of(&now, &self.face)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;

    /// Springs under a tilted flat face, summed: wrench and highest pressure (N/cm²).
    fn bed(depth: f64, tilt: (f64, f64), n: i32) -> (Wrench<Probe>, f64) {
        let face = Face::default();
        let (mut wrench, mut peak) = (Wrench::zero(), 0.0_f64);
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32, length: f64| length * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                let (x, y) = (at(i, face.length_m), at(j, face.width_m));
                let force = (depth + tilt.0 * x + tilt.1 * y).max(0.0) * 3000.0 / f64::from(n * n);
                let push = Vector3::new(0.1 * force, 0.05 * force, -force);
                wrench = wrench + Wrench::new(push, Vector3::new(x, y, 0.0).cross(&push));
                peak = peak.max(force * f64::from(n * n) * CM2 / (face.length_m * face.width_m));
            }
        }
        (wrench, peak)
    }

    fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
        low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    #[test]
    fn ten_newtons_on_the_whole_face_are_two_and_a_half_on_each_square_centimetre() {
        let wrench = Wrench::new(Vector3::new(0.3, -0.4, -10.0), Vector3::zeros());
        let found = Pressure::of(&wrench, &Face::default());
        assert!((found.mean_n_cm2 - 2.5).abs() < 1e-12 && (found.edge_n_cm2 - 2.5).abs() < 1e-12);
        assert!((found.tangential_n - 0.5).abs() < 1e-12);
        assert_eq!(found.centre_m, Some((0.0, 0.0)));
    }

    #[test]
    fn a_force_at_a_place_of_the_face_is_found_there_whatever_drags() {
        for (x, y) in [(0.012, 0.0), (-0.004, 0.003), (0.0, -0.0045)] {
            let force = Vector3::new(1.0, -2.0, -6.0);
            let wrench = Wrench::new(force, Vector3::new(x, y, 0.0).cross(&force));
            let (cx, cy) = Pressure::of(&wrench, &Face::default()).centre_m.unwrap();
            assert!((cx - x).abs() < 1e-12 && (cy - y).abs() < 1e-12, "{cx} {cy}");
        }
    }

    #[test]
    fn tilted_about_one_axis_the_edge_bears_what_springs_bear_and_about_both_no_more_than_said() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut most = 0.0_f64;
        for _ in 0..1000 {
            let depth = between(&mut rng, 0.0005, 0.003);
            let mut tilt = |half: f64| between(&mut rng, -2.0, 2.0) * depth / half;
            let (along, across) = (tilt(0.020), tilt(0.005));
            for (tilt, one) in [((along, 0.0), true), ((0.0, across), true), ((along, across), false)] {
                let (wrench, peak) = bed(depth, tilt, 60);
                let ratio = Pressure::of(&wrench, &Face::default()).edge_n_cm2 / peak;
                // The grid's outermost springs stand half a step inside the edge.
                assert!(ratio > 0.99 && (!one || ratio < 1.04), "{ratio} {tilt:?}");
                most = most.max(ratio);
            }
        }
        assert!(most < 2.0, "the bound is never twice what is borne: {most}");
    }

    #[test]
    fn a_force_on_the_very_edge_is_finite_and_a_light_one_has_no_centre() {
        let force = Vector3::new(0.0, 0.0, -4.0);
        let wrench = Wrench::new(force, Vector3::new(0.03, 0.006, 0.0).cross(&force));
        let edge = Pressure::of(&wrench, &Face::default()).edge_n_cm2;
        assert!(edge.is_finite() && edge > 100.0, "{edge}");
        let light = Wrench::new(force * 0.1, Vector3::new(0.01, 0.0, 0.0));
        assert_eq!(Pressure::of(&light, &Face::default()).centre_m, None);
    }

    #[test]
    fn no_number_is_no_number_and_the_watch_goes_on_after_it() {
        let mut watch =
            ContactWatch::new(Face::default(), Span::from_milliseconds(50), Span::from_milliseconds(2));
        let press = Wrench::new(Vector3::new(0.0, 0.0, -5.0), Vector3::zeros());
        assert!((watch.step(&press).pressing_n - 5.0).abs() < 1e-12);
        let broken = Wrench::new(Vector3::repeat(f64::NAN), Vector3::zeros());
        assert!(watch.step(&broken).pressing_n.is_nan());
        assert!((watch.step(&press).pressing_n - 5.0).abs() < 1e-12);
    }
}
