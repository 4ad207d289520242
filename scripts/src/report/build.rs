//! From a reconstruction to a report: numbers gathered, pictures drawn, files written into one folder.

use std::path::{Path, PathBuf};

use probepath_frames::{Point, World};
use probepath_recon::{LumenReconstruction, Mesh, MeshError, Section, Stenosis, measures};
use probepath_us_capture::PlacedBScan;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::dicom::{Date, DicomError, Finding, Study, encapsulated_stl, structured_report};

use super::html::{self, Pictures};
use super::picture::{self, Picture};
use super::pictures;
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
    /// A DICOM file cannot be made.
    #[error(transparent)]
    Dicom(#[from] DicomError),
    /// The numbers cannot be written as JSON.
    #[error("the numbers cannot be written: {0}")]
    Json(#[from] serde_json::Error),
}

/// The curve as a picture has so many pixels for each unit of the drawing.
const FINE: f64 = 2.0;

/// Writes into `folder`: `lumen.stl`, `.ply` and `.vtp`; `report.html` and `report.json`; the pictures as `lumen.png`,
/// `area-curve.png` and `bscan-1.png` …; `lumen-stl.dcm` and `report-sr.dcm`.
///
/// # Errors
/// When a file cannot be written or a picture not be drawn.
pub fn make(from: &Ingredients<'_>, folder: &Path) -> Result<Report, ReportError> {
    let mesh = from.recon.closed_surface();
    let surfaces = save_surfaces(&mesh, folder)?;
    let page = folder.join("report.html");
    let mut report = numbers(from, &surfaces, &page);
    let pictures = pictures(from, &mesh, &mut report, folder)?;
    dicom(from, &mesh, &mut report, folder)?;
    write(&page, html::page(&report, &pictures).as_bytes())?;
    write(&folder.join("report.json"), &serde_json::to_vec_pretty(&report)?)?;
    Ok(report)
}

/// The surface and the measures as DICOM. An exam whose day nobody knows has no structured report: it needs one.
fn dicom(from: &Ingredients<'_>, mesh: &Mesh, report: &mut Report, folder: &Path) -> Result<(), ReportError> {
    let of = &from.heading;
    let day = of.date.as_deref().and_then(Date::of_day).or_else(|| Date::of_file(from.exam));
    let study = Study::of(&of.study, &of.side, day, from.images);
    let (stl, sr) = (folder.join("lumen-stl.dcm"), folder.join("report-sr.dcm"));
    encapsulated_stl(mesh, &study, &stl)?;
    report.dicom.push(stl.display().to_string());
    let found = report.stenoses.iter().map(|row| Finding {
        stenosis: row.clone(),
        place_mm: from.recon.centreline.at(row.at_mm * 1e-3).map(|at| (at.point.vector() * 1e3).into()),
    });
    match structured_report(&found.collect::<Vec<_>>(), &report.warnings, &study, &sr) {
        Ok(()) => report.dicom.push(sr.display().to_string()),
        Err(DicomError::NoDate) => report.warnings.push(DicomError::NoDate.to_string()),
        Err(other) => return Err(other.into()),
    }
    Ok(())
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
        stenoses: recon.stenoses.iter().enumerate().map(|(i, s)| stenosis_row(i, s, from)).collect(),
        segments: segment_rows(from.segments, recon),
        area_curve: area_points(recon),
        mean_force_n: mean_force_n(from, 0.0..f64::INFINITY),
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
        pictures: Vec::new(),
        dicom: Vec::new(),
        warnings,
    }
}

