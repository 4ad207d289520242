//! What a spatial calibration says of itself, for programs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::Matrix4;
use probepath_frames::{Image, Phantom, Pose, Probe, World};
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::RepeatabilityMm;
use probepath_us_capture::errors::Found;
use probepath_us_capture::fit::{Parameter, Uncertainty};
use probepath_us_capture::point_spread::PointSpreadMm;
use probepath_us_capture::spatial::Seen;
use serde::Serialize;

/// A spatial calibration, as `calibrate spatial --json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct Spatial {
    /// The calibration in the words of PLUS.
    pub plus: PlusMatrices,
    /// An image stamped t belongs to the pose at t + lag.
    pub lag_s: f64,
    /// Its standard error; absent when the lag was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_standard_error_s: Option<f64>,
    /// Standard error of a reconstructed point, over the image.
    pub standard_error_mm: OverImage,
    /// How well ten calibrations, each from its share of the images, repeat; absent where a share has too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeatability: Option<RepeatabilityMm>,
    /// Size of a pixel: from column to column, from row to row.
    pub pixel_mm: [f64; 2],
    /// The phantom's name.
    pub phantom: String,
    /// The chain of poses.
    pub poses: String,
    /// On the images that the calibration was made of.
    pub calibration: Section,
    /// On images that it had not seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<Section>,
    /// The labelled dots of the calibration's images.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dots: Option<Vec<ImageDots>>,
    /// How wide the wires show the beam; absent where nobody said what grey levels stand for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_spread: Option<PointSpreadMm>,
    /// Every parameter that was fitted, with its uncertainty.
    pub covariance: Covariance,
    /// Directions that the images hardly determine, and what to do about them.
    pub weak: Vec<String>,
    /// What the reader must know.
    pub notes: Vec<String>,
    /// The stored calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stored: Option<PathBuf>,
    /// The folder of the pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlay: Option<PathBuf>,
}

/// The labelled dots of one image, in the phantom's order of wires: column and row in MF pixels, nothing for a wire
/// that was not seen; nothing at all for an image that was refused.
pub type ImageDots = Option<Vec<Option<[f64; 2]>>>;

/// Matrices as PLUS defines them: 16 numbers row by row that take column vectors, in mm.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "PascalCase")]
pub struct PlusMatrices {
    /// From pixels (column, row, 0, 1) to the probe's system.
    pub image_to_probe: [f64; 16],
    /// From the phantom's system to the reference's, as refined.
    pub phantom_to_reference: [f64; 16],
}

/// A figure over the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OverImage {
    /// Its mean.
    pub mean: f64,
    /// Its 95th percentile.
    pub p95: f64,
}

/// How good the calibration is on one sequence. Errors are distances in the phantom, as FIELD.md section 2 defines
/// them; `None` where there was nothing to measure.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Section {
    /// The sequence.
    pub sequence: PathBuf,
    /// Images in it.
    pub images: usize,
    /// Those whose dots were labelled.
    pub labelled: usize,
    /// Labelled images for whose instant, with the lag, there is no pose: they are not in the errors.
    pub without_pose: usize,
    /// Middle wires: mean of the smallest 95 %.
    pub mid_mean95_mm: Option<f64>,
    /// Middle wires: standard deviation of the smallest 95 %.
    pub mid_sd95_mm: Option<f64>,
    /// Middle wires: root mean square of all.
    pub mid_rms_mm: Option<f64>,
    /// Root mean square distance of every dot from its wire.
    pub line_rms_mm: Option<f64>,
    /// The same errors by depth in the image.
    pub per_depth: Vec<Depth>,
    /// Images that were refused, by the code of the reason.
    pub refused: BTreeMap<String, usize>,
    /// Each of them.
    pub refusals: Vec<RefusedImage>,
    /// The labelled dots of every image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dots: Option<Vec<ImageDots>>,
}

/// The errors in a band of depths.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Depth {
    /// Where the band begins (mm from the first row).
    pub from_mm: f64,
    /// Where it ends.
    pub until_mm: f64,
    /// Dots in it.
    pub dots: usize,
    /// Middle wires: mean of the smallest 95 %.
    pub mid_mean95_mm: Option<f64>,
    /// Root mean square distance of its dots from their wires.
    pub line_rms_mm: Option<f64>,
}

/// An image that was refused.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RefusedImage {
    /// Its number in the file.
    pub image: u64,
    /// The reason, as a code.
    pub code: String,
    /// The reason, in words.
    pub why: String,
}

/// What the fit says of its own uncertainty.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Covariance {
    /// The parameters, in the order of the matrix; the unit is in the name.
    pub parameters: Vec<String>,
    /// Their standard errors.
    pub standard_errors: Vec<f64>,
    /// The covariance, row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// Bands of depth in which errors are summed up (m).
const BAND_M: f64 = 0.01;

