//! [`Tissue`]: what the ultrasound beam meets.

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
