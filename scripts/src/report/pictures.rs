//! The pictures of a report: the surface from two sides with the stenoses marked, the area curve, B-scans with contours.

use nalgebra::Vector3;
use probepath_recon::{LumenReconstruction, Mesh, Section, Vessel};
use probepath_us_capture::PlacedBScan;

use super::StenosisRow;
use super::colours::{FAINT, INK, MARK, SOFT, Scale};
use super::curve::{self, CurvePoint, Mark};
use super::drawing::Drawing;
use super::picture::{Anchor, Picture};
use super::surface_picture::{Camera, From, SurfaceView, Window, render};

/// Size of the surface's picture.
const SIZE: (usize, usize) = (1800, 700);
const LETTERS: f64 = 24.0;
/// The views, one under the other.
const FRONT: Window = Window { left: 90.0, top: 90.0, width: 1620.0, height: 190.0 };
const RIGHT: Window = Window { left: 90.0, top: 360.0, width: 1620.0, height: 190.0 };
/// At most so many B-scans in a report.
const MOST_BSCANS: usize = 6;

/// The surface from the front and from the right; `None` of a surface without points.
pub fn surface(mesh: &Mesh, recon: &LumenReconstruction, rows: &[StenosisRow]) -> Option<Picture> {
    let vertices_mm: Vec<[f64; 3]> = mesh.points.iter().map(|p| (p * 1e3).into()).collect();
    let lost = lost_percent(mesh, recon)?;
    let scale = Scale::sequential(0.0, 100.0);
    let view = SurfaceView { vertices_mm: &vertices_mm, triangles: &mesh.triangles, values: &lost, scale };
    let mut picture = Picture::filled(SIZE.0, SIZE.1, [255; 3]);
    let mut over = Drawing { size: (SIZE.0 as f64, SIZE.1 as f64), ..Drawing::default() };
    let cameras = both(&vertices_mm)?;
    for (camera, words, above) in
        [(cameras[0], "from the front", true), (cameras[1], "from the right", false)]
    {
        render(&mut picture, &view, &camera);
        let window = if above { FRONT } else { RIGHT };
        over.text((24.0, window.top - 22.0), words, LETTERS, Anchor::Start, SOFT);
        compass(&mut over, &camera, (44.0, window.top + window.height / 2.0));
        marks(&mut over, &camera, &Marked { recon, rows, vertices_mm: &vertices_mm, above });
    }
    let foot = SIZE.1 as f64 - 62.0;
    length_scale(&mut over, cameras[0].scale, (90.0, foot + 18.0));
    let at = (SIZE.0 as f64 - 90.0 - 420.0, foot);
    scale.bar(&mut over, at, (420.0, 20.0), "area lost against the vessel's median, %", LETTERS * 0.84);
    over.paint(&mut picture, 1.0);
    Some(picture)
}

/// Both views at one scale.
fn both(vertices_mm: &[[f64; 3]]) -> Option<[Camera; 2]> {
    let front = Camera::facing(vertices_mm, From::Front, FRONT)?;
    let right = Camera::facing(vertices_mm, From::Right, RIGHT)?;
    let scale = front.scale.min(right.scale);
    Some([front.with_scale(scale), right.with_scale(scale)])
}

/// How much of its vessel's median area is missing at each vertex (%).
fn lost_percent(mesh: &Mesh, recon: &LumenReconstruction) -> Option<Vec<f64>> {
    let areas: Vec<f64> = match mesh.scalars("area_mm2") {
        Some(areas) => areas.to_vec(),
        None => mesh.points.iter().map(|p| area_near(recon, p)).collect(),
    };
    let first = median(&recon.sections)?;
    let medians: Vec<f64> = recon.vessels.iter().map(|v| median(&v.sections).unwrap_or(first)).collect();
    let lost = |(point, area): (&Vector3<f64>, f64)| {
        let open = vessel_at(recon, point).and_then(|vessel| medians.get(vessel)).unwrap_or(&first);
        100.0 * (1.0 - area / open)
    };
    Some(mesh.points.iter().zip(areas).map(lost).collect())
}

fn median(sections: &[Section]) -> Option<f64> {
    let mut known: Vec<f64> = sections.iter().filter_map(|s| Some(s.measure.as_ref()?.area_mm2)).collect();
    known.sort_by(f64::total_cmp);
    known.get(known.len() / 2).copied()
}

/// Which of several vessels a point of the surface belongs to: the one whose wall is nearest.
fn vessel_at(recon: &LumenReconstruction, point: &Vector3<f64>) -> Option<usize> {
    if recon.vessels.len() < 2 {
        return None;
    }
    let off = |section: &Section| {
        let radius = (section.measure.as_ref()?.area_mm2 * 1e-6 / std::f64::consts::PI).sqrt();
        Some((section.centre.vector() - point).norm() - radius)
    };
    // Every millimetre will do.
    let nearest =
        |vessel: &Vessel| vessel.sections.iter().step_by(2).filter_map(off).fold(f64::INFINITY, f64::min);
    let all = recon.vessels.iter().map(nearest).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(number, _)| number)
}

fn area_near(recon: &LumenReconstruction, vertex: &Vector3<f64>) -> f64 {
    let near =
        |s: &Section| Some(((s.centre.vector() - vertex).norm_squared(), s.measure.as_ref()?.area_mm2));
    let nearest = recon.sections.iter().filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(f64::NAN, |(_, area)| area)
}

