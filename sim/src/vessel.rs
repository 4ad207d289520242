//! [`Vessel`]: a lumen that is known exactly.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use nalgebra::Vector3;
use probepath_frames::{Direction, Point, World};
use serde::{Deserialize, Serialize};

use crate::spline::Curve;

/// A narrowing, known exactly: cosine-shaped along the centreline (FIELD.md section 8), its area at the middle
/// smaller than the calibre around it by `area_fraction`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stenosis {
    /// Arc length of its middle (m).
    pub at_m: f64,
    /// Length along the centreline (m), from where the lumen begins to narrow to where it is itself again.
    pub length_m: f64,
    /// Area stenosis: 0.75 leaves a quarter of the area and half the diameter.
    pub area_fraction: f64,
}

impl Stenosis {
    /// By how much of the free radius the lumen is narrowed at `s` (0 outside, `1 - sqrt(1 - A)` at the middle).
    fn narrowing(&self, s: f64) -> f64 {
        let off = s - self.at_m;
        if off.abs() >= self.length_m / 2.0 {
            return 0.0;
        }
        (1.0 - (1.0 - self.area_fraction).sqrt()) * 0.5 * (1.0 + (TAU * off / self.length_m).cos())
    }

    /// Diameter stenosis as a fraction.
    pub fn diameter_fraction(&self) -> f64 {
        1.0 - (1.0 - self.area_fraction).sqrt()
    }
}

/// The free radius along a vessel: constant but for smooth steps (C2).
#[derive(Clone, Debug, PartialEq)]
pub struct Calibre {
    first_m: f64,
    steps: Vec<(Range<f64>, f64)>,
}

impl Calibre {
    /// The same radius (m) everywhere.
    pub const fn constant(radius_m: f64) -> Self {
        Self { first_m: radius_m, steps: Vec::new() }
    }

    /// The same, but going over to `radius_m` within the arc lengths `over` (m), and staying there.
    pub fn then(mut self, over: Range<f64>, radius_m: f64) -> Self {
        let by = radius_m - self.at(f64::MAX);
        self.steps.push((over, by));
        self
    }

    /// The free radius at arc length `s` (m).
    pub fn at(&self, s: f64) -> f64 {
        let steps = self.steps.iter().map(|(over, by)| {
            let t = ((s - over.start) / (over.end - over.start)).clamp(0.0, 1.0);
            by * t * t * t * (10.0 + t * (6.0 * t - 15.0))
        });
        self.first_m + steps.sum::<f64>()
    }
}

/// The parts of the leg's arteries, as reports name them (FIELD.md section 6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SegmentName {
    /// External iliac artery.
    Eia,
    /// Common femoral artery.
    Cfa,
    /// Deep femoral artery.
    Dfa,
    /// Superficial femoral artery, its first third.
    SfaProximal,
    /// Superficial femoral artery, its second third.
    SfaMid,
    /// Superficial femoral artery, its last third.
    SfaDistal,
    /// Popliteal artery.
    Pop,
}

impl SegmentName {
    /// The short name in reports.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Eia => "EIA",
            Self::Cfa => "CFA",
            Self::Dfa => "DFA",
            Self::SfaProximal => "SFA proximal",
            Self::SfaMid => "SFA mid",
            Self::SfaDistal => "SFA distal",
            Self::Pop => "POP",
        }
    }
}

/// A named part of one vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Its name.
    pub name: SegmentName,
    /// From where to where, in arc length of the vessel (m).
    pub range_m: Range<f64>,
}

/// One tube: a C2 centreline in the World and a radius at each arc length. Its sections normal to the centreline are
/// circles, so every area is exact by construction. Arc length runs with the blood.
#[derive(Clone, Debug)]
pub struct Vessel {
    curve: Curve,
    calibre: Calibre,
    stenoses: Vec<Stenosis>,
    segments: Vec<Segment>,
    widest_m: f64,
}

/// A grid of points on a lumen: rings normal to the centreline, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceGrid {
    /// Rings.
    pub along: usize,
    /// Points in a ring, evenly spaced; the first of each lies on a line that does not twist.
    pub around: usize,
    /// `along * around` points, ring after ring.
    pub points: Vec<Point<World>>,
}

