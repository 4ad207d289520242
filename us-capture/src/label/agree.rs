//! Over a whole sequence: the one choice of wires per image that fits the probe's poses.
//!
//! One image leaves open which of a phantom's symmetric twins it shows; the poses do not: with the right choice
//! `probe_from_image` is the same in every image. A constant lag between images and poses, which is not known yet,
//! smears it along the motion, so a coarse lag is found with it.
//!
//! What no pose can tell is a mirrored image: flipped left to right it is, to the last dot, the image of the same plane
//! from behind, and calibrates as well, with the image's x and z axes reversed. Only what is known of the probe
//! ([`Expect`]) tells them apart. A mirrored *phantom* (one axis of its file reversed) the poses do tell.

mod hand_eye;
mod place;
mod sides;
mod views;

use probepath_frames::{Image, Phantom, Pose, Probe, Span, Stamp, Track, World};

use super::{Labels, Refusal};
use crate::phantom::WirePhantom;
pub use sides::{Expect, Flipped};
use views::Views;

/// One image of a sequence: when it says it was formed, and every choice of wires it allows, the best first.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidates {
    /// The image's stamp.
    pub stamp: Stamp,
    /// What [`Labeller::candidates`](super::Labeller::candidates) found; empty where it refused.
    pub labels: Vec<Labels>,
}

/// What is known before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgreeOptions {
    /// Where the phantom is, within some millimetres and degrees; `None`: anywhere.
    pub world_from_phantom: Option<Pose<World, Phantom>>,
    /// What is known of how the image lies on the probe.
    pub expect: Expect,
    /// The largest lag, either way, that is looked for.
    pub widest_lag: Span,
    /// How far from where the others put it an image's plane may be (m), once the lag is taken off.
    pub gate_m: f64,
    /// The least share of the images with candidates that have to agree.
    pub least_share: f64,
}

impl Default for AgreeOptions {
    fn default() -> Self {
        Self {
            world_from_phantom: None,
            expect: Expect::Anything,
            widest_lag: Span::from_milliseconds(600),
            gate_m: 8e-3,
            least_share: 0.5,
        }
    }
}

/// The consistent choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// For every image, which of its candidates; `None` where none agrees with the others.
    pub chosen: Vec<Option<usize>>,
    /// Where the image is on the probe: a start value for the fit.
    pub probe_from_image: Pose<Probe, Image>,
    /// Where the phantom is: as given, or a start value for the fit.
    pub world_from_phantom: Pose<World, Phantom>,
    /// The lag that lets them agree best, coarsely: an image stamped t belongs to the pose at t + lag.
    pub lag: Span,
    /// Root mean square distance of the chosen images from where the others put them (m).
    pub spread_m: f64,
    /// How much worse the next best choice is: 0 is just as good (a twin that these poses do not tell), 1 is no rival.
    pub margin: f64,
}

impl Agreement {
    /// How many images have a choice.
    pub fn support(&self) -> usize {
        self.chosen.iter().flatten().count()
    }
}

/// A place of the image on the probe and of the phantom in the world, and how well the images agree with it.
#[derive(Clone, Debug)]
struct Verdict {
    probe_from_image: nalgebra::Isometry3<f64>,
    world_from_phantom: nalgebra::Isometry3<f64>,
    lag: Span,
    worth: f64,
    support: usize,
    spread_m: f64,
}

/// The choice of candidates that agrees over the sequence.
///
/// # Errors
/// When there are too few images with candidates, they do not agree with the poses (a wrong phantom, a wrong place of
/// it, a mirrored phantom: each is said), or the image lies on the probe as it cannot ([`Refusal::Mirrored`]).
pub fn agree(
    phantom: &WirePhantom,
    images: &[Candidates],
    track: &Track<World, Probe>,
    options: &AgreeOptions,
) -> Result<Agreement, Refusal> {
    let views = Views::of(phantom, images, track, options);
    let (labelled, needed) = (views.labelled(), 3);
    if labelled < needed {
        return Err(Refusal::TooFewImages { images: images.len(), labelled, needed });
    }
    let verdicts = verdicts(&views, options);
    let verdicts = options.expect.sort_out(verdicts, &views, phantom)?;
    let Some(best) = verdicts.first().filter(|v| views.is_enough(v, options)) else {
        return Err(explain(&views, options, verdicts.first()));
    };
    let rival = verdicts.iter().skip(1).find(|v| views.differ(best, v)).map_or(0.0, |v| v.worth);
    Ok(views.agreement(best, (1.0 - rival / best.worth.max(1e-9)).clamp(0.0, 1.0)))
}

/// Everything worth a look, the best first.
fn verdicts(views: &Views<'_>, options: &AgreeOptions) -> Vec<Verdict> {
    let mut verdicts = match options.world_from_phantom {
        Some(place) => place::verdicts(views, place.isometry()),
        None => hand_eye::verdicts(views),
    };
    verdicts.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    verdicts
}

/// Why the images do not agree: would another place do, or a mirrored phantom?
fn explain(views: &Views<'_>, options: &AgreeOptions, best: Option<&Verdict>) -> Refusal {
    let best_elsewhere = |views: &Views<'_>| {
        let found = hand_eye::verdicts(views);
        found.into_iter().filter(|v| views.is_enough(v, options)).max_by(|a, b| a.worth.total_cmp(&b.worth))
    };
    let elsewhere = best_elsewhere(views);
    let mirrored = best_elsewhere(&views.of_mirrored_phantom());
    let images = views.labelled();
    match (elsewhere, mirrored, options.world_from_phantom) {
        (None, Some(m), _) => {
            Refusal::MirroredPhantom { images, support: m.support, spread_mm: m.spread_m * 1e3 }
        }
        (Some(e), _, Some(place)) => {
            let off = place.isometry().inverse() * e.world_from_phantom;
            let (off_mm, off_deg) = (off.translation.vector.norm() * 1e3, off.rotation.angle().to_degrees());
            Refusal::WrongPlace { images, support: e.support, off_mm, off_deg }
        }
        _ => Refusal::Disagree {
            images,
            support: best.map_or(0, |v| v.support),
            needed: views.needed(options),
            spread_mm: best.map_or(f64::INFINITY, |v| v.spread_m * 1e3),
        },
    }
}