/// What is written beside the surface.
struct Marked<'m> {
    recon: &'m LumenReconstruction,
    rows: &'m [StenosisRow],
    vertices_mm: &'m [[f64; 3]],
    /// Whether what each comes to is said too.
    above: bool,
}

/// A name beside every stenosis, and what it comes to, once.
fn marks(over: &mut Drawing, camera: &Camera, marked: &Marked<'_>) {
    let outline: Vec<(f64, f64)> =
        marked.vertices_mm.iter().map(|v| camera.project(*v)).map(|p| (p.0, p.1)).collect();
    for row in marked.rows {
        let Some(at) = marked.recon.centreline.at(row.at_mm * 1e-3) else { continue };
        let (x, y, _) = camera.project((at.point.vector() * 1e3).into());
        let label = if marked.above {
            format!("{}  {:.0} % of area", row.name, row.percent_area)
        } else {
            row.name.clone()
        };
        // Above all that is drawn behind the words, a branch too.
        let half = LETTERS * 0.3 * label.chars().count() as f64;
        let beside = outline.iter().filter(|p| (p.0 - x).abs() < half).map(|p| p.1);
        let foot = beside.fold(y, f64::min) - 10.0;
        over.line(&[(x, foot - 26.0), (x, foot)], 2.5, MARK);
        over.text((x, foot - 36.0), &label, LETTERS * 1.1, Anchor::Middle, MARK);
    }
}

/// The patient's directions, those that can be seen.
fn compass(over: &mut Drawing, camera: &Camera, (x, y): (f64, f64)) {
    let long = 26.0;
    for (name, along) in [
        ("L", [1.0, 0.0, 0.0]),
        ("P", [0.0, 1.0, 0.0]),
        ("A", [0.0, -1.0, 0.0]),
        ("R", [-1.0, 0.0, 0.0]),
        ("F", [0.0, 0.0, -1.0]),
    ] {
        let (right, down) = camera.direction(along);
        // Only those in the plane, and of two opposite ones the one that points up or on.
        if right.hypot(down) < 0.7 || down > 0.5 {
            continue;
        }
        let tip = (x + right * long, y + down * long);
        over.line(&[(x, y), tip], 2.0, SOFT);
        let letter = (x + right * (long + 13.0), y + down * (long + 13.0) + LETTERS * 0.3);
        over.text(letter, name, LETTERS * 0.8, Anchor::Middle, SOFT);
    }
}

/// A bar of a round number of millimetres.
fn length_scale(over: &mut Drawing, per_mm: f64, (x, y): (f64, f64)) {
    let long = curve::nice(120.0 / per_mm.max(1e-9));
    let end = x + long * per_mm;
    over.line(&[(x, y), (end, y)], 4.0, INK);
    over.text((end + 14.0, y + LETTERS * 0.35), &format!("{long:.0} mm"), LETTERS, Anchor::Start, INK);
    over.line(&[(x, y - 60.0), (SIZE.0 as f64 - 90.0, y - 60.0)], 1.0, FAINT);
}

/// The area curve with its band and the stenoses.
pub fn area_curve(recon: &LumenReconstruction, rows: &[StenosisRow]) -> Drawing {
    let points: Vec<CurvePoint> = super::build::area_points(recon)
        .iter()
        .map(|p| CurvePoint {
            at_mm: p.at_mm,
            area_mm2: p.area_mm2.unwrap_or(f64::NAN),
            band_mm2: p.area_interval_mm2,
        })
        .collect();
    let mark = |row: &StenosisRow| Mark {
        at_mm: row.at_mm,
        span_mm: (row.from_mm, row.from_mm + row.length_mm),
        label: format!("{}  {:.0} %", row.name, row.percent_area),
    };
    curve::area_curve(&points, &rows.iter().map(mark).collect::<Vec<_>>())
}

/// A B-scan that is shown, and what it shows.
pub struct Shown {
    /// In words.
    pub caption: String,
    /// With the contour.
    pub picture: Picture,
}

/// The B-scan nearest to each stenosis and, before them, one of open lumen.
pub fn bscans(recon: &LumenReconstruction, images: &[PlacedBScan], rows: &[StenosisRow]) -> Vec<Shown> {
    let mut wanted: Vec<(String, f64)> = rows
        .iter()
        .map(|row| {
            (
                format!("{}: {:.0} % of the area lost, at {:.0} mm", row.name, row.percent_area, row.at_mm),
                row.at_mm,
            )
        })
        .collect();
    if let Some(open) = recon.sections.get(recon.sections.len() / 20) {
        wanted.insert(0, (format!("Near the proximal end, at {:.0} mm", open.at_mm), open.at_mm));
    }
    wanted.truncate(MOST_BSCANS);
    wanted.into_iter().filter_map(|(caption, at_mm)| shown(recon, images, caption, at_mm)).collect()
}

fn shown(recon: &LumenReconstruction, images: &[PlacedBScan], caption: String, at_mm: f64) -> Option<Shown> {
    let place = recon.centreline.at(at_mm * 1e-3)?.point;
    let seen = recon
        .images
        .iter()
        .zip(images)
        .filter_map(|(found, image)| Some((found.lumen.as_ref().ok()?, image)));
    let nearest = seen.min_by(|a, b| a.0.centre.distance(&place).total_cmp(&b.0.centre.distance(&place)));
    let (contour, image) = nearest?;
    let picture = super::bscan_picture::draw(&image.bscan, Some(&contour.pixels));
    Some(Shown { caption: format!("{caption} (B-scan {})", image.bscan.number), picture })
}
