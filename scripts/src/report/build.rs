//! From a reconstruction to a report: numbers gathered, pictures drawn, files written into one folder.

use std::path::{Path, PathBuf};

use probepath_recon::{LumenReconstruction, Mesh, MeshError, Stenosis};
use probepath_us_capture::PlacedBScan;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::html::{self, Pictures, Surface};
use super::picture::Picture;
use super::surface_picture::{self, Camera, SurfaceView};
use super::{
    AreaPoint, ForceFigures, Heading, ImageCounts, PathFigures, Report, SegmentRow, StenosisRow,
    SurfaceError, grade,
};

/// A named part of the artery, in distances along the reconstructed centreline (m).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// CFA, SFA proximal, …
    pub name: String,
    /// Where it begins (m).
    pub from_m: f64,
    /// Where it ends (m).
    pub until_m: f64,
}

/// What the scan itself has to say, kept in the exam so that a report can be made again from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanFigures {
    /// How the force was held.
    pub force_n: ForceFigures,
    /// How well the path was kept.
    pub path: PathFigures,
    /// B-scans that were lost or left out for a fault.
    pub dropped: usize,
    /// Speed along the path (mm/s).
    pub speed_mm_s: f64,
    /// From the exam's beginning to the end of the scan (s).
    pub duration_s: f64,
    /// What the reader must know.
    pub warnings: Vec<String>,
}

/// Everything a report is made of.
pub struct Ingredients<'a> {
    /// Who, what, how.
    pub heading: Heading,
    /// What the scan has to say.
    pub figures: &'a ScanFigures,
    /// The lumen.
    pub recon: &'a LumenReconstruction,
    /// The B-scans it was found in, in the same order.
    pub images: &'a [PlacedBScan],
    /// The artery's named parts.
    pub segments: &'a [Segment],
    /// Distance to the truth, where a simulation knows it.
    pub surface_error: Option<SurfaceError>,
    /// The exam file.
    pub exam: &'a Path,
}

