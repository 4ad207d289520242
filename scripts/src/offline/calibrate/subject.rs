//! The phantom, and what is known of it and of its images: from a phantom file, a PLUS configuration, or a name.

use std::path::Path;

use probepath_frames::{Image, Phantom, Pose, Probe, World};
use probepath_us_capture::PixelSpacing;
use probepath_us_capture::label::Expect;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::plus::PlusConfig;
use probepath_us_capture::sequence::{ChainNames, ReadOptions, Sequence, TransformName};
use probepath_us_capture::shots::Shots;

use super::CalibrateError;
use super::poses::chain;
use super::request::SubjectRequest;
use super::wishes::{PhantomToReference, Region};

/// What is known before an image is looked at.
#[derive(Clone, Debug)]
pub(super) struct Subject {
    pub phantom: WirePhantom,
    /// The chain that the configuration names, with its fixed transforms.
    pub configured: ChainNames,
    pub world_from_phantom: Option<Pose<World, Phantom>>,
    /// Where the configuration has the image on the probe, from an earlier calibration.
    pub probe_from_image: Option<Pose<Probe, Image>>,
    /// What tells a mirrored image from one that is seen from behind.
    pub expect: Expect,
    /// About how large a pixel is.
    pub spacing: Option<PixelSpacing>,
    /// The configuration's clip rectangle.
    pub clip: Option<Region>,
    pub notes: Vec<String>,
}

/// A sequence that was read, and the name of its chain.
pub(super) struct Recording {
    pub shots: Shots,
    pub poses: String,
    /// The part of the images that is looked at.
    pub region: Option<Region>,
    pub notes: Vec<String>,
}

impl Subject {
    /// What `request` says, and what the file of its phantom says beyond that.
    ///
    /// # Errors
    /// When there is no such file or phantom, or it is none.
    pub(super) fn read(request: &SubjectRequest) -> Result<Self, CalibrateError> {
        let path = Path::new(&request.phantom);
        if path.exists() { of_file(path) } else { of_name(&request.phantom) }
    }

    /// The place that is given by hand, else the configuration's.
    ///
    /// # Errors
    /// When what is given is no rigid pose.
    pub(super) fn place(
        &self,
        given: Option<&PhantomToReference>,
    ) -> Result<Option<Pose<World, Phantom>>, CalibrateError> {
        let Some(PhantomToReference(matrix_mm)) = given else { return Ok(self.world_from_phantom) };
        let mut matrix = *matrix_mm;
        matrix.fixed_view_mut::<3, 1>(0, 3).scale_mut(1e-3);
        // The system of the sequence's poses is World, and the matrix takes the phantom's points there.
        let pose =
            Pose::from_matrix(&matrix).map_err(|why| CalibrateError::Place { why: why.to_string() })?;
        Ok(Some(pose))
    }

    /// Reads a sequence with the chain that was asked for.
    ///
    /// # Errors
    /// When it cannot be read, has no such chain, no pictures or no poses, or is smaller than the region.
    pub(super) fn record(&self, path: &Path, request: &SubjectRequest) -> Result<Recording, CalibrateError> {
        let sequence = sequence(path, request.orientation.map(|stored| stored.0))?;
        let names = chain(path, &sequence, &self.configured, request.poses.as_deref())?;
        let shots = Shots::from_sequence(&sequence, &names)
            .map_err(|source| CalibrateError::Shots { path: path.into(), source })?;
        let mut notes: Vec<String> = sequence.notes().iter().map(|note| named(path, note)).collect();
        let region = match (request.region, self.clip) {
            (Some(asked), _) if fits(asked, shots.size()) => Some(asked),
            (Some(asked), _) => return Err(outside(asked, shots.size())),
            (None, Some(clip)) => Some(cut(clip, shots.size(), &mut notes)?),
            (None, None) => None,
        };
        let poses = TransformName::new(&names.probe, &names.reference).to_string();
        Ok(Recording { shots, poses, region, notes })
    }
}

/// A sequence from disk.
///
/// # Errors
/// When it cannot be read.
pub(super) fn sequence(
    path: &Path,
    orientation: Option<probepath_us_capture::sequence::Orientation>,
) -> Result<Sequence, CalibrateError> {
    let options = ReadOptions { assume_orientation: orientation, ..ReadOptions::default() };
    Sequence::read(path, &options).map_err(|source| CalibrateError::Sequence { path: path.into(), source })
}

