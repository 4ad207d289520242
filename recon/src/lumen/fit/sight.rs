//! Where a wall is seen: directions that a shadow hides, or that open into another vessel, say nothing of the border.

use super::lattice::{BINS, Lattice};

/// Directions that are judged apart.
const SECTORS: usize = 24;
const BINS_A_SECTOR: usize = BINS / SECTORS;
/// Distances that are averaged over (m), and how far out a wall is looked for.
const RING_M: f32 = 0.3e-3;
const RINGS: usize = 14;

/// How well the wall is seen in every direction.
pub(super) struct Sight {
    /// 0 where there is none, 1 where it is plain.
    pub(super) trust: [f32; BINS],
    /// Part of the circumference where it is seen.
    pub(super) walled: f64,
}

impl Sight {
    /// Looks for a wall outward of `inside` (m, by direction), which lies within the lumen.
    pub(super) fn new(lattice: &Lattice, inside: &[f32; BINS]) -> Self {
        let (peaks, lumen) = peaks(lattice, inside);
        let decibel: [f32; SECTORS] = std::array::from_fn(|sector| {
            let near = |by: usize| peaks[(sector + SECTORS + by - 1) % SECTORS];
            let mean = 0.25 * near(0) + 0.5 * near(1) + 0.25 * near(2);
            10.0 * (mean / lumen).max(1e-6).log10()
        });
        // The brightest of a dozen rings is some 4 dB above the mean by speckle alone.
        let trust = |bin: usize| ((decibel[bin / BINS_A_SECTOR] - 7.0) / 5.0).clamp(0.02, 1.0);
        let seen = decibel.iter().filter(|&&db| db > 9.0).count();
        Self { trust: std::array::from_fn(trust), walled: seen as f64 / SECTORS as f64 }
    }
}

/// The brightest ring outward of the lumen in every sector, and the mean inside.
fn peaks(lattice: &Lattice, inside: &[f32; BINS]) -> ([f32; SECTORS], f32) {
    let mut rings = [[(0.0_f32, 0.0_f32); RINGS]; SECTORS];
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
        if let Some(ring) = rings[bin / BINS_A_SECTOR].get_mut((out / RING_M) as usize) {
            *ring = (ring.0 + power, ring.1 + 1.0);
        }
    }
    let brightest = |rings: &[(f32, f32); RINGS]| {
        rings.iter().filter(|ring| ring.1 > 0.0).map(|ring| ring.0 / ring.1).fold(0.0, f32::max)
    };
    (std::array::from_fn(|sector| brightest(&rings[sector])), dark / count)
}
