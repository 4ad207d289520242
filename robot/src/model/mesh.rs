//! Where a URDF's meshes are on this disk.

use std::path::{Path, PathBuf};

use urdf_rs::{Geometry, Robot};

use super::ModelWarning;

/// A mesh that a link shows, found on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mesh {
    /// The link.
    pub link: String,
    /// The file.
    pub path: PathBuf,
}

/// The visual meshes that are on disk, and a warning for each that is not. `package://name/rest` is looked for as
/// `name/rest`, and as `rest` in a folder called `name`, in every folder above the URDF.
pub(super) fn find(robot: &Robot, source: &str) -> (Vec<Mesh>, Vec<ModelWarning>) {
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    let folder = Path::new(source).parent().unwrap_or_else(|| Path::new(""));
    for link in &robot.links {
        for filename in link.visual.iter().filter_map(|visual| mesh_name(&visual.geometry)) {
            match resolve(filename, folder) {
                Ok(path) => found.push(Mesh { link: link.name.clone(), path }),
                Err(why) => missing.push(ModelWarning::MissingMesh {
                    link: link.name.clone(),
                    mesh: filename.into(),
                    why,
                }),
            }
        }
    }
    (found, missing)
}

fn mesh_name(geometry: &Geometry) -> Option<&str> {
    match geometry {
        Geometry::Mesh { filename, .. } => Some(filename),
        _ => None,
    }
}

fn resolve(filename: &str, folder: &Path) -> Result<PathBuf, String> {
    if let Some(inside) = filename.strip_prefix("package://") {
        return in_package(inside, folder);
    }
    let path = folder.join(filename.strip_prefix("file://").unwrap_or(filename));
    if path.is_file() {
        Ok(path)
    } else {
        Err(format!("is not at {}; the arm is drawn without it", path.display()))
    }
}

fn in_package(inside: &str, folder: &Path) -> Result<PathBuf, String> {
    let (package, rest) = inside.split_once('/').unwrap_or((inside, ""));
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    for above in folder.ancestors() {
        let named_so = above.file_name().is_some_and(|name| name == package);
        let candidates = [above.join(package).join(rest), above.join(rest)];
        if let Some(path) = candidates.into_iter().take(1 + usize::from(named_so)).find(|path| path.is_file())
        {
            return Ok(path);
        }
    }
    Err(format!(
        "is in no folder \"{package}\" at or above {}; the arm is drawn without it",
        folder.display()
    ))
}
