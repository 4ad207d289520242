//! How a volume is built.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use probepath_scripts::offline::{Compounding, VolumeOptions, Weights};

/// The options of `reconstruct --volume`.
#[derive(Args, Debug)]
pub struct VolumeArgs {
    /// Voxel size; 0.5 mm, or what the PLUS device set says.
    #[arg(long, value_name = "MM", requires = "volume")]
    pub voxel_mm: Option<f64>,
    /// Which voxels a pixel goes to.
    #[arg(long, value_enum, requires = "volume")]
    pub weights: Option<WeightsArg>,
    /// What many pixels in one voxel become.
    #[arg(long, value_enum, requires = "volume")]
    pub compounding: Option<CompoundingArg>,
    /// Fill holes between images no further apart than this; 0 leaves all open.
    #[arg(long, value_name = "MM", requires = "volume")]
    pub fill_mm: Option<f64>,
    /// What each part of an image counts: a TOML file with `columns`, `rows` and `weights` (0 to 255).
    #[arg(long, value_name = "FILE", requires = "volume")]
    pub importance: Option<PathBuf>,
    /// Memory the volume may take, beside the images; what is larger is built and written in parts. 2147 MB.
    #[arg(long, value_name = "MB", requires = "volume")]
    pub memory_mb: Option<u64>,
    /// Room on the disk the volume may take; what is larger is refused before it is begun. 8000 MB.
    #[arg(long, value_name = "MB", requires = "volume")]
    pub disk_mb: Option<u64>,
    /// Write the volume as NRRD, not MHA.
    #[arg(long, requires = "volume")]
    pub nrrd: bool,
}

/// Which voxels a pixel goes to.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum WeightsArg {
    /// The nearest.
    Nearest,
    /// The eight around it, by nearness.
    Linear,
}

/// What many pixels in one voxel become.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum CompoundingArg {
    /// Their weighted mean.
    Mean,
    /// The brightest.
    Maximum,
    /// The last.
    Latest,
    /// The middle one by weight.
    Median,
}

impl From<VolumeArgs> for VolumeOptions {
    fn from(args: VolumeArgs) -> Self {
        let weights = |weights| match weights {
            WeightsArg::Nearest => Weights::Nearest,
            WeightsArg::Linear => Weights::Linear,
        };
        let compounding = |compounding| match compounding {
            CompoundingArg::Mean => Compounding::Mean,
            CompoundingArg::Maximum => Compounding::Maximum,
            CompoundingArg::Latest => Compounding::Latest,
            CompoundingArg::Median => Compounding::Median,
        };
        Self {
            voxel_mm: args.voxel_mm,
            weights: args.weights.map(weights),
            compounding: args.compounding.map(compounding),
            fill_mm: args.fill_mm,
            importance: args.importance,
            memory_mb: args.memory_mb,
            disk_mb: args.disk_mb,
            nrrd: args.nrrd,
        }
    }
}
