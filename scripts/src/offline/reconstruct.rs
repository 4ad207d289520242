//! `probepath reconstruct`: the lumen of an exam or of any tracked sequence, and its volume.

mod clip;
mod error;
mod finder;
mod input;
mod tables;
mod volume;

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use probepath_recon::measures::table::to_csv;
use probepath_recon::{
    ImageLumen, LumenReconstruction, NoLumen, SeedPoint, check_sweep, reconstruct_from, segment,
};
use serde::Serialize;

use crate::progress::Progress;
use crate::report::build::{Ingredients, make};
use crate::report::{Report, StenosisRow};
pub use error::ReconstructError;
use finder::LumenProcess;
pub use finder::{FinderFault, FinderWish};
use input::Input;
pub use volume::{VolumeMade, VolumeOptions};

/// What is to be reconstructed, and from what.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReconstructWish {
    /// An exam (`.mcap`) or a tracked sequence.
    pub input: PathBuf,
    /// Where the pixels are: our own calibration (`.toml`) or a PLUS configuration (`.xml`). An exam holds its own.
    pub calibration: Option<PathBuf>,
    /// Whether a volume is built as well.
    pub volume: bool,
    /// A place in the lumen of the first image: right of its first column and below its first row (mm).
    pub seed_mm: Option<(f64, f64)>,
    /// How, where it is said.
    pub volume_options: VolumeOptions,
    /// A program that finds the lumen in the place of our own finder.
    pub lumen: Option<FinderWish>,
    /// Folder for what is made.
    pub out: PathBuf,
}

/// What was reconstructed.
#[derive(Clone, Debug, Serialize)]
pub struct Reconstructed {
    /// The exam or sequence.
    pub input: PathBuf,
    /// What became of its images.
    pub images: ImagesOf,
    /// The lumen's surface (STL; PLY and VTP beside it); none when only a volume could be made.
    pub surface: Option<PathBuf>,
    /// The centreline (CSV).
    pub centreline: Option<PathBuf>,
    /// The sections normal to it (CSV): place, area, diameters.
    pub sections: Option<PathBuf>,
    /// The narrowings, along the vessel.
    pub stenoses: Vec<StenosisRow>,
    /// What the reader must know.
    pub notes: Vec<String>,
    /// What each stage took.
    pub timing_s: Timing,
    /// The most memory that the process ever held (MB), where the system says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_memory_mb: Option<f64>,
    /// The report.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub report: Option<Report>,
    /// The volume, when one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<VolumeMade>,
}

/// What became of the images.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ImagesOf {
    /// Images in the file.
    pub total: usize,
    /// Those whose contour is in the surface.
    pub used: usize,
    /// The others, by reason: without a place, or without a lumen that can be trusted.
    pub refused: BTreeMap<String, usize>,
}

impl ImagesOf {
    /// Another program's own words in the place of our one reason for them.
    fn say_why(&mut self, declined: Declined) {
        if declined.is_empty() {
            return;
        }
        self.refused.remove(NoLumen::Declined.kind());
        for (why, count) in declined {
            *self.refused.entry(why).or_default() += count;
        }
    }
}

/// What each stage took (s, of the clock on the wall).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Timing {
    /// Reading the file and giving each image its place.
    pub reading: f64,
    /// The lumen in each image.
    pub lumen: f64,
    /// Surface, centreline, sections and stenoses.
    pub surface: f64,
    /// Tables, meshes, pictures and the report's page.
    pub report: f64,
    /// The volume.
    pub volume: f64,
    /// All of it.
    pub total: f64,
    /// What all processors worked for this process, in its whole life, where the system says: what else the computer
    /// did meanwhile is not in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub processors: Option<f64>,
}

/// Reconstructs an exam (`.mcap`) or a tracked sequence.
///
/// Where a volume was asked for, images without a lumen still give one, and a note says why there is no surface.
///
/// # Errors
/// When a file cannot be read or written, nothing says where the pixels are, or nothing can be made of them.
pub fn reconstruct(
    wish: &ReconstructWish,
    progress: &dyn Progress,
) -> Result<Reconstructed, ReconstructError> {
    let folder = |source| ReconstructError::Folder { path: wish.out.clone(), source };
    std::fs::create_dir_all(&wish.out).map_err(folder)?;
    let (begun, mut timing) = (now(), Timing::default());
    progress.at("reading", 0.0);
    let mut input = timed(&mut timing.reading, || read(wish))?;
    input.lumen.seed = wish.seed_mm.map(|place| seed(place, &input)).transpose()?;
    let settings = wish.volume.then(|| wish.volume_options.over(&input.volume)).transpose()?;
    progress.at("looking for the lumen", 0.2);
    let found = lumen(wish, &input, &mut timing);
    let mut made = Reconstructed::of(wish, &input);
    match found {
        Ok((recon, declined)) => {
            progress.at("reporting", 0.7);
            timed(&mut timing.report, || made.write(wish, &input, &recon))?;
            made.images.say_why(declined);
        }
        Err(ReconstructError::Lumen { source, .. }) if wish.volume => {
            made.notes.push(format!("no surface: {source}"));
        }
        Err(other) => return Err(other),
    }
    if let Some(settings) = settings {
        progress.at("building the volume", 0.8);
        let build = || volume::build(&input.slices(), &settings, &wish.volume_options, &wish.out);
        made.volume = Some(timed(&mut timing.volume, build)?);
    }
    timing.total = begun.elapsed().as_secs_f64();
    timing.processors = processors_s();
    made.peak_memory_mb = peak_memory_mb();
    made.timing_s = timing;
    Ok(made)
}

