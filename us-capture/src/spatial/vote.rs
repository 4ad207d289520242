//! The choice of labels on which a sequence agrees.
//!
//! One image cannot tell a phantom from its symmetric twins, nor a bold guess from a right one. Every candidate of
//! every image says where the image would be on the probe; the probe has only one image. The candidate whose place
//! explains the most images wins. Lags smear places along the motion, so the first vote is generous along the wires.

use nalgebra::{Isometry3, Point3};
use probepath_frames::{Pose, Probe, Span, World};

use super::look::Looked;
use super::options::Prediction;
use super::{Reason, Seen, SpatialError, SpatialOptions};
use crate::PixelSpacing;
use crate::label::{Labeller, Labels, Refusal};
use crate::shots::Shots;

/// Images whose candidates stand for election.
const ELECTORS: usize = 40;
/// Two planes are the same when their middles are this near across and along the wires (m), and they are turned
/// against each other by less than this (rad).
const SAME: (f64, f64, f64) = (4e-3, 30e-3, 0.25);

/// What one image could be.
struct Ballot {
    shot: usize,
    world_from_probe: Pose<World, Probe>,
    candidates: Vec<Labels>,
}

/// Labels of every image, and where they put the image, for a known place of the phantom.
pub(super) fn agree(
    shots: &Shots,
    looked: &[Looked],
    labeller: &Labeller,
    options: &SpatialOptions,
) -> Result<(Vec<Seen>, Prediction), SpatialError> {
    let spacing = options.spacing.unwrap_or(PixelSpacing { x_m: 1e-4, y_m: 1e-4 });
    let Some(place) = options.place else { return Err(SpatialError::NoAgreement(Refusal::NoDots)) };
    let world_from_phantom = place.pose();
    let mut seen: Vec<Seen> = Vec::new();
    let mut ballots = Vec::new();
    for (index, (shot, looked)) in shots.shots().iter().zip(looked).enumerate() {
        let labels = match looked {
            Ok(dots) => match labeller.candidates(dots, spacing) {
                Ok(c) => {
                    if let Ok(pose) = shots.track().at(shot.stamp) {
                        ballots.push(Ballot { shot: index, world_from_probe: pose, candidates: c.clone() });
                    }
                    Ok(c[0].clone())
                }
                Err(r) => Err(Reason::Labels(r)),
            },
            Err(r) => Err(r.clone()),
        };
        seen.push(Seen {
            number: shot.number,
            dots: looked.as_ref().map_or_else(|_| Vec::new(), Clone::clone),
            labels,
        });
    }
    let every = ballots.len().div_ceil(ELECTORS).max(1);
    let mut best: Option<(f64, Isometry3<f64>)> = None;
    for b in ballots.iter().step_by(every) {
        for c in &b.candidates {
            let h = b.world_from_probe.isometry().inverse()
                * world_from_phantom.isometry()
                * c.phantom_from_image.isometry();
            let votes: f64 = ballots
                .iter()
                .map(|o| {
                    let predicted =
                        world_from_phantom.isometry().inverse() * o.world_from_probe.isometry() * h;
                    o.candidates
                        .iter()
                        .map(|k| {
                            let (off, turned) = off(&predicted, k.phantom_from_image.isometry());
                            if turned < SAME.2 && off < SAME.1 {
                                1.0 - 0.3 * off / SAME.1 - 0.3 * turned / SAME.2
                            } else {
                                0.0
                            }
                        })
                        .fold(0.0, f64::max)
                })
                .sum();
            if best.as_ref().is_none_or(|b| votes > b.0) {
                best = Some((votes, h));
            }
        }
    }
    let Some((_votes, h)) = best else { return Err(SpatialError::NoAgreement(Refusal::NoDots)) };
    for b in &ballots {
        let predicted = world_from_phantom.isometry().inverse() * b.world_from_probe.isometry() * h;
        let near = b.candidates.iter().find(|k| {
            let (o, t) = off(&predicted, k.phantom_from_image.isometry());
            t < SAME.2 && o < SAME.1
        });
        if let Some(k) = near {
            seen[b.shot].labels = Ok(k.clone());
        } else {
            seen[b.shot].labels = Err(Reason::Labels(Refusal::NoDots));
        }
    }
    // FRAMES: the winner's place of the Image in the Probe.
    Ok((seen, Prediction { probe_from_image: Pose::assume(h), world_from_phantom, spacing, lag: Span::ZERO }))
}

fn off(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let p = Point3::new(0.025, 0.025, 0.0);
    ((a * p - b * p).norm(), a.rotation.angle_to(&b.rotation))
}
