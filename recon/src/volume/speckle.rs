//! Sweeps over the same tissue, compounded so that the speckle averages out.
//!
//! The grey levels are turned back into amplitudes, because the mean of logarithms is not the logarithm of the mean.
//! Within a sweep a voxel's pixels are one speckle grain or a few: their mean counts as many looks as grains fit into
//! them. How large a grain is is read from the images: the logarithm of fully developed speckle varies by
//! `10 / ln 10 * pi / sqrt(6)` = 5.57 dB, and pixels that differ by less belong together. Between sweeps the means are
//! averaged, each by its looks; one that lies further from the others than speckle of so many looks does (a shadow, an
//! echo that is not there) counts less. The amplitude of speckle, a Rayleigh variable, has a mean of 1.91 standard
//! deviations; of n looks, of 1.91 sqrt(n).

mod amplitude;
mod grain;

use rayon::prelude::*;

use amplitude::Amplitude;
use grain::Grain;

use super::slab::Slab;
use super::splat::{self, Walk};
use super::strip::WHOLE;
use super::swept::Sweep;
use super::{Grid, Holes, Mark, Slice, Volume, VolumeError, VolumeSettings};

/// One over 1.91: the standard deviation of the amplitude of speckle beside its mean.
const SPECKLE_SD: f32 = 0.5227;

/// How amplitudes are had from grey levels, and when one is doubtful.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeckleSettings {
    /// Decibels from grey 0 to grey 255 of the log compression.
    pub dynamic_range_db: f64,
    /// A sweep further from the sweeps' median than so many of speckle's standard deviations counts less. Three sweeps
    /// at least have to be there.
    pub doubtful_sd: f64,
}

impl Default for SpeckleSettings {
    fn default() -> Self {
        Self { dynamic_range_db: 60.0, doubtful_sd: 3.0 }
    }
}

/// The compounded sweeps.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeckleVolume {
    /// Grey levels of the mean amplitude, log-compressed as the images were.
    pub volume: Volume,
    /// Independent looks that a seen voxel has on average, as far as the sweeps' own statistics tell: sweeps along one
    /// and the same path show the same speckle, and then there are fewer.
    pub mean_looks: f64,
    /// Pixels of a speckle grain, sweep by sweep: along columns, along rows, and in images.
    pub grains_px: Vec<[f64; 3]>,
}

/// What a sweep says of a voxel: the mean amplitude, and looks (0 where it saw nothing).
type Estimate = [f32; 2];

