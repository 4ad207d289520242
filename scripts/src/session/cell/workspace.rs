//! `[workspace]`: where the probe may be.

use nalgebra::Vector3;
use probepath_frames::{Base, Direction, Point, Pose, World};
use probepath_robot::{Plane, Workspace};
use serde::{Deserialize, Serialize};

use super::line::{Wrong, within};

/// No plane of a cell is further from the table's mark (mm).
const FURTHEST_MM: f64 = 10_000.0;

/// Where the probe's origin may be, beside staying above the table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorkspaceFile {
    /// A box along the World's axes.
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    pub bounds: Option<BoxFile>,
    /// How far the probe may lean over from looking straight down (degrees); 60 when nothing is said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tilt_deg: Option<f64>,
    /// Planes that it stays on one side of.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub planes: Vec<PlaneFile>,
}

/// A box along the World's axes, by opposite corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxFile {
    /// The corner of the smallest coordinates (mm).
    pub low_mm: [f64; 3],
    /// The corner of the largest (mm).
    pub high_mm: [f64; 3],
}

/// A plane, written in the World.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneFile {
    /// A point on it (mm).
    pub through_mm: [f64; 3],
    /// Its normal, toward the side where the probe may be; its length says nothing.
    pub inward: [f64; 3],
}

/// A point on a plane, and the direction to its inner side.
type Side = (Point<World>, Direction<World>);

impl WorkspaceFile {
    pub(super) fn check(&self) -> Result<(), Wrong> {
        if let Some(tilt_deg) = self.tilt_deg {
            within("workspace.tilt_deg", tilt_deg, (1.0, 90.0), "degrees")?;
        }
        self.planes().map(drop)
    }

    /// With the planes of the file.
    pub(super) fn with(&self, workspace: Workspace, base_from_world: &Pose<Base, World>) -> Workspace {
        // Checked when the file was read.
        self.planes().unwrap_or_default().into_iter().fold(workspace, |workspace, (through, inward)| {
            workspace.and(Plane { through: *base_from_world * through, inward: *base_from_world * inward })
        })
    }

    /// Every plane in the World: the box's sides first.
    fn planes(&self) -> Result<Vec<Side>, Wrong> {
        let mut planes = Vec::new();
        if let Some(bounds) = &self.bounds {
            planes.extend(bounds.sides()?);
        }
        for plane in &self.planes {
            planes.push(plane.plane()?);
        }
        Ok(planes)
    }
}

impl BoxFile {
    fn sides(&self) -> Result<Vec<Side>, Wrong> {
        let (low, high) =
            (point("workspace.box.low_mm", self.low_mm)?, point("workspace.box.high_mm", self.high_mm)?);
        if self.low_mm.iter().zip(&self.high_mm).any(|(low, high)| low >= high) {
            let why = format!(
                "is {:?}, and low_mm {:?}; every coordinate has to be larger",
                self.high_mm, self.low_mm
            );
            return Err(Wrong::new("workspace.box.high_mm", why));
        }
        let axes = [Direction::x(), Direction::y(), Direction::z()];
        Ok(axes.into_iter().flat_map(|inward| [(low, inward), (high, inward.reversed())]).collect())
    }
}

impl PlaneFile {
    fn plane(&self) -> Result<Side, Wrong> {
        let through = point("workspace.planes", self.through_mm)?;
        let inward = Direction::of(Vector3::from(self.inward))
            .map_err(|error| Wrong::new("workspace.planes", format!("has no `inward` direction: {error}")))?;
        Ok((through, inward))
    }
}

fn point(field: &str, mm: [f64; 3]) -> Result<Point<World>, Wrong> {
    for mm in mm {
        within(field, mm, (-FURTHEST_MM, FURTHEST_MM), "mm")?;
    }
    let [x, y, z] = mm.map(|mm| mm / 1e3);
    Ok(Point::new(x, y, z))
}
