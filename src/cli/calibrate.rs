//! `calibrate …`: what can be typed.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use probepath_scripts::offline::calibrate::{Fan, PhantomToReference, PixelMm, Place, Region, Scale, Stored};

/// Which calibration.
#[derive(Debug, Subcommand)]
pub enum Calibrate {
    /// Where the image's plane is on the probe, when the image was formed, and how sure that is: from images of a
    /// wire phantom.
    Spatial(Box<Spatial>),
    /// How late the images are against the poses, from a plane that moves in the image.
    Temporal(Temporal),
    /// Whether a stored calibration still holds: pass or fail, by how much.
    Check(Box<Check>),
}

/// The phantom, and how the images of a sequence are to be read.
#[derive(Args, Debug)]
pub struct Subject {
    /// The phantom: probepath's own (.toml), a PLUS configuration (.xml), or the name of one that comes along.
    #[arg(long, value_name = "FILE")]
    pub phantom: String,
    /// The chain of poses, as PLUS names it (`ProbeToReference`, `ProbeToStepperHome`). Otherwise what the PLUS
    /// configuration names; else ProbeToReference; else the only transform of `Probe`.
    #[arg(long, value_name = "NAME")]
    pub poses: Option<String>,
    /// The part of the image that is looked at: first column, first row, columns, rows. Otherwise the clip rectangle
    /// of the PLUS configuration; else the whole image.
    #[arg(long, value_name = "X,Y,W,H")]
    pub region: Option<Region>,
    /// What a curved probe sees of the image: apex (column, row), first and last distance from it (pixels), first and last
    /// angle from straight down (degrees).
    #[arg(long, value_name = "U,V,R1,R2,A1,A2", allow_hyphen_values = true)]
    pub fan: Option<Fan>,
    /// Orientation of files that do not say theirs.
    #[arg(long, value_name = "MF|UF|MN|UN")]
    pub orientation: Option<Stored>,
}

/// `calibrate spatial`
#[derive(Args, Debug)]
pub struct Spatial {
    /// Images of the phantom with the probe's poses (.igs.mha, .igs.mhd, .igs.nrrd).
    pub sequence: PathBuf,
    #[command(flatten)]
    pub subject: Subject,
    /// Another sequence, on which the calibration is measured.
    #[arg(long, value_name = "SEQUENCE")]
    pub validate: Option<PathBuf>,
    /// Folder for a picture of every image: what was seen of it, or why it was refused.
    #[arg(long, value_name = "DIR")]
    pub overlay: Option<PathBuf>,
    /// Where the calibration is stored (.toml).
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The labelled dots of every image, in the document.
    #[arg(long)]
    pub dots: bool,
    /// Where the phantom is in the reference system (mm): a translation x,y,z, or 16 numbers row by row. Otherwise
    /// what the PLUS configuration says.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub phantom_to_reference: Option<PhantomToReference>,
    /// How the phantom's place is taken: `fixed` as given, `prior` as given but corrected a little by the wires,
    /// `unknown` found from the wires alone. `prior` where a place is given, else `unknown`.
    #[arg(long, value_name = "fixed|prior|unknown")]
    pub place: Option<Place>,
    /// Size of a pixel (mm): of a column, and of a row when that differs. Otherwise the approximate spacing of the PLUS
    /// configuration.
    #[arg(long, value_name = "X[,Y]")]
    pub pixel_mm: Option<PixelMm>,
    /// How the size of a pixel is taken: `known` as given, `estimated` along both axes, `water` as given but for the
    /// speed of sound in the water.
    #[arg(long, value_name = "known|estimated|water")]
    pub scale: Option<Scale>,
    /// Temperature of the phantom's water.
    #[arg(long, value_name = "T", default_value_t = 20.0)]
    pub water_celsius: f64,
    /// Where the image is on the probe, about: an earlier calibration (.toml) or a PLUS configuration (.xml). With it a
    /// mirrored image is told from one that is seen from behind.
    #[arg(long, value_name = "FILE")]
    pub nominal: Option<PathBuf>,
    /// Of every N of a PLUS configuration the wire that is listed first is expected on the right of an MF image, as PLUS
    /// has it, and images that show it on the left are refused as mirrored. This takes either.
    #[arg(long)]
    pub any_side: bool,
    /// The lag (s), where it is known: an image stamped t belongs to the pose at t + lag. Estimated otherwise.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub lag_s: Option<f64>,
    /// What lies between grey 0 and 255, as the machine's panel says it: with it the width of the beam is read from the
    /// wires, and stored.
    #[arg(long, value_name = "DB")]
    pub dynamic_range_db: Option<f64>,
}

/// `calibrate temporal`
#[derive(Args, Debug)]
pub struct Temporal {
    /// The images; and the poses too, where one file holds both.
    pub images: PathBuf,
    /// The poses, where they were recorded apart.
    #[arg(value_name = "POSES")]
    pub poses_file: Option<PathBuf>,
    /// The chain of poses, as PLUS names it.
    #[arg(long, value_name = "NAME")]
    pub poses: Option<String>,
    /// Orientation of files that do not say theirs.
    #[arg(long, value_name = "MF|UF|MN|UN")]
    pub orientation: Option<Stored>,
}

/// `calibrate check`
#[derive(Args, Debug)]
pub struct Check {
    /// The stored calibration (.toml).
    pub calibration: PathBuf,
    /// A short scan of the phantom: 20 seconds are enough.
    pub sequence: PathBuf,
    #[command(flatten)]
    pub subject: Subject,
    /// Where the phantom is in the reference system (mm): a translation x,y,z, or 16 numbers row by row.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub phantom_to_reference: Option<PhantomToReference>,
    /// Temperature of the water the phantom stands in. Otherwise the size of the rows is found from the dots.
    #[arg(long, value_name = "T")]
    pub water_celsius: Option<f64>,
}
