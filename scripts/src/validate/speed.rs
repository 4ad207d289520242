//! The whole road of a scan, from its exam file to the report: time by stage, memory, and how both grow with the
//! images. The command itself is run, one process for each size, and says what it took.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;

use probepath_frames::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Pose, Span, Stamp, World};
use probepath_sim::{Contact, ImagingConfig, PhantomConfig, Renderer, VascularPhantom, settings};
use probepath_us_capture::exam::{ExamFile, ExamHeader};
use probepath_us_capture::{BScan, PlacedBScan, Setting};
use rayon::prelude::*;
use serde_json::Value;

use super::bench::{Folder, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use crate::session::SOFTWARE;

/// Images in a scan.
const SIZES: [u64; 4] = [500, 1000, 2000, 4000];
/// What is told apart: the stages, and what all processors worked (which not every system says).
const PARTS: [&str; 5] = ["reading", "lumen", "surface", "report", "processors"];
/// The size whose time and memory are goals.
const GOAL: u64 = 2000;
const MOST_S: f64 = 10.0;
const MOST_MB: f64 = 1000.0;
/// Time grows with the images to this power at the most: one, and what a measurement leaves open.
const MOST_POWER: f64 = 1.15;
/// Images that are drawn, and the distance of two along the vessel (m): they cover both stenoses of the phantom.
const DRAWN: u64 = 500;
const STEP_M: f64 = 0.2e-3;
const FROM_M: f64 = 0.020;

/// What each size took.
struct Taken {
    images: u64,
    timing: Value,
    memory_mb: Option<f64>,
}

/// Reconstructs scans of 500 to 4,000 images with the program `exe`; `only` restricts it to one size.
///
/// # Errors
/// When there is no such size, the disk refuses, or the program fails.
pub fn speed(only: Option<&str>, exe: &Path, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    let sizes: Vec<u64> =
        SIZES.into_iter().filter(|size| only.is_none_or(|asked| asked == size.to_string())).collect();
    if sizes.is_empty() {
        let names = SIZES.map(|size| size.to_string()).join(", ");
        return Err(ValidateError::NoSetting { asked: only.unwrap_or_default().into(), names });
    }
    let folder = Folder::new("speed")?;
    tell(progress, "drawing", 0, 1);
    let pictures = Pictures::draw()?;
    let mut taken = Vec::new();
    for (nth, images) in sizes.iter().enumerate() {
        tell(progress, &format!("{images} images"), nth as u64, sizes.len() as u64);
        let exam = folder.path().join(format!("{images}.mcap"));
        pictures.write(*images, &exam)?;
        taken.push(run(exe, *images, &exam, &folder.path().join("made"))?);
        std::fs::remove_file(&exam)?;
    }
    let rows = taken.iter().flat_map(rows).chain(growth(&taken)).collect();
    Ok(Goals::new("speed: from an exam file to the report, 640 x 480, an image every 0.2 mm", 1, rows))
}

fn run(exe: &Path, images: u64, exam: &Path, out: &Path) -> Result<Taken, ValidateError> {
    let failed = |why: String| ValidateError::Command { images, why };
    let done = Command::new(exe).arg("reconstruct").arg(exam).arg("--out").arg(out).arg("--json").output()?;
    if !done.status.success() {
        return Err(failed(String::from_utf8_lossy(&done.stderr).into_owned()));
    }
    let document: Value = serde_json::from_slice(&done.stdout).map_err(|error| failed(error.to_string()))?;
    let used = document["images"]["used"].as_u64().unwrap_or_default();
    if used * 10 < images * 9 {
        return Err(failed(format!("only {used} images were used: {}", document["images"])));
    }
    Ok(Taken { images, timing: document["timing_s"].clone(), memory_mb: document["peak_memory_mb"].as_f64() })
}

fn rows(taken: &Taken) -> Vec<Goal> {
    let goal = taken.images == GOAL;
    let figure = |what: &str| format!("{} images: {what}", taken.images);
    let seconds = |stage: &str| taken.timing[stage].as_f64().unwrap_or(f64::NAN);
    let mut rows = vec![Goal::of(figure("all, s"), &[seconds("total")], goal.then_some(MOST_S), None)];
    for stage in PARTS.into_iter().filter(|stage| taken.timing[stage].is_number()) {
        rows.push(Goal::of(figure(&format!("{stage}, s")), &[seconds(stage)], None, None));
    }
    if let Some(mb) = taken.memory_mb {
        rows.push(Goal::of(figure("memory at its peak, MB"), &[mb], goal.then_some(MOST_MB), None));
    }
    rows
}

/// The power of the images that time grows with, stage by stage, between the smallest and the largest size.
fn growth(taken: &[Taken]) -> Vec<Goal> {
    let (Some(first), Some(last)) = (taken.first(), taken.last()) else { return Vec::new() };
    if first.images == last.images {
        return Vec::new();
    }
    let power = |stage: &str| {
        let seconds = |taken: &Taken| taken.timing[stage].as_f64().unwrap_or(f64::NAN);
        (seconds(last) / seconds(first)).ln() / (last.images as f64 / first.images as f64).ln()
    };
    ["total"]
        .into_iter()
        .chain(PARTS)
        .filter(|stage| first.timing[stage].is_number())
        .map(|stage| {
            let figure = format!("{stage}: grows with the images to the power of");
            // What else the computer did meanwhile is in the seconds, not in what the processors worked.
            let judged = matches!(stage, "total" | "processors");
            Goal::of(figure, &[power(stage)], judged.then_some(MOST_POWER), None)
        })
        .collect()
}

/// B-scans of the straight phantom; a longer vessel is the same again, to and fro.
struct Pictures {
    setting: Setting,
    pixels: Vec<Vec<u8>>,
}

impl Pictures {
    fn draw() -> Result<Self, ValidateError> {
        let setting = settings::zoomed(0.07, 0.045, 0.03, 0.034);
        let phantom = VascularPhantom::new(&PhantomConfig::default());
        let drawing = |error: probepath_sim::ImagingError| ValidateError::Drawing { why: error.to_string() };
        let renderer = Renderer::new(ImagingConfig::default(), 1).map_err(drawing)?;
        let draw = |number: u64| {
            let vessel = phantom.vessel();
            let z = vessel.centre(FROM_M + number as f64 * STEP_M).vector().z;
            let place = plane(&setting, phantom.top_y(), z);
            renderer.render(&phantom, &place, &setting, Contact::Full, number)
        };
        let pixels = (0..DRAWN).into_par_iter().map(draw).collect::<Result<_, _>>().map_err(drawing)?;
        Ok(Self { setting, pixels })
    }

    /// The picture of the image that is so many steps along.
    fn picture(&self, number: u64) -> &[u8] {
        let (turn, at) = (number / DRAWN, number % DRAWN);
        let at = if turn.is_multiple_of(2) { at } else { DRAWN - 1 - at };
        self.pixels.get(at as usize).map_or(&[], Vec::as_slice)
    }

    /// An exam of so many images.
    fn write(&self, images: u64, path: &Path) -> Result<(), ValidateError> {
        let wrong = |source| ValidateError::Exam { seed: images, source };
        let header = ExamHeader {
            software: SOFTWARE.into(),
            study_code: "SPEED".into(),
            protocol: "validate speed".into(),
            protocol_sha256: ExamHeader::sha256(""),
            calibration_id: "none".into(),
            seed: Some(1),
            joint_names: Vec::new(),
            period: Span::from_milliseconds(2),
        };
        let sink = BufWriter::new(File::create(path)?);
        let mut file = ExamFile::new(sink, &header).map_err(wrong)?;
        for number in 0..images {
            file.bscan(&self.placed(number)?).map_err(wrong)?;
        }
        file.finish().map_err(wrong)?;
        Ok(())
    }

    fn placed(&self, number: u64) -> Result<PlacedBScan, ValidateError> {
        let stamp = Stamp::ZERO + Span::from_milliseconds(20 * number as i64);
        let size = (settings::COLUMNS, settings::ROWS);
        let bscan = BScan::new(number, (stamp, stamp), self.setting, size, self.picture(number));
        let bscan = bscan.map_err(|error| ValidateError::Drawing { why: error.to_string() })?;
        let world_from_image = plane(&self.setting, 0.0, -(number as f64) * STEP_M);
        // FRAMES: nothing here asks where the probe was; it is put where the first pixel is.
        let world_from_probe = Pose::assume(*world_from_image.isometry());
        Ok(PlacedBScan { bscan, world_from_probe, world_from_image, wrench: None })
    }
}

/// An image's plane across the phantom at height `z` (m), its face at `top_y`.
fn plane(setting: &Setting, top_y: f64, z: f64) -> Pose<World, Image> {
    let left = (setting.spacing.x_m - setting.window_width_m) / 2.0;
    let first = Vector3::new(left, top_y + setting.window_top_m + setting.spacing.y_m / 2.0, z);
    // FRAMES: Image x is World x, Image y is World y (down), so Image z is World z.
    Pose::assume(Isometry3::from_parts(Translation3::from(first), UnitQuaternion::identity()))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn a_road_that_doubles_its_time_with_the_images_grows_to_the_power_of_one() {
        let taken = |images: u64, seconds: f64| Taken {
            images,
            timing: serde_json::json!({ "total": seconds, "lumen": seconds * seconds }),
            memory_mb: Some(100.0),
        };
        let goals = growth(&[taken(500, 1.0), taken(1000, 2.1), taken(4000, 8.0)]);
        assert!((goals[0].mean - 1.0).abs() < 1e-12 && goals[0].met == Some(true));
        assert!((goals[1].mean - 2.0).abs() < 1e-12);
        assert_eq!(growth(&[taken(500, 1.0), taken(4000, 64.0)])[0].met, Some(false));
        assert!(growth(&[taken(500, 1.0)]).is_empty());
    }

    #[test]
    fn an_unknown_size_is_named_beside_those_there_are() {
        let exe = PathBuf::from("probepath");
        let error = speed(Some("700"), &exe, &()).unwrap_err().to_string();
        assert!(error.contains("700") && error.contains("4000"), "{error}");
    }
}
