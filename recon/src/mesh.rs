//! Closed triangle meshes of the lumen, and their files: STL, PLY and VTP, in LPS and millimetres.

mod ply;
mod stl;
mod vtp;

use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Point, World};
use thiserror::Error;

use crate::LumenSurface;

/// Said in the comment or field of every file, where 3D Slicer reads it: x to the patient's left, y posterior,
/// z superior.
const SPACE: &str = "SPACE=LPS";
/// No mesh of a lumen has more points or triangles than this.
const MOST: usize = 50_000_000;

/// Triangles between points, counter-clockwise seen from outside. Metres; the axes are the World's (LPS), or the
/// file's own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The points (m).
    pub points: Vec<Vector3<f64>>,
    /// Three points each.
    pub triangles: Vec<[u32; 3]>,
    /// Numbers of the points, each with its name; PLY and VTP keep them.
    pub scalars: Vec<PointScalars>,
    /// A colour (red, green, blue) for every point, or none at all; PLY keeps them.
    pub colours: Vec<[u8; 3]>,
}

/// A number for every point of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointScalars {
    /// What it is, with its unit: `area_mm2`, `radius_mm`, `error_sd_mm`, `distance_mm`.
    pub name: String,
    /// One for every point, in their order; NaN where nothing is known.
    pub values: Vec<f64>,
}

/// Why a mesh cannot be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The disk said no.
    #[error("{path}: {source}")]
    File {
        /// Which file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The name's end says no format.
    #[error("{path}: a surface's name ends in .stl, .ply or .vtp")]
    Kind {
        /// Which file.
        path: String,
    },
    /// What is inside is not a surface.
    #[error("{path}: not a {format} surface: {why}")]
    Content {
        /// Which file.
        path: String,
        /// Which format was expected.
        format: &'static str,
        /// What is wrong, and where.
        why: String,
    },
    /// It is, but in axes that are not ours.
    #[error("{path} says {says}; convert it to LPS first (x and y change their sign)")]
    Space {
        /// Which file.
        path: String,
        /// What it says.
        says: String,
    },
}

impl Mesh {
    /// Reads a surface in millimetres from STL (text or binary), PLY or VTP, by the name's end.
    ///
    /// # Errors
    /// When it cannot be read, is no surface, or says that its axes are RAS.
    pub fn read(path: &Path) -> Result<Self, MeshError> {
        let name = path.display().to_string();
        let kind = kind(path)?;
        let bytes = std::fs::read(path).map_err(|source| MeshError::File { path: name.clone(), source })?;
        let head =
            String::from_utf8_lossy(bytes.get(..2000.min(bytes.len())).unwrap_or_default()).into_owned();
        if let Some(says) = ["SPACE=RAS", "SPACE=\"RAS\""].iter().find(|says| head.contains(**says)) {
            return Err(MeshError::Space { path: name, says: (*says).into() });
        }
        let content = |why| MeshError::Content { path: name, format: kind.0, why };
        (kind.1)(&bytes).and_then(Self::checked).map_err(content)
    }

