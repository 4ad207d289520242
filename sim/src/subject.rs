//! What lies on the table.

use probepath_frames::{Direction, Point, World};

use crate::cell::{CellError, SubjectConfig};
use crate::leg::Leg;
use crate::phantom::VascularPhantom;
use crate::skin::Surface;
use crate::tank::WireTank;
use crate::tissue::{Facet, Medium, Reflector, Strand, Tissue};
use crate::vessel::Vessel;

/// A leg or a phantom: an outer surface, and what the beam meets in it.
#[derive(Clone, Debug)]
pub enum Subject {
    /// A leg.
    Leg(Leg),
    /// The straight phantom.
    Phantom(VascularPhantom),
    /// A phantom of wires in water.
    WirePhantom(Box<WireTank>),
}

impl Subject {
    /// The subject of one seed.
    ///
    /// # Errors
    /// When there is no such wire phantom.
    pub fn new(config: &SubjectConfig, seed: u64) -> Result<Self, CellError> {
        Ok(match config {
            SubjectConfig::Leg(leg) => Self::Leg(Leg::new(leg, seed)),
            SubjectConfig::Phantom(phantom) => Self::Phantom(VascularPhantom::new(phantom)),
            SubjectConfig::WirePhantom(wires) => Self::WirePhantom(Box::new(WireTank::new(wires, seed)?)),
        })
    }

    /// The vessels, the main one first.
    pub fn vessels(&self) -> &[Vessel] {
        match self {
            Self::Leg(leg) => leg.arteries(),
            Self::Phantom(phantom) => phantom.vessels(),
            Self::WirePhantom(_) => &[],
        }
    }

    /// The vessel that is scanned, where there is one.
    pub fn main(&self) -> Option<&Vessel> {
        match self {
            Self::Leg(leg) => Some(leg.main()),
            Self::Phantom(phantom) => Some(phantom.vessel()),
            Self::WirePhantom(_) => None,
        }
    }

    /// The tank of a wire phantom.
    pub const fn tank(&self) -> Option<&WireTank> {
        match self {
            Self::WirePhantom(tank) => Some(tank),
            _ => None,
        }
    }

    /// Arc length of the main vessel (m) that a scan counts from: the groin's fold, or the phantom's superior end.
    pub(crate) fn origin_m(&self) -> f64 {
        match self {
            Self::Leg(leg) => leg.main().nearest(leg.skin_at(0.0, 0.1).0),
            Self::Phantom(_) | Self::WirePhantom(_) => 0.0,
        }
    }
}

impl Surface for Subject {
    fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        match self {
            Self::Leg(leg) => leg.surface(point),
            Self::Phantom(phantom) => phantom.surface(point),
            Self::WirePhantom(tank) => tank.surface(point),
        }
    }

    fn outward_over(&self, inside: Point<World>) -> Direction<World> {
        match self {
            Self::Leg(_) => self.surface(inside).1,
            // Through its flat top, however near its end.
            Self::Phantom(_) | Self::WirePhantom(_) => Direction::y().reversed(),
        }
    }
}

impl Tissue for Subject {
    fn artery(&self, point: Point<World>) -> f64 {
        match self {
            Self::Leg(leg) => leg.artery(point),
            Self::Phantom(phantom) => phantom.artery(point),
            Self::WirePhantom(tank) => tank.artery(point),
        }
    }

    fn vein(&self, point: Point<World>) -> Option<f64> {
        match self {
            Self::Leg(leg) => Tissue::vein(leg, point),
            Self::Phantom(phantom) => Tissue::vein(phantom, point),
            Self::WirePhantom(_) => None,
        }
    }

    fn reflectors(&self) -> &[Reflector] {
        match self {
            Self::Leg(leg) => leg.reflectors(),
            Self::Phantom(phantom) => phantom.reflectors(),
            Self::WirePhantom(tank) => tank.reflectors(),
        }
    }

    fn strands(&self) -> &[Strand] {
        self.tank().map_or(&[], Tissue::strands)
    }

    fn facets(&self) -> &[Facet] {
        self.tank().map_or(&[], Tissue::facets)
    }

    fn medium(&self) -> Medium {
        self.tank().map_or(Medium::Tissue, Tissue::medium)
    }
}
