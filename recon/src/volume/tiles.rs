//! A volume in parts, one after the other, each within the memory allowed: a whole leg fits on the disk, not in memory.

use std::ops::Range;

use super::splat::{self, Walk};
use super::swept::{self, Pair, Sweep};
use super::{Grid, Holes, Mark, Slice, Volume, VolumeError, VolumeSettings, holes};

/// The parts of a volume along z, in their order, each a [`Volume`] on its own part of the grid. Together they are what
/// [`Volume::build`] gives, bit for bit.
pub struct Tiles<'a> {
    pub(super) grid: Grid,
    settings: VolumeSettings,
    walk: Walk<'a>,
    sweep: Option<(Sweep, Vec<Pair>)>,
    layers: usize,
    memory_bytes: u64,
    next: usize,
}

impl<'a> Tiles<'a> {
    /// Parts as thick as [`VolumeSettings::most_bytes`] allows.
    ///
    /// # Errors
    /// As [`Volume::build`], but too large is only a grid of which not one layer fits.
    pub fn new(slices: &[Slice<'a>], settings: &VolumeSettings) -> Result<Self, VolumeError> {
        let grid = settings.grid_for(slices)?;
        grid.check()?;
        settings.check_images(slices, &grid)?;
        let kept = settings.kept_bytes(slices, &grid);
        let needs = |layers: usize| settings.tile_bytes(&grid, layers).saturating_add(kept);
        if needs(1) > settings.most_bytes {
            return Err(settings.too_large(&grid, needs(1)));
        }
        let layers = most(grid.size[2], |layers| needs(layers) <= settings.most_bytes);
        let bytes = needs(layers);
        Self::of(slices, settings, grid, layers, bytes)
    }

    pub(super) fn of(
        slices: &[Slice<'a>],
        settings: &VolumeSettings,
        grid: Grid,
        layers: usize,
        memory_bytes: u64,
    ) -> Result<Self, VolumeError> {
        let walk = Walk::prepare(slices, &grid, settings)?;
        let sweep = match settings.holes {
            Some(Holes::Swept(swept)) => {
                let sweep = Sweep::of(slices, &grid, settings);
                let pairs = sweep.pairs(&grid, swept);
                Some((sweep, pairs))
            }
            _ => None,
        };
        Ok(Self { grid, settings: settings.clone(), walk, sweep, layers, memory_bytes, next: 0 })
    }

    /// Where the voxels of all parts are.
    pub const fn grid(&self) -> &Grid {
        &self.grid
    }

    /// How many parts there are.
    pub const fn parts(&self) -> usize {
        self.grid.size[2].div_ceil(self.layers)
    }

    /// The memory that a part needs while it is built (bytes), the images apart.
    pub const fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    pub(super) fn part(&self, layers: Range<usize>) -> Volume {
        let halo = self.settings.halo();
        let low = layers.start.saturating_sub(halo);
        let around = low..layers.end.saturating_add(halo).min(self.grid.size[2]);
        let mut volume = Volume::unseen(self.grid.layers(&around));
        let Volume { grey, marks, .. } = &mut volume;
        splat::splat(&self.walk, &self.grid, &self.settings, around.start, (grey, marks));
        match (&self.sweep, self.settings.holes) {
            (Some((sweep, pairs)), _) => sweep.fill(pairs, &self.grid, around.start, (grey, marks)),
            (None, Some(Holes::Sticks(sticks))) => holes::fill(&mut volume, sticks),
            (None, _) => {}
        }
        if around == layers { volume } else { volume.only(layers.start - low, self.grid.layers(&layers)) }
    }
}

impl Iterator for Tiles<'_> {
    type Item = Volume;

    fn next(&mut self) -> Option<Volume> {
        let end = self.next.saturating_add(self.layers).min(self.grid.size[2]);
        let layers = self.next..end;
        self.next = end;
        (!layers.is_empty()).then(|| self.part(layers))
    }
}

/// The most layers that fit; one does.
fn most(layers: usize, fits: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (1, layers.max(1));
    while low < high {
        let middle = high - (high - low) / 2;
        if fits(middle) { low = middle } else { high = middle - 1 }
    }
    low
}

impl VolumeSettings {
    /// The grid given, or that of the images.
    pub(super) fn grid_for(&self, slices: &[Slice<'_>]) -> Result<Grid, VolumeError> {
        self.grid.clone().map_or_else(|| Grid::around(slices, self), Ok)
    }

    /// Layers beside a part that its filling looks at.
    const fn halo(&self) -> usize {
        match self.holes {
            Some(Holes::Sticks(sticks)) => sticks.longest,
            _ => 0,
        }
    }

    fn tile_bytes(&self, grid: &Grid, layers: usize) -> u64 {
        let [nx, ny, nz] = grid.size;
        let thick = layers.saturating_add(self.halo().saturating_mul(2)).min(nz);
        let part = Grid { size: [nx, ny, thick], ..grid.clone() };
        // Cutting the halo off copies what is left.
        let copied = if thick == layers { 0 } else { layers };
        let copy = [nx, ny, copied].iter().fold(Mark::BYTES, |bytes, n| bytes.saturating_mul(*n as u64));
        self.memory_bytes(&part).saturating_add(copy)
    }

    /// What is kept of the images until holes are filled (bytes).
    pub(super) fn kept_bytes(&self, slices: &[Slice<'_>], grid: &Grid) -> u64 {
        if matches!(self.holes, Some(Holes::Swept(_))) { swept::kept_bytes(slices, grid) } else { 0 }
    }
}
