//! [`Tissue`]: what the ultrasound beam meets.

use nalgebra::Vector3;
use probepath_frames::{Point, World};

/// What lies under the probe. Distances are metres, negative inside, and zero exactly on the wall's inner face; they
/// never change faster than twice the way gone, which the renderer leans on to skip what is far from every wall.
pub trait Tissue: Sync {
    /// Distance to the nearest artery's lumen, measured normal to its centreline.
    fn artery(&self, point: Point<World>) -> f64;

    /// Distance to the nearest vein's lumen, where there are veins.
    fn vein(&self, _point: Point<World>) -> Option<f64> {
        None
    }

    /// Points that echo by themselves, such as wires' ends or beads, with their strength.
    fn reflectors(&self) -> &[Reflector] {
        &[]
    }

    /// Thin wires.
    fn strands(&self) -> &[Strand] {
        &[]
    }

    /// Flat faces of solid things.
    fn facets(&self) -> &[Facet] {
        &[]
    }

    /// What all of it lies in.
    fn medium(&self) -> Medium {
        Medium::Tissue
    }
}

/// The speed of sound that every scanner assumes (m/s).
pub const ASSUMED_M_S: f64 = 1540.0;

/// What the beam goes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Medium {
    /// Tissue, with the speed of sound that the scanner assumes; it scatters and attenuates as the machine's
    /// configuration says.
    Tissue,
    /// Water: nothing scatters, next to nothing is lost, and sound is slower, so that echoes seem deeper.
    Water {
        /// Its temperature (degrees Celsius).
        celsius: f64,
    },
}

impl Medium {
    /// The speed of sound in it (m/s). Water: Marczak 1997, J. Acoust. Soc. Am. 102:2776, for 0 to 95 degrees.
    pub fn speed_m_s(self) -> f64 {
        const MARCZAK: [f64; 6] =
            [1.402_385e3, 5.038_813, -5.799_136e-2, 3.287_156e-4, -1.398_845e-6, 2.787_860e-9];
        match self {
            Self::Tissue => ASSUMED_M_S,
            Self::Water { celsius } => MARCZAK.iter().rev().fold(0.0, |sum, term| sum * celsius + term),
        }
    }

    /// How deep a point seems for every metre that it is deep: the scanner takes the echo's time for its way.
    pub fn shown_per_m(self) -> f64 {
        ASSUMED_M_S / self.speed_m_s()
    }

    /// What is lost (dB a centimetre, one way) at `frequency_mhz`, where tissue loses `tissue_db_cm_mhz`. Water:
    /// 0.0022 dB/cm/MHz^2 (Duck 1990), at 20 degrees.
    pub(crate) fn loss_db_cm(self, tissue_db_cm_mhz: f64, frequency_mhz: f64) -> f64 {
        match self {
            Self::Tissue => tissue_db_cm_mhz * frequency_mhz,
            Self::Water { .. } => 0.0022 * frequency_mhz.powi(2),
        }
    }
}

/// A straight wire, far thinner than the beam: a mirror along its length, so that it echoes most strongly where the
/// beam meets it squarely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strand {
    /// Where it begins and ends.
    pub ends: [Point<World>; 2],
    /// Amplitude at the echo's middle when it crosses the plane at a right angle, at the focus, in units of
    /// homogeneous tissue of echogenicity one.
    pub amplitude: f64,
}

/// A flat face of something solid: a parallelogram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// One corner.
    pub corner: Point<World>,
    /// From there to the two corners beside it (m).
    pub edges: [Vector3<f64>; 2],
    /// Amplitude when the beam meets it squarely, in units of homogeneous tissue of echogenicity one.
    pub amplitude: f64,
    /// What of that amplitude is scattered by its roughness every way, as speckle (0 to 1).
    pub rough: f64,
}

/// A bright point, far smaller than the beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// Where it is.
    pub at: Point<World>,
    /// Amplitude at the point's middle, in the plane and at the focus, in units of homogeneous tissue of
    /// echogenicity one.
    pub amplitude: f64,
}

/// Nothing but even tissue: for calibrating the renderer itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Homogeneous {
    /// Bright points in it.
    pub reflectors: Vec<Reflector>,
}

impl Tissue for Homogeneous {
    fn artery(&self, _point: Point<World>) -> f64 {
        f64::INFINITY
    }

    fn reflectors(&self) -> &[Reflector] {
        &self.reflectors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn water_is_as_fast_as_the_tables_say() {
        // Del Grosso and Mader 1972, J. Acoust. Soc. Am. 52:1442, to a decimal.
        for (celsius, table) in
            [(0.0, 1402.4), (10.0, 1447.3), (20.0, 1482.3), (25.0, 1496.7), (37.0, 1523.6), (74.0, 1555.1)]
        {
            let speed = Medium::Water { celsius }.speed_m_s();
            assert!((speed - table).abs() < 0.15, "{celsius}: {speed} instead of {table}");
        }
        assert!((Medium::Water { celsius: 20.0 }.shown_per_m() - 1.0389).abs() < 1e-4);
        assert!((Medium::Tissue.shown_per_m() - 1.0).abs() < 1e-15);
    }
}