fn of_name(name: &str) -> Result<Subject, CalibrateError> {
    let shipped = || WirePhantom::shipped_names().map(str::to_owned).collect();
    let phantom = WirePhantom::shipped(name)
        .ok_or_else(|| CalibrateError::NoPhantom { asked: name.into(), shipped: shipped() })?;
    Ok(Subject::of(phantom))
}

fn of_file(path: &Path) -> Result<Subject, CalibrateError> {
    let bad = |source| CalibrateError::Phantom { path: path.into(), source };
    let phantom = WirePhantom::read(path).map_err(bad)?;
    let mut subject = Subject::of(phantom);
    let text = std::fs::read_to_string(path).unwrap_or_default();
    if !text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
        return Ok(subject);
    }
    // PLUS lists the wires of an N from right to left as an MF image shows them, and can label nothing else.
    subject.expect = Expect::FirstWireRight;
    // The phantom may be all that can be read of a configuration: what else it says is then asked for by hand.
    match PlusConfig::parse(&text) {
        Ok(config) => subject.configured(path, &config),
        Err(why) => {
            Ok(Subject { notes: vec![named(path, &format!("only the phantom was read: {why}"))], ..subject })
        }
    }
}

impl Subject {
    fn of(phantom: WirePhantom) -> Self {
        let configured = ChainNames::default();
        Self {
            phantom,
            configured,
            world_from_phantom: None,
            probe_from_image: None,
            expect: Expect::Anything,
            spacing: None,
            clip: None,
            notes: Vec::new(),
        }
    }

    /// What a PLUS configuration says of chain, place, spacing and region.
    fn configured(mut self, path: &Path, config: &PlusConfig) -> Result<Self, CalibrateError> {
        let frames = &config.frames;
        let fixed = config.transforms.iter().filter(|t| t.from != frames.image);
        self.configured = ChainNames {
            probe: frames.probe.clone(),
            reference: frames.reference.clone(),
            fixed: fixed.map(|t| (TransformName::new(&t.from, &t.to), t.matrix_mm)).collect(),
        };
        self.world_from_phantom = config
            .world_from_phantom()
            .map_err(|source| CalibrateError::Plus { path: path.into(), source })?;
        let pixels = config.pixels_in_probe(&frames.image, &frames.probe).ok();
        self.probe_from_image = pixels.map(|pixels| pixels.nearest_rigid().0);
        if let Some(segmentation) = &config.segmentation {
            let metres = |mm: f64| PixelSpacing { x_m: mm / 1e3, y_m: mm / 1e3 };
            self.spacing = segmentation.approximate_spacing_mm.map(metres);
            self.clip = segmentation.clip.map(|clip| Region { origin: clip.origin, size: clip.size });
        }
        Ok(self)
    }
}

fn fits(region: Region, (columns, rows): (usize, usize)) -> bool {
    let Region { origin: [x, y], size: [width, height] } = region;
    let ends =
        |first: usize, count: usize, all: usize| first.checked_add(count).is_some_and(|end| end <= all);
    ends(x, width, columns) && ends(y, height, rows)
}

fn outside(region: Region, (columns, rows): (usize, usize)) -> CalibrateError {
    let Region { origin: [x, y], size: [width, height] } = region;
    CalibrateError::Region { x, y, width, height, columns, rows }
}

/// The part of a configuration's clip rectangle that lies in the image, as PLUS takes it; said where it is less.
fn cut(clip: Region, size: (usize, usize), notes: &mut Vec<String>) -> Result<Region, CalibrateError> {
    if fits(clip, size) {
        return Ok(clip);
    }
    let part =
        |first: usize, count: usize, all: usize| first.saturating_add(count).min(all).checked_sub(first);
    let [x, y] = clip.origin;
    match (part(x, clip.size[0], size.0), part(y, clip.size[1], size.1)) {
        (Some(width), Some(height)) if width > 0 && height > 0 => {
            notes.push(format!("the configuration's clip rectangle leaves the image: {width} x {height} pixels of it are used"));
            Ok(Region { origin: clip.origin, size: [width, height] })
        }
        _ => Err(outside(clip, size)),
    }
}

fn named(path: &Path, note: &impl ToString) -> String {
    let name =
        path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
    format!("{name}: {}", note.to_string())
}
