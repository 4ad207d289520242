//! The report of an exam: one page with its pictures inside, and the same numbers as JSON.
//!
//! What it shows and why follows `FIELD.md` section 6: always percent area beside percent diameter, the reference by
//! name, and the sentence that a B-mode lumen is not a Doppler grade.

pub mod bscan_picture;
pub mod build;
pub mod colours;
pub mod curve;
pub mod drawing;
pub mod error_map;
pub mod html;
pub mod picture;
pub mod pictures;
pub mod surface_picture;
mod text;

use probepath_us_capture::Calibration;
use serde::{Deserialize, Serialize};

/// Everything a report says, in the units in its names. Serialised as `report.json` and by `scan --json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Who, what, how.
    pub exam_of: Heading,
    /// Distance of the reconstructed lumen to the true one; only in simulation, where the truth is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface_error_mm: Option<SurfaceError>,
    /// The lesions, along the centreline.
    pub stenoses: Vec<StenosisRow>,
    /// The artery's named segments.
    pub segments: Vec<SegmentRow>,
    /// Lumen area along the centreline.
    pub area_curve: Vec<AreaPoint>,
    /// How the contact force was held.
    pub force_n: ForceFigures,
    /// Mean contact force over the B-scans that show the lumen (N); none without a sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_force_n: Option<f64>,
    /// What became of the B-scans.
    pub images: ImageCounts,
    /// How well the replay kept to the taught path.
    pub path: PathFigures,
    /// How long the exam took on the exam's own clock (s).
    pub duration_s: f64,
    /// The exam file.
    pub exam: String,
    /// The report's page.
    pub report: String,
    /// The lumen surfaces.
    pub surfaces: Vec<String>,
    /// The pictures beside the page (PNG).
    pub pictures: Vec<String>,
    /// The surface and the measures as DICOM.
    pub dicom: Vec<String>,
    /// What the reader must know before believing a number.
    pub warnings: Vec<String>,
}

/// Who, what, how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Study code; never a name.
    pub study: String,
    /// Left or right leg.
    pub side: String,
    /// Date of the exam, as given; none in a simulated cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// What was scanned with: the cell's name.
    pub cell: String,
    /// Protocol's name.
    pub protocol: String,
    /// SHA-256 of the protocol's text.
    pub protocol_sha256: String,
    /// This program's version.
    pub software: String,
    /// Scan depth (mm).
    pub depth_mm: f64,
    /// Focus depth (mm).
    pub focus_mm: f64,
    /// Height of the picture (mm): the whole depth, or the zoom's window.
    pub window_mm: f64,
    /// Speed along the path (mm/s).
    pub speed_mm_s: f64,
    /// Calibration's name.
    pub calibration: String,
    /// Its error, as its file says (mm).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_rms_mm: Option<f64>,
}

impl Heading {
    /// What a calibration says of the machine's setting and of itself.
    pub fn of_calibration(calibration: &Calibration) -> Self {
        let setting = &calibration.setting;
        Self {
            depth_mm: setting.depth_m * 1e3,
            focus_mm: setting.focus_m * 1e3,
            window_mm: setting.window_height_m * 1e3,
            calibration: calibration.id.clone(),
            calibration_rms_mm: Some(calibration.error.rms_mm),
            ..Self::default()
        }
    }
}

/// Distance of grid points to the true surface after a rigid fit ([P1] eq. 6), mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceError {
    /// Mean of the absolute distances.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
}

/// One lesion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StenosisRow {
    /// `S1`, `S2`, … from the proximal end.
    pub name: String,
    /// The artery's segment, when the protocol names it.
    pub segment: String,
    /// Lost area, percent of the reference.
    pub percent_area: f64,
    /// Its standard deviation, from everything known (points).
    pub percent_area_sd: f64,
    /// Its 95 % interval (percent).
    pub percent_area_interval: [f64; 2],
    /// Lost diameter, percent of the reference.
    pub percent_diameter: f64,
    /// Its 95 % interval (percent).
    pub percent_diameter_interval: [f64; 2],
    /// Grade by percent diameter: 1-19 / 20-49 / 50-99 % / occluded.
    pub grade: String,
    /// Where the narrowing begins (mm).
    pub from_mm: f64,
    /// Mean contact force while it was imaged (N); none without a sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
    /// Where the lumen is smallest: distance along the centreline from the scan's proximal end (mm).
    pub at_mm: f64,
    /// Its 95 % interval (mm).
    pub at_interval_mm: [f64; 2],
    /// Length of the narrowing (mm).
    pub length_mm: f64,
    /// Its 95 % interval (mm).
    pub length_interval_mm: [f64; 2],
    /// Whether it runs on beyond what was measured.
    pub cut_off: bool,
    /// How much of it no image shows (mm).
    #[serde(default)]
    pub unseen_mm: f64,
    /// Whether its narrowest place may not have been seen: then the percents are the least that it has lost.
    #[serde(default)]
    pub may_be_narrower: bool,
    /// Smallest lumen area (mm2).
    pub min_area_mm2: f64,
    /// Its 95 % interval (mm2).
    pub min_area_interval_mm2: [f64; 2],
    /// Diameter of a circle of that area (mm).
    pub min_diameter_mm: f64,
    /// Its 95 % interval (mm).
    pub min_diameter_interval_mm: [f64; 2],
    /// Diameter of the largest circle inside the narrowest section (mm).
    pub min_inscribed_diameter_mm: f64,
    /// How far the narrowest lumen lies off the vessel's middle: 0 in the middle, 1 against the wall; none where one
    /// side of the stenosis was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asymmetry: Option<f64>,
    /// Area of the reference (mm2).
    pub reference_area_mm2: f64,
    /// What the reference is.
    pub reference: String,
}

