//! The report step.

use probepath_frames::Point;
use probepath_us_capture::exam::{Attachment, ExamHeader, Surface};

use super::{Lumen, SOFTWARE, Session, SessionError};
use crate::report::Heading;
pub use crate::report::build::Segment;
use crate::report::build::{Ingredients, make};

/// What a report should hold beside the numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportWish {
    /// The artery's named parts.
    pub segments: Vec<Segment>,
}

/// Name of the attachment that keeps the named parts, so that a report can be made again from the exam.
pub(crate) const SEGMENTS: &str = "segments.json";

impl Session {
    /// Writes the surfaces, the report and its numbers.
    ///
    /// # Errors
    /// When a file cannot be written or a picture not be drawn.
    pub fn report(&mut self, lumen: &Lumen, wish: &ReportWish) -> Result<(), SessionError> {
        self.opening.progress.at("reporting", 0.0);
        let segments = serde_json::to_vec(&wish.segments).map_err(crate::report::build::ReportError::from)?;
        if let Some(exam) = &self.exam {
            exam.attach(Attachment::new(SEGMENTS, "application/json", segments));
        }
        let mut figures = lumen.scan.figures.clone();
        figures.warnings.extend(self.warnings.iter().cloned());
        let exam = self.exam_path();
        let from = Ingredients {
            heading: self.heading(lumen),
            figures: &figures,
            recon: &lumen.recon,
            images: &lumen.scan.images,
            segments: &wish.segments,
            surface_error: self.surface_error(lumen),
            exam: &exam,
        };
        let report = make(&from, &self.opening.out)?;
        self.show_surface(lumen);
        self.opening.progress.at("reporting", 1.0);
        self.report = Some(report);
        Ok(())
    }

    /// The lumen in the exam, for viewers.
    fn show_surface(&self, lumen: &Lumen) {
        let Some(exam) = &self.exam else { return };
        let mesh = lumen.recon.surface.mesh();
        let vertices = mesh.points.iter().map(|p| Point::from_vector(*p)).collect();
        exam.surface(Surface { stamp: self.now, name: "lumen".into(), vertices, triangles: mesh.triangles });
    }

    fn heading(&self, lumen: &Lumen) -> Heading {
        let (opening, label) = (&self.opening, &lumen.scan.label);
        let calibration = self.cell.calibration.as_ref();
        Heading {
            study: label.study.clone(),
            side: format!("{:?}", label.side).to_lowercase(),
            date: opening.date.clone(),
            cell: self.cell.file.name.clone(),
            protocol: opening.protocol.name.clone(),
            protocol_sha256: ExamHeader::sha256(&opening.protocol.text),
            software: SOFTWARE.into(),
            speed_mm_s: lumen.scan.figures.speed_mm_s,
            ..calibration.map_or_else(Heading::default, Heading::of_calibration)
        }
    }
}
