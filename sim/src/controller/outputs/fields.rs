//! The quantities of arm and controller, by name.

use nalgebra::Vector6;
use probepath_robot::Joints;

use super::Value;
use crate::controller::core::{Controller, Runtime};
use crate::controller::pose;
use crate::controller::program::ur_rtde::numbers;
use crate::controller::robot::safety::Power;

/// A field's name, its type on the wire, and how it is read.
type Field = (&'static str, &'static str, fn(&Controller) -> Value);

/// What is not simulated, with the value that it has instead.
const MAINS_V: f64 = 230.0;
const ROBOT_V: f64 = 48.0;
const ROBOT_A: f64 = 0.6;
const JOINT_C: f64 = 30.0;
/// A joint's current for its torque (A / (N m)): a round number of the UR5e's size.
const A_PER_N_M: f64 = 0.1;

/// Every output that is no general-purpose register.
pub(in crate::controller) const FIELDS: &[Field] = &[
    ("timestamp", "DOUBLE", |c| Value::F64(c.now().seconds())),
    // Joints.
    ("target_q", "VECTOR6D", |c| six(c.robot.target().0)),
    ("target_qd", "VECTOR6D", |c| six(c.robot.target().1)),
    ("target_qdd", "VECTOR6D", |c| six(c.robot.target().2)),
    ("target_moment", "VECTOR6D", |c| six(&c.robot.torques())),
    ("target_current", "VECTOR6D", |c| six(&c.robot.torques().map(|t| t * A_PER_N_M))),
    ("actual_q", "VECTOR6D", |c| six(c.robot.measured().0)),
    ("actual_qd", "VECTOR6D", |c| six(c.robot.measured().1)),
    ("actual_current", "VECTOR6D", |c| six(&c.robot.torques().map(|t| t * A_PER_N_M))),
    ("actual_current_window", "VECTOR6D", |_| Value::V6([0.5; 6])),
    ("actual_current_as_torque", "VECTOR6D", |c| six(&c.robot.torques())),
    ("joint_control_output", "VECTOR6D", |c| six(&c.robot.torques().map(|t| t * A_PER_N_M))),
    ("joint_temperatures", "VECTOR6D", |_| Value::V6([JOINT_C; 6])),
    ("actual_joint_voltage", "VECTOR6D", |_| Value::V6([ROBOT_V; 6])),
    ("joint_mode", "VECTOR6INT32", |c| Value::V6I([c.robot.power.joint_mode(); 6])),
    // The tool. Axes and poses are those of the controller's base.
    ("actual_TCP_pose", "VECTOR6D", |c| Value::V6(pose::written(&c.robot.arm.tool(c.robot.measured().0)))),
    ("target_TCP_pose", "VECTOR6D", |c| Value::V6(pose::written(&c.robot.arm.tool(c.robot.target().0)))),
    ("actual_TCP_speed", "VECTOR6D", |c| speed(c, c.robot.measured())),
    ("target_TCP_speed", "VECTOR6D", |c| speed(c, (c.robot.target().0, c.robot.target().1))),
    ("actual_TCP_acceleration", "VECTOR6D", |c| acceleration(c)),
    ("target_TCP_acceleration", "VECTOR6D", |c| acceleration(c)),
    ("tcp_offset", "VECTOR6D", |c| Value::V6(pose::numbers(&c.robot.arm.tcp))),
    ("actual_TCP_force", "VECTOR6D", |c| vector(&pose::turned_axes(&c.robot.reading().felt()))),
    ("tcp_force_scalar", "DOUBLE", |c| Value::F64(c.robot.reading().felt().fixed_rows::<3>(0).norm())),
    ("ft_raw_wrench", "VECTOR6D", |c| Value::V6(c.robot.reading().raw())),
    ("wrench_calc_from_currents", "VECTOR6D", |c| vector(&pose::turned_axes(&c.robot.reading().felt()))),
    ("target_base_acceleration", "VECTOR6D", |_| Value::V6([0.0; 6])),
    ("target_base_wrench", "VECTOR6D", |_| Value::V6([0.0; 6])),
    ("actual_tool_accelerometer", "VECTOR3D", |c| Value::V3(c.robot.accelerometer())),
    ("elbow_position", "VECTOR3D", |c| Value::V3(c.robot.elbow())),
    ("elbow_velocity", "VECTOR3D", |_| Value::V3([0.0; 3])),
    // The payload.
    ("payload", "DOUBLE", |c| Value::F64(c.robot.payload().mass_kg)),
    ("payload_cog", "VECTOR3D", |c| Value::V3(c.robot.payload().centre_m.into())),
    ("payload_inertia", "VECTOR6D", |_| Value::V6([0.0; 6])),
    ("target_gravity", "VECTOR3D", |_| Value::V3([0.0, 0.0, 9.82])),
    // Modes.
    ("robot_mode", "INT32", |c| Value::I32(c.robot.power.mode())),
    ("safety_mode", "INT32", |c| Value::I32(c.robot.safety.mode())),
    ("safety_status", "INT32", |c| Value::I32(c.robot.safety.mode())),
    ("safety_status_bits", "UINT32", |c| Value::U32(c.robot.safety.bits())),
    ("robot_status_bits", "UINT32", |c| Value::U32(status(c))),
    ("runtime_state", "UINT32", |c| Value::U32(c.runtime as u32)),
    ("script_control_line", "UINT32", |_| Value::U32(0)),
    ("control_step", "UINT64", |c| Value::U64(c.counters.ticks)),
    // Speed.
    ("speed_scaling", "DOUBLE", |c| Value::F64(c.robot.scaling())),
    ("target_speed_fraction", "DOUBLE", |c| Value::F64(c.robot.slider)),
    ("time_scale_source", "INT32", |_| Value::I32(0)),
    ("actual_momentum", "DOUBLE", |_| Value::F64(0.0)),
    ("joint_position_deviation_ratio", "DOUBLE", |c| Value::F64(deviation(c))),
    ("collision_detection_ratio", "DOUBLE", |c| Value::F64(c.robot.push_ratio())),
    ("actual_execution_time", "DOUBLE", |_| Value::F64(0.0005)),
    ("target_execution_time", "DOUBLE", |_| Value::F64(0.002)),
    // Electricity.
    ("actual_main_voltage", "DOUBLE", |_| Value::F64(MAINS_V)),
    ("actual_robot_voltage", "DOUBLE", |c| {
        Value::F64(if c.robot.power == Power::Off { 0.0 } else { ROBOT_V })
    }),
    ("actual_robot_current", "DOUBLE", |c| {
        Value::F64(if c.robot.power == Power::Off { 0.0 } else { ROBOT_A })
    }),
    ("actual_robot_energy_consumed", "DOUBLE", |_| Value::F64(0.0)),
    ("io_current", "DOUBLE", |_| Value::F64(0.0)),
    ("euromap67_input_bits", "UINT32", |_| Value::U32(0)),
    ("euromap67_output_bits", "UINT32", |_| Value::U32(0)),
    ("euromap67_24V_voltage", "DOUBLE", |_| Value::F64(0.0)),
    ("euromap67_24V_current", "DOUBLE", |_| Value::F64(0.0)),
    // Inputs and outputs.
    ("actual_digital_input_bits", "UINT64", |_| Value::U64(0)),
    ("actual_digital_output_bits", "UINT64", |c| Value::U64(c.io.digital_outputs)),
    ("actual_configurable_digital_input_bits", "UINT64", |_| Value::U64(0)),
    ("actual_configurable_digital_output_bits", "UINT64", |c| Value::U64((c.io.digital_outputs >> 8) & 0xff)),
    ("standard_analog_input0", "DOUBLE", |_| Value::F64(0.0)),
    ("standard_analog_input1", "DOUBLE", |_| Value::F64(0.0)),
    ("standard_analog_output0", "DOUBLE", |c| Value::F64(c.io.analog_outputs[0])),
    ("standard_analog_output1", "DOUBLE", |c| Value::F64(c.io.analog_outputs[1])),
    ("analog_io_types", "UINT32", |c| Value::U32(c.io.analog_types << 2)),
    ("tool_mode", "UINT32", |c| Value::U32(c.robot.power.joint_mode().unsigned_abs())),
    ("tool_analog_input_types", "UINT32", |_| Value::U32(0)),
    ("tool_analog_input0", "DOUBLE", |_| Value::F64(0.0)),
    ("tool_analog_input1", "DOUBLE", |_| Value::F64(0.0)),
    ("tool_output_voltage", "INT32", |_| Value::I32(0)),
    ("tool_output_current", "DOUBLE", |_| Value::F64(0.0)),
    ("tool_temperature", "DOUBLE", |_| Value::F64(JOINT_C)),
    ("tool_output_mode", "UINT8", |_| Value::U8(0)),
    ("tool_digital_output0_mode", "UINT8", |_| Value::U8(0)),
    ("tool_digital_output1_mode", "UINT8", |_| Value::U8(0)),
    ("encoder0_raw", "INT32", |_| Value::I32(0)),
    ("encoder1_raw", "INT32", |_| Value::I32(0)),
];

fn six(joints: &Joints) -> Value {
    Value::V6(numbers(joints))
}

fn vector(six: &Vector6<f64>) -> Value {
    Value::V6((*six).into())
}

fn speed(c: &Controller, (position, velocity): (&Joints, &Joints)) -> Value {
    vector(&pose::turned_axes(&c.robot.arm.tool_velocity(position, velocity)))
}

/// Of the target, at this posture; what the turning of the Jacobian adds is left out.
fn acceleration(c: &Controller) -> Value {
    let (position, _, acceleration) = c.robot.target();
    vector(&pose::turned_axes(&c.robot.arm.tool_velocity(position, acceleration)))
}

/// How far the joints are behind their target, of 0.1 rad, at which a controller would stop.
fn deviation(c: &Controller) -> f64 {
    let behind = c.robot.target().0.zip(c.robot.measured().0, |a, b| a - b).largest();
    (behind / 0.1).min(1.0)
}

/// Bits 0 power on, 1 program running, 2 teach button, 3 power button.
fn status(c: &Controller) -> u32 {
    u32::from(c.robot.power != Power::Off)
        | (u32::from(c.runtime == Runtime::Playing) << 1)
        | (u32::from(c.teach_button()) << 2)
}
