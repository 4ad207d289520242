//! What echoes by itself: points, wires, flat faces, laid on the grid before the beam smears them.

use nalgebra::Vector3;
use probepath_frames::{Image, Pose, World};
use probepath_us_capture::Setting;

use super::beam::Beam;
use super::config::ImagingConfig;
use super::grid::Grid;
use super::hash;
use super::scatter::Echoes;
use crate::tissue::{Facet, Medium, Reflector, Strand, Tissue};

/// Elevational deviations after which a wire, and a face, is out of the beam: 70 and 39 dB down.
const WIRE_SIGMAS: f64 = 4.0;
const FACET_SIGMAS: f64 = 3.0;
/// A wire is walked in steps no longer than this across the plane (m), and half a cell of the grid in it.
const ACROSS_STEP_M: f64 = 0.1e-3;
/// A face is made of squares of this edge (m).
const SQUARE_M: f64 = 0.3e-3;
/// An echo weaker than this is not drawn: 60 dB below tissue.
const FAINTEST: f64 = 0.5e-3;
/// A wire's unevenness changes over this length (m).
const UNEVEN_M: f64 = 1e-3;
/// What sets the faces' roughness apart from the speckle of the same seed.
const ROUGH: u64 = 0x726f_7567_6866_6163;

/// Lays echoes on the grid of one picture.
pub(super) struct Reflecting<'a> {
    config: &'a ImagingConfig,
    seed: u64,
    setting: &'a Setting,
    beam: &'a Beam,
    grid: &'a Grid,
    /// y of the probe's face in the Image (m), and how deep a point seems for every metre under it.
    face_y: f64,
    shown_per_m: f64,
    /// An echo of one cell that peaks at one at the focus.
    unit: f64,
}

/// A part of a line, between two of its parameters.
type Part = (f64, f64);

impl<'a> Reflecting<'a> {
    pub(super) fn new(
        (config, seed): (&'a ImagingConfig, u64),
        setting: &'a Setting,
        (beam, grid): (&'a Beam, &'a Grid),
        medium: Medium,
    ) -> Self {
        let tallest = |sigma: f64, step: f64| (step / (sigma * std::f64::consts::PI.sqrt())).sqrt();
        let peak =
            tallest(beam.axial(), grid.axial_m) * tallest(beam.lateral(setting.focus_m), grid.lateral_m);
        // The picture's upper edge is the window's top: the first row's centre lies half a pixel under it.
        let face_y = -(setting.window_top_m + setting.spacing.y_m / 2.0);
        let shown_per_m = medium.shown_per_m();
        Self { config, seed, setting, beam, grid, face_y, shown_per_m, unit: 1.0 / peak }
    }

    /// Everything of `tissue` that echoes by itself.
    pub(super) fn all(
        &self,
        echoes: &mut Echoes,
        tissue: &dyn Tissue,
        world_from_image: &Pose<World, Image>,
    ) {
        let image_from_world = world_from_image.inverse();
        for Reflector { at, amplitude } in tissue.reflectors() {
            let p = (image_from_world * *at).vector();
            let fading = self.fading(p.z, self.beam.elevational(self.depth(&p)));
            self.put(echoes, &p, [amplitude * fading, 0.0]);
        }
        for strand in tissue.strands() {
            self.strand(echoes, strand, &image_from_world);
        }
        for (number, facet) in tissue.facets().iter().enumerate() {
            self.facet(echoes, facet, number as i64, &image_from_world);
        }
    }

    fn fading(&self, off: f64, sigma: f64) -> f64 {
        (-0.5 * (off / sigma).powi(2)).exp()
    }

    /// True depth under the face (m).
    fn depth(&self, p: &Vector3<f64>) -> f64 {
        p.y - self.face_y
    }

    /// Adds an echo from `p`, where it shows, shared between the cells around it, so that its picture peaks at its
    /// size at the focus.
    fn put(&self, echoes: &mut Echoes, p: &Vector3<f64>, echo: [f64; 2]) {
        let [y0, x0] = self.grid.origin();
        let shown = self.face_y + self.depth(p) * self.shown_per_m;
        let (y, x) = ((shown - y0) / self.grid.axial_m, (p.x - x0) / self.grid.lateral_m);
        let inside = |t: f64, count: usize| t >= 0.0 && t < (count - 1) as f64;
        if !(inside(y, self.grid.samples) && inside(x, self.grid.nodes)) {
            return;
        }
        let (sample, node) = (y as usize, x as usize);
        for (dy, dx) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let part = (1.0 - (y - (sample + dy) as f64).abs()) * (1.0 - (x - (node + dx) as f64).abs());
            let at = (sample + dy) * self.grid.nodes + node + dx;
            echoes.real[at] += (echo[0] * part * self.unit) as f32;
            echoes.imaginary[at] += (echo[1] * part * self.unit) as f32;
        }
    }

    /// The part of the line `from + t * run` that lies over the grid and within `across` of the plane.
    fn within_reach(
        &self,
        from: &Vector3<f64>,
        run: &Vector3<f64>,
        across: f64,
        whole: Part,
    ) -> Option<Part> {
        let [y0, x0] = self.grid.origin();
        let true_y = |shown: f64| self.face_y + (shown - self.face_y) / self.shown_per_m;
        let last = |count: usize, step: f64| (count - 1) as f64 * step;
        let ends = [
            [x0, x0 + last(self.grid.nodes, self.grid.lateral_m)],
            [true_y(y0), true_y(y0 + last(self.grid.samples, self.grid.axial_m))],
            [-across, across],
        ];
        let clipped = (0..3).try_fold(whole, |(first, last), axis| {
            let [low, high] = ends[axis].map(|end| end - from[axis]);
            if run[axis].abs() < 1e-12 {
                return (low..=high).contains(&0.0).then_some((first, last));
            }
            let (a, b) = (low / run[axis], high / run[axis]);
            Some((first.max(a.min(b)), last.min(a.max(b))))
        });
        clipped.filter(|(first, last)| first < last)
    }