/// Why a report could not be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A surface cannot be written.
    #[error(transparent)]
    Surface(#[from] MeshError),
    /// A picture cannot be drawn.
    #[error("a picture cannot be drawn: {0}")]
    Picture(#[from] png::EncodingError),
    /// The numbers cannot be written as JSON.
    #[error("the numbers cannot be written: {0}")]
    Json(#[from] serde_json::Error),
}

/// Names, with the column and row where each is written.
type Labels = Vec<(String, (f64, f64))>;

/// Size of the surface's picture.
const SURFACE_PIXELS: (usize, usize) = (1680, 420);
/// At most so many B-scans in a report.
const MOST_BSCANS: usize = 6;

/// Writes `lumen.stl`, `.ply`, `.vtp`, `lumen.png`, `report.html` and `report.json` into `folder`.
///
/// # Errors
/// When a file cannot be written or a picture not be drawn.
pub fn make(from: &Ingredients<'_>, folder: &Path) -> Result<Report, ReportError> {
    let mesh = from.recon.surface.mesh();
    let surfaces = save_surfaces(&mesh, folder)?;
    let page = folder.join("report.html");
    let report = numbers(from, &surfaces, &page);
    let pictures = pictures(from, &mesh, &folder.join("lumen.png"))?;
    write(&page, html::page(&report, &pictures).as_bytes())?;
    write(&folder.join("report.json"), &serde_json::to_vec_pretty(&report)?)?;
    Ok(report)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    std::fs::write(path, bytes).map_err(|source| ReportError::File { path: path.into(), source })
}

fn save_surfaces(mesh: &Mesh, folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let save = |name: &str| -> Result<PathBuf, ReportError> {
        let path = folder.join(name);
        mesh.write(&path)?;
        Ok(path)
    };
    ["lumen.stl", "lumen.ply", "lumen.vtp"].into_iter().map(save).collect()
}

fn numbers(from: &Ingredients<'_>, surfaces: &[PathBuf], page: &Path) -> Report {
    let (recon, figures) = (from.recon, from.figures);
    let mut warnings = figures.warnings.clone();
    warnings.extend(recon.warnings.iter().map(ToString::to_string));
    Report {
        exam_of: from.heading.clone(),
        surface_error_mm: from.surface_error,
        stenoses: recon.stenoses.iter().enumerate().map(|(i, s)| stenosis_row(i, s, from.segments)).collect(),
        segments: from.segments.iter().filter_map(|s| segment_row(s, recon)).collect(),
        area_curve: area_curve(recon),
        force_n: figures.force_n,
        images: ImageCounts {
            kept: from.images.len(),
            dropped: figures.dropped,
            without_lumen: recon.counts.without_lumen,
        },
        path: figures.path,
        duration_s: figures.duration_s,
        exam: from.exam.display().to_string(),
        report: page.display().to_string(),
        surfaces: surfaces.iter().map(|path| path.display().to_string()).collect(),
        warnings,
    }
}

fn stenosis_row(index: usize, found: &Stenosis, segments: &[Segment]) -> StenosisRow {
    let at_m = found.at_mm * 1e-3;
    let segment = segments.iter().find(|s| (s.from_m..s.until_m).contains(&at_m));
    StenosisRow {
        name: format!("S{}", index + 1),
        segment: segment.map(|s| s.name.clone()).unwrap_or_default(),
        percent_area: found.percent_area,
        percent_area_sd: found.percent_area_sd,
        percent_area_interval: found.percent_area_interval,
        percent_diameter: found.percent_diameter,
        percent_diameter_interval: found.percent_diameter_interval,
        grade: grade(found.percent_diameter).into(),
        at_mm: found.at_mm,
        at_interval_mm: found.at_interval_mm,
        length_mm: found.length_mm,
        length_interval_mm: found.length_interval_mm,
        cut_off: found.cut_off,
        min_area_mm2: found.min_area_mm2,
        min_area_interval_mm2: found.min_area_interval_mm2,
        min_diameter_mm: found.min_diameter_mm,
        min_diameter_interval_mm: found.min_diameter_interval_mm,
        min_inscribed_diameter_mm: found.minimal_inscribed_diameter_mm,
        asymmetry: found.asymmetry,
        reference_area_mm2: found.reference_area_mm2,
        reference: found.reference.to_string(),
    }
}

/// What was measured in a segment; none where nothing was.
fn segment_row(segment: &Segment, recon: &LumenReconstruction) -> Option<SegmentRow> {
    let (from, until) = (segment.from_m * 1e3, segment.until_m * 1e3);
    let inside = |at: f64| (from..until).contains(&at);
    let areas: Vec<f64> = recon
        .sections
        .iter()
        .filter(|section| inside(section.at_mm))
        .filter_map(|section| Some(section.measure.as_ref()?.area_mm2))
        .collect();
    if areas.is_empty() {
        return None;
    }
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    let diameters = areas.iter().map(|area| 2.0 * (area / std::f64::consts::PI).sqrt()).sum::<f64>();
    let worst = recon.stenoses.iter().filter(|s| inside(s.at_mm)).map(|s| s.percent_area);
    Some(SegmentRow {
        name: segment.name.clone(),
        from_mm: from,
        until_mm: until.min(recon.centreline.length_m() * 1e3),
        mean_area_mm2: mean,
        min_area_mm2: areas.iter().copied().fold(f64::INFINITY, f64::min),
        mean_diameter_mm: diameters / areas.len() as f64,
        worst_percent_area: worst.reduce(f64::max),
    })
}

fn area_curve(recon: &LumenReconstruction) -> Vec<AreaPoint> {
    let point = |section: &probepath_recon::Section| AreaPoint {
        at_mm: section.at_mm,
        area_mm2: section.measure.as_ref().map(|m| m.area_mm2),
        area_interval_mm2: section.measure.as_ref().map(|m| m.area_interval_mm2),
    };
    recon.sections.iter().map(point).collect()
}

/// The surface and the B-scans at the stenoses; the surface is also left as a file of its own.
fn pictures(lumen: &Ingredients<'_>, mesh: &Mesh, file: &Path) -> Result<Pictures, ReportError> {
    let mut pictures = Pictures::default();
    if let Some((surface, labels)) = surface_picture(lumen, mesh) {
        write(file, &surface.png()?)?;
        pictures.surface = Some(Surface { uri: surface.data_uri()?, size: SURFACE_PIXELS, labels });
    }
    for (caption, image, contour) in chosen(lumen) {
        pictures.bscans.push((caption, super::bscan_picture::draw(&image.bscan, contour).data_uri()?));
    }
    Ok(pictures)
}

/// The picture, and the stenoses' names with their places on it.
fn surface_picture(lumen: &Ingredients<'_>, mesh: &Mesh) -> Option<(Picture, Labels)> {
    let (width, height) = SURFACE_PIXELS;
    let recon = lumen.recon;
    let reference = reference_area(recon)?;
    let vertices_mm: Vec<[f64; 3]> = mesh.points.iter().map(|p| (p * 1e3).into()).collect();
    let narrowing: Vec<f64> =
        mesh.points.iter().map(|p| (1.0 - area_near(recon, p) / reference).clamp(0.0, 1.0)).collect();
    let view = SurfaceView { vertices_mm: &vertices_mm, triangles: &mesh.triangles, narrowing: &narrowing };
    let camera = Camera::facing(view.vertices_mm, width, height)?;
    let mut picture = surface_picture::render(&view, &camera, width, height);
    let mut labels = Vec::new();
    for (index, stenosis) in recon.stenoses.iter().enumerate() {
        let at = recon.centreline.at(stenosis.at_mm * 1e-3)?.point.vector() * 1e3;
        let (x, y, _) = camera.project(at.into());
        labels.push((format!("S{}", index + 1), (x, y - 82.0)));
        for (from, until) in [((x, y - 74.0), (x, y - 34.0)), ((x, y + 34.0), (x, y + 74.0))] {
            picture.line(from, until, [106, 27, 154]);
            picture.line((from.0 + 1.0, from.1), (until.0 + 1.0, until.1), [106, 27, 154]);
        }
    }
    Some((picture, labels))
}

/// The median area stands for the open lumen.
fn reference_area(recon: &LumenReconstruction) -> Option<f64> {
    let mut areas: Vec<f64> =
        recon.sections.iter().filter_map(|s| Some(s.measure.as_ref()?.area_mm2)).collect();
    areas.sort_by(f64::total_cmp);
    areas.get(areas.len() / 2).copied()
}

fn area_near(recon: &LumenReconstruction, vertex: &nalgebra::Vector3<f64>) -> f64 {
    recon
        .sections
        .iter()
        .filter_map(|s| Some(((s.centre.vector() - vertex).norm_squared(), s.measure.as_ref()?.area_mm2)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(0.0, |(_, area)| area)
}

/// The contour in a B-scan's pixels (column, row), where a lumen was seen.
type Contour<'a> = Option<&'a [(f64, f64)]>;
/// What a B-scan shows, the B-scan, and its contour.
type Chosen<'a> = (String, &'a PlacedBScan, Contour<'a>);

/// The B-scan nearest to each stenosis and, before them, one of open lumen.
fn chosen<'a>(lumen: &Ingredients<'a>) -> Vec<Chosen<'a>> {
    let recon = lumen.recon;
    let mut wanted: Vec<(String, f64)> = recon
        .stenoses
        .iter()
        .enumerate()
        .map(|(i, s)| {
            (format!("S{}: {:.0} % of the area lost, at {:.0} mm", i + 1, s.percent_area, s.at_mm), s.at_mm)
        })
        .collect();
    if let Some(open) = recon.sections.get(recon.sections.len() / 20) {
        wanted.insert(0, (format!("Near the proximal end, at {:.0} mm", open.at_mm), open.at_mm));
    }
    wanted.truncate(MOST_BSCANS);
    wanted
        .into_iter()
        .filter_map(|(caption, at_mm)| nearest(lumen, at_mm).map(|(i, c)| (caption, i, c)))
        .collect()
}

fn nearest<'a>(lumen: &Ingredients<'a>, at_mm: f64) -> Option<(&'a PlacedBScan, Contour<'a>)> {
    let place = lumen.recon.centreline.at(at_mm * 1e-3)?.point;
    lumen
        .recon
        .images
        .iter()
        .zip(lumen.images)
        .filter_map(|(found, image)| Some((found.lumen.as_ref().ok()?, image)))
        .min_by(|a, b| a.0.centre.distance(&place).total_cmp(&b.0.centre.distance(&place)))
        .map(|(contour, image)| (image, Some(contour.pixels.as_slice())))
}
