//! The scatterers: one in each cube of a lattice fixed in the World, found again by its hash at every visit.

use nalgebra::Vector3;
use probepath_frames::{Image, Pose, World};
use rayon::prelude::*;

use super::beam::Beam;
use super::grid::Grid;
use super::hash;
use super::section::Section;

/// Elevational deviations after which the beam ends.
pub(super) const ACROSS_SIGMAS: f64 = 2.0;
/// `erf(2)`: what of a squared Gaussian's area lies within `ACROSS_SIGMAS`.
const WITHIN: f64 = 0.995_322_265_018_952_7;
/// Samples along the beam that one thread sums at a time.
const CHUNK: usize = 48;

/// Echoes summed on the grid: real and imaginary parts, sample after sample.
pub(super) struct Echoes {
    pub(super) real: Vec<f32>,
    pub(super) imaginary: Vec<f32>,
}

impl Echoes {
    pub(super) fn none(grid: &Grid) -> Self {
        let size = grid.samples * grid.nodes;
        Self { real: vec![0.0; size], imaginary: vec![0.0; size] }
    }
}

/// Everything that stays the same from scatterer to scatterer.
pub(super) struct Scattering<'a> {
    pub(super) grid: &'a Grid,
    pub(super) beam: &'a Beam,
    pub(super) section: &'a Section<'a>,
    pub(super) window_top_m: f64,
    pub(super) lattice_m: f64,
    pub(super) seed: u64,
    lattice: Lattice,
}

/// The lattice's axes, seen from the Image: inner is the one that runs most along the picture's rows.
#[derive(Clone, Copy)]
struct Lattice {
    axes: [usize; 3],
    /// Image coordinates of one step along each of `axes` (m), and of the lattice's origin.
    steps: [Vector3<f64>; 3],
    origin: Vector3<f64>,
}

/// A box in the Image (m).
type Span = [[f64; 2]; 3];

impl<'a> Scattering<'a> {
    pub(super) fn new(
        grid: &'a Grid,
        beam: &'a Beam,
        section: &'a Section<'a>,
        world_from_image: &Pose<World, Image>,
        (window_top_m, lattice_m, seed): (f64, f64, u64),
    ) -> Self {
        let image_from_world = world_from_image.inverse();
        let rotation = image_from_world.isometry().rotation.to_rotation_matrix();
        let along_rows = |axis: &usize| rotation[(0, *axis)].abs();
        let inner = (0..3).max_by(|a, b| along_rows(a).total_cmp(&along_rows(b))).unwrap_or(0);
        let axes = [(inner + 1) % 3, (inner + 2) % 3, inner];
        let steps = axes.map(|axis| rotation.matrix().column(axis) * lattice_m);
        let lattice = Lattice { axes, steps, origin: image_from_world.origin().vector() };
        Self { grid, beam, section, window_top_m, lattice_m, seed, lattice }
    }

    /// Depth under the face of a sample (m).
    fn depth(&self, sample: usize) -> f64 {
        (self.window_top_m + self.grid.origin()[0] + sample as f64 * self.grid.axial_m).max(0.0)
    }

    /// What the power of an echogenicity of one comes to in a cell of the grid, at the depth of `sample`.
    pub(super) fn power(&self, sample: usize) -> f64 {
        let across = self.beam.elevational(self.depth(sample)) * std::f64::consts::PI.sqrt() * WITHIN;
        self.grid.axial_m * self.grid.lateral_m * across / self.lattice_m.powi(3)
    }

    /// The sum of all scatterers in the slab.
    pub(super) fn sum(&self) -> Echoes {
        let mut echoes = Echoes::none(self.grid);
        let chunk = CHUNK * self.grid.nodes;
        let parts = echoes.real.par_chunks_mut(chunk).zip(echoes.imaginary.par_chunks_mut(chunk));
        parts.enumerate().for_each(|(part, (real, imaginary))| self.chunk(part * CHUNK, real, imaginary));
        echoes
    }

