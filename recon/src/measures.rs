//! What is read off the sections: the leg's named segments, what the probe's pressure does, the table.

mod compression;
mod segments;
pub mod table;

pub use compression::{Compression, SOFT_N};
pub use segments::{Segment, SegmentMeasure, segment_measures};

use crate::reconstruct::ReconWarning;
use crate::section::NotMeasured;
use crate::{ReferenceChoice, Section, stenosis};

/// What the reader of the sections should know.
pub(crate) fn warnings(sections: &[Section], reference: ReferenceChoice) -> Vec<ReconWarning> {
    let crossing = |section: &Section| section.missing == Some(NotMeasured::Crossing);
    let mut warnings: Vec<ReconWarning> = stretches(sections, crossing)
        .map(|run| ReconWarning::Crossing { from_mm: run[0].at_mm, to_mm: run[run.len() - 1].at_mm })
        .collect();
    warnings.extend(compression::warnings(sections));
    if let ReferenceChoice::Between { from_mm, to_mm } = reference
        && !stenosis::has_reference(sections, from_mm, to_mm)
    {
        warnings.push(ReconWarning::NoReference { from_mm, to_mm });
    }
    warnings
}

/// Runs of neighbouring sections of which something is true.
fn stretches(sections: &[Section], is: impl Fn(&Section) -> bool) -> impl Iterator<Item = &[Section]> {
    let runs: Vec<&[Section]> = sections.chunk_by(|a, b| is(a) == is(b)).filter(|run| is(&run[0])).collect();
    runs.into_iter()
}
