//! [`VascularPhantom`]: the paper's straight vessel in a block.

use probepath_frames::{Direction, Point, World};
use serde::{Deserialize, Serialize};

use crate::tissue::Tissue;
use crate::vessel::{Calibre, Stenosis, Vessel};

/// The phantom's numbers. The paper gives diameter, stenoses and depth; lengths and places are ours (FIELD.md 8).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhantomConfig {
    /// Disease-free diameter (m).
    pub diameter_m: f64,
    /// Area stenoses in the order of the arc length.
    pub area_fractions: Vec<f64>,
    /// Length of each stenosis, in diameters.
    pub length_diameters: f64,
    /// Distance between the middles of two stenoses (m).
    pub apart_m: f64,
    /// Distance from each end to the beginning of the nearest stenosis (m).
    pub straight_m: f64,
    /// Depth of the vessel's axis under the block's top (m).
    pub depth_m: f64,
    /// Width of the block across the vessel, and its height (m).
    pub block_m: [f64; 2],
    /// How far the vessel's middle is bowed out of the straight line through its ends: sideways, and down (m).
    #[serde(default)]
    pub bow_m: [f64; 2],
    /// A vein runs beside the vessel, with so much between the two lumens (m): 0.8 mm is the artery's wall alone.
    #[serde(default)]
    pub vein_gap_m: Option<f64>,
}

impl Default for PhantomConfig {
    /// [P1]: 7.87 mm, 80.0 % and 75.0 % by area, 34 mm deep.
    fn default() -> Self {
        Self {
            diameter_m: 7.87e-3,
            area_fractions: vec![0.80, 0.75],
            length_diameters: 2.5,
            apart_m: 0.050,
            straight_m: 0.040,
            depth_m: 0.034,
            block_m: [0.100, 0.080],
            bow_m: [0.0, 0.0],
            vein_gap_m: None,
        }
    }
}

/// A block on the table (its bottom at y = 0, its top flat), the vessel's axis along -z through x = 0, from
/// `z = length / 2` down to `-length / 2`; bowed, if at all, as an arc of a sine.
#[derive(Clone, Debug)]
pub struct VascularPhantom {
    config: PhantomConfig,
    vessels: Vec<Vessel>,
    vein: Option<Vessel>,
    /// Half the block's length (m): the vessel's ends are on its faces.
    half_length_m: f64,
}

/// Radius of the vein (m).
const VEIN_RADIUS_M: f64 = 4.0e-3;
/// Points that a bowed axis is drawn through.
const BOW_POINTS: usize = 25;

impl VascularPhantom {
    /// The phantom with these numbers.
    pub fn new(config: &PhantomConfig) -> Self {
        let narrow_m = config.length_diameters * config.diameter_m;
        let between = config.apart_m * config.area_fractions.len().saturating_sub(1) as f64;
        let length = 2.0 * config.straight_m + narrow_m + between;
        let stenoses = config.area_fractions.iter().enumerate().map(|(i, &area_fraction)| Stenosis {
            at_m: config.straight_m + narrow_m / 2.0 + config.apart_m * i as f64,
            length_m: narrow_m,
            area_fraction,
        });
        let y = config.depth_m - config.block_m[1];
        let axis = |aside: f64| -> Vec<Point<World>> {
            let straight = config.bow_m.iter().all(|bow| bow.abs() < 1e-9);
            let last = if straight { 1 } else { BOW_POINTS - 1 };
            (0..=last)
                .map(|i| {
                    let t = i as f64 / last as f64;
                    let [x, down] = config.bow_m.map(|bow| bow * (std::f64::consts::PI * t).sin());
                    Point::new(aside + x, y + down, length * (0.5 - t))
                })
                .collect()
        };
        let radius = config.diameter_m / 2.0;
        let vessel = Vessel::new(&axis(0.0), Calibre::constant(radius), stenoses.collect(), Vec::new());
        let vein = config.vein_gap_m.map(|gap| {
            let beside = axis(radius + gap + VEIN_RADIUS_M);
            Vessel::new(&beside, Calibre::constant(VEIN_RADIUS_M), Vec::new(), Vec::new())
        });
        Self { config: config.clone(), vessels: vec![vessel], vein, half_length_m: length / 2.0 }
    }

    /// The vein, when it has one.
    pub const fn vein(&self) -> Option<&Vessel> {
        self.vein.as_ref()
    }

    /// The vessel; its arc length begins at the superior end.
    pub fn vessel(&self) -> &Vessel {
        &self.vessels[0]
    }

    /// All its vessels: one.
    pub fn vessels(&self) -> &[Vessel] {
        &self.vessels
    }

    /// y of the block's flat top (m).
    pub const fn top_y(&self) -> f64 {
        -self.config.block_m[1]
    }

