//! The skin under the probe: how hard it pushes back, where it is higher or lower than the drawn surface, how it
//! drags.
//!
//! The probe's face is a rectangle of 40 mm x 10 mm (a linear head). At ten points of it the skin answers with a
//! spring and a damper along its own outward normal, and with Coulomb and viscous friction against the sliding; the
//! sum is the wrench. On a plane, pressed squarely, the force is stiffness times depth. Sources: FIELD.md section 8.

use nalgebra::Vector3;
use probepath_frames::{Direction, Point, Pose, Probe, Twist, World, Wrench};
use serde::{Deserialize, Serialize};

use crate::disturbance::Disturbance;
use crate::random::{Stream, Wander};

/// Half the length of the probe's face, along its x (m).
pub const HALF_FACE_X_M: f64 = 0.020;
/// Half the width of the probe's face, along its y (m).
pub const HALF_FACE_Y_M: f64 = 0.005;
/// Places along the face's length at which the skin answers, as fractions of the half length.
const ALONG: [f64; 5] = [-0.8, -0.4, 0.0, 0.4, 0.8];
/// And across it: the two Gauss points, so that a tilt meets the moment of an even pressure.
const ACROSS: [f64; 2] = [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8];
/// Parts of the face's length for which it is asked whether they touch.
const TOUCH_STEPS: u32 = 40;
/// Sliding slower than this (m/s) is creep: Coulomb's friction sets in smoothly around it.
const CREEP_M_S: f64 = 0.002;
/// The probe is far from the skin when its middle is further out than this (m): no point of the face can touch.
const FAR_M: f64 = 0.05;

/// A body's outer surface.
pub trait Surface {
    /// Signed distance to the surface (m, negative inside) and the outward normal there.
    fn surface(&self, point: Point<World>) -> (f64, Direction<World>);

    /// Where a sonographer would hold the probe to look at `inside`: outward over it. The nearest skin's normal, but
    /// for a body with faces that nobody scans through.
    fn outward_over(&self, inside: Point<World>) -> Direction<World> {
        self.surface(inside).1
    }
}

/// How the skin behaves; all of it varies along the leg from the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SkinConfig {
    /// Softest place: force per depth of the whole face (N/mm).
    pub softest_n_mm: f64,
    /// Hardest place (N/mm).
    pub hardest_n_mm: f64,
    /// Highest bump and deepest hollow, beside the drawn surface (mm).
    pub bumps_mm: f64,
    /// Shortest distance from one bump to the next (mm); the longest is 2.5 times as far.
    pub bump_spacing_mm: f64,
    /// Coulomb friction: sliding force over pressing force; with gel.
    pub friction: f64,
    /// Viscous friction of the whole face against sliding (N s/m).
    pub sliding_n_s_m: f64,
    /// Damping of the whole face against pressing (N s/m).
    pub pressing_n_s_m: f64,
    /// Gap that gel bridges between the face and the skin (mm): there the picture still comes through.
    pub gel_mm: f64,
}

impl Default for SkinConfig {
    fn default() -> Self {
        Self {
            softest_n_mm: 0.3,
            hardest_n_mm: 3.0,
            bumps_mm: 5.0,
            bump_spacing_mm: 120.0,
            friction: 0.06,
            sliding_n_s_m: 8.0,
            pressing_n_s_m: 6.0,
            gel_mm: 1.5,
        }
    }
}

impl SkinConfig {
    /// Flat and of one stiffness, without friction: what a bench test wants.
    pub fn even(stiffness_n_mm: f64) -> Self {
        Self {
            softest_n_mm: stiffness_n_mm,
            hardest_n_mm: stiffness_n_mm,
            bumps_mm: 0.0,
            friction: 0.0,
            sliding_n_s_m: 0.0,
            pressing_n_s_m: 0.0,
            ..Self::default()
        }
    }
}

/// The skin of one seed.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    config: SkinConfig,
    hardness: [Wander; 2],
    bumps: [Wander; 2],
}

