//! [`Measured`]: one output package, as numbers.

use super::rtde::{Recipe, Value};

/// What we ask the controller to tell, in this order.
pub(super) const OUTPUTS: &str = "timestamp,actual_q,actual_qd,target_q,actual_TCP_force,actual_TCP_pose,tcp_offset,\
payload,payload_cog,runtime_state,robot_mode,robot_status_bits,safety_status_bits,speed_scaling,\
output_int_register_24,output_int_register_25,output_int_register_26,output_int_register_27,output_int_register_28";

/// How often (Hz): the e-series' own rate.
pub(super) const RATE_HZ: f64 = 500.0;

/// One output package.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// Since the controller began (s).
    pub(super) timestamp_s: f64,
    pub(super) position: [f64; 6],
    pub(super) velocity: [f64; 6],
    pub(super) target: [f64; 6],
    pub(super) force: [f64; 6],
    pub(super) tcp_pose: [f64; 6],
    pub(super) tcp_offset: [f64; 6],
    pub(super) payload_kg: f64,
    pub(super) centre_m: [f64; 3],
    pub(super) runtime: u32,
    pub(super) mode: i32,
    pub(super) status_bits: u32,
    pub(super) safety_bits: u32,
    pub(super) speed_scaling: f64,
    pub(super) protocol: i32,
    pub(super) sequence: i32,
    pub(super) state: i32,
    pub(super) session: i32,
    pub(super) zeroed: i32,
}

impl Measured {
    /// Out of the fields of a package that [`Recipe::check`] took; `None` when the recipe is not [`OUTPUTS`]'.
    pub(super) fn read(recipe: &Recipe, fields: &[u8]) -> Option<Self> {
        let mut values = recipe.values(fields);
        let mut next = || values.next();
        Some(Self {
            timestamp_s: next().and_then(Value::double)?,
            position: next().and_then(Value::vector6)?,
            velocity: next().and_then(Value::vector6)?,
            target: next().and_then(Value::vector6)?,
            force: next().and_then(Value::vector6)?,
            tcp_pose: next().and_then(Value::vector6)?,
            tcp_offset: next().and_then(Value::vector6)?,
            payload_kg: next().and_then(Value::double)?,
            centre_m: next().and_then(Value::vector3)?,
            runtime: next().and_then(Value::uint32)?,
            mode: next().and_then(Value::int32)?,
            status_bits: next().and_then(Value::uint32)?,
            safety_bits: next().and_then(Value::uint32)?,
            speed_scaling: next().and_then(Value::double)?,
            protocol: next().and_then(Value::int32)?,
            sequence: next().and_then(Value::int32)?,
            state: next().and_then(Value::int32)?,
            session: next().and_then(Value::int32)?,
            zeroed: next().and_then(Value::int32)?,
        })
    }
}
