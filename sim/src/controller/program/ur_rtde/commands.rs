//! Each command of ur_rtde's script.

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use probepath_robot::Joints;

use super::{After, Contact, UrRtde};
use crate::controller::pose;
use crate::controller::program::Cycle;
use crate::controller::robot::force::ForceMode;
use crate::controller::robot::motion::Motion;
use crate::controller::robot::reading::Payload;
use crate::controller::robot::{Robot, Wish};

/// `tool_contact` feels a push of so many newtons.
const CONTACT_N: f64 = 5.0;

/// Whether something pushes at the tool.
pub(super) fn touches(robot: &Robot) -> bool {
    robot.reading().felt().fixed_rows::<3>(0).norm() > CONTACT_N
}

impl UrRtde {
    /// Carries one command out.
    pub(super) fn perform(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        match command {
            1..=4 => self.moves(command, cycle),
            6 | 7 => self.forces(command, cycle),
            9 | 10 | 15 | 41 | 42 => self.speeds(command, cycle),
            11 | 12 | 16 | 24 => self.servos(command, cycle),
            17 | 20 | 21 | 29 | 65 => self.sets(command, cycle),
            18 | 19 | 52 | 53 | 54 => self.guides(command, cycle),
            30 | 36 | 37 | 43 | 44 | 46 | 60 | 61 => self.kinematics(command, cycle),
            25 | 51 | 62..=64 => self.contacts(command, cycle),
            33 | 34 | 45 => self.stops(command, cycle),
            255 => After::End("the client stopped it".into()),
            _ => self.asks(command, cycle),
        }
    }

    fn double(&self, cycle: &Cycle<'_>, index: usize) -> f64 {
        cycle.input.double(self.offset + index)
    }

    fn six(&self, cycle: &Cycle<'_>, from: usize) -> [f64; 6] {
        cycle.input.six(self.offset + from)
    }

    fn joints(&self, cycle: &Cycle<'_>, from: usize) -> Joints {
        joints(&self.six(cycle, from))
    }

    fn answer(&self, cycle: &mut Cycle<'_>, values: &[f64; 6]) -> After {
        cycle.output.set_six(self.offset, values);
        After::Done
    }

    fn say(&self, cycle: &mut Cycle<'_>, value: i32) -> After {
        cycle.output.set_int(self.offset + 1, value);
        After::Done
    }

    fn moves(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let (six, here) = (self.six(cycle, 0), *cycle.robot.target().0);
        let (speed, acceleration) = (self.double(cycle, 6), self.double(cycle, 7));
        let wish = match command {
            1 => Wish::Joints { to: joints(&six), speed, acceleration },
            2 => match cycle.robot.arm.inverse(&pose::read(&six), &here) {
                Some(to) => Wish::Joints { to, speed, acceleration },
                None => return unreachable_pose(),
            },
            3 => Wish::Line { to: pose::read(&six), speed, acceleration },
            _ => Wish::Line { to: cycle.robot.arm.tool(&joints(&six)), speed, acceleration },
        };
        self.begin_move(cycle, |robot| robot.wish(wish))
    }

    fn forces(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        if command == 7 {
            self.force = None;
            cycle.robot.stiffen();
            cycle.robot.go(Motion::StopTool { deceleration: 10.0 });
            return After::Wait;
        }
        let selection = std::array::from_fn(|i| cycle.input.int(self.offset + 2 + i) != 0);
        let frame = pose::read(&self.six(cycle, 0));
        let (wrench, limits) = (self.six(cycle, 6).into(), self.six(cycle, 12).into());
        let kind = cycle.input.int(self.offset + 1);
        self.force = Some(ForceMode::new(frame, selection, wrench, kind, limits));
        After::Done
    }

