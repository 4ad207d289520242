//! The pixel size, when nobody knows it: the one with which the phantom explains a few images best.

use super::{LabelOptions, Labeller, Labels, Refusal};
use crate::PixelSpacing;
use crate::dots::Dot;
use crate::phantom::WirePhantom;

/// Pixels of echographs: from a high-frequency array, zoomed, to an abdominal one over its whole depth (m).
const SMALLEST_M: f64 = 30e-6;
const LARGEST_M: f64 = 400e-6;
/// From one size to the next that is tried: within what the labeller bridges by itself.
const STEP: f64 = 1.05;
/// Images that are tried: those with as many dots as the phantom has wires, or nearly.
const IMAGES: usize = 8;

/// The pixel size of images of a phantom, from their dots alone; both axes by themselves.
///
/// A phantom of one spacing throughout can be explained by pixels of half or double their size: then the size that
/// explains the most wires is returned.
///
/// # Errors
/// When no image is explained by any size from 0.03 to 0.4 mm, as the likeliest image is refused.
pub fn find_spacing(
    phantom: &WirePhantom,
    images: &[Vec<Dot>],
    options: LabelOptions,
) -> Result<PixelSpacing, Refusal> {
    let labeller = Labeller::new(phantom, options);
    let mut tried: Vec<&Vec<Dot>> = images.iter().collect();
    tried.sort_by_key(|dots| dots.len().abs_diff(phantom.wires.len()));
    tried.truncate(IMAGES);
    let Some(likeliest) = tried.first() else { return Err(Refusal::NoDots) };
    let steps = ((LARGEST_M / SMALLEST_M).ln() / STEP.ln()).ceil() as i32;
    let sized = (0..=steps).map(|k| SMALLEST_M * STEP.powi(k)).map(|m| PixelSpacing { x_m: m, y_m: m });
    let judged = sized.map(|spacing| (spacing, explained(&labeller, &tried, spacing)));
    let worth = |found: &[Labels]| found.iter().map(|l| l.score).sum::<f64>();
    let best = judged.max_by(|a, b| worth(&a.1).total_cmp(&worth(&b.1)));
    match best {
        Some((spacing, found)) if !found.is_empty() => Ok(rescaled(spacing, &found)),
        _ => Err(labeller
            .candidates(likeliest, PixelSpacing { x_m: 1e-4, y_m: 1e-4 })
            .err()
            .unwrap_or(Refusal::NoDots)),
    }
}

fn explained(labeller: &Labeller, images: &[&Vec<Dot>], spacing: PixelSpacing) -> Vec<Labels> {
    let best = |dots: &&Vec<Dot>| Some(labeller.candidates(dots, spacing).ok()?.swap_remove(0));
    images.iter().filter_map(best).collect()
}

/// The size with what the dots say of it by themselves: the median over the images.
fn rescaled(spacing: PixelSpacing, found: &[Labels]) -> PixelSpacing {
    let median = |axis: usize| {
        let mut scales: Vec<f64> = found.iter().map(|l| l.scale[axis]).collect();
        scales.sort_by(f64::total_cmp);
        scales.get(scales.len() / 2).copied().unwrap_or(1.0)
    };
    PixelSpacing { x_m: spacing.x_m * median(0), y_m: spacing.y_m * median(1) }
}
