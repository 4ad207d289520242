//! [`OnPath`]: the joints of every tick on the path, and the binding limit's way onto the board.

use probepath_robot::JointBound;
use probepath_robot::Joints;
use probepath_robot::motion::follow::Curve;
use probepath_robot::motion::timing::PathClock;
use probepath_robot::step::{Behind, Binding, PathStep, StepError, StepSettings, Stepped, Stepper};

use crate::Plan;
use crate::probe_arm::along_z;

/// The plan refused what comes nearer to a singularity than its own bound; the step itself goes a little nearer.
const SINGULAR: f64 = 0.5;
/// A redundant arm uses all of its freedom from this speed along the path (m/s).
const FREE_FROM_M_S: f64 = 0.005;
/// Off its path by more than this (m), or held back for so long (s), it gives up.
const OFF_M: f64 = 0.003;
const HELD_S: f64 = 3.0;

/// Steps the arm along the plan's curve, and holds the clock back where the joints cannot follow.
#[derive(Clone, Debug)]
pub(super) struct OnPath {
    stepper: Stepper,
    behind: Behind,
    held_by: Option<Binding>,
    held_s: f64,
}

impl OnPath {
    pub(super) fn new(plan: &Plan) -> Result<Self, StepError> {
        let settings = StepSettings {
            workspace: plan.settings.workspace.clone(),
            // The plan goes up to the planes.
            margin_m: 0.0,
            least_singular: SINGULAR * plan.settings.least_singular,
            ..StepSettings::default()
        };
        let arm = &plan.arm;
        let (model, probe) = (arm.model.clone(), arm.flange_from_probe);
        let stepper = Stepper::at_rest(model, probe, arm.limits, arm.period, plan.start, settings)?;
        Ok(Self { stepper, behind: Behind::default(), held_by: None, held_s: 0.0 })
    }

    /// A command that came from elsewhere: the way through the air.
    pub(super) fn sent(&mut self, joints: &Joints) {
        // What does not fit is refused by the loop's own limiter.
        let _ = self.stepper.sent(joints);
    }

    /// The joints for the clock's place along the path and the offset along the probe's axis; none when the arm is
    /// held back for good.
    pub(super) fn step(
        &mut self,
        plan: &Plan,
        clock: &mut PathClock,
        offset: f64,
        dt: f64,
    ) -> Option<Joints> {
        let (place, aim) = (self.behind.place(), self.behind.aim(clock.at(), dt));
        let at = |s: f64| along_z(&plan.curve.at(s).base_from_probe, offset);
        let still = at(place);
        let ahead = if aim > place { at(aim) } else { still };
        let freedom = (clock.speed() / FREE_FROM_M_S).min(1.0);
        let stepped = self.stepper.step(&PathStep { still, ahead, freedom }).ok()?;
        self.behind.went(&stepped);
        clock.hold_back(self.behind.scale());
        self.judge(&stepped, dt)
    }

    fn judge(&mut self, stepped: &Stepped, dt: f64) -> Option<Joints> {
        self.held_by = stepped.binding;
        self.held_s = if self.behind.scale() < 0.05 { self.held_s + dt } else { 0.0 };
        let gives_up = stepped.off.0 > OFF_M || self.held_s > HELD_S;
        (!gives_up).then_some(stepped.position)
    }

    /// Where along the path the arm is (m).
    pub(super) const fn place(&self) -> f64 {
        self.behind.place()
    }

    /// Whether it is where the clock is, but for a hundredth of a millimetre.
    pub(super) fn keeps_up(&self) -> bool {
        self.behind.by() < 1e-5
    }

    /// The limit that holds it back now.
    pub(super) const fn held_by(&self) -> Option<Binding> {
        self.held_by
    }
}

/// A binding as one number for the board; zero is none.
pub(super) fn to_number(held_by: Option<Binding>) -> u64 {
    match held_by {
        None => 0,
        Some(Binding::Singularity) => 1,
        Some(Binding::Joint { joint, bound }) => 2 + 4 * joint as u64 + bound as u64,
        Some(Binding::Plane { number }) => PLANES + number as u64,
    }
}

/// The board's numbers from which planes are counted.
const PLANES: u64 = 1 << 16;

/// The binding of a number of the board.
pub(super) fn of_number(number: u64) -> Option<Binding> {
    use JointBound::{Acceleration, Jerk, Position, Velocity};
    match number {
        0 => None,
        1 => Some(Binding::Singularity),
        PLANES.. => Some(Binding::Plane { number: (number - PLANES) as usize }),
        _ => {
            let joint = (number - 2) / 4;
            let bound = [Position, Velocity, Acceleration, Jerk][((number - 2) % 4) as usize];
            Some(Binding::Joint { joint: joint as usize, bound })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_goes_over_the_board_and_back() {
        use JointBound::{Acceleration, Jerk, Position, Velocity};
        let joints = (0..8).flat_map(|joint| {
            [Position, Velocity, Acceleration, Jerk].map(|bound| Some(Binding::Joint { joint, bound }))
        });
        let planes = (0..100).map(|number| Some(Binding::Plane { number }));
        for binding in joints.chain(planes).chain([None, Some(Binding::Singularity)]) {
            assert_eq!(of_number(to_number(binding)), binding);
        }
    }
}
