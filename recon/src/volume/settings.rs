//! How pixels become voxels.

use probepath_us_capture::plus::{Fan, PlusCompounding, PlusVolume, Rectangle};

use super::{Grid, Importance};

/// Which voxels a pixel goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// The one whose centre is nearest.
    Nearest,
    /// The eight around it, each by its nearness (trilinear).
    Linear,
}

/// What many pixels in one voxel become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compounding {
    /// Their weighted mean, of exact sums, rounded once.
    Mean,
    /// The brightest.
    Maximum,
    /// The last: of the last image, the last row, the last column.
    Latest,
    /// The least grey level that, with all below it, carries half of the weight: exact, by looking at every pixel four
    /// times, and costs about as much more.
    Median,
}

/// The part of every image that is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region {
    /// A rectangle; the whole image without it.
    pub rectangle: Option<Rectangle>,
    /// A fan; nothing outside it is used.
    pub fan: Option<Fan>,
}

/// How holes are filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Holes {
    /// Between one image and the next.
    Swept(Swept),
    /// Between seen voxels, as PLUS does.
    Sticks(Sticks),
}

/// Hole filling between one image and the next: every pixel moves straight from its place in the one to its place in
/// the other, and a voxel that none saw is filled when a pixel's path leads through it, with what the two images show
/// there. Nothing outside of what the images swept is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swept {
    /// Images further apart than this (the farthest of their corners' paths, m) have nothing swept between them.
    pub longest_m: f64,
}

/// Hole filling by straight sticks of voxels through the hole that end in a seen voxel on both sides, so nothing is
/// filled that does not lie between two seen voxels. The value is interpolated along the shortest sticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sticks {
    /// Most voxels of a stick, its ends included.
    pub longest: usize,
    /// How many of the shortest are averaged (all of the last one's length).
    pub at_least: usize,
}

/// How a volume is built.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeSettings {
    /// Voxel size along x, y, z (m), for a grid found from the images.
    pub spacing_m: [f64; 3],
    /// The grid, when it is not to be found from the images.
    pub grid: Option<Grid>,
    /// Which voxels a pixel goes to.
    pub weights: Weights,
    /// What many pixels in one voxel become.
    pub compounding: Compounding,
    /// The part of the images that is used.
    pub region: Region,
    /// What each part of an image counts; all alike when absent.
    pub importance: Option<Importance>,
    /// Hole filling, when wanted.
    pub holes: Option<Holes>,
    /// More memory than this is refused before any is taken.
    pub most_bytes: u64,
}

impl VolumeSettings {
    /// Cubic voxels; linear weights, mean, the whole image, no filling, at most 2 GiB.
    pub const fn every_mm(spacing_mm: f64) -> Self {
        let spacing_m = [spacing_mm * 1e-3; 3];
        let region = Region { rectangle: None, fan: None };
        Self {
            spacing_m,
            grid: None,
            weights: Weights::Linear,
            compounding: Compounding::Mean,
            region,
            importance: None,
            holes: None,
            most_bytes: 2 << 30,
        }
    }
}

/// As PLUS would build it: spacing, region, weights, compounding and hole filling of its configuration.
impl From<&PlusVolume> for VolumeSettings {
    fn from(plus: &PlusVolume) -> Self {
        Self {
            spacing_m: plus.spacing_mm.map(|s| s * 1e-3),
            weights: if plus.linear { Weights::Linear } else { Weights::Nearest },
            compounding: match plus.compounding {
                PlusCompounding::Mean => Compounding::Mean,
                PlusCompounding::Maximum => Compounding::Maximum,
                PlusCompounding::Latest => Compounding::Latest,
            },
            region: Region { rectangle: plus.clip, fan: plus.fan },
            holes: plus.holes.map(|h| Holes::Sticks(Sticks { longest: h.longest, at_least: h.sticks })),
            ..Self::every_mm(1.0)
        }
    }
}