    fn speeds(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let (six, acceleration) = (self.six(cycle, 0), self.double(cycle, 6));
        match command {
            9 => {
                self.speed_kind = 1;
                cycle.robot.go(Motion::SpeedJoints { wanted: joints(&six), acceleration });
                After::Done
            }
            10 => {
                self.speed_kind = 0;
                let wanted = pose::turned_axes(&Vector6::from(six));
                cycle.robot.go(Motion::SpeedTool { wanted, acceleration });
                After::Done
            }
            41 => {
                let wanted = self.jog(cycle, &six);
                let acceleration = self.double(cycle, 7);
                cycle.robot.go(Motion::SpeedTool { wanted, acceleration });
                After::Done
            }
            _ => {
                let deceleration = if command == 42 { 1.2 } else { self.double(cycle, 0) };
                cycle.robot.go(match self.speed_kind {
                    1 if command == 15 => Motion::Stop { deceleration },
                    _ => Motion::StopTool { deceleration },
                });
                After::Wait
            }
        }
    }

    /// The jog's speed in Base's axes: written in the base, the tool, or a feature.
    fn jog(&self, cycle: &Cycle<'_>, speed: &[f64; 6]) -> Vector6<f64> {
        let axes: UnitQuaternion<f64> = match self.double(cycle, 6) as i64 {
            1 => cycle.robot.arm.tool(cycle.robot.measured().0).rotation,
            2 => pose::read(&self.six(cycle, 8)).rotation,
            _ => pose::turned().rotation,
        };
        pose::rotated(&axes, &Vector6::from(*speed))
    }

    fn servos(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let six = self.six(cycle, 0);
        if command == 16 {
            cycle.robot.go(Motion::StopTool { deceleration: self.double(cycle, 0) });
            return After::Wait;
        }
        if command == 12 {
            let (speed, acceleration) = (self.double(cycle, 6), self.double(cycle, 7));
            cycle.robot.wish(Wish::Line { to: pose::read(&six), speed, acceleration });
            return After::Done;
        }
        let here = *cycle.robot.target().0;
        let target = match command {
            24 => cycle.robot.arm.inverse(&pose::read(&six), &here),
            _ => Some(joints(&six)),
        };
        let Some(target) = target else { return unreachable_pose() };
        let lag_s = cycle.robot.servo_lag_s(self.double(cycle, 9), self.double(cycle, 10));
        cycle.robot.go(Motion::Servo { target, lag_s });
        After::Done
    }

    fn sets(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let first = self.double(cycle, 0);
        match command {
            17 | 65 => {
                let [_, x, y, z, ..] = self.six(cycle, 0);
                let given = Vector3::new(x, y, z);
                let centre_m = if given.norm() > 0.0 { given } else { cycle.robot.payload().centre_m };
                cycle.robot.carry(Payload { mass_kg: first, centre_m });
            }
            20 => cycle.robot.force_damping = within(first, 0.0, 1.0, 0.025),
            21 => cycle.robot.force_gain = within(first, 0.01, 2.0, 0.5),
            _ => cycle.robot.arm.tcp = pose::isometry(&self.six(cycle, 0)),
        }
        After::Done
    }

    fn guides(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        match command {
            18 => cycle.robot.freedrive(UnitQuaternion::identity(), [true; 6]),
            52 => {
                let free = std::array::from_fn(|i| cycle.input.int(self.offset + 1 + i) != 0);
                cycle.robot.freedrive(pose::read(&self.six(cycle, 0)).rotation, free);
            }
            // Normal: it says something else only near a singularity.
            54 => return self.say(cycle, 0),
            _ => cycle.robot.stiffen(),
        }
        After::Done
    }

    fn kinematics(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let six = self.six(cycle, 0);
        let near = if matches!(command, 30 | 61) { self.joints(cycle, 6) } else { *cycle.robot.measured().0 };
        let arm = &cycle.robot.arm;
        match command {
            30 | 46 => match arm.inverse(&pose::read(&six), &near) {
                Some(found) => self.answer(cycle, &numbers(&found)),
                None => unreachable_pose(),
            },
            36 | 60 | 61 => {
                let reached = arm.inverse(&pose::read(&six), &near).is_some();
                self.say(cycle, i32::from(reached))
            }
            37 => {
                let inside = arm.model.outside_limits(&joints(&six), 0.0).is_none();
                self.say(cycle, i32::from(inside))
            }
            44 => {
                let flange = arm.flange(&joints(&six));
                let tool = pose::isometry(&self.six(cycle, 6));
                self.answer(cycle, &pose::written(&(flange * tool)))
            }
            _ => {
                let tool = pose::written(&arm.tool(cycle.robot.measured().0));
                self.answer(cycle, &tool)
            }
        }
    }

