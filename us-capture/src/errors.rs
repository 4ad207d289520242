//! How good a calibration is, in the field's own measures.
//!
//! ```no_run
//! # use probepath_us_capture::{errors::Chain, fit::{Fit, Sighting}, phantom::WirePhantom};
//! # use probepath_frames::{Probe, Track, World};
//! # fn run(phantom: &WirePhantom, held_out: &[Sighting], track: &Track<World, Probe>, fit: &Fit) {
//! let found = Chain::of(phantom, track, fit).judge(held_out);
//! println!("mid {:.3} mm, lines {:.3} mm", found.mid().mean95_m * 1e3, found.line().rms_m * 1e3);
//! # }
//! ```
//!
//! FIELD.md, section 2, defines them. **mid**: for each Z, the ratio of its dots in pixels gives the middle wire's
//! point on the line between the crossings of the middle wire with the sides; the error is the distance of the
//! reconstructed middle dot from it, in 3D. PLUS prints the mean and the standard deviation of the smallest 95 %.
//! **line**: the distance of every reconstructed dot from its wire. **C_rms**: how well the points of one target come
//! together ([P1] section II.B, with the root where it belongs).
//!
//! What it does not do: fit. Ask it about images that the fit has not seen.

mod repeat;

#[cfg(test)]
mod tests;

use probepath_frames::{Phantom, Point, Pose, Probe, Span, Track, World};

use crate::PixelMap;
use crate::fit::{Fit, SeenWire, Sighting, middle_point};
use crate::phantom::{Wire, WirePhantom};
pub use repeat::{Repeatability, c_rms};

/// The chain from pixels to the phantom ([P1] eq. 1), with the lag.
#[derive(Clone, Copy, Debug)]
pub struct Chain<'a> {
    /// The phantom.
    pub phantom: &'a WirePhantom,
    /// The probe's poses.
    pub track: &'a Track<World, Probe>,
    /// Where the phantom stands.
    pub world_from_phantom: Pose<World, Phantom>,
    /// An image stamped t belongs to the pose at t + lag.
    pub lag: Span,
    /// Where pixels lie in the probe; affine, so that a calibration of PLUS can be judged as it is.
    pub pixels: PixelMap<Probe>,
}

/// One dot's error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DotError {
    /// The image.
    pub image: usize,
    /// The wire; of a Z its middle one.
    pub wire: usize,
    /// The distance (m).
    pub error_m: f64,
    /// How deep in the image the dot lies: rows from the first, as a length (m).
    pub depth_m: f64,
}

/// The errors of some images.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Of every Z seen whole.
    pub mids: Vec<DotError>,
    /// Of every dot.
    pub lines: Vec<DotError>,
    /// Images that the track does not cover; they have no errors.
    pub outside: usize,
}

/// What errors come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// How many.
    pub count: usize,
    /// Mean of the smallest 95 % (m).
    pub mean95_m: f64,
    /// Standard deviation of the smallest 95 % (m).
    pub sd95_m: f64,
    /// Root mean square of all (m).
    pub rms_m: f64,
    /// The largest (m).
    pub worst_m: f64,
}

impl<'a> Chain<'a> {
    /// The chain that a fit found.
    pub fn of(phantom: &'a WirePhantom, track: &'a Track<World, Probe>, fit: &Fit) -> Self {
        let (world_from_phantom, lag) = (fit.world_from_phantom, fit.lag);
        Self { phantom, track, world_from_phantom, lag, pixels: fit.pixels() }
    }

    /// Where an image's pixels lie in the phantom; `None` when the track does not cover it.
    pub fn placed(&self, sighting: &Sighting) -> Option<PixelMap<Phantom>> {
        let world_from_probe = self.track.at(sighting.stamp + self.lag).ok()?;
        Some(self.pixels.placed(&(self.world_from_phantom.inverse() * world_from_probe)))
    }

    /// The errors of these images.
    pub fn judge(&self, sightings: &[Sighting]) -> Found {
        let mut found = Found::default();
        for sighting in sightings {
            match self.placed(sighting) {
                Some(pixels) => self.judge_one(sighting, &pixels, &mut found),
                None => found.outside += 1,
            }
        }
        found
    }

    fn judge_one(&self, sighting: &Sighting, pixels: &PixelMap<Phantom>, found: &mut Found) {
        let error = |wire: usize, at: [f64; 2], error_m: f64| {
            let depth_m = at[1] * pixels.row_step().norm();
            DotError { image: sighting.image, wire, error_m, depth_m }
        };
        for SeenWire { wire, at_px, .. } in sighting.dots.iter().copied() {
            let Some(line) = self.phantom.wires.get(wire) else { continue };
            let off = from_line(line, &pixels.at(at_px[0], at_px[1]));
            found.lines.push(error(wire, at_px, off));
        }
        for z in &self.phantom.zs {
            let Some((at, expected)) = middle_point(self.phantom, z, sighting) else { continue };
            found.mids.push(error(z.diagonal, at, pixels.at(at[0], at[1]).distance(&expected)));
        }
    }
}

/// Distance of a point from a wire's line (m).
fn from_line(wire: &Wire, point: &Point<Phantom>) -> f64 {
    let along = wire.run().normalize();
    (point.vector() - wire.front.vector()).cross(&along).norm()
}

impl Found {
    /// The mid errors' summary.
    pub fn mid(&self) -> Summary {
        Summary::of(self.mids.iter().map(|e| e.error_m))
    }

    /// The line errors' summary.
    pub fn line(&self) -> Summary {
        Summary::of(self.lines.iter().map(|e| e.error_m))
    }

    /// The same errors by depth: bands of `band_m`, each with where it begins; empty bands are left out.
    pub fn by_depth(&self, band_m: f64) -> Vec<(f64, Found)> {
        let band = |error: &DotError| (error.depth_m / band_m).floor() as i64;
        let mut bands: Vec<i64> = self.lines.iter().map(band).collect();
        bands.sort_unstable();
        bands.dedup();
        let within = |errors: &[DotError], k: i64| errors.iter().filter(|e| band(e) == k).copied().collect();
        bands
            .into_iter()
            .map(|k| {
                let found = Found { mids: within(&self.mids, k), lines: within(&self.lines, k), outside: 0 };
                (k as f64 * band_m, found)
            })
            .collect()
    }

    /// The errors of one wire.
    pub fn of_wire(&self, wire: usize) -> Found {
        let within = |errors: &[DotError]| errors.iter().filter(|e| e.wire == wire).copied().collect();
        Found { mids: within(&self.mids), lines: within(&self.lines), outside: self.outside }
    }
}

impl Summary {
    /// Of any errors (m). Of none, every number is NaN but the count.
    pub fn of(errors_m: impl IntoIterator<Item = f64>) -> Self {
        let mut errors: Vec<f64> = errors_m.into_iter().collect();
        errors.sort_unstable_by(f64::total_cmp);
        // As PLUS counts them: rounded to the nearest.
        let best = errors.get(..(errors.len() * 95 + 50) / 100).unwrap_or_default();
        let count = best.len() as f64;
        let mean = best.iter().sum::<f64>() / count;
        let scatter: f64 = best.iter().map(|e| (e - mean) * (e - mean)).sum();
        let square: f64 = errors.iter().map(|e| e * e).sum();
        Self {
            count: errors.len(),
            mean95_m: mean,
            sd95_m: (scatter / count).sqrt(),
            rms_m: (square / errors.len() as f64).sqrt(),
            worst_m: errors.last().copied().unwrap_or(f64::NAN),
        }
    }
}
