//! [`Section`]: the slab of tissue that the beam passes, looked at coarsely once so that scatterers can ask quickly.

use nalgebra::Vector3;
use probepath_frames::{Image, Point, Pose, World};
use rayon::prelude::*;

use super::config::ImagingConfig;
use super::hash;
use crate::tissue::Tissue;

/// Nodes of the distance are this far apart (m), in plane and across it.
const NODE_M: f64 = 0.5e-3;
const NODE_ACROSS_M: f64 = 1.25e-3;
/// Cells along a block's edge.
const CELLS: usize = 8;
const BLOCK_M: f64 = NODE_M * CELLS as f64;
/// How fast a wall's distance may change (a stenosis' slope makes it a little more than one).
const STEEPEST: f64 = 1.25;
/// Interpolated between nodes, a distance is this near to the truth (m): a lumen of radius 1 mm bends by
/// `NODE_M^2 / 4 mm` over a cell. Nearer to an edge than this, the truth is asked.
const SURE_M: f32 = 0.08e-3;

/// Where the slab is: in the Image, `from` to `to` (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab {
    pub(super) from: [f64; 3],
    pub(super) to: [f64; 3],
}

/// A layer of distances over the slab: only where a wall is near are there any.
struct Distances {
    blocks: Vec<Option<Vec<f32>>>,
    wall: f64,
}

/// What echoes how much in the slab.
pub(super) struct Section<'a> {
    tissue: &'a dyn Tissue,
    world_from_image: &'a Pose<World, Image>,
    config: &'a ImagingConfig,
    slab: Slab,
    blocks: [usize; 2],
    planes: usize,
    artery: Distances,
    vein: Option<Distances>,
    mottle: Vec<f32>,
}

impl<'a> Section<'a> {
    pub(super) fn new(
        tissue: &'a dyn Tissue,
        world_from_image: &'a Pose<World, Image>,
        config: &'a ImagingConfig,
        slab: Slab,
        seed: u64,
    ) -> Self {
        let count = |axis: usize| ((slab.to[axis] - slab.from[axis]) / BLOCK_M).ceil().max(1.0) as usize;
        let planes = ((slab.to[2] - slab.from[2]) / NODE_ACROSS_M).ceil().max(1.0) as usize + 1;
        let nothing = || Distances { blocks: Vec::new(), wall: 0.0 };
        let mut section = Self {
            tissue,
            world_from_image,
            config,
            slab,
            blocks: [count(0), count(1)],
            planes,
            artery: nothing(),
            vein: None,
            mottle: Vec::new(),
        };
        section.artery = section.distances(config.wall_thickness_m, &|p| tissue.artery(p));
        if tissue.vein(world_from_image.origin()).is_some() {
            let vein = |p| tissue.vein(p).unwrap_or(f64::INFINITY);
            section.vein = Some(section.distances(config.vein_wall_thickness_m, &vein));
        }
        section.mottle = section.mottled(seed);
        section
    }

    fn point(&self, p: [f64; 3]) -> Point<World> {
        *self.world_from_image * Point::new(p[0], p[1], p[2])
    }

    /// Distances in every block that a wall or lumen may reach into.
    fn distances(&self, wall: f64, distance: &(dyn Fn(Point<World>) -> f64 + Sync)) -> Distances {
        // Three looks through the slab, each for a third of its thickness.
        let thick = self.slab.to[2] - self.slab.from[2];
        let looks = [1.0, 3.0, 5.0].map(|sixths| self.slab.from[2] + thick * sixths / 6.0);
        let half = Vector3::new(BLOCK_M / 2.0, BLOCK_M / 2.0, thick / 6.0 + NODE_ACROSS_M / 2.0);
        let reach = wall + half.norm() * STEEPEST;
        let blocks = (0..self.blocks[0] * self.blocks[1]).into_par_iter().map(|block| {
            let corner = self.corner(block);
            let middle = corner.map(|from| from + BLOCK_M / 2.0);
            let near = |z: &f64| distance(self.point([middle[0], middle[1], *z])) <= reach;
            looks.iter().any(near).then(|| self.nodes(corner, distance))
        });
        Distances { blocks: blocks.collect(), wall }
    }

    fn corner(&self, block: usize) -> [f64; 2] {
        let (column, row) = (block % self.blocks[0], block / self.blocks[0]);
        [self.slab.from[0] + column as f64 * BLOCK_M, self.slab.from[1] + row as f64 * BLOCK_M]
    }

    /// Plane after plane, row after row.
    fn nodes(&self, corner: [f64; 2], distance: &dyn Fn(Point<World>) -> f64) -> Vec<f32> {
        let mut nodes = Vec::with_capacity(self.planes * (CELLS + 1) * (CELLS + 1));
        for plane in 0..self.planes {
            let z = self.slab.from[2] + plane as f64 * NODE_ACROSS_M;
            for row in 0..=CELLS {
                for column in 0..=CELLS {
                    let x = corner[0] + column as f64 * NODE_M;
                    nodes.push(distance(self.point([x, corner[1] + row as f64 * NODE_M, z])) as f32);
                }
            }
        }
        nodes
    }

