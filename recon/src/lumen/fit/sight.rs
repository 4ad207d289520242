//! Where a wall is seen: directions that a shadow hides, or that open into another vessel, say nothing of the border.

use super::lattice::{BINS, Lattice};

/// Directions that are judged apart.
const SECTORS: usize = 24;
const BINS_A_SECTOR: usize = BINS / SECTORS;
/// Distances that are averaged over (m), and how far out a wall is looked for.
const RING_M: f32 = 0.3e-3;
const RINGS: usize = 14;
/// When the wall is seen in so many sectors, those that a shadow hides are not held against it.
const LEAST_SEEN: usize = 11;

/// How well the wall is seen in every direction.
pub(super) struct Sight {
    /// 0 where there is none, 1 where it is plain.
    pub(super) trust: [f32; BINS],
    /// Part of the circumference where it is seen, of what can be seen of it.
    pub(super) walled: f64,
    /// How far outward of `inside` it rises to half its brightness (m), where it is seen.
    rise: [Option<f32>; SECTORS],
}

impl Sight {
    /// Looks for a wall outward of `inside` (m, by direction), which lies within the lumen.
    pub(super) fn new(lattice: &Lattice, inside: &[f32; BINS]) -> Self {
        let (rings, lumen) = rings(lattice, inside);
        let peaks: [f32; SECTORS] = std::array::from_fn(|sector| peak(&rings[sector]).1);
        let decibel: [f32; SECTORS] = std::array::from_fn(|sector| {
            let near = |by: usize| peaks[(sector + SECTORS + by - 1) % SECTORS];
            let mean = 0.25 * near(0) + 0.5 * near(1) + 0.25 * near(2);
            10.0 * (mean / lumen).max(1e-6).log10()
        });
        // The brightest of a dozen rings is some 4 dB above the mean by speckle alone.
        let trust = |bin: usize| ((decibel[bin / BINS_A_SECTOR] - 7.0) / 5.0).clamp(0.02, 1.0);
        let shown = peaks.iter().filter(|&&peak| peak > 0.0).count();
        let seen = decibel.iter().filter(|&&db| db > 9.0).count();
        let rise = |sector: usize| (decibel[sector] > 9.0).then(|| rise(&rings[sector]));
        Self {
            trust: std::array::from_fn(trust),
            walled: if seen >= LEAST_SEEN {
                seen as f64 / shown as f64
            } else {
                seen as f64 / SECTORS as f64
            },
            rise: std::array::from_fn(rise),
        }
    }

    /// By how much, in the median, the wall rises farther out than is expected (m outward of `inside`, by bin).
    pub(super) fn farther_out(&self, expected: impl Fn(usize) -> f64) -> f64 {
        let off = |(sector, rise): (usize, &Option<f32>)| {
            Some(f64::from((*rise)?) - expected(sector * BINS_A_SECTOR + BINS_A_SECTOR / 2))
        };
        let mut off: Vec<f64> = self.rise.iter().enumerate().filter_map(off).collect();
        off.sort_by(f64::total_cmp);
        off.get(off.len() / 2).copied().unwrap_or(0.0)
    }
}

/// The mean of every ring outward of the lumen in every sector, and the mean inside.
type Rings = [[f32; RINGS]; SECTORS];

fn rings(lattice: &Lattice, inside: &[f32; BINS]) -> (Rings, f32) {
    let mut sums = [[(0.0_f32, 0.0_f32); RINGS]; SECTORS];
    let (mut dark, mut count) = (1e-12, 1e-9);
    let cells = lattice.r.iter().zip(&lattice.bin).zip(lattice.power.iter().zip(&lattice.used));
    for ((r, bin), (power, used)) in cells {
        let bin = usize::from(*bin);
        if *used <= 0.0 {
            continue;
        }
        let out = r - inside[bin];
        if out < 0.0 {
            if *r < 0.7 * inside[bin] {
                (dark, count) = (dark + power, count + 1.0);
            }
            continue;
        }
        if let Some(ring) = sums[bin / BINS_A_SECTOR].get_mut((out / RING_M) as usize) {
            *ring = (ring.0 + power, ring.1 + 1.0);
        }
    }
    let mean = |ring: (f32, f32)| if ring.1 > 0.0 { ring.0 / ring.1 } else { 0.0 };
    (sums.map(|sector| sector.map(mean)), dark / count)
}

/// The brightest ring.
fn peak(rings: &[f32; RINGS]) -> (usize, f32) {
    rings.iter().copied().enumerate().fold((0, 0.0), |best, ring| if ring.1 > best.1 { ring } else { best })
}

/// Where the rings rise to half of the brightest, going outward (m).
fn rise(rings: &[f32; RINGS]) -> f32 {
    let (at, top) = peak(rings);
    let below = rings[..at].iter().rposition(|ring| *ring < 0.5 * top);
    let Some(below) = below else { return 0.0 };
    let (low, high) = (rings[below], rings[below + 1]);
    RING_M * (below as f32 + 0.5 + (0.5 * top - low) / (high - low).max(1e-20))
}