    /// Writes it in millimetres, in the format that the name's end says.
    ///
    /// # Errors
    /// When the name says none, or the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), MeshError> {
        let name = path.display().to_string();
        let bytes = match kind(path)?.0 {
            "STL" => stl::bytes(self),
            "PLY" => ply::bytes(self),
            _ => vtp::bytes(self),
        };
        std::fs::write(path, bytes).map_err(|source| MeshError::File { path: name, source })
    }

    /// The bytes of a binary STL (mm, LPS), for where they go into something else than a file.
    pub fn stl_bytes(&self) -> Vec<u8> {
        stl::bytes(self)
    }

    /// Refuses numbers that are not finite and triangles of points that are not there.
    fn checked(self) -> Result<Self, String> {
        if self.points.is_empty() || self.triangles.is_empty() {
            return Err(format!("{} points and {} triangles", self.points.len(), self.triangles.len()));
        }
        if let Some(i) = self.points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(format!("point {i} is not finite"));
        }
        let count = self.points.len();
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&k| k as usize >= count)) {
            return Err(format!("triangle {i} names a point beyond the {count} there are"));
        }
        Ok(self)
    }

    /// The same mesh with one more number for every point. A missing number is NaN, one too many is dropped.
    #[must_use]
    pub fn with_scalars(mut self, name: impl Into<String>, mut values: Vec<f64>) -> Self {
        values.resize(self.points.len(), f64::NAN);
        let name = name.into();
        self.scalars.retain(|scalars| scalars.name != name);
        self.scalars.push(PointScalars { name, values });
        self
    }

    /// The numbers of that name.
    pub fn scalars(&self, name: &str) -> Option<&[f64]> {
        self.scalars.iter().find(|scalars| scalars.name == name).map(|scalars| scalars.values.as_slice())
    }

    /// The same mesh somewhere else.
    #[must_use]
    pub fn moved(&self, by: &Isometry3<f64>) -> Self {
        let points = self.points.iter().map(|p| by.transform_point(&(*p).into()).coords);
        Self { points: points.collect(), ..self.clone() }
    }

    /// The corners of a triangle.
    pub(crate) fn corners(&self, triangle: &[u32; 3]) -> [Vector3<f64>; 3] {
        triangle.map(|k| self.points.get(k as usize).copied().unwrap_or_default())
    }

    /// The volume inside (m3); negative when the triangles face inward.
    pub fn volume_m3(&self) -> f64 {
        let six = |triangle: &[u32; 3]| {
            let [a, b, c] = self.corners(triangle);
            a.dot(&b.cross(&c))
        };
        self.triangles.iter().map(six).sum::<f64>() / 6.0
    }
}

/// Format by the name's end, and how it is read.
type Reader = fn(&[u8]) -> Result<Mesh, String>;

fn kind(path: &Path) -> Result<(&'static str, Reader), MeshError> {
    let end = path.extension().map(|end| end.to_string_lossy().to_lowercase());
    match end.as_deref() {
        Some("stl") => Ok(("STL", stl::read)),
        Some("ply") => Ok(("PLY", ply::read)),
        Some("vtp") => Ok(("VTP", vtp::read)),
        _ => Err(MeshError::Kind { path: path.display().to_string() }),
    }
}

impl LumenSurface {
    /// The surface as a closed mesh: the grid, and a cap at either end.
    pub fn mesh(&self) -> Mesh {
        Mesh::tube(&self.points, (self.along, self.around))
    }
}

impl Mesh {
    /// A closed tube of `along` rings of `around` points each, ring after ring: its points are the grid's, then the
    /// middles of the caps at either end.
    pub fn tube(points: &[Point<World>], (along, around): (usize, usize)) -> Self {
        let mut mesh = Self { points: points.iter().map(Point::vector).collect(), ..Self::default() };
        let rings = around;
        let around = around as u32;
        let at = |row: u32, k: u32| row * around + k % around;
        for row in 1..along as u32 {
            for k in 0..around {
                mesh.triangles.push([at(row - 1, k), at(row - 1, k + 1), at(row, k)]);
                mesh.triangles.push([at(row - 1, k + 1), at(row, k + 1), at(row, k)]);
            }
        }
        let last = along.saturating_sub(1);
        for (row, first) in [(0, true), (last, false)] {
            let ring = points.iter().skip(row * rings).take(rings);
            let centre = ring.map(|p| p.vector()).sum::<Vector3<f64>>() / f64::from(around);
            let hub = mesh.points.len() as u32;
            mesh.points.push(centre);
            for k in 0..around {
                let (a, b) = (at(row as u32, k), at(row as u32, k + 1));
                mesh.triangles.push(if first { [hub, b, a] } else { [hub, a, b] });
            }
        }
        mesh
    }
}

#[cfg(test)]
mod tests;
