use probepath_frames::{Base, Direction, Pose, Probe};

/// How far the probe may lean over: the angle between its axis (z, out of its face) and a direction, usually straight
/// down into the table. A probe that lies over presses with an edge, and with the holder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// The direction that the upright probe looks in.
    pub upright: Direction<Base>,
    /// The largest angle to it (rad).
    pub most_rad: f64,
}

impl Tilt {
    /// 60 degrees from `upright`: legs are round, and scanned from the inside of the thigh too.
    pub const fn around(upright: Direction<Base>) -> Self {
        Self { upright, most_rad: 60.0 * std::f64::consts::PI / 180.0 }
    }

    /// How far a probe leans over (rad).
    pub fn of(&self, base_from_probe: &Pose<Base, Probe>) -> f64 {
        let axis = base_from_probe.z_axis().vector();
        axis.angle(&self.upright.vector())
    }

    /// How far `next` leans over, when it is further than allowed and further than `now`: a probe that is found leaning
    /// over may come back, but lean no further.
    pub fn exceeded(&self, next: &Pose<Base, Probe>, now: &Pose<Base, Probe>) -> Option<f64> {
        let tilt = self.of(next);
        let most = self.most_rad.max(self.of(now));
        (tilt > most || tilt.is_nan()).then_some(tilt)
    }
}
