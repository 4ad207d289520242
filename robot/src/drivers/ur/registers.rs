//! The registers through which our script on the controller and the driver speak.
//!
//! All lie in the upper range, 24 to 47, which is a client's (the lower one is a field bus's); it needs PolyScope 5.3.
//! [`PROTOCOL`] changes whenever anything here does, and both ends compare it before anything moves.
//!
//! ```text
//!  host                                   controller
//!  HELLO, SESSION = n ──────────────────▶ WAITING ── echoes SESSION = n ──▶ HOLDING
//!  every tick: SEQUENCE + 1, COMMAND,  ──▶ servoes, holds, gives way; echoes SEQUENCE and STATE
//!              SETPOINT
//!  silence, or SEQUENCE stands still,  ──▶ stopj, TIMED_OUT: only a HELLO with another SESSION goes on, from HOLDING
//!  while the COMMAND is not STAY
//! ```
//!
//! Silence while the last command was [`command::STAY`] changes nothing, so that the host may think between motions;
//! the arm is at rest then, and [`state::HOLDING`] stays.

/// The number of this map and of what the script does; in [`OUT_PROTOCOL`] from the script's first tick.
pub const PROTOCOL: i32 = 1;

/// `input_int_register`: one more at every tick, never negative. The watchdogs look at it.
pub const IN_SEQUENCE: u32 = 24;
/// `input_int_register`: one of [`command`].
pub const IN_COMMAND: u32 = 25;
/// `input_int_register`: the number of the handshake, above zero.
pub const IN_SESSION: u32 = 26;
/// The first of six `input_double_register`s: where the joints shall be (rad).
pub const IN_SETPOINT: u32 = 24;

/// `output_int_register`: [`PROTOCOL`].
pub const OUT_PROTOCOL: u32 = 24;
/// `output_int_register`: the [`IN_SEQUENCE`] that was read last.
pub const OUT_SEQUENCE: u32 = 25;
/// `output_int_register`: one of [`state`].
pub const OUT_STATE: u32 = 26;
/// `output_int_register`: the [`IN_SESSION`] that is being served; 0 before the first.
pub const OUT_SESSION: u32 = 27;
/// `output_int_register`: how often the force sensor was zeroed since the script began.
pub const OUT_ZEROED: u32 = 28;

/// What the script is told.
pub mod command {
    /// Be at rest.
    pub const STAY: i32 = 0;
    /// Begin, or begin again after a time-out.
    pub const HELLO: i32 = 1;
    /// Be at the setpoint at the next tick.
    pub const SERVO: i32 = 2;
    /// Give way to the hand.
    pub const FREEDRIVE: i32 = 3;
    /// Zero the force sensor, once, at rest and in the air; then stay.
    pub const ZERO: i32 = 4;
    /// End the program, at rest.
    pub const END: i32 = 9;
}

/// What the script says of itself.
pub mod state {
    /// It has not begun: the register's value before the script writes it.
    pub const NONE: i32 = 0;
    /// It waits for the first handshake.
    pub const WAITING: i32 = 1;
    /// It is at rest.
    pub const HOLDING: i32 = 2;
    /// It follows setpoints.
    pub const SERVOING: i32 = 3;
    /// It gives way to the hand.
    pub const FREEDRIVE: i32 = 4;
    /// It heard nothing in time, stopped the arm, and waits for another handshake.
    pub const TIMED_OUT: i32 = 5;
    /// It stops the arm, or zeroes the sensor.
    pub const BUSY: i32 = 6;
    /// A setpoint was too far from where the arm is; it stopped the arm, and waits for another handshake.
    pub const REFUSED: i32 = 7;
    /// The thread that moves the arm stood still; it was ended, the arm stopped, and the program ends.
    pub const HUNG: i32 = 8;

    /// In words.
    pub const fn words(state: i32) -> &'static str {
        match state {
            NONE => "not begun",
            WAITING => "waiting for the handshake",
            HOLDING => "at rest",
            SERVOING => "following setpoints",
            FREEDRIVE => "giving way",
            TIMED_OUT => "timed out",
            BUSY => "busy",
            REFUSED => "setpoint refused",
            HUNG => "its moving thread hung",
            _ => "unknown",
        }
    }
}

/// The names of all inputs, in the order of the driver's recipe.
pub const INPUTS: &str = "input_int_register_24,input_int_register_25,input_int_register_26,\
input_double_register_24,input_double_register_25,input_double_register_26,\
input_double_register_27,input_double_register_28,input_double_register_29";
