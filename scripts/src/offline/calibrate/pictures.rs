//! The pictures of `--overlay`: one of every image of a sequence.

use std::path::Path;

use nalgebra::Vector3;
use probepath_frames::{Image, Phantom, Pose, Stamp};
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::fit::Fit;
use probepath_us_capture::phantom::{Wire, WirePhantom};
use probepath_us_capture::shots::{Shot, Shots};
use probepath_us_capture::spatial::Seen as SeenImage;

use super::overlay::Seen;
use super::wishes::Region;
use super::{CalibrateError, error_map};
use crate::report::picture::Picture;

/// A calibration, as far as pictures need it.
pub(super) struct Album<'a> {
    pub phantom: &'a WirePhantom,
    /// None when no calibration was found: what was seen is drawn all the same.
    pub fit: Option<&'a Fit>,
    pub region: Option<Region>,
}

impl Album<'_> {
    /// Writes a picture of every image, `NAME-0012.png`, into `folder`.
    ///
    /// # Errors
    /// When the folder or a picture cannot be written.
    pub(super) fn write(
        &self,
        folder: &Path,
        name: &str,
        shots: &Shots,
        seen: &[SeenImage],
    ) -> Result<(), CalibrateError> {
        std::fs::create_dir_all(folder)
            .map_err(|source| CalibrateError::Write { path: folder.into(), source })?;
        for (shot, seen) in shots.shots().iter().zip(seen) {
            let Ok(pixels) = &shot.pixels else { continue };
            let path = folder.join(format!("{name}-{:04}.png", shot.number));
            save(&path, &self.one(name, shots, shot, pixels, seen).draw())?;
        }
        Ok(())
    }

    /// Writes the map of the standard error, `standard-error.png`, into `folder`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn write_error(&self, folder: &Path, size: (usize, usize)) -> Result<(), CalibrateError> {
        let Some(fit) = self.fit else { return Ok(()) };
        let map = fit.uncertainty.standard_error_map(size.0, size.1);
        save(&folder.join("standard-error.png"), &error_map::draw(&map, size, fit.spacing))
    }

    fn one<'a>(
        &'a self,
        name: &str,
        shots: &Shots,
        shot: &Shot,
        pixels: &'a [u8],
        seen: &'a SeenImage,
    ) -> Seen<'a> {
        let labels = seen.labels.as_ref().ok();
        let dot = |wire: usize| labels.and_then(|labels| labels.dots.get(wire).copied().flatten());
        let wires = self.phantom.wires.iter().enumerate();
        Seen {
            size: shots.size(),
            pixels,
            region: self.region,
            dots: &seen.dots,
            wires: wires.map(|(nth, wire)| (wire.name.as_str(), dot(nth))).collect(),
            expected: self.expected(shots, shot.stamp),
            said: said(name, shot.number, seen, labels.map(|labels| labels.rms_m)),
            refused: seen.labels.as_ref().err().map(ToString::to_string),
        }
    }

    /// Where the calibration expects every wire at an instant.
    fn expected(&self, shots: &Shots, stamp: Stamp) -> Vec<Option<[f64; 2]>> {
        let Some(fit) = self.fit else { return Vec::new() };
        let Ok(world_from_probe) = shots.track().at(stamp + fit.lag) else { return Vec::new() };
        let phantom_from_image = fit.world_from_phantom.inverse() * world_from_probe * fit.probe_from_image;
        self.phantom.wires.iter().map(|wire| crossing(wire, &phantom_from_image, fit.spacing)).collect()
    }
}

fn save(path: &Path, picture: &Picture) -> Result<(), CalibrateError> {
    let bytes = picture.png().map_err(|source| CalibrateError::Picture { path: path.into(), source })?;
    std::fs::write(path, bytes).map_err(|source| CalibrateError::Write { path: path.into(), source })
}

fn said(name: &str, number: u64, seen: &SeenImage, rms_m: Option<f64>) -> String {
    let labels = seen.labels.as_ref().map_or(0, |labels| labels.dots.iter().flatten().count());
    let rms = rms_m.map_or_else(String::new, |m| format!(", {:.2} mm from their wires", m * 1e3));
    format!("{name} image {number}: {} dots found, {labels} of wires{rms}", seen.dots.len())
}

/// Where a wire crosses the image's plane (column, row); `None` when it does not.
fn crossing(
    wire: &Wire,
    phantom_from_image: &Pose<Phantom, Image>,
    spacing: PixelSpacing,
) -> Option<[f64; 2]> {
    let image_from_phantom = phantom_from_image.inverse();
    let [front, back]: [Vector3<f64>; 2] =
        [wire.front, wire.back].map(|end| (image_from_phantom * end).vector());
    let part = front.z / (front.z - back.z);
    let at = front + (back - front) * part;
    (0.0..=1.0).contains(&part).then(|| [at.x / spacing.x_m, at.y / spacing.y_m])
}
