//! A volume that grows while the sweep goes on.

mod layers;

use std::ops::Range;

use nalgebra::Vector3;
use probepath_frames::Point;
use rayon::prelude::*;

use layers::{Cells, Layers};

use super::clip::Clip;
use super::compound::{Brightest, Last, WeightedMean};
use super::rows::FixedMap;
use super::slab::Ready;
use super::swept::{Pair, Sweep};
use super::{
    Compounding, Grid, Holes, Mark, Slice, Volume, VolumeError, VolumeSettings, Weights, holes, memory,
};

/// Images go in one by one, as they come; a view can be had at any time, and is what [`Volume::build`] gives of the same
/// images on the same grid, bit for bit.
///
/// With a grid in the settings its voxels are those. Without one the volume grows with the images, on voxels whose
/// centres are whole steps from World's origin; memory is taken where images are.
pub struct LiveVolume {
    settings: VolumeSettings,
    /// The grid given, or one whose first voxel is at World's origin.
    lattice: Grid,
    clips: Vec<Clip>,
    cells: Box<dyn Cells>,
    sweep: Sweep,
    /// Voxels between the images' farthest corners.
    reach: Option<[Range<i64>; 3]>,
    images: usize,
    hits: f64,
}

impl LiveVolume {
    /// An empty volume.
    ///
    /// # Errors
    /// When the grid or importance is none, or the median is asked for, which needs all images at once.
    pub fn new(settings: &VolumeSettings) -> Result<Self, VolumeError> {
        let everywhere = || {
            let origin = Point::from_vector(Vector3::zeros());
            Grid { origin, spacing_m: settings.spacing_m, size: [1; 3] }
        };
        let lattice = settings.grid.clone().unwrap_or_else(everywhere);
        lattice.check()?;
        settings.importance.as_ref().map_or(Ok(()), super::Importance::check)?;
        let cells: Box<dyn Cells> = match settings.compounding {
            Compounding::Mean => Box::new(Layers::<WeightedMean>::new(settings.weights)),
            Compounding::Maximum => Box::new(Layers::<Brightest>::new(settings.weights)),
            Compounding::Latest => Box::new(Layers::<Last>::new(settings.weights)),
            Compounding::Median => return Err(VolumeError::NotLive),
        };
        Ok(Self {
            lattice,
            clips: Vec::new(),
            cells,
            sweep: Sweep::default(),
            reach: None,
            images: 0,
            hits: 0.0,
            settings: settings.clone(),
        })
    }

    /// Puts an image in.
    ///
    /// # Errors
    /// When it is none, lies too far away, or the volume would outgrow the memory allowed; the volume is as before.
    pub fn insert(&mut self, slice: &Slice<'_>) -> Result<(), VolumeError> {
        let image = self.images;
        slice.check(image)?;
        let half = self.settings.weights == Weights::Nearest;
        let map = FixedMap::of(slice, &self.lattice, half).ok_or(VolumeError::OffGrid { image })?;
        // Whether images with weights are still to come is not known.
        let hits = memory::exact(self.hits + memory::hits(slice, &self.lattice), true)?;
        let reach = self.reach_with(image, slice)?;
        let touched = self.touched(&map, slice);
        self.fits(&touched, &reach, slice)?;
        let clip = self.clip(slice);
        let (pixels, width, weights) = (slice.pixels, slice.width, slice.weights);
        if let Some(own) = self.clips.get(clip) {
            self.cells.insert(&Ready { pixels, weights, width, map, clip }, own, &touched);
        }
        if matches!(self.settings.holes, Some(Holes::Swept(_))) {
            self.sweep.push(slice, &self.lattice, &self.settings);
        }
        (self.reach, self.hits) = (reach, hits);
        self.images += 1;
        Ok(())
    }

    /// Images that went in.
    pub const fn images(&self) -> usize {
        self.images
    }

    /// Where the voxels are: the grid given, or as far as the images reach.
    ///
    /// # Errors
    /// When no image went in yet and no grid was given.
    pub fn grid(&self) -> Result<Grid, VolumeError> {
        if self.settings.grid.is_some() {
            return Ok(self.lattice.clone());
        }
        let reach = self.reach.as_ref().ok_or(VolumeError::NoImages)?;
        Ok(self.grown(reach))
    }

