//! The names of the fields and their types.
//!
//! Source: the RTDE guide's tables of outputs and inputs, as `UR_WIRE.md` has them.

use super::Type;

use Type::{Bool, Double, Int32, Uint8, Uint32, Uint64, Vector3D, Vector6D, Vector6Int32};

/// What a controller gives, besides registers.
const OUTPUTS: [(&str, Type); 93] = [
    ("timestamp", Double),
    ("target_q", Vector6D),
    ("target_qd", Vector6D),
    ("target_qdd", Vector6D),
    ("target_current", Vector6D),
    ("target_moment", Vector6D),
    ("actual_q", Vector6D),
    ("actual_qd", Vector6D),
    ("actual_current", Vector6D),
    ("actual_current_window", Vector6D),
    ("actual_current_as_torque", Vector6D),
    ("joint_control_output", Vector6D),
    ("actual_TCP_pose", Vector6D),
    ("actual_TCP_speed", Vector6D),
    ("actual_TCP_force", Vector6D),
    ("target_TCP_pose", Vector6D),
    ("target_TCP_speed", Vector6D),
    ("tcp_offset", Vector6D),
    ("actual_TCP_acceleration", Vector6D),
    ("target_TCP_acceleration", Vector6D),
    ("actual_digital_input_bits", Uint64),
    ("actual_configurable_digital_input_bits", Uint64),
    ("joint_temperatures", Vector6D),
    ("actual_execution_time", Double),
    ("target_execution_time", Double),
    ("robot_mode", Int32),
    ("joint_mode", Vector6Int32),
    ("safety_mode", Int32),
    ("safety_status", Int32),
    ("actual_tool_accelerometer", Vector3D),
    ("speed_scaling", Double),
    ("target_speed_fraction", Double),
    ("actual_momentum", Double),
    ("actual_main_voltage", Double),
    ("actual_robot_voltage", Double),
    ("actual_robot_current", Double),
    ("actual_joint_voltage", Vector6D),
    ("actual_digital_output_bits", Uint64),
    ("actual_configurable_digital_output_bits", Uint64),
    ("runtime_state", Uint32),
    ("elbow_position", Vector3D),
    ("elbow_velocity", Vector3D),
    ("robot_status_bits", Uint32),
    ("safety_status_bits", Uint32),
    ("analog_io_types", Uint32),
    ("standard_analog_input0", Double),
    ("standard_analog_input1", Double),
    ("standard_analog_output0", Double),
    ("standard_analog_output1", Double),
    ("io_current", Double),
    ("euromap67_input_bits", Uint32),
    ("euromap67_output_bits", Uint32),
    ("euromap67_24V_voltage", Double),
    ("euromap67_24V_current", Double),
    ("tool_mode", Uint32),
    ("tool_analog_input_types", Uint32),
    ("tool_analog_input0", Double),
    ("tool_analog_input1", Double),
    ("tool_output_voltage", Int32),
    ("tool_output_current", Double),
    ("tool_temperature", Double),
    ("tcp_force_scalar", Double),
    ("joint_position_deviation_ratio", Double),
    ("collision_detection_ratio", Double),
    ("time_scale_source", Int32),
    ("encoder0_raw", Int32),
    ("encoder1_raw", Int32),
    ("tool_output_mode", Uint8),
    ("tool_digital_output0_mode", Uint8),
    ("tool_digital_output1_mode", Uint8),
    ("script_control_line", Uint32),
    ("payload", Double),
    ("payload_cog", Vector3D),
    ("payload_inertia", Vector6D),
    ("actual_robot_energy_consumed", Double),
    ("ft_raw_wrench", Vector6D),
    ("wrench_calc_from_currents", Vector6D),
    ("target_gravity", Vector3D),
    ("target_base_acceleration", Vector6D),
    ("target_base_wrench", Vector6D),
    ("control_step", Uint64),
    ("output_bit_registers0_to_31", Uint32),
    ("output_bit_registers32_to_63", Uint32),
    ("input_bit_registers0_to_31", Uint32),
    ("input_bit_registers32_to_63", Uint32),
    // Set by a client, and to be read back.
    ("speed_slider_mask", Uint32),
    ("speed_slider_fraction", Double),
    ("standard_digital_output_mask", Uint8),
    ("standard_digital_output", Uint8),
    ("configurable_digital_output_mask", Uint8),
    ("configurable_digital_output", Uint8),
    ("tool_digital_output_mask", Uint8),
    ("tool_digital_output", Uint8),
];

/// How many of [`OUTPUTS`], at its end, are a client's own settings: no controller gives them back.
const SETTINGS: usize = 8;

/// What a client may set, besides [`SETTINGS`] and registers.
const INPUTS: [(&str, Type); 7] = [
    ("standard_analog_output_mask", Uint8),
    ("standard_analog_output_type", Uint8),
    ("standard_analog_output_0", Double),
    ("standard_analog_output_1", Double),
    ("external_force_torque", Vector6D),
    ("input_bit_registers0_to_31", Uint32),
    ("input_bit_registers32_to_63", Uint32),
];

/// How many registers of integers, and of doubles, there are.
const REGISTERS: u32 = 48;

/// The bits that are registers of their own.
const BITS: std::ops::Range<u32> = 64..128;

/// The names of a recipe, in order. What follows the last comma is none when it is empty: some clients send it so.
pub fn names(text: &str) -> impl Iterator<Item = &str> {
    text.strip_suffix(',').unwrap_or(text).split(',').map(str::trim).filter(move |_| !text.is_empty())
}

/// The type of what a controller gives under this name; input registers can be read back.
pub fn output_type(name: &str) -> Option<Type> {
    let given = OUTPUTS.get(..OUTPUTS.len() - SETTINGS).unwrap_or_default();
    found(given, name).or_else(|| register("output_", name)).or_else(|| register("input_", name))
}

/// The type of what a client may set under this name.
pub fn input_type(name: &str) -> Option<Type> {
    let settings = OUTPUTS.get(OUTPUTS.len() - SETTINGS..).unwrap_or_default();
    found(&INPUTS, name).or_else(|| found(settings, name)).or_else(|| register("input_", name))
}

/// All names with a type of their own.
#[cfg(test)]
pub(super) fn all() -> impl Iterator<Item = (&'static str, Type)> {
    OUTPUTS.into_iter().chain(INPUTS)
}

fn found(table: &[(&str, Type)], name: &str) -> Option<Type> {
    table.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind)
}

/// The type of a register: `int_register_0`, `double_register_47`, `bit_register_64`.
fn register(direction: &str, name: &str) -> Option<Type> {
    let name = name.strip_prefix(direction)?;
    let kinds = [
        ("int_register_", Int32, 0..REGISTERS),
        ("double_register_", Double, 0..REGISTERS),
        ("bit_register_", Bool, BITS),
    ];
    kinds.into_iter().find_map(|(prefix, kind, numbers)| {
        let number = name.strip_prefix(prefix)?;
        let value: u32 = number.parse().ok()?;
        // `+1` and `007` are no names.
        (numbers.contains(&value) && value.to_string() == number).then_some(kind)
    })
}
