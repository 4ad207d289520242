//! Hole filling between one image and the next: what their pixels pass on their straight ways is swept, and a voxel
//! there that no pixel fell into takes what the two images show where its way began and ends.
//!
//! A pixel (u, v) at t between the images is at `O + u C + v R`, where O, C and R go from the one image's origin and
//! steps to the other's in straight lines. A voxel's t is the root of the signed volume `(C x R) . (p - O)`, a cubic,
//! between two images on whose different sides it lies.

mod pair;
mod passing;
mod thumb;

use std::ops::Range;

use probepath_frames::World;
use probepath_us_capture::PixelMap;
use rayon::prelude::*;

pub(super) use pair::Pair;
use thumb::Thumb;

use super::clip::Clip;
use super::{Grid, Mark, Slice, Swept, VolumeSettings};

/// Sums of a layer at work take about this many bytes.
const ROOM_BYTES: usize = 1 << 20;
/// Bits of a sum's count of pairs.
const COUNT: u32 = 20;

/// Images as they are looked at from the holes between them.
#[derive(Default)]
pub(super) struct Sweep {
    images: Vec<Kept>,
    clips: Vec<Clip>,
}

/// What is kept of an image.
struct Kept {
    map: PixelMap<World>,
    clip: usize,
    thumb: Thumb,
}

impl Sweep {
    pub(super) fn of(slices: &[Slice<'_>], grid: &Grid, settings: &VolumeSettings) -> Self {
        let mut sweep = Self::default();
        let own: Vec<usize> = slices.iter().map(|slice| sweep.clip(slice, settings)).collect();
        let Self { images, clips } = &mut sweep;
        let kept = slices.par_iter().zip(own).filter_map(|(slice, clip)| {
            Some(Kept { map: slice.map, clip, thumb: Thumb::of(slice, clips.get(clip)?, grid) })
        });
        *images = kept.collect();
        sweep
    }

    /// One image more.
    pub(super) fn push(&mut self, slice: &Slice<'_>, grid: &Grid, settings: &VolumeSettings) {
        let clip = self.clip(slice, settings);
        if let Some(own) = self.clips.get(clip) {
            let thumb = Thumb::of(slice, own, grid);
            self.images.push(Kept { map: slice.map, clip, thumb });
        }
    }

    fn clip(&mut self, slice: &Slice<'_>, settings: &VolumeSettings) -> usize {
        let size = (slice.width, slice.height());
        Clip::number(&mut self.clips, size, |width, height| {
            Clip::of(&settings.region, width, height).weighted(settings.importance.as_ref())
        })
    }

    /// What is kept (bytes).
    pub(super) fn bytes(&self) -> u64 {
        self.images.iter().map(|image| image.thumb.bytes()).sum()
    }

    /// The neighbours between which something was swept.
    pub(super) fn pairs(&self, grid: &Grid, swept: Swept) -> Vec<Pair> {
        let pair = |(number, two): (usize, &[Kept])| {
            let [first, second] = two else { return None };
            let clip = self.clips.get(first.clip).filter(|_| first.clip == second.clip)?;
            Pair::between((number, first.clip), [&first.map, &second.map], clip, grid, swept)
        };
        self.images.windows(2).enumerate().filter_map(pair).collect()
    }

    /// Fills the layers from `first` on. Every voxel is on its own, so any cutting into layers gives the same.
    pub(super) fn fill(
        &self,
        pairs: &[Pair],
        grid: &Grid,
        first: usize,
        (grey, marks): (&mut [u8], &mut [Mark]),
    ) {
        let [nx, ny, _] = grid.size;
        let chunk = chunk_layers(grid) * nx * ny;
        let chunks = grey.par_chunks_mut(chunk).zip(marks.par_chunks_mut(chunk)).enumerate();
        chunks.for_each_init(Vec::new, |sums: &mut Vec<u64>, (number, (grey, marks))| {
            let low = (first + number * chunk_layers(grid)) as i64;
            let layers = low..low + (grey.len() / (nx * ny)) as i64;
            sums.clear();
            sums.resize(grey.len(), 0);
            for pair in pairs.iter().filter(|pair| pair.touches(&layers)) {
                self.sweep(pair, &mut Layers { sums, marks, size: [nx, ny], first: low }, &layers);
            }
            finish(sums, grey, marks);
        });
    }

    fn sweep(&self, pair: &Pair, layers: &mut Layers<'_>, range: &Range<i64>) {
        let (Some(clip), Some(first), Some(second)) =
            (self.clips.get(pair.clip), self.images.get(pair.number), self.images.get(pair.number + 1))
        else {
            return;
        };
        let rectangle = clip.rectangle();
        let holds = |u: f64, v: f64| match &rectangle {
            Some([columns, rows]) => columns.contains(&u) && rows.contains(&v),
            None => clip.holds(u, v),
        };
        let alike = first.thumb.is_like(&second.thumb);
        pair.rows(range, |[y, z], columns| {
            let Some((sums, marks)) = layers.row(y, z) else { return };
            let passing = pair.passing(y as f64, z as f64);
            for x in columns {
                let (Some(sum), Some(Mark::Unseen)) = (sums.get_mut(x), marks.get(x)) else { continue };
                let Some((t, u, v)) = passing.at(x as f64) else { continue };
                if !holds(u, v) {
                    continue;
                }
                let spot = first.thumb.spot(u, v);
                let other = if alike { spot } else { second.thumb.spot(u, v) };
                if let Some(value) = between(first.thumb.at(&spot), second.thumb.at(&other), t) {
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
fn between(first: Option<i32>, second: Option<i32>, t: f64) -> Option<u64> {
    let value = match (first, second) {
        (Some(first), Some(second)) => thumb::between(first, second, thumb::parts(t)),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => return None,
    };
    Some(u64::from(value.cast_unsigned()))
}

/// Where several sweeps lead through a voxel, their mean.
fn finish(sums: &[u64], grey: &mut [u8], marks: &mut [Mark]) {
    for ((sum, grey), mark) in sums.iter().zip(grey).zip(marks) {
        let (count, sum) = (sum & ((1 << COUNT) - 1), sum >> COUNT);
        // Mostly one; a division costs as much as all else here.
        let mean = match count {
            0 => continue,
            1 => (sum + 128) >> 8,
            _ => (sum + 128 * count) / (256 * count),
        };
        (*grey, *mark) = (mean as u8, Mark::Filled);
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
