//! Which chain of a sequence's transforms is the probe's pose.

use std::collections::BTreeSet;
use std::path::Path;

use probepath_us_capture::sequence::{ChainNames, Sequence, TransformName};

use super::CalibrateError;

/// PLUS's usual names, where nothing says others.
const PROBE: &str = "Probe";

/// The chain that was asked for; else the one that `configured` names; else `ProbeToReference`; else the only
/// transform of `Probe` that the sequence tracks.
///
/// # Errors
/// When what was asked for is no transform's name, or there is none of these; it says what there is.
pub(super) fn chain(
    path: &Path,
    sequence: &Sequence,
    configured: &ChainNames,
    asked: Option<&str>,
) -> Result<ChainNames, CalibrateError> {
    let named = |probe: &str, reference: &str| ChainNames {
        probe: probe.into(),
        reference: reference.into(),
        fixed: configured.fixed.clone(),
    };
    let there = || tracked(sequence).iter().map(|name| format!("{name}")).collect::<Vec<_>>();
    if let Some(asked) = asked {
        let name = TransformName::parse(asked.strip_suffix("Transform").unwrap_or(asked))
            .ok_or_else(|| CalibrateError::PosesName { asked: asked.into(), there: there() })?;
        let names = named(&name.from, &name.to);
        // Asked for by name: whatever is wrong with it is said, and nothing else is taken instead.
        sequence.probe_poses(&names).map_err(|source| CalibrateError::Chain { path: path.into(), source })?;
        return Ok(names);
    }
    let usual = named(PROBE, "Reference");
    let only = only_of(sequence, PROBE).map(|reference| named(PROBE, &reference));
    [Some(configured.clone()), Some(usual), only]
        .into_iter()
        .flatten()
        .find(|names| sequence.probe_poses(names).is_ok())
        .ok_or_else(|| CalibrateError::NoPoses { path: path.into(), there: there() })
}

/// The system that the only tracked transform of `probe` leads to.
fn only_of(sequence: &Sequence, probe: &str) -> Option<String> {
    let mut of_probe = tracked(sequence).into_iter().filter(|name| name.from == probe);
    let only = of_probe.next()?;
    of_probe.next().is_none().then(|| only.to.clone())
}

fn tracked(sequence: &Sequence) -> BTreeSet<&TransformName> {
    sequence.images().iter().flat_map(|image| image.transforms.keys()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;
    use probepath_us_capture::sequence::{SequenceImage, Status, Tracked};

    fn sequence(names: &[(&str, &str)]) -> Sequence {
        let mut sequence = Sequence::new(0, 0);
        let tracked = || Tracked { matrix_mm: Matrix4::identity(), status: Status::Ok };
        let transforms = names.iter().map(|(a, b)| (TransformName::new(*a, *b), tracked())).collect();
        sequence.push(SequenceImage { transforms, ..SequenceImage::default() }).unwrap();
        sequence
    }

    fn found(names: &[(&str, &str)], configured: &ChainNames, asked: Option<&str>) -> Result<String, String> {
        let names = chain("x.mha".as_ref(), &sequence(names), configured, asked);
        names.map(|n| format!("{}To{}", n.probe, n.reference)).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_asked_for_is_taken_or_refused_with_what_there_is() {
        let there = [("Probe", "Tracker"), ("Reference", "Tracker")];
        let usual = ChainNames::default();
        assert_eq!(found(&there, &usual, Some("ProbeToTracker")).unwrap(), "ProbeToTracker");
        assert_eq!(found(&there, &usual, Some("ProbeToReferenceTransform")).unwrap(), "ProbeToReference");
        for asked in ["ProbeToStepperHome", "Probe", ""] {
            let error = found(&there, &usual, Some(asked)).unwrap_err();
            assert!(error.contains("ReferenceToTracker"), "{asked}: {error}");
        }
    }

    #[test]
    fn without_a_wish_the_configuration_then_the_usual_then_the_only_one() {
        let stepper = ChainNames { reference: "StepperHome".into(), ..ChainNames::default() };
        let usual = ChainNames::default();
        let plain = [("Probe", "Tracker"), ("Reference", "Tracker")];
        assert_eq!(found(&[("Probe", "StepperHome")], &stepper, None).unwrap(), "ProbeToStepperHome");
        assert_eq!(found(&plain, &stepper, None).unwrap(), "ProbeToReference");
        assert_eq!(found(&[("Probe", "Base")], &usual, None).unwrap(), "ProbeToBase");
        let error = found(&[("Tool", "Base"), ("Probe", "A"), ("Probe", "B")], &usual, None).unwrap_err();
        assert!(error.contains("ToolToBase") && error.contains("--poses"), "{error}");
    }
}
