//! The volume of placed images.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::volume::{
    Compounding, Holes, Importance, Slice, Swept, Tiles, VolumeSettings, Weights, Written,
};
use serde::Serialize;

use super::ReconstructError;

/// Voxel size when nothing says another (mm).
pub(super) const VOXEL_MM: f64 = 0.5;
/// The most that a volume's files take on the disk when nothing says another (MB, 10^6 bytes): four whole legs at 0.2 mm.
const DISK_MB: u64 = 8_000;

/// How a volume is built, where it is said; the configuration's way, or the usual one, where it is not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeOptions {
    /// Voxel size (mm).
    pub voxel_mm: Option<f64>,
    /// Which voxels a pixel goes to.
    pub weights: Option<Weights>,
    /// What many pixels in one voxel become.
    pub compounding: Option<Compounding>,
    /// Holes between images no further apart than this are filled (mm); 0 leaves all holes open.
    pub fill_mm: Option<f64>,
    /// A table of what each part of an image counts (TOML: `columns`, `rows`, `weights` from 0 to 255).
    pub importance: Option<PathBuf>,
    /// Memory the volume may take while it is built (MB, 10^6 bytes), the images apart; one that needs more is built
    /// and written in parts.
    pub memory_mb: Option<u64>,
    /// Room on the disk its two files may take together (MB, 10^6 bytes).
    pub disk_mb: Option<u64>,
    /// Whether it is written as NRRD; else MHA.
    pub nrrd: bool,
}

impl VolumeOptions {
    /// These settings with what the options say.
    ///
    /// # Errors
    /// When a length is none, or the table of importance cannot be read.
    pub(super) fn over(&self, usual: &VolumeSettings) -> Result<VolumeSettings, ReconstructError> {
        let wrong = |option, found, least| Err(ReconstructError::Length { option, found, least });
        match (self.voxel_mm, self.fill_mm) {
            (Some(voxel), _) if !(voxel.is_finite() && voxel > 0.0) => {
                return wrong("the voxel size (--voxel-mm)", voxel, "more than 0");
            }
            (_, Some(fill)) if !(fill.is_finite() && fill >= 0.0) => {
                return wrong("the distance to fill (--fill-mm)", fill, "0 or more");
            }
            _ => {}
        }
        let mut settings = usual.clone();
        if let Some(voxel_mm) = self.voxel_mm {
            settings.spacing_m = [voxel_mm * 1e-3; 3];
        }
        settings.weights = self.weights.unwrap_or(settings.weights);
        settings.compounding = self.compounding.unwrap_or(settings.compounding);
        if let Some(fill_mm) = self.fill_mm {
            settings.holes = (fill_mm > 0.0).then_some(Holes::Swept(Swept { longest_m: fill_mm * 1e-3 }));
        }
        if let Some(path) = &self.importance {
            settings.importance = Some(importance(path)?);
        }
        settings.most_bytes = self.memory_mb.map_or(settings.most_bytes, |mb| mb.saturating_mul(1_000_000));
        Ok(settings)
    }
}

fn importance(path: &Path) -> Result<Importance, ReconstructError> {
    let bad = |why: String| ReconstructError::Importance { path: path.into(), why };
    let text = std::fs::read_to_string(path).map_err(|error| bad(error.to_string()))?;
    toml::from_str(&text).map_err(|error| bad(error.to_string()))
}

/// A volume that was written.
#[derive(Clone, Debug, Serialize)]
pub struct VolumeMade {
    /// Its file, MHA or NRRD.
    pub file: PathBuf,
    /// Which voxels were seen (1) or filled (2).
    pub marks: PathBuf,
    /// Voxels along x, y, z.
    pub size: [usize; 3],
    /// Their size (mm).
    pub spacing_mm: [f64; 3],
    /// Voxels that pixels were put into.
    pub seen: u64,
    /// Voxels that were filled.
    pub filled: u64,
    /// Parts it was built in, one after the other.
    pub parts: usize,
    /// Memory a part was built in (MB, 10^6 bytes).
    pub memory_mb: f64,
}

