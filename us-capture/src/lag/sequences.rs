//! The lag from recorded files: images and poses, together or apart.

use std::collections::BTreeMap;

use probepath_frames::{Probe, Span, Stamp, Track, World};
use thiserror::Error;

use super::motion::Motion;
use super::{LagFound, LagOptions, Line, LineOptions, NoLag, NoLine, Sample, find_line, lag_of};
use crate::sequence::{ChainNames, NoChain, Sequence, TransformName};

/// Which of a file's transforms is the probe's pose.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum PoseChoice {
    /// `ProbeToReference` where the file has a way there, else the tracked transform that moves most.
    #[default]
    MostMoving,
    /// By name, `ProbeToTracker`; the way may lead over several tracked transforms.
    Named(String),
}

/// How a lag is found in files.
#[derive(Clone, Debug, PartialEq)]
pub struct TemporalOptions {
    /// What is looked for in the two signals.
    pub lag: LagOptions,
    /// What counts as a line.
    pub line: LineOptions,
    /// Which poses.
    pub poses: PoseChoice,
    /// Poses further apart are not interpolated between.
    pub widest_gap: Span,
}

impl Default for TemporalOptions {
    /// The defaults of both, the most moving pose, gaps of up to 300 ms.
    fn default() -> Self {
        Self {
            lag: LagOptions::default(),
            line: LineOptions::default(),
            poses: PoseChoice::default(),
            widest_gap: Span::from_milliseconds(300),
        }
    }
}

/// A lag from files, and what it was found from.
#[derive(Clone, Debug, PartialEq)]
pub struct Temporal {
    /// The lag.
    pub found: LagFound,
    /// The transform that was taken as the probe's pose.
    pub poses: String,
    /// The column in which the plane's position was taken (px).
    pub column_px: f64,
    /// The plane in every image, in the file's order: number, stamp, line or why there is none.
    pub lines: Vec<(u64, Stamp, Result<Line, NoLine>)>,
    /// Images without a plane, counted by the reason's code.
    pub refused: BTreeMap<&'static str, usize>,
}

/// Files that give no lag.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TemporalError {
    /// No images to look at.
    #[error("the file of the images holds {images} images, none with a picture that may be used and a stamp")]
    NoPictures {
        /// Images in the file.
        images: usize,
    },
    /// Hardly an image shows the plane.
    #[error(
        "the plane was found in {found} of {images} images, {needed} are needed ({reasons}); the first without: {first}"
    )]
    NoPlane {
        /// Images with the plane.
        found: usize,
        /// Images looked at.
        images: usize,
        /// Images needed.
        needed: usize,
        /// Reasons with their counts.
        reasons: String,
        /// Why the first has none.
        first: NoLine,
    },
    /// A name that is none.
    #[error("{name:?} names no transform: write it as the file does, for example ProbeToReference")]
    BadName {
        /// What was asked for.
        name: String,
    },
    /// No way from one system to the other.
    #[error(transparent)]
    NoChain(#[from] NoChain),
    /// No transforms at all.
    #[error("the file of the poses holds no transform with poses that may be used and stamps ({names})")]
    NoPoses {
        /// The transforms it has.
        names: String,
    },
    /// The signals give none.
    #[error(transparent)]
    Lag(#[from] NoLag),
}

/// The lag between the images of one file and the poses of another (or the same), both stamped by one clock.
///
/// What stands still through all images (the face's echo, text, scales) is taken away first. `inside` holds the pixels
/// (column, row) that are looked at.
///
/// # Errors
/// [`TemporalError`]: no pictures, no plane in them, no such poses, or signals that give no lag.
pub fn lag_of_sequences(
    images: &Sequence,
    poses: &Sequence,
    inside: &dyn Fn(usize, usize) -> bool,
    options: &TemporalOptions,
) -> Result<Temporal, TemporalError> {
    let (name, track) = probe_track(poses, options)?;
    let lines = lines_of(images, inside, &options.line)?;
    let mut refused: BTreeMap<&'static str, usize> = BTreeMap::new();
    for no_line in lines.iter().filter_map(|(_, _, line)| line.as_ref().err()) {
        *refused.entry(no_line.code()).or_default() += 1;
    }
    let found: Vec<(Stamp, Line)> =
        lines.iter().filter_map(|(_, s, l)| Some((*s, *l.as_ref().ok()?))).collect();
    let needed = options.lag.fewest_images;
    if let Some(first) = lines.iter().find_map(|(_, _, l)| l.as_ref().err())
        && found.len() < needed
    {
        let reasons: Vec<String> = refused.iter().map(|(code, n)| format!("{code}: {n}")).collect();
        let (found, images, reasons) = (found.len(), lines.len(), reasons.join(", "));
        return Err(TemporalError::NoPlane { found, images, needed, reasons, first: *first });
    }
    let column_px = middle(found.iter().map(|(_, line)| line.column_px).collect());
    let sample = |(stamp, line): &(Stamp, Line)| {
        let (position_px, sd_px) = line.at(column_px);
        Sample { stamp: *stamp, position_px, sd_px }
    };
    let samples: Vec<Sample> = found.iter().map(sample).collect();
    let found = lag_of(&samples, &track, &options.lag)?;
    Ok(Temporal { found, poses: name, column_px, lines, refused })
}

type Lines = Vec<(u64, Stamp, Result<Line, NoLine>)>;

fn lines_of(
    images: &Sequence,
    inside: &dyn Fn(usize, usize) -> bool,
    options: &LineOptions,
) -> Result<Lines, TemporalError> {
    let pictures = || images.images().iter().filter_map(|i| Some((i.number, i.stamp?, i.picture()?)));
    if pictures().next().is_none() {
        return Err(TemporalError::NoPictures { images: images.images().len() });
    }
    let size = (images.width(), images.height());
    let still = still_part(pictures().map(|(_, _, p)| p.as_ref()));
    let line = |pixels: &[u8]| {
        let moving: Vec<u8> = pixels.iter().zip(&still).map(|(p, s)| p.saturating_sub(*s)).collect();
        find_line(&moving, size, inside, options)
    };
    Ok(pictures().map(|(number, stamp, pixels)| (number, stamp, line(pixels))).collect())
}

/// What every image shows, pixel by pixel: the least of all.
fn still_part<'a>(pictures: impl Iterator<Item = &'a [u8]>) -> Vec<u8> {
    pictures
        .map(<[u8]>::to_vec)
        .reduce(|mut least, picture| {
            for (least, pixel) in least.iter_mut().zip(picture) {
                *least = (*least).min(pixel);
            }
            least
        })
        .unwrap_or_default()
}

fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// The name of the probe's transform, and its poses that may be used.
fn probe_track(
    poses: &Sequence,
    options: &TemporalOptions,
) -> Result<(String, Track<World, Probe>), TemporalError> {
    if let PoseChoice::Named(name) = &options.poses {
        let parsed = TransformName::parse(name.strip_suffix("Transform").unwrap_or(name));
        let parsed = parsed.ok_or_else(|| TemporalError::BadName { name: name.clone() })?;
        let track = track_of(poses, &parsed, options.widest_gap)?;
        return match track.samples().is_empty() {
            true => Err(TemporalError::NoPoses { names: parsed.to_string() }),
            false => Ok((parsed.to_string(), track)),
        };
    }
    let usual = ChainNames::default();
    let usual = TransformName::new(usual.probe, usual.reference);
    if let Ok(track) = track_of(poses, &usual, options.widest_gap)
        && !track.samples().is_empty()
    {
        return Ok((usual.to_string(), track));
    }
    most_moving(poses, options.widest_gap)
}

fn most_moving(poses: &Sequence, widest_gap: Span) -> Result<(String, Track<World, Probe>), TemporalError> {
    let mut names: Vec<&TransformName> = poses.images().iter().flat_map(|i| i.transforms.keys()).collect();
    names.sort();
    names.dedup();
    let mut best: Option<(f64, String, Track<World, Probe>)> = None;
    for name in &names {
        let track = track_of(poses, name, widest_gap)?;
        let Some((first, _)) = track.span() else { continue };
        let moved = Motion::of(&track, first, (0.0, f64::INFINITY), 1).map_or(0.0, |m| m.size_m);
        if best.as_ref().is_none_or(|(most, _, _)| moved > *most) {
            best = Some((moved, name.to_string(), track));
        }
    }
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    let names = if names.is_empty() { "it has none".to_owned() } else { names.join(", ") };
    best.map(|(_, name, track)| (name, track)).ok_or(TemporalError::NoPoses { names })
}

/// The poses of one transform by their stamps. Repeated stamps and steps back are left out: of two poses for one
/// instant nobody knows the right one.
fn track_of(
    poses: &Sequence,
    name: &TransformName,
    widest_gap: Span,
) -> Result<Track<World, Probe>, NoChain> {
    let chain = ChainNames { probe: name.from.clone(), reference: name.to.clone(), ..ChainNames::default() };
    let mut track = Track::new(widest_gap);
    for (image, pose) in poses.images().iter().zip(poses.probe_poses(&chain)?) {
        if let (Some(stamp), Ok(pose)) = (image.stamp, pose) {
            let _step_back = track.push(stamp, pose);
        }
    }
    Ok(track)
}

#[cfg(test)]
mod tests;
