//! A path's file: TOML, versioned, with named systems and units; read with every check.

use std::fs;
use std::path::{Path as FilePath, PathBuf};

use probepath_frames::{Base, Frame, NamedPose, Pose, Probe};
use serde::{Deserialize, Serialize};

use super::{Label, Path, PathPoint, Side, TaughtForce};
use crate::PathError;

/// What every such file begins with.
const FORMAT: &str = "probepath taught path";
/// The version written; a reader refuses others.
const VERSION: u32 = 1;
/// How a path's file is told from others in a folder.
const ENDING: &str = ".path.toml";
/// How far two neighbours' distance may be from the spacing, as a fraction.
const UNIFORM_WITHIN: f64 = 0.02;

/// A file of a folder, and the path in it or what is wrong with it.
pub type Listed = (PathBuf, Result<Path, PathError>);

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    version: u32,
    study: String,
    side: Side,
    date: String,
    written_in: String,
    of: String,
    spacing_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    taught_force: Option<Force>,
    point: Vec<Row>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Force {
    mean_n: f64,
    sd_n: f64,
    least_n: f64,
    most_n: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    translation_m: Vec<f64>,
    rotation_xyzw: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    moved_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turned_deg: Option<f64>,
}

impl Path {
    /// The file's text.
    ///
    /// # Errors
    /// When it cannot be written as TOML, which no path gives.
    pub fn to_text(&self) -> Result<String, PathError> {
        toml::to_string(&document(self))
            .map_err(|why| PathError::Unwritable { file: "path".into(), why: Box::new(why) })
    }

    /// The path of a file's text; `file` names it in messages.
    ///
    /// # Errors
    /// When a field is missing, unknown or of the wrong type; the format, version or a system's name is another;
    /// a number is not finite; a quaternion is not unit; there are fewer than four points; or they are not at the
    /// stated spacing.
    pub fn from_text(text: &str, file: &FilePath) -> Result<Self, PathError> {
        let document: Document = toml::from_str(text)
            .map_err(|why| PathError::Syntax { file: file.into(), why: Box::new(why) })?;
        Reader { file }.path(&document)
    }

    /// Saves it: first beside the file, then renamed, so that an old file survives a full disk.
    ///
    /// # Errors
    /// When the folder or file cannot be written.
    pub fn save(&self, file: &FilePath) -> Result<(), PathError> {
        let failed = |verb| move |why| PathError::Io { file: file.into(), verb, why };
        let mut beside = file.as_os_str().to_owned();
        beside.push(".part");
        fs::write(&beside, self.to_text()?).map_err(failed("write"))?;
        fs::rename(&beside, file).map_err(failed("rename"))
    }

    /// Reads it.
    ///
    /// # Errors
    /// When the file cannot be read, or as [`Path::from_text`].
    pub fn load(file: &FilePath) -> Result<Self, PathError> {
        let text =
            fs::read_to_string(file).map_err(|why| PathError::Io { file: file.into(), verb: "read", why })?;
        Self::from_text(&text, file)
    }

    /// The files of a folder whose names end in `.path.toml`, by name, each read.
    ///
    /// # Errors
    /// When the folder cannot be read; a file that is no path is an error of its own, in the list.
    pub fn list(folder: &FilePath) -> Result<Vec<Listed>, PathError> {
        let failed = |why| PathError::Io { file: folder.into(), verb: "list", why };
        let mut files = Vec::new();
        for entry in fs::read_dir(folder).map_err(failed)? {
            let file = entry.map_err(failed)?.path();
            if file.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING)) {
                files.push(file);
            }
        }
        files.sort();
        Ok(files.into_iter().map(|file| (file.clone(), Self::load(&file))).collect())
    }
}

fn document(path: &Path) -> Document {
    Document {
        format: FORMAT.into(),
        version: VERSION,
        study: path.label.study.clone(),
        side: path.label.side,
        date: path.label.date.clone(),
        written_in: Base::NAME.into(),
        of: Probe::NAME.into(),
        spacing_mm: tidy(path.spacing * 1e3),
        taught_force: path.force.map(|f| Force {
            mean_n: f.mean,
            sd_n: f.sd,
            least_n: f.least,
            most_n: f.most,
        }),
        point: path.points.iter().map(row).collect(),
    }
}