/// Builds a volume and writes it into the folder.
pub(super) fn build(
    slices: &[Slice<'_>],
    settings: &VolumeSettings,
    options: &VolumeOptions,
    out: &Path,
) -> Result<VolumeMade, ReconstructError> {
    let tiles = Tiles::new(slices, settings)?;
    let (grid, memory_mb) = (tiles.grid().clone(), tiles.memory_bytes() as f64 / 1e6);
    fits_the_disk(grid.size, options.disk_mb.unwrap_or(DISK_MB))?;
    let ending = if options.nrrd { "nrrd" } else { "mha" };
    let [file, marks] = ["volume", "volume-marks"].map(|name| out.join(name).with_extension(ending));
    let Written { seen, filled, parts } = tiles
        .write(&file, &marks, |_| ())
        .map_err(|source| ReconstructError::Sequence { path: file.clone(), source })?;
    let spacing_mm = grid.spacing_m.map(|s| s * 1e3);
    Ok(VolumeMade { file, marks, size: grid.size, spacing_mm, seen, filled, parts, memory_mb })
}

/// Grey levels and marks are a byte each for every voxel.
fn fits_the_disk(size: [usize; 3], limit_mb: u64) -> Result<(), ReconstructError> {
    let needs_mb = size.iter().fold(2, |bytes: u64, n| bytes.saturating_mul(*n as u64)) / 1_000_000;
    if needs_mb > limit_mb {
        return Err(ReconstructError::VolumeOnDisk { size, needs_mb, limit_mb });
    }
    Ok(())
}

impl fmt::Display for VolumeMade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y, z], [sx, sy, sz]) = (self.size, self.spacing_mm);
        writeln!(
            f,
            "volume {x} x {y} x {z} of {sx:.3} x {sy:.3} x {sz:.3} mm, {} voxels seen, {} filled; built in {} part{} \
             of {:.0} MB",
            self.seen,
            self.filled,
            self.parts,
            if self.parts == 1 { "" } else { "s" },
            self.memory_mb
        )?;
        writeln!(f, "  {} (which voxels were seen or filled: {})", self.file.display(), self.marks.display())
    }
}

#[cfg(test)]
mod tests {
    use probepath_frames::nalgebra::Vector3;
    use probepath_frames::{Point, World};
    use probepath_recon::volume::Volume;
    use probepath_us_capture::PixelMap;

    use super::*;

    /// Four images a millimetre apart along z.
    fn slices(pixels: &[u8]) -> Vec<Slice<'_>> {
        let map = |image: usize| {
            let first = Point::<World>::new(0.0, 0.0, 1e-3 * image as f64);
            PixelMap::new(first, Vector3::x() * 5e-4, Vector3::y() * 5e-4)
        };
        (0..4).map(|image| Slice::new(pixels, 20, map(image))).collect()
    }

    #[test]
    fn options_are_over_what_the_configuration_says_and_parts_make_the_same_volume() {
        let folder = std::env::temp_dir().join(format!("probepath-volume-options-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let table = folder.join("importance.toml");
        std::fs::write(&table, "columns = 2\nrows = 1\nweights = [0, 255]\n").unwrap();
        let pixels: Vec<u8> = (0..300_u32).map(|i| (i * 7 % 251) as u8).collect();
        let slices = slices(&pixels);
        let usual = VolumeSettings::every_mm(VOXEL_MM);
        let options = VolumeOptions {
            voxel_mm: Some(0.25),
            weights: Some(Weights::Nearest),
            compounding: Some(Compounding::Median),
            fill_mm: Some(2.0),
            importance: Some(table.clone()),
            memory_mb: None,
            disk_mb: None,
            nrrd: true,
        };
        let whole = build(&slices, &options.over(&usual).unwrap(), &options, &folder).unwrap();
        let grey = Volume::read(&whole.file, 1 << 30).unwrap();
        assert!(whole.parts == 1 && whole.filled > 0 && (whole.spacing_mm[0] - 0.25).abs() < 1e-12);
        assert_eq!((grey.grid().size, whole.file.extension().unwrap().to_str()), (whole.size, Some("nrrd")));
        // The left half counts nothing.
        assert_eq!(grey.at([2, 4, 0]), Some(0));
        let needs = whole.memory_mb;
        let small = VolumeOptions { memory_mb: Some((needs * 0.7) as u64 + 1), nrrd: false, ..options };
        let parts = build(&slices, &small.over(&usual).unwrap(), &small, &folder).unwrap();
        assert!(parts.memory_mb <= small.memory_mb.unwrap() as f64, "{parts}");
        assert!(Volume::read(&parts.file, 1 << 30).unwrap().grey() == grey.grey());
        std::fs::write(&table, "columns = 2\nrows = 1\n").unwrap();
        let refused = small.over(&usual).unwrap_err();
        assert!(refused.to_string().contains("importance.toml"), "{refused}");
        let none = VolumeOptions { memory_mb: Some(0), ..VolumeOptions::default() };
        assert!(matches!(
            build(&slices, &none.over(&usual).unwrap(), &none, &folder),
            Err(ReconstructError::Volume(_))
        ));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_length_that_is_none_is_refused_by_its_option() {
        let usual = VolumeSettings::every_mm(VOXEL_MM);
        for wrong in [0.0, -0.5, f64::NAN, f64::INFINITY] {
            let options = VolumeOptions { voxel_mm: Some(wrong), ..VolumeOptions::default() };
            let text = options.over(&usual).unwrap_err().to_string();
            assert!(text.contains("--voxel-mm") && text.contains("more than 0"), "{text}");
        }
        for wrong in [-0.1, f64::NAN] {
            let options = VolumeOptions { fill_mm: Some(wrong), ..VolumeOptions::default() };
            assert!(options.over(&usual).unwrap_err().to_string().contains("--fill-mm"));
        }
    }
}
