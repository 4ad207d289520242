//! What a spatial calibration says of itself, for people.

use std::fmt;

use super::document::{Section, Spatial};

impl fmt::Display for Spatial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "phantom {}, poses {}", self.phantom, self.poses)?;
        writeln!(
            f,
            "\n{:<12} {:>9} {:>9} {:>16} {:>9} {:>9}",
            "", "images", "labelled", "mid 95 %, mm", "mid RMS", "line RMS"
        )?;
        row(f, "calibration", &self.calibration)?;
        match &self.validation {
            Some(section) => row(f, "validation", section)?,
            None => writeln!(
                f,
                "validation   on no other images: these errors flatter; give --validate SEQUENCE"
            )?,
        }
        self.figures(f)?;
        for (name, section) in
            [("calibration", Some(&self.calibration)), ("validation", self.validation.as_ref())]
        {
            section.map_or(Ok(()), |section| refused(f, name, section))?;
        }
        for line in &self.weak {
            writeln!(f, "weak: {line}")?;
        }
        for line in &self.notes {
            writeln!(f, "note: {line}")?;
        }
        for (what, path) in [("stored in", &self.stored), ("pictures in", &self.overlay)] {
            path.as_ref().map_or(Ok(()), |path| writeln!(f, "{what} {}", path.display()))?;
        }
        Ok(())
    }
}

impl Spatial {
    fn figures(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.pixel_mm;
        writeln!(f, "\nImageToProbe (pixel to mm, as PLUS has it)")?;
        matrix(f, &self.plus.image_to_probe)?;
        writeln!(f, "PhantomToReference (mm), as refined")?;
        matrix(f, &self.plus.phantom_to_reference)?;
        let lag_error =
            self.lag_standard_error_s.map_or_else(|| ", as given".into(), |s| format!(" ± {:.1}", s * 1e3));
        writeln!(
            f,
            "lag {:.1}{lag_error} ms (an image stamped t belongs to the pose at t + lag)",
            self.lag_s * 1e3
        )?;
        writeln!(f, "pixel {x:.5} x {y:.5} mm")?;
        let error = self.standard_error_mm;
        writeln!(
            f,
            "standard error of a point: {:.3} mm on average over the image, {:.3} mm at the 95th percentile",
            error.mean, error.p95
        )?;
        let Some(repeat) = &self.repeatability else { return Ok(()) };
        let (count, c_rms) = (repeat.calibrations, repeat.c_rms_mm);
        writeln!(
            f,
            "repeatability: C_rms {c_rms:.3} mm over {count} calibrations, each from its share of the images"
        )
    }
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, section: &Section) -> fmt::Result {
    let mm = |figure: Option<f64>| figure.map_or_else(|| "-".into(), |mm| format!("{mm:.3}"));
    let mid = section
        .mid_sd95_mm
        .map_or_else(|| mm(section.mid_mean95_mm), |sd| format!("{} ± {sd:.3}", mm(section.mid_mean95_mm)));
    let (rms, line) = (mm(section.mid_rms_mm), mm(section.line_rms_mm));
    writeln!(f, "{name:<12} {:>9} {:>9} {mid:>16} {rms:>9} {line:>9}", section.images, section.labelled)
}

/// Reason by reason: how many, the code, the words of the first.
fn refused(f: &mut fmt::Formatter<'_>, name: &str, section: &Section) -> fmt::Result {
    for (code, count) in &section.refused {
        let first = section.refusals.iter().find(|refusal| refusal.code == *code);
        let (image, why) = first.map_or((0, ""), |refusal| (refusal.image, refusal.why.as_str()));
        writeln!(f, "{name}: {count} refused ({code}), the first is image {image}: {why}")?;
    }
    Ok(())
}

fn matrix(f: &mut fmt::Formatter<'_>, numbers: &[f64; 16]) -> fmt::Result {
    for row in numbers.chunks_exact(4) {
        let row: Vec<String> = row.iter().map(|x| format!("{x:>12.6}")).collect();
        writeln!(f, "  {}", row.join(" "))?;
    }
    Ok(())
}
