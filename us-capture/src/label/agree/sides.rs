//! What is known of how the image lies on the probe: all that tells a mirrored image from a right one.

use std::fmt;

use probepath_frames::{Image, Pose, Probe};

use super::views::Views;
use super::{Refusal, Verdict};
use crate::phantom::WirePhantom;

/// What is known before of how the image lies on the probe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Expect {
    /// Nothing: a mirrored image is not noticed, and calibrates as one whose x and z axes are reversed.
    #[default]
    Anything,
    /// PLUS's convention: of every N, the wire listed first is on the right of an MF image.
    FirstWireRight,
    /// The image's axes are within 60 degrees of these (a drawing of the probe, a calibration of another day).
    About(Pose<Probe, Image>),
}

/// Which way an image is flipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flipped {
    /// Left to right.
    Columns,
    /// Top to bottom.
    Rows,
    /// Both: turned by half a turn.
    Both,
    /// Turned in some other way.
    Turned,
}

impl fmt::Display for Flipped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Columns => {
                "mirrored left to right (the file says MF and is probably UF, or the other way round)"
            }
            Self::Rows => {
                "mirrored top to bottom (the file says MF and is probably MN, or the other way round)"
            }
            Self::Both => "upside down (the file says MF and is probably UN, or the other way round)",
            Self::Turned => "turned away from where it was expected on the probe",
        })
    }
}

/// Angle beyond which an image does not lie as expected (rad).
const ABOUT_RAD: f64 = 1.05;
/// A verdict that meets the expectation stands when it is worth this much of the best that does not.
const AS_GOOD: f64 = 0.8;

impl Expect {
    /// Keeps the verdicts that may be; when the best may not, says how the images are flipped.
    pub(super) fn sort_out(
        self,
        verdicts: Vec<Verdict>,
        views: &Views<'_>,
        phantom: &WirePhantom,
    ) -> Result<Vec<Verdict>, Refusal> {
        let Some(best) = verdicts.first().cloned() else { return Ok(verdicts) };
        let kept: Vec<_> =
            verdicts.into_iter().filter(|v| self.flipped(v, views, phantom).is_none()).collect();
        let worth = kept.first().map_or(0.0, |v| v.worth);
        match self.flipped(&best, views, phantom) {
            Some(flipped) if worth < AS_GOOD * best.worth => {
                Err(Refusal::Mirrored { flipped, images: views.labelled(), support: best.support })
            }
            _ => Ok(kept),
        }
    }

    fn flipped(self, verdict: &Verdict, views: &Views<'_>, phantom: &WirePhantom) -> Option<Flipped> {
        match self {
            Self::Anything => None,
            Self::FirstWireRight => (first_right(verdict, views, phantom) < 0).then_some(Flipped::Columns),
            Self::About(pose) => {
                let turn = pose.isometry().rotation.inverse() * verdict.probe_from_image.rotation;
                let turn = turn.to_rotation_matrix();
                let along = |axis: usize| turn[(axis, axis)];
                (turn.angle() > ABOUT_RAD).then(|| match (along(0) > 0.5, along(1) > 0.5) {
                    _ if along(0).abs() < 0.5 || along(1).abs() < 0.5 => Flipped::Turned,
                    (false, true) => Flipped::Columns,
                    (true, false) => Flipped::Rows,
                    _ => Flipped::Both,
                })
            }
        }
    }
}

/// In how many more images of how many Zs the wire listed first is on the right than on the left.
fn first_right(verdict: &Verdict, views: &Views<'_>, phantom: &WirePhantom) -> i64 {
    let agreement = views.agreement(verdict, 0.0);
    let mut sum = 0;
    for (image, chosen) in views.images.iter().zip(&agreement.chosen) {
        let Some(labels) = chosen.and_then(|c| image.labels.get(c)) else { continue };
        for z in &phantom.zs {
            let dot = |wire: usize| labels.dots.get(wire).copied().flatten();
            if let (Some(first), Some(last)) = (dot(z.first), dot(z.last)) {
                sum += if first.at_px[0] > last.at_px[0] { 1 } else { -1 };
            }
        }
    }
    sum
}
