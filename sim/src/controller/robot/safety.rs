//! Safety modes and power, and their numbers on the wire (UR_WIRE.md).

/// The safety mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::controller) enum Safety {
    Normal,
    Reduced,
    ProtectiveStop,
    SafeguardStop,
    EmergencyStop,
}

impl Safety {
    /// `safety_mode`.
    pub(in crate::controller) const fn mode(self) -> i32 {
        match self {
            Self::Normal => 1,
            Self::Reduced => 2,
            Self::ProtectiveStop => 3,
            Self::SafeguardStop => 5,
            Self::EmergencyStop => 7,
        }
    }

    /// `safety_status_bits`. A protective stop is 1028 (bits 2 and 10), as was measured.
    pub(in crate::controller) const fn bits(self) -> u32 {
        match self {
            Self::Normal => 1,
            Self::Reduced => 1 << 1,
            Self::ProtectiveStop => (1 << 2) | (1 << 10),
            Self::SafeguardStop => (1 << 4) | (1 << 10),
            Self::EmergencyStop => (1 << 6) | (1 << 7) | (1 << 10),
        }
    }

    /// As the dashboard's `safetystatus` and `safetymode` say it.
    pub(in crate::controller) const fn name(self) -> &'static str {
        match self {
            Self::Normal => "NORMAL",
            Self::Reduced => "REDUCED",
            Self::ProtectiveStop => "PROTECTIVE_STOP",
            Self::SafeguardStop => "SAFEGUARD_STOP",
            Self::EmergencyStop => "ROBOT_EMERGENCY_STOP",
        }
    }

    /// Whether the arm may move.
    pub(in crate::controller) const fn moves(self) -> bool {
        matches!(self, Self::Normal | Self::Reduced)
    }
}

/// Whether the motors have power, and the brakes are open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::controller) enum Power {
    Off,
    Idle,
    Running,
}

impl Power {
    /// `robot_mode`.
    pub(in crate::controller) const fn mode(self) -> i32 {
        match self {
            Self::Off => 3,
            Self::Idle => 5,
            Self::Running => 7,
        }
    }

    /// As the dashboard's `robotmode` says it.
    pub(in crate::controller) const fn name(self) -> &'static str {
        match self {
            Self::Off => "POWER_OFF",
            Self::Idle => "IDLE",
            Self::Running => "RUNNING",
        }
    }

    /// `joint_mode` of every joint.
    pub(in crate::controller) const fn joint_mode(self) -> i32 {
        match self {
            Self::Off => 239,
            Self::Idle => 255,
            Self::Running => 253,
        }
    }
}