    /// All scatterers of the samples from `first` on that `real` has room for.
    fn chunk(&self, first: usize, real: &mut [f32], imaginary: &mut [f32]) {
        let last = first + real.len() / self.grid.nodes;
        let across = ACROSS_SIGMAS * self.beam.widest(Beam::elevational, self.depth(first), self.depth(last));
        let [y0, x0] = self.grid.origin();
        let span = [
            [x0 - 0.5 * self.grid.lateral_m, x0 + (self.grid.nodes as f64 - 0.5) * self.grid.lateral_m],
            [y0 + (first as f64 - 0.5) * self.grid.axial_m, y0 + (last as f64 - 0.5) * self.grid.axial_m],
            [-across, across],
        ];
        let mut sums = Sums::new(self, first, real, imaginary);
        self.lattice.lines(&span, |i, j, inner| {
            let hashed = self.lattice.hashed(self.seed, i, j);
            let start = self.lattice.at(i as f64, j as f64);
            sums.line(hashed, &start, inner);
        });
    }
}

impl Lattice {
    /// The Image's coordinates of the corner of the first cell of line `i`, `j`.
    fn at(&self, i: f64, j: f64) -> Vector3<f64> {
        self.origin + self.steps[0] * i + self.steps[1] * j
    }

    /// What a line adds to the hash of its cells, whichever axis it runs along.
    fn hashed(&self, seed: u64, i: i64, j: i64) -> u64 {
        seed.wrapping_add((i as u64).wrapping_mul(hash::STEPS[self.axes[0]]))
            .wrapping_add((j as u64).wrapping_mul(hash::STEPS[self.axes[1]]))
    }

    /// Every line of cells that may have a scatterer in `span`, with the range of cells.
    fn lines(&self, span: &Span, mut visit: impl FnMut(i64, i64, std::ops::Range<i64>)) {
        let wide = self.widened(span);
        let [rows, columns] = [0, 1].map(|axis| self.range(&wide, axis));
        for i in rows.0..=rows.1 {
            for j in columns.0..=columns.1 {
                let middle = self.at(i as f64 + 0.5, j as f64 + 0.5) + self.steps[2] * 0.5;
                let (mut from, mut to) = (f64::MIN, f64::MAX);
                for axis in 0..3 {
                    let step = self.steps[2][axis];
                    if step.abs() < 1e-12 {
                        let inside = (wide[axis][0]..=wide[axis][1]).contains(&middle[axis]);
                        to = if inside { to } else { f64::MIN };
                        continue;
                    }
                    let (a, b) =
                        ((wide[axis][0] - middle[axis]) / step, (wide[axis][1] - middle[axis]) / step);
                    from = from.max(a.min(b));
                    to = to.min(a.max(b));
                }
                if from <= to {
                    visit(i, j, from.ceil() as i64..to.floor() as i64 + 1);
                }
            }
        }
    }

    /// The span that a cell's middle has to be in for its scatterer to be able to be in `span`.
    fn widened(&self, span: &Span) -> Span {
        let mut wide = *span;
        for (axis, ends) in wide.iter_mut().enumerate() {
            let half: f64 = self.steps.iter().map(|step| 0.5 * step[axis].abs()).sum();
            *ends = [ends[0] - half, ends[1] + half];
        }
        wide
    }

    /// Smallest and largest index along one of the axes of any point of `span`.
    fn range(&self, span: &Span, axis: usize) -> (i64, i64) {
        let step = self.steps[axis];
        let scale = 1.0 / step.norm_squared();
        let (mut least, mut most) = (0.0, 0.0);
        for k in 0..3 {
            let ends = span[k].map(|end| (end - self.origin[k]) * step[k] * scale);
            least += ends[0].min(ends[1]);
            most += ends[0].max(ends[1]);
        }
        ((least - 0.5).floor() as i64, (most - 0.5).ceil() as i64)
    }
}

