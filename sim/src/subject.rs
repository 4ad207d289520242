//! What lies on the table.

use probepath_frames::{Direction, Point, World};

use crate::cell::SubjectConfig;
use crate::leg::Leg;
use crate::phantom::VascularPhantom;
use crate::skin::Surface;
use crate::tissue::{Reflector, Tissue};
use crate::vessel::Vessel;

/// A leg or a phantom: an outer surface, and tissue with vessels.
#[derive(Clone, Debug)]
pub enum Subject {
    /// A leg.
    Leg(Leg),
    /// The straight phantom.
    Phantom(VascularPhantom),
}

impl Subject {
    /// The subject of one seed.
    pub fn new(config: &SubjectConfig, seed: u64) -> Self {
        match config {
            SubjectConfig::Leg(leg) => Self::Leg(Leg::new(leg, seed)),
            SubjectConfig::Phantom(phantom) => Self::Phantom(VascularPhantom::new(phantom)),
        }
    }

    /// The vessels, the main one first.
    pub fn vessels(&self) -> &[Vessel] {
        match self {
            Self::Leg(leg) => leg.arteries(),
            Self::Phantom(phantom) => phantom.vessels(),
        }
    }

    /// The vessel that is scanned.
    pub fn main(&self) -> &Vessel {
        match self {
            Self::Leg(leg) => leg.main(),
            Self::Phantom(phantom) => phantom.vessel(),
        }
    }

    /// Arc length of the main vessel (m) that a scan counts from: the groin's fold, or the phantom's superior end.
    pub(crate) fn origin_m(&self) -> f64 {
        match self {
            Self::Leg(leg) => leg.main().nearest(leg.skin_at(0.0, 0.1).0),
            Self::Phantom(_) => 0.0,
        }
    }
}

impl Surface for Subject {
    fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        match self {
            Self::Leg(leg) => leg.surface(point),
            Self::Phantom(phantom) => phantom.surface(point),
        }
    }

    fn outward_over(&self, inside: Point<World>) -> Direction<World> {
        match self {
            Self::Leg(_) => self.surface(inside).1,
            // Through its flat top, however near its end.
            Self::Phantom(_) => Direction::y().reversed(),
        }
    }
}

impl Tissue for Subject {
    fn artery(&self, point: Point<World>) -> f64 {
        match self {
            Self::Leg(leg) => leg.artery(point),
            Self::Phantom(phantom) => phantom.artery(point),
        }
    }

    fn vein(&self, point: Point<World>) -> Option<f64> {
        match self {
            Self::Leg(leg) => Tissue::vein(leg, point),
            Self::Phantom(phantom) => Tissue::vein(phantom, point),
        }
    }

    fn reflectors(&self) -> &[Reflector] {
        match self {
            Self::Leg(leg) => leg.reflectors(),
            Self::Phantom(phantom) => phantom.reflectors(),
        }
    }
}