    /// Distance of `point` from the block (m), positive outside; and the outward normal of the nearest face.
    pub fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        let p = point.vector();
        let [width, height] = self.config.block_m;
        let half_length = self.half_length_m;
        let (x, y, z) = (Direction::x(), Direction::y(), Direction::z());
        let faces = [
            (-p.y - height, y.reversed()),
            (p.y, y),
            (p.x - width / 2.0, x),
            (-p.x - width / 2.0, x.reversed()),
            (p.z - half_length, z),
            (-p.z - half_length, z.reversed()),
        ];
        let nearest = faces.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let inside = nearest.unwrap_or((0.0, y.reversed()));
        if inside.0 <= 0.0 {
            return inside;
        }
        let out = faces.iter().fold(nalgebra::Vector3::zeros(), |sum, (distance, normal)| {
            sum + normal.vector() * distance.max(0.0)
        });
        (out.norm(), Direction::of(out).unwrap_or(inside.1))
    }
}

impl Tissue for VascularPhantom {
    fn artery(&self, point: Point<World>) -> f64 {
        self.vessels[0].wall_distance(point)
    }

    fn vein(&self, point: Point<World>) -> Option<f64> {
        self.vein.as_ref().map(|vein| vein.wall_distance(point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_papers_numbers() {
        let phantom = VascularPhantom::new(&PhantomConfig::default());
        let vessel = phantom.vessel();
        let free = std::f64::consts::PI * 3.935e-3_f64.powi(2);
        let radii: Vec<f64> = vessel.stenoses().iter().map(|s| vessel.radius(s.at_m)).collect();
        assert!((radii[0] - 1.7598e-3).abs() < 1e-7 && (radii[1] - 1.9675e-3).abs() < 1e-9, "{radii:?}");
        assert!((vessel.area(vessel.stenoses()[0].at_m) / free - 0.20).abs() < 1e-12);
        assert!((vessel.area(0.01) / free - 1.0).abs() < 1e-12);
        let (first, second) = (vessel.stenoses()[0], vessel.stenoses()[1]);
        assert!((second.at_m - first.at_m - 0.050).abs() < 1e-12);
        assert!((first.at_m - first.length_m / 2.0 - 0.040).abs() < 1e-12);
        let from_top = vessel.centre(0.05).vector().y - phantom.top_y();
        assert!((from_top - 0.034).abs() < 1e-12);
        // [P1]: 55.3 % and 50.0 % by diameter.
        assert!((first.diameter_fraction() - 0.553).abs() < 1e-3);
        assert!((second.diameter_fraction() - 0.500).abs() < 1e-12);
    }

    #[test]
    fn its_top_is_flat_and_its_normal_points_up() {
        let phantom = VascularPhantom::new(&PhantomConfig::default());
        let (distance, normal) = phantom.surface(Point::new(0.01, phantom.top_y() - 0.002, 0.02));
        assert!((distance - 0.002).abs() < 1e-12 && normal == Direction::y().reversed());
        assert!(phantom.surface(Point::new(0.01, phantom.top_y() + 0.003, 0.02)).0 + 0.003 < 1e-12);
        let corner = Point::new(0.053, phantom.top_y() - 0.004, 0.0);
        assert!((phantom.surface(corner).0 - 0.005).abs() < 1e-12);
    }

    #[test]
    fn a_bowed_vessel_has_the_same_stenoses_along_its_own_arc() {
        let config = PhantomConfig { bow_m: [0.010, 0.003], ..PhantomConfig::default() };
        let (bowed, straight) =
            (VascularPhantom::new(&config), VascularPhantom::new(&PhantomConfig::default()));
        let (ours, theirs) = (bowed.vessel(), straight.vessel());
        assert_eq!(ours.stenoses(), theirs.stenoses());
        assert!(ours.length_m() > theirs.length_m() + 1e-3);
        let middle = ours.centre(ours.length_m() / 2.0).vector();
        assert!(
            (middle.x - 0.010).abs() < 1e-5
                && (middle.y - theirs.centre(0.0).vector().y - 0.003).abs() < 1e-5
        );
        // The block is as long as it was.
        let beyond = Point::new(0.0, -0.03, theirs.length_m() / 2.0 + 0.004);
        assert!((bowed.surface(beyond).0 - straight.surface(beyond).0).abs() < 1e-12);
    }

    #[test]
    fn a_vein_leaves_the_gap_that_was_asked_for() {
        let config = PhantomConfig { vein_gap_m: Some(0.8e-3), ..PhantomConfig::default() };
        let phantom = VascularPhantom::new(&config);
        let wall = Point::new(3.935e-3, phantom.vessel().centre(0.0).vector().y, 0.0);
        let nearest = Tissue::vein(&phantom, wall).unwrap();
        assert!((nearest - 0.8e-3).abs() < 1e-9, "{nearest}");
        assert!(Tissue::vein(&VascularPhantom::new(&PhantomConfig::default()), wall).is_none());
    }
}