impl StenosisRow {
    /// Why its narrowest place may not have been seen, if so.
    pub(crate) fn may_be_narrower_because(&self) -> Option<String> {
        self.may_be_narrower.then(|| {
            if self.unseen_mm > 0.0 {
                format!("{:.1} mm of it no image shows", self.unseen_mm)
            } else {
                "it is narrowest where the scan ends".to_owned()
            }
        })
    }
}

/// One named segment of the artery.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SegmentRow {
    /// CFA, SFA proximal, …
    pub name: String,
    /// Where it begins along the centreline (mm).
    pub from_mm: f64,
    /// Where it ends (mm).
    pub until_mm: f64,
    /// How much of it was measured (mm).
    pub measured_mm: f64,
    /// Mean lumen area (mm2).
    pub mean_area_mm2: f64,
    /// Its 95 % interval (mm2).
    pub mean_area_interval_mm2: [f64; 2],
    /// Smallest lumen area (mm2).
    pub min_area_mm2: f64,
    /// Its 95 % interval (mm2).
    pub min_area_interval_mm2: [f64; 2],
    /// Mean diameter of equal area (mm).
    pub mean_diameter_mm: f64,
    /// Smallest diameter of equal area (mm).
    pub min_diameter_mm: f64,
    /// Mean contact force (N), where it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_force_n: Option<f64>,
    /// The worst lesion, percent area; none without a lesion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_percent_area: Option<f64>,
}

/// One point of the area curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AreaPoint {
    /// Distance along the centreline (mm).
    pub at_mm: f64,
    /// Area of the section normal to it (mm2); none where no section was found.
    pub area_mm2: Option<f64>,
    /// Its 95 % interval (mm2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_interval_mm2: Option<[f64; 2]>,
    /// Mean contact force of the images near it (N).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
}

/// How the contact force was held, in N.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ForceFigures {
    /// The force asked for.
    pub set: f64,
    /// RMS of the measured force's error while the path was followed.
    pub rms_error: f64,
    /// How far touch-down went above the set force.
    pub overshoot: f64,
    /// Largest force measured.
    pub max: f64,
}

/// What became of the B-scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageCounts {
    /// Kept along the path.
    pub kept: usize,
    /// Lost or left out for a fault (not: passed over between two marks).
    pub dropped: usize,
    /// Kept, but no lumen was seen.
    pub without_lumen: usize,
}

/// How well the replay kept to the taught and smoothed path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PathFigures {
    /// Length of the path (mm).
    pub length_mm: f64,
    /// Largest distance by which smoothing moved a taught point (mm).
    pub smoothing_max_mm: f64,
    /// RMS distance of the measured probe to the path, across the probe's axis (mm).
    pub rms_error_mm: f64,
}

/// Grade of a lesion by percent diameter (`FIELD.md` section 6).
pub fn grade(percent_diameter: f64) -> &'static str {
    match percent_diameter {
        d if d < 1.0 => "none",
        d if d < 20.0 => "1-19 %",
        d if d < 50.0 => "20-49 %",
        d if d < 99.5 => "50-99 %",
        _ => "occluded",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_quarters_of_the_area_are_half_the_diameter_and_graded_so() {
        let percent_diameter = 100.0 * (1.0 - (1.0f64 - 0.75).sqrt());
        assert_eq!(grade(percent_diameter), "50-99 %");
        assert_eq!(grade(19.9), "1-19 %");
        assert_eq!(grade(100.0), "occluded");
    }
}