impl Vessel {
    /// A vessel through `through`, in the direction of the blood (at least two points, neighbours apart).
    pub fn new(
        through: &[Point<World>],
        calibre: Calibre,
        stenoses: Vec<Stenosis>,
        segments: Vec<Segment>,
    ) -> Self {
        let points: Vec<_> = through.iter().map(Point::vector).collect();
        let curve = Curve::through(&points);
        let free = (0..=200).map(|i| calibre.at(curve.length() * f64::from(i) / 200.0));
        let widest_m = free.fold(0.0, f64::max);
        Self { curve, calibre, stenoses, segments, widest_m }
    }

    /// Length of the centreline (m).
    pub fn length_m(&self) -> f64 {
        self.curve.length()
    }

    /// The centreline at arc length `s` (m); straight on beyond the ends.
    pub fn centre(&self, s: f64) -> Point<World> {
        Point::from_vector(self.curve.jet(s).at)
    }

    /// Where the centreline goes at arc length `s` (m).
    pub fn tangent(&self, s: f64) -> Direction<World> {
        Direction::of(self.curve.jet(s).first).unwrap_or(Direction::z())
    }

    /// The centreline's curvature at arc length `s` (1/m).
    pub fn curvature(&self, s: f64) -> f64 {
        self.curve.jet(s).second.norm()
    }

    /// The lumen's radius at arc length `s` (m).
    pub fn radius(&self, s: f64) -> f64 {
        let narrowing: f64 = self.stenoses.iter().map(|stenosis| stenosis.narrowing(s)).sum();
        self.calibre.at(s) * (1.0 - narrowing)
    }

    /// The radius that it would have without stenoses (m).
    pub fn free_radius(&self, s: f64) -> f64 {
        self.calibre.at(s)
    }

    /// The lumen's area normal to the centreline at arc length `s` (m²).
    pub fn area(&self, s: f64) -> f64 {
        PI * self.radius(s).powi(2)
    }

    /// Its narrowings, in the order of the blood.
    pub fn stenoses(&self) -> &[Stenosis] {
        &self.stenoses
    }

    /// Its named parts.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The name of the part that holds arc length `s` (m).
    pub fn segment(&self, s: f64) -> Option<SegmentName> {
        self.segments.iter().find(|part| part.range_m.contains(&s)).map(|part| part.name)
    }

    /// Arc length of the point of the centreline nearest to `point` (m).
    pub fn nearest(&self, point: Point<World>) -> f64 {
        self.curve.nearest(&point.vector()).0
    }

    /// Distance from `point` to the lumen's wall, measured normal to the centreline (m): negative in the lumen,
    /// zero exactly on its wall.
    pub fn wall_distance(&self, point: Point<World>) -> f64 {
        let (s, way) = self.curve.nearest(&point.vector());
        way.norm() - self.radius(s)
    }

    /// The widest free radius (m).
    pub fn widest_m(&self) -> f64 {
        self.widest_m
    }

    /// The lumen's wall within the arc lengths `range_m`, as `along` rings of `around` points.
    pub fn surface(&self, range_m: Range<f64>, along: usize, around: usize) -> SurfaceGrid {
        let step = (range_m.end - range_m.start) / along.saturating_sub(1).max(1) as f64;
        let mut points = Vec::with_capacity(along * around);
        let mut upright = any_normal(&self.curve.jet(range_m.start).first);
        for ring in 0..along {
            let s = range_m.start + step * ring as f64;
            let jet = self.curve.jet(s);
            let tangent = jet.first.normalize();
            // Carried along without a twist: the part of the last one that is normal to the centreline here.
            upright = (upright - tangent * upright.dot(&tangent)).normalize();
            let aside = tangent.cross(&upright);
            let radius = self.radius(s);
            points.extend((0..around).map(|k| {
                let (sin, cos) = (TAU * k as f64 / around as f64).sin_cos();
                Point::from_vector(jet.at + (upright * cos + aside * sin) * radius)
            }));
        }
        SurfaceGrid { along, around, points }
    }

    /// Arc length (m) and area (m²) at `along` places within `range_m`.
    pub fn area_curve(&self, range_m: Range<f64>, along: usize) -> Vec<(f64, f64)> {
        let step = (range_m.end - range_m.start) / along.saturating_sub(1).max(1) as f64;
        let places = (0..along).map(|i| range_m.start + step * i as f64);
        places.map(|s| (s, self.area(s))).collect()
    }
}

fn any_normal(to: &Vector3<f64>) -> Vector3<f64> {
    let other = if to.y.abs() < 0.8 * to.norm() { -Vector3::y() } else { Vector3::x() };
    (other - to * (other.dot(to) / to.norm_squared())).normalize()
}