fn stenosis_row(index: usize, found: &Stenosis, from: &Ingredients<'_>) -> StenosisRow {
    let at_m = found.at_mm * 1e-3;
    let segment = from.segments.iter().find(|s| (s.from_m..s.until_m).contains(&at_m));
    StenosisRow {
        name: format!("S{}", index + 1),
        segment: segment.map(|s| s.name.clone()).unwrap_or_default(),
        percent_area: found.percent_area,
        percent_area_sd: found.percent_area_sd,
        percent_area_interval: found.percent_area_interval,
        percent_diameter: found.percent_diameter,
        percent_diameter_interval: found.percent_diameter_interval,
        grade: grade(found.percent_diameter).into(),
        from_mm: found.from_mm,
        force_n: mean_force_n(from, found.from_mm..found.from_mm + found.length_mm),
        at_mm: found.at_mm,
        at_interval_mm: found.at_interval_mm,
        length_mm: found.length_mm,
        length_interval_mm: found.length_interval_mm,
        cut_off: found.cut_off,
        unseen_mm: found.unseen_mm,
        may_be_narrower: found.may_be_narrower,
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

/// Mean of what the probe pressed with while the vessel was seen between two places (mm along it).
fn mean_force_n(from: &Ingredients<'_>, along_mm: std::ops::Range<f64>) -> Option<f64> {
    let sections = &from.recon.sections;
    let near = |place: &Point<World>| {
        let apart = |s: &Section| s.centre.distance(place);
        sections.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).map(|section| section.at_mm)
    };
    let seen = from.recon.images.iter().zip(from.images);
    let pressed = seen.filter_map(|(found, image)| {
        let at = near(&found.lumen.as_ref().ok()?.centre)?;
        along_mm.contains(&at).then_some(-image.wrench.as_ref()?.force.z)
    });
    let forces: Vec<f64> = pressed.collect();
    (!forces.is_empty()).then(|| forces.iter().sum::<f64>() / forces.len() as f64)
}

/// What was measured in each segment; none where nothing was.
fn segment_rows(segments: &[Segment], recon: &LumenReconstruction) -> Vec<SegmentRow> {
    let named = |s: &Segment| measures::Segment {
        name: s.name.clone(),
        from_mm: s.from_m * 1e3,
        until_mm: s.until_m * 1e3,
    };
    let named: Vec<measures::Segment> = segments.iter().map(named).collect();
    let found = measures::segment_measures(&named, &recon.sections, &recon.stenoses);
    found.into_iter().map(segment_row).collect()
}

fn segment_row(found: measures::SegmentMeasure) -> SegmentRow {
    SegmentRow {
        name: found.segment.name,
        from_mm: found.segment.from_mm,
        until_mm: found.segment.until_mm,
        measured_mm: found.measured_mm,
        mean_area_mm2: found.mean_area_mm2,
        mean_area_interval_mm2: found.mean_area_interval_mm2,
        min_area_mm2: found.min_area_mm2,
        min_area_interval_mm2: found.min_area_interval_mm2,
        mean_diameter_mm: found.mean_diameter_mm,
        min_diameter_mm: found.min_diameter_mm,
        mean_force_n: found.mean_force_n,
        worst_percent_area: found.worst.map(|stenosis| stenosis.percent_area),
    }
}

pub(super) fn area_points(recon: &LumenReconstruction) -> Vec<AreaPoint> {
    let point = |section: &Section| AreaPoint {
        at_mm: section.at_mm,
        area_mm2: section.measure.as_ref().map(|m| m.area_mm2),
        area_interval_mm2: section.measure.as_ref().map(|m| m.area_interval_mm2),
        force_n: section.force_n,
    };
    recon.sections.iter().map(point).collect()
}

/// Draws the pictures, leaves each as a file, and gives what the page holds of them.
fn pictures(
    from: &Ingredients<'_>,
    mesh: &Mesh,
    report: &mut Report,
    folder: &Path,
) -> Result<Pictures, ReportError> {
    let mut drawn = Pictures::default();
    let rows = report.stenoses.clone();
    let mut save = |name: String, picture: &Picture| -> Result<String, ReportError> {
        let (path, bytes) = (folder.join(name), picture.png()?);
        write(&path, &bytes)?;
        report.pictures.push(path.display().to_string());
        Ok(picture::address(&bytes))
    };
    if let Some(picture) = pictures::surface(mesh, from.recon, &rows) {
        drawn.surface = Some(save("lumen.png".into(), &picture)?);
    }
    let curve = pictures::area_curve(from.recon, &rows);
    save("area-curve.png".into(), &curve.picture(FINE))?;
    drawn.area_curve = curve.svg();
    for (i, shown) in pictures::bscans(from.recon, from.images, &rows).into_iter().enumerate() {
        let uri = save(format!("bscan-{}.png", i + 1), &shown.picture)?;
        drawn.bscans.push((shown.caption, uri));
    }
    Ok(drawn)
}
