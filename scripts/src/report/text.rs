//! The report on a terminal.

use std::fmt;

use super::Report;

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.report.is_empty() {
            return writeln!(f, "The protocol made no report. The exam: {}", self.exam);
        }
        self.table(f)?;
        let (force, images) = (&self.force_n, &self.images);
        writeln!(
            f,
            "contact {:.1} N, {:.2} N RMS off, {:.2} N over at touch-down; {} B-scans kept, {} lost, {} without a lumen",
            force.set, force.rms_error, force.overshoot, images.kept, images.dropped, images.without_lumen
        )?;
        if let Some(error) = self.surface_error_mm {
            writeln!(
                f,
                "surface against the simulated truth: {:.2} mm mean, {:.2} mm at the 95th percentile",
                error.mean, error.p95
            )?;
        }
        for warning in &self.warnings {
            writeln!(f, "note: {warning}")?;
        }
        writeln!(f, "report   {}\nexam     {}\nsurfaces {}", self.report, self.exam, self.surfaces.join(", "))
    }
}

impl Report {
    fn table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = &self.exam_of;
        writeln!(
            f,
            "{} leg, study {}: {} in {:.0} mm",
            of.side,
            of.study,
            super::html::count(self.stenoses.len(), "stenosis", "stenoses"),
            self.measured_mm()
        )?;
        if self.stenoses.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "     segment        area lost  (95 % interval)  diameter lost  grade      at       length    smallest lumen"
        )?;
        for s in &self.stenoses {
            writeln!(
                f,
                "{:<4} {:<14} {:>7.1} %  ({:>4.1} to {:>4.1} %)  {:>11.1} %  {:<9} {:>6.1} mm  {:>5.1} mm  {:>5.1} of {:.1} mm²",
                s.name,
                s.segment,
                s.percent_area,
                s.percent_area_interval[0],
                s.percent_area_interval[1],
                s.percent_diameter,
                s.grade,
                s.at_mm,
                s.length_mm,
                s.min_area_mm2,
                s.reference_area_mm2
            )?;
        }
        for s in &self.stenoses {
            if let Some(why) = s.may_be_narrower_because() {
                writeln!(f, "{:<4} may be narrower: {why}", s.name)?;
            }
        }
        Ok(())
    }

    /// Length of the centreline that was measured (mm).
    fn measured_mm(&self) -> f64 {
        let seen =
            || self.area_curve.iter().filter(|point| point.area_mm2.is_some()).map(|point| point.at_mm);
        seen().fold(0.0, f64::max) - seen().fold(f64::INFINITY, f64::min).min(seen().fold(0.0, f64::max))
    }
}