/// A place in the lumen, when it lies in the pictures.
fn seed((x_mm, y_mm): (f64, f64), input: &Input) -> Result<SeedPoint, ReconstructError> {
    if let Some(bscan) = input.images.first().map(|image| &image.bscan) {
        let spacing = bscan.setting.spacing;
        let size_mm = (bscan.width() as f64 * spacing.x_m * 1e3, bscan.height() as f64 * spacing.y_m * 1e3);
        if !((0.0..=size_mm.0).contains(&x_mm) && (0.0..=size_mm.1).contains(&y_mm)) {
            return Err(ReconstructError::Seed { x_mm, y_mm, size_mm });
        }
    }
    Ok(SeedPoint::Millimetres { x_mm, y_mm })
}

/// What the clock on the wall says.
#[allow(clippy::disallowed_methods, reason = "what a stage took is told to people; nothing depends on it")]
fn now() -> Instant {
    Instant::now()
}

/// Does it, and adds what it took.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let begun = now();
    let done = work();
    *seconds += begun.elapsed().as_secs_f64();
    done
}

/// Linux says it in kB ("VmHWM"); elsewhere nobody is asked.
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1e3)
}

/// Linux says it in hundredths of a second, own and system's (proc(5)); elsewhere nobody is asked.
fn processors_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name, in brackets, with whatever in it.
    let mut fields = stat.rsplit(')').next()?.split_whitespace().skip(11);
    let mut hundredths = || fields.next()?.parse::<f64>().ok();
    Some((hundredths()? + hundredths()?) / 100.0)
}

fn read(wish: &ReconstructWish) -> Result<Input, ReconstructError> {
    let calibration = wish.calibration.as_deref();
    if wish.input.extension().is_some_and(|ending| ending == "mcap") {
        Input::of_exam(&wish.input, calibration)
    } else {
        Input::of_sequence(&wish.input, calibration)
    }
}

/// The lumen of the sweep; and where another program found none, its reasons in its own words.
fn lumen(wish: &ReconstructWish, input: &Input, timing: &mut Timing) -> Result<Found, ReconstructError> {
    let wrong = |source| ReconstructError::Lumen { path: wish.input.clone(), source };
    check_sweep(&input.images, &input.lumen).map_err(wrong)?;
    let (lumens, declined) = timed(&mut timing.lumen, || in_each_image(wish, input))?;
    let recon = timed(&mut timing.surface, || reconstruct_from(&input.images, lumens, &input.lumen));
    Ok((recon.map_err(wrong)?, declined))
}

/// What was found, and why another program found none, counted.
type Found = (LumenReconstruction, Declined);
type Declined = BTreeMap<String, usize>;

fn in_each_image(wish: &ReconstructWish, input: &Input) -> Result<(Vec<ImageLumen>, Declined), FinderFault> {
    match &wish.lumen {
        None => Ok((segment(&input.images, &input.lumen), Declined::new())),
        Some(program) => LumenProcess::start(program, input.lumen.dynamic_range_db)?.all(&input.images),
    }
}

impl Reconstructed {
    /// Nothing was made yet.
    fn of(wish: &ReconstructWish, input: &Input) -> Self {
        Self {
            input: wish.input.clone(),
            images: ImagesOf { total: input.total, used: 0, refused: input.refused.clone() },
            surface: None,
            centreline: None,
            sections: None,
            stenoses: Vec::new(),
            notes: input.notes.clone(),
            timing_s: Timing::default(),
            peak_memory_mb: None,
            report: None,
            volume: None,
        }
    }

    /// Tables, surfaces and the report.
    fn write(
        &mut self,
        wish: &ReconstructWish,
        input: &Input,
        recon: &LumenReconstruction,
    ) -> Result<(), ReconstructError> {
        let mut figures = input.figures.clone();
        figures.warnings.extend(self.notes.iter().cloned());
        let from = Ingredients {
            heading: input.heading.clone(),
            figures: &figures,
            recon,
            images: &input.images,
            segments: &input.segments,
            surface_error: None,
            exam: &wish.input,
        };
        let report = make(&from, &wish.out)?;
        self.images.used = recon.counts.images - recon.counts.without_lumen;
        for (why, count) in &recon.counts.reasons {
            *self.images.refused.entry(why.clone()).or_default() += count;
        }
        self.surface = report.surfaces.first().map(PathBuf::from);
        self.centreline = Some(table(&wish.out, "centreline.csv", &tables::centreline(recon))?);
        self.sections = Some(table(&wish.out, "sections.csv", &to_csv(&recon.sections))?);
        self.stenoses.clone_from(&report.stenoses);
        self.report = Some(report);
        Ok(())
    }
}

fn table(folder: &Path, name: &str, text: &str) -> Result<PathBuf, ReconstructError> {
    let path = folder.join(name);
    match std::fs::write(&path, text) {
        Ok(()) => Ok(path),
        Err(source) => Err(ReconstructError::Folder { path, source }),
    }
}

impl fmt::Display for Reconstructed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} images", self.input.display(), self.images.total)?;
        if self.surface.is_some() {
            writeln!(f, "{} show the lumen", self.images.used)?;
        }
        for (why, count) in &self.images.refused {
            writeln!(f, "{count} left out: {why}")?;
        }
        for line in &self.notes {
            writeln!(f, "note: {line}")?;
        }
        if let Some(report) = &self.report {
            write!(f, "{report}")?;
        }
        for path in [&self.centreline, &self.sections].into_iter().flatten() {
            writeln!(f, "  {}", path.display())?;
        }
        if let Some(volume) = &self.volume {
            write!(f, "{volume}")?;
        }
        writeln!(f, "{}", self.timing_s)
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.1} s: reading {:.1}, lumen {:.1}, surface {:.1}, report {:.1}, volume {:.1}",
            self.total, self.reading, self.lumen, self.surface, self.report, self.volume
        )
    }
}
