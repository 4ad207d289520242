//! Where the arteries run, and how wide they are.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::Vector3;
use probepath_frames::{Point, World};

use super::Chance;
use super::skin::Skin;
use crate::vessel::{Calibre, Segment, SegmentName, Stenosis, Vessel};

/// The main artery's course: z (m), turn from anterior toward the other leg (degrees), depth under the skin (m).
/// It comes over the pubic bone, sinks as it follows the sartorius, and turns behind the knee.
const COURSE: [[f64; 3]; 13] = [
    [0.085, 2.0, 0.040],
    [0.045, 4.0, 0.033],
    [0.005, 6.0, 0.027],
    [-0.035, 8.0, 0.026],
    [-0.075, 10.0, 0.027],
    [-0.120, 13.0, 0.029],
    [-0.165, 17.0, 0.031],
    [-0.210, 22.0, 0.033],
    [-0.255, 29.0, 0.036],
    [-0.300, 42.0, 0.041],
    [-0.350, 82.0, 0.046],
    [-0.400, 135.0, 0.040],
    [-0.450, 160.0, 0.032],
];

/// Where the common femoral begins (under the inguinal ligament) and where it branches (z, m).
const CFA_FROM_Z_M: f64 = 0.010;
const BIFURCATION_Z_M: f64 = -0.045;
/// Where the superficial femoral leaves the adductor canal and is called popliteal (z, m).
const POP_FROM_Z_M: f64 = -0.320;

const EIA_RADIUS_M: f64 = 4.6e-3;
const CFA_RADIUS_M: f64 = 4.25e-3;
const SFA_RADIUS_M: f64 = 3.3e-3;
const POP_RADIUS_M: f64 = 3.0e-3;
const DFA_RADIUS_M: f64 = 2.5e-3;
const VEIN_RADIUS_M: f64 = 4.8e-3;

/// The deep femoral's way from the main artery's centreline: down, lateral, posterior (m).
const DEEP_WAY: [[f64; 3]; 6] = [
    [0.000, 0.000, 0.000],
    [0.018, 0.005, 0.004],
    [0.040, 0.011, 0.012],
    [0.075, 0.015, 0.021],
    [0.115, 0.018, 0.028],
    [0.160, 0.020, 0.034],
];

/// The points that the main artery's centreline runs through.
pub(super) struct Course {
    points: Vec<Point<World>>,
}

impl Course {
    pub(super) fn new(skin: &Skin, sign: f64, chance: &mut Chance) -> Self {
        let swing = Swing::new(chance, 2.0e-3);
        let sway = Swing::new(chance, 1.0e-3);
        let points = COURSE.map(|[z, turn_deg, depth]| {
            let (over, outward) = skin.at(z, turn_deg.to_radians());
            let sunk = over.moved(outward, -(depth + sway.at(z)));
            Point::from_vector(sunk.vector() + Vector3::new(sign * swing.at(z), 0.0, 0.0))
        });
        Self { points: points.to_vec() }
    }
}

/// A seeded bend from side to side: 2 mm always, so that no leg is straight, and a little by chance.
struct Swing {
    amplitude: f64,
    wavelength: f64,
    phase: f64,
}

impl Swing {
    fn new(chance: &mut Chance, usual: f64) -> Self {
        Self {
            amplitude: usual + chance.within(usual / 2.0),
            wavelength: 0.16 + chance.within(0.02),
            phase: chance.within(TAU / 2.0),
        }
    }

    fn at(&self, z: f64) -> f64 {
        self.amplitude * (TAU * z / self.wavelength + self.phase).sin()
    }
}

/// The main artery, and the arc length at which it branches.
pub(super) fn main(course: &Course, stenoses: &[Stenosis]) -> (Vessel, f64) {
    let bare = Vessel::new(&course.points, Calibre::constant(CFA_RADIUS_M), Vec::new(), Vec::new());
    let cfa_from = at_height(&bare, CFA_FROM_Z_M);
    let branch = at_height(&bare, BIFURCATION_Z_M);
    let pop_from = at_height(&bare, POP_FROM_Z_M);
    let calibre = Calibre::constant(EIA_RADIUS_M)
        .then(cfa_from - 0.010..cfa_from + 0.010, CFA_RADIUS_M)
        .then(branch - 0.005..branch + 0.018, SFA_RADIUS_M)
        .then(pop_from - 0.015..pop_from + 0.015, POP_RADIUS_M);
    let stenoses =
        stenoses.iter().map(|stenosis| Stenosis { at_m: branch + stenosis.at_m, ..*stenosis }).collect();
    let segments = segments(&[cfa_from, branch, pop_from, bare.length_m()]);
    (Vessel::new(&course.points, calibre, stenoses, segments), branch)
}

fn segments(&[cfa_from, branch, pop_from, end]: &[f64; 4]) -> Vec<Segment> {
    let third = (pop_from - branch) / 3.0;
    let part = |name, range_m: Range<f64>| Segment { name, range_m };
    vec![
        part(SegmentName::Eia, 0.0..cfa_from),
        part(SegmentName::Cfa, cfa_from..branch),
        part(SegmentName::SfaProximal, branch..branch + third),
        part(SegmentName::SfaMid, branch + third..pop_from - third),
        part(SegmentName::SfaDistal, pop_from - third..pop_from),
        part(SegmentName::Pop, pop_from..end),
    ]
}

/// The deep femoral artery, from the main one's centreline at `branch_m` outward and down into the muscle.
pub(super) fn deep(main: &Vessel, branch_m: f64, sign: f64) -> Vessel {
    let root = main.centre(branch_m).vector();
    let points = DEEP_WAY.map(|[down, lateral, posterior]| {
        // It leaves the main artery where that one is, and keeps to the thigh's own course after.
        let beside = main.centre(branch_m + down).vector() - root;
        let near = Vector3::new(beside.x, beside.y, 0.0) * (-down / 0.05).exp();
        Point::from_vector(root + near + Vector3::new(sign * lateral, posterior, -down))
    });
    let bare = Vessel::new(&points, Calibre::constant(DFA_RADIUS_M), Vec::new(), Vec::new());
    let segments = vec![Segment { name: SegmentName::Dfa, range_m: 0.0..bare.length_m() }];
    Vessel::new(&points, Calibre::constant(DFA_RADIUS_M), Vec::new(), segments)
}

/// The femoral vein: medial of the artery at the groin, behind it further down; `gap_m` between their lumens.
pub(super) fn vein(main: &Vessel, sign: f64, gap_m: Option<f64>) -> Vessel {
    let steps = 14;
    let points: Vec<_> = (0..=steps)
        .map(|i| {
            let fraction = f64::from(i) / f64::from(steps);
            let turn = 1.4 * fraction;
            let artery_m = main.free_radius(main.length_m() * fraction);
            let apart = gap_m.map_or(0.0115, |gap| artery_m + gap + VEIN_RADIUS_M);
            let aside = Vector3::new(-sign * turn.cos() * apart, turn.sin() * apart, 0.0);
            Point::from_vector(main.centre(main.length_m() * fraction).vector() + aside)
        })
        .collect();
    Vessel::new(&points, Calibre::constant(VEIN_RADIUS_M), Vec::new(), Vec::new())
}

/// Arc length at which the vessel, which runs down, passes height `z` (m).
fn at_height(vessel: &Vessel, z: f64) -> f64 {
    let (mut above, mut below) = (0.0, vessel.length_m());
    for _ in 0..60 {
        let middle = 0.5 * (above + below);
        if vessel.centre(middle).vector().z > z { above = middle } else { below = middle }
    }
    0.5 * (above + below)
}
