//! What the controller's safety system and its program say, as our [`Safety`] and in words.
//!
//! Source: the RTDE guide's tables of `safety_status_bits`, `robot_mode`, `runtime_state`.

use crate::{ArmFault, Safety};

/// Bits of `safety_status_bits`, the gravest first, and what they mean.
const BITS: [(u32, Safety, &str); 10] = [
    (9, Safety::Fault, "the safety system has a fault; restart it at the pendant"),
    (8, Safety::Fault, "a safety limit was violated; restart the safety system at the pendant"),
    (6, Safety::EmergencyStop, "the robot's emergency stop is pressed"),
    (5, Safety::EmergencyStop, "the system's emergency stop is pressed"),
    (7, Safety::EmergencyStop, "an emergency stop is pressed"),
    (3, Safety::Recovery, "the arm is outside its safety limits; move it back at the pendant"),
    (4, Safety::SafeguardStop, "the safeguard input is open"),
    (11, Safety::SafeguardStop, "the three-position switch is not held"),
    (2, Safety::ProtectiveStop, "the controller's own supervision stopped the arm"),
    (1, Safety::Reduced, "the arm is in reduced mode"),
];

/// Bit 2 of `robot_status_bits`: the teach (freedrive) button.
pub const TEACH_BUTTON: u32 = 1 << 2;

/// `robot_mode`: power on, brakes off.
pub const RUNNING: i32 = 7;

/// `runtime_state`: a program runs.
pub const PLAYING: u32 = 2;

/// The gravest that these bits say, and its words. No bit at all is no word from the safety system: a fault.
pub fn of_bits(bits: u32) -> (Safety, &'static str) {
    let set = |bit: &u32| bits & (1 << bit) != 0;
    match BITS.iter().find(|(bit, _, _)| set(bit)) {
        Some((_, safety, words)) => (*safety, words),
        None if set(&0) => (Safety::Normal, "all is well"),
        // Bit 10 alone, or none.
        None => (Safety::Fault, "the safety system does not say that all is well; look at the pendant"),
    }
}

/// The fault of an arm that its safety system does not let move.
pub fn fault(bits: u32, tick: u64) -> Option<ArmFault> {
    let (safety, words) = of_bits(bits);
    let why = || words.to_owned();
    Some(match safety {
        Safety::Normal | Safety::Reduced => return None,
        Safety::ProtectiveStop => ArmFault::ProtectiveStop { tick, why: why() },
        Safety::SafeguardStop => ArmFault::SafeguardStop { tick, why: why() },
        Safety::EmergencyStop => ArmFault::EmergencyStop { tick, why: why() },
        Safety::Recovery | Safety::Fault => ArmFault::SafetyFault { tick, why: why() },
    })
}

/// `robot_mode` in words.
pub const fn mode_words(mode: i32) -> &'static str {
    match mode {
        -1 => "without a controller",
        0 => "disconnected",
        1 => "waiting for its safety settings to be confirmed",
        2 => "booting",
        3 => "switched off",
        4 => "switched on with its brakes closed",
        5 => "idle with its brakes closed",
        6 => "in backdrive",
        7 => "running",
        8 => "updating",
        _ => "in a mode that this software does not know",
    }
}

/// `runtime_state` in words.
pub const fn runtime_words(state: u32) -> &'static str {
    match state {
        0 => "stopping",
        1 => "stopped",
        2 => "playing",
        3 => "pausing",
        4 => "paused",
        5 => "resuming",
        _ => "in a state that this software does not know",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_has_its_meaning_and_the_gravest_counts() {
        let of = |bits| of_bits(bits).0;
        assert_eq!(of(1), Safety::Normal);
        assert_eq!(of(0b11), Safety::Reduced);
        assert_eq!(of(1028), Safety::ProtectiveStop, "what a protective stop shows: bits 2 and 10");
        assert_eq!(of(1 << 4), Safety::SafeguardStop);
        assert_eq!(of(1 << 11), Safety::SafeguardStop);
        assert_eq!(of(1 << 3), Safety::Recovery);
        for bit in 5..8 {
            assert_eq!(of(1 << bit), Safety::EmergencyStop);
        }
        for bits in [1 << 8, 1 << 9, 1 << 10, 0, 1 << 30] {
            assert_eq!(of(bits), Safety::Fault, "{bits:#b}");
        }
        assert_eq!(of(1 | 1 << 2 | 1 << 6), Safety::EmergencyStop);
        assert_eq!(of(1 | 1 << 9 | 1 << 6), Safety::Fault);
    }

    #[test]
    fn what_lets_the_arm_move_is_no_fault_and_all_else_is() {
        for bits in 0..1_u32 << 12 {
            assert_eq!(fault(bits, 3).is_none(), of_bits(bits).0.lets_move(), "{bits:#b}");
        }
    }
}