    fn contacts(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let felt = self.contact.felt.unwrap_or(0);
        match command {
            25 => {
                let touching = i32::from(touches(cycle.robot));
                self.say(cycle, touching)
            }
            51 => {
                let wanted = pose::turned_axes(&Vector6::from(self.six(cycle, 0)));
                let acceleration = self.double(cycle, 12);
                self.contact = Contact { moving: true, ..Contact::default() };
                cycle.robot.go(Motion::SpeedTool { wanted, acceleration });
                After::Wait
            }
            62 => {
                self.contact = Contact { watching: true, ..Contact::default() };
                After::Done
            }
            63 => {
                self.contact.watching = false;
                self.say(cycle, felt)
            }
            _ => self.say(cycle, felt),
        }
    }

    fn stops(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let deceleration = self.double(cycle, 0);
        match command {
            33 => self.begin_move(cycle, |robot| robot.go(Motion::StopTool { deceleration })),
            34 => self.begin_move(cycle, |robot| robot.go(Motion::Stop { deceleration })),
            _ => {
                let after = self.begin_move(cycle, |_| ());
                self.path = self.uploaded_path.clone();
                after
            }
        }
    }

    fn asks(&mut self, command: i32, cycle: &mut Cycle<'_>) -> After {
        let robot = &mut *cycle.robot;
        match command {
            8 => robot.zero_force(),
            26 => cycle.output.set_double(self.offset, 0.002),
            27 => {
                let steps = usize::try_from(cycle.input.int(self.offset + 1)).unwrap_or(0);
                let then = numbers(&robot.earlier(steps));
                return self.answer(cycle, &then);
            }
            28 => {
                let target = pose::written(&robot.arm.tool(robot.target().0));
                return self.answer(cycle, &target);
            }
            31 => robot.protective_stop("the program asked for it".into()),
            35 => {
                let hz = cycle.input.double(self.offset);
                self.watchdog_hz = (hz.is_finite() && hz > 0.0).then_some(hz);
            }
            38 => {
                let torques = numbers(&robot.torques());
                return self.answer(cycle, &torques);
            }
            39 => {
                let product = pose::isometry(&self.six(cycle, 0)) * pose::isometry(&self.six(cycle, 6));
                return self.answer(cycle, &pose::numbers(&product));
            }
            40 => {
                let tcp = pose::numbers(&robot.arm.tcp);
                return self.answer(cycle, &tcp);
            }
            47 => {
                let steady = i32::from(robot.is_steady());
                return self.say(cycle, steady);
            }
            58 => {
                let flange = pose::written(&robot.arm.flange(robot.measured().0));
                return self.answer(cycle, &flange);
            }
            // 56, 57, 59: an external sensor and another gravity, which this cell does not have. 66 to 71 need 5.23.
            _ => {}
        }
        After::Done
    }
}

fn unreachable_pose() -> After {
    After::End("inverse kinematics: no joints put the tool there".into())
}

fn within(value: f64, low: f64, high: f64, usual: f64) -> f64 {
    if value.is_finite() { value.clamp(low, high) } else { usual }
}

/// Six numbers as joints.
pub(in crate::controller) fn joints(six: &[f64; 6]) -> Joints {
    let mut all = Joints::zeros(6);
    all.as_mut_slice().copy_from_slice(six);
    all
}

/// Joints as six numbers; zeros where there are fewer.
pub(in crate::controller) fn numbers(joints: &Joints) -> [f64; 6] {
    let mut six = [0.0; 6];
    six.iter_mut().zip(joints.iter()).for_each(|(to, from)| *to = from);
    six
}