    fn widest(&self) -> f64 {
        let bottom = self.setting.window_top_m + self.setting.window_height_m;
        self.beam.widest(Beam::elevational, 0.0, bottom + 2e-3)
    }

    /// A wire: the beam's thickness takes in a length of it, which smears its echo unless it crosses squarely
    /// (FIELD.md section 8).
    fn strand(&self, echoes: &mut Echoes, strand: &Strand, image_from_world: &Pose<Image, World>) {
        let [from, to] = strand.ends.map(|end| (*image_from_world * end).vector());
        let run = to - from;
        let reach = self.within_reach(&from, &run, WIRE_SIGMAS * self.widest(), (0.0, 1.0));
        let Some((first, last)) = reach.filter(|_| run.norm() > 0.0) else { return };
        let cells = Vector3::new(2.0 / self.grid.lateral_m, 2.0 / self.grid.axial_m, 1.0 / ACROSS_STEP_M);
        let steps = (run.component_mul(&cells).amax() * (last - first)).ceil().max(1.0);
        let (step, length) = ((last - first) / steps, run.norm() * (last - first) / steps);
        let squarely =
            self.squarely((run.y / run.norm()).abs().min(1.0).asin(), self.config.wire_specular_deg);
        let [world_from, world_to] = strand.ends.map(|end| end.vector());
        for i in 0..steps as usize {
            let t = first + (i as f64 + 0.5) * step;
            let p = from + run * t;
            let sigma = self.beam.elevational(self.depth(&p).max(0.0));
            let share = length / (sigma * std::f64::consts::TAU.sqrt()) * self.fading(p.z, sigma);
            let uneven = self.uneven(&(world_from + (world_to - world_from) * t));
            let echo = strand.amplitude * squarely * share * uneven;
            self.put(echoes, &p, [echo, 0.0]);
            if let Some(double) = self.config.double_echo {
                let behind = p + Vector3::y() * (double.behind_m / self.shown_per_m);
                self.put(echoes, &behind, [echo * ratio(-double.loss_db), 0.0]);
            }
        }
    }

    /// How much comes back when the beam meets a mirror `angle` (rad) off square.
    fn squarely(&self, angle: f64, specular_deg: f64) -> f64 {
        (-0.5 * (angle / specular_deg.to_radians()).powi(2)).exp()
    }

    fn uneven(&self, place: &Vector3<f64>) -> f64 {
        if self.config.wire_uneven_db == 0.0 {
            return 1.0;
        }
        let at = place / UNEVEN_M;
        ratio(self.config.wire_uneven_db * hash::smooth(self.seed, [at.x, at.y, at.z]))
    }

    /// A flat face, square by square: one mirror, and a scatterer of random phase in each square for its roughness.
    fn facet(&self, echoes: &mut Echoes, facet: &Facet, number: i64, image_from_world: &Pose<Image, World>) {
        let from = (*image_from_world * facet.corner).vector();
        let turn = image_from_world.isometry().rotation;
        let edges = facet.edges.map(|edge| turn * edge);
        let Some(normal) = edges[0].cross(&edges[1]).try_normalize(1e-12) else { return };
        let across = FACET_SIGMAS * self.widest();
        let counts = edges.map(|edge| (edge.norm() / SQUARE_M).ceil());
        let [one, other] = [edges[0] / counts[0], edges[1] / counts[1]];
        let cosine = normal.y.abs().min(1.0);
        let strength = [
            facet.amplitude * self.squarely(cosine.acos(), self.config.face_specular_deg),
            facet.amplitude * facet.rough * cosine,
        ];
        if strength[0].max(strength[1]) < FAINTEST {
            return;
        }
        for i in 0..counts[0] as i64 {
            let start = from + one * (i as f64 + 0.5) + other * 0.5;
            let whole = (0.0, counts[1] - 1.0);
            let Some((first, last)) = self.within_reach(&start, &other, across, whole) else { continue };
            for j in first.ceil() as i64..=last.floor() as i64 {
                let random = random(hash::cell(self.seed ^ ROUGH, number, i, j));
                self.square(echoes, &(start + other * j as f64), strength, random);
            }
        }
    }

    fn square(&self, echoes: &mut Echoes, p: &Vector3<f64>, strength: [f64; 2], random: [f64; 2]) {
        let depth = self.depth(p).max(0.0);
        let sigma = self.beam.elevational(depth);
        let fading = self.fading(p.z, sigma);
        if fading * strength[0].max(strength[1]) < FAINTEST {
            return;
        }
        let lateral = self.beam.lateral(depth);
        let area = SQUARE_M * SQUARE_M / (std::f64::consts::PI * sigma * lateral);
        let mirrored = strength[0] * fading * area / 2.0;
        let scattered = strength[1] * fading * area.sqrt();
        self.put(echoes, p, [mirrored + scattered * random[0], scattered * random[1]]);
    }
}

/// A number of random phase and mean power one.
fn random(bits: u64) -> [f64; 2] {
    let part = |shift: u32| ((bits >> shift) & 0xffff) as f64 / 65_536.0 - 0.5;
    [part(16), part(40)].map(|part| part * 6_f64.sqrt())
}

fn ratio(decibel: f64) -> f64 {
    10_f64.powf(decibel / 20.0)
}
