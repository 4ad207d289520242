//! ur_rtde's script, driven by its registers as ur_rtde drives it.

use super::*;
use crate::controller::pose;
use crate::controller::robot::reading::Payload;

const SCRIPT: &[u8] = b"def rtde_control():\n  global reg_offset_int = 0\nend\n";

/// With the script running, and the payload as it is.
fn running() -> Rig {
    let mut rig = Rig::new();
    let tool = rig.controller.cell.config().arm.tool;
    let centre_m = tool.centre().vector();
    rig.controller.robot.carry(Payload { mass_kg: tool.mass_kg, centre_m });
    assert!(rig.controller.upload(SCRIPT));
    rig.ticks(2);
    assert_eq!(rig.controller.output.int(0), 1, "ready");
    rig
}

impl Rig {
    /// A command, until it is done; then back to none, until it is ready.
    fn command(&mut self, command: i32, doubles: &[f64]) {
        self.ask(command, doubles);
        self.until(20_000, |c| c.output.int(0) == 2);
        self.int(0, 0);
        self.until(10, |c| c.output.int(0) == 1);
    }

    fn ask(&mut self, command: i32, doubles: &[f64]) {
        doubles.iter().enumerate().for_each(|(i, x)| self.controller.input.set_double(i, *x));
        self.int(0, command);
    }

    fn answer(&self) -> [f64; 6] {
        self.controller.output.six(0)
    }

    fn felt(&self) -> [f64; 6] {
        pose::turned_axes(&self.controller.robot.reading().felt()).into()
    }
}

fn six(joints: &Joints) -> [f64; 6] {
    crate::controller::program::ur_rtde::numbers(joints)
}

#[test]
fn movej_arrives_and_the_controllers_kinematics_are_our_models() {
    let mut rig = running();
    let mut to = rig.measured();
    (to[0], to[4]) = (to[0] + 0.3, to[4] - 0.2);
    rig.command(1, &[&six(&to)[..], &[1.0, 1.4]].concat());
    rig.ticks(50);
    assert!(apart(&rig.measured(), &to) < 1e-3);
    rig.command(44, &[&six(&to)[..], &[0.0; 6]].concat());
    let model = rig.controller.cell.nominal().model().forward(&to);
    let there = pose::read(&rig.answer());
    assert!((there.translation.vector - model.origin().vector()).norm() < 1e-9);
    rig.command(46, &rig.answer());
    assert!(rig.answer().iter().zip(six(&to)).all(|(a, b)| (a - b).abs() < 1e-6));
}

#[test]
fn movel_goes_straight_and_speedl_and_its_stop_keep_their_word() {
    let mut rig = running();
    let from = pose::written(&rig.controller.robot.arm.tool(rig.controller.robot.target().0));
    let mut to = from;
    to[1] += 0.08;
    rig.ask(3, &[&to[..], &[0.1, 0.5]].concat());
    let mut off: f64 = 0.0;
    while rig.controller.output.int(0) != 2 {
        rig.ticks(1);
        let now = pose::written(&rig.controller.robot.arm.tool(rig.controller.robot.target().0));
        off = off.max((now[0] - from[0]).abs()).max((now[2] - from[2]).abs());
    }
    assert!(off < 1e-7, "{off}");
    rig.int(0, 0);
    rig.ticks(2);
    rig.ask(10, &[0.0, 0.0, 0.03, 0.0, 0.0, 0.0, 0.5, 0.0]);
    rig.ticks(200);
    let (q, qd, _) = rig.controller.robot.target();
    assert!((rig.controller.robot.arm.tool_velocity(q, qd)[2] - 0.03).abs() < 1e-6);
    rig.int(0, 0);
    rig.ticks(1);
    rig.command(15, &[1.0]);
    assert!(rig.controller.robot.target().1.largest() < 1e-9);
}

#[test]
fn force_mode_presses_the_leg_with_the_wrench_that_was_asked() {
    let mut rig = running();
    let probe = pose::numbers(rig.controller.cell.nominal().flange_from_probe.isometry());
    rig.command(29, &probe);
    rig.command(8, &[]);
    rig.controller.input.set_int(1, 2);
    (0..6).for_each(|axis| rig.controller.input.set_int(2 + axis, i32::from(axis == 2)));
    let wrench = [0.0, 0.0, -5.0, 0.0, 0.0, 0.0];
    rig.ask(6, &[&[0.0; 6][..], &wrench, &[0.05, 0.05, 0.05, 1.0, 1.0, 1.0]].concat());
    rig.ticks(9000);
    let mean = (0..500)
        .map(|_| {
            rig.ticks(1);
            rig.felt()[2]
        })
        .sum::<f64>()
        / 500.0;
    let truth = rig.controller.cell.truth().moments().last().unwrap().skin.force.norm();
    // 0.2 N: what the sensor drifts in 20 s, and friction beside.
    assert!((mean - 5.0).abs() < 0.1 && (truth - 5.0).abs() < 0.4, "read {mean:.3} N, truly {truth:.3} N");
    rig.int(0, 0);
    rig.ticks(2);
    rig.command(7, &[]);
}

