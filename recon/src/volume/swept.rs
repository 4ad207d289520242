//! Hole filling between one image and the next: what their pixels pass on their straight ways is swept, and a voxel
//! there that no pixel fell into takes what the two images show where its way began and ends.
//!
//! A pixel (u, v) at t between the images is at `O + u C + v R`, where O, C and R go from the one image's origin and
//! steps to the other's in straight lines. A voxel's t is the root of the signed volume `(C x R) . (p - O)`, a cubic,
//! between two images on whose different sides it lies.

mod pair;
mod thumb;

use rayon::prelude::*;

use pair::Pair;
use thumb::Thumb;

use super::clip::Clip;
use super::{Grid, Mark, Slice, Swept, VolumeSettings};

/// Sums of a layer at work take about this many bytes.
const ROOM_BYTES: usize = 1 << 20;
/// Bits of a sum's count of pairs.
const COUNT: u32 = 20;

/// Images, and which of them have something swept between them.
pub(super) struct Sweep {
    thumbs: Vec<Thumb>,
    clips: Vec<Clip>,
    pairs: Vec<Pair>,
}

impl Sweep {
    pub(super) fn of(slices: &[Slice<'_>], grid: &Grid, settings: &VolumeSettings, swept: Swept) -> Self {
        let mut sweep = Self { thumbs: Vec::new(), clips: Vec::new(), pairs: Vec::new() };
        let owns: Vec<usize> = slices.iter().map(|slice| sweep.clip(slice, settings)).collect();
        let clips = &sweep.clips;
        let thumb = |(slice, own): (&Slice<'_>, &usize)| Thumb::of(slice, clips.get(*own)?, grid).into();
        let thumbs: Vec<Option<Thumb>> = slices.par_iter().zip(&owns).map(thumb).collect();
        let neighbours = slices.windows(2).zip(owns.windows(2)).enumerate();
        sweep.pairs = neighbours
            .filter(|(_, (_, own))| own[0] == own[1])
            .filter_map(|(number, (two, own))| {
                let [first, second] = two else { return None };
                Pair::between(number, [first, second], own[0], clips.get(own[0])?, grid, swept)
            })
            .collect();
        sweep.thumbs = thumbs.into_iter().flatten().collect();
        sweep
    }

    /// The number of the clip for images of this one's size.
    fn clip(&mut self, slice: &Slice<'_>, settings: &VolumeSettings) -> usize {
        let size = (slice.width, slice.height());
        let known = self.clips.iter().position(|c| (c.width, c.height) == size);
        known.unwrap_or_else(|| {
            self.clips.push(Clip::of(&settings.region, size.0, size.1));
            self.clips.len() - 1
        })
    }

    /// Fills the layers from `first` on. Every voxel is on its own, so any cutting into layers gives the same.
    pub(super) fn fill(&self, grid: &Grid, first: usize, (grey, marks): (&mut [u8], &mut [Mark])) {
        let [nx, ny, _] = grid.size;
        let chunk = chunk_layers(grid) * nx * ny;
        let chunks = grey.par_chunks_mut(chunk).zip(marks.par_chunks_mut(chunk)).enumerate();
        chunks.for_each_init(Vec::new, |sums: &mut Vec<u64>, (number, (grey, marks))| {
            let low = (first + number * chunk_layers(grid)) as i64;
            let layers = low..low + (grey.len() / (nx * ny)) as i64;
            sums.clear();
            sums.resize(grey.len(), 0);
            for pair in self.pairs.iter().filter(|pair| pair.touches(&layers)) {
                self.sweep(pair, &mut Layers { sums, marks, size: [nx, ny], first: low }, &layers);
            }
            finish(sums, grey, marks);
        });
    }

    fn sweep(&self, pair: &Pair, layers: &mut Layers<'_>, range: &std::ops::Range<i64>) {
        let (Some(clip), Some(first), Some(second)) =
            (self.clips.get(pair.clip), self.thumbs.get(pair.number), self.thumbs.get(pair.number + 1))
        else {
            return;
        };
        pair.rows(range, |y, z, columns| {
            let Some((sums, marks)) = layers.row(y, z) else { return };
            for x in columns {
                let (Some(sum), Some(Mark::Unseen)) = (sums.get_mut(x), marks.get(x)) else { continue };
                let Some((t, u, v)) = pair.passing([x as f64, y as f64, z as f64]) else { continue };
                if clip.holds(u, v)
                    && let Some(value) = between(first.at(u, v), second.at(u, v), t)
                {
                    *sum += (value << COUNT) | 1;
                }
            }
        });
    }
}

/// The layers that one thread works on.
struct Layers<'l> {
    sums: &'l mut [u64],
    marks: &'l [Mark],
    size: [usize; 2],
    first: i64,
}

impl Layers<'_> {
    fn row(&mut self, y: i64, z: i64) -> Option<(&mut [u64], &[Mark])> {
        let [nx, ny] = self.size;
        let start = ((z - self.first) as usize * ny + y as usize) * nx;
        Some((self.sums.get_mut(start..start + nx)?, self.marks.get(start..start + nx)?))
    }
}

/// In 256ths of a grey level: the nearer image counts more; where only one shows something, that.
fn between(first: Option<f32>, second: Option<f32>, t: f64) -> Option<u64> {
    let t = t as f32;
    let value = match (first, second) {
        (Some(first), Some(second)) => first + t * (second - first),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => return None,
    };
    Some(value.round() as u64)
}

/// Where several sweeps lead through a voxel, their mean.
fn finish(sums: &[u64], grey: &mut [u8], marks: &mut [Mark]) {
    for ((sum, grey), mark) in sums.iter().zip(grey).zip(marks) {
        let (count, sum) = (sum & ((1 << COUNT) - 1), sum >> COUNT);
        if count > 0 {
            (*grey, *mark) = (((sum + 128 * count) / (256 * count)) as u8, Mark::Filled);
        }
    }
}

fn chunk_layers(grid: &Grid) -> usize {
    let layer = grid.size[0].saturating_mul(grid.size[1]).saturating_mul(size_of::<u64>());
    (ROOM_BYTES / layer.max(1)).max(1)
}

/// The sums of the layers at work (bytes).
pub(super) fn working_bytes(grid: &Grid) -> u64 {
    let [nx, ny, _] = grid.size.map(|n| n as u64);
    let layers = (chunk_layers(grid) as u64).min(grid.size[2] as u64);
    let threads = rayon::current_num_threads() as u64;
    [ny, layers, 8, threads].into_iter().fold(nx, u64::saturating_mul)
}

/// What is kept of the images until their holes are filled (bytes).
pub(super) fn kept_bytes(slices: &[Slice<'_>], grid: &Grid) -> u64 {
    slices.iter().map(|slice| thumb::bytes(slice, grid)).fold(0, u64::saturating_add)
}