impl SpeckleVolume {
    /// Compounds sweeps on one grid. Holes are filled sweep by sweep, the first one's first.
    /// [`VolumeSettings::compounding`] is not asked.
    ///
    /// # Errors
    /// As [`Volume::build`], or when the dynamic range is none.
    pub fn build(
        sweeps: &[&[Slice<'_>]],
        settings: &VolumeSettings,
        speckle: &SpeckleSettings,
    ) -> Result<Self, VolumeError> {
        let dynamic_range_db = speckle.dynamic_range_db;
        if !(20.0..=120.0).contains(&dynamic_range_db) {
            return Err(VolumeError::BadRange { dynamic_range_db });
        }
        let all: Vec<Slice<'_>> = sweeps.iter().flat_map(|sweep| sweep.iter().copied()).collect();
        let grid = settings.grid_for(&all)?;
        settings.check(&all, &grid)?;
        let needs = settings.memory_bytes(&grid).saturating_add(working_bytes(&grid, settings, sweeps.len()));
        if needs > settings.most_bytes {
            return Err(settings.too_large(&grid, needs));
        }
        let grains: Vec<Grain> =
            sweeps.iter().map(|sweep| Grain::of(sweep, settings, dynamic_range_db)).collect();
        let walks = sweeps.iter().map(|sweep| Walk::prepare(sweep, &grid, settings));
        let walks: Vec<Walk<'_>> = walks.collect::<Result<_, _>>()?;
        let mut volume = Volume::unseen(grid);
        let looks = compound(&walks, &grains, settings, speckle, &mut volume);
        fill(sweeps, settings, &mut volume);
        let mean_looks = looks / volume.count(Mark::Seen).max(1) as f64;
        Ok(Self { volume, mean_looks, grains_px: grains.iter().map(|grain| grain.px).collect() })
    }
}

/// Gives the sum of all voxels' looks.
fn compound(
    walks: &[Walk<'_>],
    grains: &[Grain],
    settings: &VolumeSettings,
    speckle: &SpeckleSettings,
    volume: &mut Volume,
) -> f64 {
    let grid = volume.grid.clone();
    let [nx, ny, _] = grid.size;
    let thick = splat::slab_layers(&grid, settings);
    let (levels, per_voxel) = (amplitude::levels(speckle.dynamic_range_db), nx * ny * thick);
    let slabs = volume.grey.par_chunks_mut(per_voxel).zip(volume.marks.par_chunks_mut(per_voxel)).enumerate();
    let sums: Vec<f64> = slabs
        .map(|(number, (grey, marks))| {
            let low = (number * thick) as i64;
            let layers = low..low + (grey.len() / (nx * ny)) as i64;
            let mut slab = Slab::<Amplitude>::over(&[0..0, 0..0, 0..0], settings.weights, WHOLE);
            slab.set_levels(&levels);
            let mut estimates = Vec::with_capacity(walks.len() * grey.len());
            for (walk, grain) in walks.iter().zip(grains) {
                slab.clear(&[0..nx as i64, 0..ny as i64, layers.clone()]);
                walk.touching(&layers).for_each(|(slice, clip)| slab.add(slice, clip));
                estimates.extend(slab.rows().flatten().map(|cell| cell.estimate(grain)));
            }
            combine(&estimates, speckle, (grey, marks))
        })
        .collect();
    // Slab by slab in their order, so that the sum does not depend on the threads; the slabs are the grid's.
    sums.iter().sum()
}

/// The sweeps' estimates, one sweep after the other, into grey levels; gives the sum of looks.
fn combine(
    estimates: &[Estimate],
    speckle: &SpeckleSettings,
    (grey, marks): (&mut [u8], &mut [Mark]),
) -> f64 {
    let voxels = grey.len();
    let mut of_voxel: Vec<Estimate> = Vec::new();
    let mut total = 0.0;
    for (voxel, (grey, mark)) in grey.iter_mut().zip(marks).enumerate() {
        let sweeps = estimates.chunks_exact(voxels.max(1)).filter_map(|sweep| sweep.get(voxel));
        of_voxel.clear();
        of_voxel.extend(sweeps.filter(|[_, looks]| *looks > 0.0));
        if let Some((mean, looks)) = mean(&mut of_voxel, speckle.doubtful_sd as f32) {
            (*grey, *mark) = (amplitude::grey(mean, speckle.dynamic_range_db), Mark::Seen);
            total += f64::from(looks);
        }
    }
    total
}

/// The mean of a voxel's estimates by their looks, and the looks that it has.
fn mean(estimates: &mut [Estimate], doubtful_sd: f32) -> Option<(f32, f32)> {
    estimates.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let count = estimates.len();
    let middle = [estimates.get(count.checked_sub(1)? / 2)?[0], estimates.get(count / 2)?[0]];
    let median = 0.5 * (middle[0] + middle[1]);
    let (mut sum, mut weights, mut squares) = (0.0, 0.0, 0.0);
    for [amplitude, looks] in estimates.iter() {
        let sd = SPECKLE_SD * median / looks.sqrt();
        let off = (amplitude - median).abs() / sd.max(f32::MIN_POSITIVE);
        let belief = if count < 3 || off <= doubtful_sd { 1.0 } else { (doubtful_sd / off).powi(2) };
        let weight = belief * looks;
        sum += weight * amplitude;
        weights += weight;
        squares += weight * belief;
    }
    // Looks of a weighted mean: the squared sum of the weights over the sum of their squares, each by its own looks.
    (weights > 0.0).then(|| (sum / weights, weights * weights / squares))
}

fn fill(sweeps: &[&[Slice<'_>]], settings: &VolumeSettings, volume: &mut Volume) {
    match settings.holes {
        None => {}
        Some(Holes::Sticks(sticks)) => super::holes::fill(volume, sticks),
        Some(Holes::Swept(swept)) => {
            for slices in sweeps {
                let sweep = Sweep::of(slices, &volume.grid, settings);
                let pairs = sweep.pairs(&volume.grid, swept);
                let Volume { grid, grey, marks } = &mut *volume;
                sweep.fill(&pairs, grid, 0, (grey, marks));
            }
        }
    }
}

/// The sweeps' estimates in the slabs at work (bytes).
fn working_bytes(grid: &Grid, settings: &VolumeSettings, sweeps: usize) -> u64 {
    let [nx, ny, _] = grid.size;
    let cells = size_of::<Amplitude>() + sweeps.saturating_mul(size_of::<Estimate>());
    let voxels = [nx, ny, splat::slab_layers(grid, settings) + 2, rayon::current_num_threads()];
    voxels.iter().fold(cells as u64, |bytes, n| bytes.saturating_mul(*n as u64))
}