    /// One factor for muscle and fat a millimetre, row after row.
    fn mottled(&self, seed: u64) -> Vec<f32> {
        let columns = self.blocks[0] * MOTTLES + 2;
        let rows = self.blocks[1] * MOTTLES + 2;
        let step = BLOCK_M / MOTTLES as f64;
        let factor = |node: usize| {
            let p = [
                self.slab.from[0] + (node % columns) as f64 * step,
                self.slab.from[1] + (node / columns) as f64 * step,
                0.0,
            ];
            let at = self.point(p).vector() / self.config.mottle_m;
            let decibel = self.config.mottle_db * hash::smooth(seed, [at.x, at.y, at.z]);
            10_f64.powf(decibel / 20.0) as f32
        };
        (0..columns * rows).map(factor).collect()
    }

    /// The amplitude with which a scatterer at `p` (Image, m; inside the slab) echoes.
    #[inline]
    pub(super) fn echogenicity(&self, p: [f32; 3]) -> f32 {
        let x = (p[0] - self.slab.from[0] as f32) * (1.0 / BLOCK_M as f32);
        let y = (p[1] - self.slab.from[1] as f32) * (1.0 / BLOCK_M as f32);
        let column = (x.max(0.0) as usize).min(self.blocks[0] - 1);
        let row = (y.max(0.0) as usize).min(self.blocks[1] - 1);
        let block = row * self.blocks[0] + column;
        if let Some(nodes) = &self.artery.blocks[block] {
            let distance = self.interpolate(nodes, [x - column as f32, y - row as f32], p);
            if let Some(echogenicity) = self.in_artery(distance, p) {
                return echogenicity;
            }
        }
        if let Some(vein) = &self.vein
            && let Some(nodes) = &vein.blocks[block]
        {
            let distance = self.interpolate(nodes, [x - column as f32, y - row as f32], p);
            if distance < 0.0 {
                return self.config.lumen as f32;
            }
            if distance < vein.wall as f32 {
                return self.config.vein_wall as f32;
            }
        }
        self.config.tissue as f32 * self.mottle_at(x, y)
    }

    #[inline]
    fn in_artery(&self, interpolated: f32, p: [f32; 3]) -> Option<f32> {
        let wall = self.artery.wall as f32;
        let mut distance = interpolated;
        if distance.abs() < SURE_M || (distance - wall).abs() < SURE_M {
            distance = self.tissue.artery(self.point(p.map(f64::from))) as f32;
        }
        if distance < 0.0 {
            return Some(self.config.lumen as f32);
        }
        (distance < wall).then_some(self.config.wall as f32)
    }

    #[inline]
    fn interpolate(&self, nodes: &[f32], in_block: [f32; 2], p: [f32; 3]) -> f32 {
        const SIDE: usize = CELLS + 1;
        let split = |t: f32, most: usize| {
            let cell = (t.max(0.0) as usize).min(most);
            (cell, t - cell as f32)
        };
        let (column, a) = split(in_block[0] * CELLS as f32, CELLS - 1);
        let (row, b) = split(in_block[1] * CELLS as f32, CELLS - 1);
        let across = (p[2] - self.slab.from[2] as f32) * (1.0 / NODE_ACROSS_M as f32);
        let (plane, c) = split(across, self.planes - 2);
        let flat = |plane: usize| {
            let at = (plane * SIDE + row) * SIDE + column;
            let top = nodes[at] * (1.0 - a) + nodes[at + 1] * a;
            let bottom = nodes[at + SIDE] * (1.0 - a) + nodes[at + SIDE + 1] * a;
            top * (1.0 - b) + bottom * b
        };
        flat(plane) * (1.0 - c) + flat(plane + 1) * c
    }

    /// At `x`, `y` in blocks.
    #[inline]
    fn mottle_at(&self, x: f32, y: f32) -> f32 {
        let columns = self.blocks[0] * MOTTLES + 2;
        let (u, v) = (x.max(0.0) * MOTTLES as f32, y.max(0.0) * MOTTLES as f32);
        let column = (u as usize).min(columns - 2);
        let row = (v as usize).min(self.mottle.len() / columns - 2);
        let (a, b) = (u - column as f32, v - row as f32);
        let at = row * columns + column;
        let top = self.mottle[at] * (1.0 - a) + self.mottle[at + 1] * a;
        let bottom = self.mottle[at + columns] * (1.0 - a) + self.mottle[at + columns + 1] * a;
        top * (1.0 - b) + bottom * b
    }
}

/// Mottle's nodes along a block's edge.
const MOTTLES: usize = 4;