impl Section {
    /// What was seen of a sequence's images, and their errors.
    pub(super) fn of(sequence: &Path, seen: &[Seen], found: &Found, with_dots: bool) -> Self {
        let (mid, line) = (found.mid(), found.line());
        let refusals: Vec<RefusedImage> = seen.iter().filter_map(RefusedImage::of).collect();
        let mut refused = BTreeMap::new();
        for refusal in &refusals {
            *refused.entry(refusal.code.clone()).or_default() += 1;
        }
        Self {
            sequence: sequence.into(),
            images: seen.len(),
            labelled: seen.len() - refusals.len(),
            without_pose: found.outside,
            mid_mean95_mm: mm(mid.mean95_m),
            mid_sd95_mm: mm(mid.sd95_m),
            mid_rms_mm: mm(mid.rms_m),
            line_rms_mm: mm(line.rms_m),
            per_depth: found.by_depth(BAND_M).iter().map(|(from_m, band)| Depth::of(*from_m, band)).collect(),
            refused,
            refusals,
            dots: with_dots.then(|| seen.iter().map(dots).collect()),
        }
    }
}

/// The labelled dots of an image.
fn dots(seen: &Seen) -> ImageDots {
    let labels = seen.labels.as_ref().ok()?;
    Some(labels.dots.iter().map(|dot| dot.map(|dot| dot.at_px)).collect())
}

/// Millimetres, where there is a number: of nothing there is no mean, and a phantom of single wires has no middles.
fn mm(metres: f64) -> Option<f64> {
    metres.is_finite().then_some(metres * 1e3)
}

impl RefusedImage {
    fn of(seen: &Seen) -> Option<Self> {
        let reason = seen.labels.as_ref().err()?;
        Some(Self { image: seen.number, code: reason.code().into(), why: reason.to_string() })
    }
}

impl Depth {
    fn of(from_m: f64, found: &Found) -> Self {
        let (mid, line) = (found.mid(), found.line());
        Self {
            from_mm: from_m * 1e3,
            until_mm: (from_m + BAND_M) * 1e3,
            dots: line.count,
            mid_mean95_mm: mm(mid.mean95_m),
            line_rms_mm: mm(line.rms_m),
        }
    }
}

impl Covariance {
    /// Of what was fitted, the units appended to the names.
    pub(super) fn of(uncertainty: &Uncertainty) -> Self {
        let name =
            |p: &Parameter| if p.unit == "1" { p.name.to_owned() } else { format!("{}_{}", p.name, p.unit) };
        let matrix = &uncertainty.covariance;
        Self {
            parameters: uncertainty.parameters.iter().map(name).collect(),
            standard_errors: matrix.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect(),
            matrix: matrix.row_iter().map(|row| row.iter().copied().collect()).collect(),
        }
    }
}

impl PlusMatrices {
    /// Of a pose of the image in the probe and of the phantom in the world.
    pub fn of(
        probe_from_image: &Pose<Probe, Image>,
        spacing: PixelSpacing,
        world_from_phantom: &Pose<World, Phantom>,
    ) -> Self {
        Self {
            image_to_probe: row_major(&image_to_probe(probe_from_image, spacing)),
            phantom_to_reference: row_major(&millimetres(world_from_phantom.isometry().to_homogeneous())),
        }
    }
}

/// PLUS's `ImageToProbe`: columns are the steps of a pixel along both axes, and across the image a step as long as
/// their mean, so that the matrix stays far from singular.
fn image_to_probe(probe_from_image: &Pose<Probe, Image>, spacing: PixelSpacing) -> Matrix4<f64> {
    let across = (spacing.x_m + spacing.y_m) / 2.0;
    let scale = Matrix4::new_nonuniform_scaling(&nalgebra::Vector3::new(spacing.x_m, spacing.y_m, across));
    let mut matrix = probe_from_image.isometry().to_homogeneous() * scale;
    matrix.fixed_view_mut::<3, 4>(0, 0).scale_mut(1e3);
    matrix
}

fn millimetres(mut matrix: Matrix4<f64>) -> Matrix4<f64> {
    matrix.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e3);
    matrix
}

fn row_major(matrix: &Matrix4<f64>) -> [f64; 16] {
    let mut numbers = [0.0; 16];
    numbers.copy_from_slice(matrix.transpose().as_slice());
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector3};
    use probepath_us_capture::PixelMap;

    #[test]
    fn plus_reads_our_matrix_as_the_same_pixels() {
        // FRAMES: any pose will do; the reader of PLUS's matrices is the judge.
        let pose =
            Pose::assume(Isometry3::new(Vector3::new(0.01, -0.02, 0.03), Vector3::new(0.3, -1.1, 2.0)));
        let spacing = PixelSpacing { x_m: 7.8e-5, y_m: 7.4e-5 };
        // FRAMES: as above.
        let place = Pose::assume(Isometry3::translation(0.1, 0.2, 0.3));
        let plus = PlusMatrices::of(&pose, spacing, &place);
        let matrix = Matrix4::from_row_slice(&plus.image_to_probe);
        let map = PixelMap::<Probe>::from_matrix_mm(&matrix).unwrap();
        for (u, v) in [(0.0, 0.0), (819.0, 0.0), (0.0, 615.0), (400.5, 300.25)] {
            assert!(map.at(u, v).distance(&(pose * spacing.point(u, v))) < 1e-12);
        }
        assert!((matrix.fixed_view::<3, 1>(0, 2).norm() - 0.076).abs() < 1e-9);
        assert!((plus.phantom_to_reference[11] - 300.0).abs() < 1e-9);
    }
}
