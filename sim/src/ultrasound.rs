//! [`Renderer`]: the B-scan that a linear array would make of some [`Tissue`].

mod beam;
mod config;
mod display;
mod grid;
mod hash;
mod overlay;
mod reflect;
mod scatter;
mod section;
pub mod settings;

use probepath_frames::{Image, Pose, World};
use probepath_us_capture::Setting;
use rayon::prelude::*;

pub use config::{Contact, DoubleEcho, ImagingConfig, ImagingError, Overlay, Reverberation, Shadow};
use settings::{COLUMNS, ROWS};

use crate::tissue::{Medium, Tissue};
use beam::Beam;
use display::{Display, Gains};
use grid::Grid;
use reflect::Reflecting;
use scatter::{ACROSS_SIGMAS, Echoes, Scattering};
use section::{Section, Slab};

/// A simulated ultrasound machine's picture former (FIELD.md section 8).
///
/// Scatterers of random phase, one in each cube of a lattice fixed in the World, echo as strongly as the tissue there;
/// those within the beam's thickness are summed and smeared by a point spread that is a Gaussian along the beam
/// (always the same), across it (narrowest near the focus) and through it; then come attenuation, its compensation,
/// electronic noise, the envelope and its logarithm. Wires and flat faces echo as a whole; in water nothing scatters,
/// and depths are as the scanner takes them, which assumes 1540 m/s. The same seed, pose and number give the same bytes, on any number
/// of threads.
///
/// ```
/// use probepath_frames::{Image, Pose, World, nalgebra::{Isometry3, Vector3}};
/// use probepath_sim::{Contact, ImagingConfig, PhantomConfig, Renderer, VascularPhantom, settings};
///
/// # fn main() -> Result<(), probepath_sim::ImagingError> {
/// let phantom = VascularPhantom::new(&PhantomConfig::default());
/// let setting = settings::zoomed(0.07, 0.045, 0.03, 0.034);
/// // FRAMES: a probe that looks straight down on the phantom's middle, in LPS: the picture's x is the World's x, its
/// // y the World's y, both from the first pixel's centre.
/// let corner = Vector3::new(-setting.window_width_m / 2.0, phantom.top_y() + setting.window_top_m, 0.0);
/// let world_from_image = Pose::<World, Image>::assume(Isometry3::translation(corner.x, corner.y, corner.z));
///
/// let renderer = Renderer::new(ImagingConfig::default(), 1)?;
/// let pixels = renderer.render(&phantom, &world_from_image, &setting, Contact::Full, 0)?;
/// assert_eq!(pixels.len(), 640 * 480);
/// # Ok(())
/// # }
/// ```
pub struct Renderer {
    config: ImagingConfig,
    seed: u64,
    display: Display,
}

impl Renderer {
    /// A machine of this kind; the seed decides speckle and noise.
    ///
    /// # Errors
    /// When a number of the configuration is outside what makes sense.
    pub fn new(config: ImagingConfig, seed: u64) -> Result<Self, ImagingError> {
        config.check()?;
        let display = Display::new(&config, seed);
        Ok(Self { config, seed: hash::mix(seed), display })
    }

    /// What the machine is like.
    pub const fn config(&self) -> &ImagingConfig {
        &self.config
    }

    /// The B-scan of `tissue` in the plane `world_from_image` (at the first pixel's centre): 480 rows of 640 grey
    /// levels, from the probe down. `number` is the picture's count: electronic noise is new in each.
    ///
    /// # Errors
    /// When the pose or the setting has a number that makes no picture.
    pub fn render(
        &self,
        tissue: &dyn Tissue,
        world_from_image: &Pose<World, Image>,
        setting: &Setting,
        contact: Contact,
        number: u64,
    ) -> Result<Vec<u8>, ImagingError> {
        config::check_setting(setting)?;
        if !world_from_image.is_finite() {
            return Err(ImagingError::Pose);
        }
        let beam = Beam::new(&self.config, setting);
        let grid = Grid::new(setting, &beam);
        let echoes = match contact {
            Contact::None => None,
            _ => Some(self.echoes(tissue, world_from_image, setting, (&beam, &grid))),
        };
        let gains = Gains::new(&self.config, setting, &grid, (tissue.medium(), contact), ROWS);
        let smear = Smear { beam: &beam, grid: &grid, setting };
        let mut pixels = vec![0_u8; COLUMNS * ROWS];
        pixels.par_chunks_mut(COLUMNS).enumerate().for_each(|(row, out)| {
            let mut smeared = match &echoes {
                Some(echoes) => smear.row(echoes, row),
                None => [vec![0.0; grid.shown], vec![0.0; grid.shown]],
            };
            let [real, imaginary] = &mut smeared;
            self.display.amplify([real, imaginary], &gains, (number, row));
            self.show(&smeared, grid.per_node, out);
        });
        overlay::write(&mut pixels, &self.config.overlay, setting, number);
        Ok(pixels)
    }

