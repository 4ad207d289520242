//! The volume of placed images.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::volume::{Layer, Mark, Slice, Volume, VolumeSettings};
use serde::Serialize;

use super::ReconstructError;

/// Voxel size when nothing says another (mm).
pub(super) const VOXEL_MM: f64 = 0.5;

/// A volume that was written.
#[derive(Clone, Debug, Serialize)]
pub struct VolumeMade {
    /// Its file, MHA.
    pub file: PathBuf,
    /// Which voxels were seen (1) or filled (2).
    pub marks: PathBuf,
    /// Voxels along x, y, z.
    pub size: [usize; 3],
    /// Their size (mm).
    pub spacing_mm: [f64; 3],
    /// Voxels that pixels were put into.
    pub seen: usize,
    /// Voxels that were filled.
    pub filled: usize,
    /// Memory it was built in (MB).
    pub memory_mb: f64,
}

/// Builds a volume and writes it into the folder.
pub(super) fn build(
    slices: &[Slice<'_>],
    settings: &VolumeSettings,
    out: &Path,
) -> Result<VolumeMade, ReconstructError> {
    let volume = Volume::build(slices, settings)?;
    let (file, marks) = (out.join("volume.mha"), out.join("volume-marks.mha"));
    volume.write(&file, Layer::Grey)?;
    volume.write(&marks, Layer::Marks)?;
    Ok(VolumeMade {
        file,
        marks,
        size: volume.grid().size,
        spacing_mm: volume.grid().spacing_m.map(|s| s * 1e3),
        seen: volume.count(Mark::Seen),
        filled: volume.count(Mark::Filled),
        memory_mb: settings.memory_bytes(volume.grid()) as f64 / 1e6,
    })
}

impl fmt::Display for VolumeMade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y, z], [sx, sy, sz]) = (self.size, self.spacing_mm);
        writeln!(
            f,
            "volume {x} x {y} x {z} of {sx:.3} x {sy:.3} x {sz:.3} mm, {} voxels seen, {} filled, {:.0} MB to build",
            self.seen, self.filled, self.memory_mb
        )?;
        writeln!(f, "  {} (which voxels were seen or filled: {})", self.file.display(), self.marks.display())
    }
}
