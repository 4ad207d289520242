//! [`Leg`]: a thigh on the table, from the groin to below the knee, with its arteries.

mod arteries;
mod skin;

use probepath_frames::{Direction, Point, World};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::tissue::Tissue;
use crate::vessel::{SegmentName, Stenosis, Vessel};
use skin::Skin;

/// Which leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Side {
    /// The patient's left: positive x in the World.
    Left,
    /// The patient's right: the mirror image.
    Right,
}

impl Side {
    /// What x of a left leg is multiplied by.
    const fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// What the leg is like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LegConfig {
    /// Left or right.
    pub side: Side,
    /// Narrowings of the superficial femoral artery; `at_m` counts from the bifurcation of the common femoral.
    pub stenoses: Vec<Stenosis>,
    /// How far a seed may change the anatomy: 1 is usual (girth ±4 %, courses ±3 mm), 0 gives the same leg always.
    pub variation: f64,
    /// Whether a femoral vein runs beside the artery.
    pub vein: bool,
    /// How much lies between its lumen and the artery's (m): 0.8 mm is the artery's wall alone. Their middles are
    /// 11.5 mm apart when this is not said.
    #[serde(default)]
    pub vein_gap_m: Option<f64>,
}

impl Default for LegConfig {
    fn default() -> Self {
        let stenosis = |at_m, area_fraction| Stenosis { at_m, length_m: 0.0165, area_fraction };
        Self {
            side: Side::Left,
            stenoses: vec![stenosis(0.050, 0.75), stenosis(0.100, 0.60), stenosis(0.210, 0.50)],
            variation: 1.0,
            vein: false,
            vein_gap_m: None,
        }
    }
}

/// A leg in the World (LPS): supine on the table's top (y = 0), the groin's fold at z = 0, the knee near z = -0.42 m.
///
/// Vessel 0 runs from the external iliac through the common and superficial femoral to the popliteal artery;
/// vessel 1 is the deep femoral artery, which begins on vessel 0's centreline.
#[derive(Clone, Debug)]
pub struct Leg {
    side: Side,
    skin: Skin,
    arteries: Vec<Vessel>,
    bifurcation_m: f64,
    vein: Option<Vessel>,
}

impl Leg {
    /// The leg of one seed: the same seed gives the same leg, the other side its mirror image.
    pub fn new(config: &LegConfig, seed: u64) -> Self {
        let mut chance = Chance { dice: ChaCha8Rng::seed_from_u64(seed), variation: config.variation };
        let skin = Skin::new(config.side, &mut chance);
        let course = arteries::Course::new(&skin, config.side.sign(), &mut chance);
        let (main, bifurcation_m) = arteries::main(&course, &config.stenoses);
        let deep = arteries::deep(&main, bifurcation_m, config.side.sign());
        let vein = config.vein.then(|| arteries::vein(&main, config.side.sign(), config.vein_gap_m));
        Self { side: config.side, skin, arteries: vec![main, deep], bifurcation_m, vein }
    }

    /// Left or right.
    pub const fn side(&self) -> Side {
        self.side
    }

    /// Distance of `point` from the skin at rest (m): positive outside, negative inside; and the outward normal at
    /// the skin's nearest point.
    pub fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        self.skin.surface(point)
    }

    /// Where the skin is met by the ray from the leg's axis at height `z` toward anterior, turned by `medial_rad`
    /// toward the other leg; and the outward normal there. 0 is straight up from the table.
    pub fn skin_at(&self, z: f64, medial_rad: f64) -> (Point<World>, Direction<World>) {
        self.skin.at(z, medial_rad)
    }

    /// The skin's point nearest to the main artery's centreline at arc length `s` (m), and the outward normal
    /// there: where a sonographer would look for it.
    pub fn skin_over(&self, s: f64) -> (Point<World>, Direction<World>) {
        let centre = self.main().centre(s);
        let (distance, normal) = self.surface(centre);
        (centre.moved(normal, -distance), normal)
    }

    /// The arteries: 0 is the main one, 1 the deep femoral.
    pub fn arteries(&self) -> &[Vessel] {
        &self.arteries
    }

    /// External iliac, common and superficial femoral and popliteal artery, as one tube.
    pub fn main(&self) -> &Vessel {
        &self.arteries[0]
    }

    /// The deep femoral artery.
    pub fn deep(&self) -> &Vessel {
        &self.arteries[1]
    }

    /// The femoral vein, when the leg has one.
    pub const fn vein(&self) -> Option<&Vessel> {
        self.vein.as_ref()
    }

    /// Arc length of the main artery (m) at which the common femoral branches.
    pub const fn bifurcation_m(&self) -> f64 {
        self.bifurcation_m
    }

    /// The artery and its part nearest to `point`.
    pub fn segment(&self, point: Point<World>) -> Option<SegmentName> {
        let nearest =
            self.arteries.iter().min_by(|a, b| a.wall_distance(point).total_cmp(&b.wall_distance(point)))?;
        nearest.segment(nearest.nearest(point))
    }
}

impl Tissue for Leg {
    fn artery(&self, point: Point<World>) -> f64 {
        self.arteries.iter().map(|vessel| vessel.wall_distance(point)).fold(f64::INFINITY, f64::min)
    }

    fn vein(&self, point: Point<World>) -> Option<f64> {
        self.vein.as_ref().map(|vein| vein.wall_distance(point))
    }
}

/// Where the seed decides.
struct Chance {
    dice: ChaCha8Rng,
    variation: f64,
}

impl Chance {
    /// Evenly between `-most` and `most`, times the leg's variation.
    fn within(&mut self, most: f64) -> f64 {
        let unit = self.dice.next_u32() as f64 / f64::from(u32::MAX);
        (2.0 * unit - 1.0) * most * self.variation
    }
}

#[cfg(test)]
mod tests;