    /// Scatterers and whatever echoes by itself, summed on the grid.
    fn echoes(
        &self,
        tissue: &dyn Tissue,
        world_from_image: &Pose<World, Image>,
        setting: &Setting,
        (beam, grid): (&Beam, &Grid),
    ) -> Echoes {
        let mut echoes = match tissue.medium() {
            Medium::Tissue => self.speckle(tissue, world_from_image, setting, (beam, grid)),
            Medium::Water { .. } => Echoes::none(grid),
        };
        let reflecting = Reflecting::new((&self.config, self.seed), setting, (beam, grid), tissue.medium());
        reflecting.all(&mut echoes, tissue, world_from_image);
        echoes
    }

    /// Scatterers, summed on the grid.
    fn speckle(
        &self,
        tissue: &dyn Tissue,
        world_from_image: &Pose<World, Image>,
        setting: &Setting,
        (beam, grid): (&Beam, &Grid),
    ) -> Echoes {
        let bottom = setting.window_top_m + setting.window_height_m;
        let across = ACROSS_SIGMAS * beam.widest(Beam::elevational, 0.0, bottom + 2e-3);
        let [y0, x0] = grid.origin();
        let slab = Slab {
            from: [x0 - grid.lateral_m, y0 - grid.axial_m, -across],
            to: [x0 + grid.nodes as f64 * grid.lateral_m, y0 + grid.samples as f64 * grid.axial_m, across],
        };
        let section = Section::new(tissue, world_from_image, &self.config, slab, self.seed);
        let numbers = (setting.window_top_m, self.config.lattice_m, self.seed);
        Scattering::new(grid, beam, &section, world_from_image, numbers).sum()
    }

    /// Envelope and logarithm, with `per_node` columns from one node to the next.
    fn show(&self, [real, imaginary]: &[Vec<f32>; 2], per_node: usize, out: &mut [u8]) {
        for (node, columns) in out.chunks_mut(per_node).enumerate() {
            let (re, im) = (real[node], imaginary[node]);
            let (d_re, d_im) = (real[node + 1] - re, imaginary[node + 1] - im);
            for (i, pixel) in columns.iter_mut().enumerate() {
                let t = i as f32 / per_node as f32;
                let (re, im) = (re + t * d_re, im + t * d_im);
                *pixel = self.display.grey(re * re + im * im);
            }
        }
    }
}

/// The point spread in the plane.
struct Smear<'a> {
    beam: &'a Beam,
    grid: &'a Grid,
    setting: &'a Setting,
}

impl Smear<'_> {
    /// Real and imaginary echoes of one row, at the nodes that the picture spans.
    fn row(&self, echoes: &Echoes, row: usize) -> [Vec<f32>; 2] {
        let grid = self.grid;
        let axial = Grid::kernel(self.beam.axial(), grid.axial_m);
        let depth = self.setting.window_top_m + row as f64 * self.setting.spacing.y_m;
        let lateral = Grid::kernel(self.beam.lateral(depth), grid.lateral_m);
        let first = row * grid.per_row + grid.before[0] - axial.len() / 2;
        let before = grid.before[1] - lateral.len() / 2;
        [&echoes.real, &echoes.imaginary].map(|plane| {
            let mut along = vec![0.0; grid.nodes];
            for (i, weight) in axial.iter().enumerate() {
                let at = (first + i) * grid.nodes;
                add(&mut along, &plane[at..at + grid.nodes], *weight);
            }
            let mut across = vec![0.0; grid.shown];
            for (i, weight) in lateral.iter().enumerate() {
                add(&mut across, &along[before + i..before + i + grid.shown], *weight);
            }
            across
        })
    }
}

fn add(sum: &mut [f32], values: &[f32], weight: f32) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += value * weight;
    }
}

#[cfg(test)]
mod tests;