    /// The volume as it is now, its holes filled when the settings say so.
    ///
    /// # Errors
    /// When no image went in yet and no grid was given.
    pub fn view(&self) -> Result<Volume, VolumeError> {
        let grid = self.grid()?;
        let low = self.low();
        let mut volume = Volume::unseen(grid);
        let [nx, ny, _] = volume.grid.size;
        let layers =
            volume.grey.par_chunks_mut(nx * ny).zip(volume.marks.par_chunks_mut(nx * ny)).enumerate();
        layers.for_each(|(number, (grey, marks))| {
            let first = [low[0], low[1], low[2] + number as i64];
            self.cells.layer(first, [nx, ny], (grey, marks));
        });
        match self.settings.holes {
            Some(Holes::Swept(swept)) => {
                let pairs: Vec<Pair> = self.sweep.pairs(&volume.grid, swept);
                let Volume { grid, grey, marks } = &mut volume;
                self.sweep.fill(&pairs, grid, 0, (grey, marks));
            }
            Some(Holes::Sticks(sticks)) => holes::fill(&mut volume, sticks),
            None => {}
        }
        Ok(volume)
    }

    /// The memory it takes now (bytes), a view apart.
    pub fn memory_bytes(&self) -> u64 {
        self.cells.bytes_with(&[0..0, 0..0, 0..0]) + self.sweep.bytes()
    }

    /// The first voxel of a view, on the lattice.
    fn low(&self) -> [i64; 3] {
        match (&self.settings.grid, &self.reach) {
            (None, Some(reach)) => [reach[0].start, reach[1].start, reach[2].start],
            _ => [0; 3],
        }
    }

    fn grown(&self, reach: &[Range<i64>; 3]) -> Grid {
        let steps = Vector3::new(reach[0].start as f64, reach[1].start as f64, reach[2].start as f64);
        let origin = Point::from_vector(steps.component_mul(&Vector3::from(self.lattice.spacing_m)));
        let size = [0, 1, 2].map(|axis: usize| (reach[axis].end - reach[axis].start).max(1) as usize);
        Grid { origin, size, ..self.lattice.clone() }
    }

    /// How far the images reach with this one.
    fn reach_with(&self, image: usize, slice: &Slice<'_>) -> Result<Option<[Range<i64>; 3]>, VolumeError> {
        if self.settings.grid.is_some() {
            return Ok(None);
        }
        let corners = super::grid::corners(image, slice, &self.settings)?.map(|c| self.lattice.in_voxels(c));
        Ok(Some([0, 1, 2].map(|axis| {
            let own = corners.iter().map(|corner| corner[axis]);
            let low = own.clone().fold(f64::INFINITY, f64::min).floor() as i64;
            let high = own.fold(f64::NEG_INFINITY, f64::max).ceil() as i64 + 1;
            match &self.reach {
                Some(reach) => low.min(reach[axis].start)..high.max(reach[axis].end),
                None => low..high,
            }
        })))
    }

    /// The voxels that an image's pixels may go to.
    fn touched(&self, map: &FixedMap, slice: &Slice<'_>) -> [Range<i64>; 3] {
        [0, 1, 2].map(|axis| {
            let span = map.span(axis, slice.width, slice.height());
            if self.settings.grid.is_none() {
                return span;
            }
            let most = self.lattice.size[axis] as i64;
            span.start.clamp(0, most)..span.end.clamp(0, most)
        })
    }

    /// Refuses an image for which cells, and a view, would take more than is allowed.
    fn fits(
        &self,
        touched: &[Range<i64>; 3],
        reach: &Option<[Range<i64>; 3]>,
        slice: &Slice<'_>,
    ) -> Result<(), VolumeError> {
        let grid = reach.as_ref().map_or_else(|| self.lattice.clone(), |reach| self.grown(reach));
        let view = grid.size.iter().fold(Mark::BYTES, |bytes, n| bytes.saturating_mul(*n as u64));
        let kept = self.sweep.bytes() + self.settings.kept_bytes(std::slice::from_ref(slice), &grid);
        let needs = self.cells.bytes_with(touched).saturating_add(view).saturating_add(kept);
        if needs > self.settings.most_bytes { Err(self.settings.too_large(&grid, needs)) } else { Ok(()) }
    }

    fn clip(&mut self, slice: &Slice<'_>) -> usize {
        Clip::number(&mut self.clips, (slice.width, slice.height()), |width, height| {
            Clip::of(&self.settings.region, width, height).weighted(self.settings.importance.as_ref())
        })
    }
}