impl Skin {
    pub(crate) fn new(config: &SkinConfig, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "skin");
        let shortest = (config.bump_spacing_mm * 1e-3).max(1e-3);
        let mut of = |low: f64, high: f64| Wander::new(&mut stream, low, high);
        let hardness = [of(0.8, 3.0), of(0.8, 3.0)];
        let bumps = [of(0.4 / shortest, 1.0 / shortest), of(0.4 / shortest, 1.0 / shortest)];
        Self { config: config.clone(), hardness, bumps }
    }

    /// Force per depth of the whole face pressed at `place` (N/m): between softest and hardest, evenly in its
    /// logarithm, reaching both.
    pub(crate) fn stiffness(&self, place: Point<World>) -> f64 {
        let p = place.vector();
        let phase = 1.6 * self.hardness[0].at(p.z) + 0.4 * self.hardness[1].at(p.x);
        let fraction = (1.0 + phase.sin()) / 2.0;
        let (soft, hard) = (self.config.softest_n_mm.ln(), self.config.hardest_n_mm.ln());
        (soft + (hard - soft) * fraction).exp() * 1e3
    }

    /// How far the skin stands out beyond the drawn surface (m).
    pub(crate) fn bump(&self, place: Point<World>) -> f64 {
        let p = place.vector();
        let height = (1.3 * self.bumps[0].at(p.z)).sin() * (0.6 * self.bumps[1].at(p.x)).cos();
        self.config.bumps_mm * 1e-3 * height
    }

    /// Signed distance to the bumpy skin (m) and the drawn surface's normal. The bumps are shallow (slopes under
    /// 0.4), so their own tilt of the normal is left out.
    pub(crate) fn distance(&self, body: &dyn Surface, place: Point<World>) -> (f64, Direction<World>) {
        let (distance, normal) = body.surface(place);
        (distance - self.bump(place), normal)
    }

    /// What the skin does to a probe at `world_from_probe` that moves with `twist`.
    pub(crate) fn press(
        &self,
        body: &dyn Surface,
        world_from_probe: &Pose<World, Probe>,
        twist: &Twist<Probe>,
        disturbance: &Disturbance,
    ) -> Wrench<Probe> {
        let mut total = Wrench::zero();
        if self.distance(body, world_from_probe.origin()).0 > FAR_M {
            return total;
        }
        for along in ALONG {
            for across in ACROSS {
                let at = Vector3::new(along * HALF_FACE_X_M, across * HALF_FACE_Y_M, 0.0);
                let force = self.push(body, world_from_probe, (twist, disturbance), at);
                total = total + Wrench::new(force, at.cross(&force));
            }
        }
        total
    }

    /// Where gel joins the face to the skin: from and to along the probe's x (m), around the middle of what touches;
    /// `None` when all of it is in the air.
    pub(crate) fn touched(
        &self,
        body: &dyn Surface,
        world_from_probe: &Pose<World, Probe>,
        disturbance: &Disturbance,
    ) -> Option<(f64, f64)> {
        let step = 2.0 * HALF_FACE_X_M / f64::from(TOUCH_STEPS);
        let at = |i: u32| -HALF_FACE_X_M + step * f64::from(i);
        let gap = |i: u32| {
            let place = *world_from_probe * Point::<Probe>::new(at(i), 0.0, 0.0);
            self.distance(body, place).0 - disturbance.bump(place.vector().z) - self.config.gel_mm * 1e-3
        };
        let gaps: Vec<f64> = (0..=TOUCH_STEPS).map(gap).collect();
        let touching = |i: &u32| gaps.get(*i as usize).is_some_and(|gap| *gap < 0.0);
        let (first, last) = ((0..=TOUCH_STEPS).find(touching)?, (0..=TOUCH_STEPS).rev().find(touching)?);
        Some((at(first) - step / 2.0, at(last) + step / 2.0))
    }

    /// The force at one point of the face, in Probe's axes (N).
    fn push(
        &self,
        body: &dyn Surface,
        world_from_probe: &Pose<World, Probe>,
        (twist, disturbance): (&Twist<Probe>, &Disturbance),
        at: Vector3<f64>,
    ) -> Vector3<f64> {
        let place = *world_from_probe * Point::<Probe>::from_vector(at);
        let (distance, normal) = self.distance(body, place);
        let along_m = place.vector().z;
        let distance = distance - disturbance.bump(along_m);
        if distance >= 0.0 {
            return Vector3::zeros();
        }
        let share = 1.0 / (ALONG.len() * ACROSS.len()) as f64;
        let normal = (world_from_probe.inverse() * normal).vector();
        let velocity = twist.linear + twist.angular.cross(&at);
        let approach = -velocity.dot(&normal);
        let (stiffer, drier) = disturbance.factors(along_m);
        let press = stiffer * self.stiffness(place) * -distance + self.config.pressing_n_s_m * approach;
        let pressing = press.max(0.0) * share;
        normal * pressing + self.drag(velocity + normal * approach, pressing, share) * drier
    }

    /// Friction against sliding with `velocity` (m/s) under a pressing force (N).
    fn drag(&self, velocity: Vector3<f64>, pressing: f64, share: f64) -> Vector3<f64> {
        let speed = velocity.norm();
        if speed < 1e-9 {
            return Vector3::zeros();
        }
        let coulomb = self.config.friction * pressing * (speed / CREEP_M_S).tanh();
        -velocity / speed * (coulomb + self.config.sliding_n_s_m * share * speed)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;

    /// Tissue below the plane y = 0 of the World (y points down).
    pub(crate) struct Table;

    impl Surface for Table {
        fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
            (-point.vector().y, Direction::y().reversed())
        }
    }

    fn still() -> Disturbance {
        Disturbance::new(crate::DisturbanceConfig::default(), probepath_frames::Stamp::ZERO)
    }

    /// The probe pointing down, its face `depth` metres into the table.
    pub(crate) fn down(depth: f64) -> Pose<World, Probe> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
        // FRAMES: Probe z turned onto World y (down), Probe x left on World x.
        Pose::assume(Isometry3::from_parts(Vector3::new(0.0, depth, 0.0).into(), turn))
    }

    #[test]
    fn pressed_squarely_the_force_is_stiffness_times_depth_and_negative_along_z() {
        let skin = Skin::new(&SkinConfig::even(1.5), 1);
        let wrench = skin.press(&Table, &down(0.003), &Twist::zero(), &still());
        assert!((wrench.force - Vector3::new(0.0, 0.0, -4.5)).norm() < 1e-9, "{}", wrench.force);
        assert!(wrench.torque.norm() < 1e-9);
    }

    #[test]
    fn in_the_air_nothing_pushes() {
        let skin = Skin::new(&SkinConfig::even(1.5), 1);
        assert_eq!(skin.press(&Table, &down(-0.0001), &Twist::zero(), &still()), Wrench::zero());
    }

    #[test]
    fn what_touches_is_found_along_the_face() {
        let skin = Skin::new(&SkinConfig::even(1.5), 1);
        assert_eq!(skin.touched(&Table, &down(-0.0016), &still()), None);
        let (from, to) = skin.touched(&Table, &down(0.001), &still()).unwrap();
        assert!(from < -0.02 && to > 0.02);
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.2);
        // FRAMES: the same probe, turned about its own y: positive x goes out of the table's tissue.
        let tilted =
            down(0.0) * Pose::<Probe, Probe>::assume(Isometry3::from_parts(Vector3::zeros().into(), tilt));
        let (from, to) = skin.touched(&Table, &tilted, &still()).unwrap();
        // The face stands 1.5 mm over the tissue at 1.5 mm / sin(0.2) = 7.55 mm.
        assert!(
            (from + 0.00755).abs() < 0.001 && to > 0.02 || from < -0.02 && (to - 0.00755).abs() < 0.001,
            "{from} {to}"
        );
    }

    #[test]
    fn a_tilted_face_is_pushed_level() {
        let skin = Skin::new(&SkinConfig::even(1.5), 1);
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.05);
        // FRAMES: the same probe, turned about its own y.
        let tilted =
            down(0.003) * Pose::<Probe, Probe>::assume(Isometry3::from_parts(Vector3::zeros().into(), tilt));
        let wrench = skin.press(&Table, &tilted, &Twist::zero(), &still());
        assert!(wrench.torque.y < -1e-4, "{}", wrench.torque);
    }

    #[test]
    fn friction_opposes_sliding_and_grows_with_pressing() {
        let config = SkinConfig { friction: 0.1, sliding_n_s_m: 5.0, ..SkinConfig::even(1.0) };
        let skin = Skin::new(&config, 1);
        let slide = Twist::new(Vector3::new(0.0, 0.02, 0.0), Vector3::zeros());
        let wrench = skin.press(&Table, &down(0.004), &slide, &still());
        assert!((wrench.force.y + 0.1 * 4.0 + 5.0 * 0.02).abs() < 1e-6, "{}", wrench.force);
        assert!(wrench.force.x.abs() < 1e-12);
    }

    #[test]
    fn stiffness_and_bumps_fill_their_ranges_and_are_smooth() {
        let skin = Skin::new(&SkinConfig::default(), 5);
        let along = |i: i32| Point::<World>::new(0.01, 0.0, f64::from(i) * 1e-3);
        let stiff: Vec<f64> = (0..4000).map(|i| skin.stiffness(along(i)) * 1e-3).collect();
        let bumps: Vec<f64> = (0..4000).map(|i| skin.bump(along(i)) * 1e3).collect();
        let (low, high) =
            (stiff.iter().copied().fold(9.0, f64::min), stiff.iter().copied().fold(0.0, f64::max));
        assert!((0.3..0.33).contains(&low) && (2.8..=3.0001).contains(&high), "{low} {high}");
        let top = bumps.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
        assert!((3.0..=5.0).contains(&top), "{top}");
        assert!(bumps.windows(2).all(|w| (w[1] - w[0]).abs() < 0.6), "a bump steeper than 0.6");
        assert!(stiff.windows(2).all(|w| (w[1] / w[0] - 1.0).abs() < 0.07), "stiffness that jumps");
    }
}