fn row(point: &PathPoint) -> Row {
    let named = NamedPose::from(&point.base_from_probe);
    Row {
        translation_m: named.translation_m.to_vec(),
        rotation_xyzw: named.rotation_xyzw.to_vec(),
        moved_mm: point.moved.map(|(metres, _)| tidy(metres * 1e3)),
        turned_deg: point.moved.map(|(_, radians)| tidy(radians.to_degrees())),
    }
}

/// Without the last digits that a change of unit makes.
fn tidy(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

struct Reader<'a> {
    file: &'a FilePath,
}

impl Reader<'_> {
    fn wrong(&self, field: impl Into<String>, why: impl Into<String>) -> PathError {
        PathError::Field { file: self.file.into(), field: field.into(), why: why.into() }
    }

    fn path(&self, document: &Document) -> Result<Path, PathError> {
        self.head(document)?;
        let points = document.point.iter().enumerate().map(|(i, row)| self.point(document, i, row));
        let points: Vec<PathPoint> = points.collect::<Result<_, _>>()?;
        let spacing = document.spacing_mm * 1e-3;
        self.uniform(spacing, &points)?;
        let Document { study, side, date, .. } = document;
        let label = Label { study: study.clone(), side: *side, date: date.clone() };
        let force = document.taught_force.as_ref().map(|f| self.force(f)).transpose()?;
        Path::new(label, spacing, points, force).map_err(|why| self.wrong("point", why.to_string()))
    }

    fn head(&self, document: &Document) -> Result<(), PathError> {
        if document.format != FORMAT {
            return Err(self.wrong("format", format!("\"{}\" is not \"{FORMAT}\"", document.format)));
        }
        if document.version != VERSION {
            let why =
                format!("version {} is not {VERSION}: use the software that wrote it", document.version);
            return Err(self.wrong("version", why));
        }
        let spacing = document.spacing_mm;
        if !(spacing.is_finite() && spacing > 0.0) {
            return Err(self.wrong("spacing_mm", format!("{spacing} is no length")));
        }
        if document.point.len() < 4 {
            return Err(
                self.wrong("point", format!("{} points make no path: at least 4", document.point.len()))
            );
        }
        Ok(())
    }

    fn point(&self, document: &Document, index: usize, row: &Row) -> Result<PathPoint, PathError> {
        let named = NamedPose {
            written_in: document.written_in.clone(),
            of: document.of.clone(),
            translation_m: self.numbers(index, "translation_m", &row.translation_m)?,
            rotation_xyzw: self.numbers(index, "rotation_xyzw", &row.rotation_xyzw)?,
        };
        let field = || format!("point {index}");
        let base_from_probe: Pose<Base, Probe> =
            named.check().map_err(|why| PathError::Pose { file: self.file.into(), field: field(), why })?;
        let moved = match (row.moved_mm, row.turned_deg) {
            (Some(mm), Some(degrees)) if mm >= 0.0 && degrees >= 0.0 && (mm + degrees).is_finite() => {
                Some((mm * 1e-3, degrees.to_radians()))
            }
            (None, None) => None,
            found => {
                let why =
                    format!("moved_mm and turned_deg are {found:?}: both, not negative, or none of them");
                return Err(self.wrong(field(), why));
            }
        };
        Ok(PathPoint { base_from_probe, moved })
    }

    fn numbers<const N: usize>(
        &self,
        index: usize,
        name: &str,
        found: &[f64],
    ) -> Result<[f64; N], PathError> {
        let wrong =
            |_| self.wrong(format!("point {index}.{name}"), format!("{} numbers, not {N}", found.len()));
        found.try_into().map_err(wrong)
    }

    fn force(&self, force: &Force) -> Result<TaughtForce, PathError> {
        let Force { mean_n: mean, sd_n: sd, least_n: least, most_n: most } = *force;
        if [mean, sd, least, most].iter().any(|x| !x.is_finite()) || sd < 0.0 || least > most {
            return Err(self.wrong("taught_force", "the numbers are not finite or contradict each other"));
        }
        Ok(TaughtForce { mean, sd, least, most })
    }

    /// Neighbours are the stated spacing apart: a missing point, or millimetres for metres, would show here.
    fn uniform(&self, spacing: f64, points: &[PathPoint]) -> Result<(), PathError> {
        for (i, pair) in points.windows(2).enumerate() {
            let apart = pair[0].base_from_probe.distance(&pair[1].base_from_probe).0;
            if (apart - spacing).abs() > UNIFORM_WITHIN * spacing {
                let (apart_mm, spacing_mm) = (apart * 1e3, spacing * 1e3);
                let why = format!(
                    "points {i} and {} are {apart_mm:.4} mm apart, the spacing is {spacing_mm} mm: \
                     is a point missing, or a translation in millimetres?",
                    i + 1
                );
                return Err(self.wrong("point", why));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;

    fn refused(from: &str, to: &str) -> String {
        let text = example().to_text().unwrap();
        assert!(text.contains(from), "{from}");
        let text = text.replacen(from, to, 1);
        Path::from_text(&text, FilePath::new("leg.path.toml")).unwrap_err().to_string()
    }

    #[test]
    fn what_is_written_is_what_is_read() {
        let path = example();
        let text = path.to_text().unwrap();
        let read = Path::from_text(&text, FilePath::new("leg.path.toml")).unwrap();
        assert_eq!(read.to_text().unwrap(), text);
        for (a, b) in path.points().iter().zip(read.points()) {
            assert_eq!(a.base_from_probe, b.base_from_probe);
        }
        assert_eq!((read.label(), read.force(), read.points().len()), (path.label(), path.force(), 201));
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_name_and_the_field() {
        for (from, to, says) in [
            ("written_in = \"Base\"", "written_in = \"World\"", "World_T_Probe"),
            ("spacing_mm", "spacing_m", "spacing_m"),
            ("spacing_mm = 0.5", "spacing_mm = 1.0", "mm apart"),
            ("spacing_mm = 0.5", "spacing_mm = nan", "spacing_mm"),
            ("version = 1", "version = 2", "version"),
            ("taught path", "taught route", "format"),
            ("side = \"left\"", "side = \"middle\"", "middle"),
            ("translation_m = [", "translation_m = [nan, ", "translation_m"),
            ("mean_n = 4.9", "mean_n = inf", "taught_force"),
            ("moved_mm = 0.1", "moved_mm = -0.1", "moved_mm"),
            ("study = \"S-017\"", "", "study"),
        ] {
            let why = refused(from, to);
            assert!(why.starts_with("leg.path.toml: ") && why.contains(says), "{from} -> {to}: {why}");
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_refused_or_is_shorter_and_never_panics() {
        let text = example().to_text().unwrap();
        for cut in (0..text.len()).step_by(97) {
            if let Ok(path) = Path::from_text(&text[..cut], FilePath::new("cut")) {
                assert!(path.points().len() < 201);
            }
        }
    }

    #[test]
    fn a_nan_in_a_point_is_refused_by_its_number() {
        let text = example().to_text().unwrap();
        let row = text.match_indices("translation_m = [").nth(5).unwrap().0;
        let comma = row + text[row..].find(',').unwrap();
        let bad = format!("{}translation_m = [nan{}", &text[..row], &text[comma..]);
        let why = Path::from_text(&bad, FilePath::new("leg")).unwrap_err().to_string();
        assert!(why.contains("point 5") && why.contains("not finite"), "{why}");
    }

    #[test]
    fn a_folder_is_listed_with_what_is_wrong_in_it() {
        let folder = std::env::temp_dir().join(format!("probepath-paths-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        example().save(&folder.join("b.path.toml")).unwrap();
        fs::write(folder.join("a.path.toml"), "nonsense").unwrap();
        fs::write(folder.join("notes.txt"), "nothing").unwrap();
        let found = Path::list(&folder).unwrap();
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(found.len(), 2);
        assert!(found[0].1.is_err() && found[1].1.is_ok());
        assert!(Path::list(&folder).unwrap_err().to_string().contains("list"));
    }
}
