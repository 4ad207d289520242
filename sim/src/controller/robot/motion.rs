//! What the arm is doing: the controller's motion commands, one tick at a time.

use nalgebra::{Isometry3, UnitQuaternion, Vector6};
use probepath_robot::Joints;

use super::Kinematics;
use super::profile::Profile;
use crate::arm::give_way::{difference, moved};

/// A motion of the target.
#[derive(Clone, Debug)]
pub(in crate::controller) enum Motion {
    /// `stopj`: every joint slows down along its way; then the arm stands.
    Stop { deceleration: f64 },
    /// `stopl`: the tool slows down along its way.
    StopTool { deceleration: f64 },
    /// `movej`: the joints in a straight line.
    Joints { from: Joints, to: Joints, profile: Profile, seconds: f64 },
    /// `movel`: the tool in a straight line; `share` of the way is the profile over its length.
    Line { from: Isometry3<f64>, to: Isometry3<f64>, profile: Profile, length: f64, seconds: f64 },
    /// `servoj`: after a target that is sent again and again.
    Servo { target: Joints, lag_s: f64 },
    /// `speedj`.
    SpeedJoints { wanted: Joints, acceleration: f64 },
    /// `speedl`: in Base's axes at the tool.
    SpeedTool { wanted: Vector6<f64>, acceleration: f64 },
}

/// Where the target is and how fast it goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) position: Joints,
    pub(super) velocity: Joints,
}

impl Motion {
    /// `movej` to `to`.
    pub(in crate::controller) fn to_joints(from: Joints, to: Joints, speed: f64, acceleration: f64) -> Self {
        let length = from.zip(&to, |a, b| b - a).largest();
        Self::Joints { from, to, profile: Profile::new(length, speed, acceleration), seconds: 0.0 }
    }

    /// `movel` to `to` (the tool in Base). Speed and acceleration are along the way (m), of the turn (rad) where that is
    /// longer, as a tool that only turns has no way.
    pub(in crate::controller) fn to_place(
        from: Isometry3<f64>,
        to: Isometry3<f64>,
        speed: f64,
        acceleration: f64,
    ) -> Self {
        let off = difference(&from, &to);
        let length = off.fixed_rows::<3>(0).norm().max(off.fixed_rows::<3>(3).norm() * TURN_COUNTS_M);
        Self::Line { from, to, profile: Profile::new(length, speed, acceleration), length, seconds: 0.0 }
    }

    /// Whether nothing is left to do.
    pub(super) fn is_over(&self, target: &Target) -> bool {
        match self {
            Self::Stop { .. } | Self::StopTool { .. } => target.velocity.largest() < 1e-12,
            Self::Joints { profile, seconds, .. } | Self::Line { profile, seconds, .. } => {
                *seconds >= profile.duration()
            }
            _ => false,
        }
    }

    /// The target's position after `dt` seconds, of which a move counts only `scaling`; or why there is none.
    pub(super) fn step(
        &mut self,
        now: &Target,
        arm: &Kinematics,
        dt: f64,
        scaling: f64,
    ) -> Result<Joints, &'static str> {
        let rest = Joints::zeros(now.position.len());
        match self {
            Self::Stop { deceleration } => Ok(joint_speed(now, &rest, *deceleration, dt)),
            Self::StopTool { deceleration } => {
                // Where the tool cannot brake straight, the joints do.
                tool_speed(now, arm, &Vector6::zeros(), *deceleration, dt)
                    .or_else(|_| Ok(joint_speed(now, &rest, 5.0, dt)))
            }
            Self::SpeedJoints { wanted, acceleration } => Ok(joint_speed(now, wanted, *acceleration, dt)),
            Self::SpeedTool { wanted, acceleration } => tool_speed(now, arm, wanted, *acceleration, dt),
            Self::Servo { target, lag_s } => Ok(servo(now, target, *lag_s, dt)),
            Self::Joints { from, to, profile, seconds } => {
                *seconds += dt * scaling;
                let length = from.zip(to, |a, b| b - a).largest();
                let share = if length > 0.0 { profile.at(*seconds) / length } else { 1.0 };
                Ok(from.zip(to, |a, b| a + (b - a) * share))
            }
            Self::Line { from, to, profile, length, seconds } => {
                *seconds += dt * scaling;
                let share = if *length > 0.0 { profile.at(*seconds) / *length } else { 1.0 };
                arm.joints_at(&along(from, to, share), &now.position)
                    .ok_or("a movel that meets a singularity")
            }
        }
    }
}

/// A radian of the tool's turn counts as so much way.
const TURN_COUNTS_M: f64 = 1.0;

fn along(from: &Isometry3<f64>, to: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let off = difference(from, to);
    let turn = UnitQuaternion::from_scaled_axis(off.fixed_rows::<3>(3) * share);
    let place = from.translation.vector + off.fixed_rows::<3>(0) * share;
    Isometry3::from_parts(place.into(), turn * from.rotation)
}

/// Joint velocities go to `wanted`, the fastest change at `acceleration`, all in proportion.
fn joint_speed(now: &Target, wanted: &Joints, acceleration: f64, dt: f64) -> Joints {
    let off = wanted.zip(&now.velocity, |w, v| w - v);
    let share = (positive(acceleration) * dt / off.largest().max(1e-300)).min(1.0);
    let mut next = now.position;
    for joint in 0..next.len() {
        next[joint] += (now.velocity[joint] + off[joint] * share) * dt;
    }
    next
}

/// The tool's velocity goes to `wanted` at `acceleration`.
fn tool_speed(
    now: &Target,
    arm: &Kinematics,
    wanted: &Vector6<f64>,
    acceleration: f64,
    dt: f64,
) -> Result<Joints, &'static str> {
    if now.velocity.largest() < 1e-12 && wanted.amax() < 1e-12 {
        return Ok(now.position);
    }
    let speed = arm.tool_velocity(&now.position, &now.velocity);
    let off = wanted - speed;
    let share = (positive(acceleration) * dt / off.norm().max(1e-300)).min(1.0);
    let next = speed + off * share;
    if next.amax() < 1e-9 {
        return Ok(now.position);
    }
    moved(&arm.model, &arm.flange_from_tcp(), &now.position, &next, dt).ok_or("a tool speed at a singularity")
}

/// Critically damped after the target, solved exactly: behind a steady motion it lags `lag_s`.
fn servo(now: &Target, target: &Joints, lag_s: f64, dt: f64) -> Joints {
    let rate = 2.0 / lag_s.max(1e-3);
    let fade = (-rate * dt).exp();
    let mut next = now.position;
    for joint in 0..next.len() {
        let error = now.position[joint] - target[joint];
        next[joint] = target[joint] + (error + (now.velocity[joint] + rate * error) * dt) * fade;
    }
    next
}

fn positive(x: f64) -> f64 {
    if x.is_finite() && x > 1e-3 { x } else { 1e-3 }
}

/// How far behind a steady motion `servoj` is: its look-ahead time at the gain of 300 that is its default, less at a
/// higher gain. The scaling with the gain's root is our assumption: no source gives the controller's own filter.
pub(super) fn servo_lag_s(lookahead_s: f64, gain: f64) -> f64 {
    let lookahead = if lookahead_s.is_finite() { lookahead_s.clamp(0.03, 0.2) } else { 0.1 };
    let gain = if gain.is_finite() { gain.clamp(100.0, 2000.0) } else { 300.0 };
    lookahead * (300.0 / gain).sqrt()
}