#[test]
fn a_wrong_payload_shows_as_force_and_zeroing_hides_it_in_one_posture_only() {
    let mut rig = running();
    rig.ticks(100);
    let quiet = |rig: &mut Rig| {
        let mut sum = [0.0; 6];
        for _ in 0..200 {
            rig.ticks(1);
            sum.iter_mut().zip(rig.felt()).for_each(|(sum, f)| *sum += f / 200.0);
        }
        sum
    };
    let right = quiet(&mut rig);
    assert!(right[..3].iter().all(|f| f.abs() < 0.05), "{right:?}");
    // 0.2 kg too little: the controller feels them pull down.
    rig.command(17, &[0.65, 0.006, 0.0, 0.07]);
    let less = quiet(&mut rig);
    assert!((less[2] + 0.2 * 9.80665).abs() < 0.05, "{less:?}");
    rig.command(8, &[]);
    assert!(quiet(&mut rig)[..3].iter().all(|f| f.abs() < 0.05));
    let mut turned = rig.measured();
    turned[4] += 0.8;
    rig.command(1, &[&six(&turned)[..], &[1.0, 1.4]].concat());
    let elsewhere = quiet(&mut rig);
    assert!(elsewhere[..3].iter().any(|f| f.abs() > 0.5), "the zero was of another posture: {elsewhere:?}");
    // A centre of gravity 50 mm off shows as torque at the flange.
    rig.command(17, &[0.85, 0.056, 0.0, 0.07]);
    rig.command(8, &[]);
}

#[test]
fn in_teach_mode_the_hand_leads_the_arm_and_nobody_else() {
    let mut rig = running();
    let from = rig.measured();
    rig.command(18, &[]);
    rig.ticks(1500);
    assert!(rig.controller.teach_button() && apart(&from, &rig.measured()) > 0.02);
    rig.command(19, &[]);
    rig.ticks(200);
    let there = rig.measured();
    rig.ticks(200);
    assert!(!rig.controller.teach_button() && apart(&there, &rig.measured()) < 1e-3);
}

#[test]
fn freedrive_with_a_wrong_payload_lets_the_arm_sink() {
    let mut rig = running();
    rig.controller.config.hand = crate::controller::Helper::Absent;
    let height = |rig: &Rig| rig.controller.robot.arm.tool(&rig.measured()).translation.z;
    let before = height(&rig);
    rig.command(18, &[]);
    rig.ticks(500);
    assert!((height(&rig) - before).abs() < 1e-3, "the right payload is carried");
    rig.command(17, &[0.35, 0.006, 0.0, 0.07]);
    rig.ticks(500);
    assert!(before - height(&rig) > 0.01, "half a kilogram that nobody carries");
}

#[test]
fn the_watchdog_ends_the_program_when_nobody_writes() {
    let mut rig = running();
    rig.command(35, &[10.0]);
    for _ in 0..100 {
        rig.int(0, 0);
        rig.ticks(10);
    }
    assert!(rig.controller.program_name().is_some());
    let ticks = rig.until(100, |c| c.program_name().is_none());
    assert!((38..=60).contains(&ticks), "{ticks}");
    assert!(rig.controller.ended.contains("watchdog"));
}

#[test]
fn a_path_of_the_script_is_gone_through_point_by_point() {
    let mut rig = Rig::new();
    let from = rig.measured();
    let point = |d: f64| {
        let mut q = six(&from);
        q[0] += d;
        format!("movej([{}], a=1.4, v=1.0, r=0)", q.map(|x| x.to_string()).join(","))
    };
    let text = format!(
        "def rtde_control():\n def exec_move_path():\n  {}\n  {}\n end\nend\n",
        point(0.2),
        point(-0.1)
    );
    assert!(rig.controller.upload(text.as_bytes()));
    rig.ticks(2);
    rig.ask(45, &[]);
    let mut most: f64 = 0.0;
    while rig.controller.output.int(0) != 2 {
        rig.ticks(1);
        most = most.max(rig.measured()[0] - from[0]);
    }
    rig.ticks(50);
    assert!(most > 0.195 && (rig.measured()[0] - from[0] + 0.1).abs() < 1e-3);
}