/// A chunk of the grid being summed.
struct Sums<'a> {
    section: &'a Section<'a>,
    real: &'a mut [f32],
    imaginary: &'a mut [f32],
    steps: [Vector3<f32>; 3],
    /// Which bits of a cell's hash place its scatterer along each of `steps`, and what a cell adds to the hash.
    shifts: [u32; 3],
    hash_step: u64,
    /// Image y and x of the grid's first corner; cells a metre.
    corner: [f32; 2],
    cells_per_m: [f32; 2],
    nodes: usize,
    first: usize,
    /// Per sample: entries of `fading` per square metre off the plane, and what brings an echogenicity of one to
    /// power one.
    across: Vec<[f32; 2]>,
    fading: [f32; FADINGS],
}

/// Entries of the elevation's Gaussian, by the square of the distance off the plane: each 0.4 % below the last.
const FADINGS: usize = 512;

/// Uniform amplitudes of power one in the complex plane: `12 / 2` over the square of 15 bits.
const AMPLITUDE: f32 = 2.449_489_7 / 32_767.0;
const JITTER: f32 = 1.0 / 2048.0;

impl<'a> Sums<'a> {
    fn new(scattering: &Scattering<'a>, first: usize, real: &'a mut [f32], imaginary: &'a mut [f32]) -> Self {
        let grid = scattering.grid;
        let samples = real.len() / grid.nodes;
        let [y0, x0] = grid.origin();
        let across = (first..first + samples).map(|sample| {
            let sigma = scattering.beam.elevational(scattering.depth(sample));
            [
                (FADINGS as f64 / (ACROSS_SIGMAS * sigma).powi(2)) as f32,
                (1.0 / scattering.power(sample).sqrt()) as f32,
            ]
        });
        Self {
            section: scattering.section,
            real,
            imaginary,
            steps: scattering.lattice.steps.map(|step| step.cast::<f32>()),
            shifts: scattering.lattice.axes.map(|axis| 11 * axis as u32),
            hash_step: hash::STEPS[scattering.lattice.axes[2]],
            corner: [(y0 - 0.5 * grid.axial_m) as f32, (x0 - 0.5 * grid.lateral_m) as f32],
            cells_per_m: [(1.0 / grid.axial_m) as f32, (1.0 / grid.lateral_m) as f32],
            nodes: grid.nodes,
            first,
            across: across.collect(),
            fading: std::array::from_fn(|i| {
                (-0.5 * ACROSS_SIGMAS.powi(2) * (i as f64 + 0.5) / FADINGS as f64).exp() as f32
            }),
        }
    }

    /// Adds the scatterers of some cells of one line that begins at `start`.
    fn line(&mut self, hashed: u64, start: &Vector3<f64>, cells: std::ops::Range<i64>) {
        let start = start.cast::<f32>();
        for k in cells {
            let bits = hash::mix(hashed.wrapping_add((k as u64).wrapping_mul(self.hash_step)));
            let jitter = |axis: usize| ((bits >> self.shifts[axis]) & 2047) as f32 * JITTER;
            let p = start
                + self.steps[0] * jitter(0)
                + self.steps[1] * jitter(1)
                + self.steps[2] * (k as f32 + jitter(2));
            self.add(&p, bits >> 33);
        }
    }

    #[inline]
    fn add(&mut self, p: &Vector3<f32>, bits: u64) {
        let sample = (p.y - self.corner[0]) * self.cells_per_m[0];
        let node = (p.x - self.corner[1]) * self.cells_per_m[1];
        if !(sample >= 0.0 && node >= 0.0) {
            return;
        }
        // Counted from the grid's first sample, not the chunk's: a scatterer on the border rounds to one chunk only.
        let (sample, node) = ((sample as usize).wrapping_sub(self.first), node as usize);
        if sample >= self.across.len() || node >= self.nodes {
            return;
        }
        let [per_square, scale] = self.across[sample];
        let Some(fading) = self.fading.get((per_square * p.z * p.z) as usize) else {
            return;
        };
        let echo = fading * scale * self.section.echogenicity([p.x, p.y, p.z]) * AMPLITUDE;
        let part = |shift: u32| ((bits >> shift) & 32_767) as f32 - 16_383.5;
        let at = sample * self.nodes + node;
        self.real[at] += echo * part(0);
        self.imaginary[at] += echo * part(15);
    }
}
